//! A binary tree over the boxes of facets, as obvhs builds it.

use std::time::Duration;

use glam::{DVec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;

use crate::executor::{ParallelFor, collect};
use crate::geometry::surface::Surface;

/// A binary tree over boxes that hold facets, and these boxes.
pub(crate) struct BinaryTree {
    pub(super) boxes: Vec<Aabb>,
    pub(super) tree: Bvh2,
    /// Tree coordinates are scene coordinates times this, a power of two.
    pub(super) scale: f64,
}

/// How much is done for a tree that rays go through fast.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Effort {
    /// No more than there must be.
    Least,
    /// As much as many rays repay.
    Full,
}

/// A search for pairs of surfaces has a job for this many surfaces, and more where the tree splits so.
const PER_SEARCH: usize = 1 << 12;

impl BinaryTree {
    /// A tree over surfaces whose facets are larger by `slack`.
    pub(crate) fn new(surfaces: &[Surface], slack: f64, effort: Effort, executor: &ParallelFor) -> Self {
        let boxes = collect(executor, surfaces.len(), |i| bounds(&surfaces[i], slack));
        let largest =
            boxes.iter().flatten().fold(0.0, |max: f64, corner| max.max(corner.abs().max_element()));
        let scale = power_of_two_below(1.0 / largest);
        let boxes: Vec<Aabb> = boxes
            .iter()
            .map(|[min, max]| Aabb::new(round_down(*min * scale), round_up(*max * scale)))
            .collect();
        let usual = match effort {
            Effort::Least => BvhBuildParams::fastest_build(),
            Effort::Full => BvhBuildParams::slow_build(),
        };
        let params = BvhBuildParams {
            max_prims_per_leaf: 1,
            post_collapse_reinsertion_batch_ratio_multiplier: 0.0,
            ..usual
        };
        let tree = build_bvh2(&boxes, params, &mut Duration::default());
        BinaryTree { boxes, tree, scale }
    }

    /// Calls `pair` with the numbers of every two surfaces whose boxes meet, in any order, the lower number first.
    pub(crate) fn each_pair(&self, executor: &ParallelFor, pair: impl Fn(u32, u32) + Sync) {
        let meet = |[a, b]: [u32; 2]| pair(a, b);
        let searches = self.boxes.len().div_ceil(PER_SEARCH);
        let (mut joins, mut next) = (vec![[0, 0]], 0);
        while next < joins.len() && joins.len() - next < searches {
            self.split(joins[next], &mut joins).into_iter().for_each(meet);
            next += 1;
        }
        executor(joins.len() - next, &|job| {
            let mut open = vec![joins[next + job]];
            while let Some(join) = open.pop() {
                self.split(join, &mut open).into_iter().for_each(meet);
            }
        });
    }

    /// Splits the pairs of a surface under one node and a surface under another, or the same, into those of their children; where both are leaves,
    /// returns the pair. Leaves hold one surface.
    fn split(&self, [a, b]: [u32; 2], parts: &mut Vec<[u32; 2]>) -> Option<[u32; 2]> {
        let [first, second] = [a, b].map(|node| &self.tree.nodes[node as usize]);
        if a == b {
            if !first.is_leaf() {
                let [left, right] = [first.first_index, first.first_index + 1];
                parts.extend([[left, left], [right, right], [left, right]]);
            }
            return None;
        }
        if !first.aabb.intersect_aabb(&second.aabb) {
            return None;
        }
        let [surface, other] = match (first.is_leaf(), second.is_leaf()) {
            (true, true) => {
                [first, second].map(|leaf| self.tree.primitive_indices[leaf.first_index as usize])
            }
            (is_leaf, is_other_leaf) => {
                let splits_second =
                    is_leaf || (!is_other_leaf && second.aabb.half_area() > first.aabb.half_area());
                let child = if splits_second { second } else { first }.first_index;
                parts.extend([child, child + 1].map(
                    |child| {
                        if splits_second { [a, child] } else { [child, b] }
                    },
                ));
                return None;
            }
        };
        Some([surface.min(other), surface.max(other)])
    }
}

/// A box that holds every point of a facet, as [`crate::trace::meet`] computes them. In exact arithmetic the
/// facet is its surface grown by `slack`; rounding moves its edges by some 2⁻⁵² of the coordinates, 2⁻⁶ of the
/// slack, perpendicular to themselves, which at the tip of a sliver is a long way along it: hence the outline
/// of twice the slack. A point is within `slack` of the plane, and the plane of a stack within two of the surface; the
/// margin covers both.
fn bounds(surface: &Surface, slack: f64) -> [DVec3; 2] {
    let outline = outline(surface, 2.0 * slack);
    let min = outline.iter().fold(DVec3::INFINITY, |min, &corner| min.min(corner));
    let max = outline.iter().fold(DVec3::NEG_INFINITY, |max, &corner| max.max(corner));
    [min - 8.0 * slack, max + 8.0 * slack]
}

/// The corners of a surface grown by `by` on every edge.
fn outline(surface: &Surface, by: f64) -> Vec<DVec3> {
    let [u_axis, v_axis] = surface.dual_basis();
    let (u, v, w) = (by * u_axis.length(), by * v_axis.length(), by * (u_axis + v_axis).length());
    let corners = if surface.is_triangle() {
        vec![[-u, -v], [1.0 + v + w, -v], [-u, 1.0 + u + w]]
    } else {
        vec![[-u, -v], [1.0 + u, -v], [1.0 + u, 1.0 + v], [-u, 1.0 + v]]
    };
    corners.into_iter().map(|uv| surface.point(uv)).collect()
}

/// The greatest power of two that is not above x > 0.
fn power_of_two_below(x: f64) -> f64 {
    f64::from_bits(x.to_bits() & f64::INFINITY.to_bits())
}

fn round_down(v: DVec3) -> Vec3A {
    Vec3A::from_array(v.to_array().map(|x| (x as f32).next_down()))
}

fn round_up(v: DVec3) -> Vec3A {
    Vec3A::from_array(v.to_array().map(|x| (x as f32).next_up()))
}
