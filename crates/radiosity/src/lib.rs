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

pub use experiment::solution::{Estimate, Estimates, Solution};
pub use experiment::{Board, Experiment, Unfit};
pub use geometry::spec::{SceneSpec, Shape, Side, Sides, Spectrum, SurfaceSpec};
pub use method::{Birth, Chains, Direction, Method, Walks};
pub use random::rng::{Sequence, WalkRng};
pub use scene::{IndexChoice, Scene, SceneError};
pub use tally::{Counts, Layout, Overflow, Tally};
pub use walk::Space;
pub use walk::estimator::{Estimator, EstimatorKind};
pub use walk::plain::walk as plain_walk;

/// Where the walks of a thread score, below [`Board`].
pub mod boards {
    pub use crate::jacobi::ChainBoard;
    pub use crate::tally::{HitScoreboard, MergeError, Scoreboard, WeightScoreboard, Word};
}

/// Walks from cells of sensors that count the patches of a sky.
pub mod daylight {
    pub use crate::experiment::daylight::{Coefficients, DaylightSpec, SkyTally, sky_rows, sky_tallies};
    pub use crate::experiment::segments::Segment;
    pub use crate::geometry::sky::SkyPatches;
}

/// Walks that are counted by the group that takes them.
pub mod exchange {
    pub use crate::experiment::exchange::{
        ExchangeRows, ExchangeSpec, FactorKind, RowBoard, exchange_counts,
    };
    pub use crate::experiment::segments::Segment;
}

/// Groups of sources, each with figures of its own.
pub mod groups {
    pub use crate::experiment::{Groups, Meaning, PatchGroup, SourceScores};
}

/// What looks into walks, chains and traces one by one: the product replays a walk, all else is for measurements.
pub mod instruments {
    pub use crate::experiment::replay::{Replay, ReplayedHit};
    pub use crate::jacobi::{Iteration, IterationPhase, Reciprocity, stochastic_iteration};
    pub use crate::scene::Memory;
    pub use crate::scene::retracing::{Foresight, Retracing};
    pub use crate::trace::tree::{StepKind, TreeStep};
}

/// Lamps without area.
pub mod lamps {
    pub use crate::geometry::lamp::{Emission, LampSpec, LampsSpec};
}

/// Patches whose radiosity is linear, and what is told of their errors.
pub mod linear {
    pub use crate::experiment::slopes::{Accuracy, AnswerError, Fit, ReportedAnswer, Slopes};
    pub use crate::geometry::axes::{Covariance, outer_square, principal_axes};
}

/// What a method is made of, besides its estimator.
pub mod methods {
    pub use crate::experiment::birth_probabilities;
    pub use crate::experiment::solution::{Channels, Mix};
    pub use crate::jacobi::plan::{Iterations, RayBirths, Solve};
    pub use crate::method::{BatchScore, Batches, Score, Unit};
    pub use crate::random::Sampler;
    pub use crate::walk::batch::WalkEnd;
    pub use crate::walk::collision::InfiniteEnd;
    pub use crate::walk::estimator::{AbsorptionMode, Event};
}

/// Loops that several threads share.
pub mod parallel {
    pub use crate::executor::{ParallelFor, in_turn};
    pub use crate::thread_pool::ThreadPool;
}

/// The figures of planes of points.
pub mod planes {
    pub use crate::experiment::planes::{Figure, PlaneFigure, PlaneFigures, Sufficiency};
}

/// How precise a picture, its figures and its headline are.
pub mod precision {
    pub use crate::experiment::Lost;
    pub use crate::experiment::glare::{Glare, Unexamined};
    pub use crate::experiment::precision::{
        FLOOR, FaceShare, Headline, Judged, Place, Precision, QUANTILES, Quantity, Reach, TINY,
    };
}

/// Single rays, and what they meet.
pub mod rays {
    pub use crate::experiment::arrivals::Arrival;
    pub use crate::scene::sealed::Sealed;
    pub use crate::scene::view::Lookout;
    pub use crate::trace::ray::{Hit, Ray};
}

/// What the light would be with other materials and lamps.
pub mod sensitivity {
    pub use crate::experiment::SensitivityMaterial;
    pub use crate::experiment::influence::{Derivative, Influences, Property};
}

/// Surfaces that measure light and stop none.
pub mod sensors {
    pub use crate::experiment::SensorView;
    pub use crate::experiment::readings::{Reading, Readings};
    pub use crate::geometry::sensor::{SensorCell, SensorError, SensorShape, SensorSpec, Sensors};
}

/// Surfaces and their faces as a scene has built them.
pub mod surfaces {
    pub use crate::geometry::face::{Face, FaceIter, Faces};
    pub use crate::geometry::leaves::{CutCell, Leaves, LeavesError};
    pub use crate::geometry::pane::{CLEAREST, PaneSpec};
    pub use crate::geometry::planes::Body;
    pub use crate::geometry::spec::{Corners, SKY};
    pub use crate::geometry::surface::Surface;
    pub use crate::trace::coplanar::Overlap;
    pub use crate::trace::stack::Stack;
}
