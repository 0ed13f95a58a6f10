//! A method at work in a scene: which walks to shoot, onto what board, and what a tally of them says.

pub(crate) mod birth;
pub(crate) mod replay;
pub(crate) mod solution;

use std::ops::Range;

use thiserror::Error;

use crate::geometry::face::Face;
use crate::jacobi::faces::FaceTable;
use crate::jacobi::final_gather::{Gathered, LIGHT_BY_SHADOW_RAYS, final_gather};
use crate::jacobi::{self, ChainBoard, Iteration, Outcome, Reciprocity};
use crate::method::{Batch, Birth, Direction, EstimatorKind, InfiniteEnd, Method, Sampler, Solve, Space};
use crate::random::quasi::{Place, Quasi};
use crate::random::rng::Sequence;
use crate::scene::Scene;
use crate::scene::births::Births;
use crate::tally::{Counts, Layout, Overflow, Scoreboard, Tally};
use crate::walk::batch::{walk_all, walk_each};
use crate::walk::fate::{Analog, Coloured, Fate, FirstArrival, Infinite};
use crate::walk::score::{
    Absorption, Collision, Estimator, Gather, GatherRelated, RELATED, ShootHits, ShootRelated, ShootWeights,
    Survival, fixed_units,
};
use birth::birth_probabilities;

