//! Predicted variances against BS table 1 and against each other. Against walks: `walks.rs`.

use std::sync::Arc;

use crate::common::{Numbers, assert_near, cube_54, plain_box, random_box};
use exact::{
    ESTIMATORS, Exact, ExchangeMatrix, VarianceBounds, best_gathering_weights, best_shooting_weights,
    gathering_covariance, jacobi_variances, shooting_covariance, systematic_jacobi_variances,
};
use glam::DVec3;
use radiosity::EstimatorKind;

/// BS table 1: R; ζ; "RW theory", the mean square error per ray; and half a unit of the last digit of either.
/// Where the paper prints 10.076 and 20.218, its formula gives 10.104 and 20.219.
const BS_TABLE_1: [(f64, [f64; 2], [f64; 2]); 6] = [
    (1.0 / 10.0, [0.00218, 0.04915], [5e-6, 5e-6]),
    (1.0 / 3.0, [0.03125, 0.54167], [5e-6, 5e-6]),
    (1.0 / 2.0, [0.0909, 1.2727], [5e-5, 5e-5]),
    (2.0 / 3.0, [0.2353, 2.588], [5e-5, 5e-4]),
    (9.0 / 10.0, [1.3729, 10.104], [5e-5, 5e-4]),
    (19.0 / 20.0, [3.0336, 20.219], [5e-5, 5e-4]),
];

/// The cube of BS table 1 with all its form factors 0.2, as the paper takes them.
fn bs_cube(r: f64) -> Exact {
    let matrix = ExchangeMatrix::new(vec![1.0; 6], |i, j| if i == j { 0.0 } else { 0.2 });
    Exact::new(Arc::new(matrix), vec![r; 6], vec![1.0 - r; 6]).unwrap()
}

/// Variance for one walk times rays per walk, Σφ_i/Φ_T.
fn collision_error_per_ray(exact: &Exact) -> f64 {
    let rays: f64 = exact.solution().incoming.iter().sum::<f64>() / exact.total_power();
    rays * exact.shooting_variances(EstimatorKind::Collision)[0]
}

/// A box with a reflectance in [0.1, 0.9) on every surface and several emitters.
fn coloured_box(numbers: &mut Numbers) -> Exact {
    let mut spec = random_box(numbers, 0.0, 0.0);
    for surface in &mut spec.surfaces {
        surface.reflectance = numbers.between(0.1, 0.9).into();
        surface.cell_emittance = vec![(0, numbers.between(0.0, 3.0).into())];
    }
    Exact::of_scene(&spec).unwrap()
}

/// Probabilities of births by area: p_i = A_i/A_T.
fn by_area(exact: &Exact) -> Vec<f64> {
    let total: f64 = exact.areas().iter().sum();
    exact.areas().iter().map(|a| a / total).collect()
}

fn gathering(estimator: EstimatorKind, exact: &Exact) -> Vec<f64> {
    exact.gathering_variances(estimator, &by_area(exact)).into_iter().map(Option::unwrap).collect()
}

#[test]
fn bs_table_1() {
    for (r, [zeta_printed, error_printed], [zeta_unit, error_unit]) in BS_TABLE_1 {
        let exact = bs_cube(r);
        let zeta = r * exact.xi()[0];
        assert_near(zeta, 0.2 * r * r / (1.0 - 0.2 * r * (4.0 + r)), 1e-13);
        assert_near(zeta, zeta_printed, zeta_unit);
        let error = collision_error_per_ray(&exact);
        assert_near(error, 6.0 * r * r * (1.0 + 2.0 * zeta) - r * r / (1.0 - r), 1e-12);
        assert_near(error, error_printed, error_unit);
    }
}

/// The faces of a real cube see each other by 0.19982 and 0.20004, on average by 0.2: every printed digit
/// holds there, too.
#[test]
fn bs_table_1_with_the_form_factors_of_a_cube() {
    for (r, [zeta_printed, error_printed], [zeta_unit, error_unit]) in BS_TABLE_1 {
        let spec = plain_box(DVec3::ZERO, DVec3::ONE, [1, 1], r, 1.0 - r);
        let exact = Exact::of_scene(&spec).unwrap();
        assert_near(r * exact.xi()[0], zeta_printed, zeta_unit);
        assert_near(collision_error_per_ray(&exact), error_printed, error_unit);
    }
}

/// Nothing is reflected where R = 0, and nothing is to be estimated.
#[test]
fn black_patches_have_no_variance() {
    let mut spec = cube_54();
    spec.surfaces[2].reflectance = 0.0.into();
    let exact = Exact::of_scene(&spec).unwrap();
    for estimator in ESTIMATORS {
        assert_eq!(exact.shooting_variances(estimator)[18..27], [0.0; 9], "{}", estimator.word());
    }
    assert!(exact.solution().irradiance[18..27].iter().all(|&h| h > 0.0));
}

