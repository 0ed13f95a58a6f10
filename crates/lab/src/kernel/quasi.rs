//! Measures the gain of Sobol sequences over random numbers, in discrete and in continuous walks and in stochastic
//! Jacobi iterations: `radwalk-lab quasi [SCENE…]`. Relative variances of whole batches
//! (chains), as means by area over the patches that do not emit; processor time of one core, both timed in turn. A
//! quarter of an hour for all.

use std::ops::Range;

use super::{Failure, processor_seconds};
use radiosity::{
    Board, Chains, Estimates, Estimator, Experiment, IndexChoice, Method, Scene, SceneSpec, Sequence, Space,
    Walks,
    methods::{BatchScore, Batches, Iterations, Sampler, Solve},
    surfaces::Face,
};
use scenes::{cornell, cube, interior};

pub(crate) fn run(wanted: &[String]) -> Result<(), Failure> {
    let mut bright = cube(3);
    bright.surfaces.iter_mut().for_each(|face| face.reflectance = 0.95.into());
    let studies: [(&str, SceneSpec, &[u32], u64); 5] = [
        ("cube54", cube(3), &[12, 16, 20], 40),
        ("cube54-R95", bright, &[12, 16, 18], 40),
        ("cube3456", cube(24), &[16, 20], 12),
        ("cornell", cornell(), &[16, 20], 12),
        ("interior", interior(57_000), &[20], 6),
    ];
    println!("| scene | | paths | at equal rays | time per ray | at equal time |\n|---|---|---|---|---|---|");
    for (name, spec, powers, runs) in studies {
        if wanted.is_empty() || wanted.iter().any(|wanted| wanted == name) {
            let scene = Scene::build(&spec, IndexChoice::Auto)?;
            for &power in powers {
                for kind in ["discrete", "continuous", "Jacobi"] {
                    compare(name, &scene, kind, power, runs)?;
                }
            }
        }
    }
    Ok(())
}

/// One row of the table.
fn compare(name: &str, scene: &Scene, kind: &str, power: u32, runs: u64) -> Result<(), Failure> {
    let paths = 1_u64 << power;
    let chains = |sampler| {
        let solve = Solve::Iterations(Iterations { sampler, ..Iterations::default() });
        Method::from(Chains { rays: paths, linear: false, solve, final_gather: Vec::new() })
    };
    let space = if kind == "continuous" { Space::Continuous } else { Space::Discrete };
    let (random, sobol, units) = match kind {
        "Jacobi" => (chains(Sampler::Random), chains(Sampler::Sobol), 1),
        _ => {
            let score = BatchScore::Of(Estimator::Collision, space);
            let walks = Walks { space, ..Walks::shooting(Estimator::Collision) };
            (walks.into(), Batches { walks: paths, sampler: Sampler::Sobol, score }.into(), paths)
        }
    };
    let experiments =
        [(random, units), (sobol, 1)].map(|(method, units)| (Experiment::new(scene.clone(), method), units));
    let mut all = [Vec::new(), Vec::new()];
    let (mut seconds, mut rays) = ([0.0; 2], [0_u64; 2]);
    for run in 0..runs {
        for (k, (experiment, units)) in experiments.iter().enumerate() {
            let experiment = experiment.as_ref().map_err(Clone::clone)?;
            let start = processor_seconds();
            let (b, shot) = radiosities(experiment, run * units..(run + 1) * units)?;
            seconds[k] += processor_seconds() - start;
            rays[k] += shot;
            all[k].push(b);
        }
    }
    let [random, sobol] = variances(scene, &all);
    let gain = random[0] / sobol[0];
    let error = gain * (random[1] / random[0]).hypot(sobol[1] / sobol[0]);
    let time = seconds[1] * rays[0] as f64 / (seconds[0] * rays[1] as f64);
    let (now, then) = (gain / time, error / time);
    println!("| {name} | {kind} | 2^{power} | {gain:.2} ± {error:.2} | {time:.2} | {now:.2} ± {then:.2} |");
    Ok(())
}

/// B of every patch by some walks or batches [W/m²], and their rays.
fn radiosities(experiment: &Experiment, units: Range<u64>) -> Result<(Vec<f64>, u64), Failure> {
    let mut board: Board = experiment.board();
    experiment.walk(&Sequence::new(7), units, &mut board);
    let tally = board.take()?;
    let estimates = Estimates::new(experiment, &tally, 0.95);
    let b = estimates.known().map(|(_, _, channels)| channels[0].radiosity).collect();
    Ok((b, tally.counts.rays))
}

/// The mean relative variance of either kind of runs, and its standard error as the runs give it.
fn variances(scene: &Scene, all: &[Vec<Vec<f64>>; 2]) -> [[f64; 2]; 2] {
    let patches: Vec<Face> = scene.faces().iter().collect();
    let mean = |runs: &[Vec<f64>], i: usize| runs.iter().map(|run| run[i]).sum::<f64>() / runs.len() as f64;
    let means = all.each_ref().map(|runs| (0..patches.len()).map(|i| mean(runs, i)).collect::<Vec<_>>());
    let judged = |&i: &usize| !patches[i].emittance.is_lit() && means[0][i] * means[1][i] > 0.0;
    let judged: Vec<usize> = (0..patches.len()).filter(judged).collect();
    [0, 1].map(|k| {
        let n = all[k].len() as f64;
        let square = |run: &Vec<f64>, i: usize| {
            let truth = 0.5 * (means[0][i] + means[1][i]);
            patches[i].area * ((run[i] - means[k][i]) / truth).powi(2) * n / (n - 1.0)
        };
        let squares: Vec<f64> =
            all[k].iter().map(|run| judged.iter().map(|&i| square(run, i)).sum()).collect();
        let mean = squares.iter().sum::<f64>() / n;
        let spread = squares.iter().map(|square| (square - mean).powi(2)).sum::<f64>() / (n - 1.0);
        [mean, (spread / n).sqrt()]
    })
}
