//! The walk of [`super::plain`], many side by side.
//!
//! A batch of walks goes through the same verbs, one verb at a time for all of them: leave, trace, arrive, survive or
//! die, score. A walk that ends makes room for the next one. Each draws from its own place in the sequence, so that
//! how many go side by side, and where each of them is, cannot enter the answer.

use std::ops::Range;

use crate::random::rng::{Generators, Numbers, Sequence};
use crate::scene::Scene;
use crate::scene::births::{BirthPoint, Nursery};
use crate::scene::panes::thin;
use crate::scene::repeat::Copies;
use crate::simd::batch::{Decisions, Lanes, WIDTH};
use crate::simd::isa::Isa;
use crate::tally::Counts;
use crate::trace::ray::{Hits, Rays};
use crate::trace::tree::Scratch;
use crate::walk::Space;
use crate::walk::arrive::Arrivals;
use crate::walk::collision::{CollisionBatch, CollisionModel};
use crate::walk::depart::Departures;
use crate::walk::newborns::Newborns;
use crate::walk::score::Scorer;

/// Every way a walk can end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WalkEnd {
    /// An active side took it.
    Absorbed,
    /// The walk met the back of a one-sided surface.
    AbsorbedBack,
    /// The walk left the scene.
    Escaped,
    /// The walk was cut off (infinite walks only).
    Truncated,
}

/// Steps of a batch between two questions whether its walks are still wanted: half a million rays, a tenth of a second.
const STEPS_AT_ONCE: u32 = 1 << 12;

/// On what terms walks run.
#[derive(Clone, Copy)]
pub(crate) struct Terms<'a> {
    /// Where surviving walks go on from.
    pub space: Space,
    /// Whether the walks are still wanted. They are given up where they are not, and what they have scored is of no use: one walk may
    /// take longer than anyone waits.
    pub go_on: &'a dyn Fn() -> bool,
}

impl From<Space> for Terms<'_> {
    fn from(space: Space) -> Self {
        Terms { space, go_on: &|| true }
    }
}

/// Walks number `walks.start` … `walks.end` − 1 of a sequence; returns how they ended.
pub(crate) fn walk_all<'a, const C: usize>(
    scene: &Scene,
    births: &impl Nursery<C>,
    terms: impl Into<Terms<'a>>,
    sequence: &Sequence,
    walks: Range<u64>,
    model: impl CollisionModel<C>,
    estimator: &mut impl Scorer<C>,
) -> Counts {
    let starts = sequence.walks_from(walks.start).take((walks.end - walks.start) as usize);
    walk_each(scene, births, terms, &Generators::new(sequence), starts, model, estimator)
}

/// Walks that begin at these places of the numbers; returns how they ended.
pub(crate) fn walk_each<'a, N: Numbers + Clone, const C: usize>(
    scene: &Scene,
    births: &impl Nursery<C>,
    terms: impl Into<Terms<'a>>,
    numbers: &N,
    starts: impl Iterator<Item = N::Place>,
    model: impl CollisionModel<C>,
    estimator: &mut impl Scorer<C>,
) -> Counts {
    let (counts, Terms { space, go_on }) = (Counts::default(), terms.into());
    let mut newborns = Newborns::new(scene, births, numbers.clone(), starts);
    let generators = numbers.clone();
    let mut walker = Box::new(Walker {
        isa: scene.parts.isa,
        scene,
        space,
        go_on,
        estimator,
        counts,
        len: 0,
        generators,
        departures: Departures::default(),
        model,
        models: [model; WIDTH],
        weights: [[1.0; C]; WIDTH],
    });
    walker.run(&mut newborns);
    walker.counts
}

/// A batch of walks between two rays.
struct Walker<'a, N, E, F, const C: usize> {
    isa: Isa,
    scene: &'a Scene,
    space: Space,
    go_on: &'a dyn Fn() -> bool,
    estimator: &'a mut E,
    counts: Counts,
    /// The first `len` places are taken.
    len: usize,
    generators: N,
    departures: Departures,
    /// Of walks that are about to set out.
    model: F,
    models: [F; WIDTH],
    /// The weights that walks arrive with.
    weights: [[f64; C]; WIDTH],
}

