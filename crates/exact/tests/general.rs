//! Scenes that are no axis-aligned boxes, nothing in them hidden: published view factors, other ways to the
//! same number, furnaces, open scenes.

use std::f64::consts::TAU;

use crate::common::{Numbers, assert_near, cube_54, random_box};
use crate::shapes::{ball, painted, quad, tetrahedron, turned};
use exact::{Exact, FormFactors, SystemAccuracy};
use glam::DVec3;
use radiosity::{SceneSpec, Shape};

fn solve(spec: &SceneSpec) -> Exact {
    let exact = Exact::of_scene(spec).unwrap();
    assert!(matches!(exact.form_factors(), FormFactors::General { .. }));
    exact
}

/// A_iF_ij [m²] of two outlines, each the patches of some surfaces.
fn exchange_between(i: &[Shape], j: &[Shape]) -> f64 {
    let spec = painted(i.iter().chain(j).cloned(), 0.5, 1.0);
    let exact = solve(&turned(&spec));
    let cells = |shapes: &[Shape]| shapes.iter().map(|s| s.cell_count() as usize).sum::<usize>();
    let first = cells(i);
    let pairs = (0..first).flat_map(|p| (first..first + cells(j)).map(move |q| (p, q)));
    pairs.map(|(p, q)| exact.exchange().exchange_area(p, q)).sum()
}

