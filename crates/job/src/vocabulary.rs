//! The words that the keys of jobs may hold, and the limits of their numbers.

use serde::{Deserialize, Serialize};

use crate::word::Keyword;

/// The word by which a job or a surface leaves its cells to the program.
pub(crate) const AUTO: &str = "auto";

/// The largest lease: lost with its worker, it would be traced again whole.
pub(crate) const MAX_STREAM_PATHS: u64 = 1 << 24;

/// The pixels of a picture's side at most.
pub(crate) const MAX_PIXELS: u64 = 4096;

/// The fields of view that a picture may have [degrees].
pub(crate) const FOV: [f64; 2] = [1.0, 170.0];

/// What the numbers of a job measure. It changes labels and units, and no number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Light {
    /// Power in W, radiosity and irradiance in W/m².
    #[default]
    Radiant,
    /// Luminous flux in lm, luminous exitance in lm/m², illuminance in lx.
    Luminous,
}

impl Keyword for Light {
    const ALL: &'static [Self] = &[Self::Radiant, Self::Luminous];

    fn word(self) -> &'static str {
        match self {
            Light::Radiant => "radiant",
            Light::Luminous => "luminous",
        }
    }
}

/// A file of a result that follows from its tally.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum OutputFile {
    /// The table of all patches.
    Csv,
    /// Counts, errors, checks, provenance.
    Summary,
    /// The scene as an eye sees it.
    Picture,
    /// The page that shows the result.
    Report,
    /// The radiance behind every pixel of the picture.
    Exr,
    /// The patches for ParaView and VTK.
    Vtu,
    /// The scene for viewers and modellers.
    Glb,
    /// The table for data frames.
    Parquet,
}

impl OutputFile {
    /// The name of the file.
    pub fn name(self) -> &'static str {
        match self {
            OutputFile::Csv => "patches.csv",
            OutputFile::Summary => "summary.json",
            OutputFile::Picture => "radiosity.png",
            OutputFile::Report => "report.html",
            OutputFile::Exr => "radiosity.exr",
            OutputFile::Vtu => "patches.vtu",
            OutputFile::Glb => "scene.glb",
            OutputFile::Parquet => "patches.parquet",
        }
    }

    /// What it is, or which programs read it.
    pub fn purpose(self) -> &'static str {
        match self {
            OutputFile::Csv => "all patches",
            OutputFile::Summary => "errors, checks, provenance",
            OutputFile::Picture => "the scene as an eye sees it",
            OutputFile::Report => "a page to look at",
            OutputFile::Exr => "the radiance behind the pixels",
            OutputFile::Vtu => "ParaView and VTK",
            OutputFile::Glb => "viewers and modellers",
            OutputFile::Parquet => "data frames",
        }
    }
}

impl Keyword for OutputFile {
    const ALL: &'static [Self] = &[
        Self::Csv,
        Self::Summary,
        Self::Picture,
        Self::Report,
        Self::Exr,
        Self::Vtu,
        Self::Glb,
        Self::Parquet,
    ];

    fn word(self) -> &'static str {
        match self {
            OutputFile::Csv => "csv",
            OutputFile::Summary => "summary",
            OutputFile::Picture => "picture",
            OutputFile::Report => "report",
            OutputFile::Exr => "exr",
            OutputFile::Vtu => "vtu",
            OutputFile::Glb => "glb",
            OutputFile::Parquet => "parquet",
        }
    }
}

/// The side of the camera, inside or outside, where the job leaves its place to the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Vantage {
    /// From where a person could stand.
    Inside,
    /// From outside of the whole scene, through the backs of one-sided walls.
    Outside,
}

impl Keyword for Vantage {
    const ALL: &'static [Self] = &[Vantage::Inside, Vantage::Outside];

    fn word(self) -> &'static str {
        match self {
            Vantage::Inside => "inside",
            Vantage::Outside => "outside",
        }
    }
}

/// What a target makes of patches that no walk has hit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Unhit {
    /// The error of patches without a hit is infinite.
    #[default]
    Infinite,
    /// Patches without a hit are left out.
    Ignore,
}

impl Keyword for Unhit {
    const ALL: &'static [Self] = &[Self::Infinite, Self::Ignore];

    fn word(self) -> &'static str {
        match self {
            Unhit::Infinite => "infinite",
            Unhit::Ignore => "ignore",
        }
    }
}

/// The word of a [`radiosity::methods::InfiniteEnd`], before its number is known.
#[derive(Clone, Copy)]
pub(crate) enum EndWord {
    Roulette,
    Cutoff,
    Length,
}

impl Keyword for EndWord {
    const ALL: &'static [Self] = &[Self::Roulette, Self::Cutoff, Self::Length];

    fn word(self) -> &'static str {
        match self {
            EndWord::Roulette => "roulette",
            EndWord::Cutoff => "cutoff",
            EndWord::Length => "length",
        }
    }
}

/// The word of a [`radiosity::methods::Solve`].
#[derive(Clone, Copy)]
pub(crate) enum SolveWord {
    Links,
    Iterations,
}

impl Keyword for SolveWord {
    const ALL: &'static [Self] = &[Self::Links, Self::Iterations];

    fn word(self) -> &'static str {
        match self {
            SolveWord::Links => "links",
            SolveWord::Iterations => "iterations",
        }
    }
}
