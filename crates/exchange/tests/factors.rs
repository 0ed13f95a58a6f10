//! Exchange factors against closed forms and against `exact`: mean squared z, coverage, exact sums, smoothing.
//!
//! Seeds are fixed. Limits are four standard errors where nothing else is said: a false alarm in 16,000.

use crate::common::Grouped;
use crate::shapes::{grey, painted, quad, room};
use exchange::{Factors, smooth};
use glam::DVec3;
use radiosity::{SceneSpec, Shape, Sides, exchange::FactorKind};
use stats::{Coverage, mean_squared_z};

const KINDS: [FactorKind; 2] = [FactorKind::FirstHit, FactorKind::Absorbed];

/// A regular polygon of `corners` triangles about the axis, which faces up or down.
fn polygon(corners: u32, z: f64, radius: f64, up: bool) -> Vec<Shape> {
    let corner = |k: u32| {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(corners)).sin_cos();
        DVec3::new(radius * cos, radius * sin, z)
    };
    let triangle = |k| {
        let [b, c] = if up { [corner(k), corner(k + 1)] } else { [corner(k + 1), corner(k)] };
        Shape::Triangle { a: DVec3::new(0.0, 0.0, z), b, c, rows: 1 }
    };
    (0..corners).map(triangle).collect()
}

/// A room with a wall across it that leaves a gap.
fn walled() -> SceneSpec {
    let mut spec = painted(room([2.0, 1.0, 1.0], 1), 0.5, 1.0);
    let wall = quad([0.9, 0.0, 0.0], [0.0, 0.0, 0.6], [0.0, 1.0, 0.0], [1, 1]);
    spec.surfaces.push(grey(wall, 0.3, 1.0));
    spec.surfaces[6].sides = Sides::Both;
    spec
}

