//! The table `[method]`, and the walks that it takes.

use radiosity::{
    Birth, Chains, Direction, EstimatorKind, Space, Walks,
    methods::{BatchScore, Batches, InfiniteEnd, Sampler, Score, Solve},
};
use serde::{Deserialize, Serialize};

use crate::word::Keyword;

/// Which way walks run, and from where.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum WalkKind {
    /// Walks that start on the emitters.
    #[default]
    Shooting,
    /// Walks that start on the patches.
    Gathering,
    /// Chains of stochastic Jacobi.
    Jacobi,
    /// Whichever of them takes the least counted work.
    Auto,
}

impl Keyword for WalkKind {
    const ALL: &'static [Self] = &[Self::Shooting, Self::Gathering, Self::Jacobi, Self::Auto];

    fn word(self) -> &'static str {
        match self {
            WalkKind::Shooting => "shooting",
            WalkKind::Gathering => "gathering",
            WalkKind::Jacobi => "jacobi",
            WalkKind::Auto => "auto",
        }
    }
}

/// What walks find out beside the means of patches. Kept as a number, where earlier versions kept whether there is a mix.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Beside {
    /// Walks find the means of patches alone.
    #[default]
    Nothing,
    /// How absorption and survival score the same walks, and the best mix of both: `mix = true`.
    Mix,
    /// How the light is spread over patches: `basis = "linear"`.
    Slopes,
}

/// The functions that light is estimated by on a patch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum BasisKey {
    /// One number a patch, the mean of its light.
    #[default]
    Constant,
    /// The mean of a patch and two gradients.
    Linear,
}

impl Keyword for BasisKey {
    const ALL: &'static [Self] = &[Self::Constant, Self::Linear];

    fn word(self) -> &'static str {
        match self {
            BasisKey::Constant => "constant",
            BasisKey::Linear => "linear",
        }
    }
}

/// The table `[method]` of a job.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MethodTable {
    /// The kind of walk; default: shooting.
    pub walk: WalkKind,
    /// The events that score; default: collision.
    pub estimator: EstimatorKind,
    /// Where walks go on from; default: discrete.
    pub space: Space,
    /// The source of numbers; default: random.
    pub sampler: Sampler,
    /// Of the infinite estimator only. Default: roulette below a weight of 0.001.
    pub infinite: InfiniteEnd,
    /// Of gathering walks only. Default: by area.
    pub birth: Birth,
    /// What walks find out beside the means of patches. Default: nothing.
    pub beside: Beside,
    /// Rays of a chain, or walks that share a Sobol sequence: [`crate::load`] puts it where the job names none. Random
    /// walks have none.
    pub batch_paths: Option<u64>,
    /// What chains make of their rays; of Jacobi only. Default: links.
    pub jacobi: Solve,
    /// Patches, in ascending order, whose light rays of their own gather from what each batch or chain has found. Default:
    /// none.
    pub final_gather: Vec<u32>,
}

impl MethodTable {
    /// The walks, batches or chains that it takes, for the walk and sampler that are built.
    pub fn walks(&self) -> radiosity::Method {
        let (estimator, paths) = (self.estimator.ending(self.infinite), self.batch_paths.unwrap_or(0));
        let score = match self.beside {
            Beside::Nothing => Score::Of(estimator),
            Beside::Mix => Score::Mix,
            Beside::Slopes => Score::Linear(estimator),
        };
        let direction = match &self.walk {
            WalkKind::Jacobi => {
                let final_gather = self.final_gather.clone();
                let linear = self.beside == Beside::Slopes;
                return Chains { rays: paths, solve: self.jacobi, linear, final_gather }.into();
            }
            WalkKind::Gathering => Direction::Gathering(self.birth.clone()),
            WalkKind::Shooting | WalkKind::Auto => Direction::Shooting,
        };
        if !self.is_in_batches() {
            return Walks { direction, space: self.space, score }.into();
        }
        let score = match (self.final_gather.is_empty(), self.beside) {
            (true, Beside::Slopes) => BatchScore::Linear(estimator, self.space),
            (true, Beside::Nothing | Beside::Mix) => BatchScore::Of(estimator, self.space),
            (false, _) => BatchScore::FinalGather(self.final_gather.clone()),
        };
        Batches { walks: paths, sampler: self.sampler, score }.into()
    }

    /// Whether batches or chains take the place of walks.
    pub(super) fn is_in_batches(&self) -> bool {
        self.walk == WalkKind::Jacobi || self.sampler == Sampler::Sobol || !self.final_gather.is_empty()
    }
}
