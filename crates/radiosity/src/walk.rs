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

/// Every way a walk can end, with the weight that it had left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WalkEnd {
    /// An active side took it.
    Absorbed,
    /// It met the back of a one-sided surface.
    AbsorbedBack(f64),
    /// It left the scene.
    Escaped(f64),
    /// It was cut off (infinite walks only).
    Truncated(f64),
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
    fn walk<D: Depart>(
        &mut self,
        number: u64,
        rng: &mut WalkRng,
        mut fate: impl Fate,
        score: &mut impl Estimator,
    ) -> WalkEnd {
        let scene = self.scene;
        let birth = self.births.choose(rng.bits());
        let surface = &scene.surfaces()[birth.surface as usize];
        score.begin(number, surface.first_patch() + birth.cell);
        let uv = surface.point_in_cell(birth.cell, rng.pair());
        let mut ray = leave(scene, birth.surface, uv, birth.side, rng);
        loop {
            self.rays += 1;
            let Some(hit) = self.index.closest_hit(&scene.facets, &ray, &mut self.scratch) else {
                return WalkEnd::Escaped(fate.weight());
            };
            let surface = &scene.surfaces()[hit.surface as usize];
            if !surface.is_active(hit.side) {
                return WalkEnd::AbsorbedBack(fate.weight());
            }
            let cell = surface.cell_at(hit.uv);
            let patch = surface.first_patch() + cell;
            score.arrival(patch, fate.weight());
            match fate.decide(surface, rng) {
                Next::Survives => score.survival(patch),
                Next::Dies => {
                    score.death(patch);
                    return WalkEnd::Absorbed;
                }
                Next::Truncated(weight) => return WalkEnd::Truncated(weight),
            }
            let uv = D::depart(scene, &hit, cell, rng);
            ray = leave(scene, hit.surface, uv, hit.side, rng);
        }
    }
}

/// Walks number `walks.start` … `walks.end` − 1 of a sequence; returns how they ended.
pub(crate) fn walk_all(
    scene: &Scene,
    births: &Births,
    space: Space,
    sequence: &Sequence,
    walks: Range<u64>,
    fate: impl Fate,
    score: &mut impl Estimator,
) -> Counts {
    match (&scene.index, space) {
        (AnyIndex::Flat(index), Space::Discrete) => {
            walk_with::<_, FromPatch>(scene, births, index, sequence, walks, fate, score)
        }
        (AnyIndex::Flat(index), Space::Continuous) => {
            walk_with::<_, FromHit>(scene, births, index, sequence, walks, fate, score)
        }
        (AnyIndex::Tree(index), Space::Discrete) => {
            walk_with::<_, FromPatch>(scene, births, index, sequence, walks, fate, score)
        }
        (AnyIndex::Tree(index), Space::Continuous) => {
            walk_with::<_, FromHit>(scene, births, index, sequence, walks, fate, score)
        }
    }
}

fn walk_with<I: Index, D: Depart>(
    scene: &Scene,
    births: &Births,
    index: &I,
    sequence: &Sequence,
    walks: Range<u64>,
    fate: impl Fate,
    score: &mut impl Estimator,
) -> Counts {
    let mut counts = Counts { walks: walks.end - walks.start, ..Counts::default() };
    let mut walker = Walker { scene, births, index, scratch: Box::default(), rays: 0 };
    for (n, mut rng) in walks.clone().zip(sequence.walks_from(walks.start)) {
        let end = walker.walk::<D>(n, &mut rng, fate, score);
        score.end(&mut rng);
        counts.end(end);
    }
    counts.rays = walker.rays;
    counts
}

impl Counts {
    /// Counts the end of a walk, and the weight it took along in fixed point.
    #[inline(always)]
    fn end(&mut self, end: WalkEnd) {
        let fixed = |weight: f64| (weight * Counts::WEIGHT_UNITS + 0.5) as u64;
        match end {
            WalkEnd::Absorbed => self.absorbed += 1,
            WalkEnd::AbsorbedBack(weight) => {
                self.absorbed_back += 1;
                self.absorbed_back_weight += u128::from(fixed(weight));
            }
            WalkEnd::Escaped(weight) => {
                self.escaped += 1;
                self.escaped_weight += u128::from(fixed(weight));
            }
            WalkEnd::Truncated(weight) => {
                self.truncated += 1;
                self.truncated_weight += u128::from(fixed(weight));
            }
        }
    }
}
