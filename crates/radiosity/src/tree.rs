//! A tree of boxes over the facets, for scenes of more than a handful: obvhs builds it, [`build`] folds it into
//! nodes of sixteen children and leaves of four facets, [`wavefront`] walks it with many rays at a time.
//!
//! Everything in the tree is f32 and only culls, in coordinates scaled by a power of two into [−1, 1].

mod build;
mod lanes;
mod wavefront;

use crate::isa::Isa;
use crate::trace::{Facets, Hit, Hits, Ray, Rays};
pub(crate) use build::BinaryTree;
pub(crate) use lanes::LANES as WIDTH;
use lanes::{GROUP, GROUPS, Quad, Row};
pub(crate) use wavefront::Scratch;

/// A tree of nodes with sixteen children and leaves of up to four facets.
#[derive(Clone, Debug)]
pub(crate) struct Tree {
    /// Nodes and leaves one after another, the root first.
    lines: Vec<Line>,
    /// Nodes on the longest way down.
    levels: usize,
    /// Tree coordinates are scene coordinates times this, a power of two.
    scale: f64,
    /// The slack of the facets in tree coordinates.
    slack: f32,
    /// What rays are traced with.
    isa: Isa,
}

/// A cache line of the tree.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Line(Row);

/// Something to do next, in the upper two bits: visit the node or the leaf that begins with the line in the lower
/// bits, take something from the stack, or nothing more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Item(u32);

impl Item {
    const NODE: usize = 0;
    const LEAF: usize = 1;
    const POP: usize = 2;
    const DONE: usize = 3;
    /// How many kinds there are.
    const KINDS: usize = 4;

    const fn new(kind: usize, line: usize) -> Self {
        assert!(line < 1 << 30, "a tree of less than 64 GiB");
        Item((kind as u32) << 30 | line as u32)
    }

    #[inline(always)]
    fn kind(self) -> usize {
        (self.0 >> 30) as usize
    }

    #[inline(always)]
    fn line(self) -> usize {
        (self.0 & ((1 << 30) - 1)) as usize
    }
}

/// Sixteen boxes, and what is in each: lower x, upper x, lower y, …, upper z, the bits of the children's `Item`s.
type Node = [Line; NODE_LINES];

const NODE_LINES: usize = 7;

/// The line of a node that holds its children.
const CHILDREN: usize = 6;

/// The node that begins with a line.
#[inline(always)]
fn node_at(lines: &[Line], first: usize) -> &Node {
    lines[first..first + NODE_LINES].try_into().expect("as long as a node")
}

/// Up to four facets, in rows of four numbers. Where there are fewer facets the rest is not a number, and never met.
#[derive(Clone, Copy)]
struct Leaf<'a>(&'a [Line; LEAF_LINES]);

const LEAF_LINES: usize = Leaf::ROWS.div_ceil(GROUPS);

impl<'a> Leaf<'a> {
    /// The bits of surface numbers, then in f32 normal and offset, u axis and offset, v axis and offset, steepness.
    const ROWS: usize = 14;
    const SURFACE: usize = 0;
    const NORMAL: usize = 1;
    const U: usize = 5;
    const V: usize = 9;
    /// By how much u, v and u + v change at most along a unit of length; negative for a triangle.
    const STEEPNESS: usize = 13;

    /// The leaf that begins with a line.
    #[inline(always)]
    fn at(lines: &'a [Line], first: usize) -> Self {
        Leaf(lines[first..first + LEAF_LINES].try_into().expect("as long as a leaf"))
    }

    #[inline(always)]
    fn row(&self, row: usize) -> &'a Quad {
        self.0[row / GROUPS].0[row % GROUPS * GROUP..][..GROUP].try_into().expect("a row")
    }
}

impl Tree {
    /// The nearest hit of one ray of any length.
    pub(crate) fn closest_hit(&self, facets: &Facets, ray: &Ray) -> Option<Hit> {
        // The kernel wants directions of about unit length. A power of two changes no bit of the hit but the
        // exponent of t.
        let largest = ray.direction.abs().max_element();
        let scale = f64::from_bits((1.0 / largest).to_bits() & f64::INFINITY.to_bits()) * 0.5;
        let mut rays = Rays::default();
        rays.push(&Ray { direction: ray.direction * scale, ..*ray });
        let mut hits = Hits::default();
        self.closest_hits(facets, &rays, &mut Scratch::default(), &mut hits);
        hits.get(0).map(|hit| Hit { t: hit.t * scale, ..hit })
    }
}

#[cfg(test)]
mod tests;
