//! `radiosity.png`: the scene, shaded by the radiosity of its patches.

use std::io::{self, Write};
use std::ops::Range;

use job::View;
use radiosity::{Estimates, Scene};
use serde::Serialize;

use crate::camera::{Camera, Sight, Viewpoint};
use crate::cores::on_all_cores;
use crate::smooth::Smooth;
use crate::values::Values;

/// Samples along each side of a pixel that an edge goes through.
const FINE: u32 = 3;

/// Rows of pixels that are looked at together.
const BAND: usize = 16;

/// Pixels with edges that are looked at together.
const FINE_AT_ONCE: usize = 256;

/// Where no picture is drawn its exposure is measured on a picture this much coarser.
const COARSE: u32 = 4;

/// Shades (0 … 1, encoded) that differ by less than this make no edge.
const SAME_SHADE: f64 = 1.5 / 255.0;

/// What is seen beyond the scene, as light: a dark grey, so that black surfaces stand out from it.
const BACKGROUND: f64 = 0.02;

/// The part of what is seen of the non-emitting patches that is at most as bright as [`EXPOSED_LIGHT`].
const EXPOSED_SHARE: f64 = 0.95;

/// The brightness that the exposure gives to this part at most, as light; 1 is white.
const EXPOSED_LIGHT: f64 = 0.7;

/// A picture of a scene: grey, or in colour where the scene is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// The number of pixels per row.
    pub width: u32,
    /// The number of rows.
    pub height: u32,
    /// 1: grey; 3: red, green, blue.
    pub channels: usize,
    /// sRGB-encoded, row by row from the top, the channels of a pixel side by side.
    pub pixels: Vec<u8>,
}

impl Picture {
    /// Renders a scene from the side that shows most of it. `radiosity` is B of every patch [W/m²], the channels of
    /// a patch side by side.
    ///
    /// The exposure is such that nearly all that is seen of non-emitting patches stays below white; lamps clip
    /// to white. The same arguments give the same picture.
    pub fn render(scene: &Scene, radiosity: &[f64]) -> Self {
        Photo::take(scene, radiosity, None, &View::default()).picture
    }

    /// Writes the picture as PNG.
    ///
    /// # Errors
    /// Those of `writer`.
    pub fn write_png(&self, writer: impl Write) -> io::Result<()> {
        let mut encoder = png::Encoder::new(writer, self.width, self.height);
        let grey = self.channels == 1;
        encoder.set_color(if grey { png::ColorType::Grayscale } else { png::ColorType::Rgb });
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        let mut png = encoder.write_header()?;
        png.write_image_data(&self.pixels)?;
        Ok(png.finish()?)
    }
}

/// A picture, what it was made from, and how it was taken.
#[derive(Clone, Debug, PartialEq)]
pub struct Photo {
    /// What an eye sees.
    pub picture: Picture,
    /// The radiosity behind it.
    pub values: Values,
    /// How it was taken.
    pub shot: Shot,
}

impl Photo {
    /// Renders what is estimated of a scene as [`Picture::render`] does, without steps between patches, from where a job
    /// lets the camera stand. A face without an estimate shows its own emission.
    pub fn shoot(estimates: &Estimates, smooth: &Smooth, view: &View) -> Self {
        Photo::take(estimates.scene(), &shown(estimates), Some(smooth), view)
    }

    fn take(scene: &Scene, radiosity: &[f64], smooth: Option<&Smooth>, view: &View) -> Self {
        let camera = Studio::camera(scene, radiosity, view);
        let studio = Studio::expose(scene, radiosity, smooth, camera, view);
        let (picture, values) = studio.develop();
        Photo { picture, values, shot: studio.shot() }
    }
}

/// B of every face [W/m²], the channels of a face side by side; E for a face without an estimate.
fn shown(estimates: &Estimates) -> Vec<f64> {
    let channels = estimates.scene().channels();
    let shown = estimates.iter().flat_map(|(_, face, known)| {
        let shown = move |c| known.map_or(face.emittance[c], |known| known[c].radiosity);
        (0..channels).map(shown)
    });
    shown.collect()
}

/// How a picture was taken.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Shot {
    /// Where the scene is seen from.
    #[serde(flatten)]
    pub viewpoint: Viewpoint,
    /// Width and height [pixels].
    pub size: [u32; 2],
    /// Light, 1 being white, over radiosity, channel by channel [m²/W].
    pub exposure: [f64; 3],
    /// The radiosity that is white, channel by channel [W/m²].
    pub white: [f64; 3],
}

