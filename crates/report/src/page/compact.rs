//! The scene and its light for pages of many patches: corners on a grid of 16 bits that faces share, numbers as logarithms in
//! 8 or 16 bits, all as differences that pack well. `web/src/compact.js` reads them.
//!
//! Of scenes with more faces than a page can hold, corners are moved to the points of a coarser grid, and faces that have no
//! area left are left out (J. Rossignac & P. Borrel, *Multi-resolution 3D approximations for rendering complex scenes*, 1993).

use std::collections::{HashMap, HashSet};
use std::io::{self, Write};

use foldhash::fast::FixedState;
use glam::DVec3;
use parallel::both;
use radiosity::{Estimate, Estimates, Side};
use serde::Serialize;

use crate::pack::pack;
use crate::smooth::Smooth;

/// Below this many rows the page holds the whole table.
const TABLE_UP_TO: usize = 6_000;

/// Rows times channels up to which the ends of each interval are kept, beside the mean.
const ENDS_UP_TO: usize = 600_000;

/// Rows, with each channel counted as a half more, that a page holds at most.
const ROWS_UP_TO: usize = 450_000;

/// Steps of the finest grid of corners, and of the coarsest that is tried.
const GRID: [u32; 2] = [65_535, 128];

/// Steps of the first grid that is tried where the finest leaves more rows than a page holds.
const COARSER: u32 = 8_192;

/// Numbers in 16 bits are rounded to steps of this many to the octave: half a step is 0.02 %.
const STEPS: f64 = 1_536.0;

/// The same of light at corners, which is seen and not read.
const SEEN_STEPS: f64 = 64.0;

/// Half-widths in 8 bits: steps to the octave.
const WIDTH_STEPS: f64 = 12.0;

/// Rows that a thread makes at once.
const AT_ONCE: usize = 1 << 14;

/// What the script needs to know of the compact numbers.
#[derive(Serialize)]
pub(super) struct CompactLayout {
    /// Rows in the page, and faces or pieces of the scene.
    rows: usize,
    of: usize,
    vertices: usize,
    channels: usize,
    two_sided: bool,
    /// The place of grid point 0, and the step of the grid [m].
    low: [f64; 3],
    step: f64,
    /// Reflectance and emittance of each material, the channels side by side.
    materials: Vec<Vec<f64>>,
    /// Numbers in 16 bits: the exponents of 2 that code 1 stands for, of B, of the intervals, and of the light at corners.
    least: f64,
    steps: f64,
    seen_steps: f64,
    width_steps: f64,
    /// Whether both ends of intervals are there, or else a half-width.
    ends: bool,
}

impl CompactLayout {
    /// What the page leaves out.
    pub(super) fn words(&self) -> String {
        let numbers =
            if self.ends { "Numbers are rounded to 0.02 %" } else { "Half-widths are rounded to 3 %" };
        let shown = if self.rows < self.of {
            format!(
                " The page shows {} of {} faces: those that are too small are left out.",
                self.rows, self.of
            )
        } else {
            String::new()
        };
        format!("{numbers}; patches.csv has more digits, names and columns.{shown}")
    }
}

/// Rows of the page, the pieces in patch order.
struct CompactRows {
    face: usize,
    piece: u32,
    corners: [[u16; 3]; 4],
}

/// Whether a page of this many rows holds the whole table.
pub(super) fn holds_table(rows: usize) -> bool {
    rows <= TABLE_UP_TO
}

/// How light is coded in 16 bits: as a logarithm.
struct LightCode {
    /// The exponent of 2 that code 2 stands for.
    least: f64,
}

impl LightCode {
    /// The code in which the largest number has the highest code: a radiosity, the upper end of its interval, or an irradiance.
    fn of(estimates: &Estimates) -> Self {
        let most = |of: &Estimate| of.ci_high.max(of.radiosity).max(of.irradiance.unwrap_or(0.0));
        let brightest = estimates.iter().map(|(_, face, known)| {
            known.as_deref().map_or(face.emittance.max(), |known| known.iter().map(most).fold(0.0, f64::max))
        });
        let brightest = brightest.fold(f64::MIN_POSITIVE, f64::max);
        LightCode { least: brightest.log2() - 65_000.0 / STEPS }
    }

