//! Places on surfaces where rays of chains end.

use crate::geometry::basis::SLOPE_UNITS;
use crate::scene::Scene;
use crate::walk::spots::BasisSample;

/// A surface, and local coordinates on it.
pub(super) type LocalPoint = (u32, [f64; 2]);

/// ψ₁ and ψ₂ at a place.
pub(super) fn psi(scene: &Scene, (number, uv): LocalPoint) -> [f64; 2] {
    let cell = scene.surfaces()[number as usize].cell_at(uv);
    <[i64; 2]>::of_birth(scene, [number, cell], uv).map(|units| units as f64 / SLOPE_UNITS as f64)
}
