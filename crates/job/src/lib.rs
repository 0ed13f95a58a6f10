//! Files → a validated [`Job`]: what to solve, how, and how long.
//!
//! [`load`] reads a job file and the scene it names, or a scene with the defaults of jobs; [`load_mesh`] makes a job of a mesh in memory;
//! [`load_scene`] reads a scene alone. Whatever a file says wrongly
//! is one [`Error`], whose message names file, line and key, the problem, its reason and the remedy. Only the
//! numbers that [`radiosity::Scene::build`] judges are left to [`SceneFile::build`], which finds their line.

#![warn(unreachable_pub, unnameable_types)]

mod budget;
mod bytes;
mod cut;
mod document;
mod emit;
mod error;
mod finishes;
mod goals;
mod grouped;
mod groups;
mod imports;
mod job;
mod key;
mod keys;
mod kind;
mod lamp;
mod lamps;
mod lighting;
mod material;
mod method;
mod near;
mod output;
mod panes;
mod partition;
mod plain;
mod planes;
mod repaired;
mod scene;
mod scene_text;
mod schema;
mod sensors;
mod shape;
mod site;
mod sky;
mod source;
mod sources;
mod target;
mod thermal;
mod vocabulary;
mod weather;
mod word;

pub use budget::{Budget, DEFAULT_CHECKPOINT_SECONDS, DEFAULT_STREAM_PATHS};
pub use cut::Cut;
pub use document::whole_number;
pub use error::{Error, SourceLocation, SourceSpot};
pub use finishes::Finishes;
pub use groups::{FaceGroups, Grouping};
pub use import::{Options as ImportOptions, setting};
pub use job::{
    DEFAULT_CONFIDENCE, DEFAULT_PATHS, DEFAULT_SEED, DEFAULT_TOTAL_ERROR, Job, load, load_as_written,
    load_mesh, load_surfaces,
};
pub use kind::{FileKind, file_kind};
pub use lamp::load_lamp;
pub use method::{Beside, MethodTable, WalkKind, fewest_chain_rays, job_hash};
pub use output::{NamedView, Stand, View};
pub use partition::{Auto, Forecast, Partition};
pub use planes::PlaneTarget;
pub use radiosity::methods::Sampler;
pub use repaired::repaired_text;
pub use scene::{MaterialRow, SceneFile, load_scene, load_scene_with};
pub use scene_text::to_toml;
pub use schema::{job_schema, scene_schema};
pub use sensors::SensorTarget;
pub use target::{Target, TotalTarget};
pub use thermal::{Enclosure, GroupNames, load_enclosure};
pub use vocabulary::{Light, OutputFile, Unhit, Vantage};
pub use weather::load_weather;
pub use word::Keyword;
