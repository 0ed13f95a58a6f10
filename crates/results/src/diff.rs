//! Two results of one scene, held against each other patch by patch.
//!
//! z is the difference of two radiosities over its standard error, √(σ₁² + σ₂²). Of m patches the largest |z| of two honest
//! runs stays below a limit that each exceeds with the probability 1 − (1 − α)^(1/m) (Šidák 1967; patches that depend on each
//! other exceed it less often), so that α bounds the rate of false alarms of the whole comparison.
//!
//! A sample of few scores that has less than its share has too small an error, too. So the error is no smaller than it would be of the reflected light
//! that both samples together tell, the variance of each growing in proportion to that light, as of counts.

mod jobs;

use std::fs;
use std::path::{Path, PathBuf};

use csv::StringRecord;
use protocol::Checkpoint;
use stats::{mean_squared_z, normal_quantile, student_quantile};

use crate::checkpoints::CURRENT;
use crate::error::Error;
use crate::stored_run::{no_other_result, unusable};
pub use jobs::JobDifference;
use jobs::{JobFacts, differences};

/// α: the probability that chance alone makes two honest runs differ is this at most.
pub(crate) const FALSE_ALARM: f64 = 1e-3;

/// The least number of scores whose spread is trusted for a z.
pub(crate) const FEWEST_HITS: u64 = 30;

/// The most differences that are printed one by one.
pub(crate) const LISTED: usize = 10;

/// The columns of radiosities and their errors, in grey and in colour.
const COLUMNS: [[&str; 2]; 4] = [
    ["radiosity", "std_error"],
    ["radiosity_r", "std_error_r"],
    ["radiosity_g", "std_error_g"],
    ["radiosity_b", "std_error_b"],
];

/// The tables of a deterministic solution, in grey and in colour, each beside its summary.
const EXACT: [&str; 4] = ["exact", "exact_r", "exact_g", "exact_b"];

/// One radiosity of a result.
#[derive(Clone, Debug, PartialEq)]
struct PatchRadiosity {
    /// Patch, surface, cell and side, as the table has them.
    place: Vec<String>,
    /// The column of the radiosity.
    channel: &'static str,
    /// Radiosity and standard error; `None` if no walk gives an estimate, or too few walks do.
    value: Option<(f64, f64)>,
    /// What of the radiosity is emitted.
    emitted: f64,
}

impl PatchRadiosity {
    /// What is reflected, and the variance of its estimate for each unit of it; 0 of what is known without walks.
    fn reflected(&self) -> Option<[f64; 2]> {
        let (radiosity, error) = self.value?;
        let reflected = radiosity - self.emitted;
        Some([reflected, if reflected > 0.0 { error * error / reflected } else { 0.0 }])
    }
}

/// A result as its table has it.
struct ComparedResult {
    rows: Vec<PatchRadiosity>,
    /// `None` of a deterministic solution.
    tally: Option<Checkpoint>,
    job: JobFacts,
}

/// A comparison of two results.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// The ways in which the jobs differ, those first that change the answer.
    pub jobs: Vec<JobDifference>,
    /// Whether the tallies are the same, to the last bit. Then no number may differ, but for the factors of mixtures.
    pub same_tally: bool,
    /// Patches (times channels) that were compared.
    pub compared: usize,
    /// Patches (times channels) that were not compared, since too few walks reached them.
    pub skipped: usize,
    /// |z| that two honest runs exceed anywhere with the probability [`FALSE_ALARM`] at most; 0 where the tallies are the same.
    pub limit: f64,
    /// The mean of z² over what was compared: 1 is expected.
    pub mean_squared: f64,
    /// Patches (times channels) whose |z| is beyond the limit.
    pub beyond: usize,
    /// The largest |z|, those first, [`LISTED`] at most.
    pub largest: Vec<Difference>,
}

/// One radiosity in two results.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// Patch and side, as the table has them.
    pub place: Vec<String>,
    /// The column of the radiosity.
    pub channel: &'static str,
    /// The difference over its standard error.
    pub z: f64,
    /// Radiosity and standard error in either result.
    pub values: [(f64, f64); 2],
}

