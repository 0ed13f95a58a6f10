//! Wavefront OBJ: polygons of objects and groups; their materials are in MTL files ([`crate::mtl`]).
//!
//! This reader is written here rather than taken from a crate, since refusals name the line.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::{Path, PathBuf};

use glam::DVec3;

use crate::error::{Error, FileSpot, UnplacedError};
use crate::files::Files;
use crate::mesh::{DEFAULT_REFLECTANCE, Material, Mesh, MeshParts, Names, Triangle};
use crate::mtl::{self, MtlImage};
use crate::tally::NoteCounts;
use crate::text::{LogicalLines, name, number, numbers, rest, words};
use crate::texture::{self, Sampling, TexturedFace};

/// Reads an OBJ file and the MTL files that it names.
pub(crate) fn read(path: &Path, text: &[u8], files: &mut Files<'_>) -> Result<Mesh, Error> {
    let mut reader = ObjReader { stem: crate::stem(path), ..ObjReader::default() };
    let mut lines = LogicalLines::new(text);
    while let Some((number, line)) = lines.next() {
        reader.line = number as u32;
        let done = reader.statement(path, line, files);
        done.map_err(|trouble| trouble.at(path, number))?;
    }
    Ok(reader.finish(files))
}

/// A fault of this file, or an error of one that it names.
enum Trouble {
    Here(UnplacedError),
    There(Error),
}

impl Trouble {
    fn at(self, path: &Path, line: usize) -> Error {
        match self {
            Trouble::Here(fault) => fault.at(path, FileSpot::Line(line)),
            Trouble::There(error) => error,
        }
    }
}

impl From<UnplacedError> for Trouble {
    fn from(fault: UnplacedError) -> Self {
        Trouble::Here(fault)
    }
}

#[derive(Default)]
struct ObjReader {
    stem: String,
    line: u32,
    mesh: Mesh,
    parts: MeshParts,
    object: String,
    group: String,
    materials: Names,
    material: Option<u32>,
    /// The corners of the current face, kept for its allocation.
    corners: Vec<u32>,
    /// Places in images, and those of the current face's corners.
    places: Vec<[f32; 2]>,
    places_of_face: Vec<u32>,
    /// The places of each triangle's corners, as far as faces have some; of a triangle without, [`NOWHERE`].
    placed: Vec<[u32; 3]>,
    /// The images that materials name: the number of the material, the library, colour and emission.
    images: Vec<ObjImages>,
    tally: NoteCounts,
}

/// The corner of a face that names no place in an image.
const NOWHERE: u32 = u32::MAX;

/// The images of a material.
struct ObjImages {
    material: u32,
    library: PathBuf,
    colour: Option<MtlImage>,
    emission: Option<MtlImage>,
}

