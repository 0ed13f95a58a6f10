//! The light on the floor of a scene, as a map.

use std::collections::BTreeMap;

use glam::DVec3;
use radiosity::{
    Estimates, Scene, Side,
    rays::{Lookout, Ray},
};

use crate::bounds::Bounds;
use crate::camera::Frame;
use crate::isolux::{PlaneGrid, map_name, map_svg};
use crate::smooth::Smooth;

/// Points along the longer side of a map.
const POINTS: f64 = 96.0;

/// The cosine between the normal of a floor and what is up, at least.
const LEVEL: f64 = 0.999;

/// Heights that differ by less than this part of the scene's are one; points are looked for from as far above a floor.
const SAME_HEIGHT: f64 = 0.01;

/// The floor is the lowest of the levels that have this part of the largest one's area at least.
const WIDE: f64 = 0.5;

/// A level of a scene: all that faces up at one height.
#[derive(Clone, Copy)]
struct FloorLevel {
    /// Above the scene's origin [m].
    height: f64,
    area: f64,
    /// Its box along what is to the right, and ahead [m].
    low: [f64; 2],
    high: [f64; 2],
}

/// A map of the irradiance on the floor, and its mean.
pub(crate) struct FloorMap {
    /// An SVG drawing.
    pub(crate) svg: String,
    /// The mean of the points of the map that are known, and of the channels [W/m²].
    pub(crate) mean: f64,
}

/// The map in a `unit`; `None` where there is no floor, or no light on it.
pub(crate) fn floor_map(estimates: &Estimates, smooth: &Smooth, unit: &str) -> Option<FloorMap> {
    let scene = estimates.scene();
    let bounds = Bounds::of(scene);
    let frame = Frame::of(scene, &bounds);
    let above = SAME_HEIGHT * frame.height(&bounds);
    let floor = FloorLevel::of(scene, &frame, above)?;
    let size = [0, 1].map(|axis| floor.high[axis] - floor.low[axis]);
    let step = size[0].max(size[1]) / POINTS;
    let points = size.map(|length| ((length / step).round() as usize).max(2));
    let step = [0, 1].map(|axis| size[axis] / points[axis] as f64);
    let rays: Vec<Ray> = (0..points[0] * points[1])
        .map(|number| {
            let cell = [number / points[1], number % points[1]];
            let [u, v] = [0, 1].map(|axis| floor.low[axis] + (cell[axis] as f64 + 0.5) * step[axis]);
            let origin = frame.right * u - frame.front * v + frame.up * (floor.height + above);
            Ray { origin, direction: -frame.up, from: Ray::FREE }
        })
        .collect();
    let mut values = vec![f64::NAN; rays.len()];
    Lookout::new(scene).each_closest_hit(&rays, |number, hit| {
        let Some(hit) = hit.filter(|hit| hit.t < 2.0 * above) else { return };
        let surface = &scene.surfaces()[hit.surface as usize];
        if surface.is_active(hit.side) {
            let piece = surface.piece(surface.cell_at(hit.uv), hit.side);
            values[number] = irradiance(estimates, smooth, piece, hit.uv);
        }
    });
    let known: Vec<f64> = values.iter().copied().filter(|value| !value.is_nan()).collect();
    let mean = known.iter().sum::<f64>() / known.len() as f64;
    let name = map_name("floor, seen from above", scene.channels());
    (mean > 0.0)
        .then(|| FloorMap { svg: map_svg(&PlaneGrid { size: points, step, values }, &name, unit), mean })
}

impl FloorLevel {
    fn of(scene: &Scene, frame: &Frame, same: f64) -> Option<Self> {
        let mut levels: BTreeMap<i64, FloorLevel> = BTreeMap::new();
        for surface in scene.surfaces() {
            let faces_up = |side: Side| {
                surface.is_active(side)
                    && surface.normal().dot(frame.up) * side.sign() > LEVEL
                    && !scene.faces().piece(surface.piece(0, side)).emittance.is_lit()
            };
            if ![Side::Front, Side::Back].into_iter().any(faces_up) {
                continue;
            }
            let own = FloorLevel::of_corners(&surface.outline(), surface.area(), frame);
            let level =
                levels.entry((own.height / same).round() as i64).or_insert(FloorLevel { area: 0.0, ..own });
            *level = level.with(&own);
        }
        let most = levels.values().map(|level| level.area).fold(0.0, f64::max);
        levels.into_values().find(|level| level.area >= WIDE * most)
    }

    fn of_corners(corners: &[DVec3], area: f64, frame: &Frame) -> Self {
        let along = |axis: DVec3| corners.iter().map(move |corner| corner.dot(axis));
        let axes = [frame.right, -frame.front];
        FloorLevel {
            height: along(frame.up).sum::<f64>() / corners.len() as f64,
            area,
            low: axes.map(|axis| along(axis).fold(f64::INFINITY, f64::min)),
            high: axes.map(|axis| along(axis).fold(f64::NEG_INFINITY, f64::max)),
        }
    }

    fn with(&self, other: &FloorLevel) -> Self {
        FloorLevel {
            height: self.height,
            area: self.area + other.area,
            low: [0, 1].map(|axis| self.low[axis].min(other.low[axis])),
            high: [0, 1].map(|axis| self.high[axis].max(other.high[axis])),
        }
    }
}

/// H = (B − E) / ϱ at a place on a piece, between the patches; of a black one that of its patch. The mean of the channels.
fn irradiance(estimates: &Estimates, smooth: &Smooth, piece: u32, uv: [f64; 2]) -> f64 {
    let faces = estimates.scene().faces();
    let (face, channels) = (faces.piece(piece), estimates.scene().channels());
    let radiosity = smooth.at(piece, faces.corner_weights(piece, uv));
    let known = estimates.face(faces.face_of(piece) as usize);
    let of = |c: usize| match face.reflectance[c] {
        reflectance if reflectance > 0.0 => (radiosity[c] - face.emittance[c]) / reflectance,
        _ => known.as_deref().and_then(|known| known[c].irradiance).unwrap_or(f64::NAN),
    };
    (0..channels).map(of).sum::<f64>() / channels as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenes::{cube, experiment, shot};

    /// The floor of a closed cube is below, as wide as the cube, and its map lies between the least and the greatest light of its patches.
    #[test]
    fn the_floor_of_a_cube_is_its_lowest_side() {
        let scene = cube();
        let bounds = Bounds::of(&scene);
        let frame = Frame::of(&scene, &bounds);
        let floor = FloorLevel::of(&scene, &frame, 0.01).unwrap();
        let side = bounds.size().x;
        assert!((floor.height - bounds.min.dot(frame.up)).abs() < 1e-12);
        assert!((floor.area - side * side).abs() < 1e-12);
        assert!((0..2).all(|axis| (floor.high[axis] - floor.low[axis] - side).abs() < 1e-12));
        let experiment = experiment(&scene);
        let tally = shot(&experiment);
        let estimates = Estimates::new(&experiment, &tally, 0.95);
        let FloorMap { svg, mean } = floor_map(&estimates, &Smooth::new(&estimates), "W/m²").unwrap();
        let lit = (0..9).map(|face| estimates.face(face).unwrap()[0].irradiance.unwrap());
        let (least, most) = lit.fold((f64::INFINITY, 0.0_f64), |(a, b), h| (a.min(h), b.max(h)));
        assert!(least < mean && mean < most, "{mean} in {least} … {most}");
        assert!(
            svg.contains("floor, seen from above") && svg.contains("<path") && svg.contains("data:image/png")
        );
    }
}
