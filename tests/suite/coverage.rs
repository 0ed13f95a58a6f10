//! Tests of how often intervals hold the truth, with and without stopping at a target: real walks against the exact
//! solution.
//!
//! The tables of docs/results/coverage.md: `cargo test --release --test suite coverage:: -- --ignored --nocapture --test-threads 1`

use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;

use crate::common::{box_scene, experiment, walk};
use exact::Exact;
use glam::DVec3;
use radiosity::{
    Birth, Direction, Estimate, EstimatorKind, Experiment, IndexChoice, Sequence, Solution, Tally, Walks,
};
use stats::{Coverage, DoubleSampling, Interval, foresight};

const CONFIDENCE: f64 = 0.95;

/// The looks of a run, in parts of the walks that make the expected scores. The first is moved from run to run, so that
/// the moment at which a target is met has every phase between two looks.
const LOOKS: [f64; 13] = [0.0625, 0.09375, 0.125, 0.1875, 0.25, 0.375, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0];

/// One scene, one method, its exact radiosities, and the scores per walk of its receivers.
struct Case {
    name: String,
    experiment: Experiment,
    truth: Vec<f64>,
    receivers: Vec<usize>,
    /// The effective scores per walk of each receiver.
    rates: Vec<f64>,
}

impl Case {
    fn new(direction: Direction, estimator: EstimatorKind, cells: [u32; 2]) -> Self {
        let mut spec = box_scene(DVec3::ONE, cells);
        if direction != Direction::Shooting && cells == [1, 1] {
            // The wall emits so that most gathering walks meet an emitter; otherwise many scores would take too many
            // walks.
            spec.surfaces[1].emittance = 1.0.into();
            spec.surfaces[2].emittance = 1.0.into();
        }
        let word = if direction == Direction::Shooting { "shooting" } else { "gathering" };
        let name = format!("{word} {}", format!("{estimator:?}").to_lowercase());
        let method = Walks { direction, ..Walks::shooting(estimator) };
        let experiment = experiment(&spec, IndexChoice::Auto, method);
        let truth = Exact::of_scene(&spec).unwrap().solution().radiosity.clone();
        let pilot = walk(&experiment, 0, 0..2_000_000);
        let solution = Solution::new(&experiment, &pilot, CONFIDENCE);
        let patches = experiment.scene().faces().iter().enumerate();
        let receivers: Vec<usize> =
            patches.filter(|(_, patch)| !patch.emittance.is_lit()).map(|(i, _)| i).collect();
        let rate = |&i: &usize| solution.estimates[i].unwrap().effective_scores / 2e6;
        let rates = receivers.iter().map(rate).collect();
        Case { name, experiment, truth, receivers, rates }
    }

    /// The walks of a run, by the receiver in the middle of all by its scores.
    fn walks(&self, scores: f64) -> f64 {
        let mut rates = self.rates.clone();
        rates.sort_by(f64::total_cmp);
        scores / rates[rates.len() / 2]
    }

    /// The receivers that expect about as many scores as that one.
    fn typical(&self) -> Vec<usize> {
        let middle = 1.0 / self.walks(1.0);
        let near = self.receivers.iter().zip(&self.rates);
        near.filter(|&(_, rate)| (rate / middle).ln().abs() < 0.5).map(|(&i, _)| i).collect()
    }

    fn record(&self, coverage: &mut Coverage, patch: usize, estimate: &Estimate) {
        coverage.record(&Interval { low: estimate.ci_low, high: estimate.ci_high }, self.truth[patch]);
    }
}

/// The coverage of runs of a fixed length, and of runs that stop at a target.
#[derive(Default)]
struct Cell {
    fixed: Coverage,
    stopped: Coverage,
}

/// The worst case of stopping: every patch has a run of its own, which ends when this patch meets the target, or at the
/// budget of four times the expected scores.
fn run(case: &Case, scores: f64, seed: u64, cell: &mut Cell) {
    let target = 1.4 * 1.96 / scores.sqrt();
    // The golden ratio fills the phases evenly.
    let phase = 2f64.powf((seed as f64 * 0.618_033_988_749_895).fract());
    let unit = case.walks(scores) * phase;
    let patches = case.typical();
    let mut rules = vec![DoubleSampling::default(); patches.len()];
    let mut open: Vec<usize> = (0..patches.len()).collect();
    let (sequence, mut board) = (Sequence::new(seed), case.experiment.board());
    let mut tally = case.experiment.tally();
    let fixed = case.walks(scores).round() as u64;
    let mut marks: Vec<u64> = LOOKS.iter().map(|part| (part * unit).round() as u64).collect();
    let budget = *marks.last().unwrap();
    marks.push(fixed);
    marks.sort_unstable();
    for mark in marks.into_iter().filter(|&mark| mark > 0) {
        advance(case, &sequence, mark, &mut board, &mut tally);
        let solution = Solution::new(&case.experiment, &tally, CONFIDENCE);
        if mark == fixed {
            for &patch in &patches {
                case.record(&mut cell.fixed, patch, &solution.estimates[patch].unwrap());
            }
            continue;
        }
        open.retain(|&i| {
            let estimate = solution.estimates[patches[i]].unwrap();
            let error = estimate.relative_error();
            let ends = rules[i].look(mark, error <= foresight(target), error <= target) || mark == budget;
            if ends {
                case.record(&mut cell.stopped, patches[i], &estimate);
            }
            !ends
        });
        if open.is_empty() && mark > fixed {
            break;
        }
    }
}