impl<N: Numbers, E: Scorer<C>, F: CollisionModel<C>, const C: usize> Walker<'_, N, E, F, C> {
    fn run<B: Nursery<C>>(&mut self, newborns: &mut Newborns<B, N, impl Iterator<Item = N::Place>>) {
        let (mut rays, mut hits) = (Box::<Rays>::default(), Box::<Hits>::default());
        let mut scratch = Box::<Scratch>::default();
        let (mut arrivals, mut draws) = (Arrivals::default(), [[0; WIDTH]; 3]);
        let mut copies = self.scene.parts.repeat.map(Copies::new);
        while self.len < WIDTH && self.begin(self.len, newborns) {
            self.len += 1;
        }
        let mut steps = 0_u32;
        while self.len > 0 {
            steps = steps.wrapping_add(1);
            if steps.is_multiple_of(STEPS_AT_ONCE) && !(self.go_on)() {
                return;
            }
            let parts = &*self.scene.parts;
            self.departures.leave(self.isa, newborns.births.frames(self.scene), self.len, &mut rays);
            self.departures.leave_lamps(newborns.lamp_rays(), &mut rays);
            B::leave(self.scene, &mut rays);
            self.counts.rays += self.len as u64;
            parts.index.closest_hits(&parts.facets, &rays, &mut scratch, &mut hits);
            if let Some(copies) = &mut copies {
                copies.meet(self.scene, (&rays, self.len), &mut scratch, &mut hits);
            }
            let met = &hits.surface[..self.len];
            parts.landings.expect(met);
            parts.frames.expect(met);
            if C > 1 {
                parts.tints.expect(met);
            }
            // Draws of each arrival: survival, point (discrete walks), direction.
            self.generators.arrivals(self.isa, &mut draws);
            let stopped = self.stop_at_panes(&rays, &hits, &mut draws[0]);
            arrivals.locate(self.isa, self.scene, self.space, self.len, &hits, &draws);
            arrivals.take_out(stopped);
            self.estimator.expect(&arrivals.face[..self.len]);
            self.estimator.lose(Lanes::first(self.len).without(arrivals.met | stopped), &rays);
            let (decided, ended) = self.decide(&hits, &arrivals, stopped);
            self.go_on(&hits, &arrivals, decided.survived, &draws);
            let pieces = arrivals.pieces(self.scene);
            self.estimator.locate(self.isa, self.scene, self.len, &hits, pieces);
            self.estimator.score(&arrivals.face, &decided, &self.weights);
            self.replace(ended, newborns);
        }
    }

    /// A walk sets out. No score and no survival test at its origin: the estimate is of b, and E is added
    /// (source-term suppression). False where all have set out.
    #[inline(always)]
    fn begin<B: Nursery<C>>(
        &mut self,
        lane: usize,
        newborns: &mut Newborns<B, N, impl Iterator<Item = N::Place>>,
    ) -> bool {
        let Some(newborn) = newborns.pop() else { return false };
        self.counts.walks += 1;
        self.generators.set(lane, &newborns.generators.get(newborn));
        if let Some([lamp, ray]) = newborns.at_lamp(newborn) {
            self.set_out(lane, newborns.births.weights_at(lamp));
            // Lamps are numbered behind faces.
            self.estimator.begin(lane, self.scene.faces().len() as u32 + lamp);
            self.departures.set_free(lane, ray);
            return true;
        }
        let draws = newborns.draws.each_ref().map(|row| row[newborn]);
        let (birth, weights) = newborns.births.bear(self.scene, draws);
        self.set_out(lane, weights);
        let BirthPoint { surface, cell, facing, uv, face } = birth;
        self.estimator.begin(lane, face);
        self.estimator.born_at(lane, self.scene, [surface, cell], uv);
        self.departures.surface[lane] = surface;
        self.departures.facing[lane] = facing;
        self.departures.uv.iter_mut().zip(uv).for_each(|(row, uv)| row[lane] = uv);
        self.departures.direction[lane] = draws[3];
        true
    }

    #[inline(always)]
    fn set_out(&mut self, lane: usize, weights: [f64; C]) {
        if !F::CHANCE {
            self.models[lane] = self.model;
            self.models[lane].set_out(weights);
        }
    }

    /// The walks that panes stop, each with a probability; those that go on share their random number with the survival behind.
    #[inline(always)]
    fn stop_at_panes(&self, rays: &Rays, hits: &Hits, survival: &mut [u64; WIDTH]) -> Lanes {
        match self.scene.has_panes() {
            true => stop_at_panes(self.scene, rays, hits, self.len, survival),
            false => Lanes::default(),
        }
    }

    /// What becomes of the walks where they have arrived, and which of them have ended.
    #[inline(always)]
    fn decide(&mut self, hits: &Hits, arrivals: &Arrivals, stopped: Lanes) -> (Decisions, Lanes) {
        let all = Lanes::first(self.len);
        let arrived = arrivals.active & all;
        let collisions = CollisionBatch {
            isa: self.isa,
            surfaces: self.scene.surfaces(),
            tints: &self.scene.parts.tints,
            met: &hits.surface,
            arrived,
            survives: if self.model.ends_at_once() { Lanes::default() } else { arrivals.survives },
        };
        let decided = match F::CHANCE {
            true => collisions.by_chance(),
            false => F::decide_all(&mut self.models, &collisions, &mut self.weights),
        };
        self.counts.absorbed += decided.died.count() + stopped.count();
        let met = arrivals.met & all;
        let truncated = decided.arrived.without(decided.survived | decided.died);
        for (end, lanes) in [
            (WalkEnd::Escaped, all.without(met | stopped)),
            (WalkEnd::AbsorbedBack, met.without(arrived)),
            (WalkEnd::Truncated, truncated),
        ] {
            lanes.each(|lane| self.counts.end(end, self.models[lane].weights()));
        }
        (decided, all.without(decided.survived))
    }

    /// All leave from where they have arrived; those that have ended are replaced.
    #[inline(always)]
    fn go_on(&mut self, hits: &Hits, arrivals: &Arrivals, survived: Lanes, draws: &[[u64; WIDTH]; 3]) {
        let [survival, points, directions] = draws;
        self.departures.bind();
        self.departures.surface = hits.surface;
        self.departures.facing = hits.facing;
        if self.scene.transmits() {
            self.scene.parts.sheets.pass(survived, hits, survival, &mut self.departures.facing);
        }
        self.departures.uv = arrivals.uv;
        self.departures.direction = *directions;
        if self.space == Space::Discrete
            && let Some(scatter) = self.scene.points_of_groups()
        {
            scatter.spread(self.scene.surfaces(), survived, &arrivals.face, points, &mut self.departures);
        }
    }

    /// Walks set out in the places of those that have ended. Where none is left, the last ones move there.
    #[inline(always)]
    fn replace<B: Nursery<C>>(
        &mut self,
        ended: Lanes,
        newborns: &mut Newborns<B, N, impl Iterator<Item = N::Place>>,
    ) {
        let mut vacant = Lanes::default();
        ended.each(|lane| {
            self.estimator.end(lane, self.generators.chance(lane));
            if !self.begin(lane, newborns) {
                vacant.insert(lane);
            }
        });
        if !vacant.is_empty() {
            self.close_up(vacant);
        }
    }

    #[cold]
    fn close_up(&mut self, vacant: Lanes) {
        for lane in (0..self.len).rev().filter(|&lane| vacant.has(lane)) {
            self.len -= 1;
            if lane != self.len {
                self.generators.copy(self.len, lane);
                self.departures.copy(self.len, lane);
                self.models[lane] = self.models[self.len];
                self.estimator.relocate(self.len, lane);
            }
        }
    }
}

