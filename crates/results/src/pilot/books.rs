//! `pilot.bin`: what the stages of a pilot have come to and what was chosen by them, so that a choice that is stopped goes on from there.

use std::io::{self, Write as _};
use std::path::Path;
use std::sync::Arc;

use job::Job;
use protocol::codec::{CodecError, decode_serde, encode_serde};
use radiosity::Tally;
use report::OutputFolder;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::stage::{EndedGroups, PilotStage, StageResult};
use super::steps::choice;
use crate::checkpoints::has_tally;
use crate::error::Error;
use crate::packed_tally::{PackedTally, sealed, unsealed};

/// The file of a pilot that is under way.
pub const PILOT: &str = "pilot.bin";

/// The stages of a pilot, as far as they are walked, and the steps of a choice.
#[derive(Default, Serialize, Deserialize)]
pub struct PilotBooks {
    /// The stages since the last step.
    stages: Vec<StoredStage>,
    /// The digest of the job whose choice it is.
    choice: [u8; 32],
    /// Whether that is the job of this process.
    #[serde(skip)]
    is_of_job: bool,
    /// What the steps of the choice came to, in their order.
    steps: Vec<Vec<u8>>,
    /// Whether the run goes on with what an earlier one has left, if anything.
    #[serde(skip)]
    pub(super) is_resumed: bool,
}

/// A stage as it is kept.
#[derive(Serialize, Deserialize)]
struct StoredStage {
    hash: [u8; 32],
    prefix: PackedTally,
    groups: Vec<PackedTally>,
}

impl PilotBooks {
    /// What is kept in a folder that is gone on with; nothing where that is not readable.
    pub fn read(folder: &OutputFolder) -> Self {
        PilotBooks { is_resumed: true, ..unsealed(&folder.file(PILOT)).unwrap_or_default() }
    }

    /// The walks of a stage that are kept, and the groups of them that have ended.
    pub fn past(&self, stage: &PilotStage) -> Option<(Arc<Tally>, EndedGroups)> {
        let hash = stage.hash();
        let kept = self.stages.iter().find(|kept| kept.hash == hash)?;
        let (rows, layout) = (stage.experiment().rows(), stage.experiment().layout());
        let prefix = kept.prefix.unpack(rows, layout)?;
        let group = |group: &PackedTally| group.unpack(rows, layout.without_squares());
        let groups = kept.groups.iter().map(group).collect::<Option<_>>()?;
        Some((prefix.into(), EndedGroups::of(stage, groups)?))
    }

    /// A stage of which all walks are kept.
    pub fn walked(&self, stage: &PilotStage) -> Option<StageResult> {
        let (prefix, groups) = self.past(stage)?;
        (prefix.counts.walks == stage.walks()).then(|| StageResult::new(groups, prefix))
    }

    /// Keeps a stage in a folder, as far as it is walked, beside those before it.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn keep(
        &mut self,
        stage: &PilotStage,
        (prefix, groups): (&Tally, &EndedGroups),
        folder: &OutputFolder,
    ) -> Result<(), Error> {
        self.begin(stage.job)?;
        let hash = stage.hash();
        let at = self.stages.iter().position(|kept| kept.hash == hash).unwrap_or_else(|| {
            self.stages.push(StoredStage { hash, prefix: PackedTally::of(prefix), groups: Vec::new() });
            self.stages.len() - 1
        });
        let kept = &mut self.stages[at];
        kept.prefix = PackedTally::of(prefix);
        let further = groups.ended.get(kept.groups.len()..).unwrap_or_default();
        kept.groups.extend(further.iter().map(PackedTally::of));
        let content = sealed(self).map_err(unpackable)?;
        Ok(folder.write(PILOT, |file| file.write_all(&content))?)
    }

    /// Keeps of which job the choice is, and gives up the steps of another.
    fn begin(&mut self, job: &Job) -> Result<(), Error> {
        if let (false, Some(auto)) = (self.is_of_job, &job.auto) {
            let choice = choice((job, auto))?;
            if self.choice != choice {
                (self.choice, self.steps) = (choice, Vec::new());
            }
            self.is_of_job = true;
        }
        Ok(())
    }

    /// What a step of the choice of a job came to, where it is kept.
    pub(super) fn step<T: DeserializeOwned>(&self, choice: [u8; 32], number: usize) -> Option<T> {
        let step = self.steps.get(number).filter(|_| self.choice == choice)?;
        decode_serde(step).ok()
    }

    /// Keeps what the next step of the choice of a job came to: it stands for the stages before it, and for what other jobs have chosen.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub(super) fn keep_step<T: Serialize>(
        &mut self,
        (choice, number): ([u8; 32], usize),
        step: &T,
        folder: &OutputFolder,
    ) -> Result<(), Error> {
        if self.choice != choice {
            (self.choice, self.steps) = (choice, Vec::new());
        }
        self.steps.truncate(number);
        self.steps.push(encode_serde(step).map_err(unpackable)?);
        self.stages.clear();
        let content = sealed(self).map_err(unpackable)?;
        // A loss of power may take it back: it took seconds.
        let written = report::write_soon(&folder.file(PILOT), &content);
        written.map_err(|source| Error::System { doing: "keeping what a pilot has chosen", source })
    }
}

/// Whether the tally in a folder is that of a run which a job with `--force` was to replace: a pilot of this job is kept beside it.
///
/// # Errors
/// Where the job is too large.
pub fn is_being_replaced(folder: &Path, job: &Job) -> Result<bool, Error> {
    let Some(auto) = job.auto.as_ref().filter(|_| has_tally(folder)) else { return Ok(false) };
    let Some(books) = unsealed::<PilotBooks>(&folder.join(PILOT)) else { return Ok(false) };
    Ok(books.choice == choice((job, auto))?)
}

fn unpackable(error: CodecError) -> Error {
    Error::System { doing: "packing a pilot", source: io::Error::other(error) }
}
