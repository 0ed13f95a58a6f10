//! Faces that no path of light joins to an emitter, for walks that go on from any point of a face that they arrive on: backs, gaps
//! between bodies, closed boxes. [`super::lit_parts`] is for walks that go on from where they arrive.
//!
//! Light comes to a face that sees an emitter, or that sees a reflecting face which light comes to. Rays in random directions find out
//! which faces see each other, and rays towards emitters and lit faces find what is small; reflecting faces that see each other are joined into
//! groups, which light comes to as a whole or not at all. A group that its rays have joined to no light is called sealed. So a gap is overlooked where all rays of the whole group miss it: two rooms of
//! which one sends N rays are distinguished from one with an opening if the opening takes up less than some 3/N of what the walls see.

use glam::DVec3;

use super::Scene;
use super::view::Lookout;
use crate::geometry::face::Face;
use crate::geometry::spec::Side;
use crate::random::rng::{Sequence, WalkRng};
use crate::simd::batch::WIDTH;
use crate::trace::ray::Ray;

/// Directions that rise less than this above a plane lie in it, but for rounding: triangles of one plane do not see each other.
pub(super) const GRAZING: f64 = 1e-9;

/// The seed of the rays: which faces are sealed is a function of the scene alone.
const SEED: u64 = 0x5EA1;

/// The most rays for any scene.
const RAYS: usize = 1 << 17;

/// The rays that each face adds to these.
const RAYS_PER_FACE: usize = 8;

/// Births of walks that find what lamps without area light.
const LAMP_RAYS: usize = 1 << 14;

/// The group of faces that light comes to.
const LIT: u32 = u32::MAX;

/// The faces of a scene that no path of light was found to, in groups that see each other.
#[derive(Clone, Debug)]
pub struct Sealed {
    /// By face: the number of its group, or [`LIT`].
    groups: Vec<u32>,
    count: usize,
}

impl Sealed {
    /// The group of a face that no path of light was found to; `None` where light comes.
    pub fn group_of(&self, face: u32) -> Option<u32> {
        Some(self.groups[face as usize]).filter(|&group| group != LIT)
    }

    /// Of each group, whether one of its faces has a property.
    pub(crate) fn groups_with(&self, holds: impl Fn(u32) -> bool) -> Vec<bool> {
        let mut found = vec![false; self.count];
        for (face, &group) in (0..).zip(&self.groups) {
            if group != LIT && holds(face) {
                found[group as usize] = true;
            }
        }
        found
    }

    pub(super) fn new(scene: &Scene) -> Self {
        let mut search = LightSearch::new(scene);
        search.light_from_lamps();
        let faces = scene.faces().len();
        let most = RAYS + RAYS_PER_FACE * faces;
        let (mut spent, mut each) = (0, 1);
        let mut dark: Vec<u32> = (0..faces as u32).collect();
        while !dark.is_empty() {
            each = each.min((most - spent) / dark.len());
            if each == 0 {
                break;
            }
            search.shoot(&dark, each);
            spent += each * dark.len();
            each *= 2;
            search.light_what_sees_light();
            search.light_what_lamps_see(&dark);
            dark.retain(|&face| !search.is_lit(face));
        }
        let mut numbers = vec![LIT; faces];
        let mut groups = vec![LIT; faces];
        let mut count = 0;
        for face in dark {
            let root = search.joined.root(face);
            let number = &mut numbers[root as usize];
            if *number == LIT {
                *number = count;
                count += 1;
            }
            groups[face as usize] = *number;
        }
        Sealed { groups, count: count as usize }
    }
}

/// What rays have found so far.
struct LightSearch<'a> {
    scene: &'a Scene,
    rng: WalkRng,
    reflects: Vec<bool>,
    emits: Vec<bool>,
    /// Reflecting faces that see each other.
    joined: Joined,
    /// Roots of what light comes to; black faces are their own roots.
    lit: Vec<bool>,
    /// Black faces, and the reflecting faces that they see.
    waiting: Vec<[u32; 2]>,
    /// Reflecting faces that light comes to: rays are aimed at them.
    shining: Vec<u32>,
}

impl<'a> LightSearch<'a> {
    fn new(scene: &'a Scene) -> Self {
        let faces = || scene.faces().iter();
        LightSearch {
            scene,
            rng: Sequence::new(SEED).walk(0),
            reflects: faces().map(|face| face.reflectance.is_lit()).collect(),
            emits: faces().map(|face| face.emittance.is_lit()).collect(),
            joined: Joined::new(scene.faces().len()),
            lit: vec![false; scene.faces().len()],
            waiting: Vec::new(),
            shining: Vec::new(),
        }
    }

    fn is_lit(&mut self, face: u32) -> bool {
        let root = self.joined.root(face);
        self.lit[root as usize]
    }

    /// Shoots rays from each of these faces.
    fn shoot(&mut self, faces: &[u32], each: usize) {
        let scene = self.scene;
        let mut lookout = Lookout::new(scene);
        let (mut from, mut rays) = (Vec::with_capacity(WIDTH), Vec::with_capacity(WIDTH));
        let mut all = faces.iter().flat_map(|&face| (0..each).map(move |ray| (face, ray))).peekable();
        while all.peek().is_some() {
            from.clear();
            rays.clear();
            for (face, number) in all.by_ref().take(WIDTH) {
                from.push(face);
                rays.push(self.ray(face, number));
            }
            lookout.each_closest_hit(&rays, |ray, hit| {
                let Some(hit) = hit else { return };
                let surface = &scene.surfaces()[hit.surface as usize];
                if surface.is_active(hit.side) {
                    let met = scene.face_at(hit.surface, surface.cell_at(hit.uv), hit.side);
                    self.see(from[ray], met);
                }
            });
        }
    }

