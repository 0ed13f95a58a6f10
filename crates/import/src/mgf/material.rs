//! MGF's materials, and their diffuse part.

use radiosity::{Sides, Spectrum};

use super::colour::Colour;
use crate::mesh::Material;

/// An amount of light with its colour.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Tinted {
    pub(super) amount: f64,
    pub(super) colour: Colour,
}

/// The optical properties that an MGF file gives a material.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Optics {
    /// The diffuse reflectance, with its colour.
    pub(super) rd: Tinted,
    /// The diffuse transmittance, in [0, 1].
    pub(super) td: f64,
    /// The specular reflectance, in [0, 1].
    pub(super) rs: f64,
    /// The specular transmittance, in [0, 1].
    pub(super) ts: f64,
    /// The diffuse emittance [lm/m²], with its colour.
    pub(super) ed: Tinted,
    /// Whether the material has a front only.
    pub(super) one_sided: bool,
}

impl Optics {
    /// The diffuse part of the material.
    pub(super) fn material(&self, name: &str) -> Material {
        let mut dropped = Vec::new();
        let parts = [
            ("diffuse transmittance", self.td),
            ("specular reflectance", self.rs),
            ("specular transmittance", self.ts),
        ];
        dropped.extend(
            parts.iter().filter(|(_, amount)| *amount > 0.0).map(|(what, amount)| format!("{what} {amount}")),
        );
        let mut channels = |what: &str, (spectrum, lost): (Spectrum, f64)| {
            if lost > 0.005 && spectrum.is_lit() {
                dropped.push(format!(
                    "{:.0} % of the saturation of its {what}: no red, green and blue make that colour",
                    100.0 * lost
                ));
            }
            spectrum
        };
        Material {
            name: name.into(),
            reflectance: channels("reflectance", self.rd.colour.reflectance(self.rd.amount)),
            emittance: channels("emittance", self.ed.colour.emittance(self.ed.amount)),
            sides: Some(if self.one_sided { Sides::Front } else { Sides::Both }),
            dropped,
        }
    }
}
