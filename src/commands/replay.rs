//! `radwalk replay`: one walk of a job, in words.

use radiosity::{Experiment, Sequence};
use voice::{Phase, say};

use crate::args::ReplayArgs;
use crate::choose::load_anew;
use crate::fault::{Fault, Outcome};

/// Tells a walk of a job.
pub(crate) fn replay(args: &ReplayArgs) -> Result<Outcome, Fault> {
    let phase = Phase::begin("reading the scene");
    let read = load_anew(&args.job, &phase)?;
    drop(phase);
    let (scene, job) = read.build()?;
    let experiment = Experiment::new(scene, job.method.walks())?;
    if !experiment.unit().is_walk() {
        return Err(Fault::NoWalks);
    }
    let replay = experiment.replay(&Sequence::new(job.seed), args.walk);
    say(&format!("walk {} of seed {}", args.walk, job.seed));
    report::walk_lines(experiment.scene(), &replay).iter().for_each(|line| say(line));
    Ok(Outcome::Done)
}
