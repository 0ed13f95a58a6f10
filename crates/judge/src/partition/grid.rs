//! Grids of cells of one size.

use job::Cut;
use radiosity::Shape;

/// The cells of one surface, all alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Grid {
    /// Of a quad, along u and v.
    Quad([u32; 2]),
    /// Of a triangle: rows k, for k² cells.
    Triangle(u32),
}

impl Grid {
    /// The grid of a shape; one cell where its cells are not alike.
    pub fn of(shape: &Shape) -> Self {
        match *shape {
            Shape::Parallelogram { cells, .. } => Grid::Quad(cells),
            Shape::Divided { .. } => Grid::Quad([1, 1]),
            Shape::Triangle { rows, .. } => Grid::Triangle(rows),
        }
    }

    /// The cut of a surface that has it.
    pub fn cut(self) -> Cut {
        match self {
            Grid::Quad(cells) => Cut::Grid(cells),
            Grid::Triangle(rows) => Cut::Rows(rows),
        }
    }

    /// The number of cells.
    pub fn cells(self) -> u64 {
        self.cut().cells()
    }

    /// Every cell cut in two along u and v this many times; a triangle's rows are doubled by the first of the numbers.
    pub fn doubled(self, [a, b]: [u32; 2]) -> Self {
        match self {
            Grid::Quad([nu, nv]) => Grid::Quad([nu << a, nv << b]),
            Grid::Triangle(rows) => Grid::Triangle(rows << a),
        }
    }
}
