//! What chains make of their rays, and which patches gather from what they find.

use radiosity::{
    EstimatorKind, Space,
    methods::{Iterations, Solve},
};

use super::table::{Beside, MethodTable, WalkKind};
use super::walks::read_patches;
use crate::document::Value;
use crate::error::Error;
use crate::keys::SOLVE_KEYS;
use crate::vocabulary::SolveWord;
use crate::word::Keyword;

/// What chains make of their rays; the sampler stands elsewhere.
pub(super) fn read_solve(value: Value<'_>, walk: WalkKind) -> Result<Solve, Error> {
    if walk != WalkKind::Jacobi {
        let problem = format!("walk = {:?} does not use this key", walk.word());
        return Err(value.refuse(
            problem,
            "it says what chains make of their rays",
            "remove it, or write walk = \"jacobi\"",
        ));
    }
    let mut table = value.table(SOLVE_KEYS)?;
    let solve: SolveWord = table
        .require("solve", "chains have two ways to a solution", "solve = \"iterations\" beside it")?
        .word()?;
    Ok(match solve {
        SolveWord::Links => Solve::Links,
        SolveWord::Iterations => Solve::Iterations(Iterations::default()),
    })
}

/// One in this many patches may be chosen for a final gather, so that each chosen patch gets several times the rays by
/// which a batch estimates a patch.
const FEW: u64 = 16;

pub(super) fn read_final_gather(
    value: Value<'_>,
    method: &MethodTable,
    patch_count: Option<u64>,
) -> Result<Vec<u32>, Error> {
    let fits = method.space == Space::Discrete
        && method.estimator == EstimatorKind::Collision
        && method.beside == Beside::Nothing;
    if method.walk == WalkKind::Gathering || !fits {
        return Err(value.refuse(
            "a final gather is for discrete collision walks that are shot, and for chains".into(),
            "it gathers what these have found of all other patches, and takes it for the patches' mean",
            "remove it, or `walk`, `estimator`, `space`, `mix` and `basis`",
        ));
    }
    let place = value.place();
    let instead = "remove the key: no light is gathered";
    let mut patches = read_patches(value, patch_count, "a final gather needs at least one patch", instead)?;
    let patch_count = patch_count.unwrap_or(0);
    let most = (patch_count / FEW).max(1);
    if patches.len() as u64 > most {
        return Err(Error::Refused {
            place,
            problem: format!("{} of {patch_count} patches are chosen", patches.len()),
            why: "the rays are shared among the chosen patches, and each would get too few to improve on walks and chains",
            remedy: format!("choose at most {most}, or remove the key"),
        });
    }
    patches.sort_unstable();
    Ok(patches)
}
