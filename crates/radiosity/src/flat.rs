//! No index: every facet is met in turn by many rays side by side. The fastest for a handful of surfaces.

use crate::isa::{Isa, on_isa};
use crate::real::Real;
use crate::surface::Side;
use crate::trace::{Facet, Facets, Hits, Rays, WIDTH};

/// Meets every facet.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Flat {
    /// What rays are traced with.
    pub(crate) isa: Isa,
}

impl Flat {
    /// The least (t, surface number) among the facets that each ray meets.
    pub(crate) fn closest_hits(&self, facets: &Facets, rays: &Rays, hits: &mut Hits) {
        on_isa!(self.isa, closest_hits(facets: &Facets, rays: &Rays, hits: &mut Hits));
    }
}

/// The best hits so far of N rays; `surface` as a number, −1 for none, and `approach` < 0 for the front.
#[derive(Clone, Copy)]
struct Best<R> {
    t: R,
    surface: R,
    u: R,
    v: R,
    approach: R,
}

#[inline(always)]
fn closest_hits<R: Real>(facets: &Facets, rays: &Rays, hits: &mut Hits) {
    for first in (0..rays.len.min(WIDTH)).step_by(R::N) {
        let lanes = |row: &[f64; WIDTH]| R::load(&row[first..]);
        let (origin, direction) = (rays.origin.each_ref().map(lanes), rays.direction.each_ref().map(lanes));
        let from = R::load_u32(&rays.from[first..]);
        let none = R::splat(-1.0);
        let zero = R::splat(0.0);
        let mut best = Best { t: R::splat(f64::INFINITY), surface: none, u: zero, v: zero, approach: zero };
        for (number, facet) in facets.iter().enumerate() {
            let number = R::splat(number as f64);
            meet(facet, facets.slack(), origin, direction, number, from, &mut best);
        }
        best.t.store(&mut hits.t[first..]);
        best.u.store(&mut hits.uv[0][first..]);
        best.v.store(&mut hits.uv[1][first..]);
        let (mut surface, mut approach) = ([0.0; 8], [0.0; 8]);
        best.surface.store(&mut surface);
        best.approach.store(&mut approach);
        for lane in 0..R::N {
            // −1 as a signed integer is `Hits::NONE` as an unsigned one.
            hits.surface[first + lane] = surface[lane] as i64 as u32;
            hits.side[first + lane] = if approach[lane] < 0.0 { Side::Front } else { Side::Back };
        }
    }
}

/// [`Facet::meet`], operation by operation. Surfaces come in ascending order, so that of two at the same t the
/// first stays.
#[inline(always)]
fn meet<R: Real>(
    facet: &Facet,
    slack: f64,
    origin: [R; 3],
    direction: [R; 3],
    number: R,
    from: R,
    best: &mut Best<R>,
) {
    let (zero, one) = (R::splat(0.0), R::splat(1.0));
    let approach = dot(facet.normal.to_array(), direction);
    let height = dot(facet.normal.to_array(), origin) - R::splat(facet.offset);
    let front = approach.lt(zero);
    let distance = R::select(front, height, zero - height);
    let back_nearest = if facet.two_sided { -slack } else { slack };
    let nearest = R::select(front, R::splat(-slack), R::splat(back_nearest));
    let t = (distance / approach.abs()).max(zero);
    let point = [0, 1, 2].map(|axis| origin[axis] + direction[axis] * t);
    let u = dot(facet.u_axis.to_array(), point) - R::splat(facet.u_offset);
    let v = dot(facet.v_axis.to_array(), point) - R::splat(facet.v_offset);
    let inside = if facet.triangle { (u + v).le(one) } else { u.le(one) & v.le(one) };
    let met = nearest.le(distance)
        & approach.ne(zero)
        & zero.le(u)
        & zero.le(v)
        & inside
        & from.ne(number)
        & t.lt(best.t);
    best.t = R::select(met, t, best.t);
    best.surface = R::select(met, number, best.surface);
    best.u = R::select(met, u, best.u);
    best.v = R::select(met, v, best.v);
    best.approach = R::select(met, approach, best.approach);
}

#[inline(always)]
fn dot<R: Real>(a: [f64; 3], b: [R; 3]) -> R {
    R::splat(a[0]) * b[0] + R::splat(a[1]) * b[1] + R::splat(a[2]) * b[2]
}
