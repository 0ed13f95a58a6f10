//! How many paths make a batch or a chain, and whether a budget has enough of them.

use radiosity::{
    EstimatorKind, Space,
    methods::{Sampler, Solve},
};

use super::table::{Beside, MethodTable, WalkKind};
use crate::budget::Budget;
use crate::document::Value;
use crate::error::{Error, SourceLocation};

/// Where the keys stand that chains may be refused by.
pub(super) struct ChainKeys {
    pub(super) walk: Box<SourceLocation>,
    pub(super) batch: Box<SourceLocation>,
}

/// Chains of a job without `batch_paths`, unless they would be too long; fewer make no interval.
const CHAINS: u64 = 8;

/// Rays per patch and chain below which intervals are too narrow where light hides: in two rooms that exchange 1 %, R =
/// 0.95. Links: with 16, 92 % cover, with 32, 94.3 %; and with fewer walks err less. Iterations: with 256,
/// 94.0 and 86 %, with 4,096 95.5 and 92 %.
fn rays_per_patch(solve: Solve) -> u64 {
    match solve {
        Solve::Links => 32,
        Solve::Iterations(_) => 1024,
    }
}

/// The fewest rays that a chain may have among `patches` patches.
pub fn fewest_chain_rays(solve: Solve, patches: u64) -> u64 {
    rays_per_patch(solve).saturating_mul(patches)
}

/// Rays of a patch are counted in 32 bits.
const MOST_CHAIN_RAYS: u64 = u32::MAX as u64;

/// Up to this number of patches there are so few pairs to link that chains may have any length.
const FEW_PATCHES: u64 = 1 << 12;

/// Among more patches every ray may be a link, which takes memory: more rays make more chains, not longer ones, unless
/// the job says otherwise.
const LONG_CHAIN: u64 = 1 << 24;

/// Decides between chains and walks: `auto` takes chains where they have rays enough, and `jacobi` without enough
/// falls back to walks and says so.
pub(super) fn settle_jacobi(
    method: &mut MethodTable,
    places: &ChainKeys,
    (patch_count, walks_only): (Option<u64>, bool),
    budget: &Budget,
) -> Result<Option<String>, Error> {
    // The rays of chains leave patches alone, and all that land count alike.
    if walks_only && method.walk == WalkKind::Auto {
        method.walk = WalkKind::Shooting;
    }
    let paths = budget.paths;
    let asked = method.walk;
    let may_be_linear = asked == WalkKind::Jacobi && method.jacobi == Solve::Links;
    let fits = method.space == Space::Discrete
        && method.estimator == EstimatorKind::Collision
        && (method.beside == Beside::Nothing || method.beside == Beside::Slopes && may_be_linear);
    match asked {
        WalkKind::Shooting | WalkKind::Gathering => return Ok(None),
        WalkKind::Jacobi if !fits => {
            return Err(Error::Refused {
                place: places.walk.clone(),
                problem: "\"jacobi\" solves the system of the patches from single rays".into(),
                why: "it has no other space than discrete, no estimators and no mix, and a linear basis with links alone",
                remedy: "remove `space`, `estimator`, `mix` and `basis`, or choose walk = \"shooting\""
                    .into(),
            });
        }
        WalkKind::Jacobi | WalkKind::Auto => {}
    }
    // Chains whose patches are not cut yet are settled when they are.
    let Some(patch_count) = patch_count else { return Ok(None) };
    let rays_per_patch = rays_per_patch(method.jacobi);
    let needed = fewest_chain_rays(method.jacobi, patch_count);
    let longest = if patch_count <= FEW_PATCHES { MOST_CHAIN_RAYS } else { LONG_CHAIN.max(needed) };
    let chain_rays = method.batch_paths.unwrap_or((paths / CHAINS).min(longest));
    if !fits || chain_rays < needed {
        method.walk = WalkKind::Shooting;
        return Ok((asked == WalkKind::Jacobi).then(|| {
            format!(
                "walk = \"jacobi\" fell back to shooting: a chain of {chain_rays} rays is too short for {patch_count} \
                 patches (below {rays_per_patch} rays per patch intervals may be too narrow); give budget.paths ≥ {}",
                needed.saturating_mul(CHAINS)
            )
        }));
    }
    whole_batches(chain_rays, "rays (a chain)", places, budget)?;
    method.walk = WalkKind::Jacobi;
    method.batch_paths = Some(chain_rays);
    Ok(None)
}

