//! What a unit is worth: from the sums of a tally to power and radiosity.

use stats::Sizes;

use super::Experiment;
use super::gathering::Gathering;
use crate::geometry::face::Face;
use crate::geometry::spec::Spectrum;
use crate::jacobi;
use crate::jacobi::final_gather::LIGHT_BY_SHADOW_RAYS;
use crate::jacobi::plan::Solve;
use crate::method::{Chains, Method};
use crate::tally::{Counts, Tally};
use crate::walk::collision::InfiniteEnd;
use crate::walk::estimator::{Estimator, Repeats};
use crate::walk::score::FIXED_UNITS;

/// The factors that turn the sums of scores on one face into radiosity and irradiance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Meaning {
    /// One unit of score, in events (hits; for gathering, events of the largest value).
    pub unit: f64,
    /// H per event: incoming power over area [W/m²]. `None` if the estimator does not give it (survival on a
    /// face of reflectance 0).
    pub irradiance_per_event: Option<f64>,
    /// A bound on E[x²]/E[x], x in events.
    pub ratio_bound: f64,
    /// A bound on how much too small H may be [W/m²]: walks that were cut off. b may be by R times as much.
    pub irradiance_bias: f64,
}

impl Experiment {
    /// What the sums of face i mean in one channel; `None` if no walk gives an estimate (gathering, p_i = 0).
    pub fn meaning(&self, i: usize, channel: usize, tally: &Tally) -> Option<Meaning> {
        self.meaning_of((i, &self.scene.faces().get(i)), channel, tally)
    }

    /// [`Experiment::meaning`] for a face that is at hand.
    pub(super) fn meaning_of(
        &self,
        (i, face): (usize, &Face),
        channel: usize,
        tally: &Tally,
    ) -> Option<Meaning> {
        match (&self.method, &self.gathering) {
            (Method::Walks(walks), Some(gathering)) => {
                let estimator = walks.score.estimator();
                self.meaning_of_gathering(gathering, estimator, i, channel)
            }
            (Method::Walks(walks), None) => {
                Some(self.meaning_of_shooting(walks.score.estimator(), (i, face), channel, tally))
            }
            (Method::Batches(batches), _) => {
                let (estimator, _) = batches.score.of_walks();
                let walks = self.meaning_of_shooting(estimator, (i, face), channel, tally);
                let batch = self.meaning_of_batches(face, channel, false);
                Some(Meaning {
                    irradiance_per_event: walks.irradiance_per_event.and(batch.irradiance_per_event),
                    irradiance_bias: walks.irradiance_bias,
                    ..batch
                })
            }
            (Method::Chains(Chains { solve, .. }), _) => {
                Some(self.meaning_of_batches(face, channel, *solve == Solve::Links))
            }
        }
    }

    /// A batch scores H itself, over the largest radiosity there can be. Solved links do not exceed that; rays and walks
    /// cannot bring in more than all the light that is under way, Φ_T/(1 − R_max) at most (P_T of BS §4). A final gather
    /// may find all of it on the smallest face, and emitters by both kinds of its rays.
    fn meaning_of_batches(&self, face: &Face, channel: usize, links: bool) -> Meaning {
        let (scene, largest) = (&self.scene, self.largest_radiosity[channel]);
        let all = scene.total_power(channel) / (1.0 - scene.max_reflectance()[channel]);
        let gathered = self.method.final_gather().contains(&face.patch);
        let most = if gathered {
            1.0 + LIGHT_BY_SHADOW_RAYS + all / self.least_area / largest
        } else {
            all / face.area / largest
        };
        Meaning {
            unit: 1.0 / jacobi::UNITS,
            irradiance_per_event: Some(largest),
            ratio_bound: if links && !gathered { 1.0 } else { most.max(1.0) },
            irradiance_bias: 0.0,
        }
    }

