//! From a tally to radiosities with their confidence intervals.

use std::ops::Deref;

use stats::{Interval, Moments, Sample};

use super::chains::{By, ChainEstimate, Contributions, Student};
use super::mixture::Shares;
use crate::experiment::{Experiment, Meaning};
use crate::geometry::face::Face;
use crate::scene::Scene;
use crate::tally::Tally;

/// An estimate from fewer scores gets the flag `rare`: trust its interval, not its value.
const RARE_SCORES: f64 = 10.0;

/// The estimate of one face in one channel, with its interval.
///
/// ```
/// use radiosity::{EstimatorKind, Experiment, IndexChoice, Method, Scene, SceneSpec};
///
/// let scene = Scene::build(&SceneSpec::furnace(1, 0.5), IndexChoice::Auto)?;
/// let solution = Experiment::new(scene, Method::shooting(EstimatorKind::Collision))?.run(1, 10_000)?;
/// let [ceiling] = solution.face(0).expect("an active side")[..] else { panic!("one channel") };
/// assert!(ceiling.ci_low < ceiling.radiosity && ceiling.radiosity < ceiling.ci_high);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// B = E + b [W/m²]; E alone where nothing was scored ([`Estimate::known_radiosity`]).
    pub radiosity: f64,
    /// Standard error of B for the whole run [W/m²]; `None` after a single walk, which has no spread, and where nothing was
    /// scored.
    pub std_error: Option<f64>,
    /// Confidence interval of B [W/m²].
    pub ci_low: f64,
    /// The upper end of the interval [W/m²].
    pub ci_high: f64,
    /// H = φ/A [W/m²]; `None` where nothing was scored, or the estimator does not give it.
    pub irradiance: Option<f64>,
    /// Standard error of H [W/m²].
    pub irradiance_error: Option<f64>,
    /// Confidence interval of H [W/m²]; `None` if the estimator does not give it.
    pub irradiance_interval: Option<[f64; 2]>,
    /// Scored events; walks born here for gathering.
    pub hits: u128,
    /// (Σx)²/Σx² of the walks' scores x: the number of equal scores with the same information; less where the interval has room for scores that no walk
    /// has met.
    pub effective_scores: f64,
    /// How much too small b may be because walks were cut off [W/m²]; 0 for unbiased methods.
    pub bias_bound: f64,
    /// The same of H [W/m²], also where nothing is reflected.
    pub irradiance_bias: f64,
}

impl Estimate {
    /// Half-width of the interval of B over the estimate; infinite where nothing was scored.
    pub fn relative_error(&self) -> f64 {
        let half_width = 0.5 * (self.ci_high - self.ci_low);
        if half_width == 0.0 { 0.0 } else { half_width / self.known_radiosity().unwrap_or(0.0) }
    }

    /// Whether too few scores were seen for the standard error to mean much.
    pub fn is_rare(&self) -> bool {
        self.effective_scores < RARE_SCORES
    }

    /// Whether no walk has told anything of the light that comes in, and light may come in.
    pub fn is_unsampled(&self) -> bool {
        self.effective_scores == 0.0 && self.irradiance_interval.is_none_or(|[low, high]| high > low)
    }

    /// B, as far as it is known: exactly where nothing is reflected, at least E where the face emits; `None` where nothing was
    /// scored on a face that only reflects.
    pub fn known_radiosity(&self) -> Option<f64> {
        let unknown = self.is_unsampled() && self.ci_high > self.ci_low && self.radiosity == 0.0;
        (!unknown).then_some(self.radiosity)
    }
}

/// What is known of the channels of one face: one or three estimates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Channels {
    estimates: [Estimate; 3],
    count: usize,
}

impl Deref for Channels {
    type Target = [Estimate];

    fn deref(&self) -> &[Estimate] {
        &self.estimates[..self.count]
    }
}

