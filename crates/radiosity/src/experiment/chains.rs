//! What chains and batches tell of a face: the mean of n of them, and an interval of Student's t that leans upwards where few links or hits count.

use stats::{Interval, Moments};

use super::unmet::{Ball, BrightFaces, seen_by_rays};
use crate::experiment::{Experiment, Meaning};
use crate::geometry::face::Face;
use crate::jacobi::{self, plan::Solve};
use crate::method::{Chains, Method};
use crate::tally::Tally;
use crate::walk::estimator::{AbsorptionMode, Estimator};

/// How much shorter the lower half of an interval is, by the relative standard error, as Garwood's limits of a Poisson number are.
const LEAN_BELOW: f64 = 0.5;

/// The part of one more link that the standard error is widened by: calibrated. Of 0.5, 0.6, 0.7 and 1 it is the one with which mean squared z
/// is nearest to 1 where links are few (docs/theory/intervals.md).
const MORE: f64 = 0.6;

/// The part of a mean that its roundings stay below. Where one more link changes no more than that, light is even: every link brings the same, and chains
/// that agree do so by no chance.
const ROUNDING: f64 = 1e-12;

/// The estimate from the mean of n independent chains: its error follows Student's t with n − 1 degrees of freedom.
#[derive(Clone, Debug)]
pub(super) struct Student {
    /// Half-width of the interval, in standard errors of the mean; `None` of a single chain.
    quantile: Option<f64>,
    /// √(ν/(ν − 2)): the standard deviation of t; `None` where that is infinite, of 3 chains or fewer.
    pub(super) deviation: Option<f64>,
    /// ½(1 − confidence).
    pub(super) tail: f64,
}

impl Student {
    pub(super) fn new(chains: u64, confidence: f64) -> Self {
        let freedom = chains.saturating_sub(1);
        let quantile = (freedom > 0).then(|| stats::student_quantile(0.5 + 0.5 * confidence, freedom));
        let deviation = (freedom > 2).then(|| (freedom as f64 / (freedom - 2) as f64).sqrt());
        Student { quantile, deviation, tail: 0.5 * (1.0 - confidence) }
    }

    /// What scores of `per_unit` each tell of a mean that is at most `most`. The standard error is that of the whole
    /// distribution, √(ν/(ν − 2)) times s/√n: it would be too small by as much, had the sample's own been taken for the
    /// truth. What a single chain says, or chains that all say the same, is bounded by `most` alone, but for light so even that
    /// links have nothing to disagree about: there roundings are the error.
    ///
    /// Elsewhere `most` stays out: an upper end that it cuts off makes half-widths smaller than the error of the mean, which may be above it.
    ///
    /// Links: one more of them in one of the chains would add its square u² to the square of s/√n. The upper end has it beforehand, and the
    /// standard error [`MORE`]·u. The upper end is no lower than that of a Poisson number whose relative standard error is that of the mean: mean and
    /// spread of few chains are low together.
    /// Many contributions: the upper end leans in the same way. Where samples have brought nothing, those that would bring `most` have stayed out with
    /// probability ½(1 − confidence) at least. What no ray or walk has met widens the upper end as a standard error does.
    /// Hits: the interval is that of a count ([`stats::batches_interval`]). Where nothing has come in, what could have come has stayed out
    /// with probability ½(1 − confidence) at least.
    pub(super) fn estimate(&self, moments: &Moments, per_unit: f64, most: f64, by: By) -> ChainEstimate {
        let mean = per_unit * moments.mean().unwrap_or(0.0);
        let quantile = self.quantile.filter(|_| moments.standard_error().is_some());
        let (one, unmet) = match by {
            By::Many { unmet } => (0.0, unmet),
            By::Links(one) => (one, 0.0),
            By::Hits { one, unmet, .. } => (one, unmet),
        };
        let is_even = matches!(by, By::Links(_)) && one <= ROUNDING * mean;
        let least = if is_even { ROUNDING * mean } else { 0.0 };
        let sample_error = moments.standard_error().map_or(0.0, |error| (per_unit * error).max(least));
        let with_links = |links: f64| {
            let one = if let By::Links(one) = by { one } else { 0.0 };
            sample_error.hypot(links * one)
        };
        let (low, high) = match (quantile, by) {
            (Some(_), By::Links(_) | By::Hits { .. }) if mean == 0.0 && one > 0.0 => {
                let ratio = if let By::Hits { ratio_bound, .. } = by { ratio_bound } else { 1.0 };
                (0.0, most.min(-self.tail.ln() * ratio * one))
            }
            (Some(quantile), By::Hits { one, .. }) if one > 0.0 => {
                let Interval { low, high } = stats::batches_interval(mean, sample_error, quantile, one);
                (low, high)
            }
            (Some(_), By::Many { .. }) if mean == 0.0 => {
                (0.0, most * stats::unmet_chance(moments.n as f64, self.tail))
            }
            (Some(quantile), _) if sample_error > 0.0 => {
                let below = quantile * sample_error * (1.0 - LEAN_BELOW * (sample_error / mean).min(1.0));
                let above = quantile * with_links(1.0);
                let of_count =
                    (quantile + stats::beyond_of_count(quantile) * sample_error / mean) * sample_error;
                ((mean - below).max(0.0), mean + above.max(of_count))
            }
            _ => (0.0, most.max(mean)),
        };
        let high = stats::with_unmet(high, mean, unmet);
        let error = Some(with_links(MORE)).filter(|_| sample_error > 0.0).zip(self.deviation);
        ChainEstimate { mean, error: error.map(|(error, deviation)| deviation * error), low, high }
    }
}

