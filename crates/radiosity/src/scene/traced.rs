//! What rays need of the surfaces of a scene, which scenes of the same surfaces share.

use std::sync::Arc;

use super::IndexChoice;
use crate::executor::ParallelFor;
use crate::geometry::frame::Frames;
use crate::geometry::surface::Surface;
use crate::simd::isa::Isa;
use crate::trace::Index;
use crate::trace::coplanar::stacks;
use crate::trace::facet::Facets;
use crate::trace::flat::Flat;
use crate::trace::stack::Stack;
use crate::trace::tree::{BinaryTree, Effort, Tree};

/// Up to this many surfaces, meeting every facet is faster than a tree (with AVX-512 up to twice as many).
const FLAT_SURFACES: usize = 96;

/// What rays need of the surfaces of a scene, whatever the cells of these.
pub(super) struct Traced {
    pub(super) frames: Arc<Frames>,
    pub(super) stacks: Arc<[Stack]>,
    pub(super) facets: Arc<Facets>,
    pub(super) index: Arc<Index>,
}

impl Traced {
    /// What rays need of surfaces, which take on the planes of their stacks. Many rays begin as far out as `births` [m].
    pub(super) fn new(
        surfaces: &mut [Surface],
        (slack, births): (f64, f64),
        (index, isa): (IndexChoice, Isa),
        executor: &ParallelFor,
    ) -> Self {
        let tree = match index {
            IndexChoice::Auto | IndexChoice::Draft => surfaces.len() > FLAT_SURFACES,
            IndexChoice::Flat => false,
            IndexChoice::Tree => true,
        };
        let effort = if index == IndexChoice::Draft { Effort::Least } else { Effort::Full };
        let binary = tree.then(|| BinaryTree::new(surfaces, slack, effort, executor));
        let stacks = stacks(surfaces, slack, binary.as_ref(), executor);
        lie_in(surfaces, &stacks);
        let facets = Facets::new(surfaces, &stacks, slack, executor);
        let index = match &binary {
            Some(binary) => Index::Tree(Tree::new(binary, &facets, isa)),
            None => Index::Flat(Flat::new(isa, surfaces, &facets, births)),
        };
        let frames = Frames::new(surfaces.iter().map(Surface::frame)).into();
        Traced { frames, stacks: stacks.into(), facets: facets.into(), index: index.into() }
    }
}

/// Surfaces take on the planes of their stacks.
pub(super) fn lie_in(surfaces: &mut [Surface], stacks: &[Stack]) {
    for stack in stacks {
        stack.surfaces.iter().for_each(|&surface| surfaces[surface as usize].lie_in(stack.normal));
    }
}