/// [`Walker::stop_at_panes`]. It stands apart, so that scenes without panes do not pay for it.
#[inline(never)]
fn stop_at_panes(scene: &Scene, rays: &Rays, hits: &Hits, len: usize, survival: &mut [u64; WIDTH]) -> Lanes {
    let mut stopped = Lanes::default();
    for (lane, bits) in survival.iter_mut().enumerate().take(len) {
        let t = hits.get(lane).map_or(f64::INFINITY, |hit| hit.t);
        match thin(*bits, scene.passed_panes(&rays.get(lane), t)) {
            Some(rest) => *bits = rest,
            None => stopped.insert(lane),
        }
    }
    stopped
}

impl Counts {
    /// Counts the end of a walk, and the weights it took along in fixed point.
    #[inline(always)]
    fn end<const C: usize>(&mut self, end: WalkEnd, weights: [f64; C]) {
        let (walks, taken) = match end {
            WalkEnd::Absorbed => {
                self.absorbed += 1;
                return;
            }
            WalkEnd::AbsorbedBack => (&mut self.absorbed_back, &mut self.absorbed_back_weight),
            WalkEnd::Escaped => (&mut self.escaped, &mut self.escaped_weight),
            WalkEnd::Truncated => (&mut self.truncated, &mut self.truncated_weight),
        };
        *walks += 1;
        for (taken, weight) in taken.iter_mut().zip(weights) {
            *taken += (weight * Counts::WEIGHT_UNITS + 0.5) as u128;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tally::HitScoreboard;
    use crate::walk::plain;
    use crate::{
        Birth, Shape, Sides, SurfaceSpec,
        lamps::{Emission, LampSpec},
        surfaces::PaneSpec,
    };
    use crate::{
        Direction, Estimator, Experiment, IndexChoice, SceneSpec, Tally, Walks,
        methods::{InfiniteEnd, Score},
    };
    use glam::DVec3;

    /// A room with a two-sided plate and a triangle in rows, open at the top.
    fn room() -> SceneSpec {
        let quad = |corner: DVec3, u: DVec3, v: DVec3| Shape::Parallelogram {
            corner,
            corner_u: corner + u,
            corner_v: corner + v,
            cells: [3, 2],
        };
        let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
        let triangle = Shape::Triangle { a: 0.1 * x, b: x - 0.1 * z, c: 0.9 * y + 0.1 * z, rows: 3 };
        let shapes = [
            (quad(DVec3::ZERO, x, y), Sides::Front),
            (quad(DVec3::ZERO, y, z), Sides::Front),
            (quad(x, z, y), Sides::Front),
            (quad(0.2 * (x + y) + 0.6 * z, 0.5 * x, 0.4 * y + 0.1 * z), Sides::Both),
            (triangle, Sides::Both),
            (Shape::Triangle { a: y, b: y + z, c: x + y, rows: 1 }, Sides::Front),
        ];
        let surface = |(i, (shape, sides)): (usize, (Shape, Sides))| SurfaceSpec {
            name: None,
            shape,
            sides,
            reflectance: (0.3 + 0.1 * i as f64).into(),
            emittance: (i as f64).into(),
            cell_emittance: vec![],
            transmittance: Default::default(),
        };
        SceneSpec::new(shapes.into_iter().enumerate().map(surface).collect())
    }

    /// The room with coincident surfaces: a floor written twice, a rug on it, a plate that is written three times, a
    /// triangle over part of a wall.
    fn layered_room() -> SceneSpec {
        let mut spec = room();
        let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
        let cells = [2, 2];
        let rug = Shape::Parallelogram {
            corner: 0.2 * x + 0.1 * y,
            corner_u: 0.9 * x + 0.1 * y,
            corner_v: 0.2 * x + 0.7 * y,
            cells,
        };
        let patch = Shape::Triangle { a: 0.1 * y, b: 0.8 * y + 0.1 * z, c: 0.2 * y + 0.9 * z, rows: 2 };
        let mut add = |shape: Shape, sides: Sides| {
            let like = spec.surfaces[0].clone();
            spec.surfaces.push(SurfaceSpec { shape, sides, emittance: 0.3.into(), ..like });
        };
        let [floor, plate] = [0, 3].map(|i| room().surfaces[i].shape.clone());
        add(floor, Sides::Front);
        add(rug, Sides::Both);
        add(plate.clone(), Sides::Front);
        add(plate, Sides::Both);
        add(patch, Sides::Both);
        spec
    }

    /// The room with groups: cells of one surface in threes, and all cells of the triangles with two sides.
    fn grouped_room() -> SceneSpec {
        let mut spec = room();
        let triangle = Shape::Triangle { a: DVec3::X, b: DVec3::X + DVec3::Y, c: DVec3::ONE, rows: 2 };
        let like = spec.surfaces[4].clone();
        spec.surfaces.push(SurfaceSpec { shape: triangle, ..like });
        let labels: Vec<u32> = (0..4 * 6 + 9 + 1 + 4)
            .map(|cell| match cell {
                0..24 => cell % 2 + 2 * (cell / 6),
                33 => cell,
                _ => 100,
            })
            .collect();
        spec.grouped(&labels)
    }

    /// The room with leaves on two walls and on the plate of two sides.
    fn divided_room() -> SceneSpec {
        let mut spec = room();
        for (surface, cuts) in [(0, "uvu..v..v.u.v.u.."), (2, "."), (3, "vu.v..u..")] {
            let shape = &mut spec.surfaces[surface].shape;
            let (corner, u, v) = shape.edges();
            let leaves = cuts.parse().unwrap();
            *shape = Shape::Divided { corner, corner_u: corner + u, corner_v: corner + v, leaves };
        }
        spec
    }

    /// The room with lamps without area of all kinds.
    fn room_with_lamps() -> SceneSpec {
        let mut spec = room();
        let file =
            "TILT=NONE\n1 -1 1 3 3 1 2 0 0 0\n1 1 10\n0 60 170\n0 90 180\n90 80 5\n90 10 0\n90 50 60\n";
        spec.lamps.tables = vec![photometry::Luminaire::read(file.as_bytes()).unwrap().distribution];
        let at = |x: f64, emission: Emission| LampSpec::new(DVec3::new(x, 0.3, 0.8), emission, 2.0);
        spec.lamps.list = vec![
            at(0.2, Emission::Uniform),
            at(0.4, Emission::Spot { inner: 0.8, outer: -0.1 }).aimed(DVec3::new(1.0, 2.0, 0.5), 10.0),
            at(0.6, Emission::Table(0)).aimed(DVec3::new(0.1, -0.2, -1.0), 70.0),
            at(0.0, Emission::Distant { rim: 0.9 }).aimed(DVec3::new(0.3, 0.4, -1.0), 0.0),
            LampSpec { strength: 0.0.into(), ..at(0.5, Emission::Uniform) },
        ];
        spec
    }

    /// The room whose light is that of lamps with tables alone, or of lamps without.
    fn room_lit_by_lamps(have_tables: bool) -> SceneSpec {
        let mut spec = room_with_lamps();
        spec.surfaces.iter_mut().for_each(|surface| surface.emittance = 0.0.into());
        spec.lamps.list.retain(|lamp| matches!(lamp.emission, Emission::Table(_)) == have_tables);
        spec
    }

    /// The room with lamps, and with panes across it, two of them in one place.
    fn room_with_panes() -> SceneSpec {
        let mut spec = room_with_lamps();
        let pane = |corner: DVec3, u: DVec3, v: DVec3, transmittance: f64| {
            let shape = Shape::parallelogram(corner, u, v, [1, 1]);
            PaneSpec { name: String::new(), shape, transmittance }
        };
        let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
        spec.panes = vec![
            pane(0.5 * z, x, y, 0.8),
            pane(0.1 * x, y, z, 0.3),
            pane(0.1 * x, z, y, 0.9),
            pane(0.7 * x, 0.5 * (y + z), z, 0.05),
        ];
        let triangle = Shape::Triangle { a: 0.9 * z, b: 0.9 * z + x, c: 0.9 * z + y, rows: 1 };
        spec.panes.push(PaneSpec { name: String::new(), shape: triangle, transmittance: 0.5 });
        spec
    }

    /// The room with lamps and panes, whose plate and triangle pass light on.
    fn room_with_sheets() -> SceneSpec {
        let mut spec = room_with_panes();
        for (surface, transmittance) in [(3, 0.35), (4, 0.2)] {
            spec.surfaces[surface].transmittance = transmittance.into();
        }
        spec
    }

    /// A closed cube in which walks are long.
    fn bright_cube() -> SceneSpec {
        let (o, e, axes) = (DVec3::ZERO, DVec3::ONE, DVec3::AXES);
        let side = |i: usize| {
            let (u, v) = (axes[(i + 1) % 3], axes[(i + 2) % 3]);
            if i < 3 { (o, u, v) } else { (e, -v, -u) }
        };
        let surface = |i| {
            let (corner, u, v) = side(i);
            SurfaceSpec {
                name: None,
                shape: Shape::Parallelogram {
                    corner,
                    corner_u: corner + u,
                    corner_v: corner + v,
                    cells: [2, 1],
                },
                sides: Sides::Front,
                reflectance: 0.99.into(),
                emittance: 1.0.into(),
                cell_emittance: vec![],
                transmittance: Default::default(),
            }
        };
        SceneSpec::new((0..6).map(surface).collect())
    }

    fn tally(scene: Scene, method: &Walks) -> Tally {
        let experiment = Experiment::unchecked(scene, method.clone().into()).unwrap();
        let mut board = experiment.board();
        experiment.walk(&Sequence::new(7), 5..4_005, &mut board);
        board.take().unwrap()
    }

    #[test]
    fn walks_side_by_side_are_plain_walks() {
        for (spec, index) in [
            (room(), IndexChoice::Flat),
            (room(), IndexChoice::Tree),
            (layered_room(), IndexChoice::Flat),
            (layered_room(), IndexChoice::Tree),
            (grouped_room(), IndexChoice::Flat),
            (grouped_room(), IndexChoice::Tree),
            (divided_room(), IndexChoice::Flat),
            (divided_room(), IndexChoice::Tree),
            (room_with_lamps(), IndexChoice::Flat),
            (room_with_lamps(), IndexChoice::Tree),
            (room_lit_by_lamps(true), IndexChoice::Flat),
            (room_lit_by_lamps(false), IndexChoice::Flat),
            (room_with_panes(), IndexChoice::Flat),
            (room_with_panes(), IndexChoice::Tree),
            (room_with_sheets(), IndexChoice::Flat),
            (room_with_sheets(), IndexChoice::Tree),
            (bright_cube(), IndexChoice::Flat),
        ] {
            for space in [Space::Discrete, Space::Continuous] {
                let scene = Scene::build(&spec, index).unwrap();
                for estimator in [Estimator::Collision, Estimator::Absorption, Estimator::Survival] {
                    let scores = |survives: bool| match estimator {
                        Estimator::Absorption => !survives,
                        Estimator::Survival => survives,
                        _ => true,
                    };
                    let mut board = HitScoreboard::<1>::new(scene.faces().len());
                    let mut counts = Counts::default();
                    for rng in Sequence::new(7).walks_from(5).take(4_000) {
                        let (mut scored, mut under_way) = (Vec::new(), true);
                        let end = plain::walk(&scene, space, rng, |face, survives| {
                            counts.rays += 1;
                            under_way = survives;
                            scored.extend(scores(survives).then_some(face));
                        });
                        counts.walks += 1;
                        // A ray that meets no active side, or is stopped by a pane, makes no arrival.
                        counts.rays += u64::from(under_way);
                        counts.end(end, [1.0]);
                        board.add_path(&scored, |_| [1]);
                    }
                    let method = Walks { space, ..Walks::shooting(estimator) };
                    let tally = tally(scene.clone(), &method);
                    let plain = board.take().unwrap();
                    assert_eq!(tally.sums(), plain.sums(), "{estimator:?}, {space:?}, {index:?}");
                    assert_eq!(tally.counts, counts, "{estimator:?}, {space:?}, {index:?}");
                }
            }
        }
    }

    #[test]
    fn every_instruction_set_gives_the_same_bits() {
        let end = InfiniteEnd::Roulette { threshold: 0.01 };
        let scores: [fn(Estimator) -> Score; 2] = [Score::Of, Score::Linear];
        for spec in
            [room(), grouped_room(), divided_room(), room_with_lamps(), room_with_panes(), room_with_sheets()]
        {
            let on = |isa| Scene::build_for(&spec, IndexChoice::Flat, isa).unwrap();
            for estimator in [Estimator::Collision, Estimator::Absorption, Estimator::Infinite(end)] {
                for space in [Space::Discrete, Space::Continuous] {
                    for direction in [Direction::Shooting, Direction::Gathering(Birth::Area)] {
                        for score in scores.iter().map(|score| score(estimator)) {
                            let method = Walks { direction: direction.clone(), space, score };
                            let gathers = matches!(method.direction, Direction::Gathering(_));
                            if gathers && !spec.lamps.list.is_empty() {
                                continue;
                            }
                            let plain = tally(on(Isa::Portable), &method);
                            for isa in Isa::available() {
                                assert_eq!(tally(on(isa), &method), plain, "{isa:?}, {method:?}");
                            }
                        }
                    }
                }
            }
        }
    }
}
