//! The irradiance of what is in sight, pixel by pixel.
//!
//! Shadow rays bring the light of lamps, together with gathering rays that meet some, and gathering rays what other surfaces reflect: B of the solution where they end. So
//! shadows, corners and edges have the sharpness of pixels and not of patches, and errors of patches average out over the
//! hemisphere. What noise is left is taken by filters that stay on one surface: that of gathered light within a part of the
//! distance to what surrounds a point, over which it hardly changes (G. Ward, F. Rubinstein & R. Clear, *A ray tracing solution
//! for diffuse interreflection*, SIGGRAPH 1988), and that of all light within its noise (C. Schied et al., *Spatiotemporal
//! variance-guided filtering*, HPG 2017).

use glam::{DVec3, Vec3};
use parallel::on_all_cores;
use radiosity::{Scene, surfaces::Face};

use super::filter::{PixelLinks, even_gathered, even_noise, even_reach, give_back};
use super::lamps::{Lamps, SHADOWS};
use super::sights::Sights;
use super::spot::Spot;
use super::tracer::{PixelLight, PixelTask, Tracer};
use crate::camera::Camera;
use crate::smooth::Smooth;

/// Samples that a pixel may have: about √2 times as many from one to the next. A sample is a ray that gathers, and [`SHADOWS`] to
/// lamps, whose light is noisier.
const SAMPLES: [u8; 9] = [2, 3, 4, 6, 8, 12, 16, 24, 32];

/// The rays of a run for each that its picture takes.
const RUN_PER_PICTURE: u64 = 5;

/// Samples of a pixel in the mean at least: with fewer one sees blotches.
const LEAST_SAMPLES: u64 = 8;

/// A run of fewer rays than pixels over this is a trial: its picture shows the patches, and costs nothing.
const PIXELS_PER_RAY: u64 = 2;

/// The sides of a square of pixels whose rays are traced together.
const TILE: usize = 8;

/// A face is close within this many times the root of its area: what it reflects from there is sampled where a ray meets it.
const CLOSE: f32 = 1.0;

/// Points of one surface: the cosine between their normals at least, and the sine between their chord and the surface at most, where they lie on
/// a plane and where they do not.
const SAME_NORMAL: f32 = 0.94;
const SAME_PLANE: f32 = 0.01;
const SAME_CURVE: f32 = 0.2;

/// What lights a picture.
pub(super) struct Lights<'a> {
    pub(super) scene: &'a Scene,
    smooth: &'a Smooth,
    pub(super) lamps: Lamps,
    /// By face, how far away it is close [m].
    close: Vec<f32>,
}

/// The irradiance in the middle of each pixel.
pub(super) struct Field {
    size: [usize; 2],
    pixels: Vec<PixelFeatures>,
    irradiance: Vec<Vec3>,
}

/// What filters know of a pixel.
#[derive(Clone, Copy, Default)]
pub(super) struct PixelFeatures {
    pub(super) place: Vec3,
    /// Of the side in sight; 0 where no light is wanted.
    pub(super) normal: Vec3,
    /// The surface that the place is on.
    pub(super) surface: u32,
    /// What lamps without area bring, which has no noise.
    pub(super) direct: Vec3,
    /// The mean distance to what surrounds it, in the sense of Ward et al. [m].
    pub(super) reach: f32,
    /// How wide the pixel is there, across the direction of view [m].
    pub(super) width: f32,
}

impl PixelFeatures {
    /// What is known before rays are traced.
    fn of(spot: &Spot, lights: &Lights, camera: &Camera) -> Self {
        if spot.piece().is_none_or(|piece| lights.lamps.has(piece)) {
            return PixelFeatures::default();
        }
        let surface = &lights.scene.surfaces()[spot.surface as usize];
        let (place, normal) = (surface.point(spot.uv()), surface.normal() * spot.side.sign());
        PixelFeatures {
            place: place.as_vec3(),
            normal: normal.as_vec3(),
            surface: spot.surface,
            direct: lights.straight(place, normal, spot.surface).as_vec3(),
            reach: 0.0,
            width: camera.width_of_pixel(place) as f32,
        }
    }

    /// Whether two pixels show one surface.
    pub(super) fn goes_on(&self, other: &PixelFeatures) -> bool {
        let is_same = self.surface == other.surface && self.normal == other.normal;
        is_same || is_one_surface(other.place - self.place, self.normal, other.normal)
    }
}

