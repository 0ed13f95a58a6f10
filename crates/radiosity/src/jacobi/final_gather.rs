//! A final gather: rays from a few chosen faces, or from sensors, that bring in what a solution says of the faces they meet.
//!
//! H_i = Σ_j F_ij B_j, and a ray from face (or sensor cell) i meets face j with probability F_ij. What is known of B by other rays is
//! independent of these: the mean of what they bring is unbiased where the solution is, and its noise is averaged over all
//! that face i sees, of which a walk or a link tells by the few rays that happen to join i.
//!
//! Reflected light is gathered so. Light that comes straight from an emitter is a spike that few such rays would meet;
//! it is sampled by *shadow rays* to points of emitters as well, and both are combined by the balance heuristic (E. Veach
//! & L. J. Guibas, *Optimally combining sampling techniques for Monte Carlo rendering*, SIGGRAPH 1995). Its weights are
//! densities in closed form, not chosen by what was found, so that they cause no bias.

use glam::DVec3;

use crate::geometry::face::Face;
use crate::geometry::frame::Frames;
use crate::geometry::sensor::{Response, SensorCell, Sensors};
use crate::geometry::spec::Side;
use crate::geometry::spec::Sides;
use crate::geometry::surface::Surface;
use crate::jacobi::cast::systematic;
use crate::jacobi::faces::FaceTable;
use crate::jacobi::lamps::{emitted_shares, kernel, pieces_with_parts};
use crate::jacobi::numbers::RayNumbers;
use crate::jacobi::solid_angle::{FaceView, PointInView};
use crate::random::rng::{WalkRng, unit_32};
use crate::random::sobol::Points;
use crate::scene::Scene;
use crate::simd::batch::WIDTH;
use crate::trace::ray::{Hits, Ray, Rays};
use crate::trace::tree::Scratch;
use crate::walk::depart::Departures;

/// One in this many rays of a face is a shadow ray.
pub(crate) const SHADOW_SHARE: u64 = 4;

/// Shadow rays bring at most this part of the largest emittance: each counts at most as one gathering ray that meets it.
pub(crate) const LIGHT_BY_SHADOW_RAYS: f64 = 1.0 / (SHADOW_SHARE - 1) as f64;

/// The fewest rays of a face.
const FEWEST: u64 = 64;

/// The fewest rays of a cell of a sensor, of which there may be many.
const FEWEST_OF_CELL: u64 = 16;

/// What rays from one face, or one cell of a sensor, brought.
pub(crate) struct GatheredLight {
    /// The number of the face or the cell.
    pub(crate) face: u32,
    /// H [W/m²] of each channel; where sources are distinguished, of each source.
    pub(crate) irradiance: Vec<f64>,
    /// Rays that met an active side; shadow rays are not among them.
    pub(crate) landed: u64,
    pub(crate) rays: u64,
}

/// Whose light is whose, where sources are distinguished.
pub(crate) struct SourcesOfLight {
    pub(crate) count: usize,
    /// By face, and behind the faces by lamp without area.
    pub(crate) of_emitter: Vec<usize>,
}

/// Gathers H of the `chosen` faces by `rays` rays in all, given the `reflected` light of all faces, face-major and
/// channel-minor [W/m²]. `None` once `go_on`, which is asked for every batch, returns false.
pub(crate) fn final_gather(
    faces: &FaceTable,
    chosen: &[u32],
    reflected: &[f64],
    rays: u64,
    mut rng: WalkRng,
    go_on: &dyn Fn() -> bool,
) -> Option<Vec<GatheredLight>> {
    let per_face = (rays / chosen.len().max(1) as u64).max(FEWEST);
    let mut gatherer = Gatherer::new(faces, (reflected, None), per_face, go_on);
    let gathered = chosen.iter().map(|&face| {
        let station = RayOrigin::Face(faces.scene, faces.list[face as usize]);
        let (mut irradiance, landed) = gatherer.irradiance(face, &station, &mut rng)?;
        gatherer.light_of_lamps(face, &station, &mut rng, &mut irradiance)?;
        Some(GatheredLight { face, irradiance, landed, rays: per_face })
    });
    gathered.collect()
}

