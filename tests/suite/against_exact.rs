//! Tests of walks against the exact solution: estimates are unbiased, their variance is that of the closed form, and
//! intervals cover as often as they say.

use crate::common::{box_scene, collision, cube54, experiment, surface, variance, walk, walk_in_blocks};
use exact::Exact;
use glam::DVec3;
use radiosity::{EstimatorKind, Experiment, IndexChoice, SceneSpec, Solution, Space};
use stats::{Coverage, Interval, mean_squared_z};

/// A scene and its exact radiosities.
struct Case {
    name: &'static str,
    experiment: Experiment,
    exact: Exact,
}

impl Case {
    fn new(name: &'static str, spec: &SceneSpec) -> Self {
        let experiment = experiment(spec, IndexChoice::Auto, collision(Space::Discrete));
        Case { name, experiment, exact: Exact::of_scene(spec).unwrap() }
    }

    /// Patches that reflect and do not emit.
    fn receivers(&self) -> impl Iterator<Item = usize> + '_ {
        let patches = self.experiment.scene().faces().iter().enumerate();
        patches.filter(|(_, p)| p.emittance[0] == 0.0 && p.reflectance[0] > 0.0).map(|(i, _)| i)
    }

    fn truth(&self, patch: usize) -> f64 {
        self.exact.solution().radiosity[patch]
    }

    /// Hits of a patch that `walks` walks are expected to make: N·φ_i/Φ_T.
    fn expected_hits(&self, patch: usize, walks: u64) -> f64 {
        walks as f64 * self.exact.solution().incoming[patch] / self.exact.total_power()
    }
}

/// The cube of S97 fig. 2 and two boxes of other proportions with several emitters of unlike reflectance.
fn cases() -> [Case; 3] {
    let mut flat = box_scene(DVec3::new(2.0, 1.0, 0.5), [3, 3]);
    flat.surfaces[1].cell_emittance = vec![(2, 3.0.into()), (7, 0.5.into())];
    flat.surfaces[5].cell_emittance = vec![(4, 2.0.into())];
    let mut long = box_scene(DVec3::new(1.0, 1.0, 4.0), [4, 2]);
    long.surfaces[2].cell_emittance = vec![(5, 0.2.into())];
    long.surfaces[4].reflectance = 0.0.into();
    [Case::new("cube54", &cube54()), Case::new("flat box", &flat), Case::new("long box", &long)]
}

/// Six patches, R + E = 1 (BS table 1).
fn cube6(reflectance: f64) -> SceneSpec {
    let shapes = crate::common::box_walls(DVec3::ONE, [1, 1]);
    let surfaces = shapes.into_iter().map(|shape| radiosity::SurfaceSpec {
        emittance: (1.0 - reflectance).into(),
        ..surface(shape, reflectance)
    });
    SceneSpec::new(surfaces.collect())
}

/// 200 seeds of 10⁵ walks: the squared error over the squared standard error is 1 in the mean. Pooled over
/// n ≥ 9,000 intervals of a scene the mean has a standard error of √(2/n) ≤ 1.5 %; 5 % off is 3.3 σ: false-alarm
/// rate 10⁻³ a scene, once and for all with these seeds. The 95 % intervals of the same runs, ≥ 20,000 of them
/// on patches that expect ≥ 100 hits, cover 94.4 … 95.6 % (standard error 0.13 %).
#[test]
fn radiosities_are_unbiased_and_their_errors_true() {
    const WALKS: u64 = 100_000;
    let mut coverage = Coverage::default();
    for case in cases() {
        let mut z = Vec::new();
        for seed in 1..=200 {
            let solution = Solution::new(&case.experiment, &walk(&case.experiment, seed, 0..WALKS), 0.95);
            for patch in case.receivers() {
                let estimate = solution.estimates[patch].unwrap();
                let truth = case.truth(patch);
                z.push((estimate.radiosity - truth) / estimate.std_error.unwrap());
                if case.expected_hits(patch, WALKS) >= 100.0 {
                    coverage.record(&Interval { low: estimate.ci_low, high: estimate.ci_high }, truth);
                }
            }
        }
        let bias = z.iter().sum::<f64>() / (z.len() as f64).sqrt();
        let squared = mean_squared_z(z).unwrap();
        println!("{}: mean z {bias:.2} σ from 0, mean squared z {squared:?}", case.name);
        assert!((squared.value - 1.0).abs() < 0.05, "{}: mean squared z is {squared:?}", case.name);
    }
    let rate = coverage.rate(0.95).unwrap();
    println!("coverage of {} intervals: {rate:?}", coverage.trials);
    assert!(coverage.trials >= 20_000);
    assert!((0.944..=0.956).contains(&rate.value), "{rate:?}");
}

