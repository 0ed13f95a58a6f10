//! Which scenes are boxes, and how their patches are numbered.

use crate::common::{Numbers, cube_54, plain_box, random_box};
use exact::{BoxScene, NotABox};
use glam::DVec3;
use radiosity::{IndexChoice, Scene, SceneSpec, Shape, Sides};

fn refusal(change: impl Fn(&mut SceneSpec)) -> NotABox {
    let mut spec = plain_box(DVec3::new(1.0, 2.0, 3.0), DVec3::new(4.0, 4.0, 4.0), [2, 3], 0.5, 1.0);
    change(&mut spec);
    BoxScene::recognise(&spec).unwrap_err()
}

/// Moves every corner of one surface.
fn displace(spec: &mut SceneSpec, surface: usize, displaced: impl Fn(DVec3) -> DVec3) {
    let Shape::Parallelogram { corner, corner_u, corner_v, .. } = &mut spec.surfaces[surface].shape else {
        unreachable!("the walls are parallelograms")
    };
    for point in [corner, corner_u, corner_v] {
        *point = displaced(*point);
    }
}

#[test]
fn patches_are_numbered_and_placed_as_in_the_scene() {
    let mut numbers = Numbers(3);
    for _ in 0..100 {
        let spec = random_box(&mut numbers, 0.5, 1.0);
        let scene = Scene::build(&spec, IndexChoice::Flat).unwrap();
        let lowest = spec.surfaces.iter().flat_map(|surface| surface.shape.corners());
        let lowest = lowest.fold(DVec3::INFINITY, DVec3::min);
        let recognised = BoxScene::recognise(&spec).unwrap();
        assert_eq!(recognised.patches().len(), scene.faces().len());
        for (rectangle, face) in recognised.patches().iter().zip(scene.faces()) {
            let centroid = lowest + 0.5 * (rectangle.lo + rectangle.hi);
            assert!(centroid.distance(face.centroid) < 1e-12, "{rectangle:?} against {face:?}");
            assert!((rectangle.area() / face.area - 1.0).abs() < 1e-9);
            let normal = scene.surfaces()[face.surface as usize].normal();
            let forward = if rectangle.facing == exact::Facing::Up { 1.0 } else { -1.0 };
            assert!((normal[rectangle.axis] - forward).abs() < 1e-12);
        }
    }
}

/// Walls still join where rounding moves corners that were meant to coincide.
#[test]
fn rounding_is_forgiven() {
    let mut numbers = Numbers(4);
    let mut spec = plain_box(DVec3::splat(-5000.0), DVec3::splat(-4999.0), [3, 3], 0.5, 1.0);
    for surface in 0..6 {
        let jitter = numbers.between(-4e-10, 4e-10);
        displace(&mut spec, surface, |point| point + DVec3::splat(jitter));
    }
    let matrix = exact::ExchangeMatrix::of_box(&BoxScene::recognise(&spec).unwrap());
    assert!(matrix.closure_defect() < 1e-14);
}

#[test]
fn other_shapes_are_refused() {
    let triangle = refusal(|spec| {
        let a = DVec3::new(4.0, 2.0, 3.0);
        let (b, c) = (a + DVec3::Z, a + DVec3::Y);
        spec.surfaces[1].shape = Shape::Triangle { a, b, c, rows: 1 };
    });
    assert_eq!(triangle, NotABox::Triangle { surface: 1 });
    let two_sided = refusal(|spec| spec.surfaces[2].sides = Sides::Both);
    assert_eq!(two_sided, NotABox::TwoSided { surface: 2 });
    let slanted = refusal(|spec| displace(spec, 3, |point| point + 1e-6 * point.x * DVec3::Y));
    assert_eq!(slanted, NotABox::Slanted { surface: 3 });
}

#[test]
fn misplaced_walls_are_refused() {
    let inside = refusal(|spec| displace(spec, 0, |point| point + 0.5 * DVec3::X));
    assert_eq!(inside, NotABox::Inside { surface: 0 });
    let shelf = refusal(|spec| {
        let shelf = spec.surfaces[4].clone();
        spec.surfaces.push(shelf);
        displace(spec, 6, |point| point + 0.5 * DVec3::Z);
    });
    assert_eq!(shelf, NotABox::Inside { surface: 6 });
    let turned = refusal(|spec| {
        let Shape::Parallelogram { corner_u, corner_v, .. } = &mut spec.surfaces[5].shape else {
            unreachable!("the walls are parallelograms")
        };
        std::mem::swap(corner_u, corner_v);
    });
    assert_eq!(turned, NotABox::FacesOut { surface: 5 });
}

#[test]
fn walls_must_be_tiled_exactly() {
    let twice = refusal(|spec| spec.surfaces.push(spec.surfaces[4].clone()));
    assert_eq!(twice, NotABox::Overlap { first: 4, second: 6 });
    let open = refusal(|spec| {
        spec.surfaces.remove(5);
    });
    assert!(matches!(open, NotABox::Hole { axis: 'z', end: "high", missing: 6.0, area: 6.0 }), "{open:?}");
    // As much overlap as hole: the areas alone would not tell.
    let shifted = refusal(|spec| {
        let half = |point: DVec3| DVec3::new(1.0 + 0.5 * (point.x - 1.0), point.y, point.z);
        spec.surfaces.push(spec.surfaces[4].clone());
        displace(spec, 4, half);
        displace(spec, 6, |point| half(point) + 0.5 * DVec3::X);
    });
    assert_eq!(shifted, NotABox::Overlap { first: 4, second: 6 });
}

#[test]
fn a_refusal_says_what_why_and_what_to_do() {
    let mut spec = cube_54();
    spec.surfaces.pop();
    let message = BoxScene::recognise(&spec).unwrap_err().to_string();
    assert_eq!(
        message,
        "the wall at the high end of the z axis lacks 1e0 of its 1e0 m² (light would leave, and the box not \
         be closed); close it with more surfaces"
    );
}
