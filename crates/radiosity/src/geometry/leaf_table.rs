//! From a point of a surface to the leaf that holds it: one look-up, however the leaves are cut.

use super::cells::grid_step;
use super::leaves::{CutCell, Leaves};

/// The leaves of a surface, by the cells of the coarsest grid that holds them all.
#[derive(Debug)]
pub(crate) struct LeafTable {
    leaves: Leaves,
    /// Cells along u and v.
    grid: [u32; 2],
    leaf_of_cell: Vec<u32>,
}

impl LeafTable {
    pub(crate) fn new(leaves: &Leaves) -> Self {
        let grid = leaves.grid();
        let mut leaf_of_cell = vec![0; (grid[0] * grid[1]) as usize];
        for (number, leaf) in (0..).zip(leaves.iter()) {
            let size = [0, 1].map(|k| grid[k] >> leaf.levels[k]);
            let first = [0, 1].map(|k| leaf.at[k] * size[k]);
            for i in first[0]..first[0] + size[0] {
                let row = (i * grid[1] + first[1]) as usize;
                leaf_of_cell[row..row + size[1] as usize].fill(number);
            }
        }
        LeafTable { leaves: leaves.clone(), grid, leaf_of_cell }
    }

    /// What the table takes of memory [bytes].
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&self.leaf_of_cell[..])
    }

    /// How many leaves there are.
    pub(crate) fn len(&self) -> u32 {
        self.leaves.len() as u32
    }

    /// Leaf number `i`.
    #[inline(always)]
    pub(crate) fn get(&self, i: u32) -> CutCell {
        self.leaves.get(i)
    }

    /// Cells along u and v of the grid.
    pub(crate) fn grid(&self) -> [u32; 2] {
        self.grid
    }

    /// The leaf of each cell of the grid, in their order.
    pub(crate) fn of_cells(&self) -> &[u32] {
        &self.leaf_of_cell
    }

    /// The leaf that holds the point with local coordinates (u, v).
    #[inline(always)]
    pub(crate) fn leaf_at(&self, uv: [f64; 2]) -> u32 {
        let [iu, iv] = [0, 1].map(|k| grid_step(uv[k], f64::from(self.grid[k])) as u32);
        self.leaf_of_cell[(iu * self.grid[1] + iv) as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::cells::{place_in_leaf, point_in_leaf};

    #[test]
    fn cells_of_the_grid_know_their_leaf() {
        let leaves: Leaves = "uv..v.u..".parse().unwrap();
        assert_eq!(LeafTable::new(&leaves).of_cells(), [0, 1, 0, 1, 2, 3, 2, 4]);
    }

    /// Every point of a leaf is found there, and lies where it was drawn.
    #[test]
    fn points_of_a_leaf_are_found_in_it() {
        let table = LeafTable::new(&"uvu..v..v.u.v.u..".parse().unwrap());
        for number in 0..table.len() {
            for step in 0..400 {
                let place = [(f64::from(step % 20) + 0.4) / 20.0, (f64::from(step / 20) + 0.7) / 20.0];
                let uv = point_in_leaf(table.get(number), place);
                assert_eq!(table.leaf_at(uv), number);
                let found = place_in_leaf(uv, table.get(number));
                assert!(place.iter().zip(found).all(|(a, b)| (a - b).abs() < 1e-12), "{place:?}, {found:?}");
            }
        }
        for outside in [[1.0, 1.0], [1.0 + 1e-15, -1e-15]] {
            assert!(table.leaf_at(outside) < table.len());
        }
    }
}