    /// b_i = (R_i/A_i)φ_i, φ_i = Φ_T/p_i × the mean score, p_i the probability of the event after an
    /// arrival (S97 propositions 2.1, 2.9, 2.14).
    ///
    /// A face on one plane cannot hit itself, so between two visits a walk survives on it and on another face: it
    /// returns with probability at most σ_i·σ_max. Visits after the first are then at most geometric, m =
    /// 1/(1 − σ_i·σ_max) of them in the mean, and E[x²]/E[x] ≤ 2m − 1 of the largest weight w there can be. A
    /// weight that is multiplied by R_i·R_max between visits scores at most m·w in all. A group of cells on several surfaces may
    /// hit itself, and a walk that survives on it returns with any probability: 1 stands in place of σ_max and R_max.
    pub(super) fn meaning_of_shooting(
        &self,
        estimator: Estimator,
        (i, face): (usize, &Face),
        channel: usize,
        tally: &Tally,
    ) -> Meaning {
        let per_hit = self.scene.total_power(channel) / face.area;
        let survival = face.reflectance.max();
        let between = self.between_visits(i);
        let visits = 1.0 / (1.0 - survival * between.max());
        let weakened = 1.0 / (1.0 - face.reflectance[channel] * between[channel]);
        let weight = self.scene.emitters().largest_weights()[channel];
        let probability = estimator.kind().probability(survival);
        let scale = (probability > 0.0).then(|| 1.0 / probability);
        let ratio_bound = match estimator.kind().repeats() {
            Repeats::Never => 1.0,
            Repeats::Equal => 2.0 * visits - 1.0,
            Repeats::Weakening => weakened,
        };
        // Power that was cut off would have come in here at most this often.
        let counts = &tally.counts;
        let cut_off =
            counts.truncated_weight[channel] as f64 / Counts::WEIGHT_UNITS / counts.walks.max(1) as f64;
        Meaning {
            unit: if tally.layout().events { 1.0 / FIXED_UNITS } else { 1.0 },
            irradiance_per_event: scale.map(|scale| scale * per_hit),
            // A colour of light that all emitters share has weights of 1, but for rounding.
            ratio_bound: (weight * ratio_bound).max(1.0),
            irradiance_bias: per_hit * cut_off * weakened,
        }
    }

    /// The sizes that scores on face i may have, in events, and what their probabilities are multiplied by at most; `None` where all events are worth the
    /// same, and of chains. A walk comes to a face 1/(1 − σ_i·σ_max) times at most in the mean; by reciprocity a gathering walk
    /// born on face i then meets face j A_j/A_i times as often.
    pub(super) fn sizes(&self, (i, face): (usize, &Face), channel: usize) -> Option<(&Sizes, f64)> {
        let (Method::Walks(_) | Method::Batches(_)) = &self.method else { return None };
        let visits = 1.0 / (1.0 - face.reflectance.max() * self.between_visits(i).max());
        match &self.gathering {
            Some(gathering) => {
                Some((&gathering.sizes[channel], gathering.probability[i] * visits / face.area))
            }
            None => self.scene.emitters().sizes(channel).map(|sizes| (sizes, visits)),
        }
    }

    /// The largest part of the light that left face i that may come back to it: what the next face reflects, or all of it where
    /// the next face may be face i.
    pub(super) fn between_visits(&self, i: usize) -> Spectrum {
        let returns = self.scene.faces().may_see_itself(i);
        if returns { Spectrum::from(1.0) } else { self.scene.max_reflectance() }
    }

    /// b_i = R_i × the mean score / p_i, p_i the probability of a birth on face i (S97 propositions 3.1, 3.5, 3.6).
    fn meaning_of_gathering(
        &self,
        gathering: &Gathering,
        estimator: Estimator,
        i: usize,
        channel: usize,
    ) -> Option<Meaning> {
        let probability = gathering.probability[i];
        if probability == 0.0 {
            return None;
        }
        // What is left of a walk that is cut off is worth at most its weight times B̄.
        let cut_off = match estimator.infinite_end() {
            Some(InfiniteEnd::Cutoff { threshold }) => threshold,
            Some(InfiniteEnd::Length { length }) => {
                self.scene.max_reflectance()[channel].powf(f64::from(length))
            }
            Some(InfiniteEnd::Roulette { .. }) | None => 0.0,
        };
        Some(Meaning {
            unit: 1.0 / FIXED_UNITS,
            irradiance_per_event: Some(gathering.largest_value[channel] / probability),
            ratio_bound: gathering.ratio_bound[channel],
            irradiance_bias: cut_off * gathering.b_bar[channel],
        })
    }
}