/// Gathers H of every cell of sensors as [`final_gather`] does of faces, and then the mean of every plane of points: of all sources together,
/// and then of each where they are distinguished. What lamps without
/// area bring to points in one direction is left out: it is known exactly.
pub(crate) fn sense(
    faces: &FaceTable,
    sensors: &Sensors,
    (reflected, sources): (&[f64], Option<&SourcesOfLight>),
    rays: u64,
    mut rng: WalkRng,
    go_on: &dyn Fn() -> bool,
) -> Option<Vec<GatheredLight>> {
    let per_cell = (rays / sensors.cell_count() as u64).max(FEWEST_OF_CELL);
    let mut gatherer = Gatherer::new(faces, (reflected, sources), per_cell, go_on);
    let gathered = (0..sensors.cell_count() as u32).map(|number| {
        let station = RayOrigin::Cell(sensors, sensors.cell(number as usize));
        let (mut irradiance, landed) = gatherer.irradiance(number, &station, &mut rng)?;
        gatherer.light_of_lamps(number, &station, &mut rng, &mut irradiance)?;
        Some(GatheredLight { face: number, irradiance, landed, rays: per_cell })
    });
    let mut gathered = gathered.collect::<Option<Vec<_>>>()?;
    for plane in sensors.planes() {
        let mean = mean_of(&gathered[sensors.cells_of(plane)]);
        gathered.push(GatheredLight { face: gathered.len() as u32, irradiance: mean, landed: 0, rays: 0 });
    }
    Some(if sources.is_some() { each_source(gathered, faces.scene.channels()) } else { gathered })
}

/// What all sources together bring to each row, and then what each brings.
fn each_source(gathered: Vec<GatheredLight>, channels: usize) -> Vec<GatheredLight> {
    let sources = gathered[0].irradiance.len() / channels;
    let all = gathered.iter().map(|row| {
        let of_channel = |c: usize| row.irradiance.iter().skip(c).step_by(channels).sum();
        GatheredLight { irradiance: (0..channels).map(of_channel).collect(), ..*row }
    });
    let of_source = |source: usize| {
        let own = move |row: &GatheredLight| row.irradiance[source * channels..][..channels].to_vec();
        gathered.iter().map(move |row| GatheredLight { irradiance: own(row), landed: 0, rays: 0, ..*row })
    };
    all.chain((0..sources).flat_map(of_source)).collect()
}

/// The mean H of some cells, channel by channel [W/m²].
fn mean_of(cells: &[GatheredLight]) -> Vec<f64> {
    let mut mean = vec![0.0; cells[0].irradiance.len()];
    for cell in cells {
        mean.iter_mut().zip(&cell.irradiance).for_each(|(mean, h)| *mean += h / cells.len() as f64);
    }
    mean
}

/// Where rays set out from.
enum RayOrigin<'a> {
    /// A face of a scene.
    Face(&'a Scene, Face),
    /// A cell of a sensor.
    Cell(&'a Sensors, SensorCell),
}

impl RayOrigin<'_> {
    /// The frames that departures look theirs up in.
    fn frames(&self) -> &Frames {
        match self {
            RayOrigin::Face(scene, _) => &scene.parts.frames,
            RayOrigin::Cell(sensors, _) => sensors.frames(),
        }
    }

    /// The number of its frame there.
    fn frame(&self) -> u32 {
        match self {
            RayOrigin::Face(_, face) => face.surface,
            RayOrigin::Cell(_, cell) => cell.frame(),
        }
    }

    /// The surface that rays leave.
    fn surface(&self) -> u32 {
        match self {
            RayOrigin::Face(_, face) => face.surface,
            RayOrigin::Cell(..) => Ray::FREE,
        }
    }

    /// Whether it is one point.
    fn is_point(&self) -> bool {
        matches!(self, RayOrigin::Cell(_, cell) if cell.area == 0.0)
    }

    /// 1 where rays leave the front of the frame, −1 where the back.
    fn facing(&self) -> f64 {
        match self {
            RayOrigin::Face(_, face) => face.side.sign(),
            RayOrigin::Cell(..) => 1.0,
        }
    }

    /// The corners of the station of this number, in the coordinates of the scene; none of a point.
    fn corners(&self, number: u32, scene: &Scene) -> Vec<DVec3> {
        let in_scene = |corners: &[DVec3]| corners.iter().map(|corner| corner - scene.origin()).collect();
        match self {
            RayOrigin::Face(..) => {
                let faces = scene.faces();
                faces
                    .pieces(number as usize)
                    .next()
                    .map_or(Vec::new(), |it| in_scene(&faces.piece_corners(it)))
            }
            RayOrigin::Cell(sensors, cell) => {
                let corners =
                    sensors.corners(number as usize).map_or(Vec::new(), |corners| in_scene(&corners));
                // Rays of a cell set out just in front of its plane.
                let on_frame = self.point(self.place([1 << 31; 2]));
                let lift = |corner: DVec3| corner + cell.normal * cell.normal.dot(on_frame - corner);
                corners.into_iter().map(lift).collect()
            }
        }
    }

    /// Local coordinates of a uniform point.
    fn place(&self, numbers: [u32; 2]) -> [f64; 2] {
        match self {
            RayOrigin::Face(scene, face) => place(scene, face, numbers),
            RayOrigin::Cell(sensors, cell) => sensors.place(cell, numbers),
        }
    }

    /// The point with these local coordinates [m].
    fn point(&self, uv: [f64; 2]) -> DVec3 {
        match self {
            RayOrigin::Face(scene, face) => surface(scene, face).point(uv),
            RayOrigin::Cell(sensors, cell) => sensors.frame(cell).point(uv).into(),
        }
    }

    /// How it weighs light by its direction.
    fn response(&self) -> Response {
        match self {
            RayOrigin::Face(scene, face) => {
                Response::Flat { facing: surface(scene, face).normal() * self.facing() }
            }
            RayOrigin::Cell(sensors, cell) => sensors.response(cell),
        }
    }
}

