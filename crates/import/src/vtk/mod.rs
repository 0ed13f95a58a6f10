//! VTK: unstructured grids and polygons of the XML formats (`.vtu`, `.vtp`) and of the legacy format (`.vtk`), in text and in every binary
//! encoding but LZ4 and LZMA (*VTK File Formats*, VTK 9).
//!
//! This reader is written here: the crate `vtkio` reads XML by a copy of `quick-xml` that no registry has. A cell array of facet ids puts
//! cells of one number into one face, and faces are in the order of their numbers.

mod cells;
mod encoded;
mod legacy;
mod xml;

use std::path::Path;

use crate::error::Error;
use crate::mesh::Mesh;

/// Reads a file of VTK, by its first line of the legacy format or of the XML formats.
pub(crate) fn read(path: &Path, content: &[u8]) -> Result<Mesh, Error> {
    match content.starts_with(b"# vtk") {
        true => legacy::read(path, content),
        false => xml::read(path, content),
    }
}
