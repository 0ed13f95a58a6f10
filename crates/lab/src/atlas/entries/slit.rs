//! Entry of the atlas: two rooms through a slit, with rare events and intervals that look converged and are not.

use exact::Exact;
use job::{Target, Unhit};
use radiosity::{Estimate, EstimatorKind, Experiment, Method, Solution, precision::Quantity};
use report::{Axis, Chart, Series};
use stats::Measured;

use crate::arithmetic::proportion;
use crate::atlas::entry::{Entry, StudyFinding};
use crate::claim::Claim;
use crate::judged_run::{JudgedRun, run};
use crate::lab::Lab;
use crate::series::SweepCurve;
use crate::walking::{Failure, covered, estimate, experiment, receivers, solve};
use report::words::{measured, number};

pub(crate) const ENTRY: Entry = Entry {
    name: "slit",
    title: "Two rooms through a slit: intervals that look converged and are not",
    study,
};

/// The quantile of 95 % intervals.
const Z: f64 = 1.96;

/// Whether B ± 1.96 standard errors holds the truth; after no hit it is E ± 0.
fn normal_holds(estimate: &Estimate, truth: f64) -> bool {
    let error = estimate.std_error.unwrap_or(0.0);
    (estimate.radiosity - truth).abs() <= Z * error
}

fn normal_coverage(solution: &Solution, patches: &[usize], truth: &[f64]) -> f64 {
    let holds = |&&i: &&usize| normal_holds(&estimate(solution, i), truth[i]);
    patches.iter().filter(holds).count() as f64 / patches.len() as f64
}

/// The probability that k ± 1.96√k holds the mean of the Poisson count k.
fn poisson_coverage(mean: f64) -> f64 {
    let (mut probability, mut sum) = ((-mean).exp(), 0.0);
    for k in 0..(mean + 20.0 * mean.sqrt() + 20.0) as u64 {
        let count = k as f64;
        if (count - mean).abs() <= Z * count.sqrt() {
            sum += probability;
        }
        probability *= mean / (count + 1.0);
    }
    sum
}

struct Rooms {
    experiment: Experiment,
    truth: Vec<f64>,
    /// The receivers of the room without a lamp.
    dark: Vec<usize>,
    /// The hits that each of them expects per walk.
    rates: Vec<f64>,
}

impl Rooms {
    fn new() -> Result<Self, Failure> {
        let spec = scenes::two_rooms(0.1, 0.5);
        let exact = Exact::of_scene(&spec)?;
        let experiment = experiment(&spec, Method::shooting(EstimatorKind::Collision))?;
        let is_dark = |&i: &usize| experiment.scene().faces().get(i).centroid.x > 1.01;
        let dark: Vec<usize> = receivers(&experiment).into_iter().filter(is_dark).collect();
        let rate = |&i: &usize| exact.solution().incoming[i] / exact.total_power();
        let rates = dark.iter().map(rate).collect();
        Ok(Rooms { truth: exact.solution().radiosity.clone(), experiment, dark, rates })
    }

    fn mean_rate(&self) -> f64 {
        self.rates.iter().sum::<f64>() / self.rates.len() as f64
    }
}

/// The sweep over expected hits of a patch.
struct SlitSweep {
    hits: Vec<f64>,
    /// The coverage of the usual intervals: of Poisson counts in theory, and as measured.
    normal: SweepCurve,
    /// The coverage of radwalk's intervals.
    ours: Vec<(f64, Measured)>,
    claims: Vec<Claim>,
}

impl SlitSweep {
    fn drive(lab: &Lab, rooms: &Rooms) -> Self {
        let hits = lab.pick(vec![0.3, 3.0], vec![0.1, 0.3, 1.0, 3.0, 10.0, 30.0]);
        let runs = lab.pick(100, 300);
        let mut sweep = SlitSweep { hits, normal: SweepCurve::new(), ours: Vec::new(), claims: Vec::new() };
        for &hits in &sweep.hits {
            let walks = (hits / rooms.mean_rate()) as u64;
            let found = lab.each_seed(runs, |seed| {
                let solution = solve(&rooms.experiment, seed, walks);
                [
                    normal_coverage(&solution, &rooms.dark, &rooms.truth),
                    covered(&solution, &rooms.dark, &rooms.truth),
                ]
            });
            let of = |k: usize| proportion(&found.iter().map(|both| both[k]).collect::<Vec<_>>());
            let expected = rooms.rates.iter().map(|rate| poisson_coverage(rate * walks as f64)).sum::<f64>();
            sweep.normal.push(hits, expected / rooms.rates.len() as f64, of(0));
            sweep.ours.push((hits, of(1)));
            let what = format!("{hits} hits a patch: coverage of radwalk's intervals");
            sweep.claims.push(Claim::at_least(what, of(1), 0.95));
        }
        let what = "coverage of ± 1.96 standard errors at the fewest hits";
        sweep.claims.push(Claim::below(what, sweep.normal.seen_at(0), 0.5));
        sweep
    }

