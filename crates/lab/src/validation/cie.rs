//! Test cases 5.2 … 5.8 of CIE 171:2006, but for 5.5, which is of glass. The illuminance of diffuse light that the report tables at a point is
//! the configuration factor from the point to what it sees, times the exitance of that: so the point's factor is walked. Light of point lamps
//! is shot at squares. The rooms are those of the cases in kind; their sizes are our own, and the truths are closed forms and quadratures, not
//! the report's tables.

use std::f64::consts::PI;

use glam::DVec3;
use photometry::{Distribution, Luminaire};
use radiosity::{
    Estimator, Experiment, IndexChoice, Method, Scene, SceneSpec, Shape, SurfaceSpec,
    exchange::FactorKind,
    lamps::{Emission, LampSpec, LampsSpec},
};
use stats::Measured;

use super::closed_forms::{element_to_parallel_corner, element_to_perpendicular_corner, parallel_rectangles};
use super::{KnownFactor, measure, shapes};
use crate::claim::Claim;
use crate::lab::Lab;
use crate::papers::Findings;

pub(super) fn run(lab: &Lab) -> Findings {
    let pairs: Vec<KnownFactor> =
        [area_lamp(), skylight(), reflecting_plane(), obstruction()].into_iter().flatten().collect();
    let mut rows = point_lamps(lab);
    rows.extend(measure(lab, FactorKind::FirstHit, &pairs));
    rows.extend(closed_room(lab));
    Findings {
        published: "CIE 171:2006, test cases 5.2 (point lamps, even and by a photometric file), 5.3 (area lamps), 5.4 (conservation of flux \
                    through openings), 5.6 (reflection over diffuse surfaces), 5.7 (the same with obstructions) and 5.8 (what is reflected in a \
                    closed room). 5.5 is of glass ([daylight](../guide/daylight.md#panes)). The report is sold, so its tables are not held \
                    against: its cases rest on the formulas that are *theory* here. Of its known errata, table 19 (5.7) and the values of \
                    5.14, no row depends. Ward's room of 1990 is left out, for its data could not be had."
            .into(),
        experiment: "Points are squares of 1 mm. Light of a diffuse surface at a point is the point's factor to that surface times the \
                     exitance of the surface. Point lamps of 10,000 lm shine on squares of 0.5 m, 3 m below: theory is the solid angle of the \
                     square, and the quadrature of I cos θ / d² for a file."
            .into(),
        rows,
        ..Findings::default()
    }
}

/// The side of the squares under point lamps, and the height of these [m].
const SQUARE: f64 = 0.5;
const HEIGHT: f64 = 3.0;
const FLUX: f64 = 10_000.0;

/// 5.2: squares on the floor, 0 to 3 m aside of a point below the lamp.
fn point_lamps(lab: &Lab) -> Vec<Claim> {
    let mut claims = Vec::new();
    let table = uneven();
    let strengths = [FLUX / (4.0 * PI), FLUX / table.flux()];
    let emissions = [("even", Emission::Uniform), ("by a file", Emission::Table(0))];
    for (light, ((name, emission), strength)) in emissions.into_iter().zip(strengths).enumerate() {
        for (place, aside) in [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0].into_iter().enumerate() {
            let corner = DVec3::new(aside - 0.5 * SQUARE, -0.5 * SQUARE, 0.0);
            let shape = Shape::parallelogram(corner, SQUARE * DVec3::X, SQUARE * DVec3::Y, [1, 1]);
            let lamp = LampSpec::new(HEIGHT * DVec3::Z, emission, strength);
            let mut spec = SceneSpec::new(vec![SurfaceSpec::new(shape, 0.0)]);
            spec.lamps = LampsSpec { tables: vec![table.clone()], list: vec![lamp], ..LampsSpec::default() };
            let truth = match emission {
                Emission::Uniform => {
                    let [x0, x1, y] = [corner.x, corner.x + SQUARE, 0.5 * SQUARE].map(|x| x / HEIGHT);
                    strength * 2.0 * (solid_angle(x1, y) - solid_angle(x0, y)) / (SQUARE * SQUARE)
                }
                _ => strength * mean_illuminance(&table, corner),
            };
            let walks: u64 = lab.pick(1 << 15, 1 << 22);
            let part = truth * SQUARE * SQUARE / FLUX;
            let measured = Measured {
                value: irradiances(spec, (20 * light + place) as u64, walks)[0],
                standard_error: truth * ((1.0 - part) / part / walks as f64).sqrt(),
            };
            claims.push(Claim::equal(
                format!("5.2, point lamp, {name}, {aside} m aside: E [lx]"),
                measured,
                truth,
            ));
        }
    }
    claims
}

