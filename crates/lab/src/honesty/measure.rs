//! Runs of a method in a scene, and how what they tell compares with what is true.

use std::collections::BTreeMap;

use radiosity::Scene;
use report::ColumnCells;
use results::StoredRun;
use serde_json::Value;
use stats::Measured;

use super::Failure;
use super::methods::{HonestyMethod, METHODS, scene};
use super::scenes::HonestyScene;
use super::truth::{FaceReference, Fine};

/// Classes of patches by the scores that a run is worth there, up to 1, 4, 16, 64, or more: (b/σ)², b being the reflected light and σ the
/// root mean squared error of a run, and never more than its mean number of hits.
pub const CLASSES: [f64; 5] = [1.0, 4.0, 16.0, 64.0, f64::INFINITY];

/// Relative errors below this are those of rounding and of solving systems, not of walks.
const ROUNDING: f64 = 1e-5;

/// The columns of radiosities, grey and in colour.
const CHANNELS: [&str; 4] = ["", "_r", "_g", "_b"];

/// The relative error of targets over what the plainest runs tell of nine tenths of the area, and the part of the area that is asked for.
const TARGET: f64 = 1.5;
pub const FRACTION: f64 = 0.9;

/// The methods whose distance from the integral equation's answer is looked at, the seeds, and how many times longer these runs are.
const DISTANCES: [&str; 2] = ["collision", "chains"];
const DISTANCE_SEEDS: usize = 40;
const DISTANCE_LONGER: u64 = 16;

/// The scene in which figures are made false on purpose, and the part of their widths that is left.
const CONTROL: &str = "cube54";
pub const NARROWED: f64 = 0.85;

/// The total error that is asked for over what runs of a quarter of the paths tell, and the seeds of runs that ask for it.
const TOTAL_TARGET: f64 = 0.9;
pub const TOTAL_SEEDS: usize = 16;

/// Seeds of runs with a target, and the methods that have them.
pub const TARGET_SEEDS: usize = 20;
const TARGETS: [&str; 4] = ["collision", "gathering", "sobol", "chains"];

/// What a run reports of a radiosity.
#[derive(Clone, Copy, Default)]
struct ReportedRadiosity {
    mean: Option<f64>,
    std_error: Option<f64>,
    low: f64,
    high: f64,
    hits: f64,
    /// The irradiance and its interval, where they are known.
    h: Option<f64>,
    h_interval: Option<[f64; 2]>,
}

/// A run: what it tells, number by number, and its summary.
struct HonestyRun {
    reported: Vec<ReportedRadiosity>,
    summary: Value,
}

/// What intervals of a class of patches come to.
#[derive(Clone, Copy, Default)]
pub struct PatchClass {
    /// The part of the intervals that hold the truth; `None` of no patches.
    pub coverage: Option<Measured>,
    /// Half-width that the median run tells over the error that 95 % of the runs keep within, both added up relative to B.
    pub width: f64,
    /// The reported standard error over the root mean squared error.
    pub std_error: f64,
    /// The relative standard error of that ratio, by leaving out each run in turn (jackknife).
    pub chance: f64,
}

/// The distance of the discretised system from the integral equation's answer: what the median run tells of it, what it is, and the part of the
/// intervals that hold it.
#[derive(Clone, Copy)]
pub struct Distance {
    pub pair: ReportedAndTrue,
    pub coverage: Measured,
}

/// A reported figure and the truth.
#[derive(Clone, Copy)]
pub struct ReportedAndTrue {
    pub reported: f64,
    pub truth: f64,
}

/// Runs that reached a target: their part, and the part of the area that is truly within it, in the mean and at least.
#[derive(Clone, Copy)]
pub struct Reached {
    pub error: f64,
    pub part: f64,
    pub within: f64,
    pub least: f64,
}

/// Runs that reached a total error: their part, and how large their errors truly are, by root mean square with its standard error, and at most.
#[derive(Clone, Copy)]
pub struct TotalReached {
    pub target: f64,
    pub part: f64,
    pub truth: f64,
    pub std_error: f64,
    pub most: f64,
}

