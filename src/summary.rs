//! The end of a run: its results written to the folder, and a few lines on screen.

use job::{OutputFile, Word};
use judge::target;
use protocol::checkpoint::Checkpoint;
use radiosity::Experiment;
use report::words::{counted, duration, percent, quantity};
use report::{
    AccuracySummary, PartitionSummary, PrecisionSummary, SensitivitySummary, SensorSummary, SensorsSummary,
    SourceSummary, Summary, Target, TotalSummary, WorstPatch,
};
use results::{Latest, RunOutput, Settings};
use tracing::warn;
use voice::{Phase, emit, say};

use crate::args::OutArgs;
use crate::fault::Fault;

/// Writes the results of some walks and prints a summary. Without walks nothing is written.
///
/// # Errors
/// Where the books do not balance or a file cannot be written.
pub(crate) fn write(
    output: &RunOutput,
    settings: &Settings,
    experiment: &Experiment,
    checkpoint: &Checkpoint,
    latest: Latest,
    out: &OutArgs,
) -> Result<(), Fault> {
    if checkpoint.tally.counts.walks == 0 {
        warn!(
            "no walk was finished, so nothing is written to {}; what is there is from before",
            output.path().display()
        );
        return Ok(());
    }
    let phase = Phase::begin("estimating every patch");
    let summary = output.write(settings, experiment, checkpoint, latest, &|doing| phase.now(doing))?;
    drop(phase);
    if out.json {
        emit(&serde_json::json!({"event": "done", "out": output.path(), "paths": summary.paths}));
    } else if !out.quiet {
        describe(&summary, settings);
        say(&format!("written to {}", output.path().display()));
        describe_left_out(output, settings, experiment);
    }
    Ok(())
}

