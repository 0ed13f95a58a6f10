//! Cells of VTK as triangles, and the facets that they belong to.

use std::path::Path;

use glam::DVec3;

use crate::error::UnplacedError;
use crate::mesh::{Material, Mesh, Triangle};
use crate::room::{TriangleBudget, room};
use crate::tally::NoteCounts;

/// Names of cell arrays of facet ids, in lower case, letters and digits alone, without an `s` at the end. Earlier ones are taken first.
const FACETS: [&str; 13] = [
    "facet",
    "facetid",
    "face",
    "faceid",
    "surface",
    "surfaceid",
    "region",
    "regionid",
    "patchid",
    "cellentityid",
    "gmshphysical",
    "globalid",
    "id",
];

/// The place of a cell array's name among [`FACETS`]; `None` for an array of something else.
pub(super) fn facet_rank(name: &str) -> Option<usize> {
    let plain: String =
        name.chars().filter(char::is_ascii_alphanumeric).collect::<String>().to_ascii_lowercase();
    let plain = plain.strip_suffix('s').unwrap_or(&plain);
    FACETS.iter().position(|known| *known == plain)
}

/// The longest array that a file of this number of bytes may hold, in numbers: nine for each triangle that it may make.
pub(super) fn most_numbers(bytes: usize) -> u64 {
    9 * TriangleBudget::of(bytes).most()
}

/// The mesh that cells are added to.
pub(super) struct CellMesh {
    mesh: Mesh,
    tally: NoteCounts,
    /// The number of cells so far, also of those that are left out.
    cells: u32,
    /// The corners of the current cell.
    corners: Vec<u32>,
}

impl CellMesh {
    pub(super) fn new(path: &Path) -> Self {
        let mesh = Mesh { parts: vec![crate::stem(path)], ..Mesh::default() };
        CellMesh { mesh, tally: NoteCounts::default(), cells: 0, corners: Vec::new() }
    }

    /// The number of points so far.
    pub(super) fn points(&self) -> usize {
        self.mesh.positions.len()
    }

    /// Adds points, three numbers each.
    pub(super) fn add_points(&mut self, numbers: &[f64]) -> Result<(), UnplacedError> {
        if numbers.iter().any(|x| !x.is_finite()) {
            return Err(UnplacedError::new(
                "a coordinate is not a finite number",
                "nothing can be computed from it",
                "export the file again",
            ));
        }
        self.mesh.positions.extend(numbers.chunks_exact(3).map(DVec3::from_slice));
        room(&self.mesh)
    }

    /// Adds a cell of a type of VTK. Its points are numbered from the point `first`.
    pub(super) fn cell(&mut self, kind: u64, points: &[f64], first: usize) -> Result<(), UnplacedError> {
        let mut corners = std::mem::take(&mut self.corners);
        corners.clear();
        for &point in points {
            corners.push(self.corner(point, first)?);
        }
        let cell = self.cells;
        self.cells += 1;
        match (kind, corners.as_slice()) {
            (5 | 7 | 9, corners) if corners.len() >= 3 => self.polygon(corners, cell)?,
            // A pixel counts its rows.
            (8, &[a, b, c, d]) => self.polygon(&[a, b, d, c], cell)?,
            // Every other triangle of a strip runs the other way round.
            (6, corners) => {
                for (place, corners) in corners.windows(3).enumerate() {
                    let [a, b, c] = [corners[0], corners[1], corners[2]];
                    self.polygon(&if place % 2 == 0 { [a, b, c] } else { [b, a, c] }, cell)?;
                }
            }
            (0..=4, _) => self.tally.count("cells that are points or lines, left out"),
            (5..=9, _) => self.tally.count("cells with other numbers of points than their types have, left out"),
            _ => self.tally.count(
                "cells that are solid or curved, left out; extract the surface before, flat: vtkDataSetSurfaceFilter",
            ),
        }
        self.corners = corners;
        Ok(())
    }

    fn corner(&self, point: f64, first: usize) -> Result<u32, UnplacedError> {
        let known = self.points() - first;
        let fits = point.fract() == 0.0 && (0.0..known as f64).contains(&point);
        fits.then_some((first as f64 + point) as u32).ok_or_else(|| {
            UnplacedError::new(
                format!("there is no point {point}"),
                format!("there are {known}, counted from 0"),
                "export the file again",
            )
        })
    }

    fn polygon(&mut self, corners: &[u32], cell: u32) -> Result<(), UnplacedError> {
        let triangle = |corners| Triangle { corners, part: 0, face: cell, material: 0, line: 0 };
        self.tally.polygon(&mut self.mesh, corners, &[], triangle)
    }

    /// The mesh; `facets` holds an id for each cell, and is empty where the file has none.
    pub(super) fn finish(self, facets: &[f64], name: &str) -> Result<Mesh, UnplacedError> {
        let CellMesh { mut mesh, tally, cells, .. } = self;
        if !facets.is_empty() {
            if facets.len() != cells as usize {
                return Err(UnplacedError::new(
                    format!("the cell array {name:?} has {} numbers", facets.len()),
                    format!("there are {cells} cells"),
                    "export the file again",
                ));
            }
            for triangle in &mut mesh.triangles {
                triangle.face = id(facets[triangle.face as usize], name)?;
            }
            mesh.triangles.sort_by_key(|triangle| triangle.face);
            mesh.notes.push(format!(
                "cells of one number in the array {name:?} are one face, which has the number"
            ));
        }
        tally.report(&mut mesh);
        mesh.materials.push(Material::undefined("default"));
        Ok(mesh)
    }
}

fn id(facet: f64, name: &str) -> Result<u32, UnplacedError> {
    let fits = facet.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&facet);
    fits.then_some(facet as u32).ok_or_else(|| {
        UnplacedError::new(
            format!("the cell array {name:?} has the id {facet}"),
            "facets are numbered from 0 to 4294967295",
            "number them so, or leave the array out",
        )
    })
}

/// Adds the cells of offsets into a list of points: `kind` tells the type of each.
pub(super) fn add_cells(
    mesh: &mut CellMesh,
    (connectivity, ends): (&[f64], &[f64]),
    first: usize,
    kind: impl Fn(usize) -> Option<u64>,
) -> Result<(), UnplacedError> {
    let mut start = 0;
    for (cell, &end) in ends.iter().enumerate() {
        let whole = end.fract() == 0.0 && end >= start as f64 && end <= connectivity.len() as f64;
        let (Some(kind), true) = (kind(cell), whole) else {
            return Err(UnplacedError::new(
                format!("cell {cell} ends at {end}, or has no type"),
                format!("it begins at {start}, of {} points of cells", connectivity.len()),
                "export the file again",
            ));
        };
        mesh.cell(kind, &connectivity[start..end as usize], first)?;
        start = end as usize;
    }
    Ok(())
}
