//! A tree of boxes over the facets, for scenes of more than a handful: obvhs builds it, [`build`] folds it into
//! nodes of sixteen children, [`wavefront`] walks it with many rays at a time.
//!
//! Everything in the tree is f32 and only culls, in coordinates scaled by a power of two into [−1, 1].

mod build;
mod lanes;
mod wavefront;

use crate::isa::Isa;
use crate::trace::{Facets, Hit, Hits, Ray, Rays};
use lanes::{LANES, Row};
pub(crate) use wavefront::Scratch;

/// A tree of nodes with sixteen children and leaves of up to sixteen facets.
#[derive(Clone, Debug)]
pub(crate) struct Tree {
    nodes: Vec<Node>,
    /// The leaves one after another, each at the beginning of a line.
    leaves: Vec<Line>,
    /// Nodes on the longest way down.
    levels: usize,
    /// Tree coordinates are scene coordinates times this, a power of two.
    scale: f64,
    /// The slack of the facets in tree coordinates.
    slack: f32,
    /// What rays are traced with.
    isa: Isa,
}

/// Something to visit: a node, a leaf, or nothing more. The upper two bits say which: 0, 1, 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Item(u32);

impl Item {
    const DONE: Item = Item(2 << 30);

    fn node(index: usize) -> Self {
        Item(u32::try_from(index).expect("fewer nodes than surfaces"))
    }

    fn leaf(index: usize) -> Self {
        Item(1 << 30 | u32::try_from(index).expect("fewer leaves than surfaces"))
    }

    #[inline(always)]
    fn kind(self) -> usize {
        (self.0 >> 30) as usize
    }

    #[inline(always)]
    fn index(self) -> usize {
        (self.0 & ((1 << 30) - 1)) as usize
    }
}

/// Sixteen boxes, and what is in each.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
struct Node {
    /// Lower x, upper x, lower y, …, upper z, the bits of the children's `Item`s.
    rows: [Row; 7],
}

impl Node {
    const CHILDREN: usize = 6;
    /// Beyond any scene and any origin of a ray.
    const FAR: f32 = f32::MAX;
}

/// A cache line of a leaf.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Line(Row);

/// Up to sixteen facets: how many, then so many numbers for each of [`Leaf::ROWS`] rows, without gaps. Tracing waits
/// for the memory that leaves take more than for anything else.
#[derive(Clone, Copy)]
struct Leaf<'a> {
    lines: &'a [Line],
    count: usize,
}

impl<'a> Leaf<'a> {
    /// The bits of surface numbers, then in f32 normal and offset, u axis and offset, v axis and offset, steepness.
    /// Small integers first: as numbers they are subnormal, and would slow down what reads beyond a row.
    const ROWS: usize = 14;
    const SURFACE: usize = 0;
    const NORMAL: usize = 1;
    const U: usize = 5;
    const V: usize = 9;
    /// By how much u, v and u + v change at most along a unit of length; negative for a triangle.
    const STEEPNESS: usize = 13;

    /// Where a row begins in a leaf of `count` facets.
    const fn start(count: usize, row: usize) -> usize {
        1 + row * count
    }

    /// The lines that hold all rows of a leaf, each read as a whole vector.
    const fn lines(count: usize) -> usize {
        (Self::start(count, Self::ROWS - 1) + LANES).div_ceil(LANES)
    }

    /// The leaf that begins with a line.
    #[inline(always)]
    fn at(lines: &'a [Line], first: usize) -> Self {
        let count = lines[first].0[0].to_bits() as usize;
        Leaf { lines: &lines[first..first + Self::lines(count)], count }
    }

    /// A row, and after its `count` numbers whatever follows.
    #[inline(always)]
    fn row(&self, row: usize) -> &'a Row {
        let start = Self::start(self.count, row);
        debug_assert!(row < Self::ROWS && self.lines.len() == Self::lines(self.count));
        // SAFETY: a line is a vector of numbers, and lines lie side by side, as many as `lines` says: `start` is far
        // enough from the end of the last.
        unsafe { &*self.lines.as_ptr().cast::<f32>().add(start).cast::<Row>() }
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
