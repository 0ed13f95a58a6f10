//! Experiments made by rule, and what their tallies say of b.

use exact::{Exact, GatherEstimator, WalkEstimator};
use radiosity::{
    Birth, Direction, EstimatorKind, Experiment, IndexChoice, InfiniteEnd, Method, Scene, SceneSpec, Space,
    Tally, birth_probabilities,
};

/// A discrete walk of one direction and estimator; infinite ones end by roulette at 0.001.
pub fn method(direction: Direction, estimator: EstimatorKind) -> Method {
    Method {
        direction,
        estimator,
        infinite: InfiniteEnd::default(),
        space: Space::Discrete,
        mix: false,
        sobol_batch: None,
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
        let worth = |(i, patch): (usize, radiosity::Patch)| {
            let meaning = experiment.meaning(i, 0, &empty).expect("walks are born everywhere");
            patch.reflectance[0] * meaning.unit * meaning.irradiance_per_event.unwrap_or(0.0)
        };
        Reader { per_unit: experiment.scene().patches().iter().enumerate().map(worth).collect() }
    }

    /// b of every patch [W/m²].
    pub fn reflected(&self, tally: &Tally) -> Vec<f64> {
        let walks = tally.counts.walks as f64;
        let sums = (0..self.per_unit.len()).map(|i| tally.patch(i, 0)[0] as f64);
        sums.zip(&self.per_unit).map(|(sum, unit)| unit * sum / walks).collect()
    }
}
