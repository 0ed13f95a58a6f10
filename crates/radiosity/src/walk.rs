//! The walk, as the papers write it.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use crate::estimator::{Collision, Estimator};
use crate::rng::{Sequence, WalkRng};
use crate::scene::Scene;
use crate::surface::Side;
use crate::tally::{Counts, Scoreboard};
use crate::trace::{AnyIndex, Hit, Index, Ray};

/// Where a surviving walk goes on from (BS §2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Space {
    /// A fresh uniform point of the patch that was hit: the expectation solves the radiosity system.
    #[default]
    Discrete,
    /// The hit point: the expectation is the average of the integral equation's solution.
    Continuous,
}

/// Every way a walk can end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WalkEnd {
    /// An active side took it.
    Absorbed,
    /// It met the back of a one-sided surface.
    AbsorbedBack,
    /// It left the scene.
    Escaped,
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

/// The ray that starts a walk: an emitter with probability Φ_s/Φ_T, a uniform point of it, a
/// cosine-distributed direction. Draws: emitter, point, direction.
#[inline(always)]
fn emit(scene: &Scene, rng: &mut WalkRng) -> Ray {
    let emitter = scene.emitter(rng.bits());
    let uv = scene.surfaces()[emitter.surface as usize].point_in_cell(emitter.cell, rng.pair());
    leave(scene, emitter.surface, uv, emitter.side, rng)
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
    index: &'a I,
    stack: Vec<(f64, u32)>,
    rays: u64,
}

impl<I: Index> Walker<'_, I> {
    /// One shooting walk. No score and no survival test at its origin: the estimate is of b, and E is added
    /// (source-term suppression). Draws per hit: survival, then point (discrete only), then direction.
    #[inline(always)]
    fn walk<D: Depart>(&mut self, rng: &mut WalkRng, score: &mut impl Estimator) -> WalkEnd {
        let scene = self.scene;
        let mut ray = emit(scene, rng);
        loop {
            self.rays += 1;
            let Some(hit) = self.index.closest_hit(&scene.facets, &ray, &mut self.stack) else {
                return WalkEnd::Escaped;
            };
            let surface = &scene.surfaces()[hit.surface as usize];
            if !surface.is_active(hit.side) {
                return WalkEnd::AbsorbedBack;
            }
            let cell = surface.cell_at(hit.uv);
            score.arrival(surface.first_patch() + cell);
            if !surface.survives(rng.bits()) {
                return WalkEnd::Absorbed;
            }
            let uv = D::depart(scene, &hit, cell, rng);
            ray = leave(scene, hit.surface, uv, hit.side, rng);
        }
    }
}

/// Shoots walks number `walks.start` … `walks.end` − 1 of a sequence; returns how they ended.
pub fn shoot(
    scene: &Scene,
    space: Space,
    sequence: &Sequence,
    walks: Range<u64>,
    score: &mut impl Estimator,
) -> Counts {
    match (&scene.index, space) {
        (AnyIndex::Flat(index), Space::Discrete) => {
            shoot_with::<_, FromPatch>(scene, index, sequence, walks, score)
        }
        (AnyIndex::Flat(index), Space::Continuous) => {
            shoot_with::<_, FromHit>(scene, index, sequence, walks, score)
        }
        (AnyIndex::Tree(index), Space::Discrete) => {
            shoot_with::<_, FromPatch>(scene, index, sequence, walks, score)
        }
        (AnyIndex::Tree(index), Space::Continuous) => {
            shoot_with::<_, FromHit>(scene, index, sequence, walks, score)
        }
    }
}

fn shoot_with<I: Index, D: Depart>(
    scene: &Scene,
    index: &I,
    sequence: &Sequence,
    walks: Range<u64>,
    score: &mut impl Estimator,
) -> Counts {
    let mut counts = Counts { walks: walks.end - walks.start, ..Counts::default() };
    let mut walker = Walker { scene, index, stack: Vec::new(), rays: 0 };
    for (n, mut rng) in walks.clone().zip(sequence.walks_from(walks.start)) {
        score.begin(n);
        match walker.walk::<D>(&mut rng, score) {
            WalkEnd::Absorbed => counts.absorbed += 1,
            WalkEnd::AbsorbedBack => counts.absorbed_back += 1,
            WalkEnd::Escaped => counts.escaped += 1,
        }
    }
    counts.rays = walker.rays;
    counts
}

/// Shoots walks by the collision estimator onto a board.
pub fn shoot_collision<const M: usize>(
    scene: &Scene,
    space: Space,
    sequence: &Sequence,
    walks: Range<u64>,
    board: &mut Scoreboard<M>,
) {
    let counts = shoot(scene, space, sequence, walks, &mut Collision::new(board));
    board.counts.add(counts);
}