/// Compares the results in two output folders.
///
/// # Errors
/// Where one cannot be read, and where the two cannot be held against each other.
pub fn compare(first: &Path, second: &Path) -> Result<Comparison, Error> {
    let sides = [read(first)?, read(second)?];
    let jobs = differences([&sides[0].job, &sides[1].job]);
    let incomparable = |reason: String, remedy| Error::Incomparable {
        first: first.into(),
        second: second.into(),
        reason,
        remedy,
    };
    check_places(&sides).map_err(|reason| {
        let why: Vec<String> = jobs.iter().filter(|job| job.other_answer).map(JobDifference::line).collect();
        incomparable([vec![reason], why].concat().join("; "), "compare results of one scene")
    })?;
    let same_tally = match &sides {
        [ComparedResult { tally: Some(a), .. }, ComparedResult { tally: Some(b), .. }] => {
            let same = a.tally.hash() == b.tally.hash();
            if !same && share_walks(a, b) {
                let reason =
                    "they hold some of the same walks, so that they differ less than chance has it".into();
                return Err(incomparable(reason, "run one of them with another --seed"));
            }
            same
        }
        _ => false,
    };
    let comparison = Comparison { jobs, ..compare_rows(&sides, same_tally) };
    if comparison.compared == 0 {
        let reason = format!("no patch has {FEWEST_HITS} scores in both");
        return Err(incomparable(reason, "run them with more --paths"));
    }
    Ok(comparison)
}

/// Reads what a run left, or a deterministic solution: an output folder, or a table in one.
fn read(path: &Path) -> Result<ComparedResult, Error> {
    let folder = if path.is_file() { path.parent().unwrap_or(path) } else { path };
    let is_named = |name: &str| path.is_file() && path.file_stem().is_some_and(|stem| stem == name);
    let table = folder.join("patches.csv");
    if EXACT.into_iter().any(is_named) || (!table.exists() && !path.is_file()) {
        let named: Vec<&str> = EXACT.into_iter().filter(|name| is_named(name) && *name == EXACT[0]).collect();
        let tables = |names: &[&str]| -> Vec<PathBuf> {
            let paths = names.iter().map(|name| folder.join(name).with_extension("csv"));
            paths.filter(|path| path.exists()).collect()
        };
        let tables = if named.is_empty() { tables(&EXACT) } else { tables(&named) };
        if let Some(first) = tables.first() {
            return read_exact(&tables, &first.with_extension("json"));
        }
    }
    if !table.exists() {
        no_other_result(folder)?;
    }
    let rows = read_table(&table, None)?;
    let tally = Checkpoint::read(&folder.join(CURRENT))?;
    let job = JobFacts::of_run(&tally).map_err(|reason| unusable(folder, &tally, reason))?;
    Ok(ComparedResult { rows, job, tally: Some(tally) })
}

/// Reads the tables of a deterministic solution, one for each channel.
fn read_exact(tables: &[PathBuf], summary: &Path) -> Result<ComparedResult, Error> {
    let channel = |table: &PathBuf| {
        let name = table.file_stem().and_then(|stem| EXACT.into_iter().position(|name| stem == name));
        COLUMNS[name.unwrap_or(0)][0]
    };
    let channels: Result<Vec<Vec<PatchRadiosity>>, Error> =
        tables.iter().map(|table| read_table(table, Some(channel(table)))).collect();
    let mut channels: Vec<_> = channels?.into_iter().map(Vec::into_iter).collect();
    let mut rows = Vec::new();
    // Tables of runs have the channels of a patch side by side.
    while channels.iter().all(|channel| channel.len() > 0) {
        rows.extend(channels.iter_mut().filter_map(Iterator::next));
    }
    Ok(ComparedResult { rows, tally: None, job: JobFacts::of_exact(summary) })
}

