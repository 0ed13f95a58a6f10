//! A picture on its way: what is seen in the middle of pixels, what lights it, and a closer look where surfaces meet.

use glam::Vec3;
use job::View;
use parallel::on_all_cores;
use radiosity::{Scene, Side};

use super::field::{Field, Lights, left, samples};
use super::lamps::Lamps;
use super::light::{
    BACKGROUND, Contrast, Light, SHINING, Shades, balanced, exposure, mean, of_piece, tone, value,
    white_balance,
};
use super::spot::{BAND, Spot};
use super::{Picture, Shot};
use crate::camera::Camera;
use crate::smooth::Smooth;
use crate::values::Values;

/// Samples along each side of a pixel that an edge goes through.
const FINE: u32 = 4;

/// A side of a surface is lit where its mean radiosity is above this part of that of all.
const LIT: f64 = 1e-3;

/// Where a pixel is looked at for what is thinner than a pixel, and may miss its middle: four places, no two of them in one row or column of
/// the quarters of the pixel.
const PROBES: [[f64; 2]; 4] = [[0.375, 0.125], [0.875, 0.375], [0.125, 0.625], [0.625, 0.875]];

/// Pixels with edges that are looked at together.
const FINE_AT_ONCE: usize = 256;

/// Shades (0 … 1, encoded) beside each other that differ by less than this make no edge.
const SAME_SHADE: f32 = 1.5 / 255.0;

/// The cosine between the normals of surfaces that go on one into the other.
const GOES_ON: f64 = 0.98;

