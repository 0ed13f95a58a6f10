//! One walk in words.

use radiosity::{
    Scene,
    instruments::{Replay, ReplayedHit},
    methods::WalkEnd,
};

use crate::patches::side_name;

/// The birth, the arrivals and the end of a walk, a line each.
pub fn walk_lines(scene: &Scene, replay: &Replay) -> Vec<String> {
    let faces = scene.faces().len();
    let birth = match (replay.birth as usize).checked_sub(faces) {
        None => format!("is born on {}", place(scene, replay.birth)),
        Some(lamp) => format!("is born at lamp {lamp}"),
    };
    let end = match replay.end {
        WalkEnd::Absorbed => "and is absorbed there",
        WalkEnd::AbsorbedBack => "and is absorbed by the back of a one-sided surface",
        WalkEnd::Escaped => "and leaves the scene",
        WalkEnd::Truncated => "and is cut off there",
    };
    let steps = replay.steps.iter().map(|step| sentence(scene, step));
    std::iter::once(birth).chain(steps).chain([end.into()]).collect()
}

fn sentence(scene: &Scene, step: &ReplayedHit) -> String {
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
    let side = if scene.faces().two_sided() { side_name(face.side) } else { "" };
    let of = if side.is_empty() { "" } else { " of " };
    match scene.faces().pieces(number as usize).count() {
        1 => format!("{side}{of}patch {}, cell {u}, {v} of surface {name}", face.patch),
        cells => format!("{side}{of}patch {}, a group of {cells} faces from {name} on", face.patch),
    }
}
