//! Counts as a folder keeps them: what a count goes on from, and what is merged.

use std::io::Write;
use std::path::{Path, PathBuf};

use exchange::ExchangeCounts;
use report::OutputFolder;
use serde::{Deserialize, Serialize};

use super::answer::FactorsAnswer;
use super::counted::{COUNTS, Counted};
use super::fault::FactorsFault;
use super::question::FactorsQuestion;
use super::subject::Subject;
use crate::error::Error;
use crate::rounds::Cost;

/// The contents of the file [`COUNTS`].
#[derive(Clone, Serialize, Deserialize)]
pub struct FactorCounts {
    /// Digest of all that the counts of given walks depend on, the seed included.
    question: String,
    /// The same without the seed: counts of other seeds may be added. Empty in counts of earlier versions.
    #[serde(default)]
    kin: String,
    /// The seeds of the walks.
    #[serde(default)]
    seeds: Vec<u64>,
    /// What answers need; `None` in counts of earlier versions.
    #[serde(default)]
    subject: Option<Subject>,
    pub(super) rows: Vec<Vec<u64>>,
    pub(super) cost: Cost,
}

impl FactorCounts {
    /// The counts of a question.
    pub(super) fn new(question: &FactorsQuestion, counts: &ExchangeCounts, cost: Cost) -> Self {
        FactorCounts {
            question: digest(question),
            kin: kin(question),
            seeds: vec![question.job.seed],
            subject: Some(question.subject()),
            rows: (0..counts.groups()).map(|i| counts.row(i).to_vec()).collect(),
            cost,
        }
    }

    /// Writes them.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn write(&self, folder: &OutputFolder) -> Result<(), Error> {
        Ok(folder.write(COUNTS, |file| {
            serde_json::to_writer(&mut *file, self)?;
            file.write_all(b"\n")
        })?)
    }

    /// What was kept of the same question.
    pub(super) fn of_question(path: &Path, question: &FactorsQuestion) -> Result<Self, FactorsFault> {
        let unreadable = |reason| FactorsFault::UnreadableCounts { path: path.into(), reason };
        let kept = FactorCounts::read(path).map_err(unreadable)?;
        if kept.seeds.len() > 1 {
            return Err(FactorsFault::MergedCounts { path: path.into() });
        }
        if kept.question != digest(question) {
            return Err(FactorsFault::OtherCounts { path: path.into() });
        }
        let groups = question.groups.count();
        match kept.has_rows_of(groups) && kept.walks().all(u64::is_power_of_two) {
            true => Ok(kept),
            false => Err(unreadable("its rows are not those of the groups".into())),
        }
    }

    fn read(path: &Path) -> Result<Self, String> {
        let text = std::fs::read(path).map_err(|error| error.to_string())?;
        serde_json::from_slice(&text).map_err(|error| error.to_string())
    }

    fn has_rows_of(&self, groups: usize) -> bool {
        self.rows.len() == groups && self.rows.iter().all(|row| row.len() == groups + 2)
    }

    /// The walks of each group.
    fn walks(&self) -> impl Iterator<Item = u64> {
        self.rows.iter().map(|row| row.iter().fold(0_u64, |sum, count| sum.saturating_add(*count)))
    }

    /// What they say; nothing was asked of their accuracy.
    ///
    /// # Errors
    /// Where they say nothing of heat.
    pub fn answer(&self) -> Result<FactorsAnswer, Error> {
        let subject = self.subject.clone().expect("a merge has checked it");
        let mut counts = ExchangeCounts::none(self.rows.len());
        counts.add(&self.rows);
        let counted = Counted { seeds: self.seeds.clone(), counts, cost: self.cost, interrupted: false };
        Ok(FactorsAnswer::new(subject, counted, None)?)
    }

    fn add(&mut self, other: FactorCounts) -> Result<(), String> {
        if other.kin != self.kin {
            return Err("they are of another scene, other groups or another kind of factors; \
                        merge counts of one question"
                .into());
        }
        if let Some(seed) = other.seeds.iter().find(|seed| self.seeds.contains(seed)) {
            return Err(format!(
                "the walks of seed {seed} are in two of the folders, and would count twice; leave one out"
            ));
        }
        for (sum, more) in self.rows.iter_mut().flatten().zip(other.rows.into_iter().flatten()) {
            *sum = sum.checked_add(more).ok_or("there are more than 2^64 walks; merge fewer")?;
        }
        self.seeds.extend(other.seeds);
        self.cost.add(other.cost);
        Ok(())
    }
}

/// Whether a folder holds counts of exchange factors.
pub fn is_counted(folder: &Path) -> bool {
    folder.join(COUNTS).is_file()
}

/// The counts of several folders as one. The merged counts answer the question of the first.
///
/// # Errors
/// Where counts cannot be read, are of another question than those of the first, or hold walks of one before.
pub fn merge(first: &Path, others: &[PathBuf]) -> Result<FactorCounts, Error> {
    let mut merged = mergeable(first)?;
    for folder in others {
        let other = mergeable(folder)?;
        let refused = |reason| FactorsFault::Unmergeable { path: folder.join(COUNTS), reason };
        merged.add(other).map_err(refused)?;
    }
    Ok(merged)
}

fn mergeable(folder: &Path) -> Result<FactorCounts, FactorsFault> {
    let path = folder.join(COUNTS);
    let refused = |reason: String| FactorsFault::Unmergeable { path: path.clone(), reason };
    let kept = FactorCounts::read(&path)
        .map_err(|reason| refused(format!("{reason}; give output folders of `radwalk factors`")))?;
    let Some(subject) = &kept.subject else {
        return Err(refused(
            "an earlier version wrote them; let `radwalk factors --resume` write them anew".into(),
        ));
    };
    match kept.has_rows_of(subject.groups.len()) && kept.walks().all(|walks| walks > 0) {
        true => Ok(kept),
        false => Err(refused("their rows are not those of the groups; count them anew".into())),
    }
}

/// Digest of all that the counts of given walks depend on.
fn digest(question: &FactorsQuestion) -> String {
    let FactorsQuestion { job, scene, groups, kind, .. } = question;
    hex(&(scene.hash(), job.seed, kind, job.method.space, &groups.of_face))
}

/// [`digest`] without the seed, and with the names of the groups.
fn kin(question: &FactorsQuestion) -> String {
    let FactorsQuestion { job, scene, groups, kind, .. } = question;
    hex(&(scene.hash(), kind, job.method.space, &groups.of_face, &groups.names))
}

fn hex(of: &impl Serialize) -> String {
    let all = serde_json::to_vec(of).expect("numbers and words");
    blake3::hash(&all).to_hex().to_string()
}
