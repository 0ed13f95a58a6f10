//! `pilot.bin`: what the stages of a pilot have come to, so that one that is stopped goes on from there.

use std::fs;
use std::io::{self, Write as _};
use std::sync::Arc;

use protocol::codec::{decode_serde, encode_serde, pack, unpack};
use radiosity::{Counts, Layout, Tally};
use report::OutputFolder;
use serde::{Deserialize, Serialize};

use super::stage::{Groups, Stage, Walked};
use crate::error::Error;

/// The file of a pilot that is under way.
pub const PILOT: &str = "pilot.bin";

/// The bytes of the checksum at its end.
const CHECKSUM: usize = blake3::OUT_LEN;

/// The stages of a pilot, as far as they are walked.
#[derive(Default, Serialize, Deserialize)]
pub struct PilotBooks {
    stages: Vec<KeptStage>,
}

/// A stage as it is kept.
#[derive(Serialize, Deserialize)]
struct KeptStage {
    hash: [u8; 32],
    prefix: KeptTally,
    groups: Vec<KeptTally>,
}

/// A tally whose sums are packed.
#[derive(Serialize, Deserialize)]
struct KeptTally {
    counts: [u128; 15],
    sums: Vec<u8>,
}

impl KeptTally {
    fn of(tally: &Tally) -> Self {
        KeptTally { counts: tally.counts.to_array(), sums: pack(tally.sums()) }
    }

    fn unpack(&self, rows: usize, layout: Layout) -> Option<Tally> {
        let sums = unpack(&self.sums).collect::<Result<_, _>>().ok()?;
        Tally::from_parts(Counts::from_array(self.counts)?, rows, layout, sums).ok()
    }
}

impl PilotBooks {
    /// What is kept in a folder; nothing where that is not readable.
    pub fn read(folder: &OutputFolder) -> Self {
        let read = || {
            let bytes = fs::read(folder.file(PILOT)).ok()?;
            let (content, checksum) = bytes.split_last_chunk::<CHECKSUM>()?;
            (blake3::hash(content) == *checksum).then_some(())?;
            decode_serde(content).ok()
        };
        read().unwrap_or_default()
    }

    /// The walks of a stage that are kept, and the groups of them that have ended.
    pub fn past(&self, stage: &Stage) -> Option<(Arc<Tally>, Groups)> {
        let hash = stage.hash();
        let kept = self.stages.iter().find(|kept| kept.hash == hash)?;
        let (rows, layout) = (stage.experiment().rows(), stage.experiment().layout());
        let prefix = kept.prefix.unpack(rows, layout)?;
        let group = |group: &KeptTally| group.unpack(rows, layout.without_squares());
        let groups = kept.groups.iter().map(group).collect::<Option<_>>()?;
        Some((prefix.into(), Groups::of(stage, groups)?))
    }

    /// A stage of which all walks are kept.
    pub fn walked(&self, stage: &Stage) -> Option<Walked> {
        let (prefix, groups) = self.past(stage)?;
        (prefix.counts.walks == stage.walks()).then(|| Walked::new(groups, prefix))
    }

    /// Keeps a stage in a folder, as far as it is walked, beside those before it.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn keep(
        &mut self,
        stage: &Stage,
        (prefix, groups): (&Tally, &Groups),
        folder: &OutputFolder,
    ) -> Result<(), Error> {
        let hash = stage.hash();
        let at = self.stages.iter().position(|kept| kept.hash == hash).unwrap_or_else(|| {
            self.stages.push(KeptStage { hash, prefix: KeptTally::of(prefix), groups: Vec::new() });
            self.stages.len() - 1
        });
        let kept = &mut self.stages[at];
        kept.prefix = KeptTally::of(prefix);
        let further = groups.ended.get(kept.groups.len()..).unwrap_or_default();
        kept.groups.extend(further.iter().map(KeptTally::of));
        let content = encode_serde(self)
            .map_err(|error| Error::System { doing: "packing a pilot", source: io::Error::other(error) })?;
        let checksum = blake3::hash(&content);
        Ok(folder.write(PILOT, |file| {
            file.write_all(&content)?;
            file.write_all(checksum.as_bytes())
        })?)
    }
}
