//! Measures the gain of chains of stochastic Jacobi over collision walks at equal processor time:
//! `radwalk-lab gain docs/results` writes gain.csv and a chart of each scene into the
//! folder named; scenes may be named after it, and mesh files, which are taken in grey. One core; three minutes for all. With `draw` in place of scenes it draws the table that is
//! there.

use std::fmt::Write;
use std::path::Path;

use super::meshes::grey_scene;
use super::{Failure, collision_shooting, processor_seconds};
use exact::Exact;
use radiosity::{
    Board, Experiment, IndexChoice, Method, Scene, SceneSpec, Sequence, Solution, surfaces::Face,
};
use report::{Axis, Chart, Series, Style};
use scenes::{cornell, corridor, cube, interior, two_rooms};

/// The number of chains in a run that has intervals.
const CHAINS: u64 = 8;

/// The rays per patch and chain below which jobs fall back to walks.
const RAYS_PER_PATCH: u64 = 32;

/// A scene with the numbers of rays of its runs, as powers of 2, and the number of runs for each.
struct GainStudy {
    name: String,
    spec: SceneSpec,
    powers: Vec<u32>,
    runs: u64,
    /// The rays of each chain of the reference solution; `None` if the scene is solved exactly.
    reference_rays: Option<u64>,
}

/// The way in which a run spends its rays.
#[derive(Clone, Copy, PartialEq)]
enum RayUse {
    Walks,
    OneChain,
    Chains,
}

impl RayUse {
    const ALL: [RayUse; 3] = [RayUse::Walks, RayUse::OneChain, RayUse::Chains];

    fn name(self) -> &'static str {
        match self {
            RayUse::Walks => "collision walks",
            RayUse::OneChain => "one chain",
            RayUse::Chains => "8 chains",
        }
    }
}

/// The results of all runs of one way and size.
struct GainPoint {
    way: RayUse,
    rays: u64,
    /// The processor time of a run [s].
    seconds: f64,
    /// The mean squared relative error over non-emitting patches, by area; and its standard error.
    relative: [f64; 2],
    /// The mean squared error over the square of the mean radiosity, by area; and its standard error.
    absolute: [f64; 2],
}

pub(crate) fn run(words: &[String]) -> Result<(), Failure> {
    let (folder, wanted) = words.split_first().ok_or("usage: gain FOLDER [SCENE…] | FOLDER draw")?;
    let folder = Path::new(folder);
    if wanted == ["draw"] {
        return draw(folder);
    }
    let (meshes, names): (Vec<_>, Vec<_>) = wanted.iter().map(Path::new).partition(|name| name.is_file());
    let is_wanted =
        |study: &GainStudy| wanted.is_empty() || names.iter().any(|name| name.as_os_str() == &*study.name);
    let mut studies: Vec<_> = studies().into_iter().filter(is_wanted).collect();
    for mesh in meshes {
        studies.push(study_of(mesh)?);
    }
    let mut csv = String::from(
        "scene,method,rays,seconds,rms_relative_error,gain_relative,gain_relative_error,gain_absolute,gain_absolute_error\n",
    );
    for study in &studies {
        let points = measure(study)?;
        write_rows(&mut csv, &study.name, &points);
        std::fs::write(folder.join("gain.csv"), &csv)?;
    }
    draw(folder)
}

/// The study of a mesh: runs of 64 and 256 rays for each face of its surfaces, up to the next power of 2.
fn study_of(mesh: &Path) -> Result<GainStudy, Failure> {
    let spec = grey_scene(mesh)?;
    let faces = Scene::build(&spec, IndexChoice::Auto)?.faces().len() as u64;
    let rays_a_face = |rays: u64| (rays * faces).next_power_of_two();
    let name = mesh.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let powers = [64, 256].map(|rays| rays_a_face(rays).ilog2()).into();
    Ok(GainStudy { name, spec, powers, runs: 4, reference_rays: Some(rays_a_face(1024)) })
}

