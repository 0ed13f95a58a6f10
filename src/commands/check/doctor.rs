//! What the doctor finds wrong with a scene, in words, and the copy without it.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use doctor::{Finding, Repair};
use job::Job;
use report::{OutputFolder, Picture};
use results::units;
use voice::say;

use crate::fault::Fault;

/// The most findings that are printed one by one; all of them are in the folder.
const TOLD: usize = 200;

/// The most surfaces of a finding that the screen names by number.
const NUMBERED: usize = 12;

/// The most findings that get a picture.
const PICTURED: usize = 12;

/// The file of all findings.
const FILE: &str = "doctor.txt";

/// Says what is wrong with the geometry of a job's scene, most power first, and writes it to a folder with pictures of the
/// worst. Nothing is written where nothing is wrong.
///
/// # Errors
/// A scene that cannot be built, and a folder that cannot be written.
pub(crate) fn report(job: &Job, out: Option<&Path>) -> Result<(), Fault> {
    let findings = doctor::examine(job.scene.spec()).map_err(|error| job.scene.locate(error))?;
    let unit = units(job.light).power;
    findings.iter().take(TOLD).for_each(|finding| say(&sentence(finding, unit, NUMBERED)));
    if let Some(more) = findings.len().checked_sub(TOLD).filter(|more| *more > 0) {
        say(&format!("and {more} more that cost less"));
    }
    say(&match findings.len() {
        0 => "the doctor finds nothing wrong".into(),
        1 => "the doctor finds one thing wrong".into(),
        count => format!("the doctor finds {count} things wrong"),
    });
    if findings.is_empty() {
        return Ok(());
    }
    let default = || PathBuf::from("out").join(format!("{}-doctor", job.name));
    write(job, &findings, &out.map_or_else(default, Path::to_path_buf))
}

fn picture_name(number: usize) -> String {
    format!("finding-{number:02}.png")
}

/// Writes every finding, and pictures of the first that are about surfaces. Those of an earlier report are replaced.
fn write(job: &Job, findings: &[Finding], path: &Path) -> Result<(), Fault> {
    let names: Vec<String> = (1..=PICTURED).map(picture_name).collect();
    let files: Vec<&str> = names.iter().map(String::as_str).chain([FILE]).collect();
    let folder = OutputFolder::claim(path, &files, true)?;
    let scene = job.build_scene()?;
    let unit = units(job.light).power;
    let mut text = String::new();
    for (number, finding) in (1..).zip(findings) {
        let line = format!("{number}. {}", sentence(finding, unit, usize::MAX));
        writeln!(text, "{line}").expect("a string takes any text");
    }
    folder.write(FILE, |file| file.write_all(text.as_bytes()))?;
    for (number, name) in (1..).zip(&names) {
        match findings.get(number - 1).filter(|finding| !finding.surfaces.is_empty()) {
            Some(finding) => {
                let picture = Picture::mark(&scene, &finding.surfaces);
                folder.write(name, |file| picture.write_png(file))?;
            }
            None => folder.remove(&[name])?,
        }
    }
    say(&format!("{FILE} and a picture of each of the worst findings are in {}", folder.path().display()));
    Ok(())
}

fn sentence(finding: &Finding, unit: &str, most: usize) -> String {
    let Finding { kind, surfaces, power, message } = finding;
    let mut numbers: Vec<String> = surfaces.iter().take(most).map(u32::to_string).collect();
    if let Some(more) = surfaces.len().checked_sub(most).filter(|more| *more > 0) {
        numbers.push(format!("and {more} more"));
    }
    let surfaces =
        if numbers.is_empty() { String::new() } else { format!(" [surface {}]", numbers.join(", ")) };
    format!("{}: {message}{surfaces} (about {power:.3e} {unit}); {}", kind.word(), kind.remedy())
}

/// Writes a copy of a job's scene in which flipped surfaces are turned round and doubled ones left out, and says so.
///
/// # Errors
/// A copy that is there already, or cannot be written.
pub(crate) fn repair(job: &Job) -> Result<(), Fault> {
    let Repair { spec, turned, removed } =
        doctor::repair(job.scene.spec()).map_err(|error| job.scene.locate(error))?;
    if turned.is_empty() && removed.is_empty() {
        say("there is nothing that a repair can change");
        return Ok(());
    }
    let copy = copy_of(job.scene.path());
    crate::commands::new::write_new(&copy, &scenes::to_toml(&spec))?;
    let told = [("turned round", turned), ("left out, being there twice", removed)];
    for (what, names) in told.iter().filter(|(_, names)| !names.is_empty()) {
        say(&format!("{what}: {}", names.join(", ")));
    }
    say(&format!("the repaired scene is {}; {} is unchanged", copy.display(), job.scene.path().display()));
    Ok(())
}

/// `room.glb` → `room.repaired.toml`, beside it.
fn copy_of(path: &Path) -> PathBuf {
    path.with_extension("repaired.toml")
}