struct Gatherer<'a> {
    faces: &'a FaceTable<'a>,
    /// The reflected radiosity of faces [W/m²], face-major, then by source where these are distinguished, channel-minor.
    reflected: &'a [f64],
    sources: Option<&'a SourcesOfLight>,
    go_on: &'a dyn Fn() -> bool,
    /// Rays of a face that gather, and shadow rays.
    rays: [u64; 2],
    /// The part of shadow rays that go to each face; empty where nothing emits.
    share: Vec<f64>,
    /// The pieces of faces that have a part, and the parts.
    lamps: Vec<u32>,
    parts: Vec<f64>,
    batch: Box<GatherBatch>,
}

/// Rays that are traced together.
#[derive(Default)]
struct GatherBatch {
    departures: Departures,
    rays: Rays,
    hits: Hits,
    scratch: Scratch,
}

impl<'a> Gatherer<'a> {
    fn new(
        faces: &'a FaceTable,
        (reflected, sources): (&'a [f64], Option<&'a SourcesOfLight>),
        per_face: u64,
        go_on: &'a dyn Fn() -> bool,
    ) -> Self {
        let share = emitted_shares(faces);
        let shadow = if share.is_empty() { 0 } else { per_face / SHADOW_SHARE };
        let (lamps, parts) = pieces_with_parts(faces, &share);
        let rays = [per_face - shadow, shadow];
        Gatherer { faces, reflected, sources, go_on, rays, share, lamps, parts, batch: Box::default() }
    }

    /// H of a station, whose rays are those of this number, in every channel, and the rays that met something.
    fn irradiance(&mut self, number: u32, station: &RayOrigin, rng: &mut WalkRng) -> Option<(Vec<f64>, u64)> {
        let sources = self.sources.map_or(1, |sources| sources.count);
        let mut irradiance = vec![0.0; self.faces.scene.channels() * sources];
        let landed = self.gather(number, station, RayNumbers::independent(rng), &mut irradiance)?;
        if self.rays[1] > 0 {
            let offset = rng.pair()[0];
            self.light(station, RayNumbers::independent(rng), offset, &mut irradiance)?;
        }
        Some((irradiance, landed))
    }

    /// Adds what an emitter brings to the light of its source: lamps without area are numbered behind faces.
    fn bring(&self, irradiance: &mut [f64], emitter: usize, brought: impl Fn(usize) -> f64) {
        let channels = self.faces.scene.channels();
        let source = self.sources.map_or(0, |sources| sources.of_emitter[emitter]);
        let own = irradiance[source * channels..][..channels].iter_mut();
        own.enumerate().for_each(|(c, h)| *h += brought(c));
    }

