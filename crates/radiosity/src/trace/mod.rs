//! The nearest surface along a ray.
//!
//! One arithmetic everywhere: the nearest hit is the least (t, rank), every t computed by [`meet`] and
//! nothing else, so neither the index, nor its builder, nor the order of traversal can enter the answer. The rank of a
//! surface is its number, but where surfaces coincide it is that of its layer ([`coplanar`]). All of it is f64: a scene
//! may lie 10⁵ edge lengths from its origin.

pub(crate) mod coplanar;
pub(crate) mod facet;
pub(crate) mod flat;
pub(crate) mod layers;
pub(crate) mod meet;
pub(crate) mod ray;
pub(crate) mod stack;
pub(crate) mod tree;

use facet::Facets;
use flat::Flat;
use meet::{Best, meet_alone};
use ray::{Hit, Hits, Ray, Rays};
use tree::{Scratch, Tree};

/// What a scene finds the nearest surface by.
#[derive(Clone, Debug)]
pub(crate) enum Index {
    /// Every facet is met in turn.
    Flat(Flat),
    /// Through a tree of boxes.
    Tree(Tree),
}

impl Index {
    /// What the index takes of memory [bytes].
    pub(crate) fn bytes(&self) -> usize {
        match self {
            Index::Flat(flat) => flat.bytes(),
            Index::Tree(tree) => tree.bytes(),
        }
    }

    /// The least (t, rank) among the facets that each ray meets. Directions have a length of about 1;
    /// `scratch` is space that keeps its allocation from batch to batch.
    #[inline]
    pub(crate) fn closest_hits(&self, facets: &Facets, rays: &Rays, scratch: &mut Scratch, hits: &mut Hits) {
        match self {
            Index::Flat(flat) => flat.closest_hits(facets, rays, hits),
            Index::Tree(tree) => tree.closest_hits(facets, rays, scratch, hits),
        }
    }

    /// The nearest hit of one ray, whose direction may have any length.
    pub(crate) fn closest_hit(&self, facets: &Facets, ray: &Ray) -> Option<Hit> {
        match self {
            Index::Flat(_) => {
                let mut best = Best::none();
                for surface in 0..facets.len() as u32 {
                    meet_alone(facets, surface, ray, &mut best);
                }
                best.hit()
            }
            Index::Tree(tree) => tree.closest_hit(facets, ray),
        }
    }
}
