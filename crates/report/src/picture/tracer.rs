//! The rays of pixels.

use glam::DVec3;
use radiosity::{
    Side,
    rays::{Hit, Lookout, Ray},
    surfaces::Surface,
};

use super::field::{Lights, Noisy};
use super::lamps::{Aim, Odds, SHADOWS};
use super::numbers::{Use, point, unit, z_order};
use super::spot::Spot;
use crate::camera::Camera;

/// Light in a pixel by its rays.
#[derive(Clone, Default)]
pub(super) struct PixelLight {
    pub(super) lamps: Noisy,
    pub(super) gathered: Noisy,
    /// The inverse of the mean distance to what surrounds it, in the sense of Ward et al. [1/m].
    pub(super) near: f32,
}

/// A pixel whose rays are to be traced.
#[derive(Clone, Copy)]
pub(super) struct PixelTask {
    pub(super) pixel: [u32; 2],
    pub(super) spot: Spot,
    /// How many samples are taken.
    pub(super) samples: u32,
    /// Whether other surfaces may be in sight in a part of the pixel.
    pub(super) is_at_edge: bool,
}

/// A point whose irradiance is sampled.
#[derive(Clone, Copy)]
struct ShadingPoint {
    place: DVec3,
    normal: DVec3,
    surface: u32,
    side: Side,
    /// The point whose odds of lamps it takes, which lies on the same side of the same surface.
    odds: usize,
}

/// A ray on its way from a point.
struct PendingRay {
    point: usize,
    /// The number of its sample.
    index: u32,
    /// The place on a lamp that it aims at; `None` for a ray that gathers.
    aim: Option<Aim>,
}

/// What a ray meets.
enum RayOutcome {
    /// The irradiance by lamps that it brings.
    Lamp(DVec3),
    /// A piece that is no lamp, and the part of its light that arrives.
    Piece(u32, f64),
    /// Nothing that sends light.
    Dark,
}

/// The numbers that the rays of a point are aimed by.
struct NumberUses {
    direction: Use,
    lamp: Use,
    on_lamps: [Use; 2],
}

const OF_PIXELS: NumberUses =
    NumberUses { direction: Use::Direction, lamp: Use::Lamp, on_lamps: [Use::OnLamp, Use::OnSecond] };
const OF_HITS: NumberUses = NumberUses {
    direction: Use::NextDirection,
    lamp: Use::NextLamp,
    on_lamps: [Use::OnNextLamp, Use::OnNextSecond],
};

/// The sum of what rays bring, and of the squares of the mean of its channels.
#[derive(Clone, Copy, Default)]
struct Brought {
    light: DVec3,
    squares: f64,
}

/// Sums over the samples of a pixel.
#[derive(Clone, Copy, Default)]
struct PixelSums {
    lamps: Brought,
    gathered: Brought,
    /// Of inverse distances [1/m].
    near: f64,
}

/// A place close by that a ray has met: what it reflects is sampled there, since it changes within a patch.
struct Close {
    pixel: usize,
    index: u32,
    piece: u32,
    /// The part of its light that arrives.
    part: f64,
    point: ShadingPoint,
}

/// Traces the rays of pixels.
pub(super) struct Tracer<'a> {
    lights: &'a Lights<'a>,
    camera: &'a Camera,
    lookout: Lookout<'a>,
    odds: Odds,
    /// The point that the odds are of.
    odds_of: usize,
    rays: Vec<Ray>,
    errands: Vec<PendingRay>,
}

impl<'a> Tracer<'a> {
    pub(super) fn new(lights: &'a Lights, camera: &'a Camera) -> Self {
        let (lookout, odds) = (Lookout::new(lights.scene), Odds::of(&lights.lamps));
        let (rays, errands) = (Vec::new(), Vec::new());
        Tracer { lights, camera, lookout, odds, odds_of: usize::MAX, rays, errands }
    }

    /// The light of some pixels beside each other, in their order.
    pub(super) fn trace(&mut self, tasks: &[PixelTask]) -> Vec<PixelLight> {
        let points = self.points(tasks);
        for (number, (point, task)) in points.iter().zip(tasks).enumerate() {
            if let Some(point) = point {
                self.look_from(point.odds, &points);
                self.aim_from_pixel(number, point, task);
            }
        }
        let (sums, close) = self.gather(&points);
        let sums = self.gather_on(sums, close);
        sums.iter().zip(tasks).map(|(sums, task)| sums.sample(task.samples)).collect()
    }

