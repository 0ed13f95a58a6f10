//! The plan of a job, before it is run: bounds of theory, a pilot, and the cost of the pilot's walks.

mod bound;
mod cut;
mod forecast;
mod pilot;
mod resources;

pub use bound::Bound;
pub use cut::{ChainSplit, cuts, idle_workers};
pub use forecast::{ProcessMeters, RunForecast};
pub use pilot::{PlanPilot, StopCounts, predict_stop};
pub use resources::{Costs, ResourceDemand};
