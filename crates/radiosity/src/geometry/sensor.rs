//! Sensors: places where light is measured that nothing is made of. No ray meets a sensor.

use std::f64::consts::FRAC_1_PI;

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::geometry::cells::in_grid_step;
use crate::geometry::frame::{Frames, SurfaceFrame};
use crate::random::rng::unit_32;
use crate::random::sampling::sin_cos_of_turn;
use crate::scene::Scene;

/// Where a sensor measures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum SensorShape {
    /// On the front of a parallelogram, cell by cell: the mean irradiance of each.
    Quad {
        /// The corner c [m].
        corner: DVec3,
        /// c + u, the next corner along u [m].
        corner_u: DVec3,
        /// c + v, the next corner along v [m]; the front faces u × v.
        corner_v: DVec3,
        /// Cells along u and v; cell number = i_u·n_v + i_v.
        cells: [u32; 2],
    },
    /// A point that faces one direction.
    Point {
        /// The place of the sensor [m].
        point: DVec3,
        /// The direction that it faces, of any length.
        normal: DVec3,
    },
    /// The points of a plane, or of a list, each of which is a cell. Their mean is measured, too.
    Points {
        /// The points [m], and the directions that they face, of any length.
        points: Vec<[DVec3; 2]>,
        /// Points along u and v, where they are a grid: number = i_u·n_v + i_v. A list has [n, 1].
        grid: [u32; 2],
    },
    /// The points of a plane, or of a list, at each of which a small upright cylinder stands: the mean irradiance of its curved side, or of the
    /// half of it that faces the direction of the point.
    Cylinders {
        /// The points [m], and the directions that they face, of any length.
        points: Vec<[DVec3; 2]>,
        /// As that of [`SensorShape::Points`].
        grid: [u32; 2],
        /// Whether it is half of the cylinder.
        half: bool,
    },
    /// The points of a plane, or of a list, at each of which an eye looks along a horizontal direction: illuminance on the plane across it, and
    /// glare.
    Eyes {
        /// The points [m], and the directions that the eyes look along, of any length.
        points: Vec<[DVec3; 2]>,
        /// As that of [`SensorShape::Points`].
        grid: [u32; 2],
    },
}

impl SensorShape {
    /// Whether it is a plane of points, or a list of them.
    pub fn is_plane(&self) -> bool {
        self.points().is_some()
    }

    /// Whether its points are eyes.
    pub fn is_eyes(&self) -> bool {
        matches!(self, SensorShape::Eyes { .. })
    }

    /// The points of a plane, or of a list, with the directions that they face, and how many there are along u and v.
    pub fn points(&self) -> Option<(&[[DVec3; 2]], [u32; 2])> {
        match self {
            SensorShape::Points { points, grid }
            | SensorShape::Cylinders { points, grid, .. }
            | SensorShape::Eyes { points, grid } => Some((points, *grid)),
            SensorShape::Quad { .. } | SensorShape::Point { .. } => None,
        }
    }

    /// How many cells it is cut into; a point is one.
    pub fn cell_count(&self) -> u64 {
        match self {
            &SensorShape::Quad { cells: [nu, nv], .. } => u64::from(nu) * u64::from(nv),
            SensorShape::Point { .. } => 1,
            SensorShape::Points { points, .. }
            | SensorShape::Cylinders { points, .. }
            | SensorShape::Eyes { points, .. } => points.len() as u64,
        }
    }

