//! Tests of walks that go on from the point they hit: their limit, and the theory of their variance.

use crate::common::{box_scene, collision, experiment, variance, walk, walk_in_blocks};
use exact::Exact;
use glam::DVec3;
use radiosity::{Birth, Estimator, IndexChoice, SceneSpec, Solution, Space, Tally, Walks};
use stats::{Measured, Moments};

/// A box of unlike walls, one of which emits all over, so that patches change nothing but the resolution.
fn lit_box(cells: u32) -> SceneSpec {
    let mut spec = box_scene(DVec3::new(1.0, 1.5, 0.7), [cells, cells]);
    spec.surfaces[0].cell_emittance.clear();
    spec.surfaces[0].emittance = 1.0.into();
    spec
}

/// B averaged over each wall [W/m²].
fn wall_means(spec: &SceneSpec) -> Vec<f64> {
    let exact = Exact::of_scene(spec).unwrap();
    let walls = exact.solution().radiosity.chunks(exact.face_count() / 6);
    walls.map(|patches| patches.iter().sum::<f64>() / patches.len() as f64).collect()
}

/// The radiosity system's answer approaches that of continuous walks as patches shrink: the largest error over
/// the walls more than halves each time their sides are halved, from 2 cells to 8, and at 8 no more is left than the
/// last step was. The continuous walks' own errors, 6·10⁻⁵, are allowed for at 4.5 standard errors (6 walls: false-alarm rate 4·10⁻⁵, once and for all with this seed).
#[test]
fn discrete_answers_converge_to_continuous_ones() {
    let experiment = experiment(&lit_box(1), IndexChoice::Auto, collision(Space::Continuous));
    let solution = Solution::new(&experiment, &walk(&experiment, 21, 0..20_000_000), 0.95);
    let walls: Vec<_> = solution.estimates.iter().map(|estimate| estimate.unwrap()).collect();
    let noise = |i: usize| 4.5 * walls[i].std_error.unwrap();
    let means = [1, 2, 4, 8].map(|cells| wall_means(&lit_box(cells)));
    let errors = means
        .each_ref()
        .map(|means| (0..6).map(|i| (means[i] - walls[i].radiosity).abs()).fold(0.0, f64::max));
    println!("errors at 1, 2, 4, 8 cells a side: {errors:?}");
    let largest_noise = (0..6).map(noise).fold(0.0, f64::max);
    assert!(
        errors[0] > errors[1] && errors[1] > 5.0 * largest_noise,
        "coarse patches are visibly off: {errors:?}"
    );
    assert!(errors[1] > 2.0 * (errors[2] - largest_noise), "{errors:?}");
    assert!(errors[2] > 2.0 * (errors[3] - largest_noise), "{errors:?}");
    for i in 0..6 {
        let step = (means[3][i] - means[2][i]).abs();
        let left = (means[3][i] - walls[i].radiosity).abs();
        assert!(left < step + noise(i), "wall {i}: {left} left after a step of {step}");
    }
}

/// Blocks of continuous absorption gathering onto one patch, and the b of one unit of score [W/m²].
fn gathered(spec: &SceneSpec, seed: u64) -> (Vec<Tally>, f64) {
    let birth = Birth::Patches(vec![TARGET as u32]);
    let method = Walks { space: Space::Continuous, ..Walks::gathering(birth, Estimator::Absorption) };
    let experiment = experiment(spec, IndexChoice::Auto, method);
    let blocks = walk_in_blocks(&experiment, seed, WALKS, 400);
    let meaning = experiment.meaning(TARGET, 0, &blocks[0]).unwrap();
    let reflectance = experiment.scene().faces().get(TARGET).reflectance[0];
    (blocks, reflectance * meaning.irradiance_per_event.unwrap() * meaning.unit)
}

const TARGET: usize = 13;
const WALKS: u64 = 2_000_000;

/// The mean score of a walk on the target, with its error.
fn mean(blocks: &[Tally]) -> Measured {
    let mut whole = blocks[0].clone();
    blocks[1..].iter().for_each(|block| whole.merge(block).unwrap());
    let sums = whole.patch(TARGET, 0);
    let moments = Moments { n: WALKS, sum: sums[0], sum_sq: sums[1] };
    Measured { value: moments.mean().unwrap(), standard_error: moments.standard_error().unwrap() }
}

/// S97 eq. 11: the variance of absorption gathering does not know of patches. Walks that go on from the hit point
/// have R_i Σ_s E_s/(1 − R_s) b_is − b_i², b_is being what source s alone would give, here from walks of their own. The
/// z-score, by the scatter of blocks of walks and the errors of the b_is, is within 4.5: false-alarm rate 7·10⁻⁶,
/// once and for all with these seeds. By a wrong weight of the sources (E_s instead of E_s/(1 − R_s)) it would be 50
/// and more.
#[test]
fn the_variance_of_absorption_gathering_holds_at_a_point() {
    let sources = [(0, 1.0), (5, 3.0)];
    let with = |lit: &[(usize, f64)]| {
        let mut spec = lit_box(2);
        spec.surfaces[0].emittance = radiosity::Spectrum::BLACK;
        for &(wall, emittance) in lit {
            spec.surfaces[wall].emittance = emittance.into();
        }
        spec
    };
    let both = with(&sources);
    let (blocks, unit) = gathered(&both, 31);
    let variance = variance(&blocks, TARGET);
    let measured = variance.value * unit * unit;
    let measured_error = variance.standard_error * unit * unit;
    let b = mean(&blocks).value * unit;

    let reflectance = both.surfaces[TARGET / 4].reflectance[0];
    let (mut expected, mut expected_error_sq) = (-b * b, 0.0);
    for (k, source) in sources.iter().enumerate() {
        let (blocks, unit) = gathered(&with(&[*source]), 32 + k as u64);
        let mean = mean(&blocks);
        let worth = reflectance * source.1 / (1.0 - both.surfaces[source.0].reflectance[0]);
        expected += worth * mean.value * unit;
        expected_error_sq += (worth * mean.standard_error * unit).powi(2);
    }
    let z = (measured - expected) / (measured_error.powi(2) + expected_error_sq).sqrt();
    println!("measured {measured}, expected {expected}, z = {z}");
    assert!(z.abs() < 4.5, "{z}");
}
