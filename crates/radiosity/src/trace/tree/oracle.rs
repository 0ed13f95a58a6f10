//! What a wavefront may be told of rays before it traces them, to measure what such knowledge would win.

use std::cell::RefCell;

use super::layout::{CHILDREN, Item, Leaf, Tree};
use super::scratch::{Scratch, Step};
use crate::simd::batch::WIDTH;
use crate::simd::sixteen::{GROUP, LANES};
use crate::trace::facet::Facets;
use crate::trace::ray::{Hits, Rays};

/// What is known of the rays of a batch before they are traced. Of the rays of walks nothing is, which costs nothing:
/// [`Unknown`].
pub(super) trait Oracle {
    /// A parameter that the hit of a ray does not exceed.
    #[inline(always)]
    fn bound(&self, _ray: usize) -> f32 {
        f32::INFINITY
    }
    /// The item under which the hit of a ray is.
    #[inline(always)]
    fn first(&self, _ray: usize) -> Item {
        Item::ROOT
    }
    /// A ray takes a step.
    #[inline(always)]
    fn see(&self, _step: Step) {}
}

/// Nothing is known.
pub(super) struct Unknown;

impl Oracle for Unknown {}

/// What is known of the rays of a batch.
#[derive(Clone, Debug)]
pub(crate) struct Known {
    bounds: [f32; WIDTH],
    firsts: [Item; WIDTH],
}

impl Known {
    pub(crate) const NOTHING: Self = Known { bounds: [f32::INFINITY; WIDTH], firsts: [Item::ROOT; WIDTH] };
}

impl Oracle for Known {
    #[inline(always)]
    fn bound(&self, ray: usize) -> f32 {
        self.bounds[ray]
    }
    #[inline(always)]
    fn first(&self, ray: usize) -> Item {
        self.firsts[ray]
    }
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

/// What is known, and the steps that rays take.
struct Observed<'a> {
    known: &'a Known,
    steps: RefCell<Vec<TreeStep>>,
}

impl Oracle for Observed<'_> {
    fn bound(&self, ray: usize) -> f32 {
        self.known.bounds[ray]
    }
    fn first(&self, ray: usize) -> Item {
        self.known.firsts[ray]
    }
    fn see(&self, step: Step) {
        let kind = match step.item.kind() {
            Item::NODE => StepKind::Node,
            Item::LEAF => StepKind::Leaf,
            _ => StepKind::Stack,
        };
        self.steps.borrow_mut().push(TreeStep { ray: step.ray.into(), kind, place: step.item.line() });
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
        self.trace(known, facets, rays, scratch, hits);
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
        let observed = Observed { known, steps: RefCell::default() };
        self.trace(&observed, facets, rays, scratch, hits);
        observed.steps.into_inner()
    }
}
