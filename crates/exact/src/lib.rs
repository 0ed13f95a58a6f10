//! The deterministic judge of the Monte Carlo code: closed-form form factors, a dense solve of the radiosity
//! system, and the exact variance of the walks.
//!
//! Data flows one way: [`BoxScene`] (geometry) → [`ExchangeMatrix`] (form factors) → [`RadiositySystem`]
//! (one set of reflectances) → [`Solution`] (one set of emittances); [`Exact`] holds one of each for a scene.
//! All is sequential: a scene has the same answer to the last bit however busy or wide the machine is.
//!
//! Scenes are closed boxes of axis-aligned rectangles so far. Another geometry needs another way to fill the
//! [`ExchangeMatrix`]; colour needs one [`RadiositySystem`] per channel over one matrix.
//!
//! Papers are cited by key: S97 = Sbert, *Error and Complexity of Random Walk Monte Carlo Radiosity* (1997);
//! BS = Bekaert & Seidel, *A Theoretical Comparison of Monte Carlo Radiosity Algorithms*.

#![allow(rustdoc::broken_intra_doc_links, reason = "units are written in square brackets")]

mod answer;
mod box_scene;
mod cubature;
mod exchange;
mod form_factor;
mod rectangle;
mod system;
mod variance;

pub use answer::{Exact, ExactError, MAX_PATCHES};
pub use box_scene::{BoxScene, NotABox};
pub use exchange::ExchangeMatrix;
pub use form_factor::{exchange_area, form_factor};
pub use rectangle::{Facing, Rectangle};
pub use system::{RadiositySystem, Singular, Solution};
pub use variance::WalkEstimator;
