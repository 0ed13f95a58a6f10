//! `radwalk check`: validates a job or a scene and says what would be modelled, and why.

mod doctor;

use job::{FileKind, SceneFile};
use radiosity::Experiment;
use report::Units;
use report::words::counted;
use results::units;
use voice::{Phase, say};

use crate::args::CheckArgs;
use crate::fault::{Fault, Outcome};

/// Checks a file and describes it.
pub(crate) fn check(args: &CheckArgs) -> Result<Outcome, Fault> {
    let phase = Phase::begin("checking the scene");
    // Of a scene the faces are checked as they are written.
    let job = match job::file_kind(&args.file)? {
        FileKind::Job => job::load(&args.file, &args.set)?,
        FileKind::Scene => job::load_as_written(&args.file, &args.set)?,
    };
    results::check_memory(&job, 1)?;
    describe_import(&job.scene);
    let faults = match (job::file_kind(&args.file)?, &job.auto) {
        (FileKind::Job, Some(auto)) => {
            let walks = job::MethodTable::default().walks();
            let faults = describe_scene(&Experiment::new(job.build_scene()?, walks)?, &units(job.light));
            say(&format!(
                "job: {} paths; a pilot cuts {} when it is run, which count as one patch each here",
                job.budget.paths,
                counted(auto.surfaces.len() as u64, "surface")
            ));
            faults
        }
        (FileKind::Job, None) => {
            let experiment = Experiment::new(job.build_scene()?, job.method.walks())?
                .with_sensors(job.scene.sensors())?
                .with_groups(&job.sources, &job.sensitivity)?;
            let faults = describe_scene(&experiment, &units(job.light));
            judge::job_lines(&job, &experiment).iter().for_each(|line| say(line));
            faults
        }
        (FileKind::Scene, _) => {
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
    judge::scene_lines(experiment, units).iter().for_each(|line| say(line));
    let faults = [::doctor::warnings(experiment.scene()), judge::sensor_warnings(experiment)].concat();
    faults.iter().for_each(|fault| say(&format!("fault: {fault}")));
    faults
}