    /// What is seen in the middle of pixels; `None` where no light is wanted. Points on one side of a surface share their odds.
    fn points(&self, tasks: &[PixelTask]) -> Vec<Option<ShadingPoint>> {
        let scene = self.lights.scene;
        let mut points: Vec<Option<ShadingPoint>> = Vec::with_capacity(tasks.len());
        let mut firsts: Vec<(u32, Side, usize)> = Vec::new();
        for (number, PixelTask { spot, .. }) in tasks.iter().enumerate() {
            let wanted = spot.piece().filter(|piece| !self.lights.lamps.has(*piece));
            points.push(wanted.map(|_| {
                let surface = &scene.surfaces()[spot.surface as usize];
                let (place, normal) = (surface.point(spot.uv()), surface.normal() * spot.side.sign());
                let same = firsts.iter().find(|first| (first.0, first.1) == (spot.surface, spot.side));
                let odds = same.map_or(number, |first| first.2);
                if odds == number {
                    firsts.push((spot.surface, spot.side, number));
                }
                ShadingPoint { place, normal, surface: spot.surface, side: spot.side, odds }
            }));
        }
        points
    }

    /// Aims the rays of a pixel, from places all over it.
    fn aim_from_pixel(&mut self, number: usize, point: &ShadingPoint, task: &PixelTask) {
        let surface = &self.lights.scene.surfaces()[point.surface as usize];
        let [x, y] = task.pixel.map(f64::from);
        let first = z_order(task.pixel).wrapping_mul(task.samples);
        let indices = || (0..task.samples).map(|k| first.wrapping_add(k));
        let within = indices().map(|index| {
            let [across, down] = numbers_of(index, Use::Place);
            [x + across, y + down]
        });
        let within: Vec<[f64; 2]> = within.collect();
        let places =
            if task.is_at_edge { self.in_sight(task, &within) } else { self.on_plane(surface, &within) };
        for (index, uv) in indices().zip(places) {
            let place = uv.map_or(point.place, |uv| surface.point(surface.inside(uv)));
            self.aim(number, &ShadingPoint { place, ..*point }, index, &OF_PIXELS);
        }
    }

    /// Places on a surface behind some points of the picture, in its coordinates; `None` beyond its outline.
    fn on_plane(&self, surface: &Surface, points: &[[f64; 2]]) -> Vec<Option<[f64; 2]>> {
        points.iter().map(|&point| self.camera.on_plane(surface, point)).collect()
    }

    /// As many places of a pixel on the surface in its middle as there are points in it: those behind points that show it. Where other things stand
    /// in front of it, a floor under furniture, say, it has other light, or none.
    fn in_sight(&self, task: &PixelTask, points: &[[f64; 2]]) -> Vec<Option<[f64; 2]>> {
        let spots = Spot::seen_by(self.camera, self.lights.scene, points);
        let seen: Vec<[f64; 2]> =
            spots.iter().filter(|spot| spot.is_beside(&task.spot)).map(Spot::uv).collect();
        (0..points.len()).map(|k| seen.get(k % seen.len().max(1)).copied()).collect()
    }

    /// Takes the odds of another point.
    fn look_from(&mut self, of: usize, points: &[Option<ShadingPoint>]) {
        if self.odds_of != of {
            let point = points[of].as_ref().expect("only points are looked from");
            self.odds.look_from(point.place, point.normal);
            self.odds_of = of;
        }
    }

    /// Aims a ray that gathers, and those to lamps, by the odds at hand.
    fn aim(&mut self, number: usize, from: &ShadingPoint, index: u32, numbers: &NumberUses) {
        let (scene, lamps) = (self.lights.scene, &self.lights.lamps);
        let [polar, turn] = point(index, numbers.direction);
        let bits = u64::from(polar) << 32 | u64::from(turn);
        let direction = scene.surfaces()[from.surface as usize].direction(from.side, bits);
        self.rays.push(Ray { origin: from.place, direction, from: from.surface });
        self.errands.push(PendingRay { point: number, index, aim: None });
        if lamps.is_empty() {
            return;
        }
        for (choice, on) in point(index, numbers.lamp).into_iter().zip(numbers.on_lamps) {
            let place = numbers_of(index, on);
            if let Some(aim) = lamps.aim(scene, &mut self.odds, from.place, unit(choice), place) {
                self.rays.push(Ray { origin: from.place, direction: aim.direction, from: from.surface });
                self.errands.push(PendingRay { point: number, index, aim: Some(aim) });
            }
        }
    }

    /// Traces the rays of pixels, and says which places that they met are close.
    fn gather(&mut self, points: &[Option<ShadingPoint>]) -> (Vec<PixelSums>, Vec<Close>) {
        let (lights, mut close) = (self.lights, Vec::new());
        let mut sums = vec![PixelSums::default(); points.len()];
        self.follow(points, |errand, hit, found| {
            let sum = &mut sums[errand.point];
            if errand.aim.is_none() {
                sum.near += 1.0 / hit.t.max(f64::MIN_POSITIVE);
            }
            match found {
                RayOutcome::Lamp(light) => sum.lamps.add(light),
                RayOutcome::Piece(piece, part) if lights.is_close(piece, hit.t) => {
                    let surface = &lights.scene.surfaces()[hit.surface as usize];
                    let point = ShadingPoint {
                        place: surface.point(hit.uv),
                        normal: surface.normal() * hit.side.sign(),
                        surface: hit.surface,
                        side: hit.side,
                        odds: 0,
                    };
                    close.push(Close { pixel: errand.point, index: errand.index, piece, part, point });
                }
                RayOutcome::Piece(piece, part) => sum.gathered.add(part * lights.radiosity(piece, hit.uv)),
                RayOutcome::Dark => {}
            }
        });
        (sums, close)
    }

