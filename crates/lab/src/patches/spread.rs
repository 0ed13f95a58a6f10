//! How truly runs tell the spread of light over their patches, and how truly any estimate could that sees nothing of a patch but its slopes.

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use radiosity::{Estimates, Sequence};

use super::reported::{FACTOR, LONG, near};
use super::rooms::{Room, rooms};
use super::runs::{Failure, experiment, walk};
use super::study::open_job;
use super::truth::Truth;
use crate::edition::origin;

/// Walks of the jobs.
const PATHS: [u64; 3] = [100_000, 1_000_000, 10_000_000];

/// Patches are distinguished by their spread over its noise, at these limits.
const LIMITS: [f64; 3] = [1.0, 2.0, 4.0];

/// Runs that are imagined of each patch.
const RUNS: u64 = 64;

/// Runs whose slopes are alike, by the octave of their square over its noise: steps to an octave, and octaves to either side of 1.
const STEPS: f64 = 4.0;
const OCTAVES: f64 = 16.0;

/// What is true of a patch.
struct TrueSpread {
    area: f64,
    /// The mean square of the difference between the light and its mean [(W/m²)²].
    square: f64,
    /// The part of it that the best linear fit has.
    linear: f64,
    /// The variance of the estimate of that fit in a run, its mean apart.
    noise: f64,
    /// What a run tells of it [W/m²].
    reported: f64,
}

impl TrueSpread {
    /// Whether it is reported within [`FACTOR`].
    fn is_true(&self) -> bool {
        near(self.reported, self.square.sqrt())
    }

    /// Whether a run without noise would report it so.
    fn is_linear(&self) -> bool {
        near(self.linear.sqrt(), self.square.sqrt())
    }

    /// The number of [`LIMITS`] that it exceeds.
    fn class(&self) -> usize {
        LIMITS.iter().filter(|&&limit| self.square > limit * limit * self.noise).count()
    }
}

/// Writes `spread.md`.
pub fn write(folder: &Path, millions: u64) -> Result<(), Failure> {
    let mut text = format!(
        "# How truly runs tell the spread of light over patches\n\n\
         `radwalk-lab patches docs/results {millions} spread` writes this page: {}.\n\n\
         Scenes and patches are those of [chosen patches](patches.md), for seed 0, with the linear basis; the truth is that of two references of {millions} million walks each. *Told*:\n\
         the part of the area where a run's `spread` is within a factor of {FACTOR} of the truth. *Without noise*: the same for a run that knows the best linear fit to each patch;\n\
         elsewhere light varies in ways that no linear fit sees. *Ceiling*: the same for the best estimate from the slopes that a run finds of a patch and from their noise, one that knows\n\
         how many patches of each spread there are ({RUNS} imagined runs of each patch). Then the area by the true spread over the noise of its estimate, and the part of it where the\n\
         spread is told within the factor.\n\n\
         | scene | walks | told | without noise | ceiling | below 1 | 1 to 2 | 2 to 4 | above 4 |\n|---|---|---|---|---|---|---|---|---|\n",
        origin(),
    );
    // Where light is even there is no spread to report.
    for room in rooms().iter().filter(|room| room.name != "even-cube") {
        let truth = Truth::new(&room.spec, room.cells, millions * 1_000_000)?;
        for paths in PATHS {
            let spreads = spreads(room, &truth, paths)?;
            let area = |of: &dyn Fn(&TrueSpread) -> bool| -> f64 {
                spreads.iter().filter(|spread| of(spread)).map(|spread| spread.area).sum()
            };
            let all = area(&|_| true);
            let percent = |part: f64| format!("{:.0} %", 100.0 * part);
            write!(text, "| {} | {paths} | {} |", room.name, percent(area(&TrueSpread::is_true) / all))?;
            write!(
                text,
                " {} | {} |",
                percent(area(&TrueSpread::is_linear) / all),
                percent(ceiling(&spreads, FACTOR))
            )?;
            for class in 0..=LIMITS.len() {
                let own = area(&|spread| spread.class() == class);
                let reported = area(&|spread| spread.class() == class && spread.is_true());
                write!(
                    text,
                    " {}: {} |",
                    percent(own / all),
                    percent(reported / own.max(f64::MIN_POSITIVE))
                )?;
            }
            text.push('\n');
        }
    }
    fs::write(folder.join("spread.md"), text)?;
    Ok(())
}

