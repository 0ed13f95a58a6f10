//! The sides of patches that exchange light. The sides of a two-sided patch are separate: what arrives on one leaves
//! from it.

use crate::patch::Patch;
use crate::scene::Scene;
use crate::spec::{Sides, Spectrum};

/// One active side of a patch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Face {
    pub(crate) patch: u32,
    pub(crate) surface: u32,
    /// 1 for the front, −1 for the back.
    pub(crate) facing: f64,
    /// Of the patch: 1 or 2.
    pub(crate) sides: f64,
    pub(crate) reflectance: Spectrum,
    pub(crate) emittance: Spectrum,
}

/// The faces of a scene: the fronts in patch order, then the backs of two-sided surfaces.
pub(crate) struct Faces<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) list: Vec<Face>,
    /// A [m²].
    pub(crate) areas: Vec<f64>,
    /// For each surface the face of a back less its patch; of no meaning where backs are dead.
    to_back: Vec<u32>,
}

impl<'a> Faces<'a> {
    pub(crate) fn new(scene: &'a Scene) -> Self {
        let mut faces =
            Faces { scene, list: Vec::new(), areas: Vec::new(), to_back: vec![0; scene.surfaces().len()] };
        for (number, patch) in (0..).zip(scene.patches()) {
            faces.push(number, &patch, 1.0);
        }
        let two_sided = |(_, patch): &(u32, Patch)| patch.sides == Sides::Both;
        for (number, patch) in (0..).zip(scene.patches()).filter(two_sided) {
            faces.to_back[patch.surface as usize] = faces.list.len() as u32 - number;
            faces.push(number, &patch, -1.0);
        }
        faces
    }

    fn push(&mut self, number: u32, patch: &Patch, facing: f64) {
        let &Patch { surface, sides, reflectance, emittance, area, .. } = patch;
        let sides = sides.count();
        self.list.push(Face { patch: number, surface, facing, sides, reflectance, emittance });
        self.areas.push(area);
    }

    /// The face of a patch that is met.
    #[inline(always)]
    pub(crate) fn met(&self, patch: u32, surface: u32, facing: f64) -> u32 {
        if facing > 0.0 { patch } else { patch + self.to_back[surface as usize] }
    }

    /// H of every face in every channel [W/m²] from φ [W].
    pub(crate) fn per_area(&self, incoming: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let per_area =
            |incoming: &Vec<f64>| incoming.iter().zip(&self.areas).map(|(x, area)| x / area).collect();
        incoming.iter().map(per_area).collect()
    }

    /// H of every patch, channel-minor, from that of the faces in every channel: the mean of the sides.
    pub(crate) fn by_patch(&self, irradiance: &[Vec<f64>]) -> Vec<f64> {
        let channels = irradiance.len();
        let mut patches = vec![0.0; self.scene.patches().len() * channels];
        for (channel, irradiance) in irradiance.iter().enumerate() {
            for (face, h) in self.list.iter().zip(irradiance) {
                patches[face.patch as usize * channels + channel] += h / face.sides;
            }
        }
        patches
    }
}
