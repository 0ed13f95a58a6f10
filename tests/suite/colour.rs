//! Tests of colour: one walk serves three channels, each as if it had walked alone. The file also tests other relations
//! between estimators: direct light, and the best mix of absorption and survival.

use crate::common::{box_scene, cube54, experiment, walk};
use exact::shooting_covariance;
use exact::{Exact, best_gathering_weights, best_shooting_weights, gathering_covariance};
use glam::DVec3;
use radiosity::{
    Birth, Direction, Estimates, Estimator, EstimatorKind, Experiment, IndexChoice, Method, Scene, SceneSpec,
    Solution, Spectrum, Tally, Unfit, Walks,
    methods::{InfiniteEnd, Score, birth_probabilities},
    precision::Quantity,
};
use stats::{Coverage, Interval, mean_squared_z};

/// A flat box of unlike colours: a wall that is black in one channel, a grey one, emitters of which one has no
/// blue and one is 10⁻⁸ of the other.
fn coloured_box() -> SceneSpec {
    let mut spec = box_scene(DVec3::new(2.0, 1.0, 0.5), [2, 2]);
    let reflectances = [
        [0.8, 0.5, 0.2],
        [0.1, 0.6, 0.7],
        [0.5, 0.5, 0.5],
        [0.7, 0.0, 0.3],
        [0.3, 0.8, 0.75],
        [0.65, 0.05, 0.05],
    ];
    for (surface, reflectance) in spec.surfaces.iter_mut().zip(reflectances) {
        surface.reflectance = Spectrum::rgb(reflectance);
    }
    spec.surfaces[0].cell_emittance = vec![(0, Spectrum::rgb([3.0, 1.0, 0.0]))];
    spec.surfaces[1].cell_emittance = vec![(2, Spectrum::rgb([0.2, 1.0, 5.0]))];
    spec.surfaces[4].cell_emittance = vec![(3, Spectrum::rgb([3e-8, 1e-8, 2e-8]))];
    spec
}

fn methods() -> Vec<Walks> {
    let kinds = [
        EstimatorKind::Absorption,
        EstimatorKind::Survival,
        EstimatorKind::Collision,
        EstimatorKind::Infinite,
    ];
    let directions = [Direction::Shooting, Direction::Gathering(Birth::Area)];
    let all = directions.into_iter().flat_map(|direction| {
        kinds.map(|estimator| Walks { direction: direction.clone(), ..Walks::shooting(estimator) })
    });
    all.collect()
}

/// B of every patch and channel [W/m²], by the exact solution.
fn truth(spec: &SceneSpec) -> Vec<[f64; 3]> {
    let channels = [0, 1, 2].map(|c| Exact::of_scene(&spec.channel(c)).unwrap());
    let patches = 0..channels[0].face_count();
    patches.map(|i| [0, 1, 2].map(|c| channels[c].solution().radiosity[i])).collect()
}

/// Every channel against the exact solution of its own grey scene. z, by the estimated standard error (of ≥ 100
/// effective scores), pools ≥ 600 values; their squares have a standard error of 3 to 6 %, as
/// they say themselves; 4.5 of those: false-alarm rate 10⁻⁴ for all 8 pools, once and for all with these seeds.
/// 95 % intervals cover ≥ 94 %, less 3.5 standard errors.
#[test]
fn every_channel_is_as_if_it_had_walked_alone() {
    let spec = coloured_box();
    let truth = truth(&spec);
    for method in methods() {
        let experiment = experiment(&spec, IndexChoice::Auto, method.clone());
        let mut z = Vec::new();
        let mut coverage = Coverage::default();
        for seed in 1..=40 {
            let solution = Solution::new(&experiment, &walk(&experiment, seed, 0..40_000), 0.95);
            for (i, patch) in experiment.scene().faces().iter().enumerate() {
                for (c, estimate) in solution.face(i).unwrap().into_iter().enumerate() {
                    let truth = truth[i][c];
                    if patch.reflectance[c] == 0.0 {
                        assert_eq!(estimate.radiosity, patch.emittance[c]);
                        assert_eq!(estimate.std_error, Some(0.0));
                        continue;
                    }
                    coverage.record(&Interval { low: estimate.ci_low, high: estimate.ci_high }, truth);
                    if estimate.effective_scores >= 100.0 {
                        z.push((estimate.radiosity - truth) / estimate.std_error.unwrap());
                    }
                }
            }
        }
        let squared = mean_squared_z(z.iter().copied()).unwrap();
        let rate = coverage.rate(0.94).unwrap();
        let what = format!("{:?} {:?}", method.direction, method.score);
        println!("{what}: {} z, {squared:?}; {:.4} of {} cover", z.len(), rate.value, coverage.trials);
        assert!(z.len() >= 600, "{what}");
        assert!((squared.value - 1.0).abs() < 4.5 * squared.standard_error, "{what}: {squared:?}");
        assert!(rate.z(0.94) > -3.5, "{what}: {rate:?}");
    }
}

