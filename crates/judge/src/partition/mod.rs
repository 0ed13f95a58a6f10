//! The choice of patches: which grid every surface gets, and whether light is fitted by constants or by linear functions, from
//! what a pilot has seen.
//!
//! The error of a result has two parts. *Noise* grows with the number of unknowns: n cells of a surface err by n times what one
//! cell does, for as many walks. *Discretisation* falls with it. For every surface the rule takes the grid of the least sum of
//! both.

mod curve;
mod laws;
mod seen;

use job::Cut;

use self::curve::{Curve, Step, curve};
pub use self::seen::{Basis, PilotTallies, SurfaceLight, doublings};

/// The light counts as even where the likelihood that it varies along an axis, over that of light that does not, is below this in the
/// mean over all axes of all surfaces. Even light passes it once in 20 pilots at most, since the mean of such ratios is 1 there.
const UNEVEN: f64 = 20.0;

/// Grids for some surfaces, a basis for all, and the errors that are foretold.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// The grid of each surface.
    pub cuts: Vec<Cut>,
    /// What is fitted to the light on every patch.
    pub basis: Basis,
    /// The walks that it is for.
    pub walks: f64,
    /// The foretold noise [W²/m²].
    pub noise: f64,
    /// The foretold energy that the fits leave out [W²/m²].
    pub lost: f64,
}

impl Choice {
    /// The energy of the whole error [W²/m²].
    pub fn error(&self) -> f64 {
        self.noise + self.lost
    }
}

/// What is known of a surface: the energy of the error of one cell after one walk, and the grids that it may get.
type Ladder = (f64, Vec<Step>);

/// The grids that some surfaces may get, under each basis that may be chosen.
pub struct Candidates {
    /// What every surface may get, by basis.
    by_basis: Vec<(Basis, Vec<Ladder>)>,
    /// Whether nothing tells that the light varies: then every surface stays whole.
    even: bool,
}

impl Candidates {
    /// The candidates of a pilot.
    pub fn new(surfaces: &[SurfaceLight], bases: &[Basis]) -> Self {
        let curves = |basis: Basis| surfaces.iter().map(move |light| curve(light, basis));
        let odds: Vec<f64> = curves(Basis::Constant).flat_map(|curve| curve.odds).collect();
        let even = odds.iter().sum::<f64>() <= UNEVEN * odds.len() as f64;
        let of = |&basis: &Basis| {
            let noise = surfaces.iter().map(|light| light.noise[basis as usize]);
            (basis, noise.zip(curves(basis).map(|Curve { steps, .. }| steps)).collect())
        };
        Candidates { by_basis: bases.iter().map(of).collect(), even }
    }

    /// Whether nothing tells that the light varies.
    pub fn are_even(&self) -> bool {
        self.even
    }

    /// The choice of the least error after a number of walks; of two that err alike the one with constants, which come first.
    pub fn choose(&self, walks: f64) -> Choice {
        let choices = self.by_basis.iter().map(|(basis, surfaces)| {
            let mut choice = Choice { cuts: Vec::new(), basis: *basis, walks, noise: 0.0, lost: 0.0 };
            for (noise, steps) in surfaces {
                let error = |step: &Step| noise * step.cut.cells() as f64 / walks + step.lost;
                let whole = Step { lost: if steps.len() > 1 { 0.0 } else { steps[0].lost }, ..steps[0] };
                let best = match self.even {
                    true => Some(&whole),
                    false => steps.iter().min_by(|a, b| error(a).total_cmp(&error(b))),
                };
                let best = best.expect("a surface has a coarsest grid");
                choice.cuts.push(best.cut);
                choice.noise += error(best) - best.lost;
                choice.lost += best.lost;
            }
            choice
        });
        let best = choices.min_by(|a, b| a.error().total_cmp(&b.error()));
        best.expect("some basis may be chosen")
    }

    /// The choice for the fewest walks, of `least` and its doubles up to `most`, whose error is foretold to be below an energy;
    /// that for `most` where there is none.
    pub fn choose_for(&self, error: f64, least: f64, most: f64) -> Choice {
        let mut walks = least.min(most);
        loop {
            let choice = self.choose(walks);
            if choice.error() <= error || walks >= most {
                return choice;
            }
            walks = (2.0 * walks).min(most);
        }
    }
}

#[cfg(test)]
mod tests;
