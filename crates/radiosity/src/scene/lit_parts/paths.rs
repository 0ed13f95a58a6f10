//! Paths of reflections backwards, from points of faces: what each of them sees.

use glam::DVec3;

use super::super::Scene;
use super::super::births::Birthplace;
use super::super::sealed::GRAZING;
use super::super::view::Lookout;
use crate::geometry::sensor::Response;
use crate::geometry::spec::Side;
use crate::random::rng::WalkRng;
use crate::trace::ray::{Hit, Ray};

/// The most rays that a path goes on by.
pub(super) const LENGTH: usize = 8;

/// By face, what paths ask of it.
#[derive(Debug)]
pub(super) struct Kinds {
    pub(super) reflects: Vec<bool>,
    pub(super) emits: Vec<bool>,
}

impl Kinds {
    pub(super) fn of(scene: &Scene) -> Self {
        let faces = scene.faces();
        let reflects = faces.iter().map(|face| face.reflectance.is_lit()).collect();
        Kinds { reflects, emits: faces.iter().map(|face| face.emittance.is_lit()).collect() }
    }

    /// Whether a ray has met an emitter.
    fn emits(&self, scene: &Scene, hit: &Hit) -> bool {
        face_met(scene, hit).is_some_and(|face| self.emits[face as usize])
    }

    /// Where a hit is on an active side that reflects: the point, and its face.
    pub(super) fn reflecting(&self, scene: &Scene, hit: &Hit) -> Option<(SurfacePoint, u32)> {
        let face = face_met(scene, hit)?;
        let uv = scene.surfaces()[hit.surface as usize].inside(hit.uv);
        let point = SurfacePoint { surface: hit.surface, side: hit.side, uv };
        self.reflects[face as usize].then_some((point, face))
    }
}

/// A point on one side of a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfacePoint {
    pub(super) surface: u32,
    pub(super) side: Side,
    pub(super) uv: [f64; 2],
}

/// The face that a ray has met; `None` where that is an inactive back.
fn face_met(scene: &Scene, hit: &Hit) -> Option<u32> {
    let surface = &scene.surfaces()[hit.surface as usize];
    surface.is_active(hit.side).then(|| scene.face_at(hit.surface, surface.cell_at(hit.uv), hit.side))
}

impl SurfacePoint {
    pub(super) fn place(&self, scene: &Scene) -> DVec3 {
        scene.surfaces()[self.surface as usize].point(self.uv)
    }

    /// The normal on the point's side.
    fn normal(&self, scene: &Scene) -> DVec3 {
        scene.surfaces()[self.surface as usize].normal() * self.side.sign()
    }

    /// A ray by the cosine law.
    pub(super) fn scattered(&self, scene: &Scene, rng: &mut WalkRng) -> Ray {
        let direction = scene.surfaces()[self.surface as usize].direction(self.side, rng.bits());
        Ray { origin: self.place(scene), direction, from: self.surface }
    }

    /// The ray to a place; `None` where the place is not on the point's side, or so near to its plane that rounding decides.
    fn towards(&self, scene: &Scene, place: DVec3) -> Option<Ray> {
        let origin = self.place(scene);
        let direction = (place - origin).try_normalize()?;
        (direction.dot(self.normal(scene)) > GRAZING).then_some(Ray { origin, direction, from: self.surface })
    }

    /// Whether a ray that was aimed at this point has met it: a surface is flat, so that there is no other place where it may be met.
    fn is_met(&self, hit: &Hit) -> bool {
        (hit.surface, hit.side) == (self.surface, self.side)
    }
}

/// What a path has seen.
pub(super) enum PathHit {
    /// An emitter, or a place known to be lit.
    Light,
    /// One of the points of faces.
    Point(u32),
}

/// What paths go over.
pub(super) struct Ground<'a> {
    pub(super) scene: &'a Scene,
    pub(super) kinds: &'a Kinds,
    pub(super) points: &'a [SurfacePoint],
    /// By point: where it is.
    pub(super) places: &'a [DVec3],
    pub(super) first: &'a [u32],
}

/// Paths of reflections backwards, from points.
pub(super) struct Paths<'a> {
    pub(super) ground: &'a Ground<'a>,
    pub(super) rng: WalkRng,
}

