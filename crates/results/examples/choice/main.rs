//! What the program chooses without words against jobs that are tuned by hand: processor time to the same error.
//!
//! `cargo run --release -p results --example choice -- FOLDER MILLIONS ROOM…` writes `choice.md` into the folder. Rooms are meshes, or scenes in TOML
//! of which no cells are written. Light is measured at points of all faces against two references of so many million walks on small cells.

mod page;
mod runs;
mod truth;

use std::error::Error;
use std::path::Path;

use crate::runs::{Room, chosen, given};
use crate::truth::Truth;

type Failure = Box<dyn Error + Send + Sync>;

fn main() -> Result<(), Failure> {
    let mut args = std::env::args().skip(1);
    let usage = "usage: choice FOLDER MILLIONS ROOM…";
    let folder = args.next().ok_or(usage)?;
    let millions: u64 = args.next().ok_or(usage)?.parse()?;
    let files: Vec<String> = args.collect();
    let names: Vec<_> =
        files.iter().map(|file| Path::new(file).file_name().unwrap_or_default().to_string_lossy()).collect();
    let mut studied = Vec::new();
    for file in &files {
        let room = Room::new(Path::new(file))?;
        let truth = Truth::new(&room, millions * 1_000_000)?;
        let (chosen, given) = (chosen(&room, &truth)?, given(&room, &truth)?);
        studied.push((room, chosen, given));
        page::write(Path::new(&folder), (millions, &names.join(" ")), &studied)?;
    }
    Ok(())
}
