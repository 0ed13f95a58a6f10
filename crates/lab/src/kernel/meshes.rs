//! Scenes from mesh files.

use std::path::Path;

use radiosity::{SceneSpec, Spectrum};

use super::Failure;

/// The scene of a mesh file in grey, with the light that a run gives it: of each spectrum the mean of its channels.
pub fn grey_scene(path: &Path) -> Result<SceneSpec, Failure> {
    let mut spec = job::load_as_written(path, &[])?.scene.spec().clone();
    let grey = |spectrum: Spectrum| Spectrum::from(spectrum.channels().iter().sum::<f64>() / 3.0);
    for surface in &mut spec.surfaces {
        (surface.reflectance, surface.emittance) = (grey(surface.reflectance), grey(surface.emittance));
        surface.transmittance = grey(surface.transmittance);
    }
    Ok(spec)
}
