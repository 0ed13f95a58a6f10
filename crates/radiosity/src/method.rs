//! The kind of sample and its scores: the choices of a job. Types allow only combinations that are correct.

use serde::{Deserialize, Serialize};

use crate::jacobi::plan::Solve;
use crate::random::Sampler;
use crate::walk::Space;
use crate::walk::estimator::{Estimator, EstimatorKind};

/// Where gathering walks are born.
///
/// ```
/// use radiosity::{Birth, EstimatorKind, Method};
///
/// let of_two = Method::gathering(Birth::Patches(vec![0, 7]), EstimatorKind::Collision);
/// assert!(of_two.unit().is_walk());
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Birth {
    /// On each patch in proportion to its active area.
    #[default]
    Area,
    /// On each patch alike.
    Uniform,
    /// On each of these patches alike (by number), nowhere else.
    Patches(Vec<u32>),
}

/// The direction of walks: from the emitters (shooting), or from the patches (gathering).
///
/// ```
/// use radiosity::{Direction, EstimatorKind, Method};
///
/// assert_eq!(Method::shooting(EstimatorKind::Collision).direction(), Some(&Direction::Shooting));
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Direction {
    /// From the emitters, carrying power (S97 §2).
    Shooting,
    /// From patches, looking for emitters (S97 §3).
    Gathering(Birth),
}

/// What walks are scored by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Score {
    /// The scores of one estimator.
    Of(Estimator),
    /// Collision, with absorption and survival of the same walks beside it, to find the best mix of both (S97 §2.6, §3.7).
    /// Of grey scenes only.
    Mix,
    /// One estimator, and how its scores are spread over their patches: the linear basis.
    Linear(Estimator),
}

impl<E: Into<Estimator>> From<E> for Score {
    fn from(estimator: E) -> Self {
        Score::Of(estimator.into())
    }
}

impl Score {
    /// The estimator whose scores are the answer.
    pub fn estimator(self) -> Estimator {
        match self {
            Score::Of(estimator) | Score::Linear(estimator) => estimator,
            Score::Mix => Estimator::Collision,
        }
    }
}

/// Walks that are samples each.
///
/// ```
/// use radiosity::{EstimatorKind, Method, Space, Walks};
///
/// let walks = Walks { space: Space::Continuous, ..Walks::shooting(EstimatorKind::Absorption) };
/// assert_eq!(Method::Walks(walks).space(), Space::Continuous);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Walks {
    /// Which way they run.
    pub direction: Direction,
    /// Where they go on from.
    pub space: Space,
    /// The scores of the walks.
    pub score: Score,
}

impl Walks {
    /// Discrete walks from the emitters.
    pub fn shooting(score: impl Into<Score>) -> Self {
        Walks { direction: Direction::Shooting, space: Space::Discrete, score: score.into() }
    }

    /// Discrete walks from the patches.
    pub fn gathering(birth: Birth, score: impl Into<Score>) -> Self {
        Walks { direction: Direction::Gathering(birth), ..Walks::shooting(score) }
    }
}

/// Shooting walks of which many are one sample together.
#[derive(Clone, Debug, PartialEq)]
pub struct Batches {
    /// Walks of a batch.
    pub walks: u64,
    /// Where their numbers come from: one randomised Sobol sequence for all of them, or independent ones.
    pub sampler: Sampler,
    /// What becomes of them.
    pub score: BatchScore,
}

/// What the walks of a batch score.
#[derive(Clone, Debug, PartialEq)]
pub enum BatchScore {
    /// An estimator, of walks in a space.
    Of(Estimator, Space),
    /// An estimator, of walks in a space, and how its scores are spread over their patches: the linear basis.
    Linear(Estimator, Space),
    /// Collision in discrete space; then rays of their own gather the light of these patches from what the batch has
    /// found elsewhere (final gather).
    FinalGather(Vec<u32>),
}

impl BatchScore {
    pub(crate) fn of_walks(&self) -> (Estimator, Space) {
        match self {
            BatchScore::Of(estimator, space) | BatchScore::Linear(estimator, space) => (*estimator, *space),
            BatchScore::FinalGather(_) => (Estimator::Collision, Space::Discrete),
        }
    }
}

/// Chains of single rays between patches, one sample each: stochastic Jacobi (BS §4).
///
/// ```
/// use radiosity::Method;
///
/// let Method::Chains(chains) = Method::chains(4096) else { panic!("chains are asked for") };
/// assert_eq!(chains.rays, 4096);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Chains {
    /// Rays of a chain.
    pub rays: u64,
    /// What a chain makes of them.
    pub solve: Solve,
    /// Whether it tells how the light is spread over patches: the linear basis. Of links only.
    pub linear: bool,
    /// Patches whose light is gathered by rays of their own from what a chain has found elsewhere.
    pub final_gather: Vec<u32>,
}

/// A kind of sample and what it scores.
///
/// ```
/// use radiosity::{EstimatorKind, Method};
///
/// let methods = [Method::shooting(EstimatorKind::Collision), Method::chains(4096)];
/// assert_eq!(methods.map(|method| method.unit().is_chain()), [false, true]);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub enum Method {
    /// Walks, each a sample of its own.
    Walks(Walks),
    /// Batches of walks, each a sample.
    Batches(Batches),
    /// Chains of rays, each a sample.
    Chains(Chains),
}