/// A scene in front of a camera, with its light measured.
pub(super) struct Studio<'a> {
    scene: &'a Scene,
    radiosity: &'a [f64],
    /// Where patches are not flat: radiosity at their corners.
    smooth: Option<&'a Smooth>,
    camera: Camera,
    /// What is seen in the middle of the pixels.
    spots: Vec<Spot>,
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
    light: Light,
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
        let [width, height] = camera.size.map(|side| side as usize);
        let bands = on_all_cores(height.div_ceil(BAND), |band| {
            let rows = band * BAND..((band + 1) * BAND).min(height);
            let points = rows.flat_map(|y| (0..width).map(move |x| [x, y].map(|at| at as f64 + 0.5)));
            Spot::seen_by(&camera, scene, &points.collect::<Vec<_>>())
        });
        let spots = bands.concat();
        let lit = smooth.zip(samples(rays, spots.len())).map(|(smooth, samples)| {
            let lights = Lights::new(scene, smooth, radiosity);
            let field = Field::new(&lights, &camera, &spots, samples);
            (lights.lamps, field)
        });
        let mut studio = Studio {
            scene,
            radiosity,
            smooth,
            camera,
            spots,
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
        for pixel in 0..self.spots.len() {
            if let (Some(piece), Some(radiosity)) = (self.spots[pixel].piece(), self.of_pixel(pixel)) {
                let emits = self.scene.faces().piece(piece).emittance.is_lit();
                found[usize::from(emits)].push(balanced(radiosity, gains));
            }
        }
        found
    }

    pub(super) fn shot(&self) -> Shot {
        Shot {
            viewpoint: self.camera.viewpoint(self.scene),
            size: self.camera.size,
            exposure: self.exposure,
            white: self.exposure.map(|exposure| SHINING / exposure),
        }
    }

    /// The picture, and, where they are wanted, the radiosities behind it.
    pub(super) fn develop(&self, with_values: bool) -> (Picture, Option<Values>) {
        let [width, height] = self.camera.size;
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
        let width = self.camera.size[0] as usize;
        (row * width..(row + 1) * width).map(|pixel| self.pixel(&[self.of_pixel(pixel)])).collect()
    }

    /// The shades of a pixel, channel by channel (0 … 1, encoded).
    fn shades_of(&self, pixel: &Pixel) -> [f32; 3] {
        pixel.light.map(|light| self.shades.of(light) as f32)
    }

    /// Some rows of pixels, those with edges looked at more closely.
    fn band(&self, rows: std::ops::Range<usize>, middles: &[Pixel], shades: &[[f32; 3]]) -> Vec<Pixel> {
        let width = self.camera.size[0] as usize;
        let mut pixels = middles[rows.start * width..rows.end * width].to_vec();
        let all = rows.clone().flat_map(|y| (0..width).map(move |x| [x, y]));
        let (mut edges, others): (Vec<[usize; 2]>, Vec<[usize; 2]>) =
            all.partition(|&pixel| self.has_edge(pixel, shades));
        edges.extend(self.with_thin_things(&others, &PROBES));
        self.go_on(&rows, &mut edges);
        for some in edges.chunks(FINE_AT_ONCE) {
            for (&[x, y], pixel) in some.iter().zip(self.fine_pixels(some)) {
                pixels[(y - rows.start) * width + x] = pixel;
            }
        }
        pixels
    }

    /// Whether a pixel shows something else than those around it.
    fn has_edge(&self, [x, y]: [usize; 2], shades: &[[f32; 3]]) -> bool {
        let [width, height] = self.camera.size.map(|side| side as usize);
        let own = y * width + x;
        let mut around = (y.saturating_sub(1)..=(y + 1).min(height - 1))
            .flat_map(|y| (x.saturating_sub(1)..=(x + 1).min(width - 1)).map(move |x| y * width + x));
        around.any(|other| {
            let differs = shades[own].iter().zip(&shades[other]).any(|(a, b)| (a - b).abs() >= SAME_SHADE);
            differs && !self.goes_on(&self.spots[own], &self.spots[other])
        })
    }

    /// Those of some pixels that show something else beside their middle, in some places of the pixel.
    fn with_thin_things(&self, pixels: &[[usize; 2]], places: &[[f64; 2]]) -> Vec<[usize; 2]> {
        let shows_more = |(&[x, y], spots): (&[usize; 2], &[Spot])| {
            let middle = &self.spots[y * self.camera.size[0] as usize + x];
            spots.iter().any(|spot| !spot.is_beside(middle) && !self.goes_on(middle, spot)).then_some([x, y])
        };
        let of_some = |some: &[[usize; 2]]| {
            let points: Vec<[f64; 2]> = some.iter().flat_map(|&pixel| within(pixel, places)).collect();
            let spots = Spot::seen_by(&self.camera, self.scene, &points);
            some.iter().zip(spots.chunks_exact(places.len())).filter_map(shows_more).collect::<Vec<_>>()
        };
        pixels.chunks(FINE_AT_ONCE).flat_map(of_some).collect()
    }

    /// Adds to pixels with edges those of the same rows that edges go on through, pixel by pixel: a slat may be too thin to be found by [`PROBES`].
    fn go_on(&self, rows: &std::ops::Range<usize>, edges: &mut Vec<[usize; 2]>) {
        let width = self.camera.size[0] as usize;
        let mut is_known = vec![false; rows.len() * width];
        edges.iter().for_each(|&[x, y]| is_known[(y - rows.start) * width + x] = true);
        let (places, mut first) = (fine_places(), 0);
        while first < edges.len() {
            let mut beside = Vec::new();
            for &[x, y] in &edges[first..] {
                for y in y.saturating_sub(1).max(rows.start)..(y + 2).min(rows.end) {
                    for x in x.saturating_sub(1)..(x + 2).min(width) {
                        if !std::mem::replace(&mut is_known[(y - rows.start) * width + x], true) {
                            beside.push([x, y]);
                        }
                    }
                }
            }
            first = edges.len();
            edges.extend(self.with_thin_things(&beside, &places));
        }
    }

    /// Whether two spots are on one surface to the eye, and the light between them is known.
    fn goes_on(&self, a: &Spot, b: &Spot) -> bool {
        let (Some(a), Some(b)) = (a.piece(), b.piece()) else { return a == b };
        if a == b {
            return true;
        }
        let [one, other] = [a, b].map(|piece| self.scene.faces().piece(piece));
        let [n, m] = [&one, &other]
            .map(|face| self.scene.surfaces()[face.surface as usize].normal() * face.side.sign());
        self.lit.is_some()
            && (one.reflectance, one.emittance) == (other.reflectance, other.emittance)
            && n.dot(m) >= GOES_ON
            && n.dot(other.centroid - one.centroid).abs() <= 0.1 * (other.centroid - one.centroid).length()
    }

    /// Pixels that edges go through, by several looks each.
    fn fine_pixels(&self, pixels: &[[usize; 2]]) -> Vec<Pixel> {
        let places = fine_places();
        let points: Vec<[f64; 2]> = pixels.iter().flat_map(|&pixel| within(pixel, &places)).collect();
        let spots = Spot::seen_by(&self.camera, self.scene, &points);
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
        let piece = self.spots[pixel].piece()?;
        Some(match &self.lit {
            Some((lamps, field)) if !lamps.has(piece) => {
                left(&self.scene.faces().piece(piece), field.of_pixel(pixel))
            }
            _ => self.of_solution(piece, &self.spots[pixel]),
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
    fn light(&self, radiosity: Option<[f64; 3]>) -> Light {
        let Some(radiosity) = radiosity else { return [BACKGROUND; 3] };
        let mut light = [0.0; 3];
        for c in 0..self.scene.channels() {
            light[c] = radiosity[c] * self.exposure[c];
        }
        tone(self.contrast.bend(light))
    }
}

/// Where a pixel with edges is looked at: in a cell of the pixel each, no two of them in one row or column. Of a slat as many as it covers are on it.
fn fine_places() -> Vec<[f64; 2]> {
    let offset = |cell: u32, within: u32| (f64::from(cell * FINE + within) + 0.5) / f64::from(FINE * FINE);
    let at = |k: u32| (k % FINE, k / FINE);
    (0..FINE * FINE).map(at).map(|(i, j)| [offset(i, j), offset(j, i)]).collect()
}

/// Some places of a pixel, as points of the picture.
fn within([x, y]: [usize; 2], places: &[[f64; 2]]) -> impl Iterator<Item = [f64; 2]> {
    places.iter().map(move |[right, down]| [x as f64 + right, y as f64 + down])
}
