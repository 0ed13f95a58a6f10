//! `factors.csv`, `groups.csv` and `thermal.csv`: exchange factors between groups of faces, and the heat between them.
//! `factors.json`: how they were counted.

use std::io::{self, Seek, Write};

use exchange::{Factors, HeatEstimate, Smoothed, Thermal};
use serde::Serialize;

use crate::export::matrix_market;
use crate::export::npz::Archive;
use crate::summary::hex;

/// What stands for walks that end on the backs of one-sided surfaces.
pub const BACK: &str = "back";

/// What stands for walks that leave the scene.
pub const ESCAPE: &str = "escape";

/// What stands for factors that are dropped.
pub const REST: &str = "rest";

/// How exchange factors were counted.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FactorsSummary {
    /// The version of the program.
    pub version: String,
    /// Digest of the surfaces.
    #[serde(serialize_with = "hex")]
    pub scene_hash: [u8; 32],
    /// The seed of the walks; of merged ones the first.
    pub seed: u64,
    /// The seeds of all walks: several where counts were merged.
    pub seeds: Vec<u64>,
    /// The kind of factor: `first_hit` or `absorbed`.
    pub kind: &'static str,
    /// How many groups there are.
    pub groups: usize,
    /// Walks of all groups.
    pub walks: u64,
    /// The number of rays of these walks.
    pub rays: u64,
    /// Wall time of the walks [s].
    pub seconds: f64,
    /// Processor time of the walks, of all workers [s].
    pub cpu_seconds: f64,
    /// The level of the intervals.
    pub confidence: f64,
    /// Whether they hold all together.
    pub simultaneous: bool,
    /// The part of the walks that ended on backs.
    pub back: f64,
    /// What was asked for; `null` where nothing was.
    pub tolerance: Option<ToleranceSummary>,
    /// What smoothing did; `null` without it.
    pub smoothing: Option<SmoothingSummary>,
}

/// The accuracy that was asked for.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ToleranceSummary {
    /// The half-width of intervals over factors.
    pub relative_error: f64,
    /// The pairs that it was asked of; `null`: of each row in the mean square.
    pub pairs: Option<Vec<[String; 2]>>,
    /// Whether the factors are known so well.
    pub reached: bool,
}

/// The changes that smoothing made.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SmoothingSummary {
    /// Factors that it moved out of their intervals.
    pub outside: usize,
    /// The greatest move, in standard errors.
    pub largest_move: f64,
}

/// How sparse factors were counted.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SparseSummary {
    /// The version of the program.
    pub version: String,
    /// Digest of the surfaces.
    #[serde(serialize_with = "hex")]
    pub scene_hash: [u8; 32],
    /// The seed of the walks.
    pub seed: u64,
    /// The kind of factor: `first_hit` or `absorbed`.
    pub kind: &'static str,
    /// How many groups there are, each of which has a row.
    pub groups: usize,
    /// How many columns there are.
    pub columns: usize,
    /// Walks of all rows.
    pub walks: u64,
    /// The number of rays of these walks.
    pub rays: u64,
    /// Wall time of the last count [s].
    pub seconds: f64,
    /// The level of the intervals.
    pub confidence: f64,
    /// How many factors are not 0.
    pub entries: u64,
    /// The root of the sum of variances of a row, in the mean square over rows by their area.
    pub error: f64,
    /// The part of the walks that ended on backs.
    pub back: f64,
    /// The part that escaped: below the horizon, where the sky is distinguished.
    pub escape: f64,
    /// The part that left for the sky, where that is distinguished.
    pub sky: f64,
    /// The steps at which the scene repeats along x and y [m]; `null` where there is one copy of it.
    pub periods: Option<[f64; 2]>,
    /// What a threshold dropped; `null` without one.
    pub dropped: Option<DroppedSummary>,
    /// Rows that had all their walks and are not known as well as was asked; `null` where nothing was.
    pub unreached: Option<usize>,
    /// What smoothing did; `null` without it.
    pub smoothing: Option<SmoothingSummary>,
}

/// The factors that a threshold dropped.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DroppedSummary {
    /// The threshold.
    pub least: f64,
    /// How many factors were below it.
    pub entries: u64,
    /// Their sum in a row, in the mean over rows.
    pub mean: f64,
    /// Their sum in the row where it is largest.
    pub largest: f64,
}