fn floor(n: u32) -> Shape {
    quad([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [n, n])
}

/// The squares of theory.md, turned so that they follow no axis, whole and in cells.
#[test]
fn published_view_factors() {
    for n in [1, 2, 5] {
        let ceiling = quad([0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [n, n]);
        assert_near(exchange_between(&[floor(n)], &[ceiling]), 0.199_824_895_698_387_3, 1e-10);
        let wall = quad([0.0; 3], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [n, n]);
        assert_near(exchange_between(&[floor(n)], &[wall]), 0.200_043_776_075_403_2, 1e-10);
    }
}

#[test]
fn two_triangles_are_a_rectangle() {
    let [a, b, c, d] = [DVec3::Z, DVec3::new(0.0, 1.0, 1.0), DVec3::ONE, DVec3::new(1.0, 0.0, 1.0)];
    for rows in [1, 3] {
        let halves = [Shape::Triangle { a, b, c, rows }, Shape::Triangle { a, b: c, c: d, rows }];
        assert_near(exchange_between(&[floor(2)], &halves), 0.199_824_895_698_387_3, 1e-10);
    }
}

/// n triangles around the centre, at height z, facing up or down.
fn disc(n: u32, z: f64, up: bool) -> Vec<Shape> {
    let rim = |k: u32| {
        let angle = TAU * f64::from(k) / f64::from(n);
        DVec3::new(angle.cos(), angle.sin(), z)
    };
    let sector = |k: u32| {
        let (b, c) = if up { (rim(k), rim(k + 1)) } else { (rim(k + 1), rim(k)) };
        Shape::Triangle { a: DVec3::new(0.0, 0.0, z), b, c, rows: 1 }
    };
    (0..n).map(sector).collect()
}

/// Coaxial discs with r = h: 0.3819660; the error of n-gons falls like n⁻².
#[test]
fn coaxial_discs() {
    let view_factor = |n: u32| {
        let area = 0.5 * f64::from(n) * (TAU / f64::from(n)).sin();
        exchange_between(&disc(n, 0.0, true), &disc(n, 1.0, false)) / area
    };
    let expected = 0.5 * (3.0 - 5.0_f64.sqrt());
    let [coarse, fine] = [32, 64].map(view_factor);
    assert_near((coarse - expected) / (fine - expected), 4.0, 0.05);
    assert_near((4.0 * fine - coarse) / 3.0, expected, 1e-6);
}

/// Rectangles anywhere, some through the plane of the other: contours and cubature, which see them turned,
/// against closed forms, which see them along the axes.
#[test]
fn closed_forms_contours_and_cubature_agree() {
    let mut numbers = Numbers(31);
    let mut seen = 0;
    for _ in 0..300 {
        let mut three = |scale: f64| [(); 3].map(|()| scale * numbers.between(-1.0, 1.0));
        let (corner, size) = (three(4.0), three(1.0).map(f64::abs));
        let (u, v) = match numbers.below(3) {
            0 => ([size[0], 0.0, 0.0], [0.0, -size[1], 0.0]),
            1 => ([0.0, size[1], 0.0], [0.0, 0.0, size[2]]),
            _ => ([0.0, 0.0, size[2]], [size[0], 0.0, 0.0]),
        };
        let spec = painted([floor(1), quad(corner, u, v, [1, 1])], 0.5, 1.0);
        let [along, across] = [&spec, &turned(&spec)].map(|spec| solve(spec).exchange().exchange_area(0, 1));
        assert_near(across, along, 1e-9 * along + 1e-12);
        seen += usize::from(along > 0.0);
    }
    assert!(seen > 50, "only {seen} pairs see each other");
}

/// Exact and Accuracy of a furnace with E/(1 − R) = 2.
fn furnace(shapes: Vec<Shape>) {
    let exact = solve(&painted(shapes, 0.75, 0.5));
    let accuracy = SystemAccuracy::of(&exact);
    for (b, error) in exact.solution().radiosity.iter().zip(&accuracy.radiosity_error) {
        assert_near(*b, 2.0, *error);
    }
    assert!(accuracy.row_error <= 1.01e-9, "nothing is hidden in a convex scene: {accuracy:?}");
}

#[test]
fn furnaces_in_convex_shapes() {
    furnace(tetrahedron(1));
    furnace(tetrahedron(5));
    furnace(ball(1, |_| 1.0));
}

/// What holds along the axes holds in any other direction.
#[test]
fn turned_boxes() {
    let mut numbers = Numbers(32);
    for spec in [cube_54(), random_box(&mut numbers, 0.6, 1.0), random_box(&mut numbers, 0.6, 1.0)] {
        let (along, across) = (Exact::of_scene(&spec).unwrap(), solve(&turned(&spec)));
        assert_eq!(along.form_factors(), &FormFactors::ClosedForm);
        for i in 0..along.face_count() {
            let (b, b_turned) = (along.solution().radiosity[i], across.solution().radiosity[i]);
            assert_near(b_turned / b, 1.0, 1e-9);
            assert_near(across.xi()[i] / along.xi()[i], 1.0, 1e-9);
        }
    }
}

/// B_i = E_i + R_iH with H = Σ f_jE_j/(1 − Σ f_jR_j), f = A/ΣA, in a sphere; an icosphere comes close.
#[test]
fn spherical_cavity() {
    let errors = [1, 2, 3].map(|levels| {
        let mut spec = painted(ball(levels, |_| 1.0), 0.0, 0.0);
        for surface in &mut spec.surfaces {
            let above = surface.shape.corners().iter().sum::<DVec3>().z > 0.0;
            (surface.reflectance, surface.emittance) =
                if above { (0.9.into(), 0.1.into()) } else { (0.4.into(), 1.0.into()) };
        }
        let exact = solve(&spec);
        let total: f64 = exact.areas().iter().sum();
        let mean = |of_patches: &[f64]| -> f64 {
            of_patches.iter().zip(exact.areas()).map(|(x, a)| x * a / total).sum()
        };
        let irradiance = mean(exact.emittance()) / (1.0 - mean(exact.reflectance()));
        let off: Vec<f64> =
            exact.solution().irradiance.iter().map(|h| (h / irradiance - 1.0).powi(2)).collect();
        mean(&off).sqrt()
    });
    let [coarse, middle, fine] = errors;
    assert!(middle < 0.45 * coarse && fine < 0.45 * middle && fine < 0.006, "{errors:?}");
}

/// B₁ = (E₁ + R₁F E₂)/(1 − R₁R₂F²): parallel plates of one patch each, which infinity makes F = 1.
#[test]
fn parallel_plates() {
    let [(r1, e1), (r2, e2)] = [(0.7, 1.0), (0.4, 2.0)];
    let plates = |gap: f64| {
        let ceiling = quad([0.0, 0.0, gap], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [1, 1]);
        let mut spec = painted([floor(1), ceiling], r1, e1);
        (spec.surfaces[1].reflectance, spec.surfaces[1].emittance) = (r2.into(), e2.into());
        solve(&turned(&spec))
    };
    let between = |f: f64| (e1 + r1 * f * e2) / (1.0 - r1 * r2 * f * f);
    assert_near(plates(1.0).solution().radiosity[0], between(0.199_824_895_698_387_3), 1e-9);
    let mut last = 0.0;
    for gap in [1.0, 0.1, 0.01, 0.001] {
        let b = plates(gap).solution().radiosity[0];
        assert!(b > last && b < between(1.0));
        last = b;
    }
    // At most the perimeter × the gap of the light is lost per crossing, B ≤ 3.4 W/m².
    assert_near(last, between(1.0), 2.0 * 4.0 * 0.001 * 3.4);
}

/// What open scenes emit they absorb or lose through 1 − ΣF: Σ (1 − R_i)φ_i + Σ A_iB_i(1 − Σ_jF_ij) = Φ_T.
#[test]
fn open_scenes_lose_what_their_rows_lack() {
    let mut shapes = tetrahedron(4);
    shapes.remove(2);
    let exact = solve(&painted(shapes, 0.6, 1.0));
    let solution = exact.solution();
    let sums = exact.exchange().row_sums();
    let absorbed: f64 =
        solution.incoming.iter().zip(exact.reflectance()).map(|(phi, r)| (1.0 - r) * phi).sum();
    let lost = |i: usize| exact.areas()[i] * solution.radiosity[i] * (1.0 - sums[i]);
    let lost: f64 = (0..exact.face_count()).map(lost).sum();
    assert!(lost > 0.3 * exact.total_power());
    assert_near((absorbed + lost) / exact.total_power(), 1.0, 1e-13);
    assert!(sums.iter().all(|&sum| sum < 1.0));
}

/// Threads share the rows out anew each time; no bit may tell.
#[test]
fn threads_do_not_enter_the_answer() {
    let spec = painted(crate::shapes::l_room(3), 0.5, 1.0);
    let [first, second] = [(); 2].map(|()| solve(&spec));
    assert_eq!(first.solution(), second.solution());
    assert_eq!(first.exchange().row_errors(), second.exchange().row_errors());
}
