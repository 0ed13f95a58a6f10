//! Scenes where surfaces hide others: against closure, against rays that only `radiosity` traces, against
//! what can be said exactly.

use crate::common::{Numbers, assert_near};
use crate::rays::{Rays, assert_rays_agree};
use crate::shapes::{bumpy_ball, grey, l_room, painted, quad, room, turned};
use exact::{Exact, SystemAccuracy};
use radiosity::{EstimatorKind, IndexChoice, Scene, SceneSpec, Sides};

/// A room 2 × 1 × 1 with something in it.
fn room_with(inside: radiosity::Shape, sides: Sides) -> SceneSpec {
    let mut spec = painted(room([2.0, 1.0, 1.0], 2), 0.5, 1.0);
    let mut plate = grey(inside, 0.5, 1.0);
    plate.sides = sides;
    spec.surfaces.push(plate);
    spec
}

/// A wall half-way through the room that leaves a gap of 0.4 above.
fn wall() -> radiosity::Shape {
    quad([0.9, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.6], [2, 2])
}

/// A plate that hangs askew, off all walls.
fn plate() -> radiosity::Shape {
    quad([0.6, 0.2, 0.3], [0.7, 0.1, 0.2], [-0.1, 0.5, 0.3], [2, 1])
}

/// Closed scenes are dim by no more than their form factors are said to err.
#[test]
fn furnaces_in_shapes_that_hide_parts_of_themselves() {
    let scenes = [
        painted(l_room(3), 0.75, 0.5),
        turned(&painted(l_room(2), 0.75, 0.5)),
        painted(bumpy_ball(1), 0.75, 0.5),
    ];
    for spec in scenes {
        let exact = Exact::of_scene(&spec).unwrap();
        let accuracy = SystemAccuracy::of(&exact);
        for (b, error) in exact.solution().radiosity.iter().zip(&accuracy.radiosity_error) {
            assert_near(*b, 2.0, *error);
            assert!(*error < 0.02, "a useful bound, not {error:e}");
        }
        let sums = exact.exchange().row_sums();
        for (sum, error) in sums.iter().zip(exact.exchange().row_errors()) {
            assert_near(*sum, 1.0, error);
        }
    }
}

