//! Distances from points to surfaces, through a tree of boxes.

use std::ops::Range;

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

    /// The nearest point of another surface than `own`, at most `distances.end` away; of equally near ones that of the least
    /// surface. One within `distances.start` ends the search, even if another is nearer.
    pub(crate) fn nearest(&self, point: DVec3, own: u32, distances: Range<f64>) -> Option<NearPoint> {
        let away = |node: usize| {
            let BoxNode { min, max, .. } = self.nodes[node];
            point.clamp(min, max).distance(point)
        };
        let (mut best, mut within): (Option<NearPoint>, f64) = (None, distances.end);
        let mut waiting = vec![(0, away(0))];
        while let Some((number, distance)) = waiting.pop() {
            // What is found shrinks the search, but not so far that rounding hides an equally near one.
            if distance > within * (1.0 + 8.0 * f64::EPSILON) {
                continue;
            }
            let node = &self.nodes[number];
            if let Some(second) = node.second {
                let mut children = [number + 1, second].map(|child| (child, away(child)));
                // The nearer child is on top of the stack.
                children.sort_by(|a, b| b.1.total_cmp(&a.1));
                waiting.extend(children);
                continue;
            }
            for &(ref triangle, surface) in &self.triangles[node.start..node.end] {
                let found = nearest(triangle, point);
                let near = NearPoint { surface, point: found, distance: found.distance(point) };
                let is_better =
                    best.is_none_or(|best| (near.distance, near.surface) < (best.distance, best.surface));
                if surface != own && near.distance <= within && is_better {
                    (best, within) = (Some(near), near.distance);
                }
            }
            if within <= distances.start {
                break;
            }
        }
        best
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

#[cfg(test)]
mod tests {
    use super::*;
    use radiosity::SurfaceSpec;

    /// Sheets in a row across x, at the places 0, 1, 2, …
    fn row(count: u32) -> Nearby {
        let sheet = |x: u32| {
            let corner = DVec3::X * f64::from(x);
            let (corner_u, corner_v) = (corner + DVec3::Y, corner + DVec3::Z);
            SurfaceSpec::new(Shape::Parallelogram { corner, corner_u, corner_v, cells: [1, 1] }, 0.5)
        };
        Nearby::new(&SceneSpec::new((0..count).map(sheet).collect()))
    }

    #[test]
    fn the_nearest_other_surface_is_found() {
        let nearby = row(100);
        let nearest = |x: f64, own: u32, distances| {
            let near = nearby.nearest(DVec3::new(x, 0.25, 0.25), own, distances)?;
            Some((near.surface, (1e9 * near.distance).round() / 1e9))
        };
        assert_eq!(nearest(31.4, 7, 0.0..1000.0), Some((31, 0.4)));
        assert_eq!(nearest(31.4, 31, 0.0..1000.0), Some((32, 0.6)));
        assert_eq!(nearest(31.5, 7, 0.0..1000.0), Some((31, 0.5)), "of equally near ones the first");
        assert_eq!(nearest(31.4, 31, 0.0..0.5), None);
        // A search that may end at once is content with less than the nearest.
        assert!(nearest(31.4, 7, 1000.0..1000.0).is_some_and(|(_, distance)| distance < 1000.0));
    }
}
