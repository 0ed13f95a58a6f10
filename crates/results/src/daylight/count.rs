//! The walks of daylight coefficients, from look to look, and what is kept of them.

use std::time::Instant;

use parallel::on_threads;
use radiosity::{
    Sequence, Tally,
    daylight::{DaylightSpec, Segment, SkyTally, sky_rows, sky_tallies},
};
use report::{DimPoints, OutputFolder};
use sky::{BoundedValue, SkyPatchCounts};

use super::answer::FILES;
use super::question::DaylightQuestion;
use super::stored::{COUNTS, DaylightCounts};
use crate::error::Error;
use crate::rounds::{Cost, Round, RoundCounts, RoundPlan, RoundResult, walk_rounds};
use crate::settings::Settings;

/// Walks of each cell at the first look.
pub(super) const FEWEST: u64 = 1 << 12;

/// The most rows of a round's tally: a look at more cells takes several rounds.
const MOST_ROWS: usize = 1 << 20;

/// By how many times the walks of a cell grow at most from one look to the next.
const GROWTH: f64 = 16.0;

/// More walks are given than a look says are needed, by this factor: the next look should be the last.
const MARGIN: f64 = 1.1;

/// The walks of a piece of work of a thread, and the pieces of each thread between two calls of the watcher.
const PIECE: u64 = 1 << 14;
const PIECES: usize = 32;

/// What was counted, cell by cell.
pub struct DaylightCounted {
    pub(super) tallies: Vec<SkyTally>,
    pub(super) cost: Cost,
    /// Whether the tolerance is met at every cell that is not dark.
    pub reached: bool,
    /// The cells that no more than a hundredth of the median cell's light comes to, which most often lie inside of furniture; the darkest first.
    pub(super) dark: Vec<usize>,
    /// Whether a signal ended it.
    pub interrupted: bool,
}

/// Walks until the yearly mean of each cell is known as well as is asked, or the budget is spent. Walks of a cell are powers of two, chosen by what
/// it has counted: no other cell plays a part. Every round is kept in the folder, from which `resume` goes on. `walk` walks a round, and returns
/// nothing where a signal ended it; `watch` is told what part of a look is done.
///
/// # Errors
/// Those of `walk`, and where counts cannot be read or written.
pub fn count<E: From<Error>>(
    question: &DaylightQuestion,
    build: &str,
    (folder, resume): (&OutputFolder, bool),
    walk: &mut dyn FnMut(Round<'_>) -> Result<Option<RoundResult>, E>,
    watch: &dyn Fn(f64),
) -> Result<DaylightCounted, E> {
    let path = folder.file(COUNTS);
    let counts = match resume && path.exists() {
        true => DaylightCounts::of_question(&path, question)?,
        false => DaylightCounts::none(question),
    };
    let mut looks = DaylightRounds { question, counts, under_way: None };
    let replaced: &[&str] = if resume { &[] } else { &FILES };
    let done = walk_rounds(&mut looks, (&question.job, build), (folder, replaced), walk, watch)?;
    Ok(looks.end(done))
}

/// The counts of [`count`], by threads of this process. Nothing is kept on the way. `watch` is told what part of a look is done, and says whether walks
/// go on.
pub fn count_here(
    question: &DaylightQuestion,
    threads: usize,
    watch: &mut dyn FnMut(f64) -> bool,
) -> DaylightCounted {
    let mut looks = DaylightRounds { question, counts: DaylightCounts::none(question), under_way: None };
    let sequence = Sequence::new(question.job.seed);
    let (began, mut done) = (Instant::now(), true);
    while done {
        let parts: Vec<Segment> = looks.missing().into_iter().flat_map(pieces).collect();
        if parts.is_empty() {
            break;
        }
        let some = (threads * PIECES).min(parts.len());
        let walk = |(): &mut (), part: usize| {
            let Segment { group, first, walks } = parts[part];
            let mut tally = SkyTally::new(question.dome.patches().count());
            question.coefficients.walk(&sequence, group as usize, first..first + walks, &mut tally);
            tally
        };
        let tallies = on_threads(threads, some, || (), walk);
        for (part, tally) in parts.iter().zip(tallies) {
            looks.counts.tallies[part.group as usize].add(&tally);
        }
        done = watch(some as f64 / parts.len() as f64);
        if some == parts.len() {
            looks.look();
        }
    }
    looks.counts.cost.seconds = began.elapsed().as_secs_f64();
    looks.end(done)
}

/// A segment in pieces of at most [`PIECE`] walks.
fn pieces(Segment { group, first, walks }: Segment) -> impl Iterator<Item = Segment> {
    let starts = (first..first + walks).step_by(PIECE as usize);
    starts.map(move |start| Segment { group, first: start, walks: PIECE.min(first + walks - start) })
}

/// The counts of a question, look by look.
struct DaylightRounds<'a> {
    question: &'a DaylightQuestion,
    counts: DaylightCounts,
    /// What the round under way walks.
    under_way: Option<DaylightSpec>,
}

