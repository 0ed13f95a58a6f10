//! `radiosity.png`: the scene, its patches in flat shades by their radiosity.

use std::io::{self, Write};

use radiosity::Scene;

use crate::camera::Camera;

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

/// A grey picture of a scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// sRGB-encoded grey, row by row from the top.
    pub pixels: Vec<u8>,
}

impl Picture {
    /// Renders a scene from the side that shows most of it. `radiosity` is B of every patch [W/m²].
    ///
    /// The exposure is such that nearly all that is seen of non-emitting patches stays below white; lamps clip
    /// to white. The same arguments give the same picture.
    pub fn render(scene: &Scene, radiosity: &[f64]) -> Self {
        // By surface: while few walks were shot, which patches are lit is noise.
        let mut lit = vec![false; scene.surfaces().len()];
        for (patch, &radiosity) in scene.patches().iter().zip(radiosity) {
            lit[patch.surface as usize] |= radiosity > 0.0;
        }
        let camera = Camera::best(scene, |surface| lit[surface as usize], SIZE);
        Studio::new(scene, radiosity, camera).picture()
    }

    /// Writes the picture as PNG.
    ///
    /// # Errors
    /// Those of `writer`.
    pub fn write_png(&self, writer: impl Write) -> io::Result<()> {
        let mut encoder = png::Encoder::new(writer, self.width, self.height);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        let mut png = encoder.write_header()?;
        png.write_image_data(&self.pixels)?;
        Ok(png.finish()?)
    }
}

/// A scene in front of a camera, with its light measured.
struct Studio<'a> {
    scene: &'a Scene,
    radiosity: &'a [f64],
    camera: Camera,
    /// What is seen at the corners of the pixels, row by row: (width + 1) × (height + 1).
    corners: Vec<Option<u32>>,
    /// Light over radiosity.
    exposure: f64,
}

impl<'a> Studio<'a> {
    fn new(scene: &'a Scene, radiosity: &'a [f64], camera: Camera) -> Self {
        let [width, height] = camera.size;
        let grid = (0..=height).flat_map(|y| (0..=width).map(move |x| [x, y].map(f64::from)));
        let corners: Vec<_> = grid.map(|[x, y]| camera.look(scene, x, y).map(|sight| sight.patch)).collect();
        let exposure = exposure(scene, radiosity, &corners);
        Studio { scene, radiosity, camera, corners, exposure }
    }

    fn picture(&self) -> Picture {
        let [width, height] = self.camera.size;
        let grid = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let pixels = grid.map(|(x, y)| (encode(self.pixel(x, y)) * 255.0).round() as u8).collect();
        Picture { width, height, pixels }
    }

    /// The light of one pixel. Patches are flat, so a pixel whose corners look alike needs no further look.
    fn pixel(&self, x: u32, y: u32) -> f64 {
        let stride = self.camera.size[0] as usize + 1;
        let first = y as usize * stride + x as usize;
        let lights =
            [first, first + 1, first + stride, first + stride + 1].map(|i| self.light(self.corners[i]));
        let (darkest, brightest) =
            (lights.into_iter().fold(1.0, f64::min), lights.into_iter().fold(0.0, f64::max));
        if darkest == brightest || encode(brightest) - encode(darkest) < SAME_SHADE {
            return lights.iter().sum::<f64>() / 4.0;
        }
        self.fine_pixel(f64::from(x), f64::from(y))
    }

    fn fine_pixel(&self, x: f64, y: f64) -> f64 {
        let offset = |k: u32| (f64::from(k) + 0.5) / f64::from(FINE);
        let samples = (0..FINE * FINE).map(|k| {
            let sight = self.camera.look(self.scene, x + offset(k % FINE), y + offset(k / FINE));
            self.light(sight.map(|sight| sight.patch))
        });
        samples.sum::<f64>() / f64::from(FINE * FINE)
    }

    /// Light from a patch, 0 … 1.
    fn light(&self, patch: Option<u32>) -> f64 {
        patch.map_or(BACKGROUND, |patch| (self.radiosity[patch as usize] * self.exposure).min(1.0))
    }
}

/// The exposure for what is seen. Where nothing but lamps shows any light, it is theirs.
fn exposure(scene: &Scene, radiosity: &[f64], seen: &[Option<u32>]) -> f64 {
    let patches = || seen.iter().flatten().map(|&patch| patch as usize);
    let reflecting = patches().filter(|&patch| scene.patches()[patch].emittance == 0.0);
    let reference = bright(reflecting.map(|patch| radiosity[patch]).collect())
        .or_else(|| bright(patches().map(|patch| radiosity[patch]).collect()));
    reference.map_or(1.0, |reference| EXPOSED_LIGHT / reference)
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
    use crate::scenes::{cornell, cube, quad, radiosities, solution};

    /// The shade at a place of a picture, both coordinates in 0 … 1 from the upper left.
    fn shade(picture: &Picture, x: f64, y: f64) -> u8 {
        let column = (x * f64::from(picture.width)) as usize;
        let row = (y * f64::from(picture.height)) as usize;
        picture.pixels[row * picture.width as usize + column]
    }

    fn cornell_picture(index: IndexChoice) -> Picture {
        let scene = Scene::build(&cornell(), index).unwrap();
        Picture::render(&scene, &radiosities(&solution(&scene)))
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
        let mut radiosity = vec![1.0; scene.patches().len()];
        for (patch, radiosity) in scene.patches().iter().zip(&mut radiosity) {
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
        (dim.emittance, bright.emittance) = (1e-9, 2e-9);
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
        let picture = Picture { width: 3, height: 2, pixels };
        let mut bytes = Vec::new();
        picture.write_png(&mut bytes).unwrap();
        let mut reader = png::Decoder::new(io::Cursor::new(bytes)).read_info().unwrap();
        let mut read = vec![0; 6];
        let info = reader.next_frame(&mut read).unwrap();
        assert_eq!((info.width, info.height, info.color_type), (3, 2, png::ColorType::Grayscale));
        assert_eq!(read, picture.pixels);
    }
}
