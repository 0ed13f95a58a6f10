//! Landings: what arrivals look up of surfaces, N side by side.

use super::basis;
use super::cells::{folded, grid_step, in_grid_step, inside};
use super::places::Places;
use super::surface::Surface;
use crate::simd::real::Real;
use crate::simd::table::Table;

/// The outline is a parallelogram of cells.
const PARALLELOGRAM: f64 = 0.0;
/// A triangle that is one cell.
const TRIANGLE: f64 = 1.0;
/// A triangle in rows of cells.
const TRIANGLE_IN_ROWS: f64 = 2.0;

/// What an arrival needs of N surfaces.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Landing<R> {
    /// Cells along u and v.
    cells: [R; 2],
    /// The inverses of these numbers.
    inverse: [R; 2],
    /// The number of the first front; in scenes with leaves that of the first cell of the front.
    first_piece: R,
    /// The survival thresholds, as bits.
    survival: R,
    /// The step from a front to its back; 0 where backs are not active.
    to_back: R,
    /// The kind of outline.
    outline: R,
}

/// The landings of surfaces.
#[derive(Clone, Debug)]
pub(crate) struct Landings {
    table: Table<8>,
    /// Whether some triangle is cut in cells.
    rows: bool,
}

impl Landings {
    /// What the landings take of memory [bytes].
    pub(crate) fn bytes(&self) -> usize {
        self.table.bytes()
    }

    /// The landings of surfaces; `places` has the numbers of cells in scenes with leaves.
    pub(crate) fn new(surfaces: &[Surface], places: Option<&Places>) -> Self {
        let numbers = |(i, surface): (usize, &Surface)| match places {
            None => [surface.first_piece(), surface.to_back()],
            Some(places) => places.first_cells(i),
        };
        let landing = |surface: (usize, &Surface)| Landing::of(surface.1, numbers(surface));
        let landings: Vec<Landing<f64>> = surfaces.iter().enumerate().map(landing).collect();
        let rows = landings.iter().any(|landing| landing.outline == TRIANGLE_IN_ROWS);
        Landings { table: Table::new(landings.iter().map(Landing::numbers).collect()), rows }
    }

    /// Whether some triangle is cut in cells: a landing takes it for one cell.
    pub(crate) fn has_rows(&self) -> bool {
        self.rows
    }

    /// Hits on these surfaces will soon be located.
    #[inline(always)]
    pub(crate) fn expect(&self, surfaces: &[u32]) {
        self.table.expect(surfaces);
    }
}

impl Landing<f64> {
    fn of(surface: &Surface, [first_piece, to_back]: [u32; 2]) -> Self {
        let cells = surface.cells_along().map(f64::from);
        Landing {
            cells,
            inverse: cells.map(|n| 1.0 / n),
            first_piece: first_piece.into(),
            survival: f64::from_bits(surface.survival_threshold()),
            to_back: to_back.into(),
            outline: match (surface.is_triangle(), cells[0] > 1.0) {
                (false, _) => PARALLELOGRAM,
                (true, false) => TRIANGLE,
                (true, true) => TRIANGLE_IN_ROWS,
            },
        }
    }

    fn numbers(&self) -> [f64; 8] {
        let Landing { cells: [nu, nv], inverse: [iu, iv], first_piece, survival, to_back, outline } = *self;
        [nu, nv, iu, iv, first_piece, survival, to_back, outline]
    }
}

impl<R: Real> Landing<R> {
    /// Looks up the landing of each surface.
    #[inline(always)]
    pub(crate) fn each(landings: &Landings, surfaces: &[u32]) -> Self {
        let [nu, nv, iu, iv, first_piece, survival, to_back, outline] = R::rows(&landings.table, surfaces);
        Landing { cells: [nu, nv], inverse: [iu, iv], first_piece, survival, to_back, outline }
    }

    /// The cells that hold points, as numbers along u and v.
    #[inline(always)]
    pub(crate) fn cell_at(&self, [u, v]: [R; 2]) -> [R; 2] {
        [grid_step(u, self.cells[0]), grid_step(v, self.cells[1])]
    }

    /// The steps of the basis functions that hold points of cells.
    #[inline(always)]
    pub(crate) fn steps(&self, [u, v]: [R; 2]) -> [R; 2] {
        let cell = self.cell_at([u, v]);
        let place = [u * self.cells[0] - cell[0], v * self.cells[1] - cell[1]];
        basis::steps(place, self.is_triangle())
    }

    /// The numbers of the pieces that are sides of cells, those that `facing` gives; in scenes with leaves those of the cells.
    #[inline(always)]
    pub(crate) fn piece(&self, cell: [R; 2], facing: R) -> R {
        let zero = R::splat(0.0);
        let side = R::select(facing.lt(zero), self.to_back, zero);
        cell[0] * self.cells[1] + cell[1] + self.first_piece + side
    }

    /// Whether the sides that `facing` gives are active.
    #[inline(always)]
    pub(crate) fn is_active(&self, facing: R) -> R::Mask {
        // Above 0: the front, or a back that is active.
        R::splat(0.0).lt(facing + self.to_back + self.to_back)
    }

    /// Whether walks survive, given the bits that they have drawn.
    #[inline(always)]
    pub(crate) fn survives(&self, bits: &[u64]) -> R::Mask {
        R::below(bits, self.survival)
    }

    /// Local coordinates of uniform points of cells, from two uniforms in (0, 1) each.
    #[inline(always)]
    pub(crate) fn point_in(&self, cell: [R; 2], r: [R; 2]) -> [R; 2] {
        let [r, s] = folded(r, self.is_triangle());
        [in_grid_step(cell[0], r, self.inverse[0]), in_grid_step(cell[1], s, self.inverse[1])]
    }

    /// The nearest local coordinates strictly inside the surfaces.
    #[inline(always)]
    pub(crate) fn inside(&self, uv: [R; 2]) -> [R; 2] {
        inside(uv, self.is_triangle())
    }

    #[inline(always)]
    fn is_triangle(&self) -> R::Mask {
        R::splat(PARALLELOGRAM).lt(self.outline)
    }
}
