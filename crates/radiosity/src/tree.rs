//! A tree of boxes over the surfaces, for scenes of more than a handful: obvhs builds it, we walk it.

use std::time::Duration;

use glam::{DVec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::builder::build_bvh2;

use crate::spec::SceneSpec;
use crate::trace::{Facets, Hit, Index, Ray};

/// A box that holds a child, and where the child is.
#[derive(Clone, Copy, Debug)]
struct Node {
    min: [f32; 3],
    max: [f32; 3],
    /// Inner node: the first of two children. Leaf: the first entry of `order`.
    first: u32,
    /// 0 for an inner node, else the number of surfaces.
    count: u32,
}

/// A binary tree of conservative boxes.
#[derive(Clone, Debug)]
pub(crate) struct Tree {
    nodes: Vec<Node>,
    order: Vec<u32>,
}

/// How much farther than the best hit a box may begin and still be opened. The rounding errors of t (in a
/// facet) and of the slab test are each a few 2⁻⁵²; culling with this slack keeps both out of the answer.
const CULL_SLACK: f64 = 1.0 + 1.0 / (1_u64 << 40) as f64;

impl Tree {
    /// A tree over the surfaces of a scene whose coordinates become relative to `origin`. Boxes are grown by
    /// `margin` [m], which must exceed the slack of the facets and the rounding of their hit points.
    pub(crate) fn new(spec: &SceneSpec, origin: DVec3, margin: f64) -> Self {
        let boxes: Vec<Aabb> = spec
            .surfaces
            .iter()
            .map(|surface| {
                let corners = surface.shape.corners();
                let min = corners.iter().fold(DVec3::INFINITY, |m, c| m.min(*c - origin));
                let max = corners.iter().fold(DVec3::NEG_INFINITY, |m, c| m.max(*c - origin));
                Aabb::new(round_down(min - margin), round_up(max + margin))
            })
            .collect();
        let built = build_bvh2(&boxes, BvhBuildParams::medium_build(), &mut Duration::default());
        let nodes = built
            .nodes
            .iter()
            .map(|node| Node {
                min: node.aabb.min.to_array(),
                max: node.aabb.max.to_array(),
                first: node.first_index,
                count: node.prim_count,
            })
            .collect();
        Tree { nodes, order: built.primitive_indices }
    }
}

fn round_down(v: DVec3) -> Vec3A {
    Vec3A::from_array(v.to_array().map(|x| (x as f32).next_down()))
}

fn round_up(v: DVec3) -> Vec3A {
    Vec3A::from_array(v.to_array().map(|x| (x as f32).next_up()))
}

impl Node {
    /// The ray parameter at which the ray enters the box; infinite where it misses it.
    #[inline(always)]
    fn entry(&self, origin: [f64; 3], inverse: [f64; 3]) -> f64 {
        let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
        for axis in 0..3 {
            let t0 = (f64::from(self.min[axis]) - origin[axis]) * inverse[axis];
            let t1 = (f64::from(self.max[axis]) - origin[axis]) * inverse[axis];
            enter = enter.max(t0.min(t1));
            leave = leave.min(t0.max(t1));
        }
        if enter <= leave * CULL_SLACK { enter } else { f64::INFINITY }
    }
}

impl Index for Tree {
    fn closest_hit(&self, facets: &Facets, ray: &Ray, stack: &mut Vec<(f64, u32)>) -> Option<Hit> {
        let origin = ray.origin.to_array();
        let inverse = ray.direction.to_array().map(|d| 1.0 / d);
        let mut best: Option<Hit> = None;
        stack.clear();
        stack.push((0.0, 0));
        while let Some((enter, index)) = stack.pop() {
            let far = best.map_or(f64::INFINITY, |hit| hit.t * CULL_SLACK);
            if enter > far {
                continue;
            }
            let node = &self.nodes[index as usize];
            if node.count > 0 {
                for &surface in &self.order[node.first as usize..(node.first + node.count) as usize] {
                    facets.meet(surface, ray, &mut best);
                }
                continue;
            }
            let [a, b] = [node.first, node.first + 1];
            let enter_a = self.nodes[a as usize].entry(origin, inverse);
            let enter_b = self.nodes[b as usize].entry(origin, inverse);
            let (near, other) =
                if enter_a <= enter_b { ((enter_a, a), (enter_b, b)) } else { ((enter_b, b), (enter_a, a)) };
            for child in [other, near] {
                if child.0 <= far && child.0 < f64::INFINITY {
                    stack.push(child);
                }
            }
        }
        best
    }
}
