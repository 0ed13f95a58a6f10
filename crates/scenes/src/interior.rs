//! A large generated scene: furnished rooms.

use std::f64::consts::PI;

use glam::DVec3;
use radiosity::{SceneSpec, Sequence, WalkRng};

use crate::furniture::{self, Detail, GAP, between};
use crate::material::SceneMaterial;
use crate::mesh::ObjMesh;
use crate::obj::to_obj;

/// The inside measures of a room: x, y, z [m].
const ROOM: DVec3 = DVec3::new(6.0, 5.0, 2.75);

/// The thickness of the walls [m].
const WALL: f64 = 0.25;

/// The height of the doorways [m].
const DOOR: f64 = 2.125;

/// The ends of doorways: along x in the walls between rooms of neighbouring y, and along y in the others [m].
const DOOR_X: [f64; 2] = [4.5, 5.5];
const DOOR_Y: [f64; 2] = [2.0, 3.0];

/// An interior of about `triangles` triangles (from 50,000 to a few millions), one patch each: closed rooms
/// joined by doorways, with tables, chairs, shelves of books, cushions, lathe work, a teapot each, curtains
/// and leaves as two-sided sheets, slats and cables as slivers, and lamps. Sizes run from 0.2 mm to 6 m.
///
/// No ray can escape or meet the back of a one-sided surface: walls are cut so that they meet in shared
/// corners, every body is closed, and no two bodies touch.
pub fn interior(triangles: usize) -> SceneSpec {
    SceneSpec::new(interior_mesh(triangles).into_surfaces())
}

/// [`interior`] as an OBJ file with z up, which names `interior.mtl`, and the content of that file. Every piece of furniture is an
/// object. Materials whose names end with `-both` have two sides, all others one.
pub fn interior_obj(triangles: usize) -> [String; 2] {
    to_obj(&interior_mesh(triangles), "interior.mtl")
}

fn interior_mesh(triangles: usize) -> ObjMesh {
    let side = ((triangles as f64).sqrt() / 240.0).round().max(1.0) as u32;
    let rooms = [side + 1, side];
    let detail = detail_for(triangles, rooms);
    let mut mesh = shell(rooms).named("walls");
    mesh.add(furnish(rooms, detail), DVec3::ZERO, 0.0);
    mesh
}

/// The detail that comes nearest to a number of triangles, by bisection.
fn detail_for(triangles: usize, rooms: [u32; 2]) -> Detail {
    let walls = shell(rooms).len();
    // Rooms differ only in what chance puts on the shelves.
    let (mut low, mut high) = (0.25, 16.0);
    for _ in 0..14 {
        let middle = 0.5 * (low + high);
        let one = furnish([1, 1], Detail(middle)).len() * (rooms[0] * rooms[1]) as usize;
        *(if walls + one < triangles { &mut low } else { &mut high }) = middle;
    }
    Detail(0.5 * (low + high))
}

/// Whether a cell of the grid that walls and doorways lie on is hollow, by the numbers of its intervals: along x
/// a room has intervals 0 … 2 (the middle one beside a doorway) and its far wall is interval 3; y alike; along
/// z lie the height of the doors and the rest.
fn hollow([x, y, z]: [i64; 3], rooms: [u32; 2]) -> bool {
    let inside = |i: i64, rooms: u32| (0..4 * i64::from(rooms) - 1).contains(&i);
    if !(inside(x, rooms[0]) && inside(y, rooms[1]) && (0..2).contains(&z)) {
        return false;
    }
    match (x % 4 == 3, y % 4 == 3) {
        (false, false) => true,
        (true, false) => y % 4 == 1 && z == 0,
        (false, true) => x % 4 == 1 && z == 0,
        (true, true) => false,
    }
}

/// The lines of the grid along an axis.
fn lines(rooms: u32, length: f64, door: [f64; 2]) -> Vec<f64> {
    (0..rooms)
        .flat_map(|room| {
            let start = f64::from(room) * (length + WALL);
            [start, start + door[0], start + door[1], start + length]
        })
        .collect()
}

/// Walls, floors and ceilings: every face between a hollow cell of the grid and a solid one, towards the hollow.
fn shell(rooms: [u32; 2]) -> ObjMesh {
    const PLASTER: SceneMaterial = SceneMaterial::new(0.75);
    const FLOOR: SceneMaterial = SceneMaterial::new(0.4);
    let grid = [lines(rooms[0], ROOM.x, DOOR_X), lines(rooms[1], ROOM.y, DOOR_Y), vec![0.0, DOOR, ROOM.z]];
    let mut mesh = ObjMesh::default();
    let cells = [grid[0].len(), grid[1].len(), grid[2].len()].map(|lines| lines as i64 - 1);
    for (x, y, z) in
        (0..cells[0]).flat_map(|x| (0..cells[1]).flat_map(move |y| (0..2).map(move |z| (x, y, z))))
    {
        let cell = [x, y, z];
        if !hollow(cell, rooms) {
            continue;
        }
        for (axis, step) in [0, 1, 2].into_iter().flat_map(|axis| [(axis, 0), (axis, 1)]) {
            let mut neighbour = cell;
            neighbour[axis] += 2 * step - 1;
            if !hollow(neighbour, rooms) {
                let material = if axis == 2 && step == 0 { FLOOR } else { PLASTER };
                mesh.quadrangle(face(&grid, cell, axis, step), material);
            }
        }
    }
    mesh
}

