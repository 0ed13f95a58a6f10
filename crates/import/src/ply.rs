//! PLY, ASCII and binary of both byte orders: vertices and the faces that list them.
//!
//! This reader is written here rather than taken from a crate, since refusals name the line, and a million faces are
//! read in a second.

use std::path::Path;

use glam::DVec3;
use radiosity::Spectrum;

use crate::bytes::Bytes;
use crate::error::{Error, FileSpot, UnplacedError};
use crate::mesh::{Material, Mesh, Triangle};
use crate::tally::NoteCounts;
use crate::text::{name, number, words};
use crate::texture;

/// The encoding of numbers in the body.
#[derive(Clone, Copy, Debug, PartialEq)]
enum PlyEncoding {
    Ascii,
    Little,
    Big,
}

/// The type of a number.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    /// A colour's value as a part of 1: integers have 255 levels, those of 16 bits 65,535.
    fn part(self, value: f64) -> f64 {
        match self {
            Scalar::F32 | Scalar::F64 => value,
            Scalar::U16 => value / 65_535.0,
            _ => value / 255.0,
        }
    }
}

#[derive(Debug)]
struct PlyProperty {
    name: Vec<u8>,
    /// The type of the list's length; `None` for a single number.
    length: Option<Scalar>,
    scalar: Scalar,
}

#[derive(Debug)]
struct Element {
    name: Vec<u8>,
    count: u64,
    properties: Vec<PlyProperty>,
}

struct PlyHeader {
    encoding: PlyEncoding,
    elements: Vec<Element>,
    /// The number of lines in the header.
    lines: usize,
    /// The place where the data begin.
    end: usize,
}

/// Reads a PLY file.
pub(crate) fn read(path: &Path, content: &[u8]) -> Result<Mesh, Error> {
    let header = header(content).map_err(|(line, fault)| fault.at(path, FileSpot::Line(line)))?;
    let mut numbers = PlyNumbers {
        encoding: header.encoding,
        bytes: Bytes::new(&content[header.end..]),
        words: Box::new(words_of(&content[header.end..], header.lines)),
        line: header.lines,
    };
    let mut body =
        PlyBody { mesh: Mesh { parts: vec![crate::stem(path)], ..Mesh::default() }, ..PlyBody::default() };
    // Elements without properties take no room in the file, however many it announces.
    for element in header.elements.iter().filter(|element| !element.properties.is_empty()) {
        for item in 0..element.count {
            let done = body.item(element, item as u32, &mut numbers);
            done.map_err(|fault| fault.at(path, numbers.spot(element, item)))?;
        }
    }
    body.finish(&header).map_err(|fault| fault.at(path, FileSpot::File))
}

/// The words of a text with their lines; `above` lines precede the text.
fn words_of(text: &[u8], above: usize) -> impl Iterator<Item = (usize, &[u8])> {
    let lines = (above + 1..).zip(text.split(|&byte| byte == b'\n'));
    lines.flat_map(|(number, line)| words(line).map(move |word| (number, word)))
}

fn header(content: &[u8]) -> Result<PlyHeader, (usize, UnplacedError)> {
    let mut header = PlyHeader { encoding: PlyEncoding::Ascii, elements: Vec::new(), lines: 0, end: 0 };
    loop {
        let rest = &content[header.end..];
        let Some(length) = rest.iter().position(|&byte| byte == b'\n') else {
            return Err((header.lines + 1, UnplacedError::short()));
        };
        header.end += length + 1;
        header.lines += 1;
        let line = rest[..length].trim_ascii();
        if header.lines == 1 && line != b"ply" {
            return Err((
                1,
                UnplacedError::new(
                    "this is no PLY file",
                    "those begin with the line `ply`",
                    "check its name",
                ),
            ));
        }
        if line == b"end_header" {
            return Ok(header);
        }
        header.statement(line).map_err(|fault| (header.lines, fault))?;
    }
}

impl PlyHeader {
    fn statement(&mut self, line: &[u8]) -> Result<(), UnplacedError> {
        let words: Vec<&[u8]> = words(line).collect();
        match words.as_slice() {
            [b"format", encoding, _] => self.encoding = read_encoding(encoding)?,
            [b"element", name, count] => {
                let count = std::str::from_utf8(count).ok().and_then(|count| count.parse::<u32>().ok());
                let count = count.ok_or_else(|| wrong(line))?.into();
                self.elements.push(Element { name: name.to_vec(), count, properties: Vec::new() });
            }
            [b"property", b"list", length, scalar, name] => {
                let (length, scalar) = (read_scalar(length)?, read_scalar(scalar)?);
                self.property(line, PlyProperty { name: name.to_vec(), length: Some(length), scalar })?;
            }
            [b"property", scalar, name] => {
                let scalar = read_scalar(scalar)?;
                self.property(line, PlyProperty { name: name.to_vec(), length: None, scalar })?;
            }
            [b"ply" | b"comment" | b"obj_info", ..] | [] => {}
            _ => return Err(wrong(line)),
        }
        Ok(())
    }

