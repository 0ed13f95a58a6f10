//! Trees of the cells of meshes: each part is halved again and again, as far as is asked for, by where its cells lie and where they face.
//!
//! A cell is a point of six coordinates: its centre, over [`REACH`] times the diagonal of the box around its object, and its normal. A part
//! is cut across the coordinate of the largest variance over its area, at the mean. How a part is halved is a function of the cells alone.

use glam::DVec3;
use radiosity::{SceneSpec, Shape};

/// The part of an object's diagonal by which light changes about as much as by a turn of one radian.
const REACH: f64 = 1.0;

/// A cell of a mesh.
#[derive(Clone, Copy, Debug)]
struct MeshCell {
    number: u32,
    area: f64,
    /// Centre and normal.
    at: [f64; 6],
    /// Scores that are expected there.
    scores: f64,
}

/// A part of an object: some of its cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cluster {
    /// Its first cell in the order of the tree, and the one behind its last.
    pub cells: [u32; 2],
    /// The numbers of its halves, which are larger than its own; `None` where it is not halved.
    pub halves: Option<[u32; 2]>,
    /// The sum of the areas of its cells [m²].
    pub area: f64,
    /// The mean over its area of the centres of its cells [m], and of their normals.
    pub middle: [DVec3; 2],
    /// Scores that are expected on its cells.
    pub scores: f64,
    /// The distance that counts as much as a turn of one radian [m].
    reach: f64,
}

/// The trees of all objects.
#[derive(Clone, Debug, Default)]
pub struct Clusters {
    /// The cells in the order of the trees: those of a part lie next to each other.
    cells: Vec<MeshCell>,
    /// The parts, every one before its halves.
    pub parts: Vec<Cluster>,
    /// The parts that are whole objects.
    pub roots: Vec<u32>,
    /// Room for halving.
    scratch: Vec<MeshCell>,
}

impl Clusters {
    /// The trees of the cells of a scene whose surfaces are of kinds: cells of one kind make a tree. Surfaces without a kind have none.
    /// By cell of the scene, `scores` has the scores that are expected there. A part that `is_fine` is not halved.
    pub fn new(
        spec: &SceneSpec,
        kinds: &[Option<u32>],
        scores: &[f64],
        is_fine: impl Fn(&Cluster) -> bool,
    ) -> Self {
        let mut clusters = Clusters::default();
        for cells in by_kind(spec, kinds, scores) {
            let first = clusters.cells.len();
            let root = clusters.parts.len();
            clusters.roots.push(root as u32);
            clusters.parts.push(cluster(&cells, first, reach(&cells)));
            clusters.cells.extend(cells);
            let mut open = vec![root];
            while let Some(part) = open.pop() {
                if !is_fine(&clusters.parts[part]) {
                    open.extend(clusters.halve(part).into_iter().flatten().rev());
                }
            }
        }
        clusters
    }

    /// Halves a part, unless it is halved already. `None` of a single cell.
    pub fn halve(&mut self, number: usize) -> Option<[usize; 2]> {
        let part = self.parts[number];
        let [from, to] = part.cells.map(|cell| cell as usize);
        if let Some(halves) = part.halves {
            return Some(halves.map(|half| half as usize));
        }
        if to - from == 1 {
            return None;
        }
        let cells = &mut self.cells[from..to];
        let middle = halve(cells, part.middle, part.reach, &mut self.scratch);
        let (one, other) = cells.split_at(middle);
        let next = self.parts.len();
        let halves = [cluster(one, from, part.reach), cluster(other, from + one.len(), part.reach)];
        self.parts.extend(halves);
        self.parts[number].halves = Some([next as u32, next as u32 + 1]);
        Some([next, next + 1])
    }

    /// The numbers of the cells of a part.
    pub fn cells_of(&self, part: &Cluster) -> impl Iterator<Item = u32> {
        self.cells[part.cells[0] as usize..part.cells[1] as usize].iter().map(|cell| cell.number)
    }

    /// By cell of the scene, of which there are `count`, the number of the part it is in; 0 for cells that are in none of these parts.
    pub fn part_of_cell(&self, parts: impl IntoIterator<Item = u32>, count: usize) -> Vec<u32> {
        let mut part_of_cell = vec![0; count];
        for part in parts {
            self.cells_of(&self.parts[part as usize]).for_each(|cell| part_of_cell[cell as usize] = part);
        }
        part_of_cell
    }
}

/// The cells of every kind that has any.
fn by_kind(spec: &SceneSpec, kinds: &[Option<u32>], scores: &[f64]) -> Vec<Vec<MeshCell>> {
    let count = kinds.iter().flatten().max().map_or(0, |last| *last as usize + 1);
    let mut cells = vec![Vec::new(); count];
    let mut number = 0;
    for (surface, kind) in spec.surfaces.iter().zip(kinds) {
        let of_surface = surface.shape.cell_count() as u32;
        if let Some(kind) = kind {
            let (_, u, v) = surface.shape.edges();
            let normal = u.cross(v).normalize_or_zero();
            let cell = |cell: u32| {
                let of_number = number + cell;
                cell_of((&surface.shape, normal), cell, of_number, scores[of_number as usize])
            };
            cells[*kind as usize].extend((0..of_surface).map(cell));
        }
        number += of_surface;
    }
    cells.retain(|cells: &Vec<MeshCell>| !cells.is_empty());
    cells
}

/// The reach of an object of some cells [m].
fn reach(cells: &[MeshCell]) -> f64 {
    let place = |cell: &MeshCell| DVec3::from_slice(&cell.at);
    let low = cells.iter().fold(DVec3::INFINITY, |low, cell| low.min(place(cell)));
    let high = cells.iter().fold(DVec3::NEG_INFINITY, |high, cell| high.max(place(cell)));
    (REACH * (high - low).length()).max(f64::MIN_POSITIVE)
}

fn cell_of((shape, normal): (&Shape, DVec3), cell: u32, number: u32, scores: f64) -> MeshCell {
    let corners = shape.cell_corners(cell);
    let centre = corners.iter().sum::<DVec3>() / corners.len() as f64;
    let across = |a: DVec3, b: DVec3| (a - corners[0]).cross(b - corners[0]).length();
    let area = 0.5 * corners[1..].windows(2).map(|pair| across(pair[0], pair[1])).sum::<f64>();
    MeshCell { number, area, at: [centre.x, centre.y, centre.z, normal.x, normal.y, normal.z], scores }
}

fn cluster(cells: &[MeshCell], first: usize, reach: f64) -> Cluster {
    let (area, mean) = mean(cells);
    Cluster {
        cells: [first as u32, (first + cells.len()) as u32],
        halves: None,
        area,
        middle: [DVec3::from_slice(&mean[..3]), DVec3::from_slice(&mean[3..])],
        scores: cells.iter().map(|cell| cell.scores).sum(),
        reach,
    }
}

/// The area of cells, and the mean of their coordinates over it.
fn mean(cells: &[MeshCell]) -> (f64, [f64; 6]) {
    let (mut area, mut sums) = (0.0, [0.0; 6]);
    for cell in cells {
        area += cell.area;
        sums.iter_mut().zip(cell.at).for_each(|(sum, x)| *sum += cell.area * x);
    }
    (area, sums.map(|sum| sum / area))
}

/// Puts the cells of one half before those of the other, each in their order, and returns where the second begins. `middle` is that of
/// the part.
fn halve(cells: &mut [MeshCell], middle: [DVec3; 2], reach: f64, scratch: &mut Vec<MeshCell>) -> usize {
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
