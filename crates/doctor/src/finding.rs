//! What is wrong, in words.

use std::collections::{BTreeMap, BTreeSet};

use radiosity::Scene;

use crate::contact::Contacts;
use crate::cover::Covers;
use crate::pilot::Pilot;
use crate::votes::Votes;

/// One thing that is wrong with a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// What it is.
    pub kind: Kind,
    /// The surfaces concerned, by number.
    pub surfaces: Vec<u32>,
    /// About the power that it costs, all channels together [W].
    pub power: f64,
    /// What is wrong and where.
    pub message: String,
}

/// The kinds of findings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// The back of a one-sided surface is where its front should be.
    Flipped,
    /// Light leaves the scene through an opening.
    Open,
    /// Light leaves the scene through a gap between surfaces that were meant to touch.
    Leak,
    /// Light leaves the scene through a crack: a T-junction, or vertices that were not merged.
    Crack,
    /// Two surfaces lie in one plane and share area.
    Overlapping,
    /// A surface sees nothing but backs, or nothing beyond a hair's breadth: no light comes there.
    Buried,
    /// An emitter shines at something close by, or out of the scene.
    Emitter,
    /// Light is absorbed by the back of a one-sided surface.
    Back,
}

impl Kind {
    /// The word for it.
    pub fn word(self) -> &'static str {
        match self {
            Kind::Flipped => "flipped",
            Kind::Open => "open",
            Kind::Leak => "leak",
            Kind::Crack => "crack",
            Kind::Overlapping => "overlapping",
            Kind::Buried => "buried",
            Kind::Emitter => "emitter",
            Kind::Back => "back",
        }
    }

    /// What to do about it.
    pub fn remedy(self) -> &'static str {
        match self {
            Kind::Flipped => "turn it round (--repair does), or give it two sides",
            Kind::Open => "close the opening if the room was meant to be closed",
            Kind::Leak => "move the edges together",
            Kind::Crack => "merge the vertices, or split the longer edge at the vertex on it",
            Kind::Overlapping => {
                "remove one of them (--repair does where they are the same), or move them apart"
            }
            Kind::Buried => "remove it, or move it out",
            Kind::Emitter => "move it away, or turn it round",
            Kind::Back => "give the surface two sides, or close the body that it is part of",
        }
    }
}

/// A part of the scene's power below which losses are not told one by one.
const TOLD: f64 = 1e-4;

/// An emitter's side is dark where this part of its light is lost or shaded.
const DARK: f64 = 0.9;

pub(crate) fn flipped(scene: &Scene, pilot: &Pilot, flipped: &[u32]) -> Vec<Finding> {
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

/// Emitters whose light goes nowhere.
pub(crate) fn dark_emitters(scene: &Scene, pilot: &Pilot, flipped: &[u32]) -> Vec<Finding> {
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

/// Surfaces that no light comes to.
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

/// Backs that light is lost at, those of flipped surfaces aside.
pub(crate) fn backs(scene: &Scene, pilot: &Pilot, flipped: &[u32]) -> Vec<Finding> {
    let lost = (0..scene.surfaces().len() as u32)
        .map(|surface| (surface, pilot.back(surface)))
        .filter(|(surface, power)| *power > TOLD * pilot.power && !flipped.contains(surface));
    let finding = |(surface, power): (u32, f64)| Finding {
        kind: Kind::Back,
        surfaces: vec![surface],
        power,
        message: format!("light ends on the back of {}, which has one side", scene.surface_name(surface)),
    };
    lost.map(finding).collect()
}

/// The findings, most power first. Those of one kind about the same parts of a mesh become one, which begins with the
/// worst of them: a lamp of a thousand facets that all shine at a wall is one fault.
pub(crate) fn gather(scene: &Scene, mut findings: Vec<Finding>) -> Vec<Finding> {
    // Ties keep the order of surfaces.
    findings.sort_by(|a, b| b.power.total_cmp(&a.power));
    let mut first_of: BTreeMap<(Kind, Vec<&str>), usize> = BTreeMap::new();
    let mut gathered: Vec<(Finding, usize)> = Vec::new();
    for finding in findings {
        let parts: BTreeSet<&str> =
            finding.surfaces.iter().map(|&surface| part(scene.surface_name(surface))).collect();
        let key = (finding.kind, parts.into_iter().collect());
        match first_of.get(&key) {
            Some(&first) => {
                let (of_all, more) = &mut gathered[first];
                of_all.power += finding.power;
                of_all.surfaces.extend(finding.surfaces);
                *more += 1;
            }
            None => {
                first_of.insert(key, gathered.len());
                gathered.push((finding, 0));
            }
        }
    }
    for ((_, parts), first) in first_of {
        let (finding, more) = &mut gathered[first];
        if *more > 0 {
            finding.message += &format!(", and {more} more of {} like it", parts.join(" and "));
            let mut seen = BTreeSet::new();
            finding.surfaces.retain(|surface| seen.insert(*surface));
        }
    }
    let mut findings: Vec<Finding> = gathered.into_iter().map(|(finding, _)| finding).collect();
    findings.sort_by(|a, b| b.power.total_cmp(&a.power));
    findings
}

/// The part of a mesh that a surface belongs to, by its name: `Chair` of `Chair:17`. Other surfaces are parts of their own.
fn part(name: &str) -> &str {
    let is_face = |(_, face): &(&str, &str)| face.bytes().all(|digit| digit.is_ascii_digit());
    name.rsplit_once(':').filter(is_face).map_or(name, |(part, _)| part)
}

/// The opening that light leaves through, told by the edges around it.
pub(crate) fn opening(scene: &Scene, pilot: &Pilot, contacts: &Contacts) -> Option<Finding> {
    const NAMED: usize = 6;
    let mut surfaces = contacts.rims(scene, &pilot.ways_out);
    surfaces.truncate(NAMED);
    let names: Vec<&str> = surfaces.iter().map(|&surface| scene.surface_name(surface)).collect();
    let past = match names.is_empty() {
        true => String::new(),
        false => format!(", most of it past the edges of {}", names.join(", ")),
    };
    let message = format!("{:.3} % of the light leaves the scene{past}", 100.0 * pilot.escaped_part());
    Some(Finding { kind: Kind::Open, surfaces, power: pilot.escaped(), message })
}