/// The results of one method in one scene.
pub struct MethodRow {
    pub site: String,
    pub method: &'static str,
    pub seeds: usize,
    pub paths: u64,
    /// Why it cannot be studied; nothing else is reported then.
    pub refused: Option<String>,
    pub classes: [PatchClass; 5],
    /// The part of the intervals of irradiance that hold the truth.
    pub irradiance: Option<Measured>,
    /// Median, ninth decile and worst relative half-width over the area.
    pub headline: Option<[ReportedAndTrue; 3]>,
    /// Checks that failed, with the part of the runs.
    pub alarms: BTreeMap<String, f64>,
    /// The total error of the answer: as reported, and as predicted before, with the relative standard errors of reported over true by the jackknife.
    pub total: Option<(ReportedAndTrue, f64)>,
    pub predicted: Option<(ReportedAndTrue, f64)>,
    pub reached: Option<Reached>,
    pub total_reached: Option<TotalReached>,
    pub distance: Option<Distance>,
    /// Whether its intervals were narrowed on purpose ([`CONTROL`]).
    pub is_control: bool,
}

/// All methods in a scene.
pub fn all(site: &HonestyScene) -> Result<Vec<MethodRow>, Failure> {
    let (spec, scene) = scene(site)?;
    let faces = scene.faces().len();
    let discrete = FaceReference::discrete(site, &spec, faces)?;
    let of_chains = if site.made { discrete.clone() } else { FaceReference::of_chains(site, faces)? };
    let truths = [discrete, FaceReference::continuous(site, faces)?, of_chains];
    let fine = Fine::new(site, faces)?;
    let distance = true_distance(&scene, &truths);
    let mut rows = Vec::new();
    for method in METHODS.iter().filter(|method| site.made || method.in_rooms) {
        let paths = method.paths(site, scene.faces().len());
        let done = match method.chooses() {
            true => of_chosen(site, method, paths, &fine),
            false => of_given(
                site,
                method,
                paths,
                &SceneTruth { scene: &scene, truths: &truths, fine: &fine, distance },
            ),
        };
        let refused = |why: Failure| {
            vec![MethodRow { refused: Some(why.to_string()), ..MethodRow::new(site, method, 0, paths) }]
        };
        rows.extend(done.unwrap_or_else(refused));
    }
    Ok(rows)
}

/// What is known of a scene beside any run: its given patches, their light in both spaces and as chains have it, the light on fine cells, and how far the discretised
/// system is from the integral equation's answer.
struct SceneTruth<'a> {
    scene: &'a Scene,
    truths: &'a [FaceReference; 3],
    fine: &'a Fine,
    distance: f64,
}

/// The relative L2 distance between the irradiances of both spaces, without the noise of either.
fn true_distance(scene: &Scene, [discrete, continuous, _]: &[FaceReference; 3]) -> f64 {
    let (mut squares, mut light) = (0.0, 0.0);
    let channels = scene.channels();
    for (k, (&[_, d, d_noise], &[_, c, c_noise])) in discrete.light.iter().zip(&continuous.light).enumerate()
    {
        let area = scene.faces().get(k / channels).area;
        squares += area * ((d - c).powi(2) - d_noise - c_noise);
        light += area * (c * c - c_noise);
    }
    (squares.max(0.0) / light).sqrt()
}

impl MethodRow {
    fn new(site: &HonestyScene, method: &HonestyMethod, seeds: usize, paths: u64) -> Self {
        MethodRow {
            site: site.name.clone(),
            method: method.name,
            seeds,
            paths,
            refused: None,
            classes: [PatchClass::default(); 5],
            irradiance: None,
            headline: None,
            alarms: BTreeMap::new(),
            total: None,
            predicted: None,
            reached: None,
            total_reached: None,
            distance: None,
            is_control: false,
        }
    }
}

/// The results of a task for each of some seeds, on two threads.
fn for_seeds<T: Send>(
    seeds: usize,
    task: impl Fn(u64) -> Result<T, Failure> + Sync,
) -> Result<Vec<T>, Failure> {
    let done = parallel::on_threads(2, seeds, || (), |(), seed| task(1 + seed as u64));
    done.into_iter().collect()
}

