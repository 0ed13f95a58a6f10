//! The pilot: light followed from the emitters, to find where it is lost.

use std::ops::RangeInclusive;

use glam::DVec3;
use radiosity::{
    Scene, Side,
    rays::{Hit, Lookout, Ray},
    surfaces::Face,
};

/// The number of walks from each emitting patch, within the two limits below.
const WALKS_EACH: u64 = 256;

/// The fewest and the most walks in all.
const LEAST_WALKS: u64 = 20_000;
const MOST_WALKS: u64 = 60_000;

/// The part of its power from which on a walk survives a reflection with the probability of the largest reflectance.
const FAINT: f64 = 0.02;

/// Walks that are under way together.
const TOGETHER: usize = 512;

/// The number of reflections after which a walk survives by chance, too: powers stay unbiased, and walks end.
const SURE_REFLECTIONS: u32 = 16;

/// The largest probability to survive, so that walks end where hardly anything is absorbed.
const MOST_SURVIVE: f64 = 0.98;

/// The most rays out of the scene that are kept to tell where they lead.
const MOST_WAYS_OUT: usize = 256;

/// The relative difference below which two distances are those of one point; rays closer to their surface are grazing.
const NEAR: f64 = 1e-6;

/// The most places where light arrived that are kept.
const MOST_LIT_PLACES: usize = 1024;

/// Random numbers for rays: splitmix64 (Steele, Lea and Flood 2014).
pub(crate) struct Draws(u64);

impl Draws {
    pub(crate) fn new(seed: u64) -> Self {
        Draws(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15))
    }

    pub(crate) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let x = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        x ^ (x >> 31)
    }

    /// A uniform number in (0, 1).
    pub(crate) fn uniform(&mut self) -> f64 {
        ((self.bits() >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }
}

/// What became of one side's own light.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct EmissionOutcome {
    /// The power that left the side [W].
    pub(crate) power: f64,
    /// The power that met something within [`LightPilot::close`] [W].
    pub(crate) close: f64,
    /// The power that met no active side [W].
    pub(crate) lost: f64,
}

/// A place where light arrived.
#[derive(Clone, Copy, Debug)]
struct LitPlace {
    /// The point in coordinates of the scene [m].
    point: DVec3,
    surface: u32,
    side: Side,
}

/// At most [`MOST_LIT_PLACES`] of the items that are offered, at equal steps.
struct EvenSample<T> {
    kept: Vec<T>,
    offered: usize,
    step: usize,
}

impl<T> Default for EvenSample<T> {
    fn default() -> Self {
        EvenSample { kept: Vec::new(), offered: 0, step: 1 }
    }
}

impl<T> EvenSample<T> {
    fn offer(&mut self, item: T) {
        if self.kept.len() == MOST_LIT_PLACES {
            let mut number = 0_usize;
            self.kept.retain(|_| {
                number += 1;
                number % 2 == 1
            });
            self.step *= 2;
        }
        if self.offered.is_multiple_of(self.step) {
            self.kept.push(item);
        }
        self.offered += 1;
    }
}

/// The pilot's findings. Powers are sums over channels [W].
pub(crate) struct LightPilot {
    /// The power Φ_T of all emitters [W].
    pub(crate) power: f64,
    /// The power that left the scene [W], and the sum of the squares of what each walk took along [W²].
    escaped: [f64; 2],
    /// The number of walks.
    walks: f64,
    /// The power that arrived at the back of each surface [W], without what came straight from the sky: that is the light on the
    /// outsides of a building.
    backs: Vec<f64>,
    /// The first surface of the box that stands for the sky; the number of surfaces where there is none.
    sky: u32,
    /// Whether light left or arrived at the sides of each surface: front, back.
    lit: Vec<[bool; 2]>,
    /// Some places where light arrived at an active side.
    lit_places: EvenSample<LitPlace>,
    /// The first rays of walks, by surface: front, back.
    pub(crate) emission: Vec<[EmissionOutcome; 2]>,
    /// Some rays that left the scene: origin, direction, the surface they left [m, of the scene].
    pub(crate) ways_out: Vec<Ray>,
    /// What is closer than this to an emitter shades it [m]: a hundredth of the scene's extent.
    pub(crate) close: f64,
}

