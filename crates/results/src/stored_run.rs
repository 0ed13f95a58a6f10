//! A result that was kept: the tally of an output folder, and the job that it was walked for.

use std::path::Path;

use job::Partition;
use protocol::{Checkpoint, CheckpointError, CheckpointFault};
use radiosity::{Estimates, Experiment, sensitivity::Influences, sensors::Readings};

use crate::checkpoints::{CURRENT, PREVIOUS, has_tally};
use crate::daylight::DAYLIGHT_COUNTS;
use crate::error::Error;
use crate::factors::{COUNTS, ROWS};
use crate::replica::{self, check_shape};
use crate::settings::Settings;

/// The contents of a `tally.bin`.
#[derive(Clone)]
pub struct StoredRun {
    /// The tally and its books.
    pub checkpoint: Checkpoint,
    /// The settings of its job.
    pub settings: Settings,
    /// The method at work in its scene.
    pub experiment: Experiment,
}

impl StoredRun {
    /// Reads the result of a run from its output folder.
    ///
    /// # Errors
    /// Where there is none, and where it cannot be used.
    pub fn open(run: &Path) -> Result<Self, Error> {
        let path = run.join(CURRENT);
        if !path.exists() {
            no_other_result(run)?;
        }
        let checkpoint = Checkpoint::read(&path)?;
        let (settings, experiment) =
            replica::unpack(&checkpoint.book.job).map_err(|reason| unusable(run, &checkpoint, reason))?;
        check_shape(&checkpoint.tally, &experiment).map_err(|fault| CheckpointError { path, fault })?;
        Ok(StoredRun { checkpoint, settings, experiment })
    }

    /// What the tally says of every face.
    pub fn estimates(&self) -> Estimates<'_> {
        let level = self.settings.level(self.experiment.scene());
        Estimates::new(&self.experiment, &self.checkpoint.tally, level)
    }

    /// What the tally says of materials, where that is asked for.
    pub fn influences(&self) -> Option<Influences<'_>> {
        let level = self.settings.sensitivity_level(&self.experiment);
        Influences::new(&self.experiment, &self.checkpoint.tally, level)
    }

    /// What the tally says of sensors, where there are any.
    pub fn readings(&self) -> Option<Readings<'_>> {
        let level = self.settings.sensor_level(&self.experiment);
        Readings::new(&self.experiment, &self.checkpoint.tally, level)
    }
}

/// The partition that a pilot has chosen for the run in a folder; `None` where there is no tally yet.
///
/// # Errors
/// Where no tally there can be used, and where it is that of a job without a pilot.
pub fn stored_partition(run: &Path) -> Result<Option<Partition>, Error> {
    if !has_tally(run) {
        return Ok(None);
    }
    let path = run.join(CURRENT);
    let read = |path: &Path| Checkpoint::read(path);
    let kept = read(&path).or_else(|error| read(&run.join(PREVIOUS)).map_err(|_| error))?;
    let partition = replica::partition(&kept.book.job).map_err(|reason| unusable(run, &kept, reason))?;
    // A pilot that was kept beside this tally would pass for that of a run which replaces it.
    let foreign = || CheckpointError { path, fault: CheckpointFault::ForeignScene }.into();
    partition.ok_or_else(foreign).map(Some)
}

/// What tells of results that are no run, and who reads them.
const OTHERS: [(&str, &str); 4] = [
    (
        ROWS,
        "exchange factors by rows; `radwalk factors --sparse` joins parts by --join, and goes on by --resume",
    ),
    (
        COUNTS,
        "exchange factors; `radwalk merge` adds up several seeds, `radwalk factors` goes on by --resume",
    ),
    (DAYLIGHT_COUNTS, "daylight; `radwalk daylight` goes on by --resume"),
    ("exact.json", "a deterministic solution; `radwalk diff` compares it with a run"),
];

/// Whether a folder holds no result of another kind.
///
/// # Errors
/// Where it does: what it is.
pub(crate) fn no_other_result(folder: &Path) -> Result<(), Error> {
    match OTHERS.iter().find(|(file, _)| folder.join(file).is_file()) {
        Some(&(_, holds)) => Err(Error::NoRun { folder: folder.into(), holds }),
        None => Ok(()),
    }
}

/// The job that a tally keeps cannot be used, for a reason.
pub(crate) fn unusable(run: &Path, checkpoint: &Checkpoint, reason: String) -> Error {
    Error::StoredRun { path: run.into(), reason, build: builds(checkpoint) }
}

/// The builds that wrote a result.
fn builds(checkpoint: &Checkpoint) -> String {
    let mut builds: Vec<&str> = checkpoint.book.sessions.iter().map(|session| &session.build[..]).collect();
    builds.dedup();
    builds.join(", ")
}
