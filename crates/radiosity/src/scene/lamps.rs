//! Lamps without area: births of walks at them, and the light that comes from them straight to a point.
//!
//! Coordinates are those of the scene, whose origin is the middle of its box.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use photometry::{Distribution, LuminousOpening};

use super::cones::LightCones;
use super::tables::{LampRays, LightTables};
use super::{Scene, SceneError};
use crate::geometry::lamp::{Emission, LampsSpec};
use crate::geometry::sensor::Response;
use crate::geometry::spec::Spectrum;
use crate::simd::batch::WIDTH;
use crate::simd::isa::Isa;
use crate::trace::ray::Ray;

/// How far within the box that stands for the sky the light of distant lamps sets out, in halves of its diagonal: farther out than all that the
/// sky is around, which is 0.018 of its diagonal away.
const WITHIN_SKY: f64 = 0.01;

/// How many slacks a lamp hangs in front of the plane that it is written in, on the side that it is aimed at.
const LIFT: f64 = 4.0;

/// The lamps of a scene.
#[derive(Clone, Debug, Default)]
pub(crate) struct PointLamps {
    tables: Vec<Distribution>,
    /// The same tables, as births need them; `None` where no lamp has one.
    births: Option<Box<LightTables>>,
    /// The cones of lamps without a table, as births need them; `None` where all have one.
    cones: Option<Box<LightCones>>,
    list: Vec<PointLamp>,
    /// Whether the last six surfaces stand for the sky, which is nearer than distant lamps and hides none.
    pub(super) has_sky: bool,
}

#[derive(Clone, Debug)]
struct PointLamp {
    position: DVec3,
    axes: [DVec3; 3],
    emission: Emission,
    strength: Spectrum,
    opening: LuminousOpening,
    /// The flux of a lamp of strength 1 [W, or lm].
    flux: f64,
    /// How far in front of the place that was written it hangs [m].
    lift: f64,
}

impl PointLamp {
    /// A direction of the lamp's frame in the scene.
    fn in_scene(&self, d: DVec3) -> DVec3 {
        self.axes[0] * d.x + self.axes[1] * d.y + self.axes[2] * d.z
    }

    /// What births at the lamp's table need of it: the table's number, the lamp's position, and the axes of the table in the scene.
    fn for_tables(&self, tables: &[Distribution]) -> (Option<u32>, [f64; 12]) {
        match self.emission {
            Emission::Table(number) => {
                let axes = tables[number as usize].axes().map(|axis| self.in_scene(axis));
                (Some(number), numbers(self.position, axes))
            }
            _ => (None, numbers(self.position, self.axes)),
        }
    }

    /// What births in the lamp's cone need of it. The light of a distant lamp comes through a disc with the radius `reach` of a ball around the
    /// scene [m].
    fn for_cones(&self, reach: f64) -> (Emission, [f64; 12]) {
        let origin = match self.emission {
            Emission::Distant { .. } => DVec3::splat(reach),
            _ => self.position,
        };
        (self.emission, numbers(origin, self.axes))
    }
}

/// A point and three axes, number by number.
fn numbers(origin: DVec3, [x, y, z]: [DVec3; 3]) -> [f64; 12] {
    let vectors = [origin, x, y, z].map(|vector| vector.to_array());
    std::array::from_fn(|i| vectors.as_flattened()[i])
}

/// Light on its way from a lamp to a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Beam {
    /// The direction from the point to the lamp, of length 1.
    pub(crate) towards: DVec3,
    /// The distance of the lamp [m]; infinite where it is distant.
    pub(crate) distance: f64,
    /// The irradiance at the point of a plane across the beam [W/m², or lx], channel by channel.
    pub(crate) irradiance: [f64; 3],
}

/// The luminous opening of a lamp as it is seen from a place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SeenOpening {
    /// The direction to the lamp, of length 1.
    pub(crate) towards: DVec3,
    /// The distance of the lamp [m].
    pub(crate) distance: f64,
    /// The area across that direction [m²].
    pub(crate) area: f64,
}

