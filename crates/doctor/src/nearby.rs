//! Distances from points to surfaces, through a tree of boxes.

use glam::DVec3;
use radiosity::{SceneSpec, Shape};

/// The most surfaces in a leaf.
const LEAF: usize = 4;

/// The triangles of every surface in a binary tree of boxes.
pub(crate) struct Nearby {
    triangles: Vec<([DVec3; 3], u32)>,
    nodes: Vec<BoxNode>,
}

struct BoxNode {
    min: DVec3,
    max: DVec3,
    /// The first of the triangles below the node.
    start: usize,
    end: usize,
    /// The second child; the first follows its parent. `None` for a leaf.
    second: Option<usize>,
}

/// A point of a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NearPoint {
    pub(crate) surface: u32,
    pub(crate) point: DVec3,
    /// The distance from the point that was asked about [m].
    pub(crate) distance: f64,
}

impl Nearby {
    pub(crate) fn new(spec: &SceneSpec) -> Self {
        let triangles = spec.surfaces.iter().zip(0..).flat_map(|(surface, number)| {
            triangles(&surface.shape).into_iter().map(move |triangle| (triangle, number))
        });
        let mut nearby = Nearby { triangles: triangles.collect(), nodes: Vec::new() };
        nearby.build(0, nearby.triangles.len());
        nearby
    }

    /// Builds the node over a range of triangles, split in the middle of their longest extent.
    fn build(&mut self, start: usize, end: usize) {
        let corners = || self.triangles[start..end].iter().flat_map(|(triangle, _)| triangle);
        let min = corners().fold(DVec3::INFINITY, |min, corner| min.min(*corner));
        let max = corners().fold(DVec3::NEG_INFINITY, |max, corner| max.max(*corner));
        let number = self.nodes.len();
        self.nodes.push(BoxNode { min, max, start, end, second: None });
        if end - start <= LEAF {
            return;
        }
        let extent = (max - min).to_array();
        let axis = (0..3).max_by(|&a, &b| extent[a].total_cmp(&extent[b])).expect("three axes");
        let middle = (start + end) / 2;
        let centre = |triangle: &[DVec3; 3]| triangle.iter().map(|corner| corner[axis]).sum::<f64>();
        self.triangles[start..end]
            .select_nth_unstable_by(middle - start, |(a, _), (b, _)| centre(a).total_cmp(&centre(b)));
        self.build(start, middle);
        self.nodes[number].second = Some(self.nodes.len());
        self.build(middle, end);
    }

    /// Calls back for every triangle of a surface within a distance of a point.
    pub(crate) fn within(&self, point: DVec3, distance: f64, mut found: impl FnMut(NearPoint)) {
        let mut waiting = vec![0];
        while let Some(number) = waiting.pop() {
            let node = &self.nodes[number];
            if point.clamp(node.min, node.max).distance_squared(point) > distance * distance {
                continue;
            }
            match node.second {
                Some(second) => waiting.extend([number + 1, second]),
                None => {
                    for (triangle, surface) in &self.triangles[node.start..node.end] {
                        let nearest = nearest(triangle, point);
                        let away = nearest.distance(point);
                        if away <= distance {
                            found(NearPoint { surface: *surface, point: nearest, distance: away });
                        }
                    }
                }
            }
        }
    }
}

/// The triangles that a shape consists of.
pub(crate) fn triangles(shape: &Shape) -> Vec<[DVec3; 3]> {
    match *shape {
        Shape::Triangle { a, b, c, .. } => vec![[a, b, c]],
        Shape::Parallelogram { corner, corner_u, corner_v, .. }
        | Shape::Divided { corner, corner_u, corner_v, .. } => {
            let far = corner_u + (corner_v - corner);
            vec![[corner, corner_u, far], [corner, far, corner_v]]
        }
    }
}

/// The point of a triangle nearest to a point: Ericson, *Real-Time Collision Detection* (2005), section 5.1.5.
fn nearest([a, b, c]: &[DVec3; 3], p: DVec3) -> DVec3 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return *a;
    }
    let (d3, d4) = (ab.dot(p - b), ac.dot(p - b));
    if d3 >= 0.0 && d4 <= d3 {
        return *b;
    }
    let (d5, d6) = (ab.dot(p - c), ac.dot(p - c));
    if d6 >= 0.0 && d5 <= d6 {
        return *c;
    }
    let (va, vb, vc) = (d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2);
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let scale = 1.0 / (va + vb + vc);
    a + ab * (vb * scale) + ac * (vc * scale)
}
