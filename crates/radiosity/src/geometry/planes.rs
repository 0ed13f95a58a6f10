//! The linear bases of patches that are groups of cells, and what arrivals look up to score with slopes in scenes that have groups.
//!
//! x is a place on the group, o its centroid, e₁ and e₂ the two principal axes along which it extends most: those of the plane that fits it
//! best. With S_k the largest |(x − o)·e_k| on the group,
//!
//! ψ_k(x) = (x − o)·e_k / S_k.
//!
//! Principal axes are those along which coordinates have no covariance, so that ψ₁ and ψ₂ are orthogonal to 1 and to each other over the
//! area, however the group is bent. A patch of one cell has the basis of its cell (`basis.rs`).
//!
//! On a piece ψ_k is a linear function of the local coordinates of the surface. A table has its three coefficients for each piece: one
//! look-up, as for leaves.

use glam::DVec3;

use super::axes::{Covariance, outer_square, principal_axes};
use super::basis::{self, LinearBasis};
use super::face::{Face, Faces};
use super::spec::Shape;
use super::surface::Surface;
use crate::simd::real::Real;
use crate::simd::table::Table;

/// An axis along which the variance is below this part of the largest one is not known, and its ψ is left out.
const NARROW: f64 = 1.0 / (1_u64 << 40) as f64;

/// The linear bases of a scene whose patches are groups of cells.
#[derive(Clone, Debug)]
pub(crate) struct Planes {
    /// By piece, (ψ + 1)/2 of both functions as c + c_u·u + c_v·v: c, c_u, c_v of the first, then of the second, and 0s.
    rows: Table<8>,
    /// By patch.
    bases: Vec<LinearBasis>,
    /// By patch.
    bodies: Vec<Body>,
}

/// How the area of a patch is spread, and what its linear fit says of the light there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// The covariance of the places on the patch, over its area [m²].
    pub covariance: Covariance,
    /// By gradient of a linear fit ([`crate::Slopes`]), the mean over the patch of its function times the place, from the centroid on [m].
    pub arms: [DVec3; 2],
}

/// The basis of one patch, on the way to the tables.
struct Plane {
    basis: LinearBasis,
    body: Body,
    /// The centroid of a group in the coordinates of the file [m], and by function e_k/S_k [1/m]; `None` of a single cell.
    group: Option<(DVec3, [DVec3; 2])>,
}

impl Planes {
    /// The bases of all patches; `None` of a scene without groups.
    pub(crate) fn new(surfaces: &[Surface], faces: &Faces) -> Option<Self> {
        let partition = faces.partition()?;
        let shapes: Vec<&Shape> = faces.shapes().collect();
        let mut rows = vec![[0.0; 8]; faces.piece_count()];
        let (mut bases, mut bodies) = (Vec::new(), Vec::new());
        for patch in 0..faces.patch_count() as u32 {
            // The number of a patch is that of its front.
            let fronts: Vec<(u32, Face)> =
                partition.pieces(patch).iter().map(|&piece| (piece, faces.piece(piece))).collect();
            let plane = Plane::of(faces, patch, &fronts);
            for (piece, front) in &fronts {
                rows[*piece as usize] = plane.row(surfaces, &shapes, front);
            }
            bases.push(plane.basis);
            bodies.push(plane.body);
        }
        for (back, front) in faces.backs_of_cells() {
            rows[back as usize] = rows[front as usize];
        }
        Some(Planes { rows: Table::new(rows), bases, bodies })
    }

    /// What the tables take of memory [bytes].
    pub(crate) fn bytes(&self) -> usize {
        self.rows.bytes() + size_of_val(&self.bases[..]) + size_of_val(&self.bodies[..])
    }

    /// The basis of a patch.
    pub(crate) fn basis(&self, patch: u32) -> LinearBasis {
        self.bases[patch as usize]
    }

    /// How the area of a patch is spread.
    pub(crate) fn body(&self, patch: u32) -> Body {
        self.bodies[patch as usize]
    }

