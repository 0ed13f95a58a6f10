//! The summary of a run, for people.

use job::{Keyword, OutputFile, Unhit};
use radiosity::Scene;
use report::words::{counted, duration, percent, quantity};
use report::{
    AccuracySummary, ChoiceSummary, Digits, PartitionSummary, PlaneSummary, SensitivitySummary,
    SensorSummary, SensorsSummary, SourceSummary, Summary, TargetReport, TotalSummary, Verdict, WorstPatch,
};

use crate::outputs::RunOutput;
use crate::settings::Settings;

/// The summary of a run of a job with these settings, a fact or two a line; `joined` is how many workers have joined in this
/// session, if there is one.
pub fn summary_lines(summary: &Summary, settings: &Settings, joined: Option<u64>) -> Vec<String> {
    let mut lines = vec![of_walks(summary, settings, joined)];
    lines.push(summary.headline());
    lines.extend(summary.choice.iter().map(of_choice));
    lines.extend(summary.partition.iter().filter(|_| summary.choice.is_none()).map(of_partition));
    lines.extend(summary.accuracy.iter().flat_map(of_accuracy));
    lines.extend(summary.model.lines().iter().map(|line| format!("model: {line}")));
    let found = |verdict: Verdict| summary.checks.iter().filter(move |check| check.verdict == verdict);
    let lost = found(Verdict::Passed).filter(|check| check.name == "escape" && summary.escaped > 0);
    lines.extend(lost.chain(found(Verdict::Failed)).map(|check| format!("note: {}", check.message)));
    let names: Vec<&str> = found(Verdict::NotExamined).map(|check| &check.name[..]).collect();
    if !names.is_empty() {
        lines.push(format!("checks not examined: {}", names.join(", ")));
    }
    lines.extend(summary.target.iter().flat_map(|target| of_target(target, summary, settings)));
    lines.extend(summary.sensors.iter().flat_map(|sensors| of_sensors(sensors, summary.system())));
    lines.extend(summary.planes.iter().flat_map(|plane| of_plane(plane, summary)));
    lines.extend(summary.sources.iter().map(|source| of_source(source, summary)));
    let known: Vec<&SensitivitySummary> = summary.sensitivities.iter().filter(|of| of.is_known()).collect();
    if let Some((most, others)) = known.split_first() {
        lines.push(of_sensitivities(most, others));
    }
    lines
}

impl RunOutput {
    /// The usual files that a job leaves out, and what needs them; `None` where it leaves out none.
    pub fn left_out_line(&self, settings: &Settings) -> Option<String> {
        let left_out = self.left_out(settings);
        if left_out.is_empty() {
            return None;
        }
        let list = |of: fn(OutputFile) -> &'static str, between: &str| {
            left_out.iter().map(|&file| of(file)).collect::<Vec<_>>().join(between)
        };
        let needs = match (left_out.contains(&OutputFile::Csv), left_out.contains(&OutputFile::Summary)) {
            (true, true) => "; diff needs patches.csv, and status summary.json",
            (true, false) => "; diff needs patches.csv",
            (false, true) => "; status needs summary.json",
            (false, false) => "",
        };
        Some(format!(
            "left out: {}; radwalk report {} --export {} makes them. Resume, merge and audit need tally.bin alone{needs}",
            list(OutputFile::name, ", "),
            self.path().display(),
            list(OutputFile::word, ",")
        ))
    }

    /// Where all digits are, where the table has not all of them.
    pub fn digits_line(&self, settings: &Settings, scene: &Scene) -> Option<String> {
        let is_short = self.digits(settings, scene) == Digits::Rounded;
        is_short.then(|| {
            format!(
                "patches.csv has {} rows, each number to three digits of its error; patches.parquet has all digits",
                scene.faces().len()
            )
        })
    }
}