fn advance(case: &Case, sequence: &Sequence, end: u64, board: &mut radiosity::Board, tally: &mut Tally) {
    while tally.counts.walks < end {
        let first = tally.counts.walks;
        case.experiment.walk(sequence, first..end.min(first + (1 << 20)), board);
        tally.merge(&board.take().unwrap()).unwrap();
    }
}

/// Runs on all cores until both kinds have `intervals` intervals.
fn cell(case: &Case, scores: f64, intervals: usize) -> Cell {
    let runs = intervals.div_ceil(case.typical().len()) as u64;
    let next = AtomicU64::new(1);
    let work = || {
        let mut cell = Cell::default();
        loop {
            let seed = next.fetch_add(1, Ordering::Relaxed);
            if seed > runs {
                return cell;
            }
            run(case, scores, seed, &mut cell);
        }
    };
    let mut sum = Cell::default();
    thread::scope(|scope| {
        let threads: Vec<_> =
            (0..thread::available_parallelism().map_or(1, usize::from)).map(|_| scope.spawn(work)).collect();
        for thread in threads {
            let part = thread.join().unwrap();
            sum.fixed.merge(&part.fixed);
            sum.stopped.merge(&part.stopped);
        }
    });
    sum
}

/// The limit, less four standard errors of `n` intervals: if the true coverage is just at a limit, there is one alarm
/// in 30,000.
fn assert_true(coverage: &Coverage, scores: f64, what: &str) {
    let (low, high) = if scores >= 100.0 { (0.944, 0.956) } else { (0.94, 1.0) };
    let rate = coverage.rate(0.95).unwrap();
    let slack = 4.0 * rate.standard_error;
    assert!(rate.value > low - slack && rate.value < high + slack, "{what}, {scores} scores: {rate:?}");
}

fn percent(coverage: &Coverage) -> f64 {
    100.0 * coverage.covered as f64 / coverage.trials as f64
}

#[test]
#[ignore = "takes many minutes; docs/results/coverage.md has its output"]
fn table_of_shooting() {
    table(&Direction::Shooting);
}

#[test]
#[ignore = "takes many minutes; docs/results/coverage.md has its output"]
fn table_of_gathering() {
    table(&Direction::Gathering(Birth::Area));
}

fn table(direction: &Direction) {
    use EstimatorKind::{Absorption, Collision, Infinite, Survival};
    const SCORES: [f64; 6] = [0.5, 1.0, 3.0, 10.0, 100.0, 1e4];
    println!("| expected scores | {} |", SCORES.map(|scores| scores.to_string()).join(" | "));
    println!("|---|{}", "---|".repeat(SCORES.len()));
    for kind in [Absorption, Survival, Collision, Infinite] {
        let many = Case::new(direction.clone(), kind, [3, 3]);
        // Fewer patches for many scores each, which take a sixth of the walks each.
        let few = Case::new(direction.clone(), kind, [1, 1]);
        let cells = SCORES.map(|scores| cell(if scores >= 100.0 { &few } else { &many }, scores, 20_000));
        let row = |of: fn(&Cell) -> &Coverage| {
            cells.each_ref().map(|cell| format!("{:.2}", percent(of(cell)))).join(" | ")
        };
        println!("| {} | {} |", many.name, row(|cell| &cell.fixed));
        println!("| – stopped at a target | {} |", row(|cell| &cell.stopped));
        for (cell, scores) in cells.iter().zip(SCORES) {
            assert!(cell.fixed.trials >= 20_000 && cell.stopped.trials >= 20_000);
            assert_true(&cell.fixed, scores, &many.name);
            assert_true(&cell.stopped, scores, &format!("{}, stopped", many.name));
        }
    }
}

/// One estimator with fewer intervals, in the everyday suite.
#[test]
fn stopping_at_a_target_keeps_intervals_true() {
    for (direction, kind) in
        [(Direction::Shooting, EstimatorKind::Collision), (Direction::Shooting, EstimatorKind::Infinite)]
    {
        let case = Case::new(direction, kind, [1, 1]);
        for scores in [1.0, 10.0, 100.0] {
            let cell = cell(&case, scores, 10_000);
            assert_true(&cell.fixed, scores, &case.name);
            assert_true(&cell.stopped, scores, &format!("{}, stopped", case.name));
        }
    }
}

/// Simultaneous intervals of the cube's 53 receivers, each of level 1 − 0.05/53: all hold the truth in at least 95 % of
/// 1,000 runs, less four standard errors (3 %).
#[test]
fn simultaneous_intervals_hold_all_together() {
    let case = Case::new(Direction::Shooting, EstimatorKind::Collision, [3, 3]);
    let level = 1.0 - (1.0 - CONFIDENCE) / case.receivers.len() as f64;
    for walks in [200, 1_000, 5_000] {
        let mut together = Coverage::default();
        for seed in 1..=1000 {
            let solution = Solution::new(&case.experiment, &walk(&case.experiment, seed, 0..walks), level);
            let misses = |&patch: &usize| {
                let estimate = solution.estimates[patch].unwrap();
                case.truth[patch] < estimate.ci_low || case.truth[patch] > estimate.ci_high
            };
            together.trials += 1;
            together.covered += u64::from(!case.receivers.iter().any(misses));
        }
        println!("{walks} walks: {:.2} % of runs", percent(&together));
        assert!(together.rate(0.95).unwrap().z(0.95) > -4.0, "{walks} walks: {together:?}");
    }
}
