//! The score of daylight coefficients: for which patch of the sky a walk leaves, and whether it was reflected before.

use super::score::Scorer;
use crate::geometry::sky::SkyPatches;
use crate::random::rng::WalkRng;
use crate::simd::batch::{Decisions, Lanes, WIDTH};
use crate::trace::ray::Rays;

/// One unit for each walk that leaves, in the row of its patch; the first row is what leaves below the horizon.
pub(crate) struct SkyCounts<'a> {
    sky: &'a SkyPatches,
    straight: &'a mut [u64],
    reflected: &'a mut [u64],
    /// Which walks have been reflected.
    since: [bool; WIDTH],
}

impl<'a> SkyCounts<'a> {
    pub(crate) fn new(sky: &'a SkyPatches, (straight, reflected): (&'a mut [u64], &'a mut [u64])) -> Self {
        SkyCounts { sky, straight, reflected, since: [false; WIDTH] }
    }
}

impl Scorer<1> for SkyCounts<'_> {
    #[inline(always)]
    fn begin(&mut self, lane: usize, _: u32) {
        self.since[lane] = false;
    }

    #[inline(always)]
    fn score(&mut self, _: &[u32; WIDTH], decided: &Decisions, _: &[[f64; 1]; WIDTH]) {
        decided.survived.each(|lane| self.since[lane] = true);
    }

    #[inline(always)]
    fn lose(&mut self, lanes: Lanes, rays: &Rays) {
        lanes.each(|lane| {
            let patch = self.sky.of(rays.direction.each_ref().map(|row| row[lane]));
            let counts = if self.since[lane] { &mut *self.reflected } else { &mut *self.straight };
            counts[patch.map_or(0, |patch| patch as usize + 1)] += 1;
        });
    }

    #[inline(always)]
    fn end(&mut self, _: usize, _: WalkRng) {}

    fn relocate(&mut self, from: usize, to: usize) {
        self.since[to] = self.since[from];
    }
}
