//! What counted rows say: matrices, tables, heat, and a few lines for people.

use std::cell::RefCell;
use std::io::{self, BufWriter};

use exchange::{Balance, Intervals, PairedRows, SmoothedRows, SparseFactors, Thermal};
use radiosity::exchange::FactorKind;
use report::words::{counted, percent};
use report::{
    BACK, CsrKind, CsrNumbers, DroppedSummary, ESCAPE, FactorEntry, FoamList, MatrixRows, OutputFolder, REST,
    SmoothingSummary, SparseSummary,
};

use super::super::answer::{GROUPS, MATRIX, NUMPY, ROUGH, SUMMARY, THERMAL, named};
use super::super::question::FactorsQuestion;
use super::super::subject::Subject;
use super::SparseAsked;
use super::count::SparseCounted;
use super::journal::ROWS;
use super::matrix::{EntryFilter, RowsFile, RowsMatrix, SmoothedMatrix};
use crate::error::Error;

/// A file that sparse factors are written to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SparseFile {
    /// `factors.mtx`: Matrix Market.
    Mtx,
    /// `factors.npz`: compressed rows for SciPy, with counts and intervals.
    Npz,
    /// `factors.parquet`: a row for each factor that is not 0.
    Parquet,
    /// `factors.vf`: View3D.
    View3d,
    /// `vfsparse.inp` and `svf.inp`: uDALES.
    Udales,
    /// `vf.nc.inp` and `svf.inp`: uDALES, every pair in NetCDF.
    UdalesNetcdf,
    /// `factors.idf`: EnergyPlus.
    EnergyPlus,
    /// `F`, `globalFaceFaces` and the maps of one processor: OpenFOAM.
    OpenFoam,
}

impl SparseFile {
    /// All of them.
    pub const ALL: [SparseFile; 8] = [
        SparseFile::Mtx,
        SparseFile::Npz,
        SparseFile::Parquet,
        SparseFile::View3d,
        SparseFile::Udales,
        SparseFile::UdalesNetcdf,
        SparseFile::EnergyPlus,
        SparseFile::OpenFoam,
    ];

    /// The names of its files.
    pub fn names(self) -> &'static [&'static str] {
        match self {
            SparseFile::Mtx => &[MATRIX],
            SparseFile::Npz => &[NUMPY, "smoothed.npz"],
            SparseFile::Parquet => &["factors.parquet"],
            SparseFile::View3d => &["factors.vf"],
            SparseFile::Udales => &["vfsparse.inp", "svf.inp"],
            SparseFile::UdalesNetcdf => &["vf.nc.inp", "svf.inp"],
            SparseFile::EnergyPlus => &["factors.idf"],
            SparseFile::OpenFoam => &["F", "globalFaceFaces", "subMap", "constructMap", "constructMapDim"],
        }
    }
}

/// All files of sparse factors.
pub fn sparse_files() -> Vec<&'static str> {
    let own = [ROWS, GROUPS, SUMMARY, THERMAL].into_iter();
    own.chain(SparseFile::ALL.iter().flat_map(|file| file.names()).copied()).collect()
}

/// Sums over all rows.
#[derive(Clone, Debug, Default)]
struct RowTotals {
    /// Walks of each row.
    walks: Vec<u64>,
    rays: u64,
    entries: u64,
    /// Walks that ended on backs, that escaped below the horizon or to anywhere, that left for the sky.
    lost: [u64; 3],
    /// The sum of variances of each row, times the weight of the row.
    variance: f64,
    dropped: u64,
    /// The parts of rows that were dropped: their sum, and the largest.
    dropped_part: [f64; 2],
    unreached: usize,
}

/// What the rows say.
pub struct SparseAnswer {
    subject: Subject,
    zone: String,
    /// What each group is called where each has a name of its own.
    names: Vec<String>,
    counted: SparseCounted,
    file: RowsFile,
    sums: RowTotals,
    periods: Option<[f64; 2]>,
    smoothed: Option<(SmoothedRows, SmoothingSummary)>,
    thermal: Option<Thermal>,
}

