//! How surfaces are cut into patches, where a job leaves that to the program or to a file.

use radiosity::{Shape, SurfaceSpec, surfaces::Leaves};
use serde::{Deserialize, Serialize};

/// The cells of one surface: `[nu, nv]` of a quad, the rows of a triangle, or the cuts of a quad into rectangles.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Cut {
    /// Cells along u and v.
    Grid([u32; 2]),
    /// Rows k, for k² cells.
    Rows(u32),
    /// Rectangles.
    Leaves(Leaves),
}

impl Cut {
    /// The cut of a shape as it stands.
    pub fn of(shape: &Shape) -> Self {
        match *shape {
            Shape::Parallelogram { cells, .. } => Cut::Grid(cells),
            Shape::Triangle { rows, .. } => Cut::Rows(rows),
            Shape::Divided { ref leaves, .. } => Cut::Leaves(leaves.clone()),
        }
    }

    /// The number of cells.
    pub fn cells(&self) -> u64 {
        match *self {
            Cut::Grid([nu, nv]) => u64::from(nu) * u64::from(nv),
            Cut::Rows(rows) => u64::from(rows) * u64::from(rows),
            Cut::Leaves(ref leaves) => leaves.len() as u64,
        }
    }

    /// Cuts a surface so, in place of how it is cut. Emittances of its cells go over to the cells that these are cut into. Returns
    /// whether it is possible: the shape has such a cut, and no cell has parts of cells that differ in emittance.
    pub fn apply(self, surface: &mut SurfaceSpec) -> bool {
        let emit = &surface.cell_emittance;
        match (&mut surface.shape, self) {
            (&mut Shape::Parallelogram { corner, corner_u, corner_v, .. }, Cut::Leaves(leaves))
                if emit.is_empty() =>
            {
                surface.shape = Shape::Divided { corner, corner_u, corner_v, leaves };
                true
            }
            (Shape::Parallelogram { cells, .. }, Cut::Grid(new)) => {
                let [u, v] = [0, 1].map(|k| (new[k] / cells[k], new[k].is_multiple_of(cells[k])));
                if !(emit.is_empty() || u.1 && v.1) {
                    return false;
                }
                let split = |&(cell, emittance): &(u32, _)| {
                    let [i, j] = [cell / cells[1] * u.0, cell % cells[1] * v.0];
                    (i..i + u.0).flat_map(move |i| (j..j + v.0).map(move |j| (i * new[1] + j, emittance)))
                };
                surface.cell_emittance = emit.iter().flat_map(split).collect();
                *cells = new;
                true
            }
            (Shape::Triangle { rows, .. }, Cut::Rows(new)) if emit.is_empty() || *rows == new => {
                *rows = new;
                true
            }
            _ => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use radiosity::Spectrum;

    use super::*;

    #[test]
    fn emittances_go_over_to_the_parts_of_their_cells() {
        let shape = Shape::parallelogram(DVec3::ZERO, DVec3::X, DVec3::Y, [1, 2]);
        let mut surface = SurfaceSpec::new(shape, 0.5);
        surface.cell_emittance = vec![(1, Spectrum::from(3.0))];
        assert!(!Cut::Grid([2, 3]).apply(&mut surface));
        assert!(!Cut::Rows(2).apply(&mut surface));
        assert_eq!(Cut::of(&surface.shape), Cut::Grid([1, 2]));
        assert!(Cut::Grid([2, 4]).apply(&mut surface));
        let cells: Vec<u32> = surface.cell_emittance.iter().map(|&(cell, _)| cell).collect();
        assert_eq!(cells, [2, 3, 6, 7]);
        assert_eq!(Cut::of(&surface.shape), Cut::Grid([2, 4]));
        let leaves = || Cut::Leaves("uv...".parse().unwrap());
        assert!(!leaves().apply(&mut surface));
        surface.cell_emittance.clear();
        assert!(Cut::Grid([3, 1]).apply(&mut surface));
        assert!(leaves().apply(&mut surface));
        assert_eq!((Cut::of(&surface.shape), surface.shape.cell_count()), (leaves(), 3));
    }
}
