//! A tree of boxes over the facets, for scenes of more than a handful: obvhs builds it, [`build`] folds it into
//! nodes of sixteen children, [`wavefront`] walks it with many rays at a time.
//!
//! Everything in the tree is f32 and only culls, in coordinates scaled by a power of two into [−1, 1].

mod build;
mod lanes;
mod wavefront;

use crate::isa::Isa;
use crate::trace::{Facets, Hit, Hits, Ray, Rays};
use lanes::Row;
pub(crate) use wavefront::Scratch;

/// A tree of nodes with sixteen children and leaves of up to sixteen facets.
#[derive(Clone, Debug)]
pub(crate) struct Tree {
    nodes: Vec<Node>,
    leaves: Vec<Leaf>,
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

/// Up to sixteen facets.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
struct Leaf {
    /// Normal and offset, u axis and offset, v axis and offset, steepness, surface numbers.
    rows: [Row; 14],
}

impl Leaf {
    /// By how much u, v and u + v change at most along a unit of length; negative for a triangle.
    const STEEPNESS: usize = 12;
    /// The bits of surface numbers; `Ray::FREE` where there is no facet.
    const SURFACE: usize = 13;
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
