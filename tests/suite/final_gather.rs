//! Tests of a final gather against exact solutions: the chosen patches and all others, by walks and by chains.

use crate::common::{box_scene, quad, surface};
use crate::verdict::{Mean, Truth, exactly, judge_those, solve};
use glam::DVec3;
use radiosity::{
    Chains, Experiment, IndexChoice, Method, Scene, SceneSpec, Sides, Spectrum, SurfaceSpec, Unfit,
    methods::{BatchScore, Batches, Iterations, Sampler, Solve},
};

/// The chosen patches: corners beside and across from the emitter of the cube, and the middle of a wall.
const CHOSEN: [u32; 3] = [0, 31, 53];

fn walks(walks: u64, sampler: Sampler, chosen: &[u32]) -> Method {
    Batches { walks, sampler, score: BatchScore::FinalGather(chosen.to_vec()) }.into()
}

fn chains(rays: u64, solve: Solve, chosen: &[u32]) -> Method {
    Chains { rays, linear: false, solve, final_gather: chosen.to_vec() }.into()
}

fn experiment(spec: &SceneSpec, method: Method) -> Experiment {
    Experiment::new(Scene::build(spec, IndexChoice::Auto).unwrap(), method).unwrap()
}

/// Checks the mean squared z and the coverage of chosen patches and of others; `blunt` bounds the standard error of the
/// former's.
fn both_are_true(experiment: &Experiment, truth: &Truth, seeds: u64, blunt: f64) {
    let chosen = experiment.method().final_gather();
    judge_those(experiment, truth, seeds, |patch| chosen.contains(&patch)).agrees(blunt);
    judge_those(experiment, truth, seeds / 4, |patch| !chosen.contains(&patch)).agrees(blunt);
}

#[test]
fn intervals_are_true_with_walks() {
    let cube = scenes::cube(3);
    let truth = exactly(&cube);
    for sampler in [Sampler::Random, Sampler::Sobol] {
        both_are_true(&experiment(&cube, walks(1 << 10, sampler, &CHOSEN)), &truth, 400, 0.1);
    }
}

#[test]
fn intervals_are_true_with_chains() {
    let cube = scenes::cube(3);
    let truth = exactly(&cube);
    for solve in [Solve::Links, Solve::Iterations(Iterations::default())] {
        both_are_true(&experiment(&cube, chains(1 << 12, solve, &CHOSEN)), &truth, 400, 0.1);
    }
}

/// The scene has colour, a two-sided wall that hides the emitter from some patches and is gathered from on both sides,
/// an emitter that is gathered on, and one that a chosen patch touches.
#[test]
fn intervals_are_true_in_any_scene() {
    let mut coloured = scenes::cube(3);
    coloured.surfaces[2].reflectance = Spectrum::rgb([0.9, 0.5, 0.1]);
    coloured.surfaces[0].cell_emittance.push((0, Spectrum::rgb([0.0, 0.5, 2.0])));
    let channels: Vec<Truth> = (0..3).map(|c| exactly(&coloured.channel(c))).collect();
    let truth: Truth = (0..54).flat_map(|i| channels.iter().map(move |channel| channel[i])).collect();
    // Patch 1 is beside both emitters; 18 touches the second at a right angle.
    for method in [walks(1 << 11, Sampler::Random, &[1, 18, 40]), chains(1 << 12, Solve::Links, &[1, 18, 40])]
    {
        both_are_true(&experiment(&coloured, method), &truth, 300, 0.1);
    }

    let mut parted = box_scene(DVec3::new(2.0, 1.0, 1.0), [3, 3]);
    let wall = quad(DVec3::new(1.1, 0.0, 0.0), DVec3::Y, 0.7 * DVec3::Z, [2, 2]);
    let first = Scene::build(&parted, IndexChoice::Auto).unwrap().faces().len() as u32;
    parted.surfaces.push(SurfaceSpec { sides: Sides::Both, ..surface(wall, 0.7) });
    let chosen = [first + 1, 20, 40];
    let truth = exactly(&parted);
    // The chosen patches of a chain err together: it takes more seeds to know their z².
    both_are_true(&experiment(&parted, chains(1 << 12, Solve::Links, &chosen)), &truth, 500, 0.1);
    both_are_true(&experiment(&parted, walks(1 << 11, Sampler::Random, &chosen)), &truth, 300, 0.2);
}

/// Tests the gain of a chosen patch, and that the others lose nothing.
#[test]
fn the_chosen_err_less_and_the_others_as_before() {
    let cube = scenes::cube(3);
    let truth = exactly(&cube);
    let plain = experiment(&cube, walks(1 << 10, Sampler::Random, &[]));
    let gathered = experiment(&cube, walks(1 << 10, Sampler::Random, &CHOSEN));
    let mut errors = [Vec::new(), Vec::new()];
    for seed in 0..100 {
        let [before, after] = [&plain, &gathered].map(|experiment| solve(experiment, seed, 8).estimates);
        for (i, (before, after)) in before.iter().zip(&after).enumerate() {
            if !CHOSEN.contains(&(i as u32)) {
                assert_eq!(before, after, "patch {i}");
            }
        }
        for (errors, found) in errors.iter_mut().zip([before, after]) {
            let square = |&i: &u32| {
                let (truth, _) = truth[i as usize];
                (found[i as usize].unwrap().radiosity / truth - 1.0).powi(2)
            };
            errors.push(CHOSEN.iter().map(square).sum::<f64>());
        }
    }
    let [before, after] = errors.map(|errors| Mean::of(&errors));
    println!("{before:?} {after:?}");
    // The factor is 17 ± 2, 4.7 standard errors above the limit: false-alarm rate 10⁻⁶.
    assert!(6.0 * after.value < before.value);
}

#[test]
fn what_would_be_wrong_is_refused() {
    let unfit = |spec: &SceneSpec, method: Method| {
        Experiment::new(Scene::build(spec, IndexChoice::Auto).unwrap(), method).unwrap_err()
    };
    let cube = scenes::cube(1);
    for method in [walks(100, Sampler::Random, &[6]), chains(100, Solve::Links, &[6])] {
        assert_eq!(unfit(&cube, method), Unfit::NoSuchPatch { patch: 6, patches: 6 });
    }
}
