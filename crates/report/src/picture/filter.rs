//! Filters that take the noise of light from the pixels around that show the same surface.

use glam::Vec3;
use parallel::on_all_cores;

use super::field::{Noisy, PixelFeatures};
use super::sights::AXES;

/// Gathered light is taken from within this part of the mean distance to what surrounds a point.
const GATHERED_FROM: f32 = 0.35;

/// Filters have steps of 1, 2, 4 … pixels, pass by pass; these are the passes.
const GATHERED_PASSES: usize = 5;
const LAMP_PASSES: usize = 4;

/// From this pass on gathered light is taken from two pixels on opposite sides, or from none: from one side alone a slope
/// of the light, which ends at a corner of a room, would pull it.
const FIRST_IN_PAIRS: usize = 2;

/// Up to this pass gathered light is taken along diagonals, too: corners of rooms seldom lie along rows or columns.
const ALONG_DIAGONALS: usize = 3;

/// Gathered light is taken from the pixels around in any case, with one sample up to this many widths of a pixel.
const NEAREST: f32 = 16.0;

/// Light whose local means differ by this many of their standard errors, and by this part of the light, is not mixed by much. Of few samples the
/// standard errors are not known well: their squares are allowed to be larger by this number over that of the samples.
const RANGE: f32 = 2.5;
const UNKNOWN: f32 = 3.0;
const LEAST_RANGE: f32 = 5e-3;

/// Slopes of light are estimated over this many pixels on both sides, as a power of 2.
const SLOPE: usize = 2;

/// What light of another pixel is multiplied by at most to make up for a slope.
const MOST_GAIN: f32 = 2.0;

/// The filter of a pass, a cubic B-spline: the middle, and what is one step and two steps away.
const MIDDLE: f32 = 0.375;
const ASIDE: [f32; 2] = [0.25, 1.0 / 16.0];

/// What the filters took is given back over these passes, wide ones, so that it brings little noise with it. It is done again for what was
/// then given to the wrong places.
const SPREAD_PASSES: usize = 5;
const ROUNDS: usize = 3;

/// A pixel is given back, or loses, at most this part of its light at a time: with few pixels around it would be given its own noise.
const MOST_GIVEN: f32 = 0.1;

/// Distances between pixels that are linked: powers of 2.
const DISTANCES: usize = 6;

/// Which pixels show the same surface.
pub(super) struct PixelLinks {
    size: [usize; 2],
    /// By pixel: bit `DISTANCES · axis + k` is whether the pixel 2ᵏ further along an axis shows the same surface.
    ahead: Vec<u32>,
}

/// How far a pixel is from another.
#[derive(Clone, Copy)]
struct Off {
    /// Of [`AXES`].
    axis: usize,
    pixels: f32,
}

impl PixelLinks {
    /// The links of pixels, but for those between which something stands: it throws shadows.
    pub(super) fn new(
        pixels: &[PixelFeatures],
        size: [usize; 2],
        are_parted: impl Fn(usize, usize) -> bool + Sync,
    ) -> Self {
        let [width, height] = size;
        let mut links = PixelLinks { size, ahead: vec![0; pixels.len()] };
        for k in 0..DISTANCES {
            let is_in_sight = |own: usize, axis: usize| match k.checked_sub(1) {
                None => !are_parted(own, axis),
                Some(k) => links.ahead(own, axis, k).is_some_and(|half| links.ahead(half, axis, k).is_some()),
            };
            let found = |[x, y]: [usize; 2]| {
                let own = y * width + x;
                let goes_on = |(axis, way): (usize, [isize; 2])| {
                    let x = x.checked_add_signed(way[0] << k).filter(|x| *x < width)?;
                    let y = y.checked_add_signed(way[1] << k).filter(|y| *y < height)?;
                    let goes_on = is_in_sight(own, axis) && pixels[own].goes_on(&pixels[y * width + x]);
                    Some(u32::from(goes_on) << (DISTANCES * axis + k))
                };
                if pixels[own].normal == Vec3::ZERO {
                    return 0;
                }
                AXES.into_iter()
                    .enumerate()
                    .filter_map(goes_on)
                    .fold(links.ahead[own], |bits, bit| bits | bit)
            };
            let row = |y: usize| (0..width).map(|x| found([x, y])).collect::<Vec<u32>>();
            links.ahead = on_all_cores(height, row).concat();
        }
        links
    }

