//! How the light of a chain is spread over faces: the means of H·ψ_k, for the linear basis.
//!
//! Once the links are solved, their rays are shot once more. A ray between i and j has the exchange area K = 1/(d_i + d_j), d the
//! rays per area, at both of its ends: it brings K·x_j·ψ_k/A_i to face i, ψ_k at its end there and x_j the radiosity that goes along the
//! links. K·ψ_k of all rays of a face, the lost ones included, expects 0, so that the mean light of a face is taken from x_j: then
//! no noise is left where all that arrives is alike.

use std::sync::atomic::{AtomicI64, Ordering};

use super::cast::{Caster, Meeting};
use super::direct::Direct;
use super::faces::FaceTable;
use super::place::{LocalPoint, psi};
use super::shared::shoot_again;
use crate::thread_pool::ThreadPool;

/// Units in the largest radiosity: whole numbers of them add up to the same in any order.
const UNITS: f64 = (1_u64 << 40) as f64;

/// What is known when the rays are shot once more, face-major and channel-minor.
pub(super) struct SlopeInputs<'a> {
    /// The radiosity that goes along links [W/m²].
    pub(super) along: &'a [f64],
    /// What comes in along links, in the mean over each face [W/m²].
    pub(super) incoming: &'a [f64],
    /// The largest radiosity there can be in each channel [W/m²].
    pub(super) largest: [f64; 3],
    pub(super) direct: Option<&'a Direct<'a>>,
}

/// The means of H·ψ₁ and H·ψ₂ over every face, face-major and channel-minor. `None` once `pool`, which share the rays, no longer want it.
pub(super) fn slopes(
    faces: &FaceTable,
    caster: &Caster,
    solved: &SlopeInputs,
    pool: &dyn ThreadPool,
) -> Option<Vec<[f64; 2]>> {
    let sums: Vec<[AtomicI64; 2]> = solved.along.iter().map(|_| Default::default()).collect();
    let spread = SlopeSums::new(faces, caster, solved, &sums);
    let lost = |from: u32, meeting: &Meeting| spread.lose(from, meeting);
    shoot_again(caster, pool, &|from, to, meeting| spread.land(from, to, meeting), &lost)?;
    let channels = faces.scene.channels();
    let mut slopes =
        solved.direct.map_or_else(|| vec![[0.0; 2]; sums.len()], |direct| direct.slopes().to_vec());
    for (number, (slopes, sums)) in slopes.iter_mut().zip(sums).enumerate() {
        let unit = solved.largest[number % channels] / UNITS;
        for (slope, sum) in slopes.iter_mut().zip(sums) {
            *slope += unit * sum.into_inner() as f64;
        }
    }
    Some(slopes)
}

/// Sums under way.
struct SlopeSums<'a> {
    faces: &'a FaceTable<'a>,
    channels: usize,
    solved: &'a SlopeInputs<'a>,
    /// Rays per area of each face [1/m²].
    density: Vec<f64>,
    /// Units over the area of each face [1/m²].
    per_area: Vec<f64>,
    /// One over the largest radiosity of each channel [m²/W].
    per_light: [f64; 3],
    sums: &'a [[AtomicI64; 2]],
}

impl<'a> SlopeSums<'a> {
    fn new(
        faces: &'a FaceTable,
        caster: &Caster,
        solved: &'a SlopeInputs,
        sums: &'a [[AtomicI64; 2]],
    ) -> Self {
        let of_face = |(&shot, area): (&u32, &f64)| f64::from(shot) / area;
        SlopeSums {
            faces,
            channels: faces.scene.channels(),
            solved,
            density: caster.shot.iter().zip(&faces.areas).map(of_face).collect(),
            per_area: faces.areas.iter().map(|area| UNITS / area).collect(),
            per_light: solved.largest.map(|largest| 1.0 / largest),
            sums,
        }
    }

    /// A ray joins two faces.
    fn land(&self, from: u32, to: u32, meeting: &Meeting) {
        let exchange = 1.0 / (self.density[from as usize] + self.density[to as usize]);
        let near = self.solved.direct.map(|direct| direct.bounds().near_parts(from, to, || meeting.kernel()));
        let [first, last] = meeting.ends();
        for (way, (face, other, place)) in [(from, to, first), (to, from, last)].into_iter().enumerate() {
            let emitted = near.map_or(0.0, |parts| parts[way]);
            self.add(face, place, exchange, |c, i| {
                let j = self.number(other, c);
                let light = self.faces.list[other as usize].emittance[c] * emitted;
                self.solved.along[j] + light - self.solved.incoming[i]
            });
        }
    }

    /// A ray of a face is lost.
    fn lose(&self, from: u32, meeting: &Meeting) {
        let exchange = 1.0 / self.density[from as usize];
        self.add(from, meeting.ends()[0], exchange, |_, i| -self.solved.incoming[i]);
    }

    /// Adds what an exchange area brings to a place of a face; `light` tells it by channel and number of the sum.
    fn add(&self, face: u32, place: LocalPoint, exchange: f64, light: impl Fn(usize, usize) -> f64) {
        let psi = psi(self.faces.scene, place);
        let part = exchange * self.per_area[face as usize];
        for c in 0..self.channels {
            let number = self.number(face, c);
            let units = part * light(c, number) * self.per_light[c];
            for (sum, psi) in self.sums[number].iter().zip(psi) {
                let units = units * psi;
                sum.fetch_add((units + 0.5_f64.copysign(units)) as i64, Ordering::Relaxed);
            }
        }
    }

    fn number(&self, face: u32, channel: usize) -> usize {
        face as usize * self.channels + channel
    }
}