/// A method on given patches; in one scene also what it would be, were its intervals too narrow.
fn of_given(
    site: &HonestyScene,
    method: &HonestyMethod,
    paths: u64,
    known: &SceneTruth,
) -> Result<Vec<MethodRow>, Failure> {
    let SceneTruth { scene, truths: [discrete, continuous, of_chains], fine, distance } = *known;
    let seeds = method.seeds(site);
    let done = for_seeds(seeds, |seed| {
        let kept = method.run(site, paths, seed, &[])?;
        let run = read(&kept)?;
        let error = (method.name == "linear").then(|| total(&kept, &run.summary, fine));
        let continuous = kept.settings.method.space == radiosity::Space::Continuous;
        Ok((run, error, continuous))
    })?;
    let truth = match done[0].2 {
        true => continuous,
        false if method.name == "chains" => of_chains,
        false => discrete,
    };
    let runs: Vec<&HonestyRun> = done.iter().map(|(run, ..)| run).collect();
    let patches = TableFaces::new(scene, truth);
    let mut row = MethodRow::new(site, method, seeds, paths);
    patches.judge(&mut row, &runs);
    row.alarms = alarms(&runs);
    [row.total, row.predicted] = totals(&done.iter().filter_map(|(_, error, _)| *error).collect::<Vec<_>>());
    if TARGETS.contains(&method.name) && (site.made || method.name == METHODS[0].name) {
        row.reached = reached(site, method, paths, &patches, &runs)?;
    }
    row.distance = match site.made && DISTANCES.contains(&method.name) {
        true => reported_distance(&longer(site, method, paths)?, distance),
        false => reported_distance(runs.iter().map(|run| &run.summary), distance),
    };
    let mut rows = vec![row];
    if site.name == CONTROL && method.name == METHODS[0].name {
        let narrowed: Vec<HonestyRun> = runs.iter().map(|run| run.narrowed()).collect();
        let mut control = MethodRow { is_control: true, ..MethodRow::new(site, method, seeds, paths) };
        patches.judge(&mut control, &narrowed.iter().collect::<Vec<_>>());
        rows.push(control);
    }
    Ok(rows)
}

impl HonestyRun {
    /// The run with all intervals about their estimates narrowed to [`NARROWED`] of their width, standard errors and headlines with them.
    fn narrowed(&self) -> HonestyRun {
        let toward = |end: f64, middle: f64| middle + NARROWED * (end - middle);
        let of_reported = |reported: &ReportedRadiosity| {
            let (b, h) = (reported.mean.unwrap_or(reported.low), reported.h.unwrap_or(0.0));
            ReportedRadiosity {
                std_error: reported.std_error.map(|error| NARROWED * error),
                low: toward(reported.low, b),
                high: toward(reported.high, b),
                h_interval: reported.h_interval.map(|ends| ends.map(|end| toward(end, h))),
                ..*reported
            }
        };
        HonestyRun {
            reported: self.reported.iter().map(of_reported).collect(),
            summary: self.summary.clone(),
        }
    }
}

/// Summaries of runs of a made scene that are long enough for the distance of the discretised system to be examined.
fn longer(site: &HonestyScene, method: &HonestyMethod, paths: u64) -> Result<Vec<Value>, Failure> {
    for_seeds(method.seeds(site).min(DISTANCE_SEEDS), |seed| {
        let kept = method.run(site, DISTANCE_LONGER * paths, 2000 + seed, &[])?;
        Ok(serde_json::to_value(kept.summary("study"))?)
    })
}

/// What runs tell of the distance of the discretised system; `None` where they examine none.
fn reported_distance<'a>(runs: impl IntoIterator<Item = &'a Value>, truth: f64) -> Option<Distance> {
    let of = |summary: &'a Value| {
        let ends = ["distance", "low", "high"].map(|name| summary["discretised"][name].as_f64());
        Some([ends[0]?, ends[1]?, ends[2]?])
    };
    let reported: Vec<[f64; 3]> = runs.into_iter().filter_map(of).collect();
    let holds: Vec<f64> =
        reported.iter().map(|[_, low, high]| f64::from(u8::from(*low <= truth && truth <= *high))).collect();
    let mut distances: Vec<f64> = reported.iter().map(|[distance, ..]| *distance).collect();
    distances.sort_by(f64::total_cmp);
    (reported.len() > 1).then(|| Distance {
        pair: ReportedAndTrue { reported: distances[distances.len() / 2], truth },
        coverage: Measured::of(&holds),
    })
}

