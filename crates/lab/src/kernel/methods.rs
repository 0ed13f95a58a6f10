//! Measures the cost of other kinds of walks: rays per second over those of grey discrete collision shooting in the
//! same scene, on one core: `radwalk-lab methods`. All are timed in turn, in five rounds of
//! processor time; medians of the rounds' ratios.

use super::{Failure, TimedWalks, collision_shooting, median};
use radiosity::{
    Birth, Direction, EstimatorKind, Experiment, IndexChoice, Scene, SceneSpec, Space, Spectrum,
};
use scenes::{cornell, cube, interior};

const ROUNDS: usize = 5;

/// The number of rays in one timing.
const RAYS: u64 = 2_000_000;

pub(crate) fn run() -> Result<(), Failure> {
    println!("{:<26}{:>10}{:>10}{:>10}", "", "cube54", "cornell", "interior");
    let columns = [cube(3), cornell(), interior(57_000)].map(|spec| measure(&spec));
    let columns = columns.into_iter().collect::<Result<Vec<_>, _>>()?;
    for (row, (name, _)) in columns[0].iter().enumerate() {
        print!("{name:<26}");
        columns.iter().for_each(|column| print!("{:>10.2}", column[row].1));
        println!();
    }
    Ok(())
}

/// The relative rates of every kind of walk in a scene.
fn measure(spec: &SceneSpec) -> Result<Vec<(&'static str, f64)>, Failure> {
    let grey = Scene::build(spec, IndexChoice::Auto)?;
    let tinted = Scene::build(&tinted(spec), IndexChoice::Auto)?;
    let mut baseline = TimedWalks::new(collision_shooting(grey.clone())?);
    let mut kinds = Vec::new();
    for (name, scene, gathering, estimator, space) in [
        ("continuous", &grey, false, EstimatorKind::Collision, Space::Continuous),
        ("absorption", &grey, false, EstimatorKind::Absorption, Space::Discrete),
        ("survival", &grey, false, EstimatorKind::Survival, Space::Discrete),
        ("infinite", &grey, false, EstimatorKind::Infinite, Space::Discrete),
        ("gathering, collision", &grey, true, EstimatorKind::Collision, Space::Discrete),
        ("gathering, infinite", &grey, true, EstimatorKind::Infinite, Space::Discrete),
        ("coloured", &tinted, false, EstimatorKind::Collision, Space::Discrete),
        ("coloured, infinite", &tinted, false, EstimatorKind::Infinite, Space::Discrete),
        ("coloured, gathering", &tinted, true, EstimatorKind::Collision, Space::Discrete),
    ] {
        let direction = if gathering { Direction::Gathering(Birth::Area) } else { Direction::Shooting };
        let method = radiosity::Walks { direction, space, score: estimator.into() };
        kinds.push((name, TimedWalks::new(Experiment::new(scene.clone(), method)?), Vec::new()));
    }
    for _ in 0..ROUNDS {
        let plain = baseline.rate(RAYS)?;
        for (_, walks, ratios) in &mut kinds {
            ratios.push(walks.rate(RAYS)? / plain);
        }
    }
    Ok(kinds.into_iter().map(|(name, _, ratios)| (name, median(&ratios))).collect())
}

/// The scene with a little less green and blue.
fn tinted(spec: &SceneSpec) -> SceneSpec {
    let mut spec = spec.clone();
    for surface in &mut spec.surfaces {
        surface.reflectance = Spectrum::rgb([1.0, 0.9, 0.8].map(|tint| tint * surface.reflectance[0]));
    }
    spec
}
