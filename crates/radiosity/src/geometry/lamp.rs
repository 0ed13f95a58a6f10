//! Lamps without area, as a scene is written: where they hang, how they are turned, and how their light is spread.
//!
//! No ray meets a lamp. Its intensities are those of far-field photometry: all its light comes from one point, or, where it is distant,
//! from one direction.

use glam::DVec3;
use photometry::{Distribution, LuminousOpening};
use serde::{Deserialize, Serialize};

use super::spec::Spectrum;

/// How the light of a lamp is spread over directions, per unit of its strength.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Emission {
    /// The intensities of a table of [`LampsSpec`], by number.
    Table(u32),
    /// 1 cd in every direction.
    Uniform,
    /// 1 cd about the axis, −z; from one cosine of the angle to the axis to another it falls to 0, as the square of a linear function
    /// (`KHR_lights_punctual`).
    Spot {
        /// The cosine up to which it is 1 cd.
        inner: f64,
        /// The cosine from which on it is dark.
        outer: f64,
    },
    /// 1 lx on a plane across the way of the light, which goes along −z; from a disc of the sky of this radius as a cosine.
    Distant {
        /// The cosine of the angle from the middle of the disc to its rim; 1 for parallel light.
        rim: f64,
    },
}

/// A lamp without area.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LampSpec {
    /// The name of the lamp.
    pub name: String,
    /// Where its light comes from [m]; of no use where it is distant.
    pub position: DVec3,
    /// The axes of the lamp's frame in the scene, of length 1: its light is aimed along −z.
    pub axes: [DVec3; 3],
    /// How its light is spread.
    pub emission: Emission,
    /// What the light is multiplied by, channel by channel.
    pub strength: Spectrum,
}

/// The lamps of a scene, and the tables of intensities that they share.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LampsSpec {
    /// Intensities, by the number that [`Emission::Table`] has of them.
    pub tables: Vec<Distribution>,
    /// The lamps, by number.
    pub list: Vec<LampSpec>,
    /// The luminous openings of the luminaires whose tables those are, in the same order, as far as they are known. A job carries them behind
    /// all else; no walk asks for them.
    #[serde(skip)]
    pub openings: Vec<LuminousOpening>,
}

impl LampsSpec {
    /// Adds other lamps with their tables.
    pub fn append(&mut self, others: LampsSpec) {
        let first = self.tables.len() as u32;
        self.openings.resize(self.tables.len(), LuminousOpening::Point);
        self.openings.extend(others.openings);
        self.tables.extend(others.tables);
        self.list.extend(others.list.into_iter().map(|lamp| match lamp.emission {
            Emission::Table(number) => LampSpec { emission: Emission::Table(first + number), ..lamp },
            _ => lamp,
        }));
    }
}

/// What lengths and angles of axes may be off by.
const ROUNDING: f64 = 1e-9;

impl LampSpec {
    /// A lamp at a point, aimed along −z of the scene.
    pub fn new(position: DVec3, emission: Emission, strength: impl Into<Spectrum>) -> Self {
        LampSpec { name: String::new(), position, axes: DVec3::AXES, emission, strength: strength.into() }
    }

    /// The lamp aimed elsewhere: its −z goes along `aim`, and it is turned about that by `rotation` [°], counter-clockwise as seen
    /// against its light. Without a turn the lamp is tilted out of −z by the shortest way; one that is aimed straight up is turned over
    /// about its x.
    pub fn aimed(self, aim: DVec3, rotation: f64) -> Self {
        let z = -aim.normalize();
        let (sin, cos) = rotation.to_radians().sin_cos();
        let tilted = match z.z < -1.0 + 1e-12 {
            true => [DVec3::X, -DVec3::Y],
            false => {
                // The rotation that takes +z to z about their cross product.
                let turn = |v: DVec3| v - (v.dot(z) / (1.0 + z.z)) * (DVec3::Z + z);
                [turn(DVec3::X), turn(DVec3::Y)]
            }
        };
        let x = tilted[0] * cos + tilted[1] * sin;
        LampSpec { axes: [x, z.cross(x), z], ..self }
    }

    /// What is wrong with the lamp, where something is.
    pub(crate) fn fault(&self, tables: usize) -> Option<&'static str> {
        let [x, y, z] = self.axes;
        let is_frame = [x, y, z].iter().all(|axis| (axis.length() - 1.0).abs() < ROUNDING)
            && x.cross(y).distance(z) < ROUNDING;
        let strength = self.strength.channels();
        let known = match self.emission {
            Emission::Table(number) => (number as usize) < tables,
            Emission::Uniform => true,
            Emission::Spot { inner, outer } => (-1.0..1.0).contains(&outer) && outer < inner && inner <= 1.0,
            Emission::Distant { rim } => rim > 0.0 && rim <= 1.0,
        };
        match () {
            () if !self.position.is_finite() => Some("its position is not a finite number"),
            () if !is_frame => Some("its axes are no right-handed frame of unit vectors"),
            () if !strength.iter().all(|s| s.is_finite() && *s >= 0.0) => {
                Some("its strength is not a finite number from 0 on")
            }
            () if !known => Some("its cone has no width, or its table does not exist"),
            () => None,
        }
    }

    /// Every number of the lamp, for a digest.
    pub(crate) fn numbers(&self) -> Vec<f64> {
        let emission = match self.emission {
            Emission::Table(number) => [0.0, f64::from(number), 0.0],
            Emission::Uniform => [1.0, 0.0, 0.0],
            Emission::Spot { inner, outer } => [2.0, inner, outer],
            Emission::Distant { rim } => [3.0, rim, 0.0],
        };
        let vectors = std::iter::once(self.position).chain(self.axes).flat_map(|vector| vector.to_array());
        vectors.chain(emission).chain(self.strength.channels()).collect()
    }
}
