//! Entries of the atlas: selected luck, by stopping at a lucky moment, by the best of many seeds, and by walks that
//! count twice.

use exact::Exact;
use protocol::{Book, Checkpoint, Contributor, Delivery, Effort, WalkRange};
use radiosity::{Estimate, EstimatorKind, Experiment, Method, Solution};
use rand_pcg::Pcg64Dxsm;
use rand_pcg::rand_core::{Rng, SeedableRng};
use report::{Axis, Chart, Series};
use stats::{DoubleSampling, Measured, Moments, foresight, mean_interval, normal_cdf};

use crate::arithmetic::proportion;
use crate::atlas::entry::{Entry, StudyFinding};
use crate::claim::Claim;
use crate::lab::Lab;
use crate::walking::{CONFIDENCE, Failure, covered, estimate, experiment, receivers, solve, walk};
use report::words::measured;

pub(crate) const MOMENT: Entry =
    Entry { name: "lucky-moment", title: "Stopping at a lucky moment", study: moment };

pub(crate) const SEED: Entry = Entry { name: "best-seed", title: "Choosing the best seed", study: seed };

pub(crate) const TWICE: Entry =
    Entry { name: "overlapping-runs", title: "Merging runs that overlap", study: twice };

/// A rare score: hits are a Poisson count whose mean grows with the walks, with looks as in a job.
struct RareScore {
    rng: Pcg64Dxsm,
    walks: u64,
    hits: u64,
    /// The place of the next hit, in expected hits.
    next: f64,
}

/// The expected hits of one walk.
const RATE: f64 = 1e-3;

impl RareScore {
    fn new(seed: u64) -> Self {
        let mut score = RareScore { rng: Pcg64Dxsm::seed_from_u64(seed), walks: 0, hits: 0, next: 0.0 };
        score.next = score.waiting();
        score
    }