/// Light of one kind in a pixel.
#[derive(Clone, Copy, Default)]
pub(super) struct Noisy {
    pub(super) light: Vec3,
    /// Of the mean of the channels.
    pub(super) variance: f32,
}

/// Samples of all pixels together after a run of this number of rays; `None` where that was a trial.
pub(super) fn samples(rays_of_run: u64, pixels: usize) -> Option<u64> {
    let (pixels, of_run) = (pixels as u64, rays_of_run / RUN_PER_PICTURE / u64::from(1 + SHADOWS));
    (PIXELS_PER_RAY * rays_of_run >= pixels).then_some(of_run.max(LEAST_SAMPLES * pixels))
}

impl Field {
    /// The irradiance behind the middle of each pixel by some samples in all.
    pub(super) fn new(lights: &Lights, sights: &Sights, samples: u64) -> Self {
        let Sights { camera, spots, .. } = sights;
        let size = camera.size.map(|side| side as usize);
        let rows = on_all_cores(size[1], |y| {
            let spots = &spots[y * size[0]..][..size[0]];
            spots.iter().map(|spot| PixelFeatures::of(spot, lights, camera)).collect::<Vec<_>>()
        });
        let mut pixels = rows.concat();
        let links = PixelLinks::new(&pixels, size, |pixel, axis| sights.are_parted(pixel, axis));
        let counts = counts(&links, samples);
        let traced = traced(lights, camera, spots, (&counts, &links));
        pixels.iter_mut().zip(&traced).for_each(|(pixel, sample)| pixel.reach = 1.0 / sample.near);
        even_reach(&mut pixels, &links);
        let gathered = traced.iter().map(|sample| sample.gathered).collect();
        let gathered = even_noise(&even_gathered(&pixels, gathered, &links, &counts), &links, &counts);
        let by_lamps: Vec<Noisy> = traced.iter().map(|sample| sample.lamps).collect();
        let by_lamps = even_noise(&by_lamps, &links, &counts);
        let filtered = gathered.iter().zip(&by_lamps).map(|(a, b)| a.light + b.light).collect();
        let unfiltered: Vec<Vec3> =
            traced.iter().map(|sample| sample.gathered.light + sample.lamps.light).collect();
        let noisy = give_back(filtered, &unfiltered, &links);
        let straight = pixels.iter().map(|pixel| pixel.direct);
        let irradiance = noisy.into_iter().zip(straight).map(|(noisy, straight)| noisy + straight).collect();
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

/// Samples of each pixel, of some in all: the fewer pixels show the same surface around it, the more.
fn counts(links: &PixelLinks, samples: u64) -> Vec<u8> {
    let alike = links.alike();
    let mut pixels_of = vec![0; 1 + alike.iter().max().map_or(0, |most| *most as usize)];
    alike.iter().for_each(|&alike| pixels_of[alike as usize] += 1);
    // Twice as many pixels are two entries of the table.
    let count = |level: usize, alike: usize| SAMPLES[level.saturating_sub(2 * alike).min(SAMPLES.len() - 1)];
    let sum = |level: usize| -> u64 {
        pixels_of.iter().enumerate().map(|(alike, pixels)| pixels * u64::from(count(level, alike))).sum()
    };
    let most = 2 * pixels_of.len() + SAMPLES.len();
    let level = (0..most).rev().find(|&level| sum(level) <= samples).unwrap_or(0);
    alike.iter().map(|&alike| count(level, alike as usize)).collect()
}

/// The light of all pixels by their rays.
fn traced(
    lights: &Lights,
    camera: &Camera,
    spots: &[Spot],
    (counts, links): (&[u8], &PixelLinks),
) -> Vec<PixelLight> {
    let [width, height] = camera.size.map(|side| side as usize);
    let bands = on_all_cores(height.div_ceil(TILE), |band| {
        let mut tracer = Tracer::new(lights, camera);
        let rows = band * TILE..((band + 1) * TILE).min(height);
        let mut samples = vec![PixelLight::default(); rows.len() * width];
        for left in (0..width).step_by(TILE) {
            let columns = left..(left + TILE).min(width);
            let pixels = || rows.clone().flat_map(|y| columns.clone().map(move |x| [x, y]));
            let task = |[x, y]: [usize; 2]| PixelTask {
                pixel: [x as u32, y as u32],
                spot: spots[y * width + x],
                samples: counts[y * width + x].into(),
                is_at_edge: links.is_at_edge(y * width + x),
            };
            let tasks: Vec<PixelTask> = pixels().map(task).collect();
            for ([x, y], sample) in pixels().zip(tracer.trace(&tasks)) {
                samples[(y - rows.start) * width + x] = sample;
            }
        }
        samples
    });
    bands.concat()
}

/// Whether two places are on one surface to the eye: given the way from one to the other, and their normals. A chord is as far off a surface as that
/// turns on its way; what is in front of a wall and parallel to it is another surface.
fn is_one_surface(way: Vec3, normal: Vec3, other: Vec3) -> bool {
    let cosine = normal.dot(other);
    let turn = 2.0 * (1.0 - cosine).max(0.0);
    let off = (turn + SAME_PLANE * SAME_PLANE).min(SAME_CURVE * SAME_CURVE);
    cosine >= SAME_NORMAL && way.dot(normal).powi(2) <= off * way.length_squared()
}

impl<'a> Lights<'a> {
    /// What lights a scene, given the radiosity at the corners of its pieces and that of its faces.
    pub(super) fn new(scene: &'a Scene, smooth: &'a Smooth, radiosity: &[f64]) -> Self {
        let close = scene.faces().iter().map(|face| CLOSE * face.area.sqrt() as f32).collect();
        Lights { scene, smooth, lamps: Lamps::new(scene, radiosity), close }
    }

    /// B of a piece at a place.
    pub(super) fn radiosity(&self, piece: u32, uv: [f64; 2]) -> DVec3 {
        self.smooth.at(piece, self.scene.faces().corner_weights(piece, uv)).into()
    }

    /// B of a piece that irradiance falls on.
    pub(super) fn reflected(&self, piece: u32, irradiance: DVec3) -> DVec3 {
        left(&self.scene.faces().piece(piece), irradiance.to_array()).into()
    }

    /// Whether light on a piece at a distance may change much within its face as seen from there.
    pub(super) fn is_close(&self, piece: u32, distance: f64) -> bool {
        distance < f64::from(self.close[self.scene.faces().face_of(piece) as usize])
    }

    /// The irradiance that lamps without area bring straight to a point of a surface.
    pub(super) fn straight(&self, place: DVec3, normal: DVec3, surface: u32) -> DVec3 {
        self.scene.lamps_at(place, normal, surface).into()
    }
}

/// B = E + ϱH of a face [W/m²].
pub(super) fn left(face: &Face, irradiance: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| face.emittance[c] + face.reflectance[c] * irradiance[c])
}

#[cfg(test)]
mod tests {
    use job::View;
    use radiosity::{IndexChoice, SceneSpec, Side, SurfaceSpec};

