//! glTF 2.0 and GLB: the triangles of a scene's nodes.

mod buffers;
mod draco;
mod images;
mod json;
mod lights;
mod material;
mod tints;

use std::collections::HashMap;
use std::f64::consts::PI;
use std::ops::Range;
use std::path::Path;

use glam::{DAffine3, DMat4, DQuat, DVec3};
use radiosity::Spectrum;

use self::buffers::{Data, buffers, unpack};
use self::draco::Unpacked;
use self::images::GltfImages;
use self::json::{At, Document, Draco, GltfNode, Instancing, Primitive, element};
use self::lights::GltfLights;
use self::tints::VertexTints;
use crate::error::{Error, FileSpot, UnplacedError};
use crate::files::Files;
use crate::mesh::{Material, Mesh, MeshParts, Triangle, short};
use crate::room::{TriangleBudget, room};
use crate::tally::NoteCounts;

/// Extensions that a file may require: those that are read, and those that say nothing of geometry or diffuse light.
const UNDERSTOOD: &[&str] = &[
    "KHR_materials_",
    "KHR_technique",
    "KHR_texture_",
    "KHR_mesh_quantization",
    "KHR_draco_mesh_compression",
    "EXT_texture_",
    "MSFT_texture_dds",
    "KHR_lights_punctual",
    "EXT_lights_ies",
    "EXT_mesh_gpu_instancing",
    "KHR_xmp",
    "KHR_animation_pointer",
];

/// The way to a file without compression and other extensions.
const WITHOUT_EXTENSIONS: &str =
    "export the file without it, or unpack it: npx @gltf-transform/cli copy FILE unpacked.glb";

/// Modes of primitives that have triangles (specification, section 5.24.4).
const TRIANGLES: u32 = 4;
const STRIP: u32 = 5;
const FAN: u32 = 6;

/// Reads a glTF or GLB file.
pub(crate) fn read(path: &Path, content: &[u8], files: &mut Files<'_>) -> Result<Mesh, Error> {
    let (json, binary) = unpack(content).map_err(|fault| fault.at(path, FileSpot::File))?;
    let document: Document = serde_json::from_slice(json).map_err(|error| not_gltf(path, json, &error))?;
    let at = |(element, fault): At| fault.at(path, FileSpot::Element(element));
    refuse_extensions(&document).map_err(at)?;
    let (buffers, beside) = buffers(&document, binary, path, files).map_err(at)?;
    let data = Data { document: &document, buffers: &buffers };
    let mesh = Mesh { materials: material::materials(&document), ..Mesh::default() };
    let visited = vec![false; document.nodes.len()];
    let mut walk = NodeWalk {
        data,
        room: TriangleBudget::of(content.len() + beside),
        rows: 0,
        uses: 0,
        vertices: HashMap::new(),
        mesh,
        parts: MeshParts::default(),
        tally: NoteCounts::default(),
        visited,
        images: GltfImages::of(&document),
        unpacked: Unpacked::default(),
        lights: GltfLights::default(),
        tints: VertexTints::default(),
    };
    walk.roots().map_err(at)?;
    let NodeWalk { data, mut mesh, mut tally, images, lights, tints, .. } = walk;
    images.look_up(&data, path, files, &mut mesh);
    tints.apply(&mut mesh);
    mesh.lamps = lights.into_lamps(&data, path, files, &mut tally).map_err(at)?;
    if !mesh.lamps.list.is_empty() {
        mesh.luminous = true;
        // Lamps are in cd: emission beside them is a luminance in cd/m² (KHR_materials_emissive_strength), an exitance of π times it.
        for material in &mut mesh.materials {
            material.emittance = Spectrum::rgb(material.emittance.channels().map(|luminance| PI * luminance));
        }
    }
    if document.extensions.images.is_some() {
        tally.count(
            "environments of images (EXT_lights_image_based) left out; --sky=10000 gives light from outside",
        );
    }
    tally.report(&mut mesh);
    Ok(mesh)
}

fn old_version(version: u32) -> UnplacedError {
    UnplacedError::new(
        format!("the file is glTF {version}"),
        "only version 2 is read",
        "export it as glTF 2.0",
    )
}