/// The corners of the low (`step` 0) or high (1) face of a grid cell across an axis, facing into the cell.
fn face(grid: &[Vec<f64>; 3], cell: [i64; 3], axis: usize, step: i64) -> [DVec3; 4] {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let corner = |du: i64, dv: i64| {
        let mut line = cell;
        line[axis] += step;
        line[u] += du;
        line[v] += dv;
        DVec3::from_array([0, 1, 2].map(|axis| grid[axis][line[axis] as usize]))
    };
    let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
    if step == 0 { [a, b, c, d] } else { [a, d, c, b] }
}

/// The furniture of `rooms` rooms along x and y.
fn furnish(rooms: [u32; 2], detail: Detail) -> ObjMesh {
    let sequence = Sequence::new(2026);
    let mut mesh = ObjMesh::default();
    for room in 0..rooms[0] * rooms[1] {
        let corner = DVec3::new(
            f64::from(room % rooms[0]) * (ROOM.x + WALL),
            f64::from(room / rooms[0]) * (ROOM.y + WALL),
            0.0,
        );
        mesh.add(furnish_room(detail, &mut sequence.walk(u64::from(room))), corner, 0.0);
    }
    mesh
}

/// The furniture of one room, from the room's corner (0, 0, 0).
fn furnish_room(detail: Detail, rng: &mut WalkRng) -> ObjMesh {
    let mut mesh = ObjMesh::default();
    dining_place(&mut mesh, detail, rng);
    mesh.add(furniture::bookcase(rng).named("bookcase"), DVec3::new(0.3, ROOM.y, 0.0), 0.0);
    mesh.add(furniture::wire_rack(detail, rng).named("wire rack"), DVec3::new(1.2, 3.75, 0.0), 0.0);
    mesh.add(furniture::curtain(detail).named("curtain"), DVec3::new(0.3, 0.16, 0.0), 0.0);
    mesh.add(furniture::blind().named("blind"), DVec3::new(2.4, 0.06, 0.9), 0.0);
    // After a turn by −90°, what lay along x lies along −y and looks towards +x.
    mesh.add(furniture::sideboard(detail, rng).named("sideboard"), DVec3::new(GAP, 1.9, 0.0), -0.5 * PI);
    mesh.add(furniture::sofa(detail).named("sofa"), DVec3::new(GAP, 2.9, 0.0), 0.0);
    let jitter = |rng: &mut WalkRng| DVec3::new(between(rng, -0.05, 0.05), between(rng, -0.05, 0.05), 0.0);
    mesh.add(furniture::plant(detail, rng).named("plant"), DVec3::new(5.4, 1.3, GAP) + jitter(rng), 0.0);
    mesh.add(
        furniture::standing_lamp(detail).named("standing lamp"),
        DVec3::new(5.6, 3.5, 0.0) + jitter(rng),
        0.0,
    );
    mesh.add(furniture::toys(detail, rng).named("toys"), DVec3::new(4.2, 3.3, 0.0) + jitter(rng), 0.0);
    mesh.add(furniture::cable(detail).named("cable"), DVec3::new(5.9, 0.2, 0.0), 0.0);
    mesh.add(furniture::picture().named("picture"), DVec3::new(ROOM.x, 4.2, 1.4), -0.5 * PI);
    for x in [0.8, 3.9] {
        mesh.add(furniture::ceiling_lamp().named("ceiling lamp"), DVec3::new(x, 1.0, ROOM.z), 0.0);
    }
    mesh
}

/// A table, laid, with chairs round it and a lamp above.
fn dining_place(mesh: &mut ObjMesh, detail: Detail, rng: &mut WalkRng) {
    let centre = DVec3::new(2.8, 2.4, 0.0);
    mesh.add(furniture::table(detail).named("table"), centre, 0.0);
    let top = centre + DVec3::Z * 0.76;
    for (x, y, turn) in [(-0.5, -1.0, 0.5), (0.5, -1.0, 0.5), (-0.5, 1.0, -0.5), (0.5, 1.0, -0.5)] {
        let to = centre + DVec3::new(x, 0.75 * y + between(rng, -0.04, 0.04), 0.0);
        mesh.add(furniture::chair(detail).named("chair"), to, PI * turn + between(rng, -0.15, 0.15));
        mesh.add(furniture::cover(detail).named("cover"), top + DVec3::new(x, 0.3 * y, 0.0), 0.0);
    }
    mesh.add(furniture::teapot(detail).named("teapot"), top, between(rng, 0.0, 2.0 * PI));
    mesh.add(furniture::fruit_bowl(detail).named("fruit bowl"), top + DVec3::X * 0.7, 0.0);
    mesh.add(furniture::vase(detail, rng).named("vase"), top - DVec3::X * 0.7, 0.0);
    mesh.add(furniture::pendant(detail).named("pendant"), centre + DVec3::Z * ROOM.z, 0.0);
    mesh.add(furniture::mobile(detail, rng).named("mobile"), centre + DVec3::Z * ROOM.z, 0.0);
}
