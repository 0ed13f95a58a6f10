//! The walks of S97's tables, their predicted variances, and scenes that are refined.

use exact::Exact;
use radiosity::{
    Birth, Direction, Estimator, EstimatorKind, Experiment, Method, Scene, SceneSpec, Shape, Walks,
    methods::birth_probabilities,
};

use crate::walking;

/// Discrete walks of one direction and estimator; infinite ones end by roulette at 0.001.
pub(crate) fn method(direction: Direction, estimator: impl Into<Estimator>) -> Walks {
    Walks { direction, ..Walks::shooting(estimator.into()) }
}

/// An experiment of a method that was chosen for the scene.
pub(crate) fn experiment(spec: &SceneSpec, method: impl Into<Method>) -> Experiment {
    walking::experiment(spec, method).expect("the method was chosen for the scene")
}

/// The two directions of walks, with births by area.
pub(crate) const DIRECTIONS: [Direction; 2] = [Direction::Shooting, Direction::Gathering(Birth::Area)];

/// The name of an estimator in a direction.
pub(crate) fn name(direction: &Direction, estimator: EstimatorKind) -> String {
    let direction = if *direction == Direction::Shooting { "shooting" } else { "gathering" };
    format!("{direction}, {}", estimator.word())
}

/// The closed-form variance of B for one discrete walk [W²/m⁴] of every patch.
pub(crate) fn predicted(exact: &Exact, scene: &Scene, method: &Walks) -> Vec<f64> {
    let estimator = method.score.estimator().kind();
    match &method.direction {
        Direction::Shooting => exact.shooting_variances(estimator),
        Direction::Gathering(birth) => {
            let variances = exact.gathering_variances(estimator, &birth_probabilities(scene, birth));
            variances.into_iter().map(|variance| variance.expect("walks are born everywhere")).collect()
        }
    }
}

/// The scene with every cell cut in k × k, each emitting as the cell did.
pub(crate) fn refined(spec: &SceneSpec, k: u32) -> SceneSpec {
    let mut fine = spec.clone();
    for surface in &mut fine.surfaces {
        let Shape::Parallelogram { cells: [nu, nv], .. } = &mut surface.shape else {
            unreachable!("boxes are made of parallelograms");
        };
        let coarse = *nv;
        (*nu, *nv) = (*nu * k, *nv * k);
        let within = move |cell: u32| {
            let corner = [cell / coarse * k, cell % coarse * k];
            (0..k * k).map(move |i| (corner[0] + i / k) * coarse * k + corner[1] + i % k)
        };
        let cells = surface.cell_emittance.iter();
        surface.cell_emittance =
            cells.flat_map(|&(cell, e)| within(cell).map(move |fine| (fine, e))).collect();
    }
    fine
}

/// The means by area over the k × k cells of every patch of a refined scene.
pub(crate) fn coarsened(values: &[f64], spec: &SceneSpec, k: u32) -> Vec<f64> {
    let mut means = Vec::new();
    let mut first = 0;
    for surface in &spec.surfaces {
        let Shape::Parallelogram { cells: [nu, nv], .. } = surface.shape else {
            unreachable!("boxes are made of parallelograms");
        };
        for (iu, iv) in (0..nu).flat_map(|iu| (0..nv).map(move |iv| (iu, iv))) {
            let cells = (0..k * k).map(|i| (iu * k + i / k) * nv * k + iv * k + i % k);
            means.push(cells.map(|cell| values[first + cell as usize]).sum::<f64>() / f64::from(k * k));
        }
        first += (nu * nv * k * k) as usize;
    }
    means
}

/// The mean over patches, by area.
pub(crate) fn mean_by_area(exact: &Exact, values: impl IntoIterator<Item = f64>) -> f64 {
    let total: f64 = exact.areas().iter().sum();
    values.into_iter().zip(exact.areas()).map(|(value, area)| value * area).sum::<f64>() / total
}

#[cfg(test)]
mod tests {
    use radiosity::IndexChoice;

    use super::*;

    #[test]
    fn a_refined_scene_emits_the_same_power_from_the_same_places() {
        let (coarse, fine) = (scenes::cube(3), refined(&scenes::cube(3), 2));
        let build = |spec| Scene::build(spec, IndexChoice::Flat).unwrap();
        assert!((build(&coarse).total_power(0) / build(&fine).total_power(0) - 1.0).abs() < 1e-12);
        let emittance: Vec<f64> = build(&fine).faces().iter().map(|patch| patch.emittance[0]).collect();
        let patches: Vec<f64> = build(&coarse).faces().iter().map(|patch| patch.emittance[0]).collect();
        assert_eq!(coarsened(&emittance, &coarse, 2), patches);
    }
}
