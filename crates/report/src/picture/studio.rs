//! A picture on its way: what is seen at the corners of pixels, and between them where they differ.

use std::ops::Range;

use job::View;
use radiosity::Scene;

use super::light::{BACKGROUND, Light, Shades, exposure, mean, of_piece, value, white_balance};
use super::{Picture, Shot};
use crate::camera::{Camera, Sight};
use crate::cores::on_all_cores;
use crate::smooth::Smooth;
use crate::values::Values;

/// Samples along each side of a pixel that an edge goes through.
const FINE: u32 = 3;

/// Rows of pixels that are looked at together.
const BAND: usize = 16;

/// Pixels with edges that are looked at together.
const FINE_AT_ONCE: usize = 256;

/// Shades (0 … 1, encoded) of different surfaces that differ by less than this make no edge.
const SAME_SHADE: f64 = 1.5 / 255.0;

/// The same of one surface. A step of this height within a pixel puts the mean of its corners off by half of it at most.
const SAME_SHADE_OF_ONE: f64 = 12.0 / 255.0;

/// A scene in front of a camera, with its light measured.
pub(super) struct Studio<'a> {
    scene: &'a Scene,
    radiosity: &'a [f64],
    /// Where patches are not flat: radiosity at their corners.
    smooth: Option<&'a Smooth>,
    camera: Camera,
    /// What is seen at the corners of the pixels, (width + 1) × (height + 1) of them, in bands of [`BAND`] rows.
    corners: Vec<Vec<Spot>>,
    /// Light over radiosity, channel by channel.
    exposure: [f64; 3],
    shades: Shades,
    /// Whether the values behind the pixels are wanted.
    with_values: bool,
}

/// What is seen at a point of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Spot {
    /// The piece of a face, or [`Spot::NONE`].
    piece: u32,
    /// The surface that the piece is on.
    surface: u32,
    /// Where on the surface.
    uv: [f32; 2],
}

impl Spot {
    /// In place of a piece and its surface.
    const NONE: u32 = u32::MAX;

    /// Beyond the scene.
    const NOTHING: Spot = Spot { piece: Spot::NONE, surface: Spot::NONE, uv: [0.0; 2] };

    fn of(sight: &Sight) -> Self {
        let [u, v] = sight.uv;
        Spot { piece: sight.piece, surface: sight.surface, uv: [u as f32, v as f32] }
    }

    /// What it is on.
    fn piece(&self) -> Option<u32> {
        (self.piece != Spot::NONE).then_some(self.piece)
    }

    /// What a camera sees at some points of the picture.
    fn seen_by(camera: &Camera, scene: &Scene, points: &[[f64; 2]]) -> Vec<Self> {
        let mut spots = vec![Spot::NOTHING; points.len()];
        camera.each_sight(scene, points, |point, sight| spots[point] = Spot::of(&sight));
        spots
    }
}

/// What is seen at a corner of pixels: its radiosity [W/m²], light and shade (encoded light) by channels.
struct Corner {
    surface: u32,
    seen: Option<[f64; 3]>,
    light: Light,
    shade: [f64; 3],
}

/// A pixel: its light, and, where a file asks for it, the mean radiosity behind it with the part of it that shows the scene.
#[derive(Default)]
struct Pixel {
    light: Light,
    value: [f32; 4],
}

/// Some rows of pixels: the bytes of the picture and, where a file asks for them, the values behind them.
type Rows = (Vec<u8>, Vec<[f32; 4]>);

impl<'a> Studio<'a> {
    pub(super) fn camera(scene: &Scene, radiosity: &[f64], view: &View) -> Camera {
        // By surface: while few walks were shot, which patches are lit is noise.
        let mut lit = vec![false; scene.surfaces().len()];
        for piece in 0..scene.faces().piece_count() as u32 {
            let surface = scene.faces().piece(piece).surface;
            lit[surface as usize] |=
                of_piece(scene, radiosity, piece).iter().any(|&radiosity| radiosity > 0.0);
        }
        Camera::of_view(scene, view, |surface| lit[surface as usize])
    }

    pub(super) fn expose(
        scene: &'a Scene,
        radiosity: &'a [f64],
        smooth: Option<&'a Smooth>,
        camera: Camera,
        view: &View,
    ) -> Self {
        let [width, height] = camera.size.map(|side| side as usize);
        let corners = on_all_cores((height + 1).div_ceil(BAND), |band| {
            let rows = band * BAND..((band + 1) * BAND).min(height + 1);
            let points = rows.flat_map(|y| (0..=width).map(move |x| [x as f64, y as f64]));
            Spot::seen_by(&camera, scene, &points.collect::<Vec<_>>())
        });
        let exposure = match view.exposure {
            Some(exposure) => white_balance(scene).map(|gain| gain * exposure),
            None => exposure(scene, radiosity, corners.iter().flatten().filter_map(Spot::piece)),
        };
        Studio {
            scene,
            radiosity,
            smooth,
            camera,
            corners,
            exposure,
            shades: Shades::new(),
            with_values: false,
        }
    }

