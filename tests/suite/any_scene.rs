//! Scenes drawn at random, most of which no one would build. Faces touch, coincide, cross, or are slivers or points. Numbers lie at the ends of their range.
//! Each scene is examined, built and walked, as `check` and `run` do: it is refused in words, or gives finite numbers that are possible. Walks in some are held
//! against the exact solution.

use std::panic::catch_unwind;
use std::sync::mpsc;
use std::time::{Duration, Instant};

use exact::{Exact, SystemAccuracy};
use glam::DVec3;
use radiosity::{
    Birth, Estimator, EstimatorKind, Experiment, IndexChoice, Scene, SceneSpec, Sequence, Shape, Sides,
    Solution, Space, Spectrum, SurfaceSpec, Tally, Walks,
};

/// Scenes of the everyday suite.
const SHORT: u64 = 500;

/// Scenes that were wrong once. In one, two faces of the same area coincided with a tree alone: their distance is where faces begin to. The other was never built: the
/// largest of some faces that coincide is a sliver whose corners are off its own plane.
const WRONG_ONCE: [u64; 2] = [3_146_354, 7_866_715];

/// What is done with some scenes, and not with all.
#[derive(Clone, Copy)]
struct Depth {
    /// The walks of each.
    walks: u64,
    /// One in this many is examined as `check` does, which takes more walks than all else.
    examined: u64,
    /// One in this many is held against the exact solution, if it is small and its numbers are not at the ends of their range.
    exact: u64,
}

/// The everyday suite's.
const EVERYDAY: Depth = Depth { walks: 200, examined: 1, exact: 20 };

/// The most faces of such a scene: where these cross each other the exact solution takes seconds.
const MOST_FACES: usize = 10;

/// Walks of a scene whose answer is known.
const EXACT_WALKS: u64 = 4_000;

/// The longest that one scene may take: nothing but a hang is meant.
const HANG: Duration = Duration::from_secs(300);

/// What takes longer is named at once, so that a hang has a number.
const SLOW: Duration = Duration::from_secs(5);

/// An error in standard errors above which other, more walks decide. A face with a hundred effective hits goes beyond it once in a million times.
const DOUBT: f64 = 5.5;

/// Random numbers: splitmix64 (Steele, Lea and Flood 2014).
struct Lots(u64);

impl Lots {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let x = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        x ^ (x >> 31)
    }

    fn below(&mut self, n: u64) -> u64 {
        self.next() % n
    }

    fn one_in(&mut self, n: u64) -> bool {
        self.below(n) == 0
    }

    fn uniform(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn of<T: Copy>(&mut self, choice: &[T]) -> T {
        choice[self.below(choice.len() as u64) as usize]
    }

    /// A coordinate: mostly on a coarse grid, so that faces meet.
    fn coordinate(&mut self) -> f64 {
        match self.below(12) {
            0 => self.of(&[-0.0, 1e-12, 1.0 + 1e-12, 1.0 - f64::EPSILON, 1e-300, 5e-324]),
            1..3 => self.uniform(),
            _ => self.of(&[0.0, 0.0, 1.0, 1.0, 0.5, 2.0, -1.0, 1.0 / 3.0]),
        }
    }

    fn point(&mut self) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| self.coordinate()))
    }

    /// A number of a material; at the ends of its range where that is `wild`.
    fn reflectance(&mut self, wild: bool) -> f64 {
        match wild && self.one_in(4) {
            true => self.of(&[-0.0, 5e-324, 1.0 - f64::EPSILON, 1.0, 1.5, -0.1, f64::NAN, f64::INFINITY]),
            false => self.of(&[0.0, 0.2, 0.5, 0.5, 0.8, 0.95]),
        }
    }

    fn emittance(&mut self, wild: bool) -> f64 {
        match wild && self.one_in(4) {
            true => self.of(&[-0.0, 5e-324, 1e-308, 1e308, f64::MAX, -1.0, f64::NAN, f64::INFINITY]),
            false => self.of(&[0.0, 0.0, 0.0, 1.0, 100.0]),
        }
    }

    fn spectrum(&mut self, coloured: bool, mut value: impl FnMut(&mut Self) -> f64) -> Spectrum {
        match coloured {
            true => Spectrum::rgb(std::array::from_fn(|_| value(self))),
            false => value(self).into(),
        }
    }
}

