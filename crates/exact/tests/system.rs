//! The dense solve against furnaces, conservation and its own equations.

use std::sync::Arc;

use crate::common::{Numbers, assert_near, cube_54, plain_box, random_box};
use exact::{
    BoxScene, Exact, ExactError, ExchangeMatrix, MAX_GENERAL_FACES, MAX_PATCHES, RadiositySystem, Singular,
};
use glam::DVec3;

/// A box with a reflectance in [0, 0.95) and an emittance on every surface.
fn coloured_box(numbers: &mut Numbers) -> Exact {
    let mut spec = random_box(numbers, 0.0, 0.0);
    for surface in &mut spec.surfaces {
        surface.reflectance = numbers.between(0.0, 0.95).into();
        surface.emittance = numbers.between(0.0, 3.0).into();
    }
    spec.surfaces[0].reflectance = 0.0.into();
    Exact::of_scene(&spec).unwrap()
}

/// Uniform E and R: B = E/(1 − R) on every patch, whatever the shape or mesh.
#[test]
fn furnaces() {
    let mut numbers = Numbers(5);
    for r in [0.0, 0.1, 0.5, 0.9, 0.95] {
        for _ in 0..10 {
            let exact = Exact::of_scene(&random_box(&mut numbers, r, 1.0 - r)).unwrap();
            for (b, h) in exact.solution().radiosity.iter().zip(&exact.solution().irradiance) {
                assert_near(*b, 1.0, 1e-12);
                assert_near(*h, 1.0, 1e-12);
            }
        }
    }
}

/// In a closed scene all that is emitted is absorbed: Σ (1 − R_i)φ_i = Φ_T.
#[test]
fn power_is_conserved() {
    let mut numbers = Numbers(6);
    for _ in 0..20 {
        let exact = coloured_box(&mut numbers);
        let reflectance = exact.system().reflectance();
        let absorbed: f64 =
            exact.solution().incoming.iter().zip(reflectance).map(|(phi, r)| (1.0 - r) * phi).sum();
        assert_near(absorbed / exact.total_power(), 1.0, 1e-12);
        assert!(exact.solution().residual < 1e-14);
    }
}

/// ξ_i from the inverse's diagonal is what φ_i says when patch i alone emits 1 W, also where R = 0.
#[test]
fn xi_is_the_incoming_power_of_a_lone_emitter() {
    let mut numbers = Numbers(7);
    for _ in 0..5 {
        let exact = coloured_box(&mut numbers);
        for (i, &xi) in exact.xi().iter().enumerate() {
            let mut emittance = vec![0.0; exact.xi().len()];
            emittance[i] = 1.0 / exact.exchange().areas()[i];
            assert_near(exact.system().solve(&emittance).incoming[i], xi, 1e-13);
            assert!((0.0..=1.0 / (1.0 - exact.system().reflectance()[i])).contains(&xi));
        }
    }
}

/// Light paths can be reversed: b_is/(R_iE_sA_s) is symmetric in the patches.
#[test]
fn paths_are_reversible() {
    let exact = Exact::of_scene(&cube_54()).unwrap();
    let irradiance_of = |source: usize, receiver: usize| {
        let mut emittance = vec![0.0; 54];
        emittance[source] = 1.0;
        exact.system().solve(&emittance).irradiance[receiver]
    };
    for (i, j) in [(4, 30), (0, 53), (17, 9), (2, 5)] {
        assert_near(irradiance_of(i, j), irradiance_of(j, i), 1e-15);
    }
}

/// b_i = Σ_s b_is, β_i = Σ_s β_is.
#[test]
fn light_is_the_sum_of_what_the_sources_give() {
    let mut spec = cube_54();
    spec.surfaces[3].cell_emittance = vec![(0, 2.0.into()), (8, 0.5.into())];
    let exact = Exact::of_scene(&spec).unwrap();
    let sources = [4, 27, 35];
    let sum = |of_source: &dyn Fn(usize) -> exact::SystemSolution, i: usize| -> f64 {
        sources.iter().map(|&s| of_source(s).reflected[i]).sum()
    };
    for i in [0, 4, 27, 30, 53] {
        assert_near(sum(&|s| exact.solution_of_source(s), i), exact.solution().reflected[i], 1e-14);
        let beta = exact.squared_solution().reflected[i];
        assert_near(sum(&|s| exact.squared_solution_of_source(s), i), beta, 1e-14);
        assert!(beta < exact.solution().reflected[i]);
    }
}

/// Doubling every length changes powers, not radiosities.
#[test]
fn radiosity_has_no_scale() {
    let at = |size: f64| {
        let hi = size * DVec3::new(1.0, 2.0, 3.0);
        let mut spec = plain_box(DVec3::ZERO, hi, [3, 2], 0.6, 0.0);
        spec.surfaces[1].cell_emittance = vec![(2, 5.0.into())];
        Exact::of_scene(&spec).unwrap()
    };
    let (small, large) = (at(1.0), at(1e5));
    for (a, b) in small.solution().radiosity.iter().zip(&large.solution().radiosity) {
        assert_near(b / a, 1.0, 1e-12);
    }
    assert_near(large.total_power() / small.total_power(), 1e10, 1e-2);
}

#[test]
fn too_many_patches_are_refused_with_the_memory_they_take() {
    let spec = plain_box(DVec3::ZERO, DVec3::ONE, [100, 100], 0.5, 1.0);
    let error = Exact::of_scene(&spec).unwrap_err();
    assert!(matches!(error, ExactError::TooManyPatches { patches: 60_000, .. }));
    let message = error.to_string();
    assert!(message.contains(&MAX_PATCHES.to_string()) && message.contains("57.6 GB"), "{message}");
}

/// A lid is missing: not a box any more, and more faces than general scenes may have.
#[test]
fn too_large_general_scenes_are_refused_with_time_memory_and_reason() {
    let mut spec = plain_box(DVec3::ZERO, DVec3::ONE, [40, 40], 0.5, 1.0);
    spec.surfaces.pop();
    let error = Exact::of_scene(&spec).unwrap_err();
    assert!(matches!(error, ExactError::TooManyFaces { faces: 8_000, .. }), "{error}");
    let message = error.to_string();
    for part in [MAX_GENERAL_FACES.to_string().as_str(), "minutes", "2.0 GB", "lacks"] {
        assert!(message.contains(part), "{part} in {message}");
    }
}

#[test]
fn invalid_scenes_are_refused() {
    let dark = plain_box(DVec3::ZERO, DVec3::ONE, [1, 1], 0.5, 0.0);
    assert!(matches!(Exact::of_scene(&dark), Err(ExactError::Scene(_))));
}

#[test]
fn light_that_never_dies_has_no_solution() {
    let cube = BoxScene::recognise(&cube_54()).unwrap();
    let matrix = Arc::new(ExchangeMatrix::of_box(&cube));
    assert_eq!(RadiositySystem::new(matrix, vec![1.0 + 1e-12; 54]).unwrap_err(), Singular);
}
