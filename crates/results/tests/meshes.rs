//! Groups of faces that a pilot chooses: the choice is a function of the job, files give it on, and intervals stay true under it.

use std::f64::consts::PI;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use crate::common::tally;
use job::{Job, Partition};
use radiosity::{Estimates, Experiment};
use results::choose;
use stats::Coverage;
use tempfile::{TempDir, tempdir};

/// A closed room of 1 m with a lamp on its floor and a ball of 768 faces above it, as an OBJ file.
fn room() -> String {
    let mut text = String::from("mtllib room.mtl\n");
    let mut next = 1;
    let mut face = |text: &mut String, corners: &[[f64; 3]]| {
        corners.iter().for_each(|[x, y, z]| writeln!(text, "v {x} {y} {z}").unwrap());
        let numbers: Vec<String> = (next..next + corners.len()).map(|n| n.to_string()).collect();
        writeln!(text, "f {}", numbers.join(" ")).unwrap();
        next += corners.len();
    };
    text.push_str("o walls\nusemtl wall\n");
    for axis in 0..3 {
        let corner = |u: f64, v: f64, w: f64| {
            let mut at = [0.0; 3];
            (at[axis], at[(axis + 1) % 3], at[(axis + 2) % 3]) = (w, u, v);
            at
        };
        face(&mut text, &[(0., 0.), (1., 0.), (1., 1.), (0., 1.)].map(|(u, v)| corner(u, v, 0.0)));
        face(&mut text, &[(0., 0.), (0., 1.), (1., 1.), (1., 0.)].map(|(u, v)| corner(u, v, 1.0)));
    }
    text.push_str("o lamp\nusemtl lamp\n");
    face(&mut text, &[[0.1, 0.1, 0.02], [0.3, 0.1, 0.02], [0.3, 0.3, 0.02], [0.1, 0.3, 0.02]]);
    text.push_str("o ball\nusemtl ball\n");
    let point = |i: u32, j: u32| {
        let (polar, around) = (PI * f64::from(i) / 16.0, 2.0 * PI * f64::from(j) / 24.0);
        [
            0.5 + 0.2 * polar.sin() * around.cos(),
            0.5 + 0.2 * polar.sin() * around.sin(),
            0.5 - 0.2 * polar.cos(),
        ]
    };
    for (i, j) in (0..16).flat_map(|i| (0..24).map(move |j| (i, j))) {
        let [a, b, c, d] = [point(i, j), point(i, j + 1), point(i + 1, j + 1), point(i + 1, j)];
        face(&mut text, &[a, b, c]);
        face(&mut text, &[a, c, d]);
    }
    text
}

const MATERIALS: &str = "newmtl wall\nKd 0.6 0.6 0.6\nnewmtl ball\nKd 0.5 0.5 0.5\nnewmtl lamp\nKe 1 1 1\n";

fn write(folder: &TempDir, rest: &str) -> PathBuf {
    let path = folder.path().join("job.toml");
    fs::write(folder.path().join("room.obj"), room()).unwrap();
    fs::write(folder.path().join("room.mtl"), MATERIALS).unwrap();
    let head = "[scene]\nfile = \"room.obj\"\npatches = \"auto\"\n[import]\nup = \"z\"\nsides = 1\n";
    fs::write(&path, format!("{head}{rest}")).unwrap();
    path
}

fn keys(seed: u64, paths: u64) -> [String; 2] {
    [format!("seed={seed}"), format!("budget.paths={paths}")]
}

fn load(path: &Path, seed: u64, paths: u64) -> Job {
    job::load(path, &keys(seed, paths)).unwrap()
}

fn chosen(job: &Job, threads: usize) -> Partition {
    choose(job, threads).unwrap().expect("patches are left open").partition
}

/// Threads have no part in the choice; a file gives it to another job; faces of the ball are grouped, and walls, which are two faces each,
/// are cut.
#[test]
fn groups_are_a_function_of_the_job_and_given_on_by_files() {
    let folder = tempdir().unwrap();
    let path = write(&folder, "");
    let job = load(&path, 3, 11_000);
    let partition = chosen(&job, 1);
    assert_eq!(chosen(&job, 5), partition);
    let cut =
        job::load(&path, &keys(3, 11_000)).and_then(|job| job.cut(&keys(3, 11_000), &partition)).unwrap();

    let is_ball = |surface: usize| job.scene.spec().surfaces[surface].shape.area() < 0.01;
    let mut first = 0;
    let (mut of_ball, mut of_walls): (Vec<u32>, Vec<u32>) = (Vec::new(), Vec::new());
    for (surface, cut) in partition.cuts.iter().enumerate() {
        let cells = &partition.groups[first..first + cut.cells() as usize];
        if is_ball(surface) {
            of_ball.extend(cells)
        } else {
            of_walls.extend(cells)
        }
        first += cells.len();
    }
    for patches in [&mut of_ball, &mut of_walls] {
        patches.sort_unstable();
        patches.dedup();
    }
    assert!(of_ball.len() < 500 && of_walls.len() > 40, "{} and {}", of_ball.len(), of_walls.len());

    fs::write(folder.path().join("partition.toml"), partition.to_toml()).unwrap();
    let given = [keys(3, 11_000).as_slice(), &["scene.patches=partition.toml".into()]].concat();
    let given = job::load(&path, &given).unwrap();
    assert_eq!(given.scene.spec(), cut.scene.spec());
    assert_eq!(given.method, cut.method);
}

