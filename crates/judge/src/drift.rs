//! Drift: whether the walks since the previous look agree with those before it.
//!
//! Walks (batches, chains) are independent and alike, so that each order of their scores x is as likely as any other. n₁ of n
//! walks came first, f = n₁/n, S = Σx, Q = Σx². Which walks came first is a sample without replacement: its indicators are
//! negatively associated (Joag-Dev & Proschan, Ann. Statist. 11 (1983) 286–295), and each has the variance proxy
//! 2κ = (1 − 2f)/(2 ln((1 − f)/f)) (Kearns & Saul 1998; ¼ at f = ½). The sum S₁ of the first scores has therefore
//!
//! P(|S₁ − fS| ≥ d) ≤ 2 exp(−d²/2v), v = 2κ·min(Q, 2(Q − S²/n)).
//!
//! The first bound is that of scores ≥ 0. The second is of scores less their mean, which have two signs: Cauchy and Schwarz
//! part them. Both hold for any number of scores of any distribution. The least of m such probabilities, times m, bounds
//! that of any (Bonferroni), whatever patches have to do with each other.

use radiosity::Tally;
use stats::Moments;

/// The most patches in a sample: enough to tell whether a run drifts.
const TELLING_PATCHES: usize = 1 << 16;

/// The probability, at most, with which chance alone makes a check of drift fail.
pub(crate) const FALSE_ALARM: f64 = 1e-3;

/// The moments of every patch, or of every k-th patch if there are more than [`TELLING_PATCHES`].
pub(crate) struct ScoreMoments(Vec<Moments>);

impl ScoreMoments {
    /// The sample of a tally whose first `patches` rows are patches.
    pub(crate) fn new(tally: &Tally, patches: usize) -> Self {
        let every = patches.div_ceil(TELLING_PATCHES).max(1);
        let scores = 0..tally.layout().scores;
        let each = (0..patches).step_by(every).flat_map(|i| scores.clone().map(move |s| (i, s)));
        let moments = each.map(|(patch, score)| {
            let sums = tally.patch(patch, score);
            Moments { n: tally.counts.walks, sum: sums[0], sum_sq: sums[1] }
        });
        ScoreMoments(moments.collect())
    }
}

/// The probability, at most, that the walks of `before` and the walks since then, up to `now`, differ on some patch as much as
/// they do; not a number if there is nothing to compare.
pub(crate) fn drift(before: &ScoreMoments, now: &ScoreMoments) -> f64 {
    let exponents = before.0.iter().zip(&now.0).filter_map(|(before, now)| exponent(*before, *now));
    let (compared, largest) = exponents.fold((0_u64, 0.0), |(n, max), x| (n + 1, f64::max(max, x)));
    if compared == 0 { f64::NAN } else { (2.0 * compared as f64 * (-largest).exp()).min(1.0) }
}

/// The exponent d²/2v of one score on one patch; `None` if nothing is scored, or before or since.
fn exponent(before: Moments, now: Moments) -> Option<f64> {
    let since = now.n.checked_sub(before.n).filter(|&since| since > 0 && before.n > 0)?;
    let (n, sum, squares) = (now.n as f64, now.sum as f64, now.sum_sq as f64);
    let [first, rest] = [before.n as f64 / n, since as f64 / n];
    let proxy = if (rest - first).abs() < 1e-6 { 0.25 } else { (rest - first) / (2.0 * (rest / first).ln()) };
    let deviation = before.sum as f64 - first * sum;
    let about_mean = now.variance()? * (n - 1.0);
    let variance = proxy * squares.min(2.0 * about_mean);
    (variance > 0.0).then(|| 0.5 * deviation * deviation / variance)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_that_agree_have_no_deviation_and_others_do() {
        let hits = |n, sum: u128| Moments { n, sum, sum_sq: sum };
        assert_eq!(exponent(hits(1000, 100), hits(2000, 200)), Some(0.0));
        // 100 and 150 hits of 1000 walks: 25²/(2·¼·250).
        assert_eq!(exponent(hits(1000, 100), hits(2000, 250)), Some(5.0));
        // All of 10 hits in the first three quarters: 2.5²/(2v) with v = 10·½/(2 ln 3).
        let all = exponent(hits(750, 10), hits(1000, 10)).unwrap();
        assert!((all - 0.625 * 2.0 * 3f64.ln()).abs() < 1e-12, "{all}");
        assert_eq!(exponent(hits(1000, 100), hits(1000, 100)), None, "no second part");
        assert_eq!(exponent(hits(0, 0), hits(1000, 100)), None, "no first part");
        assert_eq!(exponent(hits(1000, 0), hits(2000, 0)), None, "nothing is scored");
        // Sixteen chains of 1,000 ± 1, half of them before, whose sum is off by 3: 3²/(2·2·¼·16).
        let chains = |n: u64, sum: u128| Moments { n, sum, sum_sq: 1000 * 1000 * 16 + 16 };
        let off = exponent(chains(8, 8003), Moments { n: 16, ..chains(16, 16_000) }).unwrap();
        assert!((off - 9.0 / 16.0).abs() < 1e-9, "{off}");
    }

    /// The bound is one: among all ways to choose which 6 of 12 walks came first, at most the stated part deviates as much.
    #[test]
    fn the_bound_holds_for_every_deviation_of_few_scores() {
        for scores in [
            [0; 12].map(|_: u128| 7),
            [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 9],
            [0, 0, 0, 0, 0, 0, 1, 1, 2, 2, 5, 9],
        ] {
            let moments = |chosen: u32| {
                let of = (0..12).filter(|i| chosen >> i & 1 == 1).map(|i| scores[i as usize]);
                Moments { n: 0, sum: of.clone().sum(), sum_sq: of.map(|x| x * x).sum() }
            };
            let whole = Moments { n: 12, ..moments(0xfff) };
            for first in [3, 6, 9] {
                let ways = (0..1_u32 << 12).filter(|way| way.count_ones() == first);
                let found: Vec<f64> = ways
                    .map(|way| Moments { n: first.into(), ..moments(way) })
                    .map(|before| drift(&ScoreMoments(vec![before]), &ScoreMoments(vec![whole])))
                    .filter(|p| p.is_finite())
                    .collect();
                for p in &found {
                    let part = found.iter().filter(|q| *q <= p).count() as f64 / found.len() as f64;
                    assert!(part <= *p, "{first} of {scores:?}: {part} have {p} or less");
                }
            }
        }
    }
}
