//! What surfaces are made of.

use radiosity::{Shape, Sides, SurfaceSpec};

/// Reflectance, emittance [W/m²] and active sides.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Material {
    reflectance: f64,
    emittance: f64,
    sides: Sides,
}

impl Material {
    /// Reflects with its front.
    pub(crate) const fn new(reflectance: f64) -> Self {
        Material { reflectance, emittance: 0.0, sides: Sides::Front }
    }

    /// Reflects with both sides: leaves, cloth.
    pub(crate) const fn two_sided(self) -> Self {
        Material { sides: Sides::Both, ..self }
    }

    /// Emits `emittance` [W/m²] too.
    pub(crate) const fn emitting(self, emittance: f64) -> Self {
        Material { emittance, ..self }
    }

    /// A surface of this material.
    pub(crate) fn surface(self, shape: Shape) -> SurfaceSpec {
        SurfaceSpec {
            name: None,
            shape,
            sides: self.sides,
            reflectance: self.reflectance.into(),
            emittance: self.emittance.into(),
            cell_emittance: vec![],
        }
    }
}
