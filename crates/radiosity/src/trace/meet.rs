//! Where rays meet facets: the one text of it, for N rays side by side that meet a facet each or the same one, and, with
//! N = 1, for a ray alone.
//!
//! A start within `slack` of the plane counts as on it: from there the active side is met at t = 0 by a ray that goes
//! against its normal, and the back of a one-sided surface is not met at all. So a point that rounding put behind its
//! neighbour's plane loses no walk. A layer in front of the one that the ray leaves is met at t = 0 on either side.
//!
//! Scenes in which no surfaces coincide have a text of their own, and pay nothing for layers.

use crate::geometry::spec::Side;
use crate::simd::isa::{Isa, on_isa};
use crate::simd::real::Real;
use crate::trace::facet::{Facet, Facets};
use crate::trace::layers::{LayerLanes, Layers};
use crate::trace::ray::{Hit, Hits, Ray, Rays};

/// Ray i of a batch meets facet `surfaces[i]`, none where that is [`Hits::NONE`]; it does not leave that facet.
pub(crate) fn meet_each(isa: Isa, facets: &Facets, surfaces: &[u32], rays: &Rays, hits: &mut Hits) {
    match facets.layers() {
        None => on_isa!(isa, each(facets: &Facets, surfaces: &[u32], rays: &Rays, hits: &mut Hits)),
        Some(layers) => {
            on_isa!(isa, each_layered(facets: &Facets, layers: &Layers, surfaces: &[u32], rays: &Rays, hits: &mut Hits));
        }
    }
}

#[inline(always)]
fn each<R: Real>(facets: &Facets, surfaces: &[u32], rays: &Rays, hits: &mut Hits) {
    for first in (0..rays.len).step_by(R::N) {
        meet_one::<R>(facets, None, &surfaces[first..], rays, first).store(hits, first);
    }
}

#[inline(always)]
fn each_layered<R: Real>(facets: &Facets, layers: &Layers, surfaces: &[u32], rays: &Rays, hits: &mut Hits) {
    for first in (0..rays.len).step_by(R::N) {
        meet_one::<R>(facets, Some(layers), &surfaces[first..], rays, first).store(hits, first);
    }
}

/// Each of N rays meets the facet of its own.
#[inline(always)]
pub(crate) fn meet_one<R: Real>(
    facets: &Facets,
    layers: Option<&Layers>,
    surfaces: &[u32],
    rays: &Rays,
    first: usize,
) -> Best<R> {
    let mut best = Best::none();
    let facet = FacetLanes::each(facets, surfaces);
    // None is met where there is none to meet; the surfaces that rays leave are not among these.
    let from = R::splat(f64::from(Hits::NONE));
    let (number, lanes) = (R::load_u32(surfaces), RayLanes { from, ..RayLanes::<R>::at(rays, first) });
    match layers {
        None => meet(&facet, facets.slack(), &lanes, number, &mut best),
        Some(layers) => {
            let (layer, from) = (layers.lanes(surfaces), layers.lanes(&rays.from[first..]));
            meet_layer(&facet, facets.slack(), &lanes, number, [&layer, &from], &mut best);
        }
    }
    best
}

/// Keeps the nearer of `best` and the hit of one facet.
#[inline(always)]
pub(crate) fn meet_alone(facets: &Facets, surface: u32, ray: &Ray, best: &mut Best<f64>) {
    let (facet, lanes) = (FacetLanes::each(facets, &[surface]), RayLanes::of(ray));
    let number = f64::from(surface);
    match facets.layers() {
        None => meet_unordered(&facet, facets.slack(), &lanes, number, best),
        Some(layers) => {
            let (layer, from) = (layers.lanes(&[surface]), layers.lanes(&[ray.from]));
            meet_layer(&facet, facets.slack(), &lanes, number, [&layer, &from], best);
        }
    }
}

impl Best<f64> {
    /// A hit that was stored.
    pub(crate) fn of(facets: &Facets, hit: Option<Hit>) -> Self {
        let Some(Hit { t, surface, uv: [u, v], side }) = hit else { return Best::none() };
        let rank = facets.layers().map_or(f64::from(surface), |layers| {
            let [front, back] = layers.lanes::<f64>(&[surface]).ranks;
            if side == Side::Front { front } else { back }
        });
        Best { t, surface: surface.into(), u, v, approach: -side.sign(), rank }
    }

