//! The irradiance of what is in sight, pixel by pixel.
//!
//! Shadow rays bring the light of lamps, together with gathering rays that meet some, and gathering rays what other surfaces reflect: B of the solution where they end. So
//! shadows, corners and edges have the sharpness of pixels and not of patches, and errors of patches average out over the
//! hemisphere. What noise is left is taken by filters that stay on one surface: the one of gathered light within a part of the
//! distance to what surrounds a point, over which that light hardly changes (G. Ward, F. Rubinstein & R. Clear, *A ray tracing solution
//! for diffuse interreflection*, SIGGRAPH 1988), the one of lamps within their noise (C. Schied et al., *Spatiotemporal variance-guided
//! filtering*, HPG 2017).

use glam::{DVec3, Vec3};
use parallel::on_all_cores;
use radiosity::{Lookout, Ray, Scene};

use super::lamps::{Aim, Lamps, Odds, SHADOWS};
use super::numbers::{Use, point, unit, z_order};
use super::spot::{BAND, Spot};
use crate::camera::Camera;
use crate::smooth::Smooth;

/// Samples of a pixel at most. A sample is a ray that gathers, and [`SHADOWS`] to lamps, whose light is noisier.
const MOST_SAMPLES: u32 = 24;

/// Samples of a pixel at least: with fewer the picture shows the patches.
const LEAST_SAMPLES: u32 = 2;

/// The rays of a run for each that its picture takes.
const RUN_PER_PICTURE: u64 = 4;

/// Pixels whose rays are traced together.
const AT_ONCE: usize = 64;

/// Gathered light is taken from within this part of the mean distance to what surrounds a point.
const GATHERED_FROM: f32 = 0.35;

/// Points of one surface: the cosine between their normals at least, and the sine between their chord and the surface at most.
const SAME_NORMAL: f32 = 0.94;
const SAME_PLANE: f32 = 0.2;

/// Steps between the pixels that are filtered together, pass by pass.
const GATHERED_STEPS: [usize; 5] = [1, 2, 4, 8, 16];
const LAMP_STEPS: [usize; 4] = [1, 2, 4, 8];

/// Gathered light is taken from the pixels around in any case, with one sample up to this many widths of a pixel.
const NEAREST: f32 = 16.0;

/// Light of lamps whose local means differ by this many of their standard errors, and by this part of the light, is not mixed by much.
const RANGE: f32 = 4.0;
const LEAST_RANGE: f32 = 5e-3;

/// Slopes of light are told over this many pixels on both sides.
const SLOPE: usize = 4;

/// What light of another pixel is multiplied by at most to make up for a slope.
const MOST_GAIN: f32 = 2.0;

/// The filter of a pass: a cubic B-spline.
const KERNEL: [f32; 5] = [1.0 / 16.0, 0.25, 0.375, 0.25, 1.0 / 16.0];

/// What lights a picture.
pub(super) struct Lights<'a> {
    pub(super) scene: &'a Scene,
    pub(super) smooth: &'a Smooth,
    pub(super) lamps: Lamps,
}

/// The irradiance in the middle of each pixel.
pub(super) struct Field {
    size: [usize; 2],
    pixels: Vec<Seen>,
    irradiance: Vec<Vec3>,
}

/// What filters know of a pixel.
#[derive(Clone, Copy, Default)]
struct Seen {
    place: Vec3,
    /// Of the side in sight; 0 where no light is wanted.
    normal: Vec3,
    /// The surface that the place is on.
    surface: u32,
    /// What lamps without area bring, which has no noise.
    direct: Vec3,
    /// The mean distance to what surrounds it, in the sense of Ward et al. [m].
    reach: f32,
    /// How wide the pixel is there, across the direction of view [m].
    width: f32,
}

impl Seen {
    /// Whether two pixels show one surface.
    fn goes_on(&self, other: &Seen) -> bool {
        let is_same = self.surface == other.surface && self.normal == other.normal;
        is_same || is_one_surface(other.place - self.place, self.normal, other.normal)
    }
}

/// How far a pixel is from another.
#[derive(Clone, Copy)]
struct Off {
    /// 0: in the same row; 1: in the same column.
    axis: usize,
    pixels: f32,
    /// Between the places that they show [m].
    way: Vec3,
}

/// Light of one kind in a pixel.
#[derive(Clone, Copy, Default)]
struct Noisy {
    light: Vec3,
    /// Of the mean of the channels.
    variance: f32,
}

