//! The checks of every run, in words: after MCNP's ten statistical checks, adapted to what is known of walks.
//!
//! | MCNP asks of a tally | here |
//! |---|---|
//! | mean: no trend | `drift`: the walks since the look before agree with those up to it, on every patch |
//! | relative error below 0.1; decreasing; as 1/√N | `error`, `decay` (over the looks of the last half) |
//! | VOV below 0.1; decreasing; as 1/N | `vov`, from the first two moments and the geometric law of visits |
//! | FOM constant; without trend | `efficiency`: 1/(R²·rays); rays are counted, time would differ from machine to machine |
//! | slope of the largest scores above 3 | `tail`: visits fall off geometrically; the sample must stay within that law |

use std::collections::HashMap;

use job::Forecast;
use protocol::{Book, Look};
use radiosity::{
    Counts, Estimate, Estimates, Experiment, Method, Scene, Sequence, Side, Tally,
    precision::{FaceShare, Precision, Quantity, TINY},
    sensors::Readings,
    surfaces::Face,
};
use report::words::share;
use report::{Check, Verdict, face_words};

use crate::coincident::Coincident;
use crate::drift::FALSE_ALARM;
use crate::fit::misfits;
use crate::resolution::{resolution, resolution_of_fits};
use crate::target::FEWEST_SAMPLES;

/// The relative standard error beyond which MCNP calls a tally questionable; the same number bounds the VOV.
const QUESTIONABLE: f64 = 0.1;

/// The most factor by which R·√N and the figure of merit may vary over the last half of a run. A single look says
/// nothing.
const STEADY: f64 = 1.5;

/// The fewest batches at which a look counts: the spread of fewer is too rough to tell how errors fall.
const TELLING_BATCHES: u64 = 32;

/// All checks of a result: those of its statistics, and those of its book. `chosen`: what was predicted of its patches, where a pilot
/// chose them.
pub fn checks_of_result(
    estimates: &Estimates,
    note: Option<&str>,
    precision: &Precision,
    book: &Book,
    (seed, chosen): (u64, Option<&Forecast>),
) -> Vec<Check> {
    let paths_per_walk = estimates.experiment().unit().paths();
    let mut checks = match estimates.experiment().mixture() {
        None => checks(estimates, note, precision, &book.looks),
        Some(_) => checks_of_mixture(estimates, precision),
    };
    if let Some(chosen) = chosen.filter(|chosen| chosen.linear)
        && let Some(of_means) = checks.iter_mut().find(|check| check.name == "resolution")
    {
        let (verdict, message) = resolution_of_fits(estimates, chosen);
        *of_means = check("resolution", verdict, message);
    }
    checks.extend(reciprocity(estimates.experiment(), seed));
    checks.extend([gap(book, paths_per_walk), workers(book, paths_per_walk)]);
    checks
}

/// The checks of a mixture of sources: how well its patches are known. What became of walks, and how errors fell, was checked
/// of the run that walked them.
fn checks_of_mixture(estimates: &Estimates, precision: &Precision) -> Vec<Check> {
    let (scene, doubts) = (estimates.scene(), Doubts::new(estimates, precision.headline.quantity));
    let mut checks = books(estimates.experiment(), estimates.tally()).to_vec();
    checks.extend([buried(scene), bias(estimates.experiment(), &doubts)]);
    checks.extend([unhit(scene, precision), rare(scene, &doubts), error(scene, &doubts)]);
    checks
}

/// The limits beyond which faces do not see each other both ways: on one face's difference in standard errors, and on
/// the mean square of all. Rays along Sobol sequences differ by less than random ones, and random ones never by this
/// much.
const ONE_WAY: f64 = 8.0;
const ONE_WAY_IN_THE_MEAN: f64 = 1.5;