impl SparseAnswer {
    /// The answer by rows of all groups that are in a folder.
    ///
    /// # Errors
    /// Where the rows cannot be read, or say nothing of heat.
    pub fn of(
        question: &FactorsQuestion,
        asked: &SparseAsked,
        counted: SparseCounted,
        folder: &OutputFolder,
    ) -> Result<Self, Error> {
        let (subject, heading) = (question.subject(), &counted.heading);
        let file = RowsFile {
            path: folder.file(ROWS),
            groups: heading.groups,
            columns: heading.columns + usize::from(asked.least > 0.0),
            least: asked.least,
        };
        let sums = RowTotals::of(&file, &subject)?;
        let smoothed = if subject.smooth { smoothed(&file, &subject)? } else { None };
        let thermal = balance(&file, &subject)?;
        let names = question.names();
        Ok(SparseAnswer {
            subject,
            zone: question.job.name.clone(),
            names,
            counted,
            file,
            sums,
            periods: asked.periods,
            smoothed,
            thermal,
        })
    }

    fn matrix(&self, view: EntryFilter) -> RowsMatrix<'_> {
        RowsMatrix { file: &self.file, entries: self.sums.entries, view }
    }

    /// Writes these files, the groups and the summary.
    ///
    /// # Errors
    /// Where a file cannot be written.
    pub fn write(&self, folder: &OutputFolder, files: &[SparseFile]) -> Result<(), Error> {
        for file in files {
            self.write_file(folder, *file)?;
        }
        let rows = self.subject.rows(|i| self.sums.walks[i]);
        folder.write(GROUPS, |file| report::write_groups(file, &rows))?;
        match &self.thermal {
            Some(thermal) => {
                folder.write(THERMAL, |file| report::write_thermal(file, &self.names, thermal))?
            }
            // That of an earlier run says nothing of these factors.
            None => folder.remove(&[THERMAL])?,
        }
        let summary = self.summary();
        Ok(folder.write(SUMMARY, |file| report::write_json(file, &summary))?)
    }

    /// Writes the smoothed factors where there are any, else the counted ones; those of arrays beside the counted ones.
    fn write_file(&self, folder: &OutputFolder, file: SparseFile) -> Result<(), Error> {
        let (counted, names) = (self.matrix(EntryFilter::Factor), file.names());
        let smoothed = self.smoothed.as_ref().map(|(rows, _)| SmoothedMatrix { file: &self.file, rows });
        let factors: &dyn MatrixRows = match &smoothed {
            Some(smoothed) => smoothed,
            None => &counted,
        };
        match file {
            SparseFile::Mtx => {
                let kind = if smoothed.is_some() { "Smoothed exchange" } else { "Exchange" };
                let words =
                    format!("{kind} factors of radwalk: rows are the groups of groups.csv, in its order");
                let words = format!("{words}\ncolumns are these, then {}", self.extra().join(", "));
                folder.write(names[0], |file| report::write_mtx(file, &words, factors))?;
            }
            SparseFile::Npz => {
                self.write_npz(folder, names[0], &counted)?;
                if smoothed.is_some() {
                    let extra = self.extra();
                    folder.write(names[1], |file| {
                        report::write_csr(BufWriter::new(file), factors, &[], &[], &extra)
                    })?;
                }
            }
            SparseFile::Parquet => self.write_parquet(folder, names[0])?,
            SparseFile::View3d => {
                let areas: Vec<f64> = self.subject.groups.iter().map(|group| group.area).collect();
                let emissivities: Vec<f64> =
                    self.subject.rows(|_| 0).iter().map(|row| row.absorptance).collect();
                folder
                    .write(names[0], |file| report::write_view3d(file, (&areas, &emissivities), factors))?;
            }
            SparseFile::Udales => {
                folder.write(names[0], |file| report::write_udales(file, factors))?;
                folder
                    .write(names[1], |file| report::write_udales_sky(file, factors, self.file.least > 0.0))?;
            }
            SparseFile::UdalesNetcdf => {
                folder.write(names[0], |file| report::write_udales_netcdf(file, factors))?;
                folder
                    .write(names[1], |file| report::write_udales_sky(file, factors, self.file.least > 0.0))?;
            }
            SparseFile::EnergyPlus => {
                folder.write(names[0], |file| {
                    report::write_energyplus(file, &self.zone, &self.names, factors)
                })?;
            }
            SparseFile::OpenFoam => {
                folder.write(names[0], |file| report::write_openfoam(file, FoamList::Factors, factors))?;
                folder.write(names[1], |file| report::write_openfoam(file, FoamList::Columns, factors))?;
                for map in &names[2..] {
                    folder.write(map, |file| report::write_openfoam_map(file, map, factors.rows()))?;
                }
            }
        }
        Ok(())
    }

    fn write_npz(&self, folder: &OutputFolder, name: &str, factors: &RowsMatrix<'_>) -> Result<(), Error> {
        let intervals = || RefCell::new(Intervals::new(self.subject.level));
        let [count, low, high] =
            [EntryFilter::Count, EntryFilter::Low(intervals()), EntryFilter::High(intervals())]
                .map(|view| self.matrix(view));
        let more = [
            CsrNumbers { name: "count", kind: CsrKind::U32, numbers: &count },
            CsrNumbers { name: "ci_low", kind: CsrKind::LowF32, numbers: &low },
            CsrNumbers { name: "ci_high", kind: CsrKind::HighF32, numbers: &high },
        ];
        let of_rows = [
            ("area", self.subject.groups.iter().map(|group| group.area).collect()),
            ("walks", self.sums.walks.iter().map(|&walks| walks as f64).collect()),
        ];
        let extra = self.extra();
        Ok(folder
            .write(name, |file| report::write_csr(BufWriter::new(file), factors, &more, &of_rows, &extra))?)
    }

    fn write_parquet(&self, folder: &OutputFolder, name: &str) -> Result<(), Error> {
        let mut intervals = Intervals::new(self.subject.level);
        Ok(folder.write(name, |file| {
            report::write_factors_parquet(file, |take| {
                let rows = self.file.each(&mut |from, kept, _| {
                    let walks = kept.row.walks();
                    kept.row.entries().iter().zip(kept.row.factors()).try_for_each(
                        |(&(to, count), factor)| {
                            let interval = intervals.of(count, walks).interval;
                            take(FactorEntry { from, to, count, factor, interval })
                        },
                    )
                });
                rows.map_err(io::Error::other)
            })
        })?)
    }

    /// The columns behind the groups.
    fn extra(&self) -> Vec<String> {
        let sky = (0..self.counted.heading.sky).map(|patch| format!("sky {patch}"));
        let rest = (self.file.least > 0.0).then(|| REST.to_owned());
        [BACK, ESCAPE].into_iter().map(String::from).chain(sky).chain(rest).collect()
    }

    fn summary(&self) -> SparseSummary {
        let SparseAnswer { subject, counted, sums, file, .. } = self;
        let walks = sums.walks.iter().sum::<u64>();
        let part = |lost: u64| lost as f64 / walks as f64;
        SparseSummary {
            version: env!("CARGO_PKG_VERSION").into(),
            scene_hash: subject.scene_hash,
            seed: counted.heading.seed,
            kind: match subject.kind {
                FactorKind::FirstHit => "first_hit",
                FactorKind::Absorbed => "absorbed",
            },
            groups: file.groups,
            columns: file.columns,
            walks,
            rays: sums.rays,
            seconds: counted.seconds,
            confidence: subject.confidence,
            entries: sums.entries,
            error: self.error(),
            back: part(sums.lost[0]),
            escape: part(sums.lost[1]),
            sky: part(sums.lost[2]),
            periods: self.periods,
            dropped: (file.least > 0.0).then(|| DroppedSummary {
                least: file.least,
                entries: sums.dropped,
                mean: sums.dropped_part[0] / file.groups as f64,
                largest: sums.dropped_part[1],
            }),
            unreached: counted.heading.tolerance.map(|_| sums.unreached),
            smoothing: self.smoothed.as_ref().map(|(_, summary)| summary.clone()),
        }
    }

    /// The root of the sum of variances of a row, in the mean square over rows by their weight.
    fn error(&self) -> f64 {
        (self.sums.variance / self.subject.weights().iter().sum::<f64>()).sqrt()
    }

    /// Whether all rows are known as well as was asked, where that was.
    pub fn reached(&self) -> Option<bool> {
        self.counted.heading.tolerance.map(|_| self.sums.unreached == 0)
    }

    /// A few lines for people.
    pub fn lines(&self) -> Vec<String> {
        let SparseSummary { groups, walks, entries, seconds, dropped, sky, escape, .. } = self.summary();
        let (groups, filled) = (groups as u64, entries as f64 / groups as f64);
        let what = match self.subject.kind {
            FactorKind::FirstHit => "form factors",
            FactorKind::Absorbed => "factors of absorption after reflections (Gebhart's)",
        };
        let mut lines = vec![
            format!("{what} of {}: {} in {seconds:.1} s", counted(groups, "row"), counted(walks, "walk")),
            format!(
                "{} that {} not 0, {filled:.0} a row; a row errs by {:.2e}, root of the sum of squares",
                counted(entries, "factor"),
                if entries == 1 { "is" } else { "are" },
                self.error()
            ),
        ];
        if escape + sky > 0.0 {
            lines.push(format!("{} of the walks leave the scene", percent(escape + sky)));
        }
        lines.extend(self.smoothed.as_ref().map(|(rows, SmoothingSummary { outside, largest_move })| {
            format!(
                "smoothing moves them by up to {largest_move:.1} standard errors, {outside} of {} out of their intervals",
                counted(rows.entries(), "factor")
            )
        }));
        lines.extend(dropped.map(|DroppedSummary { least, entries, mean, largest }| {
            format!(
                "{} below {least} are dropped, {} of a row in the mean and {} at most; column {REST} holds them",
                counted(entries, "factor"),
                percent(mean),
                percent(largest)
            )
        }));
        lines
    }

    /// What people should know before they use the factors.
    pub fn warnings(&self) -> Vec<String> {
        let back = self.summary().back;
        let backs = (back > 0.0).then(|| {
            format!("{} of the walks end on backs of one-sided surfaces (column back)", percent(back))
        });
        let missed = (self.sums.unreached > 0).then(|| {
            format!(
                "{} have all their walks and are not known so well; give more --rays",
                counted(self.sums.unreached as u64, "row")
            )
        });
        let rough = (self.subject.smooth && self.smoothed.is_none()).then(|| ROUGH.to_owned());
        [rough, backs, missed].into_iter().flatten().collect()
    }
}