impl PointLamps {
    /// The lamps of a scene whose box has these corners and stands for the sky or not, and whose facets are larger than their surfaces by
    /// `slack` [m].
    pub(super) fn new(
        spec: &LampsSpec,
        ([min, max], has_sky): ([DVec3; 2], bool),
        slack: f64,
    ) -> Result<Self, SceneError> {
        let (origin, reach) = (0.5 * (min + max), 0.5 * (max - min).length() * (1.0 + 1e-9));
        let mut lamps = PointLamps { tables: spec.tables.clone(), has_sky, ..PointLamps::default() };
        for lamp in &spec.list {
            if let Some(fault) = lamp.fault(spec.tables.len()) {
                return Err(SceneError::Whole(format!(
                    "lamp {:?}: {fault}; correct its keys, or remove it",
                    lamp.name
                )));
            }
            let flux = match lamp.emission {
                Emission::Table(number) => spec.tables[number as usize].flux(),
                Emission::Uniform => 2.0 * TAU,
                Emission::Spot { inner, outer } => TAU * (1.0 - inner + (inner - outer) / 3.0),
                Emission::Distant { .. } => PI * reach * reach,
            };
            let (position, axes) = (lamp.position - origin, lamp.axes);
            let lift = LIFT * slack.max(position.abs().max_element() / (1_u64 << 46) as f64);
            let position = position - axes[2] * lift;
            let (emission, strength) = (lamp.emission, lamp.strength);
            let opening = match emission {
                Emission::Table(number) => spec.openings.get(number as usize).copied(),
                _ => None,
            };
            let opening = opening.unwrap_or(LuminousOpening::Point);
            lamps.list.push(PointLamp { position, axes, emission, strength, opening, flux, lift });
        }
        if (0..lamps.len()).any(|lamp| lamps.has_table(lamp)) {
            let of_lamps = lamps.list.iter().map(|lamp| lamp.for_tables(&spec.tables));
            lamps.births = LightTables::new(&spec.tables, of_lamps).map(Box::new);
        }
        let half = 0.5 * (max - min) - DVec3::splat(WITHIN_SKY * reach);
        let room = has_sky.then(|| [-half, half].map(|corner| corner.to_array()));
        let of_lamps = lamps.list.iter().map(|lamp| lamp.for_cones(reach));
        lamps.cones = LightCones::new(of_lamps, room).map(Box::new);
        Ok(lamps)
    }

    /// The largest coordinate of a birth [m]: those of distant lamps set out from discs three times as far out as the scene reaches, or in its box.
    pub(super) fn farthest_birth(&self) -> f64 {
        let farthest = |lamp: &PointLamp| match lamp.emission {
            Emission::Distant { .. } => 3.0 * (lamp.flux / PI).sqrt(),
            _ => lamp.position.abs().max_element(),
        };
        self.list.iter().map(farthest).fold(0.0, f64::max)
    }

