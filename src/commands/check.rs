//! `radwalk check`: what would be modelled of a job or a scene and why, and all that is wrong with it at once.

mod doctor;
mod table;

use job::{FileKind, Job, MethodTable};
use radiosity::Experiment;
use report::words::counted;
use results::units;
use serde_json::json;
use voice::{Phase, say};

use self::doctor::Examined;
use crate::args::CheckArgs;
use crate::fault::{Fault, Outcome};

/// What a look at a scene tells: what would be modelled, and what is wrong, a sentence each.
type CheckReport = (Vec<String>, Vec<String>);

/// Checks a file and describes it. Faults have one numbering, and the exit code tells of them.
pub(crate) fn check(args: &CheckArgs) -> Result<Outcome, Fault> {
    let phase = Phase::begin("checking the scene");
    let overrides = [args.mesh.overrides()?, args.set.clone()].concat();
    let is_job = job::file_kind(&args.file)? == FileKind::Job;
    // Of a scene the faces are checked as they are written.
    let load = if is_job { job::load } else { job::load_as_written };
    let job = load(&args.file, &overrides)?;
    results::check_memory(&job, 1)?;
    let (model, mut faults) = match look(&job, is_job) {
        // A mesh that cannot be run is shown all the same: its materials tell what to do.
        Err(fault) if job.scene.has_mesh() => (Vec::new(), vec![fault.to_string()]),
        model => model?,
    };
    let mut examined = None;
    if (args.fix_report || args.repair) && !model.is_empty() {
        let Examined { faults: more, remarks } = doctor::examine(&job, args.out.as_deref())?;
        faults.extend(more);
        examined = Some(remarks);
    }
    drop(phase);
    if args.json {
        let answer = json!({
            "scene": table::scene(&job.scene),
            "materials": table::values(&job.scene),
            "notes": job.scene.notes(),
            "model": model,
            "faults": faults,
            "remarks": examined.unwrap_or_default(),
        });
        say(&answer.to_string());
    } else if !args.quiet {
        job.scene.notes().iter().for_each(|note| say(&format!("note: {note}")));
        table::lines(&job.scene).iter().chain(&model).for_each(|line| say(line));
        (1..).zip(&faults).for_each(|(number, fault)| say(&format!("fault {number}: {fault}")));
        match &examined {
            Some(remarks) => remarks.iter().for_each(|remark| say(remark)),
            None if faults.is_empty() => say("no fault found"),
            None => {}
        }
    }
    if args.repair {
        doctor::repair(&job)?;
    }
    Ok(if faults.is_empty() { Outcome::Done } else { Outcome::Faulty })
}

/// Builds what a file describes, and says what it is and what is wrong with its light and its sensors.
fn look(job: &Job, is_job: bool) -> Result<CheckReport, Fault> {
    let open = job.auto.as_ref().filter(|_| is_job);
    let method = if is_job && open.is_none() { job.method.walks() } else { MethodTable::default().walks() };
    let experiment = Experiment::new(job.build_scene()?, method)?
        .with_sensors(job.scene.sensors())?
        .with_groups(&job.sources, &job.sensitivity)?;
    let mut lines = judge::scene_lines(&experiment, &units(job.light));
    match open {
        Some(auto) => lines.push(format!(
            "job: {} paths; a pilot cuts {} when it is run, which count as one patch each here",
            job.budget.paths,
            counted(auto.surfaces.len() as u64, "surface")
        )),
        None if is_job => lines.extend(judge::job_lines(job, &experiment)),
        None => {}
    }
    let faults = [::doctor::warnings(experiment.scene()), judge::sensor_warnings(&experiment)].concat();
    Ok((lines, faults))
}
