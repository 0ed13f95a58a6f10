//! Tests of what is around: rooms, openings, bodies, and the sides of sheets.

use doctor::{Around, Lightless, Shine};
use glam::DVec3;
use radiosity::{SceneSpec, Shape, Sides, SurfaceSpec};

fn quad(corner: [f64; 3], u: [f64; 3], v: [f64; 3]) -> SurfaceSpec {
    let [corner, u, v] = [corner, u, v].map(DVec3::from_array);
    let shape = Shape::Parallelogram { corner, corner_u: corner + u, corner_v: corner + v, cells: [1, 1] };
    SurfaceSpec { sides: Sides::Both, ..SurfaceSpec::new(shape, 0.5) }
}

/// The sides of a box, fronts inwards: floor, ceiling, and four walls.
fn cuboid([x, y, z]: [f64; 3], [dx, dy, dz]: [f64; 3]) -> Vec<SurfaceSpec> {
    let (u, v, w) = ([dx, 0., 0.], [0., dy, 0.], [0., 0., dz]);
    vec![
        quad([x, y, z], u, v),
        quad([x, y, z + dz], v, u),
        quad([x, y, z], w, u),
        quad([x, y + dy, z], u, w),
        quad([x, y, z], v, w),
        quad([x + dx, y, z], w, v),
    ]
}

fn turned(mut surfaces: Vec<SurfaceSpec>) -> Vec<SurfaceSpec> {
    for surface in &mut surfaces {
        if let Shape::Parallelogram { corner_u, corner_v, .. } = &mut surface.shape {
            std::mem::swap(corner_u, corner_v);
        }
    }
    surfaces
}

fn lightless(surfaces: Vec<SurfaceSpec>, is_room: bool) -> Lightless {
    Around::of(&SceneSpec::new(surfaces)).unwrap().lightless(is_room)
}

#[test]
fn a_closed_room_has_a_lamp_below_its_ceiling() {
    // Far from the origin, with a table: a lamp hangs from the ceiling, not from the table.
    let mut room = cuboid([100., 50., 0.], [5., 4., 2.5]);
    room.extend(turned(cuboid([101.5, 51.5, 0.7], [2., 1., 0.05])));
    let Lightless::Rooms(rooms) = lightless(room, true) else { panic!("the room is closed") };
    let [lamp] = &rooms[..] else { panic!("{rooms:?}") };
    let [[corner, u, v]] = lamp.lamps[..] else { panic!("{rooms:?}") };
    assert!((2.3..2.5).contains(&corner.z) && (u - corner).cross(v - corner).z < 0.0, "{lamp:?}");
    for (at, low, high) in [(corner.x, 100., 105.), (u.x, 100., 105.), (corner.y, 50., 54.), (v.y, 50., 54.)]
    {
        assert!((low..high).contains(&at), "{lamp:?}");
    }
    // Below and above the table there is floor: 22 m².
    assert!((21.0..23.0).contains(&lamp.floor), "{lamp:?}");
}

#[test]
fn each_room_of_a_flat_has_a_lamp() {
    let flat = [cuboid([0.; 3], [5., 4., 2.5]), cuboid([5.2, 0., 0.], [4., 4., 2.5])].concat();
    let Lightless::Rooms(rooms) = lightless(flat, true) else { panic!("the rooms are closed") };
    assert_eq!(rooms.len(), 2, "{rooms:?}");
    let mut x: Vec<f64> = rooms.iter().map(|room| room.lamps[0][0].x).collect();
    x.sort_by(f64::total_cmp);
    assert!(x[0] < 5.0 && x[1] > 5.2, "{x:?}");
}