impl Shot {
    /// How a picture would be taken that is not drawn: the exposure is measured on every [`COARSE`]th pixel of every such row.
    pub fn aim(estimates: &Estimates, view: &View) -> Self {
        let (scene, radiosity) = (estimates.scene(), shown(estimates));
        let camera = Studio::camera(scene, &radiosity, view);
        let coarse = Studio::expose(scene, &radiosity, None, camera.coarser(COARSE), view);
        Shot { size: camera.size, ..coarse.shot() }
    }
}

/// A scene in front of a camera, with its light measured.
struct Studio<'a> {
    scene: &'a Scene,
    radiosity: &'a [f64],
    /// Where patches are not flat: radiosity at their corners.
    smooth: Option<&'a Smooth>,
    camera: Camera,
    /// What is seen at the corners of the pixels, (width + 1) × (height + 1) of them, in bands of [`BAND`] rows.
    corners: Vec<Vec<Spot>>,
    /// Light over radiosity, channel by channel.
    exposure: [f64; 3],
}

/// What is seen at a point of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Spot {
    /// The piece of a face, or [`Spot::NOTHING`].
    piece: u32,
    /// Where on the piece's surface.
    uv: [f64; 2],
}

impl Spot {
    /// In place of a piece.
    const NOTHING: u32 = u32::MAX;

    fn of(sight: Option<Sight>) -> Self {
        sight.map_or(Spot { piece: Spot::NOTHING, uv: [0.0; 2] }, |sight| Spot {
            piece: sight.piece,
            uv: sight.uv,
        })
    }

    /// What it is on.
    fn piece(&self) -> Option<u32> {
        (self.piece != Spot::NOTHING).then_some(self.piece)
    }
}

/// What is seen at a corner of pixels: its radiosity [W/m²], light and shade (encoded light) by channels.
struct Corner {
    seen: Option<[f64; 3]>,
    light: Light,
    shade: [f64; 3],
}

/// A pixel: its light, and the mean radiosity behind it with the part of it that shows the scene.
#[derive(Default)]
struct Pixel {
    light: Light,
    value: [f32; 4],
}

/// Some rows of pixels: the bytes of the picture and the values behind them.
type Rows = (Vec<u8>, Vec<[f32; 4]>);

impl<'a> Studio<'a> {
    fn camera(scene: &Scene, radiosity: &[f64], view: &View) -> Camera {
        // By surface: while few walks were shot, which patches are lit is noise.
        let mut lit = vec![false; scene.surfaces().len()];
        for piece in 0..scene.faces().piece_count() as u32 {
            let surface = scene.faces().piece(piece).surface;
            lit[surface as usize] |=
                of_piece(scene, radiosity, piece).iter().any(|&radiosity| radiosity > 0.0);
        }
        Camera::of_view(scene, view, |surface| lit[surface as usize])
    }

    fn expose(
        scene: &'a Scene,
        radiosity: &'a [f64],
        smooth: Option<&'a Smooth>,
        camera: Camera,
        view: &View,
    ) -> Self {
        let [width, height] = camera.size.map(|side| side as usize);
        let corners = on_all_cores((height + 1).div_ceil(BAND), |band| {
            let rows = band * BAND..((band + 1) * BAND).min(height + 1);
            let mut spots = Vec::with_capacity(rows.len() * (width + 1));
            for y in rows {
                let row: Vec<[f64; 2]> = (0..=width).map(|x| [x as f64, y as f64]).collect();
                spots.extend(camera.look(scene, &row).into_iter().map(Spot::of));
            }
            spots
        });
        let exposure = match view.exposure {
            Some(exposure) => white_balance(scene).map(|gain| gain * exposure),
            None => exposure(scene, radiosity, &corners),
        };
        Studio { scene, radiosity, smooth, camera, corners, exposure }
    }

    fn shot(&self) -> Shot {
        Shot {
            viewpoint: self.camera.viewpoint(self.scene),
            size: self.camera.size,
            exposure: self.exposure,
            white: self.exposure.map(|exposure| 1.0 / exposure),
        }
    }

    fn develop(&self) -> (Picture, Values) {
        let [width, height] = self.camera.size;
        let bands = on_all_cores((height as usize).div_ceil(BAND), |band| {
            let first = (band * BAND) as u32;
            self.band(first..(first + BAND as u32).min(height))
        });
        let (pixels, values): (Vec<_>, Vec<_>) = bands.into_iter().unzip();
        let channels = self.scene.channels();
        let picture = Picture { width, height, channels, pixels: pixels.concat() };
        (picture, Values { width, height, channels, values: values.concat() })
    }

