//! Whether the figures that the program tells are true: told over true, for each figure, method and scene.
//!
//! `cargo run --release -p results --example honesty -- FOLDER [--quick] [ROOM…]` writes `honesty.md` into the folder. Rooms are files of meshes
//! or jobs, which are studied beside the made scenes; `--quick` takes a quarter of the seeds. Told is what `patches.csv` and `summary.json` hold.

mod measure;
mod methods;
mod page;
mod scenes;
mod truth;

use std::error::Error;
use std::path::{Path, PathBuf};

use crate::measure::Row;
use crate::scenes::Site;

type Failure = Box<dyn Error + Send + Sync>;

fn main() -> Result<(), Failure> {
    let mut args = std::env::args().skip(1);
    let folder = args.next().ok_or("usage: honesty FOLDER [--quick] [ROOM…]")?;
    let rest: Vec<String> = args.collect();
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
