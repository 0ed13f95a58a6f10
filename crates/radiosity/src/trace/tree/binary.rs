//! A binary tree over the boxes of facets, as obvhs builds it.

use std::time::Duration;

use glam::{DVec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;

use crate::geometry::surface::Surface;

/// A binary tree over boxes that hold facets, and these boxes.
pub(crate) struct BinaryTree {
    pub(super) boxes: Vec<Aabb>,
    pub(super) tree: Bvh2,
    /// Tree coordinates are scene coordinates times this, a power of two.
    pub(super) scale: f64,
}

impl BinaryTree {
    /// A tree over surfaces whose facets are larger by `slack`.
    pub(crate) fn new(surfaces: &[Surface], slack: f64) -> Self {
        let boxes: Vec<[DVec3; 2]> = surfaces.iter().map(|surface| bounds(surface, slack)).collect();
        let largest =
            boxes.iter().flatten().fold(0.0, |max: f64, corner| max.max(corner.abs().max_element()));
        let scale = power_of_two_below(1.0 / largest);
        let boxes: Vec<Aabb> = boxes
            .iter()
            .map(|[min, max]| Aabb::new(round_down(*min * scale), round_up(*max * scale)))
            .collect();
        let params = BvhBuildParams {
            max_prims_per_leaf: 1,
            post_collapse_reinsertion_batch_ratio_multiplier: 0.0,
            ..BvhBuildParams::slow_build()
        };
        let tree = build_bvh2(&boxes, params, &mut Duration::default());
        BinaryTree { boxes, tree, scale }
    }

    /// Calls `pair` with the numbers of every two surfaces whose boxes meet, the lower one first.
    pub(crate) fn each_pair(&self, pair: &mut impl FnMut(u32, u32)) {
        for (number, bounds) in (0..).zip(&self.boxes) {
            self.tree.aabb_traverse(*bounds, |tree, node| {
                let node = &tree.nodes[node as usize];
                let range = node.first_index as usize..(node.first_index + node.prim_count) as usize;
                for &other in tree.primitive_indices[range].iter().filter(|&&other| other < number) {
                    pair(other, number);
                }
                true
            });
        }
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
