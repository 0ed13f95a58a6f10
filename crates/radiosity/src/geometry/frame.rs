//! What departures look up of surfaces.

use super::surface::Surface;
use crate::simd::table::Table;

/// What a departure needs of surfaces: corner, edges, tangent and normal, component by component, and a zero.
pub(crate) type Frames = Table<16>;

/// The frames of surfaces.
pub(crate) fn frames(surfaces: &[Surface]) -> Frames {
    let frame = |surface: &Surface| {
        let [edge_u, edge_v] = surface.edges();
        let vectors = [surface.corner(), edge_u, edge_v, surface.tangent(), surface.normal()];
        let components = vectors.map(|vector| vector.to_array());
        std::array::from_fn(|i| components.as_flattened().get(i).copied().unwrap_or(0.0))
    };
    Table::new(surfaces.iter().map(frame).collect())
}
