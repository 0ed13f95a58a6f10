//! A picture on its way: what is seen in the middle of pixels, what lights it, and a closer look where surfaces meet.

use glam::Vec3;
use job::View;
use parallel::on_all_cores;
use radiosity::{Scene, Side};

use super::field::{Field, Lights, left, samples};
use super::lamps::Lamps;
use super::light::{
    BACKGROUND, Contrast, Rgb, SHINING, Shades, balanced, exposure, mean, of_piece, tone, value,
    white_balance,
};
use super::sights::{AT_ONCE, Sights, around, fine_places, goes_on, within};
use super::spot::{BAND, Spot};
use super::{Picture, Shot};
use crate::camera::Camera;
use crate::smooth::Smooth;
use crate::values::Values;

/// A side of a surface is lit where its mean radiosity is above this part of that of all.
const LIT: f64 = 1e-3;

/// Shades (0 … 1, encoded) beside each other that differ by less than this make no edge.
const SAME_SHADE: f32 = 1.5 / 255.0;

/// A scene in front of a camera, with its light measured.
pub(super) struct Studio<'a> {
    scene: &'a Scene,
    radiosity: &'a [f64],
    /// Where patches are not flat: radiosity at their corners.
    smooth: Option<&'a Smooth>,
    sights: Sights,
    /// What shines, and the irradiance of what is seen, where rays have measured it.
    lit: Option<(Lamps, Field)>,
    /// Light over radiosity, channel by channel.
    exposure: [f64; 3],
    contrast: Contrast,
    shades: Shades,
}

/// A pixel: its radiosity [W/m²], as light and as its value.
#[derive(Clone, Copy, Default)]
struct Pixel {
    light: Rgb,
    value: [f32; 3],
}

impl<'a> Studio<'a> {
    pub(super) fn camera(scene: &Scene, radiosity: &[f64], view: &View) -> Camera {
        // By sides of surfaces: while few walks were shot, which patches are lit is noise.
        let faces = scene.faces();
        let side = |piece: u32| {
            let piece = faces.piece(piece);
            2 * piece.surface as usize + usize::from(piece.side == Side::Back)
        };
        let mut power = vec![[0.0; 2]; 2 * scene.surfaces().len()];
        for piece in 0..faces.piece_count() as u32 {
            let (area, sum) = (faces.piece(piece).area, &mut power[side(piece)]);
            let brightest = of_piece(scene, radiosity, piece).into_iter().fold(0.0, f64::max);
            *sum = [sum[0] + area * brightest, sum[1] + area];
        }
        let [all, area] = power.iter().fold([0.0; 2], |sum, of| [sum[0] + of[0], sum[1] + of[1]]);
        let least = LIT * all / area;
        Camera::of_view(scene, view, |piece| {
            let [power, area] = power[side(piece)];
            power > least * area
        })
    }

    /// `rays` is how many rays the answer has taken: a picture takes a part of that.
    pub(super) fn expose(
        scene: &'a Scene,
        radiosity: &'a [f64],
        smooth: Option<&'a Smooth>,
        (camera, rays): (Camera, u64),
        view: &View,
    ) -> Self {
        let pixels = camera.size.iter().map(|side| *side as usize).product();
        let light = smooth.zip(samples(rays, pixels));
        let sights = Sights::new(camera, scene, light.is_some());
        let lit = light.map(|(smooth, samples)| {
            let lights = Lights::new(scene, smooth, radiosity);
            let field = Field::new(&lights, &sights, samples);
            (lights.lamps, field)
        });
        let mut studio = Studio {
            scene,
            radiosity,
            smooth,
            sights,
            lit,
            exposure: [1.0; 3],
            contrast: Contrast::NONE,
            shades: Shades::new(),
        };
        let gains = white_balance(scene);
        if let Some(exposure) = view.exposure {
            studio.exposure = gains.map(|gain| gain * exposure);
        } else {
            let seen = studio.brightnesses();
            studio.exposure = exposure(scene, &seen);
            let gain = studio.exposure[0] / gains[0];
            studio.contrast = Contrast::of(&seen[0].iter().map(|value| value * gain).collect::<Vec<_>>());
        }
        studio
    }

    /// The brightest channel of every pixel with white light, of emitters apart.
    fn brightnesses(&self) -> [Vec<f64>; 2] {
        let mut found = [Vec::new(), Vec::new()];
        let gains = white_balance(self.scene);
        for pixel in 0..self.sights.spots.len() {
            if let (Some(piece), Some(radiosity)) = (self.sights.spots[pixel].piece(), self.of_pixel(pixel)) {
                let emits = self.scene.faces().piece(piece).emittance.is_lit();
                found[usize::from(emits)].push(balanced(radiosity, gains));
            }
        }
        found
    }

    pub(super) fn shot(&self) -> Shot {
        Shot {
            viewpoint: self.sights.camera.viewpoint(self.scene),
            size: self.sights.camera.size,
            exposure: self.exposure,
            white: self.exposure.map(|exposure| SHINING / exposure),
            contrast: [self.contrast.bright, self.contrast.power],
        }
    }

    /// The picture, and, where they are wanted, the radiosities behind it.
    pub(super) fn develop(&self, with_values: bool) -> (Picture, Option<Values>) {
        let [width, height] = self.sights.camera.size;
        let channels = self.scene.channels();
        let pixels = on_all_cores(height as usize, |row| self.middles(row)).concat();
        let shades: Vec<[f32; 3]> = pixels.iter().map(|pixel| self.shades_of(pixel)).collect();
        let bands = on_all_cores((height as usize).div_ceil(BAND), |band| {
            let first = band * BAND;
            self.band(first..(first + BAND).min(height as usize), &pixels, &shades)
        });
        let pixels = bands.concat();
        let byte = |&light: &f64| (self.shades.of(light) * 255.0 + 0.5) as u8;
        let bytes = pixels.iter().flat_map(|pixel| pixel.light[..channels].iter().map(byte)).collect();
        let picture = Picture { width, height, channels, pixels: bytes };
        let radiance = || pixels.iter().map(|pixel| pixel.value.map(|b| b / std::f32::consts::PI)).collect();
        let values = with_values.then(|| Values { width, height, values: radiance() });
        (picture, values)
    }

