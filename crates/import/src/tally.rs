//! The tally of a reader: counts of what notes must say, and the cutting of polygons.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;

use crate::error::UnplacedError;
use crate::mesh::{LostProperty, Mesh, Triangle};
use crate::polygon;
use crate::room::room;

/// The most corners of a polygon. Cutting one takes up to a second, and more than four times as long for twice as many.
const MAX_CORNERS: usize = 1 << 14;

/// Counts by kind; each becomes one note at the end.
#[derive(Debug, Default)]
pub(crate) struct NoteCounts {
    counts: BTreeMap<&'static str, u64>,
    /// Materials that are used and have not been defined.
    pub(crate) undefined: BTreeSet<u32>,
}

impl NoteCounts {
    /// Counts one more of a kind, `what` in the plural, with what may be done about it behind a semicolon.
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
    ) -> Result<(), UnplacedError> {
        if let &[a, b, c] = corners {
            mesh.triangles.push(triangle([a, b, c]));
            return room(mesh);
        }
        if corners.len() > MAX_CORNERS {
            return Err(UnplacedError::new(
                format!("a face of {} corners", corners.len()),
                format!("to cut one of more than {MAX_CORNERS} into triangles takes time beyond measure"),
                "cut it into triangles before",
            ));
        }
        let points: Vec<DVec3> = corners.iter().map(|&corner| mesh.positions[corner as usize]).collect();
        let cut = polygon::cut(&points, holes);
        if cut.bent {
            self.count("polygons that are not flat, by more than 0.1 % of their size; export triangles to say how they are cut");
        }
        if cut.crossed {
            self.count("polygons whose outlines cross themselves, so that their triangles may overlap; export triangles to say how they are cut");
        }
        mesh.triangles.extend(cut.triangles.iter().map(|ear| triangle(ear.map(|i| corners[i]))));
        room(mesh)
    }

    /// Writes what was counted into the notes of the mesh.
    pub(crate) fn report(self, mesh: &mut Mesh) {
        for (what, count) in self.counts {
            let (what, remedy) = what.split_once("; ").unwrap_or((what, ""));
            let remedy = if remedy.is_empty() { String::new() } else { format!("; {remedy}") };
            mesh.notes.push(format!("{what}: {count}{remedy}"));
        }
        for number in self.undefined {
            mesh.materials[number as usize].loses(LostProperty::Definition);
        }
    }
}
