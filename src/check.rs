//! `radwalk check`: validates a job or a scene and says what would be modelled, and why.

use job::{FileKind, Job, SceneFile};
use judge::bounces::bounces;
use judge::coincident::Coincident;
use judge::fit::misfits;
use judge::{MOMENTS, target};
use radiosity::{Experiment, Scene, Side};
use report::{MethodWords, Model};

use crate::args::CheckArgs;
use crate::console::say;
use crate::doctor_report;
use crate::fault::{Fault, Outcome};

/// Checks a file and describes it.
pub fn check(args: &CheckArgs) -> Result<Outcome, Fault> {
    let job = job::load(&args.file, &args.set)?;
    describe_import(&job.scene);
    match job::file_kind(&args.file)? {
        FileKind::Job => {
            let experiment = Experiment::new(job.build_scene()?, job.method.walks())?;
            describe_scene(experiment.scene());
            describe_job(&job, &experiment);
        }
        FileKind::Scene => describe_scene(&job.build_scene()?),
    }
    if args.fix_report || args.repair {
        doctor_report::report(&job)?;
    } else {
        say("no fault found");
    }
    if args.repair {
        doctor_report::repair(&job)?;
    }
    Ok(Outcome::Done)
}

/// What was left out, changed or assumed of meshes.
fn describe_import(scene: &SceneFile) {
    scene.notes().iter().for_each(|note| say(&format!("note: {note}")));
}

fn describe_scene(scene: &Scene) {
    let fronts = || scene.faces().iter().filter(|face| face.side == Side::Front);
    let area: f64 = fronts().map(|patch| patch.area).sum();
    let emitters = fronts().filter(|patch| patch.emittance.is_lit()).count();
    say(&format!(
        "scene: {} surfaces, {} patches, {area:.6} m², {emitters} emitting patches of {} W in all",
        scene.surfaces().len(),
        scene.faces().patch_count(),
        power(scene)
    ));
    Coincident::of(scene).lines().iter().for_each(|line| say(line));
}

/// Φ_T [W], channel by channel.
fn power(scene: &Scene) -> String {
    let channels = (0..scene.channels()).map(|channel| format!("{:.6}", scene.total_power(channel)));
    channels.collect::<Vec<_>>().join(", ")
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
