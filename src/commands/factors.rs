//! `radwalk factors`: exchange factors between groups of faces, and the heat between them.

mod count;
mod fault;
mod question;

use exchange::{Balance, Factors, Smoothed, Thermal, ThermalFault, smooth};
use radiosity::FactorKind;
use report::words::{counted, percent};
use report::{FactorsSummary, OutputFolder, SmoothingSummary, ToleranceSummary, is_outside};
use studies::compare::Team;
use tracing::{info, warn};
use voice::{Phase, say};

use self::count::{COUNTS, Counted, count};
pub(crate) use self::fault::FactorsFault;
use self::question::Question;
use crate::args::{FactorsArgs, MatrixFile};
use crate::commands::coordinate::{default_folder, processes};
use crate::fault::{Fault, Outcome};
use crate::signals;
use crate::team::{Hands, Remote};

const TABLE: &str = "factors.csv";
const GROUPS: &str = "groups.csv";
const SUMMARY: &str = "factors.json";
const THERMAL: &str = "thermal.csv";
const NUMPY: &str = "factors.npz";
const MATRIX: &str = "factors.mtx";

/// Counts exchange factors and writes them.
pub(crate) fn factors(args: &FactorsArgs) -> Result<Outcome, Fault> {
    let phase = Phase::begin("reading the scene");
    let question = Question::read(args)?;
    question.job.scene.notes().iter().for_each(|note| info!("note: {note}"));
    let path = args.out.out.clone().unwrap_or_else(|| default_folder(&question.job));
    let files = [TABLE, GROUPS, SUMMARY, THERMAL, NUMPY, MATRIX, COUNTS];
    let folder = OutputFolder::claim(&path, &files, args.out.force || args.resume)?;
    if args.out.force {
        folder.remove(&files)?;
    }
    drop(phase);
    signals::catch();
    let hands = hands(args, &question, &folder)?;
    let counted = count(&question, &hands, &folder, args.resume);
    if let Hands::Remote(remote) = hands {
        question.dismiss(remote)?;
    }
    let counted = counted?;
    if counted.interrupted {
        warn!("interrupted; the counts of the last look are kept, go on with --resume");
    }
    if counted.counts.total() == 0 {
        return Ok(Outcome::Interrupted);
    }
    let answer = Answer::of(args, &question, counted)?;
    answer.write(&folder, &args.export)?;
    if !args.out.quiet {
        answer.describe();
        say(&format!("written to {}", folder.path().display()));
    }
    Ok(answer.outcome())
}

/// The processes that walk.
fn hands(args: &FactorsArgs, question: &Question, folder: &OutputFolder) -> Result<Hands, Fault> {
    let Some(address) = &args.listen else {
        return Ok(Hands::Local(Team { workers: processes(args.workers), threads: args.threads }));
    };
    let file = args.access.clone().unwrap_or_else(|| folder.path().join("access.json"));
    let address = (&**address, args.advertise.as_deref());
    Ok(Hands::Remote(Remote::open(question.scene.hash(), address, file)?))
}

/// What the counts say.
struct Answer<'a> {
    question: &'a Question,
    counted: Counted,
    smoothed: Option<Smoothed>,
    thermal: Option<Thermal>,
    reached: Option<bool>,
}

impl<'a> Answer<'a> {
    fn of(args: &FactorsArgs, question: &'a Question, counted: Counted) -> Result<Self, Fault> {
        let (counts, weights) = (&counted.counts, question.weights());
        let smoothed = args.smooth.then(|| smooth(counts, &weights)).flatten();
        if args.smooth && smoothed.is_none() {
            warn!("no factors were found that are reciprocal and add up; the raw ones stand alone");
        }
        let thermal = question.enclosure.as_ref().map(|enclosure| {
            let (given, environment) = (&enclosure.given[..], enclosure.environment);
            Balance { counts, emitting_areas: &weights, given, environment, level: question.level }.solve()
        });
        let thermal = thermal.transpose().map_err(|fault| named(fault, &question.groups.names))?;
        let reached = question.tolerance.as_ref().map(|tolerance| tolerance.is_met(counts));
        Ok(Answer { question, smoothed, thermal, reached, counted })
    }

