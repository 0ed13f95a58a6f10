//! Covers: surfaces that lie on each other, as the scene's own stacks tell.

use std::collections::BTreeSet;

use glam::DVec3;
use radiosity::{Scene, Side, Sides, surfaces::Overlap};

use crate::finding::{Finding, Kind};
use crate::pilot::LightPilot;

/// The pairs of surfaces that overlap in one plane, with the exact areas that they share.
pub(crate) struct Covers {
    overlaps: Vec<Overlap>,
}

impl Covers {
    /// Takes the overlaps of the stacks. Two one-sided surfaces back to back are the two sides of a wall and no fault. Nor
    /// are bodies that touch, as a cupboard and the floor that it stands on: to where they touch no light comes, from
    /// either side.
    pub(crate) fn find(scene: &Scene, pilot: &LightPilot) -> Self {
        let surfaces = scene.surfaces();
        let one_sided = |surface: u32| surfaces[surface as usize].sides() == Sides::Front;
        let back_to_back = |overlap: &Overlap| {
            let [upper, lower] = [overlap.upper, overlap.lower].map(|i| surfaces[i as usize].normal());
            one_sided(overlap.upper) && one_sided(overlap.lower) && upper.dot(lower) < 0.0
        };
        let mut overlaps = Vec::new();
        for stack in scene.stacks() {
            let faults = stack
                .overlaps(surfaces)
                .into_iter()
                .filter(|overlap| !back_to_back(overlap) && comes_light(scene, pilot, overlap, stack.normal));
            overlaps.extend(faults);
        }
        // Of overlaps between the same parts of meshes the largest is reported.
        overlaps.sort_by(|a, b| b.area.total_cmp(&a.area));
        Covers { overlaps }
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

/// Whether light comes to the middle of an overlap, from above its upper surface or from below its lower one; `up` is the
/// normal of their plane.
fn comes_light(scene: &Scene, pilot: &LightPilot, overlap: &Overlap, up: DVec3) -> bool {
    let surfaces = scene.surfaces();
    let origin = overlap.middle(surfaces);
    [(overlap.upper, up), (overlap.lower, -up)].into_iter().any(|(surface, outwards)| {
        let is_front = surfaces[surface as usize].normal().dot(outwards) > 0.0;
        let side = if is_front { Side::Front } else { Side::Back };
        pilot.comes_light(scene, origin, surface, side)
    })
}

/// The power Φ that an area of a surface emits, all channels [W].
fn emitted(scene: &Scene, surface: u32, area: f64) -> f64 {
    let first = scene.faces().piece(scene.surfaces()[surface as usize].piece(0, Side::Front));
    (0..scene.channels()).map(|channel| first.emittance[channel] * area).sum()
}
