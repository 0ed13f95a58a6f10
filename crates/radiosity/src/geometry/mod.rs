//! Surfaces: as a scene is written, and as walks see them. Faces are the unknowns of the radiosity system.

pub(crate) mod axes;
pub(crate) mod basis;
pub(crate) mod cells;
pub(crate) mod face;
pub(crate) mod frame;
pub(crate) mod lamp;
pub(crate) mod landing;
pub(crate) mod leaf_table;
pub(crate) mod leaves;
pub(crate) mod pane;
pub(crate) mod partition;
pub(crate) mod piece;
pub(crate) mod places;
pub(crate) mod planes;
pub(crate) mod sensor;
pub(crate) mod sky;
pub(crate) mod spec;
pub(crate) mod surface;
pub(crate) mod tints;