/// The files that were left out because the job does not name them, and their use.
fn describe_left_out(output: &RunOutput, settings: &Settings, experiment: &Experiment) {
    let left_out = output.left_out(settings, experiment.scene().faces().patch_count());
    if left_out.is_empty() {
        return;
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
    say(&format!(
        "left out: {}; radwalk report {} --export {} makes them. Resume, merge and audit need tally.bin alone{needs}",
        list(OutputFile::name, ", "),
        output.path().display(),
        list(OutputFile::word, ",")
    ));
}

/// A few lines for people.
fn describe(summary: &Summary, settings: &Settings) {
    let whole =
        if summary.paths < settings.paths { format!(" of {}", settings.paths) } else { String::new() };
    say(&format!(
        "{}{whole} paths, {} rays in {} by {}: {} paths/s, {} rays/s",
        summary.paths,
        summary.rays,
        duration(summary.seconds),
        counted(summary.workers_seen, "worker"),
        quantity(summary.paths_per_second),
        quantity(summary.rays_per_second)
    ));
    describe_precision(summary);
    if let Some(partition) = &summary.partition {
        describe_partition(partition);
    }
    if let Some(accuracy) = &summary.accuracy {
        describe_accuracy(accuracy);
    }
    for line in summary.model.lines() {
        say(&format!("model: {line}"));
    }
    for check in summary.checks.iter().filter(|check| !check.ok) {
        say(&format!("note: {}", check.message));
    }
    if let Some(target) = &summary.target {
        describe_target(target, summary);
    }
    if let Some(sensors) = &summary.sensors {
        describe_sensors(sensors);
    }
    summary.sources.iter().for_each(|source| describe_source(source, summary.units.power));
    if let Some(most) = summary.sensitivities.first() {
        describe_sensitivity(most, &summary.sensitivities[1..]);
    }
}

/// How well the light of one source is known.
fn describe_source(source: &SourceSummary, unit: &str) {
    let SourceSummary { name, power, factor, relative_error, .. } = source;
    let factor = factor.map_or(String::new(), |factor| format!(", {factor} times what the job says"));
    let known = match relative_error.is_finite() {
        true => format!("half of the area is known within {}", percent(*relative_error)),
        false => "it gives no light that walks have found".into(),
    };
    say(&format!("source {name:?} emits {} {unit}{factor}: {known}", quantity(*power)));
}

/// Which material matters most.
fn describe_sensitivity(most: &SensitivitySummary, others: &[SensitivitySummary]) {
    let change = |of: &SensitivitySummary| {
        let error = of.relative_change * of.std_error_bound / of.mean_derivative;
        let error = if error.is_finite() { format!(" ± {}", percent(error)) } else { String::new() };
        format!("{:?} by {}{error}", of.material, percent(of.relative_change))
    };
    let others: Vec<String> = others.iter().take(3).map(change).collect();
    let others = if others.is_empty() { String::new() } else { format!(", {}", others.join(", ")) };
    say(&format!("a reflectance that is 0.01 higher raises the mean radiosity: {}{others}", change(most)));
}

/// How well sensors are known.
fn describe_sensors(sensors: &SensorsSummary) {
    for SensorSummary { name, patches, relative_error, target } in &sensors.list {
        let known = match relative_error.is_finite() {
            true => format!("known within {}", percent(*relative_error)),
            false => "not known yet in every patch".into(),
        };
        let asked = target.map_or(String::new(), |asked| format!(", {} is asked for", percent(asked)));
        say(&format!("sensor {name:?} ({}): {known}{asked}", counted(*patches as u64, "patch")));
    }
    if let Some(reached) = sensors.reached {
        say(&format!("target of sensors {}", if reached { "reached" } else { "not reached" }));
    }
}

/// Which patches were chosen, and what was foretold of them.
fn describe_partition(partition: &PartitionSummary) {
    let PartitionSummary { surfaces, patches, basis, pilot_paths, for_paths, total, .. } = *partition;
    say(&format!(
        "patches: a pilot of {} paths cut {} in {}, with {basis} light on each; it foretold an error of {} for {} paths",
        quantity(pilot_paths as f64),
        counted(surfaces, "surface"),
        counted(patches, "patch"),
        percent(total),
        quantity(for_paths as f64)
    ));
}

/// How far the means of patches are from the light on them, and whether that is near enough.
fn describe_accuracy(accuracy: &AccuracySummary) {
    let AccuracySummary { noise, discretisation, total, asked, .. } = *accuracy;
    say(&format!(
        "relative errors of the means, over the area: noise {}, discretisation {}, total {}",
        percent(noise),
        percent(discretisation),
        percent(total)
    ));
    let Some(TotalSummary { target, reached }) = asked else { return };
    if reached {
        say(&format!("target reached: a total error of {}", percent(target)));
    } else if discretisation >= target {
        say(&format!(
            "target not reached: a total error of {} takes finer patches, not more walks",
            percent(target)
        ));
    } else {
        let paths = walks_needed(accuracy, target);
        say(&format!(
            "target not reached: a total error of {} takes about {paths:.2} times the walks",
            percent(target)
        ));
    }
}

/// The walks that a total error takes, over those that were walked: noise falls with their root.
fn walks_needed(accuracy: &AccuracySummary, target: f64) -> f64 {
    accuracy.noise.powi(2) / (target.powi(2) - accuracy.discretisation.powi(2))
}

/// How well the patches are known.
fn describe_precision(summary: &Summary) {
    let precision = &summary.precision;
    // Where there is no light, there is no relative error.
    if precision.error_quantiles["0.99"].is_finite() || precision.unhit.area < 1.0 - 1e-12 {
        say(&format!(
            "half-widths of the {}{} % intervals: half of the area within {}, 9 tenths within {}, {}",
            if summary.simultaneous { "simultaneous " } else { "" },
            100.0 * summary.confidence,
            percent(precision.error_quantiles["0.5"]),
            percent(precision.error_quantiles["0.9"]),
            worst(precision)
        ));
    } else {
        say("no walk reached any patch that reflects: only upper bounds of its light are known");
    }
    for (apart, why) in [
        (precision.unhit, "that no walk has reached"),
        (precision.tiny, "each below a millionth of the area"),
    ] {
        if apart.patches > 0 {
            let area = percent(apart.area);
            say(&format!("listed apart: {} patches {why}, {area} of the area in all", apart.patches));
        }
    }
}

/// The worst patch. While some patch is unknown, the worst is that one, and says nothing of the others.
fn worst(precision: &PrecisionSummary) -> String {
    match &precision.worst_place {
        Some(place) if precision.max_relative_error.is_finite() => {
            format!("worst {} ({place})", percent(precision.max_relative_error))
        }
        _ => format!("99 hundredths within {}", percent(precision.error_quantiles["0.99"])),
    }
}

/// Whether the target is reached, and what it still takes.
fn describe_target(target: &Target, summary: &Summary) {
    let verdict = if target.reached { "reached" } else { "not reached" };
    say(&format!(
        "target {verdict}: {:.2} % of {} is within {}",
        100.0 * target.achieved,
        target::scope(target.patches.as_deref()),
        percent(target.relative_error)
    ));
    if let Some(paths) = target.paths_needed {
        let seconds = (paths - summary.paths as f64) / summary.paths_per_second;
        say(&format!("it takes about {} paths: {} more", quantity(paths), duration(seconds.max(0.0))));
    }
    target.worst.iter().filter(|_| !target.reached).for_each(describe_worst);
}

/// One of the patches that keep a target from being reached.
fn describe_worst(worst: &WorstPatch) {
    let WorstPatch { words, relative_error, hits, paths_needed, .. } = worst;
    let needed = if paths_needed.is_finite() {
        format!("about {} paths", quantity(*paths_needed))
    } else {
        "an unknown number of paths".into()
    };
    say(&format!("  {words}: {} after {hits} hits, takes {needed}", percent(*relative_error)));
}
