//! The doctor: faults in the geometry of a scene, those that cost the most power first.
//!
//! [`examine`] looks at a scene in four ways. A pilot ([`pilot`]) follows light from the emitters and finds where it is
//! lost: at backs, and out of the scene. Votes ([`votes`]) are rays from both sides of every surface, and tell which
//! side belongs inwards. Covers ([`cover`]) are the surfaces that the scene itself takes as layers of one plane. Contacts
//! ([`contact`]) are distances between surfaces: edges that miss their neighbour by a gap. [`repair`] turns flipped
//! surfaces round, with those that are connected to them ([`sheets`]), and takes doubled ones out. [`warnings`] tells in a
//! sentence or two, before a run, how much of the light is lost; [`lines`] tells the findings. [`Around`] tells of a scene without
//! light whether it has rooms or lies under a sky.

#![warn(unreachable_pub, unnameable_types)]

mod around;
mod contact;
mod cover;
mod faults;
mod finding;
mod losses;
mod nearby;
mod pierce;
mod pilot;
mod repair;
mod sheets;
mod stray;
mod text;
mod votes;

use radiosity::{IndexChoice, Scene, SceneError, SceneSpec};

pub use around::{Around, ClosedRoom, Lightless, Shine};
pub use finding::{Finding, Kind};
pub use repair::{Repair, repair, turn_flipped};
pub use text::{ENDLESS, lines, warnings};

use crate::contact::Contacts;
use crate::cover::Covers;
use crate::pilot::LightPilot;
use crate::votes::Votes;

/// The part of its light below which a scene that loses it counts as closed: in such a scene, a gap through which light
/// leaves is a leak, and not one more opening.
const CLOSED: f64 = 0.02;

/// Examines a scene. The findings depend on the scene alone.
///
/// # Errors
/// What [`Scene::build`] refuses.
pub fn examine(spec: &SceneSpec) -> Result<Vec<Finding>, SceneError> {
    let scene = Scene::build(spec, IndexChoice::Auto)?;
    let pilot = LightPilot::follow(&scene);
    let votes = Votes::take(&scene, &pilot);
    let contacts = Contacts::find(spec, &scene);
    let mut findings = Vec::new();
    let covers = Covers::find(&scene, &pilot);
    findings.extend(covers.findings(&scene));
    let flipped = votes.flipped(&pilot);
    findings.extend(faults::flipped(&scene, &pilot, &flipped));
    findings.extend(faults::dark_emitters(&scene, &pilot, &flipped));
    findings.extend(faults::buried(&scene, &votes, &flipped, &covers));
    findings.extend(faults::backs(&scene, &pilot, &flipped));
    if pilot.escaped_part() > 0.0 && flipped.is_empty() {
        findings.extend(faults::opening(&scene, &pilot, &contacts));
    }
    if pilot.escaped_part() < CLOSED {
        findings.extend(contacts.leaks(&scene, &pilot));
    }
    Ok(finding::gather(&scene, findings))
}