    /// The key of scene files that is at fault, and the problem.
    ///
    /// # Errors
    /// A number that is not finite, a quad without area or cells, a normal without direction.
    pub fn check(&self) -> Result<(), (&'static str, String)> {
        match *self {
            SensorShape::Points { ref points, grid }
            | SensorShape::Cylinders { ref points, grid, .. }
            | SensorShape::Eyes { ref points, grid } => {
                if points.is_empty() || u64::from(grid[0]) * u64::from(grid[1]) != points.len() as u64 {
                    return Err(("spacing", "there are no points".into()));
                }
                let is_half = matches!(self, SensorShape::Cylinders { half: true, .. });
                return points.iter().try_for_each(|&[point, normal]| {
                    check_point(point, normal)?;
                    match () {
                        () if is_half && normal.truncate() == DVec2::ZERO => {
                            Err(("normal", "half of a cylinder faces no horizontal direction".into()))
                        }
                        () if self.is_eyes() && normal.z != 0.0 => {
                            Err(("normal", "an eye does not look along a horizontal direction".into()))
                        }
                        () => Ok(()),
                    }
                });
            }
            SensorShape::Quad { corner, corner_u, corner_v, cells } => {
                let corners = [corner, corner_u, corner_v];
                if !corners.iter().all(|corner| corner.is_finite()) {
                    return Err(("quad", "a corner is not a finite number".into()));
                }
                let (u, v) = (corner_u - corner, corner_v - corner);
                let (area, extent) = (u.cross(v).length(), u.length() * v.length());
                if !(area.is_finite() && extent.is_finite() && area > 1e-12 * extent) {
                    return Err(("quad", format!("the sensor has no area ({area:e} m²)")));
                }
                if cells.contains(&0) {
                    return Err(("patches", "a sensor must have at least one patch".into()));
                }
            }
            SensorShape::Point { point, normal } => return check_point(point, normal),
        }
        Ok(())
    }
}

/// The key of a point that is at fault, and the problem.
fn check_point(point: DVec3, normal: DVec3) -> Result<(), (&'static str, String)> {
    if !point.is_finite() {
        return Err(("point", "a coordinate is not a finite number".into()));
    }
    let length = normal.length();
    if !(length.is_finite() && length > 0.0 && normal.normalize().is_finite()) {
        return Err(("normal", "the normal has no direction".into()));
    }
    Ok(())
}

/// A sensor as the scene file describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SensorSpec {
    /// The name that outputs show.
    pub name: String,
    /// Where the sensor measures.
    pub shape: SensorShape,
}

/// A sensor of impossible shape or place.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("sensor {name:?}: {problem}")]
pub struct SensorError {
    /// The name of the sensor.
    pub name: String,
    /// What is wrong with the sensor.
    pub problem: String,
}

/// The most cells that the sensors of a job have in all: every sample sends rays from each.
const MOST_CELLS: u64 = 1 << 20;

/// A sensor starts this many slacks in front of its plane, so that surfaces in that plane lie behind it: from a start
/// within one slack a ray would meet them.
const LIFT: f64 = 4.0;

/// A cell of a sensor, or its point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorCell {
    /// The number of the sensor.
    pub sensor: usize,
    /// The index of the cell along u and v; 0, 0 of a point.
    pub cell: [u32; 2],
    /// The middle of the cell, in the coordinates of the file [m].
    pub middle: DVec3,
    /// The area of the cell [m²]; 0 of a point.
    pub area: f64,
    /// The direction that the cell faces, of length 1; of no use where it is a whole cylinder.
    pub normal: DVec3,
    /// The number of its frame.
    frame: u32,
}

impl SensorCell {
    /// The number of the frame that departures look up.
    pub(crate) fn frame(&self) -> u32 {
        self.frame
    }
}

/// How a place weighs light by its direction; the integral over all directions is π.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Response {
    /// As the side of a plane: cos θ about the normal.
    Flat {
        /// The normal of that side.
        facing: DVec3,
    },
    /// As the curved side of an upright cylinder, the mean over all upright planes: sin ε/π, ε the angle to the axis.
    Cylinder,
    /// As the half that faces a horizontal direction, the mean over the upright planes that face up to 90° from it: sin ε (1 + cos α)/π, α the
    /// azimuth from that direction.
    HalfCylinder {
        /// The horizontal direction.
        facing: DVec3,
    },
}