/// Checks that what leaves and what reaches a patch agree, since chains use their counts in both directions. `None` if
/// the method has no chains.
fn reciprocity(experiment: &Experiment, seed: u64) -> Option<Check> {
    let found = experiment.reciprocity(&Sequence::new(seed))?;
    let ok = found.worst < ONE_WAY && found.mean_squared_z < ONE_WAY_IN_THE_MEAN;
    let place = found.worst_face.map_or(String::new(), |face| {
        format!(
            ", {:.1} standard errors at most ({})",
            found.worst,
            face_words(experiment.scene(), face as usize)
        )
    });
    let message = format!(
        "the power that leaves {} patches and the power that arrives there differ by {:.2} of their variance in the mean{place}",
        found.faces, found.mean_squared_z
    );
    let remedy = "; chains assume that these agree: do not trust this result, use walks, and report this fault of the program";
    Some(check("reciprocity", ok, if ok { message } else { message + remedy }))
}

/// Checks whether walks wait beyond a gap, which are not in the result.
fn gap(book: &Book, paths_per_walk: u64) -> Check {
    let walks: u128 = book.out_of_order.iter().map(|range| range.deliveries.walks()).sum();
    let message = match walks {
        0 => "no paths wait for others before them".into(),
        _ => format!(
            "{} paths that were walked are not in the result, since some before them are missing; they are kept in tally.bin for --resume",
            walks * u128::from(paths_per_walk)
        ),
    };
    check("gap", walks == 0, message)
}

/// Checks for workers that sent an impossible result: their other results may be wrong, too.
fn workers(book: &Book, paths_per_walk: u64) -> Check {
    // The results of workers behind a relay came over its connection.
    let mut over: HashMap<&str, u64> = HashMap::new();
    for worker in &book.workers {
        let walks = over.entry(worker.peer()).or_default();
        *walks = walks.saturating_add(worker.walks);
    }
    let faulty = book.workers.iter().filter(|worker| worker.faults > 0);
    let names: Vec<String> = faulty
        .map(|worker| (&worker.name, over.get(&worker.name[..]).copied().unwrap_or(0)))
        .filter(|&(_, walks)| walks > 0)
        .map(|(name, walks)| format!("{name} ({} paths)", walks.saturating_mul(paths_per_walk)))
        .collect();
    let message = match names.len() {
        0 => "no worker with paths in the result sent an impossible result".into(),
        _ => format!(
            "these workers sent impossible results, and others of theirs are in this result: {}; check them with `radwalk audit --share 1`",
            names.join(", ")
        ),
    };
    check("workers", names.is_empty(), message)
}

/// The checks of the statistics; `note` says which part of the method was not done as asked.
pub fn checks(
    estimates: &Estimates,
    note: Option<&str>,
    precision: &Precision,
    looks: &[Look],
) -> Vec<Check> {
    let (experiment, tally) = (estimates.experiment(), estimates.tally());
    let scene = experiment.scene();
    let doubts = Doubts::new(estimates, precision.headline.quantity);
    let mut checks = vec![method(note), fit(experiment)];
    checks.extend(books(experiment, tally));
    checks.extend([buried(scene), escape(experiment, tally), bias(experiment, &doubts)]);
    checks.extend([unhit(scene, precision), rare(scene, &doubts)]);
    checks.extend([error(scene, &doubts), vov(experiment, &doubts)]);
    checks.push(tail(experiment, tally));
    let (verdict, message) = resolution(estimates);
    checks.push(check("resolution", verdict, message));
    checks.extend(sensors(experiment, tally));
    let telling = experiment.unit().batch().map_or(0, |_| TELLING_BATCHES);
    let half: Vec<&Look> =
        looks.iter().filter(|look| look.walks >= telling.max(tally.counts.walks.div_ceil(2))).collect();
    let drift = drift(&half);
    // Errors fall where there are any.
    let has_error = |look: &&Look| look.median_relative_error > 0.0 && look.median_relative_error.is_finite();
    let half: Vec<&Look> = half.into_iter().filter(has_error).collect();
    checks.extend([decay(&half), efficiency(&half), drift]);
    checks
}

fn check(name: &str, verdict: impl Into<Verdict>, message: String) -> Check {
    Check { name: name.into(), verdict: verdict.into(), message }
}