impl RowTotals {
    fn of(file: &RowsFile, subject: &Subject) -> Result<Self, Error> {
        let (mut sums, weights) = (RowTotals::default(), subject.weights());
        let groups = file.groups as u32;
        file.each(&mut |i, kept, dropped| {
            let row = &kept.row;
            let walks = row.walks();
            sums.walks.push(walks);
            sums.rays += kept.rays;
            sums.entries += row.entries().len() as u64;
            let [back, escape] = [0, 1].map(|place| u64::from(row.count(groups + place)));
            let behind = row.entries().iter().filter(|&&(column, _)| column >= groups);
            let behind: u64 = behind.map(|&(_, count)| u64::from(count)).sum();
            let sky = behind - back - escape - dropped.walks;
            sums.lost.iter_mut().zip([back, escape, sky]).for_each(|(sum, more)| *sum += more);
            sums.variance += weights[i] * row.variance();
            let part = dropped.walks as f64 / walks as f64;
            sums.dropped += dropped.entries;
            sums.dropped_part = [sums.dropped_part[0] + part, sums.dropped_part[1].max(part)];
            sums.unreached += usize::from(!kept.reached);
            Ok(())
        })?;
        Ok(sums)
    }
}

/// The smoothed factors, and what smoothing has changed; `None` where there are none.
fn smoothed(file: &RowsFile, subject: &Subject) -> Result<Option<(SmoothedRows, SmoothingSummary)>, Error> {
    let mut pairs = PairedRows::new(subject.weights());
    file.each(&mut |i, kept, _| {
        pairs.measure(i, &kept.row);
        Ok(())
    })?;
    file.each(&mut |i, kept, _| {
        pairs.add(i, &kept.row);
        Ok(())
    })?;
    let Some(rows) = pairs.smooth() else { return Ok(None) };
    let (mut summary, mut intervals) =
        (SmoothingSummary { outside: 0, largest_move: 0.0 }, Intervals::new(subject.level));
    file.each(&mut |i, kept, _| {
        let walks = kept.row.walks();
        for (column, factor) in rows.row(i) {
            let known = intervals.of(kept.row.count(column), walks);
            summary.outside += usize::from(!known.interval.contains(factor));
            let moved = known.std_error.map_or(0.0, |error| (factor - known.factor).abs() / error);
            summary.largest_move = summary.largest_move.max(moved);
        }
        Ok(())
    })?;
    Ok(Some((rows, summary)))
}

/// The heat between the groups of an enclosure, by all factors: none is dropped.
fn balance(file: &RowsFile, subject: &Subject) -> Result<Option<Thermal>, Error> {
    let Some(enclosure) = &subject.enclosure else { return Ok(None) };
    let mut factors = SparseFactors::default();
    RowsFile { least: 0.0, ..file.clone() }.each(&mut |_, kept, _| {
        factors.push(&kept.row, file.groups as u32);
        Ok(())
    })?;
    let balance = Balance {
        factors: &factors,
        emitting_areas: &subject.weights(),
        given: &enclosure.given,
        environment: enclosure.environment,
        level: subject.level,
    };
    Ok(Some(balance.solve().map_err(|fault| named(&fault, &subject.names()))?))
}