/// A pixel whose rays are traced.
struct Sample {
    seen: Seen,
    lamps: Noisy,
    gathered: Vec3,
}

/// What a ray brings.
enum Errand {
    Gather,
    Shadow(Aim),
}

/// Samples of each pixel after a run of this number of rays; `None` where that is below one for each pixel.
pub(super) fn samples(rays_of_run: u64, pixels: usize) -> Option<u32> {
    let samples = rays_of_run / RUN_PER_PICTURE / (u64::from(1 + SHADOWS) * pixels as u64).max(1);
    let samples = samples.clamp(LEAST_SAMPLES.into(), MOST_SAMPLES.into()) as u32;
    (rays_of_run >= pixels as u64).then_some(samples)
}

impl Field {
    /// The irradiance behind the middle of each pixel by some samples each.
    pub(super) fn new(lights: &Lights, camera: &Camera, spots: &[Spot], samples: u32) -> Self {
        let size = camera.size.map(|side| side as usize);
        let bands = on_all_cores(spots.len().div_ceil(AT_ONCE * BAND), |band| {
            let first = band * AT_ONCE * BAND;
            let some = &spots[first..spots.len().min(first + AT_ONCE * BAND)];
            let (lookout, odds) = (Lookout::new(lights.scene), Odds::of(&lights.lamps));
            let mut tracer = Tracer { lights, camera, samples, lookout, odds };
            some.chunks(AT_ONCE)
                .zip((first..).step_by(AT_ONCE))
                .flat_map(|(spots, first)| tracer.trace(first, spots))
                .collect::<Vec<_>>()
        });
        let traced: Vec<Sample> = bands.into_iter().flatten().collect();
        let mut pixels: Vec<Seen> = traced.iter().map(|sample| sample.seen).collect();
        let gathered = traced.iter().map(|sample| Noisy { light: sample.gathered, variance: 0.0 }).collect();
        let by_lamps: Vec<Noisy> = traced.iter().map(|sample| sample.lamps).collect();
        drop(traced);
        even_reach(&mut pixels, size);
        let gathered = even_gathered(&pixels, gathered, size, samples);
        let by_lamps = even_lamps(&pixels, &by_lamps, size);
        let straight = pixels.iter().map(|pixel| pixel.direct);
        let noisy = gathered.iter().zip(&by_lamps).map(|(a, b)| a.light + b.light);
        let irradiance = noisy.zip(straight).map(|(noisy, straight)| noisy + straight).collect();
        Field { size, pixels, irradiance }
    }

    /// The irradiance in the middle of a pixel.
    pub(super) fn of_pixel(&self, pixel: usize) -> [f64; 3] {
        self.irradiance[pixel].to_array().map(f64::from)
    }

    /// The irradiance of a place in sight at a point of the picture, from the pixels around that show the same surface; `None` where none does.
    pub(super) fn at(&self, [x, y]: [f64; 2], place: Vec3, normal: Vec3) -> Option<[f64; 3]> {
        let [width, height] = self.size;
        let (mut sum, mut weights) = (Vec3::ZERO, 0.0);
        for reach in [1, 3] {
            let around = |at: f64, size: usize| {
                let middle = (at as usize).min(size - 1);
                middle.saturating_sub(reach)..=(middle + reach).min(size - 1)
            };
            for row in around(y, height) {
                for column in around(x, width) {
                    let pixel = row * width + column;
                    let seen = &self.pixels[pixel];
                    if is_one_surface(seen.place - place, normal, seen.normal) {
                        let off = [x - column as f64 - 0.5, y - row as f64 - 0.5];
                        let weight = 1.0 / (0.05 + off[0] * off[0] + off[1] * off[1]) as f32;
                        sum += self.irradiance[pixel] * weight;
                        weights += weight;
                    }
                }
            }
            if weights > 0.0 {
                return Some((sum / weights).to_array().map(f64::from));
            }
        }
        None
    }
}

/// Whether two places are on one surface to the eye: given the way from one to the other, and their normals.
fn is_one_surface(way: Vec3, normal: Vec3, other: Vec3) -> bool {
    normal.dot(other) >= SAME_NORMAL
        && way.dot(normal).powi(2) <= SAME_PLANE * SAME_PLANE * way.length_squared()
}

