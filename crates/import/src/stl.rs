//! STL, binary and ASCII: bare triangles.

use std::cmp::Ordering;
use std::path::Path;

use glam::DVec3;

use crate::bytes::Bytes;
use crate::error::{Error, FileSpot, UnplacedError};
use crate::mesh::{Material, Mesh, MeshParts, Triangle};
use crate::room::room;
use crate::text::{LogicalLines, name, numbers, rest, words};

/// The bytes before the first triangle of a binary file, its count included.
const HEADER: usize = 84;

/// The bytes of a triangle in a binary file: normal, three corners, an attribute.
const RECORD: usize = 50;

/// Reads an STL file.
pub(crate) fn read(path: &Path, content: &[u8]) -> Result<Mesh, Error> {
    let stem = crate::stem(path);
    let mut mesh = match is_binary(content) {
        true => binary(content, &stem).map_err(|fault| fault.at(path, FileSpot::File))?,
        false => ascii(content, &stem).map_err(|(line, fault)| fault.at(path, FileSpot::Line(line)))?,
    };
    mesh.materials.push(Material::undefined("default"));
    Ok(mesh)
}

/// Whether a file is binary. Binary files may begin with `solid`, too, so the length decides; more bytes may follow the last
/// triangle, where no word `facet` makes a text of them.
fn is_binary(content: &[u8]) -> bool {
    let announced =
        content.get(80..HEADER).map(|count| u32::from_le_bytes(count.try_into().expect("4 bytes")));
    let length = announced.map(|count| HEADER as u64 + RECORD as u64 * u64::from(count));
    let has = |text: &[u8], word: &[u8]| text.windows(word.len()).any(|part| part.eq_ignore_ascii_case(word));
    let start = content.trim_ascii_start();
    let is_solid = has(&start[..start.len().min(5)], b"solid");
    match length.map(|length| length.cmp(&(content.len() as u64))) {
        Some(Ordering::Equal) => true,
        Some(Ordering::Less) => !is_solid || !has(content, b"facet"),
        _ => !is_solid,
    }
}

fn binary(content: &[u8], stem: &str) -> Result<Mesh, UnplacedError> {
    let mut bytes = Bytes::new(content.get(80..).ok_or_else(UnplacedError::short)?);
    let count = u32::from_le_bytes(bytes.take()?) as usize;
    if bytes.len() < count.saturating_mul(RECORD) {
        return Err(UnplacedError::short());
    }
    let mut mesh = Mesh { parts: vec![stem.into()], ..Mesh::default() };
    for face in 0..count as u32 {
        bytes.skip(12)?;
        for _ in 0..3 {
            let corner = [bytes.take()?, bytes.take()?, bytes.take()?].map(f32::from_le_bytes);
            let corner = DVec3::from_array(corner.map(f64::from));
            if !corner.is_finite() {
                return Err(not_finite(face));
            }
            mesh.positions.push(corner);
        }
        bytes.skip(2)?;
        push(&mut mesh, 0, face, 0)?;
    }
    Ok(mesh)
}

/// Adds the triangle of the last three positions.
fn push(mesh: &mut Mesh, part: u32, face: u32, line: u32) -> Result<(), UnplacedError> {
    let end = mesh.positions.len() as u32;
    mesh.triangles.push(Triangle { corners: [end - 3, end - 2, end - 1], part, face, material: 0, line });
    room(mesh)
}

fn ascii(content: &[u8], stem: &str) -> Result<Mesh, (usize, UnplacedError)> {
    let (mut mesh, mut parts) = (Mesh::default(), MeshParts::default());
    let (mut facet, mut corners) = (0, 0);
    let mut lines = LogicalLines::new(content);
    while let Some((number, line)) = lines.next() {
        let mut arguments = words(line);
        match &*arguments.next().unwrap_or_default().to_ascii_lowercase() {
            b"solid" => parts.enter(
                &mut mesh,
                Some(rest(line)).filter(|name| !name.is_empty()).as_deref().unwrap_or(stem),
            ),
            b"facet" if is_whole(corners) => (facet, corners) = (number, 0),
            b"vertex" => {
                let corner = numbers(&mut arguments).map_err(|fault| (number, fault))?;
                mesh.positions.push(DVec3::from_array(corner));
                corners += 1;
                // Some exporters write no end of a facet.
                if corners == 3 {
                    let (part, face) = parts.next_face(&mut mesh, stem);
                    push(&mut mesh, part, face, facet as u32).map_err(|fault| (number, fault))?;
                }
            }
            b"facet" | b"endfacet" if corners != 3 => return Err((number, corner_count(corners))),
            b"outer" | b"endloop" | b"endfacet" | b"endsolid" => {}
            other => return Err((number, unknown(other))),
        }
    }
    if is_whole(corners) { Ok(mesh) } else { Err((facet, corner_count(corners))) }
}

/// Whether a facet has none of its corners, or all.
fn is_whole(corners: u32) -> bool {
    matches!(corners, 0 | 3)
}

fn not_finite(face: u32) -> UnplacedError {
    UnplacedError::new(
        format!("a corner of face {face} is not a finite number"),
        "nothing can be computed from it",
        "export the file again",
    )
}

fn corner_count(corners: u32) -> UnplacedError {
    UnplacedError::new(
        format!("a facet of {corners} corners"),
        "facets are triangles",
        "export the file again",
    )
}

fn unknown(word: &[u8]) -> UnplacedError {
    UnplacedError::new(
        format!("unknown statement {:?}", name(word)),
        "ASCII STL has solid, facet, outer loop, vertex, endloop, endfacet, endsolid",
        "export the file again",
    )
}