/// One group as a row of its table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GroupRow<'a> {
    /// The name of the group.
    pub group: &'a str,
    /// How many faces it has.
    pub faces: usize,
    /// The area of these faces [m²].
    pub area: f64,
    /// Their mean absorptance 1 − R, which is their emissivity.
    pub absorptance: f64,
    /// Walks that were born there.
    pub walks: u64,
}

/// The standard error of a smoothed factor; `None` where no walk has found any: such a factor stays 0.
fn smoothed_error(factors: &Factors<'_>, smoothed: &Smoothed, i: usize, j: usize) -> Option<f64> {
    let is_known = smoothed.factors[i][j] > 0.0 || factors.get(i, j).interval.high == 0.0;
    is_known.then(|| smoothed.errors[i][j])
}

/// Whether smoothing moved a factor out of its interval.
pub fn is_outside(factors: &Factors<'_>, smoothed: &Smoothed, i: usize, j: usize) -> bool {
    !factors.get(i, j).interval.contains(smoothed.factors[i][j])
}

/// Writes the factors between groups with these names: for each, those to all groups, to backs, and what escapes.
///
/// # Errors
/// Those of `writer`.
pub fn write_factors(
    writer: impl Write,
    names: &[String],
    factors: &Factors<'_>,
    smoothed: Option<&Smoothed>,
) -> io::Result<()> {
    let mut table = csv::Writer::from_writer(writer);
    let columns = ["from", "to", "factor", "std_error", "ci_low", "ci_high"];
    let of_smoothing = ["smoothed", "smoothed_error", "outside"];
    table.write_record(columns.iter().chain(of_smoothing.iter().filter(|_| smoothed.is_some())))?;
    for (i, from) in names.iter().enumerate() {
        for (j, to) in names.iter().map(String::as_str).chain([BACK, ESCAPE]).enumerate() {
            let known = factors.get(i, j);
            let smoothed = smoothed.map(|smoothed| {
                let outside = if is_outside(factors, smoothed, i, j) { "outside" } else { "" };
                (smoothed.factors[i][j], smoothed_error(factors, smoothed, i, j), outside)
            });
            let interval = (known.interval.low, known.interval.high);
            table.serialize((from, to, known.factor, known.std_error, interval, smoothed.as_slice()))?;
        }
    }
    table.flush()
}

/// Writes the factors as arrays for NumPy: `factor`, `std_error`, `ci_low` and `ci_high` of G rows and G + 2 columns; `smoothed` and
/// `smoothed_error` where there are any; errors that are unknown are not a number; the names of rows and of columns.
///
/// # Errors
/// Those of `writer`.
pub fn write_factors_npz(
    writer: impl Write + Seek,
    names: &[String],
    factors: &Factors<'_>,
    smoothed: Option<&Smoothed>,
) -> io::Result<()> {
    let cells = |of: &dyn Fn(usize, usize) -> f64| -> Vec<Vec<f64>> {
        (0..names.len()).map(|i| (0..names.len() + 2).map(|j| of(i, j)).collect()).collect()
    };
    let matrix = |of: &dyn Fn(exchange::Factor) -> f64| cells(&|i, j| of(factors.get(i, j)));
    let rows = names.iter().map(String::as_str);
    let mut archive = Archive::new(writer);
    archive.words("from", rows.clone())?;
    archive.words("to", rows.chain([BACK, ESCAPE]))?;
    archive.matrix("factor", &matrix(&|known| known.factor))?;
    archive.matrix("std_error", &matrix(&|known| known.std_error.unwrap_or(f64::NAN)))?;
    archive.matrix("ci_low", &matrix(&|known| known.interval.low))?;
    archive.matrix("ci_high", &matrix(&|known| known.interval.high))?;
    if let Some(smoothed) = smoothed {
        archive.matrix("smoothed", &smoothed.factors)?;
        let errors = cells(&|i, j| smoothed_error(factors, smoothed, i, j).unwrap_or(f64::NAN));
        archive.matrix("smoothed_error", &errors)?;
    }
    archive.finish()
}

/// Writes the factors that are not 0 as a sparse matrix of G rows and G + 2 columns; the smoothed ones, where there are any.
///
/// # Errors
/// Those of `writer`.
pub fn write_factors_mtx(
    writer: impl Write,
    names: &[String],
    factors: &Factors<'_>,
    smoothed: Option<&Smoothed>,
) -> io::Result<()> {
    let words = "Exchange factors of radwalk: rows and columns are the groups of groups.csv, in its order, then back, then escape";
    match smoothed {
        Some(smoothed) => matrix_market::write(writer, &format!("{words}; smoothed"), &smoothed.factors),
        None => {
            let columns = || 0..names.len() + 2;
            let row = |i| columns().map(|j| factors.get(i, j).factor).collect();
            matrix_market::write(writer, words, &(0..names.len()).map(row).collect::<Vec<Vec<f64>>>())
        }
    }
}

