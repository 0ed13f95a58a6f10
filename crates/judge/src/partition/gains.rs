//! What halving each part of a mesh is expected to gain, from what a pilot has measured of all parts.
//!
//! Gains are expected in proportion to the energy of a part: by a *rate* for each class of parts, which the pilot's sums over all parts of
//! the class give, times a *factor* of the part, one of [`FACTORS`]. A part has the factor of the part around it or another one
//! ([`STAY`]). So the factors of a tree are a hidden Markov chain that branches, of which every part is measured once; what each
//! factor's weight is, given all measurements, follows by one way from the finest parts up and one from the whole down.
//!
//! Parts that the pilot did not see halved have the factor that the part around it makes likely, and rates that fall.

use super::clusters::{Cluster, Clusters};
use super::part::PartEstimate;
use super::seen::Basis;

/// What the gain of a part may be of the rate's.
const FACTORS: [f64; 8] = [0.0, 1.0 / 64.0, 1.0 / 16.0, 0.25, 1.0, 4.0, 16.0, 64.0];

/// How likely each factor is of a part of which nothing is known. A cut that does not pay costs the noise of one unknown; a missing cut may
/// cost much more, where light is bright. So the mean of the factors is [`CAUTION`], and not 1.
const LIKELY: Weights = [0.048, 0.09, 0.138, 0.212, 0.28, 0.17, 0.052, 0.01];

/// The mean of the factors.
pub(crate) const CAUTION: f64 = 2.5;

/// The probability that a part has the factor of the part around it; with the others of cases its factor is drawn anew.
const STAY: f64 = 0.7;

/// What the rates of means and of linear fits fall by where distances are halved, in classes of which the pilot tells nothing: between 1/2
/// (the edge of a shadow) and 1/4 or 1/16 (smooth light).
const FALL: [f64; 2] = [0.4, 0.25];

/// The rates at the largest distances, before anything is measured.
const FIRST_RATE: [f64; 2] = [0.25, 0.15];

/// The standard deviation of a gain about the rate's with the factor, as a part of it.
const MISFIT: f64 = 0.7;

/// Classes by how much the normals of the halves differ.
const TURNS: [f64; 3] = [0.02, 0.2, 1.0];

/// Classes by distance: octaves, from 2⁻²⁰ m up.
const OCTAVES: usize = 40;

type Weights = [f64; FACTORS.len()];

/// What is expected of each part.
pub(crate) struct Gains {
    /// What halving it gains; of a part that has no halves, what all its cuts would [W²/m²].
    pub(crate) expected: Vec<f64>,
    rates: ClusterRates,
    /// By part that the pilot did not see halved, the mean of the factors that it may have.
    factors: Vec<f64>,
    /// All gains that follow over the first, of a part that has no halves.
    tail: f64,
    /// The number of parts that the pilot has seen.
    measured: usize,
}

impl Gains {
    /// The gains under a basis of the parts that a pilot of some walks has seen halved.
    pub(crate) fn new(clusters: &Clusters, seen: &[PartEstimate], (basis, pilot): (Basis, f64)) -> Self {
        let measured = seen.len();
        let rates = ClusterRates::new(clusters, seen, (basis, pilot));
        let tail = 1.0 / (1.0 - FALL[basis as usize]);
        let (expected, factors) = (vec![0.0; measured], vec![CAUTION; measured]);
        let mut gains = Gains { expected, rates, factors, tail, measured };
        let parts = || clusters.parts[..measured].iter().zip(seen);
        let is_halved: Vec<bool> = parts().map(|(part, _)| gains.has_measured(part)).collect();
        let base =
            |(part, seen): (&Cluster, &PartEstimate)| gains.rates.of(clusters, part) * seen.energy.max(0.0);
        let bases: Vec<f64> = parts().map(base).collect();
        let of = |part: usize| MeasuredGain::of(&seen[part], basis, pilot);
        let likelihoods = upwards(clusters, &is_halved, |part| {
            let measured = of(part);
            FACTORS.map(|factor| measured.likelihood(factor * bases[part]))
        });
        // By part, the weights of its factors, given all that is measured outside of it.
        let mut around = vec![Weights::default(); measured];
        clusters.roots.iter().for_each(|&root| around[root as usize] = LIKELY);
        for part in (0..measured).filter(|&part| is_halved[part]) {
            let mut weights = around[part];
            times(&mut weights, &likelihoods[part]);
            let (weights, measured) = (scaled(weights), of(part));
            gains.expected[part] = mean(&weights, |factor| measured.with(factor * bases[part])).max(0.0);
            for half in clusters.parts[part].halves.into_iter().flatten().map(|half| half as usize) {
                let mut weights = weights;
                if is_halved[half] {
                    divided(&mut weights, &upward(&likelihoods[half]));
                    around[half] = scaled(downward(&weights));
                } else {
                    gains.factors[half] = mean(&downward(&weights), |factor| factor);
                }
            }
        }
        gains
    }

