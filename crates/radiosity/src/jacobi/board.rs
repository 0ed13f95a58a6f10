//! Where chains score: exact sums of whole chains.

use super::outcome::ChainOutcome;
use crate::scene::Scene;
use crate::tally::{Counts, Layout, MOMENTS, Overflow, Tally};

/// Units of score in the largest radiosity that a channel can have: H is scored in fixed point.
pub(crate) const UNITS: f64 = (1_u64 << 40) as f64;

/// The power sums of the scores of chains.
#[derive(Clone, Debug)]
pub struct ChainBoard {
    /// Chains, and how their rays ended.
    pub counts: Counts,
    layout: Layout,
    patches: usize,
    /// Patch-major; `None` once one has left its range.
    sums: Option<Vec<u128>>,
}

impl ChainBoard {
    /// An empty board of one score per channel, which has this number of slopes.
    pub(crate) fn new(patches: usize, channels: usize, slopes: usize) -> Self {
        let layout = Layout { scores: channels, moments: MOMENTS, slopes: slopes * channels, events: true };
        ChainBoard {
            counts: Counts::default(),
            layout,
            patches,
            sums: Some(vec![0; patches * layout.columns()]),
        }
    }

    /// What [`ChainBoard::take`] hands over.
    pub fn layout(&self) -> Layout {
        self.layout
    }

    /// Scores one chain: H of each patch over `largest`, that of [`largest_radiosity`], and the rays that landed.
    pub(crate) fn add(&mut self, largest: &[f64; 3], outcome: &ChainOutcome) {
        let channels = self.layout.scores;
        let columns = outcome.landed.iter().enumerate().flat_map(|(i, &landed)| {
            let irradiance = &outcome.irradiance[i * channels..][..channels];
            let scores = irradiance.iter().zip(largest).map(|(h, largest)| units(*h, *largest));
            let of_slopes = outcome.slopes.chunks_exact(channels).nth(i).unwrap_or_default();
            let slopes = scores.clone().zip(of_slopes).zip(largest).flat_map(|((score, slopes), largest)| {
                slopes.iter().flat_map(move |slope| slope_powers(score, slope / largest))
            });
            let columns = scores.flat_map(powers).chain(slopes);
            columns.chain([Some(u128::from(landed))]).collect::<Vec<_>>()
        });
        self.sums = self.sums.take().and_then(|sums| {
            sums.into_iter().zip(columns).map(|(sum, column)| sum.checked_add(column?)).collect()
        });
    }

    /// Hands over all that was scored and empties the board.
    ///
    /// # Errors
    /// Where a sum has left its range.
    pub fn take(&mut self) -> Result<Tally, Overflow> {
        let empty = vec![0; self.patches * self.layout.columns()];
        let sums = self.sums.replace(empty).ok_or(Overflow)?;
        let counts = std::mem::take(&mut self.counts);
        Ok(Tally::from_parts(counts, self.patches, self.layout, sums).expect("the layout is the board's own"))
    }

    /// Adds all that was scored to a tally of this layout and empties the board.
    ///
    /// # Errors
    /// Where a sum has left its range; then the tally is unusable.
    pub fn add_to(&mut self, tally: &mut Tally) -> Result<(), Overflow> {
        tally.merge(&self.take()?).map_err(|_| Overflow)
    }
}

/// max E/(1 − max R) [W/m²] of each channel: no radiosity, and so no irradiance, exceeds it. 1 where there is no light.
pub(crate) fn largest_radiosity(scene: &Scene) -> [f64; 3] {
    let faces = scene.faces();
    let lit = faces.pieces_of_emitters().map(|piece| faces.piece(piece).emittance);
    let most = lit.fold([0.0_f64; 3], |most, emittance| std::array::from_fn(|c| most[c].max(emittance[c])));
    std::array::from_fn(|channel| {
        let emittance = most[channel];
        if emittance > 0.0 { emittance / (1.0 - scene.max_reflectance()[channel]) } else { 1.0 }
    })
}

/// The nearest whole number of units. Rounding is below 10⁻¹² of the largest radiosity; below 0 is rounding, too.
fn units(irradiance: f64, largest: f64) -> u128 {
    (irradiance / largest * UNITS + 0.5) as u128
}

/// x + d and d² of the nearest slope d to `slope`, in units, that does not exceed its score x.
fn slope_powers(x: u128, slope: f64) -> [Option<u128>; MOMENTS] {
    let d = ((slope * UNITS).round() as i128).clamp(-(x as i128), x as i128);
    [x.checked_add_signed(d), d.unsigned_abs().checked_pow(2)]
}

/// x and x², where they fit.
fn powers(x: u128) -> [Option<u128>; MOMENTS] {
    [Some(x), x.checked_pow(2)]
}