impl Paths<'_> {
    /// Follows a path from each of these points; `tell` is told the number of the start, and what the path has seen. A path ends where it
    /// sees light, leaves the scene, or meets what does not reflect. Whether a start sees a point is looked for where that is `news`.
    pub(super) fn follow(
        &mut self,
        starts: &[SurfacePoint],
        lit_places: &[SurfacePoint],
        news: impl Fn(usize, u32) -> bool,
        mut tell: impl FnMut(usize, PathHit),
    ) {
        let mut lookout = Lookout::new(self.ground.scene);
        let mut at: Vec<(usize, SurfacePoint)> = starts.iter().copied().enumerate().collect();
        for _ in 0..LENGTH {
            at.retain(|&(start, point)| {
                let is_lit = self.sees_lamp(&point);
                if is_lit {
                    tell(start, PathHit::Light);
                }
                !is_lit
            });
            self.look_for_light(&mut lookout, &mut at, lit_places, &mut tell);
            self.go_on(&mut lookout, &mut at, &news, &mut tell);
        }
    }

    /// Whether a lamp without area, chosen at random, lights a point.
    fn sees_lamp(&mut self, point: &SurfacePoint) -> bool {
        let scene = self.ground.scene;
        if scene.lamp_count() == 0 {
            return false;
        }
        let [lamp, bits] = std::array::from_fn(|_| self.rng.bits());
        let facing = Response::Flat { facing: point.normal(scene) };
        let lamp = choice(lamp, scene.lamp_count());
        scene.lamp_light(lamp, point.place(scene), facing, point.surface, bits).is_some()
    }

    /// From each point, a ray to an emitter or to a place known to be lit.
    fn look_for_light(
        &mut self,
        lookout: &mut Lookout,
        at: &mut Vec<(usize, SurfacePoint)>,
        lit_places: &[SurfacePoint],
        tell: &mut impl FnMut(usize, PathHit),
    ) {
        let scene = self.ground.scene;
        let mut aimed: Vec<(usize, Option<SurfacePoint>)> = Vec::new();
        let mut rays = Vec::new();
        for (number, (_, point)) in at.iter().enumerate() {
            let lit = lit_places.get(choice(self.rng.bits(), lit_places.len())).copied();
            let target = if self.rng.bits() & 1 == 0 { None } else { lit };
            let place = target.map_or_else(|| self.place_on_emitter(), |lit| Some(lit.place(scene)));
            if let Some(ray) = place.and_then(|place| point.towards(scene, place)) {
                rays.push(ray);
                aimed.push((number, target));
            }
        }
        let mut lit = vec![false; at.len()];
        let kinds = self.ground.kinds;
        lookout.each_closest_hit(&rays, |ray, hit| {
            let Some(hit) = hit else { return };
            let (number, target) = aimed[ray];
            lit[number] |= kinds.emits(scene, &hit) || target.is_some_and(|target| target.is_met(&hit));
        });
        let mut number = 0;
        at.retain(|&(start, _)| {
            number += 1;
            if lit[number - 1] {
                tell(start, PathHit::Light);
            }
            !lit[number - 1]
        });
    }

    /// From each point, a ray by the cosine law; and one to the nearest of the points of the face that it meets.
    fn go_on(
        &mut self,
        lookout: &mut Lookout,
        at: &mut Vec<(usize, SurfacePoint)>,
        news: &impl Fn(usize, u32) -> bool,
        tell: &mut impl FnMut(usize, PathHit),
    ) {
        let Ground { scene, kinds, .. } = *self.ground;
        let rays: Vec<Ray> = at.iter().map(|(_, point)| point.scattered(scene, &mut self.rng)).collect();
        let (mut next, mut beside, mut to_points) = (Vec::new(), Vec::new(), Vec::new());
        lookout.each_closest_hit(&rays, |ray, hit| {
            let Some(hit) = hit else { return };
            let (start, from) = at[ray];
            if kinds.emits(scene, &hit) {
                return tell(start, PathHit::Light);
            }
            let Some((met, face)) = kinds.reflecting(scene, &hit) else { return };
            let beside_it = self.beside(&met, face).filter(|&number| news(start, number));
            if let Some((ray, number)) = beside_it.and_then(|number| Some((self.ray(&from, number)?, number)))
            {
                to_points.push(ray);
                beside.push((start, number));
            }
            next.push((start, met));
        });
        lookout.each_closest_hit(&to_points, |ray, hit| {
            let (start, number) = beside[ray];
            if hit.is_some_and(|hit| self.ground.points[number as usize].is_met(&hit)) {
                tell(start, PathHit::Point(number));
            }
        });
        *at = next;
    }

    /// The point of faces that is nearest to where a face was met.
    fn beside(&self, met: &SurfacePoint, face: u32) -> Option<u32> {
        let Ground { scene, places, first, .. } = *self.ground;
        let (start, end) = first.get(face as usize).zip(first.get(face as usize + 1))?;
        let met = met.place(scene);
        let distance = |number: &u32| places[*number as usize].distance_squared(met);
        (*start..*end).min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }

    /// The ray from a place to a point of faces.
    fn ray(&self, from: &SurfacePoint, number: u32) -> Option<Ray> {
        from.towards(self.ground.scene, self.ground.places[number as usize])
    }

    /// A place on an emitter; `None` where a lamp without area was chosen.
    fn place_on_emitter(&mut self) -> Option<DVec3> {
        let scene = self.ground.scene;
        let [choice, place, point, direction] = std::array::from_fn(|_| self.rng.bits());
        match scene.emitters().choose::<1>([choice, place]).0 {
            Birthplace::Lamp(_) => None,
            Birthplace::Cell(_) => Some(scene.birth([choice, place, point, direction]).origin),
        }
    }
}

/// A number below `many` that 64 random bits choose.
fn choice(bits: u64, many: usize) -> usize {
    ((u128::from(bits) * many as u128) >> 64) as usize
}