impl LightPilot {
    /// Follows enough walks to name what is wrong with a scene.
    pub(crate) fn follow(scene: &Scene) -> Self {
        LightPilot::follow_some(scene, LEAST_WALKS..=MOST_WALKS)
    }

    /// Follows a number of walks in a range, the more the more emitters there are.
    pub(crate) fn follow_some(scene: &Scene, walks: RangeInclusive<u64>) -> Self {
        let channels = scene.channels();
        let faces = scene.faces();
        let of_pieces = (0..faces.piece_count() as u32).map(|piece| {
            let face = faces.piece(piece);
            (WalkOrigin::Piece(piece), (0..channels).map(|channel| face.power(channel)).sum())
        });
        let of_lamps = (0..scene.lamp_count()).map(|lamp| {
            (WalkOrigin::Lamp(lamp), (0..channels).map(|channel| scene.lamp_power(lamp, channel)).sum())
        });
        let emitters: Vec<(WalkOrigin, f64)> =
            of_pieces.chain(of_lamps).filter(|&(_, power)| power > 0.0).collect();
        let surfaces = scene.surfaces().len();
        let mut pilot = LightPilot {
            power: emitters.iter().map(|(_, power)| power).sum(),
            escaped: [0.0; 2],
            walks: 0.0,
            backs: vec![0.0; surfaces],
            sky: scene.surfaces_before_sky() as u32,
            lit: vec![[false; 2]; surfaces],
            lit_places: EvenSample::default(),
            emission: vec![[EmissionOutcome::default(); 2]; surfaces],
            ways_out: Vec::new(),
            close: 0.01 * extent(scene),
        };
        let walks = (WALKS_EACH * emitters.len() as u64).clamp(*walks.start(), *walks.end());
        pilot.walks = walks as f64;
        let step = pilot.power / pilot.walks;
        let (mut passed, mut emitter) = (0.0, 0);
        let births: Vec<WalkOrigin> = (0..walks)
            .map(|walk| {
                // Births are at equal steps of power: every emitter gets its share.
                let at = (walk as f64 + 0.5) * step;
                while emitter + 1 < emitters.len() && passed + emitters[emitter].1 < at {
                    passed += emitters[emitter].1;
                    emitter += 1;
                }
                emitters[emitter].0
            })
            .collect();
        let mut lookout = Lookout::new(scene);
        for (births, first) in births.chunks(TOGETHER).zip((0..).step_by(TOGETHER)) {
            let walks =
                births.iter().zip(first..).map(|(&birth, walk)| PilotWalk::born(scene, birth, step, walk));
            pilot.walk(scene, &mut lookout, walks.collect());
        }
        pilot.forgive_sky();
        pilot
    }

    /// Counts nothing of a sky as lost at once where some of it comes to active sides: most of a sky's light passes a building by.
    fn forgive_sky(&mut self) {
        let sky = &mut self.emission[self.sky as usize..];
        if sky.iter().flatten().any(|emission| emission.lost < emission.power) {
            sky.iter_mut().flatten().for_each(|emission| emission.lost = 0.0);
        }
    }

    /// Follows some walks to their ends.
    fn walk(&mut self, scene: &Scene, lookout: &mut Lookout, mut walks: Vec<PilotWalk>) {
        for hits in 0.. {
            if walks.is_empty() {
                return;
            }
            let rays: Vec<Ray> = walks.iter().map(|walk| walk.ray).collect();
            let mut met = lookout.closest_hits(&rays).into_iter();
            walks.retain_mut(|walk| {
                let hit = met.next().flatten();
                self.note(scene, walk, &hit);
                if hits == 0 {
                    self.note_emission(scene, walk, hit);
                }
                hit.is_some_and(|hit| walk.goes_on(scene, &hit, hits >= SURE_REFLECTIONS))
            });
        }
    }