    /// 0 for no number, 1 for nothing.
    fn log(&self, value: f64, steps: f64) -> u16 {
        match value {
            value if value.is_nan() => 0,
            value if value <= 0.0 => 1,
            value => (2.0 + ((value.log2() - self.least) * steps).round().max(0.0)) as u16,
        }
    }
}

/// The corners of rows: those of one place and light are one vertex.
struct VertexTables {
    /// By vertex, its place and its light, 16 bits for each axis and each channel.
    places: [Vec<u16>; 3],
    lights: Vec<Vec<u16>>,
    /// By row, for each of four corners how many vertices ago its own was made; 0 for a new one.
    indices: [Vec<u32>; 4],
}

impl VertexTables {
    fn of(rows: &[CompactRows], smooth: &Smooth, channels: usize, code: &LightCode) -> Self {
        let mut vertices: HashMap<u128, u32, FixedState> = HashMap::default();
        let lights = vec![Vec::new(); channels];
        let mut tables = VertexTables { places: Default::default(), lights, indices: Default::default() };
        for row in rows {
            for (corner, light) in smooth.corners(row.piece as usize).chunks_exact(channels).enumerate() {
                let mut codes = [0; 3];
                codes.iter_mut().zip(light).for_each(|(of, &b)| *of = code.log(b, SEEN_STEPS));
                let place = row.corners[corner];
                let key = place.iter().chain(&codes).fold(0, |key, &part| key << 16 | u128::from(part));
                let next = vertices.len() as u32;
                let vertex = *vertices.entry(key).or_insert_with(|| {
                    (0..3).for_each(|axis| tables.places[axis].push(place[axis]));
                    tables.lights.iter_mut().zip(codes).for_each(|(light, code)| light.push(code));
                    next
                });
                // Most that are not new have been met a short while ago.
                tables.indices[corner].push(next - vertex);
            }
        }
        tables
    }

    fn write(&self, mut writer: impl Write) -> io::Result<()> {
        self.places.iter().chain(&self.lights).try_for_each(|plane| sixteen(&mut writer, plane))?;
        self.indices.iter().try_for_each(|plane| thirty_two(&mut writer, plane))
    }
}

/// What is known of rows.
struct RowTables {
    /// Reflectance and emittance of each material, the channels side by side.
    materials: Vec<Vec<f64>>,
    material_of: Vec<u16>,
    /// 1 for a back.
    sides: Vec<u8>,
    patches: Vec<u32>,
    /// By quantity and channel: B, and where ends are wanted those of its interval.
    light: Vec<Vec<u16>>,
    /// Where no ends are wanted, the half-widths.
    widths: Vec<u8>,
    /// By channel, H of rows that emit or are black; that of other rows follows from B.
    irradiance: Vec<Vec<u16>>,
}

impl RowTables {
    fn of(rows: &[CompactRows], estimates: &Estimates, ends: bool, code: &LightCode) -> Self {
        let (faces, channels) = (estimates.scene().faces(), estimates.scene().channels());
        let mut numbers: HashMap<[[u64; 3]; 2], u16> = HashMap::new();
        let mut tables = RowTables {
            materials: Vec::new(),
            material_of: Vec::new(),
            sides: Vec::new(),
            patches: Vec::new(),
            light: vec![Vec::new(); channels * if ends { 3 } else { 1 }],
            widths: Vec::new(),
            irradiance: vec![Vec::new(); channels],
        };
        for row in rows {
            let face = faces.piece(row.piece);
            let known = estimates.face(row.face);
            let material = [face.reflectance, face.emittance].map(radiosity::Spectrum::channels);
            let next = numbers.len().min(usize::from(u16::MAX)) as u16;
            let number = *numbers.entry(material.map(|of| of.map(f64::to_bits))).or_insert_with(|| {
                tables.materials.push(material.iter().flat_map(|of| &of[..channels]).copied().collect());
                next
            });
            tables.material_of.push(number);
            tables.sides.push(u8::from(face.side == Side::Back));
            tables.patches.push(face.patch);
            for c in 0..channels {
                let values = known.as_deref().map(|known| {
                    [known[c].known_radiosity().unwrap_or(f64::NAN), known[c].ci_low, known[c].ci_high]
                });
                let values = values.unwrap_or([f64::NAN; 3]);
                for (which, value) in values.into_iter().enumerate().take(if ends { 3 } else { 1 }) {
                    tables.light[which * channels + c].push(code.log(value, STEPS));
                }
                let follows = face.emittance[c] == 0.0 && face.reflectance[c] > 0.0;
                let told = known.as_deref().and_then(|known| known[c].irradiance).filter(|_| !follows);
                tables.irradiance[c].push(code.log(told.unwrap_or(f64::NAN), STEPS));
            }
            if !ends {
                tables.widths.push(width_code(known.as_deref()));
            }
        }
        tables
    }

