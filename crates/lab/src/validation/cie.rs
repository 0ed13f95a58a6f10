//! Test cases 5.3 … 5.7 of CIE 171:2006, as far as they are of diffuse light. The illuminance that the report tables at a point is the
//! configuration factor from the point to what it sees, times the exitance of that: so the point's factor is walked. The rooms are
//! those of the cases in kind; their sizes are our own, and the truths are closed forms, not the report's tables.

use radiosity::FactorKind;

use super::closed_forms::{element_to_parallel_corner, element_to_perpendicular_corner, parallel_rectangles};
use super::{KnownFactor, measure, shapes};
use crate::lab::Lab;
use crate::papers::Findings;

pub(super) fn run(lab: &Lab) -> Findings {
    let pairs: Vec<KnownFactor> =
        [area_lamp(), skylight(), reflecting_plane(), obstruction()].into_iter().flatten().collect();
    Findings {
        published: "CIE 171:2006, test cases 5.3 (area lamps), 5.4 (conservation of flux through openings), 5.6 (reflection over \
                    diffuse surfaces) and 5.7 (the same with obstructions). 5.2 is of point sources and 5.5 of glass, which the \
                    program does not model; 5.8 is among the closed rooms below. The report is sold, so its tables are not held \
                    against: its cases rest on the configuration factors that are *theory* here. Ward's room of 1990 is left out, \
                    for its data could not be had."
            .into(),
        experiment: "Points are squares of 1 mm. Light of a diffuse surface at a point is the point's factor to that surface times the \
                     exitance of the surface."
            .into(),
        rows: measure(lab, FactorKind::FirstHit, &pairs),
        ..Findings::default()
    }
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