impl Response {
    /// The weight of light that comes from a direction of length 1; 0 where none is taken.
    pub(crate) fn of(self, towards: DVec3) -> f64 {
        match self {
            Response::Flat { facing } => facing.dot(towards).max(0.0),
            Response::Cylinder => across(towards) * FRAC_1_PI,
            Response::HalfCylinder { facing } => (across(towards) + facing.dot(towards)).max(0.0) * FRAC_1_PI,
        }
    }

    /// A direction that is drawn about the normal of the frame of the place, turned about the axis of the cylinder by 32 random bits: to the
    /// density that is the weight over π.
    pub(crate) fn turned(self, direction: DVec3, bits: u32) -> DVec3 {
        let [sin, cos] = sin_cos_of_turn(bits);
        let cos = match self {
            Response::Flat { .. } => return direction,
            Response::Cylinder => cos,
            Response::HalfCylinder { .. } => cos.abs(),
        };
        let DVec3 { x, y, z } = direction;
        DVec3::new(cos * x - sin * y, sin * x + cos * y, z)
    }
}

/// The sine of the angle between a direction of length 1 and the vertical.
fn across(DVec3 { x, y, .. }: DVec3) -> f64 {
    (x * x + y * y).sqrt()
}

/// The sensors of a job, ready for rays.
#[derive(Clone, Debug)]
pub struct Sensors {
    specs: Vec<SensorSpec>,
    /// The number of the first cell of each, and of all cells.
    first_cells: Vec<u32>,
    /// The number of the first frame of each, and of all frames: points have one each.
    first_frames: Vec<u32>,
    frames: Vec<SurfaceFrame<f64>>,
    table: Frames,
    sample_walks: u64,
}

impl Sensors {
    /// Prepares sensors for a scene; `None` where there are none.
    ///
    /// # Errors
    /// A shape that [`SensorShape::check`] refuses, or more than 2²⁰ cells.
    pub fn new(scene: &Scene, specs: &[SensorSpec]) -> Result<Option<Self>, SensorError> {
        if specs.is_empty() {
            return Ok(None);
        }
        let (mut first_cells, mut first_frames) = (vec![0], vec![0]);
        let mut cells = 0;
        let mut frames = Vec::new();
        for SensorSpec { name, shape } in specs {
            let error = |problem| SensorError { name: name.clone(), problem };
            shape.check().map_err(|(_, problem)| error(problem))?;
            cells += shape.cell_count();
            if cells > MOST_CELLS {
                return Err(error(format!(
                    "up to this one the sensors have {cells} patches, more than {MOST_CELLS} (every sample sends rays from each); choose coarser `patches`"
                )));
            }
            first_cells.push(cells as u32);
            frames.extend(frames_of(shape, scene));
            first_frames.push(frames.len() as u32);
        }
        Ok(Some(Sensors {
            specs: specs.into(),
            first_cells,
            first_frames,
            table: Frames::new(frames.iter().copied()),
            frames,
            sample_walks: sample_walks(scene.faces().len() as u64, cells),
        }))
    }

    /// The sensors as the scene file writes them.
    pub fn specs(&self) -> &[SensorSpec] {
        &self.specs
    }

    /// The number of cells of all sensors together.
    pub fn cell_count(&self) -> usize {
        self.first_cells[self.specs.len()] as usize
    }

    /// The sensors that are planes, or lists, of points, by number.
    pub fn planes(&self) -> impl Iterator<Item = usize> {
        (0..self.specs.len()).filter(|&sensor| self.specs[sensor].shape.is_plane())
    }

    /// Rows of a tally that hold what cells read, and then the means of planes.
    pub(crate) fn row_count(&self) -> usize {
        self.cell_count() + self.planes().count()
    }

    /// The numbers of the cells of a sensor.
    pub fn cells_of(&self, sensor: usize) -> std::ops::Range<usize> {
        self.first_cells[sensor] as usize..self.first_cells[sensor + 1] as usize
    }

