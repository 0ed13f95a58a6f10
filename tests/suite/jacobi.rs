//! Tests of chains of stochastic Jacobi against exact solutions, against walks and against themselves: means, standard
//! errors, intervals. Long versions: `cargo test --release --test suite jacobi:: -- --ignored --nocapture`, some
//! minutes.

use crate::common::{box_scene, collision, quad, surface};
use crate::verdict::{
    CHAINS, CONFIDENCE, Mean, Truth, biases, classes, exactly, judge, judge_those, long_run, run, solve,
};
use glam::DVec3;
use radiosity::{
    Chains, Counts, Estimator, EstimatorKind, Experiment, IndexChoice, Method, Scene, SceneSpec, Sequence,
    Sides, Solution, Space, Spectrum, SurfaceSpec,
    instruments::IterationPhase,
    methods::{BatchScore, Batches, Iterations, RayBirths, Sampler, Solve},
};

fn experiment(spec: &SceneSpec, method: impl Into<Method>) -> Experiment {
    Experiment::new(Scene::build(spec, IndexChoice::Auto).unwrap(), method).unwrap()
}

/// An experiment of chains with `chain_rays` rays each.
fn chains(spec: &SceneSpec, chain_rays: u64) -> Experiment {
    experiment(spec, Method::chains(chain_rays))
}

/// An experiment of chains by iterations.
fn iterations(spec: &SceneSpec, chain_rays: u64, plan: Iterations) -> Experiment {
    let solve = Solve::Iterations(plan);
    experiment(spec, Chains { rays: chain_rays, linear: false, solve, final_gather: Vec::new() })
}

/// An experiment of batches with `walks` shooting walks each.
fn sobol(spec: &SceneSpec, walks: u64, estimator: impl Into<Estimator>, space: Space) -> Experiment {
    let score = BatchScore::Of(estimator.into(), space);
    experiment(spec, Batches { walks, sampler: Sampler::Sobol, score })
}

#[test]
fn intervals_are_true_on_cube54_down_to_the_fewest_rays() {
    let cube = scenes::cube(3);
    let truth = exactly(&cube);
    for chain_rays in [16 * 54, 1 << 12] {
        judge(&chains(&cube, chain_rays), &truth, 100).agrees(0.05);
    }
}

#[test]
fn intervals_are_true_where_light_hides() {
    let rooms = two_rooms();
    let truth = long_run(&chains(&rooms, 1 << 17), 32);
    judge(&chains(&rooms, 1 << 14), &truth, 60).agrees(0.3);
}

/// The dark end of a long box, where a link to the bright end is rare: the mean of eight chains and their spread are too low together.
/// Student's intervals as such cover 92 % there with 43 rays a patch, six standard errors of the coverage below what they say, and with 32, the fewest, those that
/// allow for a part of one more link 93.6 %. With all of it they may cover up to 97 %. False alarm: 6·10⁻⁵.
#[test]
fn intervals_are_true_where_a_dark_end_hangs_on_few_links() {
    let long_box = scenes::corridor(8);
    let truth = exactly(&long_box);
    for rays in [32, 43] {
        let coverage = judge(&chains(&long_box, rays * truth.len() as u64), &truth, 100).coverage;
        assert!(coverage.error < 0.006, "the test is blunt: {coverage:?}");
        assert!(coverage.value + 4.0 * coverage.error > CONFIDENCE, "{rays}: {coverage:?}");
        assert!(coverage.value - 4.0 * coverage.error < 0.97, "{rays}: {coverage:?}");
    }
}

/// The closed cube of 54 patches with R everywhere.
fn closed_box(reflectance: f64) -> SceneSpec {
    let mut spec = scenes::cube(3);
    spec.surfaces.iter_mut().for_each(|surface| surface.reflectance = reflectance.into());
    spec
}

/// The shortest chains in a box that light leaves slowly. The solution of the links of one chain is no linear function of them: without the
/// halves of its rays, and with rays that are aimed by what the chain itself has found, the lamp's own patch errs by more than 60 standard errors of
/// the mean of 300 runs, and the mean squared error of the others in theirs is above 5. Of 53 patches that were one in effect, the mean exceeds 3 in one of 12 draws
/// of seeds, of 8 independent ones in one of 400.
#[test]
fn the_shortest_chains_have_no_bias() {
    let spec = closed_box(0.9);
    let truth = exactly(&spec);
    let biases = biases(&chains(&spec, 32 * truth.len() as u64), &truth, 300);
    let others = biases.iter().enumerate().filter(|&(i, _)| i != 4).map(|(_, bias)| bias * bias);
    let others = others.sum::<f64>() / 53.0;
    println!("lamp {:.1}, others {others:.2}", biases[4]);
    assert!(others < 3.0, "{others}");
    // What is left is below two thirds of the standard deviation of one run, which is the standard error of 300 over √300.
    assert!(biases[4].abs() < 0.67 * 300f64.sqrt(), "the lamp: {}", biases[4]);
}