/// What a mean is made of.
#[derive(Clone, Copy, Debug)]
pub(super) enum By {
    /// Contributions that are too many to matter one by one, and what those may bring that rays have not met.
    Many { unmet: f64 },
    /// Links, one of which would add this to the mean.
    Links(f64),
    /// Hits of walks, one of which adds `one`, with a bound on E\[x²\]/E\[x\] of a walk's hits x, and what those may bring that are worth more than any walk's.
    /// They are `unequal` in colour, and where walks grow weaker.
    Hits { one: f64, ratio_bound: f64, unmet: f64, unequal: bool },
}

/// A mean, its standard error, and its interval.
pub(super) struct ChainEstimate {
    pub(super) mean: f64,
    pub(super) error: Option<f64>,
    pub(super) low: f64,
    pub(super) high: f64,
}

/// What single links or hits bring, and the faces that a final gather may miss.
#[derive(Clone, Debug)]
pub(super) struct Contributions {
    kind: Kind,
    /// By channel; empty where nothing is gathered.
    bright: Vec<BrightFaces>,
}

/// What the method makes of the faces that it does not gather for.
#[derive(Clone, Debug)]
enum Kind {
    Links(Vec<ExtraLink>),
    Hits(Estimator, u64),
    Many,
}

impl Contributions {
    /// `None` of single walks.
    pub(super) fn new(experiment: &Experiment, tally: &Tally) -> Option<Self> {
        let kind = match experiment.method() {
            Method::Chains(Chains { solve: Solve::Links, .. }) => {
                let channels = 0..experiment.scene().channels();
                Kind::Links(channels.map(|c| ExtraLink::new(experiment, tally, c)).collect())
            }
            Method::Batches(batches) => Kind::Hits(batches.score.of_walks().0, batches.walks),
            Method::Chains(_) => Kind::Many,
            Method::Walks(_) => return None,
        };
        let gathers = !experiment.method().final_gather().is_empty() && tally.counts.walks > 0;
        let bright = if gathers { BrightFaces::of(experiment, tally, |_| 1.0) } else { Vec::new() };
        Some(Contributions { kind, bright })
    }

    /// What the mean of a face is made of. Patches of the final gather are lit by rays of their own.
    pub(super) fn of(
        &self,
        (experiment, tally): (&Experiment, &Tally),
        (i, face): (usize, &Face),
        channel: usize,
        student: &Student,
    ) -> By {
        if experiment.method().final_gather().contains(&face.patch) {
            return By::Many {
                unmet: self.unmet_by_gather((experiment, tally), (i, face), channel, student),
            };
        }
        match &self.kind {
            Kind::Many => By::Many { unmet: 0.0 },
            Kind::Links(channels) => By::Links(channels[channel].one[i]),
            Kind::Hits(estimator, walks) => {
                let meaning = experiment.meaning_of_shooting(*estimator, (i, face), channel, tally);
                let walks = *walks as f64 * tally.counts.walks as f64;
                let per_event = meaning.irradiance_per_event.unwrap_or(0.0);
                let events = irradiance(experiment, tally, (i, face), channel) / per_event * walks;
                let unmet = match experiment.sizes((i, face), channel).filter(|_| events > 0.0) {
                    Some((sizes, scale)) => {
                        let budget = stats::unmet_chance(walks, student.tail);
                        per_event * sizes.beyond(events / tally.events(i) as f64, budget, scale)
                    }
                    None => 0.0,
                };
                let unequal = experiment.scene().channels() > 1
                    || estimator.kind().absorption() == AbsorptionMode::Implicit;
                By::Hits { one: per_event / walks, ratio_bound: meaning.ratio_bound, unmet, unequal }
            }
        }
    }

    /// What bright faces may bring to a face that none of its rays has met [W/m²].
    fn unmet_by_gather(
        &self,
        (experiment, tally): (&Experiment, &Tally),
        (i, face): (usize, &Face),
        channel: usize,
        student: &Student,
    ) -> f64 {
        let mean = irradiance(experiment, tally, (i, face), channel);
        let [sum, sum_sq] = [0, 1].map(|power| tally.patch(i, channel)[power]);
        let moments = Moments { n: tally.counts.walks, sum, sum_sq };
        let (Some(error), Some(of_units)) =
            (moments.standard_error(), moments.mean().filter(|&mean| mean > 0.0))
        else {
            return 0.0;
        };
        let rays = tally.events(i) as f64;
        let seen = seen_by_rays(mean, error * (mean / of_units), rays);
        self.bright[channel].unmet(&Ball::of_parts_of(experiment.scene(), i), seen, (rays, student.tail))
    }
}