/// Replaces the inverse reach of every pixel by the mean of those around, so that it is not noise.
fn even_reach(pixels: &mut [Seen], size: [usize; 2]) {
    let near = pixels.iter().map(|pixel| Noisy { light: Vec3::splat(1.0 / pixel.reach), variance: 0.0 });
    let near = filtered(pixels, &near.collect::<Vec<_>>(), size, 1, |_, _, _| [1.0; 2]);
    pixels.iter_mut().zip(near).for_each(|(pixel, near)| pixel.reach = 1.0 / near.light.x);
}

/// A pass of a filter over the pixels around each that show the same surface, along rows and then along columns. `weight` is that of
/// another pixel, and what its light is multiplied by, given both and how far one is from the other.
fn filtered(
    pixels: &[Seen],
    light: &[Noisy],
    size: [usize; 2],
    step: usize,
    weight: impl Fn(usize, usize, Off) -> [f32; 2] + Sync,
) -> Vec<Noisy> {
    let along_rows = filtered_along(0, pixels, light, size, step, &weight);
    filtered_along(1, pixels, &along_rows, size, step, &weight)
}

/// [`filtered`] along one axis.
fn filtered_along(
    axis: usize,
    pixels: &[Seen],
    light: &[Noisy],
    [width, height]: [usize; 2],
    step: usize,
    weight: &(impl Fn(usize, usize, Off) -> [f32; 2] + Sync),
) -> Vec<Noisy> {
    let (length, stride) = [(width, 1), (height, width)][axis];
    let pixel = |x: usize, y: usize| {
        let own = y * width + x;
        let (here, place) = (&pixels[own], [x, y][axis]);
        if here.normal == Vec3::ZERO {
            return light[own];
        }
        let (mut sum, mut weights, mut variance) = (Vec3::ZERO, 0.0, 0.0);
        for (k, part) in KERNEL.into_iter().enumerate() {
            if place + k * step < 2 * step || place + k * step >= length + 2 * step {
                continue;
            }
            let other = own + k * step * stride - 2 * step * stride;
            let there = &pixels[other];
            let way = there.place - here.place;
            if here.goes_on(there) {
                let off = Off { axis, pixels: step as f32 * (k as f32 - 2.0), way };
                let [weight, gain] = weight(own, other, off);
                let weight = (weight * part).max(0.0);
                sum += light[other].light * (weight * gain);
                weights += weight;
                variance += weight * weight * light[other].variance;
            }
        }
        Noisy { light: sum / weights, variance: variance / (weights * weights) }
    };
    on_all_cores(height, |y| (0..width).map(|x| pixel(x, y)).collect::<Vec<Noisy>>()).concat()
}

/// Gathered light, evened out within its reach.
fn even_gathered(pixels: &[Seen], light: Vec<Noisy>, size: [usize; 2], samples: u32) -> Vec<Noisy> {
    let nearest = NEAREST / (samples as f32).sqrt();
    let within = |own: usize, other: usize, off: Off| {
        let weight = 1.0
            - off.way.length()
                / (GATHERED_FROM * pixels[own].reach.min(pixels[other].reach))
                    .max(nearest * pixels[own].width);
        [weight, 1.0]
    };
    GATHERED_STEPS.iter().fold(light, |light, &step| filtered(pixels, &light, size, step, within))
}

/// Light of lamps, evened out within its noise, which is told from shadows by means over a few pixels; and once more by the outcome, whose
/// slopes are known.
fn even_lamps(pixels: &[Seen], light: &[Noisy], size: [usize; 2]) -> Vec<Noisy> {
    let near = filtered(pixels, light, size, 1, |_, _, _| [1.0; 2]);
    let guide = Guide::flat(pixels, &near, size);
    let once = even_by(&guide, pixels, light, size);
    even_by(&guide.sloping(pixels, &once, size), pixels, light, size)
}

/// Light, evened out where it differs from what a guide foretells by no more than noise.
fn even_by(guide: &Guide, pixels: &[Seen], light: &[Noisy], size: [usize; 2]) -> Vec<Noisy> {
    let within = |own: usize, other: usize, off: Off| guide.weight(own, other, off);
    let first = filtered(pixels, light, size, LAMP_STEPS[0], within);
    LAMP_STEPS[1..].iter().fold(first, |light, &step| filtered(pixels, &light, size, step, within))
}

/// What is foretold of light.
struct Guide {
    /// The mean of the channels.
    light: Vec<f32>,
    /// What that changes by from one pixel to the next, along rows and columns.
    slopes: Vec<[f32; 2]>,
    /// Over the square of a difference that is noise.
    scale: Vec<f32>,
}

