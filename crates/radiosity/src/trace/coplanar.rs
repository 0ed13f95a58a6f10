//! Surfaces that coincide: overlapping ones in one plane.
//!
//! They are taken as layers with infinitely thin gaps between them, in one order along the normal of the plane. A ray
//! that arrives meets the first layer on its way; a ray that leaves a layer meets only layers in front of it there. Light
//! never passes a layer, and what is seen from A sees A: all exchanges are those of the scene with thin gaps, and
//! reciprocal as these are. (Two rules that contradict each other, such as the least number on arrival and the twin at
//! t = 0 on departure, trap light between twins, and each method finds another wrong answer.)

use std::sync::Mutex;

use glam::{DVec2, DVec3};

use super::stack::Stack;
use super::tree::BinaryTree;
use crate::executor::ParallelFor;
use crate::geometry::spec::{Corners, Sides};
use crate::geometry::surface::Surface;

/// Corners this many slacks from a plane count as in it: the roundings of a corner that was meant to lie there are below
/// a slack, and a start within a slack of a plane counts as on it (see [`crate::trace::meet`]).
const IN_PLANE: f64 = 2.0;

/// Outlines that reach this many slacks into each other overlap: facets are a slack larger than their surfaces, so that
/// neighbours that share an edge reach two slacks into each other.
const OVERLAP: f64 = 4.0;

/// Two surfaces of a stack that overlap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overlap {
    /// The one that is nearer to the side that the stack's normal points to.
    pub upper: u32,
    /// The one that is farther from that side.
    pub lower: u32,
    /// The area that they have in common [m²].
    pub area: f64,
}

impl Overlap {
    /// A point in the middle of what the two have in common [m, of the scene].
    pub fn middle(&self, surfaces: &[Surface]) -> DVec3 {
        let [upper, lower] =
            [self.upper, self.lower].map(|surface| Outline::new(&surfaces[surface as usize]));
        let (x, y) = upper.normal.any_orthonormal_pair();
        let part = common_part(&upper.flat([x, y]), &lower.flat([x, y]));
        let middle = part.iter().sum::<DVec2>() / part.len().max(1) as f64;
        x * middle.x + y * middle.y + upper.normal * upper.offset()
    }
}

impl Stack {
    /// Every two surfaces of the stack that overlap, given the surfaces of the scene.
    pub fn overlaps(&self, surfaces: &[Surface]) -> Vec<Overlap> {
        let (x, y) = self.normal.any_orthonormal_pair();
        let flat = |&surface: &u32| Outline::new(&surfaces[surface as usize]).flat([x, y]);
        let outlines: Vec<Vec<DVec2>> = self.surfaces.iter().map(flat).collect();
        let mut overlaps = Vec::new();
        for (i, &upper) in self.surfaces.iter().enumerate() {
            for (j, &lower) in self.surfaces.iter().enumerate().skip(i + 1) {
                let area = signed_area(&common_part(&outlines[i], &outlines[j])).abs();
                // Neighbours that share an edge overlap by rounding.
                let smaller = signed_area(&outlines[i]).abs().min(signed_area(&outlines[j]).abs());
                if area > 1e-9 * smaller {
                    overlaps.push(Overlap { upper, lower, area });
                }
            }
        }
        overlaps
    }
}

/// What two convex polygons have in common (I. E. Sutherland & G. W. Hodgman, *Reentrant polygon clipping*,
/// CACM 17 (1974)).
fn common_part(p: &[DVec2], q: &[DVec2]) -> Vec<DVec2> {
    let mut part = q.to_vec();
    let turn = signed_area(p).signum();
    for (&from, &to) in p.iter().zip(p.iter().cycle().skip(1)) {
        let height = |point: DVec2| turn * (to - from).perp_dot(point - from);
        let corners = std::mem::take(&mut part);
        for (&a, &b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
            let (h_a, h_b) = (height(a), height(b));
            if h_a >= 0.0 {
                part.push(a);
            }
            if (h_a > 0.0 && h_b < 0.0) || (h_a < 0.0 && h_b > 0.0) {
                part.push(a + (b - a) * (h_a / (h_a - h_b)));
            }
        }
    }
    part
}

