//! What was compared, in words, tables and charts.

use std::fmt::Write;

use report::{Axis, Chart, Series};
use stats::Measured;

use super::contender::Absent;
use super::judge::{Advice, Curve, advice, curves, is_pareto};
use super::measure::Point;
use crate::plot::{figure, pm, seen, theory};
use crate::progress::{percent, quantity};

/// Curves in one chart: as many as can be told apart.
const DRAWN: usize = 8;

/// What is told of one job.
pub struct Chapter {
    /// The job's name.
    pub job: String,
    /// Patches and surfaces of its scene.
    pub size: [usize; 2],
    /// All points.
    pub points: Vec<Point>,
    /// Methods that could not be compared, at any size.
    pub absent: Vec<Absent>,
    /// What the errors of discrete methods are measured against.
    pub truth: String,
    /// Likewise, of continuous ones.
    pub continuous_truth: String,
}

/// Where charts go and what is against which axis: file and chart.
pub fn charts(chapter: &Chapter) -> [(String, Chart); 2] {
    let curves = best(&chapter.points);
    let series = |x: fn(&Point) -> f64| -> Vec<Series> {
        let of =
            |curve: &Curve<'_>| seen(curve.method, curve.points.iter().map(|point| (x(point), point.rms())));
        let mut series: Vec<Series> = curves.iter().map(of).collect();
        // Slope −1/2 from the first point of the first curve.
        let [first, last] = [curves[0].points[0], curves[0].last()];
        let scale = first.rms().value * x(first).sqrt();
        let guide = [x(first), x(last)].map(|x| (x, scale / x.sqrt()));
        series.push(theory("slope −1/2", guide));
        series
    };
    let chart = |what: &str, axis: &str, x| Chart {
        title: format!("{}: error against {what}", chapter.job),
        x: Axis::log(axis),
        y: Axis::log("rms relative error"),
        series: series(x),
    };
    [
        (format!("{}-time", chapter.job), chart("time", "processor time of a run [s]", |p| p.seconds)),
        (format!("{}-rays", chapter.job), chart("rays", "rays of a run", |p| p.rays as f64)),
    ]
}

/// The curves of the best merit at their ends, the first method always among them.
fn best(points: &[Point]) -> Vec<Curve<'_>> {
    let mut curves = curves(points);
    let first = curves.remove(0);
    curves.sort_by(|a, b| b.last().merit()[0].total_cmp(&a.last().merit()[0]));
    std::iter::once(first).chain(curves).take(DRAWN).collect()
}

/// The page of all chapters.
pub fn page(command: &str, date: &str, chapters: &[Chapter]) -> String {
    let mut page = String::from("# Speed against accuracy\n\n");
    let _ = writeln!(
        page,
        "Written by `{command}` on {date}. All runs are walked in one thread of one process, one after the other, methods \
         in turn; time is the processor time of that thread while it walks, without reading scenes, starting workers and \
         sending results. Errors are relative errors of B of the patches that reflect and do not emit (and have a \
         thousandth of the mean radiosity at least), by area; ± is a standard error over the runs. Merit is 1/(mean \
         squared error · seconds), its 95 % interval by Student's t on the logarithm. Chains are eight a run, as jobs have \
         them. Memory is the growth of the process in the first run; traffic is what the result of a whole run takes on \
         the wire."
    );
    for chapter in chapters {
        write_chapter(&mut page, chapter);
    }
    page
}

fn write_chapter(page: &mut String, chapter: &Chapter) {
    let Chapter { job, size: [patches, surfaces], points, absent, truth, continuous_truth } = chapter;
    let _ = writeln!(page, "\n## {job}\n\n{patches} patches on {surfaces} surfaces.\n");
    let all = curves(points);
    let _ = writeln!(page, "**What to use.** {}\n", words(&advice(&all)));
    for (file, chart) in charts(chapter) {
        let _ = writeln!(page, "![{}](compare/{file}.svg)\n", chart.title);
    }
    write_times(page, &all);
    let _ =
        writeln!(page, "\nRuns of the most rays; ● where no other point is both faster and more accurate:\n");
    let _ = writeln!(
        page,
        "| method | rays | s | rms error | 99 % of the area | worst patch | merit [1/s] | | memory | traffic |"
    );
    let _ = writeln!(page, "|---|---|---|---|---|---|---|---|---|---|");
    for curve in &all {
        write_row(page, curve.last(), points);
    }
    let _ = writeln!(
        page,
        "\nErrors of discrete methods are measured against {truth}; of continuous ones against {continuous_truth}."
    );
    for Absent { name, why } in absent {
        let _ = writeln!(page, "Not compared: {name} ({why}).");
    }
}

fn write_row(page: &mut String, point: &Point, points: &[Point]) {
    let [merit, low, high] = point.merit();
    // Memory is told in pages.
    let bytes = |bytes: u64| match bytes {
        0 => "< 4 kB".into(),
        1..1000 => format!("{bytes} B"),
        _ => format!("{}B", quantity(bytes as f64)),
    };
    let Measured { value, standard_error } = point.rms();
    let rms = Measured { value: 100.0 * value, standard_error: 100.0 * standard_error };
    let _ = writeln!(
        page,
        "| {} | {} | {} | {} % | {} | {} | {} ({} … {}) | {} | {} | {} |",
        point.method,
        quantity(point.rays as f64),
        figure(point.seconds),
        pm(rms),
        percent(point.p99),
        percent(point.worst),
        quantity(merit),
        quantity(low),
        quantity(high),
        if is_pareto(point, points) { "●" } else { "" },
        point.memory.map_or("?".into(), bytes),
        bytes(point.traffic),
    );
}

/// Time to every error, method by method.
fn write_times(page: &mut String, curves: &[Curve<'_>]) {
    let levels = super::judge::LEVELS;
    let heads: Vec<String> = levels.iter().map(|rms| format!("{} %", 100.0 * rms)).collect();
    let _ = writeln!(page, "Seconds of one core to an rms error of (– where a bias is in the way):\n");
    let _ = writeln!(page, "| method | {} |", heads.join(" | "));
    let _ = writeln!(page, "|---|{}", "---|".repeat(levels.len()));
    for curve in curves {
        let time = |rms: &f64| curve.time_to(*rms).map_or("–".into(), figure);
        let times: Vec<String> = levels.iter().map(time).collect();
        let _ = writeln!(page, "| {} | {} |", curve.method, times.join(" | "));
    }
}

/// The advice in sentences: errors that ask for the same method share one.
fn words(advice: &[Advice<'_>]) -> String {
    let mut sentences = Vec::new();
    for group in advice.chunk_by(|a, b| a.ranking[0].0 == b.ranking[0].0) {
        let (first, last) = (&group[0], &group[group.len() - 1]);
        let range = match group.len() {
            1 => format!("For an rms error of {} %", 100.0 * first.rms),
            _ => format!("For rms errors of {} % to {} %", 100.0 * first.rms, 100.0 * last.rms),
        };
        let (name, time) = last.ranking[0];
        let alike: Vec<&str> = last.ranking[1..last.alike.max(1)].iter().map(|&(name, _)| name).collect();
        let as_good = if alike.is_empty() {
            String::new()
        } else {
            format!("; as good, as far as this tells: {}", alike.join(", "))
        };
        let next = last.ranking.get(last.alike.max(1));
        let next = next.map_or(String::new(), |(other, longer)| {
            format!("; next is {other}, {} times longer", figure(longer / time))
        });
        sentences.push(format!(
            "{range}: **{name}** ({} s to {} %{as_good}{next}).",
            figure(time),
            100.0 * last.rms
        ));
    }
    sentences.join(" ")
}
