//! The mesh that every reader makes: triangles with materials and names, in the units and axes of the file.

use std::borrow::Cow;
use std::collections::HashMap;

use glam::DVec3;
use radiosity::{Sides, Spectrum, lamps::LampsSpec};

/// The most triangles that a mesh may have. A scene takes 1.3 kB for each (`docs/results/reading.md`): some 22 GB.
pub const MAX_TRIANGLES: usize = 1 << 24;

/// The most bytes of a part's name: every surface of the part holds one.
const LONGEST_NAME: usize = 200;

/// The triangles of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertices in the units and axes of the file, transforms of nodes applied.
    pub positions: Vec<DVec3>,
    /// Triangles in the order of the file's faces.
    pub triangles: Vec<Triangle>,
    /// The names of objects, groups or nodes.
    pub parts: Vec<String>,
    /// The materials, also those that no triangle has.
    pub materials: Vec<Material>,
    /// Lamps without area, in the units and axes of the file.
    pub lamps: LampsSpec,
    /// The parts of the file that were left out or changed, a sentence each.
    pub notes: Vec<String>,
    /// Whether the light of the file is in lumens.
    pub luminous: bool,
    /// The unit that the file says to be written in, and its length [m].
    pub unit: Option<(&'static str, f64)>,
}

impl Mesh {
    /// The corners of a triangle.
    pub(crate) fn corners(&self, triangle: &Triangle) -> [DVec3; 3] {
        triangle.corners.map(|corner| self.positions[corner as usize])
    }

    /// The area of a triangle, in squares of the unit that positions have.
    pub(crate) fn area(&self, triangle: &Triangle) -> f64 {
        let [a, b, c] = self.corners(triangle);
        0.5 * (b - a).cross(c - a).length()
    }
}

/// One triangle; its front is where its corners run counter-clockwise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Triangle {
    /// The indices of the corners' positions.
    pub corners: [u32; 3],
    /// The index of the triangle's part.
    pub part: u32,
    /// The number of its face within the part, from 0. Triangles of one polygon share it.
    pub face: u32,
    /// The index of the triangle's material.
    pub material: u32,
    /// The line of its face, from 1; 0 if the file has no lines.
    pub line: u32,
}

/// The diffuse part of a material.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// The name that `[import.material]` knows it by.
    pub name: String,
    /// Reflectance as written, perhaps 1 or more.
    pub reflectance: Spectrum,
    /// Emittance [W/m²] of each active side.
    pub emittance: Spectrum,
    /// The power [W] of all faces together, in place of the emittance; `None` where the emittance holds.
    pub power: Option<Spectrum>,
    /// The active sides; `None` if the file does not say.
    pub sides: Option<Sides>,
    /// The file or the name of the texture whose mean is in the reflectance; `None` without one.
    pub texture: Option<String>,
    /// The parts of the material that its diffuse part leaves out.
    pub lost: Vec<LostProperty>,
}

/// A property of a material that the import drops or approximates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LostProperty {
    /// Nothing defines the material: its reflectance is [`DEFAULT_REFLECTANCE`].
    Definition,
    /// A colour texture cannot be read: the colour stands alone.
    Texture,
    /// Most light passes the material as if it were not there.
    Clearness,
    /// Some light passes the material.
    Transparency,
    /// Light is reflected as by a mirror: by gloss or by metal.
    Mirror,
    /// The emission varies over the faces: its mean is taken.
    EmissionTexture,
    /// No red, green and blue make the colour.
    Saturation,
    /// The colour is meant to be shown as it is, whatever light falls on it.
    Unlit,
}

/// The reflectance of faces whose file gives none.
pub const DEFAULT_REFLECTANCE: f64 = 0.5;

impl Material {
    /// A grey material of [`DEFAULT_REFLECTANCE`].
    pub fn unknown(name: impl Into<String>) -> Self {
        Material {
            name: name.into(),
            reflectance: DEFAULT_REFLECTANCE.into(),
            emittance: Spectrum::BLACK,
            power: None,
            sides: None,
            texture: None,
            lost: Vec::new(),
        }
    }