/// BS table 1, "SJ theory": 5R² for one ray.
#[test]
fn jacobi_in_the_cube_of_bs_table_1() {
    for (r, ..) in BS_TABLE_1 {
        // 6R² − R² with b = R.
        assert_near(jacobi_variances(&bs_cube(r))[0], 5.0 * r * r, 1e-13);
    }
}

/// Each of five other faces shoots n/6 rays, of which a fifth lands: R²·6·5·(1/5)(4/5) = 4.8R² for one ray, what BS
/// table 1, "SJ experiment", shows at R = 1/2, 9/10 and 19/20.
#[test]
fn systematic_jacobi_in_the_cube_of_bs_table_1() {
    for (r, ..) in BS_TABLE_1 {
        assert_near(systematic_jacobi_variances(&bs_cube(r))[0], 4.8 * r * r, 1e-13);
    }
}

/// collision = R·survival + (1 − R)·absorption, so Var = R²V′ + (1 − R)²V + 2R(1 − R)Cov (S97 eqs. 8, 16).
#[test]
fn collision_is_the_sum_of_survival_and_absorption() {
    let mut numbers = Numbers(21);
    for _ in 0..5 {
        let exact = coloured_box(&mut numbers);
        let [absorption, survival, collision, _] = ESTIMATORS.map(|e| exact.shooting_variances(e));
        let covariance = shooting_covariance(&exact);
        for (i, &r) in exact.reflectance().iter().enumerate() {
            let d = 1.0 - r;
            let sum = r * r * survival[i] + d * d * absorption[i] + 2.0 * r * d * covariance[i];
            assert_near(sum / collision[i], 1.0, 1e-10);
        }
    }
    let exact = Exact::of_scene(&cube_54()).unwrap();
    let [absorption, survival, collision, _] = ESTIMATORS.map(|e| gathering(e, &exact));
    let covariance = gathering_covariance(&exact, &by_area(&exact));
    let (r, d) = (0.3, 0.7);
    for i in 0..54 {
        let sum = r * r * survival[i] + d * d * absorption[i] + 2.0 * r * d * covariance[i].unwrap();
        assert_near(sum, collision[i], 1e-12 * survival[i]);
    }
}

/// At the best weight the variance has no slope in α (S97 §§2.6, 3.7).
#[test]
fn the_best_weights_are_stationary() {
    let exact = Exact::of_scene(&cube_54()).unwrap();
    let no_slope = |alpha: f64, survival: f64, absorption: f64, covariance: f64| {
        let slope = alpha * survival - (1.0 - alpha) * absorption + (1.0 - 2.0 * alpha) * covariance;
        assert_near(slope / survival, 0.0, 1e-12);
    };
    let [absorption, survival, ..] = ESTIMATORS.map(|e| exact.shooting_variances(e));
    let covariance = shooting_covariance(&exact);
    for (i, alpha) in best_shooting_weights(&exact).into_iter().enumerate() {
        no_slope(alpha, survival[i], absorption[i], covariance[i]);
        assert_near(alpha / exact.reflectance()[i], 1.0, 0.1);
    }
    let [absorption, survival, ..] = ESTIMATORS.map(|e| gathering(e, &exact));
    let covariance = gathering_covariance(&exact, &by_area(&exact));
    for (i, alpha) in best_gathering_weights(&exact).unwrap().into_iter().enumerate() {
        no_slope(alpha, survival[i], absorption[i], covariance[i].unwrap());
    }
    let several = coloured_box(&mut Numbers(22));
    assert_eq!(best_gathering_weights(&several), None, "sources of unlike reflectance");
}

/// The infinite walk varies less than collision; for the same walk absorption beats survival up to R = ½.
#[test]
fn the_order_of_the_estimators() {
    let mut numbers = Numbers(23);
    for _ in 0..5 {
        let exact = coloured_box(&mut numbers);
        let [absorption, survival, collision, infinite] = ESTIMATORS.map(|e| exact.shooting_variances(e));
        for (i, &r) in exact.reflectance().iter().enumerate() {
            assert!(infinite[i] <= collision[i] && collision[i] <= survival[i], "patch {i}");
            // S97 proposition 2.20 says from 1/(1 − R) ≤ 1/R + 2ξ, here in full.
            assert_eq!(absorption[i] < survival[i], 1.0 / (1.0 - r) < 1.0 / r + 2.0 * exact.xi()[i]);
        }
        let [_, survival, collision, infinite] = ESTIMATORS.map(|e| gathering(e, &exact));
        for i in 0..survival.len() {
            assert!(infinite[i] <= collision[i] && collision[i] <= survival[i], "patch {i}");
        }
    }
}

/// In the limit R → 0 only direct light counts: φ = ψ, and infinite walks become collision walks.
#[test]
fn after_one_bounce_infinite_walks_are_collision_walks() {
    let exact = Exact::of_scene(&plain_box(DVec3::ZERO, DVec3::ONE, [2, 2], 1e-6, 1.0)).unwrap();
    let [.., collision, infinite] = ESTIMATORS.map(|e| exact.shooting_variances(e));
    // β ≈ R²H against Rb = R²H.
    assert_near(infinite[0] / collision[0], 1.0, 1e-5);
}

