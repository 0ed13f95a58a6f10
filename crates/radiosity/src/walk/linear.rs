//! Scores with slopes: for each patch not the score alone, but how it is spread over the patch.
//!
//! With b(x) the light that a patch reflects at x, and ψ₁, ψ₂ the linear basis of `geometry/basis.rs`, a shooting walk that
//! scores y at x adds y·ψ_k(x) to slope k: the mean of that is the mean of b·ψ_k over the patch, as the mean of y is that of
//! b. A gathering walk that is born at x and gathers y tells the same of the patch of its birth.

use super::score::{HitTally, WeightTally, dithered, set_units};
use crate::geometry::basis::{SLOPE_BITS, SLOPE_UNITS};
use crate::random::rng::WalkRng;
use crate::simd::batch::WIDTH;
use crate::simd::isa::Simd;
use crate::tally::{LinearBoard, LinearScore, Word};

/// The score of a number of hits, with the sum of their slopes.
#[inline(always)]
fn hits(number: u64, slopes: [i64; 2]) -> LinearScore<u64, 1> {
    LinearScore { units: [number], slopes: [slopes.map(u64::from_signed)] }
}

impl HitTally for LinearBoard<u64, 0, 1> {
    type Sample = [i64; 2];

    #[inline(always)]
    fn add_hit(&mut self, face: u32, (earlier, sum): (u64, [i64; 2]), slopes: [i64; 2]) {
        self.raise(face, &hits(earlier, sum), &hits(1, slopes));
    }

    #[inline(always)]
    fn expect_faces(&self, faces: &[u32]) {
        self.expect(faces);
    }
}

/// A fixed-point score with its slopes at a place: `score·ψ_k`, plus `rounding` of a unit and rounded down. |ψ| is below 1 by
/// a unit, so that no slope exceeds its score where `rounding` is below 1.
#[inline(always)]
fn fixed<const C: usize>(scores: [u64; C], place: [i64; 2], rounding: [i64; C]) -> LinearScore<u64, C> {
    LinearScore {
        units: scores,
        slopes: std::array::from_fn(|c| {
            let whole = |psi: i64| i128::from(scores[c]) * i128::from(psi) + i128::from(rounding[c]);
            place.map(|psi| (whole(psi) >> SLOPE_BITS) as u64)
        }),
    }
}

impl<const C: usize> WeightTally<C> for LinearBoard<u128, 1, C> {
    type Sample = [i64; 2];
    type VisitScore = LinearScore<u64, C>;

    type Units = [[u64; C]; WIDTH];
    const NO_UNITS: Self::Units = [[0; C]; WIDTH];

    #[inline(always)]
    fn set_units(&mut self, units: &mut Self::Units, weights: &[[f64; C]; WIDTH]) {
        set_units(units, weights);
    }

    #[inline(always)]
    fn visit_score(units: &Self::Units, lane: usize, place: [i64; 2]) -> LinearScore<u64, C> {
        fixed(units[lane], place, [SLOPE_UNITS / 2; C])
    }

    #[inline(always)]
    fn count_event(&mut self, face: u32) {
        self.count(face);
    }

    #[inline(always)]
    fn add_visit(&mut self, face: u32, before: &LinearScore<u64, C>, now: &LinearScore<u64, C>) {
        self.add_event(face, before, now);
    }

    #[inline(always)]
    fn add_first<S: Simd>(&mut self, face: u32, now: &LinearScore<u64, C>, _: &Self::Units, _: usize) {
        self.add_event(face, &LinearScore::none(), now);
    }

    fn add_visits(
        &mut self,
        face: u32,
        before: impl Iterator<Item = LinearScore<u64, C>>,
        now: impl Iterator<Item = LinearScore<u64, C>>,
    ) {
        self.add_more(face, before, now);
    }

    /// Scores are rounded as without slopes, and slopes by the other half of the same draws.
    #[inline(always)]
    fn add_gathered(&mut self, birth: u32, scores: [f64; C], place: [i64; 2], mut rng: WalkRng) {
        let mut rounding = [0; C];
        let mut channels = rounding.iter_mut();
        let units = scores.map(|score| {
            let (units, other) = dithered(score, &mut rng);
            *channels.next().expect("one for each channel") = (other * SLOPE_UNITS as f64) as i64;
            units as u64
        });
        self.add_more(birth, std::iter::empty(), std::iter::once(fixed(units, place, rounding)));
    }

    #[inline(always)]
    fn expect_faces(&self, faces: &[u32]) {
        self.expect(faces);
    }
}
