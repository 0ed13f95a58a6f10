//! The page and the charts of the study.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use report::{Axis, Chart, ChartPoint, Series, Style};

use super::pictures;
use super::runs::Failure;
use super::study::{CEILINGS, PATHS, PatchStudy, SEEDS, StudyRow};
use crate::edition::origin;

/// Jobs that the tables have rows of.
const TABLE_PATHS: [u64; 3] = [PATHS[0], PATHS[2], PATHS[4]];

/// Writes `patches.md` and the charts of all studies so far.
pub fn write(studies: &[PatchStudy], millions: u64, folder: &Path) -> Result<(), Failure> {
    let mut text = head(millions, studies);
    saved(&mut text, studies)?;
    ceilings(&mut text, studies)?;
    truth(&mut text, studies)?;
    text.push_str("\n## Error against processor time\n\nThe pilot's time counts. Uniform grids are the best for each number of walks, found with the truth known.\n\n");
    for study in studies {
        let file = format!("patches-{}.svg", study.name);
        fs::write(folder.join(&file), chart(study).svg())?;
        writeln!(text, "![Error against time: {}]({file})", study.name)?;
    }
    if studies.iter().any(|study| study.name == pictures::DRAWN) {
        writeln!(
            text,
            "\n## Pictures at equal time\n\n{}, from the left: the best uniform grid of constants, the best uniform grid of linear fits, and chosen \
             patches, in the processor time of a job of {} walks with its pilot.\n\n![Pictures at equal time](patches-{}.png)",
            pictures::DRAWN,
            words(pictures::PATHS),
            pictures::DRAWN
        )?;
    }
    fs::write(folder.join("patches.md"), text)?;
    Ok(())
}

fn head(millions: u64, studies: &[PatchStudy]) -> String {
    let cells: Vec<String> = studies.iter().map(|study| format!("{} {}", study.name, study.cells)).collect();
    format!(
        "# What chosen patches save\n\n\
         `radwalk-lab patches docs/results {millions}` writes this page: {}.\n\n\
         The error is the relative L2 error of the reflected light over the area, noise and discretisation together. Noise is that of a run's\n\
         sample variances; discretisation is measured against two independent references of {millions} million walks each, linear fits on fine cells ({}).\n\
         *Saved* is how many times the walks of the job the best uniform grid of constants needs for the same error; that grid is found by search\n\
         with the truth known. Chosen patches are means over {SEEDS} seeds. *–*: no uniform grid that was measured comes to that error. Processor times\n\
         are the least of three.\n",
        origin(),
        cells.join(", "),
    )
}

fn is_listed(row: &&StudyRow) -> bool {
    TABLE_PATHS.contains(&row.paths)
}

fn saved(text: &mut String, studies: &[PatchStudy]) -> std::fmt::Result {
    text.push_str(
        "\n## Walks saved\n\n| scene | walks | constants: error, patches | uniform linear: error, patches | saved | chosen: error, patches | \
         linear for | predicted | saved | with the pilot's walks | processor time | against uniform linear |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for study in studies {
        for row in study.rows.iter().filter(is_listed) {
            let [constant, linear] = &row.uniform;
            let predicted = (row.chosen.predicted[0] + row.chosen.predicted[1]).sqrt();
            writeln!(
                text,
                "| {} | {} | {}, {} | {}, {} | {} | {}, {:.0} | {} of {SEEDS} | {} | **{}** | {} | {} | {} |",
                study.name,
                words(row.paths),
                percent(constant.error),
                constant.patches,
                percent(linear.error),
                linear.patches,
                times(linear.saved),
                percent(row.error),
                row.chosen.patches,
                row.chosen.linear,
                percent(predicted),
                times(row.saved[0]),
                times(row.saved[1]),
                times(row.saved[2]),
                times(row.against_linear),
            )?;
        }
    }
    Ok(())
}

fn ceilings(text: &mut String, studies: &[PatchStudy]) -> std::fmt::Result {
    text.push_str(
        "\n## Ceilings\n\nWalks saved by partitions that are chosen with the truth known: a grid of powers of two for each surface; quadtrees of square \
         cells; rectangles cut in two again and again. *Mixed* leaves take constants or linear fits, whichever is better. A quadratic fit has six unknowns.\n\n\
         | scene | walks | grids: constant | linear | quadratic | quadtrees: constant | linear | mixed | quadratic | rectangles: linear |\n|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for study in studies {
        for row in study.rows.iter().filter(is_listed) {
            write!(text, "| {} | {} |", study.name, words(row.paths))?;
            for (ceiling, saved) in &row.ceilings {
                write!(text, " {} ({}, {:.0}) |", times(*saved), percent(ceiling.error), ceiling.patches)?;
            }
            debug_assert_eq!(row.ceilings.len(), CEILINGS.len());
            text.push('\n');
        }
    }
    Ok(())
}

fn truth(text: &mut String, studies: &[PatchStudy]) -> std::fmt::Result {
    text.push_str(
        "\n## What a run tells of itself\n\nOn patches chosen for seed 0, with the linear basis: the part of the area whose `spread`, and whose error of the mean \
         taken for the patch (`std_error` and `spread` together), is within a factor of 1.5 of the truth; the total error that the run tells over the true one. \
         Rates by processor time, the fastest of five runs in turn: linear fits over constants, and chosen patches over a uniform grid of about as many.\n\n\
         | scene | walks | noise | discretisation | spread | error | total | linear / constant | chosen / uniform |\n|---|---|---|---|---|---|---|---|---|\n",
    );
    for study in studies {
        for row in study.rows.iter().filter(is_listed) {
            let of = &row.chosen.reported;
            let [linear, fixed] = row.chosen.rates;
            writeln!(
                text,
                "| {} | {} | {} | {} | {:.0} % | {:.0} % | {:.2} | {linear:.2} | {fixed:.2} |",
                study.name,
                words(row.paths),
                percent(row.noise),
                percent(row.lost),
                100.0 * of.spread,
                100.0 * of.error,
                of.total,
            )?;
        }
    }
    Ok(())
}

fn chart(study: &PatchStudy) -> Chart {
    let series = |name: &str, of: &dyn Fn(&StudyRow) -> [f64; 2]| Series {
        name: name.into(),
        style: Style::Joined,
        points: study.rows.iter().map(of).map(|[x, y]| ChartPoint { x, y, error: 0.0 }).collect(),
    };
    Chart {
        title: format!("Total error against processor time: {}", study.name),
        x: Axis::log("processor time [s]"),
        y: Axis::log("relative error over the area"),
        series: vec![
            series("best uniform grid of constants", &|row| [row.uniform[0].seconds, row.uniform[0].error]),
            series("best uniform grid of linear fits", &|row| [row.uniform[1].seconds, row.uniform[1].error]),
            series("chosen patches, with the pilot", &|row| [row.chosen.seconds, row.error]),
        ],
    }
}

fn percent(error: f64) -> String {
    let digits = if error < 0.001 { 3 } else { 2 };
    format!("{:.digits$} %", 100.0 * error)
}

fn times(saved: Option<f64>) -> String {
    match saved {
        None => "–".into(),
        Some(saved) if saved < 9.95 => format!("{saved:.2}"),
        Some(saved) => format!("{saved:.0}"),
    }
}

/// 10⁵, 3·10⁵, 10⁶ …
fn words(paths: u64) -> String {
    let power = paths.ilog10();
    let digits: String = power
        .to_string()
        .chars()
        .map(|c| ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][c as usize - '0' as usize])
        .collect();
    match paths / 10_u64.pow(power) {
        1 => format!("10{digits}"),
        first => format!("{first}·10{digits}"),
    }
}
