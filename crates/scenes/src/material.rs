//! The materials of generated surfaces.

use radiosity::{Shape, Sides, SurfaceSpec};

/// A material: reflectance, emittance [W/m²] and active sides.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SceneMaterial {
    reflectance: f64,
    emittance: f64,
    sides: Sides,
}

impl SceneMaterial {
    /// A material that reflects with its front only.
    pub(crate) const fn new(reflectance: f64) -> Self {
        SceneMaterial { reflectance, emittance: 0.0, sides: Sides::Front }
    }

    /// The material reflecting with both sides, as leaves and cloth do.
    pub(crate) const fn two_sided(self) -> Self {
        SceneMaterial { sides: Sides::Both, ..self }
    }

    /// The material that also emits `emittance` [W/m²].
    pub(crate) const fn emitting(self, emittance: f64) -> Self {
        SceneMaterial { emittance, ..self }
    }

    /// Reflectance and emittance [W/m²].
    pub(crate) fn light(self) -> [f64; 2] {
        [self.reflectance, self.emittance]
    }

    /// A name that says all of it; `-both` ends those of materials that reflect with both sides.
    pub(crate) fn name(self) -> String {
        let SceneMaterial { reflectance, emittance, sides } = self;
        let both = if sides == Sides::Both { "-both" } else { "" };
        format!("reflecting-{reflectance}-emitting-{emittance}{both}")
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
            transmittance: Default::default(),
        }
    }
}
