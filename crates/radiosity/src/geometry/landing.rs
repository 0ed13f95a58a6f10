//! What arrivals look up of surfaces.

use super::surface::Surface;
use crate::simd::table::Table;

/// What an arrival needs of a surface: cells along u and v and the inverses of these numbers, first face, bits of
/// the survival threshold, the step from a front to its back (0 where backs are not active), kind of outline.
pub(crate) type Landing = [f64; 8];

/// Kinds of outline.
pub(crate) const PARALLELOGRAM: f64 = 0.0;
/// A triangle that is one cell.
pub(crate) const TRIANGLE: f64 = 1.0;
/// A triangle in rows of cells.
pub(crate) const TRIANGLE_IN_ROWS: f64 = 2.0;

/// The landings of surfaces.
#[derive(Clone, Debug)]
pub(crate) struct Landings {
    pub(crate) table: Table<8>,
    /// Whether some triangle is cut in cells.
    pub(crate) rows: bool,
}

impl Landings {
    pub(crate) fn new(surfaces: &[Surface]) -> Self {
        let landings: Vec<Landing> = surfaces.iter().map(landing).collect();
        let rows = landings.iter().any(|landing| landing[7] == TRIANGLE_IN_ROWS);
        Landings { table: Table::new(landings), rows }
    }

    /// Hits on these surfaces will soon be located.
    #[inline(always)]
    pub(crate) fn expect(&self, surfaces: &[u32]) {
        self.table.expect(surfaces);
    }
}

fn landing(surface: &Surface) -> Landing {
    let [nu, nv] = surface.cells_along().map(f64::from);
    let kind = match (surface.is_triangle(), nu > 1.0) {
        (false, _) => PARALLELOGRAM,
        (true, false) => TRIANGLE,
        (true, true) => TRIANGLE_IN_ROWS,
    };
    let back = f64::from(surface.to_back());
    let survival = f64::from_bits(surface.survival_threshold());
    [nu, nv, 1.0 / nu, 1.0 / nv, f64::from(surface.first_face()), survival, back, kind]
}
