//! The digest that names an answer.

use radiosity::{
    Birth,
    groups::PatchGroup,
    methods::{AbsorptionMode, InfiniteEnd, Iterations, Solve},
    sensors::{SensorSpec, Sensors},
};

use super::table::{Beside, MethodTable, WalkKind};
use crate::word::Keyword;

/// Names an answer but for the number of walks: equal for equal scene, method, seed, sensors, sources and materials whose
/// influence is measured (`groups`).
///
/// `scene_hash` is [`radiosity::Scene::hash`]. What the method does not use (where gathering walks are born,
/// while they are shot) does not enter, nor do budget, target, confidence, index and names. Sensors are no part of the scene,
/// but tallies hold what they gather; so it is with groups.
pub fn job_hash(
    scene_hash: [u8; 32],
    method: &MethodTable,
    sensors: &[SensorSpec],
    groups: [&[PatchGroup]; 2],
    seed: u64,
) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    let mut field = |bytes: &[u8]| {
        hasher.update(&(bytes.len() as u64).to_le_bytes());
        hasher.update(bytes);
    };
    field(b"radwalk job");
    field(&scene_hash);
    field(&seed.to_le_bytes());
    hash_method(method, &mut field);
    if !sensors.is_empty() {
        field(b"sensors");
        field(&Sensors::hash(sensors));
    }
    for (word, groups) in [&b"sources"[..], b"materials"].into_iter().zip(groups) {
        if !groups.is_empty() {
            field(word);
            field(&PatchGroup::hash(groups));
        }
    }
    *hasher.finalize().as_bytes()
}

fn hash_method(method: &MethodTable, field: &mut impl FnMut(&[u8])) {
    field(method.walk.word().as_bytes());
    field(method.estimator.word().as_bytes());
    field(method.space.word().as_bytes());
    field(method.sampler.word().as_bytes());
    if method.estimator.absorption() == AbsorptionMode::Implicit {
        let (end, number) = words_of_end(method.infinite);
        field(end.as_bytes());
        field(&number.to_bits().to_le_bytes());
    }
    if method.walk == WalkKind::Gathering {
        match &method.birth {
            Birth::Area => field(b"area"),
            Birth::Uniform => field(b"uniform"),
            Birth::Patches(patches) => {
                field(b"patches");
                field(&numbers(patches));
            }
        }
    }
    match method.beside {
        Beside::Nothing => {}
        Beside::Mix => field(b"mix"),
        Beside::Slopes => field(b"linear"),
    }
    if method.is_in_batches() {
        // No number of walks is 0.
        field(&method.batch_paths.unwrap_or(0).to_le_bytes());
    }
    if let (WalkKind::Jacobi, Solve::Iterations(Iterations { births, regular, .. })) =
        (method.walk, method.jacobi)
    {
        field(b"iterations");
        field(births.word().as_bytes());
        field(&regular.to_le_bytes());
    }
    if (method.walk, method.jacobi) == (WalkKind::Jacobi, Solve::Links) {
        // Chains of links alone, as they were, have other bytes.
        field(b"shadow rays");
    }
    if !method.final_gather.is_empty() {
        field(b"final gather");
        field(&numbers(&method.final_gather));
    }
}

fn words_of_end(end: InfiniteEnd) -> (&'static str, f64) {
    match end {
        InfiniteEnd::Roulette { threshold } => ("roulette", threshold),
        InfiniteEnd::Cutoff { threshold } => ("cutoff", threshold),
        InfiniteEnd::Length { length } => ("length", f64::from(length)),
    }
}

fn numbers(patches: &[u32]) -> Vec<u8> {
    patches.iter().flat_map(|patch| patch.to_le_bytes()).collect()
}
