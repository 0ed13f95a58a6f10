//! Mitsuba's XML, as far as it is diffuse: shapes, their materials and area emitters.
//!
//! There is no crate that reads it; the XML itself is read by `roxmltree`.

use std::borrow::Cow;
use std::collections::HashMap;
use std::f64::consts::PI;
use std::path::Path;

use glam::{DAffine3, DMat3, DMat4, DVec3};
use radiosity::{Sides, Spectrum};
use roxmltree::{Document, Node};

use crate::error::{Error, FileSpot, UnplacedError};
use crate::files::Files;
use crate::mesh::{LostProperty, Material, Mesh, MeshParts, Triangle};
use crate::mgf::rgb_of_pairs;
use crate::room::room;
use crate::tally::NoteCounts;
use crate::texture::{self, Placing, Sampling};
use crate::{obj, ply};

/// The most materials within materials.
const DEEPEST: u32 = 16;

/// The most bytes of a name behind `$`, and of a value in which names are replaced.
const LONGEST_NAME: usize = 64;
const LONGEST_VALUE: usize = 1 << 16;

/// The most emitters that a note names.
const NAMED: usize = 3;

/// How often the faces of an octahedron are cut into four to make a sphere: 512 faces.
const CUTS: u32 = 3;

/// Reads a scene and the meshes that it names.
pub(crate) fn read(path: &Path, text: &[u8], files: &mut Files<'_>) -> Result<Mesh, Error> {
    let whole = |problem: String| {
        UnplacedError::new(problem, "no geometry can be read from it", "export the scene again")
            .at(path, FileSpot::File)
    };
    let text = std::str::from_utf8(text).map_err(|error| whole(format!("the text is not UTF-8: {error}")))?;
    let document = Document::parse(text).map_err(|error| whole(format!("not XML: {error}")))?;
    let root = document.root_element();
    if root.tag_name().name() != "scene" {
        return Err(whole(format!("the XML is a {:?}, not a scene of Mitsuba", root.tag_name().name())));
    }
    let defaults = root.children().filter(|node| node.has_tag_name("default"));
    let mut reader = MitsubaReader {
        path,
        files,
        defaults: defaults
            .filter_map(|node| Some((node.attribute("name")?, node.attribute("value")?)))
            .collect(),
        named: root
            .descendants()
            .filter(|node| !matches!(node.tag_name().name(), "ref" | "alias"))
            .filter_map(|node| Some((node.attribute("id")?, node)))
            .collect(),
        numbers: HashMap::new(),
        names: HashMap::new(),
        dark: Vec::new(),
        mesh: Mesh::default(),
        parts: MeshParts::default(),
        tally: NoteCounts::default(),
    };
    for node in root.children().filter(Node::is_element) {
        let line = document.text_pos_at(node.range().start).row as usize;
        match node.tag_name().name() {
            "shape" => reader.shape(node, line)?,
            // One of an area belongs to the shapes that refer to it.
            "emitter" if node.attribute("type") != Some("area") => {
                reader.tally.count("emitters without area, left out; what comes from outside is the light of a sky, as --sky=10000 gives");
            }
            "alias" => reader.alias(node),
            "include" => reader.tally.count("included files left out; write what they hold into the file"),
            _ => {}
        }
    }
    let MitsubaReader { mut mesh, tally, dark, .. } = reader;
    tally.report(&mut mesh);
    if !dark.is_empty() {
        let named: Vec<String> = dark.iter().take(NAMED).map(|name| format!("{name:?}")).collect();
        let more = if dark.len() > NAMED { ", …" } else { "" };
        mesh.notes.push(format!(
            "area emitters whose radiance is not read, left dark: {} ({}{more}); write it as rgb",
            dark.len(),
            named.join(", ")
        ));
    }
    Ok(mesh)
}

