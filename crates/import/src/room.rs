//! The most triangles of a mesh: files repeat what they hold, and a small one could ask for any amount.

use crate::error::UnplacedError;
use crate::mesh::{MAX_TRIANGLES, Mesh};

/// Triangles that any file may make, however small it is: read in 2 s, 6 GB as a scene with its tree.
const FREE_TRIANGLES: u64 = 1 << 22;

/// The triangles that a file may make: [`FREE_TRIANGLES`], and one for each of its bytes. Files that repeat nothing need
/// fewer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TriangleBudget {
    bytes: u64,
}

impl TriangleBudget {
    /// The room of a file of `bytes` bytes.
    pub(crate) fn of(bytes: usize) -> Self {
        TriangleBudget { bytes: bytes as u64 }
    }

    /// The most triangles that the file may make.
    pub(crate) fn most(self) -> u64 {
        self.bytes.saturating_add(FREE_TRIANGLES).min(MAX_TRIANGLES as u64)
    }

    /// The reason for the limit, for messages.
    pub(crate) fn why(self) -> String {
        match self.most() == MAX_TRIANGLES as u64 {
            true => too_many(),
            false => {
                format!(
                    "a file of {} bytes may make {}: {FREE_TRIANGLES} and one for each byte",
                    self.bytes,
                    self.most()
                )
            }
        }
    }
}

fn too_many() -> String {
    format!("a mesh has at most {MAX_TRIANGLES}: a scene takes 1.3 kB for each triangle")
}

/// Refuses a mesh that has more triangles or vertices than indices can number.
pub(crate) fn room(mesh: &Mesh) -> Result<(), UnplacedError> {
    if mesh.triangles.len() <= MAX_TRIANGLES && mesh.positions.len() <= 3 * MAX_TRIANGLES {
        return Ok(());
    }
    let problem = format!(
        "the file has more than {MAX_TRIANGLES} triangles, or more than three times as many vertices"
    );
    Err(UnplacedError::new(problem, too_many(), "split or simplify it"))
}