fn method(note: Option<&str>) -> Check {
    check("method", note.is_none(), note.unwrap_or("the method is the one asked for").into())
}

fn fit(experiment: &Experiment) -> Check {
    let misfits = misfits(experiment);
    let message =
        if misfits.is_empty() { "theory predicts no better method here".into() } else { misfits.join("; ") };
    check("fit", misfits.is_empty(), message)
}

/// Checks for light that is emitted under another surface, where it is never seen.
fn buried(scene: &Scene) -> Check {
    let part = Coincident::of(scene).buried_power();
    let message = match part {
        0.0 => "no emitter is covered by another surface".into(),
        _ => format!(
            "{:.3} % of the light is emitted under another surface, and never seen; `radwalk check` names them",
            100.0 * part
        ),
    };
    check("buried", part == 0.0, message)
}

/// The bounds of the part of the light that escapes: below the first, the gap is probably a mistake; above the second,
/// hardly any light is left to estimate from.
const LEAK: f64 = 0.01;
const SPENT: f64 = 0.99;

/// Where this part of the light escapes by chains of which each lost fewer rays than this, how much is lost rests on few rays: light is that over what is lost, so
/// that chains without such rays are far too bright, and their mean too (docs/results/intervals.md).
const LOST: f64 = 0.1;
const LOST_RAYS: u64 = 32;

/// Checks the power that left the scene, all channels together, as the page shows it. Power counts, not rays: the last rays of infinite walks and of chains may
/// carry little.
fn escape(experiment: &Experiment, tally: &Tally) -> Check {
    let counts = tally.counts;
    let what = if experiment.gathers() { "importance" } else { "power" };
    let what = if experiment.scene().channels() > 1 {
        format!("{what}, all channels together,")
    } else {
        what.into()
    };
    let part = experiment.lost(&counts).escaped.value;
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
        _ if counts.escaped >= counts.rays && lamps_face_away(experiment.scene()) => check(
            "escape",
            false,
            "all of the power left the scene at once: its lamps face away from it; turn them round (`radwalk check --repair` does), or write sides = 2, so that both sides are active".into(),
        ),
        part if part > SPENT => check(
            "escape",
            false,
            format!(
                "{} of the {what} left the scene, and only the rest is left to estimate from; give the scene a lamp that is smaller and nearer, or turn one round that faces away from it (`radwalk check` names them)",
                share(part)
            ),
        ),
        part if is_lost_by_few(experiment, &counts, part) => check(
            "escape",
            false,
            format!(
                "{} of the {what} left the scene by {} rays of {} chains: so few tell too little of how much is lost, and chains are too bright for it; give more paths, or walk = \"shooting\"",
                share(part),
                counts.escaped,
                counts.walks
            ),
        ),
        _ => check("escape", true, format!("{} of the {what} left the scene", share(part))),
    }
}

/// Whether much of the light leaves by few rays of chains.
fn is_lost_by_few(experiment: &Experiment, counts: &Counts, part: f64) -> bool {
    let is_chains = matches!(experiment.method(), Method::Chains(_));
    is_chains && part > LOST && counts.escaped < LOST_RAYS * counts.walks
}

/// The most emitting faces whose direction is examined.
const LAMPS: usize = 64;

/// Whether no lamp has any of the scene in front of it: its light cannot come back, however many walks there are. A
/// lamp far away has the scene in front of it.
fn lamps_face_away(scene: &Scene) -> bool {
    let has_scene_in_front = |face: Face| {
        let lamp = &scene.surfaces()[face.surface as usize];
        let outwards = if face.side == Side::Front { lamp.normal() } else { -lamp.normal() };
        let corner = lamp.outline().into_iter().next().expect("surfaces have corners");
        let corners = || scene.surfaces().iter().flat_map(|surface| surface.outline());
        let extent = corners().map(|point| (point - corner).length()).fold(0.0, f64::max);
        corners().any(|point| (point - corner).dot(outwards) > 1e-9 * extent)
    };
    let lamps = || scene.faces().iter().filter(|face| face.emittance.is_lit()).take(LAMPS);
    scene.lamp_count() == 0 && !lamps().any(has_scene_in_front)
}

