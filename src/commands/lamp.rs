//! `radwalk lamp`: what is in the file of a luminaire.

use std::path::PathBuf;

use report::write_atomically;
use std::io::Write;
use voice::say;

use crate::args::LampArgs;
use crate::fault::{Fault, Outcome};

/// Says what a luminaire is, and draws its polar curve.
pub(crate) fn lamp(args: &LampArgs) -> Result<Outcome, Fault> {
    let lamp = job::load_lamp(&args.file)?;
    if args.json {
        say(&lamp.json().to_string());
    } else if !args.quiet {
        lamp.lines().iter().for_each(|line| say(line));
    }
    let chart = args.svg.clone().unwrap_or_else(|| folder(args).join("polar.svg"));
    if chart.exists() && !args.force {
        return Err(Fault::Taken { path: chart });
    }
    if let Some(folder) = chart.parent() {
        std::fs::create_dir_all(folder)
            .map_err(|source| Fault::NotWritten { path: folder.into(), source })?;
    }
    write_atomically(&chart, |file| file.write_all(lamp.polar_svg().as_bytes()))?;
    if !args.json && !args.quiet {
        say(&format!("wrote {}", chart.display()));
    }
    Ok(Outcome::Done)
}

/// The output folder.
fn folder(args: &LampArgs) -> PathBuf {
    let name = args.file.file_stem().unwrap_or(args.file.as_os_str());
    args.out.clone().unwrap_or_else(|| PathBuf::from("out").join(name))
}