fn studies() -> Vec<GainStudy> {
    let small = |name: &str, spec, runs| GainStudy {
        name: name.into(),
        spec,
        powers: (10..=20).step_by(2).collect(),
        runs,
        reference_rays: None,
    };
    let mut bright = cube(3);
    bright.surfaces.iter_mut().for_each(|face| face.reflectance = 0.95.into());
    vec![
        small("cube54", cube(3), 40),
        small("cube54-R95", bright, 40),
        small("cube3456", cube(24), 12),
        small("corridor", corridor(8), 40),
        // Walks are long: few of them carry the little light that goes through the hole.
        GainStudy { reference_rays: Some(1 << 22), ..small("two-rooms", two_rooms(0.1, 0.95), 40) },
        GainStudy {
            name: "cornell".into(),
            spec: cornell(),
            powers: vec![16, 18, 20],
            runs: 12,
            reference_rays: Some(1 << 21),
        },
        GainStudy {
            name: "interior".into(),
            spec: interior(57_000),
            powers: vec![20, 22, 23],
            runs: 4,
            reference_rays: Some(1 << 24),
        },
    ]
}

fn measure(study: &GainStudy) -> Result<Vec<GainPoint>, Failure> {
    let scene = Scene::build(&study.spec, IndexChoice::Auto)?;
    let truth = match study.reference_rays {
        None => Exact::of_scene(&study.spec)?.solution().radiosity.clone(),
        Some(rays) => radiosities(&chains(&scene, rays)?, 1, 0..CHAINS)?,
    };
    let walks = collision_shooting(scene.clone())?;
    let rays_per_walk = rays_per_walk(&walks)?;
    let mut points = Vec::new();
    let fewest = CHAINS * RAYS_PER_PATCH * scene.faces().len() as u64;
    for rays in study.powers.iter().map(|power| 1_u64 << power).chain([fewest]) {
        for way in RayUse::ALL {
            let (experiment, units) = match way {
                RayUse::Walks => (walks.clone(), (rays as f64 / rays_per_walk) as u64),
                RayUse::OneChain => (chains(&scene, rays)?, 1),
                RayUse::Chains => (chains(&scene, rays / CHAINS)?, CHAINS),
            };
            let shortest = experiment.unit().chain().unwrap_or(u64::MAX);
            if shortest < RAYS_PER_PATCH * scene.faces().len() as u64 {
                continue;
            }
            let start = processor_seconds();
            let runs = (0..study.runs).map(|run| radiosities(&experiment, 2, run * units..(run + 1) * units));
            let runs = runs.collect::<Result<Vec<_>, _>>()?;
            let seconds = (processor_seconds() - start) / study.runs as f64;
            let [relative, absolute] = squared_errors(&scene, &truth, &runs);
            let point = GainPoint { way, rays, seconds, relative, absolute };
            println!(
                "{} {} {rays}: {:.0} ns per ray, rms relative error {:.3e}",
                study.name,
                way.name(),
                1e9 * point.seconds / rays as f64,
                point.relative[0].sqrt()
            );
            points.push(point);
        }
    }
    Ok(points)
}

fn chains(scene: &Scene, chain_rays: u64) -> Result<Experiment, Failure> {
    Ok(Experiment::new(scene.clone(), Method::chains(chain_rays))?)
}

fn rays_per_walk(walks: &Experiment) -> Result<f64, Failure> {
    const SAMPLE: u64 = 20_000;
    let mut board: Board = walks.board();
    walks.walk(&Sequence::new(3), 0..SAMPLE, &mut board);
    Ok(board.take()?.counts.rays as f64 / SAMPLE as f64)
}

/// B of every patch by some walks or chains [W/m²].
fn radiosities(experiment: &Experiment, seed: u64, units: std::ops::Range<u64>) -> Result<Vec<f64>, Failure> {
    let mut board: Board = experiment.board();
    experiment.walk(&Sequence::new(seed), units, &mut board);
    let solution = Solution::new(experiment, &board.take()?, 0.95);
    Ok(solution.estimates.into_iter().flatten().map(|estimate| estimate.radiosity).collect())
}

