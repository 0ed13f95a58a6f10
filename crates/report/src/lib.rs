//! The output folder: tables, summary and picture of a run, each written whole or not at all; and charts.
//!
//! Nothing is printed here; errors name the file they are about.

#![warn(unreachable_pub, unnameable_types)]

mod accuracy;
mod atomic;
mod bounds;
mod camera;
mod chart;
mod daylight;
mod daylight_svg;
mod dials;
mod error;
mod exact_csv;
mod export;
mod factors;
mod floor;
mod flow;
mod isolux;
mod mark;
mod markdown;
mod method;
mod model;
mod numbers;
mod outlines;
mod pack;
mod page;
mod partition;
mod patches;
mod picture;
mod planes;
mod precision;
mod replay;
#[cfg(test)]
mod scenes;
mod sensitivities;
mod sensors;
mod smooth;
mod sources;
mod summary;
mod terminal;
mod values;
pub mod words;

pub use accuracy::{AccuracySummary, TotalSummary};
pub use atomic::{Draft, OutputFolder, replace_atomically, write_atomically, write_soon};
pub use camera::{Viewpoint, view_troubles};
pub use chart::{Axis, Chart, ChartPoint, Series, Style};
pub use daylight::{DaylightArrays, DaylightRow, DaylightSummary, LevelSummary, write_daylight, write_ill};
pub use error::Error;
pub use exact_csv::{ExactBounds, ExactColumns, ExactSummary, write_exact};
pub use export::{
    Column, ColumnCells, CsrKind, CsrNumbers, FactorEntry, FoamList, MatrixRow, MatrixRows, columns, corners,
    read_table, write_csr, write_energyplus, write_factors_parquet, write_glb, write_mtx, write_openfoam,
    write_openfoam_map, write_parquet, write_udales, write_udales_netcdf, write_udales_sky, write_view3d,
    write_vtu,
};
pub use factors::{
    BACK, DroppedSummary, ESCAPE, FactorsSummary, GroupRow, REST, SmoothingSummary, SparseSummary,
    ToleranceSummary, is_outside, write_exact_factors, write_factors, write_factors_mtx, write_factors_npz,
    write_groups, write_json, write_thermal,
};
pub use isolux::{isolux_picture, isolux_svg};
pub use markdown::Markdown;
pub use method::MethodWords;
pub use model::{Bounce, Model};
pub use page::{Live, Milestone, Page};
pub use partition::{ChoiceSummary, PartitionSummary};
pub use patches::{Digits, face_words, flags, side_name, write_patches};
pub use picture::{NamedShot, Photo, Picture, Shot};
pub use planes::{
    DemandSummary, DimPoints, FigureInterval, GlareSummary, ModellingSummary, PerChannel, PlaneSource,
    PlaneSummary, plane_summaries, write_planes,
};
pub use precision::{DiscretisedSummary, HeadlineSummary, PatchShare, PrecisionSummary};
pub use replay::walk_lines;
pub use sensitivities::{SensitivitySummary, sensitivity_summaries, write_sensitivities};
pub use sensors::{SensorSummary, SensorsSummary, write_sensors};
pub use smooth::Smooth;
pub use sources::{SourceSummary, source_summaries, write_sources};
pub use summary::{
    Check, Energy, PartSummary, Provenance, RunFacts, SessionSummary, Summary, TargetReport, Units, Verdict,
    WorkerSummary, WorstPatch, target_scope,
};
pub use terminal::{in_terminal, shows_pictures};
pub use values::Values;
