//! The walk, as the papers write it, many side by side.
//!
//! A batch of walks goes through the same verbs, one verb at a time for all of them: trace, score, survive or die,
//! scatter. A walk that ends makes room for the next one. Each draws from its own place in the sequence, so that
//! how many go side by side, and where each of them is, cannot enter the answer.

use std::ops::Range;

use crate::birth::Births;
use crate::depart::Departures;
use crate::estimator::Estimator;
use crate::fate::{Fate, Next};
use crate::isa::Isa;
use crate::method::Space;
use crate::prefetch::prefetch;
use crate::rng::{Sequence, WalkRng};
use crate::scene::Scene;
use crate::surface::Side;
use crate::tally::Counts;
use crate::trace::{Hits, Rays, WIDTH};
use crate::tree::Scratch;

/// How many walks ahead surfaces are asked for.
const AHEAD: usize = 12;

/// Every way a walk can end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WalkEnd {
    /// An active side took it.
    Absorbed,
    /// It met the back of a one-sided surface.
    AbsorbedBack,
    /// It left the scene.
    Escaped,
    /// It was cut off (infinite walks only).
    Truncated,
}

/// A walk between two rays.
struct Walk<F, S> {
    rng: WalkRng,
    fate: F,
    /// What it has scored so far.
    score: S,
}

/// Where a walk goes on from.
struct Departure {
    surface: u32,
    side: Side,
    uv: [f64; 2],
}

/// What stays the same from walk to walk.
struct Walker<'a, E, F, const C: usize> {
    scene: &'a Scene,
    births: &'a Births,
    space: Space,
    /// Of a walk that sets out.
    fate: F,
    estimator: &'a mut E,
    counts: Counts,
}

/// Walks number `walks.start` … `walks.end` − 1 of a sequence; returns how they ended.
pub(crate) fn walk_all<const C: usize>(
    scene: &Scene,
    births: &Births,
    space: Space,
    sequence: &Sequence,
    walks: Range<u64>,
    fate: impl Fate<C>,
    estimator: &mut impl Estimator<C>,
) -> Counts {
    let counts = Counts { walks: walks.end - walks.start, ..Counts::default() };
    let mut walker = Walker { scene, births, space, fate, estimator, counts };
    let starts = sequence.walks_from(walks.start).take((walks.end - walks.start) as usize);
    walker.run(starts);
    walker.counts
}