struct MitsubaReader<'a, 'f, 'x> {
    path: &'a Path,
    files: &'a mut Files<'f>,
    /// The values of `$name`.
    defaults: HashMap<&'x str, &'x str>,
    /// The elements by their ids.
    named: HashMap<&'x str, Node<'x, 'x>>,
    /// The numbers of materials that have been read, and of their backs, by their place in the file and what they emit.
    numbers: HashMap<(usize, [u64; 3]), (u32, Option<u32>)>,
    /// The names of materials, and how many have asked for each.
    names: HashMap<String, u32>,
    /// The names of shapes whose radiance is not read.
    dark: Vec<String>,
    mesh: Mesh,
    parts: MeshParts,
    tally: NoteCounts,
}

impl<'x> MitsubaReader<'_, '_, 'x> {
    /// The value of an attribute, with each `$name` replaced; `None` where a value begins with one that has no default.
    fn attribute(&self, node: Node<'x, 'x>, name: &str) -> Option<Cow<'x, str>> {
        let value = node.attribute(name)?;
        let mut parts = value.split('$');
        let mut whole = Cow::from(parts.next()?);
        for part in parts {
            // Of names that begin alike, the longest is meant.
            let known = (1..=part.len().min(LONGEST_NAME)).rev().find_map(|end| {
                let of = self.defaults.get(part.get(..end)?)?;
                Some((of, &part[end..]))
            });
            match known {
                Some((of, rest)) => whole.to_mut().extend([*of, rest]),
                None if whole.is_empty() => return None,
                None => whole.to_mut().extend(["$", part]),
            }
            if whole.len() > LONGEST_VALUE {
                return None;
            }
        }
        Some(whole)
    }

    /// Gives an element another id.
    fn alias(&mut self, node: Node<'x, 'x>) {
        let meant = node.attribute("id").and_then(|id| self.named.get(id).copied());
        if let (Some(meant), Some(id)) = (meant, node.attribute("as")) {
            self.named.insert(id, meant);
        }
    }

    /// The value of a child with a name.
    fn value(&self, node: Node<'x, 'x>, name: &str) -> Option<Cow<'x, str>> {
        let child = node.children().find(|child| child.attribute("name") == Some(name))?;
        self.attribute(child, "value")
    }

    /// The element that a reference means, or the node itself.
    fn target(&self, node: Node<'x, 'x>) -> Option<Node<'x, 'x>> {
        match node.tag_name().name() {
            "ref" => self.named.get(&*self.attribute(node, "id")?).copied(),
            _ => Some(node),
        }
    }

    /// The first child with a tag, or that a child refers to.
    fn child(&self, node: Node<'x, 'x>, tag: &str) -> Option<Node<'x, 'x>> {
        node.children().filter_map(|child| self.target(child)).find(|child| child.has_tag_name(tag))
    }

    fn shape(&mut self, node: Node<'x, 'x>, line: usize) -> Result<(), Error> {
        let path = self.path;
        let at = |fault: UnplacedError| fault.at(path, FileSpot::Line(line));
        let place = self.place(node);
        if !place.is_finite() {
            return Err(at(UnplacedError::new(
                "its transform is not finite",
                "it puts vertices nowhere",
                "correct it",
            )));
        }
        let kind = node.attribute("type").unwrap_or_default();
        let shape = match kind {
            "obj" | "ply" => self.file_of(node, line)?,
            "rectangle" => {
                made(&[[-1., -1., 0.], [1., -1., 0.], [1., 1., 0.], [-1., 1., 0.]], &[[0, 1, 2], [0, 2, 3]])
            }
            "cube" => cube(),
            "disk" => disk(),
            "sphere" => sphere(),
            _ => {
                self.tally.count(match kind {
                    "serialized" => {
                        "serialized shapes, which are not read, left out; export them as obj or ply"
                    }
                    _ => "shapes of kinds that are not read, left out; export them as obj or ply",
                });
                return Ok(());
            }
        };
        let flipped = self.value(node, "flip_normals").or(self.value(node, "flipNormals"));
        let flipped = flipped.as_deref() == Some("true");
        // Facets of a disk or sphere are brighter by what they lack of its area, which keeps its power.
        let whole = match kind {
            "disk" => PI,
            "sphere" => 4.0 * PI,
            _ => f64::NAN,
        };
        let excess = whole / shape.triangles.iter().map(|triangle| shape.area(triangle)).sum::<f64>();
        let (material, back) = self.material_of(node, if whole.is_nan() { 1.0 } else { excess });
        let back = back.filter(|_| !matches!(kind, "cube" | "sphere"));
        let name = node.attribute("id").unwrap_or(kind);
        self.parts.enter(&mut self.mesh, name);
        let first = self.mesh.positions.len() as u32;
        self.mesh.positions.extend(shape.positions.iter().map(|corner| place.transform_point3(*corner)));
        let mirrored = (place.matrix3.determinant() < 0.0) != flipped;
        for (material, turned) in [(Some(material), mirrored), (back, !mirrored)] {
            let Some(material) = material else { continue };
            for triangle in &shape.triangles {
                let (part, face) = self.parts.next_face(&mut self.mesh, "shape");
                let [a, b, c] = triangle.corners.map(|corner| first + corner);
                let corners = if turned { [a, c, b] } else { [a, b, c] };
                self.mesh.triangles.push(Triangle { corners, part, face, material, line: line as u32 });
            }
        }
        room(&self.mesh).map_err(at)
    }

    /// Where a shape stands. A sphere has a radius and a centre of its own.
    fn place(&self, node: Node<'x, 'x>) -> DAffine3 {
        let named = |names: &'static [&str]| {
            node.children().filter(|child| child.attribute("name").is_some_and(|name| names.contains(&name)))
        };
        let mut place = DAffine3::IDENTITY;
        for child in named(&["to_world", "toWorld"]) {
            place = self.transform(child) * place;
        }
        if node.attribute("type") == Some("sphere") {
            let radius = self.value(node, "radius").and_then(|radius| radius.parse().ok()).unwrap_or(1.0);
            let centre = named(&["center"]).next().map_or(DVec3::ZERO, |point| self.vector(point, 0.0));
            place *=
                DAffine3::from_scale_rotation_translation(DVec3::splat(radius), Default::default(), centre);
        }
        place
    }

    /// The mesh of the file that a shape names.
    fn file_of(&mut self, node: Node<'x, 'x>, line: usize) -> Result<Mesh, Error> {
        let path = self.path;
        let at = |fault: UnplacedError| fault.at(path, FileSpot::Line(line));
        let Some(name) = self.value(node, "filename") else {
            return Err(at(UnplacedError::new(
                "the shape names no file",
                "its faces are there",
                "add filename",
            )));
        };
        let (file, content) = self.files.beside(path, &name).map_err(|error| {
            at(UnplacedError::new(
                format!("{name:?} cannot be read"),
                error.to_string(),
                "put it beside the scene",
            ))
        })?;
        let mut nothing = |_: &Path| Err(std::io::Error::from(std::io::ErrorKind::NotFound));
        match node.attribute("type") {
            Some("obj") => obj::read(&file, &content, &mut Files::new(&mut nothing)),
            _ => ply::read(&file, &content),
        }
    }

    /// The number of a shape's material, and that of its back where the front alone emits and both reflect. Radiance L of an area emitter is an exitance of
    /// π·L, here times `excess`.
    fn material_of(&mut self, shape: Node<'x, 'x>, excess: f64) -> (u32, Option<u32>) {
        let emitter = self.child(shape, "emitter");
        let radiance = emitter.and_then(|emitter| {
            self.spectrum(emitter.children().find(|child| child.attribute("name") == Some("radiance"))?)
        });
        if emitter.is_some() && radiance.is_none() {
            let kind = shape.attribute("type").unwrap_or_default();
            self.dark.push(shape.attribute("id").unwrap_or(kind).to_owned());
        }
        let emittance =
            radiance.map_or([0.0; 3], |radiance| radiance.map(|channel| excess * (PI * channel.max(0.0))));
        // References may also be to media and emitters.
        let bsdf = self.child(shape, "bsdf");
        let place = bsdf.map_or(usize::MAX, |bsdf| bsdf.range().start);
        let key = (place, emittance.map(f64::to_bits));
        if let Some(&numbers) = self.numbers.get(&key) {
            return numbers;
        }
        let name = bsdf.and_then(|bsdf| bsdf.attribute("id")).unwrap_or("default");
        let mut material = match bsdf {
            Some(bsdf) => {
                let mut material = Material { sides: Some(Sides::Front), ..Material::unknown(name) };
                let through = self.follow(bsdf, &mut material, DEEPEST);
                material.passes(through);
                material
            }
            None => Material { sides: Some(Sides::Front), ..Material::undefined(name) },
        };
        let mut back = None;
        if radiance.is_some() {
            let reflects = material.sides == Some(Sides::Both) && material.reflectance.is_lit();
            material.sides = Some(Sides::Front);
            if name == "default" {
                material.name = shape.attribute("id").unwrap_or("emitter").to_owned();
            }
            back = reflects.then(|| material.clone());
            material.emittance = Spectrum::rgb(emittance);
        }
        let numbers = (self.add_material(material), back.map(|back| self.add_material(back)));
        self.numbers.insert(key, numbers);
        numbers
    }

    /// Adds a material under a name of its own.
    fn add_material(&mut self, mut material: Material) -> u32 {
        material.name = self.free_name(material.name);
        self.mesh.materials.push(material);
        self.mesh.materials.len() as u32 - 1
    }

    /// A name that no material has: options would change all that share one.
    fn free_name(&mut self, name: String) -> String {
        let mut free = name.clone();
        while self.names.contains_key(&free) {
            let count = self.names.get_mut(&name).expect("the name is taken");
            *count += 1;
            free = format!("{name}.{count}");
        }
        self.names.insert(free.clone(), 1);
        free
    }

    /// Takes the diffuse part of a material. Returns the part of the light that passes it straight on.
    fn follow(&mut self, bsdf: Node<'x, 'x>, material: &mut Material, depth: u32) -> f64 {
        let kind = bsdf.attribute("type").unwrap_or_default();
        match kind {
            "twosided" | "bumpmap" | "normalmap" => {
                if kind == "twosided" {
                    material.sides = Some(Sides::Both);
                }
                self.inner(bsdf, 0, material, depth)
            }
            "mask" => {
                let through = self.inner(bsdf, 0, material, depth);
                let Some(opacity) = self.part(bsdf, "opacity", 0.5) else {
                    material.loses(LostProperty::Transparency);
                    return through;
                };
                scale(material, opacity);
                1.0 - opacity * (1.0 - through)
            }
            "blendbsdf" => {
                let weight = self.part(bsdf, "weight", 0.5).unwrap_or_else(|| {
                    material.loses(LostProperty::Texture);
                    0.5
                });
                let mut other = material.clone();
                // Each blend has two ways down: half as deep, there are few in all.
                let through = self.inner(bsdf, 0, material, depth / 2);
                let beside = self.inner(bsdf, 1, &mut other, depth / 2);
                mix(material, other, weight);
                through + weight * (beside - through)
            }
            "null" | "dielectric" | "thindielectric" | "roughdielectric" => {
                material.reflectance = Spectrum::BLACK;
                material.sides = Some(Sides::Both);
                if kind != "roughdielectric" {
                    return 1.0;
                }
                material.loses(LostProperty::Transparency);
                0.0
            }
            "conductor" | "roughconductor" => {
                material.loses(LostProperty::Mirror);
                material.reflectance = Spectrum::BLACK;
                0.0
            }
            _ => self.paint(bsdf, kind, material),
        }
    }

    /// Follows one of the materials within a material.
    fn inner(&mut self, bsdf: Node<'x, 'x>, number: usize, material: &mut Material, depth: u32) -> f64 {
        let within = bsdf.children().filter_map(|child| self.target(child));
        let inner = within.filter(|child| child.has_tag_name("bsdf")).nth(number);
        inner.filter(|_| depth > 0).map_or(0.0, |inner| self.follow(inner, material, depth - 1))
    }

    /// Takes the colour of a material that is at least in part diffuse. Returns the part of the light that passes straight on.
    fn paint(&mut self, bsdf: Node<'x, 'x>, kind: &str, material: &mut Material) -> f64 {
        if !matches!(kind, "diffuse" | "roughdiffuse") {
            material.loses(LostProperty::Mirror);
        }
        let names = ["reflectance", "diffuse_reflectance", "diffuseReflectance", "base_color"];
        let named = |child: &Node<'x, 'x>| child.attribute("name").is_some_and(|name| names.contains(&name));
        if let Some(given) = bsdf.children().find(named) {
            self.colour(given, material);
        }
        if !kind.starts_with("principled") {
            return 0.0;
        }
        let [metal, clear] = ["metallic", "spec_trans"].map(|name| self.part(bsdf, name, 0.0).unwrap_or(0.0));
        scale(material, (1.0 - metal) * (1.0 - clear));
        (1.0 - metal) * clear
    }

    /// A part in [0, 1] that a material names, or the mean of its texture; `None` where that is not read.
    fn part(&mut self, bsdf: Node<'x, 'x>, name: &str, default: f64) -> Option<f64> {
        let Some(given) = bsdf.children().find(|child| child.attribute("name") == Some(name)) else {
            return Some(default);
        };
        let texture = self.target(given).filter(|node| node.has_tag_name("texture"));
        let [red, green, blue] = match texture {
            Some(texture) => self.texture(texture).1?.channels(),
            None => self.spectrum(given)?,
        };
        Some(((red + green + blue) / 3.0).clamp(0.0, 1.0))
    }

    /// Takes the reflectance of a material: a colour, or the mean of a texture.
    fn colour(&mut self, given: Node<'x, 'x>, material: &mut Material) {
        if let Some(texture) = self.target(given).filter(|node| node.has_tag_name("texture")) {
            let (name, mean) = self.texture(texture);
            material.reflectance = mean.map_or(crate::mesh::DEFAULT_REFLECTANCE, |_| 1.0).into();
            material.show(name, mean);
            return;
        }
        match self.spectrum(given) {
            Some(channels) => material.reflectance = Spectrum::rgb(channels.map(|channel| channel.max(0.0))),
            None => material.loses(LostProperty::Definition),
        }
    }

    /// The name of a texture and its mean: of an image, or of the two colours of a checkerboard.
    fn texture(&mut self, texture: Node<'x, 'x>) -> (String, Option<Spectrum>) {
        if texture.attribute("type") == Some("checkerboard") {
            let colour = |(name, default): (&str, f64)| {
                let given = texture.children().find(|child| child.attribute("name") == Some(name));
                given.map_or(Some([default; 3]), |given| self.spectrum(given))
            };
            let [light, dark] = [("color0", 0.4), ("color1", 0.2)].map(colour);
            let mean = |(light, dark): ([f64; 3], [f64; 3])| {
                Spectrum::rgb(std::array::from_fn(|channel| 0.5 * (light[channel] + dark[channel]).max(0.0)))
            };
            return ("checkerboard".into(), light.zip(dark).map(mean));
        }
        let name = self.value(texture, "filename").unwrap_or("a texture".into()).into_owned();
        let content = self.files.beside(self.path, &name).ok();
        let image = content.and_then(|(_, content)| texture::decode(&content));
        let raw = self.value(texture, "raw").as_deref() == Some("true");
        let sampling = Sampling { raw, ..Sampling::of_colour(texture::points(1)) };
        let mean = image.map(|image| texture::mean(&image, &[], Placing::FROM_ABOVE, sampling).colour);
        (name, mean)
    }

    /// A colour: three numbers, one, `#rrggbb`, or pairs of wavelength [nm] and value; the number of a spectrum that is uniform
    /// or daylight. `None` for one that is given in another way.
    fn spectrum(&self, node: Node<'x, 'x>) -> Option<[f64; 3]> {
        let text = match (self.attribute(node, "value"), node.attribute("type")) {
            (Some(text), _) => text,
            (None, Some("uniform")) => self.value(node, "value")?,
            // Daylight is the white of red, green and blue, unless it has a colour beside its scale.
            (None, Some("d65")) if node.children().filter(Node::is_element).count() == 1 => {
                self.value(node, "scale")?
            }
            _ => return None,
        };
        let text = text.trim();
        if let Some(digits) = text.strip_prefix('#').filter(|digits| digits.len() == 6 && digits.is_ascii()) {
            let levels = u32::from_str_radix(digits, 16).ok()?.to_be_bytes();
            return Some([1, 2, 3].map(|at| texture::linear(f64::from(levels[at]) / 255.0)));
        }
        let words = || text.split([' ', ',', '\t', '\n']).filter(|word| !word.is_empty());
        let number = |word: &str| word.parse::<f64>().ok().filter(|number| number.is_finite());
        if text.contains(':') {
            let pair = |word: &str| {
                let (at, of) = word.split_once(':')?;
                Some((number(at)?, number(of)?))
            };
            return words().map(pair).collect::<Option<_>>().map(rgb_of_pairs);
        }
        let numbers: Vec<f64> = words().map(number).collect::<Option<_>>()?;
        let channels = match numbers[..] {
            [red, green, blue] => [red, green, blue],
            [one] => [one; 3],
            _ => return None,
        };
        Some(if node.has_tag_name("srgb") { channels.map(texture::linear) } else { channels })
    }

    /// The x, y and z of an element, or its `value`; those that are left out have a default.
    fn vector(&self, node: Node<'x, 'x>, default: f64) -> DVec3 {
        let number = |text: &str| text.trim().parse::<f64>().unwrap_or(f64::NAN);
        if let Some(value) = self.attribute(node, "value") {
            let numbers: Vec<f64> =
                value.split([' ', ',']).filter(|word| !word.is_empty()).map(number).collect();
            return match numbers[..] {
                [x, y, z] => DVec3::new(x, y, z),
                [one] => DVec3::splat(one),
                _ => DVec3::NAN,
            };
        }
        DVec3::from_array(
            ["x", "y", "z"].map(|axis| self.attribute(node, axis).map_or(default, |text| number(&text))),
        )
    }

    /// The transform of an element: its steps, the first of which applies first.
    fn transform(&self, node: Node<'x, 'x>) -> DAffine3 {
        let mut all = DAffine3::IDENTITY;
        for step in node.children().filter(Node::is_element) {
            let step = match step.tag_name().name() {
                "translate" => DAffine3::from_translation(self.vector(step, 0.0)),
                "scale" => DAffine3::from_scale(self.vector(step, 1.0)),
                "rotate" => {
                    let angle = self.attribute(step, "angle").and_then(|angle| angle.parse::<f64>().ok());
                    let axis = self.vector(step, 0.0).normalize_or_zero();
                    match axis == DVec3::ZERO {
                        true => DAffine3::IDENTITY,
                        false => DAffine3::from_axis_angle(axis, angle.unwrap_or(0.0).to_radians()),
                    }
                }
                "matrix" => {
                    let text = self.attribute(step, "value").unwrap_or_default();
                    let numbers =
                        text.split([' ', ',', '\n', '\t']).filter_map(|word| word.parse::<f64>().ok());
                    let numbers: Vec<f64> = numbers.collect();
                    match (<&[f64; 16]>::try_from(&*numbers), <&[f64; 9]>::try_from(&*numbers)) {
                        (Ok(rows), _) => DAffine3::from_mat4(DMat4::from_cols_array(rows).transpose()),
                        (_, Ok(rows)) => DAffine3::from_mat3(DMat3::from_cols_array(rows).transpose()),
                        _ => DAffine3::from_scale(DVec3::NAN),
                    }
                }
                "lookat" | "lookAt" => {
                    let point = |name: &str| {
                        let text = self.attribute(step, name).unwrap_or_default();
                        let words = text.split([' ', ',']);
                        let numbers: Vec<f64> = words.filter_map(|word| word.parse().ok()).collect();
                        <[f64; 3]>::try_from(numbers).map_or(DVec3::NAN, DVec3::from_array)
                    };
                    let (origin, target) = (point("origin"), point("target"));
                    let forward = (target - origin).normalize();
                    // Without an axis of its own, Mitsuba chooses one by the same rule (Duff et al. 2017).
                    let up = match step.has_attribute("up") {
                        true => point("up"),
                        false => forward.any_orthonormal_pair().0,
                    };
                    let left = up.cross(forward).normalize();
                    DAffine3::from_cols(left, forward.cross(left), forward, origin)
                }
                _ => DAffine3::IDENTITY,
            };
            all = step * all;
        }
        all
    }
}