/// A scene of equal channels is grey, however it is written: it has the bits of one channel.
#[test]
fn equal_channels_are_one() {
    let mut triple = cube54();
    for surface in &mut triple.surfaces {
        surface.reflectance = Spectrum::rgb([surface.reflectance[0]; 3]);
    }
    let tallies = [cube54(), triple].map(|spec| {
        let experiment = experiment(&spec, IndexChoice::Auto, Walks::shooting(Estimator::Collision));
        assert_eq!(experiment.scene().channels(), 1);
        walk(&experiment, 5, 0..10_000)
    });
    assert_eq!(tallies[0], tallies[1]);
}

/// If only the colours of the light differ, every weight is Φ_sc/Φ_Tc/p_s and no channel pays for another. With one
/// emitter all weights are 1, and each channel has the hits of a grey run.
#[test]
fn grey_walls_in_coloured_light_cost_no_variance() {
    let mut spec = cube54();
    spec.surfaces[0].cell_emittance = vec![(4, Spectrum::rgb([1.0, 2.0, 0.5]))];
    let method = Walks::shooting(Estimator::Collision);
    let coloured = experiment(&spec, IndexChoice::Auto, method.clone());
    let grey = experiment(&cube54(), IndexChoice::Auto, method);
    let [coloured, grey] = [coloured, grey].map(|e| Solution::new(&e, &walk(&e, 5, 0..10_000), 0.95));
    for (i, grey) in grey.estimates.iter().flatten().enumerate() {
        for (estimate, scale) in coloured.face(i).unwrap().into_iter().zip([1.0, 2.0, 0.5]) {
            assert!((estimate.radiosity - scale * grey.radiosity).abs() < 1e-9 * estimate.radiosity);
            let (error, grey_error) = (estimate.std_error.unwrap(), scale * grey.std_error.unwrap());
            assert!((error - grey_error).abs() <= 1e-6 * error);
        }
    }
}

/// A channel without any light is exactly dark.
#[test]
fn an_unlit_channel_is_dark() {
    let mut spec = cube54();
    spec.surfaces[0].cell_emittance = vec![(4, Spectrum::rgb([1.0, 0.0, 0.5]))];
    for method in methods() {
        let experiment = experiment(&spec, IndexChoice::Auto, method);
        let tally = walk(&experiment, 5, 0..1000);
        let estimates = Estimates::new(&experiment, &tally, 0.95);
        for i in 0..54 {
            let dark = estimates.face(i).unwrap()[1];
            assert_eq!((dark.radiosity, dark.ci_high, dark.std_error), (0.0, 0.0, Some(0.0)));
        }
        assert!(
            estimates
                .precision(Quantity::Irradiance, &radiosity::parallel::in_turn)
                .rms_relative_error
                .is_finite()
        );
    }
}

/// Direct light is E + R·Σ_j F_ij E_j, shot or gathered, in colour too. 2 × 54 × 3 z-scores at |z| < 5: false-alarm
/// rate 2·10⁻⁴, once and for all with this seed.
#[test]
fn direct_light_is_the_first_bounce() {
    let mut spec = cube54();
    spec.surfaces[2].emittance = Spectrum::rgb([0.5, 0.1, 2.0]);
    for direction in [Direction::Shooting, Direction::Gathering(Birth::Uniform)] {
        let method = Walks { direction, ..Walks::shooting(EstimatorKind::Direct) };
        let experiment = experiment(&spec, IndexChoice::Auto, method);
        let exact = Exact::of_scene(&spec.channel(0)).unwrap();
        let tally = walk(&experiment, 9, 0..500_000);
        assert_eq!(tally.counts.rays, tally.counts.walks);
        let solution = Solution::new(&experiment, &tally, 0.95);
        let patches = experiment.scene().faces();
        for (i, patch) in patches.iter().enumerate() {
            for (c, estimate) in solution.face(i).unwrap().into_iter().enumerate() {
                let incoming = |(j, from): (usize, radiosity::surfaces::Face)| {
                    exact.exchange().form_factor(i, j) * from.emittance[c]
                };
                let irradiance: f64 = patches.iter().enumerate().map(incoming).sum();
                let expected = patch.emittance[c] + patch.reflectance[c] * irradiance;
                let z = (estimate.radiosity - expected) / estimate.std_error.unwrap();
                assert!(z.abs() < 5.0, "patch {i} channel {c}: {z}");
            }
        }
    }
}