    /// The steps of the basis functions that hold points of pieces, given by the local coordinates of their surfaces.
    #[inline(always)]
    pub(crate) fn steps<R: Real>(&self, pieces: &[u32], [u, v]: [R; 2]) -> [R; 2] {
        let [c, c_u, c_v, d, d_u, d_v, ..] = R::rows(&self.rows, pieces);
        basis::steps_of([c + c_u * u + c_v * v, d + d_u * u + d_v * v])
    }

    /// ψ₁ and ψ₂ at a point of a piece, in units.
    pub(crate) fn slopes_at(&self, piece: u32, uv: [f64; 2]) -> [i32; 2] {
        self.steps(&[piece], uv).map(|step| basis::of_step(step as u32))
    }

    /// ψ₁ and ψ₂ at a point of a piece.
    pub(crate) fn at(&self, piece: u32, [u, v]: [f64; 2]) -> [f64; 2] {
        let [c, c_u, c_v, d, d_u, d_v, ..] = *self.rows.row(piece);
        [c + c_u * u + c_v * v, d + d_u * u + d_v * v].map(|half| 2.0 * half - 1.0)
    }
}

impl Body {
    /// The body of a cell with these corners.
    pub(crate) fn of_cell(corners: &[DVec3]) -> Self {
        Plane::of_cell(corners).body
    }
}

impl Plane {
    /// The basis of a patch, given the fronts of its cells and their numbers.
    fn of(faces: &Faces, patch: u32, fronts: &[(u32, Face)]) -> Self {
        match fronts {
            [(piece, _)] => Plane::of_cell(&faces.piece_corners(*piece)),
            _ => Plane::of_group(faces, faces.get(patch as usize), fronts),
        }
    }

    /// The basis of a cell with these corners.
    fn of_cell(corners: &[DVec3]) -> Self {
        let is_triangle = corners.len() == 3;
        let centre = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let places = [[0.0, 0.0], [1.0, 0.0], if is_triangle { [0.0, 1.0] } else { [1.0, 1.0] }, [0.0, 1.0]];
        let basis = LinearBasis::of(is_triangle);
        // Of linear functions with the mean 0, the mean of a product over a triangle or a parallelogram is the sum over corners, by 12.
        let arm = |k: usize| {
            let at = corners.iter().zip(places);
            let sum: DVec3 = at.map(|(&corner, place)| psi(place, is_triangle)[k] * (corner - centre)).sum();
            sum / (12.0 * basis.growth[k])
        };
        let mut covariance = [[0.0; 3]; 3];
        corners.iter().for_each(|&corner| add(&mut covariance, outer_square(corner - centre, 1.0 / 12.0)));
        Plane { basis, body: Body { covariance, arms: [arm(0), arm(1)] }, group: None }
    }

    /// The basis of a group: the `face` of these pieces.
    fn of_group(faces: &Faces, face: Face, pieces: &[(u32, Face)]) -> Self {
        let centre = face.centroid;
        let mut covariance = [[0.0; 3]; 3];
        let mut corners = Vec::new();
        for (piece, member) in pieces {
            let own = faces.piece_corners(*piece);
            let share = member.area / face.area;
            add(&mut covariance, outer_square(member.centroid - centre, share));
            own.iter().for_each(|&corner| {
                add(&mut covariance, outer_square(corner - member.centroid, share / 12.0));
            });
            corners.extend(own);
        }
        let axes = principal_axes(covariance);
        let plane = [0, 1].map(|k| {
            let (variance, axis) = axes[k];
            let places = corners.iter().map(|&corner| (corner - centre).dot(axis));
            let (low, high) =
                places.fold((0.0_f64, 0.0_f64), |(low, high), place| (low.min(place), high.max(place)));
            match variance > NARROW * axes[0].0 {
                true => Coordinate::new(axis, variance, [low, high]),
                false => Coordinate::NONE,
            }
        });
        Plane {
            basis: LinearBasis {
                mean_squares: plane.map(|coordinate| coordinate.mean_square),
                growth: plane.map(|coordinate| coordinate.growth),
            },
            body: Body { covariance, arms: plane.map(|coordinate| coordinate.arm) },
            group: Some((centre, plane.map(|coordinate| coordinate.along))),
        }
    }