impl Guide {
    /// Without slopes.
    fn flat(pixels: &[Seen], light: &[Noisy], size: [usize; 2]) -> Self {
        // The variance of a variance is large, too.
        let spread: Vec<Noisy> =
            light.iter().map(|of| Noisy { light: Vec3::splat(of.variance), variance: 0.0 }).collect();
        let spread = [2, 4]
            .iter()
            .fold(spread, |spread, &step| filtered(pixels, &spread, size, step, |_, _, _| [1.0; 2]));
        let scale = |(of, spread): (&Noisy, &Noisy)| {
            1.0 / (RANGE * RANGE * spread.light.x
                + (LEAST_RANGE * mean(of.light)).powi(2)
                + f32::MIN_POSITIVE)
        };
        let scale = light.iter().zip(&spread).map(scale).collect();
        let light: Vec<f32> = light.iter().map(|of| mean(of.light)).collect();
        Guide { slopes: vec![[0.0; 2]; light.len()], light, scale }
    }

    /// A guide by light with less noise, whose slopes are known, for the same noise.
    fn sloping(self, pixels: &[Seen], light: &[Noisy], [width, height]: [usize; 2]) -> Self {
        let light: Vec<f32> = light.iter().map(|of| mean(of.light)).collect();
        let slope = |own: usize, place: usize, length: usize, stride: usize| {
            let reach = |most: usize, end: &dyn Fn(usize) -> usize| {
                let reach = most.min(SLOPE);
                if pixels[own].goes_on(&pixels[end(reach)]) { reach } else { 0 }
            };
            let back = reach(place, &|reach| own - reach * stride);
            let ahead = reach(length - 1 - place, &|reach| own + reach * stride);
            (light[own + ahead * stride] - light[own - back * stride]) / (back + ahead).max(1) as f32
        };
        let slopes = (0..width * height)
            .map(|own| [slope(own, own % width, width, 1), slope(own, own / width, height, width)])
            .collect();
        Guide { light, slopes, ..self }
    }

    /// The weight of another pixel, so far from a pixel, and what its light is multiplied by to be that of the pixel.
    fn weight(&self, own: usize, other: usize, off: Off) -> [f32; 2] {
        let foretold = self.light[own] + self.slopes[own][off.axis] * off.pixels;
        let difference = foretold - self.light[other];
        // Near exp(−x), the same on every platform.
        let weight = (1.0 - difference * difference * self.scale[own] / 8.0).max(0.0).powi(8);
        let gain =
            if foretold > 0.0 { (self.light[own] / foretold).clamp(1.0 / MOST_GAIN, MOST_GAIN) } else { 1.0 };
        [weight, gain]
    }
}

fn mean(light: Vec3) -> f32 {
    light.element_sum() / 3.0
}

/// Traces the rays of pixels.
struct Tracer<'a> {
    lights: &'a Lights<'a>,
    camera: &'a Camera,
    samples: u32,
    lookout: Lookout<'a>,
    odds: Odds,
}