/// Checks for walks that were cut off: estimates lack the light that these would have carried, which the upper ends of intervals allow for.
fn bias(experiment: &Experiment, Doubts { bias, .. }: &Doubts) -> Check {
    if !experiment.is_biased() {
        return check("bias", true, "no walk was cut off".into());
    }
    let message = format!(
        "walks were cut off: radiosities may be up to {:.3} % higher (`bias_bound` in patches.csv), which the upper ends of intervals include; end = \"roulette\" has no bias",
        100.0 * bias
    );
    check("bias", false, message)
}

/// Checks that every walk is accounted for, and that none got behind a surface.
fn books(experiment: &Experiment, tally: &Tally) -> [Check; 2] {
    let counts = tally.counts;
    // The rays of a chain end one by one, as the walks of a batch do.
    let began = counts.walks.saturating_mul(experiment.unit().paths());
    let what = if experiment.unit().is_chain() { "rays" } else { "walks" };
    let ended = counts.absorbed + counts.absorbed_back + counts.escaped + counts.truncated;
    [
        check("energy", ended == began, format!("{began} {what} were emitted, {ended} absorbed or escaped")),
        check(
            "backs",
            counts.absorbed_back == 0,
            match counts.absorbed_back {
                0 => format!("0 {what} ended on the back of a one-sided surface"),
                some => format!(
                    "{some} {what} ended on the back of a one-sided surface, with {} of the {}; `radwalk check --fix-report` names the surfaces, `--repair` turns flipped ones round, and with sides = 2 both sides are active",
                    share(experiment.lost(&counts).on_backs.value),
                    if experiment.gathers() { "importance" } else { "power" }
                ),
            },
        ),
    ]
}

/// The most faces of a scene that a person has laid out, where each face matters; in a larger mesh areas do.
const LAID_OUT: usize = 1000;

/// The least part of a mesh's area that is worth a warning.
const WORTH_A_WORD: f64 = 1e-3;

/// Whether doubtful faces deserve a person's attention.
fn matters(scene: &Scene, doubtful: FaceShare) -> bool {
    doubtful.area > WORTH_A_WORD || (doubtful.faces > 0 && scene.faces().len() <= LAID_OUT)
}

/// The number and area of some faces, in words.
fn faces(FaceShare { faces, area }: FaceShare) -> String {
    let noun = if faces == 1 { "patch" } else { "patches" };
    format!("{faces} {noun} ({:.2} % of the area)", 100.0 * area)
}

fn unhit(scene: &Scene, Precision { unhit, headline, .. }: &Precision) -> Check {
    let all: f64 = scene.faces().iter().map(|face| face.area).sum();
    let sealed = match headline.sealed_area {
        0.0 => String::new(),
        area => format!("; {:.2} % of the area is sealed, where no path of light leads", 100.0 * area / all),
    };
    check("unhit", !matters(scene, *unhit), without_score(*unhit) + &sealed)
}

/// What the check of faces without scores says.
fn without_score(unhit: FaceShare) -> String {
    if unhit.faces == 0 {
        return "every patch that light can come to has a score".into();
    }
    let has = if unhit.faces == 1 { "has" } else { "have" };
    format!(
        "{} {has} no score, and light may come there: only bounds are known; it takes more walks",
        faces(unhit)
    )
}

/// The estimates of the judged quantity that are open to doubt, by reason. Tiny faces of large scenes are left out, and so are faces without
/// scores.
#[derive(Default)]
struct Doubts {
    /// The faces with some scores, but fewer than 10.
    rare: FaceShare,
    /// The faces with a large standard error.
    rough: FaceShare,
    /// The faces with a large variance of the variance.
    volatile: FaceShare,
    /// The largest bound on a bias, as a part of the estimate.
    bias: f64,
}

