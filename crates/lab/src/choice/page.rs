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
    and in a million triangles). By hand, 20 jobs: linear and constant continuous walks on even cuts of 2, 1, 0.5, 0.35, 0.25, 0.18 and 0.125 m, of up to 6 million walks, and chains of both\n\
    bases on cuts of 1, 0.5 and 0.25 m. Times are processor times from a scene that has been read to a tally, pilot and building of scenes included. *By energy* is the root mean square of the error of the\n\
    reflected light over the area, relative to that of the light; light beside lamps decides it. *By place* takes errors relative to the light of each place (or a tenth of the mean light,\n\
    where that is more), at most 1 each, as pictures and lux on planes do. References are two of independent walks, on patches that are chosen for eight times as many. *Hand* is the time of\n\
    the best job by hand to the error that is chosen, along its own runs; –: none comes to it within these budgets. *Whole* is the processor time of the whole command, from the mesh to\n\
    picture, page and tables: that of the choice, and over that of the job by hand with as many walks as come to the chosen error.\n";

/// The job by hand that is best for an error.
struct BestByHand<'a> {
    job: &'a JobOutcome,
    /// The walks that come to the error, and their processor time [s].
    walks: f64,
    time: f64,
}

/// Adds the table of what is chosen and what is found by hand.
fn table(text: &mut String, studied: &[StudiedRoom]) -> Result<(), Failure> {
    text.push_str(
        "| room | chosen | patches | time, of it pilot | whole | predicted: noise, discretisation | by energy | hand | chosen ÷ hand, whole | by place | hand | chosen ÷ hand, whole |\n\
         |---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    let mut ratios = [Vec::new(), Vec::new()];
    for (room, chosen, given) in studied {
        for found in chosen {
            write!(text, "| {} | {} | {} |", room.name, found.what, found.patches)?;
            let [time, errors @ ..] = found.runs[0];
            let [pilot, noise, lost] = found.predicted.unwrap_or_default();
            let whole = room.whole_command(&found.keys)?;
            write!(
                text,
                " {time:.2} s, {pilot:.2} | {} |",
                whole.map_or("–".into(), |whole| format!("{whole:.1} s"))
            )?;
            write!(text, " {:.1}, {:.1} % |", 100.0 * noise, 100.0 * lost)?;
            for (k, error) in errors.into_iter().enumerate() {
                let ways = given.iter().filter_map(|job| time_to(job, k, error));
                let best = ways.min_by(|a, b| a.time.total_cmp(&b.time));
                write!(text, " {:.1} % |", 100.0 * error)?;
                let Some(BestByHand { job, walks, time: best }) = best else {
                    write!(text, " – | – |")?;
                    continue;
                };
                let whole_by_hand = room.whole_command(&job.keys_for(walks as u64))?;
                let of_whole = whole.zip(whole_by_hand).map(|(whole, by_hand)| whole / by_hand);
                ratios[k].push((time / best, of_whole));
                let of_whole = of_whole.map_or(String::new(), |ratio| format!(", {ratio:.2}"));
                write!(text, " {best:.2} s, {} | {:.2}{of_whole} |", job.what, time / best)?;
            }
            text.push('\n');
        }
    }
    for (ratios, what) in ratios.iter().zip(["By energy", "By place"]) {
        let all = studied.iter().map(|(_, chosen, _)| chosen.len()).sum::<usize>();
        write!(
            text,
            "\n{what}, some job by hand comes to the chosen error in {} of {all} rows; chosen ÷ hand there has {}",
            ratios.len(),
            mean_and_worst(ratios.iter().map(|&(ratio, _)| ratio)),
        )?;
        let of_whole: Vec<f64> = ratios.iter().filter_map(|&(_, of_whole)| of_whole).collect();
        if !of_whole.is_empty() {
            write!(text, ", that of whole commands {}", mean_and_worst(of_whole.into_iter()))?;
        }
        text.push_str(".\n");
    }
    Ok(())
}

/// The geometric mean of ratios and the largest, in words.
fn mean_and_worst(ratios: impl Iterator<Item = f64> + Clone) -> String {
    let many = ratios.clone().count().max(1) as f64;
    let mean = (ratios.clone().map(f64::ln).sum::<f64>() / many).exp();
    format!("the geometric mean {mean:.2} and the largest {:.2}", ratios.fold(0.0, f64::max))
}

/// The way of a job to an error along its runs: between two of them by the power of time that both tell; `None` where it does not come there.
fn time_to(job: &JobOutcome, k: usize, error: f64) -> Option<BestByHand<'_>> {
    let (runs, walks) = (&job.runs, &job.walks);
    let (walks, time) = match runs.iter().position(|run| run[1 + k] <= error)? {
        0 => (walks[0] as f64, runs[0][0]),
        later => {
            let [before, after] = [later - 1, later];
            let part = (error / runs[before][1 + k]).ln() / (runs[after][1 + k] / runs[before][1 + k]).ln();
            let between = |[a, b]: [f64; 2]| a * (b / a).powf(part);
            (
                between([before, after].map(|run| walks[run] as f64)),
                between([before, after].map(|run| runs[run][0])),
            )
        }
    };
    Some(BestByHand { job, walks, time })
}
