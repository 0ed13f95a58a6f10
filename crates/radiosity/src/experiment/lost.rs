//! Power that no surface absorbs.

use stats::Measured;

use super::Experiment;
use crate::tally::Counts;

/// Parts of the power that no active side absorbs, all channels together: Σ_c Φ_c p_c/Σ_c Φ_c, where p_c is the mean weight of
/// channel c with which walks end so. Gathering walks carry importance in place of power, one unit in each channel.
///
/// The standard errors are bounds: p (1 − p)/n is the largest variance of the mean of n weights in \[0, 1\], and 3p/n of those in
/// \[0, 3\], as coloured walks carry them. Those of chains are infinite, since chains keep no squares of such weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lost {
    /// The part that left the scene.
    pub escaped: Measured,
    /// The part that ended on backs of one-sided surfaces.
    pub on_backs: Measured,
    /// The part that walks carried when they were cut off.
    pub cut_off: Measured,
}

impl Experiment {
    /// The power that no surface absorbs, by the counts of a tally.
    pub fn lost(&self, counts: &Counts) -> Lost {
        let channels = self.scene.channels();
        let power = |c: usize| if self.gathers() { 1.0 } else { self.scene.total_power(c) };
        let all: f64 = (0..channels).map(power).sum();
        let walks = counts.walks.max(1) as f64;
        let variance = |p: f64| match channels {
            _ if self.unit().is_chain() => f64::INFINITY,
            1 => p * (1.0 - p).max(0.0),
            _ => 3.0 * p,
        };
        let part = |weights: [u128; 3]| {
            let (mut value, mut standard_error) = (0.0, 0.0);
            for (c, weight) in
                weights.into_iter().enumerate().take(channels).filter(|(_, weight)| *weight > 0)
            {
                let (share, p) = (power(c) / all, weight as f64 / (walks * Counts::WEIGHT_UNITS));
                value += share * p;
                standard_error += share * (variance(p) / walks).sqrt();
            }
            Measured { value, standard_error }
        };
        Lost {
            escaped: part(counts.escaped_weight),
            on_backs: part(counts.absorbed_back_weight),
            cut_off: part(counts.truncated_weight),
        }
    }
}
