//! MGF's materials, and their diffuse part.

use radiosity::{Sides, Spectrum};

use super::colour::Colour;
use crate::mesh::{LostProperty, Material};

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
        let mut material = Material::unknown(name);
        material.sides = Some(if self.one_sided { Sides::Front } else { Sides::Both });
        material.passes(self.ts);
        if self.td > 0.0 {
            material.loses(LostProperty::Transparency);
        }
        if self.rs > 0.0 {
            material.loses(LostProperty::Mirror);
        }
        let mut channels = |(spectrum, part): (Spectrum, f64)| {
            if part > 0.005 && spectrum.is_lit() {
                material.loses(LostProperty::Saturation);
            }
            spectrum
        };
        let reflectance = channels(self.rd.colour.reflectance(self.rd.amount));
        let emittance = channels(self.ed.colour.emittance(self.ed.amount));
        Material { reflectance, emittance, ..material }
    }
}
