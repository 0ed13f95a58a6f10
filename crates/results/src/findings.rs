//! What the doctor finds wrong with a scene, in a folder with pictures of the worst.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use doctor::Finding;
use job::Job;
use report::{OutputFolder, Picture};

use crate::error::Error;
use crate::outputs::units;

/// The file of all findings.
pub const FINDINGS: &str = "doctor.txt";

/// The most findings that get a picture.
const PICTURED: usize = 12;

fn picture_name(number: usize) -> String {
    format!("finding-{number:02}.png")
}

/// Writes every finding, and pictures of the first that are about surfaces. Those of an earlier report are replaced.
///
/// # Errors
/// A scene that cannot be built, and a folder that cannot be written.
pub fn write_findings(job: &Job, findings: &[Finding], path: &Path) -> Result<(), Error> {
    let names: Vec<String> = (1..=PICTURED).map(picture_name).collect();
    let files: Vec<&str> = names.iter().map(String::as_str).chain([FINDINGS]).collect();
    let folder = OutputFolder::claim(path, &files, true)?;
    let scene = job.build_scene()?;
    let unit = units(job.light).power;
    let mut text = String::new();
    for (number, finding) in (1..).zip(findings) {
        let line = format!("{number}. {}", finding.sentence(unit, usize::MAX));
        writeln!(text, "{line}").expect("a string takes any text");
    }
    folder.write(FINDINGS, |file| file.write_all(text.as_bytes()))?;
    for (number, name) in (1..).zip(&names) {
        match findings.get(number - 1).filter(|finding| !finding.surfaces.is_empty()) {
            Some(finding) => {
                let picture = Picture::mark(&scene, &finding.surfaces);
                folder.write(name, |file| picture.write_png(file))?;
            }
            None => folder.remove(&[name])?,
        }
    }
    Ok(())
}