fn not_gltf(path: &Path, json: &[u8], error: &serde_json::Error) -> Error {
    // Version 1 has objects where version 2 has lists.
    let is_old = serde_json::from_slice::<serde_json::Value>(json)
        .is_ok_and(|json| json["meshes"].is_object() || json["asset"]["version"] == "1.0");
    if is_old {
        return old_version(1).at(path, FileSpot::File);
    }
    let fault = UnplacedError::new(
        format!("not the JSON of a glTF file: {error}"),
        "no geometry can be read from it",
        "export the file again",
    );
    fault.at(path, FileSpot::Line(error.line()))
}

fn refuse_extensions(document: &Document) -> Result<(), At> {
    let known = |name: &&String| !UNDERSTOOD.iter().any(|prefix| name.starts_with(prefix));
    if let Some(name) = document.extensions_required.iter().find(known) {
        return Err((
            "extensionsRequired".into(),
            UnplacedError::new(
                format!("the file requires {name}"),
                "that extension is not read",
                WITHOUT_EXTENSIONS,
            ),
        ));
    }
    Ok(())
}

/// The vertices of a primitive in the mesh, and the corners of its triangles, numbered from the first of them.
struct PrimitiveGeometry {
    vertices: Range<u32>,
    triangles: Vec<[u32; 3]>,
    /// The colours of the vertices, where they are compressed.
    colours: Option<Vec<[f64; 3]>>,
}

/// The nodes on the way to their triangles.
struct NodeWalk<'a> {
    data: Data<'a>,
    room: TriangleBudget,
    /// The number of vertices and indices that were read so far; a mesh that several nodes use counts for each of them.
    rows: u64,
    /// The number of meshes and primitives that were met so far, also of those that are left out.
    uses: u64,
    /// The vertices of the mesh that is read, by the number of their accessor: primitives share them.
    vertices: HashMap<usize, Range<u32>>,
    mesh: Mesh,
    parts: MeshParts,
    tally: NoteCounts,
    visited: Vec<bool>,
    images: GltfImages,
    unpacked: Unpacked,
    lights: GltfLights,
    tints: VertexTints,
}