    /// What lamps without area bring to a station, that of this number: shadow rays from uniform points, to one place each on the disc of a
    /// distant lamp; from points that a near lamp sees under uniform directions, where I cos θ/d² would be a spike; none from a lamp in its
    /// plane. Nothing is drawn where there is nothing to do.
    fn light_of_lamps(
        &mut self,
        number: u32,
        station: &RayOrigin,
        rng: &mut WalkRng,
        irradiance: &mut [f64],
    ) -> Option<()> {
        let scene = self.faces.scene;
        let lamps = &scene.parts.lamps;
        let sampled: Vec<usize> =
            (0..lamps.len()).filter(|&lamp| !(station.is_point() && lamps.is_sharp(lamp))).collect();
        if sampled.is_empty() {
            return Some(());
        }
        let rays = self.rays[0] / SHADOW_SHARE / sampled.len() as u64 + 1;
        let mut numbers = RayNumbers::independent(rng);
        let (response, corners) = (station.response(), station.corners(number, scene));
        for lamp in sampled {
            let view = scene.lamp_place(lamp).map(|[position, _]| FaceView::from(position, &corners));
            if let Some(FaceView::Edge) = view {
                continue;
            }
            numbers.leave(lamp as u32, 0);
            for first in (0..rays).step_by(WIDTH) {
                let len = (rays - first).min(WIDTH as u64) as usize;
                (0..len).for_each(|i| numbers.draw(i));
                let [across, along, polar, turn] = numbers.points(scene.parts.isa);
                for i in 0..len {
                    let PointInView { place, weight } = match &view {
                        Some(FaceView::Near(face)) => face.point([across[i], along[i]].map(unit_32)),
                        _ => PointInView {
                            place: station.point(station.place([across[i], along[i]])),
                            weight: 1.0,
                        },
                    };
                    let bits = u64::from(polar[i]) << 32 | u64::from(turn[i]);
                    if let Some(light) = scene.lamp_light(lamp, place, response, station.surface(), bits) {
                        let emitter = self.faces.list.len() + lamp;
                        self.bring(irradiance, emitter, |c| weight * light[c] / rays as f64);
                    }
                }
            }
            if !(self.go_on)() {
                return None;
            }
        }
        Some(())
    }

    /// Rays from uniform points of a station, distributed as it weighs light.
    fn gather(
        &mut self,
        number: u32,
        station: &RayOrigin,
        mut numbers: RayNumbers,
        irradiance: &mut [f64],
    ) -> Option<u64> {
        let (scene, count) = (self.faces.scene, self.rays[0]);
        numbers.leave(number, 0);
        let mut landed = 0;
        for first in (0..count).step_by(WIDTH) {
            let len = (count - first).min(WIDTH as u64) as usize;
            (0..len).for_each(|i| numbers.draw(i));
            self.batch.leave(scene, station, len, numbers.points(scene.parts.isa));
            self.batch.trace(scene);
            for i in 0..len {
                let Some(met) = self.batch.met(scene, i) else { continue };
                landed += 1;
                let passed = self.batch.passed(scene, i);
                let emittance = self.faces.list[met as usize].emittance;
                let weight = if emittance.is_lit() {
                    self.balance(met, self.batch.kernel(scene, station, i))
                } else {
                    0.0
                };
                let reflected = &self.reflected[met as usize * irradiance.len()..];
                let rays = count as f64 / passed;
                if self.sources.is_none() {
                    for (c, h) in irradiance.iter_mut().enumerate() {
                        *h += (reflected[c] + weight * emittance[c]) / rays;
                    }
                    continue;
                }
                irradiance.iter_mut().zip(reflected).for_each(|(h, reflected)| *h += reflected / rays);
                if weight > 0.0 {
                    self.bring(irradiance, met as usize, |c| weight * emittance[c] / rays);
                }
            }
            if !(self.go_on)() {
                return None;
            }
        }
        Some(landed)
    }

    /// Shadow rays from uniform points of a station to uniform points of emitting faces, each of which gets its share.
    fn light(
        &mut self,
        station: &RayOrigin,
        mut numbers: RayNumbers,
        offset: f64,
        irradiance: &mut [f64],
    ) -> Option<()> {
        let [count, shadow] = self.rays;
        let scene = self.faces.scene;
        let quotas = systematic(&self.parts, shadow, offset);
        for (i, quota) in quotas.into_iter().enumerate().filter(|&(_, quota)| quota > 0) {
            let lamp = self.lamps[i];
            let emitter = scene.faces().piece(lamp);
            let face = scene.faces().face_of(lamp);
            numbers.leave(lamp, 0);
            for first in (0..quota).step_by(WIDTH) {
                let len = (quota - first).min(WIDTH as u32) as usize;
                (0..len).for_each(|i| numbers.draw(i));
                self.batch.aim(scene, station, &emitter, len, numbers.points(scene.parts.isa));
                self.batch.trace(scene);
                for i in 0..len {
                    let Hits { surface, facing, .. } = &self.batch.hits;
                    if (surface[i], facing[i]) != (emitter.surface, emitter.side.sign()) {
                        continue;
                    }
                    let kernel = self.batch.kernel(scene, station, i);
                    if kernel.is_infinite() {
                        continue;
                    }
                    // E·k over the sum of both densities, where the one of gathering rays is k.
                    let weight = self.balance(face, kernel) * self.batch.passed(scene, i) / count as f64;
                    self.bring(irradiance, face as usize, |c| emitter.emittance[c] * weight);
                }
                if !(self.go_on)() {
                    return None;
                }
            }
        }
        Some(())
    }