    /// Walks of a sample, where walks are samples of their own.
    pub fn sample_walks(&self) -> u64 {
        self.sample_walks
    }

    /// The cell with a number.
    pub fn cell(&self, number: usize) -> SensorCell {
        let sensor = self.first_cells.partition_point(|&first| first as usize <= number) - 1;
        let cell = number as u32 - self.first_cells[sensor];
        let at = |cell: [u32; 2], middle: DVec3, area: f64, frame: u32| {
            let frame = self.first_frames[sensor] + frame;
            let normal = self.frames[frame as usize].normal();
            SensorCell { sensor, cell, middle, area, normal, frame }
        };
        match self.specs[sensor].shape {
            SensorShape::Point { point, .. } => at([0, 0], point, 0.0, 0),
            SensorShape::Points { ref points, grid: [_, nv] }
            | SensorShape::Eyes { ref points, grid: [_, nv] }
            | SensorShape::Cylinders { ref points, grid: [_, nv], .. } => {
                at([cell / nv, cell % nv], points[cell as usize][0], 0.0, cell)
            }
            SensorShape::Quad { corner, corner_u, corner_v, cells: [nu, nv] } => {
                let cell = [cell / nv, cell % nv];
                let (u, v) = (corner_u - corner, corner_v - corner);
                let [x, y] = [(cell[0], nu), (cell[1], nv)].map(|(i, n)| (f64::from(i) + 0.5) / f64::from(n));
                let area = u.cross(v).length() / (f64::from(nu) * f64::from(nv));
                at(cell, corner + u * x + v * y, area, 0)
            }
        }
    }

    /// The corners of a cell in the coordinates of the file [m], counter-clockwise as seen from its front; `None` of a point.
    pub fn corners(&self, number: usize) -> Option<[DVec3; 4]> {
        let SensorCell { sensor, cell, .. } = self.cell(number);
        let SensorShape::Quad { corner, corner_u, corner_v, cells } = self.specs[sensor].shape else {
            return None;
        };
        let steps = [(corner_u - corner) / f64::from(cells[0]), (corner_v - corner) / f64::from(cells[1])];
        let first = corner + steps[0] * f64::from(cell[0]) + steps[1] * f64::from(cell[1]);
        Some([first, first + steps[0], first + steps[0] + steps[1], first + steps[1]])
    }

    /// What departures look frames up in, by number.
    pub(crate) fn frames(&self) -> &Frames {
        &self.table
    }

    /// The frames of a sensor, just in front of its plane: one, or one for each point.
    pub(crate) fn frames_of(&self, sensor: usize) -> &[SurfaceFrame<f64>] {
        &self.frames[self.first_frames[sensor] as usize..self.first_frames[sensor + 1] as usize]
    }

    /// The frame of a cell.
    pub(crate) fn frame(&self, cell: &SensorCell) -> &SurfaceFrame<f64> {
        &self.frames[cell.frame as usize]
    }

    /// How a cell weighs light by its direction.
    pub(crate) fn response(&self, cell: &SensorCell) -> Response {
        let facing = cell.normal;
        match self.specs[cell.sensor].shape {
            SensorShape::Cylinders { half: false, .. } => Response::Cylinder,
            SensorShape::Cylinders { half: true, .. } => Response::HalfCylinder { facing },
            _ => Response::Flat { facing },
        }
    }

    /// Local coordinates, on the sensor, of a uniform point of a cell.
    pub(crate) fn place(&self, &SensorCell { sensor, cell, .. }: &SensorCell, numbers: [u32; 2]) -> [f64; 2] {
        match self.specs[sensor].shape {
            SensorShape::Point { .. }
            | SensorShape::Points { .. }
            | SensorShape::Cylinders { .. }
            | SensorShape::Eyes { .. } => [0.0, 0.0],
            SensorShape::Quad { cells, .. } => std::array::from_fn(|i| {
                in_grid_step(f64::from(cell[i]), unit_32(numbers[i]), 1.0 / f64::from(cells[i]))
            }),
        }
    }

