//! Sensors: what they leave alone, what cannot change them, and scenes whose light is known without a solution.

use crate::common::{cube54, quad, surface};
use glam::DVec3;
use radiosity::{
    Birth, Chains, Direction, EstimatorKind, Experiment, IndexChoice, Method, Scene, SceneSpec, Sequence,
    Sides, Space, Spectrum, Tally, Unfit, Walks,
    methods::{BatchScore, Batches, InfiniteEnd, Iterations, Sampler, Score, Solve},
    sensors::{Readings, SensorShape, SensorSpec},
};

fn desk(height: f64, cells: [u32; 2]) -> SensorSpec {
    let at = |x, y| DVec3::new(x, y, height);
    let shape =
        SensorShape::Quad { corner: at(0.2, 0.3), corner_u: at(0.8, 0.3), corner_v: at(0.2, 0.7), cells };
    SensorSpec { name: "desk".into(), shape }
}

fn point(point: DVec3, normal: DVec3) -> SensorSpec {
    SensorSpec { name: "point".into(), shape: SensorShape::Point { point, normal } }
}

fn experiment(spec: &SceneSpec, method: impl Into<Method>) -> Experiment {
    Experiment::new(Scene::build(spec, IndexChoice::Auto).unwrap(), method).unwrap()
}

/// Every kind of sample, with how many of them make some samples of sensors.
fn methods() -> Vec<(Method, u64)> {
    let walks = |direction, space, score: Score| Walks { direction, space, score };
    let infinite = EstimatorKind::Infinite.ending(InfiniteEnd::default());
    vec![
        (Method::shooting(EstimatorKind::Collision), 5000),
        (Method::shooting(EstimatorKind::Survival), 5000),
        (Method::shooting(Score::Mix), 5000),
        (Method::shooting(Score::Of(infinite)), 5000),
        (walks(Direction::Shooting, Space::Continuous, EstimatorKind::Absorption.into()).into(), 5000),
        (Method::gathering(Birth::Area, EstimatorKind::Collision), 5000),
        (Method::batches(500, Sampler::Sobol), 8),
        (Chains { rays: 2000, linear: false, solve: Solve::Links, final_gather: vec![3] }.into(), 8),
        (
            Chains {
                rays: 2000,
                linear: false,
                solve: Solve::Iterations(Iterations::default()),
                final_gather: vec![],
            }
            .into(),
            8,
        ),
    ]
}

/// The tally of some walks, handed over at every cut, each part on a board of its own.
fn tally(experiment: &Experiment, cuts: &[u64]) -> Tally {
    let sequence = Sequence::new(3);
    let mut tally = experiment.tally();
    for pair in cuts.windows(2).rev() {
        let mut board = experiment.board();
        experiment.walk(&sequence, pair[0]..pair[1], &mut board);
        board.add_to(&mut tally).unwrap();
    }
    tally
}

/// Boards that are emptied, and walks that go on where others have ended, change nothing either.
fn in_chunks(experiment: &Experiment, walks: u64, chunk: u64, chunks_of_board: u64) -> Tally {
    let (sequence, mut tally) = (Sequence::new(3), experiment.tally());
    let mut board = experiment.board();
    for (number, first) in (0..walks).step_by(chunk as usize).enumerate() {
        experiment.walk(&sequence, first..walks.min(first + chunk), &mut board);
        if (number as u64 + 1).is_multiple_of(chunks_of_board) {
            tally.merge(&board.take().unwrap()).unwrap();
        }
    }
    tally.merge(&board.take().unwrap()).unwrap();
    tally
}

#[test]
fn a_tally_is_a_function_of_its_walks_and_faces_know_nothing_of_sensors() {
    let mut coloured = cube54();
    coloured.surfaces[2].reflectance = Spectrum::rgb([0.9, 0.5, 0.1]);
    for spec in [cube54(), coloured] {
        for (method, walks) in methods() {
            if method.is_mix() && spec.channels() > 1 {
                continue;
            }
            let plain = experiment(&spec, method.clone());
            let sensors = [desk(0.5, [2, 1]), point(DVec3::splat(0.4), DVec3::X)];
            let sensed = plain.clone().with_sensors(&sensors).unwrap();
            let whole = tally(&sensed, &[0, walks]);
            // Samples of 1,024 walks, begun and ended anywhere.
            assert_eq!(tally(&sensed, &[0, walks / 7, walks / 3, walks / 2, walks]), whole, "{method:?}");
            assert_eq!(in_chunks(&sensed, walks, walks.div_ceil(7), 3), whole, "{method:?}");
            let alone = tally(&plain, &[0, walks]);
            assert_eq!(alone.counts, whole.counts, "{method:?}");
            assert_eq!(alone.sums(), &whole.sums()[..alone.sums().len()], "{method:?}");
            let readings = Readings::new(&sensed, &whole, 0.95).unwrap();
            assert_eq!(readings.samples(), if sensed.unit().is_walk() { 4 } else { walks }, "{method:?}");
            assert!(readings.rays() >= readings.samples() * 3 * 16);
            assert!(
                readings.worst_error(0, false) < 1.0 && readings.worst_error(1, false) < 1.0,
                "{method:?}"
            );
        }
    }
}

/// What some samples say of every cell and channel.
fn read(experiment: &Experiment, walks: u64) -> Vec<radiosity::sensors::Reading> {
    let tally = tally(experiment, &[0, walks]);
    let readings = Readings::new(experiment, &tally, 0.95).unwrap();
    (0..readings.sensors().cell_count()).flat_map(|cell| readings.cell(cell)).collect()
}