    /// The row of a piece of the patch.
    fn row(&self, surfaces: &[Surface], shapes: &[&Shape], piece: &Face) -> [f64; 8] {
        let surface = &surfaces[piece.surface as usize];
        let half = |uv: [f64; 2]| match self.group {
            None => {
                let place = surface.place_in_cell(surface.cell_of(piece), uv);
                psi(place, surface.is_triangle()).map(|psi| 0.5 * psi + 0.5)
            }
            Some((centre, along)) => {
                let (corner, e_u, e_v) = shapes[piece.surface as usize].edges();
                let off = (corner - centre) + e_u * uv[0] + e_v * uv[1];
                along.map(|along| 0.5 * off.dot(along) + 0.5)
            }
        };
        let [[c, d], [c_u, d_u], [c_v, d_v]] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(half);
        [c, c_u - c, c_v - c, d, d_u - d, d_v - d, 0.0, 0.0]
    }
}

/// One function ψ of a group.
#[derive(Clone, Copy)]
struct Coordinate {
    /// e_k/S_k [1/m].
    along: DVec3,
    mean_square: f64,
    growth: f64,
    arm: DVec3,
}

impl Coordinate {
    /// No function: ψ is 0. Divided by its infinite mean square, nothing is left of what is scored.
    const NONE: Self =
        Coordinate { along: DVec3::ZERO, mean_square: f64::INFINITY, growth: 0.0, arm: DVec3::ZERO };

    /// The coordinate along an axis, of which a variance and the least and the largest place are known [m², m].
    fn new(axis: DVec3, variance: f64, [low, high]: [f64; 2]) -> Self {
        let reach = high.max(-low);
        Coordinate {
            along: axis / reach,
            mean_square: variance / (reach * reach),
            growth: (high - low) / reach,
            // The covariance matrix times its eigenvector is the vector times the variance.
            arm: axis * (variance / (high - low)),
        }
    }
}

fn add(sum: &mut Covariance, more: Covariance) {
    sum.as_flattened_mut().iter_mut().zip(more.as_flattened()).for_each(|(sum, more)| *sum += more);
}

