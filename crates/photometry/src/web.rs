//! Planes of a file, completed to a table by the symmetry of the luminaire.

/// The symmetry by which the planes of a file stand for all planes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Symmetry {
    /// All directions are given.
    None,
    /// About the vertical axis.
    Axial,
    /// About the plane C0–C180.
    C0,
    /// About the plane C90–C270.
    C90,
    /// About both planes.
    Quadrants,
    /// Type A or B: about the plane of the horizontal angle 0.
    Lateral,
}

impl Symmetry {
    /// The symmetry in words.
    pub fn words(self) -> &'static str {
        match self {
            Symmetry::None => "none",
            Symmetry::Axial => "about the vertical axis",
            Symmetry::C0 => "about the plane C0–C180",
            Symmetry::C90 => "about the plane C90–C270",
            Symmetry::Quadrants => "about the planes C0–C180 and C90–C270",
            Symmetry::Lateral => "about the plane of the horizontal angle 0",
        }
    }
}

/// An angle C [°] with the intensities of its plane.
pub(crate) type CPlane = (f64, Vec<f64>);

/// The planes of the full circle, from the first to the same 360° on.
pub(crate) fn complete(mut planes: Vec<CPlane>, symmetry: Symmetry) -> Vec<CPlane> {
    match symmetry {
        Symmetry::Axial => {
            planes.truncate(1);
            planes[0].0 = 0.0;
        }
        Symmetry::C0 => reflect(&mut planes, 360.0),
        Symmetry::C90 => reflect(&mut planes, 180.0),
        Symmetry::Quadrants => {
            reflect(&mut planes, 180.0);
            reflect(&mut planes, 360.0);
        }
        Symmetry::None | Symmetry::Lateral => {}
    }
    // Where a file has both 0° and 360°, both stay.
    let closed = planes.last().is_some_and(|last| last.0 - planes[0].0 == 360.0);
    if !closed {
        for plane in &mut planes {
            plane.0 = plane.0.rem_euclid(360.0);
        }
        planes.sort_by(|a, b| a.0.total_cmp(&b.0));
        planes.dedup_by(|a, b| a.0 == b.0);
        let first = planes[0].clone();
        planes.push((first.0 + 360.0, first.1));
    }
    planes
}

/// Adds to every plane at C the one at `sum` − C, unless that is there.
fn reflect(planes: &mut Vec<CPlane>, sum: f64) {
    for index in 0..planes.len() {
        let (from, to) = (planes[index].0.rem_euclid(360.0), (sum - planes[index].0).rem_euclid(360.0));
        if from != to {
            let row = planes[index].1.clone();
            planes.push((to, row));
        }
    }
    // A stable order: of two planes at one angle the measured one stays.
    planes.iter_mut().for_each(|plane| plane.0 = plane.0.rem_euclid(360.0));
    planes.sort_by(|a, b| a.0.total_cmp(&b.0));
    planes.dedup_by(|a, b| a.0 == b.0);
}
