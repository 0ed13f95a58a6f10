//! The part of each face's area that light comes to, for walks that go on from where they arrive.
//!
//! A patch of a floor that lies half beneath a box is lit outside of the box and dark within. So it is points of faces that are lit or
//! dark here, not faces as in [`super::sealed`]: each face has points drawn at random, more where it is large, and light comes to a point if a
//! path of reflections joins the point to an emitter. Every ray goes from a point to a point, so that no path passes a wall which it
//! does not pass in a walk: *lit* is a proof (but for rounding). *Dark* is evidence: paths from a point try emitters, places known to be lit,
//! and the points beside those that they meet; points that see each other are joined into groups, and a group is dark if none of its paths has
//! found light. If one path in q finds light, n paths overlook it with probability (1 − 1/q)ⁿ. A group that
//! [`PATHS_PER_GROUP`] paths leave dark has hardly more than a thousandth of the light of what they meet, a tenth of a headline's floor. The part of a face is that of its points, an unbiased estimate, so that the
//! area over many faces is right even where a sliver of one is overlooked.

mod paths;

use std::collections::HashMap;
use std::sync::Mutex;

use glam::DVec3;

use self::paths::{Ground, Kinds, LENGTH, PathHit, Paths, SurfacePoint};
use super::Scene;
use super::sealed::Joined;
use super::view::Lookout;
use crate::executor::{ParallelFor, results};
use crate::random::rng::{Sequence, WalkRng};
use crate::trace::ray::Ray;

/// The seeds of points and of paths: what is lit is a function of the scene alone.
const SEED: u64 = 0x11A7;
const SEED_OF_PATHS: u64 = 0x11A8;

/// The paths that are followed together: each such block has random numbers of its own, so that it is the same on any thread.
const BLOCK: usize = 1 << 11;

/// The points of a scene that are shared out by the number of faces, and those shared out by area.
const POINTS: usize = 1 << 14;

/// The most points of a face.
const POINTS_PER_FACE: usize = 64;

/// The paths that a group of dark points starts: one that finds no more than a thousandth of the light overlooks it once in 60 times.
const PATHS_PER_GROUP: usize = 1 << 12;

/// All groups together start at most [`PATHS`] paths, or [`PATHS_PER_POINT`] for each point where that is more, and no more than [`MOST_PATHS`]
/// once each point has had one: 83,000 closed boxes among a million triangles took 60 s with seven paths a point, in which a coordinator answers no worker.
const PATHS: usize = 1 << 16;
const PATHS_PER_POINT: usize = 7;
const MOST_PATHS: usize = 1 << 21;

/// Paths from emitters, which find places known to be lit.
const FROM_LIGHT: usize = 1 << 11;

/// The points at which a face that walks have hit is searched for a lit sliver.
const SLIVER_POINTS: usize = 1024;

/// The group of points that light comes to.
const LIT: u32 = u32::MAX;

/// Points of the faces of a scene, lit or in dark groups.
#[derive(Debug)]
pub(crate) struct LitParts {
    /// By face, and one more: its first point.
    first: Vec<u32>,
    /// By point: the number of its dark group, or [`LIT`].
    groups: Vec<u32>,
    count: usize,
    /// Places known to be lit.
    lit_places: Vec<SurfacePoint>,
    kinds: Kinds,
    /// Of faces that walks have hit, and of which every point is dark: the lit part that was found, if any.
    slivers: Mutex<HashMap<u32, Option<f64>>>,
}

impl LitParts {
    pub(super) fn new(scene: &Scene, executor: &ParallelFor) -> Self {
        let mut rng = Sequence::new(SEED).walk(0);
        let kinds = Kinds::of(scene);
        let (points, first) = points_of_faces(scene, &mut rng);
        let lit_places = places_from_light(scene, &kinds, &mut rng);
        let places: Vec<DVec3> = points.iter().map(|point| point.place(scene)).collect();
        let mut search = PathSearch {
            ground: Ground { scene, kinds: &kinds, places: &places, points: &points, first: &first },
            executor,
            blocks: 0,
            reflects: faces_of(&first).map(|face| kinds.reflects[face]).collect(),
            joined: Joined::new(points.len()),
            lit: vec![false; points.len()],
            waiting: Vec::new(),
        };
        let dark = search.run(lit_places.clone());
        let (mut numbers, mut groups) = (vec![LIT; points.len()], vec![LIT; points.len()]);
        let mut count = 0;
        for point in dark {
            let number = &mut numbers[search.joined.root(point) as usize];
            if *number == LIT {
                *number = count;
                count += 1;
            }
            groups[point as usize] = *number;
        }
        LitParts { first, groups, count: count as usize, lit_places, kinds, slivers: Mutex::default() }
    }

