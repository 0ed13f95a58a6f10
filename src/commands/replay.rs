//! `radwalk replay`: one walk of a job, in words.

use radiosity::{Experiment, Scene, Sequence, Step, WalkEnd};
use voice::{Phase, say};

use crate::args::ReplayArgs;
use crate::choose::load_anew;
use crate::fault::{Fault, Outcome};

/// Tells a walk of a job.
pub(crate) fn replay(args: &ReplayArgs) -> Result<Outcome, Fault> {
    let phase = Phase::begin("reading the scene");
    let job = load_anew(&args.job, &phase)?;
    drop(phase);
    let experiment = Experiment::new(job.build_scene()?, job.method.walks())?;
    if !experiment.unit().is_walk() {
        return Err(Fault::NoWalks);
    }
    let replay = experiment.replay(&Sequence::new(job.seed), args.walk);
    let scene = experiment.scene();
    say(&format!("walk {} of seed {}", args.walk, job.seed));
    say(&format!("is born on {}", place(scene, replay.birth)));
    for step in &replay.steps {
        say(&sentence(scene, step));
    }
    say(match replay.end {
        WalkEnd::Absorbed => "and is absorbed there",
        WalkEnd::AbsorbedBack => "and is absorbed by the back of a one-sided surface",
        WalkEnd::Escaped => "and leaves the scene",
        WalkEnd::Truncated => "and is cut off there",
    });
    Ok(Outcome::Done)
}

fn sentence(scene: &Scene, step: &Step) -> String {
    let arrival = format!("arrives at {}", place(scene, step.patch));
    let weight = if step.weights.iter().all(|&weight| weight == 1.0) {
        String::new()
    } else {
        let weights: Vec<String> = step.weights.iter().map(|weight| format!("{weight:.6}")).collect();
        format!(" with weight {}", weights.join(", "))
    };
    let survival = if step.survives { " and goes on" } else { "" };
    format!("{arrival}{weight}{survival}")
}

/// A face as people find it.
fn place(scene: &Scene, number: u32) -> String {
    let face = scene.faces().get(number as usize);
    let ([u, v], name) = (face.cell, scene.surface_name(face.surface));
    let side = if scene.faces().two_sided() { report::side_name(face.side) } else { "" };
    let of = if side.is_empty() { "" } else { " of " };
    format!("{side}{of}patch {}, cell {u}, {v} of surface {name}", face.patch)
}