/// Relative and absolute mean squared errors of runs, each with the standard error that the runs give. A patch that is
/// dark in the reference (below 10⁻³ of the mean) is left out of relative errors.
fn squared_errors(scene: &Scene, truth: &[f64], runs: &[Vec<f64>]) -> [[f64; 2]; 2] {
    let patches: Vec<Face> = scene.faces().iter().collect();
    let judged: Vec<usize> = (0..truth.len())
        .filter(|&i| !patches[i].emittance.is_lit() && patches[i].reflectance.is_lit())
        .collect();
    let area: f64 = judged.iter().map(|&i| patches[i].area).sum();
    let mean = judged.iter().map(|&i| patches[i].area * truth[i]).sum::<f64>() / area;
    let of = |scale: &dyn Fn(usize) -> f64| {
        let squares = runs.iter().map(|run| {
            let square = |&i: &usize| patches[i].area * (scale(i) * (run[i] - truth[i])).powi(2);
            judged.iter().map(square).sum::<f64>() / area
        });
        mean_and_error(&squares.collect::<Vec<_>>())
    };
    [of(&|i| if truth[i] > 1e-3 * mean { 1.0 / truth[i] } else { 0.0 }), of(&|_| 1.0 / mean)]
}

fn mean_and_error(values: &[f64]) -> [f64; 2] {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0);
    [mean, (variance / n).sqrt()]
}

/// The factor by which the mean squared error is smaller than that of walks in the same time; and its standard error.
/// The error of walks falls exactly as their time grows.
fn gain(walks: &GainPoint, point: &GainPoint, of: impl Fn(&GainPoint) -> [f64; 2]) -> [f64; 2] {
    let ([walked, walked_error], [found, found_error]) = (of(walks), of(point));
    let gain = walked * walks.seconds / (found * point.seconds);
    [gain, gain * (walked_error / walked).hypot(found_error / found)]
}

fn write_rows(csv: &mut String, scene: &str, points: &[GainPoint]) {
    for point in points {
        let same_size = |other: &&GainPoint| other.way == RayUse::Walks && other.rays == point.rays;
        let walks = points.iter().find(same_size).expect("walks are always measured");
        let [relative, absolute] =
            [gain(walks, point, |point| point.relative), gain(walks, point, |point| point.absolute)];
        writeln!(
            csv,
            "{scene},{},{},{:.3e},{:.4e},{:.3},{:.3},{:.3},{:.3}",
            point.way.name(),
            point.rays,
            point.seconds,
            point.relative[0].sqrt(),
            relative[0],
            relative[1],
            absolute[0],
            absolute[1]
        )
        .expect("strings take all");
    }
}

/// The chart of error against time of a scene in the rows of a table.
fn chart(scene: &str, rows: &[GainRow]) -> Chart {
    let curve = |way: RayUse| {
        let mut points: Vec<_> = rows
            .iter()
            .filter(|row| row.scene == scene && row.method == way.name())
            .map(|row| report::ChartPoint { x: row.seconds, y: row.error, error: 0.0 })
            .collect();
        points.sort_by(|a, b| a.x.total_cmp(&b.x));
        Series { name: way.name().into(), style: Style::Joined, points }
    };
    Chart {
        title: format!("{scene}: error against time, one core"),
        x: Axis::log("processor time of a run [s]"),
        y: Axis::log("rms relative error"),
        series: RayUse::ALL.map(curve).into(),
    }
}

/// The part of a row of gain.csv that is drawn.
struct GainRow {
    scene: String,
    method: String,
    seconds: f64,
    error: f64,
}

/// Draws every scene of the table in the folder.
fn draw(folder: &Path) -> Result<(), Failure> {
    let table = std::fs::read_to_string(folder.join("gain.csv"))?;
    let row = |line: &str| -> Result<GainRow, Failure> {
        let cells: Vec<&str> = line.split(',').collect();
        let [scene, method, _, seconds, error, ..] = cells[..] else {
            return Err("a row is too short".into());
        };
        let (seconds, error) = (seconds.parse()?, error.parse()?);
        Ok(GainRow { scene: scene.into(), method: method.into(), seconds, error })
    };
    let rows = table.lines().skip(1).map(row).collect::<Result<Vec<_>, _>>()?;
    for group in rows.chunk_by(|a, b| a.scene == b.scene) {
        let scene = &group[0].scene;
        std::fs::write(folder.join(format!("gain-{scene}.svg")), chart(scene, group).svg())?;
    }
    Ok(())
}
