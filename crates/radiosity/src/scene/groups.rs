//! Whether the groups of cells that a scene is written with can be patches.

use super::SceneError;
use crate::geometry::piece::{Face, Pieces};
use crate::geometry::spec::SceneSpec;

/// Checks that every cell has a patch, that patches are numbered in the order of their first cells, and that the cells of a patch
/// are alike in all but place and area: a patch has one emittance, one reflectance, and one number of sides.
pub(super) fn check_groups(spec: &SceneSpec) -> Result<(), SceneError> {
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
    let pieces = Pieces::new(spec);
    let mut firsts: Vec<Face> = Vec::new();
    for (cell, &patch) in (0..).zip(patch_of_cell) {
        let own = pieces.get(cell);
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
                surface: own.surface as usize,
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

/// What two cells of one patch differ in; `None` where they are alike.
fn difference(spec: &SceneSpec, a: &Face, b: &Face) -> Option<&'static str> {
    let sides = |face: &Face| spec.surfaces[face.surface as usize].sides;
    let differences = [
        (a.reflectance != b.reflectance, "reflectance"),
        (a.emittance != b.emittance, "emittance"),
        (sides(a) != sides(b), "number of sides"),
    ];
    differences.into_iter().find(|(differs, _)| *differs).map(|(_, what)| what)
}