impl Channels {
    /// `estimate` of each channel.
    fn new(count: usize, estimate: impl Fn(usize) -> Option<Estimate>) -> Option<Self> {
        let mut estimates = [estimate(0)?; 3];
        for (c, channel) in estimates[..count].iter_mut().enumerate().skip(1) {
            *channel = estimate(c)?;
        }
        Some(Channels { estimates, count })
    }
}

/// What a tally says of the faces of a scene, each estimated when it is asked for: of a million faces nothing is
/// kept but their tally.
///
/// ```
/// use radiosity::{EstimatorKind, Estimates, Experiment, IndexChoice, Method, Scene, SceneSpec};
///
/// let scene = Scene::build(&SceneSpec::furnace(3, 0.5), IndexChoice::Auto)?;
/// let experiment = Experiment::new(scene, Method::shooting(EstimatorKind::Collision))?;
/// let nothing = experiment.tally();
/// assert_eq!(Estimates::new(&experiment, &nothing, 0.95).iter().count(), 54);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Estimates<'a> {
    experiment: &'a Experiment,
    tally: &'a Tally,
    confidence: f64,
    /// Where the tally is of chains.
    pub(super) student: Option<Student>,
    /// Where the tally is of chains of links, or of batches of walks.
    contributions: Option<Contributions>,
    /// Where it is not the light of the walked scene that is estimated.
    shares: Option<Shares>,
    /// Whether anything emits in each channel; where nothing does, no light comes to any face.
    lit: [bool; 3],
}

impl<'a> Estimates<'a> {
    /// The solution of a tally of at least one walk; every interval has the level `confidence`.
    pub fn new(experiment: &'a Experiment, tally: &'a Tally, confidence: f64) -> Self {
        let student = (!experiment.unit().is_walk()).then(|| Student::new(tally.counts.walks, confidence));
        let contributions = Contributions::new(experiment, tally);
        let of_mixture =
            || Shares::new(experiment.groups()?, |class| experiment.factor_of(class.source)).into();
        let shares = experiment.mixture().and_then(|_| of_mixture());
        let lit = [0, 1, 2].map(|channel| experiment.scene().total_power(channel) > 0.0);
        Estimates { experiment, tally, confidence, student, contributions, shares: None, lit }
            .of_shares(shares)
    }

    /// The light of these shares, where there are any.
    fn of_shares(self, shares: Option<Shares>) -> Self {
        let Some(shares) = shares else { return self };
        let mut estimates = Estimates { shares: Some(shares), ..self };
        let faces = || estimates.scene().faces().iter().enumerate();
        let experiment = estimates.experiment;
        let of_lamps = |channel: usize| {
            let (Some(groups), Some(shares)) = (experiment.groups(), &estimates.shares) else { return false };
            let shines = |&lamp: &usize| experiment.scene().lamp_power(lamp, channel) > 0.0;
            let mut lamps = (0..experiment.scene().lamp_count()).filter(shines);
            lamps.any(|lamp| shares.counts(groups.class_of_lamp(lamp)))
        };
        let emits = |channel: usize| {
            of_lamps(channel) || faces().any(|(i, face)| estimates.shown(i, face).emittance[channel] > 0.0)
        };
        estimates.lit = [0, 1, 2].map(emits);
        estimates
    }

    /// The light of one source alone, by number; `None` where there is no such source.
    pub fn of_source(
        experiment: &'a Experiment,
        tally: &'a Tally,
        confidence: f64,
        source: usize,
    ) -> Option<Self> {
        let groups = experiment.groups().filter(|groups| source < groups.sources().len())?;
        let factor = |of: u32| if of as usize == source { experiment.factor_of(of) } else { 0.0 };
        let shares = Shares::new(groups, |class| factor(class.source));
        Some(Estimates::new(experiment, tally, confidence).of_shares(Some(shares)))
    }

