//! MGF's surfaces: polygons, prisms and curved ones.

use glam::DVec3;

use super::context::Vertex;
use super::curved::{self, CurvedFacets};
use super::{MATERIAL_STEPS, MgfReader};
use crate::error::UnplacedError;
use crate::mesh::Triangle;
use crate::room::room;
use crate::text::number;

/// Cutting a polygon of n corners takes about n² steps, divided by this.
const CORNERS_A_STEP: u64 = 16;

impl MgfReader<'_, '_> {
    /// Reads a surface of any kind.
    pub(super) fn surface(
        &mut self,
        keyword: &[u8],
        arguments: &[&[u8]],
        line: u32,
    ) -> Result<(), UnplacedError> {
        let (part, face) = self.parts.next_face(&mut self.mesh, &self.stem);
        let is_flat = matches!(keyword, b"f" | b"fh" | b"prism");
        // Curved surfaces find theirs once their areas are known.
        let material = if is_flat { self.material_number() } else { 0 };
        let triangle = |corners| Triangle { corners, part, face, material, line };
        match keyword {
            b"f" | b"fh" => self.polygon(arguments, &triangle),
            b"prism" => self.prism(arguments, &triangle),
            _ => self.curved(keyword, arguments, &triangle),
        }
    }

    /// A polygon; `-` stands before the outline of each hole.
    fn polygon(
        &mut self,
        arguments: &[&[u8]],
        triangle: &impl Fn([u32; 3]) -> Triangle,
    ) -> Result<(), UnplacedError> {
        let (mut points, mut holes) = (Vec::new(), Vec::new());
        for &argument in arguments {
            match argument {
                b"-" => holes.push(points.len()),
                name => points.push(self.vertices.get("vertex", name)?.point),
            }
        }
        self.outline(&points, &holes, triangle)
    }

    /// Adds the triangles of a polygon in the coordinates of its statement.
    fn outline(
        &mut self,
        points: &[DVec3],
        holes: &[usize],
        triangle: &impl Fn([u32; 3]) -> Triangle,
    ) -> Result<(), UnplacedError> {
        let outer = holes.first().copied().unwrap_or(points.len());
        let rings = holes.iter().zip(holes.iter().skip(1).copied().chain([points.len()]));
        if outer < 3 || rings.clone().any(|(&start, end)| end < start + 3) {
            return Err(UnplacedError::new(
                "an outline of less than three corners",
                "it has no area",
                "complete the line",
            ));
        }
        let n = points.len() as u64;
        self.allowance.steps(n * n / CORNERS_A_STEP)?;
        // n corners and h holes make n − 2 + 2h triangles.
        self.allowance.triangles(n + 2 * holes.len() as u64 - 2)?;
        let first = self.place_points(points)?;
        let corners: Vec<u32> = (first..first + points.len() as u32).collect();
        let start = self.mesh.triangles.len();
        self.tally.polygon(&mut self.mesh, &corners, holes, triangle)?;
        self.turn_mirrored(start);
        Ok(())
    }

    /// Adds points where the open transforms put them; returns the number of the first.
    fn place_points(&mut self, points: &[DVec3]) -> Result<u32, UnplacedError> {
        let first = self.mesh.positions.len() as u32;
        self.mesh.positions.extend(points.iter().map(|&point| self.place.transform_point3(point)));
        if self.mesh.positions[first as usize..].iter().all(|position| position.is_finite()) {
            return Ok(first);
        }
        Err(UnplacedError::new(
            "a point is not a finite number",
            "the transforms put it nowhere",
            "correct them",
        ))
    }

    /// Reverses triangles if the open transforms mirror them, so that fronts stay fronts.
    fn turn_mirrored(&mut self, start: usize) {
        if self.place.matrix3.determinant() < 0.0 {
            self.mesh.triangles[start..].iter_mut().for_each(|triangle| triangle.corners.swap(1, 2));
        }
    }

