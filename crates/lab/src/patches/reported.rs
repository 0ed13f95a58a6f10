//! Whether what a run tells of its errors is true: spread and total of each patch, and of the whole.

use job::Cut;
use radiosity::{Estimates, SceneSpec};

use super::runs::{Failure, experiment, noise, walk};
use super::truth::Truth;
use crate::walking::SeededWalks;

/// What a run tells is true enough within this factor.
pub const FACTOR: f64 = 1.5;

/// Walks that tell the true noise of a patch.
pub const LONG: u64 = 1 << 23;

/// The part of the area whose spread, and whose error, is reported within [`FACTOR`]; and what the whole run tells of its total error, over
/// the truth.
#[derive(Clone, Copy)]
pub struct ReportedSpread {
    pub spread: f64,
    pub error: f64,
    pub total: f64,
}

/// Whether a reported figure is near enough to the truth.
pub fn near(reported: f64, truth: f64) -> bool {
    truth > 0.0 && reported <= FACTOR * truth && truth <= FACTOR * reported
}

impl ReportedSpread {
    /// Of a run of some walks with the linear basis on a grid, whose means are taken for the light of their patches.
    pub fn new(
        spec: &SceneSpec,
        truth: &Truth,
        cuts: &[Cut],
        SeededWalks { seed, walks }: SeededWalks,
    ) -> Result<Self, Failure> {
        let experiment = experiment(spec, cuts, true)?;
        let (tally, long) = (walk(&experiment, seed, walks), walk(&experiment, 1 << 41, LONG));
        let estimates = Estimates::new(&experiment, &tally, 0.95);
        let faces = experiment.scene().faces();
        let [mut area, mut of_spread, mut of_error, mut lost, mut light] = [0.0; 5];
        for sheet in &truth.sheets {
            let cells = sheet.cut(&cuts[sheet.surface]);
            let first = faces.first_piece_on(sheet.surface as u32, sheet.side).expect("an active side");
            for (cell, face) in cells.iter().zip(first as usize..) {
                let (Some(known), Some(slopes)) = (estimates.face(face), estimates.slopes(face)) else {
                    continue;
                };
                if cell.whole <= 0.0 {
                    continue;
                }
                let variance = experiment.fit(&long, face, 0).map_or(0.0, |fit| fit.mean_variance);
                let variance = variance * LONG as f64 / walks as f64;
                let square = cell.lost(0) / cell.area;
                let spread = slopes[0].spread();
                let error = known[0].std_error.unwrap_or(0.0).hypot(spread);
                area += cell.area;
                of_spread += if near(spread, square.max(0.0).sqrt()) { cell.area } else { 0.0 };
                of_error += if near(error, (square.max(0.0) + variance).sqrt()) { cell.area } else { 0.0 };
                lost += cell.lost(0);
                light += cell.whole;
            }
        }
        let total = ((noise(&experiment, &long)[0] / walks as f64 + lost) / light).sqrt();
        let reported = estimates.accuracy().map_or(f64::NAN, |accuracy| accuracy.total);
        Ok(ReportedSpread { spread: of_spread / area, error: of_error / area, total: reported / total })
    }
}