    /// Whether the pilot has seen the halves of a part.
    pub(crate) fn has_measured(&self, part: &Cluster) -> bool {
        part.halves.is_some_and(|[half, _]| (half as usize) < self.measured)
    }

    /// The most that cutting a part may gain whose halves are not known.
    pub(crate) fn promise(&self, number: usize, part: &Cluster, seen: &PartEstimate) -> f64 {
        self.tail * self.factors[number] * self.rates.largest(part) * seen.energy.max(0.0)
    }

    /// Tells what is expected of a part of some energy that the pilot did not see halved, and which factors its halves have: that of the
    /// part, or one that is drawn anew.
    pub(crate) fn tell(&mut self, clusters: &Clusters, number: usize, energy: f64) {
        let part = &clusters.parts[number];
        let tail = if part.halves.is_none() { self.tail } else { 1.0 };
        self.expected[number] = tail * self.factors[number] * self.rates.of(clusters, part) * energy.max(0.0);
        self.expected.resize(clusters.parts.len(), 0.0);
        self.factors.resize(clusters.parts.len(), CAUTION);
        for half in part.halves.into_iter().flatten() {
            self.factors[half as usize] = STAY * self.factors[number] + (1.0 - STAY) * CAUTION;
        }
    }
}

/// By part that the pilot saw halved, the likelihood of all that is measured of it and its parts, by factor. `of_part` is that of the part
/// alone.
fn upwards(clusters: &Clusters, is_seen: &[bool], of_part: impl Fn(usize) -> Weights) -> Vec<Weights> {
    let mut likelihoods = vec![Weights::default(); is_seen.len()];
    for part in (0..is_seen.len()).rev().filter(|&part| is_seen[part]) {
        let mut weights = of_part(part);
        for half in clusters.parts[part].halves.into_iter().flatten().map(|half| half as usize) {
            if is_seen[half] {
                times(&mut weights, &upward(&likelihoods[half]));
            }
        }
        likelihoods[part] = scaled(weights);
    }
    likelihoods
}

/// The mean over weighted factors of what each makes likely.
fn mean(weights: &Weights, of: impl Fn(f64) -> f64) -> f64 {
    let sum: f64 = weights.iter().sum();
    weights.iter().zip(FACTORS).map(|(weight, factor)| weight * of(factor)).sum::<f64>() / sum
}

/// What parts are alike in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct SplitClass {
    octave: usize,
    turn: usize,
}

impl SplitClass {
    fn of(clusters: &Clusters, part: &Cluster) -> Self {
        let (square, turn) = match part.halves {
            // Halves would be about so far apart.
            None => (0.25 * part.area, 0.0),
            Some([a, b]) => {
                let [a, b] = [a, b].map(|half| &clusters.parts[half as usize]);
                ((a.middle[0] - b.middle[0]).length_squared(), (a.middle[1] - b.middle[1]).length_squared())
            }
        };
        SplitClass { octave: octave(square), turn: TURNS.iter().filter(|&&limit| turn > limit).count() }
    }
}

/// The octave of a distance, given by its square.
fn octave(square: f64) -> usize {
    // The exponent of the square, from −40 up, is twice that of the distance.
    let exponent = (square.to_bits() >> 52) as i64 - 1023;
    ((exponent + 40) / 2).clamp(0, OCTAVES as i64 - 1) as usize
}

/// What parts of each class gain in proportion to their energy.
struct ClusterRates {
    by_class: Vec<[f64; OCTAVES]>,
}

impl ClusterRates {
    fn new(clusters: &Clusters, seen: &[PartEstimate], (basis, pilot): (Basis, f64)) -> Self {
        // By class, sums of gains, of their variances, and of energies.
        let mut sums = vec![[[0.0; 3]; OCTAVES]; TURNS.len() + 1];
        let count = seen.len();
        for (part, seen) in clusters.parts.iter().zip(seen) {
            if part.halves.is_none_or(|[half, _]| half as usize >= count) {
                continue;
            }
            let class = SplitClass::of(clusters, part);
            let measured = MeasuredGain::of(seen, basis, pilot);
            let variance = measured.variance(measured.gain.max(0.0));
            let sum = &mut sums[class.turn][class.octave];
            [measured.gain, variance, seen.energy].iter().zip(sum).for_each(|(x, sum)| *sum += x);
        }
        let by_class = sums.iter().map(|sums| Self::of_octaves(sums, basis)).collect();
        ClusterRates { by_class }
    }

