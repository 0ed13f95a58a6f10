//! Surfaces that lie on each other: what the scene's own stacks say of them.

use std::collections::BTreeSet;

use radiosity::{Overlap, Scene, Side, Sides};

use crate::finding::{Finding, Kind};

/// The pairs of surfaces that overlap in one plane, with the exact areas that they share.
pub(crate) struct Covers {
    overlaps: Vec<Overlap>,
}

impl Covers {
    /// Takes the overlaps of the stacks. Two one-sided surfaces back to back are the two sides of a wall and no fault.
    pub(crate) fn find(scene: &Scene) -> Self {
        let surfaces = scene.surfaces();
        let one_sided = |surface: u32| surfaces[surface as usize].sides() == Sides::Front;
        let back_to_back = |overlap: &Overlap| {
            let [upper, lower] = [overlap.upper, overlap.lower].map(|i| surfaces[i as usize].normal());
            one_sided(overlap.upper) && one_sided(overlap.lower) && upper.dot(lower) < 0.0
        };
        let overlaps = scene.stacks().iter().flat_map(|stack| stack.overlaps(surfaces));
        Covers { overlaps: overlaps.filter(|overlap| !back_to_back(overlap)).collect() }
    }

    /// The surfaces that share area with another one in its plane.
    pub(crate) fn surfaces(&self) -> BTreeSet<u32> {
        self.overlaps.iter().flat_map(|overlap| [overlap.upper, overlap.lower]).collect()
    }

    /// A finding for each pair. Its power is what the shared area emits towards the other surface.
    pub(crate) fn findings(&self, scene: &Scene) -> Vec<Finding> {
        let finding = |&Overlap { upper, lower, area }: &Overlap| {
            let (first, second) = (upper.min(lower), upper.max(lower));
            let [a, b] = [first, second].map(|surface| scene.surface_name(surface));
            Finding {
                kind: Kind::Overlapping,
                surfaces: vec![first, second],
                power: [upper, lower].iter().map(|&surface| emitted(scene, surface, area)).sum(),
                message: format!("{a} and {b} lie in one plane and share {area:.3e} m²"),
            }
        };
        self.overlaps.iter().map(finding).collect()
    }
}

/// Φ of an area of a surface, all channels [W].
fn emitted(scene: &Scene, surface: u32, area: f64) -> f64 {
    let first = scene.surfaces()[surface as usize].face(0, Side::Front);
    let face = scene.faces().get(first as usize);
    (0..scene.channels()).map(|channel| face.emittance[channel] * area).sum()
}