    /// The light of the emitters of one material alone, by number.
    pub(super) fn of_material(&self, material: usize) -> Option<Self> {
        let groups = self.experiment.groups()?;
        let shares = Shares::new(groups, |class| f64::from(u8::from(class.material as usize == material)));
        Some(self.clone().of_shares(Some(shares)))
    }

    /// The scene, as it is estimated: where that is a mixture of its sources, with the emittances of the mixture.
    pub fn scene(&self) -> &'a Scene {
        self.experiment.mixture.as_ref().map_or(self.experiment.scene(), |mixture| &mixture.scene)
    }

    /// The method in the scene.
    pub fn experiment(&self) -> &'a Experiment {
        self.experiment
    }

    /// The tally that the estimates are made from.
    pub fn tally(&self) -> &'a Tally {
        self.tally
    }

    /// The estimate of face i; `None` if no walk gives an estimate.
    pub fn face(&self, i: usize) -> Option<Channels> {
        self.face_estimate(i).1
    }

    /// Face i as it is estimated, and what is known of it.
    pub fn face_estimate(&self, i: usize) -> (Face, Option<Channels>) {
        let face = self.shown(i, self.scene().faces().get(i));
        (face, self.of(i, &face))
    }

    /// Whether anything emits in a channel.
    pub(super) fn is_lit(&self, channel: usize) -> bool {
        self.lit[channel]
    }

    /// The face, without what it emits where that is not estimated.
    fn shown(&self, i: usize, face: Face) -> Face {
        match self.shares.as_ref().zip(self.experiment.groups()) {
            Some((shares, groups)) => shares.shown(groups, i, face),
            None => face,
        }
    }

    /// All faces by number, with what is known of them.
    pub fn iter(&self) -> impl Iterator<Item = (usize, Face, Option<Channels>)> {
        let faces = self.scene().faces().iter().enumerate();
        faces.map(|(i, face)| (i, self.shown(i, face))).map(|(i, face)| (i, face, self.of(i, &face)))
    }

    /// The faces for which some walk gives an estimate.
    pub fn known(&self) -> impl Iterator<Item = (usize, Face, Channels)> {
        self.iter().filter_map(|(i, face, channels)| Some((i, face, channels?)))
    }

    /// Absorption and survival mixed on face i; `None` if no walk gives an estimate, or the method does not ask for it.
    pub fn mix(&self, i: usize) -> Option<Mix> {
        if self.experiment.method().is_mix() { Mix::new(self.experiment, self.tally, i) } else { None }
    }

    fn of(&self, i: usize, face: &Face) -> Option<Channels> {
        Channels::new(self.scene().channels(), |channel| {
            let mut meaning = self.experiment.meaning_of((i, face), channel, self.tally)?;
            if !self.lit[channel] {
                meaning.irradiance_per_event = meaning.irradiance_per_event.map(|_| 0.0);
            }
            let moments = || moments(self.tally, i, channel);
            Some(match (&self.student, self.shares.as_ref().zip(self.experiment.groups())) {
                (Some(student), _) => {
                    let by = self.contributions.as_ref().map_or(By::Many { unmet: 0.0 }, |contributions| {
                        contributions.of((self.experiment, self.tally), (i, face), channel, student)
                    });
                    let sample = (&moments(), self.tally.events(i));
                    estimate_of_chains(face, channel, sample, &meaning, (student, by))
                }
                (None, Some((shares, groups))) => {
                    let (sample, events) = shares.sample(groups, self.tally, i, channel);
                    let interval = shares.interval(
                        (groups, self.tally, i, channel),
                        (&sample, meaning.unit),
                        &|sample| self.interval(sample, &meaning, (i, face), channel),
                    );
                    let interval = self.with_scores(sample, &meaning, interval);
                    estimate(face, channel, (sample, events), &shares.scaled(meaning), interval)
                }
                (None, None) => {
                    let sample = (&moments()).into();
                    let interval = self.interval(sample, &meaning, (i, face), channel);
                    let interval = self.with_scores(sample, &meaning, interval);
                    estimate(face, channel, (sample, self.tally.events(i)), &meaning, interval)
                }
            })
        })
    }
}