impl NodeWalk<'_> {
    /// Walks the scene of the file: the default one; without it the first; without any, all nodes that are no children.
    fn roots(&mut self) -> Result<(), At> {
        let document = self.data.document;
        let roots = match document.scene.or((!document.scenes.is_empty()).then_some(0)) {
            Some(scene) => element(&document.scenes, scene, "scenes", "scene")?.nodes.clone(),
            None => orphans(document),
        };
        // Nodes wait on a stack of their own, since trees may be deeper than the program's stack allows.
        let mut waiting: Vec<PendingNode> = roots
            .into_iter()
            .rev()
            .map(|node| PendingNode { node, above: "scene".into(), place: DAffine3::IDENTITY })
            .collect();
        while let Some(next) = waiting.pop() {
            self.node(next, &mut waiting)?;
        }
        Ok(())
    }

    fn node(&mut self, next: PendingNode, waiting: &mut Vec<PendingNode>) -> Result<(), At> {
        let PendingNode { node: number, above, place } = next;
        let document = self.data.document;
        let node = element(&document.nodes, number, "nodes", &above)?;
        let name = node_name(document, node, number);
        let path = if above == "scene" { name.clone() } else { format!("{above}/{name}") };
        // Paths of long chains are cut; otherwise they would take memory in the square of their number.
        let path = if path.len() > 200 { format!("…/{name}") } else { path };
        if std::mem::replace(&mut self.visited[number], true) {
            let fault =
                UnplacedError::new("the node has two parents", "nodes form a tree", "export the file again");
            return Err((path, fault));
        }
        let place = place * placement(node);
        if !place.is_finite() {
            let fault =
                UnplacedError::new("its transform is not finite", "it puts vertices nowhere", "correct it");
            return Err((format!("node {path:?}"), fault));
        }
        if node.skin.is_some() {
            self.tally.count("skinned nodes in their pose at rest; export the pose that is meant");
        }
        if let Some(light) = &node.extensions.light {
            let lights = &document.extensions.lights.lights;
            let json = element(lights, light.light, "lights", &format!("node {path:?}"))?;
            self.lights.add(json, &name, &place, &mut self.tally);
        }
        if let Some(profile) = &node.extensions.profile {
            self.lights.add_profile(profile, &name, &place, &mut self.tally);
        }
        if let Some(mesh) = node.mesh {
            match &node.extensions.instancing {
                None => self.mesh_at(mesh, &name, &path, &place)?,
                Some(copies) => {
                    for copy in self.copies(copies, &path)? {
                        self.mesh_at(mesh, &name, &path, &(place * copy))?;
                    }
                }
            }
        }
        let children = node.children.iter().rev();
        waiting.extend(children.map(|&child| PendingNode { node: child, above: path.clone(), place }));
        Ok(())
    }

    /// The transforms of a mesh's copies (EXT_mesh_gpu_instancing), made one by one. Rows that are not in the file make none.
    fn copies(
        &mut self,
        copies: &Instancing,
        path: &str,
    ) -> Result<impl Iterator<Item = DAffine3> + use<>, At> {
        let accessor = |name: &str| copies.attributes.get(name).copied();
        let given = ["TRANSLATION", "ROTATION", "SCALE"].map(accessor);
        let [translation, rotation, scale] =
            given.map(|number| number.filter(|&number| self.has_rows(number) != Some(false)));
        if given != [translation, rotation, scale] {
            self.tally.count("transforms of copies that are not in the file, left out");
        }
        for number in [translation, rotation, scale].into_iter().flatten() {
            self.count_rows(number, path)?;
        }
        let three =
            |number: Option<usize>| number.map_or(Ok(Vec::new()), |number| self.data.rows::<3>(number, path));
        let (translations, scales) = (three(translation)?, three(scale)?);
        let rotations = rotation.map_or(Ok(Vec::new()), |number| self.data.rows::<4>(number, path))?;
        let count = translations.len().max(rotations.len()).max(scales.len());
        let copy = move |i: usize| {
            let rotation = rotations.get(i).map_or(DQuat::IDENTITY, |&r| DQuat::from_array(r).normalize());
            let [scale, translation] = [(&scales, DVec3::ONE), (&translations, DVec3::ZERO)]
                .map(|(rows, default)| rows.get(i).map_or(default, |&row| DVec3::from_array(row)));
            DAffine3::from_scale_rotation_translation(scale, rotation, translation)
        };
        Ok((0..count).map(copy))
    }

    fn mesh_at(&mut self, number: usize, name: &str, path: &str, place: &DAffine3) -> Result<(), At> {
        let document = self.data.document;
        let mesh = element(&document.meshes, number, "meshes", &format!("node {path:?}.mesh"))?;
        self.uses += 1 + mesh.primitives.len() as u64;
        self.within(self.uses, 1, "meshes and primitives", path)?;
        self.parts.enter(&mut self.mesh, name);
        self.vertices.clear();
        for (i, primitive) in mesh.primitives.iter().enumerate() {
            self.primitive(primitive, &format!("meshes[{number}].primitives[{i}]"), place)?;
        }
        Ok(())
    }

    fn primitive(&mut self, primitive: &Primitive, path: &str, place: &DAffine3) -> Result<(), At> {
        let mode = primitive.mode.unwrap_or(TRIANGLES);
        if !(TRIANGLES..=FAN).contains(&mode) {
            self.tally.count("primitives of points or lines, without area, left out");
            return Ok(());
        }
        if !primitive.targets.is_empty() {
            self.tally.count("primitives with morph targets, taken without; export the shape that is meant");
        }
        let Some(position) = position(primitive) else {
            self.tally.count("primitives without positions, left out");
            return Ok(());
        };
        let draco = primitive.extensions.draco.as_ref().filter(|_| self.has_rows(position) != Some(true));
        // By the format they are all 0, which no triangle survives: a file of 300 bytes can have millions of them.
        let mut read = [Some(position), primitive.indices].into_iter().flatten();
        if draco.is_none() && read.any(|accessor| self.has_rows(accessor) == Some(false)) {
            self.tally.count("primitives whose vertices or indices are not in the file, left out");
            return Ok(());
        }
        let PrimitiveGeometry { vertices: Range { start: first, end }, triangles, colours } = match draco {
            Some(draco) => self.unpack(draco, primitive, path, place)?,
            None => self.plain(position, mode, primitive, path, place)?,
        };
        let material = self.material(primitive, path)?;
        let mirrored = place.matrix3.determinant() < 0.0;
        let (before, vertices) = (self.mesh.triangles.len(), (end - first) as usize);
        for [a, b, c] in triangles {
            // A mirror reverses the order of corners, and with it the front.
            let corners = if mirrored { [a, c, b] } else { [a, b, c] }.map(|corner| first + corner);
            let (part, face) = self.parts.next_face(&mut self.mesh, "mesh");
            self.mesh.triangles.push(Triangle { corners, part, face, material, line: 0 });
        }
        match colours {
            Some(colours) => self.tints.add(&self.mesh, before, first, &colours),
            None => self.tint(primitive, (before, first), vertices, path)?,
        }
        for slot in self.images.asked(material) {
            let number = primitive.attributes.get(&format!("TEXCOORD_{}", slot.set)).copied();
            let Some(number) = number else { continue };
            if !self.images.knows(number) {
                // Rows that are not there, or too many, only leave an image without weights.
                if self.data.document.accessors.get(number).is_none_or(|rows| rows.count != vertices) {
                    continue;
                }
                if self.count_rows(number, path).is_err() {
                    continue;
                }
                self.images.keep(number, self.data.rows::<2>(number, path).unwrap_or_default());
            }
            self.images.show(slot, number, &self.mesh, before, first);
        }
        room(&self.mesh).map_err(|fault| (path.into(), fault))
    }

    /// Adds the colours of the triangles from `before` on, whose vertices are numbered from `first`, to those of their material. Rows
    /// that are not there, or too many, are no colours.
    fn tint(
        &mut self,
        primitive: &Primitive,
        (before, first): (usize, u32),
        vertices: usize,
        path: &str,
    ) -> Result<(), At> {
        let accessors = &self.data.document.accessors;
        let number = primitive.attributes.get("COLOR_0").copied();
        let colours = number
            .filter(|&n| accessors.get(n).is_some_and(|rows| rows.count == vertices && rows.has_rows()));
        let Some(number) = colours else {
            self.tints.add::<3>(&self.mesh, before, first, &[]);
            return Ok(());
        };
        self.count_rows(number, path)?;
        match accessors[number].kind.as_str() {
            "VEC4" => self.tints.add(&self.mesh, before, first, &self.data.rows::<4>(number, path)?),
            _ => self.tints.add(&self.mesh, before, first, &self.data.rows::<3>(number, path)?),
        }
        Ok(())
    }

    /// The vertices and triangles of a primitive that is not compressed.
    fn plain(
        &mut self,
        position: usize,
        mode: u32,
        primitive: &Primitive,
        path: &str,
        place: &DAffine3,
    ) -> Result<PrimitiveGeometry, At> {
        let vertices = self.vertices(position, path, place)?;
        let indices = self.indices(primitive, vertices.end - vertices.start, path)?;
        self.make_room(count(mode, indices.len()), path)?;
        Ok(PrimitiveGeometry { vertices, triangles: triples(mode, &indices), colours: None })
    }

    /// The vertices and triangles of a compressed primitive. Its places in images are kept by the numbers of their accessors.
    fn unpack(
        &mut self,
        draco: &Draco,
        primitive: &Primitive,
        path: &str,
        place: &DAffine3,
    ) -> Result<PrimitiveGeometry, At> {
        let at = |fault| (path.to_owned(), fault);
        let packed = self.unpacked.mesh(&self.data, draco.buffer_view, self.room.most()).map_err(at)?;
        self.rows = self.rows.saturating_add(packed.num_points() as u64 + packed.num_faces() as u64);
        self.within(self.rows, 3, "vertices and indices", path)?;
        self.make_room(packed.num_faces(), path)?;
        let attribute = |name: &str| draco.attributes.get(name).copied();
        let positions = attribute("POSITION").and_then(|number| draco::rows::<3>(&packed, number));
        let first = self.mesh.positions.len() as u32;
        self.add_vertices(&positions.ok_or_else(|| at(UnplacedError::short()))?, path, place)?;
        let vertices = first..self.mesh.positions.len() as u32;
        let triangles: Vec<[u32; 3]> = draco::triangles(&packed).collect();
        if triangles.iter().flatten().any(|&corner| corner >= vertices.end - first) {
            return Err(at(UnplacedError::short()));
        }
        for (name, &accessor) in primitive.attributes.iter().filter(|(name, _)| name.starts_with("TEXCOORD_"))
        {
            if let Some(places) = attribute(name).and_then(|number| draco::rows::<2>(&packed, number)) {
                self.images.keep(accessor, places);
            }
        }
        let colours = attribute("COLOR_0").and_then(|number| draco::colours(&packed, number));
        Ok(PrimitiveGeometry { vertices, triangles, colours })
    }

    /// Refuses more triangles than the file may have.
    fn make_room(&self, more: usize, path: &str) -> Result<(), At> {
        self.within(more as u64 + self.mesh.triangles.len() as u64, 1, "triangles", path)
    }

    /// The range of an accessor's vertices in the mesh, to which they are added.
    fn vertices(&mut self, accessor: usize, path: &str, place: &DAffine3) -> Result<Range<u32>, At> {
        if let Some(known) = self.vertices.get(&accessor) {
            return Ok(known.clone());
        }
        self.count_rows(accessor, path)?;
        let first = self.mesh.positions.len() as u32;
        self.add_vertices(&self.data.rows::<3>(accessor, path)?, path, place)?;
        let range = first..self.mesh.positions.len() as u32;
        self.vertices.insert(accessor, range.clone());
        Ok(range)
    }

    /// Adds vertices where a transform puts them.
    fn add_vertices(&mut self, vertices: &[[f64; 3]], path: &str, place: &DAffine3) -> Result<(), At> {
        for &vertex in vertices {
            let position = place.transform_point3(DVec3::from_array(vertex));
            if !position.is_finite() {
                let fault = UnplacedError::new(
                    "a vertex is not a finite number",
                    "it is nowhere",
                    "export the file again",
                );
                return Err((path.into(), fault));
            }
            self.mesh.positions.push(position);
        }
        Ok(())
    }

    /// Counts the rows of an accessor before they are read.
    fn count_rows(&mut self, accessor: usize, path: &str) -> Result<(), At> {
        let accessor = element(&self.data.document.accessors, accessor, "accessors", path)?;
        self.rows = self.rows.saturating_add(accessor.count as u64);
        self.within(self.rows, 3, "vertices and indices", path)
    }

    /// Refuses more than `times` times as many items as the file may have triangles.
    fn within(&self, count: u64, times: u64, what: &str, path: &str) -> Result<(), At> {
        if count <= times * self.room.most() {
            return Ok(());
        }
        let problem = format!("with those of this primitive the scene has {count} {what}");
        let why = match times {
            1 => self.room.why(),
            _ => format!("there are at most {times} for each triangle; {}", self.room.why()),
        };
        let remedy = "remove nodes that repeat a mesh, or simplify the mesh";
        Err((path.into(), UnplacedError::new(problem, why, remedy)))
    }

    /// Whether the file holds rows of an accessor; `None` where there is no such accessor.
    fn has_rows(&self, accessor: usize) -> Option<bool> {
        let accessor = self.data.document.accessors.get(accessor)?;
        Some(accessor.has_rows())
    }

    /// The vertices in the order of the triangles' corners.
    fn indices(&mut self, primitive: &Primitive, vertices: u32, path: &str) -> Result<Vec<u32>, At> {
        let Some(number) = primitive.indices else { return Ok((0..vertices).collect()) };
        self.count_rows(number, path)?;
        let rows = self.data.rows::<1>(number, path)?;
        let indices: Vec<u32> = rows.into_iter().map(|[index]| index as u32).collect();
        match indices.iter().find(|&&index| index >= vertices) {
            None => Ok(indices),
            Some(index) => Err((
                format!("{path}.indices"),
                UnplacedError::new(
                    format!("there is no vertex {index}"),
                    format!("the primitive has {vertices}, counted from 0"),
                    "export the file again",
                ),
            )),
        }
    }

    /// The number of a primitive's material. A primitive without one gets a default material after all others.
    fn material(&mut self, primitive: &Primitive, path: &str) -> Result<u32, At> {
        let written = self.data.document.materials.len();
        if let Some(material) = primitive.material {
            element(&self.data.document.materials, material, "materials", path)?;
            return Ok(material as u32);
        }
        if self.mesh.materials.len() == written {
            self.mesh.materials.push(Material::undefined("default"));
        }
        Ok(written as u32)
    }
}