    fn write(&self, mut writer: impl Write) -> io::Result<()> {
        thirty_two(&mut writer, &steps(&self.patches))?;
        writer.write_all(&self.sides)?;
        sixteen(&mut writer, &self.material_of)?;
        self.light.iter().try_for_each(|plane| sixteen(&mut writer, plane))?;
        writer.write_all(&self.widths)?;
        self.irradiance.iter().try_for_each(|plane| sixteen(&mut writer, plane))
    }
}

/// The half-width of a face in 8 bits, from 2⁻¹⁵ on; 0 where nothing is known.
fn width_code(known: Option<&[Estimate]>) -> u8 {
    let width = known
        .map_or(f64::NAN, |known| known.iter().map(radiosity::Estimate::relative_error).fold(0.0, f64::max));
    match width {
        width if width.is_nan() => 0,
        width => (1.0 + ((width.max(1e-9).log2() + 15.0) * WIDTH_STEPS).round().clamp(0.0, 254.0)) as u8,
    }
}

/// The layout, and the packed numbers.
pub(super) fn compact(estimates: &Estimates, smooth: &Smooth) -> io::Result<(CompactLayout, String)> {
    let scene = estimates.scene();
    let (faces, channels) = (scene.faces(), scene.channels());
    let (rows, low, step) = rows(estimates);
    let ends = rows.len() * channels <= ENDS_UP_TO;
    let code = LightCode::of(estimates);
    let (vertices, known) = both(
        || VertexTables::of(&rows, smooth, channels, &code),
        || RowTables::of(&rows, estimates, ends, &code),
    );
    let packed = pack(|zlib| {
        vertices.write(&mut *zlib)?;
        known.write(&mut *zlib)
    })?;
    let layout = CompactLayout {
        rows: rows.len(),
        of: faces.piece_count(),
        vertices: vertices.places[0].len(),
        channels,
        two_sided: faces.two_sided(),
        low: low.to_array(),
        step,
        materials: known.materials,
        least: code.least,
        steps: STEPS,
        seen_steps: SEEN_STEPS,
        width_steps: WIDTH_STEPS,
        ends,
    };
    Ok((layout, packed))
}