    /// The hit, where there is one.
    pub(crate) fn hit(self) -> Option<Hit> {
        let side = if self.approach < 0.0 { Side::Front } else { Side::Back };
        let surface = self.surface as u32;
        (self.surface >= 0.0).then_some(Hit { t: self.t, surface, uv: [self.u, self.v], side })
    }
}

/// N rays side by side.
pub(crate) struct RayLanes<R> {
    origin: [R; 3],
    direction: [R; 3],
    from: R,
}

impl<R: Real> RayLanes<R> {
    /// Loads the rays of a batch from the `first` on.
    #[inline(always)]
    pub(crate) fn at(rays: &Rays, first: usize) -> Self {
        let (mut origin, mut direction) = ([R::splat(0.0); 3], [R::splat(0.0); 3]);
        for axis in 0..3 {
            origin[axis] = R::load(&rays.origin[axis][first..]);
            direction[axis] = R::load(&rays.direction[axis][first..]);
        }
        RayLanes { origin, direction, from: R::load_u32(&rays.from[first..]) }
    }

    /// One ray in all lanes.
    #[inline(always)]
    fn of(ray: &Ray) -> Self {
        RayLanes {
            origin: splat(ray.origin),
            direction: splat(ray.direction),
            from: R::splat(ray.from.into()),
        }
    }
}

/// A facet for each of N rays.
pub(crate) struct FacetLanes<R> {
    normal: [R; 3],
    offset: R,
    u_axis: [R; 3],
    u_offset: R,
    v_axis: [R; 3],
    v_offset: R,
    /// 1 for a triangle, 0 for a parallelogram.
    triangle: R,
    two_sided: R,
}

impl<R: Real> FacetLanes<R> {
    /// Looks up the facet of each surface.
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

    /// One facet in all lanes.
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
    /// The rank of the facet hit; it has no meaning where facets are met in ascending order.
    rank: R,
}

impl<R: Real> Best<R> {
    #[inline(always)]
    pub(crate) fn none() -> Self {
        let zero = R::splat(0.0);
        Best {
            t: R::splat(f64::INFINITY),
            surface: R::splat(-1.0),
            u: zero,
            v: zero,
            approach: zero,
            rank: zero,
        }
    }

