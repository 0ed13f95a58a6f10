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

/// The part of a surface's energy that the first doubling along an axis gains where the pilot cannot tell, by constants and by
/// linear fits: light that varies by some tenths of itself.
const TYPICAL: [f64; 2] = [0.03, 0.005];

/// Light counts as varying along an axis once a doubling there gains this number of standard errors.
const SEEN: f64 = 2.0;

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
    let energy = light.caught(basis, [0, 0]).max(0.0);
    let mut histories = [History::new(basis, energy), History::new(basis, energy)];
    let (mut levels, mut cuts, mut gains) = ([0, 0], vec![light.base], Vec::new());
    loop {
        let open = (0..axes).filter(|&axis| levels[axis] < light.top[axis] + BEYOND);
        let promises = open.map(|axis| (axis, gain(light, basis, levels, axis, &histories[axis])));
        let next = promises.max_by(|(a, one), (b, other)| {
            let length = |axis: usize| light.edges[axis] / f64::from(1_u32 << levels[axis]);
            one.promise.total_cmp(&other.promise).then(length(*a).total_cmp(&length(*b)))
        });
        let Some((axis, next)) = next else { break };
        gains.push(next.gain);
        histories[axis].push(next);
        levels[axis] += 1;
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
            Step { cut, lost: lost.max(0.0) }
        })
        .collect();
    steps.reverse();
    steps
}

/// What a doubling gains.
struct Gain {
    gain: f64,
    /// Whether it stands out from the noise of its measurement.
    seen: bool,
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
        return Gain { gain: expected, seen: false, promise: expected };
    }
    let (gain, seen) = history.weighed(measured(light, basis, levels, finer(1)), 1.0);
    let promise = match levels[axis] + 1 < light.top[axis] {
        true => {
            let (both, _) = history.weighed(measured(light, basis, levels, finer(2)), 1.0 + history.decay());
            gain.max(0.5 * both)
        }
        false => gain,
    };
    Gain { gain, seen, promise }
}

/// What a finer grid catches beyond a coarser one, and the variance of that. Of c², c a coefficient of variance ν: 4c²ν + 2ν².
fn measured(light: &SurfaceLight, basis: Basis, from: [u32; 2], to: [u32; 2]) -> (f64, f64) {
    let seen = light.caught(basis, to) - light.caught(basis, from);
    let noise = light.noise[basis as usize] / basis.unknowns() / light.walks;
    let more = basis.unknowns() * (light.cells(to) - light.cells(from));
    (seen, (4.0 * seen.max(0.0) + 2.0 * more * noise) * noise)
}

/// The gains of the doublings along one axis so far.
struct History {
    gains: Vec<f64>,
    /// Whether one of them was seen, so that the next ones are expected to be parts of it.
    varies: bool,
    /// What the next doubling gains where nothing is known of this axis.
    typical: f64,
    fastest: f64,
}

impl History {
    fn new(basis: Basis, energy: f64) -> Self {
        let fastest = match basis {
            Basis::Constant => 0.25,
            Basis::Linear => 0.0625,
        };
        History { gains: Vec::new(), varies: false, typical: TYPICAL[basis as usize] * energy, fastest }
    }

    /// Takes note of a gain, and whether it was seen.
    fn push(&mut self, Gain { gain, seen, .. }: Gain) {
        let gain = gain.max(0.0);
        self.varies |= seen;
        // The light of a symmetric surface hides from the first doubling: halves have equal means.
        self.typical = USUAL * if self.gains.is_empty() { self.typical } else { gain };
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
        match (self.varies, self.gains.last()) {
            (true, Some(last)) => self.decay() * last,
            _ => self.typical,
        }
    }

    /// What a doubling gains by a measurement with a variance, and whether that was seen. Of several doublings at once the expected
    /// gain is that of the next one, this many times.
    ///
    /// Where light varies along the axis, the measurement is weighed against what is expected, whose doubt is the last gain. Where it
    /// has not been seen to vary, a gain counts as far as it stands out from its noise: halves of a surface without any differ, too.
    fn weighed(&self, (seen, variance): (f64, f64), times: f64) -> (f64, bool) {
        let noise = SEEN * SEEN * variance;
        let stands_out = seen > 0.0 && seen * seen > noise;
        let last = self.gains.last().copied().unwrap_or(0.0);
        let (found, doubt) = match (self.varies, stands_out) {
            (true, true) => (seen, times * last.max(seen)),
            (true, false) => (seen, times * last),
            (false, true) => (seen - noise / seen, times * self.typical.max(seen)),
            (false, false) => (0.0, times * self.typical),
        };
        let (expected, doubt) = (times * self.expected(), doubt * doubt);
        let sum = variance + doubt;
        let gain = if sum > 0.0 { (found * doubt + expected * variance) / sum } else { found };
        (gain, stands_out)
    }

    /// All that doublings beyond the last one gain together.
    fn rest(&self) -> f64 {
        let decay = self.decay();
        self.gains.last().map_or(0.0, |last| last * decay / (1.0 - decay))
    }
}
