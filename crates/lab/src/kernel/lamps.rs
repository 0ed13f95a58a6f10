//! What lamps cost and what the figures of planes are worth: `radwalk-lab lamps FOLDER [RUNS]` writes `lamps.md`.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use glam::DVec3;
use photometry::{Distribution, Luminaire};
use radiosity::{
    Estimator, Experiment, IndexChoice, Method, Scene, SceneSpec, Sequence, Shape, SurfaceSpec,
    lamps::{Emission, LampSpec, LampsSpec},
    planes::{Figure, PlaneFigures},
    sensors::{Readings, SensorShape, SensorSpec},
};
use scenes::interior;
use stats::{Coverage, Interval};

use super::{Failure, median};
use crate::clock::thread_seconds;
use crate::edition::origin;

/// Walks of one measurement of time, and how many there are of each.
const WALKS: u64 = 1 << 17;
const TURNS: u64 = 15;

/// Walks of a run whose intervals are held against the truth, and of the run that tells it.
const RUN: u64 = 1 << 15;
const TRUTH: u64 = 1 << 24;

/// Runs, where none are asked for.
const RUNS: u64 = 2000;

/// The level of the intervals.
const LEVEL: f64 = 0.95;

pub(crate) fn run(words: &[String]) -> Result<(), Failure> {
    let folder = words.first().ok_or("usage: lamps FOLDER [RUNS]")?;
    let runs = words.get(1).map_or(Ok(RUNS), |word| word.parse())?;
    let tables = births()? + &coverage(runs)?;
    let page = format!(
        "# Lamps\n\nMade by `radwalk-lab lamps FOLDER {runs}` on one thread: {}.\n\n{tables}",
        origin()
    );
    fs::create_dir_all(folder)?;
    fs::write(Path::new(folder).join("lamps.md"), page)?;
    Ok(())
}

/// The rates of walks that are born at a lamp over those born on a square of 0.2 m in its place, which looks down as the lamp does.
fn births() -> Result<String, Failure> {
    let mut page = "## Births\n\nWalks per second that are born at a lamp, over those born on a square of 0.2 m that hangs there and looks down; both are timed in turn, \
                    and medians count.\n\n| scene | rays a walk | spot | table, axial | table, 15° × 5° |\n|---|---|---|---|---|\n"
        .to_owned();
    for (name, spec) in [
        ("cube", cube()),
        ("interior, 2,000 triangles", interior(2000)),
        ("interior, 57,000", interior(57_000)),
    ] {
        let square = experiment(spec.clone(), None)?;
        let (rays, _) = seconds(&square, 0);
        let _ = write!(page, "| {name} | {:.2} |", rays as f64 / WALKS as f64);
        let spot = Emission::Spot { inner: 0.95, outer: 0.5 };
        for emission in [spot, Emission::Table(0), Emission::Table(1)] {
            let lit = experiment(spec.clone(), Some(emission))?;
            let ratio = |turn| seconds(&square, turn).1 / seconds(&lit, turn).1;
            let _ = write!(page, " {:.2} |", median(&(0..TURNS).map(ratio).collect::<Vec<_>>()));
        }
        page += "\n";
    }
    Ok(page + "\n")
}

/// A cube of 2 m whose sides reflect 0.4 of the light.
fn cube() -> SceneSpec {
    let mut spec = SceneSpec::furnace(3, 0.4);
    for surface in &mut spec.surfaces {
        let (corner, u, v) = surface.shape.edges();
        surface.shape = Shape::parallelogram(2.0 * corner, 2.0 * u, 2.0 * v, [3, 3]);
    }
    spec
}