impl ObjReader {
    fn statement(&mut self, path: &Path, line: &[u8], files: &mut Files<'_>) -> Result<(), Trouble> {
        let mut arguments = words(line);
        match arguments.next().unwrap_or_default() {
            b"v" => self.mesh.positions.push(DVec3::from_array(numbers(&mut arguments)?)),
            b"f" | b"fo" => self.face(arguments)?,
            b"o" => self.enter(Some(rest(line)), None),
            b"g" => self.enter(None, Some(rest(line))),
            b"usemtl" => self.material = Some(self.material_number(&rest(line))),
            b"mtllib" => self.library(path, &rest(line), files).map_err(Trouble::There)?,
            b"vt" => {
                // A place that is no number costs its faces their weights, and no more.
                let part = |word| number(Some(word)).map_or(f32::NAN, |part| part as f32);
                let (u, v) = (arguments.next().map_or(f32::NAN, part), arguments.next().map_or(0.0, part));
                self.places.push([u, v]);
            }
            b"curv" | b"curv2" | b"surf" => {
                self.tally.count("free-form curves or surfaces left out; export them as polygons");
            }
            // Points, lines, and what says nothing of faces.
            _ => {}
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

    fn face<'a>(&mut self, vertices: impl Iterator<Item = &'a [u8]>) -> Result<(), UnplacedError> {
        self.corners.clear();
        self.places_of_face.clear();
        for vertex in vertices {
            let mut numbers = vertex.split(|&byte| byte == b'/');
            let corner = index(numbers.next(), self.mesh.positions.len()).ok_or_else(|| {
                UnplacedError::new(
                    format!("there is no vertex {:?}", name(vertex)),
                    format!(
                        "{} are defined above; they count from 1, or back from −1",
                        self.mesh.positions.len()
                    ),
                    "correct the number",
                )
            })?;
            self.corners.push(corner);
            // Places only weigh images: a number that leads nowhere costs its face that weight.
            self.places_of_face.push(index(numbers.next(), self.places.len()).unwrap_or(NOWHERE));
        }
        if self.corners.len() < 3 {
            self.tally.count("faces of less than three corners, left out");
            return Ok(());
        }
        let (part, face) = self.parts.next_face(&mut self.mesh, &self.stem);
        let material = match self.material {
            Some(material) => material,
            None => self.material_number("default"),
        };
        let first = self.mesh.triangles.len();
        self.tally.polygon(&mut self.mesh, &self.corners, &[], |corners| Triangle {
            corners,
            part,
            face,
            material,
            line: self.line,
        })?;
        if !self.places.is_empty() {
            self.placed.resize(first, [NOWHERE; 3]);
            let place = |corner: u32| {
                let at = self.corners.iter().position(|&known| known == corner);
                at.map_or(NOWHERE, |at| self.places_of_face[at])
            };
            self.placed.extend(self.mesh.triangles[first..].iter().map(|ear| ear.corners.map(place)));
        }
        Ok(())
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

    /// Reads MTL files, and notes those that are not there.
    fn library(&mut self, path: &Path, line: &str, files: &mut Files<'_>) -> Result<(), Error> {
        let (found, missing) = self.libraries(path, line, files);
        for name in missing {
            self.mesh.notes.push(format!(
                "line {}: there is no material library {name:?}, so its materials are unknown; put it beside the file",
                self.line
            ));
        }
        for (file, text) in found {
            for mtl::MtlEntry { material, colour, emission } in mtl::read(&file, &text)? {
                let (number, new) = self.materials.number(&material.name);
                self.tally.undefined.remove(&number);
                match new {
                    true => self.mesh.materials.push(material),
                    false => self.mesh.materials[number as usize] = material,
                }
                self.images.retain(|images| images.material != number);
                if colour.is_some() || emission.is_some() {
                    self.images.push(ObjImages { material: number, library: file.clone(), colour, emission });
                }
            }
        }
        Ok(())
    }

    /// The content of the MTL files that a line names, and the names of those that are not there. A line may name several files,
    /// or one with spaces in its name. A file that was moved may name them by old paths; then they are looked for beside it.
    fn libraries<'l>(
        &mut self,
        path: &Path,
        line: &'l str,
        files: &mut Files<'_>,
    ) -> (Vec<(PathBuf, Vec<u8>)>, Vec<&'l str>) {
        if let Ok(whole) = files.beside(path, line) {
            return (vec![whole], Vec::new());
        }
        let (mut found, mut missing) = (Vec::new(), Vec::new());
        for name in line.split_whitespace() {
            match files.beside(path, name) {
                Ok(one) => found.push(one),
                Err(_) => missing.push(name),
            }
        }
        if missing.is_empty() {
            return (found, missing);
        }
        let moved = line.rsplit(['/', '\\']).next().unwrap_or(line);
        if let Some(whole) = files.beside(path, moved).ok().filter(|_| moved != line) {
            let note =
                format!("line {}: {line:?} is not there; {moved:?} beside the file is read", self.line);
            self.mesh.notes.push(note);
            return (vec![whole], Vec::new());
        }
        // Where none of the words is a file, the line is one name.
        let missing = if found.is_empty() { vec![line] } else { missing };
        (found, missing)
    }

    fn finish(mut self, files: &mut Files<'_>) -> Mesh {
        self.look_up_images(files);
        let ObjReader { mut mesh, tally, .. } = self;
        tally.report(&mut mesh);
        mesh
    }

    /// Multiplies the colours of materials by the means of their images, of which each is read once.
    fn look_up_images(&mut self, files: &mut Files<'_>) {
        let mut shown = self.shown();
        self.images.retain(|images| shown.contains_key(&images.material));
        let points = texture::points(self.images.len());
        let mut users: BTreeMap<(&PathBuf, &str), Vec<_>> = BTreeMap::new();
        for ObjImages { material, library, colour, emission } in &self.images {
            for (image, emission) in [(colour, false), (emission, true)] {
                let Some(MtlImage { name, placing }) = image else { continue };
                users.entry((library, name)).or_default().push((*material, emission, *placing));
            }
        }
        for ((library, name), users) in users {
            let file = name.rsplit(['/', '\\']).next().unwrap_or(name);
            let found = [name, file].into_iter().find_map(|name| files.beside(library, name).ok());
            let image = found.and_then(|(_, content)| texture::decode(&content));
            for (number, emission, placing) in users {
                let faces = shown.entry(number).or_default();
                let mean = image
                    .as_ref()
                    .map(|image| texture::mean(image, faces, placing, Sampling::of_colour(points)).colour);
                let material = &mut self.mesh.materials[number as usize];
                match emission {
                    true => material.shine(mean),
                    false => {
                        // Exporters write a black colour beside a texture, and mean the texture alone.
                        if !material.reflectance.is_lit() {
                            material.reflectance = mean.map_or(DEFAULT_REFLECTANCE, |_| 1.0).into();
                        }
                        material.show(name.to_owned(), mean);
                    }
                }
            }
        }
    }

    /// The faces of each used material with images, and the places of their corners, as far as they have some.
    fn shown(&self) -> HashMap<u32, Vec<TexturedFace>> {
        let asked: HashSet<u32> = self.images.iter().map(|images| images.material).collect();
        let mut shown: HashMap<u32, Vec<TexturedFace>> = HashMap::new();
        for (number, face) in self.mesh.triangles.iter().enumerate() {
            if !asked.contains(&face.material) {
                continue;
            }
            let faces = shown.entry(face.material).or_default();
            let places = self.placed.get(number).copied().unwrap_or([NOWHERE; 3]);
            let place = |place: u32| {
                self.places.get(place as usize).copied().filter(|[u, v]| u.is_finite() && v.is_finite())
            };
            if let [Some(a), Some(b), Some(c)] = places.map(place) {
                faces.push(TexturedFace { area: self.mesh.area(face) as f32, corners: [a, b, c] });
            }
        }
        shown
    }
}

/// The index that a number of a corner means, from 1, or from −1 backwards.
fn index(digits: Option<&[u8]>, count: usize) -> Option<u32> {
    let index = match std::str::from_utf8(digits?).ok()?.parse::<i64>().ok()? {
        number if number > 0 => number - 1,
        number if number < 0 => number + count as i64,
        _ => return None,
    };
    (0..count as i64).contains(&index).then_some(index as u32)
}
