//! Drift: whether the second half of a run agrees with the first.

use radiosity::Tally;
use stats::Moments;

/// The most patches in a sample: enough to tell whether a run drifts.
const TELLING_PATCHES: usize = 1 << 16;

/// The fewest scores expected in either half; patches with fewer are left out, since their differences are not normal.
const FEWEST_SCORES: f64 = 30.0;

/// The moments of every patch, or of every k-th patch if there are more than [`TELLING_PATCHES`].
pub(crate) struct Sample(Vec<Moments>);

impl Sample {
    /// The sample of a tally whose first `patches` rows are patches.
    pub(crate) fn new(tally: &Tally, patches: usize) -> Self {
        let every = patches.div_ceil(TELLING_PATCHES).max(1);
        let scores = 0..tally.layout().scores;
        let each = (0..patches).step_by(every).flat_map(|i| scores.clone().map(move |s| (i, s)));
        let moments = each.map(|(patch, score)| {
            let sums = tally.patch(patch, score);
            Moments { n: tally.counts.walks, sum: sums[0], sum_sq: sums[1] }
        });
        Sample(moments.collect())
    }
}

/// The mean of z² over patches and scores. z = the difference between the means of the walks of `before` and of the
/// walks since then, up to `now`, over its standard error. The result is about 1 if walks are independent, whatever
/// they score; it is not a number if no patch has enough scores.
pub(crate) fn drift(before: &Sample, now: &Sample) -> f64 {
    let z = before.0.iter().zip(&now.0).filter_map(|(before, now)| z(*before, *now));
    stats::mean_squared_z(z).map_or(f64::NAN, |drift| drift.value)
}

/// The z of one score on one patch; `None` if it has too few scores.
fn z(before: Moments, now: Moments) -> Option<f64> {
    let since = Moments {
        n: now.n.checked_sub(before.n)?,
        sum: now.sum.checked_sub(before.sum)?,
        sum_sq: now.sum_sq.checked_sub(before.sum_sq)?,
    };
    // The expected scores come from both halves together, which do not tell how scores are shared; the scores of each
    // half would select patches that have too many by chance.
    let scores = now.sum as f64 * (now.sum as f64 / now.sum_sq.max(1) as f64);
    if scores * before.n.min(since.n) as f64 / (now.n as f64) < FEWEST_SCORES {
        return None;
    }
    let variance = before.standard_error()?.powi(2) + since.standard_error()?.powi(2);
    (variance > 0.0).then(|| Some((since.mean()? - before.mean()?) / variance.sqrt()))?
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_that_agree_have_no_z_and_others_do() {
        let hits = |n, sum: u128| Moments { n, sum, sum_sq: sum };
        assert_eq!(z(hits(1000, 100), hits(2000, 200)), Some(0.0));
        // 100 and 150 hits of 1000 walks: 0.05/√(0.09·1000/999/1000 + 0.1275/999)
        let far = z(hits(1000, 100), hits(2000, 250)).unwrap();
        assert!((far - 3.39).abs() < 0.01, "{far}");
        assert_eq!(z(hits(1000, 10), hits(2000, 20)), None, "too few scores");
        assert_eq!(z(hits(1000, 100), hits(900, 100)), None, "no second half");
    }

    /// Patches are hit with probabilities of 2 … 10 %, by 2,000 walks and then 500. Which patches are used must not
    /// depend on their difference. The mean of some 20,000 z² has a standard error of about 0.01, so that chance alone
    /// fails this once in 10⁶.
    #[test]
    fn patches_are_not_chosen_for_what_they_say() {
        let mut state = 1_u64;
        let mut hits = |walks: u64, percent: u64| {
            let mut draw = || {
                // xorshift64*
                state ^= state >> 12;
                state ^= state << 25;
                state ^= state >> 27;
                state.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 32
            };
            (0..walks).filter(|_| draw() % 100 < percent).count() as u128
        };
        let (mut before, mut now) = (Vec::new(), Vec::new());
        for patch in 0..40_000 {
            let percent = 2 + patch % 9;
            let first = hits(2000, percent);
            let both = first + hits(500, percent);
            before.push(Moments { n: 2000, sum: first, sum_sq: first });
            now.push(Moments { n: 2500, sum: both, sum_sq: both });
        }
        let drift = drift(&Sample(before), &Sample(now));
        assert!((drift - 1.0).abs() < 0.05, "{drift}");
    }
}