/// Eight of the shortest chains where the second room is dark, Sobol walks that hit patches 4 to 40 times, and Sobol walks in a box that is lit as evenly as it
/// can be, so that estimates lie above the most that is possible half of the time: intervals cover, and are between 0.7 times and twice the real error at the median patch of each class. False alarm of a coverage that is just at its limit: 3·10⁻⁵ each.
#[test]
fn reported_errors_are_near_the_real_ones() {
    let (rooms, cube, even) = (scenes::two_rooms(0.1, 0.5), closed_box(0.95), scenes::furnace(1, 0.9));
    let of_chains = chains(&rooms, 43 * exactly(&rooms).len() as u64);
    let of_walks = |spec, walks| sobol(spec, walks, EstimatorKind::Collision, Space::Discrete);
    let runs = [(of_chains, &rooms), (of_walks(&cube, 8), &cube), (of_walks(&even, 512), &even)];
    for (experiment, spec) in runs {
        for class in classes(&experiment, &exactly(spec), (100, CHAINS)) {
            assert!(class.coverage.value + 4.0 * class.coverage.error > 0.94, "{class:?}");
            assert!((0.7..2.0).contains(&class.median()), "{class:?}");
        }
    }
}

/// Plates of a square centimetre in a room, which meet less than one link each in all eight chains: what the few links that there are
/// bring, is no sign that the truth is near. Intervals may be wide there, and have to cover. False alarm: 3·10⁻⁵.
#[test]
fn intervals_cover_patches_that_hardly_any_link_meets() {
    let mut room = box_scene(DVec3::new(2.0, 1.0, 1.0), [3, 2]);
    let walls = 6 * 6;
    for i in 0..24 {
        let corner =
            DVec3::new(0.2 + 0.3 * f64::from(i % 6), 0.2 + 0.2 * f64::from(i / 6), 0.3 + 0.02 * f64::from(i));
        let plate = surface(quad(corner, 0.01 * DVec3::X, 0.01 * DVec3::Y, [1, 1]), 0.5);
        room.surfaces.push(SurfaceSpec { sides: Sides::Both, ..plate });
    }
    let truth = exactly(&room);
    let experiment = chains(&room, 43 * truth.len() as u64);
    let faces = experiment.scene().faces();
    let is_plate = |face: u32| faces.get(face as usize).area < 1e-3;
    assert_eq!((0..faces.len() as u32).filter(|&face| is_plate(face)).count(), truth.len() - walls);
    let coverage = judge_those(&experiment, &truth, 100, is_plate).coverage;
    assert!(coverage.error < 0.006, "the test is blunt: {coverage:?}");
    assert!(coverage.value + 4.0 * coverage.error > CONFIDENCE, "{coverage:?}");
}

/// Tests BS §4's own iterations, with both kinds of births and of numbers.
#[test]
fn intervals_of_iterations_are_true() {
    let cube = scenes::cube(3);
    let truth = exactly(&cube);
    for sampler in [Sampler::Random, Sampler::Sobol] {
        for births in [RayBirths::Systematic, RayBirths::Multinomial] {
            let plan = Iterations { births, sampler, ..Iterations::default() };
            judge(&iterations(&cube, 1 << 13, plan), &truth, 100).agrees(0.05);
        }
    }
}

/// Iterations of one chain begin where others have ended: in rooms that light leaves slowly they err together.
/// Intervals from their spread cover two thirds of the truth; those from the spread of chains cover what they say.
#[test]
fn the_spread_of_iterations_is_no_error() {
    let rooms = two_rooms();
    let truth = long_run(&chains(&rooms, 1 << 17), 32);
    let plan = Iterations::default();
    let experiment = iterations(&rooms, 1 << 14, plan);
    let quantile = stats::student_quantile(0.5 + 0.5 * CONFIDENCE, u64::from(plan.regular) - 1);
    let coverage = |chain: u64| {
        let all = experiment.iterations(&Sequence::new(5), chain).unwrap();
        let regular: Vec<_> =
            all.iter().filter(|iteration| iteration.phase == IterationPhase::Regular).collect();
        let covers = |i: &usize| {
            let b: Vec<f64> = regular.iter().map(|iteration| 0.95 * iteration.irradiance[*i]).collect();
            Mean::of(&b).is(truth[*i].0, quantile)
        };
        // Patch 0 is the emitter.
        (1..truth.len()).filter(covers).count() as f64 / (truth.len() - 1) as f64
    };
    let naive = Mean::of(&(0..60).map(coverage).collect::<Vec<_>>());
    println!("naive intervals cover {naive:?}");
    assert!(naive.value > 0.45 && naive.value + 4.0 * naive.error < 0.9, "{naive:?}");
    judge(&experiment, &truth, 60).agrees(0.3);
}

