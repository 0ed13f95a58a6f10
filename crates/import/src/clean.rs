//! Faces that cannot be modelled: those without area, and those that cover another one.

use std::collections::HashMap;

use foldhash::fast::RandomState;
use glam::DVec3;

use crate::mesh::{Mesh, Triangle};

/// The faulty triangles of a mesh, by their indices.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct FaultyTriangles {
    /// The triangles without area.
    pub(crate) degenerate: Vec<usize>,
    /// The triangles that cover another one, which is kept: one that emits, else an earlier one.
    pub(crate) doubled: Vec<usize>,
}

impl FaultyTriangles {
    /// Finds the faulty triangles. `two_sided` says for each material whether both sides are active, `emits` whether it emits. A triangle is a
    /// double if others at its place have all of its active sides: those that emit, then earlier ones.
    pub(crate) fn find(mesh: &Mesh, two_sided: &[bool], emits: &[bool]) -> Self {
        let merged = merge(&mesh.positions);
        let corners = mesh.triangles.iter().flat_map(|triangle| triangle.corners);
        let largest = corners.fold(0.0_f64, |largest, corner| {
            largest.max(mesh.positions[corner as usize].abs().max_element())
        });
        let least = largest * SMALLEST;
        let degenerate: Vec<usize> = (0..mesh.triangles.len())
            .filter(|&i| !has_area(&mesh.triangles[i], &mesh.positions, least))
            .collect();
        let mut seen = HashMap::with_capacity_and_hasher(mesh.triangles.len(), RandomState::default());
        let mut is_double = |i: usize| {
            let triangle = &mesh.triangles[i];
            let (corners, turned) = sorted(triangle.corners.map(|corner| merged[corner as usize]));
            let own = if two_sided[triangle.material as usize] { BOTH } else { 1 << u8::from(turned) };
            let covered = seen.entry(corners).or_insert(0_u8);
            let is_covered = *covered & own == own;
            *covered |= own;
            is_covered
        };
        let (lit, dark): (Vec<usize>, Vec<usize>) =
            (0..mesh.triangles.len()).partition(|&i| emits[mesh.triangles[i].material as usize]);
        let mut doubled: Vec<usize> = lit.into_iter().chain(dark).filter(|&i| is_double(i)).collect();
        doubled.sort_unstable();
        doubled.retain(|i| degenerate.binary_search(i).is_err());
        FaultyTriangles { degenerate, doubled }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.degenerate.is_empty() && self.doubled.is_empty()
    }

    /// Takes the faulty triangles out.
    pub(crate) fn remove_from(&self, mesh: &mut Mesh) {
        let mut keep = vec![true; mesh.triangles.len()];
        self.degenerate.iter().chain(&self.doubled).for_each(|&i| keep[i] = false);
        let mut keep = keep.into_iter();
        mesh.triangles.retain(|_| keep.next().expect("a mark for each"));
    }
}

/// For each vertex, the least index of a vertex at the same place.
pub(crate) fn merge(positions: &[DVec3]) -> Vec<u32> {
    let mut first = HashMap::with_capacity_and_hasher(positions.len(), RandomState::default());
    // Adding 0 turns −0 into 0.
    let bits = |position: &DVec3| position.to_array().map(|x| (x + 0.0).to_bits());
    (0..).zip(positions).map(|(i, position)| *first.entry(bits(position)).or_insert(i)).collect()
}

/// Both sides of a triangle; a one-sided triangle has one of these bits, by its orientation.
const BOTH: u8 = 0b11;

/// The corners in the order that triangles at one place share, and whether the triangle runs through them the other way.
fn sorted(mut corners: [u32; 3]) -> ([u32; 3], bool) {
    let least = corners.iter().enumerate().min_by_key(|(_, corner)| **corner).map_or(0, |(at, _)| at);
    corners.rotate_left(least);
    let [a, b, c] = corners;
    if b > c { ([a, c, b], true) } else { ([a, b, c], false) }
}

/// The part of the scene's largest coordinate below which a triangle's edges count as no length: a thousand times what
/// coordinates there resolve.
const SMALLEST: f64 = 1.0 / (1_u64 << 36) as f64;

/// Whether the direction of a triangle's normal is more than rounding, by the rule of [`radiosity::Scene::build`], and an
/// edge is as long as `least`.
fn has_area(triangle: &Triangle, positions: &[DVec3], least: f64) -> bool {
    let corners = triangle.corners.map(|corner| positions[corner as usize]);
    let (e_u, e_v) = (corners[1] - corners[0], corners[2] - corners[0]);
    let (area, extent) = (e_u.cross(e_v).length(), e_u.length() * e_v.length());
    let largest = corners.iter().fold(0.0_f64, |max, corner| max.max(corner.abs().max_element()));
    let noise = 8.0 * f64::EPSILON * largest * e_u.length().max(e_v.length());
    let is_large = e_u.length().max(e_v.length()) >= least;
    is_large && area.is_finite() && extent.is_finite() && area > noise && area > 1e-12 * extent
}
