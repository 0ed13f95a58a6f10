//! What the doctor finds wrong with a scene, in words, and the copy without it.

use std::path::{Path, PathBuf};

use doctor::{Kind, Repair};
use job::{Job, Light};
use report::words::counted;
use results::{FINDINGS, units, write_findings};
use voice::say;

use crate::fault::Fault;

/// What the doctor finds, in words.
pub(crate) struct Examined {
    /// What is wrong, most power first.
    pub(crate) faults: Vec<String>,
    /// Openings, which may be meant, buried surfaces, which cost nothing, how many findings there are, and where they are written.
    pub(crate) remarks: Vec<String>,
}

/// Examines the geometry of a job's scene, and writes what is wrong to a folder with pictures of the worst. Nothing is written where
/// nothing is wrong.
///
/// # Errors
/// A scene that cannot be built, and a folder that cannot be written.
pub(crate) fn examine(job: &Job, out: Option<&Path>) -> Result<Examined, Fault> {
    let findings = doctor::examine(job.scene.spec()).map_err(|error| job.scene.locate(error))?;
    let (mut faults, mut remarks) = (Vec::new(), Vec::new());
    let kinds = findings.iter().map(|finding| Some(finding.kind)).chain(std::iter::repeat(None));
    for (line, kind) in doctor::lines(&findings, units(job.light).power).into_iter().zip(kinds) {
        match kind {
            None | Some(Kind::Open | Kind::Buried) => remarks.push(line),
            Some(_) => faults.push(line),
        }
    }
    if !findings.is_empty() {
        let default = || PathBuf::from("out").join(format!("{}-doctor", job.name));
        let folder = out.map_or_else(default, Path::to_path_buf);
        write_findings(job, &findings, &folder)?;
        let remark =
            format!("{FINDINGS} and a picture of each of the worst findings are in {}", folder.display());
        remarks.push(remark);
    }
    Ok(Examined { faults, remarks })
}

/// Writes a copy of a job's scene in which flipped surfaces are turned round and doubled ones left out, and says so.
///
/// # Errors
/// A copy that is there already, or cannot be written.
pub(crate) fn repair(job: &Job) -> Result<(), Fault> {
    let Repair { spec, turned, removed, numbers } =
        doctor::repair(job.scene.spec()).map_err(|error| job.scene.locate(error))?;
    if turned.is_empty() && removed.is_empty() {
        say("there is nothing that a repair can change");
        return Ok(());
    }
    let path = job.scene.path();
    let is_scene_file = path.extension().is_some_and(|extension| extension == "toml");
    let text = match is_scene_file {
        true => std::fs::read_to_string(path)
            .ok()
            .and_then(|text| job::repaired_text(&text, &numbers[0], &numbers[1])),
        false => Some(job::to_toml(&spec)),
    };
    let Some(text) = text else {
        let names = [turned, removed].concat().join(", ");
        say(&format!(
            "nothing is written: {names} are faces of meshes that {} names; repair those files",
            path.display()
        ));
        return Ok(());
    };
    let copy = copy_of(path);
    crate::commands::new::write_new(&copy, &text)?;
    let changes = [("turned round", turned), ("left out, being there twice", removed)];
    for (what, names) in changes.iter().filter(|(_, names)| !names.is_empty()) {
        say(&format!("{what}: {}", names.join(", ")));
    }
    if !is_scene_file && !spec.lamps.list.is_empty() {
        let lamps = counted(spec.lamps.list.len() as u64, "lamp");
        say(&format!("left out: {lamps} of the file; a [[lamp]] for each brings them back"));
    }
    if !is_scene_file && job.light == Light::Luminous {
        say("its light is in lumens: a job of the copy needs light = \"luminous\"");
    }
    say(&format!("the repaired scene is {}; {} is unchanged", copy.display(), job.scene.path().display()));
    Ok(())
}

/// `room.glb` → `room.repaired.toml`, beside it.
fn copy_of(path: &Path) -> PathBuf {
    path.with_extension("repaired.toml")
}
