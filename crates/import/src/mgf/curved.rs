//! MGF's curved surfaces as facets whose corners lie on the surface.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

/// The facets of one surface: points and the triangles between them, fronts outwards.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct CurvedFacets {
    pub(super) points: Vec<DVec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// The area of the surface that they stand for.
    area: f64,
}

/// The number of sides of a polygon inscribed in a circle, the middles of whose sides lie within the circle by no
/// more than `error` of its radius: 1 − cos(π/n) ≤ error.
pub(super) fn segments(error: f64) -> usize {
    let least = PI / (1.0 - error.clamp(1e-6, 0.5)).acos();
    (least.ceil() as usize).max(4)
}

/// The most triangles of a surface of some kind, if a polygon of n sides stands for a circle.
pub(super) fn most_triangles(keyword: &[u8], n: u64) -> u64 {
    match keyword {
        b"sph" => 2 * n * (n.div_ceil(2) - 1),
        b"torus" => 2 * n * n,
        // Cylinders, cones and rings have two circles.
        _ => 2 * n,
    }
}

impl CurvedFacets {
    fn of_area(area: f64) -> Self {
        CurvedFacets { area, ..CurvedFacets::default() }
    }

    /// The area of the surface in parts of that of its facets, as f32 has it: equal for surfaces of one kind. Emission is so much brighter,
    /// which keeps its power.
    pub(super) fn excess(&self) -> f64 {
        let point = |corner: u32| self.points[corner as usize];
        let area = |&[a, b, c]: &[u32; 3]| 0.5 * (point(b) - point(a)).cross(point(c) - point(a)).length();
        let excess = (self.area / self.triangles.iter().map(area).sum::<f64>()) as f32;
        if excess.is_normal() { excess.into() } else { 1.0 }
    }

    /// The side of a cone between two circles about one axis; a circle may be a point.
    pub(super) fn cone(low: DVec3, low_radius: f64, high: DVec3, high_radius: f64, n: usize) -> Self {
        let (u, v) = across((high - low).normalize());
        let slant = low.distance(high).hypot(high_radius - low_radius);
        let mut facets = CurvedFacets::of_area(PI * (low_radius + high_radius) * slant);
        facets.row(low, u * low_radius, v * low_radius, n);
        facets.row(high, u * high_radius, v * high_radius, n);
        facets.skin(0, n as u32, n as u32);
        facets
    }

    /// A sphere about its centre.
    pub(super) fn sphere(centre: DVec3, radius: f64, n: usize) -> Self {
        let mut facets = CurvedFacets::of_area(4.0 * PI * radius * radius);
        let rows = n.div_ceil(2);
        for row in 0..=rows {
            let (sin, cos) = turn(row, 2 * rows);
            // The poles are points, whatever sin π is rounded to.
            let across = if row == 0 || row == rows { 0.0 } else { radius * sin };
            facets.row(centre - DVec3::Z * (radius * cos), DVec3::X * across, DVec3::Y * across, n);
        }
        (0..rows).for_each(|row| facets.skin((row * n) as u32, ((row + 1) * n) as u32, n as u32));
        facets
    }

    /// A flat ring about an axis, which its front faces; a disk if the inner radius is 0.
    pub(super) fn ring(centre: DVec3, axis: DVec3, inner: f64, outer: f64, n: usize) -> Self {
        let (u, v) = across(axis);
        let mut facets = CurvedFacets::of_area(PI * (outer - inner) * (outer + inner));
        facets.row(centre, u * outer, v * outer, n);
        facets.row(centre, u * inner, v * inner, n);
        facets.skin(0, n as u32, n as u32);
        facets
    }

    /// A torus about an axis, between two radii.
    pub(super) fn torus(centre: DVec3, axis: DVec3, inner: f64, outer: f64, n: usize) -> Self {
        let (u, v) = across(axis);
        let (middle, tube) = (0.5 * (inner + outer), 0.5 * (outer - inner));
        let mut facets = CurvedFacets::of_area(4.0 * PI * PI * middle * tube);
        for row in 0..n {
            let (sin, cos) = turn(row, n);
            let radius = middle + tube * cos;
            facets.row(centre + axis * (tube * sin), u * radius, v * radius, n);
        }
        (0..n).for_each(|row| facets.skin((row * n) as u32, ((row + 1) % n * n) as u32, n as u32));
        facets
    }

