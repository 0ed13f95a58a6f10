//! What the doctor finds wrong with a scene, in words, and the copy without it.

use std::path::{Path, PathBuf};

use doctor::{Finding, Repair};
use job::Job;

use crate::console::say;
use crate::fault::Fault;

/// The most findings that are told one by one.
const TOLD: usize = 200;

/// Says what is wrong with the geometry of a job's scene, most power first.
///
/// # Errors
/// A scene that cannot be built.
pub fn report(job: &Job) -> Result<(), Fault> {
    let findings = doctor::examine(job.scene.spec()).map_err(|error| job.scene.locate(error))?;
    findings.iter().take(TOLD).for_each(|finding| say(&sentence(finding)));
    if let Some(more) = findings.len().checked_sub(TOLD).filter(|more| *more > 0) {
        say(&format!("and {more} more that cost less"));
    }
    say(&match findings.len() {
        0 => "the doctor finds nothing wrong".into(),
        1 => "the doctor finds one thing wrong".into(),
        count => format!("the doctor finds {count} things wrong"),
    });
    Ok(())
}

fn sentence(finding: &Finding) -> String {
    let Finding { kind, surfaces, power, message } = finding;
    let numbers: Vec<String> = surfaces.iter().map(u32::to_string).collect();
    let surfaces =
        if numbers.is_empty() { String::new() } else { format!(" [surface {}]", numbers.join(", ")) };
    format!("{}: {message}{surfaces} (about {power:.3e} W); {}", kind.word(), kind.remedy())
}

/// Writes a copy of a job's scene in which flipped surfaces are turned round and doubled ones left out, and says so.
///
/// # Errors
/// A copy that is there already, or cannot be written.
pub fn repair(job: &Job) -> Result<(), Fault> {
    let Repair { spec, turned, removed } =
        doctor::repair(job.scene.spec()).map_err(|error| job.scene.locate(error))?;
    if turned.is_empty() && removed.is_empty() {
        say("there is nothing that a repair can change");
        return Ok(());
    }
    let copy = copy_of(job.scene.path());
    crate::new::write_new(&copy, &scenes::to_toml(&spec))?;
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
