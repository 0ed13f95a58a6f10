//! Methods by name, and experiments with them.

use radiosity::{
    Birth, Direction, EstimatorKind, Experiment, IndexChoice, InfiniteEnd, Method, Scene, SceneSpec, Space,
};

/// What keeps a study from being done.
pub type Failure = Box<dyn std::error::Error + Send + Sync>;

/// Discrete shooting walks.
pub fn shooting(estimator: EstimatorKind) -> Method {
    method(Direction::Shooting, estimator)
}

/// Discrete gathering walks.
pub fn gathering(birth: Birth, estimator: EstimatorKind) -> Method {
    method(Direction::Gathering(birth), estimator)
}

/// Chains of `chain_rays` rays each.
pub fn chains(chain_rays: u64) -> Method {
    method(Direction::Jacobi { chain_rays, solve: Default::default() }, EstimatorKind::Collision)
}

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

/// A method in a scene.
///
/// # Errors
/// Where the scene or the method is refused.
pub fn experiment(spec: &SceneSpec, method: Method) -> Result<Experiment, Failure> {
    Ok(Experiment::new(Scene::build(spec, IndexChoice::Auto)?, method)?)
}
