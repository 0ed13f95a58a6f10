//! The rule of choice, on light that is known.

use super::*;

/// What a grid of 2^i × 2^j cells loses of smooth light that varies along u alone.
fn lost(basis: Basis, [i, _]: [u32; 2]) -> f64 {
    let h = 0.5_f64.powi(i as i32);
    match basis {
        Basis::Constant => 0.08 * h * h,
        Basis::Linear => 0.001 * h.powi(4),
    }
}

fn smooth(walks: f64) -> SurfaceLight {
    SurfaceLight::known([5, 5], |basis, levels| 1.0 - lost(basis, levels), [1.0, 3.0], walks)
}

/// Cells are doubled along the axis along which light varies, and as often as pays. With constants that is as often as is best. With
/// linear fits it may be once more: beyond what a pilot resolves there may be a shadow's edge.
#[test]
fn grids_follow_the_light() {
    for walks in [1e5, 1e6, 1e7, 1e8] {
        let light = smooth(walks / 8.0);
        for (basis, more) in [(Basis::Constant, 0), (Basis::Linear, 1)] {
            let choice = Candidates::new(std::slice::from_ref(&light), &[basis]).choose(walks);
            let Cut::Grid([nu, nv]) = choice.cuts[0] else { panic!("a quad") };
            assert_eq!(nv, 1, "{walks} {basis:?}");
            let error =
                |i: u32| light.noise[basis as usize] * f64::from(1 << i) / walks + lost(basis, [i, 0]);
            let best = (0..16).min_by(|&a, &b| error(a).total_cmp(&error(b))).expect("some");
            assert!((best..=best + more).contains(&nu.ilog2()), "{walks} {basis:?}: {nu}, best 2^{best}");
        }
    }
}

/// Smooth light is worth two more unknowns a patch; even light is not.
#[test]
fn the_basis_follows_the_light() {
    let choose =
        |light: SurfaceLight| Candidates::new(&[light], &[Basis::Constant, Basis::Linear]).choose(1e6);
    assert_eq!(choose(smooth(1e5)).basis, Basis::Linear);
    let even = SurfaceLight::known([5, 5], |_, _| 1.0, [1.0, 3.0], 1e5);
    let choice = choose(even);
    assert_eq!((choice.basis, choice.cuts), (Basis::Constant, vec![Cut::Grid([1, 1])]));
}

/// Chance alone makes cells differ. Where nothing else does, surfaces stay whole, however fine the grids that were looked at: what a
/// pilot of 10⁵ walks catches beyond the mean is the noise of its estimates, ±√2·ν for each new coefficient.
#[test]
fn chance_is_not_taken_for_light() {
    let noise = [1.0, 3.0];
    let mut state = 7_u64;
    let mut sign = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        if state >> 63 == 0 { 1.0 } else { -1.0 }
    };
    let mut lights = Vec::new();
    for _ in 0..20 {
        let signs: Vec<f64> = (0..72).map(|_| sign()).collect();
        let caught = |basis: Basis, [i, j]: [u32; 2]| {
            let unknowns = if basis == Basis::Constant { 1.0 } else { 3.0 };
            let new = unknowns * f64::from((1 << (i + j)) - 1);
            let sign = signs[(36 * usize::from(basis == Basis::Linear)) + (6 * i + j) as usize];
            1.0 + 1e-5 * sign * (2.0 * new).sqrt()
        };
        lights.push(SurfaceLight::known([5, 5], caught, noise, 1e5));
    }
    let candidates = Candidates::new(&lights, &[Basis::Constant, Basis::Linear]);
    let choice = candidates.choose(1e6);
    assert!(candidates.are_even() && choice.basis == Basis::Constant);
    assert!(choice.cuts.iter().all(|&cut| cut == Cut::Grid([1, 1])), "{:?}", choice.cuts);
}

/// The light of a symmetric scene hides from the first doubling along each axis: halves have equal means.
#[test]
fn symmetric_light_is_found_behind_the_first_doubling() {
    let part = |level: u32| match level {
        0 | 1 => 0.0,
        level => 0.1 * (1.0 - 0.25_f64.powi(level as i32 - 1)),
    };
    let caught = |_, [i, j]: [u32; 2]| 1.0 + part(i) + part(j);
    let light = SurfaceLight::known([5, 5], caught, [1.0, 3.0], 1e6);
    let choice = Candidates::new(&[light], &[Basis::Constant]).choose(1e7);
    let Cut::Grid(cells) = choice.cuts[0] else { panic!("a quad") };
    assert!(cells.iter().all(|&n| n >= 16), "{cells:?}");
}

/// A target takes the fewest walks that a choice is foretold to reach it with, and the whole budget where none does.
#[test]
fn a_target_takes_the_fewest_walks() {
    let candidates = Candidates::new(&[smooth(1e6)], &[Basis::Constant]);
    let choice = candidates.choose_for(1e-3, 1024.0, 1e9);
    assert!(choice.error() <= 1e-3 && candidates.choose(0.5 * choice.walks).error() > 1e-3);
    assert_eq!(candidates.choose_for(1e-9, 1024.0, 1e6).walks, 1e6);
}
