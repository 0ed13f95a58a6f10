//! Meshes that Draco compresses (KHR_draco_mesh_compression).

use std::collections::HashMap;
use std::rc::Rc;

use draco_core::{DataType, DecodeLimits, DecoderBuffer, Mesh, MeshDecoder};

use super::WITHOUT_EXTENSIONS;
use super::buffers::Data;
use crate::error::UnplacedError;

/// The most bytes that the vertices of a compressed mesh may take.
const MOST_BYTES: u64 = 1 << 29;

/// The compressed meshes of a file that were unpacked, by the numbers of their views.
#[derive(Default)]
pub(super) struct Unpacked {
    meshes: HashMap<usize, Rc<Mesh>>,
}

impl Unpacked {
    /// Unpacks a mesh of at most `most` triangles, or finds it unpacked.
    pub(super) fn mesh(
        &mut self,
        data: &Data<'_>,
        view: usize,
        most: u64,
    ) -> Result<Rc<Mesh>, UnplacedError> {
        if let Some(known) = self.meshes.get(&view) {
            return Ok(known.clone());
        }
        let bytes = data.view(view).ok_or_else(UnplacedError::short)?;
        let limits = DecodeLimits::default()
            .with_max_points(3 * most)
            .with_max_faces(most)
            .with_max_decoded_bytes(MOST_BYTES);
        let mut mesh = Mesh::new();
        let decoded =
            MeshDecoder::new().decode(&mut DecoderBuffer::new(bytes).with_limits(limits), &mut mesh);
        decoded.map_err(|error| {
            let problem = format!("its compressed mesh (Draco) cannot be read: {error}");
            UnplacedError::new(problem, "it has no triangles", WITHOUT_EXTENSIONS)
        })?;
        let mesh = Rc::new(mesh);
        self.meshes.insert(view, mesh.clone());
        Ok(mesh)
    }
}

/// The values of an attribute at all points, by its number in the compressed mesh; `None` where the mesh has none of that number.
pub(super) fn rows<const N: usize>(mesh: &Mesh, attribute: u32) -> Option<Vec<[f64; N]>> {
    let attribute = mesh.attribute_by_unique_id(attribute)?;
    let values = attribute.read_f32s(mesh.num_points(), N);
    Some(values.chunks_exact(N).map(|row| std::array::from_fn(|i| f64::from(row[i]))).collect())
}

/// The colours at all points, as [`rows`]. Whole numbers are parts of their most.
pub(super) fn colours(mesh: &Mesh, attribute: u32) -> Option<Vec<[f64; 3]>> {
    let most = match mesh.attribute_by_unique_id(attribute)?.data_type() {
        DataType::Uint8 => 255.0,
        DataType::Uint16 => 65_535.0,
        _ => 1.0,
    };
    Some(rows::<3>(mesh, attribute)?.into_iter().map(|row| row.map(|level| level / most)).collect())
}

/// The corners of its triangles.
pub(super) fn triangles(mesh: &Mesh) -> impl Iterator<Item = [u32; 3]> {
    mesh.faces().iter().map(|face| face.map(|point| point.0))
}