    /// Whether a hit comes after another one, given the t and the rank of that.
    #[inline(always)]
    fn comes_after(&self, t: R, rank: R) -> R::Mask {
        let (zero, one) = (R::splat(0.0), R::splat(1.0));
        let first = R::select(rank.lt(self.rank), one, zero);
        let tied = R::select(t.ne(self.t), zero, first);
        zero.lt(R::select(t.lt(self.t), one, tied))
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

/// Where N rays meet the planes of facets.
struct Crossing<R> {
    approach: R,
    /// From where the rays come to the plane; 0 on it.
    distance: R,
    /// The least distance at which the plane is met.
    nearest: R,
}

impl<R: Real> Crossing<R> {
    #[inline(always)]
    fn new(facet: &FacetLanes<R>, slack: f64, rays: &RayLanes<R>) -> Self {
        let (zero, slack) = (R::splat(0.0), R::splat(slack));
        let approach = dot(facet.normal, rays.direction);
        let height = dot(facet.normal, rays.origin) - facet.offset;
        let front = approach.lt(zero);
        let back_nearest = R::select(zero.lt(facet.two_sided), zero - slack, slack);
        Crossing {
            approach,
            distance: R::select(front, height, zero - height),
            nearest: R::select(front, zero - slack, back_nearest),
        }
    }

    /// t, u, v, and which rays meet the facet.
    #[inline(always)]
    fn inside(&self, facet: &FacetLanes<R>, rays: &RayLanes<R>) -> ([R; 3], R::Mask) {
        let (zero, one) = (R::splat(0.0), R::splat(1.0));
        let t = (self.distance / self.approach.abs()).max(zero);
        let mut point = rays.origin;
        for (x, &direction) in point.iter_mut().zip(&rays.direction) {
            *x = *x + direction * t;
        }
        let u = dot(facet.u_axis, point) - facet.u_offset;
        let v = dot(facet.v_axis, point) - facet.v_offset;
        let farthest = R::select(zero.lt(facet.triangle), u + v, u.max(v));
        let met = self.nearest.le(self.distance)
            & self.approach.ne(zero)
            & zero.le(u)
            & zero.le(v)
            & farthest.le(one);
        ([t, u, v], met)
    }
}

impl<R: Real> Best<R> {
    #[inline(always)]
    fn take(&mut self, nearer: R::Mask, number: R, [t, u, v]: [R; 3], approach: R, rank: R) {
        self.t = R::select(nearer, t, self.t);
        self.surface = R::select(nearer, number, self.surface);
        self.u = R::select(nearer, u, self.u);
        self.v = R::select(nearer, v, self.v);
        self.approach = R::select(nearer, approach, self.approach);
        self.rank = R::select(nearer, rank, self.rank);
    }
}

/// Keeps the nearer of `best` and what rays meet of facets, where no surfaces coincide. Surfaces come in ascending order, so
/// that of two at the same t the first stays; a ray does not meet the surface that it leaves.
#[inline(always)]
pub(crate) fn meet<R: Real>(
    facet: &FacetLanes<R>,
    slack: f64,
    rays: &RayLanes<R>,
    number: R,
    best: &mut Best<R>,
) {
    keep(facet, slack, rays, [number, R::splat(0.0)], best, |best, t| t.lt(best.t));
}

/// What [`meet`] does, but for surfaces in any order.
#[inline(always)]
fn meet_unordered<R: Real>(
    facet: &FacetLanes<R>,
    slack: f64,
    rays: &RayLanes<R>,
    number: R,
    best: &mut Best<R>,
) {
    keep(facet, slack, rays, [number, number], best, |best, t| best.comes_after(t, number));
}

/// Keeps of `best` and what rays meet of facets what `is_nearer` says of `best` and a t.
#[inline(always)]
fn keep<R: Real>(
    facet: &FacetLanes<R>,
    slack: f64,
    rays: &RayLanes<R>,
    [number, rank]: [R; 2],
    best: &mut Best<R>,
    is_nearer: impl FnOnce(&Best<R>, R) -> R::Mask,
) {
    let crossing = Crossing::new(facet, slack, rays);
    let (place, met) = crossing.inside(facet, rays);
    let nearer = met & rays.from.ne(number) & is_nearer(best, place[0]);
    best.take(nearer, number, place, crossing.approach, rank);
}

/// What [`meet_unordered`] does where some surfaces coincide, given the layers of the facets and of what the rays leave.
#[inline(always)]
pub(crate) fn meet_layer<R: Real>(
    facet: &FacetLanes<R>,
    slack: f64,
    rays: &RayLanes<R>,
    number: R,
    [layer, from]: [&LayerLanes<R>; 2],
    best: &mut Best<R>,
) {
    let (zero, one) = (R::splat(0.0), R::splat(1.0));
    let mut crossing = Crossing::new(facet, slack, rays);
    let apart = layer.plane.ne(from.plane);
    crossing.distance = R::select(apart, crossing.distance, zero);
    crossing.nearest = R::select(apart, crossing.nearest, zero - R::splat(slack));
    let rank = R::select(crossing.approach.lt(zero), layer.ranks[0], layer.ranks[1]);
    let along = crossing.approach * layer.facing * from.facing;
    let left = R::select(along.lt(zero), from.ranks[0], from.ranks[1]);
    let in_front = R::select(left.lt(rank), one, zero);
    let may_meet = zero.lt(R::select(apart, one, in_front));
    let (place, met) = crossing.inside(facet, rays);
    let nearer = best.comes_after(place[0], rank);
    best.take(met & may_meet & rays.from.ne(number) & nearer, number, place, crossing.approach, rank);
}

#[inline(always)]
fn dot<R: Real>(a: [R; 3], b: [R; 3]) -> R {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
