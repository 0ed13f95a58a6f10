//! The page of a comparison, in words, tables and charts.

use std::path::{Path, PathBuf};

use report::words::{bytes, measured, number, percent, quantity};
use report::{Axis, Chart, Markdown, Series};
use stats::Measured;

use super::contender;
use super::contender::Absent;
use super::judge::{Advice, MethodCurve, advice, curves, front, is_pareto};
use super::measure::ContenderResult;
use crate::team::Team;

/// The most curves in one chart: as many as can be distinguished.
const DRAWN: usize = 8;

/// The chapter of one job.
pub(crate) struct JobChapter {
    /// The name of the job.
    pub job: String,
    /// The path of the job's file.
    pub path: PathBuf,
    /// The numbers of patches and surfaces in its scene.
    pub size: [usize; 2],
    /// All points of the job.
    pub points: Vec<ContenderResult>,
    /// The methods that could not be compared at any size.
    pub absent: Vec<Absent>,
    /// The reference for the errors of discrete methods, in words.
    pub truth: String,
    /// The reference for the errors of continuous walks, in words.
    pub continuous_truth: String,
}

/// The charts of a chapter, each with its file.
pub(crate) fn charts(chapter: &JobChapter) -> [(String, Chart); 2] {
    let curves = best(&chapter.points);
    let series = |x: fn(&ContenderResult) -> f64| -> Vec<Series> {
        let of = |curve: &MethodCurve<'_>| {
            Series::measured(curve.method, curve.points.iter().map(|point| (x(point), point.rms())))
        };
        let mut series: Vec<Series> = curves.iter().map(of).collect();
        // The slope −1/2 from the first point of the first curve, below all others.
        let [first, last] = [curves[0].points[0], curves[0].last()];
        let scale = first.rms().value * x(first).sqrt();
        let guide = [x(first), x(last)].map(|x| (x, scale / x.sqrt()));
        series.insert(0, Series::theory("slope −1/2", guide));
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
        (format!("{}-rays", chapter.job), chart("rays", "rays of a run", |p| p.traced as f64)),
    ]
}

/// The curves with the best merit at their ends, and always the first method.
fn best(points: &[ContenderResult]) -> Vec<MethodCurve<'_>> {
    let mut curves = curves(points);
    let first = curves.remove(0);
    curves.sort_by(|a, b| b.last().merit()[0].total_cmp(&a.last().merit()[0]));
    std::iter::once(first).chain(curves).take(DRAWN).collect()
}

/// Writes the page of all chapters.
pub(crate) fn write(how: &str, date: &str, team: Team, chapters: &[JobChapter]) -> String {
    let mut page = Markdown::default();
    let workers = plural(team.workers, "worker");
    let threads = plural(team.threads as usize, "thread");
    page.heading(1, "Speed against accuracy");
    page.paragraph(format!(
        "Written by `{how}` on {date}. All runs of a method and size are walked by worker processes, as jobs are, one \
         run after the other ({workers} of {threads} each); time is the processor time of their threads while they walk, \
         without starting, reading scenes and sending results. Errors are relative errors of B of the patches that reflect \
         and do not emit (and have a thousandth of the mean radiosity at least), by area; ± is a standard error over the \
         runs; those of the worst patch and of 99 % of the area are root mean squares over the runs. Merit is 1/(mean \
         squared error · seconds), its 95 % interval by Student's t on the logarithm. Memory is the most that a worker \
         process took; traffic is what workers sent for a run, as it went over the wire. Times below a millisecond are those of \
         longer runs, in proportion: the first walks of a job take longer."
    ));
    chapters.iter().for_each(|chapter| write_chapter(&mut page, chapter));
    page.text()
}

fn plural(n: usize, what: &str) -> String {
    if n == 1 { format!("one {what}") } else { format!("{n} {what}s") }
}

