//! Wavefront OBJ: polygons of objects and groups; their materials are in MTL files ([`crate::mtl`]).
//!
//! This reader is written here rather than taken from a crate, since refusals name the line.

use std::path::Path;

use glam::DVec3;

use crate::error::{Error, Fault, Spot};
use crate::files::Files;
use crate::mesh::{Material, Mesh, Names, Parts, Triangle};
use crate::mtl;
use crate::tally::Tally;
use crate::text::{Lines, name, numbers, rest, words};

/// Reads an OBJ file and the MTL files that it names.
pub(crate) fn read(path: &Path, text: &[u8], files: &mut Files<'_>) -> Result<Mesh, Error> {
    let mut reader = Reader { stem: crate::stem(path), ..Reader::default() };
    let mut lines = Lines::new(text);
    while let Some((number, line)) = lines.next() {
        reader.line = number as u32;
        let done = reader.statement(path, line, files);
        done.map_err(|trouble| trouble.at(path, number))?;
    }
    Ok(reader.finish())
}

/// A fault of this file, or an error of one that it names.
enum Trouble {
    Here(Fault),
    There(Error),
}

impl Trouble {
    fn at(self, path: &Path, line: usize) -> Error {
        match self {
            Trouble::Here(fault) => fault.at(path, Spot::Line(line)),
            Trouble::There(error) => error,
        }
    }
}

impl From<Fault> for Trouble {
    fn from(fault: Fault) -> Self {
        Trouble::Here(fault)
    }
}

#[derive(Default)]
struct Reader {
    stem: String,
    line: u32,
    mesh: Mesh,
    parts: Parts,
    object: String,
    group: String,
    materials: Names,
    material: Option<u32>,
    /// The corners of the current face, kept for its allocation.
    corners: Vec<u32>,
    tally: Tally,
}

impl Reader {
    fn statement(&mut self, path: &Path, line: &[u8], files: &mut Files<'_>) -> Result<(), Trouble> {
        let mut arguments = words(line);
        match arguments.next().unwrap_or_default() {
            b"v" => self.mesh.positions.push(DVec3::from_array(numbers(&mut arguments)?)),
            b"f" | b"fo" => self.face(arguments)?,
            b"o" => self.enter(Some(rest(line)), None),
            b"g" => self.enter(None, Some(rest(line))),
            b"usemtl" => self.material = Some(self.material_number(&rest(line))),
            b"mtllib" => self.library(path, &rest(line), files).map_err(Trouble::There)?,
            b"vn" | b"vt" | b"vp" | b"s" => {}
            b"p" | b"l" => self.tally.count("points or lines (they have no area) were left out"),
            b"curv" | b"curv2" | b"surf" => {
                self.tally.count("free-form curves or surfaces were left out: export them as polygons");
            }
            _ => self.tally.count("statements that say nothing of faces were skipped"),
        }
        Ok(())
    }

    /// Enters a part: an object, a group outside of objects, or a group of an object as `object/group`.
    fn enter(&mut self, object: Option<String>, group: Option<String>) {
        if let Some(object) = object {
            self.object = object;
            self.group.clear();
        }
        if let Some(group) = group {
            self.group = group;
        }
        let part = match (self.object.as_str(), self.group.as_str()) {
            ("", "") => self.stem.clone(),
            (object, "") => object.into(),
            ("", group) => group.into(),
            (object, group) => format!("{object}/{group}"),
        };
        self.parts.enter(&mut self.mesh, &part);
    }

    fn face<'a>(&mut self, vertices: impl Iterator<Item = &'a [u8]>) -> Result<(), Fault> {
        self.corners.clear();
        for vertex in vertices {
            let corner = vertex_number(vertex, self.mesh.positions.len())?;
            self.corners.push(corner);
        }
        if self.corners.len() < 3 {
            return Err(Fault::new(
                format!("a face of {} corners", self.corners.len()),
                "a face has three or more",
                "complete or remove the line",
            ));
        }
        let (part, face) = self.parts.next_face(&mut self.mesh, &self.stem);
        let material = match self.material {
            Some(material) => material,
            None => self.material_number("default"),
        };
        self.tally.polygon(&mut self.mesh, &self.corners, &[], |corners| Triangle {
            corners,
            part,
            face,
            material,
            line: self.line,
        })
    }

    /// The number of a material by its name, also of one that no MTL file has defined yet.
    fn material_number(&mut self, name: &str) -> u32 {
        let name = if name.is_empty() { "default" } else { name };
        let (number, new) = self.materials.number(name);
        if new {
            self.mesh.materials.push(Material::unknown(name));
            self.tally.undefined.insert(number);
        }
        number
    }

    /// Reads MTL files. A line may name several files, or one with spaces in its name. A file that was moved may name
    /// them by old paths; then they are looked for beside it.
    fn library(&mut self, path: &Path, line: &str, files: &mut Files<'_>) -> Result<(), Error> {
        let mut found = files.beside(path, line).map(|found| vec![found]);
        if found.is_err() {
            found = line.split_whitespace().map(|file| files.beside(path, file)).collect();
        }
        if found.is_err() {
            let moved = line.rsplit(['/', '\\']).next().unwrap_or(line);
            found = files.beside(path, moved).map(|found| vec![found]);
            if found.is_ok() {
                let note =
                    format!("line {}: {line:?} is not there; {moved:?} beside the file is read", self.line);
                self.mesh.notes.push(note);
            }
        }
        let Ok(found) = found else {
            self.mesh.notes.push(format!(
                "line {}: there is no material library {line:?}, so its materials are unknown",
                self.line
            ));
            return Ok(());
        };
        for (file, text) in found {
            for material in mtl::read(&file, &text)? {
                let (number, new) = self.materials.number(&material.name);
                self.tally.undefined.remove(&number);
                match new {
                    true => self.mesh.materials.push(material),
                    false => self.mesh.materials[number as usize] = material,
                }
            }
        }
        Ok(())
    }

    fn finish(self) -> Mesh {
        let Reader { mut mesh, tally, .. } = self;
        tally.report(&mut mesh);
        mesh
    }
}

/// The index of a face's corner `v`, `v/vt`, `v//vn` or `v/vt/vn`: from 1, or from −1 backwards.
fn vertex_number(word: &[u8], count: usize) -> Result<u32, Fault> {
    let digits = word.split(|&byte| byte == b'/').next().unwrap_or_default();
    let written = std::str::from_utf8(digits).ok().and_then(|digits| digits.parse::<i64>().ok());
    let index = match written {
        Some(number) if number > 0 => Some(number - 1),
        Some(number) if number < 0 => Some(number + count as i64),
        _ => None,
    };
    index.filter(|index| (0..count as i64).contains(index)).map(|index| index as u32).ok_or_else(|| {
        Fault::new(
            format!("there is no vertex {:?}", name(word)),
            format!("{count} are defined above; they count from 1, or back from −1"),
            "correct the number",
        )
    })
}