/// What is true of the patches that are chosen for a job, and what a run of it tells.
fn spreads(room: &Room, truth: &Truth, paths: u64) -> Result<Vec<TrueSpread>, Failure> {
    let chosen = results::choose(&open_job(&room.spec, paths, 0)?, 1)?.ok_or("nothing is open")?;
    let cuts = chosen.partition.cuts;
    let experiment = experiment(&room.spec, &cuts, true)?;
    let (tally, long) = (walk(&experiment, 0, paths), walk(&experiment, 1 << 41, LONG));
    let estimates = Estimates::new(&experiment, &tally, 0.95);
    let faces = experiment.scene().faces();
    let mut spreads = Vec::new();
    for sheet in &truth.sheets {
        let first = faces.first_piece_on(sheet.surface as u32, sheet.side).expect("an active side");
        for (cell, face) in sheet.cut(&cuts[sheet.surface]).iter().zip(first as usize..) {
            let (Some(slopes), Some(fit)) = (estimates.slopes(face), experiment.fit(&long, face, 0)) else {
                continue;
            };
            if cell.whole > 0.0 {
                spreads.push(TrueSpread {
                    area: cell.area,
                    square: cell.lost(0).max(0.0) / cell.area,
                    linear: (cell.lost(0) - cell.lost(1)).max(0.0) / cell.area,
                    noise: fit.slope_variance * LONG as f64 / paths as f64,
                    reported: slopes[0].spread(),
                });
            }
        }
    }
    Ok(spreads)
}

/// The part of the area on which the best estimate is within a factor of the truth in the mean over runs: one that knows how many patches of
/// each spread there are, and of a run the slopes of the patch, with their noise.
///
/// A run finds the slopes c + σz, z normal, c and σ² those of the patch. The estimate is a function of |c + σz|²/σ²; for each value of it the best one is the middle
/// of the interval of that factor in which most area lies whose runs find this value.
fn ceiling(spreads: &[TrueSpread], factor: f64) -> f64 {
    // By value found: the true spread over its noise, and the area.
    let mut found = vec![Vec::new(); (2.0 * STEPS * OCTAVES) as usize];
    let sequence = Sequence::new(1);
    for (number, spread) in (0..).zip(spreads).filter(|(_, spread)| spread.noise > 0.0) {
        let mut numbers = sequence.walk(number);
        for _ in 0..RUNS {
            let [length, turn] = numbers.pair();
            let (radius, (sin, cos)) = ((-2.0 * length.ln()).sqrt(), (TAU * turn).sin_cos());
            // Each of both slopes has half of the noise.
            let (x, y) = ((2.0 * spread.linear / spread.noise).sqrt() + radius * cos, radius * sin);
            let step = STEPS * (OCTAVES + (0.5 * (x * x + y * y)).log2());
            let place = step.clamp(0.0, found.len() as f64 - 1.0) as usize;
            found[place].push(((spread.square / spread.noise).sqrt(), spread.area));
        }
    }
    let within: f64 = found.iter_mut().map(|found| most_within(found, factor * factor)).sum();
    within / (RUNS as f64 * spreads.iter().map(|spread| spread.area).sum::<f64>())
}

/// The most area of spreads that are within a ratio of each other.
fn most_within(spreads: &mut [(f64, f64)], ratio: f64) -> f64 {
    spreads.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    let (mut first, mut area, mut most) = (0, 0.0, 0.0_f64);
    for &(spread, own) in &*spreads {
        area += own;
        while spreads[first].0 * ratio < spread {
            area -= spreads[first].1;
            first += 1;
        }
        most = most.max(area);
    }
    most
}
