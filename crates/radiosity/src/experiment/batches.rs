//! Batches of walks, and chains: samples that are long, and score H of every face.

use std::ops::Range;
use std::sync::Arc;

use super::Experiment;
use super::board::Sensing;
use super::board::with_board;
use super::meaning::Meaning;
use super::run::Source;
use super::sensing::SENSING_PART;
use crate::geometry::face::Face;
use crate::jacobi::faces::FaceTable;
use crate::jacobi::final_gather::{GatheredLight, final_gather};
use crate::jacobi::plan::Solve;
use crate::jacobi::{self, ChainBoard, ChainOutcome, Iteration, Reciprocity};
use crate::method::{Batches, Chains, Method, Score};
use crate::random::Sampler;
use crate::random::quasi::Quasi;
use crate::random::rng::Sequence;
use crate::tally::{Counts, Tally};
use crate::thread_pool::ThreadPool;
use crate::walk::batch::Terms;
use crate::walk::estimator::Estimator;

/// The rays of a final gather are this part of the batch's own, in all. Of 1/8 … 1 none did much better in any scene that was
/// tried: fewer rays bring their own noise, more cost more than they gain.
const GATHERING_PART: u64 = 4;

/// The rays of the final gather of batch n are those of walk 2⁶³ + n: no job has 2⁶³ walks.
const GATHERING_RAYS: u64 = 1 << 63;

/// The rays that test reciprocity are those of this walk, which no job has either.
const RECIPROCITY: u64 = u64::MAX;

/// Walks of a batch that are scored at once: no sum of so few wraps.
const WALKS_AT_ONCE: usize = 1 << 18;

impl Experiment {
    /// Scores each batch or chain of `batches`, of which `one` makes one.
    pub(super) fn batches(
        &self,
        sequence: &Sequence,
        batches: Range<u64>,
        (board, sensing): (&mut ChainBoard, &mut Option<Sensing>),
        one: impl Fn(u64) -> Option<ChainOutcome>,
        go_on: &dyn Fn() -> bool,
    ) -> Counts {
        let mut counts = Counts::default();
        for batch in batches {
            let outcome = one(batch).and_then(|outcome| self.gathered(outcome, sequence, batch, go_on));
            let Some(outcome) = outcome else { break };
            if let Some((sensors, sensing)) = self.sensors().zip(sensing.as_mut()) {
                let reflected = self.reflected(&outcome);
                let rays = outcome.counts.rays / SENSING_PART;
                let gathered = self.sense(sensors, &reflected, rays, (sequence, batch), go_on);
                let Some(gathered) = gathered else { break };
                sensing.add(&self.largest_at_sensors, &gathered);
            }
            board.add(&self.largest_radiosity, &outcome);
            counts.add(&outcome.counts).expect("64 bits outlast any process");
        }
        counts
    }

    /// The H that one chain gives.
    pub(super) fn chain(
        &self,
        sequence: &Sequence,
        chain: u64,
        plan: &Chains,
        pool: &dyn ThreadPool,
    ) -> Option<ChainOutcome> {
        let aim = |faces: &FaceTable| self.aim(faces, plan.rays, pool);
        let rng = match plan.solve {
            Solve::Links => jacobi::aim::numbers_of_chain(sequence, chain),
            Solve::Iterations(_) => sequence.walk(chain),
        };
        jacobi::chain(&self.scene, rng, plan.rays, (plan.solve, plan.linear), aim, pool)
    }

    /// How all chains share out their rays. Threads that ask at once each find it for themselves, and find the same.
    fn aim(&self, faces: &FaceTable, rays: u64, pool: &dyn ThreadPool) -> Option<Arc<[f64]>> {
        if let Some(aim) = self.aim.get() {
            return Some(Arc::clone(aim));
        }
        let aim: Arc<[f64]> = jacobi::aim::aim(faces, rays, pool)?.into();
        Some(Arc::clone(self.aim.get_or_init(|| aim)))
    }

    /// Whether chains of links bring direct light by shadow rays.
    pub(super) fn has_shadow_rays(&self) -> bool {
        let Method::Chains(Chains { rays, solve: Solve::Links, .. }) = self.method() else { return false };
        *self.shadow_rays.get_or_init(|| jacobi::has_shadow_rays(&self.scene, *rays))
    }

    /// The H that the walks of one batch give.
    pub(super) fn batch_of_walks(
        &self,
        sequence: &Sequence,
        batch: u64,
        plan: &Batches,
        go_on: &dyn Fn() -> bool,
    ) -> Option<ChainOutcome> {
        let (walks, (estimator, space)) = (plan.walks, plan.score.of_walks());
        let score = if self.method.is_linear() { Score::Linear(estimator) } else { Score::Of(estimator) };
        let numbers = Quasi::new(sequence, batch, walks);
        let mut board = self.scores_of_walks(score, self.scene.faces().len());
        let mut tally: Option<Tally> = None;
        for first in (0..walks).step_by(WALKS_AT_ONCE) {
            let end = walks.min(first + WALKS_AT_ONCE as u64);
            let source = match plan.sampler {
                Sampler::Random => Source::Random(sequence, batch * walks + first..batch * walks + end),
                Sampler::Sobol => Source::Sobol(&numbers, first..end),
            };
            let counts = self.shoot((score, Terms { space, go_on }), &source, (&mut board, None));
            if !go_on() {
                return None;
            }
            with_board!(&mut board, board => board.counts.add(&counts))
                .expect("a batch is counted in 32 bits");
            match &mut tally {
                None => tally = Some(board.take().expect("few walks do not wrap a sum")),
                Some(tally) => board.add_to(tally).expect("few walks do not wrap a sum"),
            }
        }
        tally.map(|tally| self.outcome(estimator, &tally))
    }