    /// By face: the part of its area that light comes to, above 0 where walks have hit the face.
    ///
    /// A hit on a face all of whose points are dark has one of two reasons. Either the face has a lit sliver between its points, which is looked for;
    /// or light comes to a group by a way that no path has found, and then all of that group counts as lit.
    pub(crate) fn given(&self, scene: &Scene, hit: &[bool], executor: &ParallelFor) -> Vec<f64> {
        let mut found = vec![false; self.count];
        let in_doubt = (0..hit.len()).filter(|&face| hit[face] && self.is_dark(face));
        let slivers = self.slivers_of(scene, in_doubt.map(|face| face as u32).collect(), executor);
        for (&face, _) in slivers.iter().filter(|(_, sliver)| sliver.is_none()) {
            self.of_face(face as usize).iter().for_each(|&group| found[group as usize] = true);
        }
        let is_lit = |group: &&u32| **group == LIT || found[**group as usize];
        let part = |face: usize| {
            let groups = self.of_face(face);
            match groups.iter().filter(is_lit).count() {
                0 if hit[face] => slivers[&(face as u32)].expect("its groups are lit if it has none"),
                lit => lit as f64 / groups.len() as f64,
            }
        };
        (0..hit.len()).map(part).collect()
    }

    /// The groups of the points of a face.
    fn of_face(&self, face: usize) -> &[u32] {
        &self.groups[self.first[face] as usize..self.first[face + 1] as usize]
    }

    fn is_dark(&self, face: usize) -> bool {
        !self.of_face(face).contains(&LIT)
    }

    /// By face, of some whose own points are all dark: the lit part; `None` where more points are dark, too.
    fn slivers_of(
        &self,
        scene: &Scene,
        faces: Vec<u32>,
        executor: &ParallelFor,
    ) -> HashMap<u32, Option<f64>> {
        let mut known = self.slivers.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        let new: Vec<u32> = faces.iter().copied().filter(|face| !known.contains_key(face)).collect();
        let found = results(executor, new.len(), |number| self.sliver(scene, new[number]));
        known.extend(new.into_iter().zip(found));
        faces.into_iter().map(|face| (face, known[&face])).collect()
    }

    /// The lit part of a face whose own points are all dark; `None` where more points are dark, too.
    fn sliver(&self, scene: &Scene, face: u32) -> Option<f64> {
        let ground = Ground { scene, kinds: &self.kinds, places: &[], points: &[], first: &[] };
        let mut paths = Paths { ground: &ground, rng: Sequence::new(SEED).walk(1 + u64::from(face)) };
        let mut tried = 0;
        while tried < SLIVER_POINTS {
            let batch: Vec<SurfacePoint> = (0..64).map(|_| point_of(scene, face, &mut paths.rng)).collect();
            tried += batch.len();
            let mut lit = 0;
            paths.follow(
                &batch,
                &self.lit_places,
                |_, _| false,
                |_, seen| lit += usize::from(matches!(seen, PathHit::Light)),
            );
            if lit > 0 {
                return Some(lit as f64 / tried as f64);
            }
        }
        None
    }
}

/// By point: its face.
fn faces_of(first: &[u32]) -> impl Iterator<Item = usize> {
    first
        .windows(2)
        .enumerate()
        .flat_map(|(face, ends)| std::iter::repeat_n(face, (ends[1] - ends[0]) as usize))
}

/// Points of all faces, by face, and the first of each: by number or by area, where that is more, and one at least.
fn points_of_faces(scene: &Scene, rng: &mut WalkRng) -> (Vec<SurfacePoint>, Vec<u32>) {
    let all: f64 = scene.faces().iter().map(|face| face.area).sum();
    let (mut points, mut first) = (Vec::new(), vec![0]);
    let by_number = POINTS / scene.faces().len();
    for (number, face) in (0..).zip(scene.faces().iter()) {
        let by_area = (POINTS as f64 * face.area / all).ceil() as usize;
        let many = by_number.max(by_area);
        points.extend((0..many.clamp(1, POINTS_PER_FACE)).map(|_| point_of(scene, number, rng)));
        first.push(points.len() as u32);
    }
    (points, first)
}

/// A uniform point of a face.
fn point_of(scene: &Scene, face: u32, rng: &mut WalkRng) -> SurfacePoint {
    let faces = scene.faces();
    let piece = faces.piece(faces.pieces(face as usize).next().expect("a face has a piece"));
    let cell = scene.cell_of(&piece);
    let (surface, uv) = scene.scatter(cell, face, rng.bits());
    SurfacePoint { surface, side: piece.side, uv }
}

/// Reflecting places that paths from emitters arrive at.
fn places_from_light(scene: &Scene, kinds: &Kinds, rng: &mut WalkRng) -> Vec<SurfacePoint> {
    let mut places = Vec::new();
    let mut lookout = Lookout::new(scene);
    let mut rays: Vec<Ray> = (0..FROM_LIGHT).map(|_| scene.emit(rng)).collect();
    for _ in 0..LENGTH {
        let arrived: Vec<SurfacePoint> = lookout
            .closest_hits(&rays)
            .into_iter()
            .flatten()
            .filter_map(|hit| Some(kinds.reflecting(scene, &hit)?.0))
            .collect();
        rays = arrived.iter().map(|place| place.scattered(scene, rng)).collect();
        places.extend(arrived);
    }
    places
}