impl Tracer<'_> {
    /// The light of some pixels in their order, from the first.
    fn trace(&mut self, first: usize, spots: &[Spot]) -> Vec<Sample> {
        let width = self.camera.size[0] as usize;
        let capacity = ((1 + SHADOWS) * self.samples) as usize * spots.len();
        let (mut rays, mut errands) = (Vec::with_capacity(capacity), Vec::with_capacity(capacity));
        let mut seen = Vec::with_capacity(spots.len());
        for (number, spot) in spots.iter().enumerate() {
            let pixel = first + number;
            seen.push(self.aim([pixel % width, pixel / width].map(|at| at as u32), spot, |ray, errand| {
                rays.push(ray);
                errands.push((number, errand));
            }));
        }
        let mut gathered = vec![(DVec3::ZERO, 0.0_f64); spots.len()];
        let mut by_lamps = vec![(DVec3::ZERO, 0.0_f64); spots.len()];
        let (scene, lamps, odds) = (self.lights.scene, &self.lights.lamps, &mut self.odds);
        let mut of = usize::MAX;
        self.lookout.each_closest_hit(&rays, |ray, hit| {
            let Some(hit) = hit else { return };
            let (number, errand) = &errands[ray];
            let (light, squares) = &mut by_lamps[*number];
            let passed = scene.passed_panes(&rays[ray], hit.t);
            let mut add = |brought: DVec3| {
                let brought = passed * brought;
                *light += brought;
                *squares += (brought.element_sum() / 3.0).powi(2);
            };
            match errand {
                Errand::Gather => {
                    let (gathered, near) = &mut gathered[*number];
                    *near += 1.0 / hit.t.max(f64::MIN_POSITIVE);
                    let surface = &scene.surfaces()[hit.surface as usize];
                    if !surface.is_active(hit.side) {
                        return;
                    }
                    let piece = surface.piece(surface.cell_at(hit.uv), hit.side);
                    if !lamps.has(piece) {
                        *gathered += passed * self.lights.radiosity(piece, hit.uv);
                        return;
                    }
                    if std::mem::replace(&mut of, *number) != *number {
                        let from: &Seen = &seen[*number];
                        odds.look_from(from.place.as_dvec3(), from.normal.as_dvec3());
                    }
                    let weight = lamps.met(scene, odds, piece, rays[ray].direction, hit.t);
                    add(self.lights.radiosity(piece, hit.uv) * weight);
                }
                Errand::Shadow(aim) if (aim.surface, aim.side) == (hit.surface, hit.side) => {
                    let surface = &scene.surfaces()[hit.surface as usize];
                    let piece = surface.piece(surface.cell_at(hit.uv), hit.side);
                    add(self.lights.radiosity(piece, hit.uv) * aim.weight);
                }
                Errand::Shadow(_) => {}
            }
        });
        let count = f64::from(self.samples);
        let sample = |(seen, (gathered, near), (light, squares)): (Seen, (DVec3, f64), (DVec3, f64))| {
            let rays = count * f64::from(1 + SHADOWS);
            let light = light / count;
            let variance = (squares / (count * count) - (light.element_sum() / 3.0).powi(2) / rays).max(0.0)
                * rays
                / (rays - 1.0);
            Sample {
                seen: Seen { reach: (count / near) as f32, ..seen },
                lamps: Noisy { light: light.as_vec3(), variance: variance as f32 },
                gathered: (gathered / count).as_vec3(),
            }
        };
        let pixels = seen.into_iter().zip(gathered).zip(by_lamps);
        pixels.map(|((seen, gathered), by_lamps)| sample((seen, gathered, by_lamps))).collect()
    }

    /// Aims the rays of a pixel.
    fn aim(&mut self, [x, y]: [u32; 2], spot: &Spot, mut shoot: impl FnMut(Ray, Errand)) -> Seen {
        let (lights, scene) = (self.lights, self.lights.scene);
        let Some(piece) = spot.piece().filter(|piece| !lights.lamps.has(*piece)) else {
            return Seen::default();
        };
        let side = scene.faces().piece(piece).side;
        let surface = &scene.surfaces()[spot.surface as usize];
        let normal = surface.normal() * side.sign();
        let middle = surface.point(spot.uv());
        self.odds.look_from(middle, normal);
        let first = z_order([x, y]).wrapping_mul(self.samples);
        for index in (0..self.samples).map(|k| first.wrapping_add(k)) {
            let [across, down] = point(index, Use::Place).map(unit);
            let uv = self.camera.on_plane(surface, [f64::from(x) + across, f64::from(y) + down]);
            let origin = surface.point(surface.inside(uv.unwrap_or(spot.uv())));
            let from = spot.surface;
            let [polar, turn] = point(index, Use::Direction);
            let direction = surface.direction(side, u64::from(polar) << 32 | u64::from(turn));
            shoot(Ray { origin, direction, from }, Errand::Gather);
            for (choice, place) in point(index, Use::Lamp).into_iter().zip([Use::OnLamp, Use::OnSecond]) {
                let place = point(index, place).map(unit);
                if let Some(aim) = lights.lamps.aim(scene, &mut self.odds, origin, unit(choice), place) {
                    shoot(Ray { origin, direction: aim.direction, from }, Errand::Shadow(aim));
                }
            }
        }
        let width = self.camera.width_of_pixel(middle) as f32;
        let direct = DVec3::from(scene.lamps_at(middle, normal, spot.surface)).as_vec3();
        let (place, normal) = (middle.as_vec3(), normal.as_vec3());
        Seen { place, normal, surface: spot.surface, direct, reach: 0.0, width }
    }
}

impl Lights<'_> {
    /// B of a piece at a place.
    fn radiosity(&self, piece: u32, uv: [f64; 2]) -> DVec3 {
        self.smooth.at(piece, self.scene.faces().corner_weights(piece, uv)).into()
    }
}
