//! The lines of a tree: nodes and leaves.

use crate::simd::isa::Isa;
use crate::simd::sixteen::{GROUP, GROUPS, LANES, Quad, Row};

/// A tree of nodes with sixteen children and leaves of up to four facets.
#[derive(Clone, Debug)]
pub(crate) struct Tree {
    /// Nodes and leaves one after another, the root first.
    pub(super) lines: Vec<Line>,
    /// Tree coordinates are scene coordinates times this, a power of two.
    pub(super) scale: f64,
    /// The slack of the facets in tree coordinates.
    pub(super) slack: f32,
    /// What rays are traced with.
    pub(super) isa: Isa,
}

/// Nodes on the longest way down, at most.
pub(super) const LEVELS: usize = LANES;

impl Tree {
    /// What nodes and leaves take of memory [bytes].
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&self.lines[..])
    }
}

/// A cache line of the tree.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Line(pub(super) Row);

/// Something to do next, in the upper two bits: visit the node or the leaf that begins with the line in the lower
/// bits, take something from the stack, or nothing more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Item(pub(super) u32);

impl Item {
    pub(super) const NODE: usize = 0;
    pub(super) const LEAF: usize = 1;
    pub(super) const POP: usize = 2;
    pub(super) const DONE: usize = 3;
    /// How many kinds there are.
    pub(super) const KINDS: usize = 4;
    /// A visit of the root.
    pub(super) const ROOT: Self = Item::new(Item::NODE, 0);

    pub(super) const fn new(kind: usize, line: usize) -> Self {
        assert!(line < 1 << 30, "a tree of less than 64 GiB");
        Item((kind as u32) << 30 | line as u32)
    }

    #[inline(always)]
    pub(super) fn kind(self) -> usize {
        (self.0 >> 30) as usize
    }

    #[inline(always)]
    pub(super) fn line(self) -> usize {
        (self.0 & ((1 << 30) - 1)) as usize
    }
}

/// Sixteen boxes, and what is in each: lower x, upper x, lower y, …, upper z, the bits of the children's `Item`s.
pub(super) type Node = [Line; NODE_LINES];

/// Two lines for each axis, and one of children.
pub(super) const NODE_LINES: usize = 7;

/// The line of a node that holds its children.
pub(super) const CHILDREN: usize = 6;

/// The node that begins with a line.
#[inline(always)]
pub(super) fn node_at(lines: &[Line], first: usize) -> &Node {
    lines[first..first + NODE_LINES].try_into().expect("as long as a node")
}

/// Up to four facets, in rows of four numbers. Where there are fewer facets the rest is not a number, and never met.
#[derive(Clone, Copy)]
pub(super) struct Leaf<'a>(pub(super) &'a [Line; LEAF_LINES]);

/// The lines of a leaf.
pub(super) const LEAF_LINES: usize = Leaf::ROWS.div_ceil(GROUPS);

impl<'a> Leaf<'a> {
    /// The bits of surface numbers, then in f32 normal and offset, u axis and offset, v axis and offset, steepness.
    pub(super) const ROWS: usize = 14;
    pub(super) const SURFACE: usize = 0;
    pub(super) const NORMAL: usize = 1;
    pub(super) const U: usize = 5;
    pub(super) const V: usize = 9;
    /// By how much u, v and u + v change at most along a unit of length; negative for a triangle.
    pub(super) const STEEPNESS: usize = 13;

    /// The leaf that begins with a line.
    #[inline(always)]
    pub(super) fn at(lines: &'a [Line], first: usize) -> Self {
        Leaf(lines[first..first + LEAF_LINES].try_into().expect("as long as a leaf"))
    }

    #[inline(always)]
    pub(super) fn row(&self, row: usize) -> &'a Quad {
        self.0[row / GROUPS].0[row % GROUPS * GROUP..][..GROUP].try_into().expect("a row")
    }
}