    /// The same, which keeps the values behind the pixels.
    pub(super) fn keeping_values(self, with_values: bool) -> Self {
        Studio { with_values, ..self }
    }

    pub(super) fn shot(&self) -> Shot {
        Shot {
            viewpoint: self.camera.viewpoint(self.scene),
            size: self.camera.size,
            exposure: self.exposure,
            white: self.exposure.map(|exposure| 1.0 / exposure),
        }
    }

    pub(super) fn develop(&self) -> (Picture, Option<Values>) {
        let [width, height] = self.camera.size;
        let bands = on_all_cores((height as usize).div_ceil(BAND), |band| {
            let first = (band * BAND) as u32;
            self.band(first..(first + BAND as u32).min(height))
        });
        let (pixels, values): (Vec<_>, Vec<_>) = bands.into_iter().unzip();
        let channels = self.scene.channels();
        let picture = Picture { width, height, channels, pixels: pixels.concat() };
        let values = self.with_values.then(|| Values { width, height, channels, values: values.concat() });
        (picture, values)
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
        let byte = |&light: &f64| (self.shades.of(light) * 255.0 + 0.5) as u8;
        let bytes = pixels.iter().flat_map(|pixel| pixel.light[..channels].iter().map(byte)).collect();
        let kept = if self.with_values { &pixels[..] } else { &[] };
        (bytes, kept.iter().map(|pixel| pixel.value).collect())
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
        let mut shade = [0.0; 3];
        (0..self.scene.channels()).for_each(|c| shade[c] = self.shades.of(light[c]));
        Corner { surface: spot.surface, seen, light, shade }
    }

    /// One pixel whose corners look alike: it needs no further look. `None` where they do not.
    fn even_pixel(&self, corners: [&Corner; 4]) -> Option<Pixel> {
        let of_one = corners.iter().all(|corner| corner.surface == corners[0].surface);
        let same = if of_one { SAME_SHADE_OF_ONE } else { SAME_SHADE };
        let alike = |c: usize| {
            let (mut darkest, mut brightest) = (1.0_f64, 0.0_f64);
            for corner in corners {
                (darkest, brightest) = (darkest.min(corner.shade[c]), brightest.max(corner.shade[c]));
            }
            darkest == brightest || brightest - darkest < same
        };
        (0..self.scene.channels()).all(alike).then(|| Pixel {
            light: mean(corners.iter().map(|corner| &corner.light)),
            value: self.value(corners.iter().map(|corner| &corner.seen)),
        })
    }

    /// Pixels that edges go through, by several looks each.
    fn fine_pixels(&self, pixels: &[[u32; 2]]) -> Vec<Pixel> {
        let offset = |k: u32| (f64::from(k) + 0.5) / f64::from(FINE);
        let within = |&[x, y]: &[u32; 2]| {
            (0..FINE * FINE).map(move |k| [f64::from(x) + offset(k % FINE), f64::from(y) + offset(k / FINE)])
        };
        let samples: Vec<[f64; 2]> = pixels.iter().flat_map(within).collect();
        let spots = Spot::seen_by(&self.camera, self.scene, &samples).into_iter();
        let seen: Vec<Option<[f64; 3]>> = spots.map(|spot| self.radiosity(spot)).collect();
        let pixel = |seen: &[Option<[f64; 3]>]| {
            let lights: Vec<Light> = seen.iter().map(|&seen| self.light(seen)).collect();
            Pixel { light: mean(lights.iter()), value: self.value(seen.iter()) }
        };
        seen.chunks_exact((FINE * FINE) as usize).map(pixel).collect()
    }

    /// What a pixel keeps of the radiosities in it.
    fn value<'b>(&self, seen: impl ExactSizeIterator<Item = &'b Option<[f64; 3]>>) -> [f32; 4] {
        if self.with_values { value(seen) } else { Default::default() }
    }

    /// B in three channels at what is seen [W/m²]; `None` beyond the scene.
    fn radiosity(&self, spot: Spot) -> Option<[f64; 3]> {
        let piece = spot.piece()?;
        Some(match self.smooth {
            Some(smooth) => smooth
                .at(piece, self.scene.faces().corner_weights(piece, [spot.uv[0].into(), spot.uv[1].into()])),
            None => of_piece(self.scene, self.radiosity, piece),
        })
    }

    /// Light from what is seen, in the channels of the scene.
    fn light(&self, radiosity: Option<[f64; 3]>) -> Light {
        let Some(radiosity) = radiosity else { return [BACKGROUND; 3] };
        let mut light = [0.0; 3];
        for c in 0..self.scene.channels() {
            light[c] = (radiosity[c] * self.exposure[c]).min(1.0);
        }
        light
    }
}
