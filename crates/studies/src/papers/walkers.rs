//! Experiments made by rule, and what their tallies say of b.

use exact::{Exact, GatherEstimator, WalkEstimator};
use radiosity::{
    Birth, Direction, EstimatorKind, Experiment, IndexChoice, InfiniteEnd, Method, Scene, SceneSpec, Shape,
    Space, Tally, birth_probabilities,
};

/// A discrete walk of one direction and estimator; infinite ones end by roulette at 0.001.
pub fn method(direction: Direction, estimator: EstimatorKind) -> Method {
    Method {
        direction,
        estimator,
        infinite: InfiniteEnd::default(),
        space: Space::Discrete,
        mix: false,
        batch: None,
        final_gather: Vec::new(),
    }
}

/// A method in a scene that was made for it.
pub fn experiment(spec: &SceneSpec, method: Method) -> Experiment {
    let scene = Scene::build(spec, IndexChoice::Auto).expect("scenes made by rule are valid");
    Experiment::new(scene, method).expect("the method was chosen for the scene")
}

/// Both directions of walks, births by area.
pub const DIRECTIONS: [Direction; 2] = [Direction::Shooting, Direction::Gathering(Birth::Area)];

/// The estimators in the order of S97's tables.
pub const ESTIMATORS: [EstimatorKind; 4] =
    [EstimatorKind::Absorption, EstimatorKind::Survival, EstimatorKind::Collision, EstimatorKind::Infinite];

/// What an estimator is called in a direction.
pub fn name(direction: &Direction, estimator: EstimatorKind) -> String {
    let direction = if *direction == Direction::Shooting { "shooting" } else { "gathering" };
    format!("{direction}, {}", estimator_name(estimator))
}

/// What an estimator is called.
pub fn estimator_name(estimator: EstimatorKind) -> &'static str {
    match estimator {
        EstimatorKind::Absorption => "absorption",
        EstimatorKind::Survival => "survival",
        EstimatorKind::Collision => "collision",
        EstimatorKind::Infinite => "infinite",
        EstimatorKind::Direct => "direct",
    }
}

/// The closed-form variance of B for one discrete walk [W²/m⁴] of every patch.
pub fn predicted(exact: &Exact, scene: &Scene, method: &Method) -> Vec<f64> {
    match &method.direction {
        Direction::Shooting => WalkEstimator::ALL[rank(method.estimator)].variances(exact),
        Direction::Gathering(birth) => {
            let estimator = GatherEstimator::ALL[rank(method.estimator)];
            let variances = estimator.variances(exact, &birth_probabilities(scene, birth));
            variances.into_iter().map(|variance| variance.expect("walks are born everywhere")).collect()
        }
        Direction::Jacobi { .. } => unreachable!("chains are no walks"),
    }
}

/// Its place in [`ESTIMATORS`], which is that of `exact`.
pub fn rank(estimator: EstimatorKind) -> usize {
    ESTIMATORS.iter().position(|&other| other == estimator).expect("an estimator of S97")
}

/// What the sums of a grey experiment's tallies are worth.
pub struct Reader {
    /// b over the mean score [W/m²] of every patch.
    per_unit: Vec<f64>,
}

impl Reader {
    /// Of an experiment whose walks tell of every patch.
    pub fn new(experiment: &Experiment) -> Self {
        let empty = experiment.tally::<2>();
        let worth = |(i, patch): (usize, radiosity::Face)| {
            let meaning = experiment.meaning(i, 0, &empty).expect("walks are born everywhere");
            patch.reflectance[0] * meaning.unit * meaning.irradiance_per_event.unwrap_or(0.0)
        };
        Reader { per_unit: experiment.scene().faces().iter().enumerate().map(worth).collect() }
    }

    /// b of every patch [W/m²].
    pub fn reflected(&self, tally: &Tally) -> Vec<f64> {
        let walks = tally.counts.walks as f64;
        let sums = (0..self.per_unit.len()).map(|i| tally.patch(i, 0)[0] as f64);
        sums.zip(&self.per_unit).map(|(sum, unit)| unit * sum / walks).collect()
    }
}

/// Every cell cut in k × k, each emitting as the cell did.
pub fn refined(spec: &SceneSpec, k: u32) -> SceneSpec {
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

/// The means by area of what holds of the k × k cells of every patch of a scene that was refined.
pub fn coarsened(values: &[f64], spec: &SceneSpec, k: u32) -> Vec<f64> {
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
pub fn mean_by_area(exact: &Exact, values: impl IntoIterator<Item = f64>) -> f64 {
    let total: f64 = exact.areas().iter().sum();
    values.into_iter().zip(exact.areas()).map(|(value, area)| value * area).sum::<f64>() / total
}

#[cfg(test)]
mod tests {
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
