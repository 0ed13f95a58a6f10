use job::{Stand, Vantage, View};
use radiosity::{IndexChoice, SceneSpec, Shape, Side, Sides};

use super::choice::Frame;
use super::*;
use crate::scenes::{cornell, cube, cube_spec, quad};

fn build(spec: &SceneSpec) -> Scene {
    Scene::build(spec, IndexChoice::Auto).unwrap()
}

fn best(scene: &Scene) -> Camera {
    Camera::best(scene, |_| true, Size::Longest(200))
}

fn patch_at(scene: &Scene, camera: &Camera, point: DVec3) -> Option<u32> {
    let [x, y] = camera.project(point - scene.origin()).expect("the eye looks at the scene");
    camera.look(scene, &[[x, y]])[0].map(|sight| scene.faces().face_of(sight.piece))
}

fn named(scene: &Scene, name: &str) -> usize {
    scene.faces().iter().position(|patch| scene.surface_name(patch.surface) == name).unwrap()
}

#[test]
fn an_open_box_is_seen_through_its_front_and_upright() {
    let scene = build(&cornell());
    let camera = best(&scene);
    assert!(camera.forward.z > 0.999 && camera.up.y > 0.999, "{camera:?}");
    for name in ["floor", "ceiling", "back", "dark", "light", "lamp", "short"] {
        let first = named(&scene, name);
        let surface = scene.faces().get(first).surface;
        let own = scene.faces().iter().skip(first).take_while(|patch| patch.surface == surface);
        let seen = (first as u32..)
            .zip(own)
            .filter(|(number, patch)| patch_at(&scene, &camera, patch.centroid) == Some(*number));
        assert!(seen.count() > 0, "{name}");
    }
}

#[test]
fn one_looks_through_the_backs_of_a_closed_room() {
    let scene = cube();
    let camera = best(&scene);
    assert!(camera.up.z > 0.999 && camera.cut.is_none());
    let seen = |(number, patch): &(u32, radiosity::surfaces::Face)| {
        patch_at(&scene, &camera, patch.centroid) == Some(*number)
    };
    assert_eq!((0..).zip(scene.faces()).filter(seen).count(), 45);
}

/// A room of 5 m × 4 m × 2.6 m with a table in it; the unit of the scene is `unit` times a metre.
fn room(unit: f64, sides: Sides) -> Scene {
    let mut spec = cube_spec();
    let mut table = quad("table", [[0.35, 0.35, 0.3], [0.65, 0.35, 0.3], [0.35, 0.65, 0.3]], [1, 1], 0.5);
    table.sides = Sides::Both;
    for surface in &mut spec.surfaces {
        surface.sides = sides;
    }
    spec.surfaces.push(table);
    for surface in &mut spec.surfaces {
        if let Shape::Parallelogram { corner, corner_u, corner_v, .. } = &mut surface.shape {
            for point in [corner, corner_u, corner_v] {
                *point *= DVec3::new(5.0, 4.0, 2.6) * unit;
            }
        }
    }
    build(&spec)
}

#[test]
fn a_room_is_seen_from_where_a_person_stands() {
    let of = |scene: &Scene, from: Option<Vantage>| {
        let faces = scene.faces();
        let lit = |piece: u32| faces.piece(piece).side == Side::Front;
        Camera::of_view(scene, &View { from, ..View::default() }, lit).viewpoint(scene)
    };
    for sides in [Sides::Front, Sides::Both] {
        let scene = room(1.0, sides);
        let seen = of(&scene, None);
        assert!((seen.eye[2] - 1.508).abs() < 1e-9, "58 % of 2.6 m: {seen:?}");
        assert!((0.0..5.0).contains(&seen.eye[0]) && (0.0..4.0).contains(&seen.eye[1]), "{seen:?}");
        // Not on the table, and towards the middle of the room.
        let ahead = DVec3::from(seen.look_at) - DVec3::from(seen.eye);
        assert!(ahead.dot(DVec3::new(2.5, 2.0, 1.3) - DVec3::from(seen.eye)) > 0.0, "{seen:?}");
        let outside = of(&scene, Some(Vantage::Outside)).eye;
        assert!(!(0.0..5.0).contains(&outside[0]) || !(0.0..4.0).contains(&outside[1]), "{outside:?}");
    }
    // In another unit, two-sided walls hide the inside, and one-sided ones do not.
    let (hidden, open) = (of(&room(0.01, Sides::Both), None), of(&room(0.01, Sides::Front), None));
    assert!((hidden.eye[2] - 0.58 * 0.026).abs() < 1e-9, "{hidden:?}");
    assert!(open.eye[1] < 0.0 || open.eye[2] > 0.026, "{open:?}");
}