/// Walks draw random numbers unless asked otherwise, links follow Sobol sequences, iterations have the choice. `asked` is
/// what the job says, `method` what it becomes.
pub(super) fn read_sampler(
    value: Option<Value<'_>>,
    asked: WalkKind,
    method: &MethodTable,
) -> Result<Sampler, Error> {
    let (walks, links) = (method.walk != WalkKind::Jacobi, method.jacobi == Solve::Links);
    let default = if !walks && links { Sampler::Sobol } else { Sampler::Random };
    let Some(value) = value else { return Ok(default) };
    match value.word()? {
        // Chains that fell back to walks.
        _ if method.walk != asked && walks => Ok(default),
        Sampler::Sobol if walks && (asked != WalkKind::Shooting || method.beside == Beside::Mix) => Err(value.refuse(
            "\"sobol\" is for shooting walks without `mix`, and for chains".into(),
            "gathered scores are rounded at random, and gathering from every patch leaves each too few points to be even",
            "write \"random\"",
        )),
        Sampler::Random if !walks && links => Err(value.refuse(
            "\"random\" does not go with walk = \"jacobi\"".into(),
            "the rays of its patches follow Sobol sequences, which costs nothing and errs far less",
            "remove the key, or write jacobi = { solve = \"iterations\" }, which has both",
        )),
        sampler => Ok(sampler),
    }
}

/// Batches of a job of walks without `batch_paths`: between 16 and 31.
const BATCHES: u64 = 16;

/// Puts the number of walks of a batch: a power of 2 if the job names none, since that number of points of a Sobol
/// sequence is
/// spread most evenly.
pub(super) fn settle_batches(
    method: &mut MethodTable,
    places: &ChainKeys,
    budget: &Budget,
) -> Result<(), Error> {
    if method.walk == WalkKind::Jacobi || !method.is_in_batches() {
        return Ok(());
    }
    let most = (budget.paths / BATCHES).clamp(1, MOST_CHAIN_RAYS);
    let walks = method.batch_paths.unwrap_or(1 << most.ilog2());
    method.batch_paths = Some(walks);
    whole_batches(walks, "walks", places, budget)
}

/// Whether a budget has batches enough, and begins with one.
fn whole_batches(batch: u64, what: &str, places: &ChainKeys, budget: &Budget) -> Result<(), Error> {
    let Budget { paths, first_path, .. } = *budget;
    if paths / batch < CHAINS {
        return Err(Error::Refused {
            place: places.batch.clone(),
            problem: format!("{paths} paths make {} batches of {batch} {what}", paths / batch),
            why: "intervals come from what independent batches differ by, and 8 are the fewest that tell",
            remedy: format!("choose batch_paths ≤ {}, or more paths", paths / CHAINS),
        });
    }
    if !first_path.is_multiple_of(batch) {
        return Err(Error::Refused {
            place: places.batch.clone(),
            problem: format!("budget.first_path = {first_path} begins no batch of {batch} {what}"),
            why: "batches are shot whole",
            remedy: "choose a first_path that is a multiple of batch_paths".into(),
        });
    }
    Ok(())
}

pub(super) fn read_batch(value: &Value<'_>) -> Result<u64, Error> {
    value.integer(1..=MOST_CHAIN_RAYS, "a batch has at least one path, and they are counted in 32 bits")
}