/// How much was walked, and how fast.
fn of_walks(summary: &Summary, settings: &Settings, joined: Option<u64>) -> String {
    let whole =
        if summary.paths < settings.paths { format!(" of {}", settings.paths) } else { String::new() };
    format!(
        "{}{whole} paths, {} rays in {} by {}: {} paths/s, {} rays/s",
        summary.paths,
        summary.rays,
        duration(summary.seconds),
        workers(summary.workers_seen, summary.provenance.sessions.len() as u64, joined),
        quantity(summary.paths_per_second),
        quantity(summary.rays_per_second)
    )
}

/// The workers of a run: a worker that comes back in another session has joined again, and is counted again.
fn workers(seen: u64, sessions: u64, joined: Option<u64>) -> String {
    let seen = counted(seen, "worker");
    match joined {
        _ if sessions < 2 => seen,
        None => format!("{seen} in {sessions} sessions"),
        Some(joined) => {
            format!("{} in this session ({seen} in {sessions} sessions)", counted(joined, "worker"))
        }
    }
}

/// Which patches were chosen, and what was predicted of them.
fn of_partition(partition: &PartitionSummary) -> String {
    let PartitionSummary { surfaces, grouped, patches, basis, pilot_paths, for_paths, total, .. } =
        *partition;
    let cut = if grouped { "cut and grouped" } else { "cut" };
    format!(
        "patches: a pilot of {} paths {cut} {} and made {}, with {basis} light on each; it predicted an error of {} for {} paths",
        quantity(pilot_paths as f64),
        counted(surfaces, "surface"),
        counted(patches, "patch"),
        percent(total),
        quantity(for_paths as f64)
    )
}

/// What the program chose, and why.
fn of_choice(choice: &ChoiceSummary) -> String {
    let ChoiceSummary { method, basis, why, .. } = choice;
    format!("chosen: {method}, {basis} fits; {why}")
}

/// How far the answer is from the light on the patches, and whether that is near enough.
fn of_accuracy(accuracy: &AccuracySummary) -> Vec<String> {
    let AccuracySummary { answer, noise, discretisation, total, asked } = *accuracy;
    let answer = if answer == "linear" { "linear fits" } else { "means" };
    let errors = format!(
        "relative errors of the {answer}, over the area: noise {}, discretisation {}, total {}",
        percent(noise),
        percent(discretisation),
        percent(total)
    );
    let verdict = asked.map(|TotalSummary { target, reached }| {
        let total = percent(target);
        if reached {
            format!("target reached: a total error of {total}")
        } else if discretisation >= target {
            format!("target not reached: a total error of {total} takes finer patches, not more walks: a larger budget chooses them, unless the job states its own")
        } else {
            let paths = walks_needed(accuracy, target);
            format!("target not reached: a total error of {total} takes about {paths:.2} times the walks")
        }
    });
    [Some(errors), verdict].into_iter().flatten().collect()
}

/// The walks that a total error takes, over those that were walked: noise falls with their root.
fn walks_needed(accuracy: &AccuracySummary, target: f64) -> f64 {
    accuracy.noise.powi(2) / (target.powi(2) - accuracy.discretisation.powi(2))
}

/// Whether the target is reached, and what it still takes.
fn of_target(target: &TargetReport, summary: &Summary, settings: &Settings) -> Vec<String> {
    let verdict = if target.reached { "reached" } else { "not reached" };
    let mut lines = vec![format!("target {verdict}: {}{}", target.achieved_words(), summary.system())];
    lines.extend(target.paths_needed.map(|paths| {
        let seconds = (paths - summary.paths as f64) / summary.paths_per_second;
        format!("it takes about {} paths: {} more", quantity(paths), duration(seconds.max(0.0)))
    }));
    let sealed = summary.precision.headline.sealed_area > 0.0 && target.patches.is_none();
    if sealed
        && !target.reached
        && settings.target.as_ref().is_some_and(|asked| asked.unhit == Unhit::Infinite)
    {
        lines.push(
            "what is sealed counts as unknown; --set target.unhit=ignore leaves out what no walk has hit"
                .into(),
        );
    }
    lines.extend(target.worst.iter().filter(|_| !target.reached).map(of_worst));
    lines
}

