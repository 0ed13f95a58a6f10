//! The plan of a job, before it is run: bounds of theory, a pilot, and the cost of the pilot's walks.

pub mod bound;
pub mod cut;
pub mod pilot;
pub mod resources;