/// The solid angle of a rectangle from a point above one of its corners, with its sides in units of the height.
fn solid_angle(a: f64, b: f64) -> f64 {
    (a * b / (1.0 + a * a + b * b).sqrt()).atan()
}

/// A table that is brightest at 35° and has no symmetry.
fn uneven() -> Distribution {
    let file = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 7 5 1 2 0 0 0\n1 1 10\n0 10 20 35 50 70 90\n0 90 180 270 360\n\
                700 800 900 1200 600 200 0\n700 760 880 1000 500 100 0\n700 720 800 850 450 90 0\n700 780 870 1100 550 120 0\n\
                700 800 900 1200 600 200 0\n";
    Luminaire::read(file.as_bytes()).expect("the file is one").distribution
}

/// The mean of I cos θ / d² over a square below a lamp of strength 1, by the middle rule at 400 × 400 points.
fn mean_illuminance(table: &Distribution, corner: DVec3) -> f64 {
    const POINTS: u32 = 400;
    let part = |i: u32| SQUARE * (f64::from(i) + 0.5) / f64::from(POINTS);
    let at = |i: u32, j: u32| {
        let away = corner + DVec3::new(part(i), part(j), -HEIGHT);
        table.intensity(away) * HEIGHT / away.length().powi(3)
    };
    let sum: f64 = (0..POINTS).flat_map(|i| (0..POINTS).map(move |j| at(i, j))).sum();
    sum / f64::from(POINTS * POINTS)
}

/// 5.8: a point lamp in a closed room of 4 × 4 × 4 m, 96 m², all of one reflectance. The mean of what is reflected is Φρ/(S(1 − ρ)). A walk
/// arrives k + 1 times with probability (1 − ρ)ρᵏ, of which k are of reflected light.
fn closed_room(lab: &Lab) -> Vec<Claim> {
    let claim = |(number, rho): (u64, f64)| {
        let mut spec = SceneSpec::furnace(2, rho);
        for surface in &mut spec.surfaces {
            let (corner, u, v) = surface.shape.edges();
            surface.shape = Shape::parallelogram(4.0 * corner, 4.0 * u, 4.0 * v, [2, 2]);
            surface.emittance = 0.0.into();
        }
        let lamp = LampSpec::new(DVec3::new(2.0, 2.0, 3.0), Emission::Uniform, FLUX / (4.0 * PI));
        spec.lamps = LampsSpec { tables: Vec::new(), list: vec![lamp], ..LampsSpec::default() };
        let walks: u64 = lab.pick(1 << 15, 1 << 22);
        let faces = irradiances(spec, 50 + number, walks);
        let direct = FLUX / 96.0;
        let measured = Measured {
            value: faces.iter().sum::<f64>() / faces.len() as f64 - direct,
            standard_error: direct * rho.sqrt() / (1.0 - rho) / (walks as f64).sqrt(),
        };
        let truth = direct * rho / (1.0 - rho);
        Claim::equal(
            format!("5.8, point lamp in a closed room, ρ = {rho}: reflected E [lx]"),
            measured,
            truth,
        )
    };
    (0..).zip([0.1, 0.3, 0.5, 0.7, 0.9, 0.95]).map(claim).collect()
}

/// The irradiance of every face, by shooting walks.
fn irradiances(spec: SceneSpec, seed: u64, walks: u64) -> Vec<f64> {
    let scene = Scene::build(&spec, IndexChoice::Auto).expect("the scene is valid");
    let experiment =
        Experiment::new(scene, Method::shooting(Estimator::Collision)).expect("the method takes lamps");
    let solution = experiment.run(seed, walks).expect("so few walks fit any sum");
    let of_face = |estimate: &Option<radiosity::Estimate>| {
        estimate.as_ref().and_then(|estimate| estimate.irradiance).unwrap_or(0.0)
    };
    solution.estimates.iter().map(of_face).collect()
}