/// A scene with no light but that of a lamp, or of a square in its place.
fn experiment(mut spec: SceneSpec, emission: Option<Emission>) -> Result<Experiment, Failure> {
    let place = DVec3::new(1.0, 1.0, 1.9);
    for surface in &mut spec.surfaces {
        surface.emittance = 0.0.into();
        surface.cell_emittance.clear();
    }
    let (u, v) = (0.2 * DVec3::X, 0.2 * DVec3::Y);
    let square = SurfaceSpec::new(Shape::parallelogram(place - 0.5 * (u + v), v, u, [1, 1]), 0.0);
    match emission {
        None => spec.surfaces.push(square.emitting(1.0)),
        Some(emission) => {
            // Below the square, which is as dark as before.
            spec.surfaces.push(square);
            spec.lamps.list = vec![LampSpec::new(place - 0.05 * DVec3::Z, emission, 1.0)];
            spec.lamps.tables = vec![axial(), uneven()];
        }
    }
    let scene = Scene::build(&spec, IndexChoice::Auto)?;
    Ok(Experiment::new(scene, Method::shooting(Estimator::Collision))?)
}

/// Rays and processor time [s] of a measurement.
fn seconds(experiment: &Experiment, turn: u64) -> (u64, f64) {
    let mut board = experiment.board();
    let start = thread_seconds();
    experiment.walk(&Sequence::new(turn), 0..WALKS, &mut board);
    let seconds = thread_seconds() - start;
    (board.take().map_or(0, |tally| tally.counts.rays), seconds)
}

/// A table from rows of words.
fn table(gamma: &str, c: &str, candela: &str) -> Distribution {
    let sizes = [gamma, c].map(|angles| angles.split_whitespace().count());
    let file = format!(
        "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 {} {} 1 2 0 0 0\n1 1 10\n{gamma}\n{c}\n{candela}\n",
        sizes[0], sizes[1]
    );
    Luminaire::read(file.as_bytes()).expect("the file is one").distribution
}

/// A downlight: one plane of 19 angles.
fn axial() -> Distribution {
    let angles: Vec<String> = (0..19).map(|k| (5 * k).to_string()).collect();
    let candela = (0..19).map(|k| (1000.0 * f64::from(5 * k).to_radians().cos().powi(2)).round().to_string());
    table(&angles.join(" "), "0", &candela.collect::<Vec<_>>().join(" "))
}

/// A luminaire without symmetry: 25 planes of 19 angles.
fn uneven() -> Distribution {
    let gamma: Vec<String> = (0..19).map(|k| (5 * k).to_string()).collect();
    let c: Vec<String> = (0..25).map(|k| (15 * k).to_string()).collect();
    let candela = (0..25).flat_map(|plane| {
        let tilt = 1.0 + 0.5 * f64::from(15 * plane).to_radians().sin();
        (0..19).map(move |k| (1000.0 * tilt * f64::from(5 * k).to_radians().cos()).round().to_string())
    });
    table(&gamma.join(" "), &c.join(" "), &candela.collect::<Vec<_>>().join(" "))
}

/// Rooms of 6 × 4 × 3 m with 40 points at 0.8 m.
struct LampRoom {
    name: &'static str,
    reflectance: f64,
    /// The places of lamps in x and y [m]; they hang at 2.95 m.
    lamps: &'static [[f64; 2]],
    /// Whether they hang at 2 m and light the ceiling.
    is_upwards: bool,
    /// Walks of a run.
    walks: u64,
}

const FOUR: &[[f64; 2]] = &[[1.5, 1.0], [4.5, 1.0], [1.5, 3.0], [4.5, 3.0]];

const CASES: [LampRoom; 6] = [
    LampRoom { name: "two equal minima", reflectance: 0.3, lamps: FOUR, is_upwards: false, walks: RUN },
    LampRoom { name: "two equal minima", reflectance: 0.7, lamps: FOUR, is_upwards: false, walks: RUN },
    LampRoom {
        name: "one clear minimum",
        reflectance: 0.5,
        lamps: &[[1.0, 1.0]],
        is_upwards: false,
        walks: RUN,
    },
    LampRoom { name: "indirect, nearly even", reflectance: 0.7, lamps: FOUR, is_upwards: true, walks: RUN },
    LampRoom { name: "few samples", reflectance: 0.7, lamps: FOUR, is_upwards: false, walks: RUN / 4 },
    LampRoom {
        name: "indirect, few samples",
        reflectance: 0.5,
        lamps: FOUR,
        is_upwards: true,
        walks: RUN / 4,
    },
];

