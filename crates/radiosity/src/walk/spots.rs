//! What is kept of the places where walks score: nothing, or the values of the linear basis there; many side by side.

use super::visits::VisitRecord;
use crate::geometry::basis::{of_step, slopes_at};
use crate::geometry::landing::{Landing, Landings};
use crate::geometry::places::Places;
use crate::geometry::planes::Planes;
use crate::geometry::spec::Side;
use crate::scene::Scene;
use crate::simd::batch::{Lanes, WIDTH};
use crate::simd::isa::{Isa, on_isa};
use crate::simd::real::Real;
use crate::trace::ray::Hits;

/// What is kept of the place where a walk scores, and of several places together: `()`, or the sums of ψ₁ and ψ₂ there [slope
/// units].
pub(crate) trait BasisSample: VisitRecord<Sums = <Self as VisitRecord>::Row> {
    /// The spot of a birth on a surface, in a cell of it, at these local coordinates.
    fn of_birth(scene: &Scene, place: [u32; 2], uv: [f64; 2]) -> Self;
    /// The spots of the first `len` hits, on these pieces. They mean nothing where no surface is met.
    fn locate(row: &mut Self::Row, isa: Isa, scene: &Scene, len: usize, hits: &Hits, pieces: &[u32; WIDTH]);
}

impl VisitRecord for () {
    const NONE: () = ();
    type Row = ();
    const NO_ROW: () = ();
    type Sums = ();
    const NO_SUMS: () = ();
    #[inline(always)]
    fn of((): &(), _: usize) {}
    #[inline(always)]
    fn put(self, (): &mut (), _: usize) {}
    #[inline(always)]
    fn plus(self, (): ()) {}
    #[inline(always)]
    fn add_if(_: u32, (): &mut (), (): &(), _: usize) {}
}

impl BasisSample for () {
    #[inline(always)]
    fn of_birth(_: &Scene, _: [u32; 2], _: [f64; 2]) {}
    #[inline(always)]
    fn locate((): &mut (), _: Isa, _: &Scene, _: usize, _: &Hits, _: &[u32; WIDTH]) {}
}

/// ψ₁ and ψ₂ of a batch of walks.
type BatchSlopes = [[i32; WIDTH]; 2];

impl VisitRecord for [i64; 2] {
    const NONE: Self = [0; 2];
    type Row = BatchSlopes;
    const NO_ROW: BatchSlopes = [[0; WIDTH]; 2];
    type Sums = BatchSlopes;
    const NO_SUMS: BatchSlopes = Self::NO_ROW;

    #[inline(always)]
    fn of(row: &BatchSlopes, lane: usize) -> Self {
        [row[0][lane].into(), row[1][lane].into()]
    }

    #[inline(always)]
    fn put(self, row: &mut BatchSlopes, lane: usize) {
        (row[0][lane], row[1][lane]) = (self[0] as i32, self[1] as i32);
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        [self[0] + other[0], self[1] + other[1]]
    }

    #[inline(always)]
    fn add_if(same: u32, sums: &mut BatchSlopes, row: &BatchSlopes, lane: usize) {
        let mask = same.wrapping_neg() as i32;
        let [first, second] = sums;
        first[lane] += row[0][lane] & mask;
        second[lane] += row[1][lane] & mask;
    }
}

impl BasisSample for [i64; 2] {
    #[inline(always)]
    fn of_birth(scene: &Scene, [number, cell]: [u32; 2], uv: [f64; 2]) -> Self {
        let surface = &scene.surfaces()[number as usize];
        let slopes = match scene.planes() {
            None => slopes_at(surface.place_in_cell(cell, uv), surface.is_triangle()),
            // Both sides have one basis.
            Some(planes) => planes.slopes_at(surface.piece(cell, Side::Front), uv),
        };
        slopes.map(Into::into)
    }

    #[inline(always)]
    fn locate(
        row: &mut BatchSlopes,
        isa: Isa,
        scene: &Scene,
        len: usize,
        hits: &Hits,
        pieces: &[u32; WIDTH],
    ) {
        locate_all(row, isa, scene, len, hits, pieces);
    }
}

