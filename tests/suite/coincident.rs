//! Tests of coincident surfaces, which are layers with infinitely thin gaps: whatever is doubled, overlaps or touches,
//! a place has the light of the scene without twins, by every method.

use crate::common::{box_scene, collision, experiment, flipped, quad, rotation, surface, walk};
use exact::Exact;
use glam::DVec3;
use radiosity::{
    Birth, Chains, Direction, Estimator, EstimatorKind, Experiment, IndexChoice, Method, Scene, SceneSpec,
    Sequence, Shape, Sides, Solution, Space, SurfaceSpec, WalkRng, Walks,
    methods::{BatchScore, Batches, Iterations, Sampler, Solve},
};

const R: f64 = 0.8;

/// The ways in which the walls of a cube are doubled, all but the lamp's.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Twin {
    None,
    SameWay,
    BackToBack,
    /// The twin faces the same way, 0.1 mm outside.
    Near,
}

fn shifted(shape: &Shape, by: DVec3) -> Shape {
    shape.moved(|corner| corner + by)
}

fn normal(shape: &Shape) -> DVec3 {
    let (_, u, v) = shape.edges();
    u.cross(v).normalize()
}

/// A unit cube of R = 0.8 whose second wall emits 1 W/m², the others with twins.
fn cube(twin: Twin, sides: Sides) -> SceneSpec {
    let wall = |shape| SurfaceSpec { sides, ..surface(shape, R) };
    let walls = crate::common::box_walls(DVec3::ONE, [1, 1]);
    let mut surfaces: Vec<SurfaceSpec> = walls.iter().cloned().map(wall).collect();
    surfaces[1].emittance = 1.0.into();
    let twins = walls.iter().enumerate().filter(|&(i, _)| i != 1).filter_map(|(_, shape)| match twin {
        Twin::None => None,
        Twin::SameWay => Some(wall(shape.clone())),
        Twin::BackToBack => Some(wall(flipped(shape.clone()))),
        Twin::Near => Some(wall(shifted(shape, -1e-4 * normal(shape)))),
    });
    surfaces.extend(twins.collect::<Vec<_>>());
    SceneSpec::new(surfaces)
}

/// The power Φ on all faces in the plane of each of some walls [W], and its variance.
fn power_on(walls: &[Shape], experiment: &Experiment, solution: &Solution) -> Vec<[f64; 2]> {
    let mut power = vec![[0.0; 2]; walls.len()];
    for (face, estimate) in experiment.scene().faces().iter().zip(&solution.estimates) {
        let estimate = estimate.expect("every method tells of all faces");
        // No light reaches a buried face, and no walk tells of it.
        let (h, error) = (estimate.irradiance.unwrap_or(0.0), estimate.irradiance_error.unwrap_or(0.0));
        let height = |wall: &Shape| normal(wall).dot(face.centroid - wall.edges().0).abs();
        let nearest = |a: &usize, b: &usize| height(&walls[*a]).total_cmp(&height(&walls[*b]));
        let wall = (0..walls.len()).min_by(nearest).unwrap();
        power[wall][0] += face.area * h;
        power[wall][1] += (face.area * error).powi(2);
    }
    power
}

fn method(direction: Direction, estimator: EstimatorKind, space: Space) -> Method {
    Walks { direction, space, score: estimator.into() }.into()
}

/// Every kind of walk, with a number of walks (or chains) that is enough.
fn methods() -> Vec<(Method, u64)> {
    use EstimatorKind::{Absorption, Collision, Infinite, Survival};
    let mut methods = Vec::new();
    for space in [Space::Discrete, Space::Continuous] {
        for estimator in [Absorption, Survival, Collision, Infinite] {
            methods.push((method(Direction::Shooting, estimator, space), 10_000));
            methods.push((method(Direction::Gathering(Birth::Area), estimator, space), 30_000));
        }
    }
    for solve in [Solve::Links, Solve::Iterations(Iterations::default())] {
        for final_gather in [vec![], vec![0, 1, 3]] {
            methods.push((Chains { rays: 2_000, linear: false, solve, final_gather }.into(), 16));
        }
    }
    for sampler in [Sampler::Random, Sampler::Sobol] {
        let plain = BatchScore::Of(Estimator::Collision, Space::Discrete);
        for score in [plain, BatchScore::FinalGather(vec![0, 1, 3])] {
            methods.push((Batches { walks: 1_000, sampler, score }.into(), 16));
        }
    }
    methods
}

