//! Trees of the cells of meshes: each part is halved again and again, down to single cells, by where its cells lie and where they face.
//!
//! A cell is a point of six coordinates: its centre, over [`REACH`] times the diagonal of the box around its object, and its normal. A part
//! is cut across the coordinate of the largest variance over its area, at the mean. The tree is a function of the cells alone.

use glam::DVec3;
use radiosity::{SceneSpec, Shape};

/// The part of an object's diagonal by which light changes about as much as by a turn of one radian.
const REACH: f64 = 1.0;

/// A cell of a mesh.
#[derive(Clone, Copy, Debug)]
struct Cell {
    number: u32,
    area: f64,
    /// Centre and normal.
    at: [f64; 6],
}

/// A part of an object: some of its cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cluster {
    /// Its first cell in the order of the tree, and the one behind its last.
    pub cells: [u32; 2],
    /// The numbers of its halves, which are larger than its own; `None` of a single cell.
    pub halves: Option<[u32; 2]>,
    /// The sum of the areas of its cells [m²].
    pub area: f64,
    /// The mean over its area of the centres of its cells [m], and of their normals.
    pub middle: [DVec3; 2],
}

/// The trees of all objects.
#[derive(Clone, Debug)]
pub struct Clusters {
    /// The cells in the order of the trees: a part has neighbouring places.
    pub cells: Vec<u32>,
    /// The parts, every one before its halves.
    pub parts: Vec<Cluster>,
    /// The parts that are whole objects.
    pub roots: Vec<u32>,
}

impl Clusters {
    /// The trees of the cells of a scene whose surfaces are of kinds: cells of one kind make a tree. Surfaces without a kind have none.
    pub fn new(spec: &SceneSpec, kinds: &[Option<u32>]) -> Self {
        let mut clusters = Clusters { cells: Vec::new(), parts: Vec::new(), roots: Vec::new() };
        for mut cells in by_kind(spec, kinds) {
            clusters.roots.push(clusters.parts.len() as u32);
            let reach = reach(&cells);
            clusters.grow(&mut cells, reach);
        }
        clusters
    }

    /// Adds the tree of some cells, for which a step of `reach` [m] counts as much as a turn of one radian.
    fn grow(&mut self, cells: &mut [Cell], reach: f64) {
        let first = self.cells.len();
        let root = self.parts.len();
        self.parts.push(cluster(cells, first));
        let (mut open, mut scratch) = (vec![root], Vec::new());
        while let Some(part) = open.pop() {
            let [from, to] = self.parts[part].cells.map(|cell| cell as usize - first);
            if to - from == 1 {
                continue;
            }
            let middle = from + halve(&mut cells[from..to], self.parts[part].middle, reach, &mut scratch);
            let next = self.parts.len();
            self.parts.push(cluster(&cells[from..middle], first + from));
            self.parts.push(cluster(&cells[middle..to], first + middle));
            self.parts[part].halves = Some([next as u32, next as u32 + 1]);
            open.extend([next + 1, next]);
        }
        self.cells.extend(cells.iter().map(|cell| cell.number));
    }
}

/// The cells of every kind that has any.
fn by_kind(spec: &SceneSpec, kinds: &[Option<u32>]) -> Vec<Vec<Cell>> {
    let count = kinds.iter().flatten().max().map_or(0, |last| *last as usize + 1);
    let mut cells = vec![Vec::new(); count];
    let mut number = 0;
    for (surface, kind) in spec.surfaces.iter().zip(kinds) {
        let of_surface = surface.shape.cell_count() as u32;
        if let Some(kind) = kind {
            cells[*kind as usize]
                .extend((0..of_surface).map(|cell| cell_of(&surface.shape, cell, number + cell)));
        }
        number += of_surface;
    }
    cells.retain(|cells: &Vec<Cell>| !cells.is_empty());
    cells
}

/// The reach of an object of some cells [m].
fn reach(cells: &[Cell]) -> f64 {
    let place = |cell: &Cell| DVec3::from_slice(&cell.at);
    let low = cells.iter().fold(DVec3::INFINITY, |low, cell| low.min(place(cell)));
    let high = cells.iter().fold(DVec3::NEG_INFINITY, |high, cell| high.max(place(cell)));
    (REACH * (high - low).length()).max(f64::MIN_POSITIVE)
}

fn cell_of(shape: &Shape, cell: u32, number: u32) -> Cell {
    let (_, u, v) = shape.edges();
    let corners = shape.cell_corners(cell);
    let centre = corners.iter().sum::<DVec3>() / corners.len() as f64;
    let normal = u.cross(v).normalize_or_zero();
    let across = |a: DVec3, b: DVec3| (a - corners[0]).cross(b - corners[0]).length();
    let area = 0.5 * corners[1..].windows(2).map(|pair| across(pair[0], pair[1])).sum::<f64>();
    Cell { number, area, at: [centre.x, centre.y, centre.z, normal.x, normal.y, normal.z] }
}

fn cluster(cells: &[Cell], first: usize) -> Cluster {
    let (area, mean) = mean(cells);
    Cluster {
        cells: [first as u32, (first + cells.len()) as u32],
        halves: None,
        area,
        middle: [DVec3::from_slice(&mean[..3]), DVec3::from_slice(&mean[3..])],
    }
}

/// The area of cells, and the mean of their coordinates over it.
fn mean(cells: &[Cell]) -> (f64, [f64; 6]) {
    let (mut area, mut sums) = (0.0, [0.0; 6]);
    for cell in cells {
        area += cell.area;
        sums.iter_mut().zip(cell.at).for_each(|(sum, x)| *sum += cell.area * x);
    }
    (area, sums.map(|sum| sum / area))
}

/// Puts the cells of one half before those of the other, each in their order, and returns where the second begins. `middle` is that of
/// the part.
fn halve(cells: &mut [Cell], middle: [DVec3; 2], reach: f64, scratch: &mut Vec<Cell>) -> usize {
    let [at, normal] = middle;
    let mean = [at.x, at.y, at.z, normal.x, normal.y, normal.z];
    let mut variances = [0.0; 6];
    for cell in &*cells {
        for ((variance, x), mean) in variances.iter_mut().zip(cell.at).zip(mean) {
            *variance += cell.area * (x - mean) * (x - mean);
        }
    }
    variances[..3].iter_mut().for_each(|variance| *variance /= reach * reach);
    let widest = (0..6).fold(0, |widest, k| if variances[k] > variances[widest] { k } else { widest });
    scratch.clear();
    let mut below = 0;
    for i in 0..cells.len() {
        let cell = cells[i];
        if cell.at[widest] < mean[widest] {
            cells[below] = cell;
            below += 1;
        } else {
            scratch.push(cell);
        }
    }
    cells[below..].copy_from_slice(scratch);
    if below == 0 || below == cells.len() { cells.len() / 2 } else { below }
}
