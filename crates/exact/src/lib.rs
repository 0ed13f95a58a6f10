//! The deterministic judge of the Monte Carlo code: form factors, a dense solve of the radiosity system, and the
//! exact variance of the walks.
//!
//! Data flows one way: geometry → [`ExchangeMatrix`] (form factors) → [`RadiositySystem`] (one set of
//! reflectances) → [`SystemSolution`] (one set of emittances); [`Exact`] holds one of each for a scene, and [`SystemAccuracy`]
//! says how far it may be off. Predictions about walks ([`Exact::shooting_variances`], [`Exact::gathering_variances`], [`WeightedWalk`],
//! [`VarianceBounds`]) read an [`Exact`].
//!
//! The unknowns are faces, the active sides of patches, numbered as [`radiosity::surfaces::Faces`] does: a two-sided patch has
//! two, and nothing passes from one to the other. Every vector here is in the order of faces.
//!
//! Geometry comes in two kinds. A closed box of axis-aligned rectangles ([`BoxScene`]) has closed forms for all
//! pairs of faces. In any other scene each pair is judged alone: closed forms, contour integrals or cubature
//! where nothing can stand between; where something may, adaptive cubature of Lambert's formula for what a
//! point sees past the occluders, with an estimated error.
//!
//! Lamps without area are points, whose light on faces is added to the system; what a lamp does not see of a face is cut off.
//!
//! Surfaces that overlap in one plane are layers ([`radiosity::surfaces::Stack`]): a face exchanges light with other planes
//! through what no layer in front covers of it, and with the layer that it faces through the area between them.
//!
//! Threads fill the rows of general scenes and never enter the answer; its last digits may differ between
//! machines (vector width, the platform's atan and ln). Colour needs one [`Exact`] per channel over one
//! matrix.
//!
//! Papers are cited by key: S97 = Sbert, *Error and Complexity of Random Walk Monte Carlo Radiosity* (1997);
//! SInf = Sbert, *Variance of two infinite path length random walk radiosity estimators*; BS = Bekaert & Seidel,
//! *A Theoretical Comparison of Monte Carlo Radiosity Algorithms*.

#![warn(unreachable_pub, unnameable_types)]
#![allow(rustdoc::broken_intra_doc_links, reason = "units are written in square brackets")]

mod accuracy;
mod answer;
mod bounds;
mod box_scene;
mod colour;
mod contour;
mod cubature;
#[allow(unsafe_code, reason = "the product of matrices takes pointers")]
mod dense;
mod exchange;
mod face;
mod form_factor;
mod found;
mod general;
mod lamps;
mod layers;
mod occlusion;
mod penumbra;
mod polygon;
mod rectangle;
#[cfg(test)]
#[path = "../tests/common/shapes.rs"]
#[allow(unreachable_pub, reason = "tests of their own crate share it")]
mod shapes;
mod system;
mod variance;

pub use accuracy::SystemAccuracy;
pub use answer::{Exact, ExactError, MAX_GENERAL_FACES, MAX_PATCHES};
pub use bounds::VarianceBounds;
pub use box_scene::{BoxScene, NotABox};
pub use colour::{SharedPath, WeightedWalk};
pub use exchange::ExchangeMatrix;
pub use form_factor::{exchange_area, form_factor};
pub use found::FormFactors;
pub use lamps::LampLight;
pub use rectangle::{Facing, Rectangle};
pub use system::{RadiositySystem, Singular, SystemSolution};
pub use variance::{
    ESTIMATORS, best_gathering_weights, best_shooting_weights, gathering_covariance, jacobi_variances,
    shooting_covariance, systematic_jacobi_variances,
};
