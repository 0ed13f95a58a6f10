//! Where rays have arrived: the faces that hold the hit points, who survives there, and the points from which
//! survivors go on; many side by side.

use crate::geometry::landing::{Landings, PARALLELOGRAM};
use crate::geometry::spec::Side;
use crate::geometry::surface::{EDGE, Surface};
use crate::random::rng::{UNIT_32, unit_32};
use crate::scene::Scene;
use crate::simd::batch::{Lanes, WIDTH};
use crate::simd::isa::{Isa, on_isa};
use crate::simd::real::Real;
use crate::trace::ray::Hits;
use crate::walk::Space;

/// The arrivals of a batch.
#[derive(Clone, Debug)]
pub(crate) struct Arrivals {
    /// Without meaning where no active side is met.
    pub(crate) face: [u32; WIDTH],
    /// Met a surface,
    pub(crate) met: Lanes,
    /// and on an active side.
    pub(crate) active: Lanes,
    /// Would survive there, as chance has it.
    pub(crate) survives: Lanes,
    /// Local coordinates of the point that a survivor goes on from.
    pub(crate) uv: [[f64; WIDTH]; 2],
}

impl Default for Arrivals {
    fn default() -> Self {
        Arrivals {
            face: [0; WIDTH],
            met: Lanes::default(),
            active: Lanes::default(),
            survives: Lanes::default(),
            uv: [[0.0; WIDTH]; 2],
        }
    }
}

impl Arrivals {
    /// The arrivals of the first `len` hits; the draws are survival and point.
    pub(crate) fn locate(
        &mut self,
        isa: Isa,
        scene: &Scene,
        space: Space,
        len: usize,
        hits: &Hits,
        draws: &[[u64; WIDTH]; 3],
    ) {
        (self.met, self.active, self.survives) = Default::default();
        let [survival, point, _] = draws;
        let (arrivals, landings) = (&mut *self, &scene.landings);
        match space {
            Space::Discrete => {
                on_isa!(isa, discrete(arrivals: &mut Arrivals, landings: &Landings, len: usize, hits: &Hits, survival: &[u64; WIDTH], point: &[u64; WIDTH]));
            }
            Space::Continuous => {
                on_isa!(isa, continuous(arrivals: &mut Arrivals, landings: &Landings, len: usize, hits: &Hits, survival: &[u64; WIDTH]));
            }
        }
        if scene.landings.rows {
            self.locate_in_rows(scene.surfaces(), space, len, hits, point);
        }
    }

    /// Once more where triangles are cut in cells.
    fn locate_in_rows(
        &mut self,
        surfaces: &[Surface],
        space: Space,
        len: usize,
        hits: &Hits,
        point: &[u64; WIDTH],
    ) {
        (self.met & Lanes::first(len)).each(|lane| {
            let surface = &surfaces[hits.surface[lane] as usize];
            if !surface.is_triangle() {
                return;
            }
            let cell = surface.cell_at(hits.uv.each_ref().map(|row| row[lane]));
            let side = if hits.facing[lane] > 0.0 { Side::Front } else { Side::Back };
            self.face[lane] = surface.face(cell, side);
            if space == Space::Discrete {
                let r = [(point[lane] >> 32) as u32, point[lane] as u32].map(unit_32);
                let uv = surface.point_in_cell(cell, r);
                self.uv.iter_mut().zip(uv).for_each(|(row, uv)| row[lane] = uv);
            }
        });
    }
}

/// Discrete walks go on from another point of the patch.
#[inline(always)]
fn discrete<R: Real>(
    arrivals: &mut Arrivals,
    landings: &Landings,
    len: usize,
    hits: &Hits,
    survival: &[u64; WIDTH],
    point: &[u64; WIDTH],
) {
    for first in (0..len.min(WIDTH)).step_by(R::N) {
        let (cell, [_, _, inverse_u, inverse_v, _, _, _, kind]) =
            arrive::<R>(arrivals, landings, first, hits, survival);
        let ([r, s], half, one) = (R::load_halves(&point[first..]), R::splat(0.5), R::splat(1.0));
        let (r, s) = ((r + half) * R::splat(UNIT_32), (s + half) * R::splat(UNIT_32));
        // The unit square is folded on its diagonal.
        let folded = R::splat(PARALLELOGRAM).lt(kind) & one.le(r + s);
        let (r, s) = (R::select(folded, one - r, r), R::select(folded, one - s, s));
        ((cell[0] + r) * inverse_u).store(&mut arrivals.uv[0][first..]);
        ((cell[1] + s) * inverse_v).store(&mut arrivals.uv[1][first..]);
    }
}

/// Continuous walks go on from where they are, but strictly inside the surface (see [`Surface::inside`]).
#[inline(always)]
fn continuous<R: Real>(
    arrivals: &mut Arrivals,
    landings: &Landings,
    len: usize,
    hits: &Hits,
    survival: &[u64; WIDTH],
) {
    let (least, most) = (R::splat(EDGE), R::splat(1.0 - EDGE));
    for first in (0..len.min(WIDTH)).step_by(R::N) {
        let (_, [.., kind]) = arrive::<R>(arrivals, landings, first, hits, survival);
        let (u, v) = (R::load(&hits.uv[0][first..]).max(least), R::load(&hits.uv[1][first..]).max(least));
        let (u, v) = (R::select(most.lt(u), most, u), R::select(most.lt(v), most, v));
        let excess = u + v - most;
        let outside = R::splat(PARALLELOGRAM).lt(kind) & R::splat(0.0).lt(excess);
        let step = R::select(outside, excess, R::splat(0.0));
        let in_u = v.lt(u);
        R::select(in_u, u - step, u).store(&mut arrivals.uv[0][first..]);
        R::select(in_u, v, v - step).store(&mut arrivals.uv[1][first..]);
    }
}

/// Face, activity and survival of N arrivals; returns their cells, as numbers along u and v, and landings.
#[inline(always)]
fn arrive<R: Real>(
    arrivals: &mut Arrivals,
    landings: &Landings,
    first: usize,
    hits: &Hits,
    survival: &[u64; WIDTH],
) -> ([R; 2], [R; 8]) {
    let landing = R::rows(&landings.table, &hits.surface[first..]);
    let [nu, nv, _, _, first_face, threshold, back, _] = landing;
    let cell = [grid_step(R::load(&hits.uv[0][first..]), nu), grid_step(R::load(&hits.uv[1][first..]), nv)];
    let (facing, zero) = (R::load(&hits.facing[first..]), R::splat(0.0));
    let side = R::select(facing.lt(zero), back, zero);
    (cell[0] * nv + cell[1] + first_face + side).store_u32(&mut arrivals.face[first..]);
    let none = R::splat(f64::from(Hits::NONE));
    let met = R::load_u32(&hits.surface[first..]).ne(none);
    arrivals.met.add(first, R::bits(met));
    // Above 0: the front, or a back that is active.
    let activity = facing + back + back;
    arrivals.active.add(first, R::bits(met & zero.lt(activity)));
    arrivals.survives.add(first, R::bits(R::below(&survival[first..], threshold)));
    (cell, landing)
}

/// The step of an n-step division of [0, 1] that holds x; x may exceed the interval by a rounding error.
#[inline(always)]
fn grid_step<R: Real>(x: R, n: R) -> R {
    let step = (x * n).floor();
    R::select(step.lt(n), step, n - R::splat(1.0)).max(R::splat(0.0))
}