    /// Takes down where the power of a walk has come, or is lost.
    fn note(&mut self, scene: &Scene, walk: &PilotWalk, hit: &Option<Hit>) {
        let PilotWalk { ray, left, .. } = walk;
        let power: f64 = left.iter().sum();
        match hit {
            None => {
                self.escaped[0] += power;
                self.escaped[1] += power * power;
                if ray.from != Ray::FREE && self.ways_out.len() < MOST_WAYS_OUT {
                    self.ways_out.push(*ray);
                }
            }
            Some(hit) if !scene.surfaces()[hit.surface as usize].is_active(hit.side) => {
                let is_skylight = (self.sky..self.backs.len() as u32).contains(&ray.from);
                self.backs[hit.surface as usize] += if is_skylight { 0.0 } else { power };
            }
            Some(hit) => {
                self.lit[hit.surface as usize][usize::from(hit.side == Side::Back)] = true;
                let point = ray.origin + ray.direction * hit.t;
                self.lit_places.offer(LitPlace { point, surface: hit.surface, side: hit.side });
            }
        }
    }

    fn note_emission(&mut self, scene: &Scene, walk: &PilotWalk, hit: Option<Hit>) {
        let (surface, back, power) = (walk.ray.from, walk.born_on == Side::Back, walk.power);
        if surface == Ray::FREE {
            return;
        }
        self.lit[surface as usize][usize::from(back)] = true;
        let emission = &mut self.emission[surface as usize][usize::from(back)];
        emission.power += power;
        let is_lost = hit.is_none_or(|hit| !scene.surfaces()[hit.surface as usize].is_active(hit.side));
        emission.lost += if is_lost { power } else { 0.0 };
        emission.close += if hit.is_some_and(|hit| hit.t < self.close) { power } else { 0.0 };
    }

    /// Whether light left or arrived at an active side.
    pub(crate) fn is_lit(&self, surface: u32, side: Side) -> bool {
        self.lit[surface as usize][usize::from(side == Side::Back)]
    }

    /// Whether light comes to a point of a side: whether it sees a place where light arrived, or sees a point that does.
    pub(crate) fn comes_light(&self, scene: &Scene, origin: DVec3, from: u32, side: Side) -> bool {
        // Of a side that a fourth of the directions light they overlook one in a hundred.
        const RAYS: u32 = 16;
        // Light that comes over another surface comes from much of it: an eighth of the places tells.
        const SOME: usize = 8;
        if self.sees_lit_place(scene, origin, from, side, 1) {
            return true;
        }
        let surface = &scene.surfaces()[from as usize];
        let mut draws = Draws::new(u64::from(from) ^ origin.x.to_bits() ^ origin.y.to_bits().rotate_left(20));
        (0..RAYS).any(|_| {
            let direction = surface.direction(side, draws.bits());
            scene.closest_hit(&Ray { origin, direction, from }).is_some_and(|hit| {
                self.sees_lit_place(scene, origin + direction * hit.t, hit.surface, hit.side, SOME)
            })
        })
    }

    /// Whether a point of a side sees a lit place, of which one in `step` is tried.
    fn sees_lit_place(&self, scene: &Scene, origin: DVec3, from: u32, side: Side, step: usize) -> bool {
        let normal = scene.surfaces()[from as usize].normal();
        let outwards = if side == Side::Front { normal } else { -normal };
        self.lit_places.kept.iter().step_by(step).any(|lit| {
            let towards = lit.point - origin;
            let distance = towards.length();
            if towards.dot(outwards) <= NEAR * distance || distance <= 0.0 {
                return false;
            }
            let hit = scene.closest_hit(&Ray { origin, direction: towards / distance, from });
            hit.is_some_and(|hit| {
                (hit.surface, hit.side) == (lit.surface, lit.side)
                    && (hit.t - distance).abs() <= NEAR * distance
            })
        })
    }

    /// Power of a surface that meets no active side at once [W].
    pub(crate) fn lost_at_once(&self, surface: u32) -> f64 {
        self.emission[surface as usize].iter().map(|emission| emission.lost).sum()
    }

    /// The part of all power that leaves the scene.
    pub(crate) fn escaped_part(&self) -> f64 {
        self.escaped() / self.power
    }

    /// The standard error of [`LightPilot::escaped_part`], at most: births at equal steps of power only lessen it. It is that of
    /// one walk more, which takes all of its power along, so that it is not 0 where no walk has escaped.
    pub(crate) fn escaped_error(&self) -> f64 {
        let squares = self.escaped[1] * (self.walks / self.power).powi(2);
        let variance = (squares + 1.0) / self.walks - self.escaped_part().powi(2);
        (variance / self.walks).sqrt()
    }