    /// The pixels of a row, by what is in their middle.
    fn middles(&self, row: usize) -> Vec<Pixel> {
        let width = self.sights.camera.size[0] as usize;
        (row * width..(row + 1) * width).map(|pixel| self.pixel(&[self.of_pixel(pixel)])).collect()
    }

    /// The shades of a pixel, channel by channel (0 … 1, encoded).
    fn shades_of(&self, pixel: &Pixel) -> [f32; 3] {
        pixel.light.map(|light| self.shades.of(light) as f32)
    }

    /// Some rows of pixels, those with edges looked at more closely.
    fn band(&self, rows: std::ops::Range<usize>, middles: &[Pixel], shades: &[[f32; 3]]) -> Vec<Pixel> {
        let width = self.sights.camera.size[0] as usize;
        let mut pixels = middles[rows.start * width..rows.end * width].to_vec();
        let all = rows.clone().flat_map(|y| (0..width).map(move |x| [x, y]));
        let is_fine =
            |&[x, y]: &[usize; 2]| self.sights.has_thin(y * width + x) || self.has_edge([x, y], shades);
        let edges: Vec<[usize; 2]> = all.filter(is_fine).collect();
        for some in edges.chunks(AT_ONCE) {
            for (&[x, y], pixel) in some.iter().zip(self.fine_pixels(some)) {
                pixels[(y - rows.start) * width + x] = pixel;
            }
        }
        pixels
    }

    /// Whether a pixel shows something else than those around it.
    fn has_edge(&self, [x, y]: [usize; 2], shades: &[[f32; 3]]) -> bool {
        let size = self.sights.camera.size;
        let own = y * size[0] as usize + x;
        around(size, [x, y]).any(|other| {
            let differs = shades[own].iter().zip(&shades[other]).any(|(a, b)| (a - b).abs() >= SAME_SHADE);
            differs && !self.goes_on(&self.sights.spots[own], &self.sights.spots[other])
        })
    }

    /// Whether two spots are on one surface to the eye, and the light between them is known.
    fn goes_on(&self, a: &Spot, b: &Spot) -> bool {
        a == b || self.lit.is_some() && goes_on(self.scene, a, b)
    }

    /// Pixels that edges go through, by several looks each.
    fn fine_pixels(&self, pixels: &[[usize; 2]]) -> Vec<Pixel> {
        let places = fine_places();
        let points: Vec<[f64; 2]> = pixels.iter().flat_map(|&pixel| within(pixel, &places)).collect();
        let spots = Spot::seen_by(&self.sights.camera, self.scene, &points);
        let seen: Vec<Option<[f64; 3]>> =
            spots.iter().zip(&points).map(|(spot, &point)| self.of_spot(spot, point)).collect();
        seen.chunks_exact(places.len()).map(|seen| self.pixel(seen)).collect()
    }

    /// A pixel from the radiosities in it.
    fn pixel(&self, seen: &[Option<[f64; 3]>]) -> Pixel {
        Pixel { light: mean(seen.iter().map(|&seen| self.light(seen))), value: value(seen) }
    }

    /// B in three channels in the middle of a pixel [W/m²]; `None` beyond the scene.
    fn of_pixel(&self, pixel: usize) -> Option<[f64; 3]> {
        let piece = self.sights.spots[pixel].piece()?;
        Some(match &self.lit {
            Some((lamps, field)) if !lamps.has(piece) => {
                left(&self.scene.faces().piece(piece), field.of_pixel(pixel))
            }
            _ => self.of_solution(piece, &self.sights.spots[pixel]),
        })
    }

    /// B in three channels at a spot in sight at a point of the picture [W/m²]; `None` beyond the scene.
    fn of_spot(&self, spot: &Spot, point: [f64; 2]) -> Option<[f64; 3]> {
        let piece = spot.piece()?;
        let lit = self.lit.as_ref().filter(|(lamps, _)| !lamps.has(piece)).and_then(|(_, field)| {
            let face = self.scene.faces().piece(piece);
            let surface = &self.scene.surfaces()[face.surface as usize];
            let normal: Vec3 = (surface.normal() * face.side.sign()).as_vec3();
            let irradiance = field.at(point, surface.point(spot.uv()).as_vec3(), normal)?;
            Some(left(&face, irradiance))
        });
        Some(lit.unwrap_or_else(|| self.of_solution(piece, spot)))
    }

    /// B of the solution at a spot [W/m²].
    fn of_solution(&self, piece: u32, spot: &Spot) -> [f64; 3] {
        match self.smooth {
            Some(smooth) => smooth.at(piece, self.scene.faces().corner_weights(piece, spot.uv())),
            None => of_piece(self.scene, self.radiosity, piece),
        }
    }

    /// Light from what is seen, in the channels of the scene.
    fn light(&self, radiosity: Option<[f64; 3]>) -> Rgb {
        let Some(radiosity) = radiosity else { return [BACKGROUND; 3] };
        let mut light = [0.0; 3];
        for c in 0..self.scene.channels() {
            light[c] = radiosity[c] * self.exposure[c];
        }
        tone(self.contrast.bend(light))
    }
}
