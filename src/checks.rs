//! What is verified of every run, in words: after MCNP's ten statistical checks, adapted to what is known of walks.
//!
//! | MCNP asks of a tally | here |
//! |---|---|
//! | mean: no trend | `drift`: the walks since the look before agree with those up to it, over all patches |
//! | relative error below 0.1; decreasing; as 1/√N | `error`, `decay` (over the looks of the last half) |
//! | VOV below 0.1; decreasing; as 1/N | `vov`, from the first two moments and the geometric law of visits |
//! | FOM constant; without trend | `efficiency`: 1/(R²·rays); rays are counted, time would differ from machine to machine |
//! | slope of the largest scores above 3 | `tail`: visits fall off geometrically; the sample must stay within that law |

use cluster::checkpoint::{Book, Look};
use radiosity::{Counts, Estimate, Estimates, Experiment, Precision, Scene, Tally};
use report::Check;

use crate::fit::misfits;

/// Standard error over estimate, beyond which MCNP calls a tally questionable; the same number bounds the VOV.
const QUESTIONABLE: f64 = 0.1;

/// How far R·√N and the figure of merit may wander over the last half of a run. Fewer looks than two say nothing.
const STEADY: f64 = 1.5;

/// What fewer batches differ by is too rough to tell how errors fall.
const TELLING_BATCHES: u64 = 32;

/// The checks of a result: those of its statistics, and what its books say of its walks.
pub fn checks_of_result(
    estimates: &Estimates,
    note: Option<&str>,
    precision: &Precision,
    book: &Book,
) -> Vec<Check> {
    let paths_per_walk = estimates.experiment().paths_per_walk();
    let mut checks = checks(estimates, note, precision, &book.looks);
    checks.extend([gap(book, paths_per_walk), workers(book, paths_per_walk)]);
    checks
}

/// What waits beyond a gap is not in the result.
fn gap(book: &Book, paths_per_walk: u64) -> Check {
    let walks: u128 = book.islands.iter().map(|island| island.deliveries.walks()).sum();
    let message = match walks {
        0 => "no paths wait for others before them".into(),
        _ => format!(
            "{} paths that were walked are not in the result, since some before them are missing; they are kept in tally.bin for --resume",
            walks * u128::from(paths_per_walk)
        ),
    };
    check("gap", walks == 0, message)
}

/// A worker that sent what cannot be may have sent what is wrong before.
fn workers(book: &Book, paths_per_walk: u64) -> Check {
    let faulty = || book.workers.iter().filter(|worker| worker.faults > 0 && worker.walks > 0);
    let names: Vec<String> = faulty()
        .map(|worker| format!("{} ({} paths)", worker.name, worker.walks.saturating_mul(paths_per_walk)))
        .collect();
    let message = match names.len() {
        0 => "no worker with paths in the result sent any that cannot be".into(),
        _ => format!(
            "sent results that cannot be, and have others in this one: {}; hold them against `radwalk audit --share 1`",
            names.join(", ")
        ),
    };
    check("workers", names.is_empty(), message)
}

/// The outcome of every check of the statistics; `note` says what of the method was not done as asked.
pub fn checks(
    estimates: &Estimates,
    note: Option<&str>,
    precision: &Precision,
    looks: &[Look],
) -> Vec<Check> {
    let (experiment, tally) = (estimates.experiment(), estimates.tally());
    let scene = experiment.scene();
    let doubts = Doubts::new(estimates);
    let mut checks = vec![method(note), fit(experiment)];
    checks.extend(books(experiment, tally));
    checks.extend([escape(experiment, tally), bias(experiment, &doubts)]);
    checks.extend([unhit(precision), rare(&doubts), error(&doubts), vov(experiment, &doubts)]);
    checks.push(tail(experiment, tally));
    let telling = experiment.batch_paths().map_or(0, |_| TELLING_BATCHES);
    let half: Vec<&Look> = looks
        .iter()
        .filter(|look| look.walks >= telling.max(tally.counts.walks.div_ceil(2)))
        .filter(|look| look.rms_relative_error > 0.0)
        .collect();
    checks.extend([decay(&half), efficiency(&half), drift(scene, &half)]);
    checks
}

fn check(name: &str, ok: bool, message: String) -> Check {
    Check { name: name.into(), ok, message }
}

fn method(note: Option<&str>) -> Check {
    check("method", note.is_none(), note.unwrap_or("the method is the one asked for").into())
}

fn fit(experiment: &Experiment) -> Check {
    let misfits = misfits(experiment);
    let message =
        if misfits.is_empty() { "theory knows of no better method here".into() } else { misfits.join("; ") };
    check("fit", misfits.is_empty(), message)
}