/// Tests walks that share Sobol sequences, by several estimators, and continuous ones against random ones.
#[test]
fn intervals_of_sobol_walks_are_true() {
    let cube = scenes::cube(3);
    let truth = exactly(&cube);
    for estimator in [EstimatorKind::Collision, EstimatorKind::Survival, EstimatorKind::Infinite] {
        judge(&sobol(&cube, 1 << 12, estimator, Space::Discrete), &truth, 60).agrees(0.06);
    }
    let truth = long_run(&experiment(&cube, collision(Space::Continuous)), 4_000_000);
    judge(&sobol(&cube, 1 << 12, Estimator::Collision, Space::Continuous), &truth, 60).agrees(0.06);
}

/// Tests open, hidden, two-sided and coloured scenes.
#[test]
fn intervals_are_true_in_any_scene() {
    let mut open = box_scene(DVec3::new(2.0, 1.0, 1.0), [3, 2]);
    open.surfaces.remove(1);
    judge(&chains(&open, 1 << 12), &exactly(&open), 100).agrees(0.06);

    let mut parted = box_scene(DVec3::new(2.0, 1.0, 1.0), [2, 2]);
    let wall = quad(DVec3::new(1.1, 0.0, 0.0), DVec3::Y, 0.7 * DVec3::Z, [2, 2]);
    parted.surfaces.push(SurfaceSpec { sides: Sides::Both, ..surface(wall, 0.7) });
    judge(&chains(&parted, 1 << 12), &exactly(&parted), 100).agrees(0.06);

    let mut coloured = scenes::cube(3);
    coloured.surfaces[2].reflectance = Spectrum::rgb([0.9, 0.5, 0.1]);
    coloured.surfaces[0].cell_emittance.push((0, Spectrum::rgb([0.0, 0.5, 2.0])));
    let channels: Vec<Truth> = (0..3).map(|c| exactly(&coloured.channel(c))).collect();
    let truth = (0..54).flat_map(|i| channels.iter().map(move |channel| channel[i])).collect();
    judge(&chains(&coloured, 1 << 12), &truth, 100).agrees(0.06);
}

/// A lamp hangs 5 cm under a ceiling: most of what its upper side emits is near light, which links bring. Under it a face lies in
/// contact with the floor.
#[test]
fn intervals_are_true_beside_an_emitter() {
    let mut spec = box_scene(DVec3::new(2.0, 1.0, 1.0), [3, 2]);
    spec.surfaces.iter_mut().for_each(|wall| wall.cell_emittance.clear());
    let lamp = surface(quad(DVec3::new(0.9, 0.4, 0.95), 0.2 * DVec3::X, 0.2 * DVec3::Y, [1, 1]), 0.5);
    spec.surfaces.push(SurfaceSpec { sides: Sides::Both, emittance: 1.0.into(), ..lamp });
    spec.surfaces.push(surface(quad(DVec3::new(0.5, 0.3, 0.0), 0.6 * DVec3::X, 0.4 * DVec3::Y, [2, 1]), 0.8));
    let truth = exactly(&spec);
    for chain_rays in [1 << 12, 1 << 15] {
        judge(&chains(&spec, chain_rays), &truth, 100).agrees(0.06);
    }
}

/// In a closed scene with uniform E and R, B = E/(1 − R) whatever the rays do, since no difference goes along a link: to the roundings, which the
/// intervals allow for.
#[test]
fn a_furnace_is_exact_with_any_rays() {
    let mut spec = box_scene(DVec3::new(2.0, 1.0, 1.0), [3, 2]);
    for surface in &mut spec.surfaces {
        (surface.reflectance, surface.emittance) = (0.75.into(), 0.5.into());
        surface.cell_emittance.clear();
    }
    for estimate in solve(&chains(&spec, 600), 5, 2).estimates.into_iter().flatten() {
        assert!((estimate.radiosity - 2.0).abs() < 1e-12, "{estimate:?}");
        assert!(
            estimate.ci_low < 2.0 && 2.0 < estimate.ci_high && estimate.ci_high < 2.0 + 1e-9,
            "{estimate:?}"
        );
    }
}