    /// Some rows of pixels.
    fn band(&self, rows: Range<u32>) -> Rows {
        let width = self.camera.size[0] as usize;
        let mut pixels: Vec<Pixel> = Vec::with_capacity(rows.len() * width);
        let mut edges: Vec<(usize, [u32; 2])> = Vec::new();
        let mut above = self.corners_of_row(rows.start);
        for y in rows {
            let below = self.corners_of_row(y + 1);
            for x in 0..width {
                let even = self.even_pixel([&above[x], &above[x + 1], &below[x], &below[x + 1]]);
                if even.is_none() {
                    edges.push((pixels.len(), [x as u32, y]));
                }
                pixels.push(even.unwrap_or_default());
            }
            above = below;
        }
        for some in edges.chunks(FINE_AT_ONCE) {
            let places: Vec<[u32; 2]> = some.iter().map(|&(_, place)| place).collect();
            for (&(edge, _), pixel) in some.iter().zip(self.fine_pixels(&places)) {
                pixels[edge] = pixel;
            }
        }
        let channels = self.scene.channels();
        let byte = |&light: &f64| (encode(light) * 255.0).round() as u8;
        let bytes = pixels.iter().flat_map(|pixel| pixel.light[..channels].iter().map(byte)).collect();
        (bytes, pixels.iter().map(|pixel| pixel.value).collect())
    }

    /// The corners of pixels on the upper side of a row of them.
    fn corners_of_row(&self, y: u32) -> Vec<Corner> {
        let (band, row) = (y as usize / BAND, y as usize % BAND);
        let stride = self.camera.size[0] as usize + 1;
        self.corners[band][row * stride..][..stride].iter().map(|&spot| self.corner(spot)).collect()
    }

    fn corner(&self, spot: Spot) -> Corner {
        let seen = self.radiosity(spot);
        let light = self.light(seen);
        let channels = self.scene.channels();
        let shade = std::array::from_fn(|c| if c < channels { encode(light[c]) } else { 0.0 });
        Corner { seen, light, shade }
    }

    /// One pixel whose corners look alike: it needs no further look. `None` where they do not.
    fn even_pixel(&self, corners: [&Corner; 4]) -> Option<Pixel> {
        let alike = |c: usize| {
            let shades = corners.map(|corner| corner.shade[c]);
            let darkest = shades.iter().copied().fold(1.0, f64::min);
            let brightest = shades.iter().copied().fold(0.0, f64::max);
            darkest == brightest || brightest - darkest < SAME_SHADE
        };
        (0..self.scene.channels()).all(alike).then(|| Pixel {
            light: mean(&corners.map(|corner| corner.light)),
            value: value(&corners.map(|corner| corner.seen)),
        })
    }

    /// Pixels that edges go through, by several looks each.
    fn fine_pixels(&self, pixels: &[[u32; 2]]) -> Vec<Pixel> {
        let offset = |k: u32| (f64::from(k) + 0.5) / f64::from(FINE);
        let within = |&[x, y]: &[u32; 2]| {
            (0..FINE * FINE).map(move |k| [f64::from(x) + offset(k % FINE), f64::from(y) + offset(k / FINE)])
        };
        let samples: Vec<[f64; 2]> = pixels.iter().flat_map(within).collect();
        let sights = self.camera.look(self.scene, &samples).into_iter();
        let seen: Vec<Option<[f64; 3]>> = sights.map(|sight| self.radiosity(Spot::of(sight))).collect();
        let pixel = |seen: &[Option<[f64; 3]>]| {
            let lights: Vec<Light> = seen.iter().map(|&seen| self.light(seen)).collect();
            Pixel { light: mean(&lights), value: value(seen) }
        };
        seen.chunks_exact((FINE * FINE) as usize).map(pixel).collect()
    }

    /// B in three channels at what is seen [W/m²]; `None` beyond the scene.
    fn radiosity(&self, spot: Spot) -> Option<[f64; 3]> {
        let piece = spot.piece()?;
        Some(match self.smooth {
            Some(smooth) => smooth.at(piece, self.scene.faces().corner_weights(piece, spot.uv)),
            None => of_piece(self.scene, self.radiosity, piece),
        })
    }

    /// Light from what is seen.
    fn light(&self, radiosity: Option<[f64; 3]>) -> Light {
        radiosity.map_or([BACKGROUND; 3], |radiosity| {
            std::array::from_fn(|c| (radiosity[c] * self.exposure[c]).min(1.0))
        })
    }
}