    /// The pixel 2ᵏ pixels further along an axis, where it shows the same surface.
    fn ahead(&self, own: usize, axis: usize, k: usize) -> Option<usize> {
        let is_linked = self.ahead[own] >> (DISTANCES * axis + k) & 1 == 1;
        is_linked.then(|| own + (self.stride(axis) << k))
    }

    /// The pixel 2ᵏ pixels before.
    fn behind(&self, own: usize, axis: usize, k: usize) -> Option<usize> {
        let before = own.checked_sub(self.stride(axis) << k)?;
        self.ahead(before, axis, k)?;
        Some(before)
    }

    /// Whether one of the eight pixels around a pixel shows another surface.
    pub(super) fn is_at_edge(&self, own: usize) -> bool {
        (0..AXES.len()).any(|axis| self.behind(own, axis, 0).is_none() || self.ahead(own, axis, 0).is_none())
    }

    /// By pixel, the number of pixels around that show the same surface, as far as on both sides along each axis, as a power of 2.
    pub(super) fn alike(&self) -> Vec<u32> {
        let along = |own: usize, axis: usize| {
            let is_between =
                |k: &usize| self.behind(own, axis, *k).is_some() && self.ahead(own, axis, *k).is_some();
            (0..DISTANCES).take_while(is_between).count() as u32
        };
        (0..self.ahead.len()).map(|own| along(own, 0) + along(own, 1)).collect()
    }

    /// How far the next pixel along an axis is in memory.
    fn stride(&self, axis: usize) -> usize {
        [1, self.size[0], self.size[0] + 1, self.size[0] - 1][axis]
    }

    /// What a pass makes of light, along rows and then along columns. `weights` are those of the pixels before and behind a pixel,
    /// as far as there are, and what their light is multiplied by.
    fn filtered(
        &self,
        light: &[Noisy],
        pass: usize,
        weights: impl Fn(usize, [Option<usize>; 2], Off) -> [[f32; 2]; 2] + Sync,
    ) -> Vec<Noisy> {
        let along_rows = self.filtered_along(0, light, pass, &weights);
        self.filtered_along(1, &along_rows, pass, &weights)
    }

    /// [`PixelLinks::filtered`] along one axis.
    fn filtered_along(
        &self,
        axis: usize,
        light: &[Noisy],
        pass: usize,
        weights: &(impl Fn(usize, [Option<usize>; 2], Off) -> [[f32; 2]; 2] + Sync),
    ) -> Vec<Noisy> {
        let [width, height] = self.size;
        let pixel = |own: usize| {
            let middle = &light[own];
            let (mut sum, mut all) = (middle.light * MIDDLE, MIDDLE);
            let mut variance = MIDDLE * MIDDLE * middle.variance;
            for (further, part) in ASIDE.into_iter().enumerate() {
                let k = pass + further;
                let others = [self.behind(own, axis, k), self.ahead(own, axis, k)];
                if others == [None; 2] {
                    continue;
                }
                let weights = weights(own, others, Off { axis, pixels: (1 << k) as f32 });
                for (other, [weight, gain]) in others.into_iter().zip(weights) {
                    let Some(other) = other.map(|other| &light[other]) else { continue };
                    let weight = weight * part;
                    sum += other.light * (weight * gain);
                    all += weight;
                    variance += weight * weight * other.variance;
                }
            }
            Noisy { light: sum / all, variance: variance / (all * all) }
        };
        let row = |y: usize| (y * width..(y + 1) * width).map(pixel).collect::<Vec<Noisy>>();
        on_all_cores(height, row).concat()
    }