/// A method that would be wrong in this scene.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum Unfit {
    /// Gathering by survival scores where a walk survives on an emitter.
    #[error(
        "patch {patch} emits and has reflectance 0, and gathering by survival scores only where walks survive (its light would be lost); choose another estimator"
    )]
    BlackEmitter {
        /// The emitter.
        patch: usize,
    },
    /// The best mix of absorption and survival is a matter of one channel and of analog walks.
    #[error("`mix` compares collision, absorption and survival on the same walks, which needs {0}")]
    Mix(&'static str),
    /// Batches of walks that share a Sobol sequence score as shooting walks do.
    #[error("Sobol sequences are for shooting walks without `mix`; choose sampler = \"random\"")]
    Sobol,
    /// What is gathered has to be told apart from the rays that gather it.
    #[error("a final gather needs {0}")]
    FinalGather(&'static str),
    /// Nobody can be born, and nothing gathered, where there is no patch.
    #[error("patch {patch} is chosen, but the scene has {patches} patches; choose from 0 to {last}", last = patches - 1)]
    NoSuchPatch {
        /// The patch.
        patch: u32,
        /// Patches of the scene.
        patches: usize,
    },
}

/// The board that an experiment scores on; M power sums per score.
#[derive(Clone, Debug)]
pub enum Board<const M: usize> {
    /// Grey analog shooting: whole hits.
    Hits(Scoreboard<u64, (), 1, M>),
    /// The same with three estimators at once.
    RelatedHits(Scoreboard<u64, (), RELATED, M>),
    /// Other grey walks: fixed point.
    Fixed(Scoreboard<u128, u64, 1, M>),
    /// Gathering with three estimators at once.
    RelatedFixed(Scoreboard<u128, u64, RELATED, M>),
    /// Three channels.
    Coloured(Scoreboard<u128, u64, 3, M>),
    /// Whole chains of stochastic Jacobi.
    Chains(ChainBoard<M>),
}

/// Does the same with whichever board it is.
macro_rules! with_board {
    ($self:expr, $board:ident => $body:expr) => {
        match $self {
            Board::Hits($board) => $body,
            Board::RelatedHits($board) => $body,
            Board::Fixed($board) => $body,
            Board::RelatedFixed($board) => $body,
            Board::Coloured($board) => $body,
            Board::Chains($board) => $body,
        }
    };
}

/// What gathering needs beyond the scene.
#[derive(Clone, Debug)]
struct Gathering {
    births: Births,
    /// p_i.
    probability: Vec<f64>,
    values: Values,
    /// The largest value of an event [W/m²], per channel.
    largest_value: [f64; 3],
    /// B̄ = max_s E_s/(1 − R_s) [W/m²], per channel.
    b_bar: [f64; 3],
    /// A bound on E[x²]/E[x], x in events of the largest value, per channel.
    ratio_bound: [f64; 3],
}

/// What an event on patch j is worth, over the largest value.
#[derive(Clone, Debug)]
enum Values {
    Grey(Vec<[f64; 1]>),
    Coloured(Vec<[f64; 3]>),
    /// Of an arrival, a death and a survival.
    Related(Vec<[f64; 3]>),
}

/// The rays of a final gather are this part of the batch's own, in all. Of 1/8 … 1 none did much better in any scene that was
/// tried: fewer rays bring their own noise, more cost more than they gain.
const GATHERING_PART: u64 = 4;

/// The rays of the final gather of batch n are those of walk 2⁶³ + n: no job has so many walks.
const GATHERING_RAYS: u64 = 1 << 63;

/// The rays that test reciprocity are those of this walk, which no job has either.
const RECIPROCITY: u64 = u64::MAX;

/// Walks of a batch that are scored at once: no sum of so few wraps.
const WALKS_AT_ONCE: usize = 1 << 18;

/// Where the numbers of walks come from, and which walks.
enum Source<'a> {
    Random(&'a Sequence, Range<u64>),
    Sobol(&'a Quasi, Range<u64>),
}

/// A scene and a method that fits it.
#[derive(Clone, Debug)]
pub struct Experiment {
    scene: Scene,
    method: Method,
    gathering: Option<Gathering>,
    /// What chains score H over [W/m²], per channel.
    largest_radiosity: [f64; 3],
    /// Of a face [m²].
    least_area: f64,
}

/// Runs walks with the event that an estimator scores and the fate its walks meet, in C channels.
macro_rules! walk_by_estimator {
    ($self:ident, $analog:expr, $births:expr, $source:expr, $V:ident => $score:expr) => {
        match $self.method.estimator {
            EstimatorKind::Absorption => {
                type $V = Absorption;
                $self.walk_all($births, $source, $analog, $score)
            }
            EstimatorKind::Survival => {
                type $V = Survival;
                $self.walk_all($births, $source, $analog, $score)
            }
            EstimatorKind::Collision => {
                type $V = Collision;
                $self.walk_all($births, $source, $analog, $score)
            }
            EstimatorKind::Infinite => {
                type $V = Collision;
                $self.walk_all($births, $source, Infinite::new($self.method.infinite), $score)
            }
            EstimatorKind::Direct => {
                type $V = Collision;
                $self.walk_all($births, $source, FirstArrival::new(), $score)
            }
        }
    };
}

impl Experiment {
    /// Prepares a method for a scene.
    ///
    /// # Errors
    /// Where its answer would be wrong.
    pub fn new(scene: Scene, method: Method) -> Result<Self, Unfit> {
        if method.mix && scene.channels() > 1 {
            return Err(Unfit::Mix("a grey scene; run one channel at a time, or remove `mix`"));
        }
        if method.mix && method.estimator != EstimatorKind::Collision {
            return Err(Unfit::Mix("collision walks; choose estimator = \"collision\", or remove `mix`"));
        }
        if method.mix && matches!(method.direction, Direction::Jacobi { .. }) {
            return Err(Unfit::Mix("walks, not chains; remove `mix`"));
        }
        if method.batch.is_some() && (method.mix || method.direction != Direction::Shooting) {
            return Err(Unfit::Sobol);
        }
        check_final_gather(&scene, &method)?;
        let gathering = match &method.direction {
            Direction::Shooting | Direction::Jacobi { .. } => None,
            Direction::Gathering(birth) => {
                if let Birth::Patches(chosen) = birth {
                    check_patches(chosen, &scene)?;
                }
                Some(Gathering::new(&scene, &method, birth_probabilities(&scene, birth))?)
            }
        };
        let largest_radiosity = jacobi::largest_radiosity(&scene);
        let least_area = least_area(&scene);
        Ok(Experiment { scene, method, gathering, largest_radiosity, least_area })
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The method.
    pub fn method(&self) -> &Method {
        &self.method
    }

    /// Whether walks carry importance from the patches, not power from the emitters.
    pub fn gathers(&self) -> bool {
        self.gathering.is_some()
    }

    /// Where walks are born.
    pub(crate) fn births(&self) -> &Births {
        self.gathering.as_ref().map_or(self.scene.emitters(), |gathering| &gathering.births)
    }

    /// Whether walks are cut off while they still carry weight.
    pub fn is_biased(&self) -> bool {
        self.method.estimator == EstimatorKind::Infinite
            && !matches!(self.method.infinite, InfiniteEnd::Roulette { .. })
    }

    /// What a tally of M power sums keeps of each patch.
    pub fn layout<const M: usize>(&self) -> Layout {
        with_board!(&self.board_of::<M>(0), board => board.layout())
    }

    /// An empty tally of M power sums.
    pub fn tally<const M: usize>(&self) -> Tally {
        Tally::new(self.scene.faces().len(), self.layout::<M>())
    }

    /// An empty board.
    pub fn board<const M: usize>(&self) -> Board<M> {
        self.board_of(self.scene.faces().len())
    }

    fn board_of<const M: usize>(&self, faces: usize) -> Board<M> {
        if self.batch_paths().is_some() {
            return Board::Chains(ChainBoard::new(faces, self.scene.channels()));
        }
        self.board_of_walks(faces)
    }

    /// The board of single walks.
    fn board_of_walks<const M: usize>(&self, faces: usize) -> Board<M> {
        let hits =
            self.method.direction == Direction::Shooting && self.method.estimator != EstimatorKind::Infinite;
        match (self.scene.channels(), hits, self.method.mix) {
            (1, true, false) => Board::Hits(Scoreboard::new(faces)),
            (1, true, true) => Board::RelatedHits(Scoreboard::new(faces)),
            (1, false, false) => Board::Fixed(Scoreboard::new(faces)),
            (1, false, true) => Board::RelatedFixed(Scoreboard::new(faces)),
            _ => Board::Coloured(Scoreboard::new(faces)),
        }
    }

    /// Rays of a chain, where chains take the place of walks.
    pub fn chain_rays(&self) -> Option<u64> {
        match self.method.direction {
            Direction::Jacobi { chain_rays, .. } => Some(chain_rays),
            Direction::Shooting | Direction::Gathering(_) => None,
        }
    }

    /// Paths of a batch, where batches take the place of walks: rays of a chain, or walks that share a Sobol sequence.
    /// Batches are independent, what is within one is not.
    pub fn batch_paths(&self) -> Option<u64> {
        self.chain_rays().or(self.method.batch.map(|batch| batch.walks))
    }

    /// What a walk counts as in jobs: one path; a batch counts as all of its own.
    pub fn paths_per_walk(&self) -> u64 {
        self.batch_paths().unwrap_or(1)
    }

    /// Walks (or batches) number `walks.start` … `walks.end` − 1 of a sequence, onto a board that
    /// [`Experiment::board`] made.
    pub fn walk<const M: usize>(&self, sequence: &Sequence, walks: Range<u64>, board: &mut Board<M>) {
        self.walk_while(sequence, walks, board, &|| true);
    }

    /// The same, but a batch, which may be long, is given up once `go_on` says no; it is asked many times a second.
    /// What the board holds is of no use then.
    pub fn walk_while<const M: usize>(
        &self,
        sequence: &Sequence,
        walks: Range<u64>,
        board: &mut Board<M>,
        go_on: &dyn Fn() -> bool,
    ) {
        let counts = match (&self.gathering, board as &mut Board<M>) {
            (None, Board::Chains(board)) => self.batches(sequence, walks, board, go_on),
            (None, board) => self.shoot(&Source::Random(sequence, walks), board),
            (Some(gathering), board) => self.gather(gathering, sequence, walks, board),
        };
        with_board!(board, board => board.counts.add(&counts)).expect("64 bits outlast any process");
    }

    fn batches<const M: usize>(
        &self,
        sequence: &Sequence,
        batches: Range<u64>,
        board: &mut ChainBoard<M>,
        go_on: &dyn Fn() -> bool,
    ) -> Counts {
        let mut counts = Counts::default();
        for batch in batches {
            let outcome = match (&self.method.direction, self.method.batch) {
                (Direction::Jacobi { chain_rays, solve }, _) => {
                    jacobi::chain(&self.scene, sequence.walk(batch), *chain_rays, *solve, go_on)
                }
                (_, Some(plan)) => self.batch_of_walks(sequence, batch, plan, go_on),
                _ => unreachable!("only batches have boards of batches"),
            };
            let outcome = outcome.and_then(|outcome| self.gathered(outcome, sequence, batch, go_on));
            let Some(outcome) = outcome else { break };
            board.add(&self.largest_radiosity, &outcome);
            counts.add(&outcome.counts).expect("64 bits outlast any process");
        }
        counts
    }

    /// What the walks of one batch say of H.
    fn batch_of_walks(
        &self,
        sequence: &Sequence,
        batch: u64,
        Batch { walks, sampler }: Batch,
        go_on: &dyn Fn() -> bool,
    ) -> Option<Outcome> {
        let numbers = Quasi::new(sequence, batch, walks);
        let mut board = self.board_of_walks::<2>(self.scene.faces().len());
        let mut tally: Option<Tally> = None;
        for first in (0..walks).step_by(WALKS_AT_ONCE) {
            if !go_on() {
                return None;
            }
            let end = walks.min(first + WALKS_AT_ONCE as u64);
            let source = match sampler {
                Sampler::Random => Source::Random(sequence, batch * walks + first..batch * walks + end),
                Sampler::Sobol => Source::Sobol(&numbers, first..end),
            };
            let counts = self.shoot(&source, &mut board);
            with_board!(&mut board, board => board.counts.add(&counts))
                .expect("a batch is counted in 32 bits");
            match &mut tally {
                None => tally = Some(board.take().expect("few walks do not wrap a sum")),
                Some(tally) => board.add_to(tally).expect("few walks do not wrap a sum"),
            }
        }
        tally.map(|tally| self.outcome(&tally))
    }

    /// H of every face, and the counts of one walk, the batch.
    fn outcome(&self, tally: &Tally) -> Outcome {
        let (faces, channels) = (self.scene.faces(), self.scene.channels());
        let walks = tally.counts.walks;
        let irradiance = |(i, face): (usize, &Face), channel: usize| {
            let Meaning { unit, irradiance_per_event, .. } = self.meaning_of_shooting(face, channel, tally);
            tally.patch(i, channel)[0] as f64 / walks as f64 * unit * irradiance_per_event.unwrap_or(0.0)
        };
        let by_face = faces.iter().enumerate();
        let per_walk = |weights: [u128; 3]| weights.map(|weight| weight / u128::from(walks));
        Outcome {
            irradiance: by_face
                .flat_map(|(i, face)| (0..channels).map(move |c| irradiance((i, &face), c)))
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

    /// The same outcome but for the patches of the final gather.
    fn gathered(
        &self,
        mut outcome: Outcome,
        sequence: &Sequence,
        batch: u64,
        go_on: &dyn Fn() -> bool,
    ) -> Option<Outcome> {
        let chosen = &self.method.final_gather;
        if chosen.is_empty() {
            return Some(outcome);
        }
        let (faces, channels) = (FaceTable::new(&self.scene), self.scene.channels());
        let of_face = |(face, h): (&Face, &[f64])| {
            h.iter().enumerate().map(|(c, h)| face.reflectance[c] * h).collect::<Vec<f64>>()
        };
        let reflected: Vec<f64> =
            faces.list.iter().zip(outcome.irradiance.chunks_exact(channels)).flat_map(of_face).collect();
        let chosen: Vec<u32> = chosen.iter().flat_map(|&patch| self.scene.faces().of_patch(patch)).collect();
        let rng = sequence.walk(GATHERING_RAYS + batch);
        let rays = outcome.counts.rays / GATHERING_PART;
        let gathered = final_gather(&faces, &chosen, &reflected, rays, rng, go_on)?;
        for Gathered { face, irradiance, landed, rays } in gathered {
            let i = face as usize;
            outcome.irradiance[i * channels..][..channels].copy_from_slice(&irradiance);
            outcome.landed[i] += landed;
            outcome.counts.rays += rays;
        }
        Some(outcome)
    }

    /// Whether the rays of chains see both ways, which their links take for granted; `None` where the method has no links.
    /// An eighth of one chain's rays are shot for that, 2²⁰ at most.
    pub fn reciprocity(&self, sequence: &Sequence) -> Option<Reciprocity> {
        match self.method.direction {
            Direction::Jacobi { chain_rays, solve: Solve::Links } => {
                let rays = (chain_rays / 8).min(1 << 20);
                Some(jacobi::reciprocity(&self.scene, sequence.walk(RECIPROCITY), rays))
            }
            _ => None,
        }
    }

    /// The iterations of chain number `chain` one by one, in their order; `None` where the method has none. What they
    /// differ by says little of the error of their average: each begins where others have ended.
    pub fn iterations(&self, sequence: &Sequence, chain: u64) -> Option<Vec<Iteration>> {
        let Direction::Jacobi { chain_rays, solve: Solve::Iterations(plan) } = self.method.direction else {
            return None;
        };
        Some(jacobi::observed(&self.scene, sequence.walk(chain), chain_rays, plan))
    }

    fn shoot<const M: usize>(&self, source: &Source, board: &mut Board<M>) -> Counts {
        let births = self.scene.emitters();
        match board {
            Board::Hits(board) => {
                walk_by_estimator!(self, Analog, births, source, V => &mut ShootHits::<V, M>::new(self.scene.isa, board))
            }
            Board::RelatedHits(board) => self.walk_all(births, source, Analog, &mut ShootRelated::new(board)),
            Board::Fixed(board) => {
                let fate = Infinite::new(self.method.infinite);
                self.walk_all(births, source, fate, &mut ShootWeights::<Collision, 1, M>::new(board))
            }
            Board::Coloured(board) => {
                walk_by_estimator!(self, Coloured::new(), births, source, V => &mut ShootWeights::<V, 3, M>::new(board))
            }
            Board::RelatedFixed(_) | Board::Chains(_) => {
                unreachable!("shooting walks that are never cut off score hits, and chains are no walks")
            }
        }
    }

    fn gather<const M: usize>(
        &self,
        gathering: &Gathering,
        sequence: &Sequence,
        walks: Range<u64>,
        board: &mut Board<M>,
    ) -> Counts {
        let births = &gathering.births;
        let source = &Source::Random(sequence, walks);
        match (board, &gathering.values) {
            (Board::Fixed(board), Values::Grey(values)) => {
                walk_by_estimator!(self, Analog, births, source, V => &mut Gather::<V, 1, M>::new(board, values))
            }
            (Board::Coloured(board), Values::Coloured(values)) => {
                walk_by_estimator!(self, Coloured::new(), births, source, V => &mut Gather::<V, 3, M>::new(board, values))
            }
            (Board::RelatedFixed(board), Values::Related(values)) => {
                self.walk_all(births, source, Analog, &mut GatherRelated::new(board, values))
            }
            _ => unreachable!("boards and values are both made for the channels of the scene"),
        }
    }

    fn walk_all<const C: usize>(
        &self,
        births: &Births,
        source: &Source,
        fate: impl Fate<C>,
        score: &mut impl Estimator<C>,
    ) -> Counts {
        let (scene, space) = (&self.scene, self.method.space);
        match source {
            Source::Random(sequence, walks) => {
                walk_all(scene, births, space, sequence, walks.clone(), fate, score)
            }
            Source::Sobol(numbers, walks) => {
                let starts = walks.clone().map(|walk| Place::start(walk as u32));
                walk_each(scene, births, space, *numbers, starts, fate, score)
            }
        }
    }
}

fn check_patches(chosen: &[u32], scene: &Scene) -> Result<(), Unfit> {
    let patches = scene.faces().patch_count();
    let unknown = chosen.iter().find(|&&patch| patch as usize >= patches);
    unknown.map_or(Ok(()), |&patch| Err(Unfit::NoSuchPatch { patch, patches }))
}

/// What is gathered must be what batches of discrete collision walks, or chains, have found.
fn check_final_gather(scene: &Scene, method: &Method) -> Result<(), Unfit> {
    let walks = !matches!(method.direction, Direction::Jacobi { .. });
    check_patches(&method.final_gather, scene)?;
    match method {
        _ if method.final_gather.is_empty() => Ok(()),
        Method { space: Space::Continuous, .. } => Err(Unfit::FinalGather("discrete walks")),
        _ if method.estimator != EstimatorKind::Collision => Err(Unfit::FinalGather("collision walks")),
        Method { batch: None, .. } if walks => Err(Unfit::FinalGather("batches of shooting walks")),
        _ => Ok(()),
    }
}

impl<const M: usize> Board<M> {
    /// Hands over all that was scored and empties the board.
    ///
    /// # Errors
    /// Where a sum may have wrapped.
    pub fn take(&mut self) -> Result<Tally, Overflow> {
        with_board!(self, board => board.take())
    }

    /// Adds all that was scored to a tally of the same experiment and empties the board.
    ///
    /// # Errors
    /// Where a sum may have wrapped or leaves its range; then the tally is unusable.
    pub fn add_to(&mut self, tally: &mut Tally) -> Result<(), Overflow> {
        with_board!(self, board => board.add_to(tally))
    }
}

impl Gathering {
    fn new(scene: &Scene, method: &Method, probability: Vec<f64>) -> Result<Self, Unfit> {
        let births =
            Births::new(scene.surfaces(), scene.faces(), |i| probability[i]).expect("probabilities sum to 1");
        let b_bar = PER_CHANNEL.map(|c| most(scene, c, |s| s.emittance[c] / (1.0 - s.reflectance[c])));
        let kinds = if method.mix { &RELATED_KINDS[..] } else { std::slice::from_ref(&method.estimator) };
        let largest_value = PER_CHANNEL.map(|c| {
            let of_kind = |&kind: &EstimatorKind| most(scene, c, |face| value(face, kind, c));
            kinds.iter().map(of_kind).fold(0.0, f64::max)
        });
        if !largest_value.iter().all(|value| value.is_finite()) {
            let black = |face: &Face| face.emittance.is_lit() && !face.reflectance.is_lit();
            let black = scene.faces().iter().find(black).expect("dividing by no other σ is infinite");
            return Err(Unfit::BlackEmitter { patch: black.patch as usize });
        }
        // A channel without light has no value anywhere.
        let scaled = |face: &Face, kind, c: usize| match value(face, kind, c) {
            0.0 => 0.0,
            value => value / largest_value[c],
        };
        let patches = scene.faces().iter();
        let values = match (method.mix, scene.channels()) {
            (true, _) => Values::Related(patches.map(|p| RELATED_KINDS.map(|k| scaled(&p, k, 0))).collect()),
            (_, 1) => Values::Grey(patches.map(|p| [scaled(&p, method.estimator, 0)]).collect()),
            _ => Values::Coloured(
                patches.map(|p| PER_CHANNEL.map(|c| scaled(&p, method.estimator, c))).collect(),
            ),
        };
        let ratio_bound = PER_CHANNEL.map(|c| {
            if largest_value[c] == 0.0 {
                return 1.0;
            }
            // Below 1 only where related estimators share a unit.
            (largest_ratio(scene, method.estimator, b_bar[c], c) / largest_value[c]).max(1.0)
        });
        Ok(Gathering { births, probability, values, largest_value, b_bar, ratio_bound })
    }
}

const PER_CHANNEL: [usize; 3] = [0, 1, 2];

/// In the order of `estimator::RELATED`.
const RELATED_KINDS: [EstimatorKind; 3] =
    [EstimatorKind::Collision, EstimatorKind::Absorption, EstimatorKind::Survival];

/// What an event on a face is worth to a gathering walk of weight 1 [W/m²]: E, over the probability of the event
/// after an arrival.
fn value(face: &Face, kind: EstimatorKind, channel: usize) -> f64 {
    let (emittance, survival) = (face.emittance[channel], face.reflectance.max());
    match kind {
        _ if emittance == 0.0 => 0.0,
        EstimatorKind::Absorption => emittance / (1.0 - survival),
        EstimatorKind::Survival => emittance / survival,
        EstimatorKind::Collision | EstimatorKind::Infinite | EstimatorKind::Direct => emittance,
    }
}

fn least_area(scene: &Scene) -> f64 {
    scene.faces().iter().map(|face| face.area).fold(f64::INFINITY, f64::min)
}

/// The largest of a value over the sources of a channel.
fn most(scene: &Scene, channel: usize, value: impl Fn(&Face) -> f64) -> f64 {
    let sources = scene.faces().iter().filter(|face| face.emittance[channel] > 0.0);
    sources.fold(0.0, |max, source| value(&source).max(max))
}

/// A bound on E[x²]/E[x] of gathered scores x [W/m²] in one channel, whose weights never exceed 1. With b_s ≤
/// R_s·B̄ (S97 §3) the variances of theory give max_s (E_s + 2R_sB̄), over σ_s for survival; an absorption scores
/// once, at most max_s E_s/(1 − σ_s). Rounding at random adds less than a unit to a score.
fn largest_ratio(scene: &Scene, estimator: EstimatorKind, b_bar: f64, channel: usize) -> f64 {
    let collisions = |s: &Face| s.emittance[channel] + 2.0 * s.reflectance[channel] * b_bar;
    let largest = match estimator {
        EstimatorKind::Absorption | EstimatorKind::Direct => {
            most(scene, channel, |s| value(s, estimator, channel))
        }
        EstimatorKind::Survival => most(scene, channel, |s| collisions(s) / s.reflectance.max()),
        EstimatorKind::Collision | EstimatorKind::Infinite => most(scene, channel, collisions),
    };
    largest * (1.0 + 1e-9)
}

/// What the sums of one score on one face mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Meaning {
    /// One unit of score, in events (hits; for gathering, events of the largest value).
    pub unit: f64,
    /// H per event: incoming power over area [W/m²]. `None` where the estimator cannot tell it (survival on a
    /// face of reflectance 0).
    pub irradiance_per_event: Option<f64>,
    /// A bound on E[x²]/E[x], x in events.
    pub ratio_bound: f64,
    /// A bound on how much too small b may be [W/m²]: walks that were cut off.
    pub bias_bound: f64,
}

impl Experiment {
    /// What the sums of face i mean in one channel; `None` where no walk can tell of it (gathering, p_i = 0).
    pub fn meaning(&self, i: usize, channel: usize, tally: &Tally) -> Option<Meaning> {
        self.meaning_of((i, &self.scene.faces().get(i)), channel, tally)
    }

    /// The same for a face that is at hand.
    pub(crate) fn meaning_of(
        &self,
        (i, face): (usize, &Face),
        channel: usize,
        tally: &Tally,
    ) -> Option<Meaning> {
        if self.batch_paths().is_some() {
            return Some(self.meaning_of_batches(face, channel, tally));
        }
        match &self.gathering {
            None => Some(self.meaning_of_shooting(face, channel, tally)),
            Some(gathering) => {
                self.meaning_of_gathering(gathering, (i, face), channel, tally.layout().moments)
            }
        }
    }

    /// A batch scores H itself, over the largest radiosity there can be. Solved links do not exceed that; rays and walks
    /// cannot bring in more than all the light that is under way, Φ_T/(1 − R_max) at most. A final gather may find all of
    /// it on the smallest face, and emitters by both kinds of its rays.
    fn meaning_of_batches(&self, face: &Face, channel: usize, tally: &Tally) -> Meaning {
        let (scene, largest) = (&self.scene, self.largest_radiosity[channel]);
        let walks = self.method.batch.map(|_| self.meaning_of_shooting(face, channel, tally));
        let all = scene.total_power(channel) / (1.0 - scene.max_reflectance()[channel]);
        let gathered = self.method.final_gather.contains(&face.patch);
        let most = if gathered {
            1.0 + LIGHT_BY_SHADOW_RAYS + all / self.least_area / largest
        } else {
            all / face.area / largest
        };
        let links = matches!(self.method.direction, Direction::Jacobi { solve: Solve::Links, .. });
        Meaning {
            unit: 1.0 / jacobi::UNITS,
            irradiance_per_event: walks
                .is_none_or(|walks| walks.irradiance_per_event.is_some())
                .then_some(largest),
            ratio_bound: if links && !gathered { 1.0 } else { most.max(1.0) },
            bias_bound: walks.map_or(0.0, |walks| walks.bias_bound),
        }
    }

    /// b_i = (R_i/A_i)φ_i, φ_i = Φ_T × the mean score, × 1/(1 − σ_i) for absorption, 1/σ_i for survival.
    ///
    /// A planar face cannot hit itself, so between two visits a walk survives on it and on another face: it
    /// returns with probability at most σ_i·σ_max. Visits after the first are then at most geometric, m =
    /// 1/(1 − σ_i·σ_max) of them in the mean, and E[x²]/E[x] ≤ 2m − 1 of the largest weight w there can be. A
    /// weight that is multiplied by R_i·R_max between visits scores at most m·w in all.
    fn meaning_of_shooting(&self, face: &Face, channel: usize, tally: &Tally) -> Meaning {
        let per_hit = self.scene.total_power(channel) / face.area;
        let (survival, most) = (face.reflectance.max(), self.scene.max_reflectance());
        let visits = 1.0 / (1.0 - survival * most.max());
        let weakened = 1.0 / (1.0 - face.reflectance[channel] * most[channel]);
        let weight = self.scene.emitters().largest_weights()[channel];
        let (scale, ratio_bound) = match self.method.estimator {
            EstimatorKind::Absorption => (Some(1.0 / (1.0 - survival)), 1.0),
            EstimatorKind::Survival => ((survival > 0.0).then(|| 1.0 / survival), 2.0 * visits - 1.0),
            EstimatorKind::Collision => (Some(1.0), 2.0 * visits - 1.0),
            EstimatorKind::Infinite => (Some(1.0), weakened),
            EstimatorKind::Direct => (Some(1.0), 1.0),
        };
        // Power that was cut off would have come in here at most so many times.
        let counts = &tally.counts;
        let cut_off =
            counts.truncated_weight[channel] as f64 / Counts::WEIGHT_UNITS / counts.walks.max(1) as f64;
        Meaning {
            unit: if tally.layout().events { 1.0 / fixed_units(tally.layout().moments) } else { 1.0 },
            irradiance_per_event: scale.map(|scale| scale * per_hit),
            // A colour of light that all emitters share has weights of 1, but for rounding.
            ratio_bound: (weight * ratio_bound).max(1.0),
            bias_bound: face.reflectance[channel] * per_hit * cut_off * weakened,
        }
    }

    /// b_i = R_i × the mean score / p_i.
    fn meaning_of_gathering(
        &self,
        gathering: &Gathering,
        (i, face): (usize, &Face),
        channel: usize,
        moments: usize,
    ) -> Option<Meaning> {
        let probability = gathering.probability[i];
        if probability == 0.0 {
            return None;
        }
        // What is left of a walk that is cut off is worth at most its weight times B̄.
        let cut_off = match (self.method.estimator, self.method.infinite) {
            (EstimatorKind::Infinite, InfiniteEnd::Cutoff { threshold }) => threshold,
            (EstimatorKind::Infinite, InfiniteEnd::Length { length }) => {
                self.scene.max_reflectance()[channel].powi(length as i32)
            }
            _ => 0.0,
        };
        let reflectance = face.reflectance[channel];
        Some(Meaning {
            unit: 1.0 / fixed_units(moments),
            irradiance_per_event: Some(gathering.largest_value[channel] / probability),
            ratio_bound: gathering.ratio_bound[channel],
            bias_bound: reflectance * cut_off * gathering.b_bar[channel],
        })
    }
}