    use super::*;
    use crate::scenes::{cube_spec, quad};

    /// What a camera in front of a scene sees.
    fn seen(scene: &Scene) -> Sights {
        let camera = Camera::of_view(scene, &View { size: Some([96, 72]), ..View::default() }, |_| true);
        Sights::new(camera, scene, true)
    }

    /// A box on the floor of the unit cube whose sides reflect outwards: below it there is no light.
    fn box_on_floor() -> Vec<SurfaceSpec> {
        let (a, b, top) = (0.33, 0.65, 0.3);
        let sides = [
            [[a, a, top], [b, a, top], [a, b, top]],
            [[a, a, 0.0], [a, a, top], [a, b, 0.0]],
            [[b, a, 0.0], [b, b, 0.0], [b, a, top]],
            [[a, a, 0.0], [b, a, 0.0], [a, a, top]],
            [[a, b, 0.0], [a, b, top], [b, b, 0.0]],
        ];
        sides.map(|corners| quad("box", corners, [1, 1], 0.5)).into()
    }

    /// In a furnace, whose faces have E = 1 − ϱ, light is 1 everywhere, whether rays end in the solution or are gathered on from close by, and
    /// in pixels of the floor that a box stands in a part of.
    #[test]
    fn a_furnace_is_even() {
        let mut spec: SceneSpec = cube_spec();
        spec.surfaces.extend(box_on_floor());
        spec.surfaces.iter_mut().for_each(|surface| {
            (surface.reflectance, surface.emittance) = (0.6.into(), 0.4.into());
            surface.cell_emittance.clear();
        });
        let scene = Scene::build(&spec, IndexChoice::Auto).unwrap();
        let sights = seen(&scene);
        let spots = &sights.spots;
        let smooth = Smooth::even(&scene, 1.0);
        let lights = Lights::new(&scene, &smooth, &vec![1.0; scene.faces().len()]);
        assert!(lights.is_close(0, 0.9 * scene.faces().get(0).area.sqrt()));
        let field = Field::new(&lights, &sights, 8 * spots.len() as u64);
        let lit = spots.iter().enumerate().filter(|(_, spot)| spot.piece().is_some());
        let mut worst = 0.0_f64;
        lit.for_each(|(pixel, _)| worst = worst.max((field.of_pixel(pixel)[0] - 1.0).abs()));
        assert!(worst < 1e-5, "{worst}");
    }