fn write_chapter(page: &mut Markdown, chapter: &JobChapter) {
    let JobChapter { job, path, size: [patches, surfaces], points, absent, truth, continuous_truth } =
        chapter;
    page.heading(2, job);
    page.paragraph(format!("{patches} patches on {surfaces} surfaces."));
    let all = curves(points);
    write_advice(page, path, &advice(&all));
    for (file, chart) in charts(chapter) {
        page.drawing(&chart.title, &format!("compare/{file}.svg"));
    }
    write_times(page, &all);
    page.paragraph("Runs of the most rays; ● where no other point is both faster and more accurate:");
    page.table(
        [
            "method",
            "rays",
            "s",
            "rms error",
            "99 % of the area",
            "worst patch",
            "merit [1/s]",
            "",
            "memory",
            "traffic",
        ],
        all.iter().map(|curve| row(curve.last(), points)),
    );
    page.paragraph("No other point is both faster and more accurate than:");
    page.table(
        ["s", "rms error", "99 % of the area", "worst patch", "method", "rays"],
        front(points).into_iter().map(|point| {
            let [method, rays, seconds, rms, p99, worst, ..] = row(point, points);
            [seconds, rms, p99, worst, method, rays]
        }),
    );
    page.paragraph(format!(
        "Errors of discrete methods are measured against {truth}; of continuous ones against {continuous_truth}."
    ));
    for Absent { name, why } in absent {
        page.line(format!("Not compared: {name} ({why})."));
    }
    page.line("");
}

/// A point as the cells of a table.
fn row(point: &ContenderResult, points: &[ContenderResult]) -> [String; 10] {
    let [merit, low, high] = point.merit().map(quantity);
    [
        point.method.clone(),
        quantity(point.traced as f64),
        number(point.seconds),
        format!("{} %", measured(in_percent(point.rms()))),
        percent(point.p99),
        percent(point.worst),
        format!("{merit} ({low} … {high})"),
        if is_pareto(point, points) { "●" } else { "" }.into(),
        point.memory.map_or("?".into(), bytes),
        bytes(point.traffic),
    ]
}

/// Writes the time to every error, method by method.
fn write_times(page: &mut Markdown, curves: &[MethodCurve<'_>]) {
    page.paragraph("Seconds of one core to an rms error of (– where a bias is in the way):");
    let levels = super::judge::LEVELS.map(|rms| format!("{} %", 100.0 * rms));
    let [a, b, c, d, e] = levels.each_ref().map(String::as_str);
    page.table(
        ["method", a, b, c, d, e],
        curves.iter().map(|curve| {
            let [a, b, c, d, e] =
                super::judge::LEVELS.map(|rms| curve.time_to(rms).map_or("–".into(), number));
            [curve.method.into(), a, b, c, d, e]
        }),
    );
}

/// Writes the advice: errors that ask for the same method share one item, with the exact commands for the first and the
/// last.
fn write_advice(page: &mut Markdown, path: &Path, advice: &[Advice<'_>]) {
    page.paragraph("**What to use.**");
    for group in advice.chunk_by(|a, b| a.ranking[0].0.method == b.ranking[0].0.method) {
        let (first, last) = (&group[0], &group[group.len() - 1]);
        let range = match group.len() {
            1 => format!("For an rms error of {} %", 100.0 * first.rms),
            _ => format!("For rms errors of {} % to {} %", 100.0 * first.rms, 100.0 * last.rms),
        };
        page.line(format!("- {range}: **{}**.", first.ranking[0].0.method));
        write_level(page, path, first);
        if group.len() > 1 {
            write_level(page, path, last);
        }
    }
    page.line("");
}

/// Writes the command for one error, and the next best method.
fn write_level(page: &mut Markdown, path: &Path, Advice { rms, ranking, alike }: &Advice<'_>) {
    let (ahead, behind) = ranking.split_at((*alike).max(1));
    let (best, time) = ahead[0];
    let percent = 100.0 * rms;
    let equals: Vec<&str> = ahead[1..].iter().map(|(curve, _)| curve.method).collect();
    let as_good = match &equals[..] {
        [] => String::new(),
        equals => format!(" (as good, as far as this tells: {})", equals.join(", ")),
    };
    page.line(format!("  - {percent} % in {} s: {}{as_good}", number(time), command(path, best, *rms)));
    if let Some((next, longer)) = behind.first() {
        let times = number(longer / time);
        let command = command(path, next, *rms);
        page.line(format!("  - {percent} % by {}, next, {times} times longer: {command}", next.method));
    }
}

/// The command by which a method reaches an error.
fn command(path: &Path, curve: &MethodCurve<'_>, rms: f64) -> String {
    let method = contender::method(curve.method).expect("only known methods are ranked");
    let paths = curve.paths_to(rms).expect("only methods that reach an error are ranked for it");
    format!("`radwalk run {} --set 'method={method}' --paths {paths}`", path.display())
}

fn in_percent(Measured { value, standard_error }: Measured) -> Measured {
    Measured { value: 100.0 * value, standard_error: 100.0 * standard_error }
}