/// A node that waits to be walked.
struct PendingNode {
    node: usize,
    /// The path of the node's parent.
    above: String,
    place: DAffine3,
}

fn orphans(document: &Document) -> Vec<usize> {
    let mut is_child = vec![false; document.nodes.len()];
    for &child in document.nodes.iter().flat_map(|node| &node.children) {
        if let Some(is_child) = is_child.get_mut(child) {
            *is_child = true;
        }
    }
    (0..is_child.len()).filter(|&node| !is_child[node]).collect()
}

fn node_name(document: &Document, node: &GltfNode, number: usize) -> String {
    let mesh = node.mesh.and_then(|mesh| document.meshes.get(mesh)?.name.as_deref());
    let written = node.name.as_deref().or(mesh).filter(|name| !name.is_empty());
    written.map_or_else(|| format!("node {number}"), |name| short(name).into_owned())
}

fn position(primitive: &Primitive) -> Option<usize> {
    primitive.attributes.get("POSITION").copied()
}

fn placement(node: &GltfNode) -> DAffine3 {
    if let Some(matrix) = node.matrix {
        return DAffine3::from_mat4(DMat4::from_cols_array(&matrix));
    }
    let scale = node.scale.map_or(DVec3::ONE, DVec3::from_array);
    let rotation = node.rotation.map_or(DQuat::IDENTITY, |rotation| DQuat::from_array(rotation).normalize());
    let translation = node.translation.map_or(DVec3::ZERO, DVec3::from_array);
    DAffine3::from_scale_rotation_translation(scale, rotation, translation)
}

