//! The page of the study.

use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::process::Command;

use super::runs::{ChoiceRoom, JobOutcome};
use crate::edition::machine;
use crate::walking::Failure;

/// A room with what is chosen and what is found by hand.
pub type StudiedRoom = (ChoiceRoom, Vec<JobOutcome>, Vec<JobOutcome>);

/// Writes `choice.md`.
pub fn write(folder: &Path, (millions, rooms): (u64, &str), studied: &[StudiedRoom]) -> Result<(), Failure> {
    let mut text = format!(
        "# What the program chooses, against jobs by hand\n\n\
         `radwalk-lab choice docs/results {millions} {rooms}` writes this page: {}, {}.\n\n\
         *Chosen* is a job without words, with a quarter, a sixteenth and a sixty-fourth of the {millions} million walks of a reference, and without a budget. By hand: linear and\n\
         constant continuous walks on even cuts of 1, 0.5, 0.35, 0.25 and 0.125 m, and chains of both bases on cuts of 0.5 and 0.25 m, each with all of these budgets. Times are processor\n\
         times, pilot and building of scenes included. *By energy* is the root mean square of the error of the reflected light over the area, relative to that of the light; light beside\n\
         lamps decides it. *By place* takes errors relative to the light of each place (or a tenth of the mean light, where that is more), at most 1 each, as pictures and lux on planes\n\
         do. References are two of independent walks on small cells. *Hand* is the time of the best job by hand to the error that is chosen, along its own runs; –: none comes to it within these budgets.\n\n\
         | room | chosen | patches | time, of it pilot | foretold: noise, discretisation | by energy | hand | chosen ÷ hand | by place | hand | chosen ÷ hand |\n\
         |---|---|---|---|---|---|---|---|---|---|---|\n",
        commit(),
        machine(),
    );
    let mut ratios = [Vec::new(), Vec::new()];
    for (room, chosen, given) in studied {
        for found in chosen {
            write!(text, "| {} | {} | {} |", room.name, found.what, found.patches)?;
            let [time, errors @ ..] = found.runs[0];
            let [pilot, noise, lost] = found.foretold.unwrap_or_default();
            write!(text, " {time:.2} s, {pilot:.2} | {:.1}, {:.1} % |", 100.0 * noise, 100.0 * lost)?;
            for (k, error) in errors.into_iter().enumerate() {
                let times =
                    given.iter().filter_map(|given| Some((time_to(&given.runs, k, error)?, &given.what)));
                let best = times.min_by(|(a, _), (b, _)| a.total_cmp(b));
                write!(text, " {:.1} % |", 100.0 * error)?;
                match best {
                    Some((best, what)) => {
                        ratios[k].push(time / best);
                        write!(text, " {best:.2} s, {what} | {:.2} |", time / best)?;
                    }
                    None => write!(text, " – | – |")?,
                }
            }
            text.push('\n');
        }
    }
    for (ratios, what) in ratios.iter().zip(["By energy", "By place"]) {
        let mean = ratios.iter().map(|ratio| ratio.ln()).sum::<f64>() / ratios.len() as f64;
        let worst = ratios.iter().fold(0.0_f64, |worst, &ratio| worst.max(ratio));
        let all = studied.iter().map(|(_, chosen, _)| chosen.len()).sum::<usize>();
        writeln!(
            text,
            "\n{what}, some job by hand comes to the chosen error in {} of {all} rows; chosen ÷ hand there has the geometric mean {:.2} and is {worst:.2} at worst.",
            ratios.len(),
            mean.exp(),
        )?;
    }
    fs::write(folder.join("choice.md"), text)?;
    Ok(())
}

/// The commit that is measured, with its date.
fn commit() -> String {
    let log = Command::new("git").args(["log", "-1", "--format=commit %h of %cs"]).output();
    log.map_or_else(|_| "no commit".into(), |log| String::from_utf8_lossy(&log.stdout).trim().into())
}

/// The processor time to an error along the runs of a job: between two of them and beyond by the power of time that both tell.
fn time_to(runs: &[[f64; 3]], k: usize, error: f64) -> Option<f64> {
    match runs.iter().position(|run| run[1 + k] <= error)? {
        0 => Some(runs[0][0]),
        later => {
            let [before, after] = [runs[later - 1], runs[later]];
            let part = (error / before[1 + k]).ln() / (after[1 + k] / before[1 + k]).ln();
            Some(before[0] * (after[0] / before[0]).powf(part))
        }
    }
}
