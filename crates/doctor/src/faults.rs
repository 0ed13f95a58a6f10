//! Faults that light shows: surfaces that are turned round or buried, lamps that shine at nothing, openings.

use radiosity::Scene;

use crate::contact::Contacts;
use crate::cover::Covers;
use crate::finding::{Finding, Kind};
use crate::pilot::LightPilot;
use crate::votes::Votes;

/// The part of the scene's power below which losses are not reported one by one.
const LEAST_REPORTED: f64 = 1e-4;

/// The part of an emitting side's light that must be lost or shaded for the side to be dark.
const DARK: f64 = 0.9;

pub(crate) fn flipped(scene: &Scene, pilot: &LightPilot, flipped: &[u32]) -> Vec<Finding> {
    let finding = |&surface: &u32| Finding {
        kind: Kind::Flipped,
        surfaces: vec![surface],
        power: pilot.back(surface) + pilot.emission[surface as usize][0].lost,
        message: format!(
            "{} is turned round: its front sees no light, its back does",
            scene.surface_name(surface)
        ),
    };
    flipped.iter().map(finding).collect()
}

/// Finds emitters whose light goes nowhere.
pub(crate) fn dark_emitters(scene: &Scene, pilot: &LightPilot, flipped: &[u32]) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (surface, sides) in (0..).zip(&pilot.emission) {
        let name = scene.surface_name(surface);
        for (side, emission) in ["front", "back"].iter().zip(sides) {
            let part = |power: f64| power / emission.power;
            let what = if emission.power == 0.0 || flipped.contains(&surface) {
                continue;
            } else if part(emission.close) >= DARK {
                format!("meets something within {:.3} m", pilot.close)
            } else if part(emission.lost) >= DARK {
                "meets no surface that reflects".into()
            } else {
                continue;
            };
            findings.push(Finding {
                kind: Kind::Emitter,
                surfaces: vec![surface],
                power: emission.power,
                message: format!("the light of {name} from its {side} {what}"),
            });
        }
    }
    findings
}

/// Finds surfaces that no light comes to.
pub(crate) fn buried(scene: &Scene, votes: &Votes, flipped: &[u32], covers: &Covers) -> Vec<Finding> {
    let covered = covers.surfaces();
    let is_buried = |surface: u32| {
        let front = votes.front(surface);
        votes.is_one_sided(surface)
            && front.backs >= 0.999
            && !flipped.contains(&surface)
            && !covered.contains(&surface)
    };
    let finding = |surface: u32| Finding {
        kind: Kind::Buried,
        surfaces: vec![surface],
        power: 0.0,
        message: format!("{} sees nothing but backs of surfaces", scene.surface_name(surface)),
    };
    (0..scene.surfaces().len() as u32).filter(|&surface| is_buried(surface)).map(finding).collect()
}

/// Finds backs at which light is lost, those of flipped surfaces aside.
pub(crate) fn backs(scene: &Scene, pilot: &LightPilot, flipped: &[u32]) -> Vec<Finding> {
    let lost = (0..scene.surfaces().len() as u32)
        .map(|surface| (surface, pilot.back(surface)))
        .filter(|(surface, power)| *power > LEAST_REPORTED * pilot.power && !flipped.contains(surface));
    let finding = |(surface, power): (u32, f64)| Finding {
        kind: Kind::Back,
        surfaces: vec![surface],
        power,
        message: format!("light ends on the back of {}, which has one side", scene.surface_name(surface)),
    };
    lost.map(finding).collect()
}

/// Finds the opening through which light leaves, described by the edges around it.
pub(crate) fn opening(scene: &Scene, pilot: &LightPilot, contacts: &Contacts) -> Option<Finding> {
    // The names that a line holds.
    const NAMED: usize = 6;
    let mut surfaces = contacts.rims(scene, &pilot.ways_out);
    surfaces.truncate(NAMED);
    let names: Vec<&str> = surfaces.iter().map(|&surface| scene.surface_name(surface)).collect();
    let past = match names.is_empty() {
        true => String::new(),
        false => format!(", most of it past the edges of {}", names.join(", ")),
    };
    let channels = if scene.channels() > 1 { ", all channels together," } else { "" };
    let message = format!(
        "{:.2} % of the power{channels} leaves the scene{past} (± {:.2}, one standard error: {} walks of a pilot)",
        100.0 * pilot.escaped_part(),
        100.0 * pilot.escaped_error(),
        pilot.walks()
    );
    Some(Finding { kind: Kind::Open, surfaces, power: pilot.escaped(), message })
}
