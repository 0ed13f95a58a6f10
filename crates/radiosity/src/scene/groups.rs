//! Whether the groups of cells that a scene is written with can be patches.

use super::SceneError;
use crate::geometry::piece::Pieces;
use crate::geometry::spec::{SceneSpec, Spectrum};

/// Checks that every cell has a patch, that patches are numbered in the order of their first cells, and that the cells of a patch
/// are alike in all but place and area: a patch has one emittance, one reflectance, and one number of sides.
pub(super) fn check_groups(spec: &SceneSpec, pieces: &Pieces) -> Result<(), SceneError> {
    let patch_of_cell = &spec.patch_of_cell;
    if patch_of_cell.is_empty() {
        return Ok(());
    }
    if patch_of_cell.len() as u64 != spec.cell_count() {
        return Err(SceneError::Whole(format!(
            "groups are given for {} cells, and the scene has {} (each cell belongs to one patch); give one for each",
            patch_of_cell.len(),
            spec.cell_count()
        )));
    }
    let mut firsts: Vec<CellProperties> = Vec::new();
    for ((cell, &patch), surface) in (0..).zip(patch_of_cell).zip(pieces.surfaces_of_cells()) {
        let own =
            CellProperties { surface: surface as usize, emittance: pieces.emittance(cell, surface as usize) };
        if patch as usize == firsts.len() {
            firsts.push(own);
        }
        let Some(first) = firsts.get(patch as usize) else {
            return Err(SceneError::Whole(format!(
                "cell {cell} belongs to patch {patch}, and the cells before it to patches below {} (patches are numbered in the order of their first cells); number them so",
                firsts.len()
            )));
        };
        if let Some(what) = difference(spec, first, &own) {
            return Err(SceneError::Surface {
                surface: own.surface,
                key: "patches",
                problem: format!(
                    "it belongs to a patch that begins on surface {}, which has another {what} (a patch has one); take it out of the group",
                    first.surface
                ),
            });
        }
    }
    Ok(())
}

/// What a cell looks like: its surface, and what it emits.
#[derive(Clone, Copy)]
struct CellProperties {
    surface: usize,
    emittance: Spectrum,
}

/// What two cells of one patch differ in; `None` where they are alike.
fn difference(spec: &SceneSpec, a: &CellProperties, b: &CellProperties) -> Option<&'static str> {
    let [of_a, of_b] = [a, b].map(|look| &spec.surfaces[look.surface]);
    let differences = [
        (of_a.reflectance != of_b.reflectance, "reflectance"),
        (a.emittance != b.emittance, "emittance"),
        (of_a.sides != of_b.sides, "number of sides"),
    ];
    differences.into_iter().find(|(differs, _)| *differs).map(|(_, what)| what)
}
