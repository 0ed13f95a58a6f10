//! What a job will take, before it is run: bounds of theory, a pilot, and what the pilot's walks cost.

pub mod bound;
pub mod pilot;
pub mod resources;