/// Reads a table; `of` is the channel of one that has a single channel's numbers, and not what a run leaves.
fn read_table(path: &Path, of: Option<&'static str>) -> Result<Vec<PatchRadiosity>, Error> {
    let fault = |reason: String| Error::NoTable { path: path.into(), reason };
    let bytes = fs::read(path).map_err(|error| fault(error.to_string()))?;
    let mut reader = csv::Reader::from_reader(&bytes[..]);
    let header = reader.headers().map_err(|error| fault(error.to_string()))?.clone();
    let column = |name: &str| header.iter().position(|column| column == name);
    let places: Vec<usize> = ["patch", "side"].into_iter().filter_map(column).collect();
    let channels: Vec<_> = match of {
        None => COLUMNS
            .into_iter()
            .filter_map(|[value, error]| Some((value, column(value)?, column(error))))
            .collect(),
        // How far the solution itself may be off stands for a standard error.
        Some(channel) => {
            column("radiosity").map(|value| (channel, value, column("radiosity_error"))).into_iter().collect()
        }
    };
    if channels.is_empty() {
        return Err(fault("it has no column of radiosities".into()));
    }
    let trusted = HitColumns { hits: column("hits"), flags: column("flags") };
    let emittances = COLUMNS.map(|[name, _]| column(&name.replace("radiosity", "emittance")));
    let reflected = column("reflected");
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| fault(error.to_string()))?;
        let place: Vec<String> = places.iter().map(|&i| record[i].to_owned()).collect();
        for &(channel, value, error) in &channels {
            let number = |column: usize| record[column].parse::<f64>().unwrap_or(0.0);
            let emittance = COLUMNS.iter().position(|[name, _]| *name == channel).and_then(|c| emittances[c]);
            let emitted = match (reflected, emittance) {
                (Some(reflected), _) => number(value) - number(reflected),
                (None, emittance) => emittance.map_or(0.0, number),
            };
            let value = value_of(&record, value, error, &trusted).map_err(&fault)?;
            rows.push(PatchRadiosity { place: place.clone(), channel, value, emitted });
        }
    }
    Ok(rows)
}

/// The columns that tell whether a standard error means much: scores, of which gathering has as many as births, and flags.
struct HitColumns {
    hits: Option<usize>,
    flags: Option<usize>,
}

/// A radiosity and its standard error, which is 0 where there is no such column.
fn value_of(
    record: &StringRecord,
    value: usize,
    error: Option<usize>,
    trusted: &HitColumns,
) -> Result<Option<(f64, f64)>, String> {
    let number = |i: usize| match &record[i] {
        "" => Ok(None),
        text => text.parse::<f64>().map(Some).map_err(|_| format!("{text:?} is no number")),
    };
    let error = error.map_or(Ok(Some(0.0)), number)?;
    let hits = trusted.hits.map_or(Ok(None), number)?;
    let value = number(value)?.zip(error);
    let is_rare = trusted.flags.is_some_and(|flags| record[flags].split('|').any(|flag| flag == "rare"));
    let few = is_rare || hits.is_some_and(|hits| hits < FEWEST_HITS as f64);
    // What is known without any walk is known well.
    let few = few && value.is_none_or(|(_, error)| error > 0.0);
    Ok(value.filter(|_| !few))
}

/// Whether rows stand for the same faces.
fn check_places([first, second]: &[ComparedResult; 2]) -> Result<(), String> {
    if first.rows.len() != second.rows.len() {
        return Err(format!("one has {} radiosities, the other {}", first.rows.len(), second.rows.len()));
    }
    let same = |(a, b): (&PatchRadiosity, &PatchRadiosity)| (&a.place, a.channel) == (&b.place, b.channel);
    match first.rows.iter().zip(&second.rows).position(|rows| !same(rows)) {
        None => Ok(()),
        Some(row) => Err(format!("row {} is of other patches, sides or channels", row + 1)),
    }
}