impl Doubts {
    fn new(estimates: &Estimates, quantity: Quantity) -> Self {
        let mut doubts = Doubts::default();
        let scene = estimates.scene();
        let total: f64 = scene.faces().iter().map(|face| face.area).sum();
        let keeps = |area: f64| area >= TINY * total || scene.faces().len() <= LAID_OUT;
        for (i, face, channels) in estimates.known().filter(|(_, face, _)| keeps(face.area)) {
            let part = face.area / total;
            let found =
                |(c, e): &(usize, &Estimate)| e.effective_scores > 0.0 && quantity.of(&face, *c, e).is_some();
            let any = |holds: &dyn Fn(usize, &Estimate) -> bool| {
                channels.iter().enumerate().filter(found).any(|(c, estimate)| holds(c, estimate))
            };
            let is_rough = |_: usize, e: &Estimate| {
                let known = e.irradiance.zip(e.irradiance_error);
                known.is_none_or(|(irradiance, error)| error > QUESTIONABLE * irradiance)
            };
            let is_volatile =
                |c: usize, _: &Estimate| variance_of_variance(estimates.tally(), i, c) > QUESTIONABLE;
            for (doubt, holds) in [
                (&mut doubts.rare, any(&|_, estimate| estimate.is_rare())),
                (&mut doubts.rough, any(&is_rough)),
                (&mut doubts.volatile, any(&is_volatile)),
            ] {
                if holds {
                    doubt.add(part);
                }
            }
            let bias = channels.iter().filter(|e| e.radiosity > 0.0).map(|e| e.bias_bound / e.radiosity);
            doubts.bias = bias.fold(doubts.bias, f64::max);
        }
        doubts
    }
}

fn rare(scene: &Scene, Doubts { rare, .. }: &Doubts) -> Check {
    let message = format!("{}: fewer than 10 scores; trust the intervals, not the values", faces(*rare));
    check("rare", !matters(scene, *rare), message)
}

fn error(scene: &Scene, Doubts { rough, .. }: &Doubts) -> Check {
    let message = format!("{}: a standard error of the irradiance above 10 % of the estimate", faces(*rough));
    check("error", !matters(scene, *rough), message)
}

/// Checks the variance of the variance. Batches and chains differ like normal numbers, and their intervals allow for
/// what few of them can tell (Student's t).
fn vov(experiment: &Experiment, Doubts { volatile, .. }: &Doubts) -> Check {
    if !experiment.unit().is_walk() {
        let message = "the intervals of batches are Student's: they allow for the variance of the variance";
        return check("vov", Verdict::NotExamined, message.into());
    }
    let message = format!("{}: a variance of the variance above 0.1", faces(*volatile));
    check("vov", !matters(experiment.scene(), *volatile), message)
}

/// The variance of the variance: VOV = Σ(x − x̄)⁴/(Σ(x − x̄)²)² − 1/N over scores x of N walks. The walks that reach a
/// patch visit it a geometric number of times with mean m: Σx²/Σx = 2m − 1, and Σx⁴/Σx = 24m³ − 36m² + 14m − 1. If most
/// walks miss the patch, central moments equal those about 0.
fn variance_of_variance(tally: &Tally, patch: usize, channel: usize) -> f64 {
    let sums = tally.patch(patch, channel);
    let size = sums[1] as f64 / sums[0] as f64;
    let unit = if tally.layout().events { size } else { 1.0 };
    let (hits, m) = (sums[0] as f64 / unit, 0.5 * (size / unit + 1.0));
    let fourth = 24.0 * m.powi(3) - 36.0 * m * m + 14.0 * m - 1.0;
    fourth / (hits * (2.0 * m - 1.0).powi(2))
}

