//! Measures the gain of a final gather for a chosen patch:
//! `radwalk-lab gather [SCENE…]`. Mean squared relative errors of one patch over
//! independent runs, times processor time, over those of collision walks. One core; ten minutes for all.

use std::ops::Range;

use super::{Failure, collision_shooting, processor_seconds};
use exact::Exact;
use radiosity::{
    Birth, Board, Chains, Estimates, Estimator, Experiment, IndexChoice, Method, Scene, SceneSpec, Sequence,
    methods::{BatchScore, Batches, Sampler, Solve},
};
use scenes::{cornell, corridor, cube};

/// The numbers of batches of walks, and of chains, in a run.
const BATCHES: u64 = 16;
const CHAINS: u64 = 8;

struct GatherStudy {
    name: &'static str,
    spec: SceneSpec,
    /// The numbers of the patches, with a word for each.
    patches: &'static [(u32, &'static str)],
    /// The number of rays in a run of walks.
    rays: u64,
    runs: u64,
}

pub(crate) fn run(wanted: &[String]) -> Result<(), Failure> {
    println!(
        "| scene, patch | method | rms error [%] | seconds | gain at equal time |\n|---|---|---|---|---|"
    );
    for study in studies() {
        if wanted.is_empty() || wanted.iter().any(|name| name == study.name) {
            measure(&study)?;
        }
    }
    Ok(())
}

fn studies() -> [GatherStudy; 3] {
    [
        GatherStudy {
            name: "cube54",
            spec: cube(3),
            patches: &[(53, "corner across"), (0, "corner beside the emitter")],
            rays: 1 << 18,
            runs: 200,
        },
        GatherStudy {
            name: "long box",
            spec: corridor(8),
            patches: &[(9, "corner of the dark end")],
            rays: 1 << 20,
            runs: 100,
        },
        GatherStudy {
            name: "Cornell box",
            spec: cornell(),
            patches: &[(300, "ceiling"), (1500, "wall")],
            rays: 1 << 20,
            runs: 40,
        },
    ]
}

fn measure(study: &GatherStudy) -> Result<(), Failure> {
    let scene = Scene::build(&study.spec, IndexChoice::Auto)?;
    let walks = collision_shooting(scene.clone())?;
    let plain = walks.method().clone();
    let (_, rays) = solve(&walks, 3, 0..20_000)?;
    let count = (study.rays as f64 * 20_000.0 / rays as f64) as u64;
    // Solving hidden pairs of thousands of patches takes too long.
    let exact = (study.name != "Cornell box").then(|| Exact::of_scene(&study.spec)).transpose()?;
    for &(patch, what) in study.patches {
        let links = |rays: u64| Method::chains(rays / CHAINS);
        let gathered_links = |rays: u64| {
            let (rays, solve) = (rays / CHAINS, Solve::Links);
            Method::from(Chains { rays, linear: false, solve, final_gather: vec![patch] })
        };
        let births = Method::gathering(Birth::Patches(vec![patch]), Estimator::Collision);
        let batch = |sampler| {
            let score = BatchScore::FinalGather(vec![patch]);
            Method::from(Batches { walks: count / BATCHES, sampler, score })
        };
        let truth = match &exact {
            Some(exact) => exact.solution().radiosity[patch as usize],
            None => {
                let long = Experiment::new(scene.clone(), gathered_links(8 * study.rays))?;
                solve(&long, 11, 0..CHAINS)?.0[patch as usize]
            }
        };
        let mut baseline = None;
        for (name, method, units) in [
            ("collision walks", plain.clone(), count),
            ("gathering walks from the patch", births, count),
            ("walks + final gather", batch(Sampler::Random), BATCHES),
            ("Sobol walks + final gather", batch(Sampler::Sobol), BATCHES),
            ("chains", links(study.rays), CHAINS),
            ("chains + final gather", gathered_links(study.rays), CHAINS),
        ] {
            let experiment = Experiment::new(scene.clone(), method)?;
            let start = processor_seconds();
            let runs = (0..study.runs).map(|run| {
                let b = solve(&experiment, 2, run * units..(run + 1) * units)?.0;
                Ok((b[patch as usize] / truth - 1.0).powi(2))
            });
            let squares = runs.collect::<Result<Vec<f64>, Failure>>()?;
            let seconds = (processor_seconds() - start) / study.runs as f64;
            let n = squares.len() as f64;
            let mean = squares.iter().sum::<f64>() / n;
            let spread = squares.iter().map(|square| (square - mean).powi(2)).sum::<f64>() / (n - 1.0);
            let error = (spread / n).sqrt() / mean;
            let (work, before) = *baseline.get_or_insert((mean * seconds, error));
            let gain = work / (mean * seconds);
            println!(
                "| {}, {what} ({patch}) | {name} | {:.3} | {seconds:.4} | {gain:.2} ± {:.2} |",
                study.name,
                100.0 * mean.sqrt(),
                gain * error.hypot(before)
            );
        }
    }
    Ok(())
}

/// B of every patch [W/m²], 0 where it is not known, and the number of rays.
fn solve(experiment: &Experiment, seed: u64, units: Range<u64>) -> Result<(Vec<f64>, u64), Failure> {
    let mut board: Board = experiment.board();
    experiment.walk(&Sequence::new(seed), units, &mut board);
    let tally = board.take()?;
    let estimates = Estimates::new(experiment, &tally, 0.95);
    let b = estimates.iter().map(|(_, _, known)| known.map_or(0.0, |known| known[0].radiosity));
    Ok((b.collect(), tally.counts.rays))
}
