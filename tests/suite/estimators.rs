//! Tests of every walk and estimator against the exact solution: unbiased, with the variance of the closed form.

use crate::common::{box_scene, cube54, experiment, walk, walk_in_blocks};
use exact::Exact;
use glam::DVec3;
use radiosity::{
    Birth, Direction, Estimator, EstimatorKind, IndexChoice, Scene, SceneSpec, Solution, Walks,
    methods::{InfiniteEnd, birth_probabilities},
};
use stats::{Coverage, Interval, mean_squared_z};

/// The estimators of all reflected light.
fn kinds() -> impl Iterator<Item = EstimatorKind> {
    EstimatorKind::ALL.iter().copied().filter(|kind| kind.goes_on())
}

fn method(direction: Direction, estimator: impl Into<Estimator>) -> Walks {
    Walks { direction, ..Walks::shooting(estimator.into()) }
}

/// The 54-patch cube, and a flat box with emitters of unlike power and reflectance.
fn scenes() -> [(&'static str, SceneSpec); 2] {
    let mut flat = box_scene(DVec3::new(2.0, 1.0, 0.5), [2, 3]);
    flat.surfaces[1].cell_emittance = vec![(2, 3.0.into()), (5, 0.5.into())];
    flat.surfaces[5].cell_emittance = vec![(4, 2.0.into())];
    [("cube54", cube54()), ("flat box", flat)]
}

/// The closed-form variance of B for one walk; `None` if no walk is born there. For the infinite estimator it is that
/// of endless walks; roulette below a weight of 0.001 adds less than a thousandth.
fn predicted(exact: &Exact, scene: &Scene, method: &Walks) -> Vec<Option<f64>> {
    let estimator = method.score.estimator().kind();
    match &method.direction {
        Direction::Shooting => exact.shooting_variances(estimator).into_iter().map(Some).collect(),
        Direction::Gathering(birth) => {
            exact.gathering_variances(estimator, &birth_probabilities(scene, birth))
        }
    }
}

fn directions() -> [Direction; 4] {
    [
        Direction::Shooting,
        Direction::Gathering(Birth::Area),
        Direction::Gathering(Birth::Uniform),
        Direction::Gathering(Birth::Patches(vec![3, 9, 20])),
    ]
}

/// Mean squared z, z the error over the standard error that theory predicts (so that it is 1 however few the
/// scores are), over 200 seeds and all non-emitting patches. Births on three patches pool 600 z: standard error
/// 5.8 %; the others ≥ 6,600: ≤ 1.7 %, a little more where patches expect few scores. Allowed: 4.5 of these standard
/// errors; false-alarm rate 10⁻³ for all 32 pools, once and for all with these seeds. The 95 % intervals of the same
/// runs, which know nothing of the theory, cover ≥ 94 %, less 3 standard errors of the pool.
#[test]
fn every_method_is_unbiased_and_its_intervals_cover() {
    for (name, spec) in scenes() {
        let exact = Exact::of_scene(&spec).unwrap();
        for direction in directions() {
            for kind in kinds() {
                let walks = 5_000;
                let method = method(direction.clone(), kind);
                let experiment = experiment(&spec, IndexChoice::Auto, method.clone());
                let variances = predicted(&exact, experiment.scene(), &method);
                let mut z = Vec::new();
                let mut coverage = Coverage::default();
                for seed in 1..=200 {
                    let solution = Solution::new(&experiment, &walk(&experiment, seed, 0..walks), 0.95);
                    for (i, patch) in experiment.scene().faces().iter().enumerate() {
                        let Some(estimate) = solution.estimates[i].filter(|_| patch.emittance[0] == 0.0)
                        else {
                            continue;
                        };
                        let truth = exact.solution().radiosity[i];
                        let error = (variances[i].unwrap() / walks as f64).sqrt();
                        z.push((estimate.radiosity - truth) / error);
                        coverage.record(&Interval { low: estimate.ci_low, high: estimate.ci_high }, truth);
                    }
                }
                let squared = mean_squared_z(z.iter().copied()).unwrap();
                let rate = coverage.rate(0.94).unwrap();
                let what = format!("{name} {direction:?} {kind:?}");
                println!("{what}: {squared:?}, {:.4} of {} intervals cover", rate.value, coverage.trials);
                assert!(z.len() >= 600);
                assert!((squared.value - 1.0).abs() < 4.5 * squared.standard_error, "{what}: {squared:?}");
                assert!(rate.z(0.94) > -3.0, "{what}: {rate:?}");
            }
        }
    }
}

/// The variance of one walk, patch by patch, against the closed form, by the scatter of 400 blocks of walks: about
/// 1,000 z-scores at |z| < 5: false-alarm rate 6·10⁻⁴, once and for all with this seed.
#[test]
fn every_variance_is_that_of_the_closed_form() {
    for (name, spec) in scenes() {
        let exact = Exact::of_scene(&spec).unwrap();
        for direction in directions() {
            for kind in kinds() {
                // No walk of the length seen here reaches this threshold, so that walks are the endless ones of theory.
                let endless = InfiniteEnd::Roulette { threshold: 1e-9 };
                let method = method(direction.clone(), kind.ending(endless));
                let experiment = experiment(&spec, IndexChoice::Auto, method.clone());
                let blocks = walk_in_blocks(&experiment, 11, 500_000, 400);
                let mut worst = 0.0_f64;
                for (i, variance) in predicted(&exact, experiment.scene(), &method).into_iter().enumerate() {
                    let Some(meaning) = experiment.meaning(i, 0, &blocks[0]) else {
                        assert_eq!(variance, None);
                        continue;
                    };
                    let unit = experiment.scene().faces().get(i).reflectance[0]
                        * meaning.irradiance_per_event.unwrap()
                        * meaning.unit;
                    let measured = crate::common::variance(&blocks, i);
                    let z = measured.z(variance.unwrap() / (unit * unit));
                    worst = worst.max(z.abs());
                    assert!(
                        z.abs() < 5.0,
                        "{name} {direction:?} {kind:?} patch {i}: {measured:?} is {z:.2} σ off"
                    );
                }
                println!("{name} {direction:?} {kind:?}: largest |z| {worst:.2}");
            }
        }
    }
}

/// Walks that are cut off lose light: no more than the reported bound, and here visibly more than chance.
#[test]
fn cut_off_walks_are_biased_within_their_bound() {
    let exact = Exact::of_scene(&cube54()).unwrap();
    for direction in [Direction::Shooting, Direction::Gathering(Birth::Patches(vec![3, 9, 50]))] {
        for end in [InfiniteEnd::Cutoff { threshold: 0.2 }, InfiniteEnd::Length { length: 2 }] {
            let method = method(direction.clone(), Estimator::Infinite(end));
            let experiment = experiment(&cube54(), IndexChoice::Auto, method);
            let tally = walk(&experiment, 5, 0..500_000);
            assert!(tally.counts.truncated > 0);
            let solution = Solution::new(&experiment, &tally, 0.95);
            assert!(experiment.is_biased());
            let mut seen = 0;
            for (i, estimate) in solution.estimates.iter().enumerate() {
                let Some(estimate) = estimate else { continue };
                let (missing, error) =
                    (exact.solution().radiosity[i] - estimate.radiosity, estimate.std_error.unwrap());
                // 114 z-scores a side at 5 σ: false-alarm rate 10⁻⁴, once and for all with this seed.
                assert!(missing > -5.0 * error, "{direction:?} {end:?} patch {i}: too bright");
                assert!(
                    missing < estimate.bias_bound + 5.0 * error,
                    "{direction:?} {end:?} patch {i}: {missing}"
                );
                seen += u32::from(missing > 5.0 * error);
            }
            assert!(seen > 0, "{direction:?} {end:?}: a bias of a few percent must show");
        }
    }
}

/// At R = 0.9999 a walk meets the six walls 10⁴ times: E = 1 − R, so B = 1 everywhere. |z| < 5 for each of 30:
/// false-alarm rate 2·10⁻⁵ each, once and for all with this seed.
#[test]
fn the_furnace_at_r_09999_is_right_by_every_estimator() {
    let mut spec = box_scene(DVec3::ONE, [1, 1]);
    for surface in &mut spec.surfaces {
        (surface.reflectance, surface.emittance, surface.cell_emittance) =
            (0.9999.into(), 1e-4.into(), vec![]);
    }
    for direction in [Direction::Shooting, Direction::Gathering(Birth::Area)] {
        for kind in kinds() {
            let experiment = experiment(&spec, IndexChoice::Auto, method(direction.clone(), kind));
            let tally = walk(&experiment, 1, 0..200);
            assert_eq!(tally.counts.absorbed, 200);
            for estimate in Solution::new(&experiment, &tally, 0.95).estimates.into_iter().flatten() {
                let z = (estimate.radiosity - 1.0) / estimate.std_error.unwrap().max(1e-9);
                assert!(z.abs() < 5.0, "{direction:?} {kind:?}: {estimate:?}");
            }
        }
    }
}

/// Gathering by survival cannot see an emitter that does not reflect, and is refused in words. Every other method takes
/// it. A patch of reflectance 0 has b = 0 exactly, and its irradiance is known to every method but survival.
#[test]
fn black_emitters_and_black_patches() {
    let mut spec = cube54();
    spec.surfaces[0].reflectance = 0.0.into();
    let scene = || Scene::build(&spec, IndexChoice::Auto).unwrap();
    for direction in [Direction::Shooting, Direction::Gathering(Birth::Area)] {
        for kind in kinds() {
            let experiment = match radiosity::Experiment::new(scene(), method(direction.clone(), kind)) {
                Ok(experiment) => experiment,
                Err(unfit) => {
                    assert_eq!((direction != Direction::Shooting, kind), (true, EstimatorKind::Survival));
                    assert!(unfit.to_string().contains("patch 4"), "{unfit}");
                    continue;
                }
            };
            let solution = Solution::new(&experiment, &walk(&experiment, 1, 0..100_000), 0.95);
            let black = solution.estimates[0].unwrap();
            assert_eq!((black.radiosity, black.std_error), (0.0, Some(0.0)));
            let blind = direction == Direction::Shooting && kind == EstimatorKind::Survival;
            assert_eq!(black.irradiance.is_none(), blind);
        }
    }
}