/// A method whose patches a pilot chooses: no two runs need have the same.
fn of_chosen(
    site: &HonestyScene,
    method: &HonestyMethod,
    paths: u64,
    fine: &Fine,
) -> Result<Vec<MethodRow>, Failure> {
    let seeds = method.seeds(site);
    let done = for_seeds(seeds, |seed| {
        let kept = method.run(site, paths, seed, &[])?;
        let summary = serde_json::to_value(kept.summary("study"))?;
        let error = total(&kept, &summary, fine);
        Ok((HonestyRun { reported: Vec::new(), summary }, error))
    })?;
    let mut row = MethodRow::new(site, method, seeds, paths);
    row.alarms = alarms(&done.iter().map(|(run, _)| run).collect::<Vec<_>>());
    [row.total, row.predicted] = totals(&done.iter().map(|(_, error)| *error).collect::<Vec<_>>());
    if row.predicted.is_some() {
        row.total_reached = total_reached(site, method, paths, fine, row.total)?;
    }
    Ok(vec![row])
}

/// The total error of a run: reported, predicted, true.
fn total(kept: &StoredRun, summary: &Value, fine: &Fine) -> [f64; 3] {
    let number = |place: &str| summary.pointer(place).and_then(Value::as_f64).unwrap_or(f64::NAN);
    let linear = summary.pointer("/accuracy/answer").is_some_and(|answer| answer == "linear");
    [number("/accuracy/total"), number("/predicted/total"), fine.error(kept, linear)]
}

/// Root mean squares over runs of what is reported and of what is true, where both are known, with the relative standard error of their ratio.
fn totals(found: &[[f64; 3]]) -> [Option<(ReportedAndTrue, f64)>; 2] {
    let root = |of: &dyn Fn(&[f64; 3]) -> f64| {
        (found.iter().map(|run| of(run).powi(2)).sum::<f64>() / found.len() as f64).sqrt()
    };
    let pair = |k: usize| {
        let squares: Vec<[f64; 2]> = found.iter().map(|run| [run[k] * run[k], run[2] * run[2]]).collect();
        let pair = ReportedAndTrue { reported: root(&|run| run[k]), truth: root(&|run| run[2]) };
        Some((pair, ratio_of_roots(&squares).1)).filter(|(pair, _)| pair.reported.is_finite())
    };
    if found.is_empty() { [None, None] } else { [pair(0), pair(1)] }
}

/// Reads what a run tells.
fn read(kept: &StoredRun) -> Result<HonestyRun, Failure> {
    let estimates = kept.estimates();
    let columns = report::columns(&estimates)?;
    let cells = |name: String| {
        columns.iter().find(|column| column.name == name).map(|column| match &column.cells {
            ColumnCells::Number(cells) => cells.clone(),
            ColumnCells::Whole(cells) => cells.iter().map(|cell| cell.map(|cell| cell as f64)).collect(),
            ColumnCells::Words(_) => Vec::new(),
        })
    };
    let hits = cells("hits".into()).ok_or("a table has hits")?;
    let mut channels = Vec::new();
    for suffix in CHANNELS {
        let Some(mean) = cells(format!("radiosity{suffix}")) else { continue };
        let column = |name: &str| cells(format!("{name}{suffix}")).ok_or("a column is missing");
        let (error, low, high) = (column("std_error")?, column("ci_low")?, column("ci_high")?);
        let (h, h_low, h_high) =
            (column("irradiance")?, column("irradiance_low")?, column("irradiance_high")?);
        let reported = (0..mean.len()).map(|i| ReportedRadiosity {
            mean: mean[i],
            std_error: error[i],
            low: low[i].unwrap_or(0.0),
            high: high[i].unwrap_or(f64::INFINITY),
            hits: hits[i].unwrap_or(0.0),
            h: h[i],
            h_interval: h_low[i].zip(h_high[i]).map(|(low, high)| [low, high]),
        });
        channels.push(reported.collect::<Vec<_>>());
    }
    let rows = hits.len();
    let reported = (0..rows).flat_map(|i| channels.iter().map(move |channel| channel[i])).collect();
    Ok(HonestyRun { reported, summary: serde_json::to_value(kept.summary("study"))? })
}

