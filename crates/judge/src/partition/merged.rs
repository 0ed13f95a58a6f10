//! Cells of a surface that are of one patch, merged into cells of a coarser grid where no group tells them apart.

use super::grid::Grid;
use super::seen::GridCells;

/// The coarsest grid between `base` and a grid whose cells have labels, on which no cell has parts of different labels, with the labels of
/// its cells. Only grids that halve the cells of the finer one are tried.
pub fn merged(base: Grid, grid: Grid, labels: Vec<u32>) -> (Grid, Vec<u32>) {
    let coarser: Vec<Grid> = match (base, grid) {
        (Grid::Triangle(least), Grid::Triangle(rows)) if rows.is_multiple_of(2) && rows > least => {
            vec![Grid::Triangle(rows / 2)]
        }
        (Grid::Quad(least), Grid::Quad([nu, nv])) => {
            let along = [(nu, least[0], [nu / 2, nv]), (nv, least[1], [nu, nv / 2])];
            let halves = along.into_iter().filter(|(n, least, _)| n.is_multiple_of(2) && n > least);
            halves.map(|(_, _, cells)| Grid::Quad(cells)).collect()
        }
        _ => Vec::new(),
    };
    match coarser.into_iter().find_map(|coarse| Some((coarse, gathered(grid, coarse, &labels)?))) {
        Some((coarse, labels)) => merged(base, coarse, labels),
        None => (grid, labels),
    }
}

/// The cell of a coarse grid that is around a cell of a grid that halves its cells again and again.
pub fn around(coarse: Grid, fine: Grid, cell: u64) -> usize {
    GridCells::new(coarse).cell_at(GridCells::new(fine).centre(cell as usize).0)
}

/// The labels of the cells of a coarser grid; `None` where parts of a cell differ.
fn gathered(grid: Grid, coarse: Grid, labels: &[u32]) -> Option<Vec<u32>> {
    let (fine, wide) = (GridCells::new(grid), GridCells::new(coarse));
    let mut found = vec![None; coarse.cells() as usize];
    for (cell, &label) in labels.iter().enumerate() {
        let around = &mut found[wide.cell_at(fine.centre(cell).0)];
        if *around.get_or_insert(label) != label {
            return None;
        }
    }
    found.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_of_one_label_become_one() {
        let all = |cells: usize| vec![7; cells];
        assert_eq!(merged(Grid::Triangle(1), Grid::Triangle(4), all(16)), (Grid::Triangle(1), all(1)));
        assert_eq!(merged(Grid::Quad([1, 3]), Grid::Quad([4, 6]), all(24)), (Grid::Quad([1, 3]), all(3)));
        // The first of the four rows is a patch of its own.
        let labels = vec![1, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2];
        assert_eq!(merged(Grid::Triangle(1), Grid::Triangle(4), labels.clone()), (Grid::Triangle(4), labels));
        let halves = vec![1, 1, 2, 2];
        assert_eq!(merged(Grid::Quad([1, 1]), Grid::Quad([2, 2]), halves), (Grid::Quad([2, 1]), vec![1, 2]));
    }
}