/// Red, green, blue; 0 … 1. Equal where the scene is grey.
type Light = [f64; 3];

fn mean(lights: &[Light]) -> Light {
    std::array::from_fn(|c| lights.iter().map(|light| light[c]).sum::<f64>() / lights.len() as f64)
}

/// The mean radiosity of samples that show the scene, over all samples, and the part of them that do.
fn value(seen: &[Option<[f64; 3]>]) -> [f32; 4] {
    let count = seen.len() as f64;
    let shown = || seen.iter().flatten();
    std::array::from_fn(|c| match c {
        3 => (shown().count() as f64 / count) as f32,
        _ => (shown().map(|radiosity| radiosity[c]).sum::<f64>() / count) as f32,
    })
}

/// B of a patch in three channels [W/m²].
fn of_piece(scene: &Scene, radiosity: &[f64], piece: u32) -> [f64; 3] {
    let (channels, face) = (scene.channels(), scene.faces().face_of(piece) as usize);
    std::array::from_fn(|c| radiosity[face * channels + c.min(channels - 1)])
}

/// The exposure for what is seen, by its brightest channel, white being the colour of all emitted light together.
/// Where nothing but lamps shows any light, it is theirs.
fn exposure(scene: &Scene, radiosity: &[f64], seen: &[Vec<Spot>]) -> [f64; 3] {
    let balance = white_balance(scene);
    let pieces = || seen.iter().flatten().filter_map(Spot::piece);
    let reflecting = pieces().filter(|&piece| !scene.faces().piece(piece).emittance.is_lit());
    let brightest = |piece| {
        let balanced = of_piece(scene, radiosity, piece).into_iter().zip(balance).map(|(b, gain)| b * gain);
        balanced.fold(0.0, f64::max)
    };
    let reference =
        bright(reflecting.map(brightest).collect()).or_else(|| bright(pieces().map(brightest).collect()));
    balance.map(|gain| reference.map_or(1.0, |reference| gain * EXPOSED_LIGHT / reference))
}

/// The gains that make the emitted light white; 1 for a channel without any.
fn white_balance(scene: &Scene) -> [f64; 3] {
    let power = std::array::from_fn(|c| scene.total_power(c.min(scene.channels() - 1)));
    let most = power.into_iter().fold(0.0, f64::max);
    power.map(|power| if power > 0.0 { most / power } else { 1.0 })
}

/// The value that [`EXPOSED_SHARE`] of the values stay below; `None` where none is positive.
fn bright(mut values: Vec<f64>) -> Option<f64> {
    values.retain(|&value| value > 0.0);
    let rank = (values.len() as f64 * EXPOSED_SHARE) as usize;
    let last = values.len().checked_sub(1)?;
    Some(*values.select_nth_unstable_by(rank.min(last), f64::total_cmp).1)
}