    fn chart(self) -> Chart {
        let [line, normal] = self.normal.series("k ± 1.96√k, Poisson counts", "± 1.96 standard errors");
        Chart {
            title: "Patches of the room behind the hole".into(),
            x: Axis::log("expected hits of a patch"),
            y: Axis::linear("part of the 95 % intervals that hold the truth"),
            series: vec![
                line,
                normal,
                Series::measured("radwalk", self.ours),
                Series::theory("95 %", self.hits.iter().map(|&hits| (hits, 0.95))),
            ],
        }
    }
}

/// Runs that a target ends: the coverage of their intervals, the part that reach it, and their walks.
fn stopped(lab: &Lab, rooms: &Rooms) -> [Measured; 3] {
    let target = Target {
        relative_error: 0.5,
        fraction: 1.0,
        min_paths: 1,
        min_hits: 10,
        unhit: Unhit::Infinite,
        patches: None,
        quantity: Quantity::Irradiance,
    };
    let most = (3000.0 / rooms.mean_rate()) as u64;
    let stopped = lab.each_seed(lab.pick(16, 60), |seed| {
        let run = run(&rooms.experiment, seed, most, Some(target.clone()));
        let covers = covered(&run.solution, &rooms.dark, &rooms.truth);
        [covers, f64::from(run.reached), run.tally.counts.walks as f64]
    });
    [0, 1, 2].map(|k: usize| proportion(&stopped.iter().map(|run| run[k]).collect::<Vec<_>>()))
}

fn study(lab: &Lab) -> Result<StudyFinding, Failure> {
    let rooms = Rooms::new()?;
    let sweep = SlitSweep::drive(lab, &rooms);
    let mut claims = sweep.claims.clone();
    let (few, messages) = silence(lab, &rooms, 3.0 / rooms.mean_rate(), &mut claims);
    let [remedy, reached, taken] = stopped(lab, &rooms);
    claims.push(Claim::at_least("coverage where a target ends the run", remedy, 0.95).instead());
    claims.push(Claim::equal("runs that reach the target", reached, 1.0).instead());
    Ok(StudyFinding {
        predicted: "Light in the second room is a matter of the few walks that find the hole, 1 % of the wall: hits of \
                    a patch there are about a Poisson count k. Before the first of them B̂ = E, with an error of 0; \
                    after a few the usual k ± 1.96√k covers far less than 95 %. The line is that of Poisson counts."
            .into(),
        seen: format!(
            "Intervals of ± 1.96 standard errors cover {} at {} hits a patch and {} at {}; radwalk's cover {} and {}.",
            measured(sweep.normal.seen_at(0)),
            sweep.hits[0],
            measured(sweep.normal.seen_at(1)),
            sweep.hits[1],
            measured(sweep.ours[0].1),
            measured(sweep.ours[1].1)
        ),
        messages,
        instead: format!(
            "Trust the interval, not the value, of what is flagged `rare`; or set a target: with target.relative_error = 0.5 \
             and target.fraction = 1 (10 scores a patch at least) runs end after {} walks instead of {few:.0}, and their \
             intervals cover {}.",
            number(taken.value),
            measured(remedy)
        ),
        claims,
        chart: sweep.chart(),
    })
}

/// Whether some check fails in every run in which the usual interval misses; and the words of one run.
fn silence(lab: &Lab, rooms: &Rooms, walks: f64, claims: &mut Vec<Claim>) -> (f64, Vec<String>) {
    let word = |run: &JudgedRun| run.fails("unhit") || run.fails("rare") || run.fails("vov");
    let heard = lab.each_seed(lab.pick(30, 200), |seed| {
        let run = run(&rooms.experiment, seed, walks as u64, None);
        let misses = |&i: &usize| !normal_holds(&estimate(&run.solution, i), rooms.truth[i]);
        let silent = rooms.dark.iter().any(misses) && !word(&run);
        (silent, run)
    });
    let silent = heard.iter().filter(|(silent, _)| *silent).count();
    let what = format!("{silent} of {} runs whose usual intervals miss are silent", heard.len());
    claims.push(Claim::sure(what, silent == 0));
    let run = &heard[0].1;
    let mut messages = run.messages();
    let rare = rooms.dark.iter().find(|&&i| run.flags(&rooms.experiment, i) == "rare");
    messages.extend(rare.map(|i| format!("flags of patch {i} in patches.csv: `rare`")));
    claims.push(Claim::messages(&messages, "`rare`"));
    (walks, messages)
}