    pub(crate) fn len(&self) -> usize {
        self.list.len()
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// What the lamps take of memory [bytes].
    pub(crate) fn bytes(&self) -> usize {
        let tables = self.tables.iter().map(|table| size_of::<f64>() * table.numbers().count());
        size_of_val(&self.list[..])
            + tables.sum::<usize>()
            + self.births.as_ref().map_or(0, |births| births.bytes())
            + self.cones.as_ref().map_or(0, |cones| cones.bytes())
    }

    /// The power of a lamp in one channel [W, or lm].
    pub(crate) fn power(&self, lamp: usize, channel: usize) -> f64 {
        self.list[lamp].flux * self.list[lamp].strength[channel]
    }

    /// The tables of lamps; `None` where none has a table.
    pub(crate) fn tables(&self) -> Option<&LightTables> {
        self.births.as_deref()
    }

    /// The cones of lamps; `None` where all have tables.
    pub(crate) fn cones(&self) -> Option<&LightCones> {
        self.cones.as_deref()
    }

    /// Whether the light of a lamp is that of a table.
    #[inline(always)]
    pub(crate) fn has_table(&self, lamp: usize) -> bool {
        matches!(self.list[lamp].emission, Emission::Table(_))
    }

    /// The rays of a batch of births, each made of three times 64 random bits, from number `from` on: those at lamps with tables before place
    /// `end`, and those at others from place `begin` on.
    pub(crate) fn bear(
        &self,
        isa: Isa,
        (lamps, bits): (&[u32; WIDTH], [&[u64; WIDTH]; 3]),
        [end, begin]: [usize; 2],
        (rays, from): (&mut LampRays, usize),
    ) {
        if let Some(tables) = self.tables() {
            tables.bear(isa, (lamps, end), bits, (&mut *rays, from));
        }
        if let Some(cones) = self.cones() {
            cones.bear(isa, (lamps, begin), bits, (rays, from));
        }
    }

    /// The ray with which a walk sets out from a lamp, made of three times 64 random bits: its density over directions, and over the
    /// disc of a distant lamp, is that of the light.
    pub(crate) fn birth(&self, lamp: usize, bits: [u64; 3]) -> Ray {
        let born = match self.has_table(lamp) {
            true => self.tables().map(|tables| tables.bear_one(lamp, bits)),
            false => self.cones().map(|cones| cones.bear_one(lamp, bits)),
        };
        let [x, y, z, dx, dy, dz] = born.expect("the tables and cones of all lamps are kept");
        Ray { origin: DVec3::new(x, y, z), direction: DVec3::new(dx, dy, dz), from: Ray::FREE }
    }

    /// The light of a lamp at a point, if nothing stands between. The random bits choose a place on the disc of a distant lamp, over which
    /// it is to be averaged; other lamps take no notice of them.
    pub(crate) fn beam(&self, lamp: usize, point: DVec3, bits: u64) -> Beam {
        let PointLamp { position, axes, emission, strength, .. } = &self.list[lamp];
        let beam = |towards: DVec3, distance: f64, per_strength: f64| Beam {
            towards,
            distance,
            irradiance: strength.channels().map(|strength| strength * per_strength),
        };
        if let (Emission::Distant { .. }, Some(cones)) = (emission, self.cones()) {
            return beam(-DVec3::from(cones.direction_of_distant(lamp, bits)), f64::INFINITY, 1.0);
        }
        let away = point - *position;
        let (square, distance) = (away.length_squared(), away.length());
        let d = DVec3::from_array(axes.map(|axis| axis.dot(away)));
        let intensity = match *emission {
            Emission::Table(number) => self.tables[number as usize].intensity(d),
            Emission::Uniform | Emission::Distant { .. } => 1.0,
            Emission::Spot { inner, outer } => {
                let part = ((-d.z / distance - outer) / (inner - outer)).clamp(0.0, 1.0);
                part * part
            }
        };
        if square == 0.0 {
            return beam(DVec3::Z, 0.0, 0.0);
        }
        beam(-away / distance, distance, intensity / square)
    }

    /// How the opening of a lamp looks from a place; `None` of a lamp that is distant.
    pub(crate) fn seen(&self, lamp: usize, place: DVec3) -> Option<SeenOpening> {
        let PointLamp { position, axes, emission, opening, .. } = &self.list[lamp];
        let (way, distance) = (*position - place, position.distance(place));
        if matches!(emission, Emission::Distant { .. }) || distance == 0.0 {
            return None;
        }
        let towards = way / distance;
        let area = opening.projected_area(DVec3::from_array(axes.map(|axis| axis.dot(towards))));
        Some(SeenOpening { towards, distance, area })
    }

    /// The distance of a lamp from a place [m]; infinite where it is distant.
    pub(crate) fn distance(&self, lamp: usize, place: DVec3) -> f64 {
        let PointLamp { position, emission, .. } = &self.list[lamp];
        if matches!(emission, Emission::Distant { .. }) { f64::INFINITY } else { position.distance(place) }
    }

    /// Whether the light of a lamp at a point comes from one direction, so that one shadow ray tells it exactly.
    pub(crate) fn is_sharp(&self, lamp: usize) -> bool {
        !matches!(self.list[lamp].emission, Emission::Distant { rim } if rim < 1.0)
    }

    /// Whether the plane through a point with this normal divides a lamp from a place. A plane that the lamp hangs in, but for rounding, divides it from
    /// nothing.
    fn is_divided(&self, lamp: usize, place: DVec3, (point, normal): (DVec3, DVec3)) -> bool {
        let PointLamp { position, lift, .. } = &self.list[lamp];
        let before = (*position - point).dot(normal);
        before.abs() > lift / 16.0 && before * (place - point).dot(normal) < 0.0
    }

    /// The most irradiance that all lamps together may bring, channel by channel; `per_intensity` is what a lamp of intensity 1 at a place
    /// brings at most [1/m²].
    pub(crate) fn most_irradiance(&self, per_intensity: impl Fn(DVec3) -> f64) -> [f64; 3] {
        let mut most = [0.0; 3];
        for PointLamp { position, emission, strength, .. } in &self.list {
            let peak = match *emission {
                Emission::Table(number) => self.tables[number as usize].peak(),
                Emission::Uniform | Emission::Spot { .. } => 1.0,
                Emission::Distant { .. } => {
                    most.iter_mut().zip(strength.channels()).for_each(|(most, s)| *most += s);
                    continue;
                }
            };
            let per_intensity = per_intensity(*position);
            let add = |s: f64| if s > 0.0 { s * peak * per_intensity } else { 0.0 };
            most.iter_mut().zip(strength.channels()).for_each(|(most, s)| *most += add(s));
        }
        most
    }
}

impl Scene {
    /// How many lamps without area there are.
    pub fn lamp_count(&self) -> usize {
        self.parts.lamps.len()
    }

