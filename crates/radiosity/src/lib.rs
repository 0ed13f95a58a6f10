//! Monte Carlo radiosity: scenes, rays, walks, estimators and exact tallies.
//!
//! No I/O, clock, threads or sockets live here: everything is a function of its arguments, and the tally of
//! walks 0 … N − 1 a function of scene, method, seed and N alone.
//!
//! Papers are cited by key: S97 = Sbert, *Error and Complexity of Random Walk Monte Carlo Radiosity* (1997);
//! BS = Bekaert & Seidel, *A Theoretical Comparison of Monte Carlo Radiosity Algorithms*.

mod arrive;
mod batch;
mod birth;
mod coplanar;
mod depart;
mod estimator;
mod experiment;
mod face;
mod fate;
mod final_gather;
mod flat;
mod isa;
mod jacobi;
mod layers;
mod meet;
mod method;
mod prefetch;
mod quasi;
mod real;
mod replay;
mod rng;
mod sampling;
mod scene;
mod sobol;
mod solution;
mod spec;
mod surface;
mod table;
mod tally;
mod trace;
mod tree;
mod view;
mod walk;

pub use birth::birth_probabilities;
pub use coplanar::{Overlap, Stack};
pub use experiment::{Board, Experiment, Meaning, Unfit};
pub use face::{Face, Faces};
pub use jacobi::{ChainBoard, Iteration, Phase, Reciprocity, stochastic_iteration};
pub use method::{
    Batch, Birth, Direction, EstimatorKind, InfiniteEnd, Iterations, Method, RayBirths, Sampler, Solve, Space,
};
pub use replay::{Replay, Step};
pub use rng::{Sequence, WalkRng};
pub use scene::{IndexChoice, Scene, SceneError};
pub use solution::{Apart, Channels, Estimate, Estimates, Mix, Precision, QUANTILES, Solution, TINY};
pub use spec::{SceneSpec, Shape, Sides, Spectrum, SurfaceSpec};
pub use surface::{Side, Surface};
pub use tally::{Counts, Layout, MergeError, Overflow, Scoreboard, Tally};
pub use trace::{Hit, Ray};
pub use walk::WalkEnd;
