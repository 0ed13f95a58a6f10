//! View3D's input: vertices, and surfaces of three or four of them (G. N. Walton, NISTIR 6925; `doc/view3d-manual.tex` of View3D).
//!
//! A line is `V` number x y z, or `S` number v1 v2 v3 v4 base cmb emit name, v4 being 0 in a triangle; `O` is a surface that obstructs
//! alone. The front is where corners run counter-clockwise. Each surface is a face of the mesh, together with those that are combined with it; its
//! emissivity is 1 − reflectance. Surfaces that mask others or lie on others are refused.

use std::collections::HashMap;
use std::path::Path;

use glam::DVec3;
use radiosity::Sides;

use crate::error::{Error, FileSpot, UnplacedError};
use crate::mesh::{Material, Mesh, MeshParts, Triangle};
use crate::room::room;
use crate::text::{LogicalLines, name, number, numbers, words};

/// Reads a file of View3D.
pub(crate) fn read(path: &Path, content: &[u8]) -> Result<Mesh, Error> {
    let mut reader = Vs3Reader::default();
    let mut lines = LogicalLines::new(content);
    while let Some((number, line)) = lines.next() {
        let ended = reader.line(line, number).map_err(|fault| fault.at(path, FileSpot::Line(number)))?;
        if ended {
            break;
        }
    }
    Ok(reader.mesh)
}

#[derive(Default)]
struct Vs3Reader {
    mesh: Mesh,
    parts: MeshParts,
    /// The materials by the bits of their emissivity.
    materials: HashMap<u64, u32>,
    /// The part and face of each surface, in the order of their numbers.
    surfaces: Vec<(u32, u32)>,
}

impl Vs3Reader {
    /// Reads a line; true where it is the last.
    fn line(&mut self, line: &[u8], number: usize) -> Result<bool, UnplacedError> {
        let mut words = words(line);
        let Some(first) = words.next() else { return Ok(false) };
        match first.to_ascii_uppercase().as_slice() {
            b"V" => self.vertex(&mut words)?,
            b"S" | b"O" => self.surface(&mut words, number)?,
            b"F" => match words.next() {
                Some(b"3") => {}
                other => return Err(other_geometry(other)),
            },
            b"M" | b"N" => return Err(composed("masks and null surfaces")),
            word if word[0] == b'E' => return Ok(true),
            // Title, control values, remarks.
            _ => {}
        }
        Ok(false)
    }

    fn vertex<'a>(&mut self, words: &mut impl Iterator<Item = &'a [u8]>) -> Result<(), UnplacedError> {
        let [place, x, y, z] = numbers(words)?;
        let next = self.mesh.positions.len() + 1;
        if place != next as f64 {
            return Err(out_of_order("vertex", next, place));
        }
        self.mesh.positions.push(DVec3::new(x, y, z));
        Ok(())
    }

    fn surface<'a>(
        &mut self,
        words: &mut impl Iterator<Item = &'a [u8]>,
        line: usize,
    ) -> Result<(), UnplacedError> {
        let [_, v1, v2, v3, v4, base, combined] = numbers(words)?;
        if base != 0.0 {
            return Err(composed("surfaces with a base"));
        }
        let emissivity = number(words.next())?;
        let title = words.next().map_or_else(|| format!("surface {}", self.surfaces.len() + 1), name);
        let corners = [v1, v2, v3].map(|vertex| self.corner(vertex));
        let [a, b, c] = [corners[0].clone()?, corners[1].clone()?, corners[2].clone()?];
        let material = self.material(emissivity)?;
        let (part, face) = if combined == 0.0 {
            self.parts.enter(&mut self.mesh, &title);
            self.parts.next_face(&mut self.mesh, &title)
        } else {
            self.combined(combined)?
        };
        self.surfaces.push((part, face));
        let triangle = |corners| Triangle { corners, part, face, material, line: line as u32 };
        self.mesh.triangles.push(triangle([a, b, c]));
        if v4 != 0.0 {
            let d = self.corner(v4)?;
            self.mesh.triangles.push(triangle([a, c, d]));
        }
        room(&self.mesh)
    }

    /// The part and face of a surface that is written above, by its number.
    fn combined(&self, surface: f64) -> Result<(u32, u32), UnplacedError> {
        let known = self.surfaces.len();
        let fits = surface.fract() == 0.0 && (1.0..=known as f64).contains(&surface);
        fits.then(|| self.surfaces[surface as usize - 1]).ok_or_else(|| {
            UnplacedError::new(
                format!("there is no surface {surface} to combine with"),
                format!("{known} are written above"),
                "combine surfaces with one of a lower number",
            )
        })
    }

    /// The index of a vertex that is written above.
    fn corner(&self, vertex: f64) -> Result<u32, UnplacedError> {
        let known = self.mesh.positions.len();
        let fits = vertex.fract() == 0.0 && (1.0..=known as f64).contains(&vertex);
        fits.then(|| vertex as u32 - 1).ok_or_else(|| {
            UnplacedError::new(
                format!("there is no vertex {vertex}"),
                format!("{known} are written above"),
                "write vertices first, and count them from 1",
            )
        })
    }

    fn material(&mut self, emissivity: f64) -> Result<u32, UnplacedError> {
        if !(0.0..=1.0).contains(&emissivity) {
            return Err(UnplacedError::new(
                format!("the emissivity is {emissivity}"),
                "surfaces emit at most what a black one does",
                "write a number from 0 to 1",
            ));
        }
        let mesh = &mut self.mesh;
        Ok(*self.materials.entry(emissivity.to_bits()).or_insert_with(|| {
            let (reflectance, sides) = ((1.0 - emissivity).into(), Some(Sides::Front));
            let material = Material::unknown(format!("emissivity {emissivity}"));
            mesh.materials.push(Material { reflectance, sides, ..material });
            mesh.materials.len() as u32 - 1
        }))
    }
}

fn other_geometry(format: Option<&[u8]>) -> UnplacedError {
    let format = name(format.unwrap_or_default());
    UnplacedError::new(
        format!("the geometry is of format {format:?}"),
        "vertices and surfaces of three dimensions are format 3",
        "convert the file to `F 3`",
    )
}

fn composed(what: &str) -> UnplacedError {
    UnplacedError::new(
        format!("{what} are not read"),
        "each surface stands for itself",
        "write what is seen of a surface as surfaces of its own",
    )
}

fn out_of_order(what: &str, expected: usize, found: f64) -> UnplacedError {
    UnplacedError::new(
        format!("{what} {found} is out of order"),
        format!("the next is {expected}"),
        "number them from 1 without gaps",
    )
}