/// The faces of a scene in the order of tables, channel by channel.
struct TableFaces {
    /// Area [m²], R, E, B and H of each number.
    of: Vec<[f64; 5]>,
    channels: usize,
}

impl TableFaces {
    fn new(scene: &Scene, truth: &FaceReference) -> Self {
        let channels = scene.channels();
        let of = scene.faces().by_patch().flat_map(|i| {
            let face = scene.faces().get(i);
            (0..channels).map(move |c| {
                let [b, h, _] = truth.light[i * channels + c];
                [face.area, face.reflectance[c], face.emittance[c], b, h]
            })
        });
        TableFaces { of: of.collect(), channels }
    }

    /// The class of each number that is unknown before walks. Where there is no light there are no scores.
    fn class_of(&self, runs: &[&HonestyRun]) -> Vec<Option<usize>> {
        let mean =
            |of: &dyn Fn(&HonestyRun) -> f64| runs.iter().map(|run| of(run)).sum::<f64>() / runs.len() as f64;
        let scores = |k: usize| {
            let [_, _, emittance, b, _] = self.of[k];
            let square = mean(&|run| (run.reported[k].mean.unwrap_or(emittance) - b).powi(2));
            let worth = if b > emittance { (b - emittance).powi(2) / square } else { 0.0 };
            worth.min(mean(&|run| run.reported[k].hits))
        };
        // A patch that no run has hit is worth 1, but for rounding.
        let class = |k: usize| CLASSES.iter().position(|&most| scores(k) <= most * (1.0 + 1e-9));
        (0..self.of.len()).map(|k| class(k).filter(|_| self.of[k][1] > 0.0)).collect()
    }

    /// Holds all that runs tell patch by patch against the truth.
    fn judge(&self, row: &mut MethodRow, runs: &[&HonestyRun]) {
        row.classes = self.classes(runs);
        row.irradiance = self.irradiance(runs);
        row.headline = self.headline(runs);
    }

    fn classes(&self, runs: &[&HonestyRun]) -> [PatchClass; 5] {
        let class_of = self.class_of(runs);
        std::array::from_fn(|class| {
            let members: Vec<usize> = (0..self.of.len()).filter(|&k| class_of[k] == Some(class)).collect();
            if members.is_empty() {
                return PatchClass::default();
            }
            let holds = |run: &&HonestyRun| {
                let inside = members.iter().filter(|&&k| {
                    let (b, ReportedRadiosity { low, high, .. }) = (self.of[k][3], run.reported[k]);
                    let slack = ROUNDING * b;
                    low - slack <= b && b <= high + slack
                });
                inside.count() as f64 / members.len() as f64
            };
            let each: Vec<f64> = runs.iter().map(holds).collect();
            let (mut widths, mut truths) = (0.0, 0.0);
            // Of each run the sums of the reported squared errors, and of squared errors.
            let mut squares = vec![[0.0; 2]; runs.len()];
            for &k in &members {
                let scale = self.of[k][3].max(f64::MIN_POSITIVE);
                let reported = || runs.iter().map(|run| run.reported[k]);
                let mut reported_widths: Vec<f64> =
                    reported().map(|reported| 0.5 * (reported.high - reported.low)).collect();
                reported_widths.sort_by(f64::total_cmp);
                widths += reported_widths[reported_widths.len() / 2] / scale;
                truths += self.error_within(k, runs, 0.95) / scale;
                for (reported, sums) in reported().zip(&mut squares) {
                    if let Some((std_error, mean)) = reported.std_error.zip(reported.mean) {
                        sums[0] += (std_error / scale).powi(2);
                        sums[1] += ((mean - self.of[k][3]) / scale).powi(2);
                    }
                }
            }
            // What is exact but for rounding has no error to compare with.
            let exact = truths <= ROUNDING * members.len() as f64;
            let (std_error, chance) = if exact { (f64::NAN, 0.0) } else { ratio_of_roots(&squares) };
            let width = if exact { f64::NAN } else { widths / truths };
            PatchClass { coverage: Some(Measured::of(&each)), width, std_error, chance }
        })
    }