/// A scene by its number, and whether its numbers are at the ends of their range.
fn scene(number: u64) -> (SceneSpec, bool) {
    let lots = &mut Lots(number.wrapping_mul(0xD134_2543_DE82_EF95));
    let wild = lots.one_in(3);
    let coloured = wild && lots.one_in(4);
    let scale = match wild && lots.one_in(2) {
        true => lots.of(&[1e-308, 1e-150, 1e-30, 1e-3, 1e3, 1e30, 1e150, 1e308]),
        false => 1.0,
    };
    let mut surfaces: Vec<SurfaceSpec> = match lots.one_in(3) {
        true => crate::common::box_walls(DVec3::ONE, [1, 1])
            .into_iter()
            .map(|w| SurfaceSpec::new(w, 0.5))
            .collect(),
        false => Vec::new(),
    };
    for _ in 0..1 + lots.below(5) {
        surfaces.push(SurfaceSpec::new(shape(lots, &surfaces), 0.0));
    }
    for surface in &mut surfaces {
        surface.reflectance = lots.spectrum(coloured, |lots| lots.reflectance(wild));
        surface.emittance = lots.spectrum(coloured, |lots| lots.emittance(wild));
        surface.sides = if lots.one_in(3) { Sides::Both } else { Sides::Front };
        if wild && lots.one_in(8) {
            surface.transmittance = lots.of(&[0.3, 0.5, 1.0]).into();
        }
    }
    if !surfaces.iter().any(|surface| surface.emittance.channels().iter().any(|&e| e > 0.0)) {
        surfaces[0].emittance = 1.0.into();
    }
    let spec = SceneSpec::new(surfaces);
    (if scale == 1.0 { spec } else { crate::common::map_corners(&spec, |corner| scale * corner) }, wild)
}

/// A face: one by itself, one that is there already, one beside it, or a sliver.
fn shape(lots: &mut Lots, others: &[SurfaceSpec]) -> Shape {
    let cells = lots.of(&[[1, 1], [1, 1], [2, 1], [2, 2], [3, 2]]);
    let (corner, mut u, mut v) = (lots.point(), lots.point(), lots.point());
    match lots.below(8) {
        0 if !others.is_empty() => return others[lots.below(others.len() as u64) as usize].shape.clone(),
        1 if !others.is_empty() => {
            let shift =
                lots.of(&[1e-15, 1e-12, 1e-9, 1e-6, 0.1]) * lots.of(&[DVec3::X, DVec3::Z, DVec3::ONE]);
            let other = SceneSpec::new(vec![others[lots.below(others.len() as u64) as usize].clone()]);
            return crate::common::map_corners(&other, |corner| corner + shift).surfaces.remove(0).shape;
        }
        2 => v = u + lots.of(&[1e-15, 1e-9, 1e-4, 0.01]) * v,
        3 => u *= lots.of(&[1e-300, 1e-12, 1e-6]),
        _ => {}
    }
    match lots.one_in(3) {
        true => Shape::Triangle { a: corner, b: corner + u, c: corner + v, rows: cells[0] },
        false => Shape::parallelogram(corner, u, v, cells),
    }
}

/// What became of scenes.
#[derive(Default)]
struct Outcomes {
    refused: u64,
    walked: u64,
    exact: u64,
    faces: u64,
    /// Errors beyond [`DOUBT`], which more walks did not confirm.
    doubted: u64,
}

fn method(lots: &mut Lots) -> Walks {
    let estimator = lots.of(&[EstimatorKind::Collision, EstimatorKind::Absorption, EstimatorKind::Survival]);
    let walks = match lots.one_in(4) {
        true => Walks::gathering(Birth::Area, Estimator::Collision),
        false => Walks::shooting(estimator),
    };
    Walks { space: lots.of(&[Space::Discrete, Space::Continuous]), ..walks }
}

fn tally(experiment: &Experiment, seed: u64, walks: u64) -> Tally {
    let mut board = experiment.board();
    experiment.walk(&Sequence::new(seed), 0..walks, &mut board);
    board.take().expect("few walks fit")
}

fn solved(experiment: &Experiment, seed: u64, walks: u64) -> Solution {
    Solution::new(experiment, &tally(experiment, seed, walks), 0.95)
}

