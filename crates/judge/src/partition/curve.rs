//! How much a surface's grid loses of the light, for ever finer grids.

use job::Cut;

use super::seen::{Basis, SurfaceLight};

/// Beyond the pilot's grid the gain is extrapolated over this many further doublings along each axis.
const BEYOND: u32 = 3;

/// A doubling gains at most this part of what the one before it along the axis has gained: that is the decay at the edge of a
/// shadow. Smooth light decays by 1/4 (constants) or 1/16 (linear fits).
const SLOWEST: f64 = 0.5;

/// What a doubling is taken to gain, over the one before it, where no gain tells.
const USUAL: f64 = 0.25;

/// The first doublings along an axis of which nothing is known beforehand: the light of a symmetric scene may hide from the
/// first.
const UNTOLD: usize = 2;

/// A gain counts as seen, whatever was expected of it, where it exceeds that by this number of standard errors.
const SURPRISE: f64 = 3.0;

/// One grid of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Step {
    pub(crate) cut: Cut,
    /// The energy of what a fit on this grid leaves out of the light, as far as can be told [W²/m²].
    pub(crate) lost: f64,
}

/// Ever finer grids of a surface, each of twice the cells of the one before it (of a triangle: four times).
///
/// Each step doubles the cells along the axis that gains more. A gain is the energy that the finer grid catches beyond the coarser
/// one. It is measured without bias, with an error; and expected to be a part of the gain of the doubling before it along the axis.
/// Both are weighed by their errors: coarse doublings are known by measurement, fine ones, whose gains drown in the pilot's
/// noise, by extrapolation. What a grid loses is the sum of all gains that follow.
pub(crate) fn curve(light: &SurfaceLight, basis: Basis) -> Vec<Step> {
    if !light.free {
        let lost = (light.energy() - light.caught(basis, [0, 0])).max(0.0);
        return vec![Step { cut: light.base, lost }];
    }
    let axes = match light.base {
        Cut::Grid(_) => 2,
        Cut::Rows(_) => 1,
    };
    let mut histories = [History::new(basis), History::new(basis)];
    let (mut levels, mut cuts, mut gains) = ([0, 0], vec![light.base], Vec::new());
    loop {
        let open = (0..axes).filter(|&axis| levels[axis] < light.top[axis] + BEYOND);
        let promises = open.map(|axis| (axis, gain(light, basis, levels, axis, &histories[axis])));
        let next = promises.max_by(|(a, one), (b, other)| {
            let length = |axis: usize| light.edges[axis] / f64::from(1_u32 << levels[axis]);
            one.promise.total_cmp(&other.promise).then(length(*a).total_cmp(&length(*b)))
        });
        let Some((axis, Gain { gain, .. })) = next else { break };
        histories[axis].push(gain);
        levels[axis] += 1;
        gains.push(gain);
        cuts.push(light.base.doubled(levels));
    }
    let mut lost: f64 = histories[..axes].iter().map(History::rest).sum();
    let mut steps: Vec<Step> = cuts
        .into_iter()
        .rev()
        .enumerate()
        .map(|(i, cut)| {
            if i > 0 {
                lost += gains[gains.len() - i];
            }
            Step { cut, lost }
        })
        .collect();
    steps.reverse();
    steps
}

/// What a doubling gains.
struct Gain {
    gain: f64,
    /// What it and the next one along the axis gain in the mean, where that is more: by it axes are compared.
    promise: f64,
}

fn gain(light: &SurfaceLight, basis: Basis, levels: [u32; 2], axis: usize, history: &History) -> Gain {
    let finer = |doublings: u32| {
        let mut finer = levels;
        finer[axis] += doublings;
        finer
    };
    let expected = history.expected();
    if levels[axis] >= light.top[axis] {
        return Gain { gain: expected, promise: expected };
    }
    let (seen, variance) = measured(light, basis, levels, finer(1));
    let gain = match history.gains.len() < UNTOLD {
        true => shrunk(seen, variance),
        false => history.weighed(seen, variance),
    };
    let promise = match levels[axis] + 1 < light.top[axis] {
        true => {
            let (both, variance) = measured(light, basis, levels, finer(2));
            gain.max(0.5 * shrunk(both, variance))
        }
        false => gain,
    };
    Gain { gain, promise }
}

/// What a finer grid catches beyond a coarser one, and the variance of that. Of c², c a coefficient of variance ν: 4c²ν + 2ν².
fn measured(light: &SurfaceLight, basis: Basis, from: [u32; 2], to: [u32; 2]) -> (f64, f64) {
    let seen = light.caught(basis, to) - light.caught(basis, from);
    let noise = light.noise[basis as usize] / basis.unknowns() / light.walks;
    let more = basis.unknowns() * (light.cells(to) - light.cells(from));
    (seen, (4.0 * seen.max(0.0) + 2.0 * more * noise) * noise)
}

/// An estimate less what of its square is likely noise.
fn shrunk(seen: f64, variance: f64) -> f64 {
    if seen > 0.0 { (seen - variance / seen).max(0.0) } else { 0.0 }
}

/// The gains of the doublings along one axis so far.
struct History {
    gains: Vec<f64>,
    /// The most that a doubling may be expected to gain by what the ones before it have gained.
    envelope: f64,
    fastest: f64,
}

impl History {
    fn new(basis: Basis) -> Self {
        let fastest = match basis {
            Basis::Constant => 0.25,
            Basis::Linear => 0.0625,
        };
        History { gains: Vec::new(), envelope: 0.0, fastest }
    }

    fn push(&mut self, gain: f64) {
        self.envelope = gain.max(SLOWEST * self.envelope);
        self.gains.push(gain);
    }

    /// The part of the last gain that the next one is expected to be.
    fn decay(&self) -> f64 {
        match self.gains[..] {
            [.., before, last] if before > 0.0 => (last / before).clamp(self.fastest, SLOWEST),
            _ => USUAL,
        }
    }

    fn expected(&self) -> f64 {
        self.gains.last().map_or(0.0, |last| self.decay() * last)
    }

    /// A measured gain, weighed against the expected one, whose error is about the envelope.
    fn weighed(&self, seen: f64, variance: f64) -> f64 {
        let (expected, doubt) = (self.expected(), (SLOWEST * self.envelope).powi(2));
        let surprise = seen - expected;
        if surprise > 0.0 && surprise * surprise > SURPRISE * SURPRISE * (variance + doubt) {
            return shrunk(seen, variance);
        }
        match variance + doubt > 0.0 {
            true => ((seen * doubt + expected * variance) / (variance + doubt)).max(0.0),
            false => seen.max(0.0),
        }
    }

    /// All that doublings beyond the last one gain together.
    fn rest(&self) -> f64 {
        let decay = self.decay();
        self.gains.last().map_or(0.0, |last| last * decay / (1.0 - decay))
    }
}
