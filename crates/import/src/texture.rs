//! Textures: the mean of an image over the faces that show it, in linear light.

use std::io::Cursor;

use glam::{DMat2, DVec2};
use image::{DynamicImage, GenericImageView, ImageReader, Limits, Rgba};
use radiosity::Spectrum;

/// The most bytes that decoding an image may take, and the most pixels along an edge.
const MOST_BYTES: u64 = 1 << 29;
const LONGEST_EDGE: u32 = 1 << 14;

/// The most points at which the image of a material is looked up, and those of all materials of a file. Faces have shares by their
/// areas, and at least one each.
const MOST_POINTS: usize = 1 << 16;
const ALL_POINTS: usize = 1 << 24;

/// A face that shows an image: its area, in any unit, and the places of its corners in the image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TexturedFace {
    pub(crate) area: f32,
    pub(crate) corners: [[f32; 2]; 3],
}

/// A map of places before they are looked up: of glTF's KHR_texture_transform, of MTL's options, and of v counted from below.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placing {
    pub(crate) linear: DMat2,
    pub(crate) offset: DVec2,
    /// What images show beyond their edges, along u and v.
    pub(crate) wrap: [Wrap; 2],
}

/// What an image shows beyond its edges.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Wrap {
    Repeat,
    Mirror,
    /// Its last texels.
    Clamp,
}

/// How texels are read, and at how many points.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sampling {
    pub(crate) points: usize,
    /// Whether alpha counts.
    pub(crate) opacity: bool,
    /// Whether levels are of linear light, not of sRGB.
    pub(crate) raw: bool,
}

impl Sampling {
    /// Opaque texels of sRGB.
    pub(crate) fn of_colour(points: usize) -> Self {
        Sampling { points, opacity: false, raw: false }
    }
}

impl Placing {
    /// Places whose v counts from the image's last row upwards, as in OBJ.
    pub(crate) const FROM_BELOW: Placing = Placing {
        linear: DMat2::from_cols(DVec2::X, DVec2::NEG_Y),
        offset: DVec2::Y,
        wrap: [Wrap::Repeat; 2],
    };

    /// Places as glTF has them: v counts from the image's first row downwards.
    pub(crate) const FROM_ABOVE: Placing =
        Placing { linear: DMat2::IDENTITY, offset: DVec2::ZERO, wrap: [Wrap::Repeat; 2] };

    /// These places where the image is scaled and moved before.
    pub(crate) fn after(self, scale: DVec2, offset: DVec2) -> Placing {
        let linear = self.linear * DMat2::from_diagonal(scale);
        Placing { linear, offset: self.offset + self.linear * offset, ..self }
    }
}

/// The mean of an image over some faces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Mean {
    /// The colour in linear light, weighted by opacity where opacity is asked for.
    pub(crate) colour: Spectrum,
    /// The opacity.
    pub(crate) alpha: f64,
}

/// Decodes an image; `None` where it is of no known format, broken or too large.
pub(crate) fn decode(content: &[u8]) -> Option<DynamicImage> {
    let mut reader = ImageReader::new(Cursor::new(content)).with_guessed_format().ok()?;
    if reader.format().is_none() {
        // TGA has no first bytes of its own.
        reader.set_format(image::ImageFormat::Tga);
    }
    let mut limits = Limits::default();
    limits.max_alloc = Some(MOST_BYTES);
    limits.max_image_width = Some(LONGEST_EDGE);
    limits.max_image_height = Some(LONGEST_EDGE);
    reader.limits(limits);
    let image = reader.decode().ok()?;
    (image.width() > 0 && image.height() > 0).then_some(image)
}

/// The points for each of some materials with images.
pub(crate) fn points(materials: usize) -> usize {
    (ALL_POINTS / materials.max(1)).clamp(1, MOST_POINTS)
}

/// The mean of an image over faces, that of the whole image where there are none.
pub(crate) fn mean(
    image: &DynamicImage,
    shown: &[TexturedFace],
    placing: Placing,
    sampling: Sampling,
) -> Mean {
    let whole = [[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]], [[0.0, 0.0], [1.0, 1.0], [0.0, 1.0]]];
    let whole = whole.map(|corners| TexturedFace { area: 0.5, corners });
    let total: f64 = shown.iter().map(|face| f64::from(face.area)).sum();
    let (shown, total) = if total > 0.0 && total.is_finite() { (shown, total) } else { (&whole[..], 1.0) };
    let linear = levels(sampling.raw);
    let (mut colour, mut alpha, mut weights) = ([0.0; 3], 0.0, 0.0);
    let mut number = 0_u64;
    for face in shown {
        let area = f64::from(face.area);
        let points = (sampling.points as f64 * area / total).ceil().max(1.0);
        let weight = area / points;
        let [a, b, c] =
            face.corners.map(|[u, v]| placing.linear * DVec2::new(u.into(), v.into()) + placing.offset);
        for _ in 0..points as u64 {
            number += 1;
            let [s, t] = in_triangle(number);
            let Rgba([red, green, blue, opaque]) = texel(image, a + (b - a) * s + (c - a) * t, placing.wrap);
            let opaque = if sampling.opacity { f64::from(opaque) / 255.0 } else { 1.0 };
            for (sum, value) in colour.iter_mut().zip([red, green, blue]) {
                *sum += weight * opaque * linear[usize::from(value)];
            }
            alpha += weight * opaque;
            weights += weight;
        }
    }
    let mean = |sum: f64| if alpha > 0.0 { sum / alpha } else { 0.0 };
    Mean { colour: Spectrum::rgb(colour.map(mean)), alpha: alpha / weights }
}

