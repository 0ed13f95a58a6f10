//! Groups of neighbouring cells: what meshes of many small faces are modelled by.
//!
//! Each kind of cells (one object in one material) is laid in boxes of equal size, at most [`GroupLimits::size`] along every axis. A
//! group begins with the first cell that has none, and takes the neighbours of its cells that are of its kind, have their centre in
//! its box, and face the same way as its first cell within [`GroupLimits::angle`]. Neighbours share an edge, along which they run in
//! opposite directions, so that their fronts are on one side. The groups are a function of the cells and their order.

use std::collections::{HashMap, VecDeque};

use glam::{DVec3, I64Vec3};
use radiosity::{SceneSpec, surfaces::Corners};

/// How far a group reaches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroupLimits {
    /// The longest edge of the boxes that hold the centres of a group's cells [m].
    pub size: f64,
    /// The largest angle between the normals of a group's first cell and any other [degrees].
    pub angle: f64,
}

/// The default of [`GroupLimits::angle`] [degrees].
pub const GROUP_ANGLE: f64 = 20.0;

/// Corners nearer to each other than this part of the scene's size are one.
const SAME_PLACE: f64 = 1e-9;

/// The group number of a cell that no group has taken yet.
const NONE: u32 = u32::MAX;

/// A cell that may be grouped.
struct GroupableCell {
    kind: u32,
    centre: DVec3,
    normal: DVec3,
    corners: Corners,
}

/// An edge, and whether a cell runs along it from the lesser of its ends.
type Edge = ([I64Vec3; 2], bool);

/// A label for each cell of a scene, in the order of surfaces and their cells; cells of equal labels make a group. Cells of surfaces of
/// equal `kind` may be grouped; those of surfaces without one stay alone, and those that emit cell by cell.
pub fn groups(spec: &SceneSpec, kind: impl Fn(usize) -> Option<u32>, grouping: &GroupLimits) -> Vec<u32> {
    let cells = cells(spec, kind);
    let boxes = boxes(&cells, grouping.size);
    let neighbours = neighbours(&cells);
    let least = grouping.angle.to_radians().cos();
    let mut labels = vec![NONE; cells.len()];
    let mut queue = VecDeque::new();
    for first in 0..cells.len() {
        if labels[first] != NONE {
            continue;
        }
        let label = first as u32;
        labels[first] = label;
        let Some(seed) = &cells[first] else { continue };
        queue.push_back(first);
        while let Some(cell) = queue.pop_front() {
            for &next in &neighbours[cell] {
                let joins =
                    |cell: &GroupableCell| cell.kind == seed.kind && cell.normal.dot(seed.normal) >= least;
                let fits = boxes[next as usize] == boxes[first];
                if labels[next as usize] == NONE && fits && cells[next as usize].as_ref().is_some_and(joins) {
                    labels[next as usize] = label;
                    queue.push_back(next as usize);
                }
            }
        }
    }
    labels
}

/// The cells of all surfaces; `None` for those that stay alone.
fn cells(spec: &SceneSpec, kind: impl Fn(usize) -> Option<u32>) -> Vec<Option<GroupableCell>> {
    let of_surface = |(number, surface): (usize, &radiosity::SurfaceSpec)| {
        let kind = kind(number).filter(|_| surface.cell_emittance.is_empty());
        let shape = surface.shape.clone();
        let (_, u, v) = shape.edges();
        let normal = u.cross(v).normalize_or_zero();
        (0..shape.cell_count() as u32).map(move |cell| {
            let kind = kind?;
            let corners = shape.cell_corners(cell);
            let centre = corners.iter().sum::<DVec3>() / corners.len() as f64;
            Some(GroupableCell { kind, centre, normal, corners })
        })
    };
    spec.surfaces.iter().enumerate().flat_map(of_surface).collect()
}

/// The box of every cell: its place among those that its kind is laid in.
fn boxes(cells: &[Option<GroupableCell>], size: f64) -> Vec<I64Vec3> {
    let mut bounds: HashMap<u32, [DVec3; 2]> = HashMap::new();
    for cell in cells.iter().flatten() {
        let [low, high] = bounds.entry(cell.kind).or_insert([DVec3::INFINITY, DVec3::NEG_INFINITY]);
        for &corner in &cell.corners {
            (*low, *high) = (low.min(corner), high.max(corner));
        }
    }
    let place = |cell: &GroupableCell| {
        let [low, high] = bounds[&cell.kind];
        let extent = high - low;
        let count = (extent / size).ceil().max(DVec3::ONE);
        let step = extent / count;
        let place = (cell.centre - low) / DVec3::select(step.cmpgt(DVec3::ZERO), step, DVec3::ONE);
        place.floor().clamp(DVec3::ZERO, count - DVec3::ONE).as_i64vec3()
    };
    cells.iter().map(|cell| cell.as_ref().map_or(I64Vec3::ZERO, place)).collect()
}

/// The cells that share an edge with each cell, in ascending order.
fn neighbours(cells: &[Option<GroupableCell>]) -> Vec<Vec<u32>> {
    let corners = || cells.iter().flatten().flat_map(|cell| &cell.corners);
    let low = corners().fold(DVec3::INFINITY, |low, corner| low.min(*corner));
    let high = corners().fold(DVec3::NEG_INFINITY, |high, corner| high.max(*corner));
    let grid = 1.0 / (SAME_PLACE * (high - low).max_element()).max(f64::MIN_POSITIVE);
    let mut along: HashMap<[I64Vec3; 2], Vec<(u32, bool)>> = HashMap::new();
    for (number, cell) in (0..).zip(cells) {
        for (ends, upwards) in cell.iter().flat_map(|cell| edges(cell, low, grid)) {
            along.entry(ends).or_default().push((number, upwards));
        }
    }
    let mut neighbours = vec![Vec::new(); cells.len()];
    for sharing in along.values() {
        for &(cell, upwards) in sharing {
            let others = sharing.iter().filter(|(_, other)| *other != upwards).map(|(other, _)| *other);
            neighbours[cell as usize].extend(others);
        }
    }
    neighbours.iter_mut().for_each(|of_cell: &mut Vec<u32>| of_cell.sort_unstable());
    neighbours
}

/// The edges of a cell, its corners being taken to a grid.
fn edges(cell: &GroupableCell, low: DVec3, grid: f64) -> impl Iterator<Item = Edge> {
    let place = |corner: &DVec3| ((corner - low) * grid).round().as_i64vec3();
    let corners: Vec<I64Vec3> = cell.corners.iter().map(place).collect();
    let count = corners.len();
    (0..count).map(move |i| (corners[i], corners[(i + 1) % count])).map(|(from, to)| {
        let upwards = from.to_array() < to.to_array();
        (if upwards { [from, to] } else { [to, from] }, upwards)
    })
}
