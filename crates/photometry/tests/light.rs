//! Fluxes, directions and intensities of tables, held to quadrature.

use std::f64::consts::PI;

use crate::support::{Random, ies, quadrature, tables};
use glam::DVec3;
use photometry::{Cell, Luminaire};

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

/// Cells tile the sphere of a table, with its intensities and its flux in all; none reaches over the equator.
#[test]
fn cells_tile_the_table() {
    for (name, lamp) in tables() {
        let light = &lamp.distribution;
        let axes = light.axes();
        let cells = light.cells();
        let flux: f64 = cells.iter().map(|cell| cell.flux).sum();
        assert_eq!(flux, light.flux(), "{name}");
        for cell in &cells {
            let middle = |[sin, cos]: [f64; 2], width: f64| (sin.atan2(cos) + 0.5 * width).sin_cos();
            let ((sin_c, cos_c), (sin, cos)) =
                (middle(cell.c, cell.widths[0]), middle(cell.gamma, cell.widths[1]));
            let d = axes[0] * (sin * cos_c) + axes[1] * (sin * sin_c) - axes[2] * cos;
            let expected = 0.25 * cell.candela.as_flattened().iter().sum::<f64>();
            assert!((light.intensity(d) - expected).abs() < 1e-9 * light.peak(), "{name}: {cell:?}");
            let first = cell.gamma[0].atan2(cell.gamma[1]);
            let last = first + cell.widths[1];
            assert!(first > 0.5 * PI - 1e-12 || last < 0.5 * PI + 1e-12, "{name}: {first} {last}");
            assert!(cell.widths[0] <= Cell::WIDEST_C * (1.0 + 1e-12));
            assert!(cell.widths[1] <= Cell::WIDEST_GAMMA * (1.0 + 1e-12));
        }
    }
}

/// FNV-1a of the bits of cells and intensities: no platform's sine or cosine takes part.
#[test]
fn cells_and_intensities_have_the_same_bits_everywhere() {
    let mut random = Random(2026);
    let mut digest = 0xCBF2_9CE4_8422_2325u64;
    let mut add = |value: f64| digest = (digest ^ value.to_bits()).wrapping_mul(0x0000_0100_0000_01B3);
    for (_, lamp) in tables() {
        for cell in lamp.distribution.cells() {
            cell.c.into_iter().chain(cell.gamma).chain([cell.flux]).for_each(&mut add);
        }
        for _ in 0..1000 {
            let d = DVec3::from_array(std::array::from_fn(|_| random.next() - 0.5));
            add(lamp.distribution.intensity(d));
        }
    }
    assert_eq!(format!("{digest:016x}"), "5332cdef31b62812");
}