    /// The error of B that a part of the runs do not exceed. What is unknown is taken for its own emittance.
    fn error_within(&self, k: usize, runs: &[&HonestyRun], part: f64) -> f64 {
        let [_, _, emittance, b, _] = self.of[k];
        not_exceeded(runs.iter().map(|run| run.reported[k].mean.unwrap_or(emittance) - b), part)
    }

    /// The error of H that a part of the runs do not exceed. What is unknown is taken for dark.
    fn irradiance_within(&self, k: usize, runs: &[&HonestyRun], part: f64) -> f64 {
        let [.., h] = self.of[k];
        not_exceeded(runs.iter().map(|run| run.reported[k].h.unwrap_or(0.0) - h), part)
    }

    fn irradiance(&self, runs: &[&HonestyRun]) -> Option<Measured> {
        let holds = |run: &&HonestyRun| {
            let (mut inside, mut all) = (0.0, 0.0);
            for (&[.., h], reported) in self.of.iter().zip(&run.reported) {
                let Some([low, high]) = reported.h_interval else { continue };
                let slack = ROUNDING * h;
                all += 1.0;
                inside += f64::from(u8::from(low - slack <= h && h <= high + slack));
            }
            (all > 0.0).then(|| inside / all)
        };
        let each: Vec<f64> = runs.iter().filter_map(holds).collect();
        (each.len() > 1).then(|| Measured::of(&each))
    }

    /// The headline's percentiles: reported by the median run, and true, by the errors of irradiance that 95 % of the runs keep within.
    /// Patches that no light reaches are left out, as the program reports them to be.
    fn headline(&self, runs: &[&HonestyRun]) -> Option<[ReportedAndTrue; 3]> {
        let reported = |place: &str| {
            let of = |run: &&HonestyRun| {
                run.summary.pointer(place).map(|value| value.as_f64().unwrap_or(f64::INFINITY))
            };
            let mut values: Vec<f64> = runs.iter().filter_map(of).collect();
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied()
        };
        // The floor is a number, in colour one for each channel.
        let floor = |c: usize| {
            let of = |run: &&HonestyRun| {
                let floor = run.summary.pointer("/headline/floor")?;
                floor.get(c).unwrap_or(floor).as_f64()
            };
            runs.iter().filter_map(of).sum::<f64>() / runs.len() as f64
        };
        let mut ranks: Vec<(f64, f64)> = Vec::new();
        for (face, numbers) in self.of.chunks(self.channels).enumerate() {
            let relative = |(c, &[.., h]): (usize, &[f64; 5])| {
                self.irradiance_within(face * self.channels + c, runs, 0.95) / h.max(floor(c))
            };
            if numbers.iter().any(|[.., h]| *h > 0.0) {
                ranks.push((numbers.iter().enumerate().map(relative).fold(0.0, f64::max), numbers[0][0]));
            }
        }
        ranks.sort_by(|a, b| a.0.total_cmp(&b.0));
        let total: f64 = ranks.iter().map(|(_, area)| area).sum();
        let at = |part: f64| {
            let mut below = 0.0;
            let reached = ranks.iter().find(|(_, area)| {
                below += area;
                below >= part * total * (1.0 - 1e-12)
            });
            reached.map_or(f64::NAN, |(error, _)| if *error <= ROUNDING { f64::NAN } else { *error })
        };
        Some([
            ReportedAndTrue { reported: reported("/headline/median")?, truth: at(0.5) },
            ReportedAndTrue { reported: reported("/headline/p90")?, truth: at(0.9) },
            ReportedAndTrue { reported: reported("/headline/worst")?, truth: at(1.0) },
        ])
    }

    /// The part of the lit area whose irradiance is truly within a relative error.
    fn part_within(&self, run: &HonestyRun, error: f64) -> f64 {
        let (mut within, mut area) = (0.0, 0.0);
        for (numbers, reported) in self.of.chunks(self.channels).zip(run.reported.chunks(self.channels)) {
            let is_within = |(&[.., h], reported): (&[f64; 5], &ReportedRadiosity)| {
                (reported.h.unwrap_or(0.0) - h).abs() <= error * h
            };
            if numbers.iter().any(|[.., h]| *h > 0.0) {
                area += numbers[0][0];
                within += if numbers.iter().zip(reported).all(is_within) { numbers[0][0] } else { 0.0 };
            }
        }
        within / area
    }
}

