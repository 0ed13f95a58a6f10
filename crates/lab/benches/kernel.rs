//! The kernel's parts and whole walks: `cargo bench -p radwalk-lab`, or `cargo bench -p radwalk-lab -- walk` for a part.
//!
//! One thread, one core. Items are draws, directions, rays and scores: read the rates (median column). Absolute
//! figures drift with the machine; compare what was measured in one run.

use std::hint::black_box;

use divan::Bencher;
use divan::counter::ItemsCount;
use glam::DVec3;
use photometry::{Distribution, Luminaire};
use radiosity::{
    Birth, Direction, EstimatorKind, Experiment, IndexChoice, Scene, SceneSpec, Sequence, Side, Space, Walks,
    boards::HitScoreboard,
    lamps::{Emission, LampSpec, LampsSpec},
    rays::Ray,
};
use scenes::{cornell, cube, interior};

fn main() {
    divan::main();
}

/// The names of the scenes in which walks are timed.
const SCENES: [&str; 4] = ["cube54", "cornell", "interior-57k", "interior-1M"];

fn spec(name: &str) -> SceneSpec {
    match name {
        "cube54" => cube(3),
        "cornell" => cornell(),
        "interior-57k" => interior(57_000),
        "interior-1M" => interior(1_000_000),
        _ => unreachable!("no other scene is named"),
    }
}

fn scene(name: &str) -> Scene {
    Scene::build(&spec(name), IndexChoice::Auto).expect("scenes by rule are valid")
}

/// 64-bit draws of one walk after the other, 16 each.
#[divan::bench]
fn generator(bencher: Bencher) {
    const WALKS: usize = 4096;
    let sequence = Sequence::new(1);
    bencher.counter(ItemsCount::new(16 * WALKS)).bench(|| {
        let walks = sequence.walks_from(black_box(0)).take(WALKS);
        walks.fold(0, |sum: u64, mut walk| (0..16).fold(sum, |sum, _| sum.wrapping_add(walk.bits())))
    });
}

/// Cosine-distributed directions, the draw included.
#[divan::bench]
fn direction(bencher: Bencher) {
    const DIRECTIONS: usize = 65_536;
    let scene = scene("cube54");
    let surface = &scene.surfaces()[1];
    let mut rng = Sequence::new(1).walk(0);
    bencher.counter(ItemsCount::new(DIRECTIONS)).bench_local(|| {
        let directions = (0..DIRECTIONS).map(|_| surface.direction(Side::Front, rng.bits()));
        directions.fold(glam::DVec3::ZERO, |sum, direction| sum + direction)
    });
}

/// Nearest hits, one ray at a time. Rays leave uniform points of patches taken at random.
#[divan::bench(args = SCENES)]
fn trace(bencher: Bencher, name: &str) {
    const RAYS: usize = 16_384;
    let scene = scene(name);
    let rays = rays(&scene, RAYS);
    bencher.counter(ItemsCount::new(RAYS)).bench(|| {
        rays.iter().filter_map(|ray| scene.closest_hit(black_box(ray))).map(|hit| hit.t).sum::<f64>()
    });
}

fn rays(scene: &Scene, count: usize) -> Vec<Ray> {
    let mut rng = Sequence::new(2).walk(0);
    let mut ray = || {
        let patch = scattered(rng.bits(), scene.faces().len() as u32);
        let number = scene.faces().get(patch as usize).surface;
        let surface = &scene.surfaces()[number as usize];
        let uv = surface.point_in_cell(patch - surface.piece(0, Side::Front), rng.pair());
        Ray { origin: surface.point(uv), direction: surface.direction(Side::Front, rng.bits()), from: number }
    };
    (0..count).map(|_| ray()).collect()
}

/// Whole walks by collision shooting in each scene: sampling, tracing, survival, tally.
#[divan::bench(args = SCENES)]
fn walk(bencher: Bencher, name: &str) {
    bench_walks(bencher, scene(name), method(Direction::Shooting, EstimatorKind::Collision, Space::Discrete));
}

/// Continuous walks, which draw no new point after a hit.
#[divan::bench(args = SCENES)]
fn walk_continuous(bencher: Bencher, name: &str) {
    bench_walks(
        bencher,
        scene(name),
        method(Direction::Shooting, EstimatorKind::Collision, Space::Continuous),
    );
}

/// Every other estimator of shooting, on the cube.
#[divan::bench(args = [EstimatorKind::Absorption, EstimatorKind::Survival, EstimatorKind::Infinite])]
fn walk_shooting(bencher: Bencher, estimator: EstimatorKind) {
    bench_walks(bencher, scene("cube54"), method(Direction::Shooting, estimator, Space::Discrete));
}

