//! Meshes that another program holds in memory: arrays of vertices and of triangles.

use std::path::Path;

use glam::DVec3;

use crate::error::{Error, FileSpot, UnplacedError};
use crate::mesh::{MAX_TRIANGLES, Material, Mesh, Triangle};
use crate::stem;

/// Makes a mesh of arrays: `faces` holds indices of `vertices`, counter-clockwise as seen from the front, and `of_face` holds the
/// index of each face's material. `name` stands for the file in messages and names the one part.
///
/// # Errors
/// Arrays without faces, with too many, or of different lengths; indices that lead nowhere, and coordinates that are not finite.
pub fn from_arrays(
    name: &Path,
    vertices: &[[f64; 3]],
    faces: &[[i64; 3]],
    of_face: &[u32],
    materials: Vec<Material>,
) -> Result<Mesh, Error> {
    let whole = |fault: UnplacedError| fault.at(name, FileSpot::File);
    check_counts(faces.len(), of_face.len()).map_err(whole)?;
    let at = |kind: &str, number: usize, fault: UnplacedError| {
        fault.at(name, FileSpot::Element(format!("{kind} {number}")))
    };
    if let Some(bad) = vertices.iter().position(|vertex| vertex.iter().any(|x| !x.is_finite())) {
        let found = format!("{:?} is no point", vertices[bad]);
        return Err(at(
            "vertex",
            bad,
            UnplacedError::new(found, "surfaces lie at finite places", "correct it"),
        ));
    }
    let triangle = |(number, (corners, &material)): (usize, (&[i64; 3], &u32))| {
        let corner = |corner: i64| {
            let found = u32::try_from(corner).ok().filter(|&corner| (corner as usize) < vertices.len());
            found.ok_or_else(|| {
                let (found, count) = (format!("there is no vertex {corner}"), vertices.len());
                let why = format!("there are {count} vertices, numbered from 0");
                at("face", number, UnplacedError::new(found, why, "correct the index"))
            })
        };
        if material as usize >= materials.len() {
            let (found, count) = (format!("there is no material {material}"), materials.len());
            let why = format!("there are {count} materials, numbered from 0");
            return Err(at("face", number, UnplacedError::new(found, why, "correct the index")));
        }
        let [a, b, c] = *corners;
        let corners = [corner(a)?, corner(b)?, corner(c)?];
        Ok(Triangle { corners, part: 0, face: number as u32, material, line: 0 })
    };
    Ok(Mesh {
        positions: vertices.iter().map(|&vertex| DVec3::from_array(vertex)).collect(),
        triangles: faces.iter().zip(of_face).enumerate().map(triangle).collect::<Result<_, _>>()?,
        parts: vec![stem(name)],
        materials,
        ..Mesh::default()
    })
}

fn check_counts(faces: usize, of_face: usize) -> Result<(), UnplacedError> {
    if faces == 0 {
        return Err(UnplacedError::new(
            "there are no faces",
            "light needs surfaces to meet",
            "give triangles",
        ));
    }
    if faces > MAX_TRIANGLES {
        let found = format!("{faces} faces are too many");
        return Err(UnplacedError::new(
            found,
            format!("scenes hold up to {MAX_TRIANGLES}"),
            "simplify the mesh",
        ));
    }
    if faces != of_face {
        let found = format!("{of_face} materials do not fit {faces} faces");
        return Err(UnplacedError::new(
            found,
            "each face has one",
            "give as many indices of materials as faces",
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const VERTICES: [[f64; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

    fn mesh_of(vertices: &[[f64; 3]], faces: &[[i64; 3]], of_face: &[u32]) -> Result<Mesh, String> {
        from_arrays(Path::new("desk"), vertices, faces, of_face, vec![Material::unknown("wood")])
            .map_err(|error| error.to_string())
    }

    #[test]
    fn faces_become_triangles_in_their_order() {
        let mesh = mesh_of(&VERTICES, &[[0, 1, 2], [2, 1, 0]], &[0, 0]).unwrap();
        assert_eq!(mesh.parts, ["desk"]);
        assert_eq!(
            mesh.triangles[1],
            Triangle { corners: [2, 1, 0], part: 0, face: 1, material: 0, line: 0 }
        );
    }

    #[test]
    fn arrays_that_do_not_fit_are_refused_by_element() {
        let nan = [VERTICES[0], [f64::NAN, 0.0, 0.0], VERTICES[2]];
        for (found, expected) in [
            (
                mesh_of(&VERTICES, &[], &[]),
                "desk: there are no faces (light needs surfaces to meet); give triangles",
            ),
            (mesh_of(&VERTICES, &[[0, 1, 2]], &[]), "desk: 0 materials do not fit 1 faces"),
            (
                mesh_of(&VERTICES, &[[0, 1, 3]], &[0]),
                "desk: face 0: there is no vertex 3 (there are 3 vertices",
            ),
            (mesh_of(&VERTICES, &[[0, -1, 2]], &[0]), "desk: face 0: there is no vertex -1"),
            (mesh_of(&VERTICES, &[[0, 1, 2]], &[1]), "desk: face 0: there is no material 1"),
            (mesh_of(&nan, &[[0, 1, 2]], &[0]), "desk: vertex 1: [NaN, 0.0, 0.0] is no point"),
        ] {
            let found = found.unwrap_err();
            assert!(found.starts_with(expected), "{found}");
        }
    }
}
