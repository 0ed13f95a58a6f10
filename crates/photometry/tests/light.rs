//! Fluxes, directions and intensities of tables, held to quadrature.

mod support;

use std::f64::consts::PI;

use glam::DVec3;
use photometry::Luminaire;
use support::{Random, direction, ies};

/// Tables of every kind of photometry, with values that jump between nodes.
fn tables() -> Vec<(&'static str, Luminaire)> {
    let mut random = Random(11);
    let mut value = |_: f64, _: f64| (1000.0 * random.next().powi(3)).round();
    let step = |from: i32, to: i32, by: usize| (from..=to).step_by(by).map(f64::from).collect::<Vec<_>>();
    let mut made = |kind, c: &[f64], gamma: &[f64]| {
        let text = ies(2002, kind, c, gamma, &mut value);
        Luminaire::read(text.as_bytes()).unwrap_or_else(|error| panic!("{error}: {text}"))
    };
    vec![
        ("axial", made(1, &[0.0], &step(0, 180, 15))),
        ("quadrants", made(1, &[0.0, 10.0, 45.0, 90.0], &step(0, 90, 5))),
        ("C0", made(1, &step(0, 180, 20), &[0.0, 1.0, 3.0, 60.0, 180.0])),
        ("C90", made(1, &step(90, 270, 30), &step(0, 90, 10))),
        ("free", made(1, &step(0, 360, 24), &step(0, 180, 9))),
        ("upwards", made(1, &step(0, 345, 15), &step(90, 180, 10))),
        ("type A", made(3, &step(-50, 50, 10), &step(-90, 30, 10))),
        ("type B", made(2, &step(0, 90, 15), &step(-60, 60, 5))),
    ]
}

/// The integral of a function over all directions: the middle rule, which converges with the square of the steps, at two steps,
/// extrapolated.
fn quadrature(steps: usize, value: impl Fn(DVec3) -> f64) -> f64 {
    let rule = |n: usize| {
        let width = PI / n as f64;
        let mut sum = 0.0;
        for j in 0..n {
            let gamma = (j as f64 + 0.5) * width;
            for i in 0..2 * n {
                let c = (i as f64 + 0.5) * width;
                sum += gamma.sin() * value(direction(c.to_degrees(), gamma.to_degrees()));
            }
        }
        sum * width * width
    };
    (4.0 * rule(2 * steps) - rule(steps)) / 3.0
}

/// Steps of 1° and half of that meet all nodes of the tables, so that the integrand is smooth within them.
#[test]
fn the_flux_is_the_integral_of_the_intensities() {
    for (name, lamp) in tables() {
        let flux = lamp.distribution.flux();
        let found = quadrature(180, |d| lamp.distribution.intensity(d));
        // The nodes of type B lie on other circles: the integrand has edges within steps.
        let tolerance = if name == "type B" { 2e-4 } else { 1e-6 };
        assert!(
            (flux / found - 1.0).abs() < tolerance,
            "{name}: {flux} by closed form, {found} by quadrature"
        );
    }
    // ∫ (a + bγ) sin γ over the sphere at constant intensity.
    let even = Luminaire::read(ies(2019, 1, &[0.0], &[0.0, 180.0], &mut |_, _| 100.0).as_bytes()).unwrap();
    assert!((even.distribution.flux() / (400.0 * PI) - 1.0).abs() < 1e-14);
}

/// Type B by quadrature about its own axis, where the table's nodes are met.
#[test]
fn the_flux_of_type_b_is_the_integral_about_its_axis() {
    let (_, lamp) = tables().pop().unwrap();
    let turned = |d: DVec3| DVec3::new(-d.z, d.y, d.x);
    let found = quadrature(180, |d| lamp.distribution.intensity(turned(d)));
    assert!((lamp.distribution.flux() / found - 1.0).abs() < 1e-6);
}

