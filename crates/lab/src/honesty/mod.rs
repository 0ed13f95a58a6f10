//! Whether the figures that the program reports are true: reported over true, for each figure, method and scene.
//!
//! `radwalk-lab honesty FOLDER [--quick] [SCENE…] [ROOM…]` writes `honesty.md` into the folder. Rooms are files of meshes or jobs, which are studied
//! beside the made scenes; the names of made scenes choose these alone; `--quick` takes a quarter of the seeds. Told is what `patches.csv` and
//! `summary.json` hold. The study fails where it takes figures that are false on purpose for true.

mod measure;
mod methods;
mod page;
mod scenes;
mod truth;

use std::path::{Path, PathBuf};

use self::measure::MethodRow;
use self::scenes::HonestyScene;
use crate::clock::process_seconds;
use crate::walking::Failure;

pub(crate) fn run(words: &[String]) -> Result<(), Failure> {
    let (folder, rest) = words.split_first().ok_or("usage: honesty FOLDER [--quick] [SCENE…] [ROOM…]")?;
    std::fs::create_dir_all(folder)?;
    let work = tempfile::tempdir()?;
    let sites = sites(rest, work.path())?;
    let mut rows: Vec<MethodRow> = Vec::new();
    for site in &sites {
        rows.extend(measure::all(site)?);
        page::write(&sites, &rows, Path::new(&folder))?;
        eprintln!("{}: {:.0} s of processor time", site.name, process_seconds());
    }
    match rows.iter().find(|row| row.is_control && !page::is_refused(row)) {
        Some(row) => Err(format!("{}: figures that are false on purpose pass", row.site).into()),
        None => Ok(()),
    }
}

/// The scenes that the words ask for: all made ones or those that are named, and rooms.
fn sites(words: &[String], work: &Path) -> Result<Vec<HonestyScene>, Failure> {
    let (quick, words): (Vec<&String>, Vec<&String>) = words.iter().partition(|word| *word == "--quick");
    let made = scenes::made();
    let (named, rooms): (Vec<&String>, Vec<&String>) =
        words.into_iter().partition(|word| made.iter().any(|(name, ..)| name == word));
    let mut sites = Vec::new();
    for (name, what, spec) in &made {
        if named.is_empty() || named.iter().any(|word| word == name) {
            sites.push(HonestyScene::made(name, what, spec, work)?);
        }
    }
    for room in rooms {
        sites.push(HonestyScene::room(&PathBuf::from(room))?);
    }
    sites.iter_mut().for_each(|site| site.slow |= !quick.is_empty());
    Ok(sites)
}
