//! `radwalk check`: validates a job or a scene and says what would be modelled, and why.

mod doctor;

use job::{FileKind, Job, SceneFile};
use judge::bounces::bounces;
use judge::coincident::Coincident;
use judge::fit::misfits;
use judge::{MOMENTS, target};
use radiosity::{Experiment, Scene, SensorShape, Side};
use report::words::counted;
use report::{MethodWords, Model, Units, view_troubles};
use results::units;
use voice::{Phase, say};

use crate::args::CheckArgs;
use crate::fault::{Fault, Outcome};
use crate::memory;

/// Checks a file and describes it.
pub(crate) fn check(args: &CheckArgs) -> Result<Outcome, Fault> {
    let phase = Phase::begin("checking the scene");
    let job = job::load(&args.file, &args.set)?;
    memory::check(&job, 1)?;
    describe_import(&job.scene);
    let faults = match job::file_kind(&args.file)? {
        FileKind::Job if job.auto.is_some() => {
            let walks = job::MethodTable::default().walks();
            let faults = describe_scene(&Experiment::new(job.build_scene()?, walks)?, &units(job.light));
            describe_open(&job);
            faults
        }
        FileKind::Job => {
            let experiment = Experiment::new(job.build_scene()?, job.method.walks())?
                .with_sensors(job.scene.sensors())?
                .with_groups(&job.sources, &job.sensitivity)?;
            let faults = describe_scene(&experiment, &units(job.light));
            describe_job(&job, &experiment);
            faults
        }
        FileKind::Scene => {
            let walks = job::MethodTable::default().walks();
            let experiment = Experiment::new(job.build_scene()?, walks)?
                .with_sensors(job.scene.sensors())?
                .with_groups(&job.sources, &job.sensitivity)?;
            describe_scene(&experiment, &units(job.light))
        }
    };
    if args.fix_report || args.repair {
        doctor::report(&job, args.out.as_deref())?;
    } else if faults.is_empty() {
        say("no fault found");
    }
    drop(phase);
    if args.repair {
        doctor::repair(&job)?;
    }
    Ok(Outcome::Done)
}

/// What was left out, changed or assumed of meshes.
fn describe_import(scene: &SceneFile) {
    scene.notes().iter().for_each(|note| say(&format!("note: {note}")));
}

/// Returns what is wrong with its light and with its sensors, which is said.
fn describe_scene(experiment: &Experiment, units: &Units) -> Vec<String> {
    let scene = experiment.scene();
    let fronts = || scene.faces().iter().filter(|face| face.side == Side::Front);
    let area: f64 = fronts().map(|patch| patch.area).sum();
    let emitters = fronts().filter(|patch| patch.emittance.is_lit()).count();
    say(&format!(
        "scene: {}, {}, {area:.6} m², {} of {} {} in all",
        counted(scene.surfaces().len() as u64, "surface"),
        counted(scene.faces().patch_count() as u64, "patch"),
        counted(emitters as u64, "emitting patch"),
        power(scene),
        units.power
    ));
    Coincident::of(scene).lines().iter().for_each(|line| say(line));
    let sensors = experiment.sensors();
    for (number, spec) in sensors.iter().flat_map(|sensors| sensors.specs().iter().enumerate()) {
        let what = match spec.shape {
            SensorShape::Point { .. } => "a point".into(),
            SensorShape::Quad { .. } => {
                let cells = sensors.map_or(0..0, |sensors| sensors.cells_of(number));
                counted(cells.len() as u64, "patch")
            }
        };
        say(&format!("sensor {:?}: {what}", spec.name));
    }
    let faults = [::doctor::warnings(scene), judge::sensors::warnings(experiment)].concat();
    faults.iter().for_each(|fault| say(&format!("fault: {fault}")));
    faults
}

/// Φ_T [W], channel by channel.
fn power(scene: &Scene) -> String {
    let channels = (0..scene.channels()).map(|channel| format!("{:.6}", scene.total_power(channel)));
    channels.collect::<Vec<_>>().join(", ")
}

/// What a pilot chooses when the job is run.
fn describe_open(job: &Job) {
    let open = job.auto.as_ref().map_or(0, |auto| auto.surfaces.len());
    say(&format!(
        "job: {} paths; a pilot chooses the patches of {} when it is run, which count as one each here",
        job.budget.paths,
        counted(open as u64, "surface")
    ));
}

fn describe_job(job: &Job, experiment: &Experiment) {
    let scene = experiment.scene();
    let MethodWords { walk, estimator, space, sampler, chains } = MethodWords::of(experiment.method());
    let final_gather = experiment.method().final_gather();
    let kind =
        chains.map_or_else(|| format!("{space} {estimator} {walk}"), |chains| format!("{walk} ({chains})"));
    say(&format!(
        "job: {} paths of {kind}, {sampler} numbers from seed {}, {} % intervals",
        job.budget.paths,
        job.seed,
        100.0 * job.confidence
    ));
    if !final_gather.is_empty() {
        say(&format!("final gather: {} chosen patches", final_gather.len()));
    }
    if let Some(target) = &job.target {
        say(&format!(
            "target: relative half-width {} on {} of {}",
            target.relative_error,
            target.fraction,
            target::scope(target.patches.as_deref())
        ));
    }
    if let Some(target) = &job.sensor_target {
        say(&format!("target: {}", target::asked_of_sensors(target, job.scene.sensors())));
    }
    if let Some(target) = &job.total_target {
        say(&format!("target: relative error {} of noise and discretisation together", target.total_error));
    }
    if let Some(files) = &job.files {
        let names = ["tally.bin"].into_iter().chain(files.iter().map(|file| file.name()));
        say(&format!("output: {}", names.collect::<Vec<_>>().join(", ")));
    }
    view_troubles(scene, &job.view).iter().for_each(|trouble| say(&format!("note: {trouble}")));
    if let Some(note) = &job.note {
        say(&format!("note: {note}"));
    }
    let model = Model::new(scene, experiment.method(), MOMENTS, bounces(experiment));
    for line in model.lines().into_iter().chain(model.why) {
        say(&format!("model: {line}"));
    }
    for misfit in misfits(experiment) {
        say(&format!("note: {misfit}"));
    }
}
