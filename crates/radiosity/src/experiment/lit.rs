//! Light straight from lamps without area, where it is known exactly: at the points of sensors.

use std::sync::Arc;

use glam::DVec3;

use super::Experiment;
use crate::geometry::sensor::{SensorError, SensorShape, Sensors};
use crate::jacobi;
use crate::scene::Scene;
use crate::trace::ray::Ray;

/// A lamp that is no farther from a point than this many slacks of the scene, 2⁻³⁰ of its extent, is at the point.
const AT_A_LAMP: f64 = (1_u32 << 16) as f64;

/// What lamps bring to the points of sensors.
#[derive(Clone, Debug, Default)]
pub(super) struct LampsAtCells {
    /// By cell, the lamps whose light is known there, and the light [W/m², or lx].
    cells: Vec<Vec<(u32, [f64; 3])>>,
}

impl LampsAtCells {
    fn new(scene: &Scene, sensors: &Sensors) -> Self {
        let of_cell = |number: usize| {
            let cell = sensors.cell(number);
            let mut lights = Vec::new();
            if cell.area == 0.0 {
                let place = DVec3::from(sensors.frame(&cell).point([0.0; 2]));
                scene.each_lamp_to(place, (sensors.response(&cell), Ray::FREE), |lamp, light| {
                    lights.push((lamp as u32, light));
                });
            }
            lights
        };
        let cells = if scene.lamp_count() == 0 { 0 } else { sensors.cell_count() };
        LampsAtCells { cells: (0..cells).map(of_cell).collect() }
    }

    /// The lamps that light a cell, and what each brings, channel by channel.
    pub(super) fn of_cell(&self, cell: usize) -> &[(u32, [f64; 3])] {
        self.cells.get(cell).map_or(&[], |lights| lights)
    }
}

impl Experiment {
    /// What lamps bring to the points of sensors.
    pub(super) fn lamps_at_cells(&self) -> &LampsAtCells {
        let make = || {
            let sensors = self.sensors.as_deref();
            Arc::new(sensors.map(|sensors| LampsAtCells::new(&self.scene, sensors)).unwrap_or_default())
        };
        self.lamps_at_cells.get_or_init(make)
    }

    /// Whether any lamp without area lights a sensor, at the middle of one of its cells.
    pub fn is_lit_by_lamps(&self, sensor: usize) -> bool {
        let Some(sensors) = self.sensors().filter(|_| self.scene.lamp_count() > 0) else { return false };
        sensors.cells_of(sensor).any(|number| {
            let cell = sensors.cell(number);
            let (place, response) = (cell.middle - self.scene.origin(), sensors.response(&cell));
            let mut lamps = 0..self.scene.lamp_count();
            lamps.any(|lamp| self.scene.lamp_light(lamp, place, response, Ray::FREE, 0).is_some())
        })
    }

    /// Whether all light in a channel comes straight from lamps to points, where it is known exactly: nothing reflects, and no face emits.
    pub(super) fn is_all_direct(&self, channel: usize) -> bool {
        let emits = || self.scene.faces().iter().any(|face| face.emittance[channel] > 0.0);
        let lamps = 0..self.scene.lamp_count();
        let quads = || {
            let specs = self.sensors.iter().flat_map(|sensors| sensors.specs());
            specs.into_iter().any(|spec| matches!(spec.shape, SensorShape::Quad { .. }))
        };
        self.scene.max_reflectance()[channel] == 0.0
            && !lamps.is_empty()
            && lamps.clone().all(|lamp| self.scene.parts.lamps.is_sharp(lamp))
            && !quads()
            && !emits()
    }
}

/// [`jacobi::largest_radiosity`], which H does not exceed where lamps without area light faces, either: no piece gets more than all their
/// flux, nor than what they bring to its nearest place.
pub(super) fn largest_radiosity(scene: &Scene) -> [f64; 3] {
    let largest = jacobi::largest_radiosity(scene);
    let lamps = &scene.parts.lamps;
    if lamps.is_empty() {
        return largest;
    }
    let flux = |c: usize| (0..lamps.len()).map(|lamp| lamps.power(lamp, c)).sum::<f64>();
    let flux: [f64; 3] = std::array::from_fn(flux);
    let mut most = [0.0_f64; 3];
    for number in 0..scene.faces().piece_count() as u32 {
        // Lamps are in the coordinates of the scene, corners in those of the file.
        let corners: Vec<DVec3> =
            scene.faces().piece_corners(number).iter().map(|corner| corner - scene.origin()).collect();
        let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let radius = corners.iter().map(|corner| corner.distance(middle)).fold(0.0, f64::max);
        let area = scene.faces().piece(number).area;
        let at = |distance: &dyn Fn(DVec3) -> f64| -> [f64; 3] {
            let near = lamps.most_irradiance(|lamp| distance(lamp).powi(-2));
            std::array::from_fn(|c| near[c].min(flux[c] / area))
        };
        let from_afar = at(&|lamp| (lamp.distance(middle) - radius).max(0.0));
        if (0..3).any(|c| from_afar[c] > most[c]) {
            let near = at(&|lamp| distance_to_polygon(lamp, &corners));
            most.iter_mut().zip(near).for_each(|(most, near)| *most = most.max(near));
        }
    }
    let emittance = |c: usize| scene.faces().iter().map(|face| face.emittance[c]).fold(0.0, f64::max);
    std::array::from_fn(|c| match (emittance(c) + most[c]) / (1.0 - scene.max_reflectance()[c]) {
        0.0 => 1.0,
        largest => largest,
    })
}

