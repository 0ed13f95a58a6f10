//! Rays that faces shoot, a batch at a time.

use super::faces::FaceTable;
use super::lamps::kernel;
use super::numbers::RayNumbers;
use super::place::LocalPoint;
use crate::geometry::face::Face;
use crate::random::rng::WalkRng;
use crate::random::sobol::Points;
use crate::scene::{Scene, SurfaceCell};
use crate::simd::batch::WIDTH;
use crate::trace::ray::{Hits, Rays};
use crate::trace::tree::Scratch;
use crate::walk::Space;
use crate::walk::arrive::Arrivals;
use crate::walk::depart::Departures;

/// Shoots rays from faces.
pub(crate) struct Caster<'a> {
    faces: &'a FaceTable<'a>,
    numbers: RayNumbers,
    /// Rays that each face has shot.
    pub(crate) shot: Vec<u32>,
    /// Rays that landed on each face.
    pub(crate) landed: Vec<u64>,
    /// Rays of each face that left the scene, that ended on backs.
    pub(crate) lost: Vec<[u32; 2]>,
    batch: Box<LinkBatch>,
}

/// Rays that are traced together.
struct LinkBatch {
    len: usize,
    /// The faces they leave.
    from: [u32; WIDTH],
    /// The cells of surfaces that these are; the first ones of groups.
    cell: [u32; WIDTH],
    departures: Departures,
    rays: Rays,
    hits: Hits,
    arrivals: Arrivals,
    scratch: Scratch,
}

/// A ray that is traced.
pub(crate) struct Meeting<'a> {
    scene: &'a Scene,
    batch: &'a LinkBatch,
    ray: usize,
}

impl Meeting<'_> {
    /// Where it leaves, and where it meets a surface.
    pub(super) fn ends(&self) -> [LocalPoint; 2] {
        let LinkBatch { departures, hits, .. } = self.batch;
        let at = |uv: &[[f64; WIDTH]; 2]| [uv[0][self.ray], uv[1][self.ray]];
        [(departures.surface[self.ray], at(&departures.uv)), (hits.surface[self.ray], at(&hits.uv))]
    }

    /// k = cos θ cos θ′/(πr²) between the ends [1/m²]; infinite where they are one point.
    pub(super) fn kernel(&self) -> f64 {
        let LinkBatch { departures, rays, hits, .. } = self.batch;
        let normal = |surface: u32| self.scene.surfaces()[surface as usize].normal();
        let direction = rays.get(self.ray).direction;
        let leaves = normal(departures.surface[self.ray]).dot(direction) * departures.facing[self.ray];
        let arrives = -normal(hits.surface[self.ray]).dot(direction) * hits.facing[self.ray];
        kernel(leaves, arrives, hits.t[self.ray])
    }
}

/// Draws for `arrive` that stand for none: a ray of a chain ends where it lands, so survival, point and direction are
/// not used.
static NO_DRAWS: [[u64; WIDTH]; 3] = [[0; WIDTH]; 3];

impl Default for LinkBatch {
    fn default() -> Self {
        LinkBatch {
            len: 0,
            from: [0; WIDTH],
            cell: [0; WIDTH],
            departures: Departures::default(),
            rays: Rays::default(),
            hits: Hits::default(),
            arrivals: Arrivals::default(),
            scratch: Scratch::default(),
        }
    }
}

impl<'a> Caster<'a> {
    /// A caster with the numbers of this one, whose faces have shot as many rays and landed none.
    pub(super) fn fresh_copy(&self) -> Self {
        Caster { shot: self.shot.clone(), ..self.afresh() }
    }

    /// A caster with the numbers of this one that has shot nothing yet.
    pub(super) fn afresh(&self) -> Self {
        Caster::new(self.faces, self.numbers.clone())
    }

    /// A caster that has shot nothing yet.
    pub(crate) fn new(faces: &'a FaceTable, numbers: RayNumbers) -> Self {
        let count = faces.list.len();
        Caster {
            faces,
            numbers,
            shot: vec![0; count],
            landed: vec![0; count],
            lost: vec![[0; 2]; count],
            batch: Box::default(),
        }
    }

    /// Rays shot so far.
    pub(crate) fn rays(&self) -> u64 {
        self.shot.iter().map(|&shot| u64::from(shot)).sum()
    }

    /// The chain's own generator.
    pub(crate) fn rng(&mut self) -> &mut WalkRng {
        self.numbers.rng()
    }

    /// Shoots `rays[k]` more rays from each face `first` + k, face by face; `land(i, j, meeting)` for each of face i that lands
    /// on a face j. `None` once `go_on` says no, which is asked for every batch.
    pub(crate) fn cast(
        &mut self,
        first: usize,
        rays: &[u32],
        go_on: &dyn Fn() -> bool,
        land: impl FnMut(u32, u32, &Meeting),
    ) -> Option<()> {
        self.cast_all(first, rays, go_on, land, |_, _| {})
    }

