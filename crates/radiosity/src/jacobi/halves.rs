//! The rays of a chain in two halves, which tell the bias of the whole.
//!
//! The solution is no linear function of the links, so that errors of links that are as likely up as down do not cancel in it: a bias is
//! left, in proportion to the variance V(n) of links of n rays. Each half has a solution, too, whose bias is V(n/2)/V(n) times as large. So
//! H + λ(H − mean of H by either half) has none of that order, if λ = 1/(V(n/2)/V(n) − 1): λ = 1 for independent rays (M. H. Quenouille, *Notes
//! on bias in estimation*, Biometrika 43 (1956) 353–360). Of Sobol sequences V falls faster, and λ is measured.

use super::cast::Caster;
use super::faces::FaceTable;
use super::links::{LinkTable, Links};
use super::near::LandingCounts;
use super::shared::cast;
use crate::thread_pool::ThreadPool;

/// λ: V falls with n^1.22. Of 0, 0.6, 0.75, 0.8 and 1 it is the one that leaves no bias to be seen (docs/theory/chains.md).
const BEYOND: f64 = 0.75;

/// λ of what emitters take in along the links that they light others by, which are those of many rays: n^1.42.
const BEYOND_OF_EMITTERS: f64 = 0.6;

/// Where one half of the rays went.
pub(super) struct Half<'a> {
    landed: LandingCounts<'a>,
    shot: Vec<u32>,
    lost: Vec<[u32; 2]>,
}

/// Rays that links are made of: those of a half, or of both.
pub(super) struct LinkRays<'a> {
    pub(super) landed: Vec<&'a LandingCounts<'a>>,
    /// Rays that each face has shot.
    pub(super) shot: &'a [u32],
    /// Rays of each face that left the scene, that ended on backs.
    pub(super) lost: &'a [[u32; 2]],
}

impl<'a> Half<'a> {
    /// No ray yet.
    pub(super) fn new(landed: LandingCounts<'a>, faces: usize) -> Self {
        Half { landed, shot: vec![0; faces], lost: vec![[0; 2]; faces] }
    }

    /// Shoots more rays from each face.
    pub(super) fn cast(&mut self, caster: &mut Caster, more: &[u32], pool: &dyn ThreadPool) -> Option<()> {
        let before = caster.lost.clone();
        cast(caster, more, &mut self.landed, pool)?;
        self.shot.iter_mut().zip(more).for_each(|(shot, more)| *shot += more);
        for (lost, (after, before)) in self.lost.iter_mut().zip(caster.lost.iter().zip(before)) {
            *lost = [0, 1].map(|way| lost[way] + after[way] - before[way]);
        }
        Some(())
    }

    /// The rays of this half.
    pub(super) fn rays(&self) -> LinkRays<'_> {
        LinkRays { landed: vec![&self.landed], shot: &self.shot, lost: &self.lost }
    }
}

/// Shoots more rays from each face, as many for each half.
pub(super) fn cast_halves(
    halves: &mut [Half; 2],
    caster: &mut Caster,
    more: &[u32],
    pool: &dyn ThreadPool,
) -> Option<()> {
    // Of an odd number every other face has one more in the first half.
    let first = (0..).zip(more).zip(&halves[0].shot).map(|((face, more), shot)| {
        let out = caster.shot[face as usize] + more;
        ((out + face % 2) / 2).saturating_sub(*shot).min(*more)
    });
    let first: Vec<u32> = first.collect();
    let second: Vec<u32> = more.iter().zip(&first).map(|(more, first)| more - first).collect();
    let [one, other] = halves;
    one.cast(caster, &first, pool)?;
    other.cast(caster, &second, pool)
}

impl<'a> LinkRays<'a> {
    /// All rays of a chain.
    pub(super) fn of_both(halves: &'a [Half<'a>; 2], caster: &'a Caster) -> Self {
        let landed = halves.iter().map(|half| &half.landed).collect();
        LinkRays { landed, shot: &caster.shot, lost: &caster.lost }
    }

    /// The links that they are.
    pub(super) fn links<'b>(&self, faces: &'b FaceTable<'b>) -> Links<'b> {
        let tables: Vec<&LinkTable> = self.landed.iter().map(|landed| &landed.links).collect();
        Links::new(&tables, (self.shot, self.lost), faces)
    }

    /// [`LandingCounts::near_light`] of all rays.
    pub(super) fn near_light(&self, areas: &[f64], mut bring: impl FnMut(usize, usize, f64)) {
        self.landed.iter().for_each(|landed| landed.near_light(self.shot, areas, &mut bring));
    }
}

/// What all rays say, once what either half says is taken into account; `met` where it is what an emitter meets along its own links.
pub(super) fn extrapolated(whole: f64, halves: [f64; 2], met: bool) -> f64 {
    let beyond = if met { BEYOND_OF_EMITTERS } else { BEYOND };
    whole + beyond * (whole - 0.5 * (halves[0] + halves[1]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bias_that_falls_as_the_variance_is_removed() {
        for (met, power) in [(false, 1.2224), (true, 1.415)] {
            let of = |rays: f64| 3.0 + 0.7 * rays.powf(-power);
            let found = extrapolated(of(32.0), [of(16.0) + 0.1, of(16.0) - 0.1], met);
            assert!((found - 3.0).abs() < 1e-4 * (of(32.0) - 3.0), "{found}");
        }
    }
}
