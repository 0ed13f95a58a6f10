//! The search for lit parts of faces is held against continuous walks, in random rooms of touching, overlapping and doubled bodies.

use std::cell::Cell;

use crate::common::{box_walls, collision, experiment, flipped, quad, surface, walk};
use glam::{DMat3, DVec3};
use radiosity::{
    IndexChoice, Scene, SceneSpec, Sequence, Shape, Sides, Space, SurfaceSpec, parallel::in_turn,
};

fn both_sides(shape: Shape, reflectance: f64) -> SurfaceSpec {
    SurfaceSpec { sides: Sides::Both, ..surface(shape, reflectance) }
}

/// By face: its lit part, where no walk has hit any.
fn parts(spec: &SceneSpec) -> Vec<f64> {
    let scene = Scene::build(spec, IndexChoice::Auto).unwrap();
    scene.lit_parts(&vec![false; scene.faces().len()], &in_turn)
}

/// A room of 4 m whose ceiling emits, and whose floor has these cells.
fn lit_room(cells: [u32; 2]) -> Vec<SurfaceSpec> {
    let walls = box_walls(DVec3::splat(4.0), [1, 1]).into_iter().map(|wall| surface(wall, 0.5));
    let mut walls: Vec<SurfaceSpec> = walls.collect();
    walls[0] = surface(quad(DVec3::ZERO, DVec3::X * 4.0, DVec3::Y * 4.0, cells), 0.5);
    walls[1].emittance = 1.0.into();
    walls
}

/// The walls of a cuboid on the floor: its low corner, its size, turned about the corner; without its bottom.
fn cuboid(corner: DVec3, size: DVec3, turned: f64) -> Vec<Shape> {
    let turn = DMat3::from_rotation_z(turned);
    box_walls(size, [1, 1]).iter().skip(1).map(|wall| wall.moved(|p| corner + turn * p)).collect()
}

/// A box of 2 m × 2 m stands on the floor of 4 m × 4 m, half on each of the cells that it touches, with no bottom of its own: a quarter of
/// the floor is dark, and all of the box's inside, whose faces follow the fronts of all others.
#[test]
fn the_floor_beneath_a_box_is_dark_and_so_is_the_inside() {
    for cells in [[1, 1], [2, 1], [4, 2]] {
        let mut spec = lit_room(cells);
        let fronts = (cells[0] * cells[1]) as usize;
        spec.extend(
            cuboid(DVec3::new(1.0, 1.0, 0.0), DVec3::new(2.0, 2.0, 1.0), 0.0)
                .into_iter()
                .map(|wall| both_sides(flipped(wall), 0.5)),
        );
        let parts = parts(&SceneSpec::new(spec));
        let lit: f64 = parts[..fronts].iter().sum::<f64>() / fronts as f64;
        // Of 64 points of each cell the part that is lit scatters by 0.054 at most; five of them.
        assert!((lit - 0.75).abs() < 0.27, "{cells:?}: {lit}");
        assert!(parts[fronts..fronts + 5].iter().all(|&part| part == 1.0), "walls of the room");
        let outside = fronts + 5;
        assert!(
            parts[outside..outside + 5].iter().all(|&part| part == 1.0),
            "{cells:?}: {:?}",
            &parts[outside..]
        );
        assert!(parts[outside + 5..].iter().all(|&part| part == 0.0), "{cells:?}: {:?}", &parts[outside..]);
    }
}

/// Halves of a rectangle do not see each other, though rounding has each a little above the other's plane: the inside of a box of triangles is
/// dark, however the box is turned.
#[test]
fn halves_of_a_wall_bring_no_light_inside() {
    for turn in 0..8 {
        let mut spec = lit_room([1, 1]);
        let walls = cuboid(DVec3::new(1.5, 1.5, 0.0), DVec3::new(0.7, 0.6, 1.1), 0.3 + 0.7 * f64::from(turn));
        let halves = walls.into_iter().flat_map(|wall| {
            let (corner, u, v) = flipped(wall).edges();
            let half = |a: DVec3, u: DVec3, v: DVec3| Shape::Triangle { a, b: a + u, c: a + v, rows: 1 };
            [half(corner, u, v), half(corner + u + v, -u, -v)]
        });
        spec.extend(halves.map(|half| both_sides(half, 0.9)));
        let parts = parts(&SceneSpec::new(spec));
        assert!(parts[6..16].iter().all(|&part| part == 1.0), "outside, turn {turn}: {parts:?}");
        assert!(parts[16..].iter().all(|&part| part == 0.0), "inside, turn {turn}: {parts:?}");
    }
}