    /// H of every face, and the counts of one walk, the batch.
    fn outcome(&self, estimator: Estimator, tally: &Tally) -> ChainOutcome {
        let (faces, channels) = (self.scene.faces(), self.scene.channels());
        let walks = tally.counts.walks;
        let per_unit = |face: (usize, &Face), channel: usize| {
            let Meaning { unit, irradiance_per_event, .. } =
                self.meaning_of_shooting(estimator, face, channel, tally);
            (unit, irradiance_per_event.unwrap_or(0.0))
        };
        let irradiance = |(i, face): (usize, &Face), channel: usize| {
            let (unit, per_event) = per_unit((i, face), channel);
            tally.patch(i, channel)[0] as f64 / walks as f64 * unit * per_event
        };
        let slopes = |(i, face): (usize, &Face), channel: usize| {
            let (unit, per_event) = per_unit((i, face), channel);
            let slope_unit = unit / tally.layout().slope_units() as f64;
            [0, 1].map(|k| tally.slope(i, channel, k).0 as f64 / walks as f64 * slope_unit * per_event)
        };
        let with_slopes = if self.method.is_linear() { channels } else { 0 };
        let by_face = faces.iter().enumerate();
        let per_walk = |weights: [u128; 3]| weights.map(|weight| weight / u128::from(walks));
        ChainOutcome {
            irradiance: by_face
                .flat_map(|(i, face)| (0..channels).map(move |c| irradiance((i, &face), c)))
                .collect(),
            slopes: faces
                .iter()
                .enumerate()
                .flat_map(|(i, face)| (0..with_slopes).map(move |c| slopes((i, &face), c)))
                .collect(),
            landed: (0..faces.len()).map(|i| tally.events(i) as u64).collect(),
            counts: Counts {
                walks: 1,
                absorbed_back_weight: per_walk(tally.counts.absorbed_back_weight),
                escaped_weight: per_walk(tally.counts.escaped_weight),
                truncated_weight: per_walk(tally.counts.truncated_weight),
                ..tally.counts
            },
        }
    }

    /// Replaces the patches of the final gather in an outcome by what their own rays gather.
    fn gathered(
        &self,
        mut outcome: ChainOutcome,
        sequence: &Sequence,
        batch: u64,
        go_on: &dyn Fn() -> bool,
    ) -> Option<ChainOutcome> {
        let chosen = self.method.final_gather();
        if chosen.is_empty() {
            return Some(outcome);
        }
        let (faces, channels) = (FaceTable::new(&self.scene), self.scene.channels());
        let reflected = self.reflected(&outcome);
        let chosen: Vec<u32> = chosen.iter().flat_map(|&patch| self.scene.faces().of_patch(patch)).collect();
        let rng = sequence.walk(GATHERING_RAYS + batch);
        let rays = outcome.counts.rays / GATHERING_PART;
        let gathered = final_gather(&faces, &chosen, &reflected, rays, rng, go_on)?;
        for GatheredLight { face, irradiance, landed, rays } in gathered {
            let i = face as usize;
            outcome.irradiance[i * channels..][..channels].copy_from_slice(&irradiance);
            outcome.landed[i] += landed;
            outcome.counts.rays += rays;
        }
        Some(outcome)
    }

    /// b = R·H of every face, face-major and channel-minor [W/m²].
    fn reflected(&self, outcome: &ChainOutcome) -> Vec<f64> {
        let of_face = |(face, h): (Face, &[f64])| {
            h.iter().enumerate().map(|(c, h)| face.reflectance[c] * h).collect::<Vec<f64>>()
        };
        let by_face = outcome.irradiance.chunks_exact(self.scene.channels());
        self.scene.faces().iter().zip(by_face).flat_map(of_face).collect()
    }

    /// Whether the rays of chains see both ways, which their links take for granted; `None` where the method has no links.
    /// An eighth of one chain's rays are shot for that, 2²⁰ at most.
    pub fn reciprocity(&self, sequence: &Sequence) -> Option<Reciprocity> {
        let Method::Chains(Chains { rays, solve: Solve::Links, .. }) = self.method else { return None };
        Some(jacobi::reciprocity(&self.scene, sequence.walk(RECIPROCITY), (rays / 8).min(1 << 20)))
    }

    /// The iterations of chain number `chain` one by one, in their order; `None` where the method has none. What they
    /// differ by says little of the error of their average: each begins where others have ended.
    pub fn iterations(&self, sequence: &Sequence, chain: u64) -> Option<Vec<Iteration>> {
        let Method::Chains(Chains { rays, solve: Solve::Iterations(plan), .. }) = self.method else {
            return None;
        };
        Some(jacobi::observed(&self.scene, sequence.walk(chain), rays, plan))
    }
}