/// Whether two results hold a walk in common.
fn share_walks(a: &Checkpoint, b: &Checkpoint) -> bool {
    let parts = a.book.parts.iter().flat_map(|a| b.book.parts.iter().map(move |b| (a, b)));
    parts.filter(|(a, b)| (a.job_hash, a.seed) == (b.job_hash, b.seed)).any(|(a, b)| {
        a.first < b.first.saturating_add(b.walks()) && b.first < a.first.saturating_add(a.walks())
    })
}

/// The chains or batches of a result, where its intervals are Student's; its paths tell.
fn freedom(side: &ComparedResult) -> Option<u64> {
    let Checkpoint { tally, .. } = side.tally.as_ref()?;
    let ends =
        tally.counts.absorbed + tally.counts.absorbed_back + tally.counts.escaped + tally.counts.truncated;
    (ends > tally.counts.walks).then(|| tally.counts.walks.max(2) - 1)
}

fn compare_rows([first, second]: &[ComparedResult; 2], same_tally: bool) -> Comparison {
    let of_row = |(i, (a, b)): (usize, (&PatchRadiosity, &PatchRadiosity))| {
        let values = [a.value?, b.value?];
        Some((z(values, least_error([a.reflected()?, b.reflected()?])), i))
    };
    let mut ranks: Vec<(f64, usize)> =
        first.rows.iter().zip(&second.rows).enumerate().filter_map(of_row).collect();
    ranks.sort_by(|a, b| b.0.abs().total_cmp(&a.0.abs()).then(a.1.cmp(&b.1)));
    let compared = ranks.len();
    let each = -f64::ln_1p(-FALSE_ALARM) / compared.max(1) as f64;
    // 1 − (1 − α)^(1/m) = 1 − exp(−each).
    let p = 1.0 + 0.5 * f64::exp_m1(-each);
    // Of the smaller sample, whose intervals are the wider.
    let freedom = [first, second].into_iter().filter_map(freedom).min();
    let limit = match freedom {
        _ if same_tally => 0.0,
        None => normal_quantile(p),
        Some(freedom) => student_quantile(p, freedom),
    };
    let is_by_chance = |i: usize| {
        [first, second].iter().any(|side| side.rows[i].value.is_some_and(|(_, error)| error > 0.0))
    };
    let by_chance = ranks.iter().filter(|(z, i)| *z != 0.0 || is_by_chance(*i));
    // By the errors of the samples themselves.
    let own_z = |&(_, i): &(f64, usize)| Some(z([first.rows[i].value?, second.rows[i].value?], 0.0));
    let difference = |&(z, i): &(f64, usize)| {
        let PatchRadiosity { place, channel, value, .. } = &first.rows[i];
        let values = [(*value)?, second.rows[i].value?];
        Some(Difference { place: place.clone(), channel, z, values })
    };
    Comparison {
        jobs: Vec::new(),
        same_tally,
        compared,
        skipped: first.rows.len() - compared,
        limit,
        mean_squared: mean_squared_z(by_chance.filter_map(own_z)).map_or(0.0, |found| found.value),
        beyond: ranks.iter().filter(|(z, _)| z.abs() > limit).count(),
        largest: ranks.iter().take(LISTED).filter_map(difference).collect(),
    }
}

/// The standard error of the difference of two samples of the reflected light that is likeliest for both.
fn least_error([[x, per_x], [y, per_y]]: [[f64; 2]; 2]) -> f64 {
    let common = match (per_x > 0.0, per_y > 0.0) {
        (true, true) => (x * per_y + y * per_x) / (per_x + per_y),
        (true, false) => y,
        (false, _) => x,
    };
    ((per_x + per_y) * common.max(0.0)).sqrt()
}

