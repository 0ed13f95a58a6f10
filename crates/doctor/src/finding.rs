//! Findings of the doctor, in words.

use std::collections::{BTreeMap, BTreeSet};

use radiosity::Scene;

/// One fault of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// The kind of the fault.
    pub kind: Kind,
    /// The surfaces concerned, by number.
    pub surfaces: Vec<u32>,
    /// About the power that the fault costs, all channels together [W].
    pub power: f64,
    /// The fault and its place, in words.
    pub message: String,
}

impl Finding {
    /// The finding as a sentence, with at most `most` surfaces by number; `unit` is that of the scene's power.
    pub fn sentence(&self, unit: &str, most: usize) -> String {
        let Finding { kind, surfaces, power, message } = self;
        let mut numbers: Vec<String> = surfaces.iter().take(most).map(u32::to_string).collect();
        if let Some(more) = surfaces.len().checked_sub(most).filter(|more| *more > 0) {
            numbers.push(format!("and {more} more"));
        }
        let surfaces =
            if numbers.is_empty() { String::new() } else { format!(" [surface {}]", numbers.join(", ")) };
        let lost = if *power > 0.0 { format!(" (about {power:.3e} {unit})") } else { String::new() };
        format!("{}: {message}{surfaces}{lost}; {}", kind.word(), kind.remedy())
    }
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
    /// The word for this kind of fault.
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

    /// The remedy for this kind of fault.
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

/// Sorts findings by power, the most first, and joins those of one kind about the same parts of a mesh into one, which
/// begins with the worst of them: a lamp of a thousand facets that all shine at a wall is one fault.
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