/// Point n of a sequence that fills a triangle evenly: the additive recurrence of the plastic number (Roberts 2018), folded
/// at the diagonal.
fn in_triangle(number: u64) -> [f64; 2] {
    // The root of x³ = x + 1.
    const PLASTIC: f64 = 1.324_717_957_244_746;
    let along = |step: f64| (0.5 + number as f64 * step).fract();
    let [s, t] = [along(1.0 / PLASTIC), along(1.0 / (PLASTIC * PLASTIC))];
    if s + t > 1.0 { [1.0 - s, 1.0 - t] } else { [s, t] }
}

/// The texel at a place, counted from the first row.
fn texel(image: &DynamicImage, place: DVec2, [wrap_u, wrap_v]: [Wrap; 2]) -> Rgba<u8> {
    let index = |x: f64, count: u32, wrap: Wrap| {
        let x = match wrap {
            Wrap::Repeat => x - x.floor(),
            Wrap::Mirror => 1.0 - (x.rem_euclid(2.0) - 1.0).abs(),
            Wrap::Clamp => x.clamp(0.0, 1.0),
        };
        // A place that is no number, and one that rounds to 1.
        ((x * f64::from(count)) as u32).min(count - 1)
    };
    image.get_pixel(index(place.x, image.width(), wrap_u), index(place.y, image.height(), wrap_v))
}

/// The linear light of each of 256 levels, of sRGB unless they are `raw`.
fn levels(raw: bool) -> [f64; 256] {
    let light = if raw { |level| level } else { linear };
    std::array::from_fn(|level| light(level as f64 / 255.0))
}

/// The linear light of a level in [0, 1] (IEC 61966-2-1, the curve of sRGB).
pub(crate) fn linear(level: f64) -> f64 {
    let level = level.clamp(0.0, 1.0);
    if level <= 0.040_45 { level / 12.92 } else { ((level + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 2 × 2 texels: white, black; black, white, the last without opacity.
    fn checks() -> DynamicImage {
        let pixels = [[255, 255, 255, 255], [0, 0, 0, 255], [0, 0, 0, 255], [255, 255, 255, 0]];
        let image = image::RgbaImage::from_raw(2, 2, pixels.concat()).unwrap();
        DynamicImage::ImageRgba8(image)
    }

    #[test]
    fn means_are_over_the_faces_that_show_the_image() {
        let image = checks();
        let mean = |shown: &[TexturedFace], opacity| {
            let sampling = Sampling { opacity, ..Sampling::of_colour(points(1)) };
            mean(&image, shown, Placing::FROM_ABOVE, sampling)
        };
        let all = mean(&[], false);
        assert!((all.colour[0] - 0.5).abs() < 1e-3 && all.alpha == 1.0, "{all:?}");
        let all = mean(&[], true);
        assert!((all.colour[0] - 1.0 / 3.0).abs() < 1e-3 && (all.alpha - 0.75).abs() < 1e-3, "{all:?}");
        // Three quarters of the area show the white texel, one quarter a black one, in the copy to the right.
        let face = |area, u: f32| TexturedFace { area, corners: [[u, 0.1], [u + 0.3, 0.1], [u, 0.4]] };
        let part = mean(&[face(3.0, 0.1), face(1.0, 1.6)], false);
        assert!((part.colour[0] - 0.75).abs() < 1e-3, "{part:?}");
    }

    #[test]
    fn levels_are_of_linear_light() {
        let grey = DynamicImage::ImageRgba8(image::RgbaImage::from_pixel(3, 1, Rgba([128, 128, 128, 255])));
        let of = |raw| mean(&grey, &[], Placing::FROM_BELOW, Sampling { raw, ..Sampling::of_colour(1) });
        let [coded, raw] = [false, true].map(|raw| of(raw).colour[0]);
        assert!((coded - 0.215_860_5).abs() < 1e-7 && (raw - 128.0 / 255.0).abs() < 1e-12, "{coded} {raw}");
    }

    /// White and black texels beside each other: beyond the edges the row repeats, turns round or ends.
    #[test]
    fn images_go_on_beyond_their_edges_as_is_asked() {
        let image = DynamicImage::ImageLuma8(image::GrayImage::from_raw(2, 1, vec![255, 0]).unwrap());
        let seen = |wrap| {
            let at = |u| texel(&image, DVec2::new(u, 0.5), [wrap; 2]).0[0];
            [-0.75, -0.25, 0.25, 0.75, 1.25, 1.75].map(at)
        };
        assert_eq!(seen(Wrap::Repeat), [255, 0, 255, 0, 255, 0]);
        assert_eq!(seen(Wrap::Mirror), [0, 255, 255, 0, 0, 255]);
        assert_eq!(seen(Wrap::Clamp), [255, 255, 255, 0, 0, 0]);
    }
}
