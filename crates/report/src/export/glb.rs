//! `scene.glb`: the faces as one mesh of binary glTF 2.0 with the radiosity as vertex colour.
//!
//! `COLOR_0` is light, 0 … 1, by the exposure of the picture; the material is unlit (`KHR_materials_unlit`), so that viewers
//! show it as it is. `_RADIOSITY` is B [W/m²] in 32-bit floats, the mean over the channels where there are three.

use std::io::{self, Write};

use radiosity::Estimates;
use serde_json::{Value, json};

use crate::picture::Shot;

/// Constants that the glTF format defines.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// Writes the faces; the shot tells how bright they are shown, and what is up.
///
/// # Errors
/// Those of `writer`; a scene whose buffers take more than 4 GiB, which the format cannot hold.
pub fn write_glb(mut writer: impl Write, estimates: &Estimates, shot: &Shot) -> io::Result<()> {
    let corners = Corners::of(estimates, shot);
    let (views, buffer) = corners.buffer();
    let scene = corners.scene(views, buffer.len(), shot);
    container(&mut writer, &scene, buffer)
}

/// What the corners of the faces are drawn by, in the order of the table.
#[derive(Default)]
struct Corners {
    places: Vec<f32>,
    colours: Vec<f32>,
    /// B [W/m²], the mean over the channels.
    light: Vec<f32>,
    /// Corners of triangles, as indices of places.
    indices: Vec<u32>,
    /// The box around all places.
    low: [f32; 3],
    high: [f32; 3],
}

impl Corners {
    fn of(estimates: &Estimates, shot: &Shot) -> Self {
        let faces = estimates.scene().faces();
        let channels = estimates.scene().channels();
        let mut all = Corners { low: [f32::INFINITY; 3], high: [f32::NEG_INFINITY; 3], ..Corners::default() };
        for (face, piece) in faces.pieces_by_patch() {
            let corners = faces.piece_corners(piece);
            let known = estimates.face(face);
            let emittance = faces.get(face).emittance;
            let radiosity = |c: usize| known.as_deref().map_or(emittance[c], |known| known[c].radiosity);
            let shown = |c: usize| (radiosity(c) * shot.exposure[c]).clamp(0.0, 1.0) as f32;
            let mean = (0..channels).map(radiosity).sum::<f64>() / channels as f64;
            let first = all.light.len() as u32;
            for corner in &corners {
                let place = corner.to_array().map(|x| x as f32);
                all.low = std::array::from_fn(|axis| all.low[axis].min(place[axis]));
                all.high = std::array::from_fn(|axis| all.high[axis].max(place[axis]));
                all.places.extend(place);
                all.colours.extend([0, 1, 2].map(|c| shown(c % channels)));
                all.light.push(mean as f32);
            }
            (2..corners.len() as u32).for_each(|i| all.indices.extend([first, first + i - 1, first + i]));
        }
        all
    }

    /// All numbers one after the other, and where each kind of them lies.
    fn buffer(&self) -> (Vec<Value>, Vec<u8>) {
        let bytes = |values: &[f32]| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>();
        let parts = [
            (bytes(&self.places), ARRAY_BUFFER),
            (bytes(&self.colours), ARRAY_BUFFER),
            (bytes(&self.light), ARRAY_BUFFER),
            (self.indices.iter().flat_map(|index| index.to_le_bytes()).collect(), ELEMENT_ARRAY_BUFFER),
        ];
        let (mut views, mut buffer) = (Vec::new(), Vec::new());
        for (part, target) in parts {
            views.push(
                json!({"buffer": 0, "byteOffset": buffer.len(), "byteLength": part.len(), "target": target}),
            );
            buffer.extend(part);
        }
        (views, buffer)
    }

    /// The document that says what the numbers are.
    fn scene(&self, views: Vec<Value>, bytes: usize, shot: &Shot) -> Value {
        let (count, low, high) = (self.light.len(), self.low, self.high);
        json!({
            "asset": {"version": "2.0", "generator": concat!("radwalk ", env!("CARGO_PKG_VERSION"))},
            "extensionsUsed": ["KHR_materials_unlit"],
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0, "rotation": upright(shot.viewpoint.up)}],
            "meshes": [{"primitives": [{
                "attributes": {"POSITION": 0, "COLOR_0": 1, "_RADIOSITY": 2},
                "indices": 3,
                "material": 0
            }]}],
            "materials": [{
                "name": "radiosity",
                "extensions": {"KHR_materials_unlit": {}},
                "pbrMetallicRoughness": {"baseColorFactor": [1.0, 1.0, 1.0, 1.0], "metallicFactor": 0.0}
            }],
            "accessors": [
                {"bufferView": 0, "componentType": FLOAT, "count": count, "type": "VEC3", "min": low, "max": high},
                {"bufferView": 1, "componentType": FLOAT, "count": count, "type": "VEC3"},
                {"bufferView": 2, "componentType": FLOAT, "count": count, "type": "SCALAR"},
                {"bufferView": 3, "componentType": UNSIGNED_INT, "count": self.indices.len(), "type": "SCALAR"}
            ],
            "bufferViews": views,
            "buffers": [{"byteLength": bytes}]
        })
    }
}

/// The rotation that turns a scene's up to glTF's, which is y, as a quaternion [x, y, z, w].
fn upright(up: [f64; 3]) -> [f64; 4] {
    if up[1] > 0.5 {
        [0.0, 0.0, 0.0, 1.0]
    } else {
        // A quarter turn about x takes z to y.
        [-std::f64::consts::FRAC_1_SQRT_2, 0.0, 0.0, std::f64::consts::FRAC_1_SQRT_2]
    }
}

/// Header and chunks of a binary glTF file.
fn container(writer: &mut impl Write, scene: &serde_json::Value, buffer: Vec<u8>) -> io::Result<()> {
    let mut json = scene.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let size = 12 + 8 + json.len() + 8 + buffer.len();
    let size =
        u32::try_from(size).map_err(|_| io::Error::other("a .glb file holds 4 GiB, and this scene more"))?;
    writer.write_all(b"glTF")?;
    for number in [2, size, json.len() as u32] {
        writer.write_all(&number.to_le_bytes())?;
    }
    writer.write_all(b"JSON")?;
    writer.write_all(&json)?;
    writer.write_all(&(buffer.len() as u32).to_le_bytes())?;
    writer.write_all(b"BIN\0")?;
    writer.write_all(&buffer)
}
