//! The accuracy of faces, held against what a target asks of each.

use job::{Target, Unhit};
use parallel::run_on_all_cores;
use radiosity::{
    Estimate, Estimates,
    methods::Channels,
    precision::{Place, Reach},
    surfaces::Face,
};

/// The accuracy of one face.
#[derive(Clone, Copy, Debug)]
pub(super) struct FaceAccuracy {
    pub(super) area: f64,
    /// The largest relative error of its channels; infinite if no walk has hit it.
    pub(super) error: f64,
    /// The fewest effective scores of its channels.
    pub(super) scores: f64,
    pub(super) hits: u128,
}

impl FaceAccuracy {
    /// The accuracy of a face; `None` where its quantity is known without any walk or the estimator does not give it, and where it
    /// has no score and the target ignores such faces.
    pub(super) fn new(face: &Face, channels: &Channels, target: &Target) -> Option<Self> {
        let Target { quantity, unhit, .. } = *target;
        let judged =
            |(c, e): (usize, &Estimate)| Some((quantity.of(face, c, e)?.relative(0.0), e.effective_scores));
        let judged = channels.iter().enumerate().filter_map(judged);
        let (error, scores) = judged.reduce(|a, b| (a.0.max(b.0), a.1.min(b.1)))?;
        let left_out = unhit == Unhit::Ignore && scores == 0.0;
        (!left_out).then(|| FaceAccuracy { area: face.area, error, scores, hits: channels[0].hits })
    }
}

/// All faces that a target is about and that walks can tell of: the chosen ones, or all.
pub fn about<'a>(
    estimates: &'a Estimates,
    target: &'a Target,
) -> Box<dyn Iterator<Item = (usize, Face, Channels)> + 'a> {
    let faces = estimates.scene().faces();
    match &target.patches {
        Some(chosen) => {
            Box::new(chosen.iter().flat_map(|&patch| faces.of_patch(patch)).filter_map(move |i| {
                let i = i as usize;
                Some((i, faces.get(i), estimates.face(i)?))
            }))
        }
        None => Box::new(estimates.known()),
    }
}

/// The accuracy of all faces that a target is about: where it names no patches, of those that a headline is about, too.
pub(super) fn face_accuracies(estimates: &Estimates, target: &Target) -> Vec<(usize, FaceAccuracy)> {
    let mut hit = vec![false; estimates.scene().faces().len()];
    let mut all = Vec::new();
    for (i, face, channels) in about(estimates, target) {
        hit[i] = !channels.iter().any(Estimate::is_unsampled);
        all.extend(FaceAccuracy::new(&face, &channels, target).map(|accuracy| (i, accuracy)));
    }
    if target.patches.is_none() {
        let reach = Reach::new(estimates, &hit, &run_on_all_cores);
        all.retain_mut(|(i, accuracy)| {
            let Place::Room { part } = reach.of(*i as u32, hit[*i]) else { return false };
            accuracy.area *= part;
            true
        });
    }
    all
}

/// The requirements on one face: at most this relative error, from at least this many scores.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bar {
    pub(super) error: f64,
    pub(super) scores: f64,
}

impl Bar {
    pub(super) fn is_met(&self, accuracy: &FaceAccuracy) -> bool {
        accuracy.error <= self.error && accuracy.scores >= self.scores
    }
}

/// The parts of the area that meet each of several requirements; 0 where there is nothing to judge.
pub(super) fn parts_within<const N: usize>(
    face_accuracies: impl Iterator<Item = FaceAccuracy>,
    bars: [Bar; N],
) -> [f64; N] {
    let (mut within, mut all) = ([0.0; N], 0.0);
    for accuracy in face_accuracies {
        all += accuracy.area;
        for (within, bar) in within.iter_mut().zip(bars) {
            *within += if bar.is_met(&accuracy) { accuracy.area } else { 0.0 };
        }
    }
    within.map(|within| if all > 0.0 { within / all } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_target_goes_by_area_and_by_scores() {
        let accuracy = |area, error, scores| FaceAccuracy { area, error, scores, hits: scores as u128 };
        let all = [accuracy(1.0, 0.1, 100.0), accuracy(2.0, 0.2, 50.0), accuracy(1.0, f64::INFINITY, 0.0)];
        let bars = [(0.1, 0.0), (0.2, 0.0), (0.2, 60.0), (1e300, 0.0)];
        let parts = parts_within(all.into_iter(), bars.map(|(error, scores)| Bar { error, scores }));
        assert_eq!(parts, [0.25, 0.75, 0.25, 0.75], "what no walk has hit is never known");
        let nothing = parts_within([].into_iter(), [Bar { error: 0.1, scores: 0.0 }]);
        assert_eq!(nothing, [0.0], "where nothing is judged no target is met");
    }
}