/// Whether some patch has cells of two surfaces.
fn spans_surfaces(partition: &Partition) -> bool {
    let mut groups = partition.groups.iter();
    let mut patches: Vec<(u32, usize)> = Vec::new();
    for (surface, cut) in partition.cuts.iter().enumerate() {
        patches.extend(groups.by_ref().take(cut.cells() as usize).map(|&patch| (patch, surface)));
    }
    patches.sort_unstable();
    patches.dedup();
    patches.windows(2).any(|pair| pair[0].0 == pair[1].0)
}

/// Few faces, or many paths, get fits of their own; so do jobs that ask something of single faces.
#[test]
fn what_is_asked_of_faces_keeps_them_apart() {
    let folder = tempdir().unwrap();
    let grouped = |rest: &str, paths: u64| {
        let path = write(&folder, rest);
        spans_surfaces(&chosen(&load(&path, 1, paths), 2))
    };
    assert!(grouped("", 10_000));
    assert!(grouped("[method]\nwalk = \"jacobi\"\n", 10_000));
    assert!(!grouped("", 200_000));
    assert!(grouped("[method]\nbasis = \"linear\"\n", 10_000));
    assert!(grouped("[method]\nbasis = \"constant\"\n", 10_000));
    // A total error that few walks reach is reached soonest on groups.
    assert!(grouped("[target]\ntotal_error = 0.2\n", 10_000));
    assert!(!grouped("[target]\ntotal_error = 0.02\n", 200_000));
    assert!(!grouped("[[source]]\nname = \"lamp\"\nsurfaces = [\"lamp*\"]\n", 10_000));
}

/// The part of 95 % intervals that cover, on groups that each seed's own pilot has chosen: the mean over seeds, its standard error by
/// their spread, and the number of intervals. The truth is a run of other walks on the same groups, 100 times as long: its own noise
/// takes 0.1 % of the intervals' coverage at the most.
fn coverage(seeds: u64, paths: u64) -> (f64, f64, u64) {
    let folder = tempdir().unwrap();
    let path = write(&folder, "");
    let mut parts = Vec::new();
    for seed in 0..seeds {
        let partition = chosen(&load(&path, seed, paths), 2);
        let job = job::load(&path, &keys(seed, paths))
            .and_then(|job| job.cut(&keys(seed, paths), &partition))
            .unwrap();
        let experiment = Experiment::new(job.build_scene().unwrap(), job.method.walks()).unwrap();
        let [own, long] =
            [tally(&experiment, seed, paths), tally(&experiment, seed + (1 << 40), 100 * paths)];
        let truth = Estimates::new(&experiment, &long, 0.95);
        let (mut covered, mut trials) = (0, 0);
        for (face, _, known) in Estimates::new(&experiment, &own, 0.95).known() {
            let Some(truth) = truth.face(face) else { continue };
            if known[0].ci_high > known[0].ci_low {
                covered += u64::from((known[0].ci_low..=known[0].ci_high).contains(&truth[0].radiosity));
                trials += 1;
            }
        }
        parts.push(Coverage { covered, trials });
    }
    crate::common::over_seeds(&parts)
}

/// Within 4 standard errors of 95 % (false-alarm rate 6·10⁻⁵), which are below 1 %.
#[test]
fn intervals_are_true_on_chosen_groups() {
    let (mean, error, intervals) = coverage(16, 10_000);
    println!("{:.2} ± {:.2} % of {intervals}", 100.0 * mean, 100.0 * error);
    assert!(error < 0.01 && (mean - 0.95).abs() < 4.0 * error, "{mean} ± {error}");
}

/// Between 94.4 and 95.6 %, for more than 20,000 intervals.
#[test]
#[ignore = "takes minutes"]
fn twenty_thousand_intervals_are_true_on_chosen_groups() {
    let (mean, error, intervals) = coverage(140, 11_000);
    println!("{:.2} ± {:.2} % of {intervals}", 100.0 * mean, 100.0 * error);
    assert!(intervals >= 20_000);
    assert!((0.944..=0.956).contains(&mean), "{mean} ± {error}");
}