/// Less than this part of the light leaves through a gap that nobody meant to leave; more than the other, and hardly
/// anything is left to be known.
const LEAK: f64 = 0.01;
const SPENT: f64 = 0.99;

/// What left the scene, by power: the last rays of infinite walks, and those of chains, may carry little.
fn escape(experiment: &Experiment, tally: &Tally) -> Check {
    let counts = tally.counts;
    let channels = 0..experiment.scene().channels();
    let weight = |c: usize| counts.escaped_weight[c] as f64 / Counts::WEIGHT_UNITS;
    let what = if experiment.gathers() { "importance" } else { "power" };
    let part = channels.map(weight).fold(0.0, f64::max) / counts.walks.max(1) as f64;
    let percent = 100.0 * part;
    match part {
        0.0 => check("escape", true, "nothing left the scene".into()),
        part if part < LEAK => check(
            "escape",
            false,
            format!(
                "{percent:.2e} % of the {what} left the scene: if it is meant to be closed, it has a gap"
            ),
        ),
        part if part > SPENT => check(
            "escape",
            false,
            format!(
                "{percent:.3} % of the {what} left the scene, and the rest has to tell all; give the scene a lamp that is smaller and nearer"
            ),
        ),
        _ => check("escape", true, format!("{percent:.1} % of the {what} left the scene")),
    }
}

/// Intervals hold what walks say; what was cut off is not in them.
fn bias(experiment: &Experiment, Doubts { bias, .. }: &Doubts) -> Check {
    if !experiment.is_biased() {
        return check("bias", true, "no walk was cut off".into());
    }
    let message = format!(
        "walks were cut off: radiosities may be up to {:.3} % higher (`bias_bound` in patches.csv), which intervals do not include; end = \"roulette\" has no bias",
        100.0 * bias
    );
    check("bias", false, message)
}

/// Whether every walk is accounted for, and none got behind a surface.
fn books(experiment: &Experiment, tally: &Tally) -> [Check; 2] {
    let counts = tally.counts;
    // The rays of a chain end one by one, as the walks of a batch do.
    let began = counts.walks.saturating_mul(experiment.paths_per_walk());
    let what = if experiment.chain_rays().is_some() { "rays" } else { "walks" };
    let ended = counts.absorbed + counts.absorbed_back + counts.escaped + counts.truncated;
    [
        check("energy", ended == began, format!("{began} {what} were emitted, {ended} absorbed or escaped")),
        check(
            "backs",
            counts.absorbed_back == 0,
            format!("{} {what} ended on the back of a one-sided surface", counts.absorbed_back),
        ),
    ]
}

fn unhit(Precision { unhit_patches: unhit, .. }: &Precision) -> Check {
    check("unhit", *unhit == 0, format!("{unhit} reflecting patches have no score: only bounds are known"))
}

/// How many estimates are open to doubt, and why.
#[derive(Default)]
struct Doubts {
    /// Patches with fewer than 10 scores.
    rare: usize,
    /// Estimates that walks had to find: of reflecting patches that were hit.
    found: usize,
    /// Of these: with a large standard error.
    rough: usize,
    /// Of these: with a large variance of the variance.
    volatile: usize,
    /// The largest bound on a bias, over the estimate.
    bias: f64,
}

impl Doubts {
    fn new(estimates: &Estimates) -> Self {
        let mut doubts = Doubts::default();
        for (i, patch, channels) in estimates.known() {
            doubts.rare += usize::from(channels.iter().any(Estimate::is_rare));
            let found = |(c, e): &(usize, &Estimate)| patch.reflectance[*c] > 0.0 && e.effective_scores > 0.0;
            for (c, estimate) in channels.iter().enumerate().filter(found) {
                let reflected = estimate.radiosity - patch.emittance[c];
                let is_rough = estimate.std_error.is_none_or(|error| error > QUESTIONABLE * reflected);
                doubts.found += 1;
                doubts.bias = doubts.bias.max(estimate.bias_bound / estimate.radiosity);
                doubts.rough += usize::from(is_rough);
                doubts.volatile += usize::from(variance_of_variance(estimates.tally(), i, c) > QUESTIONABLE);
            }
        }
        doubts
    }
}

fn rare(Doubts { rare, .. }: &Doubts) -> Check {
    let message =
        format!("{rare} patches have fewer than 10 scores: trust their intervals, not their values");
    check("rare", *rare == 0, message)
}