    /// A pass whose weights are 1.
    fn evened(&self, light: &[Noisy], pass: usize) -> Vec<Noisy> {
        self.filtered(light, pass, |_, _, _| [[1.0; 2]; 2])
    }

    /// Light spread over each surface by passes along axes: all pixels together have as much as before.
    fn spread(&self, light: &[Vec3], steps: impl Iterator<Item = (usize, usize)>) -> Vec<Vec3> {
        steps.fold(light.to_vec(), |light, (pass, axis)| self.spread_along(axis, pass, &light))
    }

    /// A pass of [`PixelLinks::spread`] along one axis: two pixels take alike from each other, and a pixel keeps the rest.
    fn spread_along(&self, axis: usize, pass: usize, light: &[Vec3]) -> Vec<Vec3> {
        let width = self.size[0];
        let pixel = |own: usize| {
            let mut sum = light[own];
            for (further, part) in ASIDE.into_iter().enumerate() {
                let k = pass + further;
                for other in [self.behind(own, axis, k), self.ahead(own, axis, k)].into_iter().flatten() {
                    sum += (light[other] - light[own]) * part;
                }
            }
            sum
        };
        let row = |y: usize| (y * width..(y + 1) * width).map(pixel).collect::<Vec<Vec3>>();
        on_all_cores(self.size[1], row).concat()
    }
}

/// Replaces the inverse reach of every pixel by the mean of those around, so that it is not noise.
pub(super) fn even_reach(pixels: &mut [PixelFeatures], links: &PixelLinks) {
    let near = pixels.iter().map(|pixel| Noisy { light: Vec3::splat(1.0 / pixel.reach), variance: 0.0 });
    let near = links.evened(&near.collect::<Vec<_>>(), 0);
    pixels.iter_mut().zip(near).for_each(|(pixel, near)| pixel.reach = 1.0 / near.light.x);
}

/// Gathered light, evened out within its reach.
pub(super) fn even_gathered(
    pixels: &[PixelFeatures],
    light: Vec<Noisy>,
    links: &PixelLinks,
    samples: &[u8],
) -> Vec<Noisy> {
    let weight = &|own: usize, other: usize| {
        let nearest = NEAREST / f32::from(samples[own]).sqrt();
        let (own, other) = (&pixels[own], &pixels[other]);
        let reach = (GATHERED_FROM * own.reach.min(other.reach)).max(nearest * own.width);
        (1.0 - (other.place - own.place).length() / reach).max(0.0)
    };
    let weights = |pass: usize| {
        move |own: usize, others: [Option<usize>; 2], _: Off| match others {
            [Some(behind), Some(ahead)] => [[weight(own, behind).min(weight(own, ahead)), 1.0]; 2],
            _ if pass >= FIRST_IN_PAIRS => [[0.0; 2]; 2],
            _ => others.map(|other| [other.map_or(0.0, |other| weight(own, other)), 1.0]),
        }
    };
    let pass = |light: Vec<Noisy>, pass: usize| {
        let axes = if pass < ALONG_DIAGONALS { AXES.len() } else { 2 };
        (0..axes).fold(light, |light, axis| links.filtered_along(axis, &light, pass, &weights(pass)))
    };
    (0..GATHERED_PASSES).fold(light, pass)
}

/// Light, evened out within its noise, which is told from shadows by means over a few pixels; and once more by the outcome, whose
/// slopes are known.
pub(super) fn even_noise(light: &[Noisy], links: &PixelLinks, samples: &[u8]) -> Vec<Noisy> {
    let guide = Guide::flat(&links.evened(light, 0), links, samples);
    let once = even_by(&guide, light, links);
    even_by(&guide.sloping(&once, links), light, links)
}

