//! The walk, as the papers write it.

use std::ops::Range;

use crate::birth::Births;
use crate::estimator::Estimator;
use crate::fate::{Fate, Next};
use crate::method::Space;
use crate::rng::{Sequence, WalkRng};
use crate::scene::Scene;
use crate::surface::Side;
use crate::tally::Counts;
use crate::trace::{AnyIndex, Hit, Index, Ray};
use crate::tree::Scratch;

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

/// [`Space`] as a type, so that the loop pays only for the one it uses.
trait Depart {
    /// Local coordinates that the walk leaves from after a hit in `cell`.
    fn depart(scene: &Scene, hit: &Hit, cell: u32, rng: &mut WalkRng) -> [f64; 2];
}

struct FromPatch;
struct FromHit;

impl Depart for FromPatch {
    #[inline(always)]
    fn depart(scene: &Scene, hit: &Hit, cell: u32, rng: &mut WalkRng) -> [f64; 2] {
        scene.surfaces()[hit.surface as usize].point_in_cell(cell, rng.pair())
    }
}

impl Depart for FromHit {
    #[inline(always)]
    fn depart(scene: &Scene, hit: &Hit, _: u32, _: &mut WalkRng) -> [f64; 2] {
        scene.surfaces()[hit.surface as usize].inside(hit.uv)
    }
}

/// A cosine-distributed ray from a point of a surface. Draws: direction.
#[inline(always)]
fn leave(scene: &Scene, number: u32, uv: [f64; 2], side: Side, rng: &mut WalkRng) -> Ray {
    let surface = &scene.surfaces()[number as usize];
    Ray { origin: surface.point(uv), direction: surface.direction(side, rng.bits()), from: number }
}

/// What stays the same from walk to walk.
struct Walker<'a, I> {
    scene: &'a Scene,
    births: &'a Births,
    index: &'a I,
    scratch: Box<Scratch>,
    rays: u64,
}

impl<I: Index> Walker<'_, I> {
    /// One walk. Draws: place of birth, point, direction; then per hit survival, point (discrete only),
    /// direction. No score and no survival test at its origin: the estimate is of b, and E is added
    /// (source-term suppression).
    #[inline(always)]
    fn walk<D: Depart, F: Fate<C>, const C: usize>(
        &mut self,
        number: u64,
        rng: &mut WalkRng,
        fate: &mut F,
        score: &mut impl Estimator<C>,
    ) -> WalkEnd {
        let scene = self.scene;
        let (birth, weights) = self.births.choose(rng.bits());
        fate.set_out(weights);
        let surface = &scene.surfaces()[birth.surface as usize];
        score.begin(number, surface.first_patch() + birth.cell);
        let uv = surface.point_in_cell(birth.cell, rng.pair());
        let mut ray = leave(scene, birth.surface, uv, birth.side, rng);
        loop {
            self.rays += 1;
            let Some(hit) = self.index.closest_hit(&scene.facets, &ray, &mut self.scratch) else {
                return WalkEnd::Escaped;
            };
            let surface = &scene.surfaces()[hit.surface as usize];
            if !surface.is_active(hit.side) {
                return WalkEnd::AbsorbedBack;
            }
            let cell = surface.cell_at(hit.uv);
            let patch = surface.first_patch() + cell;
            let weights = fate.weights();
            score.arrival(patch, weights);
            match fate.decide(surface, rng) {
                Next::Survives => score.survival(patch, weights),
                Next::Dies => {
                    score.death(patch, weights);
                    return WalkEnd::Absorbed;
                }
                Next::Truncated => return WalkEnd::Truncated,
            }
            let uv = D::depart(scene, &hit, cell, rng);
            ray = leave(scene, hit.surface, uv, hit.side, rng);
        }
    }
}

/// Walks number `walks.start` … `walks.end` − 1 of a sequence; returns how they ended.
pub(crate) fn walk_all<const C: usize>(
    scene: &Scene,
    births: &Births,
    space: Space,
    sequence: &Sequence,
    walks: Range<u64>,
    fate: impl Fate<C>,
    score: &mut impl Estimator<C>,
) -> Counts {
    match (&scene.index, space) {
        (AnyIndex::Flat(index), Space::Discrete) => {
            walk_with::<_, FromPatch, C>(scene, births, index, sequence, walks, fate, score)
        }
        (AnyIndex::Flat(index), Space::Continuous) => {
            walk_with::<_, FromHit, C>(scene, births, index, sequence, walks, fate, score)
        }
        (AnyIndex::Tree(index), Space::Discrete) => {
            walk_with::<_, FromPatch, C>(scene, births, index, sequence, walks, fate, score)
        }
        (AnyIndex::Tree(index), Space::Continuous) => {
            walk_with::<_, FromHit, C>(scene, births, index, sequence, walks, fate, score)
        }
    }
}

fn walk_with<I: Index, D: Depart, const C: usize>(
    scene: &Scene,
    births: &Births,
    index: &I,
    sequence: &Sequence,
    walks: Range<u64>,
    fate: impl Fate<C>,
    score: &mut impl Estimator<C>,
) -> Counts {
    let mut counts = Counts { walks: walks.end - walks.start, ..Counts::default() };
    let mut walker = Walker { scene, births, index, scratch: Box::default(), rays: 0 };
    for (n, mut rng) in walks.clone().zip(sequence.walks_from(walks.start)) {
        let mut fate = fate;
        let end = walker.walk::<D, _, C>(n, &mut rng, &mut fate, score);
        score.end(&mut rng);
        counts.end(end, fate.weights());
    }
    counts.rays = walker.rays;
    counts
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
