//! A method in the words of job files.

use radiosity::{
    Direction, EstimatorKind, Method, Space,
    methods::{Iterations, RayBirths, Sampler, Solve},
};
use serde::Serialize;

/// How walks and scores are made, in the words of job files.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct MethodWords {
    /// The kind of walk: `shooting`, `gathering`, `jacobi`.
    pub walk: &'static str,
    /// The estimator: `collision`, `absorption`, …
    pub estimator: &'static str,
    /// The space of the walks: `discrete` or `continuous`.
    pub space: &'static str,
    /// The source of numbers: `random` or `sobol`.
    pub sampler: &'static str,
    /// What chains make of their rays.
    #[serde(skip)]
    pub chains: Option<String>,
}

impl MethodWords {
    /// The words of a method. Rays of chains count as collision walks of one ray.
    pub fn of(method: &Method) -> Self {
        let (chains, sampler) = match method {
            Method::Walks(_) => (None, Sampler::Random),
            Method::Batches(batches) => (None, batches.sampler),
            Method::Chains(chains) => match chains.solve {
                Solve::Links => (Some("links".into()), Sampler::Sobol),
                Solve::Iterations(iterations) => (Some(iterations_in_words(&iterations)), iterations.sampler),
            },
        };
        MethodWords {
            walk: match method.direction() {
                Some(Direction::Shooting) => "shooting",
                Some(Direction::Gathering(_)) => "gathering",
                None => "jacobi",
            },
            estimator: method.estimator_kind().unwrap_or(EstimatorKind::Collision).word(),
            space: match method.space() {
                Space::Discrete => "discrete",
                Space::Continuous => "continuous",
            },
            sampler: match sampler {
                Sampler::Random => "random",
                Sampler::Sobol => "sobol",
            },
            chains,
        }
    }
}

fn iterations_in_words(Iterations { births, regular, .. }: &Iterations) -> String {
    let births = match births {
        RayBirths::Systematic => "systematic",
        RayBirths::Multinomial => "multinomial",
    };
    format!("incremental iterations, then {regular} regular ones; {births} births")
}