/// Every estimator of gathering, on the cube; its emitter reflects.
#[divan::bench(args = [
    EstimatorKind::Absorption, EstimatorKind::Survival, EstimatorKind::Collision, EstimatorKind::Infinite,
])]
fn walk_gathering(bencher: Bencher, estimator: EstimatorKind) {
    bench_walks(
        bencher,
        scene("cube54"),
        method(Direction::Gathering(Birth::Area), estimator, Space::Discrete),
    );
}

/// Whole walks against the number of patches: 6 n² on the cube, up to 1,572,864.
#[divan::bench(args = [1, 3, 32, 128, 512])]
fn walk_patches(bencher: Bencher, cells: u32) {
    let scene = Scene::build(&cube(cells), IndexChoice::Auto).expect("cubes are valid");
    bench_walks(bencher, scene, method(Direction::Shooting, EstimatorKind::Collision, Space::Discrete));
}

fn method(direction: Direction, estimator: EstimatorKind, space: Space) -> Walks {
    Walks { direction, space, score: estimator.into() }
}

/// Whole walks of 1.7 rays in a cube: born on its sides, and at lamps in its middle whose light is a formula or a table of 37 × 24 intensities.
#[divan::bench(args = ["area", "uniform", "table"])]
fn walk_births(bencher: Bencher, birth: &str) {
    let scene = Scene::build(&lit_cube(birth), IndexChoice::Auto).expect("cubes are valid");
    bench_walks(bencher, scene, method(Direction::Shooting, EstimatorKind::Collision, Space::Discrete));
}

fn lit_cube(birth: &str) -> SceneSpec {
    let mut spec = SceneSpec::furnace(3, 0.4);
    let emission = match birth {
        "area" => return spec,
        "uniform" => Emission::Uniform,
        _ => Emission::Table(0),
    };
    spec.surfaces.iter_mut().for_each(|surface| surface.emittance = 0.0.into());
    let lamp = LampSpec::new(DVec3::splat(0.5), emission, 1.0);
    spec.lamps = LampsSpec { tables: vec![table()], list: vec![lamp], ..LampsSpec::default() };
    spec
}

/// A table without symmetry, 15° by 5°.
fn table() -> Distribution {
    let angles = |count: u32, step: u32| (0..count).map(move |k| (k * step).to_string());
    let words = |words: &mut dyn Iterator<Item = String>| words.collect::<Vec<_>>().join(" ");
    let candela = |k: u32| (100 + (k.wrapping_mul(2_654_435_761) >> 7) % 400).to_string();
    let (gamma, c) = (words(&mut angles(37, 5)), words(&mut angles(25, 15)));
    let planes = words(&mut (0..37 * 25).map(|k: u32| candela(k % (37 * 24))));
    let file =
        format!("IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 37 25 1 2 0 0 0\n1 1 10\n{gamma}\n{c}\n{planes}\n");
    Luminaire::read(file.as_bytes()).expect("the file is one").distribution
}

/// Ever further walks onto one board, so that no cache keeps them. Rays are counted by the mean of the first 65,536
/// walks, good to half a percent.
fn bench_walks(bencher: Bencher, scene: Scene, method: Walks) {
    const WALKS: u64 = 16_384;
    let experiment = Experiment::new(scene, method).expect("the method fits the scene");
    let sequence = Sequence::new(1);
    let mut board = experiment.board();
    let mut next = 4 * WALKS;
    experiment.walk(&sequence, 0..next, &mut board);
    let rays = board.take().expect("so few walks fit any sum").counts.rays / 4;
    bencher.counter(ItemsCount::new(rays)).bench_local(|| {
        experiment.walk(&sequence, next..next + WALKS, &mut board);
        next += WALKS;
    });
}

/// Scores of hits, three a walk, on patches in no order: 54, and more than fit a core's caches.
#[divan::bench(args = [54, 1_572_864])]
fn tally(bencher: Bencher, patches: u32) {
    const HITS: u64 = 49_152;
    let mut board = HitScoreboard::<1>::new(patches as usize);
    let mut next = 0_u64;
    bencher.counter(ItemsCount::new(HITS)).bench_local(|| {
        for first in (next..next + HITS).step_by(3) {
            let patch = |hit: u64| scattered(hit.wrapping_mul(0x9E37_79B9_7F4A_7C15), patches);
            board.add_path(&[patch(first), patch(first + 1), patch(first + 2)], |_| [1]);
        }
        next += HITS;
    });
}

/// The patch that the upper half of 64 bits chooses.
fn scattered(bits: u64, patches: u32) -> u32 {
    (((bits >> 32) * u64::from(patches)) >> 32) as u32
}

/// A board emptied and merged, as a worker does at the end of a lease.
#[divan::bench(args = [54, 1_572_864], sample_count = 20)]
fn merge(bencher: Bencher, patches: usize) {
    let mut board = HitScoreboard::<1>::new(patches);
    let mut sum = board.take().expect("an empty board");
    bencher.counter(ItemsCount::new(patches)).bench_local(|| {
        sum.merge(&board.take().expect("an empty board")).expect("the same layout");
    });
}
