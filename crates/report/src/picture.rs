//! `radiosity.png`: the scene, shaded by the radiosity of its patches.

use std::io::{self, Write};

use radiosity::{Estimates, Scene};
use serde::Serialize;

use crate::camera::{Camera, Sight, Viewpoint};
use crate::smooth::Smooth;

/// The longer side of a picture [pixels].
const SIZE: u32 = 800;

/// Samples along each side of a pixel that an edge goes through.
const FINE: u32 = 3;

/// Shades (0 … 1, encoded) that differ by less than this make no edge.
const SAME_SHADE: f64 = 1.5 / 255.0;

/// What is seen beyond the scene, as light: a dark grey, so that black surfaces stand out from it.
const BACKGROUND: f64 = 0.02;

/// This part of what is seen of the non-emitting patches …
const EXPOSED_SHARE: f64 = 0.95;

/// … is at most as bright as this, as light; 1 is white.
const EXPOSED_LIGHT: f64 = 0.7;

/// A picture of a scene: grey, or in colour where the scene is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
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
        Picture::take(scene, radiosity, None).0
    }

    /// Renders what is estimated of a scene as [`Picture::render`] does, without steps between patches, and says how. A face
    /// that no walk could tell of shows what it emits.
    pub fn shoot(estimates: &Estimates, smooth: &Smooth) -> (Self, Shot) {
        let scene = estimates.scene();
        let shown = estimates.iter().flat_map(|(_, face, known)| {
            let shown = move |c| known.map_or(face.emittance[c], |known| known[c].radiosity);
            (0..scene.channels()).map(shown)
        });
        Picture::take(scene, &shown.collect::<Vec<f64>>(), Some(smooth))
    }

    fn take(scene: &Scene, radiosity: &[f64], smooth: Option<&Smooth>) -> (Self, Shot) {
        // By surface: while few walks were shot, which patches are lit is noise.
        let mut lit = vec![false; scene.surfaces().len()];
        for (patch, radiosity) in scene.faces().iter().zip(radiosity.chunks_exact(scene.channels())) {
            lit[patch.surface as usize] |= radiosity.iter().any(|&radiosity| radiosity > 0.0);
        }
        let camera = Camera::best(scene, |surface| lit[surface as usize], SIZE);
        let viewpoint = camera.viewpoint(scene);
        let studio = Studio::new(scene, radiosity, smooth, camera);
        (studio.picture(), Shot { viewpoint, exposure: studio.exposure })
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

/// How a picture was taken.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Shot {
    /// Where the scene is seen from.
    #[serde(flatten)]
    pub viewpoint: Viewpoint,
    /// Light, 1 being white, over radiosity, channel by channel [m²/W].
    pub exposure: [f64; 3],
}

/// A scene in front of a camera, with its light measured.
struct Studio<'a> {
    scene: &'a Scene,
    radiosity: &'a [f64],
    /// Where patches are not flat: radiosity at their corners.
    smooth: Option<&'a Smooth>,
    camera: Camera,
    /// What is seen at the corners of the pixels, row by row: (width + 1) × (height + 1).
    corners: Vec<Option<Sight>>,
    /// Light over radiosity, channel by channel.
    exposure: [f64; 3],
}

impl<'a> Studio<'a> {
    fn new(scene: &'a Scene, radiosity: &'a [f64], smooth: Option<&'a Smooth>, camera: Camera) -> Self {
        let [width, height] = camera.size;
        let grid = (0..=height).flat_map(|y| (0..=width).map(move |x| [x, y].map(f64::from)));
        let corners = camera.look(scene, &grid.collect::<Vec<_>>());
        let exposure = exposure(scene, radiosity, &corners);
        Studio { scene, radiosity, smooth, camera, corners, exposure }
    }

    fn picture(&self) -> Picture {
        let [width, height] = self.camera.size;
        let grid: Vec<[u32; 2]> = (0..height).flat_map(|y| (0..width).map(move |x| [x, y])).collect();
        let mut lights: Vec<Option<Light>> = grid.iter().map(|&pixel| self.even_pixel(pixel)).collect();
        let (edges, places): (Vec<usize>, Vec<[u32; 2]>) =
            (0..).zip(&grid).filter(|&(i, _)| lights[i].is_none()).unzip();
        for (edge, light) in edges.into_iter().zip(self.fine_pixels(&places)) {
            lights[edge] = Some(light);
        }
        let channels = self.scene.channels();
        let pixels = lights.into_iter().flatten().flat_map(|light| {
            light.into_iter().take(channels).map(|light| (encode(light) * 255.0).round() as u8)
        });
        Picture { width, height, channels, pixels: pixels.collect() }
    }