/// Gives filtered light back what the filters took from it. They divide by sums of weights, which follow from the same rays as the light:
/// pixels with bright noise are given smaller weights, and their light is lost. With S for a wide [`PixelLinks::spread`] and Sᵀ for the same steps backwards, F becomes
/// F (1 + Sᵀ[(L − F) / S[F]]). Its sum is that of the light L before filters, and what is dark stays dark.
pub(super) fn give_back(filtered: Vec<Vec3>, unfiltered: &[Vec3], links: &PixelLinks) -> Vec<Vec3> {
    let steps = || (0..SPREAD_PASSES).flat_map(|pass| [(pass, 0), (pass, 1)]);
    let round = |filtered: Vec<Vec3>| {
        let around = links.spread(&filtered, steps());
        let taken = (0..filtered.len()).map(|pixel| {
            let part = (unfiltered[pixel] - filtered[pixel]) / around[pixel];
            Vec3::select(around[pixel].cmpgt(Vec3::ZERO), part, Vec3::ZERO)
        });
        let taken = links.spread(&taken.collect::<Vec<_>>(), steps().rev());
        let most = Vec3::splat(MOST_GIVEN);
        let given = |(&filtered, taken): (&Vec3, Vec3)| filtered + filtered * taken.clamp(-most, most);
        filtered.iter().zip(taken).map(given).collect()
    };
    (0..ROUNDS).fold(filtered, |filtered, _| round(filtered))
}

/// Light, evened out where it differs from what a guide predicts by no more than noise.
fn even_by(guide: &Guide, light: &[Noisy], links: &PixelLinks) -> Vec<Noisy> {
    let pass = |light: &[Noisy], pass: usize| {
        links.filtered(light, pass, |own, [behind, ahead], off| {
            let back = Off { pixels: -off.pixels, ..off };
            [(behind, back), (ahead, off)].map(|(other, off)| match other {
                Some(other) => guide.weight(own, other, off),
                None => [0.0; 2],
            })
        })
    };
    (1..LAMP_PASSES).fold(pass(light, 0), |light, k| pass(&light, k))
}

/// What is predicted of light.
struct Guide {
    of: Vec<PredictedPixel>,
}

/// What is predicted of a pixel.
#[derive(Clone, Copy)]
struct PredictedPixel {
    /// The mean of the channels.
    light: f32,
    /// What that changes by from one pixel to the next, along rows and columns.
    slopes: [f32; 2],
    /// Over the square of a difference that is noise.
    scale: f32,
}

impl Guide {
    /// Without slopes.
    fn flat(light: &[Noisy], links: &PixelLinks, samples: &[u8]) -> Self {
        // The variance of a variance is large, too.
        let spread: Vec<Noisy> =
            light.iter().map(|of| Noisy { light: Vec3::splat(of.variance), variance: 0.0 }).collect();
        let spread = [1, 2].iter().fold(spread, |spread, &pass| links.evened(&spread, pass));
        let predicted = |((of, spread), &samples): ((&Noisy, &Noisy), &u8)| {
            let light = mean(of.light);
            let variance = spread.light.x * (1.0 + UNKNOWN / f32::from(samples));
            let noise = RANGE * RANGE * variance + (LEAST_RANGE * light).powi(2);
            PredictedPixel { light, slopes: [0.0; 2], scale: 1.0 / (noise + f32::MIN_POSITIVE) }
        };
        Guide { of: light.iter().zip(&spread).zip(samples).map(predicted).collect() }
    }

    /// A guide by light with less noise, whose slopes are known, for the same noise.
    fn sloping(self, light: &[Noisy], links: &PixelLinks) -> Self {
        let light: Vec<f32> = light.iter().map(|of| mean(of.light)).collect();
        let slope = |own: usize, axis: usize| {
            let [back, ahead] = [links.behind(own, axis, SLOPE), links.ahead(own, axis, SLOPE)];
            let ends = usize::from(back.is_some()) + usize::from(ahead.is_some());
            let rise = light[ahead.unwrap_or(own)] - light[back.unwrap_or(own)];
            rise / ((ends << SLOPE).max(1)) as f32
        };
        let predicted = |(own, of): (usize, &PredictedPixel)| PredictedPixel {
            light: light[own],
            slopes: [slope(own, 0), slope(own, 1)],
            ..*of
        };
        Guide { of: self.of.iter().enumerate().map(predicted).collect() }
    }

