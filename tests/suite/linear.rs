//! `basis = "linear"` against the exact solution of finer patches, and on a cluster.

use std::fs;
use std::sync::OnceLock;

use crate::common::{box_scene, box_walls, experiment, quad, surface, walk};
use crate::support::{answer, path, run, run_job, storms_leave_no_trace, summary};
use exact::Exact;
use glam::DVec3;
use radiosity::{
    Direction, Estimates, Estimator, EstimatorKind, IndexChoice, SceneSpec, Shape, Space, Tally, Walks,
    methods::Score,
};
use stats::mean_squared_z;
use tempfile::tempdir;

const CUBE: &str = "tests/data/cube54.toml";
const LINEAR: [&str; 4] = ["--set", "method.basis=linear", "--paths", "300000"];

const SIZE: DVec3 = DVec3::new(1.0, 2.0, 0.7);
const CELLS: u32 = 2;

fn linear(space: Space, estimator: impl Into<Estimator>) -> Walks {
    Walks { direction: Direction::Shooting, space, score: Score::Linear(estimator.into()) }
}

/// The box whose patches walks tell of, each cut in n × n.
fn cut(n: u32) -> SceneSpec {
    let mut spec = box_scene(SIZE, [n * CELLS, n * CELLS]);
    // All of the first wall emits: a lamp's edge would bend the light within a patch.
    spec.surfaces[0].cell_emittance.clear();
    spec.surfaces[0].emittance = 1.0.into();
    spec
}

/// The moments of a patch: means of b, b·ψ₁, b·ψ₂, and of H·ψ₁², H·ψ₂².
type Moments = [f64; 5];

/// The moments over the patches of `cut(1)`, of what arrives on the cells of `cut(n)` by the means of those: H of the exact
/// solution of the scene that `emits` on each patch of `cut(1)` what leaves it, or of `cut(n)` itself.
fn moments_of(n: u32, emits: Option<&[f64]>) -> Vec<Moments> {
    let mut spec = cut(n);
    let reflectance: Vec<f64> = spec.surfaces.iter().map(|surface| surface.reflectance[0]).collect();
    let side = n * CELLS;
    if let Some(emits) = emits {
        for (number, surface) in spec.surfaces.iter_mut().enumerate() {
            let patch = |cell: u32| number as u32 * CELLS * CELLS + cell / side / n * CELLS + cell % side / n;
            (surface.reflectance, surface.emittance) = (0.0.into(), 0.0.into());
            surface.cell_emittance =
                (0..side * side).map(|cell| (cell, emits[patch(cell) as usize].into())).collect();
        }
    }
    let exact = Exact::of_scene(&spec).unwrap();
    let mut moments = vec![[0.0; 5]; (6 * CELLS * CELLS) as usize];
    for (i, h) in exact.solution().irradiance.iter().enumerate() {
        let (wall, cell) = (i as u32 / (side * side), i as u32 % (side * side));
        let [iu, iv] = [cell / side, cell % side];
        let patch = (wall * CELLS * CELLS + iu / n * CELLS + iv / n) as usize;
        let psi = [iu, iv].map(|i| (2 * (i % n) + 1) as f64 / f64::from(n) - 1.0);
        let (h, b) = (h / f64::from(n * n), h * reflectance[wall as usize] / f64::from(n * n));
        // The mean of ψ² over a cell is that of its middle, and a third of the square of half its width.
        let squares = psi.map(|psi| h * (psi * psi + 1.0 / f64::from(3 * n * n)));
        for (sum, part) in moments[patch].iter_mut().zip([b, b * psi[0], b * psi[1], squares[0], squares[1]])
        {
            *sum += part;
        }
    }
    moments
}

/// The limit of ever finer cells: errors fall with the square of their width.
fn limit(coarse: &[Moments], fine: &[Moments]) -> Vec<Moments> {
    let each = |(a, b): (&Moments, &Moments)| std::array::from_fn(|k| (4.0 * b[k] - a[k]) / 3.0);
    coarse.iter().zip(fine).map(each).collect()
}

fn truth(space: Space) -> &'static [Moments] {
    static TRUTHS: [OnceLock<Vec<Moments>>; 2] = [const { OnceLock::new() }; 2];
    TRUTHS[space as usize].get_or_init(|| {
        let emits = match space {
            Space::Discrete => Some(Exact::of_scene(&cut(1)).unwrap().solution().radiosity.clone()),
            Space::Continuous => None,
        };
        limit(&moments_of(4, emits.as_deref()), &moments_of(8, emits.as_deref()))
    })
}

