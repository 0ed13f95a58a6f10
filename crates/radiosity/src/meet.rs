//! Facets in lanes: N rays meet one facet each, or the same one, with the bits of [`Facet::meet`].

use crate::isa::{Isa, on_isa};
use crate::real::Real;
use crate::trace::{Facet, Facets, Hits, Rays};

/// Ray i of a batch meets facet `surfaces[i]`, none where that is [`Hits::NONE`]; it does not leave that facet.
pub(crate) fn meet_each(isa: Isa, facets: &Facets, surfaces: &[u32], rays: &Rays, hits: &mut Hits) {
    on_isa!(isa, each(facets: &Facets, surfaces: &[u32], rays: &Rays, hits: &mut Hits));
}

#[inline(always)]
fn each<R: Real>(facets: &Facets, surfaces: &[u32], rays: &Rays, hits: &mut Hits) {
    for first in (0..rays.len).step_by(R::N) {
        meet_one::<R>(facets, &surfaces[first..], rays, first).store(hits, first);
    }
}

/// Each of N rays meets the facet of its own.
#[inline(always)]
pub(crate) fn meet_one<R: Real>(facets: &Facets, surfaces: &[u32], rays: &Rays, first: usize) -> Best<R> {
    let none = R::splat(f64::from(Hits::NONE));
    let (origin, direction) = rays_at::<R>(rays, first);
    let mut best = Best::none();
    let facet = FacetLanes::each(facets, surfaces);
    meet(&facet, facets.slack(), origin, direction, R::load_u32(surfaces), none, &mut best);
    best
}

#[inline(always)]
pub(crate) fn rays_at<R: Real>(rays: &Rays, first: usize) -> ([R; 3], [R; 3]) {
    let (mut origin, mut direction) = ([R::splat(0.0); 3], [R::splat(0.0); 3]);
    for axis in 0..3 {
        origin[axis] = R::load(&rays.origin[axis][first..]);
        direction[axis] = R::load(&rays.direction[axis][first..]);
    }
    (origin, direction)
}

/// A facet for each of N rays.
pub(crate) struct FacetLanes<R> {
    normal: [R; 3],
    offset: R,
    u_axis: [R; 3],
    u_offset: R,
    v_axis: [R; 3],
    v_offset: R,
    /// 1 or 0.
    triangle: R,
    two_sided: R,
}

impl<R: Real> FacetLanes<R> {
    /// One for each.
    #[inline(always)]
    fn each(facets: &Facets, surfaces: &[u32]) -> Self {
        let [n0, n1, n2, offset, u0, u1, u2, u_offset, v0, v1, v2, v_offset, triangle, two_sided, _, _] =
            R::rows(facets.table(), surfaces);
        FacetLanes {
            normal: [n0, n1, n2],
            offset,
            u_axis: [u0, u1, u2],
            u_offset,
            v_axis: [v0, v1, v2],
            v_offset,
            triangle,
            two_sided,
        }
    }

    /// The same for all.
    #[inline(always)]
    pub(crate) fn of(facet: &Facet) -> Self {
        FacetLanes {
            normal: splat(facet.normal),
            offset: R::splat(facet.offset),
            u_axis: splat(facet.u_axis),
            u_offset: R::splat(facet.u_offset),
            v_axis: splat(facet.v_axis),
            v_offset: R::splat(facet.v_offset),
            triangle: R::splat(f64::from(u8::from(facet.triangle))),
            two_sided: R::splat(f64::from(u8::from(facet.two_sided))),
        }
    }
}

#[inline(always)]
fn splat<R: Real>(vector: glam::DVec3) -> [R; 3] {
    [R::splat(vector.x), R::splat(vector.y), R::splat(vector.z)]
}

/// The best hits so far of N rays; `surface` as a number, −1 for none, and `approach` < 0 for the front.
#[derive(Clone, Copy)]
pub(crate) struct Best<R> {
    pub(crate) t: R,
    surface: R,
    u: R,
    v: R,
    approach: R,
}

impl<R: Real> Best<R> {
    #[inline(always)]
    pub(crate) fn none() -> Self {
        let zero = R::splat(0.0);
        Best { t: R::splat(f64::INFINITY), surface: R::splat(-1.0), u: zero, v: zero, approach: zero }
    }

    #[inline(always)]
    pub(crate) fn store(self, hits: &mut Hits, first: usize) {
        self.t.store(&mut hits.t[first..]);
        self.u.store(&mut hits.uv[0][first..]);
        self.v.store(&mut hits.uv[1][first..]);
        // −1 as a signed integer is `Hits::NONE` as an unsigned one.
        self.surface.store_u32(&mut hits.surface[first..]);
        let (front, back) = (R::splat(1.0), R::splat(-1.0));
        R::select(self.approach.lt(R::splat(0.0)), front, back).store(&mut hits.facing[first..]);
    }
}

/// [`Facet::meet`], operation by operation. Surfaces come in ascending order, so that of two at the same t the
/// first stays; the surface `from` is not met.
#[inline(always)]
pub(crate) fn meet<R: Real>(
    facet: &FacetLanes<R>,
    slack: f64,
    origin: [R; 3],
    direction: [R; 3],
    number: R,
    from: R,
    best: &mut Best<R>,
) {
    let (zero, one, slack) = (R::splat(0.0), R::splat(1.0), R::splat(slack));
    let approach = dot(facet.normal, direction);
    let height = dot(facet.normal, origin) - facet.offset;
    let front = approach.lt(zero);
    let distance = R::select(front, height, zero - height);
    let back_nearest = R::select(zero.lt(facet.two_sided), zero - slack, slack);
    let nearest = R::select(front, zero - slack, back_nearest);
    let t = (distance / approach.abs()).max(zero);
    let mut point = origin;
    for axis in 0..3 {
        point[axis] = point[axis] + direction[axis] * t;
    }
    let u = dot(facet.u_axis, point) - facet.u_offset;
    let v = dot(facet.v_axis, point) - facet.v_offset;
    let farthest = R::select(zero.lt(facet.triangle), u + v, u.max(v));
    let met = nearest.le(distance)
        & approach.ne(zero)
        & zero.le(u)
        & zero.le(v)
        & farthest.le(one)
        & from.ne(number)
        & t.lt(best.t);
    best.t = R::select(met, t, best.t);
    best.surface = R::select(met, number, best.surface);
    best.u = R::select(met, u, best.u);
    best.v = R::select(met, v, best.v);
    best.approach = R::select(met, approach, best.approach);
}

#[inline(always)]
fn dot<R: Real>(a: [R; 3], b: [R; 3]) -> R {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