/// A floor and a smaller one-sided plate above it, in the open.
fn blocked() -> SceneSpec {
    let floor = quad([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [2, 2]);
    let lid = quad([0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [2, 2]);
    let blocker = quad([0.3, 0.3, 0.5], [0.5, 0.0, 0.0], [0.0, 0.4, 0.0], [1, 1]);
    painted([floor, lid, blocker], 0.6, 1.0)
}

/// The rows of the cube's floor in closed form: opposed unit squares at distance 1, perpendicular ones with a common edge
/// (Howell, A Catalog of Radiation Heat Transfer Configuration Factors, C-11 and C-14).
#[test]
fn squares_have_the_factors_of_the_catalogue() {
    let cube = painted(room([1.0; 3], 1), 0.0, 1.0);
    let counts = Grouped::by_face(&cube).count(FactorKind::FirstHit, 1, 0, 1 << 20);
    let factors = Factors::new(&counts, 0.9999);
    for i in 0..6 {
        for j in 0..6 {
            let truth = match (i == j, i / 2 == j / 2) {
                (true, _) => 0.0,
                (_, true) => 0.199_824_895_698_387_46,
                _ => 0.200_043_776_075_403_16,
            };
            let known = factors.get(i, j);
            assert!(known.interval.contains(truth), "{i} {j}: {known:?}");
            assert!(known.half_width() < 2e-3, "{i} {j}: {known:?}");
        }
        assert_eq!(factors.get(i, 7).factor, 0.0);
    }
}

/// Coaxial discs of radius 1 at distance 1 (C-41) as polygons of 96 triangles, whose factor differs from that of discs by less
/// than a part in a thousand.
#[test]
fn coaxial_discs_have_the_factor_of_the_catalogue() {
    let [lower, upper] = [(0.0, true), (1.0, false)].map(|(z, up)| polygon(96, z, 1.0, up));
    let spec = painted(lower.into_iter().chain(upper), 0.0, 1.0);
    let discs = Grouped::new(&spec, |_, surface| surface / 96);
    let counts = discs.count(FactorKind::FirstHit, 2, 0, 3 << 18);
    let s = 3.0_f64;
    let truth = 0.5 * (s - (s * s - 4.0).sqrt());
    for (i, j) in [(0, 1), (1, 0)] {
        let known = Factors::new(&counts, 0.9999).get(i, j);
        assert!((known.factor - truth).abs() < 1e-3 * truth + known.half_width(), "{known:?}, {truth}");
        assert!(known.half_width() < 6e-3 * truth, "{known:?}");
    }
}

/// Cells whose counts expect five walks or more are tested by z; all by the coverage of their intervals.
#[test]
fn factors_are_those_of_exact() {
    const RUNS: u64 = 100;
    const WALKS: u64 = 1 << 10;
    for (name, spec) in [("cube", scenes::cube(2)), ("walled", walled()), ("blocked", blocked())] {
        for kind in KINDS {
            let grouped = Grouped::by_face(&spec);
            let truth = grouped.truth(&spec, kind);
            let (mut z, mut coverage) = (Vec::new(), Coverage::default());
            for run in 0..RUNS {
                let counts = grouped.count(kind, 3, run * WALKS, WALKS);
                let factors = Factors::new(&counts, 0.95);
                for (i, row) in truth.iter().enumerate() {
                    for (j, &p) in row[..grouped.groups].iter().enumerate() {
                        let known = factors.get(i, j);
                        coverage.record(&known.interval, p);
                        if p * WALKS as f64 >= 5.0 {
                            z.push((known.factor - p) / (p * (1.0 - p) / WALKS as f64).sqrt());
                        }
                    }
                    let lost =
                        factors.get(i, grouped.groups).factor + factors.get(i, grouped.groups + 1).factor;
                    let error = (row[grouped.groups].max(1e-6) / WALKS as f64).sqrt();
                    assert!(
                        (lost - row[grouped.groups]).abs() < 6.0 * error + 1e-6,
                        "{name}: row {i}: {lost}"
                    );
                }
            }
            let tried = z.len() as f64;
            let mean = z.iter().sum::<f64>() / tried.sqrt();
            let squares = mean_squared_z(z).unwrap();
            // Cells of a row depend on each other: their sum is given. The variance of z² is 2 + 1/p(1 − p)N at most.
            assert!(squares.z(1.0).abs() < 5.0, "{name} {kind:?}: {squares:?}");
            assert!(mean.abs() < 4.0, "{name} {kind:?}: {mean}");
            let rate = coverage.rate(0.95).unwrap();
            assert!(rate.value > 0.945, "{name} {kind:?}: {rate:?}");
        }
    }
}

/// By surface, in proportion to area or to area times absorptance: groups of faces with unlike factors.
#[test]
fn factors_of_groups_are_means_over_their_births() {
    let mut spec = blocked();
    spec.surfaces[1].reflectance = 0.1.into();
    for kind in KINDS {
        let grouped = Grouped::new(&spec, |_, surface| u32::from(surface > 0));
        let truth = grouped.truth(&spec, kind);
        let counts = grouped.count(kind, 4, 0, 1 << 19);
        let factors = Factors::new(&counts, 0.9999);
        for (i, row) in truth.iter().enumerate() {
            for (j, &p) in row[..2].iter().enumerate() {
                assert!(
                    factors.get(i, j).interval.contains(p),
                    "{kind:?} {i} {j}: {:?} {p}",
                    factors.get(i, j)
                );
            }
        }
    }
}

/// To the last bit, whatever the order: numbers of walks are powers of two.
#[test]
fn rows_sum_to_exactly_one() {
    let grouped = Grouped::by_face(&blocked());
    for kind in KINDS {
        for walks in [1, 2, 1 << 5, 1 << 16] {
            let counts = grouped.count(kind, 5, 0, walks);
            let factors = Factors::new(&counts, 0.95);
            for i in 0..grouped.groups {
                let row = || (0..grouped.groups + 2).map(|j| factors.get(i, j).factor);
                assert_eq!((row().sum::<f64>(), row().rev().sum::<f64>()), (1.0, 1.0), "row {i}");
            }
        }
    }
}

/// Walk n of a group is the same walk however many others there are, and in whatever pieces they are walked.
#[test]
fn walks_of_a_group_have_places_of_their_own() {
    let grouped = Grouped::by_face(&walled());
    for kind in KINDS {
        let whole = grouped.count(kind, 6, 0, 1 << 12);
        let mut pieces = grouped.count(kind, 6, 0, 1 << 10);
        let rows = |counts: &exchange::ExchangeCounts| {
            (0..grouped.groups).map(|i| counts.row(i).to_vec()).collect::<Vec<_>>()
        };
        pieces.add(&rows(&grouped.count(kind, 6, 1 << 10, 1 << 11)));
        pieces.add(&rows(&grouped.count(kind, 6, 3 << 10, 1 << 10)));
        assert_eq!(whole, pieces);
    }
}

/// Smoothing lowers the mean squared error against `exact`, and says how much error is left.
#[test]
fn smoothing_lowers_the_error() {
    const RUNS: u64 = 40;
    const WALKS: u64 = 1 << 12;
    for (name, spec) in [("cube", scenes::cube(2)), ("blocked", blocked())] {
        for kind in KINDS {
            let grouped = Grouped::by_face(&spec);
            let (truth, weights) = (grouped.truth(&spec, kind), grouped.weights(kind));
            let (mut raw, mut smoothed, mut z, mut outside, mut cells) = (0.0, 0.0, Vec::new(), 0, 0);
            for run in 0..RUNS {
                let counts = grouped.count(kind, 7, run * WALKS, WALKS);
                let (factors, smooth) = (Factors::new(&counts, 0.95), smooth(&counts, &weights).unwrap());
                for (i, row) in truth.iter().enumerate() {
                    for (j, &p) in row[..grouped.groups].iter().enumerate().filter(|(_, p)| **p > 0.01) {
                        let (known, error) = (factors.get(i, j), smooth.errors[i][j]);
                        raw += (known.factor - p).powi(2);
                        smoothed += (smooth.factors[i][j] - p).powi(2);
                        z.push((smooth.factors[i][j] - p) / error);
                        cells += 1;
                        outside += u32::from(!known.interval.contains(smooth.factors[i][j]));
                    }
                }
            }
            let squares = mean_squared_z(z).unwrap();
            let gain = smoothed / raw;
            println!(
                "{name} {kind:?}: mean squared error times {gain:.3}, {squares:?}, {outside} of {cells} outside"
            );
            assert!(gain < 0.65, "{name} {kind:?}: {gain}");
            // Each pair counts twice, and the cells of a row depend on each other.
            assert!((squares.value - 1.0).abs() < 0.1, "{name} {kind:?}: {squares:?}");
            assert!(f64::from(outside) < 0.02 * f64::from(cells), "{name} {kind:?}: {outside} of {cells}");
        }
    }
}