/// What one more link would add to the mean of each face \[W/m²\], in one channel.
///
/// A ray from j that meets i brings (B_j − B_i)/(A_i(d_i + d_j)), d being rays per area. Means are by what comes along the links: with
/// A_j|B_j − B_i| for weights, the difference is D = ΣA(B − B_i)²/ΣA|B − B_i|, and D/d_j is P = ΣA(B − B_i)²/d / ΣA|B − B_i|.
#[derive(Clone, Debug)]
pub(super) struct ExtraLink {
    one: Vec<f64>,
}

impl ExtraLink {
    fn new(experiment: &Experiment, tally: &Tally, channel: usize) -> Self {
        let faces = experiment.scene().faces();
        let areas: Vec<f64> = faces.iter().map(|face| face.area).collect();
        let landed: u128 = (0..faces.len()).map(|i| tally.events(i)).sum();
        let ends = landed + u128::from(tally.counts.escaped + tally.counts.absorbed_back);
        // Beside shadow rays, links carry what is reflected alone.
        let emits =
            if ends < u128::from(tally.counts.rays) && experiment.has_shadow_rays() { 0.0 } else { 1.0 };
        let radiosity: Vec<f64> = faces
            .iter()
            .enumerate()
            .map(|(i, face)| {
                let reflected =
                    face.reflectance[channel] * irradiance(experiment, tally, (i, &face), channel);
                emits * face.emittance[channel] + reflected
            })
            .collect();
        let aim = jacobi::aim::density(&areas, std::slice::from_ref(&radiosity));
        let density: Vec<f64> =
            aim.iter().zip(&areas).map(|(part, area)| part * ends as f64 / area).collect();
        ExtraLink { one: one_more(&areas, &radiosity, &density) }
    }
}

/// [`ExtraLink`] of radiosities \[W/m²\] and rays per area \[1/m²\].
fn one_more(areas: &[f64], radiosity: &[f64], density: &[f64]) -> Vec<f64> {
    let area: f64 = areas.iter().sum();
    // About their mean, so that nothing cancels where all are nearly alike.
    let middle = areas.iter().zip(radiosity).map(|(area, b)| area * b).sum::<f64>() / area;
    let mut order: Vec<usize> = (0..areas.len()).collect();
    order.sort_unstable_by(|&i, &j| radiosity[i].total_cmp(&radiosity[j]).then(i.cmp(&j)));
    // Σw, ΣwB and ΣwB², w = A and w = A/d.
    let mut sums = [[0.0; 3]; 2];
    for (i, b) in radiosity.iter().map(|b| b - middle).enumerate() {
        for (sums, weight) in sums.iter_mut().zip([areas[i], areas[i] / density[i]]) {
            sums.iter_mut().zip([1.0, b, b * b]).for_each(|(sum, power)| *sum += weight * power);
        }
    }
    let [by_area, by_density] = sums;
    let (mut below, mut one) = ([0.0; 2], vec![0.0; areas.len()]);
    for i in order {
        let b = radiosity[i] - middle;
        let squares = |sums: [f64; 3]| (sums[2] - 2.0 * b * sums[1] + b * b * sums[0]).max(0.0);
        let differences = by_area[1] - 2.0 * below[1] - b * (by_area[0] - 2.0 * below[0]);
        if differences > 0.0 {
            let (far, power) = (squares(by_area) / differences, squares(by_density) / differences);
            one[i] = if power > 0.0 { far / (density[i] + far / power) / areas[i] } else { 0.0 };
        }
        below = [below[0] + areas[i], below[1] + areas[i] * b];
    }
    one
}

/// H of a face, by the mean of all chains [W/m²].
fn irradiance(experiment: &Experiment, tally: &Tally, (i, face): (usize, &Face), channel: usize) -> f64 {
    let per_unit = |meaning: Meaning| meaning.unit * meaning.irradiance_per_event.unwrap_or(0.0);
    let per_unit = experiment.meaning_of((i, face), channel, tally).map_or(0.0, per_unit);
    per_unit * tally.patch(i, channel)[0] as f64 / tally.counts.walks as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four chains that say the same of a mean of 100, in units of 1e-6, where one more link would add `one`.
    fn of_equals(one: f64) -> ChainEstimate {
        let each = 100_000_000_u128;
        let moments = Moments { n: 4, sum: 4 * each, sum_sq: 4 * each * each };
        Student::new(4, 0.95).estimate(&moments, 1e-6, 1e4, By::Links(one))
    }

    /// Chains may say the same by chance where links differ, and in even light they must.
    #[test]
    fn chains_that_agree_are_trusted_in_even_light_alone() {
        let even = of_equals(1e-12);
        assert!(even.error.is_some_and(|error| error > 0.0 && error < 1e-9), "{:?}", even.error);
        assert!(even.low < 100.0 && 100.0 < even.high && even.high - even.low < 1e-8);
        let by_chance = of_equals(1e-3);
        assert!(by_chance.error.is_none() && by_chance.low == 0.0 && by_chance.high == 1e4);
    }
}