    fn factors(&self) -> Factors<'_> {
        Factors::new(&self.counted.counts, self.question.level)
    }

    fn write(&self, folder: &OutputFolder, exports: &[MatrixFile]) -> Result<(), Fault> {
        let names = &self.question.groups.names;
        let (factors, smoothed) = (self.factors(), self.smoothed.as_ref());
        folder.write(TABLE, |file| report::write_factors(file, names, &factors, smoothed))?;
        if exports.contains(&MatrixFile::Npz) {
            folder.write(NUMPY, |file| report::write_factors_npz(file, names, &factors, smoothed))?;
        }
        if exports.contains(&MatrixFile::Mtx) {
            folder.write(MATRIX, |file| report::write_factors_mtx(file, names, &factors, smoothed))?;
        }
        let rows = self.question.rows(|i| self.counted.counts.walks(i));
        folder.write(GROUPS, |file| report::write_groups(file, &rows))?;
        if let Some(thermal) = &self.thermal {
            folder.write(THERMAL, |file| report::write_thermal(file, names, thermal))?;
        }
        let summary = self.summary();
        Ok(folder.write(SUMMARY, |file| summary.write(file))?)
    }

    fn summary(&self) -> FactorsSummary {
        let Question { job, scene, groups, kind, tolerance, pairs, .. } = self.question;
        let Counted { counts, cost, .. } = &self.counted;
        let tolerance = tolerance.as_ref().zip(self.reached);
        FactorsSummary {
            version: env!("CARGO_PKG_VERSION").into(),
            scene_hash: scene.hash(),
            seed: job.seed,
            kind: match kind {
                FactorKind::FirstHit => "first_hit",
                FactorKind::Absorbed => "absorbed",
            },
            groups: groups.count(),
            walks: counts.total(),
            rays: cost.rays,
            seconds: cost.seconds,
            cpu_seconds: cost.cpu_seconds,
            confidence: job.confidence,
            simultaneous: job.simultaneous,
            back: self.back(),
            tolerance: tolerance.map(|(tolerance, reached)| ToleranceSummary {
                relative_error: tolerance.relative,
                pairs: pairs.clone(),
                reached,
            }),
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

    /// A few lines for people.
    fn describe(&self) {
        let (counts, factors) = (&self.counted.counts, self.factors());
        let (groups, cost) = (counts.groups(), &self.counted.cost);
        say(&format!(
            "{} between {}: {} in {:.1} s",
            match self.question.kind {
                FactorKind::FirstHit => "form factors",
                FactorKind::Absorbed => "factors of absorption after reflections (Gebhart's)",
            },
            counted(groups as u64, "group"),
            counted(counts.total(), "walk"),
            cost.seconds
        ));
        let worst = (0..groups).map(|i| factors.row_error(i)).enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((i, error)) = worst {
            let name = &self.question.groups.names[i];
            say(&format!(
                "known within {} of themselves, in the mean square of the worst row ({name})",
                percent(error)
            ));
        }
        if self.back() > 0.0 {
            warn!(
                "{} of the walks end on backs of one-sided surfaces (rows to `back`)",
                percent(self.back())
            );
        }
        if let Some(smoothing) = self.smoothed.as_ref().map(|smoothed| self.smoothing(smoothed)) {
            let SmoothingSummary { outside, largest_move } = smoothing;
            say(&format!(
                "smoothing moves them by up to {largest_move:.1} standard errors, {outside} of {} out of their intervals (column outside)",
                groups * (groups + 2)
            ));
        }
        if self.reached == Some(false) {
            warn!("the budget ended before the tolerance was reached; give more --paths");
        }
    }

    fn outcome(&self) -> Outcome {
        match (self.counted.interrupted, self.reached) {
            (true, _) => Outcome::Interrupted,
            (false, Some(false)) => Outcome::TargetMissed,
            (false, _) => Outcome::Done,
        }
    }
}

/// What is wrong with an enclosure, by the names of its groups.
fn named(fault: ThermalFault, names: &[String]) -> FactorsFault {
    match fault {
        ThermalFault::Backs { group } => FactorsFault::Backs { group: names[group].clone() },
        ThermalFault::Undetermined => FactorsFault::Undetermined,
        ThermalFault::BelowZero { group } => FactorsFault::BelowZero { group: names[group].clone() },
    }
}