/// 10⁶ draws from each of 8 tables in 20 × 36 bins of equal solid angle. χ² of ν degrees of freedom, as normal by Wilson & Hilferty, is
/// below 3.9 with a false-alarm rate of 5·10⁻⁵ each, 4·10⁻⁴ in all. Means of directions lie within 4.5 standard errors: 24 × 7·10⁻⁶.
#[test]
fn directions_have_the_density_of_the_intensities() {
    const DRAWS: usize = 1_000_000;
    const BINS: [usize; 2] = [20, 36];
    for (name, lamp) in tables() {
        let light = &lamp.distribution;
        let mut random = Random(45);
        let mut counts = vec![0u32; BINS[0] * BINS[1]];
        let (mut sum, mut squares) = (DVec3::ZERO, DVec3::ZERO);
        for _ in 0..DRAWS {
            let d = light.sample(random.next(), random.next());
            assert!((d.length() - 1.0).abs() < 1e-14, "{name}: {d}");
            sum += d;
            squares += d * d;
            let z = (((d.z + 1.0) * 0.5 * BINS[0] as f64) as usize).min(BINS[0] - 1);
            let c = d.y.atan2(d.x).rem_euclid(2.0 * PI) / (2.0 * PI) * BINS[1] as f64;
            counts[z * BINS[1] + (c as usize).min(BINS[1] - 1)] += 1;
        }
        let flux = light.flux();
        let (mut chi, mut cells) = (0.0, 0);
        let (mut rare, mut rare_expected) = (0.0, 0.0);
        for (bin, &count) in counts.iter().enumerate() {
            const FINE: usize = 16;
            let mut intensity = 0.0;
            for k in 0..FINE * FINE {
                let part = |k: usize| (k as f64 + 0.5) / FINE as f64;
                let z = ((bin / BINS[1]) as f64 + part(k / FINE)) / BINS[0] as f64 * 2.0 - 1.0;
                let c = ((bin % BINS[1]) as f64 + part(k % FINE)) / BINS[1] as f64 * 2.0 * PI;
                let r = (1.0 - z * z).sqrt();
                intensity += light.intensity(DVec3::new(r * c.cos(), r * c.sin(), z));
            }
            let share = intensity / (FINE * FINE) as f64 * 4.0 * PI / counts.len() as f64 / flux;
            let expected = share * DRAWS as f64;
            if expected < 20.0 {
                rare += f64::from(count);
                rare_expected += expected;
                continue;
            }
            chi += (f64::from(count) - expected).powi(2) / expected;
            cells += 1;
        }
        if rare_expected > 5.0 {
            chi += (rare - rare_expected).powi(2) / rare_expected;
            cells += 1;
        } else {
            assert!(rare < 25.0, "{name}: {rare} draws where {rare_expected} are expected");
        }
        let freedom = f64::from(cells - 1);
        let width = 2.0 / (9.0 * freedom);
        let z = ((chi / freedom).cbrt() - (1.0 - width)) / width.sqrt();
        assert!(z < 3.9, "{name}: χ² = {chi:.1} with {freedom} degrees of freedom, z = {z:.2}");

        let n = DRAWS as f64;
        let mean = sum / n;
        for axis in 0..3 {
            let expected = quadrature(90, |d| light.intensity(d) * d[axis]) / flux;
            let error = ((squares[axis] / n - mean[axis] * mean[axis]) / n).sqrt();
            let z = (mean[axis] - expected) / error;
            // The quadrature itself is good to 10⁻⁵.
            assert!(
                (mean[axis] - expected).abs() < 4.5 * error + 1e-5,
                "{name}: axis {axis} at {z:.2} standard errors"
            );
        }
    }
}

/// Along each number the cumulative distribution is a line: equal steps of ξ₁ enclose equal fluxes.
#[test]
fn the_first_number_is_the_flux_below() {
    let (_, lamp) = tables().remove(0);
    let light = &lamp.distribution;
    for k in 1..16 {
        let xi = f64::from(k) / 16.0;
        let z = light.sample(xi, 0.5).z;
        let cap = (-z).acos();
        let n = 20_000;
        let width = cap / f64::from(n);
        let at = |i: i32| (f64::from(i) + 0.5) * width;
        let below: f64 = (0..n)
            .map(|i| 2.0 * PI * width * at(i).sin() * light.intensity(direction(0.0, at(i).to_degrees())))
            .sum();
        assert!((below / light.flux() - xi).abs() < 1e-7, "ξ₁ = {xi}: {}", below / light.flux());
    }
    // The ends of the range of numbers.
    for (a, b) in [(0.0, 0.0), (1.0 - f64::EPSILON, 1.0 - f64::EPSILON), (0.0, 1.0 - f64::EPSILON)] {
        assert!(light.sample(a, b).is_finite());
    }
}

/// FNV-1a of the bits of draws and intensities: no platform's sine or cosine takes part.
#[test]
fn draws_and_intensities_have_the_same_bits_everywhere() {
    let mut random = Random(2026);
    let mut digest = 0xCBF2_9CE4_8422_2325u64;
    for (_, lamp) in tables() {
        for _ in 0..1000 {
            let d = lamp.distribution.sample(random.next(), random.next());
            for value in [d.x, d.y, d.z, lamp.distribution.intensity(d)] {
                digest = (digest ^ value.to_bits()).wrapping_mul(0x0000_0100_0000_01B3);
            }
        }
    }
    assert_eq!(format!("{digest:016x}"), "607dea294b522967");
}
