//! Laws by which the light of a surface may vary along an axis, weighed by what a pilot has measured.
//!
//! A law says what each doubling of the cells along the axis gains, in proportion to the energy of the surface's mean light. The gains
//! stay nearly alike up to a level, at which cells are as small as what varies in the light, and fall by one ratio from there on. A
//! measurement multiplies the weight of every law by its likelihood; what is expected of a doubling is the mean over all laws. Only
//! sums, products, quotients and square roots enter, so that the weights are alike on every machine.

use super::seen::Basis;

/// The largest gains together, as a part of the energy. Light in one corner has more than that of its mean.
const MOST: f64 = 2.0;

/// Gains together are those of [`MOST`], halved up to this many times but one: less than a thousandth does not pay.
const SIZES: u32 = 12;

/// The part of a gain that the one before it is, up to the level where gains begin to fall.
const RISE: f64 = 0.7;

/// The level from which gains fall, what the first doubling gains in proportion, and the weight of such laws. Halves of a symmetric
/// surface have equal means, so that a first doubling may gain little.
const SHAPES: [(u32, f64, f64); 5] =
    [(0, 1.0, 0.5), (0, 0.1, 0.15), (1, 1.0, 0.15), (2, 1.0, 0.1), (3, 1.0, 0.1)];

/// The weight of the law by which nothing varies, all others together having 1: most gains that a pilot could measure are none.
const NONE: f64 = 5.0;

/// The standard deviation of a gain about that of its law, as a part of it.
const MISFIT: f64 = 0.7;

/// The ratios by which gains fall: 1/2 at the edge of a shadow, 1/4 (constants) or 1/16 (linear fits) in smooth light.
fn ratios(basis: Basis) -> &'static [f64] {
    match basis {
        Basis::Constant => &[0.5, 0.25],
        Basis::Linear => &[0.5, 0.25, 0.125, 0.0625],
    }
}

/// What one or more doublings were seen to gain.
#[derive(Clone, Copy)]
pub(super) struct MeasuredDoublings {
    /// Without bias [W²/m²].
    pub(super) gain: f64,
    /// The energy of the noise of one unknown, ν: the square of a coefficient c has the variance 4c²ν + 2ν².
    pub(super) noise: f64,
    /// New unknowns.
    pub(super) unknowns: f64,
}

impl MeasuredDoublings {
    /// The variance of the measurement where `gain` is gained.
    fn variance(&self, gain: f64) -> f64 {
        (4.0 * gain + 2.0 * self.unknowns * self.noise) * self.noise
    }

    /// The likelihood of the measurement where `gain` is gained, give or take a part of it, but for a factor: Student's with 15
    /// degrees of freedom, whose tails allow for hits that go together.
    fn likelihood(&self, gain: f64, misfit: f64) -> f64 {
        let variance = self.variance(gain) + (misfit * gain) * (misfit * gain);
        let off = self.gain - gain;
        let square = 1.0 + off * off / (15.0 * variance);
        let fourth = (square * square) * (square * square);
        1.0 / (fourth * fourth * variance.sqrt())
    }

    /// The gain, by the measurement and what laws expect.
    fn with(&self, expected: f64) -> f64 {
        let (variance, misfit) = (self.variance(expected), MISFIT * expected);
        (self.gain * misfit * misfit + expected * variance) / (misfit * misfit + variance)
    }
}

/// What laws say before anything is measured, of all surfaces alike.
pub(super) struct Code {
    /// Law by law, what the doublings of all levels gain, in proportion to the energy of the mean light.
    gains: Vec<f64>,
    levels: usize,
    weights: Vec<f64>,
}

impl Code {
    /// The laws for doublings up to a level.
    pub(super) fn new(basis: Basis, levels: u32) -> Self {
        let (mut gains, mut weights) = (Vec::new(), Vec::new());
        for &ratio in ratios(basis) {
            for size in 0..SIZES {
                let all = MOST / f64::from(1_u32 << size);
                for (peak, first, weight) in SHAPES {
                    let gain = |level: u32| {
                        let to_peak =
                            if level < peak { power(RISE, peak - level) } else { power(ratio, level - peak) };
                        all * (1.0 - ratio) * to_peak * if level == 0 { first } else { 1.0 }
                    };
                    gains.extend((0..levels).map(gain));
                    weights.push(weight / f64::from(SIZES * ratios(basis).len() as u32));
                }
            }
        }
        Code { gains, levels: levels as usize, weights }
    }
}

/// The laws of one axis of one surface, with their weights.
pub(super) struct Laws<'a> {
    code: &'a Code,
    /// The energy of the mean light [W²/m²].
    energy: f64,
    weights: Vec<f64>,
    /// The weight of the law by which nothing varies.
    none: f64,
}

impl<'a> Laws<'a> {
    /// The laws before anything is measured, of a surface whose mean light has an energy.
    pub(super) fn new(code: &'a Code, energy: f64) -> Self {
        Laws { code, energy, weights: code.weights.clone(), none: NONE }
    }

    /// What some doublings from a level on gain together, by each law.
    fn gains(&self, level: usize, doublings: usize) -> impl Iterator<Item = f64> {
        let laws = self.code.gains.chunks_exact(self.code.levels);
        laws.map(move |gains| self.energy * gains[level..level + doublings].iter().sum::<f64>())
    }

    /// What the doubling of a level is expected to gain.
    pub(super) fn expected(&self, level: usize) -> f64 {
        let sum: f64 = self.weights.iter().sum();
        let gains = self.gains(level, 1).zip(&self.weights);
        gains.map(|(gain, weight)| weight * gain).sum::<f64>() / (self.none + sum)
    }

    /// What some doublings gain together by their measurement and by what it makes of the laws.
    pub(super) fn measured_gain(&self, level: usize, doublings: usize, measured: &MeasuredDoublings) -> f64 {
        let (mut sum, mut weights) = (0.0, self.none * measured.likelihood(0.0, MISFIT));
        for (gain, weight) in self.gains(level, doublings).zip(&self.weights) {
            let weight = weight * measured.likelihood(gain, MISFIT);
            sum += weight * gain;
            weights += weight;
        }
        measured.with(sum / weights)
    }

    /// What the doubling of a level gains, as all measurements tell.
    pub(super) fn gain(&self, level: usize, measured: Option<&MeasuredDoublings>) -> f64 {
        let expected = self.expected(level);
        measured.map_or(expected, |measured| measured.with(expected)).max(0.0)
    }

    /// Takes note of a measurement of the doubling of a level.
    pub(super) fn learn(&mut self, level: usize, measured: &MeasuredDoublings) {
        let likelihoods: Vec<f64> =
            self.gains(level, 1).map(|gain| measured.likelihood(gain, MISFIT)).collect();
        self.weights.iter_mut().zip(likelihoods).for_each(|(weight, likelihood)| *weight *= likelihood);
        self.none *= measured.likelihood(0.0, MISFIT);
        let largest = self.weights.iter().fold(self.none, |largest, &weight| largest.max(weight));
        self.none /= largest;
        self.weights.iter_mut().for_each(|weight| *weight /= largest);
    }

    /// How much likelier the measurements are where the light varies than where it does not.
    pub(super) fn odds(&self) -> f64 {
        let none = (self.none / NONE).max(f64::MIN_POSITIVE);
        self.weights.iter().sum::<f64>() / none
    }
}

fn power(base: f64, exponent: u32) -> f64 {
    (0..exponent).fold(1.0, |product, _| product * base)
}