impl Estimates<'_> {
    /// The interval of the mean score [events] of walks on face i, with room for scores of sizes that no walk has met.
    fn interval(
        &self,
        sample: Sample,
        meaning: &Meaning,
        (i, face): (usize, &Face),
        channel: usize,
    ) -> Interval {
        let interval = self.interval_of_met(sample, meaning);
        match self.experiment.sizes((i, face), channel).filter(|_| sample.sum > 0.0) {
            Some((sizes, scale)) => {
                let unit = meaning.unit;
                let (mean, seen) = (unit * sample.sum / sample.n as f64, unit * sample.sum_sq / sample.sum);
                sizes.widen(interval, mean, (sample.n, self.confidence), seen, scale)
            }
            None => interval,
        }
    }

    /// What face i may reflect beyond what walks have found [W/m²]: by scores of sizes that none has met, or by any where none has scored. `None` if no walk
    /// gives an estimate.
    pub(super) fn unmet_by_walks(&self, (i, face): (usize, &Face), channel: usize) -> Option<f64> {
        let meaning = self.experiment.meaning_of((i, face), channel, self.tally)?;
        let sample: Sample = (&moments(self.tally, i, channel)).into();
        let all = self.interval(sample, &meaning, (i, face), channel).high;
        let met = if sample.sum > 0.0 { self.interval_of_met(sample, &meaning).high } else { 0.0 };
        Some(face.reflectance[channel] * meaning.irradiance_per_event? * (all - met))
    }

    /// The interval of the mean score [events], by what walks have scored.
    fn interval_of_met(&self, sample: Sample, meaning: &Meaning) -> Interval {
        stats::mean_interval(sample, meaning.unit, self.confidence, meaning.ratio_bound)
    }

    /// An interval of the mean score, with the number of equal scores that tell as much. Room for what no walk has met makes them fewer.
    fn with_scores(&self, sample: Sample, meaning: &Meaning, interval: Interval) -> (Interval, f64) {
        let scores = effective_scores(&sample);
        if sample.counts && meaning.unit == 1.0 {
            return (interval, scores);
        }
        let mean = meaning.unit * sample.sum / sample.n.max(1) as f64;
        let [met, all] = [self.interval_of_met(sample, meaning), interval].map(|of| of.high - mean);
        (interval, if all > met { scores * (met / all).powi(2) } else { scores })
    }
}

/// The estimates of all faces at once.
///
/// ```
/// use radiosity::{EstimatorKind, Experiment, IndexChoice, Method, Scene, SceneSpec, Solution};
///
/// let scene = Scene::build(&SceneSpec::furnace(3, 0.5), IndexChoice::Auto)?;
/// let experiment = Experiment::new(scene, Method::shooting(EstimatorKind::Collision))?;
/// let narrow = Solution::new(&experiment, &experiment.tally(), 0.5);
/// assert_eq!(narrow.estimates.len(), 54);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// By number, the channels of a face side by side; `None` if no walk gives an estimate.
    pub estimates: Vec<Option<Estimate>>,
    /// Channels per face: 1 or 3.
    pub channels: usize,
}

impl Solution {
    /// The solution from a tally of at least one walk.
    pub fn new(experiment: &Experiment, tally: &Tally, confidence: f64) -> Self {
        let channels = experiment.scene().channels();
        let of_patch = |known: Option<Channels>| (0..channels).map(move |c| known.map(|known| known[c]));
        let estimates = Estimates::new(experiment, tally, confidence);
        Solution { estimates: estimates.iter().flat_map(|(_, _, known)| of_patch(known)).collect(), channels }
    }

    /// The estimates of one face, channel by channel; `None` if no walk gives an estimate.
    pub fn face(&self, face: usize) -> Option<Vec<Estimate>> {
        self.estimates[face * self.channels..][..self.channels].iter().copied().collect()
    }
}