    /// A closed right prism: the polygon, its copy moved against its normal by the length, and the sides between. All
    /// faces point outwards, or inwards if the length is negative.
    fn prism(
        &mut self,
        arguments: &[&[u8]],
        triangle: &impl Fn([u32; 3]) -> Triangle,
    ) -> Result<(), UnplacedError> {
        let Some((length, names)) = arguments.split_last() else {
            return Err(UnplacedError::new(
                "a prism of nothing",
                "it has a base and a length",
                "complete the line",
            ));
        };
        let length = number(Some(length))?;
        let mut base = Vec::new();
        for name in names {
            base.push(self.vertices.get("vertex", name)?.point);
        }
        let Some(normal) = crate::polygon::normal(&base).filter(|_| base.len() >= 3 && length != 0.0) else {
            return Err(UnplacedError::new(
                "the prism has no volume",
                "its base or its length is 0",
                "correct it",
            ));
        };
        let moved: Vec<DVec3> = base.iter().map(|&point| point - normal * length).collect();
        self.outline(&base, &[], triangle)?;
        let reversed: Vec<DVec3> = moved.iter().rev().copied().collect();
        self.outline(&reversed, &[], triangle)?;
        for (i, next) in (0..base.len()).map(|i| (i, (i + 1) % base.len())) {
            self.outline(&[base[next], base[i], moved[i], moved[next]], &[], triangle)?;
        }
        Ok(())
    }

    fn curved(
        &mut self,
        keyword: &[u8],
        arguments: &[&[u8]],
        triangle: &impl Fn([u32; 3]) -> Triangle,
    ) -> Result<(), UnplacedError> {
        let n = self.segments;
        self.allowance.triangles(curved::most_triangles(keyword, n as u64))?;
        let vertex = |i: usize| self.vertices.get("vertex", arguments.get(i).copied().unwrap_or_default());
        let radius = |i: usize| number(arguments.get(i).copied());
        let (facets, inwards) = match keyword {
            b"sph" => {
                let radius = radius(1)?;
                (CurvedFacets::sphere(vertex(0)?.point, radius.abs(), n), radius < 0.0)
            }
            b"cyl" => cone(vertex(0)?, radius(1)?, vertex(2)?, radius(1)?, n)?,
            b"cone" => cone(vertex(0)?, radius(1)?, vertex(2)?, radius(3)?, n)?,
            b"ring" => {
                let [inner, outer] = in_order(radius(1)?, radius(2)?)?;
                let vertex = vertex(0)?;
                (
                    CurvedFacets::ring(vertex.point, axis(vertex.normal)?, inner.abs(), outer.abs(), n),
                    outer < 0.0,
                )
            }
            _ => {
                let [inner, outer] = in_order(radius(1)?, radius(2)?)?;
                let vertex = vertex(0)?;
                (
                    CurvedFacets::torus(vertex.point, axis(vertex.normal)?, inner.abs(), outer.abs(), n),
                    outer < 0.0,
                )
            }
        };
        let first = self.place_points(&facets.points)?;
        let start = self.mesh.triangles.len();
        self.mesh.triangles.extend(facets.triangles.iter().map(|corners| {
            let [a, b, c] = corners.map(|corner| first + corner);
            triangle(if inwards { [a, c, b] } else { [a, b, c] })
        }));
        let material = match self.materials.current().ed.amount > 0.0 {
            true => {
                self.allowance.steps(MATERIAL_STEPS)?;
                self.number_of(facets.excess())
            }
            false => self.material_number(),
        };
        self.mesh.triangles[start..].iter_mut().for_each(|triangle| triangle.material = material);
        self.facets += facets.triangles.len() as u64;
        self.turn_mirrored(start);
        room(&self.mesh)
    }
}

/// The unit vector of a normal.
fn axis(normal: DVec3) -> Result<DVec3, UnplacedError> {
    normal.try_normalize().ok_or_else(|| {
        UnplacedError::new("the vertex has no normal", "the surface turns about it", "give it one with `n`")
    })
}

/// Two radii of one sign, the smaller one first.
fn in_order(inner: f64, outer: f64) -> Result<[f64; 2], UnplacedError> {
    if inner * outer >= 0.0 && inner.abs() < outer.abs() {
        return Ok([inner, outer]);
    }
    Err(UnplacedError::new(
        format!("radii {inner} and {outer}"),
        "the second is the larger one, of the same sign",
        "correct them",
    ))
}

/// A cone with its sign: negative radii face inwards.
fn cone(
    low: Vertex,
    low_radius: f64,
    high: Vertex,
    high_radius: f64,
    n: usize,
) -> Result<(CurvedFacets, bool), UnplacedError> {
    let length = low.point.distance(high.point);
    let some = low_radius != 0.0 || high_radius != 0.0;
    if !(length > 0.0 && length.is_finite() && some && low_radius * high_radius >= 0.0) {
        return Err(UnplacedError::new(
            "the cone has no side",
            "its ends coincide, its radii are 0 or of different sign",
            "correct it",
        ));
    }
    let facets = CurvedFacets::cone(low.point, low_radius.abs(), high.point, high_radius.abs(), n);
    Ok((facets, low_radius + high_radius < 0.0))
}