/// Power is emitted = absorbed + escaped, chain by chain. A black lamp hangs in an open box: the power that the lamp
/// absorbs is known to within noise, a thousandth of all, and that of the walls to the tolerance of the solver.
#[test]
fn energy_is_conserved() {
    let mut spec = box_scene(DVec3::new(2.0, 1.0, 1.0), [3, 2]);
    spec.surfaces.remove(1);
    spec.surfaces[0].cell_emittance.clear();
    let lamp = surface(quad(DVec3::new(0.9, 0.4, 0.6), 0.2 * DVec3::X, 0.2 * DVec3::Y, [1, 1]), 0.0);
    spec.surfaces.push(SurfaceSpec { sides: Sides::Both, emittance: 1.0.into(), ..lamp });
    let experiment = chains(&spec, 1 << 16);
    let scene = experiment.scene();
    for seed in 0..3 {
        let tally = run(&experiment, seed, 1);
        let estimates = Solution::new(&experiment, &tally, CONFIDENCE).estimates;
        let absorbed = scene.faces().iter().zip(estimates.into_iter().flatten()).map(|(patch, estimate)| {
            (1.0 - patch.reflectance[0]) * patch.area * estimate.irradiance.unwrap()
        });
        let escaped = tally.counts.escaped_weight[0] as f64 / Counts::WEIGHT_UNITS;
        let balance = absorbed.sum::<f64>() / scene.total_power(0) + escaped;
        assert!((balance - 1.0).abs() < 1e-3, "{balance}");
        assert!(escaped > 0.1 && tally.counts.escaped > 0, "the box is open");
    }
}

/// The first 3 of 8 chains are those of a run of 3.
#[test]
fn chains_are_a_function_of_their_number() {
    let experiment = chains(&scenes::cube(3), 2000);
    let sequence = Sequence::new(3);
    let tally = |ranges: &[[u64; 2]]| {
        let mut board = experiment.board();
        for &[start, end] in ranges {
            experiment.walk(&sequence, start..end, &mut board);
        }
        board.take().unwrap()
    };
    let whole = tally(&[[0, 8]]);
    assert_eq!(whole, tally(&[[5, 8], [0, 3], [3, 5]]));
    assert_ne!(whole, tally(&[[1, 9]]));
    assert_eq!((whole.counts.walks, whole.counts.rays), (8, 16_000));
    let landed: u128 = (0..54).map(|patch| whole.events(patch)).sum();
    assert_eq!(landed, 8 * 32 * 54, "no ray escapes a cube, and the others are shadow rays");
}

/// One chain cannot tell its error: the only bound is that no radiosity exceeds max E/(1 − max R).
#[test]
fn a_single_chain_claims_nothing() {
    let experiment = chains(&scenes::cube(3), 2000);
    for estimate in solve(&experiment, 1, 1).estimates.into_iter().flatten() {
        assert_eq!(estimate.std_error, None);
        assert!(estimate.ci_high >= 0.3 / (1.0 - 0.8) && estimate.ci_low <= 1.0, "{estimate:?}");
    }
}

#[test]
#[ignore = "a minute; run with --release"]
fn long_cube54() {
    let cube = scenes::cube(3);
    let truth = exactly(&cube);
    for chain_rays in [16 * 54, 1 << 13, 1 << 17] {
        judge(&chains(&cube, chain_rays), &truth, 200).is_true();
    }
}

#[test]
#[ignore = "minutes; run with --release"]
fn long_two_rooms() {
    let rooms = two_rooms();
    let truth = long_run(&chains(&rooms, 1 << 20), 64);
    judge(&chains(&rooms, 1 << 14), &truth, 1000).is_true();
}

