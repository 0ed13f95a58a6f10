//! What each source has scored, and where it emits.

use stats::Sizes;

use super::meaning::Meaning;
use super::solution::Estimates;

/// What each source has scored on one face in one channel, and what the scores are worth: all that estimates of mixtures of
/// the sources are made from.
#[derive(Clone, Debug, PartialEq)]
pub struct SourceScores {
    /// Σx and Σx² of the walks of each source, x in units.
    pub sums: Vec<[f64; 2]>,
    /// What units are worth where every source emits as the scene has it.
    pub meaning: Meaning,
    /// What the probabilities of [`Estimates::sizes_of_scores`] are multiplied by at most.
    pub scale: f64,
}

impl Estimates<'_> {
    /// What each source has scored on face i in one channel; `None` where sources are not distinguished, or where no walk gives an
    /// estimate.
    pub fn by_source(&self, i: usize, channel: usize) -> Option<SourceScores> {
        let groups = self.experiment().groups().filter(|groups| !groups.sources().is_empty())?;
        let meaning = self.experiment().meaning(i, channel, self.tally())?;
        let face = self.experiment().scene().faces().get(i);
        let scale = self.experiment().sizes((i, &face), channel).map_or(1.0, |(_, scale)| scale);
        let mut sums = vec![[0_u128; 2]; groups.sources().len()];
        for (class, [sum, sum_sq, _]) in groups.classes.iter().zip(groups.sums(self.tally(), i, channel)) {
            let of_source = &mut sums[class.source as usize];
            *of_source = [of_source[0] + sum, of_source[1] + sum_sq];
        }
        Some(SourceScores {
            sums: sums.iter().map(|sums| sums.map(|sum| sum as f64)).collect(),
            meaning,
            scale,
        })
    }

    /// The sizes of scores of shooting walks in a channel. `None`: all are worth the same.
    pub fn sizes_of_scores(&self, channel: usize) -> Option<&Sizes> {
        self.experiment().scene().emitters().sizes(channel)
    }

    /// The source of what face i emits, by number; `None` where it does not emit, or where sources are not distinguished.
    pub fn source_of(&self, i: usize) -> Option<usize> {
        let experiment = self.experiment();
        let groups = experiment.groups().filter(|groups| !groups.sources().is_empty())?;
        let emits = experiment.scene().faces().get(i).emittance.is_lit();
        emits.then(|| groups.classes[groups.class_of(i)].source as usize)
    }
}
