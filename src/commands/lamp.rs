//! `radwalk lamp`: what is in the file of a luminaire.

use std::path::PathBuf;

use report::write_atomically;
use std::io::Write;
use voice::say;

use crate::args::LampArgs;
use crate::fault::{Fault, Outcome};

/// Says what a luminaire is, and draws its polar curve. The place of the curve is checked first: a command that fails says nothing of the lamp.
pub(crate) fn lamp(args: &LampArgs) -> Result<Outcome, Fault> {
    let lamp = job::load_lamp(&args.file)?;
    let chart = chart(args);
    if let Some(chart) = chart.as_ref().filter(|chart| chart.exists() && !args.force) {
        return Err(Fault::Taken { path: chart.clone() });
    }
    if args.json {
        say(&lamp.json().to_string());
    } else if !args.quiet {
        lamp.lines().iter().for_each(|line| say(line));
    }
    let Some(chart) = chart else { return Ok(Outcome::Done) };
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

/// The file of the polar curve; `None` where JSON is all that is asked for.
fn chart(args: &LampArgs) -> Option<PathBuf> {
    // Two formats of one luminaire have one stem.
    let own = || PathBuf::from("out").join(args.file.file_name().unwrap_or(args.file.as_os_str()));
    let folder = args.out.clone().or_else(|| (!args.json).then(own));
    args.svg.clone().or_else(|| folder.map(|folder| folder.join("polar.svg")))
}