    /// The weight of another pixel, so far from a pixel, and what its light is multiplied by to be that of the pixel.
    fn weight(&self, own: usize, other: usize, off: Off) -> [f32; 2] {
        let (own, other) = (&self.of[own], &self.of[other]);
        let predicted = own.light + own.slopes[off.axis] * off.pixels;
        let difference = predicted - other.light;
        // Near exp(−x), the same on every platform.
        let weight = (1.0 - difference * difference * own.scale / 8.0).max(0.0).powi(8);
        let gain =
            if predicted > 0.0 { (own.light / predicted).clamp(1.0 / MOST_GAIN, MOST_GAIN) } else { 1.0 };
        [weight, gain]
    }
}

fn mean(light: Vec3) -> f32 {
    light.element_sum() / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A plane in 64 × 48 pixels, up to a wall in column 40.
    fn corner() -> (Vec<PixelFeatures>, PixelLinks) {
        let [width, height] = [64, 48];
        let pixel = |x: usize, y: usize| PixelFeatures {
            place: Vec3::new(x as f32, y as f32, 0.0),
            normal: if x < 40 { Vec3::Z } else { Vec3::X },
            surface: u32::from(x >= 40),
            direct: Vec3::ZERO,
            reach: 60.0,
            width: 1.0,
        };
        let pixels: Vec<PixelFeatures> =
            (0..width * height).map(|pixel_| pixel(pixel_ % width, pixel_ / width)).collect();
        let links = PixelLinks::new(&pixels, [width, height], |_, _| false);
        (pixels, links)
    }

    /// Light that rises towards a corner is as bright there after the filter as before, but for what the two narrowest passes take from one side.
    #[test]
    fn a_slope_that_ends_at_a_corner_is_not_pulled() {
        let (pixels, links) = corner();
        let light = |pixel: usize| if pixel % 64 < 40 { 1.0 + 0.02 * (pixel % 64) as f32 } else { 0.3 };
        let noisy = |pixel: usize| Noisy { light: Vec3::splat(light(pixel)), variance: 0.0 };
        let filtered =
            even_gathered(&pixels, (0..pixels.len()).map(noisy).collect(), &links, &vec![2; pixels.len()]);
        let off = |column: usize| (filtered[24 * 64 + column].light.x - light(column)).abs();
        assert!(off(39) < 0.06 && off(34) < 0.03 && off(20) < 2e-3, "{} {} {}", off(39), off(34), off(20));
        assert!((filtered[24 * 64 + 41].light.x - 0.3).abs() < 1e-6);
    }

    /// Noise of few bright pixels, as light seen between two edges has: where they have less around them than others, and where light
    /// rises, there is as much light after the filters as before, and squares of steps between pixels are a hundredth of what they were, or less.
    #[test]
    fn filters_keep_the_light() {
        let (mut pixels, links) = corner();
        let is_bright = |pixel: usize| (pixel as u32).wrapping_mul(0x9E37_79B9) >> 27 == 0;
        let light: Vec<Noisy> = (0..pixels.len())
            .map(|pixel| {
                let light = (1.0 + 0.02 * (pixel % 64) as f32) * if is_bright(pixel) { 9.0 } else { 0.75 };
                Noisy { light: Vec3::new(light, 0.8 * light, 0.6 * light), variance: 0.1 * light * light }
            })
            .collect();
        for (number, pixel) in pixels.iter_mut().enumerate() {
            pixel.reach = if is_bright(number) { 8.0 } else { 60.0 };
        }
        let of = |light: Vec<Noisy>| light.iter().map(|of| of.light).collect::<Vec<Vec3>>();
        let sum = |light: &[Vec3]| light.iter().map(|of| f64::from(mean(*of))).sum::<f64>();
        let steps = |light: &[Vec3]| -> f64 {
            let step = |pair: &[Vec3]| f64::from(mean(pair[1] - pair[0])).powi(2);
            light.chunks(64).flat_map(|row| row[..40].windows(2)).map(step).sum()
        };
        let by_lamps = of(even_noise(&light, &links, &vec![2; pixels.len()]));
        let gathered = of(even_gathered(&pixels, light.clone(), &links, &vec![32; pixels.len()]));
        let light = of(light);
        for filtered in [by_lamps, gathered] {
            let kept = give_back(filtered.clone(), &light, &links);
            let [before, after] = [&filtered, &kept].map(|of| sum(of) / sum(&light));
            assert!((before - 1.0).abs() > 2e-3 && (after - 1.0).abs() < 1e-5, "{before} {after}");
            assert!(steps(&kept) < 0.01 * steps(&light), "{} {}", steps(&kept), steps(&light));
        }
    }

    /// Pixels are not linked across another surface, nor across what is thinner than a pixel, and filters mix no light across it.
    #[test]
    fn nothing_is_linked_across_what_stands_between() {
        let (mut pixels, _) = corner();
        let at = |x: usize, y: usize| y * 64 + x;
        (0..40).for_each(|x| (pixels[at(x, 10)].surface, pixels[at(x, 10)].normal) = (2, Vec3::Y));
        let links = PixelLinks::new(&pixels, [64, 48], |pixel, axis| axis != 0 && pixel / 64 == 30);
        assert_eq!([0, 1, 2].map(|k| links.ahead(at(5, 9), 1, k)), [None; 3]);
        assert_eq!([0, 1, 2].map(|k| links.ahead(at(5, 30), 1, k)), [None; 3]);
        assert_eq!(links.ahead(at(5, 28), 1, 1), Some(at(5, 30)));
        assert_eq!([2, 3].map(|k| links.ahead(at(5, 28), 1, k)), [None; 2]);
        assert!(links.is_at_edge(at(5, 30)) && links.is_at_edge(at(5, 31)) && !links.is_at_edge(at(5, 29)));
        let light = |pixel: usize| if pixel / 64 > 30 { Vec3::ZERO } else { Vec3::ONE };
        let noisy: Vec<Noisy> =
            (0..pixels.len()).map(|pixel| Noisy { light: light(pixel), variance: 1.0 }).collect();
        let samples = vec![2; pixels.len()];
        let gathered = even_gathered(&pixels, noisy.clone(), &links, &samples);
        for filtered in [gathered, even_noise(&noisy, &links, &samples)] {
            let off = |(pixel, of): (usize, &Noisy)| (of.light - light(pixel)).abs().max_element();
            let worst = filtered.iter().enumerate().map(off).fold(0.0, f32::max);
            assert!(worst < 1e-6, "{worst}");
        }
    }

    /// Links end at the edges of the picture and of surfaces, along all axes.
    #[test]
    fn links_end_where_surfaces_do() {
        let (_, links) = corner();
        let at = |x: usize, y: usize| y * 64 + x;
        assert_eq!(links.ahead(at(38, 10), 0, 0), Some(at(39, 10)));
        assert_eq!(links.ahead(at(39, 10), 0, 0), None);
        assert_eq!(links.behind(at(40, 10), 0, 0), None);
        assert_eq!(links.ahead(at(10, 10), 1, 5), Some(at(10, 42)));
        assert_eq!(links.ahead(at(10, 20), 1, 5), None);
        assert_eq!(links.ahead(at(36, 10), 2, 2), None);
        assert_eq!(links.ahead(at(36, 10), 3, 2), Some(at(32, 14)));
        assert_eq!(links.behind(at(32, 14), 3, 2), Some(at(36, 10)));
        assert_eq!(links.behind(at(0, 10), 0, 0), None);
    }
}
