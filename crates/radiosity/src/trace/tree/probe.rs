//! A probe of a wavefront: what rays may be told before they are traced, to measure what such knowledge would win, and the steps that
//! they take.

use std::cell::RefCell;

use super::layout::{CHILDREN, Item, Leaf, Tree};
use super::scratch::{Scratch, Step};
use crate::simd::batch::WIDTH;
use crate::simd::sixteen::{GROUP, LANES};
use crate::trace::facet::Facets;
use crate::trace::ray::{Hits, Rays};

/// What is known of the rays of a batch before they are traced. Of the rays of walks nothing is.
#[derive(Clone, Debug)]
pub(crate) struct Known {
    /// Parameters that hits do not exceed.
    bounds: [f32; WIDTH],
    /// The items under which hits are.
    firsts: [Item; WIDTH],
}

impl Known {
    pub(crate) const NOTHING: Self = Known { bounds: [f32::INFINITY; WIDTH], firsts: [Item::ROOT; WIDTH] };
}

/// The kind of a step of a ray through a tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepKind {
    /// To a node.
    Node,
    /// To a leaf.
    Leaf,
    /// To the ray's stack, for what is left.
    Stack,
}

/// A step of a ray through a tree.
#[derive(Clone, Copy, Debug)]
pub struct TreeStep {
    /// The number of the ray.
    pub ray: usize,
    /// What the step leads to.
    pub kind: StepKind,
    /// The number of the node or the leaf.
    pub place: usize,
}

/// Looks into a wavefront.
pub(super) struct Probe<'a> {
    known: &'a Known,
    /// The steps that rays take, where they are wanted.
    steps: Option<RefCell<Vec<TreeStep>>>,
}

impl Probe<'_> {
    /// A parameter that the hit of a ray does not exceed.
    pub(super) fn bound(&self, ray: usize) -> f32 {
        self.known.bounds[ray]
    }

    /// The item under which the hit of a ray is.
    pub(super) fn first(&self, ray: usize) -> Item {
        self.known.firsts[ray]
    }

    /// A ray takes a step.
    pub(super) fn see(&self, step: Step) {
        let Some(steps) = &self.steps else { return };
        let kind = match step.item.kind() {
            Item::NODE => StepKind::Node,
            Item::LEAF => StepKind::Leaf,
            _ => StepKind::Stack,
        };
        steps.borrow_mut().push(TreeStep { ray: step.ray.into(), kind, place: step.item.line() });
    }
}

impl Tree {
    /// The leaf that holds each facet.
    pub(crate) fn leaves(&self, facets: usize) -> Vec<Item> {
        let mut leaves = vec![Item::ROOT; facets];
        let mut open = vec![Item::ROOT.line()];
        while let Some(node) = open.pop() {
            for slot in (0..LANES).filter(|&slot| self.lines[node].0[slot] < f32::MAX) {
                let item = Item(self.lines[node + CHILDREN].0[slot].to_bits());
                if item.kind() == Item::NODE {
                    open.push(item.line());
                    continue;
                }
                let leaf = Leaf::at(&self.lines, item.line());
                for lane in (0..GROUP).filter(|&lane| !leaf.row(Leaf::NORMAL)[lane].is_nan()) {
                    leaves[leaf.row(Leaf::SURFACE)[lane].to_bits() as usize] = item;
                }
            }
        }
        leaves
    }

    /// What hits tell of their rays: how far they are and, with the leaves of facets, where.
    pub(crate) fn known(&self, rays: &Rays, hits: &Hits, leaves: Option<&[Item]>) -> Known {
        let mut known = Known::NOTHING;
        for (i, hit) in (0..rays.len).filter_map(|i| Some((i, hits.get(i)?))) {
            known.bounds[i] = ((hit.t * self.scale) as f32).next_up();
            if let Some(leaves) = leaves {
                known.firsts[i] = leaves[hit.surface as usize];
            }
        }
        known
    }

    /// [`Tree::closest_hits`] with what is known beforehand.
    pub(crate) fn closest_hits_knowing(
        &self,
        known: &Known,
        facets: &Facets,
        rays: &Rays,
        scratch: &mut Scratch,
        hits: &mut Hits,
    ) {
        self.trace::<true>(Some(&Probe { known, steps: None }), facets, rays, scratch, hits);
    }

    /// The steps that rays take with what is known beforehand.
    pub(crate) fn steps(
        &self,
        known: &Known,
        facets: &Facets,
        rays: &Rays,
        scratch: &mut Scratch,
        hits: &mut Hits,
    ) -> Vec<TreeStep> {
        let probe = Probe { known, steps: Some(RefCell::default()) };
        self.trace::<true>(Some(&probe), facets, rays, scratch, hits);
        probe.steps.map_or(Vec::new(), RefCell::into_inner)
    }
}
