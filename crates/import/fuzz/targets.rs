// The fuzz targets of the readers: whatever a file holds, a reader must not panic, run for ever or take memory without
// end.

use std::io;
use std::path::Path;

use import::{Faults, Files, Format, Options};
use radiosity::{IndexChoice, Scene};

/// Reads some content, and builds the scene if there is one. The bytes after a NUL are the content of every file that
/// the first part names.
fn mesh(content: &[u8], format: Format) {
    let (content, named) = match content.iter().position(|&byte| byte == 0) {
        Some(end) if matches!(format, Format::Obj | Format::Mgf | Format::Mitsuba) => {
            (&content[..end], &content[end + 1..])
        }
        _ => (content, &[][..]),
    };
    let mut open = |_: &Path| match named {
        [] => Err(io::Error::from(io::ErrorKind::NotFound)),
        named => Ok(named.to_vec()),
    };
    let path = Path::new("fuzz");
    let Ok(mesh) = import::read(path, content, format, 0.1, &mut Files::new(&mut open)) else { return };
    let options =
        Options { join: true, reflectance_limit: Some(0.9), faults: Faults::Report, ..Options::default() };
    let Ok(imported) = mesh.into_scene(path, format, &options) else { return };
    if imported.spec.surfaces.len() < 10_000 {
        let _ = Scene::build(&imported.spec, IndexChoice::Auto);
    }
}

pub fn obj(content: &[u8]) {
    mesh(content, Format::Obj);
}

pub fn gltf(content: &[u8]) {
    mesh(content, Format::Gltf);
}

pub fn stl(content: &[u8]) {
    mesh(content, Format::Stl);
}

pub fn ply(content: &[u8]) {
    mesh(content, Format::Ply);
}

pub fn mgf(content: &[u8]) {
    mesh(content, Format::Mgf);
}

pub fn mitsuba(content: &[u8]) {
    mesh(content, Format::Mitsuba);
}

pub fn vs3(content: &[u8]) {
    mesh(content, Format::View3d);
}

pub fn vtk(content: &[u8]) {
    mesh(content, Format::Vtk);
}
