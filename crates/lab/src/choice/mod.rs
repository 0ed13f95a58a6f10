//! What the program chooses without words against jobs that are tuned by hand: processor time to the same error.
//!
//! `radwalk-lab choice FOLDER MILLIONS KEPT ROOM…` writes `choice.md` into the folder. Rooms are meshes, or scenes in TOML of which no cells are
//! written. Light is measured at points of all faces against two long runs on small patches, each of the number of walks that the command names. These
//! references stay in the folder KEPT, and are read from there the next time.

mod page;
mod runs;
pub(crate) mod survival;
mod truth;

use std::path::Path;

use self::runs::{ChoiceRoom, TrialPlan, chosen, given};
use self::truth::RoomReference;
use crate::walking::Failure;

pub(crate) fn run(words: &[String]) -> Result<(), Failure> {
    let mut args = words.iter();
    let usage = "usage: choice FOLDER MILLIONS KEPT ROOM…";
    let folder = args.next().ok_or(usage)?;
    let millions: u64 = args.next().ok_or(usage)?.parse()?;
    let kept = Path::new(args.next().ok_or(usage)?);
    let files: Vec<&String> = args.collect();
    let names: Vec<_> =
        files.iter().map(|file| Path::new(file).file_name().unwrap_or_default().to_string_lossy()).collect();
    let mut studied = Vec::new();
    for file in &files {
        let room = ChoiceRoom::new(Path::new(file))?;
        let truth = RoomReference::cached(&room, millions * 1_000_000, kept)?;
        let effort = TrialPlan::ROOM;
        let (chosen, given) = (chosen(&room, &truth, effort)?, given(&room, &truth, effort)?);
        studied.push((room, chosen, given));
        page::write(Path::new(folder), (millions, &names.join(" ")), &studied)?;
    }
    Ok(())
}
