//! The page of the study.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use super::runs::{Failure, GroupOutcome};
use super::{PATHS, UNIFORM};
use crate::edition::origin;

/// All that was found.
pub struct Studied {
    /// On cells of each of [`UNIFORM`].
    pub uniform: Vec<GroupOutcome>,
    /// On chosen patches for each of [`PATHS`], under the basis that is chosen.
    pub open: Vec<GroupOutcome>,
    /// Under constants and under linear fits.
    pub of_basis: [Vec<GroupOutcome>; 2],
}

/// Writes `groups.md`.
pub fn write(folder: &Path, millions: u64, studied: &Studied) -> Result<(), Failure> {
    let Studied { uniform, open: chosen, .. } = studied;
    let mut text = format!(
        "# What groups of faces save\n\n\
         `radwalk-lab groups docs/results {millions}` writes this page: {}.\n\n\
         The scene is `scenes::interior` of {} triangles as an OBJ file: two furnished rooms, an object for each piece of furniture. Errors are relative L2\n\
         errors of the reflected light, noise and discretisation together, against two references of {millions} million walks each. *All light*: on cells of at most\n\
         5 cm². *Faces*: of the means of faces above 10 cm², for which one patch a face has noise alone. Times are processor times of one core:\n\
         building the scene and walks, and for chosen patches pilot and choice, without reading the file and writing the results. A chosen job's scene takes from\n\
         the pilot's what rays find surfaces by.\n",
        origin(),
        uniform[0].patches,
    );
    for (k, title) in [(0, "All light"), (1, "Means of faces above 10 cm²")] {
        errors(&mut text, title, k, uniform, chosen)?;
    }
    bases(&mut text, studied)?;
    predicted(&mut text, chosen)?;
    fs::write(folder.join("groups.md"), text)?;
    Ok(())
}

fn errors(
    text: &mut String,
    title: &str,
    k: usize,
    uniform: &[GroupOutcome],
    chosen: &[GroupOutcome],
) -> std::fmt::Result {
    write!(text, "\n## {title}\n\n| walks |")?;
    for (found, area) in uniform.iter().zip(UNIFORM) {
        match area.is_finite() {
            true => write!(text, " cells below {area} m²: {} |", found.patches)?,
            false => write!(text, " one patch a face: {} |", found.patches)?,
        }
    }
    text.push_str(" chosen: error, patches | its time, of it choosing | walks of one patch a face to that error, their time |\n|---|---|---|---|---|---|---|---|\n");
    for (paths, chosen) in PATHS.iter().zip(chosen) {
        write!(text, "| {paths} |")?;
        uniform.iter().try_for_each(|found| write!(text, " {} |", percent(found.after(*paths, k))))?;
        let error = chosen.errors.total[k];
        let noise = (uniform[0].after(1, k) - uniform[0].errors.lost[k].max(0.0)).max(0.0);
        let room = error - uniform[0].errors.lost[k].max(0.0);
        let needed = match room > 0.0 {
            true => {
                let walks = noise / room;
                let seconds = uniform[0].building + walks * uniform[0].walking / uniform[0].walks as f64;
                format!("{walks:.0}, {seconds:.2} s")
            }
            false => "never".into(),
        };
        let time = chosen.time();
        writeln!(
            text,
            " **{}**, {} {} | {time:.2} s, {:.2} s | {needed} |",
            percent(error),
            chosen.patches,
            if chosen.is_linear { "linear" } else { "constant" },
            chosen.choosing
        )?;
    }
    Ok(())
}

/// What constants and linear fits come to, each on the patches that are chosen for them.
fn bases(text: &mut String, studied: &Studied) -> std::fmt::Result {
    text.push_str(
        "\n## The basis\n\n| walks | constants: patches | all light | faces | linear fits: patches | all light | faces | chosen |\n|---|---|---|---|---|---|---|---|\n",
    );
    let [constant, linear] = &studied.of_basis;
    for (((paths, constant), linear), chosen) in PATHS.iter().zip(constant).zip(linear).zip(&studied.open) {
        write!(text, "| {paths} |")?;
        for found in [constant, linear] {
            let [all, faces] = found.errors.total.map(percent);
            write!(text, " {} | {all} | {faces} |", found.patches)?;
        }
        writeln!(text, " {} |", if chosen.is_linear { "linear" } else { "constant" })?;
    }
    Ok(())
}

fn predicted(text: &mut String, chosen: &[GroupOutcome]) -> std::fmt::Result {
    text.push_str(
        "\n## What is predicted\n\n| walks | noise: predicted, measured | discretisation: predicted, measured | total: predicted over measured |\n|---|---|---|---|\n",
    );
    for (paths, found) in PATHS.iter().zip(chosen) {
        let [noise, lost] = found.predicted;
        let total = (noise * noise + lost * lost).sqrt();
        let own = [found.errors.total[0] - found.errors.lost[0], found.errors.lost[0]];
        writeln!(
            text,
            "| {paths} | {}, {} | {}, {} | {:.2} |",
            percent(noise * noise),
            percent(own[0]),
            percent(lost * lost),
            percent(own[1]),
            total / found.errors.total[0].sqrt(),
        )?;
    }
    Ok(())
}

/// A squared error as the percentage of its root.
fn percent(square: f64) -> String {
    format!("{:.2} %", 100.0 * square.max(0.0).sqrt())
}
