//! Curved bodies, and plates in a V: spheres, cylinders within each other and beside each other, tubes.

use radiosity::exchange::FactorKind;

use super::{KnownFactor, closed_forms, measure, shapes};
use crate::lab::Lab;
use crate::papers::Findings;

pub(super) fn run(lab: &Lab) -> Findings {
    let pairs: Vec<KnownFactor> =
        [spheres(), coaxial(), tubes(), beside(), plates_in_v()].into_iter().flatten().collect();
    Findings {
        published: "J. R. Howell, *A Catalog of Radiation Heat Transfer Configuration Factors*: spheres to discs and rectangles, \
                    concentric spheres, coaxial cylinders of one length (C-91), the inside of a cylinder (C-78), parallel cylinders and a strip \
                    beside one, plates in a V (C-16, here by quadrature). The formulas are held against quadratures (`closed_forms.rs`)."
            .into(),
        experiment: format!(
            "Walks from the first group of a pair end at their first hit. Spheres have {} triangles, cylinders {} sides: their factors \
             differ from those of round bodies by less than 10⁻⁴ of themselves.",
            20 << (2 * shapes::CUTS),
            shapes::STAVES
        ),
        rows: measure(lab, FactorKind::FirstHit, &pairs),
        ..Findings::default()
    }
}

fn spheres() -> Vec<KnownFactor> {
    let sphere = |surface: u32| u32::from(surface >= 20 << (2 * shapes::CUTS));
    let mut pairs = Vec::new();
    for (r, h, disc) in [(0.5, 1.0, 1.0), (0.9, 1.0, 3.0), (0.2, 2.0, 1.0)] {
        let mut spec = shapes::sphere(r, h);
        spec.surfaces.extend(shapes::disc(0.0, disc, true));
        pairs.push(KnownFactor {
            label: format!("sphere of radius {r} to a disc of radius {disc}, {h} below its centre"),
            spec,
            group: sphere,
            from: 0,
            to: 1,
            truth: closed_forms::sphere_to_corner_or_disc(None, disc / h),
            periods: [0.0; 2],
        });
    }
    for (a, b, h) in [(1.0, 1.0, 1.0), (3.0, 0.5, 0.8)] {
        let mut spec = shapes::sphere(0.5, h);
        spec.surfaces.extend(shapes::opposed(a, b).surfaces.into_iter().take(1));
        pairs.push(KnownFactor {
            label: format!(
                "sphere of radius 0.5 to a rectangle of {a} × {b}, {h} below its centre, a corner below it"
            ),
            spec,
            group: sphere,
            from: 0,
            to: 1,
            truth: closed_forms::sphere_to_corner_or_disc(Some(a / h), b / h),
            periods: [0.0; 2],
        });
    }
    for (r, to) in [(0.5, 0), (0.5, 1), (0.9, 0)] {
        let mut spec = shapes::sphere(r, 0.0);
        spec.surfaces.extend(shapes::icosphere(shapes::CUTS, 0.0).surfaces);
        let what = if to == 0 { "to the inner one" } else { "to itself" };
        pairs.push(KnownFactor {
            label: format!("concentric spheres of radii {r} and 1: the outer one {what}"),
            spec,
            group: sphere,
            from: 1,
            to,
            truth: if to == 0 { r * r } else { 1.0 - r * r },
            periods: [0.0; 2],
        });
    }
    pairs
}

/// The group of cylinders one after the other.
fn cylinder(surface: u32) -> u32 {
    surface / shapes::STAVES
}

fn coaxial() -> Vec<KnownFactor> {
    let mut pairs = Vec::new();
    for (r, h, to) in
        [(2.0, 2.0, 0), (2.0, 2.0, 1), (1.25, 1.0, 0), (1.25, 1.0, 1), (3.0, 10.0, 0), (3.0, 10.0, 1)]
    {
        let mut spec = shapes::cylinder(1.0, h, false);
        spec.surfaces.extend(shapes::cylinder(r, h, true).surfaces);
        let what = if to == 0 { "to the inner one" } else { "to itself" };
        pairs.push(KnownFactor {
            label: format!("coaxial cylinders of radii 1 and {r}, length {h}: the outer one {what}"),
            spec,
            group: cylinder,
            from: 1,
            to,
            truth: closed_forms::coaxial_cylinders(r, h)[to as usize],
            periods: [0.0; 2],
        });
    }
    pairs
}

fn tubes() -> Vec<KnownFactor> {
    let mut pairs = Vec::new();
    for h in [0.5, 2.0, 6.0] {
        let truth = closed_forms::tube_to_itself(h);
        pairs.push(KnownFactor::to_itself(
            format!("tube of radius 1, length {h}"),
            shapes::cylinder(1.0, h, true),
            truth,
        ));
    }
    for h in [0.5, 2.0] {
        let mut spec = shapes::cylinder(1.0, h, true);
        spec.surfaces.extend(shapes::disc(0.0, 1.0, true));
        pairs.push(KnownFactor {
            label: format!("end of a tube of radius 1, length {h}: to its wall"),
            spec,
            group: |surface| cylinder(surface).min(1),
            from: 1,
            to: 0,
            truth: 1.0 - closed_forms::coaxial_discs(1.0 / h, 1.0 / h),
            periods: [0.0; 2],
        });
    }
    pairs
}

fn beside() -> Vec<KnownFactor> {
    let mut pairs = Vec::new();
    for gap in [0.1, 2.0] {
        pairs.push(KnownFactor {
            label: format!("endless cylinders of radius 1, {gap} between them"),
            spec: shapes::endless_cylinders(gap),
            group: cylinder,
            from: 0,
            to: 1,
            truth: closed_forms::parallel_cylinders(gap),
            periods: [0.0; 2],
        });
    }
    for [a, b, l] in [[-1.0, 1.0, 1.5], [0.5, 4.0, 2.0]] {
        pairs.push(KnownFactor {
            label: format!("endless strip {a} … {b} to a cylinder of radius 1, axis {l} above 0"),
            spec: shapes::strip_and_cylinder([a, b], l),
            group: |surface| surface.min(1),
            from: 0,
            to: 1,
            truth: closed_forms::strip_to_cylinder([a, b], l),
            periods: [0.0; 2],
        });
    }
    pairs
}

fn plates_in_v() -> Vec<KnownFactor> {
    let plates = [(30.0_f64, 1.0, 1.0), (60.0, 1.0, 1.0), (60.0, 2.0, 0.5), (135.0, 1.0, 1.0)];
    let pair = |(degrees, w, h): (f64, f64, f64)| {
        let angle = degrees.to_radians();
        let label = format!("plates in a V of {degrees}°, widths {w} to {h}, common edge 1");
        KnownFactor::of_surfaces(
            label,
            shapes::plates(angle, [w, h], 1.0),
            closed_forms::plates_in_v(angle, [w, h]),
        )
    };
    plates.into_iter().map(pair).collect()
}