    /// A digest of where they measure, in what order; names do not enter.
    pub fn hash(specs: &[SensorSpec]) -> [u8; 32] {
        let mut hasher = blake3::Hasher::new();
        for SensorSpec { shape, .. } in specs {
            let (kind, vectors, cells) = match *shape {
                SensorShape::Quad { corner, corner_u, corner_v, cells } => {
                    (0_u32, vec![corner, corner_u, corner_v], cells)
                }
                SensorShape::Point { point, normal } => (1, vec![point, normal], [1, 1]),
                SensorShape::Points { ref points, grid } => {
                    (2, points.iter().flatten().copied().collect(), grid)
                }
                SensorShape::Cylinders { ref points, grid, half } => {
                    (3 + u32::from(half), points.iter().flatten().copied().collect(), grid)
                }
                SensorShape::Eyes { ref points, grid } => {
                    (5, points.iter().flatten().copied().collect(), grid)
                }
            };
            [kind, cells[0], cells[1]].iter().for_each(|n| _ = hasher.update(&n.to_le_bytes()));
            for x in vectors.iter().flat_map(|vector| vector.to_array()) {
                hasher.update(&x.to_bits().to_le_bytes());
            }
        }
        *hasher.finalize().as_bytes()
    }
}

/// A sample takes time for every face and every cell, which its walks should outweigh; more walks than these are no better,
/// and may belong to several leases.
fn sample_walks(faces: u64, cells: u64) -> u64 {
    faces.max(16 * cells).clamp(1 << 10, 1 << 16).next_power_of_two()
}

/// The frames of a sensor in the coordinates of a scene, just in front of its plane.
fn frames_of(shape: &SensorShape, scene: &Scene) -> Vec<SurfaceFrame<f64>> {
    let of_point = |point: DVec3, normal: DVec3| {
        let normal = normal.normalize();
        frame((point, [DVec3::ZERO; 2]), [normal.any_orthonormal_vector(), normal], scene)
    };
    match *shape {
        SensorShape::Quad { corner, corner_u, corner_v, .. } => {
            let edges = [corner_u - corner, corner_v - corner];
            let normal = edges[0].cross(edges[1]).normalize();
            vec![frame((corner, edges), [edges[0].normalize(), normal], scene)]
        }
        SensorShape::Point { point, normal } => vec![of_point(point, normal)],
        SensorShape::Points { ref points, .. } | SensorShape::Eyes { ref points, .. } => {
            points.iter().map(|&[point, normal]| of_point(point, normal)).collect()
        }
        SensorShape::Cylinders { ref points, half, .. } => {
            let facing = |direction: DVec3| if half { direction.with_z(0.0) } else { DVec3::X };
            points.iter().map(|&[point, direction]| of_point(point, facing(direction))).collect()
        }
    }
}

