//! Scenes from mesh files.

use std::fs;
use std::path::Path;

use import::{Files, Format, Options};
use radiosity::{SceneSpec, Spectrum};

use super::Failure;

/// The scene of a mesh file in grey: of each spectrum the mean of its channels.
pub fn grey_scene(path: &Path) -> Result<SceneSpec, Failure> {
    let format = Format::of(path).ok_or("the file's name has no extension of a mesh")?;
    let (options, content) =
        (Options { reflectance_limit: Some(0.95), ..Options::default() }, fs::read(path)?);
    let mut open = |path: &Path| fs::read(path);
    let mesh = import::read(path, &content, format, options.curve_error, &mut Files::new(&mut open))?;
    let mut spec = mesh.into_scene(path, format, &options)?.spec;
    let grey = |spectrum: Spectrum| Spectrum::from(spectrum.channels().iter().sum::<f64>() / 3.0);
    for surface in &mut spec.surfaces {
        (surface.reflectance, surface.emittance) = (grey(surface.reflectance), grey(surface.emittance));
    }
    Ok(spec)
}