/// Builds and walks a scene, with a tree and without: the tallies are the same to the last bit. Some are examined, too, and some held against the exact
/// solution.
fn try_scene(number: u64, depth: Depth, outcomes: &mut Outcomes) {
    let (spec, wild) = scene(number);
    let built = Scene::build(&spec, IndexChoice::Flat);
    let is_examined = number.is_multiple_of(depth.examined);
    if is_examined {
        let examined = doctor::examine(&spec);
        assert_eq!(examined.is_err(), built.is_err(), "check and run disagree: {:?}", examined.err());
    }
    let Ok(scene) = built else {
        outcomes.refused += 1;
        return;
    };
    if is_examined {
        doctor::warnings(&scene).iter().for_each(|warning| assert!(!warning.is_empty()));
    }
    // Where such light is caught between two faces a walk takes years; the doctor has a warning.
    if scene.max_reflectance().max() > doctor::ENDLESS {
        outcomes.refused += 1;
        return;
    }
    let method = method(&mut Lots(!number));
    let Ok(experiment) = Experiment::new(scene, method.clone()) else {
        outcomes.refused += 1;
        return;
    };
    outcomes.walked += 1;
    let found = tally(&experiment, number, depth.walks);
    let in_tree = Scene::build(&spec, IndexChoice::Tree).expect("it was built before");
    let in_tree = Experiment::new(in_tree, method).expect("as before");
    assert!(tally(&in_tree, number, depth.walks) == found, "a tree changes the tally");
    let solution = Solution::new(&experiment, &found, 0.95);
    for estimate in solution.estimates.iter().flatten() {
        let (b, low, high) = (estimate.radiosity, estimate.ci_low, estimate.ci_high);
        assert!(b >= 0.0 && low <= b && b <= high, "{b} in {low} … {high}");
    }
    if number.is_multiple_of(depth.exact) && !wild && experiment.scene().faces().len() <= MOST_FACES {
        agree(number, &spec, outcomes);
    }
}

/// Holds shooting walks against the exact solution, on faces whose standard error is predicted below a tenth.
fn agree(number: u64, spec: &SceneSpec, outcomes: &mut Outcomes) {
    let Ok(exact) = Exact::of_scene(spec) else { return };
    let stated = SystemAccuracy::of(&exact).radiosity_error;
    let scene = Scene::build(spec, IndexChoice::Auto).expect("it was built before");
    let experiment = Experiment::new(scene, Walks::shooting(EstimatorKind::Collision)).expect("as before");
    let variances = exact.shooting_variances(EstimatorKind::Collision);
    outcomes.exact += 1;
    let truth = &exact.solution().radiosity;
    let errors = |seed: u64, walks: u64, face: usize| {
        let found =
            solved(&experiment, seed, walks).estimates[face].map_or(0.0, |estimate| estimate.radiosity);
        let noise = (variances[face] / walks as f64).sqrt();
        ((found - truth[face]).abs() - 2.0 * stated[face] - 1e-9 * truth[face]) / noise
    };
    let reached = (0..truth.len()).filter(|&face| {
        exact.emittance()[face] == 0.0 && (variances[face] / EXACT_WALKS as f64).sqrt() < 0.1 * truth[face]
    });
    for face in reached {
        outcomes.faces += 1;
        if errors(number, EXACT_WALKS, face) < DOUBT {
            continue;
        }
        outcomes.doubted += 1;
        let surely = errors(!number, 100 * EXACT_WALKS, face);
        assert!(surely < DOUBT, "face {face} is {surely} standard errors off");
    }
}

/// Tries a scene on a thread of its own, which is given up where it hangs.
fn outcomes_of(number: u64, depth: Depth) -> Outcomes {
    let (done, outcome) = mpsc::channel();
    std::thread::spawn(move || {
        let mut outcomes = Outcomes::default();
        let tried = catch_unwind(move || {
            try_scene(number, depth, &mut outcomes);
            outcomes
        });
        // A scene that was given up has no listener.
        _ = done.send(tried);
    });
    let mut tried = outcome.recv_timeout(SLOW);
    if tried.is_err() {
        println!("scene {number} takes more than {SLOW:?}");
        let began = Instant::now();
        tried = outcome.recv_timeout(HANG);
        println!("scene {number} takes {:?}", SLOW + began.elapsed());
    }
    let Ok(Ok(outcomes)) = tried else { panic!("scene {number}: {:#?}", scene(number).0) };
    outcomes
}

