//! What the doctor finds, in words; and warnings about power that vanishes: on backs, or at once.

use radiosity::Scene;

use crate::finding::Finding;
use crate::losses::{Losses, losses};
use crate::stray::stray_lamps;

/// The most faces of a scene that is examined before a run.
const MOST_FACES: usize = 20_000_000;

/// The part of the power lost at once from which a warning is due; open scenes lose less.
const VANISHES: f64 = 0.9;

/// The part of the power on backs from which a warning before a run is due; the check `backs` counts less.
const WORTH_A_WORD: f64 = 0.01;

/// Above this reflectance a walk in a closed room is reflected a million times and more, and may not end while anyone waits.
pub const ENDLESS: f64 = 0.999_999;

/// The most surfaces that are named.
const NAMED: usize = 5;

/// The most findings that are listed one by one.
const LISTED: usize = 200;

/// The most surfaces of a finding that are listed by number.
const NUMBERED: usize = 12;

/// Findings in words, a line each, and how many there are; `unit` is that of the scene's power.
pub fn lines(findings: &[Finding], unit: &str) -> Vec<String> {
    let mut lines: Vec<String> =
        findings.iter().take(LISTED).map(|finding| finding.sentence(unit, NUMBERED)).collect();
    if let Some(more) = findings.len().checked_sub(LISTED).filter(|more| *more > 0) {
        lines.push(format!("and {more} more that cost less"));
    }
    lines.push(match findings.len() {
        0 => "the doctor finds nothing wrong".into(),
        1 => "the doctor finds one thing wrong".into(),
        count => format!("the doctor finds {count} things wrong"),
    });
    lines
}

/// The warnings about a scene whose light is lost, a sentence each; none if the scene is sound.
pub fn warnings(scene: &Scene) -> Vec<String> {
    if scene.faces().len() > MOST_FACES {
        return Vec::new();
    }
    let losses = losses(scene);
    let mut warnings = Vec::new();
    let reflectance = scene.max_reflectance().max();
    if reflectance > ENDLESS {
        warnings.push(format!(
            "a reflectance of {reflectance} sends light on {:.1e} times: where light cannot leave such surfaces a walk hardly \
             ever ends. Give them a lower one: {ENDLESS} is the highest that walks are made for",
            1.0 / (1.0 - reflectance)
        ));
    }
    let stray = stray_lamps(scene);
    if !stray.is_empty() {
        // Where else their light ends is no fault of the surfaces there.
        return [warnings, stray].concat();
    }
    if losses.at_once >= VANISHES {
        warnings.push(format!(
            "{} of the power vanishes at once: it leaves its lamps and meets no side that reflects. By power: {}. Their fronts \
             face away from the room, or they are far from it; turn them round (`radwalk check SCENE --fix-report` says which \
             surfaces are flipped, `--repair` writes a copy without), or write sides = 2, so that both sides are active",
            part(losses.at_once),
            named(scene, &losses.lamps, &losses)
        ));
    }
    if losses.on_backs >= WORTH_A_WORD {
        warnings.push(format!(
            "{} of the power ends on the backs of one-sided surfaces, and is lost (± {}, one standard error at most: {} walks of a \
             pilot). By power: {}. Turn them round \
             (`radwalk check SCENE --fix-report` says which are flipped, `--repair` writes a copy without), or write sides = 2, \
             so that both sides are active",
            part(losses.on_backs),
            part(losses.backs_error()),
            losses.walks,
            named(scene, &losses.backs, &losses)
        ));
    }
    warnings
}

/// The first surfaces, with their parts of all power, in words.
fn named(scene: &Scene, surfaces: &[(u32, f64)], losses: &Losses) -> String {
    let named = surfaces.iter().take(NAMED);
    let named = named
        .map(|&(surface, power)| format!("{} ({})", scene.surface_name(surface), part(power / losses.power)));
    let more = surfaces.len().saturating_sub(NAMED);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    named.collect::<Vec<_>>().join(", ") + &more
}

fn part(part: f64) -> String {
    format!("{:.1} %", 100.0 * part)
}
