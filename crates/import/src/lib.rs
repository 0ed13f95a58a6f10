//! Scenes from mesh files: OBJ with MTL, glTF 2.0 and GLB, STL, PLY, MGF, Mitsuba's XML, View3D, VTK.
//!
//! [`read`] makes a [`Mesh`] of any of them, and [`from_arrays`] of arrays in memory; [`Mesh::into_scene`] turns it into the surfaces of a
//! [`radiosity::SceneSpec`] as [`Options`] ask for. This crate opens no files: the caller passes content in, and
//! [`Files`] reads what a file names. What the radiosity method cannot model (specular reflection, textures,
//! transparency) is reduced to its diffuse part and listed in notes; a fault is one [`Error`] with file and line, or
//! element.

#![warn(unreachable_pub, unnameable_types)]

mod arrays;
mod bytes;
mod clean;
mod error;
mod files;
mod gltf;
mod groups;
mod lamps;
mod mesh;
mod mgf;
mod mitsuba;
mod mtl;
mod notes;
mod obj;
mod options;
mod ply;
mod polygon;
mod room;
mod scale;
mod scene;
mod stl;
mod tally;
mod text;
mod texture;
mod vs3;
mod vtk;

use std::path::Path;

use radiosity::Spectrum;

pub use arrays::from_arrays;
pub use error::{Error, FileSpot};
pub use files::Files;
pub use groups::{GROUP_ANGLE, GroupLimits, groups};
pub use mesh::{DEFAULT_REFLECTANCE, LostProperty, MAX_TRIANGLES, Material, Mesh, Triangle};
pub use notes::setting;
pub use options::{Faults, MaterialOverride, Options, SidesChoice, UpAxis, matches};
pub use scene::{Imported, OpenSides, Spots};

/// The formats of mesh files, chosen by the extension of the file's name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// The format Wavefront OBJ.
    Obj,
    /// The format glTF 2.0, also in its container GLB.
    Gltf,
    /// The format STL, binary or ASCII.
    Stl,
    /// The format PLY, binary or ASCII.
    Ply,
    /// The Materials and Geometry Format, MGF.
    Mgf,
    /// The XML of Mitsuba, as far as it is diffuse.
    Mitsuba,
    /// The vertices and surfaces of View3D.
    View3d,
    /// The formats of VTK: unstructured grids and polygons.
    Vtk,
}

impl Format {
    /// The format of a file by its name; `None` if it is none of these.
    pub fn of(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_lowercase().as_str() {
            "obj" => Some(Format::Obj),
            "gltf" | "glb" => Some(Format::Gltf),
            "stl" => Some(Format::Stl),
            "ply" => Some(Format::Ply),
            "mgf" => Some(Format::Mgf),
            "xml" => Some(Format::Mitsuba),
            "vs3" => Some(Format::View3d),
            "vtk" | "vtp" | "vtu" => Some(Format::Vtk),
            _ => None,
        }
    }
}

/// What a file begins with that stands for another one in a repository.
const LFS_POINTER: &[u8] = b"version https://git-lfs.github.com/spec/";

/// Reads a mesh. `curve_error` bounds how far the facets of curved MGF surfaces may lie inside them, in parts of the
/// radius.
///
/// # Errors
/// A file that is not of the format, is cut short, or asks for what cannot be modelled.
pub fn read(
    path: &Path,
    content: &[u8],
    format: Format,
    curve_error: f64,
    files: &mut Files<'_>,
) -> Result<Mesh, Error> {
    let content = text::without_mark(content);
    if content.starts_with(LFS_POINTER) {
        let fault = error::UnplacedError::new(
            "the file is a pointer of Git LFS",
            "it names a file that is kept elsewhere",
            "fetch that by `git lfs pull`",
        );
        return Err(fault.at(path, FileSpot::File));
    }
    let mut mesh = match format {
        Format::Obj => obj::read(path, content, files),
        Format::Gltf => gltf::read(path, content, files),
        Format::Stl => stl::read(path, content),
        Format::Ply => ply::read(path, content),
        Format::Mgf => mgf::read(path, content, curve_error, files),
        Format::Mitsuba => mitsuba::read(path, content, files),
        Format::View3d => vs3::read(path, content),
        Format::Vtk => vtk::read(path, content),
    }?;
    if matches!(format, Format::Obj | Format::Ply | Format::Stl) {
        mesh.unit = scale::said_unit(content);
    }
    if mesh.triangles.is_empty() {
        let left_out: String = mesh.notes.iter().map(|note| format!("; {note}")).collect();
        let fault = error::UnplacedError::new(
            format!("the file has no faces{left_out}"),
            "light needs surfaces to meet",
            "export polygons or triangles",
        );
        return Err(fault.at(path, FileSpot::File));
    }
    Ok(mesh)
}

/// The name of a file without its extension: the part that faces without object or group belong to.
fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// A spectrum as messages show it, to four decimals: one number where it is grey.
fn in_words(spectrum: Spectrum) -> String {
    let [red, green, blue] = spectrum.channels().map(|channel| (1e4 * channel).round() / 1e4);
    if spectrum.is_grey() { format!("{red}") } else { format!("[{red}, {green}, {blue}]") }
}
