//! What gathering walks need beyond the scene: where they are born, and what the faces that they meet are worth.

use stats::Sizes;

use super::unfit::Unfit;
use crate::geometry::face::Face;
use crate::method::{Birth, Score};
use crate::scene::Scene;
use crate::scene::births::Births;
use crate::walk::estimator::{Estimator, Event, Repeats};

/// What gathering needs beyond the scene.
#[derive(Clone, Debug)]
pub(super) struct Gathering {
    pub(super) births: Births,
    /// p_i: the probability that a walk is born on face i.
    pub(super) probability: Vec<f64>,
    pub(super) values: EventValues,
    /// The largest value of an event [W/m²], per channel.
    pub(super) largest_value: [f64; 3],
    /// B̄ = max_s E_s/(1 − R_s) [W/m²], per channel.
    pub(super) b_bar: [f64; 3],
    /// A bound on E[x²]/E[x], x in events of the largest value, per channel.
    pub(super) ratio_bound: [f64; 3],
    /// What events are worth, over the largest value, each with the area [m²] on which arrivals score it, per channel.
    pub(super) sizes: [Sizes; 3],
}

/// What an event on patch j is worth, over the largest value.
#[derive(Clone, Debug)]
pub(super) enum EventValues {
    Grey(Vec<[f64; 1]>),
    Coloured(Vec<[f64; 3]>),
    /// The values of an arrival, a death and a survival.
    Related(Vec<[f64; 3]>),
}

/// p_i: the probability that a gathering walk is born on face i, for every face (S97 §3.1).
pub fn birth_probabilities(scene: &Scene, birth: &Birth) -> Vec<f64> {
    let faces = scene.faces();
    match birth {
        Birth::Area => {
            let total: f64 = faces.iter().map(|face| face.area).sum();
            faces.iter().map(|face| face.area / total).collect()
        }
        Birth::Uniform => vec![1.0 / faces.len() as f64; faces.len()],
        Birth::Patches(patches) => {
            let chosen: Vec<u32> = patches.iter().flat_map(|&patch| faces.of_patch(patch)).collect();
            let mut probabilities = vec![0.0; faces.len()];
            for &face in &chosen {
                probabilities[face as usize] = 1.0 / chosen.len() as f64;
            }
            probabilities
        }
    }
}

/// The numbers of the channels.
const PER_CHANNEL: [usize; 3] = [0, 1, 2];

/// In the order of `walk::score::RELATED`.
const RELATED_EVENTS: [Event; 3] = [Event::Arrival, Event::Absorption, Event::Survival];

impl Gathering {
    pub(super) fn new(scene: &Scene, birth: &Birth, score: Score) -> Result<Self, Unfit> {
        let (probability, estimator) = (birth_probabilities(scene, birth), score.estimator());
        let births =
            Births::new(scene.surfaces(), scene.faces(), |i| probability[i]).expect("probabilities sum to 1");
        let b_bar = PER_CHANNEL.map(|c| most(scene, c, |s| s.emittance[c] / (1.0 - s.reflectance[c])));
        let events = match score {
            Score::Mix => &RELATED_EVENTS[..],
            Score::Of(_) | Score::Linear(_) => &[estimator.kind().event()],
        };
        let largest_value = PER_CHANNEL.map(|c| {
            let of_event = |&event: &Event| most(scene, c, |face| value(face, event, c));
            events.iter().map(of_event).fold(0.0, f64::max)
        });
        if !largest_value.iter().all(|value| value.is_finite()) {
            let black = |face: &Face| face.emittance.is_lit() && !face.reflectance.is_lit();
            let black = scene.faces().iter().find(black).expect("dividing by no other σ is infinite");
            return Err(Unfit::BlackEmitter { patch: black.patch as usize });
        }
        // A channel without light has no value anywhere.
        let scaled = |face: &Face, event, c: usize| match value(face, event, c) {
            0.0 => 0.0,
            value => value / largest_value[c],
        };
        let (faces, event) = (scene.faces().iter(), estimator.kind().event());
        let values = match (score, scene.channels()) {
            (Score::Mix, _) => EventValues::Related(
                faces.map(|face| RELATED_EVENTS.map(|event| scaled(&face, event, 0))).collect(),
            ),
            (_, 1) => EventValues::Grey(faces.map(|face| [scaled(&face, event, 0)]).collect()),
            _ => EventValues::Coloured(
                faces.map(|face| PER_CHANNEL.map(|c| scaled(&face, event, c))).collect(),
            ),
        };
        let ratio_bound = PER_CHANNEL.map(|c| {
            if largest_value[c] == 0.0 {
                return 1.0;
            }
            // Below 1 only where related estimators share a unit.
            (largest_ratio(scene, estimator, b_bar[c], c) / largest_value[c]).max(1.0)
        });
        let sizes = PER_CHANNEL.map(|c| {
            let emitters = scene.faces().iter().filter(|face| face.emittance[c] > 0.0);
            let area = |face: &Face| face.area * event.probability(face.reflectance.max());
            Sizes::new(emitters.map(|face| (scaled(&face, event, c), area(&face))))
        });
        Ok(Gathering { sizes, births, probability, values, largest_value, b_bar, ratio_bound })
    }
}

/// What an event on face s is worth to a gathering walk of weight 1 [W/m²]: E_s/p_s, p_s the probability of the event
/// after an arrival (S97 propositions 3.1, 3.5, 3.6).
fn value(face: &Face, event: Event, channel: usize) -> f64 {
    match face.emittance[channel] {
        0.0 => 0.0,
        emittance => emittance / event.probability(face.reflectance.max()),
    }
}

/// The largest of a value over the sources of a channel.
fn most(scene: &Scene, channel: usize, value: impl Fn(&Face) -> f64) -> f64 {
    let sources = scene.faces().iter().filter(|face| face.emittance[channel] > 0.0);
    sources.fold(0.0, |max, source| value(&source).max(max))
}

/// A bound on E[x²]/E[x] of gathered scores x [W/m²] in one channel, whose weights never exceed 1. With b_s ≤
/// R_s·B̄ (S97 §3.3) the variances of S97 eqs. (13), (14) and SInf eq. (3) give max_s (E_s + 2R_sB̄)/p_s; an estimator that
/// scores once gathers at most max_s E_s/p_s. Rounding at random adds less than a unit to a score.
fn largest_ratio(scene: &Scene, estimator: Estimator, b_bar: f64, channel: usize) -> f64 {
    let event = estimator.kind().event();
    let largest = match estimator.kind().repeats() {
        Repeats::Never => most(scene, channel, |s| value(s, event, channel)),
        Repeats::Equal | Repeats::Weakening => most(scene, channel, |s| {
            let visits = s.emittance[channel] + 2.0 * s.reflectance[channel] * b_bar;
            visits / event.probability(s.reflectance.max())
        }),
    };
    largest * (1.0 + 1e-9)
}
