//! Monte Carlo radiosity: scenes, rays, walks, estimators and exact tallies.
//!
//! No I/O, clock, threads or sockets live here: everything is a function of its arguments, and the tally of
//! walks 0 … N − 1 a function of scene, method, seed and N alone.
//!
//! Papers are cited by key: S97 = Sbert, *Error and Complexity of Random Walk Monte Carlo Radiosity* (1997);
//! BS = Bekaert & Seidel, *A Theoretical Comparison of Monte Carlo Radiosity Algorithms*.
//!
//! The walk itself is [`plain_walk`]: start reading there. A furnace in which B = 1 W/m² everywhere, solved:
//!
//! ```
//! use radiosity::{Estimator::Collision, Experiment, IndexChoice, Method, Scene, SceneSpec};
//!
//! let scene = Scene::build(&SceneSpec::furnace(3, 0.5), IndexChoice::Auto)?;
//! let experiment = Experiment::new(scene, Method::shooting(Collision))?;
//! let solution = experiment.run(1, 100_000)?;
//! for (patch, b) in solution.estimates.iter().flatten().enumerate() {
//!     println!("patch {patch}: {:.3} W/m², 95 % in {:.3} … {:.3}", b.radiosity, b.ci_low, b.ci_high);
//!     assert!((b.radiosity - 1.0).abs() < 6.0 * b.std_error.unwrap());
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! From the ground up: `simd/` many numbers side by side, `random/` numbers, `geometry/` surfaces and faces, `trace/`
//! the nearest surface along a ray, `scene/` all that walks run in, `tally/` exact sums, `walk/` walks and what they
//! score, `jacobi/` chains, `method.rs` and `experiment/` a method at work in a scene. No arrow leads back up.

#![warn(unreachable_pub, unnameable_types)]

mod executor;
mod experiment;
mod geometry;
mod jacobi;
mod method;
mod random;
mod scene;
#[allow(unsafe_code, reason = "intrinsics, each with its proof")]
mod simd;
mod tally;
mod thread_pool;
mod trace;
mod walk;

pub use executor::{ParallelFor, in_turn};
pub use experiment::arrivals::Arrival;
pub use experiment::glare::{Glare, Unexamined};
pub use experiment::precision::{
    FLOOR, FaceShare, Headline, Judged, Place, Precision, QUANTILES, Quantity, Reach, TINY,
};
pub use experiment::readings::{Reading, Readings};
pub use experiment::slopes::{Accuracy, AnswerError, Fit, ReportedAnswer, Slopes};
pub use experiment::solution::{Channels, Estimate, Estimates, Mix, Solution};
pub use experiment::{
    Board, Experiment, Groups, Lost, Meaning, PatchGroup, SensorView, SourceScores, Unfit,
    birth_probabilities,
};
pub use geometry::axes::{Covariance, outer_square, principal_axes};
pub use geometry::face::{Face, FaceIter, Faces};
pub use geometry::lamp::{Emission, LampSpec, LampsSpec};
pub use geometry::leaves::{CutCell, Leaves, LeavesError};
pub use geometry::pane::{CLEAREST, PaneSpec};
pub use geometry::planes::Body;
pub use geometry::sensor::{SensorCell, SensorError, SensorShape, SensorSpec, Sensors};
pub use geometry::sky::SkyPatches;
pub use geometry::spec::{Corners, SKY, SceneSpec, Shape, Side, Sides, Spectrum, SurfaceSpec};
pub use geometry::surface::Surface;
pub use jacobi::plan::{Iterations, RayBirths, Solve};
pub use method::{BatchScore, Batches, Birth, Chains, Direction, Method, Score, Unit, Walks};
pub use random::Sampler;
pub use random::rng::{Sequence, WalkRng};
pub use scene::sealed::Sealed;
pub use scene::view::Lookout;
pub use scene::{IndexChoice, Memory, Scene, SceneError};
pub use tally::{Counts, Layout, Overflow, Tally};
pub use thread_pool::ThreadPool;
pub use trace::coplanar::Overlap;
pub use trace::ray::{Hit, Ray};
pub use trace::stack::Stack;
pub use walk::Space;
pub use walk::batch::WalkEnd;
pub use walk::collision::InfiniteEnd;
pub use walk::estimator::{AbsorptionMode, Estimator, EstimatorKind, Event};
pub use walk::plain::walk as plain_walk;

/// Where the walks of a thread score, below [`Board`].
pub mod boards {
    pub use crate::jacobi::ChainBoard;
    pub use crate::tally::{Events, MergeError, Scoreboard, Word};
}

/// Walks from cells of sensors that count the patches of a sky.
pub mod daylight {
    pub use crate::experiment::daylight::{Coefficients, DaylightSpec, SkyTally, sky_rows, sky_tallies};
    pub use crate::experiment::segments::Segment;
}

/// Walks that are counted by the group that takes them.
pub mod exchange {
    pub use crate::experiment::exchange::{
        ExchangeRows, ExchangeSpec, FactorKind, RowBoard, exchange_counts,
    };
    pub use crate::experiment::segments::Segment;
}

/// What looks into walks, chains and traces one by one: the product replays a walk, all else is for measurements.
pub mod instruments {
    pub use crate::experiment::replay::{Replay, ReplayedHit};
    pub use crate::jacobi::{Iteration, IterationPhase, Reciprocity, stochastic_iteration};
    pub use crate::scene::retracing::{Foresight, Retracing};
    pub use crate::trace::tree::{StepKind, TreeStep};
}

/// The figures of planes of points.
pub mod planes {
    pub use crate::experiment::planes::{Figure, PlaneFigure, PlaneFigures, Sufficiency};
}

/// What the light would be with other materials and lamps.
pub mod sensitivity {
    pub use crate::experiment::SensitivityMaterial;
    pub use crate::experiment::influence::{Derivative, Influences, Property};
}