fn locate_all(
    row: &mut BatchSlopes,
    isa: Isa,
    scene: &Scene,
    len: usize,
    hits: &Hits,
    pieces: &[u32; WIDTH],
) {
    let (slopes, landings) = (&mut *row, &scene.parts.landings);
    let again = match (scene.planes(), &scene.parts.places) {
        (Some(planes), _) => {
            on_isa!(isa, locate_in_groups(slopes: &mut BatchSlopes, planes: &Planes, len: usize, hits: &Hits, pieces: &[u32; WIDTH]));
            false
        }
        (None, None) => {
            on_isa!(isa, locate(slopes: &mut BatchSlopes, landings: &Landings, len: usize, hits: &Hits));
            landings.has_rows()
        }
        (None, Some(places)) => {
            on_isa!(isa, locate_in_pieces(slopes: &mut BatchSlopes, places: &Places, len: usize, hits: &Hits, pieces: &[u32; WIDTH]));
            places.has_triangles()
        }
    };
    if again {
        locate_in_triangles(row, scene, len, hits);
    }
}

/// Locates hits once more where surfaces are triangles.
fn locate_in_triangles(row: &mut BatchSlopes, scene: &Scene, len: usize, hits: &Hits) {
    Lanes::first(len).each(|lane| {
        let number = hits.surface[lane];
        if number == Hits::NONE {
            return;
        }
        let surface = &scene.surfaces()[number as usize];
        if surface.is_triangle() {
            let uv = hits.uv.each_ref().map(|row| row[lane]);
            <[i64; 2]>::of_birth(scene, [number, surface.cell_at(uv)], uv).put(row, lane);
        }
    });
}

#[inline(always)]
fn locate<R: Real>(slopes: &mut BatchSlopes, landings: &Landings, len: usize, hits: &Hits) {
    let mut steps = [[0; WIDTH]; 2];
    for first in (0..len.min(WIDTH)).step_by(R::N) {
        let landing = Landing::<R>::each(landings, &hits.surface[first..]);
        let found = landing.steps(hits.uv.each_ref().map(|row| R::load(&row[first..])));
        found[0].store_u32(&mut steps[0][first..]);
        found[1].store_u32(&mut steps[1][first..]);
    }
    put_steps(slopes, &steps);
}

/// The slopes of hits on pieces, which may be leaves.
#[inline(always)]
fn locate_in_pieces<R: Real>(
    slopes: &mut BatchSlopes,
    places: &Places,
    len: usize,
    hits: &Hits,
    pieces: &[u32; WIDTH],
) {
    let mut steps = [[0; WIDTH]; 2];
    for first in (0..len.min(WIDTH)).step_by(R::N) {
        let uv = hits.uv.each_ref().map(|row| R::load(&row[first..]));
        let found = places.steps(&pieces[first..], uv);
        found[0].store_u32(&mut steps[0][first..]);
        found[1].store_u32(&mut steps[1][first..]);
    }
    put_steps(slopes, &steps);
}

/// The slopes of hits on pieces of groups.
#[inline(always)]
fn locate_in_groups<R: Real>(
    slopes: &mut BatchSlopes,
    planes: &Planes,
    len: usize,
    hits: &Hits,
    pieces: &[u32; WIDTH],
) {
    let mut steps = [[0; WIDTH]; 2];
    for first in (0..len.min(WIDTH)).step_by(R::N) {
        let uv = hits.uv.each_ref().map(|row| R::load(&row[first..]));
        let found = planes.steps(&pieces[first..], uv);
        found[0].store_u32(&mut steps[0][first..]);
        found[1].store_u32(&mut steps[1][first..]);
    }
    put_steps(slopes, &steps);
}

#[inline(always)]
fn put_steps(slopes: &mut BatchSlopes, steps: &[[u32; WIDTH]; 2]) {
    for (slopes, steps) in slopes.iter_mut().zip(steps) {
        slopes.iter_mut().zip(steps).for_each(|(slope, &step)| *slope = of_step(step));
    }
}
