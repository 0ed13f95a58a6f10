//! A furnace, in which B = 1 W/m² everywhere: what walks find of it, patch by patch.

use radiosity::{Estimator::Collision, Experiment, IndexChoice, Method, Scene, SceneSpec};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scene = Scene::build(&SceneSpec::furnace(3, 0.5), IndexChoice::Auto)?;
    let experiment = Experiment::new(scene, Method::shooting(Collision))?;
    let solution = experiment.run(1, 100_000)?;
    for (patch, b) in solution.estimates.iter().flatten().enumerate() {
        println!("patch {patch}: {:.3} W/m², 95 % in {:.3} … {:.3}", b.radiosity, b.ci_low, b.ci_high);
    }
    Ok(())
}