/// Two walls on a plate under a sky are no room, and the picture is about them, not about the box that stands for the sky.
#[test]
fn what_stands_under_a_sky_is_seen_from_outside() {
    let mut spec = cube_spec();
    for (name, corners) in [
        ("plate", [[0.2, 0.2, 0.1], [0.8, 0.2, 0.1], [0.2, 0.8, 0.1]]),
        ("wall", [[0.2, 0.2, 0.1], [0.2, 0.8, 0.1], [0.2, 0.2, 0.9]]),
        ("wall", [[0.8, 0.2, 0.1], [0.8, 0.2, 0.9], [0.8, 0.8, 0.1]]),
    ] {
        let mut sheet = quad(name, corners, [1, 1], 0.5);
        sheet.sides = Sides::Both;
        spec.surfaces.insert(0, sheet);
    }
    for side in &mut spec.surfaces[3..] {
        (side.emittance, side.reflectance) = (1.0.into(), 0.0.into());
        side.cell_emittance.clear();
        side.name = Some(radiosity::surfaces::SKY.into());
    }
    let scene = build(&spec);
    assert_eq!(scene.surfaces_before_sky(), 3);
    let camera = Camera::of_view(&scene, &View::default(), |_| true);
    assert_eq!(camera.said, None, "nobody stands there");
    let [width, height] = camera.size.map(f64::from);
    let wide = Bounds::below_sky(&scene).corners().map(|corner| camera.project(corner).unwrap()[0] / width);
    let [least, most] = [f64::min, f64::max].map(|pick| wide.into_iter().reduce(pick).unwrap());
    assert!(most - least > 0.9 || height > width, "{least} to {most}");
}

#[test]
fn half_of_a_view_is_dark_where_one_of_two_plates_is() {
    let plate = |x: f64| quad("plate", [[x, 0., 0.], [x + 1., 0., 0.], [x, 1., 0.]], [1, 1], 0.5);
    let mut spec = SceneSpec::new(vec![plate(0.0), plate(1.0)]);
    spec.surfaces.iter_mut().for_each(|plate| plate.emittance = 1.0.into());
    let scene = build(&spec);
    let camera = best(&scene);
    let dark = camera.dark_part(&scene, |piece| piece == 0);
    assert!((dark - 0.5).abs() < 0.02, "{dark}");
    assert_eq!(camera.dark_part(&scene, |_| true), 0.0);
}

#[test]
fn unlit_sides_do_not_draw_the_camera() {
    let scene = cube();
    let camera = Camera::best(&scene, |piece| scene.faces().piece(piece).surface == 0, Size::Longest(200));
    assert!(camera.forward.z < -0.5, "{camera:?}");
}

#[test]
fn a_plate_is_seen_from_its_front() {
    for (corners, forward) in [
        ([[0., 0., 0.], [2., 0., 0.], [0., 3., 0.]], -1.0),
        ([[0., 0., 0.], [0., 3., 0.], [2., 0., 0.]], 1.0),
    ] {
        let mut plate = quad("plate", corners, [2, 2], 0.5);
        plate.emittance = 1.0.into();
        let scene = build(&SceneSpec::new(vec![plate]));
        let camera = best(&scene);
        assert!(camera.up.z > 0.5 && camera.forward.z * forward > 0.5, "{camera:?}");
        assert_eq!(patch_at(&scene, &camera, scene.faces().get(3).centroid), Some(3));
    }
}

#[test]
fn the_shortest_extent_is_up_and_lamps_decide_among_equals() {
    let mut spec = cube_spec();
    let up = |spec: &SceneSpec| best(&build(spec)).up.round();
    assert_eq!(up(&spec), DVec3::Z);
    spec.surfaces[1].cell_emittance.clear();
    spec.surfaces[3].cell_emittance = vec![(4, 1.0.into())];
    assert_eq!(up(&spec), DVec3::Y);
    for surface in &mut spec.surfaces {
        if let Shape::Parallelogram { corner, corner_u, corner_v, .. } = &mut surface.shape {
            for point in [corner, corner_u, corner_v] {
                point.y *= 5.0;
            }
        }
    }
    assert_eq!(up(&spec), DVec3::Z);
}

#[test]
fn the_whole_scene_is_in_the_picture() {
    let scene = build(&cornell());
    let bounds = Bounds::of(&scene);
    let frame = Frame::of(&scene, &bounds);
    for (azimuth, elevation) in [(0.0, 0.0), (30.0, 20.0), (240.0, 55.0)] {
        let camera = frame.camera(&bounds, azimuth, elevation, false, Size::Longest(300));
        let [width, height] = camera.size.map(f64::from);
        assert!(width.max(height) == 300.0);
        for [x, y] in bounds.corners().map(|corner| camera.project(corner).unwrap()) {
            assert!(x > 0.0 && x < width && y > 0.0 && y < height, "{x} {y}");
        }
    }
}

fn view(eye: DVec3, look_at: DVec3) -> View {
    View { stand: Some(Stand { eye, look_at, up: None, fov: 60.0 }), ..View::default() }
}