/// Multiplies what a material reflects.
fn scale(material: &mut Material, factor: f64) {
    material.reflectance = Spectrum::rgb(material.reflectance.channels().map(|channel| channel * factor));
}

/// Mixes a material with a part of another one.
fn mix(material: &mut Material, other: Material, part: f64) {
    let (own, others) = (material.reflectance.channels(), other.reflectance.channels());
    let mixed = std::array::from_fn(|channel| own[channel] + part * (others[channel] - own[channel]));
    material.reflectance = Spectrum::rgb(mixed);
    material.texture = material.texture.take().or(other.texture);
    other.lost.into_iter().for_each(|lost| material.loses(lost));
    if other.sides == Some(Sides::Front) {
        material.sides = other.sides;
    }
}

/// A mesh of corners and triangles, whose fronts are counter-clockwise.
fn made(corners: &[[f64; 3]], faces: &[[u32; 3]]) -> Mesh {
    let triangle = |&corners: &[u32; 3]| Triangle { corners, part: 0, face: 0, material: 0, line: 0 };
    Mesh {
        positions: corners.iter().map(|&corner| DVec3::from_array(corner)).collect(),
        triangles: faces.iter().map(triangle).collect(),
        ..Mesh::default()
    }
}

/// The cube from −1 to 1, fronts outwards.
fn cube() -> Mesh {
    let corner = |i: u32| [0, 1, 2].map(|axis| if i >> axis & 1 == 1 { 1.0 } else { -1.0 });
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let faces: Vec<[u32; 3]> = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    made(&(0..8).map(corner).collect::<Vec<_>>(), &faces)
}