    /// Adds what close places reflect, each by rays from there, which end in the solution.
    fn gather_on(&mut self, mut sums: Vec<PixelSums>, mut close: Vec<Close>) -> Vec<PixelSums> {
        let lights = self.lights;
        // Places on one piece share their odds, and come one after the other.
        close.sort_by_key(|close| close.piece);
        for number in 1..close.len() {
            let is_same = close[number].piece == close[number - 1].piece;
            close[number].point.odds = if is_same { close[number - 1].point.odds } else { number };
        }
        if let Some(first) = close.first_mut() {
            first.point.odds = 0;
        }
        let points: Vec<Option<ShadingPoint>> = close.iter().map(|close| Some(close.point)).collect();
        for (number, Close { index, point, .. }) in close.iter().enumerate() {
            self.look_from(point.odds, &points);
            self.aim(number, point, *index, &OF_HITS);
        }
        let mut irradiance: Vec<DVec3> = close
            .iter()
            .map(|close| lights.straight(close.point.place, close.point.normal, close.point.surface))
            .collect();
        self.follow(&points, |errand, hit, found| match found {
            RayOutcome::Lamp(light) => irradiance[errand.point] += light,
            RayOutcome::Piece(piece, part) => {
                irradiance[errand.point] += part * lights.radiosity(piece, hit.uv)
            }
            RayOutcome::Dark => {}
        });
        for (close, irradiance) in close.iter().zip(irradiance) {
            sums[close.pixel].gathered.add(close.part * lights.reflected(close.piece, irradiance));
        }
        sums
    }

    /// Traces the rays that are aimed from some points, and hands on in order what each of them has met.
    fn follow(
        &mut self,
        points: &[Option<ShadingPoint>],
        mut see: impl FnMut(&PendingRay, &Hit, RayOutcome),
    ) {
        let (scene, lights) = (self.lights.scene, self.lights);
        let (rays, errands) = (std::mem::take(&mut self.rays), std::mem::take(&mut self.errands));
        let (odds, mut odds_of) = (&mut self.odds, usize::MAX);
        self.lookout.each_closest_hit(&rays, |number, hit| {
            let Some(hit) = hit else { return };
            let (ray, errand) = (&rays[number], &errands[number]);
            let surface = &scene.surfaces()[hit.surface as usize];
            let piece = || surface.piece(surface.cell_at(hit.uv), hit.side);
            let passed = || scene.passed_panes(ray, hit.t);
            let found = match &errand.aim {
                Some(aim) if (aim.surface, aim.side) != (hit.surface, hit.side) => RayOutcome::Dark,
                Some(aim) => RayOutcome::Lamp(passed() * aim.weight * lights.radiosity(piece(), hit.uv)),
                None if !surface.is_active(hit.side) => RayOutcome::Dark,
                None if !lights.lamps.has(piece()) => RayOutcome::Piece(piece(), passed()),
                None => {
                    let of = points[errand.point].as_ref().map_or(errand.point, |point| point.odds);
                    if std::mem::replace(&mut odds_of, of) != of {
                        let from = points[of].as_ref().expect("only points are looked from");
                        odds.look_from(from.place, from.normal);
                    }
                    let weight = lights.lamps.met(scene, odds, piece(), ray.direction, hit.t);
                    RayOutcome::Lamp(passed() * weight * lights.radiosity(piece(), hit.uv))
                }
            };
            see(errand, &hit, found);
        });
        self.odds_of = usize::MAX;
        (self.rays, self.errands) = (rays, errands);
        self.rays.clear();
        self.errands.clear();
    }
}

impl Brought {
    fn add(&mut self, light: DVec3) {
        self.light += light;
        self.squares += (light.element_sum() / 3.0).powi(2);
    }

    /// The mean over samples of a number of rays each.
    fn mean(&self, samples: f64, rays: u32) -> Noisy {
        let (light, all) = (self.light / samples, samples * f64::from(rays));
        let variance =
            (self.squares / (samples * samples) - (light.element_sum() / 3.0).powi(2) / all).max(0.0) * all
                / (all - 1.0);
        Noisy { light: light.as_vec3(), variance: variance as f32 }
    }
}

impl PixelSums {
    /// The light of a pixel from the sums over its samples.
    fn sample(&self, samples: u32) -> PixelLight {
        let count = f64::from(samples);
        PixelLight {
            lamps: self.lamps.mean(count, 1 + SHADOWS),
            gathered: self.gathered.mean(count, 1),
            near: (self.near / count) as f32,
        }
    }
}

/// Two numbers in (0, 1).
fn numbers_of(index: u32, of: Use) -> [f64; 2] {
    point(index, of).map(unit)
}