/// One of the patches that keep a target from being reached.
fn of_worst(worst: &WorstPatch) -> String {
    let WorstPatch { words, relative_error, hits, paths_needed, .. } = worst;
    let needed = if paths_needed.is_finite() {
        format!("about {} paths", quantity(*paths_needed))
    } else {
        "an unknown number of paths".into()
    };
    format!("  {words}: {} after {hits} hits, takes {needed}", percent(*relative_error))
}

/// How well sensors are known. Their rays gather the radiosities of the patches, and so the light of the same `system`.
fn of_sensors(sensors: &SensorsSummary, system: &str) -> Vec<String> {
    let of_sensor = |SensorSummary { name, patches, relative_error, target }: &SensorSummary| {
        let known = match relative_error.is_finite() {
            true => format!("known within {}{system}", percent(*relative_error)),
            false => "not known yet in every patch".into(),
        };
        let asked = target.map_or(String::new(), |asked| format!(", {} is asked for", percent(asked)));
        format!("sensor {name:?} ({}): {known}{asked}", counted(*patches as u64, "patch"))
    };
    let verdict = sensors.reached.map(|reached| {
        format!("target of sensors {}{system}", if reached { "reached" } else { "not reached" })
    });
    sensors.list.iter().map(of_sensor).chain(verdict).collect()
}

/// What a plane of points has found.
fn of_plane(plane: &PlaneSummary, summary: &Summary) -> Vec<String> {
    let PlaneSummary { name, points, mean, minimum, uniformity, diversity, .. } = plane;
    let (unit, system) = (summary.units.irradiance, summary.system());
    let demands: String = plane.demands.iter().map(|demand| format!("; {}", demand.words(unit))).collect();
    let modelling = plane.modelling.as_ref().map_or(String::new(), |of| format!("; {}", of.words()));
    let ugr = plane.ugr.as_ref().map_or(String::new(), |of| format!("; {}", of.words()));
    let figures = format!(
        "plane {name:?} ({}): mean {} {unit}, minimum {} {unit}, U₀ {}, U_d {}{modelling}{ugr}{demands}{system}",
        counted(*points as u64, "point"),
        mean.words(),
        minimum.words(),
        uniformity.words(),
        diversity.words()
    );
    let dim = plane.dim.map(|dim| format!("note: plane {name:?}: {}", dim.words("the mean", "figures")));
    [figures].into_iter().chain(dim).collect()
}

/// How well the light of one source is known.
fn of_source(source: &SourceSummary, summary: &Summary) -> String {
    let SourceSummary { name, power, factor, relative_error, .. } = source;
    let (unit, system) = (summary.units.power, summary.system());
    let factor = factor.map_or(String::new(), |factor| format!(", {factor} times what the job says"));
    let known = match relative_error.is_finite() {
        true => format!("half of the area is known within {}{system}", percent(*relative_error)),
        false => "it gives no light that walks have found".into(),
    };
    format!("source {name:?} emits {} {unit}{factor}: {known}", quantity(*power))
}

/// Which material matters most.
fn of_sensitivities(most: &SensitivitySummary, others: &[&SensitivitySummary]) -> String {
    let change = |of: &SensitivitySummary| {
        let error = of.relative_change * of.std_error_bound / of.mean_derivative;
        let error = if error.is_finite() { format!(" ± {}", percent(error)) } else { String::new() };
        format!("{:?} by {}{error}", of.material, percent(of.relative_change))
    };
    let others: Vec<String> = others.iter().take(3).map(|of| change(of)).collect();
    let others = if others.is_empty() { String::new() } else { format!(", {}", others.join(", ")) };
    format!("a reflectance that is 0.01 higher raises the mean radiosity: {}{others}", change(most))
}