    /// The number of walks that were followed.
    pub(crate) fn walks(&self) -> f64 {
        self.walks
    }

    /// Power that leaves the scene [W].
    pub(crate) fn escaped(&self) -> f64 {
        self.escaped[0]
    }

    /// Power that arrives at the back of a surface [W].
    pub(crate) fn back(&self, surface: u32) -> f64 {
        self.backs[surface as usize]
    }
}

/// Where a walk sets out.
#[derive(Clone, Copy)]
enum WalkOrigin {
    Piece(u32),
    /// A lamp without area.
    Lamp(usize),
}

/// A walk on its way.
struct PilotWalk {
    ray: Ray,
    born_on: Side,
    /// What it set out with, and what is left of that in each channel [W].
    power: f64,
    left: [f64; 3],
    draws: Draws,
}

impl PilotWalk {
    /// A walk that sets out from an emitter.
    fn born(scene: &Scene, birth: WalkOrigin, power: f64, number: u64) -> Self {
        match birth {
            WalkOrigin::Piece(piece) => PilotWalk::born_on(scene, piece, power, number),
            WalkOrigin::Lamp(lamp) => PilotWalk::born_at(scene, lamp, power, number),
        }
    }

    /// A walk that sets out from a lamp without area.
    fn born_at(scene: &Scene, lamp: usize, power: f64, number: u64) -> Self {
        let mut draws = Draws::new(number);
        let ray = scene.lamp_birth(lamp, std::array::from_fn(|_| draws.bits()));
        let channels = scene.channels();
        let all: f64 = (0..channels).map(|channel| scene.lamp_power(lamp, channel)).sum();
        let left =
            [0, 1, 2].map(|c| if c < channels { power * scene.lamp_power(lamp, c) / all } else { 0.0 });
        PilotWalk { ray, born_on: Side::Front, power, left, draws }
    }

    /// A walk that sets out from a piece.
    fn born_on(scene: &Scene, birth: u32, power: f64, number: u64) -> Self {
        let mut draws = Draws::new(number);
        let born = scene.faces().piece(birth);
        let Face { surface: from, side, .. } = born;
        let channels = scene.channels();
        let all: f64 = (0..channels).map(|channel| born.power(channel)).sum();
        let left = [0, 1, 2].map(|c| if c < channels { power * born.power(c) / all } else { 0.0 });
        let surface = &scene.surfaces()[from as usize];
        let cell = birth - surface.piece(0, side);
        let origin = surface.point(surface.point_in_cell(cell, [draws.uniform(), draws.uniform()]));
        let ray = Ray { origin, direction: surface.direction(side, draws.bits()), from };
        PilotWalk { ray, born_on: side, power, left, draws }
    }

    /// Leaves from where it has arrived; false where it ends. A walk that is faint, or `old`, survives by chance, and carries
    /// what others that ended would have carried.
    fn goes_on(&mut self, scene: &Scene, hit: &Hit, old: bool) -> bool {
        let met = &scene.surfaces()[hit.surface as usize];
        let reflectance = met.reflectance();
        let faint = self.left.iter().sum::<f64>() < FAINT * self.power;
        let survives = if old || faint { reflectance.max().min(MOST_SURVIVE) } else { 1.0 };
        if !met.is_active(hit.side) || reflectance.max() == 0.0 || self.draws.uniform() >= survives {
            return false;
        }
        for (c, left) in self.left.iter_mut().enumerate().take(scene.channels()) {
            *left *= reflectance[c] / survives;
        }
        let origin = met.point(met.inside(hit.uv));
        let direction = met.direction(hit.side, self.draws.bits());
        self.ray = Ray { origin, direction, from: hit.surface };
        true
    }
}

/// The largest extent of a scene along an axis [m].
pub(crate) fn extent(scene: &Scene) -> f64 {
    let corners = || scene.surfaces().iter().flat_map(|surface| surface.outline());
    let min = corners().fold(DVec3::INFINITY, DVec3::min);
    let max = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
    (max - min).max_element()
}