/// The rows on the finest grid that leaves no more than a page holds, the place of its first point and its step [m].
fn rows(estimates: &Estimates) -> (Vec<CompactRows>, DVec3, f64) {
    let faces = estimates.scene().faces();
    let most = 2 * ROWS_UP_TO / (1 + estimates.scene().channels());
    let bounds = crate::bounds::Bounds::of(estimates.scene());
    let low = bounds.min + estimates.scene().origin();
    let size = bounds.size().max_element().max(f64::MIN_POSITIVE);
    let on_grid =
        |corner: DVec3| ((corner - low) * (f64::from(GRID[0]) / size)).round().to_array().map(|x| x as u16);
    let on_finest = |&(face, piece): &(usize, u32)| {
        let corners = faces.piece_corners(piece);
        let corners = std::array::from_fn(|i| on_grid(corners[i.min(corners.len() - 1)]));
        CompactRows { face, piece, corners }
    };
    let pieces: Vec<(usize, u32)> = faces.pieces_by_patch().collect();
    let finest = parallel::map(&pieces, AT_ONCE, on_finest);
    if finest.len() <= most {
        return (finest, low, size / f64::from(GRID[0]));
    }
    let kept = |steps: u32, up_to: usize| -> Vec<CompactRows> {
        let times = f64::from(steps) / f64::from(GRID[0]);
        let coarse = |row: &CompactRows| CompactRows {
            corners: row.corners.map(|corner| corner.map(|x| (f64::from(x) * times).round() as u16)),
            ..*row
        };
        let mut met = HashSet::with_hasher(FixedState::default());
        // A face without area, or where another of that outline is, is lost.
        let is_kept = |row: &CompactRows| !has_no_area(&row.corners) && met.insert(row.corners);
        finest.iter().map(coarse).filter(is_kept).take(up_to).collect()
    };
    let mut coarser = vec![COARSER];
    while let Some(&steps) = coarser.last().filter(|&&steps| steps > GRID[1]) {
        coarser.push(steps * 3 / 4);
    }
    let fits = coarser.partition_point(|&steps| kept(steps, most + 1).len() > most);
    let steps = coarser[fits.min(coarser.len() - 1)];
    (kept(steps, finest.len()), low, size / f64::from(steps))
}

fn has_no_area(corners: &[[u16; 3]; 4]) -> bool {
    let at = |i: usize| DVec3::from(corners[i].map(f64::from));
    (at(2) - at(0)).cross(at(3) - at(1)).length() + (at(1) - at(0)).cross(at(2) - at(0)).length() == 0.0
}

/// The difference of each number from the one before.
fn steps(numbers: &[u32]) -> Vec<u32> {
    let mut before = 0_u32;
    numbers.iter().map(|&number| number.wrapping_sub(std::mem::replace(&mut before, number))).collect()
}

/// Numbers of 16 bits as differences, the low bytes of all before the high ones.
fn sixteen(mut writer: impl Write, numbers: &[u16]) -> io::Result<()> {
    let mut before = 0_u16;
    let steps: Vec<[u8; 2]> = numbers
        .iter()
        .map(|&number| number.wrapping_sub(std::mem::replace(&mut before, number)).to_le_bytes())
        .collect();
    (0..2).try_for_each(|byte| writer.write_all(&steps.iter().map(|step| step[byte]).collect::<Vec<u8>>()))
}

