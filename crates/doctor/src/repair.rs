//! Repairs that need no question.

use std::collections::BTreeSet;

use radiosity::{IndexChoice, Scene, SceneError, SceneSpec, Shape, SurfaceSpec};

use crate::pilot::LightPilot;
use crate::sheets::OrientedSheets;
use crate::votes::Votes;

/// The most rounds of turning: a surface that is turned round changes what others see.
const ROUNDS: usize = 8;

/// A repaired scene and what was done to it.
#[derive(Clone, Debug, PartialEq)]
pub struct Repair {
    /// The scene with its changes.
    pub spec: SceneSpec,
    /// The names of surfaces that were turned round.
    pub turned: Vec<String>,
    /// The names of surfaces that were taken out: they were there twice.
    pub removed: Vec<String>,
    /// The numbers that those surfaces had before: turned round, taken out.
    pub numbers: [Vec<u32>; 2],
}

/// Takes out surfaces that are there twice, and turns round one-sided surfaces whose back is where light arrives.
///
/// # Errors
/// What [`Scene::build`] refuses.
pub fn repair(spec: &SceneSpec) -> Result<Repair, SceneError> {
    // Surfaces that are taken out leave groups of cells without their numbers; a repaired scene is written without them.
    let mut spec = SceneSpec { patch_of_cell: Vec::new(), ..spec.clone() };
    let removed = doubles(&spec.surfaces);
    let names_of_removed = names(&spec, &removed);
    let kept: Vec<u32> =
        (0..spec.surfaces.len() as u32).filter(|number| removed.binary_search(number).is_err()).collect();
    spec.surfaces = kept.iter().map(|&number| spec.surfaces[number as usize].clone()).collect();
    let turned = turn_numbers(&mut spec)?;
    let names_of_turned = names(&spec, &turned);
    let numbers = [turned.iter().map(|&number| kept[number as usize]).collect(), removed];
    Ok(Repair { spec, turned: names_of_turned, removed: names_of_removed, numbers })
}

/// Turns round one-sided surfaces whose back is where light arrives, and with them those that are connected to them and
/// that rays cannot judge. Returns their names.
///
/// # Errors
/// What [`Scene::build`] refuses.
pub fn turn_flipped(spec: &mut SceneSpec) -> Result<Vec<String>, SceneError> {
    let turned = turn_numbers(spec)?;
    Ok(names(spec, &turned))
}

/// [`turn_flipped`], whose surfaces are told by their numbers.
fn turn_numbers(spec: &mut SceneSpec) -> Result<BTreeSet<u32>, SceneError> {
    let mut turned = BTreeSet::new();
    for _ in 0..ROUNDS {
        let scene = Scene::build(spec, IndexChoice::Auto)?;
        let pilot = LightPilot::follow(&scene);
        let votes = Votes::take(&scene, &pilot);
        let flipped = votes.flipped(&pilot);
        let wrong = OrientedSheets::of(spec).turned(&flipped, |surface| votes.is_right(surface));
        if wrong.is_empty() {
            break;
        }
        for surface in wrong {
            turn(&mut spec.surfaces[surface as usize]);
            // A surface that is turned twice is as it was.
            if !turned.remove(&surface) {
                turned.insert(surface);
            }
        }
    }
    Ok(turned)
}

/// The names of surfaces, by number; the number where a surface has none.
fn names<'a>(spec: &SceneSpec, numbers: impl IntoIterator<Item = &'a u32>) -> Vec<String> {
    let name = |&number: &u32| {
        let name = spec.surfaces[number as usize].name.as_deref();
        name.map_or_else(|| number.to_string(), str::to_owned)
    };
    numbers.into_iter().map(name).collect()
}

/// The numbers of surfaces that are equal to an earlier one in all but their name.
fn doubles(surfaces: &[SurfaceSpec]) -> Vec<u32> {
    let key = |surface: &SurfaceSpec| {
        let corners = surface.shape.corners();
        let mut corners: Vec<[u64; 3]> =
            corners.iter().map(|corner| corner.to_array().map(|x| (x + 0.0).to_bits())).collect();
        corners.sort_unstable();
        corners
    };
    let mut order: Vec<(Vec<[u64; 3]>, usize)> = surfaces.iter().map(key).zip(0..).collect();
    order.sort_unstable();
    let mut doubles = Vec::new();
    for coincident in order.chunk_by(|a, b| a.0 == b.0) {
        let mut kept: Vec<&SurfaceSpec> = Vec::new();
        for &(_, number) in coincident {
            let surface = &surfaces[number];
            match kept.iter().any(|earlier| is_double(earlier, surface)) {
                true => doubles.push(number as u32),
                false => kept.push(surface),
            }
        }
    }
    doubles.sort_unstable();
    doubles
}

/// Whether two surfaces with the same corners are equal in all but their name. Corners may be listed from another one on,
/// unless cells have emittances of their own, which the numbering of cells places.
fn is_double(a: &SurfaceSpec, b: &SurfaceSpec) -> bool {
    let normal = |surface: &SurfaceSpec| {
        let (_, e_u, e_v) = surface.shape.edges();
        e_u.cross(e_v)
    };
    let finish = |surface: &SurfaceSpec| {
        (surface.sides, surface.reflectance, surface.emittance, surface.transmittance)
    };
    let plain = a.cell_emittance.is_empty() && a.shape.cell_count() == b.shape.cell_count();
    finish(a) == finish(b)
        && a.cell_emittance == b.cell_emittance
        && (plain || a.shape == b.shape)
        && normal(a).dot(normal(b)) > 0.0
}

/// Exchanges front and back; cells keep their places.
fn turn(surface: &mut SurfaceSpec) {
    let before = surface.shape.clone();
    surface.shape = match before.clone() {
        Shape::Parallelogram { corner, corner_u, corner_v, cells: [nu, nv] } => {
            Shape::Parallelogram { corner, corner_u: corner_v, corner_v: corner_u, cells: [nv, nu] }
        }
        Shape::Triangle { a, b, c, rows } => Shape::Triangle { a, b: c, c: b, rows },
        Shape::Divided { corner, corner_u, corner_v, leaves } => {
            Shape::Divided { corner, corner_u: corner_v, corner_v: corner_u, leaves: leaves.transposed() }
        }
    };
    for (cell, _) in &mut surface.cell_emittance {
        let [i, j] = before.cell_label(*cell);
        let label = match before {
            Shape::Triangle { .. } => [i, 2 * i - j],
            Shape::Parallelogram { .. } => [j, i],
            Shape::Divided { .. } => [i, j],
        };
        *cell = surface.shape.cell_index(label).expect("the mirrored cell");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use radiosity::{Sides, Spectrum};

    #[test]
    fn cells_keep_their_places() {
        let shape = Shape::Triangle { a: DVec3::ZERO, b: DVec3::X, c: DVec3::Y, rows: 3 };
        let mut surface = SurfaceSpec {
            name: None,
            shape: shape.clone(),
            sides: Sides::Front,
            reflectance: 0.5.into(),
            emittance: Spectrum::BLACK,
            cell_emittance: vec![(shape.cell_index([2, 1]).unwrap(), 1.0.into())],
            transmittance: Default::default(),
        };
        let lit = surface.clone();
        turn(&mut surface);
        assert_eq!(surface.shape.cell_label(surface.cell_emittance[0].0), [2, 3]);
        turn(&mut surface);
        assert_eq!(surface, lit);
    }
}
