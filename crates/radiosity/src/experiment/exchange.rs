//! Exchange factors: walks are counted by the group of faces that they are born in and the group that takes them.
//!
//! F_ij is the part of what leaves group i uniformly that meets group j first. Gebhart's factor B_ij is the part of what group i
//! emits that group j absorbs, by whatever reflections (B. Gebhart, Int. J. Heat Mass Transfer 3 (1961) 341–346). Of N_i
//! walks that are born in group i, n_ij are taken by group j, and n_ij/N_i expects the factor. Every walk is taken by a group,
//! by a back, or escapes: so the counts of a row add up to N_i.
//!
//! In the tally of such an experiment group i of G has G + 2 rows: what groups 0 … G − 1 take, what backs take, what escapes.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::segments::{Segment, SegmentPart, Segments, WALKS_OF_A_GROUP};
use super::unfit::Unfit;
use crate::geometry::face::Face;
use crate::geometry::sky::SkyPatches;
use crate::random::rng::Sequence;
use crate::scene::Scene;
use crate::scene::births::Births;
use crate::tally::{HitScoreboard, Tally};
use crate::walk::Space;
use crate::walk::batch::walk_all;
use crate::walk::collision::Analog;
use crate::walk::exchanged::{Exchanged, ExchangedRow, RowCounts};

/// Which exchange factors are counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum FactorKind {
    /// F_ij: walks end where they arrive first. They are born in a group uniformly.
    FirstHit,
    /// B_ij, Gebhart's factors: walks end where they are absorbed. They are born in a group as heat is emitted, in proportion to
    /// area times absorptance 1 − R.
    Absorbed,
}

impl FactorKind {
    /// What a face is worth at births: its area, for B_ij times its absorptance [m²].
    pub fn weight(self, face: &Face) -> f64 {
        match self {
            FactorKind::FirstHit => face.area,
            FactorKind::Absorbed => face.area * (1.0 - face.reflectance[0]),
        }
    }
}

/// Which exchange factors are counted, between which groups, by which walks.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ExchangeSpec {
    /// The kind of factor that is counted.
    pub kind: FactorKind,
    /// The group of each face.
    pub group_of_face: Vec<u32>,
    /// How many groups there are.
    pub groups: u32,
    /// The walks: number n of the experiment is number n of these segments, one after the other.
    pub segments: Vec<Segment>,
}

impl ExchangeSpec {
    /// Walks of all segments.
    pub fn walks(&self) -> u64 {
        self.segments.iter().map(|segment| segment.walks).sum()
    }
}

/// Groups whose walks have places of their own in the sequence, below those of other rays.
const MOST_GROUPS: u32 = 1 << 22;

/// The births of each group, in proportion to what faces are worth.
///
/// # Errors
/// A scene in colour, and groups that leave faces out, are empty, or are more than the sequence has places for.
fn births_of_groups(
    scene: &Scene,
    kind: FactorKind,
    (group_of_face, groups): (&[u32], u32),
) -> Result<Vec<Births>, Unfit> {
    if scene.channels() > 1 {
        return Err(Unfit::ExchangeInColour);
    }
    let fits = groups <= MOST_GROUPS
        && group_of_face.len() == scene.faces().len()
        && group_of_face.iter().all(|&group| group < groups);
    if !fits {
        return Err(Unfit::NoSuchGroups);
    }
    let weights: Vec<f64> = scene.faces().iter().map(|face| kind.weight(&face)).collect();
    let share = |face: usize| weights[face];
    let births = Births::of_groups(scene.surfaces(), scene.faces(), (group_of_face, groups), share);
    births.into_iter().collect::<Option<Vec<_>>>().ok_or(Unfit::NoSuchGroups)
}

/// What exchange needs beyond the scene.
#[derive(Clone, Debug)]
pub(super) struct Exchange {
    kind: FactorKind,
    group_of_face: Vec<u32>,
    groups: u32,
    births: Vec<Births>,
    segments: Segments,
}

impl Exchange {
    pub(super) fn new(scene: &Scene, spec: ExchangeSpec) -> Result<Self, Unfit> {
        let ExchangeSpec { kind, group_of_face, groups, segments } = spec;
        let births = births_of_groups(scene, kind, (&group_of_face, groups))?;
        let segments = Segments::new(segments, groups).ok_or(Unfit::NoSuchGroups)?;
        Ok(Exchange { kind, group_of_face, groups, births, segments })
    }

    /// Rows of each group in a tally.
    fn columns(&self) -> u32 {
        self.groups + 2
    }

    pub(super) fn rows(&self) -> usize {
        self.groups as usize * self.columns() as usize
    }