/// Absorption and survival of the same walks, mixed as the sample likes best (S97 §2.6, §3.7).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mix {
    /// α: the weight of survival that gives the least variance; 1 − α is that of absorption. `None` where the estimators agree walk by walk,
    /// or where one of them has hardly scored: then collision stands for both.
    pub alpha: Option<f64>,
    /// B by that mix [W/m²]. The weight was chosen by the same walks, which costs a bias of the order of 1/N.
    pub radiosity: f64,
    /// Its standard error for the whole run [W/m²].
    pub std_error: Option<f64>,
    /// Variance of collision over that of the mix: 1 where collision is the best.
    pub collision_excess: Option<f64>,
}

/// The least number of scores of absorption, and of survival, from which a weight is taken: it costs a bias of the order of 1 over them.
const MIXED_SCORES: f64 = 50.0;

impl Mix {
    /// The mix that a tally of related scores gives for a face; `None` if no walk gives an estimate.
    fn new(experiment: &Experiment, tally: &Tally, i: usize) -> Option<Self> {
        let face = experiment.scene().faces().get(i);
        let meaning = experiment.meaning_of((i, &face), 0, tally)?;
        let reflectance = face.reflectance[0];
        // A shooting walk scores hits, which are worth more the rarer the event is.
        let (absorbed, survived) = match experiment.gathers() {
            true => (1.0, 1.0),
            false if reflectance == 0.0 => (1.0, 0.0),
            false => (1.0 / (1.0 - reflectance), 1.0 / reflectance),
        };
        let [collision, absorption, survival, sum] = [0, 1, 2, 3].map(|score| moments(tally, i, score));
        let variance = |moments: &Moments| moments.standard_error().map_or(0.0, |error| error * error);
        let mean = |moments: &Moments| moments.mean().unwrap_or(0.0);
        let per_unit = meaning.unit * meaning.irradiance_per_event.unwrap_or(0.0) * reflectance;
        // Of few scores the weight would be chance, and lean to what is too dark.
        let is_rare = |moments: &Moments| effective_scores(&moments.into()) < MIXED_SCORES;
        if reflectance > 0.0 && (is_rare(&absorption) || is_rare(&survival)) {
            let error = collision.standard_error().filter(|_| collision.sum > 0);
            return Some(Mix {
                alpha: None,
                radiosity: face.emittance[0] + per_unit * mean(&collision),
                std_error: error.map(|error| per_unit * error),
                collision_excess: None,
            });
        }
        let (var_a, var_s) = (variance(&absorption), variance(&survival));
        let covariance = 0.5 * (variance(&sum) - var_a - var_s) * absorbed * survived;
        let (var_a, var_s) = (var_a * absorbed * absorbed, var_s * survived * survived);
        let denominator = var_a + var_s - 2.0 * covariance;
        let alpha = (denominator > 0.0 && survived > 0.0).then(|| (var_a - covariance) / denominator);
        let weight = alpha.unwrap_or(0.0);
        let mixed = |a: f64, s: f64| weight * survived * s + (1.0 - weight) * absorbed * a;
        let rest = 1.0 - weight;
        let mix_variance = weight * weight * var_s + rest * rest * var_a + 2.0 * weight * rest * covariance;
        Some(Mix {
            alpha,
            radiosity: face.emittance[0] + per_unit * mixed(mean(&absorption), mean(&survival)),
            std_error: collision.standard_error().map(|_| per_unit * mix_variance.max(0.0).sqrt()),
            collision_excess: (mix_variance > 0.0).then(|| variance(&collision) / mix_variance),
        })
    }
}