impl<E: Estimator<C>, F: Fate<C>, const C: usize> Walker<'_, E, F, C> {
    /// One walk for each generator.
    fn run(&mut self, mut starts: impl Iterator<Item = WalkRng>) {
        let isa = Isa::best();
        let (mut rays, mut hits) = (Box::<Rays>::default(), Box::<Hits>::default());
        let mut scratch = Box::<Scratch>::default();
        let mut departures = Box::<Departures>::default();
        let mut walks: Vec<Walk<F, E::Score>> = Vec::with_capacity(WIDTH);
        for rng in starts.by_ref().take(WIDTH) {
            let mut walk = Walk { rng, fate: self.fate, score: E::Score::default() };
            let departure = self.begin(&mut walk);
            departures.set(walks.len(), departure, walk.rng.bits());
            walks.push(walk);
        }
        while !walks.is_empty() {
            departures.leave(isa, self.scene.surfaces(), walks.len(), &mut rays);
            self.counts.rays += walks.len() as u64;
            self.scene.index.closest_hits(&self.scene.facets, &rays, &mut scratch, &mut hits);
            let mut i = 0;
            while i < walks.len() {
                self.fetch(&hits, i + AHEAD);
                let departure = match self.settle(&hits, i, &mut walks[i]) {
                    Ok(departure) => departure,
                    Err(end) => {
                        self.end(end, &mut walks[i]);
                        let Some(rng) = starts.next() else {
                            // The last walk of the batch takes the place, its hit included.
                            hits.copy(walks.len() - 1, i);
                            walks.swap_remove(i);
                            continue;
                        };
                        walks[i].rng = rng;
                        self.begin(&mut walks[i])
                    }
                };
                departures.set(i, departure, walks[i].rng.bits());
                i += 1;
            }
        }
    }

    /// A walk sets out. Draws: place of birth, point; the direction is next. No score and no survival test at its
    /// origin: the estimate is of b, and E is added (source-term suppression).
    #[inline(always)]
    fn begin(&mut self, walk: &mut Walk<F, E::Score>) -> Departure {
        let (birth, weights) = self.births.choose(walk.rng.bits());
        walk.fate = self.fate;
        walk.fate.set_out(weights);
        let surface = &self.scene.surfaces()[birth.surface as usize];
        self.estimator.begin(&mut walk.score, surface.first_patch() + birth.cell);
        let uv = surface.point_in_cell(birth.cell, walk.rng.pair());
        Departure { surface: birth.surface, side: birth.side, uv }
    }

    /// Asks for the surface of a hit that is settled later.
    #[inline(always)]
    fn fetch(&self, hits: &Hits, i: usize) {
        let surfaces = self.scene.surfaces().as_ptr();
        prefetch(surfaces.wrapping_add(hits.surface[i % WIDTH] as usize), 3);
    }

    /// What becomes of a walk where its ray has led it. Draws: survival, point (discrete only); the direction is
    /// next.
    #[inline(always)]
    fn settle(&mut self, hits: &Hits, i: usize, walk: &mut Walk<F, E::Score>) -> Result<Departure, WalkEnd> {
        let (number, side) = (hits.surface[i], hits.side[i]);
        if number == Hits::NONE {
            return Err(WalkEnd::Escaped);
        }
        let surface = &self.scene.surfaces()[number as usize];
        if !surface.is_active(side) {
            return Err(WalkEnd::AbsorbedBack);
        }
        let uv = hits.uv.each_ref().map(|row| row[i]);
        let cell = surface.cell_at(uv);
        let patch = surface.first_patch() + cell;
        let weights = walk.fate.weights();
        self.estimator.arrival(&mut walk.score, patch, weights);
        match walk.fate.decide(surface, &mut walk.rng) {
            Next::Survives => self.estimator.survival(&mut walk.score, patch, weights),
            Next::Dies => {
                self.estimator.death(&mut walk.score, patch, weights);
                return Err(WalkEnd::Absorbed);
            }
            Next::Truncated => return Err(WalkEnd::Truncated),
        }
        let uv = match self.space {
            Space::Discrete => surface.point_in_cell(cell, walk.rng.pair()),
            Space::Continuous => surface.inside(uv),
        };
        Ok(Departure { surface: number, side, uv })
    }

    #[inline(always)]
    fn end(&mut self, end: WalkEnd, walk: &mut Walk<F, E::Score>) {
        self.estimator.end(&mut walk.score, &mut walk.rng);
        self.counts.end(end, walk.fate.weights());
    }
}

impl Departures {
    #[inline(always)]
    fn set(&mut self, i: usize, departure: Departure, bits: u64) {
        self.surface[i] = departure.surface;
        self.side[i] = departure.side;
        self.uv[0][i] = departure.uv[0];
        self.uv[1][i] = departure.uv[1];
        self.polar[i] = (bits >> 32) as u32;
        self.turn[i] = bits as u32;
    }
}

impl Counts {
    /// Counts the end of a walk, and the weights it took along in fixed point.
    #[inline(always)]
    fn end<const C: usize>(&mut self, end: WalkEnd, weights: [f64; C]) {
        let (walks, taken) = match end {
            WalkEnd::Absorbed => {
                self.absorbed += 1;
                return;
            }
            WalkEnd::AbsorbedBack => (&mut self.absorbed_back, &mut self.absorbed_back_weight),
            WalkEnd::Escaped => (&mut self.escaped, &mut self.escaped_weight),
            WalkEnd::Truncated => (&mut self.truncated, &mut self.truncated_weight),
        };
        *walks += 1;
        for (taken, weight) in taken.iter_mut().zip(weights) {
            *taken += (weight * Counts::WEIGHT_UNITS + 0.5) as u128;
        }
    }
}