/// 250 seeds of 10,000 walks: the squared error of gradients over the squared standard error is 1 in the mean. Pooled over
/// 10,000 gradients the mean has a standard error of √(2/n) = 1.4 %; 5 % off is 3.5 σ: false-alarm rate 10⁻³ in both spaces
/// together, once and for all with these seeds. The spread's square has no bias: its mean over seeds is the true one within 4.5
/// standard errors, of 40 patches (false-alarm rate 3·10⁻⁴).
#[test]
fn gradients_are_unbiased_and_their_errors_true() {
    for space in [Space::Discrete, Space::Continuous] {
        let truth = truth(space);
        let experiment = experiment(&cut(1), IndexChoice::Auto, linear(space, EstimatorKind::Collision));
        let (mut z, mut energies) = (Vec::new(), vec![[0.0; 2]; truth.len()]);
        const SEEDS: u64 = 250;
        for seed in 1..=SEEDS {
            let tally = walk(&experiment, seed, 0..10_000);
            let estimates = Estimates::new(&experiment, &tally, 0.95);
            for (i, truth) in truth.iter().enumerate() {
                let slopes = estimates.slopes(i).unwrap()[0];
                let errors = slopes.gradient_error.unwrap();
                // b = b̄ + 3·(mean of b·ψ)·ψ, and ψ = 2u − 1.
                z.extend((0..2).map(|k| (slopes.gradient[k] - 6.0 * truth[1 + k]) / errors[k]));
                energies[i][0] += slopes.energy;
                energies[i][1] += slopes.energy * slopes.energy;
            }
        }
        let squared = mean_squared_z(z.iter().copied()).unwrap();
        println!("{space:?}: mean squared z {squared:?} of {}", z.len());
        assert!((squared.value - 1.0).abs() < 0.05, "{space:?}: {squared:?}");
        for (i, ([sum, squares], truth)) in energies.iter().zip(truth).enumerate() {
            let mean = sum / SEEDS as f64;
            let error = ((squares / SEEDS as f64 - mean * mean) / (SEEDS - 1) as f64).sqrt();
            let expected = 3.0 * (truth[1] * truth[1] + truth[2] * truth[2]);
            assert!((mean - expected).abs() < 4.5 * error, "{space:?}, {i}: {mean} ± {error}, {expected}");
        }
    }
}

/// An absorption walk scores once at most, so that the mean of its squared slope is (1 − R)·A/Φ_T times the mean of H·ψ². 48
/// numbers within 4.5 standard errors: false-alarm rate 3·10⁻⁴. No fourth power is kept: since ψ⁴ ≤ ψ², one hit in n tells of
/// n within √(1/(n·mean ψ²)).
#[test]
fn variances_of_slopes_are_those_of_the_closed_form() {
    const WALKS: u64 = 2_000_000;
    let truth = truth(Space::Discrete);
    let experiment =
        experiment(&cut(1), IndexChoice::Auto, linear(Space::Discrete, EstimatorKind::Absorption));
    let tally: Tally = walk(&experiment, 3, 0..WALKS);
    let scene = experiment.scene();
    for (i, face) in scene.faces().iter().enumerate() {
        for k in 0..2 {
            let units = tally.layout().slope_units() as f64;
            let measured = tally.slope(i, 0, k).1 as f64 / (units * units) / WALKS as f64;
            let absorbed = (1.0 - face.reflectance[0]) * face.area / scene.total_power(0);
            let expected = absorbed * truth[i][3 + k];
            let error = (expected / WALKS as f64).sqrt();
            assert!((measured - expected).abs() < 4.5 * error, "{i}, {k}: {measured}, {expected} ± {error}");
        }
    }
}

