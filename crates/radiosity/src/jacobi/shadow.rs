//! Shadow rays: from uniform points of faces to points of emitters, chosen in proportion to their power.

use super::faces::FaceTable;
use super::lamps::{EmittingPiece, EmittingPieces, kernel};
use super::numbers::RayNumbers;
use super::place::LocalPoint;
use crate::random::rng::unit_32;
use crate::random::sobol::Points;
use crate::simd::batch::WIDTH;
use crate::trace::ray::{Hits, Ray, Rays};
use crate::trace::tree::Scratch;

/// Shoots shadow rays. The n-th ray of a face is made of the n-th point of the face's own Sobol sequence: two numbers for the
/// place on the face, two for the lamp and the place on it.
pub(super) struct ShadowCaster<'a> {
    faces: &'a FaceTable<'a>,
    lamps: &'a EmittingPieces,
    numbers: RayNumbers,
    batch: Box<ShadowBatch>,
}

/// A shadow ray that reaches its lamp.
pub(super) struct LitShadowRay<'a> {
    /// The face that it leaves.
    pub(super) face: u32,
    /// Where it leaves.
    pub(super) place: LocalPoint,
    pub(super) lamp: &'a EmittingPiece,
    /// k of its ends [1/m²].
    pub(super) kernel: f64,
}

/// Rays that are traced together.
struct ShadowBatch {
    /// Points that are drawn, and the faces whose points they are.
    drawn: usize,
    face: [u32; WIDTH],
    /// Of each ray that is traced: the face that it leaves, the lamp, k of its ends [1/m²], and where it leaves.
    from: [u32; WIDTH],
    lamp: [u32; WIDTH],
    kernel: [f64; WIDTH],
    place: [LocalPoint; WIDTH],
    rays: Rays,
    hits: Hits,
    scratch: Scratch,
}

impl Default for ShadowBatch {
    fn default() -> Self {
        ShadowBatch {
            drawn: 0,
            face: [0; WIDTH],
            from: [0; WIDTH],
            lamp: [0; WIDTH],
            kernel: [0.0; WIDTH],
            place: [(0, [0.0; 2]); WIDTH],
            rays: Rays::default(),
            hits: Hits::default(),
            scratch: Scratch::default(),
        }
    }
}

impl<'a> ShadowCaster<'a> {
    pub(super) fn new(faces: &'a FaceTable, lamps: &'a EmittingPieces, numbers: RayNumbers) -> Self {
        ShadowCaster { faces, lamps, numbers, batch: Box::default() }
    }

    /// Shoots the first `rays[n]` rays of each face `first` + n; `see` is called for each that reaches its lamp. `None` once `go_on` says no, which is asked for every batch.
    pub(super) fn cast(
        &mut self,
        first: usize,
        rays: &[u32],
        go_on: &dyn Fn() -> bool,
        mut see: impl FnMut(&LitShadowRay),
    ) -> Option<()> {
        for (face, &rays) in (first as u32..).zip(rays).filter(|(_, rays)| **rays > 0) {
            self.numbers.leave(face, 0);
            for _ in 0..rays {
                let batch = &mut *self.batch;
                self.numbers.draw(batch.drawn);
                batch.face[batch.drawn] = face;
                batch.drawn += 1;
                if batch.drawn == WIDTH {
                    self.trace(&mut see);
                    if !go_on() {
                        return None;
                    }
                }
            }
        }
        self.trace(&mut see);
        Some(())
    }

    /// Traces the rays of the points that are drawn, and reports those that reach their lamps.
    fn trace(&mut self, see: &mut impl FnMut(&LitShadowRay)) {
        let (scene, batch) = (self.faces.scene, &mut *self.batch);
        batch.aim(self.faces, self.lamps, self.numbers.points(scene.parts.isa));
        scene.parts.index.closest_hits(&scene.parts.facets, &batch.rays, &mut batch.scratch, &mut batch.hits);
        for ray in 0..batch.rays.len {
            let lamp = &self.lamps.list[batch.lamp[ray] as usize];
            if (batch.hits.surface[ray], batch.hits.facing[ray])
                == (lamp.piece.surface, lamp.piece.side.sign())
            {
                let (face, place, kernel) = (batch.from[ray], batch.place[ray], batch.kernel[ray]);
                see(&LitShadowRay { face, place, lamp, kernel });
            }
        }
    }
}

impl ShadowBatch {
    /// Turns all points that are drawn into rays, but for those whose ends lie behind each other, which no light joins.
    fn aim(&mut self, faces: &FaceTable, lamps: &EmittingPieces, points: &Points) {
        let (scene, [across, along, choice, depth]) = (faces.scene, points);
        self.rays.len = 0;
        for i in 0..std::mem::take(&mut self.drawn) {
            let number = self.face[i];
            let face = &faces.list[number as usize];
            let cell = scene.cell_of(face);
            let bits = u64::from(across[i]) << 32 | u64::from(along[i]);
            let (from, place) = scene.scatter(cell, number, bits);
            let (lamp, rest) = lamps.choose(choice[i]);
            let piece = &lamps.list[lamp].piece;
            let [near, far] = [from, piece.surface].map(|surface| &scene.surfaces()[surface as usize]);
            let origin = near.point(place);
            let end = far.point(far.point_in_cell(far.cell_of(piece), [rest, unit_32(depth[i])]));
            let way = end - origin;
            let distance = way.length();
            let direction = way / distance;
            let leaves = near.normal().dot(direction) * face.side.sign();
            let arrives = -far.normal().dot(direction) * piece.side.sign();
            let kernel = kernel(leaves, arrives, distance);
            if kernel > 0.0 {
                let ray = self.rays.len;
                (self.from[ray], self.lamp[ray]) = (number, lamp as u32);
                (self.kernel[ray], self.place[ray]) = (kernel, (from, place));
                self.rays.push(&Ray { origin, direction, from });
            }
        }
    }
}