#[test]
#[ignore = "minutes; run with --release"]
fn long_iterations_and_sobol_walks() {
    let (cube, rooms, cornell) = (scenes::cube(3), two_rooms(), scenes::cornell());
    let studies = [
        (&cube, exactly(&cube), [16 * 54, 1 << 13]),
        (&rooms, long_run(&chains(&rooms, 1 << 20), 64), [1 << 12, 1 << 14]),
        (
            &cornell,
            long_run(&experiment(&cornell, Method::shooting(Estimator::Collision)), 100_000_000),
            [16 * 3000, 1 << 17],
        ),
    ];
    for (spec, truth, rays) in &studies {
        for rays in rays {
            for sampler in [Sampler::Random, Sampler::Sobol] {
                for births in [RayBirths::Systematic, RayBirths::Multinomial] {
                    println!("{rays} rays, {sampler:?}, {births:?}");
                    let plan = Iterations { births, sampler, ..Iterations::default() };
                    judge(&iterations(spec, *rays, plan), truth, 200);
                }
            }
            println!("{rays} Sobol walks");
            judge(&sobol(spec, *rays, Estimator::Collision, Space::Discrete), truth, 200);
        }
    }
}

/// Measures how many rays per patch and chain intervals need if hardly any ray goes through the hole between two rooms.
#[test]
#[ignore = "minutes; run with --release"]
fn long_few_rays_in_two_rooms() {
    let rooms = two_rooms();
    let truth = long_run(&chains(&rooms, 1 << 20), 64);
    for rays_per_patch in [16, 20, 32, 64, 128, 256] {
        let rays = rays_per_patch * truth.len() as u64;
        println!("{rays_per_patch} rays per patch: links, Sobol walks");
        judge(&chains(&rooms, rays), &truth, 1000);
        judge(&sobol(&rooms, rays / 16, Estimator::Collision, Space::Discrete), &truth, 200);
    }
    for rays_per_patch in [256, 1024, 4096, 16_384] {
        for births in [RayBirths::Systematic, RayBirths::Multinomial] {
            println!("{rays_per_patch} rays per patch: iterations, {births:?}");
            let plan = Iterations { births, ..Iterations::default() };
            judge(&iterations(&rooms, rays_per_patch * truth.len() as u64, plan), &truth, 200);
        }
    }
}

/// Measures intervals of eight chains that have few rays.
#[test]
#[ignore = "minutes; run with --release"]
fn long_few_links() {
    let rooms = |reflectance| ("two rooms", scenes::two_rooms(0.1, reflectance));
    let boxes = [("long box", scenes::corridor(8)), ("box", scenes::corridor(4)), ("cube", scenes::cube(8))];
    for (name, spec) in boxes.into_iter().chain([rooms(0.5), rooms(0.95)]) {
        let truth = exactly(&spec);
        for rays_per_patch in [43, 64, 256] {
            println!("{name}, {rays_per_patch} rays per patch");
            judge(&chains(&spec, rays_per_patch * truth.len() as u64), &truth, 200);
        }
    }
}

/// The table of docs/results/intervals.md: coverage and reported over real error by expected hits, for each method.
#[test]
#[ignore = "minutes; run with --release"]
fn long_told_over_real() {
    let scenes = [
        ("closed box, R = 0.95", closed_box(0.95)),
        ("two rooms, R = 0.5", scenes::two_rooms(0.1, 0.5)),
        ("two rooms, R = 0.95", scenes::two_rooms(0.1, 0.95)),
        ("long box, 8 cubes", scenes::corridor(8)),
        ("corridor, 50 cubes", scenes::corridor(50)),
        ("cube, 384 patches", scenes::cube(8)),
    ];
    for (name, spec) in scenes {
        let truth = exactly(&spec);
        let patches = truth.len() as u64;
        let seeds = (40_000 / patches).clamp(20, 200);
        for rays in [32, 64] {
            println!("\n{name}: eight chains of {rays} rays a patch");
            classes(&chains(&spec, rays * patches), &truth, (seeds, CHAINS));
        }
        for walks in [1, 8] {
            println!("\n{name}: eight batches of {walks} Sobol walks a patch");
            let method = sobol(&spec, walks * patches, EstimatorKind::Collision, Space::Discrete);
            classes(&method, &truth, (seeds, CHAINS));
            println!("\n{name}: {walks} walks a patch, eight times as many in all");
            let method = experiment(&spec, Method::shooting(EstimatorKind::Collision));
            classes(&method, &truth, (seeds, 8 * walks * patches));
        }
    }
}

/// Tests chains against walks, which have no links.
#[test]
#[ignore = "minutes; run with --release"]
fn long_cornell() {
    let cornell = scenes::cornell();
    let truth = long_run(&experiment(&cornell, Method::shooting(Estimator::Collision)), 100_000_000);
    judge(&chains(&cornell, 1 << 17), &truth, 200).is_true();
}

/// A scene of two rooms that exchange 1 % of their light, with R = 0.95.
fn two_rooms() -> SceneSpec {
    scenes::two_rooms(0.1, 0.95)
}