impl RoundCounts for DaylightRounds<'_> {
    fn next(&mut self) -> Result<Option<RoundPlan>, Error> {
        let job = &self.question.job;
        let mut missing = self.missing();
        if missing.is_empty() {
            self.look();
            missing = self.missing();
        }
        let all: u64 = missing.iter().map(|segment| segment.walks).sum();
        let done = self.counts.tallies.iter().map(|tally| tally.walks).sum::<u64>();
        missing.truncate(MOST_ROWS / sky_rows(self.question.dome.patches().count()));
        let walks = missing.iter().map(|segment| segment.walks).sum();
        if walks == 0 {
            return Ok(None);
        }
        let experiment = self.question.experiment(missing.clone())?;
        let spec = self.question.spec(missing);
        let settings = Settings { sensors: Vec::new(), daylight: Some(spec.clone()), ..Settings::of(job) };
        self.under_way = Some(spec);
        let parts = [done, done + walks].map(|done_then| done_then as f64 / (done + all) as f64);
        Ok(Some(RoundPlan { experiment, settings, walks, parts }))
    }

    fn add(&mut self, tally: &Tally, cost: Cost) {
        let spec = self.under_way.take().expect("a round was under way");
        for (segment, tally) in spec.segments.iter().zip(sky_tallies(tally, &spec)) {
            self.counts.tallies[segment.group as usize].add(&tally);
        }
        self.counts.cost.add(cost);
    }

    fn keep(&self, folder: &OutputFolder) -> Result<(), Error> {
        self.counts.write(folder)
    }
}

impl DaylightRounds<'_> {
    /// What was counted, where walks are `done` or given up.
    fn end(self, done: bool) -> DaylightCounted {
        let DaylightCounts { tallies, cost, .. } = self.counts;
        let known: Vec<BoundedValue> =
            tallies.iter().map(|tally| yearly_mean(self.question, tally)).collect();
        let dark = dark(&known);
        let mut met: Vec<bool> = known.iter().map(|known| excess(self.question, known) <= 1.0).collect();
        dark.iter().for_each(|&cell| met[cell] = true);
        let reached = done && met.into_iter().all(|met| met);
        DaylightCounted { tallies, cost, reached, dark, interrupted: !done }
    }

    /// The walks that cells have fewer than they are to have.
    fn missing(&self) -> Vec<Segment> {
        let cells = self.counts.tallies.iter().zip(&self.counts.wanted).enumerate();
        cells
            .map(|(cell, (tally, &wanted))| Segment {
                group: cell as u32,
                first: tally.walks,
                walks: wanted.saturating_sub(tally.walks),
            })
            .filter(|segment| segment.walks > 0)
            .collect()
    }

    /// Looks at what cells have counted, and says how many walks they are to have.
    fn look(&mut self) {
        let most = self.question.most_walks();
        let wanted = self.counts.tallies.iter().map(|tally| needed(self.question, tally).min(most));
        self.counts.wanted = wanted.collect();
    }
}

/// The counts of a cell, as figures take them.
pub(super) fn row(tally: &SkyTally) -> SkyPatchCounts {
    SkyPatchCounts {
        walks: tally.walks,
        straight: tally.straight.clone(),
        reflected: tally.reflected.clone(),
    }
}

/// The yearly mean of a cell.
fn yearly_mean(question: &DaylightQuestion, tally: &SkyTally) -> BoundedValue {
    row(tally).light(&question.mean.0, &question.mean.1, question.wanted.confidence)
}

/// The cells that are surely dark, the darkest first.
fn dark(known: &[BoundedValue]) -> Vec<usize> {
    let mut cells: Vec<usize> = (0..known.len()).collect();
    cells.sort_by(|&a, &b| known[a].value.total_cmp(&known[b].value));
    let median = known[cells[cells.len() / 2]].value;
    cells.retain(|&cell| known[cell].high < DimPoints::PART * median);
    cells
}

/// By what factor the relative half-width of the yearly mean is above what is asked.
fn excess(question: &DaylightQuestion, known: &BoundedValue) -> f64 {
    0.5 * (known.high - known.low) / known.value / question.tolerance
}

/// The walks that a cell needs: errors fall as the square root of their number.
fn needed(question: &DaylightQuestion, tally: &SkyTally) -> u64 {
    let excess = excess(question, &yearly_mean(question, tally));
    if excess <= 1.0 {
        return tally.walks;
    }
    // Where no walk has found the sky there is no excess that were a number.
    let growth = if excess.is_finite() { (MARGIN * excess * excess).clamp(2.0, GROWTH) } else { GROWTH };
    ((tally.walks as f64 * growth).ceil() as u64).next_power_of_two()
}