/// Where B = 1 W/m² everywhere, so is H, wherever a sensor lies in the room and whatever it faces. Ten estimates of 64
/// samples at 6 standard errors: a false alarm has a chance of 10⁻⁶ by Student's t for this seed, once and for all.
#[test]
fn in_a_furnace_every_sensor_reads_one() {
    for space in [Space::Discrete, Space::Continuous] {
        let method = Walks { space, ..Walks::shooting(EstimatorKind::Collision) };
        let on_floor = [
            desk(0.5, [2, 2]),
            desk(0.0, [1, 1]),
            point(DVec3::splat(0.3), DVec3::new(-1.0, 2.0, 0.5)),
            point(DVec3::new(0.5, 1e-9, 0.5), DVec3::Y),
        ];
        let experiment = experiment(&SceneSpec::furnace(3, 0.5), method).with_sensors(&on_floor).unwrap();
        for reading in read(&experiment, 64 << 10) {
            let (h, error) = (reading.irradiance.unwrap(), reading.std_error.unwrap());
            assert!((h - 1.0).abs() < 6.0 * error && error < 0.01, "{reading:?}");
        }
    }
}

/// A sensor on a surface is in front of it: on a two-sided sheet it reads the light of the side that it faces. The room is
/// black, and one half of it has a lamp.
#[test]
fn a_sensor_on_a_sheet_reads_the_side_that_it_faces() {
    let sheet = quad(DVec3::new(0.0, 0.0, 0.5), DVec3::X, DVec3::Y, [1, 1]);
    let lamp = quad(DVec3::new(0.0, 0.0, 1.0), DVec3::Y, DVec3::X, [1, 1]);
    let floor = quad(DVec3::ZERO, DVec3::X, DVec3::Y, [1, 1]);
    let mut spec = SceneSpec::new(vec![surface(floor, 0.0), surface(sheet, 0.5), surface(lamp, 0.0)]);
    spec.surfaces[1].sides = Sides::Both;
    spec.surfaces[2].emittance = 1.0.into();
    let middle = DVec3::splat(0.5);
    let sensors = [desk(0.5, [1, 1]), point(middle, DVec3::Z), point(middle, -DVec3::Z)];
    let experiment = experiment(&spec, Method::shooting(EstimatorKind::Collision)).with_sensors(&sensors);
    let readings = read(&experiment.unwrap(), 16 << 10);
    let h = |i: usize| readings[i].irradiance.unwrap();
    assert!(h(0) > 0.5 && h(1) > 0.5, "{readings:?}");
    // The floor below is dark, and the sheet's lower side. Had samples that bring 2 W/m² a probability p, all would have stayed out with (1 − p)ⁿ.
    assert_eq!((h(2), readings[2].ci_low, readings[2].std_error), (0.0, 0.0, None));
    assert!((readings[2].ci_high - 2.0 * (1.0 - 0.025_f64.powf(1.0 / 16.0))).abs() < 1e-12, "{readings:?}");
}

/// A closed cube of 1 m, R = 0.8, and a lamp of 1 W that hardly any gathering walk meets. The reading is that
/// of shadow rays alone where none has, and its interval has room for all else.
#[test]
fn gathering_walks_may_miss_a_lamp() {
    let mut spec = SceneSpec::furnace(3, 0.8);
    spec.surfaces.iter_mut().for_each(|surface| surface.emittance = 0.0.into());
    for (side, walks) in [(0.001, 50_000), (0.03, 50_000)] {
        let corner = DVec3::new(0.5, 0.5, 1.0 - 1e-3);
        let lamp = quad(corner - DVec3::new(0.5, 0.5, 0.0) * side, side * DVec3::Y, side * DVec3::X, [1, 1]);
        let mut spec = spec.clone();
        spec.surfaces.push(surface(lamp, 0.0));
        spec.surfaces[6].emittance = (1.0 / (side * side)).into();
        let on_desk = [point(DVec3::new(0.5, 0.5, 0.3), DVec3::Z)];
        let read_by = |method: Method, walks| {
            read(&experiment(&spec, method).with_sensors(&on_desk).unwrap(), walks)[0]
        };
        let chains = Chains { rays: 200_000, linear: false, solve: Solve::Links, final_gather: vec![] };
        let known = read_by(chains.into(), 8);
        let (truth, error) = (known.irradiance.unwrap(), known.std_error.unwrap());
        let found = read_by(Method::gathering(Birth::Area, EstimatorKind::Collision), walks);
        let (low, high) = (found.ci_low - 3.0 * error, found.ci_high + 3.0 * error);
        assert!((low..high).contains(&truth) && error < 0.01 * truth, "{side}: {found:?} {known:?}");
    }
}

#[test]
fn walks_that_do_not_tell_of_every_patch_or_of_all_light_are_refused() {
    let few = Method::gathering(Birth::Patches(vec![3]), EstimatorKind::Collision);
    let refused = experiment(&cube54(), few).with_sensors(&[desk(0.5, [1, 1])]);
    assert_eq!(refused.unwrap_err(), Unfit::SensorsOfFewPatches);
    let cut_off = EstimatorKind::Infinite.ending(InfiniteEnd::Cutoff { threshold: 0.5 });
    let refused =
        experiment(&cube54(), Method::shooting(Score::Of(cut_off))).with_sensors(&[desk(0.5, [1, 1])]);
    assert_eq!(refused.unwrap_err(), Unfit::CutOffSensors);
    let batches = Batches { walks: 100, sampler: Sampler::Random, score: BatchScore::FinalGather(vec![1]) };
    let without = experiment(&cube54(), batches).with_sensors(&[]).unwrap();
    assert!(without.sensors().is_none() && without.rows() == 54);
}