/// The independent sample: what plans number, ledgers book and tallies count as one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// A single walk, independent of all others.
    Walk,
    /// A batch of walks that depend on each other.
    Batch {
        /// The walks of a batch.
        walks: u64,
    },
    /// A chain of rays.
    Chain {
        /// The rays of a chain.
        rays: u64,
    },
}

impl Unit {
    /// What one counts as in jobs: walks, or rays of chains.
    pub fn paths(self) -> u64 {
        match self {
            Unit::Walk => 1,
            Unit::Batch { walks } => walks,
            Unit::Chain { rays } => rays,
        }
    }

    /// Whether each walk is a sample of its own.
    pub fn is_walk(self) -> bool {
        self == Unit::Walk
    }

    /// Whether it is a chain.
    pub fn is_chain(self) -> bool {
        self.chain().is_some()
    }

    /// Paths that depend on each other, where a walk is no sample of its own: walks of a batch, or rays of a chain.
    pub fn batch(self) -> Option<u64> {
        (!self.is_walk()).then(|| self.paths())
    }

    /// Rays of a chain.
    pub fn chain(self) -> Option<u64> {
        match self {
            Unit::Chain { rays } => Some(rays),
            Unit::Walk | Unit::Batch { .. } => None,
        }
    }

    /// Several of them, in a word.
    pub fn word(self) -> &'static str {
        match self {
            Unit::Walk => "walks",
            Unit::Batch { .. } => "batches",
            Unit::Chain { .. } => "chains",
        }
    }
}

impl Method {
    /// Discrete walks from the emitters.
    pub fn shooting(score: impl Into<Score>) -> Self {
        Walks::shooting(score).into()
    }

    /// Discrete walks from the patches.
    pub fn gathering(birth: Birth, score: impl Into<Score>) -> Self {
        Walks::gathering(birth, score).into()
    }

    /// Batches of discrete collision walks from the emitters.
    pub fn batches(walks: u64, sampler: Sampler) -> Self {
        let score = BatchScore::Of(Estimator::Collision, Space::Discrete);
        Method::Batches(Batches { walks, sampler, score })
    }

    /// Chains that solve the system of their links.
    pub fn chains(rays: u64) -> Self {
        Method::Chains(Chains { rays, solve: Solve::default(), linear: false, final_gather: Vec::new() })
    }

    /// What is one sample.
    pub fn unit(&self) -> Unit {
        match *self {
            Method::Walks(_) => Unit::Walk,
            Method::Batches(Batches { walks, .. }) => Unit::Batch { walks },
            Method::Chains(Chains { rays, .. }) => Unit::Chain { rays },
        }
    }

    /// Which way walks run; `None` for chains.
    pub fn direction(&self) -> Option<&Direction> {
        match self {
            Method::Walks(walks) => Some(&walks.direction),
            Method::Batches(_) => Some(&Direction::Shooting),
            Method::Chains(_) => None,
        }
    }

    /// What walks are scored by; `None` for chains.
    pub fn estimator(&self) -> Option<Estimator> {
        match self {
            Method::Walks(walks) => Some(walks.score.estimator()),
            Method::Batches(batches) => Some(batches.score.of_walks().0),
            Method::Chains(_) => None,
        }
    }

    /// What walks are scored by, in a word; `None` for chains.
    pub fn estimator_kind(&self) -> Option<EstimatorKind> {
        self.estimator().map(Estimator::kind)
    }

    /// Where walks, or the rays of chains, go on from.
    pub fn space(&self) -> Space {
        match self {
            Method::Walks(walks) => walks.space,
            Method::Batches(batches) => batches.score.of_walks().1,
            Method::Chains(_) => Space::Discrete,
        }
    }

    /// Whether walks are scored by absorption and survival, too.
    pub fn is_mix(&self) -> bool {
        matches!(self, Method::Walks(Walks { score: Score::Mix, .. }))
    }

    /// Whether scores have slopes: what is known of a patch is linear over it.
    pub fn is_linear(&self) -> bool {
        matches!(
            self,
            Method::Walks(Walks { score: Score::Linear(_), .. })
                | Method::Batches(Batches { score: BatchScore::Linear(..), .. })
                | Method::Chains(Chains { linear: true, .. })
        )
    }

    /// Patches whose light is gathered by rays of their own.
    pub fn final_gather(&self) -> &[u32] {
        match self {
            Method::Batches(Batches { score: BatchScore::FinalGather(patches), .. }) => patches,
            Method::Chains(chains) => &chains.final_gather,
            Method::Walks(_) | Method::Batches(_) => &[],
        }
    }

    /// Whether walks are cut off while they still carry weight.
    pub fn is_biased(&self) -> bool {
        let end = self.estimator().and_then(Estimator::infinite_end);
        end.is_some_and(|end| end.is_biased())
    }
}

impl From<Walks> for Method {
    fn from(walks: Walks) -> Self {
        Method::Walks(walks)
    }
}

impl From<Batches> for Method {
    fn from(batches: Batches) -> Self {
        Method::Batches(batches)
    }
}

impl From<Chains> for Method {
    fn from(chains: Chains) -> Self {
        Method::Chains(chains)
    }
}