/// A triangle that hangs in the room, of one cell or of rows, against the means of its cells in a job that cuts it 24 times finer.
/// Continuous walks do not know of either. 20 numbers within 4.5 standard errors: false-alarm rate 10⁻⁴.
#[test]
fn gradients_of_triangles_are_those_of_finer_patches() {
    const FINER: u32 = 24;
    let room = |rows: u32| {
        let mut surfaces: Vec<_> =
            box_walls(SIZE, [1, 1]).into_iter().map(|shape| surface(shape, 0.5)).collect();
        surfaces[1].emittance = 1.0.into();
        let [a, b, c] = [[0.2, 0.1, 0.1], [0.9, 1.2, 0.2], [0.1, 1.9, 0.5]].map(DVec3::from);
        surfaces.push(surface(Shape::Triangle { a, b, c, rows }, 0.7));
        surfaces.push(surface(quad(DVec3::splat(0.45), DVec3::X * 0.3, DVec3::Y * 0.4, [1, 1]), 0.3));
        SceneSpec::new(surfaces)
    };
    for rows in [1, 3] {
        let solve = |rows: u32, seed: u64, walks: u64| {
            let method = linear(Space::Continuous, EstimatorKind::Collision);
            let experiment = experiment(&room(rows), IndexChoice::Auto, method);
            let tally = walk(&experiment, seed, 0..walks);
            (experiment, tally)
        };
        let (coarse, fine) = (solve(rows, 1, 500_000), solve(rows * FINER, 2, 2_000_000));
        let [coarse, fine] = [&coarse, &fine].map(|(e, tally)| Estimates::new(e, tally, 0.95));
        // Means of b·ψ over each coarse cell from those of fine cells, and the squares of their errors.
        let mut expected = vec![[[0.0; 2]; 2]; (rows * rows) as usize];
        for row in 0..rows * FINER {
            for position in 0..2 * row + 1 {
                let number = 6 + row * row + position;
                let known = fine.face(number as usize).unwrap()[0];
                // The centroid, in units of the coarse cells' edges along u and v.
                let (j, inverted) = (position / 2, position % 2 == 1);
                let third = if inverted { [-1.0, 2.0] } else { [1.0, 1.0] };
                let n = f64::from(FINER);
                let u = (f64::from(row - j) + third[0] / 3.0) / n;
                let v = (f64::from(j) + third[1] / 3.0) / n;
                let (i, k) = (u.floor(), v.floor());
                let upside_down = u - i + v - k >= 1.0;
                let coarse_row = (i + k) as u32 + u32::from(upside_down);
                let cell = coarse_row * coarse_row + 2 * k as u32 + u32::from(upside_down);
                let [s, t] = if upside_down { [i + 1.0 - u, k + 1.0 - v] } else { [u - i, v - k] };
                let psi = [(3.0 * s - 1.0) / 2.0, 2.0 * t + s - 1.0];
                // The middles of cells have this part of the mean square of ψ.
                let part = (1.0 - 1.0 / (n * n)) * n * n;
                for (sums, psi) in expected[cell as usize].iter_mut().zip(psi) {
                    sums[0] += known.radiosity * psi / part;
                    sums[1] += (known.std_error.unwrap() * psi / part).powi(2);
                }
            }
        }
        for (cell, expected) in expected.iter().enumerate() {
            let slopes = coarse.slopes(6 + cell).unwrap()[0];
            let errors = slopes.gradient_error.unwrap();
            for k in 0..2 {
                // ψ over the mean of its square, times what it grows by: 8·3/2 and 6·2.
                let [mean, variance] = expected[k];
                let z = (slopes.gradient[k] - 12.0 * mean) / errors[k].hypot(12.0 * variance.sqrt());
                println!("{rows} rows, cell {cell}, axis {k}: {} {z:.2}", slopes.gradient[k]);
                assert!(z.abs() < 4.5, "{rows} rows, cell {cell}, axis {k}: {z}");
            }
        }
    }
}

/// The first columns keep their bytes, and the others are those of any workers.
#[test]
fn workers_leave_no_trace_in_gradients() {
    let folder = tempdir().unwrap();
    let [base, constant] = ["base", "constant"].map(|name| path(&folder, name));
    let result = run_job(CUBE, &base, &[&LINEAR[..], &["--workers", "1"]].concat());
    run_job(CUBE, &constant, &["--paths", "300000"]);
    let [with, without] = [&base, &constant].map(|out| fs::read_to_string(out.join("patches.csv")).unwrap());
    for (with, without) in with.lines().zip(without.lines()) {
        assert_eq!(with.strip_prefix(without).unwrap().split(',').count(), 7);
    }
    let accuracy = |name: &str| result["accuracy"][name].as_f64().unwrap();
    let [noise, discretisation, total] = ["noise", "discretisation", "total"].map(accuracy);
    assert!((noise.hypot(discretisation) - total).abs() < 1e-12);
    assert!(discretisation > 0.1 && noise < 0.05, "3 × 3 patches a wall are coarse: {result}");
    let failed = |out: &serde_json::Value| {
        let failed = out["checks"].as_array().unwrap().iter().find(|check| check["ok"] == false).cloned();
        failed.map(|check| (check["name"].as_str().unwrap().to_owned(), check["message"].to_string()))
    };
    let (name, message) = failed(&result).expect("coarse patches");
    assert!(name == "resolution" && message.contains("patch"), "{name}: {message}");
    let out = path(&folder, "five");
    run_job(CUBE, &out, &[&LINEAR[..], &["--workers", "5", "--set", "budget.stream_paths=777"]].concat());
    assert!(answer(&out) == answer(&base));
}

