//! The parts of the power that arrive after 0, 1, 2 and more reflections, by a pilot of single walks.

use radiosity::{Experiment, Sequence};
use report::Bounce;

/// The most walks of the pilot; it ends earlier if walks are long.
const WALKS: u64 = 1000;

/// The number of arrivals at which the pilot ends.
const ARRIVALS: usize = 20_000;

/// The number of rows: direct light, one reflection, two, and the rest.
const BOUNCES: usize = 4;

/// The shares of a method's power by number of reflections. `None` for gathering walks, which carry importance, and if
/// nothing arrives.
pub fn bounces(experiment: &Experiment) -> Option<Vec<Bounce>> {
    if experiment.gathers() {
        return None;
    }
    let sequence = Sequence::new(0);
    let (mut walks, mut arrivals) = (Vec::new(), 0);
    for walk in 0..WALKS {
        if arrivals > ARRIVALS {
            break;
        }
        let mut power = [0.0; BOUNCES];
        for (reflections, step) in experiment.replay_beginning(&sequence, walk).iter().enumerate() {
            power[reflections.min(BOUNCES - 1)] += arriving(experiment, &step.weights);
            arrivals += 1;
        }
        walks.push(power);
    }
    let total: f64 = walks.iter().flatten().sum();
    let share = |reflections: usize| {
        let part = walks.iter().map(|power| power[reflections]).sum::<f64>() / total;
        // The standard error of a quotient of two sums over walks.
        let off = |power: &[f64; BOUNCES]| (power[reflections] - part * power.iter().sum::<f64>()).powi(2);
        let std_error = walks.iter().map(off).sum::<f64>().sqrt() / total;
        Bounce { reflections, or_more: reflections == BOUNCES - 1, part, std_error }
    };
    (total > 0.0).then(|| (0..BOUNCES).map(share).collect())
}

/// The power that a walk brings to a face, over that of a walk at its birth, summed over channels.
fn arriving(experiment: &Experiment, weights: &[f64]) -> f64 {
    let power = |c: usize| experiment.scene().total_power(c);
    let channels = 0..weights.len();
    let brought: f64 = channels.clone().map(|c| weights[c] * power(c)).sum();
    brought / channels.map(power).sum::<f64>()
}