/// Numbers of 32 bits as they are, byte by byte of all.
fn thirty_two(mut writer: impl Write, numbers: &[u32]) -> io::Result<()> {
    (0..4).try_for_each(|byte| {
        writer.write_all(&numbers.iter().map(|number| number.to_le_bytes()[byte]).collect::<Vec<u8>>())
    })
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use base64::Engine;
    use base64::engine::general_purpose::STANDARD;
    use flate2::read::ZlibDecoder;
    use radiosity::{IndexChoice, Scene, SceneSpec};

    use super::*;
    use crate::scenes::{experiment, quad, shot};

    /// Reads planes of bytes as the script does.
    struct Planes(std::vec::IntoIter<u8>);

    impl Planes {
        fn eight(&mut self, count: usize) -> Vec<u8> {
            self.0.by_ref().take(count).collect()
        }

        fn sixteen(&mut self, count: usize) -> Vec<u16> {
            let bytes = [self.eight(count), self.eight(count)];
            let mut sum = 0_u16;
            let mut next = |i: usize| {
                sum = sum.wrapping_add(u16::from_le_bytes([bytes[0][i], bytes[1][i]]));
                sum
            };
            (0..count).map(&mut next).collect()
        }

        fn thirty_two(&mut self, count: usize) -> Vec<u32> {
            let bytes = [(); 4].map(|()| self.eight(count));
            (0..count).map(|i| u32::from_le_bytes([0, 1, 2, 3].map(|byte: usize| bytes[byte][i]))).collect()
        }
    }

    /// Every corner is where it was within half a step of the grid, and every radiosity what it was within the rounding.
    #[test]
    fn corners_and_numbers_are_read_back() {
        let mut lamp = quad("lamp", [[0., 0., 1.], [0., 4., 1.], [4., 0., 1.]], [9, 9], 0.0);
        lamp.emittance = 3.0.into();
        let floor = quad("floor", [[0., 0., 0.], [4., 0., 0.], [0., 4., 0.]], [80, 80], 0.5);
        let scene = Scene::build(&SceneSpec::new(vec![floor, lamp]), IndexChoice::Auto).unwrap();
        let experiment = experiment(&scene);
        let tally = shot(&experiment);
        let estimates = Estimates::new(&experiment, &tally, 0.95);
        let (layout, packed) = compact(&estimates, &Smooth::new(&estimates)).unwrap();
        let faces = scene.faces();
        assert_eq!((layout.rows, layout.of, layout.ends), (faces.len(), faces.len(), true));
        assert!(!holds_table(layout.rows) && packed.len() < 16 * layout.rows, "{}", packed.len());
        let mut bytes = Vec::new();
        ZlibDecoder::new(&STANDARD.decode(packed).unwrap()[..]).read_to_end(&mut bytes).unwrap();
        let mut planes = Planes(bytes.into_iter());
        let places = [(); 3].map(|()| planes.sixteen(layout.vertices));
        planes.sixteen(layout.vertices);
        let back = [(); 4].map(|()| planes.thirty_two(layout.rows));
        let mut met = 0;
        for face in 0..faces.len() {
            for (back_steps, truth) in back.iter().zip(faces.piece_corners(face as u32)) {
                let vertex = met - back_steps[face] as usize;
                met += usize::from(vertex == met);
                let place =
                    [0, 1, 2].map(|axis| layout.low[axis] + layout.step * f64::from(places[axis][vertex]));
                assert!((DVec3::from(place) - truth).abs().max_element() <= 0.501 * layout.step, "{truth}");
            }
        }
        assert_eq!(met, layout.vertices);
        let patches = planes.thirty_two(layout.rows);
        assert!(patches.iter().skip(1).all(|&step| step == 1));
        planes.eight(layout.rows);
        assert_eq!(planes.sixteen(layout.rows).iter().filter(|&&material| material == 1).count(), 81);
        let mut unknown = 0;
        for (face, code) in planes.sixteen(layout.rows).into_iter().enumerate() {
            let read = 2_f64.powf(layout.least + (f64::from(code) - 2.0) / layout.steps);
            match estimates.face(face).and_then(|known| known[0].known_radiosity()) {
                Some(truth) => assert!((read / truth - 1.0).abs() < 3e-4, "{read} {truth}"),
                None => assert_eq!(code, 0, "what no walk has hit is unknown, not dark"),
            }
            unknown += u32::from(code == 0);
        }
        assert!(unknown > 0, "some patches are unhit");
        for end in [false, true] {
            for (face, code) in planes.sixteen(layout.rows).into_iter().enumerate() {
                let known = estimates.face(face).unwrap()[0];
                let truth = if end { known.ci_high } else { known.ci_low };
                let read = 2_f64.powf(layout.least + (f64::from(code) - 2.0) / layout.steps);
                assert!(truth == 0.0 || (read / truth - 1.0).abs() < 3e-4, "{read} {truth}");
            }
        }
        // The lamp is black, and its irradiance is not in its radiosity.
        for (face, code) in planes.sixteen(layout.rows).into_iter().enumerate() {
            let told = estimates.face(face).and_then(|known| known[0].irradiance);
            match told.filter(|_| faces.get(face).emittance.is_lit()) {
                Some(truth) => {
                    let read = 2_f64.powf(layout.least + (f64::from(code) - 2.0) / layout.steps);
                    assert!((read / truth - 1.0).abs() < 3e-4, "{read} {truth}");
                }
                None => assert_eq!(code, 0),
            }
        }
        assert_eq!(planes.0.len(), 0);
    }
}
