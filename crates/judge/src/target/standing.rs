//! The accuracy of faces, held against what a target asks of each.

use job::{Target, Unhit};
use radiosity::{Channels, Estimate, Estimates, Face};

/// The accuracy of one face.
#[derive(Clone, Copy, Debug)]
pub(super) struct Standing {
    pub(super) area: f64,
    /// The largest relative error of its channels; infinite if no walk has hit it.
    pub(super) error: f64,
    /// The fewest effective scores of its channels; infinite if it is known without any.
    pub(super) scores: f64,
    pub(super) hits: u128,
}

impl Standing {
    /// The accuracy of a face; `None` if it has no score and the target ignores such faces.
    pub(super) fn new(patch: &Face, channels: &Channels, unhit: Unhit) -> Option<Self> {
        let unknown = || channels.iter().filter(|e| e.ci_high > e.ci_low);
        let error = unknown().map(Estimate::relative_error).fold(0.0, f64::max);
        let scores = unknown().map(|e| e.effective_scores).fold(f64::INFINITY, f64::min);
        let left_out = unhit == Unhit::Ignore && scores == 0.0;
        (!left_out).then(|| Standing { area: patch.area, error, scores, hits: channels[0].hits })
    }
}

/// All faces that a target is about and that walks can tell of: the chosen ones, or all that do not emit.
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
        None => Box::new(estimates.known().filter(|(_, patch, _)| !patch.emittance.is_lit())),
    }
}

/// The area that a target is about, in words.
pub fn scope(patches: Option<&[u32]>) -> String {
    match patches {
        None => "the patch area".into(),
        Some([patch]) => format!("patch {patch}"),
        Some(patches) => format!("the area of {} chosen patches", patches.len()),
    }
}

pub(super) fn standings<'a>(
    estimates: &'a Estimates,
    target: &'a Target,
) -> impl Iterator<Item = (usize, Standing)> + 'a {
    let unhit = target.unhit;
    about(estimates, target)
        .filter_map(move |(i, patch, channels)| Some((i, Standing::new(&patch, &channels, unhit)?)))
}

/// The requirements on one face: at most this relative error, from at least this many scores.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bar {
    pub(super) error: f64,
    pub(super) scores: f64,
}

impl Bar {
    pub(super) fn is_met(&self, standing: &Standing) -> bool {
        standing.error <= self.error && standing.scores >= self.scores
    }
}

/// The parts of the area that meet each of several requirements.
pub(super) fn parts_within<const N: usize>(
    standings: impl Iterator<Item = Standing>,
    bars: [Bar; N],
) -> [f64; N] {
    let (mut within, mut all) = ([0.0; N], 0.0);
    for standing in standings {
        all += standing.area;
        for (within, bar) in within.iter_mut().zip(bars) {
            *within += if bar.is_met(&standing) { standing.area } else { 0.0 };
        }
    }
    within.map(|within| if all > 0.0 { within / all } else { 1.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_target_goes_by_area_and_by_scores() {
        let standing = |area, error, scores| Standing { area, error, scores, hits: scores as u128 };
        let all = [standing(1.0, 0.1, 100.0), standing(2.0, 0.2, 50.0), standing(1.0, f64::INFINITY, 0.0)];
        let bars = [(0.1, 0.0), (0.2, 0.0), (0.2, 60.0), (1e300, 0.0)];
        let parts = parts_within(all.into_iter(), bars.map(|(error, scores)| Bar { error, scores }));
        assert_eq!(parts, [0.25, 0.75, 0.25, 0.75], "what no walk has hit is never known");
        assert_eq!(parts_within([].into_iter(), [Bar { error: 0.1, scores: 10.0 }]), [1.0]);
    }
}
