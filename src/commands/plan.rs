//! `radwalk plan`: what a job will take, before it is run.

use judge::plan::{ProcessMeters, RunForecast};
use radiosity::Experiment;
use results::{Settings, units};
use voice::{Phase, say};

use crate::args::PlanArgs;
use crate::choose::load_anew;
use crate::clock::cpu_seconds;
use crate::fault::{Fault, Outcome};

/// Plans a job and prints the plan. Nothing is written.
pub(crate) fn plan(args: &PlanArgs) -> Result<Outcome, Fault> {
    let phase = Phase::begin("reading the scene");
    let read = load_anew(&args.job, &phase)?;
    results::check_memory(&read.job, 1)?;
    let (scene, job) = read.build()?;
    let experiment = Experiment::new(scene, job.method.walks())?
        .with_sensors(job.scene.sensors())?
        .with_groups(&job.sources, &job.sensitivity)?;
    phase.now("shooting a pilot");
    let settings = Settings::of(&job);
    let (level, goal) = (settings.level(experiment.scene()), settings.sensor_goal(&experiment));
    let asked = (level, goal.as_ref());
    let meters = ProcessMeters { cpu_seconds, peak_memory: results::peak_memory };
    let forecast = RunForecast::of(&job, &experiment, asked, args.workers, meters);
    drop(phase);
    if args.json {
        say(&forecast.json().to_string());
    } else {
        forecast.lines(&units(job.light)).iter().for_each(|line| say(line));
    }
    Ok(Outcome::Done)
}
