//! Net heat in enclosures with closed forms, in which every group is uniform by symmetry.
//!
//! Seeds are fixed; a false alarm takes 5 standard errors.

use crate::common::Grouped;
use crate::shapes::{grey, painted, quad, room};
use BoundaryCondition::{Flux, Temperature};
use exchange::{Balance, BoundaryCondition, SIGMA, SparseFactors, Thermal};
use radiosity::{SceneSpec, Shape, exchange::FactorKind};
use stats::{Coverage, Interval, mean_squared_z};

/// F between opposed unit squares at distance 1.
const OPPOSED: f64 = 0.199_824_895_698_387_46;

/// A unit cube whose sides of x have these emissivities; its other sides are one group.
fn plates([first, second, walls]: [f64; 3]) -> Grouped {
    let mut spec = painted(room([1.0; 3], 1), 1.0 - walls, 1.0);
    spec.surfaces[0].reflectance = (1.0 - first).into();
    spec.surfaces[1].reflectance = (1.0 - second).into();
    Grouped::new(&spec, |_, surface| surface.min(2))
}

/// A cube within a cube twice as large, both seen from the space between; every side is one patch, so that by symmetry those of
/// a cube are alike.
fn boxes([inner, outer]: [f64; 2]) -> Grouped {
    let turned = |shape: Shape| match shape {
        Shape::Parallelogram { corner, corner_u, corner_v, cells } => {
            let [corner, u, v] = [corner, corner_v, corner_u].map(|point| (point + 0.5).to_array());
            let edge = |end: [f64; 3]| std::array::from_fn(|k| end[k] - corner[k]);
            quad(corner, edge(u), edge(v), cells)
        }
        triangle => triangle,
    };
    let mut surfaces: Vec<_> =
        room([1.0; 3], 1).into_iter().map(|shape| grey(turned(shape), 1.0 - inner, 1.0)).collect();
    surfaces.extend(room([2.0; 3], 1).into_iter().map(|shape| grey(shape, 1.0 - outer, 1.0)));
    Grouped::new(&SceneSpec::new(surfaces), |_, surface| surface / 6)
}

fn solve(grouped: &Grouped, given: &[BoundaryCondition], run: u64, walks: u64) -> Thermal {
    let counts = grouped.count(FactorKind::Absorbed, 11, run * walks, walks);
    let emitting_areas = &grouped.weights(FactorKind::Absorbed)[..];
    let factors = &SparseFactors::from(&counts);
    Balance { factors, emitting_areas, given, environment: None, level: 0.95 }.solve().unwrap()
}

/// Runs many times and holds estimates, their errors and their intervals against the truth.
fn judge(
    grouped: &Grouped,
    given: &[BoundaryCondition],
    truth: f64,
    read: impl Fn(&Thermal) -> exchange::HeatEstimate,
) {
    const RUNS: u64 = 400;
    let (mut z, mut coverage) = (Vec::new(), Coverage::default());
    for run in 0..RUNS {
        let found = read(&solve(grouped, given, run, 1 << 12));
        z.push((found.value - truth) / found.std_error.unwrap());
        coverage.record(&Interval { low: found.low, high: found.high }, truth);
    }
    let mean = z.iter().sum::<f64>() / (RUNS as f64).sqrt();
    let (squares, rate) = (mean_squared_z(z).unwrap(), coverage.rate(0.95).unwrap());
    assert!(mean.abs() < 4.0, "{mean}: {truth}");
    assert!(squares.z(1.0).abs() < 4.0, "{squares:?}");
    assert!(rate.z(0.95).abs() < 4.0, "{rate:?}");
}

fn emitted(kelvin: f64) -> f64 {
    SIGMA * kelvin.powi(4)
}

/// Two grey squares joined by insulated walls: Q = (e₁ − e₂)/(ρ₁ + 1/(F₁₂ + 1/(1/F₁w + 1/F₂w)) + ρ₂) of unit areas, with ρ = (1 − ε)/ε
/// (Incropera & DeWitt, *Fundamentals of Heat and Mass Transfer*, "the reradiating surface"). The walls' emissivity is of no account.
#[test]
fn grey_plates_with_insulated_walls() {
    let [e1, e2] = [0.8, 0.5];
    let grouped = plates([e1, e2, 0.3]);
    let walls = 1.0 - OPPOSED;
    let between = 1.0 / (OPPOSED + 0.5 * walls);
    let net = (emitted(400.0) - emitted(300.0)) / ((1.0 - e1) / e1 + between + (1.0 - e2) / e2);
    let given = [Temperature(400.0), Temperature(300.0), Flux(0.0)];
    judge(&grouped, &given, net, |thermal| thermal.fluxes[0]);
    judge(&grouped, &given, -net, |thermal| thermal.fluxes[1]);
    // The walls are halfway between the radiosities of the plates.
    let [j1, j2] = [emitted(400.0) - net * (1.0 - e1) / e1, emitted(300.0) + net * (1.0 - e2) / e2];
    let wall = (0.5 * (j1 + j2) / SIGMA).powf(0.25);
    judge(&grouped, &given, wall, |thermal| thermal.temperatures[2]);
}

/// Black walls of a given temperature: three surfaces, of which each plate loses F·(e − e′) to the others.
#[test]
fn black_plates_in_a_black_box() {
    let grouped = plates([1.0; 3]);
    let given = [Temperature(500.0), Temperature(300.0), Temperature(350.0)];
    let net =
        OPPOSED * (emitted(500.0) - emitted(300.0)) + (1.0 - OPPOSED) * (emitted(500.0) - emitted(350.0));
    judge(&grouped, &given, net, |thermal| thermal.fluxes[0]);
}

/// Concentric cubes: Q = A₁(e₁ − e₂)/(1/ε₁ + (A₁/A₂)(1/ε₂ − 1)). Given the flux, the temperature follows.
#[test]
fn a_cube_in_a_cube() {
    let [e1, e2] = [0.7, 0.4];
    let grouped = boxes([e1, e2]);
    let net = 6.0 * (emitted(350.0) - emitted(280.0)) / (1.0 / e1 + 0.25 * (1.0 / e2 - 1.0));
    let fixed = [Temperature(350.0), Temperature(280.0)];
    judge(&grouped, &fixed, net, |thermal| thermal.fluxes[0]);
    judge(&grouped, &[Flux(net), Temperature(280.0)], 350.0, |thermal| thermal.temperatures[0]);
    judge(&grouped, &[Flux(net), Temperature(280.0)], -net, |thermal| thermal.fluxes[1]);
}
