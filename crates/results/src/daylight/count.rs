//! The walks of daylight coefficients, from look to look.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Instant;

use parallel::on_threads;
use radiosity::{Sequence, daylight::SkyTally};
use sky::SkyPatchCounts;

use super::question::DaylightQuestion;

/// Walks of each cell at the first look.
pub(super) const FEWEST: u64 = 1 << 12;

/// The most walks that a thread takes at once.
const PART: u64 = 1 << 16;

/// By how many times the walks of a cell grow at most from one look to the next.
const GROWTH: f64 = 16.0;

/// More walks are given than a look says are needed, by this factor: the next look should be the last.
const MARGIN: f64 = 1.1;

/// What was counted, cell by cell.
pub struct DaylightCounted {
    pub(super) tallies: Vec<SkyTally>,
    /// Whether the tolerance is met at every cell.
    pub reached: bool,
    /// Wall time of walking [s].
    pub seconds: f64,
}

/// Walks on some threads until the yearly mean of each cell is known as well as is asked, or the budget is spent. Walks of a cell are
/// powers of two, chosen by what it has counted: neither threads nor other cells play a part. `watch` hears what part of a look is done, and
/// says whether to go on; `None` where it does not.
pub fn count(
    question: &DaylightQuestion,
    threads: usize,
    watch: &(dyn Fn(f64) -> bool + Sync),
) -> Option<DaylightCounted> {
    let began = Instant::now();
    let cells = question.cells();
    let most = 1 << (question.job.budget.paths / cells as u64).ilog2();
    let mut tallies = vec![SkyTally::new(question.dome.patches().count()); cells];
    let mut wanted = vec![FEWEST; cells];
    loop {
        walk(question, &mut tallies, &wanted, threads, watch)?;
        let next: Vec<u64> = tallies.iter().map(|tally| needed(question, tally).min(most)).collect();
        if next == wanted {
            break;
        }
        wanted = next;
    }
    let reached = tallies.iter().all(|tally| excess(question, tally) <= 1.0);
    Some(DaylightCounted { tallies, reached, seconds: began.elapsed().as_secs_f64() })
}

/// The counts of a cell, as figures take them.
pub(super) fn row(tally: &SkyTally) -> SkyPatchCounts {
    SkyPatchCounts {
        walks: tally.walks,
        straight: tally.straight.clone(),
        reflected: tally.reflected.clone(),
    }
}

/// By what factor the relative half-width of the yearly mean is above what is asked.
fn excess(question: &DaylightQuestion, tally: &SkyTally) -> f64 {
    let known = row(tally).light(&question.mean.0, &question.mean.1, question.wanted.confidence);
    0.5 * (known.high - known.low) / known.value / question.tolerance
}

/// The walks that a cell needs: errors fall as the square root of their number.
fn needed(question: &DaylightQuestion, tally: &SkyTally) -> u64 {
    let excess = excess(question, tally);
    if excess <= 1.0 {
        return tally.walks;
    }
    // Where no walk has found the sky there is no excess that were a number.
    let growth = if excess.is_finite() { (MARGIN * excess * excess).clamp(2.0, GROWTH) } else { GROWTH };
    ((tally.walks as f64 * growth).ceil() as u64).next_power_of_two()
}

/// Walks what each cell has fewer than `wanted`.
fn walk(
    question: &DaylightQuestion,
    tallies: &mut [SkyTally],
    wanted: &[u64],
    threads: usize,
    watch: &(dyn Fn(f64) -> bool + Sync),
) -> Option<()> {
    let sequence = Sequence::new(question.job.seed);
    let parts: Vec<(usize, u64, u64)> = (0..tallies.len())
        .flat_map(|cell| {
            let (first, end) = (tallies[cell].walks, wanted[cell]);
            (first..end).step_by(PART as usize).map(move |first| (cell, first, end.min(first + PART)))
        })
        .collect();
    let (done, goes_on) = (AtomicUsize::new(0), AtomicBool::new(true));
    let tally = |(): &mut (), number: usize| {
        let (cell, first, end) = parts[number];
        let mut tally = SkyTally::new(question.dome.patches().count());
        if goes_on.load(Ordering::Relaxed) {
            question.coefficients.walk(&sequence, cell, first..end, &mut tally);
            let part = done.fetch_add(1, Ordering::Relaxed) as f64 / parts.len() as f64;
            if !watch(part) {
                goes_on.store(false, Ordering::Relaxed);
            }
        }
        tally
    };
    let walked = on_threads(threads, parts.len(), || (), tally);
    parts.iter().zip(&walked).for_each(|(&(cell, ..), tally)| tallies[cell].add(tally));
    goes_on.into_inner().then_some(())
}
