//! The choice of patches: how every surface is cut, and whether light is fitted by constants or by linear functions, from
//! what a pilot has seen.
//!
//! The error of a result has two parts. *Noise* grows with the number of unknowns: n cells of a surface err by n times what one
//! cell does, for as many walks. *Discretisation* falls with it. For every surface the rule takes the grid of the least sum of
//! both; with linear fits, rectangles or triangles of different sizes where its shape allows.

mod clusters;
mod curve;
mod finer;
mod gains;
mod grid;
mod images;
mod laws;
mod merged;
mod mesh;
mod missed;
mod moments;
mod part;
mod quarters;
mod seen;
mod tree;

use job::Cut;

pub use self::clusters::{Cluster, Clusters};
use self::curve::{Curve, GridStep, code, curve};
pub use self::finer::Finer;
pub use self::grid::Grid;
pub use self::merged::{around, merged};
pub use self::mesh::{Grouped, MeshLight};
pub use self::missed::{Missed, PatchControl};
use self::quarters::Triangles;
pub use self::seen::{Basis, PilotTallies, SurfaceLight, doublings};
use self::tree::{JobWalks, Start, rectangles};

/// The light counts as even where the likelihood that it varies along some of the axes of all surfaces, over that of light that varies along none, is
/// below this. Even light passes it once in 20 pilots at most, since the mean of such ratios is 1 there.
const UNEVEN: f64 = 20.0;

/// A first look of few walks tells that the light is even where that ratio is below this.
const SURELY_EVEN: f64 = 1.0;

/// The part of all axes along which light that is not even is expected to vary.
const VARIED: f64 = 0.1;

/// Twice the walks pay where they leave less than this part of an error's square.
const PAYS: f64 = 0.98;

/// The chosen cut of each surface, the basis for all of them, and the predicted errors.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// The cut of each surface.
    pub cuts: Vec<Cut>,
    /// Of each surface the patch of each cell, counted from 0 in the order of first cells; `None` where every cell is a patch.
    pub patches: Vec<Option<Vec<u32>>>,
    /// What is fitted to the light on every patch.
    pub basis: Basis,
    /// The walks that it is for.
    pub walks: f64,
    /// The predicted noise [W²/m²].
    pub noise: f64,
    /// The predicted energy that the fits leave out [W²/m²].
    pub lost: f64,
}

impl Choice {
    /// The energy of the whole error [W²/m²].
    pub fn error(&self) -> f64 {
        self.noise + self.lost
    }
}

/// What is known of a surface: what the pilot saw of it, and the grids that it may get.
struct Ladder<'a> {
    light: &'a SurfaceLight,
    steps: Vec<GridStep>,
}

/// A cut of a surface with the predicted noise and the energy that its fits leave out [W²/m²].
struct PredictedCut {
    cut: Cut,
    /// As in [`Choice::patches`].
    patches: Option<Vec<u32>>,
    noise: f64,
    lost: f64,
}

impl Ladder<'_> {
    /// What is predicted of a grid.
    fn of_grid(&self, step: &GridStep, basis: Basis, walks: f64) -> PredictedCut {
        let noise = self.light.noise[basis as usize] * step.cut.cells() as f64 / walks;
        PredictedCut { cut: step.cut.cut(), patches: None, noise, lost: step.lost }
    }

    /// The surface as a whole, where nothing tells that its light varies.
    fn whole(&self, basis: Basis, walks: f64) -> PredictedCut {
        let lost = if self.steps.len() > 1 { 0.0 } else { self.steps[0].lost };
        self.of_grid(&GridStep { lost, ..self.steps[0] }, basis, walks)
    }

    /// The cut of the least error: parts of different sizes, of which a grid is one case, or a grid where only grids may be had.
    fn best(&self, basis: Basis, walks: f64) -> PredictedCut {
        self.of_tree(basis, walks).unwrap_or_else(|| {
            let grids = self.steps.iter().map(|step| self.of_grid(step, basis, walks));
            let best = grids.min_by(|a, b| (a.noise + a.lost).total_cmp(&(b.noise + b.lost)));
            best.expect("a surface has a coarsest grid")
        })
    }

    /// What is predicted of the best parts of different sizes: all that the laws of grids say there is beyond what they catch.
    fn of_tree(&self, basis: Basis, walks: f64) -> Option<PredictedCut> {
        if basis != Basis::Linear || self.steps.len() == 1 {
            return None;
        }
        let whole = self.light.caught(basis, [0, 0]) + self.steps[0].lost;
        let job_walks = JobWalks { pilot: self.light.walks, job: walks };
        if let Some(images) = &self.light.images {
            let tree = rectangles(images, job_walks, Start::SURFACE);
            let lost = (whole - tree.caught).max(tree.left);
            return Some(PredictedCut {
                cut: Cut::Leaves(tree.leaves),
                patches: None,
                noise: tree.noise / walks,
                lost,
            });
        }
        let Triangles { rows, patch_of_cell, noise, caught, left } =
            self.light.quarters.as_ref()?.triangles(job_walks, Start::SURFACE);
        let lost = (whole - caught).max(left);
        let is_grid = patch_of_cell.iter().zip(0..).all(|(&patch, cell)| patch == cell);
        let patches = Some(patch_of_cell).filter(|_| !is_grid);
        Some(PredictedCut { cut: Cut::Rows(rows), patches, noise: noise / walks, lost })
    }
}

