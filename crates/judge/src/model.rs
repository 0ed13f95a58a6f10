//! What would be modelled, and why, in words: for `radwalk check`.

use job::Job;
use radiosity::{Experiment, Scene, Side, sensors::SensorShape};
use report::words::counted;
use report::{MethodWords, Model, Units, target_scope, view_troubles};

use crate::bounces::bounces;
use crate::coincident::Coincident;
use crate::fit::misfits;
use crate::target::asked_of_sensors;

/// The scene of an experiment, with what coincides in it, and its sensors.
pub fn scene_lines(experiment: &Experiment, units: &Units) -> Vec<String> {
    let scene = experiment.scene();
    let fronts = || scene.faces().iter().filter(|face| face.side == Side::Front);
    let area: f64 = fronts().map(|patch| patch.area).sum();
    let emitters = fronts().filter(|patch| patch.emittance.is_lit()).count();
    let lamps = match scene.lamp_count() {
        0 => String::new(),
        lamps => format!(" and {}", counted(lamps as u64, "lamp")),
    };
    let mut lines = vec![format!(
        "scene: {}, {}, {area:.6} m², {}{lamps} of {} {} in all",
        counted(scene.surfaces().len() as u64, "surface"),
        counted(scene.faces().patch_count() as u64, "patch"),
        counted(emitters as u64, "emitting patch"),
        power(scene),
        units.power
    )];
    if scene.pane_count() > 0 {
        lines.push(format!("panes: {} of clear glass", counted(scene.pane_count() as u64, "pane")));
    }
    lines.extend(Coincident::of(scene).lines());
    let sensors = experiment.sensors();
    for (number, spec) in sensors.iter().flat_map(|sensors| sensors.specs().iter().enumerate()) {
        let what = match spec.shape {
            SensorShape::Point { .. } => "a point".into(),
            SensorShape::Points { ref points, .. } => counted(points.len() as u64, "point"),
            SensorShape::Eyes { ref points, .. } => counted(points.len() as u64, "eye"),
            SensorShape::Cylinders { ref points, half: false, .. } => {
                counted(points.len() as u64, "cylinder")
            }
            SensorShape::Cylinders { ref points, .. } => counted(points.len() as u64, "half cylinder"),
            SensorShape::Quad { .. } => {
                let cells = sensors.map_or(0..0, |sensors| sensors.cells_of(number));
                counted(cells.len() as u64, "patch")
            }
        };
        lines.push(format!("sensor {:?}: {what}", spec.name));
    }
    lines
}

/// Φ_T [W], channel by channel.
fn power(scene: &Scene) -> String {
    let channels = (0..scene.channels()).map(|channel| format!("{:.6}", scene.total_power(channel)));
    channels.collect::<Vec<_>>().join(", ")
}

/// A job, its targets, its model, and what theory has against its method.
pub fn job_lines(job: &Job, experiment: &Experiment) -> Vec<String> {
    let scene = experiment.scene();
    let mut lines = vec![what(job, experiment)];
    let final_gather = experiment.method().final_gather();
    if !final_gather.is_empty() {
        lines.push(format!("final gather: {} chosen patches", final_gather.len()));
    }
    lines.extend(targets(job));
    lines.extend(job.files.as_ref().map(|files| {
        let names = ["tally.bin"].into_iter().chain(files.iter().map(|file| file.name()));
        format!("output: {}", names.collect::<Vec<_>>().join(", "))
    }));
    let notes = view_troubles(scene, &job.view, &job.views).into_iter().chain(job.note.clone());
    lines.extend(notes.map(|note| format!("note: {note}")));
    let model = Model::new(scene, experiment.method(), bounces(experiment));
    lines.extend(model.lines().into_iter().chain(model.why).map(|line| format!("model: {line}")));
    lines.extend(misfits(experiment).iter().map(|misfit| format!("note: {misfit}")));
    lines
}

fn what(job: &Job, experiment: &Experiment) -> String {
    let MethodWords { walk, estimator, space, sampler, chains } = MethodWords::of(experiment.method());
    let kind =
        chains.map_or_else(|| format!("{space} {estimator} {walk}"), |chains| format!("{walk} ({chains})"));
    format!(
        "job: {} paths of {kind}, {sampler} numbers from seed {}, {} % intervals",
        job.budget.paths,
        job.seed,
        100.0 * job.confidence
    )
}

fn targets(job: &Job) -> Vec<String> {
    let of_patches = job.target.as_ref().map(|target| {
        let of = target_scope(target.patches.as_deref(), target.quantity);
        let quantity = target.quantity.words();
        format!(
            "relative half-width {} of the {quantity} on {} of {of}",
            target.relative_error, target.fraction
        )
    });
    let of_sensors = job.sensor_target.as_ref().map(|target| asked_of_sensors(target, job.scene.sensors()));
    let of_total = job
        .total_target
        .as_ref()
        .map(|target| format!("relative error {} of noise and discretisation together", target.total_error));
    let targets = [of_patches, of_sensors, of_total].into_iter().flatten();
    targets.map(|target| format!("target: {target}")).collect()
}