    fn property(&mut self, line: &[u8], property: PlyProperty) -> Result<(), UnplacedError> {
        self.elements.last_mut().ok_or_else(|| wrong(line))?.properties.push(property);
        Ok(())
    }
}

fn wrong(line: &[u8]) -> UnplacedError {
    UnplacedError::new(
        format!("{:?} is no line of a PLY header", name(line)),
        "it has format, element and property lines",
        "export the file again",
    )
}

fn read_encoding(word: &[u8]) -> Result<PlyEncoding, UnplacedError> {
    match word {
        b"ascii" => Ok(PlyEncoding::Ascii),
        b"binary_little_endian" => Ok(PlyEncoding::Little),
        b"binary_big_endian" => Ok(PlyEncoding::Big),
        _ => Err(wrong(word)),
    }
}

fn read_scalar(word: &[u8]) -> Result<Scalar, UnplacedError> {
    match word {
        b"char" | b"int8" => Ok(Scalar::I8),
        b"uchar" | b"uint8" => Ok(Scalar::U8),
        b"short" | b"int16" => Ok(Scalar::I16),
        b"ushort" | b"uint16" => Ok(Scalar::U16),
        b"int" | b"int32" => Ok(Scalar::I32),
        b"uint" | b"uint32" => Ok(Scalar::U32),
        b"float" | b"float32" => Ok(Scalar::F32),
        b"double" | b"float64" => Ok(Scalar::F64),
        _ => Err(UnplacedError::new(
            format!("unknown type {:?}", name(word)),
            "PLY has char to uint, float and double",
            "export the file again",
        )),
    }
}

/// The numbers after the header, one by one.
struct PlyNumbers<'a> {
    encoding: PlyEncoding,
    bytes: Bytes<'a>,
    words: Box<dyn Iterator<Item = (usize, &'a [u8])> + 'a>,
    /// The line of the last word.
    line: usize,
}

impl PlyNumbers<'_> {
    fn next(&mut self, scalar: Scalar) -> Result<f64, UnplacedError> {
        if self.encoding == PlyEncoding::Ascii {
            let Some((line, word)) = self.words.next() else { return Err(UnplacedError::short()) };
            self.line = line;
            return number(Some(word));
        }
        Ok(match scalar {
            Scalar::I8 => i8::from_le_bytes(self.bytes.take()?).into(),
            Scalar::U8 => u8::from_le_bytes(self.bytes.take()?).into(),
            Scalar::I16 => i16::from_le_bytes(self.ordered()?).into(),
            Scalar::U16 => u16::from_le_bytes(self.ordered()?).into(),
            Scalar::I32 => i32::from_le_bytes(self.ordered()?).into(),
            Scalar::U32 => u32::from_le_bytes(self.ordered()?).into(),
            Scalar::F32 => f32::from_le_bytes(self.ordered()?).into(),
            Scalar::F64 => f64::from_le_bytes(self.ordered()?),
        })
    }

    /// The next bytes, least significant first.
    fn ordered<const N: usize>(&mut self) -> Result<[u8; N], UnplacedError> {
        let mut bytes: [u8; N] = self.bytes.take()?;
        if self.encoding == PlyEncoding::Big {
            bytes.reverse();
        }
        Ok(bytes)
    }

    fn spot(&self, element: &Element, item: u64) -> FileSpot {
        match self.encoding {
            PlyEncoding::Ascii => FileSpot::Line(self.line),
            _ => FileSpot::Element(format!("{} {item}", name(&element.name))),
        }
    }
}

/// What was read from the elements so far.
#[derive(Default)]
struct PlyBody {
    mesh: Mesh,
    tally: NoteCounts,
    /// The corners of the current face.
    corners: Vec<u32>,
    /// The colours of vertices in linear light, where all have some.
    colours: Vec<[f64; 3]>,
    /// The sum of the colours of faces times their areas, in linear light, and the area.
    tint: TintSum,
}

/// A sum of colours by area.
#[derive(Default)]
struct TintSum {
    sums: [f64; 3],
    area: f64,
}

impl TintSum {
    fn add(&mut self, colour: [f64; 3], area: f64) {
        self.area += area;
        self.sums.iter_mut().zip(colour).for_each(|(sum, channel)| *sum += area * channel);
    }

    /// The mean, where there is an area.
    fn mean(&self) -> Option<Spectrum> {
        let has_mean = self.area > 0.0 && self.area.is_finite();
        has_mean.then(|| Spectrum::rgb(self.sums.map(|sum| sum / self.area)))
    }
}