/// A room with boxes that touch, overlap and pierce, doubled plates, slivers, and a plane far larger than the room.
fn messy_room(number: u64) -> SceneSpec {
    let mut rng = Sequence::new(0x3E55).walk(number);
    let mut uniform = || rng.pair()[0];
    let size = DVec3::new(1.0 + 3.0 * uniform(), 1.0 + 3.0 * uniform(), 1.0 + 2.0 * uniform());
    let cells = [1 + (8.0 * uniform()) as u32, 1 + (8.0 * uniform()) as u32];
    let mut surfaces: Vec<SurfaceSpec> =
        box_walls(size, cells).into_iter().map(|wall| both_sides(wall, 0.9)).collect();
    if number.is_multiple_of(3) {
        surfaces.remove(5);
    }
    let lamp = size * DVec3::new(0.8 * uniform(), 0.8 * uniform(), 0.9);
    let lamp = quad(lamp, DVec3::Y * 0.1, DVec3::X * 0.1, [1, 1]);
    surfaces.push(SurfaceSpec { emittance: 1.0.into(), ..surface(lamp, 0.0) });
    for _ in 0..(1.0 + 4.0 * uniform()) as usize {
        let corner = DVec3::new(size.x * uniform(), size.y * uniform(), 0.0);
        let of = DVec3::new(0.2 + uniform(), 0.2 + uniform(), (0.2 + uniform()) * size.z / 2.0);
        let turned = if uniform() < 0.3 { 0.0 } else { 6.0 * uniform() };
        surfaces.extend(cuboid(corner, of, turned).into_iter().map(|wall| both_sides(flipped(wall), 0.9)));
        if uniform() < 0.5 {
            let turn = DMat3::from_rotation_z(turned);
            let bottom = quad(corner, turn * DVec3::X * of.x, turn * DVec3::Y * of.y, [1, 1]);
            surfaces.push(both_sides(bottom, 0.9));
        }
    }
    let plate = quad(size * 0.3, DVec3::X * 0.4, DVec3::new(0.0, 0.3, 0.2), [2, 2]);
    surfaces.extend([both_sides(plate.clone(), 0.9), both_sides(plate, 0.9)]);
    let sliver = Shape::Triangle { a: size * 0.2, b: size * 0.8, c: size * 0.8 + DVec3::Z * 1e-4, rows: 1 };
    surfaces.push(both_sides(sliver, 0.9));
    let ground = quad(
        DVec3::new(-500.0, -500.0, if uniform() < 0.5 { 0.0 } else { -0.1 }),
        DVec3::X * 1e3,
        DVec3::Y * 1e3,
        [1, 1],
    );
    surfaces.push(both_sides(ground, 0.9));
    SceneSpec::new(surfaces)
}

/// What walks tell of a messy room.
#[derive(Debug, Default)]
struct Found {
    arrivals: u128,
    /// Arrivals on faces of which every point is called dark.
    in_the_dark: u128,
    /// The area that is called lit, and of that the area that no walk has found [m²].
    lit: f64,
    lit_in_vain: f64,
}

fn find(number: u64, walks: u64) -> Found {
    let spec = messy_room(number);
    let experiment = experiment(&spec, IndexChoice::Auto, collision(Space::Continuous));
    let scene = experiment.scene();
    let tally = walk(&experiment, number, 0..walks);
    let faces = scene.faces().len();
    let lit_parts = scene.lit_parts(&vec![false; faces], &in_turn);
    let hit: Vec<bool> = (0..faces).map(|face| tally.events(face) > 0).collect();
    let by_hits = scene.lit_parts(&hit, &in_turn);
    let mut found = Found::default();
    for (i, face) in scene.faces().iter().enumerate() {
        let hits = tally.events(i);
        assert!(
            by_hits[i] >= lit_parts[i] && (hits == 0 || by_hits[i] > 0.0),
            "{number}, face {i}: what is hit is lit"
        );
        found.arrivals += hits;
        found.in_the_dark += if lit_parts[i] == 0.0 { hits } else { 0 };
        found.lit += lit_parts[i] * face.area;
        found.lit_in_vain += if hits == 0 { lit_parts[i] * face.area } else { 0.0 };
    }
    found
}

/// Light that walks bring to faces called dark is falsely sealed: below 1 in 10,000 arrivals, where no hit of the walks is explained (in all but
/// one of the rooms there are none, and the outside of that one is lit through a crack). And what is called lit is lit: in closed rooms walks find all but
/// a thousandth of it. Rooms without a wall have a ground of a square kilometre, too large to be found.
#[test]
fn walks_find_light_where_it_is_told_and_nowhere_else() {
    let rooms: Vec<Found> = (0..12).map(|number| find(number, 1 << 15)).collect();
    let [arrivals, in_the_dark] = [|room: &Found| room.arrivals, |room: &Found| room.in_the_dark]
        .map(|of| rooms.iter().map(of).sum::<u128>());
    assert!(in_the_dark * 10_000 < arrivals, "{in_the_dark} of {arrivals}");
    let closed = || (0..12).filter(|number| number % 3 != 0).map(|number| &rooms[number]);
    let [lit, in_vain] =
        [|room: &Found| room.lit, |room: &Found| room.lit_in_vain].map(|of| closed().map(of).sum::<f64>());
    assert!(in_vain < 1e-3 * lit, "{in_vain} of {lit} m²");
    println!("{in_the_dark} of {arrivals}; {in_vain} of {lit} m²");
}

