//! What counted walks say: factors with intervals, smoothed ones, and heat; as tables, and in words.

use std::path::Path;

use exchange::{Balance, Factors, Smoothed, SparseFactors, Thermal, ThermalFault, smooth};
use radiosity::exchange::FactorKind;
use report::words::{counted, percent};
use report::{FactorsSummary, OutputFolder, SmoothingSummary, ToleranceSummary, is_outside};

use super::counted::{COUNTS, Counted};
use super::fault::FactorsFault;
use super::question::FactorsQuestion;
use super::subject::Subject;
use crate::error::Error;
use crate::rounds::ROUND;

const TABLE: &str = "factors.csv";
pub(super) const GROUPS: &str = "groups.csv";
pub(super) const SUMMARY: &str = "factors.json";
pub(super) const THERMAL: &str = "thermal.csv";
pub(super) const NUMPY: &str = "factors.npz";
pub(super) const MATRIX: &str = "factors.mtx";

/// Where smoothing has found nothing.
pub(super) const ROUGH: &str =
    "no factors were found that are reciprocal and add up; the raw ones stand alone";

/// All files that may be written.
pub const FILES: [&str; 8] = [TABLE, GROUPS, SUMMARY, THERMAL, NUMPY, MATRIX, COUNTS, ROUND];

/// The matrices that a folder holds.
pub fn matrices_in(folder: &Path) -> Vec<MatrixFile> {
    let files = [(NUMPY, MatrixFile::Npz), (MATRIX, MatrixFile::Mtx)];
    files.into_iter().filter(|(name, _)| folder.join(name).is_file()).map(|(_, file)| file).collect()
}

/// A format of matrices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MatrixFile {
    /// Arrays of factors, errors and names for NumPy.
    Npz,
    /// The factors that are not 0, in the format of Matrix Market.
    Mtx,
}

/// What the counts say.
pub struct FactorsAnswer {
    subject: Subject,
    /// The names of the groups.
    names: Vec<String>,
    counted: Counted,
    smoothed: Option<Smoothed>,
    thermal: Option<Thermal>,
    tolerance: Option<ToleranceSummary>,
}

impl FactorsAnswer {
    /// The answer to a question by what was counted.
    ///
    /// # Errors
    /// Where the counts say nothing of heat.
    pub fn of(question: &FactorsQuestion, counted: Counted) -> Result<Self, FactorsFault> {
        let tolerance = question.tolerance.as_ref().map(|tolerance| ToleranceSummary {
            relative_error: tolerance.relative,
            pairs: question.pairs.clone(),
            reached: tolerance.is_met(&counted.counts),
        });
        FactorsAnswer::new(question.subject(), counted, tolerance)
    }

    /// What was counted of a subject says, of which some accuracy was asked.
    ///
    /// # Errors
    /// Where the counts say nothing of heat.
    pub(super) fn new(
        subject: Subject,
        counted: Counted,
        tolerance: Option<ToleranceSummary>,
    ) -> Result<Self, FactorsFault> {
        let (counts, weights, names) = (&counted.counts, subject.weights(), subject.names());
        let smoothed = subject.smooth.then(|| smooth(counts, &weights)).flatten();
        let thermal = subject.enclosure.as_ref().map(|enclosure| {
            let (given, environment) = (&enclosure.given[..], enclosure.environment);
            let factors = &SparseFactors::from(counts);
            Balance { factors, emitting_areas: &weights, given, environment, level: subject.level }.solve()
        });
        let thermal = thermal.transpose().map_err(|fault| named(&fault, &names))?;
        Ok(FactorsAnswer { subject, names, smoothed, thermal, tolerance, counted })
    }

