//! Tests of the variance of single iterations of BS §4.

use crate::common::box_scene;
use exact::{Exact, jacobi_variances, systematic_jacobi_variances};
use glam::DVec3;
use radiosity::{
    IndexChoice, Scene, SceneSpec, Sequence, instruments::stochastic_iteration, methods::RayBirths,
};

/// The reflectances R of BS table 1.
const TABLE_1: [f64; 6] = [0.1, 1.0 / 3.0, 0.5, 2.0 / 3.0, 0.9, 0.95];

/// The cube of BS table 1: six patches, R + E = 1, so that B = 1.
fn bs_cube(reflectance: f64) -> SceneSpec {
    let mut spec = box_scene(DVec3::ONE, [1, 1]);
    for surface in &mut spec.surfaces {
        (surface.reflectance, surface.emittance) = (reflectance.into(), (1.0 - reflectance).into());
        surface.cell_emittance.clear();
    }
    spec
}

/// The mean squared error of b of one ray, over the prediction: BS eq. (22) for multinomial births, 5R² here; 4.8R² for
/// systematic births. One seed in 4,000 would be four standard errors off in one of the twelve cases, once and for all.
#[test]
fn one_iteration_errs_as_predicted() {
    const RAYS: u64 = 6000;
    const RUNS: u64 = 400;
    for (seed, reflectance) in (31..).zip(TABLE_1) {
        let spec = bs_cube(reflectance);
        let exact = Exact::of_scene(&spec).unwrap();
        let scene = Scene::build(&spec, IndexChoice::Auto).unwrap();
        for (births, predicted) in [
            (RayBirths::Multinomial, jacobi_variances(&exact)),
            (RayBirths::Systematic, systematic_jacobi_variances(&exact)),
        ] {
            let sequence = Sequence::new(seed);
            let ratios: Vec<f64> = (0..RUNS)
                .map(|run| {
                    let h = stochastic_iteration(&scene, births, sequence.walk(run), &[1.0; 6], RAYS);
                    let ratio = |(h, variance): (&f64, &f64)| {
                        (reflectance * (h - 1.0)).powi(2) * RAYS as f64 / variance
                    };
                    h.iter().zip(&predicted).map(ratio).sum::<f64>() / 6.0
                })
                .collect();
            let mean = ratios.iter().sum::<f64>() / RUNS as f64;
            let variance = ratios.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (RUNS - 1) as f64;
            let error = (variance / RUNS as f64).sqrt();
            println!(
                "R {reflectance:.3} {births:?}: {:.3} R² predicted, {mean:.3} ± {error:.3} of it",
                predicted[0] / reflectance / reflectance
            );
            assert!(
                (mean - 1.0).abs() < 4.0 * error && error < 0.04,
                "{births:?} at R = {reflectance}: {mean} ± {error}"
            );
        }
    }
}
