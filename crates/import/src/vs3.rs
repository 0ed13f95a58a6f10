//! View3D's input: vertices, and surfaces of three or four of them (G. N. Walton, NISTIR 6925; `doc/view3d-manual.tex` of View3D).
//!
//! The first letter of a line tells what it is: `V` number x y z, or `S` number v1 v2 v3 v4 base cmb emit name, v4 being 0 in a triangle; `O` is a
//! surface that obstructs alone, and may end with its vertices. The front is where corners run counter-clockwise. Each surface is a face of the mesh,
//! together with those that are combined with it; its emissivity is 1 − reflectance. Surfaces that mask others or lie on others are refused.

use std::collections::HashMap;
use std::iter::Peekable;
use std::path::Path;

use glam::DVec3;
use radiosity::Sides;

use crate::error::{Error, FileSpot, UnplacedError};
use crate::mesh::{Material, Mesh, MeshParts, Triangle};
use crate::polygon::cut;
use crate::room::room;
use crate::text::{name, numbers, without_mark, words};

/// View3D takes smaller emissivities for this one.
const LEAST_EMISSIVITY: f64 = 0.001;

/// Reads a file of View3D.
pub(crate) fn read(path: &Path, content: &[u8]) -> Result<Mesh, Error> {
    let mut reader = Vs3Reader::default();
    for (line, number) in without_mark(content).split(|&byte| byte == b'\n').zip(1..) {
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
        let mut words = words(line).take_while(|word| !word.starts_with(b"!")).peekable();
        let Some(identifier) = words.next() else { return Ok(false) };
        match identifier[0].to_ascii_uppercase() {
            b'V' => self.vertex(&mut words)?,
            b'S' => self.surface(&mut words, "surface", number)?,
            b'O' => self.surface(&mut words, "obstruction", number)?,
            b'F' => match words.next() {
                Some(b"3") => {}
                other => return Err(other_geometry(other)),
            },
            b'M' | b'N' => return Err(composed("masks and null surfaces")),
            b'E' | b'*' => return Ok(true),
            // Title, control values, remarks, and a transformation that View3D takes no notice of either.
            b'T' | b'C' | b'X' | b'/' => {}
            _ => return Err(unknown(identifier)),
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
        words: &mut Peekable<impl Iterator<Item = &'a [u8]>>,
        kind: &str,
        line: usize,
    ) -> Result<(), UnplacedError> {
        let [place, v1, v2, v3, v4] = numbers(words)?;
        let next = self.surfaces.len() + 1;
        if place != next as f64 {
            return Err(out_of_order("surface", next, place));
        }
        let [base, combined, emissivity] = match kind == "obstruction" && words.peek().is_none() {
            true => [0.0, 0.0, 1.0],
            false => numbers(words)?,
        };
        if base != 0.0 {
            return Err(composed("surfaces with a base"));
        }
        let title = words.next().map_or_else(|| format!("{kind} {next}"), name);
        let listed = if v4 == 0.0 { vec![v1, v2, v3] } else { vec![v1, v2, v3, v4] };
        let corners =
            listed.into_iter().map(|vertex| self.corner(vertex)).collect::<Result<Vec<u32>, _>>()?;
        let points: Vec<DVec3> = corners.iter().map(|&corner| self.mesh.positions[corner as usize]).collect();
        let outline = cut(&points, &[]);
        if outline.crossed {
            return Err(crossed(&title));
        }
        let material = self.material(emissivity)?;
        let (part, face) = if combined == 0.0 {
            self.parts.enter(&mut self.mesh, &title);
            self.parts.next_face(&mut self.mesh, &title)
        } else {
            self.combined(combined)?
        };
        self.surfaces.push((part, face));
        for triangle in outline.triangles {
            let corners = triangle.map(|corner| corners[corner]);
            self.mesh.triangles.push(Triangle { corners, part, face, material, line: line as u32 });
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
        let emissivity = emissivity.max(LEAST_EMISSIVITY);
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

fn unknown(identifier: &[u8]) -> UnplacedError {
    UnplacedError::new(
        format!("a line begins with {:?}", name(identifier)),
        "View3D's lines begin with V, S, O, F, T, C, X, ! or E",
        "correct the line, or begin it with `!`",
    )
}

fn crossed(title: &str) -> UnplacedError {
    UnplacedError::new(
        format!("the outline of {title:?} crosses itself"),
        "its inside is not told",
        "list its corners in the order in which they lie around it",
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
