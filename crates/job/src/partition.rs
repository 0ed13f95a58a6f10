//! How the surfaces of a scene are cut, where the program chooses that or a file says it: `patches` in the table `[scene]` of a job.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use radiosity::{
    Space,
    surfaces::{Leaves, LeavesError},
};
use serde::{Deserialize, Serialize};

use crate::cut::Cut;
use crate::document::{KeyTable, Value};
use crate::error::{Error, SourceLocation, SourceSpot};
use crate::grouped;
use crate::keys::SCENE_TABLE_KEYS;
use crate::method::BasisKey;
use crate::shape::{read_grid, read_rows};
use crate::source::SourceText;
use crate::vocabulary::AUTO;
use crate::word::Keyword;

/// The word for the cells of the scene file.
const GIVEN: &str = "given";

/// The keys of a partition's file.
const PARTITION_KEYS: &[&str] = &["basis", "space", "surfaces", "groups"];

/// The cut of every surface of a scene, and the basis of the estimates on its patches.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Partition {
    /// The cut of each surface, in their order.
    pub cuts: Vec<Cut>,
    /// The patch of each cell, in the order of surfaces and their cells; patches are numbered in the order of their first cells. Empty
    /// where every cell is a patch.
    pub groups: Vec<u32>,
    /// Whether jobs that name no basis take the linear one, where their method has it.
    pub linear: bool,
    /// Where the walks of jobs that do not say so go on from, where their method has the choice.
    pub space: Space,
    /// What the pilot that chose it predicts; `None` where a file says it.
    pub forecast: Option<Forecast>,
}

/// What a pilot predicts of the job with the patches that it has chosen.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Forecast {
    /// Surfaces whose cells were chosen.
    pub surfaces: u64,
    /// Walks of the pilot.
    pub paths: u64,
    /// Rays of the pilot.
    pub rays: u64,
    /// Whether the errors are those of linear fits, not of means.
    pub linear: bool,
    /// Walks of the job that the errors are predicted for.
    pub for_paths: u64,
    /// The relative error over the area that is due to the number of walks.
    pub noise: f64,
    /// The relative error over the area that is due to the size of the patches.
    pub discretisation: f64,
}

impl Forecast {
    /// Noise and discretisation together.
    pub fn total(&self) -> f64 {
        self.noise.hypot(self.discretisation)
    }

    /// The walks after which both together are a total error; infinite where the discretisation alone is more.
    pub fn paths_to(&self, total_error: f64) -> f64 {
        let noise = (total_error * total_error - self.discretisation * self.discretisation).max(0.0).sqrt();
        self.for_paths as f64 * (self.noise / noise).powi(2)
    }
}

/// What a job leaves to the program.
#[derive(Clone, Debug, PartialEq)]
pub struct Auto {
    /// The numbers of the surfaces whose cut is left open. They stand in the scene with the coarsest that they may have.
    pub surfaces: Vec<usize>,
    /// Of each surface of the scene the kind, a number, if it is left open and its cells may be grouped with those of others of its kind.
    /// Empty where nothing may be grouped.
    pub kinds: Vec<Option<u32>>,
    /// Whether the light on a patch may be estimated by its mean alone.
    pub constant: bool,
    /// Whether the light on a patch may be estimated by a linear function.
    pub linear: bool,
}

/// What a job says of its patches beside the scene file.
pub(crate) enum Patches {
    /// The job does not say.
    Unsaid,
    /// The cells are those of the scene file.
    AsWritten,
    /// The program cuts the surfaces that the scene file says no cells of.
    WhereUnsaid,
    /// The program cuts every surface.
    Auto,
    /// A file says it.
    Given(PathBuf, Box<SourceLocation>),
}

impl Patches {
    /// Whether the cells are those of the scene file.
    pub(crate) fn are_written(&self) -> bool {
        matches!(self, Patches::Unsaid | Patches::AsWritten)
    }

    /// These, where the job itself says them.
    pub(crate) fn unless_unsaid(self) -> Self {
        if matches!(self, Patches::WhereUnsaid) { Patches::Unsaid } else { self }
    }
}

