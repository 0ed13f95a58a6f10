//! What is estimated of a scene, as a picture.

use job::View;
use radiosity::{Estimates, Scene};

use super::studio::Studio;
use super::{Picture, Shot};
use crate::smooth::Smooth;
use crate::values::Values;

/// Where no picture is drawn its exposure is measured on a picture this much coarser.
const COARSE: u32 = 4;

/// A picture, what it was made from, and how it was taken.
#[derive(Clone, Debug, PartialEq)]
pub struct Photo {
    /// What an eye sees.
    pub picture: Picture,
    /// The radiosity behind it, where it is asked for.
    pub values: Option<Values>,
    /// How it was taken.
    pub shot: Shot,
}

impl Photo {
    /// Renders what is estimated of a scene, from where a job lets the camera stand. After a run of enough rays the light of
    /// lamps and what surfaces reflect on each other is gathered pixel by pixel (`field.rs`); after fewer it is the radiosity of the faces,
    /// without steps between them. A face without an estimate shows its own emission.
    pub fn shoot(estimates: &Estimates, smooth: &Smooth, view: &View, with_values: bool) -> Self {
        let rays = estimates.tally().counts.rays;
        Photo::take((estimates.scene(), rays), &shown(estimates), Some(smooth), view, with_values)
    }

    pub(super) fn take(
        (scene, rays): (&Scene, u64),
        radiosity: &[f64],
        smooth: Option<&Smooth>,
        view: &View,
        with_values: bool,
    ) -> Self {
        let camera = Studio::camera(scene, radiosity, view);
        let studio = Studio::expose(scene, radiosity, smooth, (camera, rays), view);
        let (picture, values) = studio.develop(with_values);
        Photo { picture, values, shot: studio.shot() }
    }
}

/// B of every face [W/m²], the channels of a face side by side; E for a face without an estimate.
fn shown(estimates: &Estimates) -> Vec<f64> {
    let channels = estimates.scene().channels();
    let shown = estimates.iter().flat_map(|(_, face, known)| {
        let shown = move |c| known.map_or(face.emittance[c], |known| known[c].radiosity);
        (0..channels).map(shown)
    });
    shown.collect()
}

impl Picture {
    /// Renders a scene from the side that shows most of it. `radiosity` is B of every patch [W/m²], the channels of
    /// a patch side by side.
    ///
    /// The same arguments give the same picture.
    pub fn render(scene: &Scene, radiosity: &[f64]) -> Self {
        Photo::take((scene, 0), radiosity, None, &View::default(), false).picture
    }
}

impl Shot {
    /// How a picture would be taken that is not drawn: the exposure is measured on every [`COARSE`]th pixel of every such row.
    pub fn aim(estimates: &Estimates, view: &View) -> Self {
        let (scene, radiosity) = (estimates.scene(), shown(estimates));
        let camera = Studio::camera(scene, &radiosity, view);
        let coarse = Studio::expose(scene, &radiosity, None, (camera.coarser(COARSE), 0), view);
        Shot { size: camera.size, ..coarse.shot() }
    }
}