/// The disk of radius 1, its front to z: a polygon of 32 corners.
fn disk() -> Mesh {
    let corner = |i: u32| {
        let (sin, cos) = (PI * f64::from(i) / 16.0).sin_cos();
        [cos, sin, 0.0]
    };
    let faces: Vec<[u32; 3]> = (2..32).map(|i| [0, i - 1, i]).collect();
    made(&(0..32).map(corner).collect::<Vec<_>>(), &faces)
}

/// The sphere of radius 1, fronts outwards.
fn sphere() -> Mesh {
    let octahedron = [[1., 0., 0.], [-1., 0., 0.], [0., 1., 0.], [0., -1., 0.], [0., 0., 1.], [0., 0., -1.]];
    let mut faces: Vec<[DVec3; 3]> = Vec::new();
    for [a, b, c] in [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
    {
        faces.push([a, b, c].map(|i: usize| DVec3::from_array(octahedron[i])));
    }
    for _ in 0..CUTS {
        faces = faces
            .iter()
            .flat_map(|&[a, b, c]| {
                let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(a, b)| (a + b).normalize());
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    let corners: Vec<[f64; 3]> = faces.iter().flatten().map(|corner| corner.to_array()).collect();
    let numbers: Vec<[u32; 3]> = (0..faces.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    made(&corners, &numbers)
}
