//! A mesh of arrays.

use std::path::PathBuf;

use import::Material;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use radiosity::{Sides, Spectrum};

use crate::refusal::refuse;

/// Triangles in memory, which a job can be made of.
#[pyclass(name = "Mesh", frozen, module = "radwalk._radwalk")]
pub(crate) struct ArrayMesh {
    pub(crate) name: PathBuf,
    pub(crate) mesh: import::Mesh,
}

/// A material as Python has it: name, reflectance, emittance, and its active sides where they are said.
type PyMaterial = (String, [f64; 3], [f64; 3], Option<u8>);

#[pymethods]
impl ArrayMesh {
    /// A mesh of little-endian bytes: vertices (f64, three a row), faces (i64, three a row), and the index of each face's material
    /// (i64).
    #[new]
    fn new(
        name: PathBuf,
        vertices: &[u8],
        faces: &[u8],
        of_face: &[u8],
        materials: Vec<PyMaterial>,
    ) -> PyResult<Self> {
        let vertices = rows(vertices, f64::from_le_bytes)?;
        let faces = rows(faces, i64::from_le_bytes)?;
        let of_face = numbers(of_face, i64::from_le_bytes)?;
        // A number that is no index becomes one that leads nowhere, which is refused by face.
        let of_face: Vec<u32> = of_face.into_iter().map(|n| u32::try_from(n).unwrap_or(u32::MAX)).collect();
        let materials = materials.into_iter().map(material).collect::<PyResult<_>>()?;
        let mesh = import::from_arrays(&name, &vertices, &faces, &of_face, materials).map_err(refuse)?;
        Ok(ArrayMesh { name, mesh })
    }
}

fn material((name, reflectance, emittance, sides): PyMaterial) -> PyResult<Material> {
    let sides = match sides {
        None => None,
        Some(1) => Some(Sides::Front),
        Some(2) => Some(Sides::Both),
        Some(other) => {
            let message = format!("sides = {other} (a surface has two sides); choose 1 or 2");
            return Err(refuse(message));
        }
    };
    let spectrum = |[r, g, b]: [f64; 3]| match r == g && g == b {
        true => Spectrum::from(r),
        false => Spectrum::rgb([r, g, b]),
    };
    let (reflectance, emittance) = (spectrum(reflectance), spectrum(emittance));
    Ok(Material { reflectance, emittance, sides, ..Material::unknown(name) })
}

fn numbers<T>(bytes: &[u8], read: fn([u8; 8]) -> T) -> PyResult<Vec<T>> {
    let (numbers, rest) = bytes.as_chunks::<8>();
    match rest {
        [] => Ok(numbers.iter().map(|&number| read(number)).collect()),
        _ => Err(PyValueError::new_err("the bytes are no whole numbers of 64 bits each")),
    }
}

fn rows<T: Copy>(bytes: &[u8], read: fn([u8; 8]) -> T) -> PyResult<Vec<[T; 3]>> {
    let numbers = numbers(bytes, read)?;
    let (rows, rest) = numbers.as_chunks::<3>();
    match rest {
        [] => Ok(rows.to_vec()),
        _ => Err(PyValueError::new_err("the numbers are no whole rows of three")),
    }
}
