//! What materials do to the light of every face: derivatives of B by reflectances and emittances.

use stats::{Moments, mean_interval};

use super::Experiment;
use super::groups::{Groups, SensitivityMaterial};
use super::solution::{Estimate, Estimates};
use crate::geometry::face::Face;
use crate::tally::Tally;
use crate::walk::collision::InfiniteEnd;
use crate::walk::estimator::Estimator;

/// A property of a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Property {
    /// The reflectance R.
    Reflectance,
    /// The emittance E.
    Emittance,
}

/// ∂B/∂R [W/m²] or ∂B/∂E of one face, in one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Derivative {
    /// The estimate of the derivative.
    pub value: f64,
    /// The standard error of the derivative for the whole run; `None` after a single walk, which cannot tell.
    pub std_error: Option<f64>,
    /// The lower end of the confidence interval.
    pub ci_low: f64,
    /// The upper end of the confidence interval.
    pub ci_high: f64,
}

impl Derivative {
    /// Whether no walk has told anything of it, so that its limits alone are known.
    pub fn is_unsampled(&self) -> bool {
        self.value == 0.0 && self.std_error == Some(0.0) && self.ci_high > self.ci_low
    }
}

/// What a tally says of the influence of materials.
#[derive(Clone, Debug)]
pub struct Influences<'a> {
    estimates: Estimates<'a>,
    groups: &'a Groups,
    confidence: f64,
    /// No walk of the tally was longer, but for one chance in a million [rays].
    longest: f64,
}

/// The chance that some walk of a tally is longer than bounds suppose.
const LONGER: f64 = 1e-6;

impl<'a> Influences<'a> {
    /// The influence of materials in a tally of the experiment; every interval has the level `confidence`. `None` where no
    /// influence was asked for, and for the estimate of a mixture: walks have marks of all sources together.
    pub fn new(experiment: &'a Experiment, tally: &'a Tally, confidence: f64) -> Option<Self> {
        let groups = experiment.groups().filter(|groups| !groups.materials().is_empty())?;
        if experiment.mixture().is_some() {
            return None;
        }
        let estimates = Estimates::new(experiment, tally, confidence);
        let most = experiment.scene().max_reflectance().max();
        let weakest = match experiment.method().estimator().and_then(Estimator::infinite_end) {
            Some(InfiniteEnd::Roulette { threshold }) => threshold,
            _ => 1.0,
        };
        let walks = tally.counts.walks.max(1) as f64;
        let longest = if most > 0.0 { (LONGER * weakest / walks).ln() / most.ln() } else { 0.0 };
        Some(Influences { estimates, groups, confidence, longest: 1.0 + longest })
    }

    /// The materials, by number.
    pub fn materials(&self) -> &'a [SensitivityMaterial] {
        self.groups.materials()
    }

    /// The light of the scene.
    pub fn estimates(&self) -> &Estimates<'a> {
        &self.estimates
    }

    /// The derivative of B on face i by a property of a material, channel by channel. `None` where walks cannot tell: by a
    /// reflectance of 0 in the channel, which no light is reflected by; by an emittance that is 0 in the channel, or that
    /// not all emitters of the material have.
    pub fn of(&self, material: usize, property: Property, i: usize) -> Vec<Option<Derivative>> {
        let face = self.estimates.scene().faces().get(i);
        let channels = 0..self.estimates.scene().channels();
        match property {
            Property::Reflectance => channels.map(|c| self.by_reflectance(material, (i, &face), c)).collect(),
            Property::Emittance => self.by_emittance(material, i),
        }
    }

    /// The mean mark over R_m, times what a score is worth.
    ///
    /// The bound on E\[y²\]/E\[y\] of marks y: let u_k be what the k-th score on the face is marked with, at most L·w for walks
    /// of at most L rays and weights of at most w. y² ≤ 2Σ_k u_k Σ_{l ≥ k} u_l. From each score on there are at most m in the
    /// mean, m = 1/(1 − σ_i·σ_max) (`meaning_of_shooting`), so that E\[y²\] ≤ 2·L·m·w·E\[y\].
    fn by_reflectance(&self, number: usize, (i, face): (usize, &Face), c: usize) -> Option<Derivative> {
        let (experiment, tally) = (self.estimates.experiment(), self.estimates.tally());
        let reflectance = self.groups.materials()[number].reflectance[c];
        if reflectance == 0.0 {
            return None;
        }
        let meaning = experiment.meaning_of((i, face), c, tally)?;
        let faces = experiment.scene().faces().len();
        let row = faces + self.groups.class_rows() + number * faces + i;
        let sums = tally.patch(row, c);
        let moments = Moments { n: tally.counts.walks, sum: sums[0], sum_sq: sums[1] };
        let visits = 1.0 / (1.0 - face.reflectance.max() * experiment.between_visits(i).max());
        let weight = experiment.scene().emitters().largest_weights()[c].max(1.0);
        let bound = 2.0 * self.longest * visits * weight;
        let sample = stats::Sample { counts: false, ..(&moments).into() };
        let interval = mean_interval(sample, meaning.unit, self.confidence, bound);
        let per_mark = face.reflectance[c] / reflectance * meaning.irradiance_per_event.unwrap_or(0.0);
        Some(Derivative {
            value: per_mark * meaning.unit * sample.mean().unwrap_or(0.0),
            std_error: sample.standard_error().map(|error| per_mark * meaning.unit * error),
            ci_low: per_mark * interval.low,
            ci_high: per_mark * interval.high,
        })
    }

    /// B is linear in E: the light of the material's own emitters, over E.
    fn by_emittance(&self, number: usize, i: usize) -> Vec<Option<Derivative>> {
        let emittance = self.groups.materials()[number].emittance;
        let light = emittance.and_then(|_| self.estimates.of_material(number)?.face(i));
        let by = |c: usize| {
            let emittance = emittance.map(|emittance| emittance[c]).filter(|&emittance| emittance > 0.0)?;
            let Estimate { radiosity, std_error, ci_low, ci_high, .. } = light.as_ref()?[c];
            Some(Derivative {
                value: radiosity / emittance,
                std_error: std_error.map(|error| error / emittance),
                ci_low: ci_low / emittance,
                ci_high: ci_high / emittance,
            })
        };
        (0..self.estimates.scene().channels()).map(by).collect()
    }
}
