//! The deterministic judge of the Monte Carlo code: closed-form form factors, a dense solve of the radiosity
//! system, and the exact variance of the walks.
//!
//! Data flows one way: [`BoxScene`] (geometry) → [`ExchangeMatrix`] (form factors) → [`RadiositySystem`]
//! (one set of reflectances) → [`Solution`] (one set of emittances); [`Exact`] holds one of each for a scene.
//! All is sequential, so threads never enter the answer; its last digits may differ between machines (vector
//! width, the platform's atan and ln).
//!
//! Scenes are closed boxes of axis-aligned rectangles so far. Another geometry needs another way to fill the
//! [`ExchangeMatrix`]; colour needs one [`RadiositySystem`] per channel over one matrix.
//!
//! Papers are cited by key: S97 = Sbert, *Error and Complexity of Random Walk Monte Carlo Radiosity* (1997);
//! SInf = Sbert, *Variance of two infinite path length random walk radiosity estimators*; BS = Bekaert & Seidel,
//! *A Theoretical Comparison of Monte Carlo Radiosity Algorithms*.

#![allow(rustdoc::broken_intra_doc_links, reason = "units are written in square brackets")]

mod answer;
mod bounds;
mod box_scene;
mod contour;
mod cubature;
mod exchange;
mod face;
mod faces;
mod form_factor;
mod general;
mod occlusion;
mod penumbra;
mod polygon;
mod rectangle;
mod system;
mod variance;

pub use answer::{Exact, ExactError, MAX_PATCHES};
pub use bounds::Bounds;
pub use box_scene::{BoxScene, NotABox};
pub use exchange::ExchangeMatrix;
pub use faces::Faces;
pub use form_factor::{exchange_area, form_factor};
pub use rectangle::{Facing, Rectangle};
pub use system::{RadiositySystem, Singular, Solution};
pub use variance::{
    GatherEstimator, WalkEstimator, best_gathering_weights, best_shooting_weights, gathering_covariance,
    jacobi_variances, shooting_covariance,
};