    /// The rates from the largest distance down: what is measured, and what the rate at twice the distance makes likely, weighed by their
    /// variances.
    fn of_octaves(sums: &[[f64; 3]; OCTAVES], basis: Basis) -> [f64; OCTAVES] {
        let (first, fall) = (FIRST_RATE[basis as usize], FALL[basis as usize]);
        let mut rates = [0.0; OCTAVES];
        let mut likely = first;
        for octave in (0..OCTAVES).rev() {
            let [gain, variance, energy] = sums[octave];
            rates[octave] = likely;
            if energy > 0.0 {
                let (rate, variance) = (gain / energy, variance / (energy * energy));
                let misfit = (2.0 * likely) * (2.0 * likely);
                rates[octave] = ((rate * misfit + likely * variance) / (misfit + variance)).max(0.1 * likely);
                likely = fall * rates[octave];
            } else if likely < first {
                likely *= fall;
            }
        }
        rates
    }

    fn of(&self, clusters: &Clusters, part: &Cluster) -> f64 {
        let class = SplitClass::of(clusters, part);
        self.by_class[class.turn][class.octave]
    }

    /// The largest rate that a part may have whose halves are not known.
    fn largest(&self, part: &Cluster) -> f64 {
        let octave = octave(0.25 * part.area);
        self.by_class.iter().fold(0.0, |most, rates| most.max(rates[octave]))
    }
}

/// A gain as it was measured.
struct MeasuredGain {
    gain: f64,
    /// The energy of the noise of one unknown in the pilot.
    noise: f64,
    /// New unknowns.
    unknowns: f64,
}

impl MeasuredGain {
    /// What a pilot of some walks has seen halving a part gain.
    fn of(seen: &PartEstimate, basis: Basis, pilot: f64) -> Self {
        MeasuredGain {
            gain: seen.gain[basis as usize],
            noise: seen.noise / pilot,
            unknowns: basis.unknowns(),
        }
    }

    /// The variance of the measurement where `gain` is gained.
    fn variance(&self, gain: f64) -> f64 {
        (4.0 * gain + 2.0 * self.unknowns * self.noise) * self.noise
    }

    /// The likelihood of the measurement where `gain` is gained, give or take a part of it, but for a factor: Student's with 15 degrees of
    /// freedom, as the pilot has 16 groups.
    fn likelihood(&self, gain: f64) -> f64 {
        let variance = self.variance(gain) + (MISFIT * gain) * (MISFIT * gain);
        if variance <= 0.0 {
            return 1.0;
        }
        let off = self.gain - gain;
        let square = 1.0 + off * off / (15.0 * variance);
        let fourth = (square * square) * (square * square);
        1.0 / (fourth * fourth * variance.sqrt())
    }

    /// The gain by the measurement and by what is expected.
    fn with(&self, expected: f64) -> f64 {
        let (variance, misfit) = (self.variance(expected), MISFIT * expected * MISFIT * expected);
        let sum = variance + misfit;
        if sum > 0.0 { (self.gain * misfit + expected * variance) / sum } else { expected }
    }
}

/// The likelihood of what is measured of a half, by the factors of the whole.
fn upward(half: &Weights) -> Weights {
    let mean: f64 = half.iter().zip(LIKELY).map(|(weight, likely)| weight * likely).sum();
    half.map(|weight| STAY * weight + (1.0 - STAY) * mean)
}

/// The weights of the factors of a half, from those of the whole.
fn downward(whole: &Weights) -> Weights {
    let sum: f64 = whole.iter().sum();
    std::array::from_fn(|k| STAY * whole[k] + (1.0 - STAY) * LIKELY[k] * sum)
}

fn times(weights: &mut Weights, by: &Weights) {
    weights.iter_mut().zip(by).for_each(|(weight, by)| *weight *= by);
}

fn divided(weights: &mut Weights, by: &Weights) {
    weights.iter_mut().zip(by).for_each(|(weight, by)| *weight /= by);
}

/// Weights over the largest of them.
fn scaled(weights: Weights) -> Weights {
    let largest = weights.iter().fold(f64::MIN_POSITIVE, |largest, &weight| largest.max(weight));
    weights.map(|weight| weight / largest)
}