#[test]
fn a_plate_that_covers_all_lets_nothing_pass() {
    let floor = quad([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [2, 2]);
    let ceiling = quad([0.0, 0.0, 2.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [2, 2]);
    let between = quad([-0.1, -0.1, 1.0], [1.2, 0.0, 0.0], [0.0, 1.2, 0.0], [1, 1]);
    for spec in
        [painted([floor, ceiling, between], 0.5, 1.0)].map(|spec| [turned(&spec), spec]).as_flattened()
    {
        let exact = Exact::of_scene(spec).unwrap();
        for (i, j) in (0..4).flat_map(|i| (4..8).map(move |j| (i, j))) {
            assert_eq!(exact.exchange().exchange_area(i, j), 0.0);
        }
    }
}

/// Two squares in front of each other, a screen half-way, and a lid at their edge, which leave a slit of height g between them: few points of
/// either see through it. Points at heights z and z′ below the edge see each other where z + z′ < 2g, which is an area of 2g² of all pairs.
#[test]
fn a_narrow_slit_lets_light_pass() {
    let left = quad([0.0; 3], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1, 1]);
    let right = quad([1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1, 1]);
    let lid = quad([0.4, -9.0, 1.0], [0.0, 19.0, 0.0], [0.2, 0.0, 0.0], [1, 1]);
    for slit in [0.05, 0.02, 0.01] {
        let screen = quad([0.5, -9.0, -9.0], [0.0, 19.0, 0.0], [0.0, 0.0, 10.0 - slit], [1, 1]);
        let mut spec = painted([left.clone(), right.clone(), screen, lid.clone()], 0.5, 1.0);
        spec.surfaces[2..].iter_mut().for_each(|surface| surface.sides = Sides::Both);
        let exact = Exact::of_scene(&spec).unwrap();
        // They are about 1 apart, so that both cosines are 1/r: ∫∫ dy dy′/(π (1 + (y − y′)²)²) is 1/4 over both widths.
        let narrow = 2.0 * slit * slit / 4.0;
        let found = exact.exchange().exchange_area(0, 1);
        assert!((found / narrow - 1.0).abs() < 0.1, "{slit}: {found:e}, not {narrow:e}");
    }
}

/// Half a screen between two squares, in the middle: every line that misses one half meets the other, so both
/// let pass, in sum, what no screen would; and alike, by symmetry.
#[test]
fn halves_of_a_screen_hide_alike() {
    let floor = quad([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1, 1]);
    let ceiling = quad([0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [1, 1]);
    let half = |x: f64| quad([x, -1.0, 0.5], [1.5, 0.0, 0.0], [0.0, 3.0, 0.0], [1, 1]);
    let exchange = |screens: &[radiosity::Shape]| {
        let shapes = [&floor, &ceiling].into_iter().cloned().chain(screens.iter().cloned());
        let exact = Exact::of_scene(&turned(&painted(shapes, 0.5, 1.0))).unwrap();
        (exact.exchange().exchange_area(0, 1), exact.exchange().row_errors()[0])
    };
    let ((left, e_left), (right, e_right)) = (exchange(&[half(-1.0)]), exchange(&[half(0.5)]));
    assert_near(left + right, 0.199_824_895_698_387_3, e_left + e_right);
    assert_near(left, right, e_left + e_right);
    assert!(e_left < 1e-3);
    assert_near(exchange(&[half(-1.0), half(0.5)]).0, 0.0, 1e-3);
}

#[test]
fn rays_past_a_wall() {
    assert_rays_agree(&room_with(wall(), Sides::Both));
}

#[test]
fn rays_past_a_hanging_plate() {
    assert_rays_agree(&room_with(plate(), Sides::Both));
    assert_rays_agree(&turned(&room_with(plate(), Sides::Front)));
}

#[test]
fn rays_in_a_room_with_a_corner() {
    assert_rays_agree(&painted(l_room(2), 0.5, 1.0));
}

/// The back of a one-sided plate takes light and gives none back.
#[test]
fn backs_absorb() {
    let exact = Exact::of_scene(&room_with(plate(), Sides::Front)).unwrap();
    let [least, greatest] = SystemAccuracy::of(&exact).row_sums;
    assert!(least < 0.97 && greatest < 1.0 + 2e-3, "{least} {greatest}");
    let both = Exact::of_scene(&room_with(plate(), Sides::Both)).unwrap();
    assert!(both.exchange().closure_defect() < 2e-3);
    // To the rest of the room it is the same obstacle.
    for (i, j) in (0..24).flat_map(|i| (0..24).map(move |j| (i, j))) {
        assert_eq!(exact.exchange().exchange_area(i, j), both.exchange().exchange_area(i, j));
    }
}

/// A wall across the room, lit from one side: its lit face has all the light, its dark face none, and each face has an
/// area of its own.
#[test]
fn the_faces_of_a_plate_are_lit_apart() {
    let across = quad([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1, 1]);
    let mut spec = room_with(across, Sides::Both);
    for surface in &mut spec.surfaces {
        surface.emittance = 0.0.into();
    }
    spec.surfaces[0].emittance = 1.0.into();
    let exact = Exact::of_scene(&spec).unwrap();
    let radiosity = &exact.solution().radiosity;
    // The front faces +x, away from the lamp at x = 0.
    assert!(radiosity[24] < 1e-12 && radiosity[25] > 0.1, "{radiosity:?}");
    assert_near(exact.areas()[24], 1.0, 1e-15);
    assert_near(exact.areas()[25], 1.0, 1e-15);
    // The lit half of the room is a closed box of its own.
    let mut half = painted(room([1.0, 1.0, 1.0], 1), 0.5, 0.0);
    half.surfaces[0].emittance = 1.0.into();
    let half = Exact::of_scene(&half).unwrap();
    assert_near(radiosity[25], half.solution().radiosity[1], 2e-3);
    let absorbed: f64 = exact.solution().incoming.iter().map(|phi| 0.5 * phi).sum();
    assert_near(absorbed / exact.total_power(), 1.0, 1e-3);
}

#[test]
fn walks_around_a_two_sided_plate_spread_as_predicted() {
    let mut spec = room_with(plate(), Sides::Both);
    for (surface, r) in spec.surfaces.iter_mut().zip([0.8, 0.3, 0.5, 0.6, 0.4, 0.7, 0.9]) {
        (surface.reflectance, surface.emittance) = (r.into(), 0.0.into());
    }
    spec.surfaces[5].cell_emittance = vec![(1, 2.0.into())];
    spec.surfaces[6].cell_emittance = vec![(0, 1.0.into())];
    assert_walks_spread_as_predicted(&spec);
}

/// A bright room of few patches, parted all but a slit: walks return to either side many times, often by way of patches
/// that reach past the plate, and from one side more often than from the other.
#[test]
fn walks_that_return_to_both_sides_of_a_plate_spread_as_predicted() {
    let mut spec = painted(room([2.0, 1.0, 1.0], 1), 0.9, 0.0);
    let mut plate = grey(quad([0.4, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.95], [1, 1]), 0.95, 0.0);
    plate.sides = Sides::Both;
    spec.surfaces.push(plate);
    spec.surfaces[0].emittance = 1.0.into();
    spec.surfaces[6].emittance = 0.1.into();
    assert_walks_spread_as_predicted(&spec);
}

/// The mean and the variance of the whole score on a face of walks that leave from the side they hit: as predicted. Some
/// 4 × 35 z-scores in all at |z| < 4.5: false-alarm rate 10⁻³, once and for all with this seed.
#[track_caller]
fn assert_walks_spread_as_predicted(spec: &SceneSpec) {
    const WALKS: u32 = 400_000;
    let exact = Exact::of_scene(spec).unwrap();
    let scene = Scene::build(spec, IndexChoice::Flat).unwrap();
    let n = exact.face_count();
    let mut rays = Rays { scene: &scene, numbers: Numbers(34) };
    let mut shot = Moments::new(n);
    let mut gathered = Moments::new(n);
    for _ in 0..WALKS {
        let source = emitter(&exact, &mut rays.numbers);
        let mut whole = vec![0.0; n];
        for hit in walk(&exact, &mut rays, source) {
            whole[hit] += exact.reflectance()[hit] * exact.total_power() / exact.areas()[hit];
        }
        shot.add(&whole);
        let birth = rays.numbers.below(n as u32) as usize;
        let found: f64 = walk(&exact, &mut rays, birth).iter().map(|&s| exact.emittance()[s]).sum();
        let mut whole = vec![0.0; n];
        whole[birth] = exact.reflectance()[birth] * found * n as f64;
        gathered.add(&whole);
    }
    let birth = vec![1.0 / n as f64; n];
    let of_gathering = exact.gathering_variances(EstimatorKind::Collision, &birth);
    let of_shooting = exact.shooting_variances(EstimatorKind::Collision);
    for i in 0..n {
        let b = exact.solution().reflected[i];
        for (name, moments, variance) in
            [("shot", &shot, of_shooting[i]), ("gathered", &gathered, of_gathering[i].unwrap())]
        {
            let [z_mean, z_variance] = moments.z(i, f64::from(WALKS), b, variance);
            assert!(z_mean.abs() < 4.5 && z_variance.abs() < 4.5, "{name} {i}: {z_mean} {z_variance}");
        }
    }
}

/// A source, by power.
fn emitter(exact: &Exact, numbers: &mut Numbers) -> usize {
    let mut target = numbers.uniform() * exact.total_power();
    let power = |s: usize| exact.emittance()[s] * exact.areas()[s];
    let chosen = (0..exact.face_count()).find(|&s| {
        target -= power(s);
        target < 0.0
    });
    chosen.expect("the powers add up")
}

/// The faces that a mortal walk hits.
fn walk(exact: &Exact, rays: &mut Rays, mut face: usize) -> Vec<usize> {
    let mut hits = vec![];
    while let Some(hit) = rays.next(face) {
        hits.push(hit);
        face = hit;
        if rays.numbers.uniform() >= exact.reflectance()[face] {
            break;
        }
    }
    hits
}

/// Σ score … Σ score⁴, face by face.
struct Moments(Vec<[f64; 4]>);

impl Moments {
    fn new(n: usize) -> Self {
        Moments(vec![[0.0; 4]; n])
    }

    fn add(&mut self, scores: &[f64]) {
        for (sums, score) in self.0.iter_mut().zip(scores) {
            for (k, sum) in sums.iter_mut().enumerate() {
                *sum += score.powi(k as i32 + 1);
            }
        }
    }

    /// How many standard errors mean and variance are off.
    fn z(&self, face: usize, walks: f64, mean: f64, variance: f64) -> [f64; 2] {
        let [m1, m2, m3, m4] = self.0[face].map(|sum| sum / walks);
        let measured = m2 - m1 * m1;
        let fourth = m4 - 4.0 * m1 * m3 + 6.0 * m1 * m1 * m2 - 3.0 * m1.powi(4);
        [
            (m1 - mean) / (measured / walks).sqrt(),
            (measured - variance) / ((fourth - measured * measured) / walks).sqrt(),
        ]
    }
}