/// 24 methods × 8 scenes × 6 walls, each within 4.5 standard errors (Student's t of 15 degrees of freedom for batches
/// and chains: 8): false-alarm rate below 1 %, once and for all with this seed. In discrete walks each wall is one
/// patch. In continuous walks the walls differ from that as those of the plain cube do, by a difference that 10⁶ walks
/// measure.
#[test]
fn a_face_and_its_twin_together_have_the_light_of_the_plain_cube() {
    let plain = cube(Twin::None, Sides::Front);
    let walls = crate::common::box_walls(DVec3::ONE, [1, 1]);
    let exact = Exact::of_scene(&plain).unwrap();
    let discrete = &exact.solution().irradiance;
    let reference = experiment(&plain, IndexChoice::Auto, collision(Space::Continuous));
    let tally = walk(&reference, 1, 0..1_000_000);
    let continuous = power_on(&walls, &reference, &Solution::new(&reference, &tally, 0.95));
    for twin in [Twin::None, Twin::SameWay, Twin::BackToBack, Twin::Near] {
        for sides in [Sides::Front, Sides::Both] {
            let spec = cube(twin, sides);
            for (method, walks) in methods() {
                let index =
                    if method.space() == Space::Discrete { IndexChoice::Flat } else { IndexChoice::Tree };
                let experiment = experiment(&spec, index, method.clone());
                let solution = Solution::new(&experiment, &walk(&experiment, 7, 0..walks), 0.95);
                let limit = if experiment.unit().is_walk() { 4.5 } else { 8.0 };
                for (wall, [power, variance]) in
                    power_on(&walls, &experiment, &solution).into_iter().enumerate()
                {
                    let [truth, more] = match method.space() {
                        Space::Discrete => [discrete[wall], 0.0],
                        Space::Continuous => continuous[wall],
                    };
                    let z = (power - truth) / (variance + more + 1e-18).sqrt();
                    assert!(
                        z.abs() < limit && variance.sqrt() < 0.1 * truth,
                        "{twin:?}, {sides:?}, {method:?}: wall {wall} has {power}, not {truth}: z = {z:.1}"
                    );
                }
            }
        }
    }
}

/// A box with a lamp in its ceiling, and rectangles in the planes of its other walls: equal, nested, overlapping,
/// touching, sticking out; either way round, one-sided or two-sided; each of the reflectance of its wall.
fn cluttered(seed: u64) -> [SceneSpec; 2] {
    let mut rng = Sequence::new(seed).walk(0);
    let size = DVec3::from_array([0, 1, 2].map(|_| 0.5 + 2.0 * unit(&mut rng)));
    let mut plain = box_scene(size, [1, 1]);
    plain.surfaces[0].cell_emittance.clear();
    plain.surfaces[1].emittance = 1.0.into();
    let mut cluttered = SceneSpec::new(vec![]);
    for (number, wall) in plain.surfaces.iter().enumerate() {
        let count = if number == 1 { 0 } else { (4.0 * unit(&mut rng)) as usize };
        let before = (unit(&mut rng) * (count + 1) as f64) as usize;
        for i in 0..=count {
            cluttered.surfaces.push(if i == before { wall.clone() } else { twin(wall, &mut rng) });
        }
    }
    let turn =
        |spec: &SceneSpec| crate::common::map_corners(spec, |p| rotation() * p + DVec3::new(3.0, -1.0, 0.5));
    if seed.is_multiple_of(2) { [plain, cluttered] } else { [&plain, &cluttered].map(turn) }
}

fn unit(rng: &mut WalkRng) -> f64 {
    rng.pair()[0]
}

/// A rectangle (or half of one) in the plane of a wall.
fn twin(wall: &SurfaceSpec, rng: &mut WalkRng) -> SurfaceSpec {
    let (corner, u, v) = wall.shape.edges();
    // Places are mostly whole quarters, so that edges often lie on each other and on the wall's; now and then any
    // number.
    let mut place = |most: f64| {
        let at = most * unit(rng);
        if unit(rng) < 0.7 { (4.0 * at).round() / 4.0 } else { at }
    };
    let (from, to) = ([place(0.75), place(0.75)], [place(1.25), place(1.25)]);
    let span = [0, 1].map(|k: usize| (to[k] - from[k]).abs().max(0.25));
    let low = [0, 1].map(|k: usize| from[k].min(to[k]));
    let (c, u, v) = (corner + u * low[0] + v * low[1], u * span[0], v * span[1]);
    let kind = (4.0 * unit(rng)) as u32;
    let shape = match kind {
        0 => Shape::Triangle { a: c, b: c + u, c: c + v, rows: 2 },
        _ => quad(c, u, v, [2, 1]),
    };
    let shape = if unit(rng) < 0.5 { flipped(shape) } else { shape };
    let sides = if unit(rng) < 0.5 { Sides::Both } else { Sides::Front };
    SurfaceSpec { shape, sides, ..surface(wall.shape.clone(), wall.reflectance[0]) }
}

