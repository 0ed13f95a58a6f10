//! The page of the study.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use super::runs::{ChoiceRoom, JobOutcome};
use crate::edition::origin;
use crate::walking::Failure;

/// A room with what is chosen and what is found by hand.
pub type StudiedRoom = (ChoiceRoom, Vec<JobOutcome>, Vec<JobOutcome>);

/// Writes `choice.md`.
pub fn write(folder: &Path, (millions, rooms): (u64, &str), studied: &[StudiedRoom]) -> Result<(), Failure> {
    let mut text = format!(
        "# What the program chooses, against jobs by hand\n\n\
         `radwalk-lab choice docs/results {millions} KEPT {rooms}` writes this page: {}.\n\n\
         {LEGEND}\n",
        origin(),
    );
    table(&mut text, studied)?;
    fs::write(folder.join("choice.md"), text)?;
    Ok(())
}

/// Writes `survival.md`: scenes that a choice must survive, and what the program says where it refuses one.
pub fn write_survival(
    (folder, is_quick): (&Path, bool),
    cases: &[(&str, String)],
    studied: &[StudiedRoom],
) -> Result<(), Failure> {
    let mut text = format!(
        "# What the program chooses where it is hard to choose\n\n\
         `radwalk-lab survival docs/results{}` writes this page: {}.\n\n\
         Made scenes, and the choice of a job without words in each.\n\n\
         | scene | what is chosen, and why |\n|---|---|\n",
        if is_quick { " quick" } else { "" },
        origin(),
    );
    for (name, what) in cases {
        writeln!(text, "| {name} | {what} |")?;
    }
    write!(text, "\n{LEGEND}\n")?;
    table(&mut text, studied)?;
    fs::write(folder.join("survival.md"), text)?;
    Ok(())
}

/// What the columns of the table mean.
const LEGEND: &str = "*Chosen* is a job without words of 93,750, 375,000 and 1.5 million walks, and without a budget: times are means and errors root mean squares of five seeds (one at R = 0.99\n\
    and in a million triangles). By hand: linear and constant continuous walks on even cuts of 1, 0.5, 0.35, 0.25 and 0.125 m, of up to 6 million walks, and chains of both bases on cuts\n\
    of 0.5 and 0.25 m. Times are processor times, pilot and building of scenes included. *By energy* is the root mean square of the error of the reflected light over the area, relative to\n\
    that of the light; light beside lamps decides it. *By place* takes errors relative to the light of each place (or a tenth of the mean light, where that is more), at most 1 each, as\n\
    pictures and lux on planes do. References are two of independent walks, on patches that are chosen for eight times as many. *Hand* is the time of the best job by hand to the error that\n\
    is chosen, along its own runs; –: none comes to it within these budgets.\n";

/// Adds the table of what is chosen and what is found by hand.
fn table(text: &mut String, studied: &[StudiedRoom]) -> Result<(), Failure> {
    text.push_str(
        "| room | chosen | patches | time, of it pilot | foretold: noise, discretisation | by energy | hand | chosen ÷ hand | by place | hand | chosen ÷ hand |\n\
         |---|---|---|---|---|---|---|---|---|---|---|\n",
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
        let mean = ratios.iter().map(|ratio| ratio.ln()).sum::<f64>() / ratios.len().max(1) as f64;
        let worst = ratios.iter().fold(0.0_f64, |worst, &ratio| worst.max(ratio));
        let all = studied.iter().map(|(_, chosen, _)| chosen.len()).sum::<usize>();
        writeln!(
            text,
            "\n{what}, some job by hand comes to the chosen error in {} of {all} rows; chosen ÷ hand there has the geometric mean {:.2} and is {worst:.2} at worst.",
            ratios.len(),
            mean.exp(),
        )?;
    }
    Ok(())
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
