//! The table `[method]` as a whole.

use radiosity::{
    EstimatorKind, Space,
    methods::{Sampler, Solve},
};

use super::batches::{ChainKeys, read_batch, read_sampler, settle_batches, settle_jacobi};
use super::chains::{read_final_gather, read_solve};
use super::table::{BasisKey, Beside, MethodTable, WalkKind};
use super::walks::{read_birth, read_infinite};
use crate::budget::Budget;
use crate::document::{KeyTable, Value};
use crate::error::Error;
use crate::word::Keyword;

/// The patches that a method is for.
pub(crate) struct PatchPurpose {
    /// How many there are; `None` where the program has yet to cut them.
    pub(crate) patches: Option<u64>,
    /// Whether a job that names no basis takes the linear one, where its method has it.
    pub(crate) linear: bool,
    /// Where walks go on from if the job does not say so, where its method has the choice.
    pub(crate) space: Space,
    /// Whether chains cannot know all of its light: there are lamps without area, or panes.
    pub(crate) walks_only: bool,
}

/// Reads `[method]`, for a scene that is cut so and a budget; says what was not done as asked.
pub(crate) fn read_method(
    mut table: KeyTable<'_>,
    cutting: &PatchPurpose,
    budget: &Budget,
) -> Result<(MethodTable, Option<String>), Error> {
    let patch_count = cutting.patches;
    let names = ["space", "basis"].map(|key| table.has_any(&[key]));
    let walk = table.word("walk")?;
    let is_random = table.says("sampler", Sampler::Random.word());
    let sampler = table.take("sampler");
    let jacobi = table.take("jacobi").map(|value| read_solve(value, walk)).transpose()?.unwrap_or_default();
    let places = ChainKeys { walk: table.place("walk"), batch: table.place("batch_paths") };
    let estimator_place = table.place("estimator");
    let final_gather = table.take("final_gather");
    let mut method = MethodTable {
        walk,
        estimator: table.word("estimator")?,
        space: table.word("space")?,
        sampler: Sampler::default(),
        infinite: table.take("infinite").map(read_infinite).transpose()?.unwrap_or_default(),
        birth: table
            .take("birth")
            .map(|value| read_birth(value, patch_count))
            .transpose()?
            .unwrap_or_default(),
        beside: read_beside(table.take("mix"), table.take("basis"))?,
        batch_paths: table.take("batch_paths").map(|value| read_batch(&value)).transpose()?,
        jacobi,
        final_gather: Vec::new(),
    };
    if method.beside == Beside::Mix && method.estimator != EstimatorKind::Collision {
        return Err(Error::Refused {
            place: estimator_place,
            problem: format!("{:?} beside mix = true", method.estimator.word()),
            why: "the mix is of walks that score by collision",
            remedy: "remove one of the two".into(),
        });
    }
    let is_free = walk != WalkKind::Jacobi && final_gather.is_none();
    if is_free && !names[0] {
        method.space = cutting.space;
    }
    if is_free && !names[1] && cutting.linear && method.beside == Beside::Nothing {
        method.beside = Beside::Slopes;
    }
    if let Some(value) = final_gather {
        method.final_gather = read_final_gather(value, &method, patch_count)?;
    }
    // Links follow Sobol sequences: who asks for random numbers asks for walks.
    let walks_only = cutting.walks_only || (is_random && jacobi == Solve::Links);
    let note = settle_jacobi(&mut method, &places, (patch_count, walks_only), budget)?;
    method.sampler = read_sampler(sampler, walk, &method)?;
    settle_batches(&mut method, &places, budget)?;
    if let Solve::Iterations(iterations) = &mut method.jacobi {
        iterations.sampler = method.sampler;
    }
    Ok((method, note))
}

/// What is found out beside the means: one thing at most.
fn read_beside(mix: Option<Value<'_>>, basis: Option<Value<'_>>) -> Result<Beside, Error> {
    let mix = mix.map(|value| value.boolean()).transpose()?.unwrap_or_default();
    let Some(basis) = basis else { return Ok(if mix { Beside::Mix } else { Beside::Nothing }) };
    match (mix, basis.word()?) {
        (true, BasisKey::Linear) => Err(basis.refuse(
            "mix = true has no linear basis".into(),
            "the best mix is one of the means of patches",
            "remove one of the two",
        )),
        (true, BasisKey::Constant) => Ok(Beside::Mix),
        (false, BasisKey::Linear) => Ok(Beside::Slopes),
        (false, BasisKey::Constant) => Ok(Beside::Nothing),
    }
}
