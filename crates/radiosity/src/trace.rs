//! The nearest surface along a ray.
//!
//! One arithmetic everywhere: the nearest hit is the least (t, surface number), every t computed by
//! [`Facet::meet`] and nothing else, so neither the index, nor its builder, nor the order of traversal can
//! enter the answer. All of it is f64: a scene may lie 10⁵ edge lengths from its origin.

use glam::DVec3;

use crate::spec::Sides;
use crate::surface::{Side, Surface};
use crate::tree::Tree;

/// A ray from a point on a surface.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Where it starts [m].
    pub origin: DVec3,
    /// Where it goes; of any length.
    pub direction: DVec3,
    /// The surface it leaves, which, being planar, it cannot meet. [`Ray::FREE`] for none.
    pub from: u32,
}

impl Ray {
    /// The `from` of a ray that leaves no surface.
    pub const FREE: u32 = u32::MAX;
}

/// Where a ray meets a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Ray parameter of the hit point.
    pub t: f64,
    /// The surface that is met.
    pub surface: u32,
    /// Local coordinates on it, in [0, 1].
    pub uv: [f64; 2],
    /// The side that is met.
    pub side: Side,
}

/// What tracing needs of a surface: its plane and the affine map to its local coordinates. A facet is the
/// surface grown by the scene's slack on every edge, so that nothing falls through where two meet.
#[derive(Clone, Debug)]
pub(crate) struct Facet {
    normal: DVec3,
    /// n·x of the points x of the plane.
    offset: f64,
    u_axis: DVec3,
    u_offset: f64,
    v_axis: DVec3,
    v_offset: f64,
    triangle: bool,
    two_sided: bool,
}

impl Facet {
    fn new(surface: &Surface, slack: f64) -> Self {
        let [e_u, e_v] = surface.edges();
        let normal = surface.normal();
        // The dual basis: u_axis·e_u = 1, u_axis·e_v = 0. Its length is 1 over the height above the other edge.
        let u_axis = e_v.cross(normal) / e_v.cross(normal).dot(e_u);
        let v_axis = normal.cross(e_u) / normal.cross(e_u).dot(e_v);
        let (grow_u, grow_v) = (slack * u_axis.length(), slack * v_axis.length());
        let corner = surface.corner();
        let (scale_u, scale_v) = if surface.is_triangle() {
            let grow_w = slack * (u_axis + v_axis).length();
            let scale = 1.0 / (1.0 + grow_u + grow_v + grow_w);
            (scale, scale)
        } else {
            (1.0 / (1.0 + 2.0 * grow_u), 1.0 / (1.0 + 2.0 * grow_v))
        };
        Facet {
            normal,
            offset: normal.dot(corner),
            u_axis: u_axis * scale_u,
            u_offset: (u_axis.dot(corner) - grow_u) * scale_u,
            v_axis: v_axis * scale_v,
            v_offset: (v_axis.dot(corner) - grow_v) * scale_v,
            triangle: surface.is_triangle(),
            two_sided: surface.sides() == Sides::Both,
        }
    }

    /// Where a ray meets the facet, if it does.
    ///
    /// A start within `slack` of the plane counts as on it: from there the active side is met at t = 0 by a
    /// ray that goes against its normal, and the back of a one-sided surface is not met at all. So a point
    /// that rounding put behind its neighbour's plane loses no walk.
    #[inline(always)]
    fn meet(&self, ray: &Ray, slack: f64) -> Option<(f64, [f64; 2], Side)> {
        let approach = self.normal.dot(ray.direction);
        let height = self.normal.dot(ray.origin) - self.offset;
        let (side, distance) = if approach < 0.0 { (Side::Front, height) } else { (Side::Back, -height) };
        let nearest = if side == Side::Front || self.two_sided { -slack } else { slack };
        if distance < nearest || approach == 0.0 {
            return None;
        }
        let t = (distance / approach.abs()).max(0.0);
        let point = ray.origin + ray.direction * t;
        let u = self.u_axis.dot(point) - self.u_offset;
        let v = self.v_axis.dot(point) - self.v_offset;
        let inside = u >= 0.0 && v >= 0.0 && if self.triangle { u + v <= 1.0 } else { u <= 1.0 && v <= 1.0 };
        inside.then_some((t, [u, v], side))
    }
}

/// The facets of a scene in surface order.
#[derive(Clone, Debug)]
pub(crate) struct Facets {
    facets: Vec<Facet>,
    slack: f64,
}

impl Facets {
    pub(crate) fn new(surfaces: &[Surface], slack: f64) -> Self {
        Facets { facets: surfaces.iter().map(|surface| Facet::new(surface, slack)).collect(), slack }
    }

    pub(crate) fn len(&self) -> usize {
        self.facets.len()
    }

    /// Keeps the nearer of `best` and the hit of one facet; of two at the same t, the lower surface number.
    #[inline(always)]
    pub(crate) fn meet(&self, surface: u32, ray: &Ray, best: &mut Option<Hit>) {
        if surface == ray.from {
            return;
        }
        if let Some((t, uv, side)) = self.facets[surface as usize].meet(ray, self.slack) {
            let nearer = best.is_none_or(|hit| t < hit.t || (t == hit.t && surface < hit.surface));
            if nearer {
                *best = Some(Hit { t, surface, uv, side });
            }
        }
    }
}

/// Finds the nearest hit: the one thing that walks ask of geometry.
pub(crate) trait Index {
    /// The least (t, surface number) among the facets that the ray meets. `stack` is scratch space that keeps
    /// its allocation from ray to ray.
    fn closest_hit(&self, facets: &Facets, ray: &Ray, stack: &mut Vec<(f64, u32)>) -> Option<Hit>;
}

/// No index: every facet is met in turn. The fastest for a handful.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Flat;

impl Index for Flat {
    #[inline(always)]
    fn closest_hit(&self, facets: &Facets, ray: &Ray, _: &mut Vec<(f64, u32)>) -> Option<Hit> {
        let mut best = None;
        for surface in 0..facets.len() as u32 {
            facets.meet(surface, ray, &mut best);
        }
        best
    }
}

/// The index that a scene was given.
#[derive(Clone, Debug)]
pub(crate) enum AnyIndex {
    Flat(Flat),
    Tree(Tree),
}