    /// Light comes to the faces that rays from lamps without area meet.
    fn light_from_lamps(&mut self) {
        let scene = self.scene;
        if scene.lamp_count() == 0 {
            return;
        }
        let rays: Vec<Ray> = (0..LAMP_RAYS).map(|_| scene.emit(&mut self.rng)).collect();
        let from_lamps: Vec<Ray> = rays.into_iter().filter(|ray| ray.from == Ray::FREE).collect();
        Lookout::new(scene).each_closest_hit(&from_lamps, |_, hit| {
            let Some(hit) = hit else { return };
            let surface = &scene.surfaces()[hit.surface as usize];
            if surface.is_active(hit.side) {
                let met = scene.face_at(hit.surface, surface.cell_at(hit.uv), hit.side);
                let root = self.joined.root(met);
                self.lit[root as usize] = true;
            }
        });
    }

    /// Light comes to the faces of which a lamp without area lights a point.
    fn light_what_lamps_see(&mut self, faces: &[u32]) {
        let scene = self.scene;
        if scene.lamp_count() == 0 {
            return;
        }
        for &face in faces {
            let (piece, from, uv) = self.point_of(face);
            let surface = &scene.surfaces()[from as usize];
            let normal = surface.normal() * piece.side.sign();
            scene.each_lamp_at(surface.point(uv), normal, from, |_, _| {
                let root = self.joined.root(face);
                self.lit[root as usize] = true;
            });
        }
    }

    /// A ray from a uniform point of a face: of every four, two by the cosine law, one towards an emitter, and one towards a lit
    /// face, where the face's side looks there.
    fn ray(&mut self, face: u32, number: usize) -> Ray {
        let (piece, from, uv) = self.point_of(face);
        let surface = &self.scene.surfaces()[from as usize];
        let origin = surface.point(uv);
        let direction = surface.direction(piece.side, self.rng.bits());
        let outwards = if piece.side == Side::Front { surface.normal() } else { -surface.normal() };
        let aim = self.aim(number).and_then(|place| (place - origin).try_normalize());
        Ray { origin, direction: aim.filter(|aim| aim.dot(outwards) > GRAZING).unwrap_or(direction), from }
    }

    /// The place that a ray is aimed at.
    fn aim(&mut self, number: usize) -> Option<DVec3> {
        let (surface, uv) = match number % 4 {
            1 => {
                let [choice, place, point] = std::array::from_fn(|_| self.rng.bits());
                return Some(self.scene.birth([choice, place, point, 0]).origin);
            }
            3 if !self.shining.is_empty() => {
                let which = (u128::from(self.rng.bits()) * self.shining.len() as u128) >> 64;
                let (_, surface, uv) = self.point_of(self.shining[which as usize]);
                (surface, uv)
            }
            _ => return None,
        };
        Some(self.scene.surfaces()[surface as usize].point(uv))
    }

    /// A uniform point of a face: its surface, and the coordinates there.
    fn point_of(&mut self, face: u32) -> (Face, u32, [f64; 2]) {
        let faces = self.scene.faces();
        let piece = faces.piece(faces.pieces(face as usize).next().expect("a face has a piece"));
        let cell = self.scene.cell_of(&piece);
        let (surface, uv) = self.scene.scatter(cell, face, self.rng.bits());
        (piece, surface, uv)
    }

    /// Notes that two faces see each other.
    fn see(&mut self, a: u32, b: u32) {
        for (sender, receiver) in [(a, b), (b, a)] {
            if self.emits[sender as usize] {
                let root = self.joined.root(receiver);
                self.lit[root as usize] = true;
            }
        }
        match [a, b].map(|face| self.reflects[face as usize]) {
            [true, true] => {
                let lit = self.is_lit(a) || self.is_lit(b);
                let root = self.joined.join(a, b);
                self.lit[root as usize] = lit;
            }
            [false, true] => self.waiting.push([a, b]),
            [true, false] => self.waiting.push([b, a]),
            [false, false] => {}
        }
    }

    /// Light comes to black faces that see lit ones.
    fn light_what_sees_light(&mut self) {
        for [black, seen] in std::mem::take(&mut self.waiting) {
            if self.lit[black as usize] {
                continue;
            }
            if self.is_lit(seen) {
                self.lit[black as usize] = true;
            } else {
                self.waiting.push([black, seen]);
            }
        }
        let faces = 0..self.reflects.len() as u32;
        self.shining = faces.filter(|&face| self.reflects[face as usize] && self.is_lit(face)).collect();
    }
}

/// Faces in groups: each points to another of its group, the root to itself.
pub(super) struct Joined(Vec<u32>);

impl Joined {
    /// Each face, or point, in a group of its own.
    pub(super) fn new(many: usize) -> Self {
        Joined((0..many as u32).collect())
    }

    pub(super) fn root(&mut self, mut face: u32) -> u32 {
        while self.0[face as usize] != face {
            let next = self.0[self.0[face as usize] as usize];
            self.0[face as usize] = next;
            face = next;
        }
        face
    }

    /// Joins two groups; returns the root of both.
    pub(super) fn join(&mut self, a: u32, b: u32) -> u32 {
        let (a, b) = (self.root(a), self.root(b));
        self.0[b as usize] = a;
        a
    }
}