    /// The power of a lamp without area in one channel [W, or lm].
    pub fn lamp_power(&self, lamp: usize, channel: usize) -> f64 {
        self.parts.lamps.power(lamp, channel)
    }

    /// The ray with which a walk sets out from a lamp without area, made of three times 64 random bits, the last of which are those of the
    /// direction.
    pub fn lamp_birth(&self, lamp: usize, bits: [u64; 3]) -> Ray {
        self.parts.lamps.birth(lamp, bits)
    }

    /// The irradiance that comes straight from lamps without area to a point, on the side that `normal` points to [W/m², or lx], lamp by
    /// lamp, exactly: by one shadow ray to each whose light comes from one direction; others bring nothing here. `from` is the surface that
    /// the point lies on, or [`Ray::FREE`]. Coordinates are relative to [`Scene::origin`].
    pub fn each_lamp_at(&self, point: DVec3, normal: DVec3, from: u32, see: impl FnMut(usize, [f64; 3])) {
        self.each_lamp_to(point, (Response::Flat { facing: normal }, from), see);
    }

    /// As [`Scene::each_lamp_at`], at a point that weighs light by a `response`.
    pub(crate) fn each_lamp_to(
        &self,
        point: DVec3,
        (response, from): (Response, u32),
        mut see: impl FnMut(usize, [f64; 3]),
    ) {
        let lamps = &self.parts.lamps;
        for lamp in (0..lamps.len()).filter(|&lamp| lamps.is_sharp(lamp)) {
            if let Some(light) = self.lamp_light(lamp, point, response, from, 0) {
                see(lamp, light);
            }
        }
    }

    /// The irradiance that all lamps without area bring straight to a point, as [`Scene::each_lamp_at`] has it; distant ones as if they were
    /// the middles of their discs.
    pub fn lamps_at(&self, point: DVec3, normal: DVec3, from: u32) -> [f64; 3] {
        let facing = Response::Flat { facing: normal };
        let lights = (0..self.lamp_count()).filter_map(|lamp| self.lamp_light(lamp, point, facing, from, 0));
        lights.fold([0.0; 3], |sum, light| std::array::from_fn(|c| sum[c] + light[c]))
    }

    /// The place of a lamp without area, and the direction of its aim, of length 1; `None` where it is distant. Coordinates are relative to
    /// [`Scene::origin`].
    pub fn lamp_place(&self, lamp: usize) -> Option<[DVec3; 2]> {
        let PointLamp { position, axes, emission, .. } = &self.parts.lamps.list[lamp];
        (!matches!(emission, Emission::Distant { .. })).then_some([*position, -axes[2]])
    }

    /// The irradiance that a lamp without area would bring to a point, on the side that `normal` points to, if nothing stood between
    /// [W/m², or lx]; of a distant one, that of the middle of its disc.
    pub fn lamp_unshaded(&self, lamp: usize, point: DVec3, normal: DVec3) -> [f64; 3] {
        let Beam { towards, irradiance, .. } = self.parts.lamps.beam(lamp, point, 0);
        irradiance.map(|e| e * towards.dot(normal).max(0.0))
    }

    /// What a lamp brings to a point; `None` where it lies behind or something stands between.
    pub(crate) fn lamp_light(
        &self,
        lamp: usize,
        origin: DVec3,
        response: Response,
        from: u32,
        bits: u64,
    ) -> Option<[f64; 3]> {
        let Beam { towards, distance, irradiance } = self.parts.lamps.beam(lamp, origin, bits);
        let weight = response.of(towards);
        if weight <= 0.0 || irradiance == [0.0; 3] {
            return None;
        }
        let ray = Ray { origin, direction: towards, from };
        let hit = self.closest_hit(&ray);
        let is_sky = |surface: u32| surface as usize >= self.surfaces_before_sky();
        // A lamp in the plane of a surface hangs just in front of it, so near that a ray from the front may meet the surface first; one from behind
        // does not pass.
        let divides = |surface: u32| {
            let surface = &self.surfaces()[surface as usize];
            self.parts.lamps.is_divided(lamp, origin, (surface.point([0.0; 2]), surface.normal()))
        };
        let is_free = hit.is_none_or(|hit| match distance.is_infinite() {
            true => is_sky(hit.surface),
            false => hit.t >= distance || hit.t >= distance * (1.0 - NEAR) && !divides(hit.surface),
        });
        let part = weight * self.passed_panes(&ray, distance);
        is_free.then(|| irradiance.map(|e| e * part))
    }
}

/// The part of its distance at the end of a shadow ray where nothing shades the lamp.
const NEAR: f64 = 1e-9;
