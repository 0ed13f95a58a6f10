//! Whether the surfaces of a scene can be walked in.

use super::SceneError;
use crate::geometry::spec::{SceneSpec, Shape, Sides, Spectrum, SurfaceSpec};

/// The most patches a scene may have: patch numbers are 32 bits wide.
const MAX_PATCHES: u64 = 1 << 31;

/// The most cells of the grids that hold the leaves of all surfaces: a table has the leaf of each.
const MAX_GRID_CELLS: u64 = 1 << 24;

/// Whether every surface is valid, and there are neither none nor too many.
pub(super) fn check(spec: &SceneSpec) -> Result<(), SceneError> {
    if spec.surfaces.is_empty() {
        return Err(SceneError::Whole(
            "the scene has no surface (nothing could be hit); add a [[surface]] or a [[mesh]]".into(),
        ));
    }
    for (number, surface) in spec.surfaces.iter().enumerate() {
        check_surface(surface).map_err(|(key, problem)| SceneError::Surface {
            surface: number,
            key,
            problem,
        })?;
    }
    let face_count: f64 = spec.surfaces.iter().map(|s| s.shape.cell_count() as f64 * s.sides.count()).sum();
    if face_count > MAX_PATCHES as f64 {
        return Err(SceneError::Whole(format!(
            "the scene has {face_count} patches (two-sided ones count twice), more than {MAX_PATCHES} (their numbers are 32 bits wide); use coarser `patches`"
        )));
    }
    let grid_cells = spec.surfaces.iter().map(|surface| match &surface.shape {
        Shape::Divided { leaves, .. } => leaves.grid().map(u64::from).iter().product::<u64>(),
        _ => 0,
    });
    let grid_cells: u64 = grid_cells.sum();
    if grid_cells > MAX_GRID_CELLS {
        return Err(SceneError::Whole(format!(
            "the rectangles that surfaces are cut into lie on grids of {grid_cells} cells, more than {MAX_GRID_CELLS} (walks look them up in a table); cut them less often"
        )));
    }
    Ok(())
}

type SceneFault = (&'static str, String);

/// The edges that surfaces may have [m], whose corners lie within the longest. Squares of areas, and of areas by areas, are numbers then and not 0.
const EDGES: [f64; 2] = [1e-36, 1e36];

/// What surfaces may emit, if they do [W/m²]: the squares of all that light comes to are numbers then and not 0.
const EMITTANCES: [f64; 2] = [1e-60, 1e60];

/// The least reflectance of what reflects at all.
const LEAST_REFLECTANCE: f64 = 1e-30;

fn check_surface(surface: &SurfaceSpec) -> Result<(), SceneFault> {
    let outline = match surface.shape {
        Shape::Parallelogram { .. } | Shape::Divided { .. } => "quad",
        Shape::Triangle { .. } => "triangle",
    };
    let corners = surface.shape.corners();
    if !corners.iter().all(|corner| corner.is_finite()) {
        return Err((outline, "a corner is not a finite number; write finite coordinates in metres".into()));
    }
    let (_, e_u, e_v) = surface.shape.edges();
    let (area, extent) = (e_u.cross(e_v).length(), e_u.length() * e_v.length());
    let largest = corners.iter().fold(0.0_f64, |max, corner| max.max(corner.abs().max_element()));
    // Below this the direction of the normal is rounding noise.
    let noise = 8.0 * f64::EPSILON * largest * e_u.length().max(e_v.length());
    let [least, most] = EDGES;
    if largest <= most && !(area > noise && area > 1e-12 * extent) {
        return Err((
            outline,
            format!(
                "the surface has no area ({area:e} m²; its corners coincide or lie on a line); remove it or move a corner"
            ),
        ));
    }
    if e_u.length().min(e_v.length()) < least || largest > most {
        return Err((
            outline,
            format!(
                "an edge is shorter than {least:e} m, or a corner farther away than {most:e} m (squares of areas have to be numbers); scale the scene"
            ),
        ));
    }
    if surface.shape.cell_count() == 0 {
        return Err((
            "patches",
            "a surface must have at least one patch; write 1 or more along each side".into(),
        ));
    }
    if surface.shape.cell_count() > MAX_PATCHES {
        return Err(("patches", format!("more than {MAX_PATCHES} patches on one surface; use fewer")));
    }
    check_reflectance(surface.reflectance).map_err(|problem| ("reflectance", problem))?;
    check_transmittance(surface)?;
    check_emittance(surface.emittance).map_err(|problem| ("emittance", problem))?;
    for &(cell, emittance) in &surface.cell_emittance {
        if u64::from(cell) >= surface.shape.cell_count() {
            return Err(("emit", format!("cell {cell} does not exist on this surface")));
        }
        check_emittance(emittance).map_err(|problem| ("emit", problem))?;
    }
    Ok(())
}

fn check_reflectance(reflectance: Spectrum) -> Result<(), String> {
    let outside = reflectance.channels().into_iter().find(|channel| !(0.0..1.0).contains(channel));
    outside.map_or(Ok(()), |outside| {
        Err(format!(
            "{outside} is outside [0, 1) (walks would never end, or power be negative); choose 0 ≤ reflectance < 1"
        ))
    })?;
    let tiny = reflectance.channels().into_iter().find(|&rho| rho > 0.0 && rho < LEAST_REFLECTANCE);
    tiny.map_or(Ok(()), |tiny| {
        Err(format!(
            "{tiny:e} is below {LEAST_REFLECTANCE:e} (scores are divided by it, and their squares have to be numbers); choose 0"
        ))
    })
}

fn check_transmittance(surface: &SurfaceSpec) -> Result<(), SceneFault> {
    let outside = surface.transmittance.channels().into_iter().find(|channel| !(0.0..1.0).contains(channel));
    if let Some(outside) = outside {
        return Err((
            "transmittance",
            format!("{outside} is outside [0, 1) (it is a part of the light); choose 0 ≤ transmittance < 1"),
        ));
    }
    if let Some(sum) = surface.passed_on().channels().into_iter().find(|&sum| sum >= 1.0) {
        return Err((
            "transmittance",
            format!(
                "reflectance and transmittance add up to {sum} (more light would go on than comes in, or walks never end); choose them below 1 together"
            ),
        ));
    }
    match surface.transmittance.is_lit() && surface.sides == Sides::Front {
        true => Err((
            "transmittance",
            "a surface with one active side passes light on to the other (which is not active, and absorbs all); write sides = 2 for the surface".into(),
        )),
        false => Ok(()),
    }
}

fn check_emittance(emittance: Spectrum) -> Result<(), String> {
    let outside = emittance.channels().into_iter().find(|channel| !(channel.is_finite() && *channel >= 0.0));
    if let Some(outside) = outside {
        return Err(format!(
            "{outside} is not a finite number ≥ 0 (surfaces cannot emit negative power); give W/m² ≥ 0"
        ));
    }
    let [least, most] = EMITTANCES;
    let extreme = emittance.channels().into_iter().find(|&e| e > 0.0 && !(least..=most).contains(&e));
    extreme.map_or(Ok(()), |extreme| {
        Err(format!(
            "{extreme:e} W/m² is beyond {least:e} … {most:e} (squares of light have to be numbers); give another unit of light"
        ))
    })
}
