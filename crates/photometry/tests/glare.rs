//! Glare: position indices and the areas that openings show.

use glam::DVec3;
use photometry::{LuminousOpening, position_index};

/// Entries of the table of CIE 117 straight above the line of sight, which the formula fits: heights and ways aside over the way ahead.
#[test]
fn position_indices_are_those_of_the_table() {
    for (above, aside, index) in
        [(0.0, 0.0, 1.0), (0.1, 0.0, 1.26), (0.5, 0.0, 2.86), (1.0, 0.0, 7.0), (1.5, 0.0, 13.15)]
    {
        let towards = DVec3::new(1.0, aside, above).normalize();
        let found = position_index(DVec3::X, towards).unwrap();
        assert!((found / index - 1.0).abs() < 0.04, "{above} {aside}: {found} for {index}");
    }
    assert_eq!(position_index(DVec3::X, DVec3::NEG_X), None);
    assert_eq!(position_index(DVec3::X, DVec3::new(0.9, 0.0, -0.1).normalize()), None);
}

/// Cauchy: the mean over all directions is a quarter of the surface of a convex body.
#[test]
fn projected_areas_have_the_mean_of_their_bodies() {
    const N: u32 = 400;
    let mean = |opening: LuminousOpening| {
        let mut sum = 0.0;
        for i in 0..N {
            for j in 0..N {
                let z = 2.0 * (f64::from(i) + 0.5) / f64::from(N) - 1.0;
                let (sin, cos) = (std::f64::consts::TAU * (f64::from(j) + 0.5) / f64::from(N)).sin_cos();
                let across = (1.0 - z * z).sqrt();
                sum += opening.projected_area(DVec3::new(across * cos, across * sin, z));
            }
        }
        sum / f64::from(N * N)
    };
    let pi = std::f64::consts::PI;
    for (opening, surface) in [
        (LuminousOpening::Rectangle { x: 2.0, y: 3.0 }, 12.0),
        (LuminousOpening::Disc { x: 2.0, y: 2.0 }, 2.0 * pi),
        (LuminousOpening::Box { size: [1.0, 2.0, 3.0] }, 22.0),
        (LuminousOpening::Cylinder { size: [2.0, 2.0, 3.0], axis: 2 }, 8.0 * pi),
        (LuminousOpening::Cylinder { size: [3.0, 2.0, 2.0], axis: 0 }, 8.0 * pi),
        (LuminousOpening::Ellipsoid { size: [2.0; 3] }, 4.0 * pi),
        (LuminousOpening::Point, 0.0),
    ] {
        let found = mean(opening);
        assert!((found - surface / 4.0).abs() < 1e-3 * surface + 1e-12, "{opening:?}: {found}");
    }
}
