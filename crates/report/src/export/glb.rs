//! `scene.glb`: the faces as one mesh of binary glTF 2.0 with the radiosity as vertex colour.
//!
//! `COLOR_0` is light, 0 … 1, by the exposure of the picture; the material is unlit (`KHR_materials_unlit`), so that viewers
//! show it as it is. `_RADIOSITY` is B [W/m²] in 32-bit floats, the mean over the channels where there are three.
//!
//! A sensor is a node of its own with the outlines of its cells as lines, which importers do not take for surfaces. Its `extras` hold
//! the rows of `sensors.csv`.

use std::io::{self, Write};

use glam::DVec3;
use radiosity::{
    Estimates,
    sensors::{Reading, Readings},
};
use serde_json::{Value, json};

use crate::bounds::Bounds;
use crate::camera::Frame;
use crate::outlines::outlines;
use crate::picture::Shot;

/// Constants that the glTF format defines.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const LINES: u32 = 1;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// The colour of sensors.
const SENSOR_COLOUR: [f64; 4] = [0.0, 0.62, 0.45, 1.0];

/// Writes the faces and the sensors; the shot tells how bright faces are shown.
///
/// # Errors
/// Those of `writer`; a scene whose buffers take more than 4 GiB, which the format cannot hold.
pub fn write_glb(
    mut writer: impl Write,
    estimates: &Estimates,
    readings: Option<&Readings>,
    shot: &Shot,
) -> io::Result<()> {
    let corners = VertexBuffers::of(estimates, shot);
    let (views, mut buffer) = corners.buffer();
    let up = Frame::of(estimates.scene(), &Bounds::below_sky(estimates.scene())).up;
    let mut scene = corners.scene(views, up);
    if let Some(readings) = readings {
        add_sensors(&mut scene, &mut buffer, readings);
    }
    scene["buffers"] = json!([{"byteLength": buffer.len()}]);
    container(&mut writer, &scene, buffer)
}

/// Adds a node for each sensor: the outlines of its cells, and what they read.
fn add_sensors(scene: &mut Value, buffer: &mut Vec<u8>, readings: &Readings) {
    let outlines = outlines(readings);
    let rotation = scene["nodes"][0]["rotation"].clone();
    add(
        scene,
        "materials",
        json!({
            "name": "sensor",
            "extensions": {"KHR_materials_unlit": {}},
            "pbrMetallicRoughness": {"baseColorFactor": SENSOR_COLOUR, "metallicFactor": 0.0}
        }),
    );
    for (number, spec) in readings.sensors().specs().iter().enumerate() {
        let cells = readings.sensors().cells_of(number);
        let ends = outlines[cells.clone()]
            .iter()
            .flat_map(|corners| (0..4).flat_map(move |i| [corners[i], corners[(i + 1) % 4]]));
        let places: Vec<[f32; 3]> = ends.map(|end| end.to_array().map(|x| x as f32)).collect();
        let extreme = |pick: fn(f32, f32) -> f32| -> [f32; 3] {
            std::array::from_fn(|axis| places.iter().map(|place| place[axis]).reduce(pick).unwrap_or(0.0))
        };
        let bytes: Vec<u8> = places.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        let view = add(
            scene,
            "bufferViews",
            json!({
                "buffer": 0, "byteOffset": buffer.len(), "byteLength": bytes.len(), "target": ARRAY_BUFFER
            }),
        );
        buffer.extend(bytes);
        let accessor = add(
            scene,
            "accessors",
            json!({
                "bufferView": view, "componentType": FLOAT, "count": places.len(), "type": "VEC3",
                "min": extreme(f32::min), "max": extreme(f32::max)
            }),
        );
        let mesh = add(
            scene,
            "meshes",
            json!({
                "name": spec.name,
                "primitives": [{"attributes": {"POSITION": accessor}, "material": 1, "mode": LINES}]
            }),
        );
        let node = add(
            scene,
            "nodes",
            json!({
                "name": spec.name, "mesh": mesh, "rotation": rotation, "extras": extras(readings, cells)
            }),
        );
        scene["scenes"][0]["nodes"].as_array_mut().expect("a list").push(node.into());
    }
}

/// Adds an element to a list of the document; returns its number.
fn add(scene: &mut Value, list: &str, element: Value) -> usize {
    let list = scene[list].as_array_mut().expect("a list");
    list.push(element);
    list.len() - 1
}

/// What the cells of a sensor read, in the order of `sensors.csv`; a cell of a coloured scene has three numbers.
fn extras(readings: &Readings, cells: std::ops::Range<usize>) -> Value {
    let of = |value: fn(&Reading) -> Option<f64>| -> Vec<Value> {
        let cell = |cell: usize| {
            let known: Vec<Option<f64>> = readings.cell(cell).iter().map(value).collect();
            if let [only] = known[..] { json!(only) } else { json!(known) }
        };
        cells.clone().map(cell).collect()
    };
    json!({
        "irradiance": of(|r| r.irradiance), "std_error": of(|r| r.std_error),
        "ci_low": of(|r| Some(r.ci_low)), "ci_high": of(|r| Some(r.ci_high))
    })
}

/// What the corners of the faces are drawn by, in the order of the table.
#[derive(Default)]
struct VertexBuffers {
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

impl VertexBuffers {
    fn of(estimates: &Estimates, shot: &Shot) -> Self {
        let faces = estimates.scene().faces();
        let channels = estimates.scene().channels();
        let mut all = VertexBuffers {
            low: [f32::INFINITY; 3],
            high: [f32::NEG_INFINITY; 3],
            ..VertexBuffers::default()
        };
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
    fn scene(&self, views: Vec<Value>, up: DVec3) -> Value {
        let (count, low, high) = (self.light.len(), self.low, self.high);
        json!({
            "asset": {"version": "2.0", "generator": concat!("radwalk ", env!("CARGO_PKG_VERSION"))},
            "extensionsUsed": ["KHR_materials_unlit"],
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0, "rotation": upright(up)}],
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
            "bufferViews": views
        })
    }
}

/// The rotation that turns a scene's up to glTF's, which is y, as a quaternion [x, y, z, w].
fn upright(up: DVec3) -> [f64; 4] {
    if up.y > 0.5 {
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

#[cfg(test)]
mod tests {
    use job::{Stand, View};

    use super::*;
    use crate::scenes::{cube, experiment, shot};

    /// A view from above, whose up is y, does not lay a scene whose up is z on its side.
    #[test]
    fn the_scene_stands_whatever_the_view() {
        let experiment = experiment(&cube());
        let tally = shot(&experiment);
        let estimates = Estimates::new(&experiment, &tally, 0.95);
        let from_above = Stand {
            eye: DVec3::new(0.5, 0.5, 4.0),
            look_at: DVec3::splat(0.5),
            up: Some(DVec3::Y),
            fov: 40.0,
        };
        let shot = Shot::aim(&estimates, &View { stand: Some(from_above), ..View::default() });
        assert_eq!(shot.viewpoint.up, [0.0, 1.0, 0.0]);
        let mut glb = Vec::new();
        write_glb(&mut glb, &estimates, None, &shot).unwrap();
        let text = String::from_utf8_lossy(&glb);
        assert!(text.contains("\"rotation\":[-0.7071067811865476,0.0,0.0,0.7071067811865476]"), "{text}");
    }
}