#[test]
fn workers_killed_at_random_leave_no_trace_in_gradients() {
    storms_leave_no_trace(CUBE, &["--set", "method.basis=linear", "--paths", "10000000"]);
}

#[test]
fn gradients_are_extended_merged_and_audited() {
    let folder = tempdir().unwrap();
    let [straight, head, tail, merged] =
        ["straight", "head", "tail", "merged"].map(|name| path(&folder, name));
    for set in ["method.estimator=infinite", "method.sampler=sobol"] {
        let job = ["--set", "method.basis=linear", "--set", set];
        let job = match set {
            "method.sampler=sobol" => [&job[..], &["--set", "method.batch_paths=4096"]].concat(),
            _ => job.to_vec(),
        };
        run_job(CUBE, &straight, &[&job[..], &["--paths", "131072", "--force"]].concat());
        run_job(CUBE, &head, &[&job[..], &["--paths", "65536", "--force"]].concat());
        let second = ["--paths", "65536", "--force", "--set", "budget.first_path=65536"];
        run_job(CUBE, &tail, &[&job[..], &second].concat());
        let text = |path: &std::path::Path| path.to_str().unwrap().to_owned();
        let parts = [text(&tail), text(&head), text(&merged)];
        let (code, _, stderr) =
            run(&["merge", &parts[0], &parts[1], "--quiet", "--force", "--out", &parts[2]]);
        assert_eq!(code, 0, "{stderr}");
        assert!(answer(&merged) == answer(&straight), "{set}");
        assert_eq!(summary(&merged)["paths"], 131_072);
        let (code, stdout, stderr) = run(&["audit", &parts[2], "--share", "1"]);
        assert_eq!(code, 0, "{stderr}");
        assert!(stdout.contains("131072 of 131072 paths"), "{stdout}");
        run_job(CUBE, &head, &[&job[..], &["--paths", "131072", "--resume"]].concat());
        assert!(answer(&head) == answer(&straight), "{set}");
    }
}

/// More walks make the noise less, and the patches no finer.
#[test]
fn a_total_error_ends_a_run_where_patches_are_fine_enough() {
    let folder = tempdir().unwrap();
    let [known, ended, missed] = ["known", "ended", "missed"].map(|name| path(&folder, name));
    let summary_of = run_job(CUBE, &known, &LINEAR);
    let discretisation = summary_of["accuracy"]["discretisation"].as_f64().unwrap();
    let run_to = |out: &std::path::Path, error: f64| {
        let target = format!("target.total_error={error}");
        let out = out.to_str().unwrap();
        run(&[
            "run",
            CUBE,
            "--out",
            out,
            "--set",
            "method.basis=linear",
            "--set",
            &target,
            "--paths",
            "3000000",
        ])
    };
    let (code, stdout, stderr) = run_to(&ended, 1.1 * discretisation);
    assert_eq!(code, 0, "{stderr}");
    assert!(stdout.contains("target reached: a total error of"), "{stdout}");
    let result = summary(&ended);
    assert!(
        result["paths"].as_u64().unwrap() < 1_000_000 && result["accuracy"]["reached"] == true,
        "{result}"
    );
    assert!(result["accuracy"]["total"].as_f64().unwrap() <= 1.1 * discretisation);
    let (code, stdout, stderr) = run_to(&missed, 0.8 * discretisation);
    assert_eq!(code, 1, "{stderr}");
    assert!(stdout.contains("takes finer patches, not more walks"), "{stdout}");
    assert_eq!(summary(&missed)["accuracy"]["reached"], false);
    let (code, _, stderr) = run(&["run", CUBE, "--set", "target.total_error=0.1", "--out", "never"]);
    assert_eq!(code, 2);
    assert!(stderr.contains("write basis = \"linear\""), "{stderr}");
}