impl PlyBody {
    fn item(
        &mut self,
        element: &Element,
        item: u32,
        numbers: &mut PlyNumbers<'_>,
    ) -> Result<(), UnplacedError> {
        let mut position = DVec3::ZERO;
        let mut colour = [None; 3];
        let triangles = self.mesh.triangles.len();
        self.corners.clear();
        for property in &element.properties {
            if let Some(length) = property.length {
                self.list(property, length, numbers)?;
                continue;
            }
            let value = numbers.next(property.scalar)?;
            match property.name.as_slice() {
                b"x" => position.x = value,
                b"y" => position.y = value,
                b"z" => position.z = value,
                b"red" | b"diffuse_red" => colour[0] = Some(property.scalar.part(value)),
                b"green" | b"diffuse_green" => colour[1] = Some(property.scalar.part(value)),
                b"blue" | b"diffuse_blue" => colour[2] = Some(property.scalar.part(value)),
                _ => {}
            }
        }
        let colour = match colour {
            [Some(red), Some(green), Some(blue)] => Some([red, green, blue].map(texture::linear)),
            _ => None,
        };
        match element.name.as_slice() {
            b"vertex" => {
                self.vertex(position)?;
                self.colours.extend(colour);
            }
            b"face" => {
                self.face(item)?;
                let area = self.mesh.triangles[triangles..].iter().map(|new| self.mesh.area(new)).sum();
                colour.into_iter().for_each(|colour| self.tint.add(colour, area));
            }
            _ => {}
        }
        Ok(())
    }

    /// Reads a list, and keeps that of a face's vertices.
    fn list(
        &mut self,
        property: &PlyProperty,
        length: Scalar,
        numbers: &mut PlyNumbers<'_>,
    ) -> Result<(), UnplacedError> {
        let is_face = matches!(property.name.as_slice(), b"vertex_indices" | b"vertex_index");
        for _ in 0..numbers.next(length)?.max(0.0) as u64 {
            let value = numbers.next(property.scalar)?;
            if is_face {
                // No mesh has a vertex u32::MAX: it is refused with those that are too large.
                self.corners.push(if value < 0.0 { u32::MAX } else { value as u32 });
            }
        }
        Ok(())
    }

    fn vertex(&mut self, position: DVec3) -> Result<(), UnplacedError> {
        if !position.is_finite() {
            return Err(UnplacedError::new(
                "a coordinate is not a finite number",
                "nothing can be computed from it",
                "export the file again",
            ));
        }
        self.mesh.positions.push(position);
        Ok(())
    }

    fn face(&mut self, item: u32) -> Result<(), UnplacedError> {
        let count = self.mesh.positions.len();
        if let Some(corner) = self.corners.iter().find(|&&corner| corner as usize >= count) {
            return Err(UnplacedError::new(
                format!("there is no vertex {corner}"),
                format!("{count} are defined, counted from 0"),
                "export the file again",
            ));
        }
        if self.corners.len() < 3 {
            self.tally.count("faces of less than three corners, left out");
            return Ok(());
        }
        let corners = std::mem::take(&mut self.corners);
        self.tally.polygon(&mut self.mesh, &corners, &[], |corners| Triangle {
            corners,
            part: 0,
            face: item,
            material: 0,
            line: 0,
        })
    }

    fn finish(self, header: &PlyHeader) -> Result<Mesh, UnplacedError> {
        let PlyBody { mut mesh, tally, colours, tint, .. } = self;
        if header.elements.iter().any(|element| element.name == b"tristrips") {
            return Err(UnplacedError::new(
                "the file has triangle strips",
                "only faces are read",
                "export it with faces",
            ));
        }
        tally.report(&mut mesh);
        let mut material = Material::undefined("default");
        // Faces count where vertices have no colours.
        let means = [
            ("colours of vertices", tint_of_vertices(&mesh, &colours).mean()),
            ("colours of faces", tint.mean()),
        ];
        if let Some((name, mean)) = means.into_iter().find_map(|(name, mean)| Some((name, mean?))) {
            let texture = Some(name.into());
            material = Material { reflectance: mean, texture, ..Material::unknown("default") };
        }
        mesh.materials.push(material);
        Ok(mesh)
    }
}

/// The colours of vertices over the faces of a mesh; none where not all vertices have some. The mean of a colour that varies linearly is
/// that of the corners.
fn tint_of_vertices(mesh: &Mesh, colours: &[[f64; 3]]) -> TintSum {
    let mut tint = TintSum::default();
    let coloured = mesh.triangles.iter().filter(|_| colours.len() == mesh.positions.len());
    for triangle in coloured {
        let area = mesh.area(triangle) / 3.0;
        triangle.corners.iter().for_each(|&corner| tint.add(colours[corner as usize], area));
    }
    tint
}
