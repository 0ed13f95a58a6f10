//! What arrivals look up in scenes with leaves: the piece that a point lies in, and where in it.
//!
//! A leaf is a block of cells of its surface's grid. The cells of all sides of all surfaces are numbered, and a table has the piece of
//! each: one look-up, however the leaves are cut. A second table has the place of every piece on its surface.

use super::basis;
use super::face::Faces;
use super::spec::{Side, Sides};
use super::surface::Surface;
use crate::simd::real::Real;
use crate::simd::table::Table;

/// The tables of a scene with leaves.
#[derive(Clone, Debug)]
pub(crate) struct Places {
    /// By cell.
    pieces: Vec<u32>,
    /// By surface: the number of the first cell of its front, and of that of its back less this one (0 without a back).
    first_cells: Vec<[u32; 2]>,
    /// By piece that is a cell of a grid of n_u × n_v: n_u, i_u, n_v, i_v, and 0s.
    spots: Table<8>,
    /// Whether some surface is a triangle, whose pieces have no such place.
    triangles: bool,
}

/// A point's piece where it lies in none.
const NO_PIECE: u32 = 0;

impl Places {
    /// The places of a scene; `None` where no surface is cut into leaves.
    pub(crate) fn new(surfaces: &[Surface], faces: &Faces) -> Option<Self> {
        surfaces.iter().any(|surface| surface.leaves().is_some()).then(|| {
            let mut pieces = Vec::new();
            let first_cells = surfaces.iter().map(|surface| number_cells(surface, &mut pieces)).collect();
            let mut spots = vec![[0.0; 8]; faces.piece_count()];
            for surface in surfaces {
                for cell in 0..surface.cell_count() {
                    let spot = spot_of(surface, cell);
                    let sides = [Side::Front, Side::Back].into_iter().filter(|&side| surface.is_active(side));
                    sides.for_each(|side| spots[surface.piece(cell, side) as usize] = spot);
                }
            }
            let triangles = surfaces.iter().any(Surface::is_triangle);
            Places { pieces, first_cells, spots: Table::new(spots), triangles }
        })
    }

    /// What the tables take of memory [bytes].
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&self.pieces[..]) + size_of_val(&self.first_cells[..]) + self.spots.bytes()
    }

    /// The numbers of the first cell of a surface's front, and of that of its back less this one.
    pub(crate) fn first_cells(&self, surface: usize) -> [u32; 2] {
        self.first_cells[surface]
    }

    /// Whether some surface is a triangle: its pieces have to be located once more.
    pub(crate) fn has_triangles(&self) -> bool {
        self.triangles
    }

    /// Puts the numbers of pieces in place of those of cells.
    #[inline(always)]
    pub(crate) fn look_up(&self, cells: &mut [u32]) {
        for cell in cells {
            *cell = self.pieces.get(*cell as usize).copied().unwrap_or(NO_PIECE);
        }
    }

    /// The steps of the basis functions that hold points of pieces of parallelograms.
    #[inline(always)]
    pub(crate) fn steps<R: Real>(&self, pieces: &[u32], [u, v]: [R; 2]) -> [R; 2] {
        let [nu, iu, nv, iv, ..] = R::rows(&self.spots, pieces);
        let zero = R::splat(0.0);
        basis::steps([u * nu - iu, v * nv - iv], zero.lt(zero))
    }
}

/// Numbers the cells of a surface behind those that have a piece.
fn number_cells(surface: &Surface, pieces: &mut Vec<u32>) -> [u32; 2] {
    let first = pieces.len() as u32;
    let side = |side: Side| match surface.leaves() {
        None => (0..surface.cell_count()).map(|cell| surface.piece(cell, side)).collect::<Vec<u32>>(),
        Some(table) => table.of_cells().iter().map(|&leaf| surface.piece(leaf, side)).collect(),
    };
    pieces.extend(side(Side::Front));
    let back = pieces.len() as u32;
    if surface.sides() == Sides::Front {
        return [first, 0];
    }
    pieces.extend(side(Side::Back));
    [first, back - first]
}

fn spot_of(surface: &Surface, cell: u32) -> [f64; 8] {
    let [[nu, nv], [iu, iv]] = match surface.leaves() {
        _ if surface.is_triangle() => [[0; 2]; 2],
        Some(table) => [table.get(cell).grid(), table.get(cell).at],
        None => {
            let [nu, nv] = surface.cells_along();
            [[nu, nv], [cell / nv, cell % nv]]
        }
    };
    [nu, iu, nv, iv, 0, 0, 0, 0].map(f64::from)
}
