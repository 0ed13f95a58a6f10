//! Whether the figures that the program tells are true: told over true, for each figure, method and scene.
//!
//! `radwalk-lab honesty FOLDER [--quick] [ROOM…]` writes `honesty.md` into the folder. Rooms are files of meshes
//! or jobs, which are studied beside the made scenes; `--quick` takes a quarter of the seeds. Told is what `patches.csv` and `summary.json` hold.

mod measure;
mod methods;
mod page;
mod scenes;
mod truth;

use std::path::{Path, PathBuf};

use self::measure::Row;
use self::scenes::Site;
use crate::walking::Failure;

pub(crate) fn run(words: &[String]) -> Result<(), Failure> {
    let (folder, rest) = words.split_first().ok_or("usage: honesty FOLDER [--quick] [ROOM…]")?;
    let quick = rest.iter().any(|arg| arg == "--quick");
    let (made, work) = (scenes::made(), tempfile::tempdir()?);
    let mut sites = Vec::new();
    for (name, what, spec) in made {
        sites.push(Site::made(name, what, &spec, work.path())?);
    }
    for room in rest.iter().filter(|arg| *arg != "--quick") {
        sites.push(Site::room(&PathBuf::from(room))?);
    }
    sites.iter_mut().for_each(|site| site.slow |= quick);
    let mut rows: Vec<Row> = Vec::new();
    for site in &sites {
        rows.extend(measure::all(site)?);
        page::write(&sites, &rows, Path::new(&folder))?;
        eprintln!("{}: {:.0} s of processor time", site.name, scenes::processor_seconds());
    }
    Ok(())
}
