//! The table `[sky]`: a uniform environment.
//!
//! Radiance does not change along a ray, so that a black box around the scene, which emits E on all its inner sides, sends from every
//! direction what a uniform environment of radiance E/π does. The sky is such a box: six surfaces behind all others, called `sky`.
//! Every method knows how to deal with surfaces, so that none needs to know of the sky.

use glam::DVec3;
use radiosity::{
    SceneSpec, Shape, Sides, Spectrum, SurfaceSpec,
    lamps::{Emission, LampSpec},
    sensors::{SensorShape, SensorSpec},
    surfaces::SKY,
};

use crate::document::Value;
use crate::error::Error;
use crate::keys::SKY_KEYS;
use crate::material::read_spectrum;

/// How far the box is from what is in it, relative to the diagonal of that: near, so that few walks miss the scene, and far enough
/// that nothing lies in a side of the box.
const DISTANCE: f64 = 0.02;

/// The emittance of the sky [W/m²].
pub(crate) fn read_sky(value: Value<'_>) -> Result<Spectrum, Error> {
    let mut table = value.table(SKY_KEYS)?;
    let value = table.require(
        "emittance",
        "a sky is an environment that emits",
        "emittance = 1.0, in W/m²: what a horizontal plane receives from all of it",
    )?;
    read_emittance(value)
}

/// The emittance that is written for a sky.
pub(crate) fn read_emittance(value: Value<'_>) -> Result<Spectrum, Error> {
    let place = value.place();
    let emittance = read_spectrum(value)?;
    if (0..3).all(|c| emittance[c] >= 0.0) && emittance.is_lit() {
        return Ok(emittance);
    }
    Err(Error::Refused {
        place,
        problem: "the sky does not emit".into(),
        why: "its emittance is what lights the scene, in no channel below 0 and in some above",
        remedy: "write a number above 0, or remove [sky]".into(),
    })
}

/// The box around surfaces, sensors, and lamps that have a place.
pub(crate) fn sky_box(spec: &SceneSpec, sensors: &[SensorSpec], emittance: Spectrum) -> Vec<SurfaceSpec> {
    let of_sensor = |sensor: &SensorSpec| match &sensor.shape {
        &SensorShape::Quad { corner, corner_u, corner_v, .. } => {
            vec![corner, corner_u, corner_v, corner_u + corner_v - corner]
        }
        SensorShape::Point { point, .. } => vec![*point],
        SensorShape::Points { points, .. }
        | SensorShape::Cylinders { points, .. }
        | SensorShape::Eyes { points, .. } => points.iter().map(|[point, _]| *point).collect(),
    };
    let is_near = |lamp: &&LampSpec| !matches!(lamp.emission, Emission::Distant { .. });
    let lamps = spec.lamps.list.iter().filter(is_near).map(|lamp| lamp.position);
    let corners = spec.surfaces.iter().flat_map(|surface| surface.shape.corners());
    let all: Vec<DVec3> = corners.chain(sensors.iter().flat_map(of_sensor)).chain(lamps).collect();
    let least = all.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let most = all.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
    let away = DVec3::splat(DISTANCE * (most - least).length());
    let (low, high) = (least - away, most + away);
    let sides = (0..3).flat_map(|axis| {
        let [u, v] = [1, 2].map(|next| {
            let next = (axis + next) % 3;
            DVec3::AXES[next] * (high - low)[next]
        });
        [(low, u, v), (high, -v, -u)]
    });
    sides.map(|(corner, u, v)| side(corner, u, v, emittance)).collect()
}

fn side(corner: DVec3, u: DVec3, v: DVec3, emittance: Spectrum) -> SurfaceSpec {
    SurfaceSpec {
        name: Some(SKY.into()),
        shape: Shape::Parallelogram { corner, corner_u: corner + u, corner_v: corner + v, cells: [1, 1] },
        sides: Sides::Front,
        reflectance: 0.0.into(),
        emittance,
        cell_emittance: Vec::new(),
        transmittance: Default::default(),
    }
}