/// b = R·H: the interval of the mean score, through the meaning of a unit.
fn estimate(
    face: &Face,
    channel: usize,
    (sample, hits): (Sample, u128),
    meaning: &Meaning,
    (interval, effective_scores): (Interval, f64),
) -> Estimate {
    let Meaning { unit, irradiance_per_event, irradiance_bias, .. } = *meaning;
    let bias_bound = face.reflectance[channel] * irradiance_bias;
    // Where the estimator gives no irradiance the face has R = 0, so that b = 0 is still right.
    let reflected_per_event = face.reflectance[channel] * irradiance_per_event.unwrap_or(0.0);
    let mean = unit * sample.mean().unwrap_or(0.0);
    // A channel without light is known to have none; of one with light, no score says nothing but a bound.
    let scored = sample.sum > 0.0 || irradiance_per_event == Some(0.0);
    let error = sample.standard_error().filter(|_| scored).map(|error| unit * error);
    let radiosity = |mean_score: f64| face.emittance[channel] + reflected_per_event * mean_score;
    Estimate {
        radiosity: radiosity(mean),
        // What reflects nothing has no error, however few walks there were.
        std_error: match reflected_per_event {
            0.0 => Some(0.0),
            per_event => error.map(|error| per_event * error),
        },
        ci_low: radiosity(interval.low),
        ci_high: radiosity(interval.high) + bias_bound,
        irradiance: irradiance_per_event.filter(|_| scored).map(|per_event| per_event * mean),
        irradiance_error: irradiance_per_event.zip(error).map(|(per_event, error)| per_event * error),
        irradiance_interval: irradiance_per_event
            .map(|per_event| [per_event * interval.low, per_event * interval.high + irradiance_bias]),
        hits,
        effective_scores,
        bias_bound,
        irradiance_bias,
    }
}

/// The number of equal scores with the same information: (Σx)²/Σx².
fn effective_scores(sample: &Sample) -> f64 {
    if sample.sum_sq > 0.0 { sample.sum / sample.sum_sq * sample.sum } else { 0.0 }
}

/// The mean of the chains and its Student interval.
fn estimate_of_chains(
    face: &Face,
    channel: usize,
    (moments, landed): (&Moments, u128),
    meaning: &Meaning,
    (student, by): (&Student, By),
) -> Estimate {
    let per_event = meaning.irradiance_per_event.unwrap_or(0.0);
    let (emitted, reflectance) = (face.emittance[channel], face.reflectance[channel]);
    let ChainEstimate { mean, error, low, high } =
        student.estimate(moments, meaning.unit * per_event, per_event, by);
    let irradiance = meaning.irradiance_per_event;
    let bias_bound = reflectance * meaning.irradiance_bias;
    // Rays may land and bring no light, and shadow rays bring light where no ray has landed.
    let scored = moments.sum > 0;
    // A channel without light is known to have none.
    let dark = irradiance == Some(0.0);
    // Hits of unequal weights tell as much as their spread says, at most.
    let by_error = match (by, error) {
        (By::Hits { unequal: true, .. }, Some(error)) if error > 0.0 => (mean / error).powi(2),
        _ => f64::INFINITY,
    };
    let error = if dark { Some(0.0) } else { error };
    Estimate {
        radiosity: emitted + reflectance * mean,
        std_error: if reflectance == 0.0 { Some(0.0) } else { error.map(|error| reflectance * error) },
        ci_low: emitted + reflectance * low,
        ci_high: emitted + reflectance * high + bias_bound,
        irradiance: irradiance.filter(|_| scored || dark).map(|_| mean),
        irradiance_error: irradiance.and(error),
        irradiance_interval: irradiance.map(|_| [low, high + meaning.irradiance_bias]),
        hits: landed,
        effective_scores: if scored { (landed.max(1) as f64).min(by_error) } else { 0.0 },
        bias_bound,
        irradiance_bias: meaning.irradiance_bias,
    }
}

/// The exact power sums of one score on one face.
fn moments(tally: &Tally, face: usize, score: usize) -> Moments {
    let sums = tally.patch(face, score);
    Moments { n: tally.counts.walks, sum: sums[0], sum_sq: sums[1] }
}
