//! Where rays have arrived: the faces that hold the hit points, which walks survive there, and the points from which
//! survivors go on; many side by side.

use crate::geometry::landing::{Landing, Landings};
use crate::geometry::spec::Side;
use crate::geometry::surface::Surface;
use crate::random::rng::{unit_32, units};
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
    /// In scenes with groups, the pieces that these were met on.
    piece: [u32; WIDTH],
    /// The walks whose rays met a surface.
    pub(crate) met: Lanes,
    /// The walks that met an active side.
    pub(crate) active: Lanes,
    /// The walks that would survive there, by their draws.
    pub(crate) survives: Lanes,
    /// Local coordinates of the point that a survivor goes on from.
    pub(crate) uv: [[f64; WIDTH]; 2],
}

impl Default for Arrivals {
    fn default() -> Self {
        Arrivals {
            face: [0; WIDTH],
            piece: [0; WIDTH],
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
        let (arrivals, landings) = (&mut *self, &scene.parts.landings);
        match space {
            Space::Discrete => {
                on_isa!(isa, discrete(arrivals: &mut Arrivals, landings: &Landings, len: usize, hits: &Hits, survival: &[u64; WIDTH], point: &[u64; WIDTH]));
            }
            Space::Continuous => {
                on_isa!(isa, continuous(arrivals: &mut Arrivals, landings: &Landings, len: usize, hits: &Hits, survival: &[u64; WIDTH]));
            }
        }
        let places = scene.parts.places.as_ref();
        if let Some(places) = places {
            // So far these are the numbers of cells.
            places.look_up(&mut self.face[..len]);
        }
        if scene.parts.landings.has_rows() || (places.is_some() && space == Space::Discrete) {
            self.locate_again(scene.surfaces(), space, len, hits, point);
        }
        if let Some(partition) = scene.faces().partition() {
            // So far these are the numbers of pieces.
            for (face, piece) in self.face[..len].iter_mut().zip(&mut self.piece) {
                *piece = *face;
                *face = partition.face_of(*piece);
            }
        }
    }

    /// These walks have not arrived anywhere.
    #[inline(always)]
    pub(crate) fn take_out(&mut self, stopped: Lanes) {
        self.met = self.met.without(stopped);
        self.active = self.active.without(stopped);
    }

    /// The pieces of the arrivals; without meaning where no active side is met.
    #[inline(always)]
    pub(crate) fn pieces(&self, scene: &Scene) -> &[u32; WIDTH] {
        if scene.faces().are_grouped() { &self.piece } else { &self.face }
    }

    /// Once more where surfaces are triangles cut in cells, or cut into leaves.
    fn locate_again(
        &mut self,
        surfaces: &[Surface],
        space: Space,
        len: usize,
        hits: &Hits,
        point: &[u64; WIDTH],
    ) {
        (self.met & Lanes::first(len)).each(|lane| {
            let surface = &surfaces[hits.surface[lane] as usize];
            if !surface.is_triangle() && surface.leaves().is_none() {
                return;
            }
            let cell = surface.cell_at(hits.uv.each_ref().map(|row| row[lane]));
            let side = if hits.facing[lane] > 0.0 { Side::Front } else { Side::Back };
            self.face[lane] = surface.piece(cell, side);
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
        let (landing, cell) = arrive::<R>(arrivals, landings, first, hits, survival);
        let uv = landing.point_in(cell, units(&point[first..]));
        uv[0].store(&mut arrivals.uv[0][first..]);
        uv[1].store(&mut arrivals.uv[1][first..]);
    }
}

/// Continuous walks go on from where they are, but strictly inside the surface.
#[inline(always)]
fn continuous<R: Real>(
    arrivals: &mut Arrivals,
    landings: &Landings,
    len: usize,
    hits: &Hits,
    survival: &[u64; WIDTH],
) {
    for first in (0..len.min(WIDTH)).step_by(R::N) {
        let (landing, _) = arrive::<R>(arrivals, landings, first, hits, survival);
        let uv = landing.inside(hits.uv.each_ref().map(|row| R::load(&row[first..])));
        uv[0].store(&mut arrivals.uv[0][first..]);
        uv[1].store(&mut arrivals.uv[1][first..]);
    }
}

/// Face, activity and survival of N arrivals; returns their landings and cells, as numbers along u and v.
#[inline(always)]
fn arrive<R: Real>(
    arrivals: &mut Arrivals,
    landings: &Landings,
    first: usize,
    hits: &Hits,
    survival: &[u64; WIDTH],
) -> (Landing<R>, [R; 2]) {
    let landing = Landing::<R>::each(landings, &hits.surface[first..]);
    let cell = landing.cell_at(hits.uv.each_ref().map(|row| R::load(&row[first..])));
    let facing = R::load(&hits.facing[first..]);
    landing.piece(cell, facing).store_u32(&mut arrivals.face[first..]);
    let met = R::load_u32(&hits.surface[first..]).ne(R::splat(f64::from(Hits::NONE)));
    arrivals.met.add(first, R::bits(met));
    arrivals.active.add(first, R::bits(met & landing.is_active(facing)));
    arrivals.survives.add(first, R::bits(landing.survives(&survival[first..])));
    (landing, cell)
}
