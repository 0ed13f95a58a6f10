//! Where in their cells rays have arrived, as the values of the basis functions there; many side by side.

use crate::geometry::basis::{of_step, slopes_at};
use crate::geometry::landing::{Landing, Landings};
use crate::scene::Scene;
use crate::simd::batch::{Lanes, WIDTH};
use crate::simd::isa::{Isa, on_isa};
use crate::simd::real::Real;
use crate::trace::ray::Hits;

/// ψ₁ and ψ₂ at the hit points of a batch, in units. They mean nothing where no surface is met.
#[derive(Clone, Debug)]
pub(crate) struct Places {
    pub(crate) slopes: [[i32; WIDTH]; 2],
}

impl Places {
    pub(crate) fn new() -> Self {
        Places { slopes: [[0; WIDTH]; 2] }
    }

    /// The places of the first `len` hits.
    pub(crate) fn locate(&mut self, isa: Isa, scene: &Scene, len: usize, hits: &Hits) {
        let (places, landings) = (&mut *self, &scene.parts.landings);
        on_isa!(isa, locate(places: &mut Places, landings: &Landings, len: usize, hits: &Hits));
        if landings.has_rows() {
            self.locate_in_rows(scene, len, hits);
        }
    }

    /// Places them once more where triangles are cut in cells.
    fn locate_in_rows(&mut self, scene: &Scene, len: usize, hits: &Hits) {
        Lanes::first(len).each(|lane| {
            let surface = match hits.surface[lane] {
                Hits::NONE => return,
                number => &scene.surfaces()[number as usize],
            };
            if surface.is_triangle() {
                let uv = hits.uv.each_ref().map(|row| row[lane]);
                let slopes = slopes_at(surface.place_in_cell(surface.cell_at(uv), uv), true);
                self.slopes.iter_mut().zip(slopes).for_each(|(row, slope)| row[lane] = slope);
            }
        });
    }
}

#[inline(always)]
fn locate<R: Real>(places: &mut Places, landings: &Landings, len: usize, hits: &Hits) {
    let mut steps = [[0; WIDTH]; 2];
    for first in (0..len.min(WIDTH)).step_by(R::N) {
        let landing = Landing::<R>::each(landings, &hits.surface[first..]);
        let found = landing.steps(hits.uv.each_ref().map(|row| R::load(&row[first..])));
        found[0].store_u32(&mut steps[0][first..]);
        found[1].store_u32(&mut steps[1][first..]);
    }
    for (slopes, steps) in places.slopes.iter_mut().zip(&steps) {
        slopes.iter_mut().zip(steps).for_each(|(slope, &step)| *slope = of_step(step));
    }
}