#[test]
fn a_source_that_does_not_reflect_is_lost_to_gathering_by_survival() {
    let mut spec = cube_54();
    spec.surfaces[0].reflectance = 0.0.into();
    let exact = Exact::of_scene(&spec).unwrap();
    let birth = by_area(&exact);
    assert_eq!(exact.gathering_variances(EstimatorKind::Survival, &birth), vec![None; 54]);
    assert_eq!(gathering_covariance(&exact, &birth), vec![None; 54]);
    assert_eq!(best_gathering_weights(&exact), None);
    for estimator in [EstimatorKind::Absorption, EstimatorKind::Collision, EstimatorKind::Infinite] {
        let variances = exact.gathering_variances(estimator, &birth);
        assert_eq!(variances[..9], [Some(0.0); 9], "{}: black patches", estimator.word());
        assert!(variances[9..].iter().all(|v| v.unwrap() > 0.0), "{}", estimator.word());
    }
}

/// p_i = 1/2 on two chosen patches, 0 elsewhere: E[score²] is inverse to p_i.
#[test]
fn gathering_on_chosen_patches() {
    let exact = Exact::of_scene(&cube_54()).unwrap();
    let mut birth = vec![0.0; 54];
    (birth[7], birth[30]) = (0.5, 0.5);
    for estimator in ESTIMATORS {
        let (chosen, all) = (exact.gathering_variances(estimator, &birth), gathering(estimator, &exact));
        assert_eq!(chosen.iter().filter(|v| v.is_some()).count(), 2);
        for i in [7, 30] {
            let b2 = exact.solution().reflected[i].powi(2);
            assert_near((chosen[i].unwrap() + b2) * 27.0 / (all[i] + b2), 1.0, 1e-13);
        }
    }
}

/// Areas, reflectances and emittances are all that bounds look at, so the scene itself has them.
#[test]
fn bounds_of_a_scene_are_those_of_its_solution() {
    let scene = radiosity::Scene::build(&cube_54(), radiosity::IndexChoice::Flat).unwrap();
    let (of_scene, of_exact) =
        (VarianceBounds::of_scene(&scene, 0), VarianceBounds::of(&Exact::of_scene(&cube_54()).unwrap()));
    assert_near(of_scene.shooting_variance() / of_exact.shooting_variance(), 1.0, 1e-12);
    assert_near(of_scene.gathering_variance() / of_exact.gathering_variance(), 1.0, 1e-12);
}

/// S97's bounds hold for every patch and for the mean over the area.
#[test]
fn bounds_bound() {
    let mut numbers = Numbers(24);
    let mut scenes: Vec<Exact> = (0..5).map(|_| coloured_box(&mut numbers)).collect();
    scenes.push(Exact::of_scene(&cube_54()).unwrap());
    for exact in scenes {
        let bounds = VarianceBounds::of(&exact);
        let birth = by_area(&exact);
        let mean = |variances: &[f64]| variances.iter().zip(&birth).map(|(v, p)| v * p).sum::<f64>();
        for estimator in ESTIMATORS {
            assert!(mean(&exact.shooting_variances(estimator)) <= bounds.shooting_error(estimator));
        }
        for estimator in ESTIMATORS {
            assert!(mean(&gathering(estimator, &exact)) <= bounds.gathering_error(estimator));
        }
        let below = |variances: &[f64], bound: f64| variances.iter().all(|&v| v <= bound);
        assert!(below(&exact.shooting_variances(EstimatorKind::Absorption), bounds.shooting_variance()));
        assert!(below(&gathering(EstimatorKind::Absorption, &exact), bounds.gathering_variance()));
        let least = birth.iter().copied().fold(1.0, f64::min);
        for estimator in ESTIMATORS {
            assert!(below(&exact.shooting_variances(estimator), bounds.shooting_variance_of(estimator)));
        }
        for estimator in ESTIMATORS {
            assert!(below(&gathering(estimator, &exact), bounds.gathering_variance_of(estimator, least)));
        }
        for (b, r) in exact.solution().reflected.iter().zip(exact.reflectance()) {
            assert!(b <= &(r * bounds.max_radiosity));
        }
        assert!(
            exact.solution().incoming.iter().sum::<f64>() / bounds.total_power <= bounds.shooting_rays(1.0)
        );
        assert_near(
            bounds.shooting_walks(0.5),
            2.0 * bounds.shooting_variance(),
            1e-12 * bounds.shooting_walks(0.5),
        );
        assert_near(
            bounds.gathering_walks(2.0),
            0.5 * bounds.gathering_variance(),
            1e-12 * bounds.gathering_walks(2.0),
        );
    }
}