/// Light comes into a second room through a hole that takes up a 3,700th of what its walls see, onto a floor that both rooms share.
#[test]
fn a_room_behind_a_small_hole_is_lit() {
    let (low, high) = (0.48, 0.52);
    let rooms = |hole: bool| {
        let walls = box_walls(DVec3::new(2.0, 1.0, 1.0), [2, 2]).into_iter().map(|wall| surface(wall, 0.5));
        let mut walls: Vec<SurfaceSpec> = walls.collect();
        walls[4].emittance = 1.0.into();
        walls[0] = surface(quad(DVec3::ZERO, DVec3::X * 2.0, DVec3::Y, [1, 1]), 0.5);
        let piece = |from: [f64; 2], to: [f64; 2]| {
            let (u, v) = (DVec3::Y * (to[0] - from[0]), DVec3::Z * (to[1] - from[1]));
            both_sides(quad(DVec3::new(1.0, from[0], from[1]), u, v, [1, 1]), 0.5)
        };
        walls.extend([
            piece([0.0, 0.0], [1.0, low]),
            piece([0.0, high], [1.0, 1.0]),
            piece([0.0, low], [low, high]),
            piece([high, low], [1.0, high]),
        ]);
        if !hole {
            walls.push(piece([low, low], [high, high]));
        }
        SceneSpec::new(walls)
    };
    assert!(parts(&rooms(true)).iter().all(|&part| part == 1.0));
    let closed = parts(&rooms(false));
    assert!((closed[0] - 0.5).abs() < 0.3, "the floor is half lit: {}", closed[0]);
    // The far wall of the second room: the last of the box's walls.
    assert_eq!(closed[17..21], [0.0; 4]);
}

/// What is found is the same whatever runs the blocks of paths, and in whatever order: here the last one first.
#[test]
fn the_search_is_the_same_on_any_executor() {
    let mut spec = lit_room([24, 24]);
    spec.extend(
        cuboid(DVec3::new(1.0, 1.0, 0.0), DVec3::new(2.0, 2.0, 1.0), 0.0)
            .into_iter()
            .map(|wall| both_sides(wall, 0.5)),
    );
    let spec = SceneSpec::new(spec);
    let blocks = Cell::new(0);
    let backwards = |jobs: usize, job: &(dyn Fn(usize) + Sync)| {
        (0..jobs).rev().for_each(job);
        blocks.set(blocks.get() + jobs);
    };
    let scene = Scene::build(&spec, IndexChoice::Auto).unwrap();
    assert_eq!(scene.lit_parts(&vec![false; scene.faces().len()], &backwards), parts(&spec));
    assert!(blocks.get() > 4);
}

/// Where walks hit a face whose points are all dark, all that its points see is lit, unless the face has a lit sliver.
#[test]
fn a_hit_lights_what_no_path_has_found() {
    let mut spec = lit_room([1, 1]);
    let shut = box_walls(DVec3::ONE, [1, 1]).into_iter().map(|wall| wall.moved(|p| p + DVec3::ONE));
    spec.extend(shut.map(|wall| both_sides(wall, 0.5)));
    let scene = Scene::build(&SceneSpec::new(spec), IndexChoice::Auto).unwrap();
    let faces = scene.faces().len();
    let mut hit = vec![false; faces];
    assert_eq!(scene.lit_parts(&hit, &in_turn)[6..12], [0.0; 6]);
    hit[7] = true;
    assert_eq!(scene.lit_parts(&hit, &in_turn)[6..12], [1.0; 6]);
    // A box without a bottom covers all of the floor but a strip of 2 cm, which is found.
    let mut spec = lit_room([1, 1]);
    let over = cuboid(DVec3::ZERO, DVec3::new(4.0, 3.98, 1.0), 0.0);
    spec.extend(over.into_iter().map(|wall| both_sides(flipped(wall), 0.5)));
    let scene = Scene::build(&SceneSpec::new(spec), IndexChoice::Auto).unwrap();
    let mut hit = vec![false; scene.faces().len()];
    hit[0] = true;
    let parts = scene.lit_parts(&hit, &in_turn);
    assert!(parts[0] > 0.0 && parts[0] < 0.05, "{}", parts[0]);
}
