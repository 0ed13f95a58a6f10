//! Light straight from lamps without area, where it is known exactly: at the points of sensors.

use std::sync::Arc;

use glam::DVec3;

use super::Experiment;
use crate::geometry::sensor::{SensorShape, Sensors};
use crate::jacobi;
use crate::scene::Scene;
use crate::trace::ray::Ray;

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
        let corners = scene.faces().piece_corners(number);
        let centre = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let radius = corners.iter().map(|corner| corner.distance(centre)).fold(0.0, f64::max);
        // Lamps are in the coordinates of the scene, corners in those of the file.
        let middle = centre - scene.origin();
        let near = lamps.most_irradiance(|lamp| (lamp.distance(middle) - radius).max(0.0));
        let area = scene.faces().piece(number).area;
        for c in 0..3 {
            most[c] = most[c].max(near[c].min(flux[c] / area));
        }
    }
    let emittance = |c: usize| scene.faces().iter().map(|face| face.emittance[c]).fold(0.0, f64::max);
    std::array::from_fn(|c| match (emittance(c) + most[c]) / (1.0 - scene.max_reflectance()[c]) {
        0.0 => 1.0,
        largest => largest,
    })
}

/// The most that a sample of a quad of sensors may find of lamps without area, whose light it samples [W/m²].
pub(super) fn most_at_quads(scene: &Scene, sensors: &Sensors) -> [f64; 3] {
    let mut most = [0.0_f64; 3];
    for (sensor, spec) in sensors.specs().iter().enumerate() {
        if matches!(spec.shape, SensorShape::Quad { .. }) {
            let frame = &sensors.frames_of(sensor)[0];
            let (corner, normal) = (DVec3::from(frame.point([0.0; 2])), frame.normal());
            let near = scene.parts.lamps.most_irradiance(|lamp| (lamp - corner).dot(normal).abs());
            most.iter_mut().zip(near).for_each(|(most, near)| *most = most.max(near));
        }
    }
    // Of a lamp in the plane of a sensor nothing comes in.
    most.map(|most| if most.is_finite() { most } else { 0.0 })
}