/// The noise that all cells of some surfaces have in common after one walk [W²/m²]. Hits of one walk go together, so that coarse cells, which walks
/// hit more than once, err by more than the noise of as many fine ones. Where they do not, chance alone makes the sum differ from 0.
pub fn shared_noise(surfaces: &[SurfaceLight]) -> f64 {
    surfaces.iter().map(|light| light.shared).sum()
}

/// The cuts that some surfaces may get, under each basis that may be chosen.
pub struct CutCandidates<'a> {
    /// What every surface may get, by basis.
    by_basis: Vec<(Basis, Vec<Ladder<'a>>)>,
    /// How much likelier light is that varies along some axes than light that varies along none.
    unevenness: f64,
    /// The noise that cells have in common after one walk, whatever their cuts [W²/m²].
    shared: f64,
}

impl<'a> CutCandidates<'a> {
    /// The candidates of a pilot, whose cells have some noise in common after one walk [W²/m²].
    pub fn new(surfaces: &'a [SurfaceLight], shared: f64, bases: &[Basis]) -> Self {
        let curves = |basis: Basis| {
            let code = code(surfaces, basis);
            surfaces.iter().map(|light| curve(light, (basis, &code))).collect::<Vec<Curve>>()
        };
        let constant = curves(Basis::Constant);
        let odds: Vec<f64> = constant.iter().flat_map(|curve| &curve.odds).copied().collect();
        let unevenness =
            odds.iter().fold(1.0_f64, |all, odds| (all * (1.0 - VARIED + VARIED * odds)).min(f64::MAX));
        let ladder = |(light, curve): (&'a SurfaceLight, Curve)| Ladder { light, steps: curve.steps };
        let of =
            |basis: Basis, curves: Vec<Curve>| (basis, surfaces.iter().zip(curves).map(ladder).collect());
        let mut by_basis = Vec::new();
        if bases.contains(&Basis::Constant) {
            by_basis.push(of(Basis::Constant, constant));
        }
        if bases.contains(&Basis::Linear) {
            by_basis.push(of(Basis::Linear, curves(Basis::Linear)));
        }
        CutCandidates { by_basis, unevenness, shared: shared.max(0.0) }
    }

    /// Whether nothing tells that the light varies: then every surface stays whole.
    fn are_even(&self) -> bool {
        self.unevenness <= UNEVEN
    }

    /// Whether few walks are enough to tell that the light does not vary.
    pub fn are_surely_even(&self) -> bool {
        self.unevenness <= SURELY_EVEN
    }

    /// The bases that may be chosen: where light is known to vary, linear fits alone, if they are among the candidates. Constants lose more in hot
    /// spots than their laws predict, by factors of up to ten where lamps hang below ceilings.
    pub fn bases(&self) -> impl Iterator<Item = Basis> {
        let only_linear = !self.are_even() && self.by_basis.iter().any(|(basis, _)| *basis == Basis::Linear);
        let bases = self.by_basis.iter().map(|(basis, _)| *basis);
        bases.filter(move |basis| !only_linear || *basis == Basis::Linear)
    }

    /// The choice of the least error after a number of walks; of two that err alike the one with constants, which come first.
    pub fn choose(&self, walks: f64) -> Choice {
        let choices = self.bases().map(|basis| self.choose_basis(basis, walks));
        let best = choices.min_by(|a, b| a.error().total_cmp(&b.error()));
        best.expect("some basis may be chosen")
    }

    /// The choice of the least error after a number of walks under a basis that is among the candidates.
    ///
    /// # Panics
    /// Where it is not.
    pub fn choose_basis(&self, basis: Basis, walks: f64) -> Choice {
        let (_, surfaces) = self.by_basis.iter().find(|(own, _)| *own == basis).expect("a candidate");
        let noise = self.shared / walks;
        let mut choice = Choice { cuts: Vec::new(), patches: Vec::new(), basis, walks, noise, lost: 0.0 };
        for ladder in surfaces {
            let PredictedCut { cut, patches, noise, lost } = match self.are_even() {
                true => ladder.whole(basis, walks),
                false => ladder.best(basis, walks),
            };
            choice.cuts.push(cut);
            choice.patches.push(patches);
            choice.noise += noise;
            choice.lost += lost;
        }
        choice
    }

    /// The choice for the fewest walks, of `least` and its doubles up to `most`, whose error is predicted to be below an energy, or to
    /// be [hardly less](fewest) after twice as many; that for `most` where there is none.
    pub fn choose_for(&self, error: f64, least: f64, most: f64) -> Choice {
        fewest([least, most], error, |choice| choice, |walks| self.choose(walks))
    }
}

/// A choice for the fewest walks, of the first number and its doubles up to the second, whose error is below an energy. Where its noise alone is below
/// that, and twice as many walks take hardly any of the error, the fewest as well: what is left is for want of cells in the pilot, of
/// which more walks of the job tell nothing.
pub fn fewest<T>(
    [least, most]: [f64; 2],
    enough: f64,
    of: impl Fn(&T) -> &Choice,
    mut choose: impl FnMut(f64) -> T,
) -> T {
    let mut walks = least.min(most);
    let mut made = choose(walks);
    while of(&made).error() > enough && walks < most {
        walks = (2.0 * walks).min(most);
        let next = choose(walks);
        if of(&made).noise <= enough && of(&next).error() > PAYS * of(&made).error() {
            break;
        }
        made = next;
    }
    made
}

#[cfg(test)]
mod tests;