/// Tests the best weight α and its gain over collision against theory (S97 §2.6, §3.7), from 6.4·10⁶ walks. α is a ratio
/// of sample moments with an error of a few thousandths, found here by the spread between 16 parts of the walks (a
/// t-quantile for 15 degrees of freedom, |t| < 6.5: 10⁻⁵ a patch, 10⁻³ in all).
#[test]
fn the_best_mix_is_that_of_theory() {
    let mut spec = cube54();
    // All sources share R: only then does gathering have a single best weight.
    spec.surfaces[0].cell_emittance = vec![(4, 1.0.into()), (0, 0.3.into())];
    let exact = Exact::of_scene(&spec).unwrap();
    let direction = Direction::Gathering(Birth::Area);
    let best = [best_shooting_weights(&exact), best_gathering_weights(&exact).unwrap()];
    for (direction, best) in [Direction::Shooting, direction].into_iter().zip(best) {
        let method = Walks { direction, ..Walks::shooting(Score::Mix) };
        let experiment = experiment(&spec, IndexChoice::Auto, method.clone());
        let parts: Vec<Tally> = (0..16).map(|part| walk(&experiment, part, 0..400_000)).collect();
        let excess = predicted_excess(&exact, &experiment, &best);
        for i in 0..54 {
            let mixes = || parts.iter().map(|part| Estimates::new(&experiment, part, 0.95).mix(i).unwrap());
            let t_alpha = t_of(mixes().map(|mix| mix.alpha.unwrap()).collect(), best[i]);
            assert!(t_alpha.abs() < 6.5, "{:?} patch {i}: alpha t = {t_alpha}", method.direction);
            let t_excess = t_of(mixes().map(|mix| mix.collision_excess.unwrap()).collect(), excess[i]);
            assert!(t_excess.abs() < 6.5, "{:?} patch {i}: excess t = {t_excess}", method.direction);
            let t_mix = t_of(mixes().map(|mix| mix.radiosity).collect(), exact.solution().radiosity[i]);
            assert!(t_mix.abs() < 6.5, "{:?} patch {i}: B t = {t_mix}", method.direction);
            assert!(mixes().all(|mix| mix.collision_excess.unwrap() >= 1.0 - 1e-9));
        }
    }
}

/// The ratio Var(collision)/Var(best mix), by the closed forms.
fn predicted_excess(exact: &Exact, experiment: &Experiment, best: &[f64]) -> Vec<f64> {
    let some = |variances: Vec<Option<f64>>| variances.into_iter().map(Option::unwrap).collect::<Vec<_>>();
    let [a, s, c, covariance] = match experiment.method().direction() {
        None => panic!("chains have no mix"),
        Some(Direction::Shooting) => {
            let kinds = [EstimatorKind::Absorption, EstimatorKind::Survival, EstimatorKind::Collision];
            let [a, s, c] = kinds.map(|kind| exact.shooting_variances(kind));
            [a, s, c, shooting_covariance(exact)]
        }
        Some(Direction::Gathering(birth)) => {
            let p = birth_probabilities(experiment.scene(), birth);
            let kinds = [EstimatorKind::Absorption, EstimatorKind::Survival, EstimatorKind::Collision];
            let [a, s, c] = kinds.map(|kind| some(exact.gathering_variances(kind, &p)));
            [a, s, c, some(gathering_covariance(exact, &p))]
        }
    };
    let excess = |i: usize| {
        let (w, v) = (best[i], 1.0 - best[i]);
        c[i] / (w * w * s[i] + v * v * a[i] + 2.0 * w * v * covariance[i])
    };
    (0..best.len()).map(excess).collect()
}

/// The number of standard errors by which the mean of some values is off.
fn t_of(values: Vec<f64>, expected: f64) -> f64 {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean - expected) / (variance / n).sqrt()
}

#[test]
fn a_mix_is_refused_where_it_has_no_meaning() {
    let build = |spec: &SceneSpec| Scene::build(spec, IndexChoice::Auto).unwrap();
    let refused = Experiment::new(build(&coloured_box()), Method::shooting(Score::Mix));
    assert!(matches!(refused, Err(Unfit::MixInColour)));
}

/// If walks are cut off early, every channel is too small by no more than its bound.
#[test]
fn cut_off_walks_are_biased_within_the_bound_of_their_channel() {
    let spec = coloured_box();
    let truth = truth(&spec);
    for direction in [Direction::Shooting, Direction::Gathering(Birth::Area)] {
        for infinite in [InfiniteEnd::Cutoff { threshold: 0.2 }, InfiniteEnd::Length { length: 2 }] {
            let method =
                Walks { direction: direction.clone(), ..Walks::shooting(Estimator::Infinite(infinite)) };
            let experiment = experiment(&spec, IndexChoice::Auto, method);
            let solution = Solution::new(&experiment, &walk(&experiment, 3, 0..500_000), 0.95);
            for (i, truth) in truth.iter().enumerate() {
                for (estimate, truth) in solution.face(i).unwrap().into_iter().zip(truth) {
                    let noise = 5.0 * estimate.std_error.unwrap();
                    let missing = truth - estimate.radiosity;
                    assert!(missing >= -noise, "patch {i}: {missing} {noise}");
                    assert!(missing <= estimate.bias_bound + noise, "patch {i}: {missing} {estimate:?}");
                }
            }
        }
    }
}
