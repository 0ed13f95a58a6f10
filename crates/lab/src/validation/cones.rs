//! Cavities of revolution, rings between cylinders, rectangles at right angles anywhere, spheres seen by elements, and cells that repeat.

use std::f64::consts::FRAC_PI_3;

use radiosity::{SceneSpec, exchange::FactorKind};

use super::{KnownFactor, closed_forms, measure, shapes};
use crate::lab::Lab;
use crate::papers::Findings;

pub(super) fn run(lab: &Lab) -> Findings {
    let pairs: Vec<KnownFactor> = [bowls(), frusta(), tubes(), rings(), spheres(), rectangles(), cells()]
        .into_iter()
        .flatten()
        .collect();
    Findings {
        published: "J. R. Howell, *A Catalog of Radiation Heat Transfer Configuration Factors*: perpendicular rectangles anywhere (C-15), \
                    elements to spheres (class B), and by the algebra of factors from C-41, C-78 and C-91 the insides of frusta, rings of a \
                    tube and the ends of coaxial cylinders; a plane before a row of tubes (Hottel). The formulas are held against each other \
                    and their limits (`closed_forms.rs`)."
            .into(),
        experiment: format!(
            "Walks from the first group of a pair end at their first hit. Bodies of revolution have {} sides, parts of spheres 64 rings of \
             them; their factors differ from those of round bodies by less than 2·10⁻⁴ of themselves. A cell that repeats (`--periodic`) \
             stands for what is endless.",
            shapes::STAVES
        ),
        rows: measure(lab, FactorKind::FirstHit, &pairs),
        ..Findings::default()
    }
}

/// A factor from one band of a path that is turned to another.
fn of_bands(label: String, path: [&[[f64; 2]]; 2], [from, to]: [u32; 2], truth: f64) -> KnownFactor {
    let spec = SceneSpec::new(path.into_iter().flat_map(shapes::bands).collect());
    KnownFactor { label, spec, group: |surface| surface / shapes::BAND, from, to, truth, periods: [0.0; 2] }
}

fn bowls() -> Vec<KnownFactor> {
    let mut pairs = Vec::new();
    for height in [1.0, 0.5, 1.6] {
        let cavity = format!("part of a sphere of radius 1, height {height}");
        pairs.push(KnownFactor::to_itself(
            cavity,
            shapes::bowl(height),
            closed_forms::bowl_to_itself(height),
        ));
    }
    for h in [1.0, 3.0] {
        let cone = SceneSpec::new(shapes::bands(&[[1.0, h], [0.0, 0.0]]).collect());
        let cavity = format!("cone of height {h} on a base of radius 1");
        pairs.push(KnownFactor::to_itself(cavity, cone, closed_forms::cone_to_itself(h)));
    }
    pairs
}

fn frusta() -> Vec<KnownFactor> {
    let mut pairs = Vec::new();
    for (radii, place) in [([1.0, 0.5], 0), ([1.0, 0.5], 2), ([0.3, 2.0], 1), ([0.3, 2.0], 2)] {
        let [r1, r2] = radii;
        // The end is the second group, of half as many triangles.
        let (what, from, to) =
            [("end to wall", 1, 0), ("wall to end", 0, 1), ("wall to itself", 0, 0)][place];
        pairs.push(of_bands(
            format!("frustum of height 1, radii {r1} and {r2}: {what}"),
            [&[[r2, 1.0], [r1, 0.0]], &[[r1, 0.0], [0.0, 0.0]]],
            [from, to],
            closed_forms::frustum(radii)[place],
        ));
    }
    pairs
}

fn tubes() -> Vec<KnownFactor> {
    let mut pairs = Vec::new();
    for ([a, b], gap) in [([1.0, 1.0], 0.0), ([0.5, 2.0], 0.0), ([1.0, 1.0], 1.0)] {
        pairs.push(of_bands(
            format!("tube of radius 1: from {a} of its length to {b}, {gap} away"),
            [&[[1.0, a], [1.0, 0.0]], &[[1.0, a + gap + b], [1.0, a + gap]]],
            [0, 1],
            closed_forms::tube_rings([a, b], gap),
        ));
    }
    let end: [[f64; 2]; 2] = [[1.0, 0.0], [0.0, 0.0]];
    let truth = 0.5 * (1.0 - closed_forms::tube_to_itself(1.0));
    let label = "tube of radius 1, length 1: its wall to an end".into();
    pairs.push(of_bands(label, [&[[1.0, 1.0], [1.0, 0.0]], &end], [0, 1], truth));
    pairs
}