/// The difference of two radiosities over its standard error, which is no less than `least`.
fn z([(x, dx), (y, dy)]: [(f64, f64); 2], least: f64) -> f64 {
    let error = dx.hypot(dy).max(least);
    match x - y {
        // Both are known without walks, or to the last bit.
        0.0 => 0.0,
        off if off.abs() <= 1e-9 * x.abs().max(y.abs()) && error == 0.0 => 0.0,
        off => off / error,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn side(values: &[Option<(f64, f64)>]) -> ComparedResult {
        let row = |(i, &value): (usize, &Option<(f64, f64)>)| PatchRadiosity {
            place: vec![i.to_string()],
            channel: "radiosity",
            value,
            emitted: 0.0,
        };
        let job = JobFacts::of_exact(Path::new(""));
        ComparedResult { rows: values.iter().enumerate().map(row).collect(), tally: None, job }
    }

    #[test]
    fn z_goes_by_both_errors() {
        let sides = [
            side(&[Some((1.0, 0.4)), Some((2.0, 0.0)), None, Some((5.0, 0.0))]),
            side(&[Some((2.0, 0.3)), Some((2.0, 0.0)), Some((1.0, 0.1)), Some((6.0, 0.0))]),
        ];
        let comparison = compare_rows(&sides, false);
        assert_eq!((comparison.compared, comparison.skipped), (3, 1));
        let largest: Vec<(f64, &str)> =
            comparison.largest.iter().map(|difference| (difference.z, &difference.place[0][..])).collect();
        // The variances for each unit of light are 0.16 and 0.045, the light that is likeliest for both 1.780: 0.604, more than the 0.5 of the errors.
        let z = -1.0 / (0.365_f64).sqrt();
        assert!((largest[1].0 - z).abs() < 1e-12, "{largest:?}");
        assert_eq!(
            [largest[0], (-2.0, largest[1].1), largest[2]],
            [(f64::NEG_INFINITY, "3"), (-2.0, "0"), (0.0, "1")]
        );
        assert_eq!(comparison.beyond, 1, "what is known without error and differs, differs");
        // Φ⁻¹(1 − 0.0005/3), for α/m to first order.
        assert!((comparison.limit - 3.588).abs() < 0.01, "{}", comparison.limit);
    }

    /// 400 runs of 181 patches with 80 scores each against a solution without error: a false alarm in 1,000 comparisons at most, so that five in 400 have a probability
    /// of 6·10⁻⁵. By their own errors alone there are about six.
    #[test]
    fn runs_of_few_scores_agree_with_the_truth() {
        let mut rng = radiosity::Sequence::new(5).walk(0);
        let mut poisson = |mean: f64| {
            let (mut events, mut time) = (0_u32, 0.0);
            loop {
                time -= (1.0 - rng.pair()[0]).ln();
                if time > mean {
                    return f64::from(events);
                }
                events += 1;
            }
        };
        let truth = vec![Some((80.0, 0.0)); 181];
        let mut differs = || {
            let run: Vec<_> = (0..181).map(|_| poisson(80.0)).map(|k| Some((k, k.sqrt()))).collect();
            compare_rows(&[side(&run), side(&truth)], false).beyond > 0
        };
        let alarms = (0..400).filter(|_| differs()).count();
        assert!(alarms < 5, "{alarms}");
    }

    #[test]
    fn the_mean_is_of_what_chance_plays_a_part_in() {
        let sides = [
            side(&[Some((1.0, 0.3)), Some((2.0, 0.0)), Some((3.0, 0.0))]),
            side(&[Some((2.0, 0.4)), Some((2.0, 0.0)), Some((3.0, 0.0))]),
        ];
        assert_eq!(compare_rows(&sides, false).mean_squared, 4.0);
        assert_eq!(
            compare_rows(&sides.map(|side| ComparedResult { rows: side.rows[1..].to_vec(), ..side }), false)
                .mean_squared,
            0.0
        );
    }

    #[test]
    fn rows_are_of_the_same_patches() {
        assert!(check_places(&[side(&[None]), side(&[None, None])]).unwrap_err().contains("one has 1"));
        let mut other = side(&[None]);
        other.rows[0].place = vec!["7".into()];
        assert!(check_places(&[side(&[None]), other]).unwrap_err().contains("row 1"));
    }
}
