//! The images of glTF's materials: which faces show them, and their means.

use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use image::DynamicImage;
use radiosity::Spectrum;

use super::buffers::{Data, decode_data, decode_percent};
use super::json::Document;
use super::material::{TextureRole, finish, has_alpha, placing, textures};
use crate::files::Files;
use crate::mesh::{LostProperty, Mesh};
use crate::texture::{self, Placing, Sampling, TexturedFace};

/// The use of an image by a material.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slot {
    material: usize,
    image: Option<usize>,
    role: TextureRole,
    /// The set of places that it takes.
    pub(super) set: usize,
    placing: Placing,
    opacity: bool,
    /// Its number among all.
    number: usize,
}

/// The images that materials use.
pub(super) struct GltfImages {
    slots: Vec<Slot>,
    /// The faces that show each slot.
    shown: Vec<Vec<TexturedFace>>,
    /// Places in images, by the number of their accessor.
    places: HashMap<usize, Vec<[f64; 2]>>,
}

impl GltfImages {
    /// The images of a document's materials, without faces.
    pub(super) fn of(document: &Document) -> Self {
        let mut slots = Vec::new();
        for (material, json) in document.materials.iter().enumerate() {
            for (role, texture) in textures(json) {
                let (set, placing) = placing(document, texture);
                let image = document.textures.get(texture.index).and_then(|texture| texture.source);
                let opacity = role == TextureRole::Colour && has_alpha(json);
                slots.push(Slot { material, image, role, set, placing, opacity, number: slots.len() });
            }
        }
        GltfImages { shown: vec![Vec::new(); slots.len()], slots, places: HashMap::new() }
    }

    /// The slots of a material.
    pub(super) fn asked(&self, material: u32) -> Vec<Slot> {
        // Slots are in the order of their materials.
        let first = self.slots.partition_point(|slot| slot.material < material as usize);
        let of = self.slots[first..].iter().take_while(|slot| slot.material == material as usize);
        of.copied().collect()
    }

    /// Whether the places of an accessor are kept.
    pub(super) fn knows(&self, accessor: usize) -> bool {
        self.places.contains_key(&accessor)
    }

    /// Keeps the places of an accessor.
    pub(super) fn keep(&mut self, accessor: usize, places: Vec<[f64; 2]>) {
        self.places.insert(accessor, places);
    }

    /// Adds the triangles of a mesh from `before` on, whose vertices are numbered from `first`.
    pub(super) fn show(&mut self, slot: Slot, accessor: usize, mesh: &Mesh, before: usize, first: u32) {
        let Some(places) = self.places.get(&accessor) else { return };
        let shown = mesh.triangles[before..].iter().filter_map(|triangle| {
            let place =
                |corner: u32| places.get((corner - first) as usize).map(|place| place.map(|x| x as f32));
            let [Some(a), Some(b), Some(c)] = triangle.corners.map(place) else { return None };
            Some(TexturedFace { area: mesh.area(triangle) as f32, corners: [a, b, c] })
        });
        self.shown[slot.number].extend(shown);
    }

    /// Multiplies the colours and emissions of the used materials by the means of their images, of which each is read once. Then takes from all
    /// materials what is no paint.
    pub(super) fn look_up(mut self, data: &Data<'_>, path: &Path, files: &mut Files<'_>, mesh: &mut Mesh) {
        let mut used = vec![false; mesh.materials.len()];
        mesh.triangles.iter().for_each(|triangle| used[triangle.material as usize] = true);
        let mut users: BTreeMap<Option<usize>, Vec<Slot>> = BTreeMap::new();
        let slots = self.slots.iter().filter(|slot| used[slot.material]);
        slots.for_each(|slot| users.entry(slot.image).or_default().push(*slot));
        let points = texture::points(users.values().map(Vec::len).sum());
        let mut means: HashMap<usize, HashMap<TextureRole, Option<Spectrum>>> = HashMap::new();
        for (number, slots) in users {
            let image = number.and_then(|number| read(data, number, path, files));
            for slot in slots {
                let shown = std::mem::take(&mut self.shown[slot.number]);
                let raw = matches!(slot.role, TextureRole::Metal | TextureRole::Transmission);
                let sampling = Sampling { points, opacity: slot.opacity, raw };
                let mean = image.as_ref().map(|image| texture::mean(image, &shown, slot.placing, sampling));
                let material = &mut mesh.materials[slot.material];
                let colour = mean.map(|mean| mean.colour);
                match slot.role {
                    TextureRole::Emission => material.shine(colour),
                    TextureRole::Colour => material.show(name(data.document, number), colour),
                    role => drop(means.entry(slot.material).or_default().insert(role, colour)),
                }
                if mean.is_some_and(|mean| mean.alpha < 0.99) {
                    material.loses(LostProperty::Transparency);
                }
            }
        }
        for (number, json) in data.document.materials.iter().enumerate() {
            finish(json, &means.remove(&number).unwrap_or_default(), &mut mesh.materials[number]);
        }
    }
}

fn name(document: &Document, image: Option<usize>) -> String {
    let json = image.and_then(|number| document.images.get(number));
    let uri = json.and_then(|json| json.uri.as_deref()).filter(|uri| !uri.starts_with("data:"));
    let written = uri.or(json.and_then(|json| json.name.as_deref()));
    written.map_or_else(|| image.map_or("an image".into(), |image| format!("image {image}")), str::to_owned)
}

/// Reads an image: of a view, of a data URI or of a file beside this one.
fn read(data: &Data<'_>, number: usize, path: &Path, files: &mut Files<'_>) -> Option<DynamicImage> {
    let json = data.document.images.get(number)?;
    match (json.buffer_view, json.uri.as_deref()) {
        (Some(view), _) => texture::decode(data.view(view)?),
        (None, Some(uri)) if uri.starts_with("data:") => texture::decode(&decode_data(uri)?),
        (None, Some(uri)) => texture::decode(&files.beside(path, &decode_percent(uri)).ok()?.1),
        (None, None) => None,
    }
}