    /// [`Material::unknown`] of a file that should define it.
    pub(crate) fn undefined(name: impl Into<String>) -> Self {
        Material { lost: vec![LostProperty::Definition], ..Material::unknown(name) }
    }

    /// Multiplies the reflectance by the mean of a texture. Without a mean, the texture could not be read.
    pub(crate) fn show(&mut self, texture: String, mean: Option<Spectrum>) {
        self.texture = Some(texture);
        match mean {
            Some(mean) => self.reflectance = product(self.reflectance, mean),
            None => self.loses(LostProperty::Texture),
        }
    }

    /// Multiplies the emittance by the mean of a texture; a black one stands for the texture alone. Without a mean the emittance stays.
    pub(crate) fn shine(&mut self, mean: Option<Spectrum>) {
        if let Some(mean) = mean {
            self.emittance = if self.emittance.is_lit() { product(self.emittance, mean) } else { mean };
        }
        self.loses(LostProperty::EmissionTexture);
    }

    /// Notes a part that is left out, once.
    pub(crate) fn loses(&mut self, what: LostProperty) {
        if !self.lost.contains(&what) {
            self.lost.push(what);
        }
    }

    /// Notes that a part of the light passes, in [0, 1].
    pub(crate) fn passes(&mut self, part: f64) {
        // What passes less is rather a surface than nothing.
        const CLEAR: f64 = 0.5;
        match part {
            part if part > CLEAR => self.loses(LostProperty::Clearness),
            part if part > 0.0 => self.loses(LostProperty::Transparency),
            _ => {}
        }
    }
}

fn product(a: Spectrum, b: Spectrum) -> Spectrum {
    Spectrum::rgb([0, 1, 2].map(|channel| a[channel] * b[channel]))
}

/// Numbers names in the order of their first use.
#[derive(Debug, Default)]
pub(crate) struct Names {
    numbers: HashMap<String, u32>,
}

impl Names {
    pub(crate) fn get(&self, name: &str) -> Option<u32> {
        self.numbers.get(name).copied()
    }

    /// The number of a name, and whether it is new.
    pub(crate) fn number(&mut self, name: &str) -> (u32, bool) {
        if let Some(number) = self.get(name) {
            return (number, false);
        }
        let number = self.numbers.len() as u32;
        self.numbers.insert(name.to_owned(), number);
        (number, true)
    }
}

/// The parts of a mesh, each of which counts its own faces.
#[derive(Debug, Default)]
pub(crate) struct MeshParts {
    names: Names,
    faces: Vec<u32>,
    current: Option<u32>,
    /// Whether a name was longer than names of parts may be.
    cut: bool,
}

impl MeshParts {
    /// Makes a part the current one, new or known.
    pub(crate) fn enter(&mut self, mesh: &mut Mesh, name: &str) {
        let short = short(name);
        if short.len() < name.len() && !self.cut {
            self.cut = true;
            mesh.notes.push(format!("names of parts are cut behind {LONGEST_NAME} bytes, such as {short}"));
        }
        let (number, new) = self.names.number(&short);
        if new {
            mesh.parts.push(visible(&short));
            self.faces.push(0);
        }
        self.current = Some(number);
    }

    /// The current part and the number of its next face; `default` names the part where none was entered.
    pub(crate) fn next_face(&mut self, mesh: &mut Mesh, default: &str) -> (u32, u32) {
        if self.current.is_none() {
            self.enter(mesh, default);
        }
        let part = self.current.expect("a part, as just entered");
        let count = &mut self.faces[part as usize];
        let face = *count;
        *count += 1;
        (part, face)
    }
}

/// A name, cut if it is longer than names of parts may be. Parts whose names begin alike up to there become one.
pub(crate) fn short(name: &str) -> Cow<'_, str> {
    if name.len() <= LONGEST_NAME {
        return name.into();
    }
    let end = (0..=LONGEST_NAME - '…'.len_utf8()).rev().find(|&end| name.is_char_boundary(end));
    format!("{}…", &name[..end.unwrap_or(0)]).into()
}

/// A name without characters that would break a line.
fn visible(name: &str) -> String {
    name.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}
