//! Where sensors are drawn in three dimensions.

use glam::DVec3;
use radiosity::sensors::{Readings, Sensors};

use crate::bounds::Bounds;

/// The side of the square that stands for a point, as a part of the scene's longest extent.
const POINT: f64 = 0.025;

/// The corners of every cell of the sensors in the coordinates of the file [m], counter-clockwise as seen from its front. A point
/// is drawn as a small square around it.
pub(crate) fn outlines(readings: &Readings) -> Vec<[DVec3; 4]> {
    let sensors = readings.sensors();
    let side = POINT * Bounds::of(readings.scene()).size().max_element();
    let outline = |number| sensors.corners(number).unwrap_or_else(|| square(sensors, number, side));
    (0..sensors.cell_count()).map(outline).collect()
}

/// A square around a point, across the direction that it faces.
fn square(sensors: &Sensors, number: usize, side: f64) -> [DVec3; 4] {
    let cell = sensors.cell(number);
    let side = match sensors.specs()[cell.sensor].shape.points() {
        Some((points, _)) if points.len() > 1 => side.min(points[0][0].distance(points[1][0])),
        _ => side,
    };
    let (u, v) = cell.normal.any_orthonormal_pair();
    let corner = |(s, t): (f64, f64)| cell.middle + 0.5 * side * (s * u + t * v);
    [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(corner)
}