#[test]
fn a_stand_sees_what_it_looks_at_upright() {
    let scene = cube();
    let eye = DVec3::new(0.5, 0.1, 0.5);
    let [wall, lamp] = [DVec3::new(0.5, 1.0, 0.5), DVec3::new(0.5, 0.5, 1.0)];
    for up in [None, Some(DVec3::new(0.0, -0.3, 2.0))] {
        let mut level = view(eye, wall);
        level.stand.as_mut().unwrap().up = up;
        level.size = Some([300, 200]);
        let camera = Camera::of_view(&scene, &level, |_| true);
        let at = |point: DVec3| camera.project(point - scene.origin()).unwrap();
        let [x, y] = at(wall);
        assert!((x - 150.0).abs() < 1e-9 && (y - 100.0).abs() < 1e-9, "{x} {y}");
        // 60° from the lower to the upper edge, 0.9 m away; x grows to the right, z upwards.
        let half = 0.9 * 30_f64.to_radians().tan();
        assert!(at(wall + DVec3::Z * half)[1].abs() < 1e-9);
        assert!(at(wall + DVec3::X * half)[0] > 249.0);
        let shown = camera.viewpoint(&scene);
        assert!((shown.fov - 60.0).abs() < 1e-9 && (DVec3::from(shown.look_at) - wall).length() < 1e-9);
    }
    // Straight up, where the scene's own up tells nothing.
    let camera = Camera::of_view(&scene, &view(DVec3::new(0.5, 0.5, 0.1), lamp), |_| true);
    let middle = camera.look(&scene, &[camera.size.map(|side| f64::from(side) / 2.0)])[0].unwrap();
    assert!(scene.faces().piece(middle.piece).emittance.is_lit());
}

#[test]
fn a_size_changes_the_frame_and_not_the_direction() {
    let scene = build(&cornell());
    let [free, wide] = [None, Some([600, 200])]
        .map(|size| Camera::of_view(&scene, &View { size, ..View::default() }, |_| true));
    assert_eq!((free.eye, free.forward, wide.size), (wide.eye, wide.forward, [600, 200]));
    for corner in Bounds::of(&scene).corners() {
        let [x, y] = wide.project(corner).unwrap();
        assert!(x > 0.0 && x < 600.0 && y > 0.0 && y < 200.0, "{x} {y}");
    }
}

#[test]
fn stands_that_show_nothing_are_reported() {
    let scene = cube();
    let middle = DVec3::splat(0.5);
    let troubles = |eye: DVec3, look_at: DVec3| view_troubles(&scene, &view(eye, look_at), &[]).join("; ");
    assert_eq!(troubles(DVec3::new(0.5, 0.1, 0.5), middle), "");
    assert_eq!(
        troubles(DVec3::new(0.5, -3.0, 0.5), middle),
        "",
        "a room is seen through the backs of its walls"
    );
    assert!(
        troubles(DVec3::new(0.5, -3.0, 0.5), DVec3::new(0.5, -9.0, 0.5)).contains("no surface is in front")
    );
    assert!(troubles(DVec3::new(0.5, 1e-5, 0.5), DVec3::new(0.5, -1.0, 0.5)).contains("stands on a wall"));
    // From inside a block one sees the room through its faces' backs.
    let scene = build(&cornell());
    let block = view(DVec3::new(0.67, 0.15, 0.28), DVec3::new(0.5, 0.2, 1.0));
    let troubles = view_troubles(&scene, &block, &[]).join("; ");
    assert!(troubles.contains("inside a wall or a block"), "{troubles}");
    assert!(view_troubles(&scene, &View::default(), &[]).is_empty());
}

#[test]
fn a_cut_leaves_out_the_near_shell_only() {
    let bounds = Bounds { min: DVec3::ZERO, max: DVec3::ONE };
    assert_eq!(bounds.entry(DVec3::new(0.5, 0.5, -2.0), DVec3::Z), Some(2.0));
    assert_eq!(bounds.entry(DVec3::new(0.5, 0.5, -2.0), DVec3::NEG_Z), None);
    assert_eq!(bounds.entry(DVec3::new(1.5, 0.5, -2.0), DVec3::Z), None);
    assert_eq!(bounds.entry(DVec3::splat(0.5), DVec3::X), Some(0.0));
}

#[test]
fn the_pixels_of_a_plate_cover_its_area() {
    let mut plate = quad("plate", [[0., 0., 0.], [3., 0., 0.], [0., 2., 0.]], [1, 1], 0.5);
    plate.emittance = 1.0.into();
    let scene = build(&SceneSpec::new(vec![plate]));
    let bounds = Bounds::of(&scene);
    let camera = Frame::of(&scene, &bounds).camera(&bounds, 30.0, 35.0, false, Size::Longest(400));
    let mut area = 0.0;
    for (x, y) in (0..camera.size[1]).flat_map(|y| (0..camera.size[0]).map(move |x| (x, y))) {
        let [x, y] = [x, y].map(f64::from);
        if let Some(sight) = camera.look(&scene, &[[x, y]])[0] {
            area += camera.footprint(&sight, camera.direction(x, y).length());
        }
    }
    assert!((area - 6.0).abs() < 0.1, "{area}");
}
