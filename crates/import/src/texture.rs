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

/// A map of places before they are looked up: of glTF's KHR_texture_transform, and of v counted from below.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placing {
    pub(crate) linear: DMat2,
    pub(crate) offset: DVec2,
}

impl Placing {
    /// Places whose v counts from the image's last row upwards, as in OBJ.
    pub(crate) const FROM_BELOW: Placing =
        Placing { linear: DMat2::from_cols(DVec2::X, DVec2::NEG_Y), offset: DVec2::Y };

    /// Places as glTF has them: v counts from the image's first row downwards.
    pub(crate) const FROM_ABOVE: Placing = Placing { linear: DMat2::IDENTITY, offset: DVec2::ZERO };
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

/// The mean of an image over faces, that of the whole image where there are none, from some points. `opacity` says whether alpha
/// counts.
pub(crate) fn mean(
    image: &DynamicImage,
    shown: &[TexturedFace],
    placing: Placing,
    (points, opacity): (usize, bool),
) -> Mean {
    let whole = [[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]], [[0.0, 0.0], [1.0, 1.0], [0.0, 1.0]]];
    let whole = whole.map(|corners| TexturedFace { area: 0.5, corners });
    let total: f64 = shown.iter().map(|face| f64::from(face.area)).sum();
    let (shown, total) = if total > 0.0 && total.is_finite() { (shown, total) } else { (&whole[..], 1.0) };
    let linear = linear_light();
    let (mut colour, mut alpha, mut weights) = ([0.0; 3], 0.0, 0.0);
    let mut number = 0_u64;
    for face in shown {
        let area = f64::from(face.area);
        let points = (points as f64 * area / total).ceil().max(1.0);
        let weight = area / points;
        let [a, b, c] =
            face.corners.map(|[u, v]| placing.linear * DVec2::new(u.into(), v.into()) + placing.offset);
        for _ in 0..points as u64 {
            number += 1;
            let [s, t] = in_triangle(number);
            let Rgba([red, green, blue, opaque]) = texel(image, a + (b - a) * s + (c - a) * t);
            let opaque = if opacity { f64::from(opaque) / 255.0 } else { 1.0 };
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

/// The texel at a place, counted from the first row; images repeat beyond their edges.
fn texel(image: &DynamicImage, place: DVec2) -> Rgba<u8> {
    let index = |x: f64, count: u32| {
        let x = x - x.floor();
        // A place that is no number, and one that rounds to 1.
        ((x * f64::from(count)) as u32).min(count - 1)
    };
    image.get_pixel(index(place.x, image.width()), index(place.y, image.height()))
}

/// The linear light of each of 256 levels.
fn linear_light() -> [f64; 256] {
    std::array::from_fn(|level| linear(level as f64 / 255.0))
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
        let mean =
            |shown: &[TexturedFace], opacity| mean(&image, shown, Placing::FROM_ABOVE, (points(1), opacity));
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
        let [found, ..] = mean(&grey, &[], Placing::FROM_BELOW, (points(1), false)).colour.channels();
        assert!((found - 0.215_860_5).abs() < 1e-7, "{found}");
    }
}