/// How often intervals of figures hold the truth.
fn coverage(runs: u64) -> Result<String, Failure> {
    let width = 3.9 * 100.0 * (LEVEL * (1.0 - LEVEL) / runs as f64).sqrt();
    let mut page = format!(
        "## Figures of planes\n\nRooms of 6 × 4 × 3 m with lamps of the second table, 40 points at 0.8 m: {runs} runs each with {} % intervals, against one of \
         {TRUTH} walks. Chance alone leaves {:.1} … {:.1} % of {} % but for once in 1,000 tables.\n\n\
         | room | reflectance | walks | mean | minimum | maximum | U₀ | U_d |\n|---|---|---|---|---|---|---|---|\n",
        100.0 * LEVEL,
        100.0 * LEVEL - width,
        100.0 * LEVEL + width,
        100.0 * LEVEL,
    );
    for case in &CASES {
        let experiment = room(case)?;
        let truth = figures(&experiment, u64::MAX, TRUTH)?;
        let mut covers = [Coverage::default(); 5];
        for seed in 0..runs {
            let reported = figures(&experiment, seed, case.walks)?;
            for ((covers, reported), truth) in covers.iter_mut().zip(each(&reported)).zip(each(&truth)) {
                covers
                    .record(&Interval { low: reported.low, high: reported.high }, truth.value.unwrap_or(0.0));
            }
        }
        let share = |covers: &Coverage| covers.rate(LEVEL).map_or(f64::NAN, |rate| 100.0 * rate.value);
        let _ = write!(page, "| {} | {} | {} |", case.name, case.reflectance, case.walks);
        covers.iter().for_each(|covers| page += &format!(" {:.1} % |", share(covers)));
        page += "\n";
    }
    Ok(page)
}

fn each(figures: &PlaneFigures) -> [Figure; 5] {
    [figures.mean, figures.minimum, figures.maximum, figures.uniformity, figures.diversity]
}

/// The figures of the plane after some walks.
fn figures(experiment: &Experiment, seed: u64, walks: u64) -> Result<PlaneFigures, Failure> {
    let (sequence, mut board, mut tally) = (Sequence::new(seed), experiment.board(), experiment.tally());
    for first in (0..walks).step_by(RUN as usize) {
        experiment.walk(&sequence, first..walks.min(first + RUN), &mut board);
        board.add_to(&mut tally)?;
    }
    let readings = Readings::new(experiment, &tally, LEVEL).expect("the room has a plane");
    Ok(readings.plane(0, 0))
}

fn room(case: &LampRoom) -> Result<Experiment, Failure> {
    let size = DVec3::new(6.0, 4.0, 3.0);
    let mut spec = SceneSpec::furnace(4, case.reflectance);
    for surface in &mut spec.surfaces {
        let (corner, u, v) = surface.shape.edges();
        surface.shape = Shape::parallelogram(size * corner, size * u, size * v, [4, 4]);
        surface.emittance = 0.0.into();
    }
    let height = if case.is_upwards { 2.0 } else { 2.95 };
    let aim = if case.is_upwards { DVec3::Z } else { -DVec3::Z };
    let lamp =
        |&[x, y]: &[f64; 2]| LampSpec::new(DVec3::new(x, y, height), Emission::Table(0), 1.0).aimed(aim, 0.0);
    spec.lamps = LampsSpec {
        tables: vec![uneven()],
        list: case.lamps.iter().map(lamp).collect(),
        ..LampsSpec::default()
    };
    let at = |i: u32, j: u32| DVec3::new(0.375 + 0.75 * f64::from(i), 0.4 + 0.8 * f64::from(j), 0.8);
    let points = (0..8).flat_map(|i| (0..5).map(move |j| [at(i, j), DVec3::Z])).collect();
    let plane = SensorSpec { name: "desk".into(), shape: SensorShape::Points { points, grid: [8, 5] } };
    let scene = Scene::build(&spec, IndexChoice::Auto)?;
    let experiment = Experiment::new(scene, Method::shooting(Estimator::Collision))?;
    Ok(experiment.with_sensors(&[plane])?)
}
