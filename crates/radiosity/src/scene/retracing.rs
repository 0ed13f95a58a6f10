//! Rays that are traced again and again, to measure what tracing takes, and what it would take if something were known of
//! the rays.

use crate::scene::Scene;
use crate::simd::batch::WIDTH;
use crate::trace::Index;
use crate::trace::facet::Facets;
use crate::trace::ray::{Hits, Ray, Rays};
use crate::trace::tree::{Known, Scratch, Tree, TreeStep};

/// What is known of rays before they are traced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Foresight {
    /// Nothing, as in walks.
    Nothing,
    /// How far they go: no first guess of a hit can tell more.
    Distance,
    /// How far they go, and the leaf of the tree that they end in: no tree can lead there sooner.
    Leaf,
}

/// A batch of rays, and what can be known of it.
struct RetracedBatch {
    rays: Rays,
    distance: Known,
    leaf: Known,
}

/// Rays that are traced again and again through the tree of a scene, in the same batches.
pub struct Retracing<'a> {
    tree: &'a Tree,
    facets: &'a Facets,
    batches: Vec<RetracedBatch>,
    scratch: Box<Scratch>,
    hits: Box<Hits>,
}

impl<'a> Retracing<'a> {
    /// Takes on rays, whose directions have length 1 within 10⁻⁹; `None` where the scene has no tree.
    pub fn new(scene: &'a Scene, rays: &[Ray]) -> Option<Self> {
        let parts = &*scene.parts;
        let Index::Tree(tree) = &*parts.index else { return None };
        let (mut scratch, mut hits) = (Box::<Scratch>::default(), Box::<Hits>::default());
        let leaves = tree.leaves(parts.facets.len());
        let batch = |part: &[Ray]| {
            let mut rays = Rays::default();
            part.iter().for_each(|ray| rays.push(ray));
            tree.closest_hits(&parts.facets, &rays, &mut scratch, &mut hits);
            let [distance, leaf] = [None, Some(&leaves[..])].map(|leaves| tree.known(&rays, &hits, leaves));
            RetracedBatch { rays, distance, leaf }
        };
        let batches = rays.chunks(WIDTH).map(batch).collect();
        Some(Retracing { tree, facets: &parts.facets, batches, scratch, hits })
    }

    /// Traces all rays, and returns a digest of their hits.
    pub fn trace(&mut self, foresight: Foresight) -> u64 {
        let mut digest = 0_u64;
        for RetracedBatch { rays, distance, leaf } in &self.batches {
            let (facets, scratch, hits) = (self.facets, &mut *self.scratch, &mut *self.hits);
            match foresight {
                Foresight::Nothing => self.tree.closest_hits(facets, rays, scratch, hits),
                Foresight::Distance => self.tree.closest_hits_knowing(distance, facets, rays, scratch, hits),
                Foresight::Leaf => self.tree.closest_hits_knowing(leaf, facets, rays, scratch, hits),
            }
            for (t, &surface) in hits.t[..rays.len].iter().zip(&hits.surface) {
                digest = digest.wrapping_add(t.to_bits() ^ u64::from(surface) << 40);
            }
        }
        digest
    }

    /// The steps that rays take through the tree.
    pub fn steps(&mut self, foresight: Foresight) -> Vec<TreeStep> {
        let mut all = Vec::new();
        for (number, RetracedBatch { rays, distance, leaf }) in self.batches.iter().enumerate() {
            let known = match foresight {
                Foresight::Nothing => &Known::NOTHING,
                Foresight::Distance => distance,
                Foresight::Leaf => leaf,
            };
            let steps = self.tree.steps(known, self.facets, rays, &mut self.scratch, &mut self.hits);
            all.extend(steps.into_iter().map(|step| TreeStep { ray: WIDTH * number + step.ray, ..step }));
        }
        all
    }
}
