//! Triangle meshes: closed bodies that face outwards, and two-sided sheets.

use std::f64::consts::TAU;

use glam::{DMat3, DVec3};
use radiosity::{Shape, SurfaceSpec};

use crate::material::SceneMaterial;

/// The step to which vertices are rounded [m]: exact in 32-bit floating point up to 64 m from the origin.
const STEP: f64 = 1.0 / (1 << 18) as f64;

/// Triangles with their materials.
#[derive(Clone, Debug, Default)]
pub(crate) struct ObjMesh {
    triangles: Vec<([DVec3; 3], SceneMaterial)>,
    /// Names of objects, each with the number of its first triangle.
    objects: Vec<(usize, String)>,
}

impl ObjMesh {
    pub(crate) fn triangle(&mut self, [a, b, c]: [DVec3; 3], material: SceneMaterial) {
        // A ring that has shrunk to a point leaves triangles without area.
        if a != b && b != c && c != a {
            self.triangles.push(([a, b, c], material));
        }
    }

    /// Two triangles over the corners of a quadrangle, counter-clockwise seen from its front.
    pub(crate) fn quadrangle(&mut self, [a, b, c, d]: [DVec3; 4], material: SceneMaterial) {
        self.triangle([a, b, c], material);
        self.triangle([a, c, d], material);
    }

    /// Adds a mesh, turned about the z axis by `turn` [rad], then moved by `to`.
    pub(crate) fn add(&mut self, mesh: ObjMesh, to: DVec3, turn: f64) {
        let first = self.triangles.len();
        self.objects.extend(mesh.objects.into_iter().map(|(triangle, name)| (first + triangle, name)));
        let rotation = DMat3::from_rotation_z(turn);
        let place = |corner: DVec3| rotation * corner + to;
        self.triangles
            .extend(mesh.triangles.into_iter().map(|(corners, material)| (corners.map(place), material)));
    }

    /// Makes all of the mesh one object.
    pub(crate) fn named(self, name: impl Into<String>) -> Self {
        ObjMesh { objects: vec![(0, name.into())], ..self }
    }

    /// Joins rings of the same number of points, counter-clockwise about the way from the first ring to the last, by a
    /// skin that faces outwards. A ring may repeat one point: there the skin closes.
    pub(crate) fn skin(&mut self, rings: &[Vec<DVec3>], material: SceneMaterial) {
        for pair in rings.windows(2) {
            let (low, high) = (&pair[0], &pair[1]);
            for (j, next) in (0..low.len()).map(|j| (j, (j + 1) % low.len())) {
                self.quadrangle([low[j], low[next], high[next], high[j]], material);
            }
        }
    }

    /// A two-sided sheet over rows of points.
    pub(crate) fn sheet(&mut self, rows: &[Vec<DVec3>], material: SceneMaterial) {
        for pair in rows.windows(2) {
            for j in 1..pair[0].len() {
                self.quadrangle(
                    [pair[0][j - 1], pair[0][j], pair[1][j], pair[1][j - 1]],
                    material.two_sided(),
                );
            }
        }
    }

    /// A box between two corners.
    pub(crate) fn cuboid(&mut self, min: DVec3, max: DVec3, material: SceneMaterial) {
        let ring = |z: f64| {
            [[min.x, min.y], [max.x, min.y], [max.x, max.y], [min.x, max.y]]
                .map(|[x, y]| DVec3::new(x, y, z))
                .to_vec()
        };
        let (bottom, top) = (ring(min.z), ring(max.z));
        self.quadrangle([bottom[0], bottom[3], bottom[2], bottom[1]], material);
        self.quadrangle([top[0], top[1], top[2], top[3]], material);
        self.skin(&[bottom, top], material);
    }

    /// A body of revolution about the z axis. The profile (radius, z) runs counter-clockwise, seen with the
    /// axis on the left: up on the outside; it begins and ends on the axis.
    pub(crate) fn lathe(&mut self, profile: &[[f64; 2]], segments: u32, material: SceneMaterial) {
        let rings: Vec<Vec<DVec3>> = profile
            .iter()
            .map(|&[radius, z]| ring(DVec3::Z * z, DVec3::X * radius, DVec3::Y * radius, segments))
            .collect();
        self.skin(&rings, material);
    }

    /// A closed tube round a path, with a radius for each of its points.
    pub(crate) fn tube(
        &mut self,
        path: &[DVec3],
        radius: impl Fn(usize) -> f64,
        sides: u32,
        material: SceneMaterial,
    ) {
        let last = path.len() - 1;
        let tangent = |i: usize| (path[(i + 1).min(last)] - path[i.saturating_sub(1)]).normalize();
        // The vector is carried along the path, so that rings do not twist.
        let mut across = tangent(0).any_orthonormal_vector();
        let point = |at: DVec3| vec![at; sides as usize];
        let mut rings = vec![point(path[0])];
        for (i, &at) in path.iter().enumerate() {
            let along = tangent(i);
            across = (across - along * across.dot(along)).normalize();
            rings.push(ring(at, across * radius(i), along.cross(across) * radius(i), sides));
        }
        rings.push(point(path[last]));
        self.skin(&rings, material);
    }

    /// A body |x/a|^(2/e) + |y/b|^(2/e) … = 1 with half axes `size`: a ball for roundness e = 1, a cushion below.
    pub(crate) fn cushion(&mut self, size: DVec3, roundness: f64, segments: u32, material: SceneMaterial) {
        let power = |x: f64| x.signum() * x.abs().powf(roundness);
        let levels = (segments / 2).max(2);
        let rings: Vec<Vec<DVec3>> = (0..=levels)
            .map(|level| {
                let (sin, cos) = (0.5 * TAU * f64::from(level) / f64::from(levels)).sin_cos();
                // The poles are points, whatever sin π is rounded to.
                let radius = if level == 0 || level == levels { 0.0 } else { power(sin) };
                (0..segments)
                    .map(|j| {
                        let (y, x) = (TAU * f64::from(j) / f64::from(segments)).sin_cos();
                        size * DVec3::new(radius * power(x), radius * power(y), -power(cos))
                    })
                    .collect()
            })
            .collect();
        self.skin(&rings, material);
    }

    /// The number of triangles.
    pub(crate) fn len(&self) -> usize {
        self.triangles.len()
    }

    /// The names of objects, each with the number of its first triangle, in ascending order.
    pub(crate) fn objects(&self) -> &[(usize, String)] {
        &self.objects
    }

    /// The triangles with rounded corners.
    pub(crate) fn rounded(&self) -> impl Iterator<Item = ([DVec3; 3], SceneMaterial)> {
        // Adding 0 turns −0 into 0.
        let snap = |corner: DVec3| (corner / STEP).round() * STEP + DVec3::ZERO;
        self.triangles.iter().map(move |&(corners, material)| (corners.map(snap), material))
    }

    /// One surface of one patch for each triangle.
    pub(crate) fn into_surfaces(self) -> Vec<SurfaceSpec> {
        let surface = |([a, b, c], material): ([DVec3; 3], SceneMaterial)| {
            material.surface(Shape::Triangle { a, b, c, rows: 1 })
        };
        self.rounded().map(surface).collect()
    }
}

/// Points of an ellipse with half axes u and v, from u towards v.
fn ring(centre: DVec3, u: DVec3, v: DVec3, segments: u32) -> Vec<DVec3> {
    (0..segments)
        .map(|j| {
            let (sin, cos) = (TAU * f64::from(j) / f64::from(segments)).sin_cos();
            centre + u * cos + v * sin
        })
        .collect()
}
