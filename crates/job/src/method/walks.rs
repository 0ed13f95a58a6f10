//! Where gathering walks are born, and how infinite walks end.

use std::collections::HashSet;

use radiosity::{Birth, methods::InfiniteEnd};

use crate::document::Value;
use crate::error::Error;
use crate::keys::{BIRTH_KEYS, INFINITE_KEYS};
use crate::vocabulary::EndWord;
use crate::word::Keyword;

/// Reflections of an infinite walk of fixed length, unless the job says otherwise.
const DEFAULT_LENGTH: u32 = 20;

pub(super) fn read_infinite(value: Value<'_>) -> Result<InfiniteEnd, Error> {
    let mut table = value.table(INFINITE_KEYS)?;
    let end: EndWord = table
        .require("end", "a number alone does not say how walks end", "end = \"roulette\" beside it")?
        .word()?;
    let (threshold, length) = (table.take("threshold"), table.take("length"));
    let stray = if matches!(end, EndWord::Length) { &threshold } else { &length };
    if let Some(stray) = stray {
        let problem = format!("end = {:?} does not use this key", end.word());
        return Err(stray.refuse(problem, "it would be ignored silently", "remove one of the two"));
    }
    let threshold =
        threshold.map(|value| read_threshold(&value)).transpose()?.unwrap_or(InfiniteEnd::DEFAULT_THRESHOLD);
    let length = length.map(|value| read_length(&value)).transpose()?.unwrap_or(DEFAULT_LENGTH);
    Ok(match end {
        EndWord::Roulette => InfiniteEnd::Roulette { threshold },
        EndWord::Cutoff => InfiniteEnd::Cutoff { threshold },
        EndWord::Length => InfiniteEnd::Length { length },
    })
}

fn read_threshold(value: &Value<'_>) -> Result<f64, Error> {
    let threshold = value.number()?;
    if threshold > 0.0 && threshold < 1.0 {
        return Ok(threshold);
    }
    Err(value.refuse(
        format!("{threshold} is outside (0, 1)"),
        "weights fall from 1 towards 0: no walk or every walk would end",
        "choose 0 < threshold < 1",
    ))
}

fn read_length(value: &Value<'_>) -> Result<u32, Error> {
    let length =
        value.integer(1..=u64::from(u32::MAX), "a walk reflects at least once, counted in 32 bits")?;
    Ok(length as u32)
}

pub(super) fn read_birth(value: Value<'_>, patch_count: Option<u64>) -> Result<Birth, Error> {
    if value.is_string() {
        return match value.string()? {
            "area" => Ok(Birth::Area),
            "uniform" => Ok(Birth::Uniform),
            other => Err(Error::UnknownWord {
                place: value.place(),
                found: other.into(),
                hint: crate::near::hint(other, ["area", "uniform"].into_iter()),
                choices: "\"area\" or \"uniform\" or { patches = [7, 12] }".into(),
            }),
        };
    }
    let mut table = value.table(BIRTH_KEYS)?;
    let listed = table.require("patches", "walks must be born somewhere", "patches = [7, 12], by number")?;
    read_patches(listed, patch_count, "walks must be born somewhere", "write birth = \"area\"")
        .map(Birth::Patches)
}

/// A list of patches by number, `patch_count` of which there are if they are known yet; `why` it cannot be empty, and what to
/// write `instead`.
pub(crate) fn read_patches(
    listed: Value<'_>,
    patch_count: Option<u64>,
    why: &'static str,
    instead: &str,
) -> Result<Vec<u32>, Error> {
    let place = listed.place();
    let Some(patch_count) = patch_count else {
        return Err(listed.refuse(
            "patches have no numbers yet".into(),
            "patches = \"auto\" cuts them when the job is run",
            "cut the surfaces yourself, or take the partition of a run: [scene] patches = \"out/…/partition.toml\"",
        ));
    };
    let (mut patches, mut seen) = (Vec::new(), HashSet::new());
    for value in listed.array()? {
        let last = patch_count.saturating_sub(1).min(u64::from(u32::MAX));
        let patch = value.integer(0..=last, "the scene's patches are numbered from 0")? as u32;
        if !seen.insert(patch) {
            return Err(value.refuse(
                format!("patch {patch} is listed twice"),
                "each counts once",
                "list it once",
            ));
        }
        patches.push(patch);
    }
    if patches.is_empty() {
        return Err(Error::Refused {
            place,
            problem: "the list is empty".into(),
            why,
            remedy: format!("list a patch, or {instead}"),
        });
    }
    Ok(patches)
}
