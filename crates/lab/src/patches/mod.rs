//! What chosen patches save: walks and processor time to the same total error, against the best uniform grid of constants.
//!
//! `radwalk-lab patches docs/results [millions of walks of a reference] [scene]` writes
//! `patches.md`, a chart of each scene and a picture into the folder. With `spread` in place of a scene it writes `spread.md` alone: how truly
//! runs tell the spread of light over patches, and how truly they could.
//!
//! An error is noise, from the sample variances of a run, and discretisation, from a much finer solution. Uniform grids have
//! square cells of one size; the best of them is found by search.

mod oracle;
mod page;
mod pictures;
mod reported;
mod rooms;
mod runs;
mod spread;
mod study;
mod truth;

use std::path::Path;

use self::rooms::rooms;
use self::runs::Failure;
use self::study::PatchStudy;

pub(crate) fn run(words: &[String]) -> Result<(), Failure> {
    let mut args = words.iter();
    let folder = args.next().ok_or("usage: patches FOLDER [MILLIONS [SCENE | spread]]")?;
    let folder = Path::new(folder);
    let millions: u64 = args.next().map_or(Ok(100), |text| text.parse())?;
    let only = args.next();
    if only.is_some_and(|only| only == "spread") {
        return spread::write(folder, millions);
    }
    let mut studies = Vec::new();
    for room in rooms() {
        if only.is_none_or(|only| only == room.name) {
            let study = PatchStudy::new(&room, millions * 1_000_000)?;
            pictures::draw(&room, &study, folder)?;
            studies.push(study);
            page::write(&studies, millions, folder)?;
        }
    }
    Ok(())
}