/// A frame just in front of its plane, in the coordinates of a scene.
fn frame(
    (corner, edges): (DVec3, [DVec3; 2]),
    [tangent, normal]: [DVec3; 2],
    scene: &Scene,
) -> SurfaceFrame<f64> {
    let corner = corner - scene.origin();
    let corners = [corner, corner + edges[0], corner + edges[1]];
    let largest = corners.iter().fold(0.0_f64, |most, corner| most.max(corner.abs().max_element()));
    let lift = LIFT * scene.parts.facets.slack().max(largest / (1_u64 << 46) as f64);
    SurfaceFrame::new(corner + normal * lift, edges, tangent, normal)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{IndexChoice, SceneSpec};

    fn quad(cells: [u32; 2]) -> SensorShape {
        SensorShape::Quad {
            corner: DVec3::new(0.0, 0.0, 0.5),
            corner_u: DVec3::new(1.0, 0.0, 0.5),
            corner_v: DVec3::new(0.0, 1.0, 0.5),
            cells,
        }
    }

    fn spec(shape: SensorShape) -> SensorSpec {
        SensorSpec { name: "s".into(), shape }
    }

    #[test]
    fn cells_are_numbered_sensor_by_sensor_and_row_by_row() {
        let scene = Scene::build(&SceneSpec::furnace(1, 0.5), IndexChoice::Auto).unwrap();
        let point = SensorShape::Point { point: DVec3::splat(0.25), normal: DVec3::Z };
        let sensors = Sensors::new(&scene, &[spec(quad([2, 3])), spec(point)]).unwrap().unwrap();
        assert_eq!((sensors.cell_count(), sensors.cells_of(0), sensors.cells_of(1)), (7, 0..6, 6..7));
        let last = sensors.cell(5);
        assert_eq!((last.sensor, last.cell), (0, [1, 2]));
        assert!((last.middle - DVec3::new(0.75, 5.0 / 6.0, 0.5)).length() < 1e-15);
        assert!((last.area - 1.0 / 6.0).abs() < 1e-15);
        let corners = sensors.corners(5).unwrap();
        assert!((corners.iter().sum::<DVec3>() / 4.0 - last.middle).length() < 1e-15);
        assert!((corners[0] - DVec3::new(0.5, 2.0 / 3.0, 0.5)).length() < 1e-15);
        assert!((corners[1] - corners[0]).cross(corners[3] - corners[0]).z > 0.0);
        assert!(sensors.corners(6).is_none());
        assert_eq!(sensors.cell(6).middle, DVec3::splat(0.25));
        let [u, v] = sensors.place(&last, [u32::MAX / 2; 2]);
        assert!((u - 0.75).abs() < 1e-9 && (v - 5.0 / 6.0).abs() < 1e-9);
    }

    #[test]
    fn shapes_that_cannot_be_are_refused_by_key() {
        let at_fault = |shape: SensorShape| shape.check().unwrap_err().0;
        assert_eq!(at_fault(quad([2, 0])), "patches");
        let line = SensorShape::Quad {
            corner: DVec3::ZERO,
            corner_u: DVec3::X,
            corner_v: 2.0 * DVec3::X,
            cells: [1, 1],
        };
        assert_eq!(at_fault(line), "quad");
        let point = |point, normal| at_fault(SensorShape::Point { point, normal });
        assert_eq!(point(DVec3::NAN, DVec3::Z), "point");
        assert_eq!(point(DVec3::ZERO, DVec3::ZERO), "normal");
        let scene = Scene::build(&SceneSpec::furnace(1, 0.5), IndexChoice::Auto).unwrap();
        let many = Sensors::new(&scene, &[spec(quad([1 << 10, 1 << 10])), spec(quad([1, 1]))]);
        assert!(many.unwrap_err().to_string().contains("1048577 patches"));
    }

    #[test]
    fn a_sample_outweighs_what_each_costs() {
        assert_eq!(sample_walks(54, 1), 1 << 10);
        assert_eq!(sample_walks(54, 100), 1 << 11);
        assert_eq!(sample_walks(3000, 1), 1 << 12);
        assert_eq!(sample_walks(1_000_000, 1_000_000), 1 << 16);
    }

    #[test]
    fn the_digest_is_of_places_alone() {
        let hash = |specs: &[SensorSpec]| Sensors::hash(specs);
        let (a, b) = (spec(quad([1, 1])), spec(quad([1, 2])));
        let renamed = SensorSpec { name: "other".into(), ..a.clone() };
        assert_eq!(hash(std::slice::from_ref(&a)), hash(&[renamed]));
        assert_ne!(hash(std::slice::from_ref(&a)), hash(std::slice::from_ref(&b)));
        assert_ne!(hash(&[a.clone(), b.clone()]), hash(&[b, a]));
    }
}
