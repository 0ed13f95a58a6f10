//! What answers need of a question: it is kept beside the counts, so that a merge needs no job.

use job::Enclosure;
use radiosity::exchange::FactorKind;
use report::GroupRow;
use serde::{Deserialize, Serialize};

/// Groups, and what is to be reported of them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Subject {
    /// Digest of the surfaces.
    pub(super) scene_hash: [u8; 32],
    pub(super) kind: FactorKind,
    pub(super) groups: Vec<GroupOfFaces>,
    /// The level that the job asks for.
    pub(super) confidence: f64,
    /// Whether the intervals hold all together.
    pub(super) simultaneous: bool,
    /// The level of each interval.
    pub(super) level: f64,
    pub(super) smooth: bool,
    pub(super) enclosure: Option<Enclosure>,
}

/// A group by the sums over its faces.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct GroupOfFaces {
    pub(super) name: String,
    /// How many faces it has.
    pub(super) faces: usize,
    /// The area of the faces [m²].
    pub(super) area: f64,
    /// Their area, each times its absorptance [m²].
    pub(super) absorbing: f64,
}

impl Subject {
    /// What each group is worth at births [m²].
    pub(super) fn weights(&self) -> Vec<f64> {
        let weight = |group: &GroupOfFaces| match self.kind {
            FactorKind::FirstHit => group.area,
            FactorKind::Absorbed => group.absorbing,
        };
        self.groups.iter().map(weight).collect()
    }

    /// The names of the groups.
    pub(super) fn names(&self) -> Vec<String> {
        self.groups.iter().map(|group| group.name.clone()).collect()
    }

    /// The groups as a table shows them, of which `walks` tells how many walks each had.
    pub(super) fn rows(&self, walks: impl Fn(usize) -> u64) -> Vec<GroupRow<'_>> {
        let groups = self.groups.iter().enumerate();
        groups
            .map(|(i, group)| GroupRow {
                group: &group.name,
                faces: group.faces,
                area: group.area,
                absorptance: group.absorbing / group.area,
                walks: walks(i),
            })
            .collect()
    }
}