    /// The light of one pixel whose corners look alike: it needs no further look. `None` where they do not.
    fn even_pixel(&self, [x, y]: [u32; 2]) -> Option<Light> {
        let stride = self.camera.size[0] as usize + 1;
        let first = y as usize * stride + x as usize;
        let lights =
            [first, first + 1, first + stride, first + stride + 1].map(|i| self.light(self.corners[i]));
        let alike = |c: usize| {
            let darkest = lights.iter().fold(1.0, |min: f64, light| min.min(light[c]));
            let brightest = lights.iter().fold(0.0, |max: f64, light| max.max(light[c]));
            darkest == brightest || encode(brightest) - encode(darkest) < SAME_SHADE
        };
        (0..3).all(alike).then(|| mean(&lights))
    }

    /// The light of pixels that edges go through, by several looks each.
    fn fine_pixels(&self, pixels: &[[u32; 2]]) -> Vec<Light> {
        let offset = |k: u32| (f64::from(k) + 0.5) / f64::from(FINE);
        let within = |&[x, y]: &[u32; 2]| {
            (0..FINE * FINE).map(move |k| [f64::from(x) + offset(k % FINE), f64::from(y) + offset(k / FINE)])
        };
        let samples: Vec<[f64; 2]> = pixels.iter().flat_map(within).collect();
        let lights = self.camera.look(self.scene, &samples).into_iter().map(|sight| self.light(sight));
        let lights: Vec<Light> = lights.collect();
        lights.chunks_exact((FINE * FINE) as usize).map(mean).collect()
    }

    /// Light from what is seen.
    fn light(&self, sight: Option<Sight>) -> Light {
        sight.map_or([BACKGROUND; 3], |sight| {
            let radiosity = match self.smooth {
                Some(smooth) => {
                    smooth.at(sight.face, self.scene.faces().corner_weights(sight.face as usize, sight.uv))
                }
                None => of_face(self.scene, self.radiosity, sight.face as usize),
            };
            std::array::from_fn(|c| (radiosity[c] * self.exposure[c]).min(1.0))
        })
    }
}

/// Red, green, blue; 0 … 1. Equal where the scene is grey.
type Light = [f64; 3];

fn mean(lights: &[Light]) -> Light {
    std::array::from_fn(|c| lights.iter().map(|light| light[c]).sum::<f64>() / lights.len() as f64)
}

/// B of a patch in three channels [W/m²].
fn of_face(scene: &Scene, radiosity: &[f64], patch: usize) -> [f64; 3] {
    let channels = scene.channels();
    std::array::from_fn(|c| radiosity[patch * channels + c.min(channels - 1)])
}

/// The exposure for what is seen, by its brightest channel, white being the colour of all emitted light together.
/// Where nothing but lamps shows any light, it is theirs.
fn exposure(scene: &Scene, radiosity: &[f64], seen: &[Option<Sight>]) -> [f64; 3] {
    let balance = white_balance(scene);
    let patches = || seen.iter().flatten().map(|sight| sight.face as usize);
    let reflecting = patches().filter(|&patch| !scene.faces().get(patch).emittance.is_lit());
    let brightest = |patch| {
        let balanced = of_face(scene, radiosity, patch).into_iter().zip(balance).map(|(b, gain)| b * gain);
        balanced.fold(0.0, f64::max)
    };
    let reference =
        bright(reflecting.map(brightest).collect()).or_else(|| bright(patches().map(brightest).collect()));
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
        let spec = SceneSpec { surfaces: vec![dim, bright] };
        let scene = Scene::build(&spec, IndexChoice::Auto).unwrap();
        let picture = Picture::render(&scene, &[1e-9, 2e-9]);
        let shade_of = |light: f64| (encode(light) * 255.0).round() as u8;
        for light in [EXPOSED_LIGHT, 0.5 * EXPOSED_LIGHT] {
            assert!(picture.pixels.contains(&shade_of(light)));
        }
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
