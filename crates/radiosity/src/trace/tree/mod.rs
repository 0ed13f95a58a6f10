//! A tree of boxes over the facets, for scenes of more than a handful: obvhs builds it, [`build`] folds it into
//! nodes of sixteen children and leaves of four facets, [`wavefront`] walks it with many rays at a time.
//!
//! Everything in the tree is f32 and only culls, in coordinates scaled by a power of two into [−1, 1].

mod binary;
mod build;
mod layout;
mod probe;
mod scratch;
mod wavefront;

pub(crate) use crate::simd::sixteen::LANES as WIDTH;
pub(crate) use binary::{BinaryTree, Effort};
pub(crate) use layout::Tree;
pub(crate) use probe::Known;
pub use probe::{StepKind, TreeStep};
pub(crate) use scratch::Scratch;

#[cfg(test)]
mod tests;