    /// What is close is lit by rays from there, and not by the solution: a cube whose solution is off by a half is nearer to the truth where a wall is near.
    #[test]
    fn close_places_do_not_show_the_solution() {
        let mut spec: SceneSpec = cube_spec();
        spec.surfaces.iter_mut().for_each(|surface| {
            (surface.reflectance, surface.emittance) = (0.5.into(), 0.5.into());
            surface.cell_emittance.clear();
        });
        let scene = Scene::build(&spec, IndexChoice::Auto).unwrap();
        let smooth = Smooth::even(&scene, 0.5);
        let lights = Lights::new(&scene, &smooth, &vec![0.5; scene.faces().len()]);
        let sights = seen(&scene);
        let spots = &sights.spots;
        let field = Field::new(&lights, &sights, 32 * spots.len() as u64);
        let irradiance = |pixel: usize| field.of_pixel(pixel)[0];
        let lit = (0..spots.len()).filter(|&pixel| spots[pixel].piece().is_some());
        let (least, most) = lit.fold((1.0_f64, 0.0_f64), |(least, most), pixel| {
            (least.min(irradiance(pixel)), most.max(irradiance(pixel)))
        });
        // Far from all walls 0.5; beside one, which then is half of all that is seen, up to E + ϱ · 0.5 = 0.75 of that half.
        assert!((0.499..0.56).contains(&least) && (0.6..0.7501).contains(&most), "{least} {most}");
    }

    /// A short run has the samples that a picture needs, a long one a fifth of its rays, and a trial none.
    #[test]
    fn a_picture_has_a_part_of_the_run_or_what_it_needs() {
        let pixels = 400_000;
        assert_eq!(samples(199_999, pixels), None);
        assert_eq!(samples(200_000, pixels), Some(LEAST_SAMPLES * 400_000));
        assert_eq!(samples(150_000_000, pixels), Some(10_000_000));
    }

    /// Pixels at edges have more samples than those amid a wall, and all together no more than there are.
    #[test]
    fn edges_have_more_samples() {
        let scene = Scene::build(&cube_spec(), IndexChoice::Auto).unwrap();
        let sights = seen(&scene);
        let spots = &sights.spots;
        let smooth = Smooth::even(&scene, 1.0);
        let lights = Lights::new(&scene, &smooth, &vec![1.0; scene.faces().len()]);
        let pixels: Vec<PixelFeatures> =
            spots.iter().map(|spot| PixelFeatures::of(spot, &lights, &sights.camera)).collect();
        let links = PixelLinks::new(&pixels, [96, 72], |_, _| false);
        for each in [6, 12] {
            let budget = each * spots.len() as u64;
            let counts = counts(&links, budget);
            let all: u64 = counts.iter().map(|count| u64::from(*count)).sum();
            assert!(all <= budget && 2 * all > budget, "{all} of {budget}");
            let is_edge = |pixel: &usize| {
                let side = |pixel: usize| -> (u32, Side) { (spots[pixel].surface, spots[pixel].side) };
                pixel % 96 < 95 && side(*pixel) != side(pixel + 1)
            };
            let mean = |edge: bool| {
                let of = (0..spots.len())
                    .filter(|pixel| spots[*pixel].piece().is_some() && is_edge(pixel) == edge);
                let of: Vec<f64> = of.map(|pixel| counts[pixel].into()).collect();
                of.iter().sum::<f64>() / of.len() as f64
            };
            assert!(mean(true) > 1.2 * mean(false), "{} {}", mean(true), mean(false));
        }
    }
}