/// A corridor of two arms has lamps along both, and no more light than its floor asks for.
#[test]
fn lamps_share_out_the_floor_of_a_room_of_any_outline() {
    let [length, width, height] = [20.0, 2.0, 3.0];
    let along = |x: f64, y: f64, dx: f64, dy: f64, z: f64| quad([x, y, z], [dx, 0., 0.], [0., dy, 0.]);
    let wall = |x: f64, y: f64, dx: f64, dy: f64| quad([x, y, 0.], [dx, dy, 0.], [0., 0., height]);
    let mut corridor = Vec::new();
    for z in [0.0, height] {
        corridor.push(along(0., 0., length, width, z));
        corridor.push(along(0., width, width, length - width, z));
    }
    corridor.extend([
        wall(0., 0., length, 0.),
        wall(length, 0., 0., width),
        wall(width, width, length - width, 0.),
    ]);
    corridor.extend([
        wall(width, width, 0., length - width),
        wall(0., length, width, 0.),
        wall(0., 0., 0., length),
    ]);
    let Lightless::Rooms(rooms) = lightless(corridor, true) else { panic!("the corridor is closed") };
    let [room] = &rooms[..] else { panic!("{rooms:?}") };
    assert!((66.0..86.0).contains(&room.floor), "76 m² by some hundred places: {}", room.floor);
    let middles: Vec<DVec3> = room.lamps.iter().map(|[_, u, v]| 0.5 * (*u + *v)).collect();
    let is_inside = |at: &DVec3| at.x.min(at.y) < width && at.max_element() < length && at.z > 2.8;
    assert!((3..7).contains(&middles.len()) && middles.iter().all(is_inside), "{middles:?}");
    assert!(middles.iter().any(|at| at.x > 8.0) && middles.iter().any(|at| at.y > 8.0), "{middles:?}");
    let area = |&[corner, u, v]: &[DVec3; 3]| (u - corner).cross(v - corner).length();
    assert!(room.lamps.iter().all(|lamp| area(lamp) > 0.1), "{:?}", room.lamps);
}

/// A room with a window of 1 m² in 63 m² of walls keeps its lamp, since a sky would light its outside above all; what is smaller than rooms, and lacks a wall,
/// lies under a sky. A hull that faces outwards is a body, unless it is as large as a room.
#[test]
fn rooms_may_have_windows_and_other_openings_and_bodies_lie_under_a_sky() {
    let mut windowed = cuboid([0.; 3], [5., 4., 2.5]);
    windowed.pop();
    let [x, y, z] = [5.0, 4.0, 2.5];
    for (y0, z0, dy, dz) in [(0., 0., y, 0.8), (0., 1.8, y, z - 1.8), (0., 0.8, 1.5, 1.), (2.5, 0.8, 1.5, 1.)]
    {
        windowed.push(quad([x, y0, z0], [0., 0., dz], [0., dy, 0.]));
    }
    assert!(matches!(lightless(windowed.clone(), true), Lightless::Rooms(rooms) if rooms.len() == 1));
    assert!(matches!(lightless(windowed, false), Lightless::Open(_)));
    let mut roofless = cuboid([0.; 3], [5., 4., 2.5]);
    roofless.remove(1);
    assert!(matches!(lightless(roofless, true), Lightless::Open(part) if part > 0.1));
    let mut open = cuboid([0.; 3], [1., 1., 1.]);
    open.pop();
    assert!(matches!(lightless(open, false), Lightless::Open(part) if part > 0.1));
    let body = || turned(cuboid([0.; 3], [5., 4., 2.5]));
    assert!(matches!(lightless(body(), false), Lightless::Open(_)));
    assert!(matches!(lightless(body(), true), Lightless::Rooms(_)));
}

/// Lamps: a sheet 1 cm below the ceiling whose front faces the ceiling, one that faces down, and one in the middle of the room.
#[test]
fn sheets_shine_into_the_room() {
    let mut room = cuboid([0.; 3], [5., 4., 2.5]);
    room.push(quad([1., 1., 2.49], [0.5, 0., 0.], [0., 0.5, 0.]));
    room.push(quad([3., 1., 2.49], [0., 0.5, 0.], [0.5, 0., 0.]));
    room.push(quad([2., 2., 1.25], [0.5, 0., 0.], [0., 0.5, 0.]));
    let around = Around::of(&SceneSpec::new(room)).unwrap();
    assert_eq!(around.shine(&[6, 7, 8], |surface| surface > 5), [Shine::Back, Shine::Front, Shine::Either]);
}
