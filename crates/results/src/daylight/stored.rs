//! Counts of daylight coefficients as a folder keeps them, from which another count goes on.

use std::io::Write;
use std::path::Path;

use radiosity::daylight::SkyTally;
use report::OutputFolder;
use serde::{Deserialize, Serialize};

use super::count::FEWEST;
use super::question::DaylightQuestion;
use crate::error::Error;
use crate::rounds::Cost;

/// The file of counts, which is written after every round.
pub(crate) const COUNTS: &str = "daylight.counts.json";

/// The contents of the file [`COUNTS`].
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct DaylightCounts {
    /// Digest of all that the counts of given walks depend on.
    question: String,
    /// The walks that each cell is to have before the next look.
    pub(super) wanted: Vec<u64>,
    pub(super) tallies: Vec<SkyTally>,
    pub(super) cost: Cost,
}

impl DaylightCounts {
    /// Those of a question before the first walk.
    pub(super) fn none(question: &DaylightQuestion) -> Self {
        let cells = question.cells();
        DaylightCounts {
            question: digest(question),
            wanted: vec![FEWEST; cells],
            tallies: vec![SkyTally::new(question.dome.patches().count()); cells],
            cost: Cost::default(),
        }
    }

    /// What was kept of the same question.
    ///
    /// # Errors
    /// Where the counts are of another one, or cannot be read.
    pub(super) fn of_question(path: &Path, question: &DaylightQuestion) -> Result<Self, Error> {
        let unreadable = |reason| Error::UnreadableDaylight { path: path.into(), reason };
        let text = std::fs::read(path).map_err(|error| unreadable(error.to_string()))?;
        let kept: DaylightCounts =
            serde_json::from_slice(&text).map_err(|error| unreadable(error.to_string()))?;
        if kept.question != digest(question) {
            return Err(Error::OtherDaylight { path: path.into() });
        }
        let (cells, patches) = (question.cells(), question.dome.patches().count());
        let fits = kept.wanted.len() == cells
            && kept.tallies.len() == cells
            && kept.tallies.iter().all(|tally| tally.is_of(patches));
        match fits {
            true => Ok(kept),
            false => Err(unreadable("its counts are not those of the places and the sky".into())),
        }
    }

    /// Writes them.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub(super) fn write(&self, folder: &OutputFolder) -> Result<(), Error> {
        Ok(folder.write(COUNTS, |file| {
            serde_json::to_writer(&mut *file, self)?;
            file.write_all(b"\n")
        })?)
    }
}

/// Digest of all that the counts of given walks depend on. Weather, accuracy and budget choose the number of walks alone: other ones take counts on.
fn digest(question: &DaylightQuestion) -> String {
    let DaylightQuestion { job, scene, dome, .. } = question;
    let walks = (scene.hash(), job.seed, job.scene.sensors(), dome.patches().count());
    let all = serde_json::to_vec(&walks).expect("numbers and words");
    blake3::hash(&all).to_hex().to_string()
}