    fn factors(&self) -> Factors<'_> {
        Factors::new(&self.counted.counts, self.subject.level)
    }

    /// Writes all tables and the summary.
    ///
    /// # Errors
    /// Where a file cannot be written.
    pub fn write(&self, folder: &OutputFolder, exports: &[MatrixFile]) -> Result<(), Error> {
        let names = &self.names;
        let (factors, smoothed) = (self.factors(), self.smoothed.as_ref());
        folder.write(TABLE, |file| report::write_factors(file, names, &factors, smoothed))?;
        if exports.contains(&MatrixFile::Npz) {
            folder.write(NUMPY, |file| report::write_factors_npz(file, names, &factors, smoothed))?;
        }
        if exports.contains(&MatrixFile::Mtx) {
            folder.write(MATRIX, |file| report::write_factors_mtx(file, names, &factors, smoothed))?;
        }
        let rows = self.subject.rows(|i| self.counted.counts.walks(i));
        folder.write(GROUPS, |file| report::write_groups(file, &rows))?;
        match &self.thermal {
            Some(thermal) => folder.write(THERMAL, |file| report::write_thermal(file, names, thermal))?,
            // That of an earlier run says nothing of these factors.
            None => folder.remove(&[THERMAL])?,
        }
        let summary = self.summary();
        Ok(folder.write(SUMMARY, |file| report::write_json(file, &summary))?)
    }

    fn summary(&self) -> FactorsSummary {
        let FactorsAnswer { subject, counted: Counted { seeds, counts, cost, .. }, .. } = self;
        FactorsSummary {
            version: env!("CARGO_PKG_VERSION").into(),
            scene_hash: subject.scene_hash,
            seed: seeds[0],
            seeds: seeds.clone(),
            kind: match subject.kind {
                FactorKind::FirstHit => "first_hit",
                FactorKind::Absorbed => "absorbed",
            },
            groups: counts.groups(),
            walks: counts.total(),
            rays: cost.rays,
            seconds: cost.seconds,
            cpu_seconds: cost.cpu_seconds,
            confidence: subject.confidence,
            simultaneous: subject.simultaneous,
            back: self.back(),
            tolerance: self.tolerance.clone(),
            smoothing: self.smoothed.as_ref().map(|smoothed| self.smoothing(smoothed)),
        }
    }

    /// The part of the walks that ended on backs.
    fn back(&self) -> f64 {
        let counts = &self.counted.counts;
        let groups = counts.groups();
        (0..groups).map(|i| counts.row(i)[groups]).sum::<u64>() as f64 / counts.total() as f64
    }

    fn smoothing(&self, smoothed: &Smoothed) -> SmoothingSummary {
        let factors = self.factors();
        let groups = self.counted.counts.groups();
        let cells = || (0..groups).flat_map(|i| (0..groups + 2).map(move |j| (i, j)));
        let moved = |(i, j): (usize, usize)| {
            let known = factors.get(i, j);
            known.std_error.map_or(0.0, |error| (smoothed.factors[i][j] - known.factor).abs() / error)
        };
        SmoothingSummary {
            outside: cells().filter(|&(i, j)| is_outside(&factors, smoothed, i, j)).count(),
            largest_move: cells().map(moved).fold(0.0, f64::max),
        }
    }

    /// Whether a signal ended the count.
    pub fn interrupted(&self) -> bool {
        self.counted.interrupted
    }

    /// Whether the tolerance is reached, where there is one.
    pub fn reached(&self) -> Option<bool> {
        self.tolerance.as_ref().map(|tolerance| tolerance.reached)
    }

    /// A few lines for people.
    pub fn lines(&self) -> Vec<String> {
        let (counts, factors) = (&self.counted.counts, self.factors());
        let (groups, cost) = (counts.groups(), &self.counted.cost);
        let what = match self.subject.kind {
            FactorKind::FirstHit => "form factors",
            FactorKind::Absorbed => "factors of absorption after reflections (Gebhart's)",
        };
        let (between, walks) = (counted(groups as u64, "group"), counted(counts.total(), "walk"));
        let mut lines = vec![format!("{what} between {between}: {walks} in {:.1} s", cost.seconds)];
        let worst = (0..groups).map(|i| factors.row_error(i)).enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((i, error)) = worst {
            let name = &self.names[i];
            lines.push(format!(
                "known within {} of themselves, in the mean square of the worst row ({name})",
                percent(error)
            ));
        }
        if let Some(smoothing) = self.smoothed.as_ref().map(|smoothed| self.smoothing(smoothed)) {
            let SmoothingSummary { outside, largest_move } = smoothing;
            lines.push(format!(
                "smoothing moves them by up to {largest_move:.1} standard errors, {outside} of {} out of their intervals (column outside)",
                groups * (groups + 2)
            ));
        }
        lines
    }

    /// What people should know before they use the factors.
    pub fn warnings(&self) -> Vec<String> {
        let backs = (self.back() > 0.0).then(|| {
            format!(
                "{} of the walks end on backs of one-sided surfaces (rows to `back`)",
                percent(self.back())
            )
        });
        let missed = (self.reached() == Some(false))
            .then(|| "the budget ended before the tolerance was reached; give more --paths".to_string());
        let rough = (self.subject.smooth && self.smoothed.is_none()).then(|| ROUGH.to_string());
        [rough, backs, missed].into_iter().flatten().collect()
    }
}

/// What is wrong with an enclosure, by the names of its groups.
pub(super) fn named(fault: &ThermalFault, names: &[String]) -> FactorsFault {
    match *fault {
        ThermalFault::Backs { group } => FactorsFault::Backs { group: names[group].clone() },
        ThermalFault::Undetermined => FactorsFault::Undetermined,
        ThermalFault::BelowZero { group } => FactorsFault::BelowZero { group: names[group].clone() },
    }
}