/// 95 % intervals of patches that expect few hits: 10 … 100, and fewer than 10 (down to 0.1, where most have
/// none). At least 94 % cover; ≥ 20,000 intervals a class, standard error 0.16 %: where the true rate is 95 %,
/// false-alarm rate 10⁻⁹.
#[test]
fn intervals_of_rare_patches_cover() {
    let mut classes = [
        (10.0, 100.0, Coverage::default()),
        (1.0, 10.0, Coverage::default()),
        (0.1, 1.0, Coverage::default()),
    ];
    for case in cases() {
        for walks in [30, 300, 3_000] {
            for seed in 1001..=1600 {
                let solution = Solution::new(&case.experiment, &walk(&case.experiment, seed, 0..walks), 0.95);
                for patch in case.receivers() {
                    let expected = case.expected_hits(patch, walks);
                    let estimate = solution.estimates[patch].unwrap();
                    for (low, high, coverage) in &mut classes {
                        if (*low..*high).contains(&expected) {
                            coverage.record(
                                &Interval { low: estimate.ci_low, high: estimate.ci_high },
                                case.truth(patch),
                            );
                        }
                    }
                }
            }
        }
    }
    for (low, high, coverage) in classes {
        let rate = coverage.rate(0.95).unwrap();
        println!("{low} … {high} hits expected: {} intervals, {rate:?}", coverage.trials);
        assert!(coverage.trials >= 20_000);
        assert!(rate.value >= 0.94, "{low} … {high} hits expected: {rate:?}");
    }
}

/// The variance of one walk is b_i[(R_iΦ_T/A_i)(1 + 2R_iξ_i) − b_i] (S97 §2.4), judged by the sample's own
/// scatter over 400 blocks of walks. 59 z-scores in all at |z| < 4.5: false-alarm rate 4·10⁻⁴, once and for all with this seed.
/// On the six-patch cube at R = 0.9, squaring hits one by one would be off by a factor of 2.
#[test]
fn variances_of_walks_are_those_of_the_closed_form() {
    // The blocks are the sample: longer ones would tell no more of the variance.
    const WALKS: u64 = 2_000_000;
    let cases = [Case::new("cube54", &cube54()), Case::new("cube6-r90", &cube6(0.9))];
    for case in &cases {
        let predicted = case.exact.shooting_variances(EstimatorKind::Collision);
        let blocks = walk_in_blocks(&case.experiment, 7, WALKS, 400);
        let mut worst = 0.0_f64;
        for (i, patch) in case.experiment.scene().faces().iter().enumerate() {
            let measured = variance(&blocks, i);
            // From the variance of B [(W/m²)²] to that of the number of hits.
            let unit = patch.reflectance[0] * case.experiment.scene().total_power(0) / patch.area;
            let z = measured.z(predicted[i] / (unit * unit));
            worst = worst.max(z.abs());
            assert!(z.abs() < 4.5, "{} patch {i}: {measured:?} is {z:.2} σ off", case.name);
        }
        println!("{}: largest |z| {worst:.2}", case.name);
    }
}

/// In a closed scene of one E and R, B = E/(1 − R) on every patch, whatever the shape: here a bumpy sphere of
/// triangles, discrete and continuous. Mean squared z over 1,280 patches, |z| < 4: false-alarm rate 6·10⁻⁵.
#[test]
fn a_furnace_glows_evenly() {
    let mut spec = crate::common::bumpy_sphere(2, 2);
    for surface in &mut spec.surfaces {
        (surface.reflectance, surface.emittance) = (0.6.into(), 2.0.into());
    }
    for space in [Space::Discrete, Space::Continuous] {
        let experiment = experiment(&spec, IndexChoice::Auto, collision(space));
        let tally = walk(&experiment, 3, 0..150_000);
        assert_eq!(tally.counts.absorbed, tally.counts.walks, "emitted = absorbed, exactly");
        let solution = Solution::new(&experiment, &tally, 0.95);
        let z = solution.estimates.iter().flatten().map(|e| (e.radiosity - 5.0) / e.std_error.unwrap());
        let measured = mean_squared_z(z).unwrap();
        assert!(measured.z(1.0).abs() < 4.0, "{space:?}: {measured:?}");
    }
}