    /// A circle of n points from u towards v.
    fn row(&mut self, centre: DVec3, u: DVec3, v: DVec3, n: usize) {
        self.points.extend((0..n).map(|j| {
            let (sin, cos) = turn(j, n);
            centre + u * cos + v * sin
        }));
    }

    /// Joins two rows of n points each; triangles that have shrunk to a line are left out.
    fn skin(&mut self, low: u32, high: u32, n: u32) {
        for (j, next) in (0..n).map(|j| (j, (j + 1) % n)) {
            self.triangle([low + j, low + next, high + next]);
            self.triangle([low + j, high + next, high + j]);
        }
    }

    fn triangle(&mut self, corners: [u32; 3]) {
        let [a, b, c] = corners.map(|corner| self.points[corner as usize]);
        if a != b && b != c && c != a {
            self.triangles.push(corners);
        }
    }
}

/// Two unit vectors that make a right-handed frame with an axis.
fn across(axis: DVec3) -> (DVec3, DVec3) {
    let u = axis.any_orthonormal_vector();
    (u, axis.cross(u))
}

/// Sine and cosine of j/n of a full turn.
fn turn(j: usize, n: usize) -> (f64, f64) {
    (TAU * j as f64 / n as f64).sin_cos()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Volume [m³] within closed facets, positive where fronts face outwards.
    fn volume(facets: &CurvedFacets) -> f64 {
        let point = |corner: u32| facets.points[corner as usize];
        facets.triangles.iter().map(|&[a, b, c]| point(a).dot(point(b).cross(point(c))) / 6.0).sum()
    }

    #[test]
    fn segments_keep_the_error_that_they_promise() {
        assert_eq!(segments(0.0125), 20);
        for error in [0.1, 0.01, 1e-4] {
            let n = segments(error) as f64;
            assert!(1.0 - (PI / n).cos() <= error && 1.0 - (PI / (n - 1.0)).cos() > error);
        }
    }

    #[test]
    fn spheres_and_tori_are_closed_and_face_outwards() {
        let sphere = CurvedFacets::sphere(DVec3::splat(0.3), 2.0, 200);
        assert!((volume(&sphere) / (4.0 / 3.0 * PI * 8.0) - 1.0).abs() < 1e-3);
        assert_eq!(CurvedFacets::sphere(DVec3::ZERO, 1.0, 20).triangles.len(), 20 * 2 * 9);
        let torus = CurvedFacets::torus(DVec3::ZERO, DVec3::Z, 1.0, 3.0, 200);
        assert!((volume(&torus) / (2.0 * PI * PI * 2.0) - 1.0).abs() < 1e-3);
    }

    #[test]
    fn facets_know_how_much_larger_their_surfaces_are() {
        let cylinder = CurvedFacets::cone(DVec3::ZERO, 2.0, DVec3::Z * 3.0, 2.0, 20);
        let ring = CurvedFacets::ring(DVec3::ZERO, DVec3::Z, 1.0, 3.0, 20);
        assert!((cylinder.excess() / (PI / 20.0 / (PI / 20.0).sin()) - 1.0).abs() < 1e-6);
        assert!((ring.excess() / (TAU / 20.0 / (TAU / 20.0).sin()) - 1.0).abs() < 1e-6);
        let cone = CurvedFacets::cone(DVec3::ZERO, 1.0, DVec3::Z * 3.0, 0.0, 2000);
        let torus = CurvedFacets::torus(DVec3::ZERO, DVec3::Z, 1.0, 3.0, 500);
        let sphere = CurvedFacets::sphere(DVec3::ZERO, 2.0, 500);
        for facets in [cone, torus, sphere] {
            assert!((1.0..1.0001).contains(&facets.excess()), "{}", facets.excess());
        }
    }

    #[test]
    fn cones_face_outwards_and_rings_along_their_axis() {
        let cone = CurvedFacets::cone(DVec3::ZERO, 1.0, DVec3::Z * 3.0, 0.0, 200);
        let lid = CurvedFacets::ring(DVec3::ZERO, -DVec3::Z, 0.0, 1.0, 200);
        assert!((volume(&cone) + volume(&lid) - PI).abs() < 1e-2);
        assert_eq!((cone.triangles.len(), lid.triangles.len()), (200, 200));
    }
}