/// The number of triangles that [`triples`] makes of as many indices.
fn count(mode: u32, indices: usize) -> usize {
    if mode == TRIANGLES { indices / 3 } else { indices.saturating_sub(2) }
}

/// Triangles of a list, a strip (every other one turned round) or a fan.
fn triples(mode: u32, indices: &[u32]) -> Vec<[u32; 3]> {
    let window = |i: usize| [indices[i], indices[i + 1], indices[i + 2]];
    let count = indices.len().saturating_sub(2);
    match mode {
        STRIP => (0..count)
            .map(|i| {
                let [a, b, c] = window(i);
                if i % 2 == 0 { [a, b, c] } else { [a, c, b] }
            })
            .collect(),
        FAN => (0..count).map(|i| [indices[0], indices[i + 1], indices[i + 2]]).collect(),
        _ => indices.chunks_exact(3).map(|corners| [corners[0], corners[1], corners[2]]).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans_keep_their_orientation() {
        assert_eq!(triples(STRIP, &[0, 1, 2, 3]), [[0, 1, 2], [1, 3, 2]]);
        assert_eq!(triples(FAN, &[0, 1, 2, 3]), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(triples(TRIANGLES, &[0, 1, 2, 3]), [[0, 1, 2]]);
        for (mode, made) in [(STRIP, 2), (FAN, 2), (TRIANGLES, 1)] {
            assert_eq!((count(mode, 4), count(mode, 0)), (made, 0));
        }
    }
}