    /// n₁p₁/(n₁p₁ + n₂p₂) of a pair of points, one on a face that `met` is seen from: p₁ = k, p₂ = q/A the densities per area of
    /// `met` with which gathering rays and shadow rays find it.
    fn balance(&self, met: u32, kernel: f64) -> f64 {
        let Some(share) = self.share.get(met as usize) else { return 1.0 };
        // A layer in contact is found by gathering rays alone.
        if kernel.is_infinite() {
            return 1.0;
        }
        let gathering = self.rays[0] as f64 * kernel;
        let shadow = self.rays[1] as f64 * share / self.faces.areas[met as usize];
        if gathering > 0.0 { gathering / (gathering + shadow) } else { 0.0 }
    }
}

impl GatherBatch {
    /// Turns points into rays from a station, distributed as it weighs light. A cylinder is at one place, so that the number of the place
    /// across turns the ray.
    fn leave(&mut self, scene: &Scene, station: &RayOrigin, len: usize, points: &Points) {
        let [across, along, polar, turn] = points;
        for i in 0..len {
            self.departures.surface[i] = station.frame();
            self.departures.facing[i] = station.facing();
            let place = station.place([across[i], along[i]]);
            self.departures.uv.iter_mut().zip(place).for_each(|(row, x)| row[i] = x);
            self.departures.direction[i] = u64::from(polar[i]) << 32 | u64::from(turn[i]);
        }
        self.departures.leave(scene.parts.isa, station.frames(), len, &mut self.rays);
        self.rays.from[..len].fill(station.surface());
        let response = station.response();
        if !matches!(response, Response::Flat { .. }) {
            for (i, &turn) in across[..len].iter().enumerate() {
                let turned = response.turned(self.rays.get(i).direction, turn).to_array();
                self.rays.direction.iter_mut().zip(turned).for_each(|(row, x)| row[i] = x);
            }
        }
    }

    /// Turns points into rays from a station to a face.
    fn aim(&mut self, scene: &Scene, from: &RayOrigin, to: &Face, len: usize, points: &Points) {
        let [across, along, polar, turn] = points;
        self.rays.len = 0;
        for i in 0..len {
            let origin = from.point(from.place([across[i], along[i]]));
            let end = surface(scene, to).point(place(scene, to, [polar[i], turn[i]]));
            let direction = (end - origin).normalize_or(DVec3::X);
            self.rays.push(&Ray { origin, direction, from: from.surface() });
        }
    }

    fn trace(&mut self, scene: &Scene) {
        scene.parts.index.closest_hits(&scene.parts.facets, &self.rays, &mut self.scratch, &mut self.hits);
    }

    /// The part of the light that passes panes on the way of ray i.
    fn passed(&self, scene: &Scene, i: usize) -> f64 {
        match scene.has_panes() {
            true => scene.passed_panes(&self.rays.get(i), self.hits.t[i]),
            false => 1.0,
        }
    }

    /// The face that ray i meets, if it is active.
    fn met(&self, scene: &Scene, i: usize) -> Option<u32> {
        let (number, facing) = (self.hits.surface[i], self.hits.facing[i]);
        if number == Hits::NONE {
            return None;
        }
        let surface = &scene.surfaces()[number as usize];
        if facing < 0.0 && surface.sides() == Sides::Front {
            return None;
        }
        let cell = surface.cell_at(self.hits.uv.map(|row| row[i]));
        Some(scene.face_at(number, cell, if facing > 0.0 { Side::Front } else { Side::Back }))
    }

    /// k = w cos θ′/(πr²), w the weight of the direction at the station (cos θ of a plane), between the ends of ray i [1/m²]; 0 where it leaves below the station, infinite where both
    /// ends are one point.
    fn kernel(&self, scene: &Scene, from: &RayOrigin, i: usize) -> f64 {
        let direction = self.rays.get(i).direction;
        let leaves = from.response().of(direction);
        let met = &scene.surfaces()[self.hits.surface[i] as usize];
        let arrives = -met.normal().dot(direction) * self.hits.facing[i];
        kernel(leaves, arrives, self.hits.t[i])
    }
}

fn surface<'a>(scene: &'a Scene, face: &Face) -> &'a Surface {
    &scene.surfaces()[face.surface as usize]
}

/// Local coordinates of a uniform point of a face.
fn place(scene: &Scene, face: &Face, numbers: [u32; 2]) -> [f64; 2] {
    let surface = surface(scene, face);
    surface.point_in_cell(surface.cell_of(face), numbers.map(unit_32))
}