/// ψ₁ and ψ₂ at a place of a cell.
fn psi(place: [f64; 2], is_triangle: bool) -> [f64; 2] {
    basis::halves(place, is_triangle).map(|half| 2.0 * half - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{IndexChoice, Scene, SceneSpec, SurfaceSpec};

    fn planes(shapes: &[Shape], labels: &[u32]) -> (Scene, Planes) {
        let surface = |shape: &Shape| SurfaceSpec::new(shape.clone(), 0.5).emitting(1.0);
        let spec = SceneSpec::new(shapes.iter().map(surface).collect()).grouped(labels);
        let scene = Scene::build(&spec, IndexChoice::Flat).unwrap();
        let planes = Planes::new(scene.surfaces(), scene.faces()).unwrap();
        (scene, planes)
    }

    /// A parallelogram in cells, and a triangle in rows that goes on from it at an angle.
    fn bent() -> [Shape; 2] {
        let corner = DVec3::new(7.0, 1.0, 0.3);
        let (u, v) = (DVec3::new(1.0, 0.2, 0.0), DVec3::new(0.1, 2.0, 0.4));
        let c = corner + u + DVec3::new(0.3, 0.9, 1.1);
        [
            Shape::parallelogram(corner, u, v, [2, 3]),
            Shape::Triangle { a: corner + u, b: corner + u + v, c, rows: 2 },
        ]
    }

    /// Means over a grid of points of the group, weighted by area: of ψ_k, of ψ_k², of ψ₁·ψ₂, and of ψ_k·x.
    #[test]
    fn the_functions_of_a_bent_group_are_orthogonal() {
        const N: u32 = 60;
        let (scene, planes) = planes(&bent(), &[0; 10]);
        let (mut area, mut sums, mut levers) = (0.0, [0.0; 5], [DVec3::ZERO; 2]);
        let mut largest = [0.0_f64; 2];
        for piece in 0..10 {
            let face = scene.faces().piece(piece);
            let surface = &scene.surfaces()[face.surface as usize];
            for (i, j) in (0..N).flat_map(|i| (0..N).map(move |j| (i, j))) {
                let place = [i, j].map(|i| (f64::from(i) + 0.5) / f64::from(N));
                let uv = surface.point_in_cell(surface.cell_of(&face), place);
                let [a, b] = planes.at(piece, uv);
                let [steps_a, steps_b] = planes.slopes_at(piece, uv).map(|units| f64::from(units) / 4096.0);
                assert!((a - steps_a).abs() < 3e-4 && (b - steps_b).abs() < 3e-4);
                largest = [largest[0].max(a.abs()), largest[1].max(b.abs())];
                area += face.area;
                for (sum, value) in sums.iter_mut().zip([a, b, a * a, b * b, a * b]) {
                    *sum += face.area * value;
                }
                let x = surface.point(uv);
                levers = [levers[0] + face.area * a * x, levers[1] + face.area * b * x];
            }
        }
        assert!(largest.iter().all(|&most| (0.98..1.0).contains(&most)), "{largest:?}");
        let [first, second] = planes.basis(0).mean_squares;
        for (sum, expected) in sums.into_iter().zip([0.0, 0.0, first, second, 0.0]) {
            assert!((sum / area - expected).abs() < 1e-3, "{sums:?} of {area}");
        }
        for (k, lever) in levers.into_iter().enumerate() {
            let (arm, expected) = (planes.body(0).arms[k], lever / area / planes.basis(0).growth[k]);
            assert!((arm - expected).length() < 2e-3, "{arm}, {expected}");
        }
    }

    /// A patch of one cell keeps the basis of its cell, in grids and in triangles.
    #[test]
    fn single_cells_have_their_own_basis() {
        let (scene, planes) = planes(&bent(), &[0, 0, 2, 3, 4, 5, 6, 7, 8, 9]);
        for patch in 1..9_u32 {
            let piece = scene.faces().pieces(patch as usize).next().unwrap();
            let face = scene.faces().piece(piece);
            let surface = &scene.surfaces()[face.surface as usize];
            let cell = surface.cell_of(&face);
            assert_eq!(planes.basis(patch), LinearBasis::of(surface.is_triangle()));
            for place in [[0.1, 0.2], [0.5, 0.4], [0.03, 0.9]] {
                let uv = surface.point_in_cell(cell, place);
                let own = basis::slopes_at(surface.place_in_cell(cell, uv), surface.is_triangle());
                let found = planes.slopes_at(piece, uv);
                assert!((0..2).all(|k| (own[k] - found[k]).abs() <= 2), "{own:?}, {found:?}");
            }
        }
    }

    /// Across a needle nothing is fitted.
    #[test]
    fn a_needle_has_one_function() {
        let needle = Shape::parallelogram(DVec3::ONE, DVec3::X, 1e-7 * DVec3::Y, [2, 1]);
        let (_, planes) = planes(&[needle], &[0, 0]);
        let LinearBasis { mean_squares, growth } = planes.basis(0);
        assert!((mean_squares[0] - 1.0 / 3.0).abs() < 1e-12 && mean_squares[1].is_infinite());
        assert!((growth[0] - 2.0).abs() < 1e-12 && growth[1] == 0.0);
        assert_eq!(planes.at(1, [0.75, 0.9])[1], 0.0);
    }
}