    /// [`Caster::cast`], with `lose(i, meeting)` for each ray of face i that lands on no face.
    pub(super) fn cast_all(
        &mut self,
        first: usize,
        rays: &[u32],
        go_on: &dyn Fn() -> bool,
        mut land: impl FnMut(u32, u32, &Meeting),
        mut lose: impl FnMut(u32, &Meeting),
    ) -> Option<()> {
        for (i, &more) in (first..).zip(rays).filter(|(_, more)| **more > 0) {
            let (number, face) = (i as u32, &self.faces.list[i]);
            self.numbers.leave(number, self.shot[i]);
            self.shot[i] += more;
            for _ in 0..more {
                self.numbers.draw(self.batch.len);
                self.batch.push(self.faces.scene, number, face);
                if self.batch.len == WIDTH {
                    self.trace(&mut land, &mut lose);
                    if !go_on() {
                        return None;
                    }
                }
            }
        }
        self.trace(&mut land, &mut lose);
        Some(())
    }

    /// Takes over where the rays of another caster went.
    pub(super) fn take_over(&mut self, other: &Self) {
        self.landed.iter_mut().zip(&other.landed).for_each(|(sum, landed)| *sum += landed);
        for (sum, lost) in self.lost.iter_mut().zip(&other.lost) {
            *sum = [sum[0] + lost[0], sum[1] + lost[1]];
        }
    }

    /// Traces the batch and reports where its rays land.
    fn trace(&mut self, land: &mut impl FnMut(u32, u32, &Meeting), lose: &mut impl FnMut(u32, &Meeting)) {
        let (scene, batch) = (self.faces.scene, &mut *self.batch);
        let len = std::mem::take(&mut batch.len);
        batch.leave(scene, len, self.numbers.points(scene.parts.isa));
        scene.parts.index.closest_hits(&scene.parts.facets, &batch.rays, &mut batch.scratch, &mut batch.hits);
        batch.arrivals.locate(scene.parts.isa, scene, Space::Discrete, len, &batch.hits, &NO_DRAWS);
        for (i, &from) in batch.from.iter().enumerate().take(len) {
            if batch.arrivals.active.has(i) {
                let to = batch.arrivals.face[i];
                self.landed[to as usize] += 1;
                land(from, to, &Meeting { scene, batch, ray: i });
            } else {
                let back = batch.arrivals.met.has(i);
                self.lost[from as usize][usize::from(back)] += 1;
                lose(from, &Meeting { scene, batch, ray: i });
            }
        }
    }
}

impl LinkBatch {
    /// Adds a ray from a face; there must be room.
    #[inline(always)]
    fn push(&mut self, scene: &Scene, number: u32, face: &Face) {
        let i = self.len;
        self.from[i] = number;
        self.cell[i] = scene.surfaces()[face.surface as usize].cell_of(face);
        self.departures.surface[i] = face.surface;
        self.departures.facing[i] = face.side.sign();
        self.len += 1;
    }

    /// Turns the points of the first `len` rays into rays: two numbers for the place, two for the direction.
    fn leave(&mut self, scene: &Scene, len: usize, points: &Points) {
        let [across, along, polar, turn] = points;
        for i in 0..len {
            let (cell, bits) = (
                SurfaceCell { surface: self.departures.surface[i], cell: self.cell[i] },
                u64::from(across[i]) << 32 | u64::from(along[i]),
            );
            let (surface, place) = scene.scatter(cell, self.from[i], bits);
            self.departures.surface[i] = surface;
            [self.departures.uv[0][i], self.departures.uv[1][i]] = place;
            self.departures.direction[i] = u64::from(polar[i]) << 32 | u64::from(turn[i]);
        }
        self.departures.leave(scene.parts.isa, &scene.parts.frames, len, &mut self.rays);
    }
}

/// Whole numbers of rays in proportion to `shares` ≥ 0, `total` in all: systematic, from an offset in [0, 1), so that
/// each expects its share and gets one of the two whole numbers next to it. Where no share is above 0, all are alike.
pub(crate) fn systematic(shares: &[f64], total: u64, offset: f64) -> Vec<u32> {
    let sum: f64 = shares.iter().sum();
    let alike = if sum > 0.0 { 0.0 } else { 1.0 };
    let per_share = total as f64 / (sum + alike * shares.len() as f64);
    let (mut cumulated, mut before) = (0.0, 0);
    let counts = shares.iter().enumerate().map(|(i, share)| {
        cumulated += share + alike;
        let last = i + 1 == shares.len();
        // The last sum may err by a rounding; the total may not.
        let end = if last { total } else { ((cumulated * per_share + offset) as u64).clamp(before, total) };
        (end - std::mem::replace(&mut before, end)) as u32
    });
    counts.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn systematic_shares_are_rounded_to_a_neighbour_and_add_up() {
        let shares = [0.5, 0.0, 3.25, 1e-9, 6.25];
        for offset in [0.0, 0.3, 0.999] {
            for total in [0, 1, 10, 1_000_003] {
                let counts = systematic(&shares, total, offset);
                assert_eq!(counts.iter().map(|&count| u64::from(count)).sum::<u64>(), total);
                for (count, share) in counts.iter().zip(shares) {
                    assert!((f64::from(*count) - share / 10.0 * total as f64).abs() < 1.001, "{counts:?}");
                }
            }
        }
        assert_eq!(systematic(&[0.0, 0.0], 4, 0.5).iter().sum::<u32>(), 4);
    }
}