/// Tries scenes by their numbers.
fn try_scenes(numbers: impl Iterator<Item = u64>, depth: Depth) -> Outcomes {
    let mut outcomes = Outcomes::default();
    for more in numbers.map(|number| outcomes_of(number, depth)) {
        outcomes.refused += more.refused;
        outcomes.walked += more.walked;
        outcomes.exact += more.exact;
        outcomes.faces += more.faces;
        outcomes.doubted += more.doubted;
    }
    outcomes
}

#[test]
fn any_scene_is_refused_or_gives_possible_numbers() {
    let outcomes = try_scenes((0..SHORT).chain(WRONG_ONCE), EVERYDAY);
    assert!(outcomes.refused > SHORT / 10 && outcomes.walked > SHORT / 4 && outcomes.exact > SHORT / 100);
}

/// As many as fit in `RADWALK_SECONDS` seconds (600) on each of two threads, from scene `RADWALK_FIRST` (that after the everyday ones) on. Each takes
/// `RADWALK_WALKS` walks (200). One in `RADWALK_EXAMINED` (1) is examined, one in `RADWALK_EXACT` (20) held against the exact solution.
#[test]
#[ignore = "takes ten minutes"]
fn a_million_scenes_are_refused_or_give_possible_numbers() {
    let given = |key: &str, usual: u64| std::env::var(key).map_or(usual, |text| text.parse().unwrap());
    let (seconds, first) = (given("RADWALK_SECONDS", 600), given("RADWALK_FIRST", SHORT));
    let depth = Depth {
        walks: given("RADWALK_WALKS", EVERYDAY.walks),
        examined: given("RADWALK_EXAMINED", EVERYDAY.examined),
        exact: given("RADWALK_EXACT", EVERYDAY.exact),
    };
    let began = Instant::now();
    let going = || began.elapsed() < Duration::from_secs(seconds);
    let lane = |(): &mut (), lane: usize| {
        try_scenes((first + lane as u64..).step_by(2).take_while(|_| going()), depth)
    };
    let all = parallel::on_threads(2, 2, || (), lane);
    let sum = |of: fn(&Outcomes) -> u64| all.iter().map(of).sum::<u64>();
    println!(
        "{} scenes refused in words, {} walked, {} held against the exact solution on {} faces, {} of which were doubted and cleared",
        sum(|o| o.refused),
        sum(|o| o.walked),
        sum(|o| o.exact),
        sum(|o| o.faces),
        sum(|o| o.doubted)
    );
}

/// Light and lengths at the ends of the range of numbers are refused in words: estimates would be no numbers, or 0 ± 0.
#[test]
fn light_and_lengths_whose_squares_are_no_numbers_are_refused() {
    let room = |scale: f64, emittance: f64| {
        let walls = crate::common::box_walls(DVec3::ONE, [1, 1]);
        let mut spec =
            SceneSpec::new(walls.into_iter().map(|wall| SurfaceSpec::new(wall, 0.5)).collect::<Vec<_>>());
        spec.surfaces[0].emittance = emittance.into();
        crate::common::map_corners(&spec, |corner| scale * corner)
    };
    for (scale, emittance, said) in [
        (1.0, f64::MAX, "W/m² is beyond 1e-60 … 1e60"),
        (1.0, 5e-324, "W/m² is beyond 1e-60 … 1e60"),
        (1e60, 1.0, "farther away than 1e36 m"),
        (1e-40, 1.0, "shorter than 1e-36 m"),
    ] {
        let refused = Scene::build(&room(scale, emittance), IndexChoice::Auto).err().unwrap().to_string();
        assert!(refused.contains(said), "{refused}");
    }
    for (scale, emittance) in [(9e35, 1e-60), (9e35, 1e60), (2e-36, 1e60), (2e-36, 1e-60)] {
        let scene = Scene::build(&room(scale, emittance), IndexChoice::Auto).unwrap();
        let experiment = Experiment::new(scene, Walks::shooting(EstimatorKind::Collision)).unwrap();
        for estimate in solved(&experiment, 1, 10_000).estimates.iter().flatten() {
            // A closed room of one reflectance: 0.5 of E/(6 · 0.5) on average, and none far from that.
            let part = (estimate.radiosity
                - if estimate.radiosity > 0.9 * emittance { emittance } else { 0.0 })
                / emittance;
            assert!((0.05..0.5).contains(&part), "{scale:e}, {emittance:e}: {part}");
            assert!(estimate.std_error.is_some_and(|error| error > 0.0 && error < 0.1 * estimate.radiosity));
        }
    }
}
