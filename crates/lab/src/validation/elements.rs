//! More of the catalogue: elements, unequal and offset rectangles, endless strips, discs and annuli.

use radiosity::exchange::FactorKind;

use super::{KnownFactor, closed_forms, measure, shapes};
use crate::lab::Lab;
use crate::papers::Findings;

pub(super) fn run(lab: &Lab) -> Findings {
    let pairs: Vec<KnownFactor> =
        [rectangles(), strips(), elements(), annuli()].into_iter().flatten().collect();
    Findings {
        published: "J. R. Howell, *A Catalog of Radiation Heat Transfer Configuration Factors*: C-13, C-14 and C-41 with the algebra \
                    of factors, crossed strings (Hottel), and of class B elements to rectangles and discs. The formulas are held \
                    against quadratures (`closed_forms.rs`)."
            .into(),
        experiment: format!(
            "Walks from the first group of a pair end at their first hit. Elements are squares of 1 mm, at distances of metres. Discs \
             are polygons of {} triangles; what is endless is 10⁵ long.",
            shapes::SECTORS
        ),
        rows: measure(lab, FactorKind::FirstHit, &pairs),
        ..Findings::default()
    }
}

fn rectangles() -> Vec<KnownFactor> {
    let mut pairs = Vec::new();
    let unit = [[0.0, 1.0], [0.0, 1.0]];
    for (what, to) in [
        ("one twice as wide, centred", [[-0.5, 1.5], [-0.5, 1.5]]),
        ("one beside it", [[1.0, 2.0], [0.0, 1.0]]),
        ("one of 1.5 × 1.3 that overlaps a corner", [[0.5, 2.0], [-1.0, 0.3]]),
    ] {
        let label = format!("parallel squares at distance 1: to {what}");
        let truth = closed_forms::parallel_rectangles(unit, to);
        pairs.push(KnownFactor::of_surfaces(label, shapes::parallel(unit, to), truth));
    }
    for (x, z) in [([0.5, 1.5], [0.0, 1.0]), ([0.0, 1.0], [1.0, 3.0]), ([1.0, 2.0], [0.5, 1.0])] {
        let label = format!("floor strip {} … {} to wall strip {} … {}, length 1", x[0], x[1], z[0], z[1]);
        let truth = closed_forms::perpendicular_strips(x, z);
        pairs.push(KnownFactor::of_surfaces(label, shapes::perpendicular_strips(x, z), truth));
    }
    pairs
}

fn strips() -> Vec<KnownFactor> {
    let corner = |k: u32| {
        let (sin, cos) = (std::f64::consts::FRAC_PI_3 * f64::from(k)).sin_cos();
        [cos, sin]
    };
    let hexagon = |k: u32| [corner(k), corner(k + 1)];
    let floor = [[0.0, 0.0], [1.0, 0.0]];
    let mut pairs = Vec::new();
    for (what, from, to) in [
        ("strip of width 1 to one of width 3 at distance 1", floor, [[2.0, 1.0], [-1.0, 1.0]]),
        ("strip of width 1 to one of width 0.5 at distance 2, aside", floor, [[1.5, 2.0], [1.0, 2.0]]),
        ("floor of width 1 to a wall of height 3 along its edge", floor, [[1.0, 0.0], [1.0, 3.0]]),
        ("floor of width 1 to a wall of height 0.2 along its edge", floor, [[1.0, 0.0], [1.0, 0.2]]),
        ("hexagon: side to the next", hexagon(0), hexagon(1)),
        ("hexagon: side to the next but one", hexagon(0), hexagon(2)),
        ("hexagon: side to the opposite one", hexagon(0), hexagon(3)),
    ] {
        let truth = closed_forms::crossed_strings(from, to);
        pairs.push(KnownFactor::of_surfaces(format!("endless {what}"), shapes::endless([from, to]), truth));
    }
    pairs
}

fn elements() -> Vec<KnownFactor> {
    let mut pairs = Vec::new();
    for (a, b) in [(1.0, 1.0), (0.5, 4.0)] {
        let truth = closed_forms::element_to_parallel_corner(a, b);
        let above = shapes::element([[[0.0, 0.0, 1.0], [0.0, b, 0.0], [a, 0.0, 0.0]]]);
        pairs.push(KnownFactor::of_surfaces(
            format!("element to a parallel {a} × {b}, corner above it"),
            above,
            truth,
        ));
    }
    for (b, c) in [(1.0, 1.0), (3.0, 0.5)] {
        let truth = closed_forms::element_to_perpendicular_corner(b, c);
        let beside = shapes::element([[[1.0, 0.0, 0.0], [0.0, 0.0, c], [0.0, b, 0.0]]]);
        pairs.push(KnownFactor::of_surfaces(
            format!("element to a wall {b} long and {c} high"),
            beside,
            truth,
        ));
    }
    for (r, away) in [(1.0, 0.0), (0.5, 0.0), (1.0, 1.0), (0.7, 2.0)] {
        pairs.push(KnownFactor {
            label: format!("element to a disc of radius {r}, {away} off its axis"),
            spec: shapes::element_and_disc(r, away),
            group: |surface| surface.min(1),
            from: 0,
            to: 1,
            truth: closed_forms::element_to_disc(r, away),
            periods: [0.0; 2],
        });
    }
    pairs
}

fn annuli() -> Vec<KnownFactor> {
    let ring = |r1: f64, [r2, r3]: [f64; 2]| KnownFactor {
        label: format!("disc of radius {r1} to the annulus {r2} … {r3}"),
        spec: shapes::disc_and_annulus(r1, [r2, r3]),
        group: |surface| surface / shapes::SECTORS,
        from: 0,
        to: 2,
        truth: closed_forms::disc_to_annulus(r1, [r2, r3]),
        periods: [0.0; 2],
    };
    vec![ring(1.0, [0.5, 1.0]), ring(0.5, [1.0, 3.0])]
}