/// Checks that Σx²/Σx is not above its bound by more than 5 standard errors of about 1/√scores.
fn tail(experiment: &Experiment, tally: &Tally) -> Check {
    let patches = 0..experiment.scene().faces().len();
    let channels = experiment.scene().channels();
    let heavy = |&(patch, channel): &(usize, usize)| {
        let Some(meaning) = experiment.meaning(patch, channel, tally) else { return false };
        let sums = tally.patch(patch, channel);
        let (sum, squares) = (sums[0] as f64, sums[1] as f64);
        let scores = sum * (sum / squares);
        sum > 0.0 && meaning.unit * squares / sum > meaning.ratio_bound * (1.0 + 5.0 / scores.sqrt())
    };
    let heavy = patches.flat_map(|patch| (0..channels).map(move |c| (patch, c))).filter(heavy).count();
    let limit = match experiment.unit().batch() {
        Some(_) => "batches can make (all light that is under way)",
        None => "walks can make (visits fall off geometrically)",
    };
    check("tail", heavy == 0, format!("{heavy} estimates have larger scores than {limit}"))
}

/// Checks that sensors have samples enough; `None` if there are no sensors.
fn sensors(experiment: &Experiment, tally: &Tally) -> Option<Check> {
    let samples = Readings::new(experiment, tally, 0.5)?.samples();
    let ok = samples >= FEWEST_SAMPLES;
    let message = format!("the intervals of sensors come from {samples} samples");
    let remedy = match experiment.sensors().filter(|_| experiment.unit().is_walk()) {
        Some(sensors) => format!(
            ", fewer than {FEWEST_SAMPLES}: give {} walks or more",
            FEWEST_SAMPLES * sensors.sample_walks()
        ),
        None => format!(", fewer than {FEWEST_SAMPLES}: give more paths"),
    };
    Some(check("sensors", ok, if ok { message } else { message + &remedy }))
}

/// What is said of errors over a run that was looked at once.
const TOO_FEW_LOOKS: &str = "too few looks to tell how errors fell over the last half of the run";

/// The largest of some values, divided by the least.
fn spread(values: impl Iterator<Item = f64> + Clone) -> f64 {
    values.clone().fold(0.0, f64::max) / values.fold(f64::INFINITY, f64::min)
}

fn decay(half: &[&Look]) -> Check {
    let scaled = half.iter().map(|look| look.median_relative_error * (look.walks as f64).sqrt());
    let falls = half.is_sorted_by(|a, b| a.median_relative_error >= b.median_relative_error);
    if half.len() < 2 {
        return check("decay", Verdict::NotExamined, TOO_FEW_LOOKS.into());
    }
    let spread = spread(scaled);
    check(
        "decay",
        falls && spread < STEADY,
        format!(
            "over the last {} looks the error that half of the area keeps within {} and error·√paths varied by a factor of {spread:.2}",
            half.len(),
            if falls { "fell" } else { "rose" }
        ),
    )
}

fn efficiency(half: &[&Look]) -> Check {
    let merits = half.iter().map(|look| 1.0 / (look.median_relative_error.powi(2) * look.rays as f64));
    if half.len() < 2 {
        return check("efficiency", Verdict::NotExamined, TOO_FEW_LOOKS.into());
    }
    let spread = spread(merits);
    check(
        "efficiency",
        spread < STEADY * STEADY,
        format!("the figure of merit 1/(error²·rays) varied by a factor of {spread:.2} over the last looks"),
    )
}

/// Checks that the walks since the look before the last agree with those up to it.
fn drift(half: &[&Look]) -> Check {
    // Right after a resume there may be too few walks to compare.
    let Some(last) = half.iter().rfind(|look| look.drift.is_finite()) else {
        return check("drift", Verdict::NotExamined, "too few looks to compare parts of the run".into());
    };
    check(
        "drift",
        last.drift >= FALSE_ALARM,
        format!(
            "probability that the last walks and those before them differ as much by chance, which fails below {FALSE_ALARM}, at most: {:.2e}",
            last.drift
        ),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_patch_without_scores_is_in_the_singular() {
        let text = |faces| without_score(FaceShare { faces, area: 0.5 });
        assert!(text(1).starts_with("1 patch (50.00 % of the area) has no score"), "{}", text(1));
        assert!(text(0).starts_with("every patch"), "{}", text(0));
        assert!(text(2).contains("2 patches (50.00 % of the area) have no score"), "{}", text(2));
    }
}