fn error(Doubts { found, rough, .. }: &Doubts) -> Check {
    let message = format!("{rough} of {found} estimates have a standard error above 10 % of themselves");
    check("error", *rough == 0, message)
}

/// Batches and chains differ like normal numbers, and their intervals allow for what few of them can tell (Student's t).
fn vov(experiment: &Experiment, Doubts { found, volatile, .. }: &Doubts) -> Check {
    if experiment.batch_paths().is_some() {
        let message = "the intervals of batches are Student's: they allow for the variance of the variance";
        return check("vov", true, message.into());
    }
    let message = format!("{volatile} of {found} estimates have a variance of the variance above 0.1");
    check("vov", *volatile == 0, message)
}

/// VOV = Σ(x − x̄)⁴/(Σ(x − x̄)²)² − 1/N. The walks that reach a patch visit it a geometric number of times, of mean m:
/// Σx²/Σx = 2m − 1, and Σx⁴/Σx = 24m³ − 36m² + 14m − 1. Central moments of scores that most walks miss are those about 0.
fn variance_of_variance(tally: &Tally, patch: usize, channel: usize) -> f64 {
    let sums = tally.patch(patch, channel);
    let size = sums[1] as f64 / sums[0] as f64;
    let unit = if tally.layout().events { size } else { 1.0 };
    let (hits, m) = (sums[0] as f64 / unit, 0.5 * (size / unit + 1.0));
    let fourth = 24.0 * m.powi(3) - 36.0 * m * m + 14.0 * m - 1.0;
    fourth / (hits * (2.0 * m - 1.0).powi(2))
}

/// Whether Σx²/Σx stays below what it can be at most, by more than 5 standard errors of about 1/√scores.
fn tail(experiment: &Experiment, tally: &Tally) -> Check {
    let patches = 0..experiment.scene().patches().len();
    let channels = experiment.scene().channels();
    let heavy = |&(patch, channel): &(usize, usize)| {
        let Some(meaning) = experiment.meaning(patch, channel, tally) else { return false };
        let sums = tally.patch(patch, channel);
        let (sum, squares) = (sums[0] as f64, sums[1] as f64);
        let scores = sum * (sum / squares);
        sum > 0.0 && meaning.unit * squares / sum > meaning.ratio_bound * (1.0 + 5.0 / scores.sqrt())
    };
    let heavy = patches.flat_map(|patch| (0..channels).map(move |c| (patch, c))).filter(heavy).count();
    let limit = match experiment.batch_paths() {
        Some(_) => "batches can make (all light that is under way)",
        None => "walks can make (visits fall off geometrically)",
    };
    check("tail", heavy == 0, format!("{heavy} patches have larger scores than {limit}"))
}

/// The largest of some values over the least.
fn spread(values: impl Iterator<Item = f64> + Clone) -> f64 {
    values.clone().fold(0.0, f64::max) / values.fold(f64::INFINITY, f64::min)
}

fn decay(half: &[&Look]) -> Check {
    let scaled = half.iter().map(|look| look.rms_relative_error * (look.walks as f64).sqrt());
    let falls = half.is_sorted_by(|a, b| a.rms_relative_error >= b.rms_relative_error);
    let spread = if half.len() < 2 { 1.0 } else { spread(scaled) };
    check(
        "decay",
        falls && spread < STEADY,
        format!(
            "over the last {} looks the error {} and error·√paths varied by a factor of {spread:.2}",
            half.len(),
            if falls { "fell" } else { "rose" }
        ),
    )
}

fn efficiency(half: &[&Look]) -> Check {
    let merits = half.iter().map(|look| 1.0 / (look.rms_relative_error.powi(2) * look.rays as f64));
    let spread = if half.len() < 2 { 1.0 } else { spread(merits) };
    check(
        "efficiency",
        spread < STEADY * STEADY,
        format!("the figure of merit 1/(error²·rays) varied by a factor of {spread:.2} over the last looks"),
    )
}

/// χ² of n differences over n has the standard deviation √(2/n). Differences of patches depend on each other; 5 standard
/// deviations of 100 at most leave room for that.
fn drift(scene: &Scene, half: &[&Look]) -> Check {
    let Some(last) = half.last().filter(|look| look.drift.is_finite()) else {
        return check("drift", true, "too few looks to compare halves of the run".into());
    };
    let independent = scene.patches().len().min(100) as f64;
    check(
        "drift",
        last.drift < 1.0 + 5.0 * (2.0 / independent).sqrt(),
        format!(
            "mean squared difference between halves of the run, over its variance: {:.3} (1 is perfect)",
            last.drift
        ),
    )
}