/// Reads the key `scene`: a file, or a table of a file and `patches`.
pub(crate) fn read_scene_key<'a>(
    value: Option<Value<'a>>,
    job: &Path,
) -> Result<(Option<Value<'a>>, Patches), Error> {
    let Some(value) = value else { return Ok((None, Patches::Unsaid)) };
    if !value.is_table() {
        return Ok((Some(value), Patches::Unsaid));
    }
    let mut table = value.table(SCENE_TABLE_KEYS)?;
    let patches = match table.take("patches") {
        None => Patches::Unsaid,
        Some(value) => match value.string()? {
            AUTO => Patches::Auto,
            GIVEN => Patches::AsWritten,
            file => Patches::Given(job.parent().unwrap_or(Path::new("")).join(file), value.place()),
        },
    };
    Ok((table.take("file"), patches))
}

impl Partition {
    /// Reads the file of a partition; `named` is the key of the job that names it.
    pub(crate) fn read(file: &Path, named: &SourceLocation) -> Result<Self, Error> {
        let source =
            SourceText::read(file, "surfaces = [[nu, nv], rows, …]").map_err(|error| match error {
                Error::Missing { file } => Error::Refused {
                    place: Box::new(named.clone()),
                    problem: format!("there is no file {}", file.display()),
                    why: "the patches are read from it",
                    remedy: "correct the path, relative to the job file, or write \"auto\"".into(),
                },
                error => error,
            })?;
        let mut table = KeyTable::root(&source, PARTITION_KEYS)?;
        let linear = table.word::<BasisKey>("basis")? == BasisKey::Linear;
        let space = table.word("space")?;
        let surfaces = table.require(
            "surfaces",
            "a partition says how each surface is cut",
            "surfaces = [[4, 4], 2], for a quad and a triangle",
        )?;
        let read_cut = |value: Value<'_>| match value.is_array() {
            true => read_grid(value).map(Cut::Grid),
            false if value.is_string() => read_leaves(&value).map(Cut::Leaves),
            false => read_rows(&value).map(Cut::Rows),
        };
        let cuts: Vec<Cut> = surfaces.array()?.into_iter().map(read_cut).collect::<Result<_, _>>()?;
        let cells = cuts.iter().fold(0_u64, |sum, cut| sum.saturating_add(cut.cells()));
        let groups = table.take("groups").map(|value| grouped::read(value, cells)).transpose()?;
        Ok(Partition { cuts, groups: groups.unwrap_or_default(), linear, space, forecast: None })
    }

    /// The text of a file that holds it.
    pub fn to_toml(&self) -> String {
        let basis = if self.linear { BasisKey::Linear } else { BasisKey::Constant };
        let mut text = String::from(
            "# How each surface is cut, in the scene's order: [nu, nv] of a quad, the rows of a triangle, or the cuts of a quad:\n\
             # u or v halves a part along that axis, and the first half follows, then the second; a point leaves it whole.\n\
             # A job takes it by patches = \"partition.toml\" in its table [scene].\n\n",
        );
        let _ = writeln!(text, "basis = {:?}\nspace = {:?}\nsurfaces = [", basis.word(), self.space.word());
        let is_tree = |cut: &Cut| matches!(cut, Cut::Leaves(_));
        for line in self.cuts.chunk_by(|a, b| !is_tree(a) && !is_tree(b)).flat_map(|alike| alike.chunks(10)) {
            let cuts: Vec<String> = line
                .iter()
                .map(|cut| match cut {
                    Cut::Grid([nu, nv]) => format!("[{nu}, {nv}]"),
                    Cut::Rows(rows) => rows.to_string(),
                    Cut::Leaves(leaves) => format!("{:?}", leaves.text()),
                })
                .collect();
            let _ = writeln!(text, "  {},", cuts.join(", "));
        }
        text.push_str("]\n");
        if !self.groups.is_empty() {
            text.push_str(&grouped::written(&self.groups));
        }
        text
    }
}

/// The cuts of a quad into rectangles.
fn read_leaves(value: &Value<'_>) -> Result<Leaves, Error> {
    value.string()?.parse().map_err(|error: LeavesError| {
        value.refuse(
            error.to_string(),
            "u or v halves a part, and both halves follow, each cut again or left whole by a point",
            "take the text as a run has written it, such as \"uv...\" for three rectangles",
        )
    })
}

/// Why a scene cannot be cut so, at the key or in the file that says it.
pub(crate) fn misfit(problem: String, spot: SourceSpot, file: &Path, key: &str) -> Error {
    Error::Refused {
        place: Box::new(SourceLocation { file: file.into(), spot, key: key.into() }),
        problem,
        why: "a partition says how each surface of one scene is cut, in their order",
        remedy: "take the partition of this scene, or write patches = \"auto\"".into(),
    }
}
