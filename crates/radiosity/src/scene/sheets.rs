//! Sheets that pass light on diffusely: blinds, curtains, leaves.
//!
//! A walk that arrives on a side goes on with probability R + T: of the random numbers that let it, the first R leave the side that it came to, the others
//! the side behind.

use super::{Scene, SceneError};
use crate::geometry::spec::{Side, SurfaceSpec};
use crate::random::sampling::fixed_64;
use crate::simd::batch::{Lanes, WIDTH};
use crate::trace::ray::Hits;
use crate::trace::stack::Stack;

/// Which of the random bits that let a walk go on let it be reflected, surface by surface: those below R, as a threshold for 64 bits. Empty where
/// no surface transmits.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sheets(Vec<u64>);

impl Sheets {
    /// The sheets among surfaces, of which those in `stacks` overlap in one plane.
    pub(super) fn new(surfaces: &[SurfaceSpec], stacks: &[Stack]) -> Result<Self, SceneError> {
        let transmits = |surface: u32| surfaces[surface as usize].transmittance.is_lit();
        if let Some(&surface) = stacks.iter().flat_map(|stack| &stack.surfaces).find(|&&s| transmits(s)) {
            return Err(SceneError::Surface {
                surface: surface as usize,
                key: "transmittance",
                problem: "the surface overlaps with another one in its plane, and passes light on into it (between the two there is no room for a ray); move it by a millimetre".into(),
            });
        }
        let thresholds = surfaces.iter().map(|surface| match surface.transmittance.is_lit() {
            true => fixed_64(surface.reflectance.max()),
            false => u64::MAX,
        });
        let any = surfaces.iter().any(|surface| surface.transmittance.is_lit());
        Ok(Sheets(if any { thresholds.collect() } else { Vec::new() }))
    }

    /// What the sheets take of memory [bytes].
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.0[..])
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The side from which a walk goes on that has arrived on one, by the bits that let it.
    pub(crate) fn leaves(&self, surface: u32, side: Side, survival: u64) -> Side {
        match (self.0.get(surface as usize).is_some_and(|&reflected| survival >= reflected), side) {
            (false, side) => side,
            (true, Side::Front) => Side::Back,
            (true, Side::Back) => Side::Front,
        }
    }

    /// Turns the walks that are transmitted to the other side: `facing` is that of the sides which they leave.
    #[inline(never)]
    pub(crate) fn pass(
        &self,
        survived: Lanes,
        hits: &Hits,
        survival: &[u64; WIDTH],
        facing: &mut [f64; WIDTH],
    ) {
        survived.each(|lane| {
            if survival[lane] >= self.0[hits.surface[lane] as usize] {
                facing[lane] = -facing[lane];
            }
        });
    }
}

impl Scene {
    /// Whether some surface passes light on to its other side.
    pub fn transmits(&self) -> bool {
        !self.parts.sheets.is_empty()
    }
}