    fn uniform(&mut self) -> f64 {
        ((self.rng.next_u64() >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    fn waiting(&mut self) -> f64 {
        -self.uniform().ln()
    }

    /// The half-width over the estimate after some walks, and whether the interval holds the truth.
    fn look(&mut self, walks: u64) -> (f64, bool) {
        self.walks = walks;
        while self.next <= RATE * walks as f64 {
            self.hits += 1;
            self.next += self.waiting();
        }
        let hits = u128::from(self.hits);
        let interval = mean_interval(&Moments { n: walks, sum: hits, sum_sq: hits }, 1.0, CONFIDENCE, 1.0);
        let estimate = self.hits as f64 / walks as f64;
        (0.5 * (interval.high - interval.low) / estimate, interval.contains(RATE))
    }
}

/// Whether the interval covers if a run ends at the first look that meets the target, and if double sampling ends it.
/// The first look is moved from run to run.
fn stops(seed: u64, target: f64) -> (f64, f64) {
    let mut score = RareScore::new(seed);
    let phase = 2f64.powf(score.uniform());
    let (mut rule, mut lucky) = (DoubleSampling::default(), None);
    for step in 0.. {
        let power = 256.0 * phase * 2f64.powi(step / 2);
        let walks = if step % 2 == 0 { power } else { 1.5 * power };
        let (error, covers) = score.look(walks.round() as u64);
        let met = error <= target;
        if met {
            lucky.get_or_insert(covers);
        }
        if rule.look(walks.round() as u64, error <= foresight(target), met) {
            let lucky = lucky.unwrap_or(covers);
            return (f64::from(u8::from(lucky)), f64::from(u8::from(covers)));
        }
    }
    unreachable!("errors fall below any target")
}

/// The probability that some of a number of looks, equally far apart, has an interval of 95 % that misses: P. Armitage, C. K.
/// McPherson & B. C. Rowe, J. R. Statist. Soc. A 132 (1969) 235–244, table 2.
const ARMITAGE: [(u64, f64); 7] =
    [(1, 0.050), (2, 0.083), (3, 0.107), (4, 0.126), (5, 0.142), (10, 0.193), (20, 0.248)];

/// For every number of looks of [`ARMITAGE`], whether all intervals up to there hold the truth.
fn wishes(seed: u64) -> Vec<f64> {
    /// The expected hits between two looks.
    const HITS: f64 = 400.0;
    let mut score = RareScore::new(seed);
    let mut holding = true;
    let mut holds = Vec::new();
    for look in 1..=ARMITAGE[ARMITAGE.len() - 1].0 {
        holding &= score.look((look as f64 * HITS / RATE) as u64).1;
        if ARMITAGE.iter().any(|&(looks, _)| looks == look) {
            holds.push(f64::from(u8::from(holding)));
        }
    }
    holds
}

fn moment(lab: &Lab) -> Result<StudyFinding, Failure> {
    let found = lab.each_seed(lab.pick(4000, 40_000), wishes);
    let marks: Vec<_> = ARMITAGE
        .iter()
        .enumerate()
        .map(|(k, &(looks, _))| (looks as f64, proportion(&found.iter().map(|f| f[k]).collect::<Vec<_>>())))
        .collect();
    let mut claims: Vec<Claim> = ARMITAGE
        .iter()
        .zip(&marks)
        .map(|(&(looks, missed), &(_, found))| {
            Claim::equal(format!("{looks} looks: coverage"), found, 1.0 - missed)
        })
        .collect();
    let target = 0.6;
    let stopped = lab.each_seed(lab.pick(20_000, 400_000), |seed| stops(seed, target));
    let of = |pick: fn(&(f64, f64)) -> f64| proportion(&stopped.iter().map(pick).collect::<Vec<_>>());
    let (first, double) = (of(|f| f.0), of(|f| f.1));
    claims.push(Claim::at_least("a target of 0.6: coverage by double sampling", double, 0.95).instead());
    let last = marks[marks.len() - 1];
    Ok(StudyFinding {
        predicted: "A user who looks again and again, and stops as soon as an interval excludes the true B, succeeds \
                    in the end: of 20 looks some 95 % interval misses with the probability 0.248 (Armitage, McPherson \
                    & Rowe 1969). Stopping at a relative error is milder: a count that happens to be high meets it \
                    early."
            .into(),
        seen: format!(
            "Of runs that are looked at 20 times and stopped at the first interval that misses, {} hold the truth \
             where they stop. Runs that stop at the first look whose relative half-width is below {target} cover {}: \
             intervals of rare scores are cautious enough for that, on average over the phase of the looks.",
            measured(last.1),
            measured(first)
        ),
        messages: vec![
            "nothing of stops by hand: the program writes the walks it has, and cannot know why it was stopped. \
             `paths` in summary.json is then short of the job's budget, and on screen “… of … paths” says so"
                .into(),
        ],
        instead: format!(
            "Say before the run when it is to end: budget.paths, or target.relative_error, which decides the end in advance, at twice \
             the walks of the first look that shows they will do (Stein 1945, Cox 1952). Its intervals cover {} at a \
             target of {target}.",
            measured(double)
        ),
        claims,
        chart: Chart {
            title: "Stopped at the first look that says what was hoped for".into(),
            x: Axis::linear("looks"),
            y: Axis::linear("part of the 95 % intervals that hold the truth"),
            series: vec![
                Series::theory("Armitage, McPherson & Rowe", ARMITAGE.iter().map(|&(looks, p)| (looks as f64, 1.0 - p))),
                Series::measured("seen", marks),
                Series::measured("remedy: a target, by double sampling", [(1.0, double), (20.0, double)]),
            ],
        },
    })
}

/// The patch whose brightest answer is chosen: in the middle of the last face of the 54-patch cube.
const PATCH: usize = 49;

fn cube() -> Result<(Experiment, Vec<f64>), Failure> {
    let spec = scenes::cube(3);
    let truth = Exact::of_scene(&spec)?.solution().radiosity.clone();
    Ok((experiment(&spec, Method::shooting(EstimatorKind::Collision))?, truth))
}

/// The coverage of the brightest of some runs.
struct Brightest {
    /// The number of runs to choose from.
    most: usize,
    marks: Vec<(f64, Measured)>,
    /// The coverage of all runs merged.
    merged: Measured,
    claims: Vec<Claim>,
}

/// The coverage of the brightest of n runs: all lower ends must lie below the truth (0.975ⁿ), but not all upper ends
/// (0.025ⁿ).
fn coverage_of_brightest(n: usize) -> f64 {
    0.975f64.powi(n as i32) - 0.025f64.powi(n as i32)
}

impl Brightest {
    fn drive(lab: &Lab) -> Result<Self, Failure> {
        let (experiment, truth) = cube()?;
        let sweep = lab.pick(vec![1_usize, 8], vec![1, 2, 4, 8, 16, 32]);
        let most = sweep[sweep.len() - 1];
        let (groups, walks) = lab.pick((300, 3000), (1000, 5000));
        let holds = |estimate: &Estimate| {
            f64::from(u8::from((estimate.ci_low..=estimate.ci_high).contains(&truth[PATCH])))
        };
        let found = lab.each_seed(groups, |group| {
            let seeds = (0..most as u64).map(|i| group * 1000 + i);
            let tallies: Vec<_> = seeds.map(|seed| walk(&experiment, seed, walks)).collect();
            let of = |tally| estimate(&Solution::new(&experiment, tally, CONFIDENCE), PATCH);
            let estimates: Vec<Estimate> = tallies.iter().map(of).collect();
            let best = |n: &usize| {
                let brightest = estimates[..*n].iter().max_by(|a, b| a.radiosity.total_cmp(&b.radiosity));
                holds(brightest.expect("a seed at least"))
            };
            let mut all = experiment.tally();
            tallies.iter().for_each(|tally| all.merge(tally).expect("one experiment"));
            (sweep.iter().map(best).collect::<Vec<f64>>(), holds(&of(&all)))
        });
        let of = |k: usize| proportion(&found.iter().map(|f| f.0[k]).collect::<Vec<_>>());
        let marks: Vec<_> = sweep.iter().enumerate().map(|(k, &n)| (n as f64, of(k))).collect();
        let merged = proportion(&found.iter().map(|f| f.1).collect::<Vec<_>>());
        let claim = |(&n, &(_, found)): (&usize, &(f64, Measured))| {
            Claim::equal(format!("the brightest of {n}: coverage"), found, coverage_of_brightest(n))
        };
        let mut claims: Vec<Claim> = sweep.iter().zip(&marks).map(claim).collect();
        claims.push(Claim::equal("all seeds merged: coverage", merged, 0.95).instead());
        Ok(Brightest { most, marks, merged, claims })
    }

    fn chart(self) -> Chart {
        let most = self.most;
        Chart {
            title: "The brightest of n runs of the 54-patch cube".into(),
            x: Axis::log("runs to choose from"),
            y: Axis::linear("part of the 95 % intervals that hold the truth"),
            series: vec![
                Series::theory("0.975ⁿ − 0.025ⁿ", (1..=most).map(|n| (n as f64, coverage_of_brightest(n)))),
                Series::measured("the brightest, seen", self.marks),
                Series::measured("all merged", [(most as f64, self.merged)]),
            ],
        }
    }
}

fn seed(lab: &Lab) -> Result<StudyFinding, Failure> {
    let sweep = Brightest::drive(lab)?;
    let (most, last) = (sweep.most, sweep.marks[sweep.marks.len() - 1].1);
    Ok(StudyFinding {
        predicted: format!(
            "The interval of the brightest of n runs holds the truth only if no run is too bright: 0.975ⁿ − 0.025ⁿ, {:.3} \
             for n = {most}. The same with any other choice by what runs say.",
            coverage_of_brightest(most)
        ),
        seen: format!("The brightest of {most} runs covers {}.", measured(last)),
        messages: vec![
            "nothing, and it cannot: a run does not know of others that were thrown away. `provenance` in summary.json \
             names the seed and the walks, so that a reader may ask why that seed"
                .into(),
        ],
        instead: format!(
            "Choose the seed before the first run, or merge all of them: `radwalk merge` of all {most} covers {}.",
            measured(sweep.merged)
        ),
        claims: sweep.claims.clone(),
        chart: sweep.chart(),
    })
}

/// The checkpoint that `radwalk merge` reads, with walks `first` … of a job.
fn checkpoint(experiment: &Experiment, first: u64, walks: u64) -> Checkpoint {
    let part =
        WalkRange { job_hash: [1; 32], seed: 1, first, deliveries: Delivery::lease(walks, 0, 0).into() };
    let book = Book {
        parts: vec![part],
        out_of_order: vec![],
        workers: vec![Contributor { name: "a worker".into(), walks, leases: 1, faults: 0 }],
        looks: vec![],
        goal: [0; 32],
        effort: Effort::default(),
        sessions: vec![],
        job: [].into(),
    };
    Checkpoint { scene_hash: experiment.scene().hash(), tally: walk(experiment, 1, walks).into(), book }
}

fn twice(lab: &Lab) -> Result<StudyFinding, Failure> {
    let (experiment, truth) = cube()?;
    let patches = receivers(&experiment);
    let sweep = lab.pick(vec![1_u32, 4], vec![1, 2, 4, 8, 16]);
    let (runs, walks) = lab.pick((100, 20_000), (200, 100_000));
    let predicted = |times: u32| 2.0 * normal_cdf(1.96 / f64::from(times).sqrt()) - 1.0;
    let (mut marks, mut claims) = (Vec::new(), Vec::new());
    for &times in &sweep {
        let found = lab.each_seed(runs, |seed| {
            let once = walk(&experiment, seed, walks);
            let mut tally = experiment.tally();
            (0..times).for_each(|_| tally.merge(&once).expect("one experiment"));
            covered(&Solution::new(&experiment, &tally, CONFIDENCE), &patches, &truth)
        });
        let found = proportion(&found);
        claims.push(Claim::equal(format!("{times} times: coverage"), found, predicted(times)));
        marks.push((f64::from(times), found));
    }
    let refusal = checkpoint(&experiment, 0, 1000).merge(checkpoint(&experiment, 900, 1000));
    let messages: Vec<String> = refusal.err().map(|fault| fault.to_string()).into_iter().collect();
    claims.push(Claim::messages(&messages, "walks 900 to 999 of seed 1 are in two of the runs"));
    let apart = checkpoint(&experiment, 0, 1000).merge(checkpoint(&experiment, 1000, 1000));
    claims.push(Claim::sure("ranges that do not overlap are merged", apart.is_ok()).instead());
    let honest = lab.each_seed(runs, |seed| covered(&solve(&experiment, seed, 4 * walks), &patches, &truth));
    let honest = proportion(&honest);
    claims.push(Claim::equal("four ranges of walks: coverage", honest, 0.95).instead());
    let last = marks[marks.len() - 1];
    Ok(StudyFinding {
        predicted:
            "Walks that count k times make intervals √k too narrow: they cover 2Φ(1.96/√k) − 1 of the truths."
                .into(),
        seen: format!("Tallies added to themselves cover {} where k = {}.", measured(last.1), last.0),
        messages,
        instead: format!(
            "Runs of other ranges of walks (budget.first_path) or of other seeds (seed): four ranges cover {}.",
            measured(honest)
        ),
        claims,
        chart: Chart {
            title: "Walks that count more than once".into(),
            x: Axis::log("times that each walk counts"),
            y: Axis::linear("part of the 95 % intervals that hold the truth"),
            series: vec![
                Series::theory(
                    "2Φ(1.96/√k) − 1",
                    (4..=16 * 4)
                        .map(|k| 0.25 * f64::from(k))
                        .filter(|&k| k <= last.0)
                        .map(|k| (k, 2.0 * normal_cdf(1.96 / k.sqrt()) - 1.0)),
                ),
                Series::measured("merged against all advice", marks),
                Series::measured("four ranges of walks", [(4.0, honest)]),
            ],
        },
    })
}