/// Light to sRGB, both 0 … 1 (IEC 61966-2-1).
fn encode(light: f64) -> f64 {
    if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use radiosity::{IndexChoice, SceneSpec};

    use super::*;
    use crate::scenes::{cornell, cube, quad, radiosities};

    /// The shade at a place of a picture, both coordinates in 0 … 1 from the upper left.
    fn shade(picture: &Picture, x: f64, y: f64) -> u8 {
        let column = (x * f64::from(picture.width)) as usize;
        let row = (y * f64::from(picture.height)) as usize;
        picture.pixels[row * picture.width as usize + column]
    }

    fn cornell_picture(index: IndexChoice) -> Picture {
        let scene = Scene::build(&cornell(), index).unwrap();
        Picture::render(&scene, &radiosities(&scene))
    }

    #[test]
    fn the_cornell_box_looks_like_itself() {
        let picture = cornell_picture(IndexChoice::Auto);
        assert_eq!((picture.width, picture.height), (800, 800));
        assert_eq!(shade(&picture, 0.5, 0.15), 255, "the lamp is white");
        let background = (encode(BACKGROUND) * 255.0).round() as u8;
        for (x, y) in [(0.01, 0.01), (0.99, 0.01), (0.01, 0.99), (0.99, 0.99)] {
            assert_eq!(shade(&picture, x, y), background);
        }
        // From −z, x grows to the left.
        let (light, dark) = (shade(&picture, 0.1, 0.4), shade(&picture, 0.9, 0.4));
        assert!(light > dark + 60 && light < 255 && dark > 0, "{light} {dark}");
        // The short block stands on the left, its top lit and its front in shadow.
        let (top, front) = (shade(&picture, 0.34, 0.66), shade(&picture, 0.27, 0.8));
        assert!(top > front + 100, "{top} {front}");
    }

    #[test]
    fn index_and_repetition_change_no_pixel() {
        let picture = cornell_picture(IndexChoice::Flat);
        assert_eq!(picture, cornell_picture(IndexChoice::Flat));
        assert_eq!(picture, cornell_picture(IndexChoice::Tree));
    }

    #[test]
    fn a_patch_is_flat_and_its_edge_is_smooth() {
        let scene = cube();
        let mut radiosity = vec![1.0; scene.faces().len()];
        for (patch, radiosity) in scene.faces().iter().zip(&mut radiosity) {
            if scene.surface_name(patch.surface) == "left" {
                *radiosity = 0.25;
            }
        }
        let picture = Picture::render(&scene, &radiosity);
        let shade_of = |light: f64| (encode(light) * 255.0).round() as u8;
        let (full, quarter) = (shade_of(EXPOSED_LIGHT), shade_of(0.25 * EXPOSED_LIGHT));
        let count = |holds: &dyn Fn(u8) -> bool| picture.pixels.iter().filter(|&&p| holds(p)).count();
        assert!(count(&|p| p == full) > 300_000);
        assert!(count(&|p| p == quarter) > 60_000);
        // The slanting edges between left wall, floor and ceiling.
        assert!(count(&|p| p > quarter && p < full) > 300);
    }

    #[test]
    fn a_scene_of_lamps_alone_is_exposed_for_them() {
        let mut dim = quad("dim", [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]], [1, 1], 0.0);
        let mut bright = quad("bright", [[1., 0., 0.], [2., 0., 0.], [1., 1., 0.]], [1, 1], 0.0);
        (dim.emittance, bright.emittance) = (1e-9.into(), 2e-9.into());
        let spec = SceneSpec::new(vec![dim, bright]);
        let scene = Scene::build(&spec, IndexChoice::Auto).unwrap();
        let picture = Picture::render(&scene, &[1e-9, 2e-9]);
        let shade_of = |light: f64| (encode(light) * 255.0).round() as u8;
        for light in [EXPOSED_LIGHT, 0.5 * EXPOSED_LIGHT] {
            assert!(picture.pixels.contains(&shade_of(light)));
        }
    }

    #[test]
    fn values_are_radiosities_and_an_exposure_is_what_a_job_says() {
        let scene = cube();
        let radiosity = vec![3.0; scene.faces().len()];
        let view = View { size: Some([120, 90]), exposure: Some(0.1), ..View::default() };
        let photo = Photo::take(&scene, &radiosity, None, &view);
        assert_eq!((photo.shot.size, photo.shot.exposure), ([120, 90], [0.1; 3]));
        assert!((photo.shot.white[0] - 10.0).abs() < 1e-12);
        let shade_of = |light: f64| (encode(light) * 255.0).round() as u8;
        let mut whole = 0;
        for (pixel, [b, _, _, part]) in photo.picture.pixels.iter().zip(&photo.values.values) {
            assert!((b - 3.0 * part).abs() < 1e-5, "{b} over {part} of a pixel");
            if *part == 1.0 {
                whole += 1;
                assert_eq!(*pixel, shade_of(0.3));
            }
        }
        assert!(whole > 120 * 90 / 2 && whole < 120 * 90, "{whole}");
    }

    #[test]
    fn exposure_ignores_the_brightest_few() {
        let mut values = vec![1.0; 99];
        values.extend([1e6, 0.0]);
        assert_eq!(bright(values), Some(1.0));
        assert_eq!(bright(vec![3.0]), Some(3.0));
        assert_eq!(bright(vec![0.0, 0.0]), None);
    }

    #[test]
    fn the_png_holds_the_pixels() {
        let pixels = (0..6).map(|shade| shade * 50).collect();
        let picture = Picture { width: 3, height: 2, channels: 1, pixels };
        let mut bytes = Vec::new();
        picture.write_png(&mut bytes).unwrap();
        let mut reader = png::Decoder::new(io::Cursor::new(bytes)).read_info().unwrap();
        let mut read = vec![0; 6];
        let info = reader.next_frame(&mut read).unwrap();
        assert_eq!((info.width, info.height, info.color_type), (3, 2, png::ColorType::Grayscale));
        assert_eq!(read, picture.pixels);
    }
}