/// Positive where the corners run counterclockwise.
fn signed_area(polygon: &[DVec2]) -> f64 {
    let edges = polygon.iter().zip(polygon.iter().cycle().skip(1));
    0.5 * edges.map(|(a, b)| a.perp_dot(*b)).sum::<f64>()
}

/// What is asked of surfaces here.
#[derive(Clone)]
struct Outline {
    corners: Corners,
    normal: DVec3,
    area: f64,
}

impl Outline {
    fn new(surface: &Surface) -> Self {
        let [edge_u, edge_v] = surface.edges();
        let mut corners = surface.outline();
        if let [_, _, third, fourth] = &mut corners[..] {
            std::mem::swap(third, fourth);
        }
        Outline { corners, normal: surface.normal(), area: edge_u.cross(edge_v).length() }
    }

    fn offset(&self) -> f64 {
        self.normal.dot(self.corners[0])
    }

    /// Whether all corners of `other` lie in the plane of this outline.
    fn holds(&self, other: &Outline, slack: f64) -> bool {
        let offset = self.offset();
        other.corners.iter().all(|corner| (self.normal.dot(*corner) - offset).abs() <= IN_PLANE * slack)
    }

    /// The corners in the plane of `normal`, counterclockwise as seen from this outline's front.
    fn flat(&self, [x, y]: [DVec3; 2]) -> Vec<DVec2> {
        self.corners.iter().map(|corner| DVec2::new(x.dot(*corner), y.dot(*corner))).collect()
    }
}

/// Whether the larger of two surfaces holds the other in its plane, and their outlines overlap. Of two of the same area the first counts as the larger:
/// that is the one with the lower number.
fn coincide(a: &Outline, b: &Outline, slack: f64) -> bool {
    let (large, small) = if a.area >= b.area { (a, b) } else { (b, a) };
    large.holds(small, slack) && {
        let (x, y) = large.normal.any_orthonormal_pair();
        let [p, q] = [large, small].map(|outline| outline.flat([x, y]));
        !is_apart(&p, &q, OVERLAP * slack) && !is_apart(&q, &p, OVERLAP * slack)
    }
}

/// Whether an edge of convex polygon `p` has all of `q` on its outer side, but for a strip as wide as `margin`.
fn is_apart(p: &[DVec2], q: &[DVec2], margin: f64) -> bool {
    let middle = p.iter().sum::<DVec2>() / p.len() as f64;
    let edges = p.iter().zip(p.iter().cycle().skip(1));
    edges.clone().any(|(&from, &to)| {
        let across = (to - from).perp().normalize_or_zero();
        let inwards = if across.dot(middle - from) < 0.0 { -across } else { across };
        q.iter().all(|corner| inwards.dot(*corner - from) < margin)
    })
}

/// Which surfaces belong together.
struct CoplanarSets(Vec<u32>);

impl CoplanarSets {
    fn new(count: usize) -> Self {
        CoplanarSets((0..count as u32).collect())
    }

    /// The least member of a group.
    fn first_of(&mut self, mut member: u32) -> u32 {
        while self.0[member as usize] != member {
            // Halves the way for those who come later.
            let above = self.0[self.0[member as usize] as usize];
            self.0[member as usize] = above;
            member = above;
        }
        member
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.first_of(a), self.first_of(b));
        self.0[a.max(b) as usize] = a.min(b);
    }

    /// The groups of more than one.
    fn several(mut self) -> Vec<Vec<u32>> {
        let count = self.0.len() as u32;
        let mut joined: Vec<(u32, u32)> = Vec::new();
        for member in 0..count {
            let first = self.first_of(member);
            if first != member {
                joined.extend([(first, first), (first, member)]);
            }
        }
        joined.sort_unstable();
        joined.dedup();
        let members = |group: &[(u32, u32)]| group.iter().map(|&(_, member)| member).collect();
        joined.chunk_by(|a, b| a.0 == b.0).map(members).collect()
    }
}