/// What a part of some errors do not exceed.
fn not_exceeded(errors: impl Iterator<Item = f64>, part: f64) -> f64 {
    let mut errors: Vec<f64> = errors.map(f64::abs).collect();
    errors.sort_by(f64::total_cmp);
    errors[((part * errors.len() as f64) as usize).min(errors.len() - 1)]
}

/// The root of a ratio of sums, and its relative standard error by the jackknife.
fn ratio_of_roots(sums: &[[f64; 2]]) -> (f64, f64) {
    let all = [0, 1].map(|k| sums.iter().map(|sums| sums[k]).sum::<f64>());
    let ratio = |without: [f64; 2]| ((all[0] - without[0]) / (all[1] - without[1])).sqrt();
    let (whole, n) = (ratio([0.0; 2]), sums.len() as f64);
    let squares: f64 = sums.iter().map(|&without| (ratio(without) / whole - 1.0).powi(2)).sum();
    (whole, (squares * (n - 1.0) / n).sqrt())
}

fn alarms(runs: &[&HonestyRun]) -> BTreeMap<String, f64> {
    let mut failed = BTreeMap::new();
    for run in runs {
        for check in run.summary["checks"].as_array().into_iter().flatten() {
            let is_wrong = check["verdict"] == "failed";
            *failed.entry(check["name"].as_str().unwrap_or_default().into()).or_default() +=
                f64::from(u8::from(is_wrong)) / runs.len() as f64;
        }
    }
    failed
}

/// Runs that ask for a total error a little below what shorter ones tell.
fn total_reached(
    site: &HonestyScene,
    method: &HonestyMethod,
    paths: u64,
    fine: &Fine,
    reported: Option<(ReportedAndTrue, f64)>,
) -> Result<Option<TotalReached>, Failure> {
    let Some((ReportedAndTrue { reported, .. }, _)) = reported else { return Ok(None) };
    let target = TOTAL_TARGET * reported;
    let more = [format!("target.total_error={target}")];
    let done = for_seeds(TOTAL_SEEDS, |seed| {
        let kept = method.run(site, 4 * paths, 3000 + seed, &more)?;
        let summary = serde_json::to_value(kept.summary("study"))?;
        let is_reached = summary.pointer("/accuracy/reached").is_some_and(|reached| reached == true);
        Ok(is_reached.then(|| total(&kept, &summary, fine)[2]))
    })?;
    let errors: Vec<f64> = done.into_iter().flatten().collect();
    let reached = errors.len() as f64;
    let square = errors.iter().map(|error| error * error).sum::<f64>() / reached;
    let variance = errors.iter().map(|error| (error * error - square).powi(2)).sum::<f64>() / (reached - 1.0);
    let truth = square.sqrt();
    Ok(Some(TotalReached {
        target,
        part: reached / TOTAL_SEEDS as f64,
        truth,
        // That of the mean square, to first order.
        std_error: (variance / reached).sqrt() / (2.0 * truth),
        most: errors.into_iter().fold(f64::NAN, f64::max),
    }))
}

/// Runs with a target.
fn reached(
    site: &HonestyScene,
    method: &HonestyMethod,
    paths: u64,
    patches: &TableFaces,
    runs: &[&HonestyRun],
) -> Result<Option<Reached>, Failure> {
    let Some([_, ninth, _]) = patches.headline(runs) else { return Ok(None) };
    if !ninth.reported.is_finite() || ninth.reported <= 0.0 {
        return Ok(None);
    }
    let error = (TARGET * ninth.reported).min(1.0);
    let more = [format!("target.relative_error={error}"), format!("target.fraction={FRACTION}")];
    let seeds = TARGET_SEEDS.min(method.seeds(site));
    let done = for_seeds(seeds, |seed| read(&method.run(site, 4 * paths, 1000 + seed, &more)?))?;
    let reached: Vec<f64> = done
        .iter()
        .filter(|run| run.summary.pointer("/target/reached").is_some_and(|reached| reached == true))
        .map(|run| patches.part_within(run, error))
        .collect();
    let within = reached.iter().sum::<f64>() / reached.len() as f64;
    let least = reached.iter().copied().fold(f64::INFINITY, f64::min);
    Ok(Some(Reached { error, part: reached.len() as f64 / seeds as f64, within, least }))
}
