//! Rays that patches shoot: each patch goes on along its own scrambled Sobol sequence.

use crate::depart::Departures;
use crate::isa::{Isa, on_isa};
use crate::rng::unit_32;
use crate::scene::Scene;
use crate::sobol::{DIMENSIONS, Points, Sobol, scramble};
use crate::spec::Sides;
use crate::surface::Side;
use crate::trace::{Hits, Rays, WIDTH};
use crate::tree::Scratch;

/// Shoots rays from patches. The j-th ray of a patch is the j-th point of the patch's sequence, whenever it is shot.
pub(crate) struct Caster<'a> {
    scene: &'a Scene,
    /// Tells this chain's scramblings from those of others.
    key: u64,
    /// Rays that each patch has shot.
    pub(crate) shot: Vec<u32>,
    /// Rays that landed on each patch.
    pub(crate) landed: Vec<u64>,
    /// Rays of each patch that left the scene, that ended on backs.
    pub(crate) lost: Vec<[u32; 2]>,
    batch: Box<Batch>,
}

/// Rays that are traced together.
struct Batch {
    len: usize,
    /// The patches they leave.
    from: [u32; WIDTH],
    points: Points,
    seeds: Points,
    departures: Departures,
    rays: Rays,
    hits: Hits,
    scratch: Scratch,
}

impl Default for Batch {
    fn default() -> Self {
        Batch {
            len: 0,
            from: [0; WIDTH],
            points: [[0; WIDTH]; DIMENSIONS],
            seeds: [[0; WIDTH]; DIMENSIONS],
            departures: Departures::default(),
            rays: Rays::default(),
            hits: Hits::default(),
            scratch: Scratch::default(),
        }
    }
}

/// Rays that leave one side of a patch, one after the other.
struct Origin {
    patch: u32,
    surface: u32,
    side: Side,
    sequence: Sobol,
    seeds: [u32; DIMENSIONS],
}

/// Mixes 64 bits (the finaliser of SplitMix64).
#[inline(always)]
fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// Random bits for a number, in one chain.
#[inline(always)]
fn hash(key: u64, number: u64) -> u64 {
    mix(key ^ mix(number.wrapping_mul(0x9E37_79B9_7F4A_7C15)))
}

/// A seed per dimension for the rays of one side of a patch.
#[inline(always)]
fn seeds(key: u64, patch: u32, side: Side) -> [u32; DIMENSIONS] {
    let a = hash(key, u64::from(patch) << 1 | u64::from(side == Side::Back));
    let b = mix(a ^ 0xD1B5_4A32_D192_ED03);
    [a as u32, (a >> 32) as u32, b as u32, (b >> 32) as u32]
}

impl<'a> Caster<'a> {
    /// Nothing shot yet.
    pub(crate) fn new(scene: &'a Scene, key: u64) -> Self {
        let patches = scene.patches().len();
        Caster {
            scene,
            key,
            shot: vec![0; patches],
            landed: vec![0; patches],
            lost: vec![[0; 2]; patches],
            batch: Box::default(),
        }
    }

    /// Rays shot so far.
    pub(crate) fn rays(&self) -> u64 {
        self.shot.iter().map(|&shot| u64::from(shot)).sum()
    }

    /// Shoots `rays[i]` more rays from each patch i, patch by patch; `land(i, j)` for each that lands on a patch j. The
    /// rays of a two-sided patch take its sides in turn, either of them first. `None` once `go_on` says no, which is asked for every batch.
    pub(crate) fn cast(
        &mut self,
        rays: &[u32],
        go_on: &dyn Fn() -> bool,
        mut land: impl FnMut(u32, u32),
    ) -> Option<()> {
        let scene = self.scene;
        for (patch, &more) in (0_u32..).zip(rays).filter(|(_, more)| **more > 0) {
            let surface = scene.patches()[patch as usize].surface;
            let sides: &[Side] = match scene.surfaces()[surface as usize].sides() {
                Sides::Front => &[Side::Front],
                Sides::Both if hash(!self.key, patch.into()) & 1 == 0 => &[Side::Front, Side::Back],
                Sides::Both => &[Side::Back, Side::Front],
            };
            let shot = self.shot[patch as usize];
            self.shot[patch as usize] += more;
            for (turn, &side) in (0_u32..).zip(sides) {
                let count = sides.len() as u32;
                let of_side = |shot: u32| (shot + count - 1 - turn) / count;
                let (first, end) = (of_side(shot), of_side(shot + more));
                let seeds = seeds(self.key, patch, side);
                let mut origin = Origin { patch, surface, side, sequence: Sobol::at(first), seeds };
                for _ in first..end {
                    self.batch.push(&mut origin);
                    if self.batch.len == WIDTH {
                        self.trace(&mut land);
                        if !go_on() {
                            return None;
                        }
                    }
                }
            }
        }
        self.trace(&mut land);
        Some(())
    }

    /// Traces the batch and tells where its rays land.
    fn trace(&mut self, land: &mut impl FnMut(u32, u32)) {
        let (scene, batch) = (self.scene, &mut *self.batch);
        let len = std::mem::take(&mut batch.len);
        batch.leave(scene, len);
        scene.index.closest_hits(&scene.facets, &batch.rays, &mut batch.scratch, &mut batch.hits);
        for (i, &from) in batch.from.iter().enumerate().take(len) {
            let number = batch.hits.surface[i];
            if number == Hits::NONE {
                self.lost[from as usize][0] += 1;
                continue;
            }
            let surface = &scene.surfaces()[number as usize];
            if !surface.is_active(batch.hits.side[i]) {
                self.lost[from as usize][1] += 1;
                continue;
            }
            let cell = surface.cell_at(batch.hits.uv.each_ref().map(|row| row[i]));
            let patch = surface.first_patch() + cell;
            self.landed[patch as usize] += 1;
            land(from, patch);
        }
    }
}

impl Batch {
    /// Adds the next ray of an origin; there must be room.
    #[inline(always)]
    fn push(&mut self, origin: &mut Origin) {
        let i = self.len;
        let point = origin.sequence.next();
        for d in 0..DIMENSIONS {
            self.points[d][i] = point[d];
            self.seeds[d][i] = origin.seeds[d];
        }
        self.from[i] = origin.patch;
        self.departures.surface[i] = origin.surface;
        self.departures.side[i] = origin.side;
        self.len += 1;
    }

    /// Turns the points of the first `len` rays into rays: two numbers for the place, two for the direction.
    fn leave(&mut self, scene: &Scene, len: usize) {
        let isa = Isa::best();
        let (points, seeds) = (&mut self.points, &self.seeds);
        on_isa!(isa, scramble(points: &mut Points, seeds: &Points));
        for i in 0..len {
            let surface = &scene.surfaces()[self.departures.surface[i] as usize];
            let cell = self.from[i] - surface.first_patch();
            let uv = surface.point_in_cell(cell, [unit_32(points[0][i]), unit_32(points[1][i])]);
            [self.departures.uv[0][i], self.departures.uv[1][i]] = uv;
        }
        self.departures.polar[..len].copy_from_slice(&points[2][..len]);
        self.departures.turn[..len].copy_from_slice(&points[3][..len]);
        self.departures.leave(isa, scene.surfaces(), len, &mut self.rays);
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