/// The factor from an element at the origin to a rectangle of these ranges in the parallel plane at a height.
fn above([x0, x1]: [f64; 2], [y0, y1]: [f64; 2], height: f64) -> f64 {
    let corner = |x: f64, y: f64| {
        let [a, b] = [x / height, y / height];
        a.signum() * b.signum() * element_to_parallel_corner(a.abs(), b.abs())
    };
    corner(x1, y1) - corner(x0, y1) - corner(x1, y0) + corner(x0, y0)
}

/// A rectangle of these ranges at a height that faces down, by corner and edges.
fn facing_down([x0, x1]: [f64; 2], [y0, y1]: [f64; 2], height: f64) -> [[f64; 3]; 3] {
    [[x0, y0, height], [0.0, y1 - y0, 0.0], [x1 - x0, 0.0, 0.0]]
}

/// 5.3: points on the floor of a black room of 4 × 4 × 3 m under a lamp of 1 × 1 m in the middle of its ceiling.
fn area_lamp() -> Vec<KnownFactor> {
    let mut pairs = Vec::new();
    for [x, y] in [[2.0, 2.0], [1.0, 2.0], [0.5, 0.5], [3.9, 1.2]] {
        let [u, v] = [[1.5 - x, 2.5 - x], [1.5 - y, 2.5 - y]];
        pairs.push(KnownFactor::of_surfaces(
            format!("5.3, lamp of 1 × 1 above the floor at {x}, {y}: E over M"),
            shapes::element([facing_down(u, v, 3.0)]),
            above(u, v, 3.0),
        ));
    }
    pairs
}

/// 5.4: what comes in through an opening in the roof of a black room of 4 × 4 × 3 m falls on its floor and its walls.
fn skylight() -> Vec<KnownFactor> {
    let mut pairs = Vec::new();
    for side in [1.0, 2.0, 4.0] {
        let (low, high) = (2.0 - 0.5 * side, 2.0 + 0.5 * side);
        // In units of the height.
        let [opening, floor] = [[low, high], [0.0, 4.0]].map(|range| [range.map(|x| x / 3.0); 2]);
        let to_floor = parallel_rectangles(opening, floor);
        for (what, to, truth) in [("floor", 1, to_floor), ("walls", 2, 1.0 - to_floor)] {
            pairs.push(KnownFactor {
                label: format!("5.4, opening of {side} × {side} in the roof: flux on the {what}"),
                spec: shapes::room_below_opening([low, high]),
                group: |surface| surface.min(2),
                from: 0,
                to,
                truth,
                periods: [0.0; 2],
            });
        }
    }
    pairs
}

/// 5.6: a point that looks down on a diffuse surface in full light, and a point of a wall beside it.
fn reflecting_plane() -> Vec<KnownFactor> {
    let mut pairs = Vec::new();
    for side in [0.5, 4.0, 500.0] {
        let range = [-0.5 * side, 0.5 * side];
        pairs.push(KnownFactor::of_surfaces(
            format!("5.6, {side} × {side} of diffuse reflection seen from 3 m above its middle: E over M"),
            shapes::element([facing_down(range, range, 3.0)]),
            above(range, range, 3.0),
        ));
    }
    // The surface stands at a right angle to the wall.
    for (length, depth) in [(4.0, 4.0), (500.0, 500.0)] {
        let beside = [[1.0, -0.5 * length, 0.0], [0.0, 0.0, depth], [0.0, length, 0.0]];
        pairs.push(KnownFactor::of_surfaces(
            format!(
                "5.6, {length} × {depth} of diffuse reflection seen from a wall, 1 m above its edge: E over M"
            ),
            shapes::element([beside]),
            2.0 * element_to_perpendicular_corner(0.5 * length, depth),
        ));
    }
    pairs
}

/// 5.7: a plate half way between a point and a diffuse surface of 4 × 4 m takes away what the point would see through it.
fn obstruction() -> Vec<KnownFactor> {
    let mut pairs = Vec::new();
    let surface = [-2.0, 2.0];
    for (what, u, v) in
        [("1 × 1 in the middle", [-0.5, 0.5], [-0.5, 0.5]), ("0.5 × 1.5, aside", [0.25, 0.75], [-0.75, 0.75])]
    {
        pairs.push(KnownFactor::of_surfaces(
            format!("5.7, 4 × 4 of diffuse reflection at 3 m behind a plate of {what}, half way: E over M"),
            shapes::element([facing_down(surface, surface, 3.0), facing_down(u, v, 1.5)]),
            above(surface, surface, 3.0) - above(u, v, 1.5),
        ));
    }
    pairs
}
