//! How much a surface's grid loses of the light, for ever finer grids.

use super::grid::Grid;
use super::laws::{Code, Laws, MeasuredDoublings};
use super::seen::{Basis, SurfaceLight};

/// Beyond the pilot's grid the gain is extrapolated over this many further doublings along each axis.
const BEYOND: u32 = 3;

/// The laws for some surfaces.
pub(crate) fn code(surfaces: &[SurfaceLight], basis: Basis) -> Code {
    let levels = surfaces.iter().flat_map(|light| light.top).max().unwrap_or(0) + BEYOND;
    Code::new(basis, levels)
}

/// One grid of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct GridStep {
    pub(crate) cut: Grid,
    /// The energy of what a fit on this grid leaves out of the light, as far as is known [W²/m²].
    pub(crate) lost: f64,
}

/// Ever finer grids of a surface.
pub(crate) struct Curve {
    /// Each of twice the cells of the one before it (of a triangle: four times).
    pub(crate) steps: Vec<GridStep>,
    /// Of each axis, how much likelier light is that varies along it than light that does not.
    pub(crate) odds: Vec<f64>,
}

/// The grids of a surface.
///
/// Each step doubles the cells along the axis that gains more. A gain is the energy that the finer grid catches beyond the coarser
/// one. It is measured without bias, with an error; and expected by the laws that measurements along the axis make likely.
/// Both are weighed by their errors: coarse doublings are known by measurement, fine ones, whose gains drown in the pilot's
/// noise, by extrapolation. What a grid loses is the sum of all gains that follow.
pub(crate) fn curve(light: &SurfaceLight, (basis, code): (Basis, &Code)) -> Curve {
    let mean = light.caught(basis, [0, 0]);
    let noise = light.noise[basis as usize] / basis.unknowns() / light.walks;
    let dark = mean <= 0.0 || noise <= 0.0;
    if !light.free || dark {
        let lost = if light.free { 0.0 } else { (light.energy() - mean).max(0.0) };
        return Curve { steps: vec![GridStep { cut: light.base, lost }], odds: Vec::new() };
    }
    let seen = SeenLight { light, basis, noise };
    let axes = match light.base {
        Grid::Quad(_) => 2,
        Grid::Triangle(_) => 1,
    };
    let mut laws: Vec<Laws> = (0..axes).map(|_| Laws::new(code, mean)).collect();
    let (mut levels, mut cuts, mut taken) = ([0, 0], vec![light.base], Vec::new());
    loop {
        let open = (0..axes).filter(|&axis| levels[axis] < light.top[axis] + BEYOND);
        let promises = open.map(|axis| (axis, promise(seen, levels, axis, &laws[axis])));
        let next = promises.max_by(|(a, one), (b, other)| {
            let length = |axis: usize| light.edges[axis] / f64::from(1_u32 << levels[axis]);
            one.total_cmp(other).then(length(*a).total_cmp(&length(*b)))
        });
        let Some((axis, _)) = next else { break };
        let measured = measured(seen, levels, axis, 1);
        if let Some(measured) = &measured {
            laws[axis].learn(levels[axis] as usize, measured);
        }
        taken.push((axis, levels[axis] as usize, measured));
        levels[axis] += 1;
        cuts.push(light.base.doubled(levels));
    }
    let gains = taken.iter().map(|(axis, level, measured)| laws[*axis].gain(*level, measured.as_ref()));
    Curve { steps: steps(&cuts, &gains.collect::<Vec<f64>>()), odds: laws.iter().map(Laws::odds).collect() }
}

/// What each grid loses: the sum of the gains after it.
fn steps(cuts: &[Grid], gains: &[f64]) -> Vec<GridStep> {
    let mut lost = 0.0;
    let mut steps = vec![GridStep { cut: cuts[gains.len()], lost }];
    for (&cut, gain) in cuts.iter().zip(gains).rev() {
        lost += gain;
        steps.push(GridStep { cut, lost });
    }
    steps.reverse();
    steps
}

/// The light on a surface as a pilot saw it, in one basis.
#[derive(Clone, Copy)]
struct SeenLight<'a> {
    light: &'a SurfaceLight,
    basis: Basis,
    /// The noise of one unknown [W²/m²].
    noise: f64,
}

/// What a doubling along an axis gains, or it and the next one in the mean, where that is more: by it axes are compared.
fn promise(seen: SeenLight<'_>, levels: [u32; 2], axis: usize, laws: &Laws) -> f64 {
    let level = levels[axis] as usize;
    let of = |doublings: u32| {
        let measured = measured(seen, levels, axis, doublings)?;
        Some(laws.measured_gain(level, doublings as usize, &measured) / f64::from(doublings))
    };
    match (of(1), of(2)) {
        (Some(one), Some(two)) => one.max(two),
        (Some(one), None) => one,
        (None, _) => laws.expected(level),
    }
}

/// What some doublings along an axis were seen to gain; `None` beyond the pilot's grid.
fn measured(
    SeenLight { light, basis, noise }: SeenLight<'_>,
    levels: [u32; 2],
    axis: usize,
    doublings: u32,
) -> Option<MeasuredDoublings> {
    let mut finer = levels;
    finer[axis] += doublings;
    (finer[axis] <= light.top[axis]).then(|| MeasuredDoublings {
        gain: light.caught(basis, finer) - light.caught(basis, levels),
        noise,
        unknowns: basis.unknowns() * (light.cells(finer) - light.cells(levels)),
    })
}