/// What paths have found so far.
struct PathSearch<'a> {
    ground: Ground<'a>,
    executor: &'a ParallelFor<'a>,
    /// How many blocks of paths were followed.
    blocks: u64,
    /// By point: whether its face reflects.
    reflects: Vec<bool>,
    /// Reflecting points that see each other.
    joined: Joined,
    /// Roots of what light comes to; points of black faces are their own roots.
    lit: Vec<bool>,
    /// Points of black faces, and the reflecting points that they see.
    waiting: Vec<[u32; 2]>,
}

impl PathSearch<'_> {
    /// Searches until every point is lit or its group has started enough paths; returns the points that are dark.
    fn run(&mut self, mut lit_places: Vec<SurfacePoint>) -> Vec<u32> {
        let from_light = lit_places.len();
        let all = self.lit.len() as u32;
        let most = PATHS.max((PATHS_PER_POINT * all as usize).min(MOST_PATHS));
        let mut dark: Vec<u32> = (0..all).collect();
        let (mut begun, mut spent, mut each) = (vec![0; all as usize], 0, 1);
        while spent < most {
            let starts = self.starts(&dark, &mut begun, each.min((most - spent).div_ceil(dark.len().max(1))));
            if starts.is_empty() {
                break;
            }
            self.follow(&starts, &lit_places);
            spent += starts.len();
            each *= 2;
            self.light_what_waits();
            dark.retain(|&point| !self.is_lit(point));
            lit_places.truncate(from_light);
            let shining = (0..all).filter(|&point| self.reflects[point as usize] && self.is_lit(point));
            let shining: Vec<u32> = shining.collect();
            lit_places.extend(shining.iter().map(|&point| self.ground.points[point as usize]));
        }
        dark
    }

    /// The starts of a round: of each dark point as many paths as its group still lacks of [`PATHS_PER_GROUP`], and at most `each`. `begun` counts the
    /// paths of each point.
    fn starts(&mut self, dark: &[u32], begun: &mut [usize], each: usize) -> Vec<u32> {
        let mut of_group: HashMap<u32, [usize; 2]> = HashMap::new();
        for &point in dark {
            let [points, paths] = of_group.entry(self.joined.root(point)).or_default();
            (*points, *paths) = (*points + 1, *paths + begun[point as usize]);
        }
        let mut starts = Vec::new();
        for &point in dark {
            let [points, paths] = of_group[&self.joined.root(point)];
            let lacking = PATHS_PER_GROUP.saturating_sub(paths).div_ceil(points).min(each);
            begun[point as usize] += lacking;
            starts.extend(std::iter::repeat_n(point, lacking));
        }
        starts
    }

    /// Follows a path from each of these points, in blocks.
    fn follow(&mut self, from: &[u32], lit_places: &[SurfacePoint]) {
        let roots: Vec<u32> = (0..self.lit.len() as u32).map(|point| self.joined.root(point)).collect();
        let blocks: Vec<&[u32]> = from.chunks(BLOCK).collect();
        let (ground, reflects, before) = (&self.ground, &self.reflects, self.blocks);
        let found = results(self.executor, blocks.len(), |number| {
            let block = blocks[number];
            let rng = Sequence::new(SEED_OF_PATHS).walk(before + number as u64);
            let starts: Vec<SurfacePoint> =
                block.iter().map(|&point| ground.points[point as usize]).collect();
            let news = |start: usize, point: u32| {
                reflects[point as usize] && roots[block[start] as usize] != roots[point as usize]
            };
            let mut seen = Vec::new();
            Paths { ground, rng }
                .follow(&starts, lit_places, news, |start, what| seen.push((block[start], what)));
            seen
        });
        self.blocks += blocks.len() as u64;
        for (start, what) in found.into_iter().flatten() {
            match what {
                PathHit::Light => self.light(start),
                PathHit::Point(point) if !self.reflects[start as usize] => self.waiting.push([start, point]),
                PathHit::Point(point) => {
                    let lit = self.is_lit(start) || self.is_lit(point);
                    let root = self.joined.join(start, point);
                    self.lit[root as usize] = lit;
                }
            }
        }
    }

    fn light(&mut self, point: u32) {
        let root = self.joined.root(point);
        self.lit[root as usize] = true;
    }

    fn is_lit(&mut self, point: u32) -> bool {
        let root = self.joined.root(point);
        self.lit[root as usize]
    }

    /// Light comes to points of black faces that see lit ones.
    fn light_what_waits(&mut self) {
        for [black, seen] in std::mem::take(&mut self.waiting) {
            if self.is_lit(seen) {
                self.light(black);
            } else {
                self.waiting.push([black, seen]);
            }
        }
    }
}