/// The stacks of a scene, by their least surface. Without a tree over the surfaces every pair is looked at.
pub(crate) fn stacks(
    surfaces: &[Surface],
    slack: f64,
    tree: Option<&BinaryTree>,
    executor: &ParallelFor,
) -> Vec<Stack> {
    let groups = Mutex::new(CoplanarSets::new(surfaces.len()));
    let join = |i: u32, j: u32| groups.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).join(i, j);
    match tree {
        Some(tree) => tree.each_pair(executor, |i, j| {
            let [one, other] = [i, j].map(|number| Outline::new(&surfaces[number as usize]));
            if coincide(&one, &other, slack) {
                join(i, j);
            }
        }),
        None => {
            let outlines: Vec<Outline> = surfaces.iter().map(Outline::new).collect();
            for (number, one) in (0..).zip(&outlines) {
                let others = (0..number).zip(&outlines);
                let twins = others.filter(|(_, other)| coincide(other, one, slack));
                twins.for_each(|(other, _)| join(other, number));
            }
        }
    }
    let groups = groups.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner());
    let mut stacks = Vec::new();
    for group in groups.several() {
        stack_up(group, surfaces, slack, &mut stacks);
    }
    stacks.sort_by_key(|stack: &Stack| stack.surfaces.iter().copied().min());
    stacks
}

/// Makes a stack of the surfaces of a group that lie in the plane of its largest, and further ones of the others: along a
/// chain of surfaces, each in the plane of the next, planes can drift apart.
fn stack_up(group: Vec<u32>, surfaces: &[Surface], slack: f64, stacks: &mut Vec<Stack>) {
    let outlined = |member: u32| (member, Outline::new(&surfaces[member as usize]));
    let mut group: Vec<(u32, Outline)> = group.into_iter().map(outlined).collect();
    while group.len() > 1 {
        let by_area = |(a, of_a): &&(u32, Outline), (b, of_b): &&(u32, Outline)| {
            of_a.area.total_cmp(&of_b.area).then(b.cmp(a))
        };
        let (largest, plane) = group.iter().max_by(by_area).expect("not empty").clone();
        // The corners of a sliver may be off the plane that its edges give it.
        let (layers, others): (Vec<_>, Vec<_>) = group
            .into_iter()
            .partition(|(member, outline)| *member == largest || plane.holds(outline, slack));
        if layers.len() > 1 {
            let layers = layers.into_iter().map(|(member, _)| member).collect();
            stacks.push(stack(layers, surfaces, &plane));
        }
        group = others;
    }
}

/// The layers of surfaces in one plane: outermost the fronts of one-sided ones, so that nothing ends on a back because
/// of a twin, two-sided ones between; by number where nothing else decides.
fn stack(mut layers: Vec<u32>, surfaces: &[Surface], plane: &Outline) -> Stack {
    let first = layers.iter().copied().min().expect("not empty");
    let same_way = plane.normal.dot(surfaces[first as usize].normal()) > 0.0;
    let sign = if same_way { 1.0 } else { -1.0 };
    let normal = plane.normal * sign;
    layers.sort_by_key(|&number| {
        let surface = &surfaces[number as usize];
        match (surface.sides(), surface.normal().dot(normal) > 0.0) {
            (Sides::Front, true) => (0, i64::from(number)),
            (Sides::Both, _) => (1, i64::from(number)),
            (Sides::Front, false) => (2, -i64::from(number)),
        }
    });
    Stack { normal, surfaces: layers, offset: plane.offset() * sign }
}