/// 40 cluttered boxes against the same boxes without clutter: the power that arrives on each wall's plane, in 240
/// differences. Of standard normal numbers none exceeds 4.5 (false-alarm rate 1.6·10⁻³, once and for all with these
/// seeds). No ray is lost.
#[test]
fn clutter_in_the_planes_of_walls_changes_nothing() {
    const WALKS: u64 = 40_000;
    let mut stacked = 0;
    for seed in 0..40 {
        let [plain, cluttered] = cluttered(seed);
        let walls: Vec<Shape> = plain.surfaces.iter().map(|wall| wall.shape.clone()).collect();
        let [truth, found] = [(&plain, 100 + seed), (&cluttered, 200 + seed)].map(|(spec, seed)| {
            let index = if seed % 4 < 2 { IndexChoice::Flat } else { IndexChoice::Tree };
            let experiment = experiment(spec, index, collision(Space::Continuous));
            let tally = walk(&experiment, seed, 0..WALKS);
            assert_eq!((tally.counts.escaped, tally.counts.absorbed_back), (0, 0), "scene {seed}");
            stacked += experiment.scene().stacks().len();
            let solution = Solution::new(&experiment, &tally, 0.95);
            power_on(&walls, &experiment, &solution)
        });
        for (wall, (truth, found)) in truth.iter().zip(&found).enumerate() {
            let z = (found[0] - truth[0]) / (found[1] + truth[1]).sqrt();
            assert!(z.abs() < 4.5, "scene {seed}, wall {wall}: {found:?}, not {truth:?}: z = {z:.1}");
        }
    }
    assert!(stacked > 100, "{stacked} stacks");
}

#[test]
fn stacks_hold_what_overlaps_in_one_plane_and_nothing_else() {
    let stacks = |shapes: &[(Shape, Sides)]| {
        let surfaces = shapes.iter().cloned().map(|(shape, sides)| SurfaceSpec {
            sides,
            emittance: 1.0.into(),
            ..surface(shape, R)
        });
        let spec = SceneSpec::new(surfaces.collect());
        let found = [IndexChoice::Flat, IndexChoice::Tree].map(|index| {
            let scene = Scene::build(&spec, index).unwrap();
            scene.stacks().iter().map(|stack| stack.surfaces.clone()).collect::<Vec<_>>()
        });
        assert_eq!(found[0], found[1]);
        found.into_iter().next().unwrap()
    };
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    let tile = |i: f64, j: f64| quad(x * i + y * j, x, y, [1, 1]);
    let (front, both) = (Sides::Front, Sides::Both);
    // Tiles share edges and corners, a wall stands on their edge, a plate is 0.1 µm above: nothing overlaps.
    let wall = quad(DVec3::ZERO, x, z, [1, 1]);
    let plate = shifted(&tile(0.0, 0.0), 1e-7 * z);
    let apart = [
        (tile(0.0, 0.0), front),
        (tile(1.0, 0.0), front),
        (tile(1.0, 1.0), both),
        (wall, both),
        (plate, both),
    ];
    assert!(stacks(&apart).is_empty());
    // The order is: fronts outermost, the least number first; two-sided surfaces between; those that face down at the
    // bottom, the least number last. The normal is that of surface 0.
    let half = || tile(0.5, 0.5);
    let down = || flipped(half());
    let layers = [
        (down(), front),
        (half(), both),
        (tile(0.0, 0.0), front),
        (half(), front),
        (down(), front),
        (tile(0.0, 0.0), both),
    ];
    assert_eq!(stacks(&layers), [[0, 4, 1, 5, 3, 2]]);
    // There are two planes, each with a stack; the chain of overlaps 0 – 1 – 2 is one.
    let chain = [
        (tile(0.0, 0.0), front),
        (tile(0.7, 0.0), front),
        (tile(1.4, 0.0), both),
        (shifted(&tile(0.0, 0.0), z), front),
        (shifted(&half(), z), front),
    ];
    assert_eq!(stacks(&chain), [vec![0, 1, 2], vec![3, 4]]);
}

/// A surface that is in the plane but for the rounding of its corners is a twin, in any pose.
#[test]
fn twins_are_found_in_any_pose() {
    for scale in [1e-3, 1.0, 1e4] {
        let mut spec = cube(Twin::BackToBack, Sides::Front);
        // These are halves of a wall, cut along a line that rounding moves.
        let wall = spec.surfaces[0].shape.clone();
        let (corner, u, v) = wall.edges();
        spec.surfaces.push(surface(quad(corner, u / 3.0, v, [1, 1]), R));
        spec.surfaces.push(surface(quad(corner + u / 3.0, u - u / 3.0, v, [1, 1]), R));
        let moved = |spec: &SceneSpec| {
            crate::common::map_corners(spec, |p| scale * (rotation() * (p + DVec3::new(7.3, -2.1, 4.4))))
        };
        let scene = Scene::build(&moved(&spec), IndexChoice::Auto).unwrap();
        let mut sizes: Vec<usize> = scene.stacks().iter().map(|stack| stack.surfaces.len()).collect();
        sizes.sort_unstable();
        assert_eq!(sizes, [2, 2, 2, 2, 4], "scale {scale}");
    }
}
