//! The tally of a reader: counts of what notes must say, and the cutting of polygons.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;

use crate::error::Fault;
use crate::mesh::{Lost, Mesh, Triangle};
use crate::polygon;
use crate::room::room;

/// The most corners of a polygon. Cutting one takes up to a second, and more than four times as long for twice as many.
const MAX_CORNERS: usize = 1 << 14;

/// Counts by kind; each becomes one note at the end.
#[derive(Debug, Default)]
pub(crate) struct Tally {
    counts: BTreeMap<&'static str, u64>,
    /// Materials that are used and have not been defined.
    pub(crate) undefined: BTreeSet<u32>,
}

impl Tally {
    pub(crate) fn count(&mut self, what: &'static str) {
        *self.counts.entry(what).or_default() += 1;
    }

    /// Adds the triangles of a polygon; `holes` as in [`polygon::cut`].
    ///
    /// # Errors
    /// If there are more corners than a polygon, or more triangles than a mesh may have.
    pub(crate) fn polygon(
        &mut self,
        mesh: &mut Mesh,
        corners: &[u32],
        holes: &[usize],
        triangle: impl Fn([u32; 3]) -> Triangle,
    ) -> Result<(), Fault> {
        if let &[a, b, c] = corners {
            mesh.triangles.push(triangle([a, b, c]));
            return room(mesh);
        }
        if corners.len() > MAX_CORNERS {
            return Err(Fault::new(
                format!("a face of {} corners", corners.len()),
                format!("to cut one of more than {MAX_CORNERS} into triangles takes time beyond measure"),
                "cut it into triangles before",
            ));
        }
        let points: Vec<DVec3> = corners.iter().map(|&corner| mesh.positions[corner as usize]).collect();
        let cut = polygon::cut(&points, holes);
        if cut.bent {
            self.count("polygons are not flat (corners off their plane by more than 0.1 % of their size)");
        }
        if cut.crossed {
            self.count("polygons have outlines that cross themselves: their triangles may overlap");
        }
        mesh.triangles.extend(cut.triangles.iter().map(|ear| triangle(ear.map(|i| corners[i]))));
        room(mesh)
    }

    /// Writes what was counted into the notes of the mesh.
    pub(crate) fn report(self, mesh: &mut Mesh) {
        for (what, count) in self.counts {
            mesh.notes.push(format!("{count} {what}"));
        }
        for number in self.undefined {
            mesh.materials[number as usize].loses(Lost::Definition);
        }
    }
}
