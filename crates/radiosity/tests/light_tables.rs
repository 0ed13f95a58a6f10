//! Directions of births at lamps with tables, held to quadrature.

use std::f64::consts::PI;

use crate::support::{Random, quadrature, tables};
use glam::DVec3;
use photometry::Distribution;
use radiosity::{
    IndexChoice, Scene, SceneSpec,
    lamps::{Emission, LampSpec, LampsSpec},
};

/// A cube around a lamp with this table.
fn lit_by(light: &Distribution) -> Scene {
    let mut spec = SceneSpec::furnace(1, 0.0);
    spec.surfaces.iter_mut().for_each(|surface| surface.emittance = 0.0.into());
    let list = vec![LampSpec::new(DVec3::splat(0.5), Emission::Table(0), 1.0)];
    spec.lamps = LampsSpec { tables: vec![light.clone()], list, ..LampsSpec::default() };
    Scene::build(&spec, IndexChoice::Auto).unwrap()
}

/// 10⁶ draws from each of 8 tables in 20 × 36 bins of equal solid angle. χ² of ν degrees of freedom, as normal by Wilson & Hilferty, is
/// below 3.9 with a false-alarm rate of 5·10⁻⁵ each, 4·10⁻⁴ in all. Means of directions lie within 4.5 standard errors: 24 × 7·10⁻⁶.
#[test]
fn directions_have_the_density_of_the_intensities() {
    const DRAWS: usize = 1_000_000;
    const BINS: [usize; 2] = [20, 36];
    for (name, lamp) in tables() {
        let light = &lamp.distribution;
        let scene = lit_by(light);
        let mut random = Random(45);
        let mut counts = vec![0u32; BINS[0] * BINS[1]];
        let (mut sum, mut squares) = (DVec3::ZERO, DVec3::ZERO);
        for _ in 0..DRAWS {
            let d = scene.lamp_birth(0, std::array::from_fn(|_| random.bits())).direction;
            assert!((d.length() - 1.0).abs() < 1e-13, "{name}: {d}");
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