/// Groups: the inner cylinder, the outer one, the lower ring, the upper one.
fn rings() -> Vec<KnownFactor> {
    let mut pairs = Vec::new();
    for (r, h) in [(2.0, 2.0), (1.25, 1.0)] {
        let known = closed_forms::rings(r, h);
        for (what, [from, to], truth) in [
            ("inner to a ring", [0, 2], known.inner_to_ring),
            ("outer to a ring", [1, 3], known.outer_to_ring),
            ("ring to inner", [2, 0], known.ring_to_inner),
            ("ring to outer", [3, 1], known.ring_to_outer),
            ("ring to ring", [2, 3], known.ring_to_ring),
        ] {
            let label = format!("coaxial cylinders of radii 1 and {r}, length {h}, closed by rings: {what}");
            let walls: Vec<[[f64; 2]; 2]> =
                vec![[[1.0, 0.0], [1.0, h]], [[r, h], [r, 0.0]], [[r, 0.0], [1.0, 0.0]], [[1.0, h], [r, h]]];
            let spec = SceneSpec::new(walls.iter().flat_map(|wall| shapes::bands(wall)).collect());
            let group = |surface| surface / shapes::BAND;
            pairs.push(KnownFactor { label, spec, group, from, to, truth, periods: [0.0; 2] });
        }
    }
    pairs
}

fn spheres() -> Vec<KnownFactor> {
    let sphere = |surface: u32| u32::from(surface >= 20 << (2 * shapes::CUTS));
    let mut pairs = Vec::new();
    for (r, h) in [(0.5, 1.0), (0.4, 0.5)] {
        let mut spec = shapes::sphere(r, 0.0);
        spec.surfaces.extend(shapes::bands(&[[1.0, h], [1.0, -h]]));
        pairs.push(KnownFactor {
            label: format!(
                "sphere of radius {r} in the middle of a tube of radius 1, length {}: to the tube",
                2.0 * h
            ),
            spec,
            group: sphere,
            from: 0,
            to: 1,
            truth: closed_forms::sphere_to_tube(1.0, h),
            periods: [0.0; 2],
        });
    }
    for (r, [x, z]) in [(0.5, [0.0, 1.0]), (0.5, [1.0, 1.0]), (0.9, [2.0, 1.0])] {
        pairs.push(KnownFactor {
            label: format!("element to a sphere of radius {r}, {z} above and {x} aside"),
            spec: shapes::element_and_sphere(r, [x, z]),
            group: |surface| surface.min(1),
            from: 0,
            to: 1,
            truth: closed_forms::element_to_sphere(r, [x, z]),
            periods: [0.0; 2],
        });
    }
    pairs
}

fn rectangles() -> Vec<KnownFactor> {
    let mut pairs = Vec::new();
    for (what, floor, wall) in [
        ("square, to one at its side", [[0.0, 1.0], [0.0, 1.0]], [[1.0, 2.0], [0.0, 1.0]]),
        ("square, to one of 2 × 1 above its middle", [[0.5, 1.5], [0.0, 1.0]], [[-0.5, 1.5], [0.5, 1.5]]),
        ("0.5 × 2, to a square aside and above", [[0.2, 0.7], [0.0, 2.0]], [[2.5, 3.5], [0.3, 1.3]]),
    ] {
        let truth = closed_forms::floor_to_wall(floor, wall);
        let label = format!("at a right angle: {what}");
        pairs.push(KnownFactor::of_surfaces(label, shapes::floor_and_wall(floor, wall), truth));
    }
    pairs
}

/// A cell of what is endless.
fn cells() -> Vec<KnownFactor> {
    let surfaces = |label: &str, spec, truth, periods| KnownFactor {
        periods,
        ..KnownFactor::of_surfaces(format!("cell that repeats: {label}"), spec, truth)
    };
    let mut pairs = vec![
        surfaces(
            "strips of width 1 at distance 1",
            shapes::opposed(1.0, 0.7),
            closed_forms::strips(1.0),
            [0.0, 0.7],
        ),
        surfaces(
            "plates in a V of 60°",
            shapes::plates(FRAC_PI_3, [1.0; 2], 1.0),
            closed_forms::wedge(FRAC_PI_3),
            [0.0, 1.0],
        ),
        surfaces("floor to slats of 0.8 at steps of 1.5", shapes::floor_and_slat(0.8), 0.8 / 1.5, [1.5, 1.0]),
        KnownFactor {
            to: 4,
            ..surfaces(
                "street, walls of height 1.5, floor to the sky",
                shapes::piece_of_street(1.5, 0.8),
                closed_forms::strips(1.5),
                [1.4, 0.8],
            )
        },
        KnownFactor {
            from: 1,
            to: 2,
            // Walls of height h at distance 1 are strips of width 1 at distance 1/h.
            ..surfaces(
                "street, walls of height 0.7, wall to wall",
                shapes::piece_of_street(0.7, 2.0),
                closed_forms::strips(1.0 / 0.7),
                [1.2, 2.0],
            )
        },
    ];
    for d in [0.5, 0.8] {
        let label = format!("plane to a row of tubes of diameter {d} at steps of 1");
        let tubes =
            surfaces(&label, shapes::plane_and_tube(0.5 * d), closed_forms::plane_to_tubes(d), [1.0; 2]);
        pairs.push(KnownFactor { group: |surface| surface.min(1), ..tubes });
    }
    for (to, what, truth) in [(0, "the inner one", 0.4), (1, "itself", 0.6)] {
        let label = format!("coaxial cylinders of radii 1 and 2.5, the outer one to {what}");
        let pair = surfaces(&label, shapes::pieces_of_coaxial_cylinders(2.5), truth, [0.0, 1.0]);
        pairs.push(KnownFactor { group: |surface| surface / shapes::STAVES, from: 1, to, ..pair });
    }
    pairs
}