/// The distance of a point from a flat, convex polygon.
fn distance_to_polygon(point: DVec3, corners: &[DVec3]) -> f64 {
    let edges = || corners.iter().zip(corners.iter().cycle().skip(1)).map(|(&from, &to)| (from, to - from));
    let to_edge = |(from, edge): (DVec3, DVec3)| {
        let along = (point - from).dot(edge) / edge.length_squared();
        // An edge without length is a corner.
        let along = if along.is_nan() { 0.0 } else { along.clamp(0.0, 1.0) };
        point.distance(from + along * edge)
    };
    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
    let is_above = edges().all(|(from, edge)| edge.cross(point - from).dot(normal) > 0.0);
    let to_edges = edges().map(to_edge).fold(f64::INFINITY, f64::min);
    if is_above { to_edges.min((point - corners[0]).dot(normal).abs()) } else { to_edges }
}

/// Refuses points of sensors at which a lamp without area is: light is infinite there.
pub(super) fn check_points(scene: &Scene, sensors: &Sensors) -> Result<(), SensorError> {
    let places: Vec<DVec3> = (0..scene.lamp_count())
        .filter_map(|lamp| Some(scene.lamp_place(lamp)?[0] + scene.origin()))
        .collect();
    let points = (0..sensors.cell_count()).map(|cell| sensors.cell(cell)).filter(|cell| cell.area == 0.0);
    for cell in points {
        if places.iter().any(|place| place.distance(cell.middle) <= AT_A_LAMP * scene.parts.facets.slack()) {
            let [x, y, z] = cell.middle.to_array();
            return Err(SensorError {
                name: sensors.specs()[cell.sensor].name.clone(),
                problem: format!(
                    "a lamp is at its point {x}, {y}, {z}, where light is infinite; move one of them"
                ),
            });
        }
    }
    Ok(())
}

/// The most that a sample of a cell of a quad of sensors may find of lamps without area, whose light it samples [W/m²].
fn most_at_quads(scene: &Scene, sensors: &Sensors) -> [f64; 3] {
    let mut most = [0.0_f64; 3];
    if scene.lamp_count() == 0 {
        return most;
    }
    for cell in 0..sensors.cell_count() {
        if let Some(corners) = sensors.corners(cell) {
            let corners = corners.map(|corner| corner - scene.origin());
            let near = scene.parts.lamps.most_irradiance(|lamp| jacobi::most_of_unit_lamp(lamp, &corners));
            most.iter_mut().zip(near).for_each(|(most, near)| *most = most.max(near));
        }
    }
    most
}

/// What samples of sensors are parts of [W/m²]: neither the radiosity of a face exceeds it, nor what lamps without area bring to a cell.
pub(super) fn largest_at_sensors(scene: &Scene, sensors: &Sensors, radiosity: [f64; 3]) -> [f64; 3] {
    let at_quads = most_at_quads(scene, sensors);
    std::array::from_fn(|c| radiosity[c].max(at_quads[c]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_distance_of_a_polygon_is_that_of_its_nearest_point() {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| DVec3::new(x, y, 0.0));
        let sliver = [[0.0, 0.0], [1.0, 0.0], [0.5, 1e-13]].map(|[x, y]| DVec3::new(x, y, 0.0));
        let known = [
            (&square[..], [0.5, 0.5, -2.0], 2.0),
            (&square[..], [1.0 + 3.0, 0.5, 4.0], 5.0),
            (&square[..], [-3.0, 1.0 + 4.0, 12.0], 13.0),
            (&square[..], [0.25, 0.5, 0.0], 0.0),
            (&sliver[..], [0.5, 3.0, 4.0], 5.0),
            (&sliver[..], [0.5, 0.0, 2.0], 2.0),
        ];
        for (corners, point, distance) in known {
            let found = distance_to_polygon(point.into(), corners);
            assert!((found - distance).abs() < 1e-12, "{point:?}: {found}, not {distance}");
        }
    }
}