/// Writes factors that are known without noise, F and B of every row: those to all faces with these names, and what is left of 1,
/// which escapes or ends on backs.
///
/// # Errors
/// Those of `writer`.
pub fn write_exact_factors(
    writer: impl Write,
    names: &[String],
    row: impl Fn(usize) -> Vec<[f64; 2]>,
) -> io::Result<()> {
    let mut table = csv::Writer::from_writer(writer);
    table.write_record(["from", "to", "factor", "absorbed"])?;
    for (i, from) in names.iter().enumerate() {
        let row = row(i);
        for (to, factors) in names.iter().zip(&row) {
            table.serialize((from, to, factors))?;
        }
        let lost = [0, 1].map(|kind| 1.0 - row.iter().map(|factors| factors[kind]).sum::<f64>());
        table.serialize((from, ESCAPE, lost))?;
    }
    table.flush()
}

/// Writes the groups.
///
/// # Errors
/// Those of `writer`.
pub fn write_groups(writer: impl Write, groups: &[GroupRow<'_>]) -> io::Result<()> {
    let mut table = csv::Writer::from_writer(writer);
    groups.iter().try_for_each(|group| table.serialize(group))?;
    table.flush()
}

/// Writes temperatures and net fluxes of groups with these names.
///
/// # Errors
/// Those of `writer`.
pub fn write_thermal(writer: impl Write, names: &[String], thermal: &Thermal) -> io::Result<()> {
    let mut table = csv::Writer::from_writer(writer);
    let columns = ["temperature", "flux"]
        .map(|of| [of.to_owned(), format!("{of}_error"), format!("{of}_low"), format!("{of}_high")]);
    table.write_record(["group".to_owned()].iter().chain(columns.as_flattened()))?;
    let cells = |known: &HeatEstimate| (known.value, known.std_error, known.low, known.high);
    for (name, known) in names.iter().zip(thermal.temperatures.iter().zip(&thermal.fluxes)) {
        table.serialize((name, cells(known.0), cells(known.1)))?;
    }
    table.flush()
}

/// Writes a summary as JSON.
///
/// # Errors
/// Those of `writer`.
pub fn write_json(mut writer: impl Write, summary: &impl Serialize) -> io::Result<()> {
    serde_json::to_writer_pretty(&mut writer, summary)?;
    writer.write_all(b"\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use exchange::{ExchangeCounts, smooth};

    #[test]
    fn tables_are_as_the_format_says() {
        let mut counts = ExchangeCounts::none(2);
        counts.add(&[vec![0, 3, 0, 1], vec![4, 0, 0, 0]]);
        let names = ["a, b".to_owned(), "c".into()];
        let mut text = Vec::new();
        write_factors(&mut text, &names, &Factors::new(&counts, 0.95), None).unwrap();
        let text = String::from_utf8(text).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "from,to,factor,std_error,ci_low,ci_high");
        assert!(lines[1].starts_with("\"a, b\",\"a, b\",0.0,,0.0,0.6"), "{text}");
        assert!(lines[2].starts_with("\"a, b\",c,0.75,0.25,"), "{text}");
        assert!(lines[4].starts_with("\"a, b\",escape,0.25,0.25,"), "{text}");
        assert!(lines[5].starts_with("c,\"a, b\",1.0,,"), "{text}");
        assert_eq!(lines.len(), 1 + 2 * 4);
        let mut text = Vec::new();
        let smoothed = smooth(&counts, &[4.0, 3.0]).unwrap();
        write_factors(&mut text, &names, &Factors::new(&counts, 0.95), Some(&smoothed)).unwrap();
        let text = String::from_utf8(text).unwrap();
        assert!(
            text.starts_with("from,to,factor,std_error,ci_low,ci_high,smoothed,smoothed_error,outside\n")
        );
        assert!(text.lines().all(|line| line.replace("a, b", "").split(',').count() == 9), "{text}");
        assert!(text.lines().nth(1).is_some_and(|line| line.ends_with(",0.0,,")), "{text}");
    }
}
