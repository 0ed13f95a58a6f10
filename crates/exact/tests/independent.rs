//! The 54-patch cube of S97 by ways that share nothing with the crate: form factors by cubature of Lambert's
//! point-to-polygon formula, the power system by iteration.

use crate::common::{assert_near, cube_54};
use exact::{BoxScene, Exact, Rectangle};
use glam::DVec3;

/// Points along either side of a patch that its form factors are averaged over.
const POINTS: u32 = 48;

/// Lambert 1760: the form factor from a point with unit normal `n` to a polygon above its horizon.
fn lambert(point: DVec3, n: DVec3, polygon: &[DVec3; 4]) -> f64 {
    let edge = |k: usize| {
        let (a, b) = (polygon[k] - point, polygon[(k + 1) % 4] - point);
        let cross = a.cross(b);
        if cross == DVec3::ZERO { 0.0 } else { a.angle_between(b) * n.dot(cross.normalize()) }
    };
    ((0..4).map(edge).sum::<f64>() / std::f64::consts::TAU).abs()
}

fn corners(rectangle: &Rectangle) -> [DVec3; 4] {
    let (p, q) = ((rectangle.axis + 1) % 3, (rectangle.axis + 2) % 3);
    [[false, false], [true, false], [true, true], [false, true]].map(|[on_p, on_q]| {
        let mut corner = rectangle.lo;
        corner[p] = if on_p { rectangle.hi[p] } else { rectangle.lo[p] };
        corner[q] = if on_q { rectangle.hi[q] } else { rectangle.lo[q] };
        corner
    })
}

fn averaged_form_factor(i: &Rectangle, j: &Rectangle) -> f64 {
    if (i.axis, i.facing) == (j.axis, j.facing) {
        return 0.0;
    }
    let (from, to) = (corners(i), corners(j));
    let mut sum = 0.0;
    for k in 0..POINTS * POINTS {
        let at = [k / POINTS, k % POINTS].map(|m| (f64::from(m) + 0.5) / f64::from(POINTS));
        let point = from[0] + at[0] * (from[1] - from[0]) + at[1] * (from[3] - from[0]);
        sum += lambert(point, DVec3::AXES[i.axis], &to);
    }
    sum / f64::from(POINTS * POINTS)
}

/// φ_i = Σ_j F_ji (Φ_j + R_jφ_j), bounce after bounce.
fn iterate(form_factors: &[Vec<f64>], reflectance: &[f64], power: &[f64]) -> Vec<f64> {
    let n = power.len();
    let mut incoming = vec![0.0; n];
    for _ in 0..200 {
        let shot: Vec<f64> = (0..n).map(|j| power[j] + reflectance[j] * incoming[j]).collect();
        incoming = (0..n).map(|i| (0..n).map(|j| form_factors[j][i] * shot[j]).sum()).collect();
    }
    incoming
}

#[test]
fn the_54_patch_cube() {
    let spec = cube_54();
    let exact = Exact::of_scene(&spec).unwrap();
    let cube = BoxScene::recognise(&spec).unwrap();
    let row = |i: &Rectangle| cube.patches().iter().map(|j| averaged_form_factor(i, j)).collect();
    let form_factors: Vec<Vec<f64>> = cube.patches().iter().map(row).collect();
    for (i, row) in form_factors.iter().enumerate() {
        for (j, &cubature) in row.iter().enumerate() {
            assert_near(exact.exchange().form_factor(i, j), cubature, 2e-5);
        }
    }

    let reflectance: Vec<f64> = (0..54).map(|i| [0.3, 0.4, 0.5, 0.6, 0.7, 0.8][i / 9]).collect();
    let alone = |source: usize, watts: f64| {
        let mut power = vec![0.0; 54];
        power[source] = watts;
        iterate(&form_factors, &reflectance, &power)
    };
    let incoming = alone(4, 1.0 / 9.0);
    for (i, phi) in incoming.iter().enumerate() {
        let radiosity = if i == 4 { 1.0 } else { 0.0 } + reflectance[i] * phi * 9.0;
        assert_near(exact.solution().radiosity[i], radiosity, 2e-6);
        assert_near(exact.xi()[i], alone(i, 1.0)[i], 2e-5);
    }
}