    /// Some walks of a sequence onto a board with these rows.
    pub(super) fn walk(
        &self,
        scene: &Scene,
        space: Space,
        (sequence, walks): (&Sequence, Range<u64>),
        board: &mut HitScoreboard<1>,
    ) {
        for SegmentPart { group, walks, .. } in self.segments.parts(walks) {
            let first_row = group * self.columns();
            let births = &self.births[group as usize];
            let mut score = Exchanged::new(board, &self.group_of_face, first_row);
            let model = Analog { ends_at_once: self.kind == FactorKind::FirstHit };
            let of_group = u64::from(group) * WALKS_OF_A_GROUP;
            let walks = of_group + walks.start..of_group + walks.end;
            let counts = walk_all(scene, births, space, sequence, walks, model, &mut score);
            let backs = first_row + self.groups;
            board.add_walks_of_one(backs, counts.absorbed_back);
            board.add_walks_of_one(backs + 1, counts.escaped);
            board.counts.add(&counts).expect("64 bits outlast any process");
        }
    }
}

/// n_ij of a tally of exchange factors between `groups` groups: for each group, what each of them took, what backs took, and what
/// escaped.
///
/// # Panics
/// Where the tally has other rows.
pub fn exchange_counts(tally: &Tally, groups: u32) -> Vec<Vec<u64>> {
    let (groups, columns) = (groups as usize, groups as usize + 2);
    assert_eq!(tally.patches(), groups * columns, "the rows are those of exchange factors");
    let count = |row| u64::try_from(tally.patch(row, 0)[0]).expect("there are fewer walks than 2⁶⁴");
    (0..groups).map(|group| (group * columns..(group + 1) * columns).map(count).collect()).collect()
}

/// Exchange factors row by row, of any number of groups: what is kept of a row is the columns that its walks have met.
///
/// Columns are the G groups, backs (G), what escapes (G + 1), and where the sky is divided its patches (G + 2, …): then only what
/// leaves below the horizon escapes. Walk n of a group is the same walk as in [`Experiment::with_exchange`](super::Experiment::with_exchange).
#[derive(Clone, Debug)]
pub struct ExchangeRows {
    scene: Scene,
    kind: FactorKind,
    space: Space,
    group_of_face: Vec<u32>,
    groups: u32,
    births: Vec<Births>,
    sky: Option<SkyPatches>,
}

/// The row that a thread counts, for [`ExchangeRows::walk`].
#[derive(Clone, Debug)]
pub struct RowBoard {
    row: RowCounts,
    rays: u64,
}

impl ExchangeRows {
    /// Rows of a scene whose walks go on in `space`, between groups of faces.
    ///
    /// # Errors
    /// A scene in colour, or groups that cannot be.
    pub fn new(
        scene: Scene,
        (kind, space): (FactorKind, Space),
        (group_of_face, groups): (Vec<u32>, u32),
        sky: Option<SkyPatches>,
    ) -> Result<Self, Unfit> {
        let births = births_of_groups(&scene, kind, (&group_of_face, groups))?;
        Ok(ExchangeRows { scene, kind, space, group_of_face, groups, births, sky })
    }

    /// How many groups there are, each of which has a row.
    pub fn groups(&self) -> usize {
        self.groups as usize
    }

    /// How many columns a row has.
    pub fn columns(&self) -> usize {
        self.groups() + 2 + self.sky.as_ref().map_or(0, SkyPatches::count)
    }

    /// An empty row, for one thread to count.
    pub fn board(&self) -> RowBoard {
        RowBoard { row: RowCounts::new(self.columns()), rays: 0 }
    }

    /// Walks some walks of a group and adds them to a row.
    ///
    /// # Panics
    /// Where there is no such group, or more walks than the group or 32 bits have.
    pub fn walk(&self, sequence: &Sequence, group: u32, walks: Range<u64>, board: &mut RowBoard) {
        assert!(walks.end <= WALKS_OF_A_GROUP.min(u32::MAX.into()), "a row counts in 32 bits");
        let births = &self.births[group as usize];
        let of_group = u64::from(group) * WALKS_OF_A_GROUP;
        let sky = self.sky.as_ref().map(|sky| (sky, self.groups + 2));
        let model = Analog { ends_at_once: self.kind == FactorKind::FirstHit };
        let mut score =
            ExchangedRow { row: &mut board.row, group_of_face: &self.group_of_face, sky, to_sky: 0 };
        let walks = of_group + walks.start..of_group + walks.end;
        let counts = walk_all(&self.scene, births, self.space, sequence, walks, model, &mut score);
        let to_sky = score.to_sky;
        board.row.add(self.groups, counts.absorbed_back as u32);
        board.row.add(self.groups + 1, counts.escaped as u32 - to_sky);
        board.rays += counts.rays;
    }
}

impl RowBoard {
    /// Hands over the columns that have walks, in ascending order, each with its count, and the number of rays of these walks.
    pub fn take(&mut self) -> (Vec<(u32, u32)>, u64) {
        (self.row.take(), std::mem::take(&mut self.rays))
    }
}
