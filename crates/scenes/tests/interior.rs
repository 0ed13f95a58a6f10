//! Tests of the interior: it is as large as asked, closed, well oriented, and alike on every machine.

use radiosity::{Estimator, Experiment, IndexChoice, Scene, Sequence, Shape, Space, Walks};
use scenes::interior;

#[test]
fn it_has_about_as_many_triangles_as_asked() {
    for wanted in [50_000, 57_000, 200_000, 1_000_000] {
        let surfaces = interior(wanted).surfaces.len();
        assert!(surfaces.abs_diff(wanted) * 20 < wanted, "{surfaces} for {wanted}");
    }
}

#[test]
fn not_one_walk_escapes_or_meets_a_back() {
    let scene = Scene::build(&interior(50_000), IndexChoice::Auto).unwrap();
    for space in [Space::Discrete, Space::Continuous] {
        let method = Walks { space, ..Walks::shooting(Estimator::Collision) };
        let experiment = Experiment::new(scene.clone(), method).unwrap();
        let mut board = experiment.board();
        experiment.walk(&Sequence::new(1), 0..500_000, &mut board);
        let counts = board.take().unwrap().counts;
        assert_eq!((counts.escaped, counts.absorbed_back), (0, 0), "{space:?}");
    }
}

/// Rounded vertices make the scene alike on every machine; other tracers get the very same triangles.
#[test]
fn its_corners_are_exact_in_32_bits() {
    for surface in interior(50_000).surfaces {
        assert!(matches!(surface.shape, Shape::Triangle { rows: 1, .. }));
        for x in surface.shape.corners().iter().flat_map(|corner| corner.to_array()) {
            assert_eq!(f64::from(x as f32), x);
        }
    }
}

/// The corners of all surfaces, folded (FNV-1a on 64-bit words).
fn digest(spec: &radiosity::SceneSpec) -> u64 {
    let corners = spec.surfaces.iter().flat_map(|surface| surface.shape.corners());
    corners
        .flat_map(|corner| corner.to_array())
        .fold(0xCBF2_9CE4_8422_2325, |hash, x| (hash ^ x.to_bits()).wrapping_mul(0x0000_0100_0000_01B3))
}

#[test]
fn it_is_the_same_on_every_machine() {
    assert_eq!(digest(&interior(57_000)), 13_287_072_726_873_818_965);
}
