//! The choice of rectangles for one surface: a tree of cuts, each in the middle of a part, along u or along v.
//!
//! A cut *gains* the energy that the linear fits on both halves catch beyond the one on the part. It costs the noise of three unknowns
//! more. What a pilot sees of a gain has an error of some noise of the pilot, which has far fewer walks than the job: most of the cuts
//! that pay gain less than that. So the tree is found in two steps. First the cuts that the pilot *proves*: the tree whose gains
//! exceed [`PROOF`] times what three unknowns cost in the pilot by the most, found from the finest cells up. Then further cuts of its
//! parts as they are *expected* to pay: gains fall from one cut to the next as they do in smooth light, unless the pilot sees
//! otherwise, and measurement and expectation are weighed by their variances.

use radiosity::surfaces::{CutCell, Leaves};

use super::images::{Images, halved, levels};

/// A proven cut gains this many times the noise of its unknowns in the pilot. Where nothing varies, one cut in 70 would.
pub(crate) const PROOF: f64 = 2.5;

/// The part of a gain along an axis that the gain of a half of the part is along this axis: half of an eighth.
const FALL: f64 = 1.0 / 16.0;

/// The part of a gain along the other axis that a half of the part has.
const SHARE: f64 = 0.6;

/// The standard deviation of a gain about what is expected, as a part of that.
pub(crate) const MISFIT: f64 = 1.2;

/// All gains along an axis over the next one, if each is an eighth of the one before.
pub(crate) const TAIL: f64 = 8.0 / 7.0;

/// Cuts beyond the pilot's grid along each axis.
const BEYOND: u32 = 2;

/// Unknowns of a linear fit.
const UNKNOWNS: f64 = 3.0;

/// What is known of the whole that a tree of cuts begins with.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Start {
    /// What cutting it is expected to gain; `None` where nothing but the pilot tells.
    pub(crate) expected: Option<f64>,
    /// How often a part of it may be cut, along u and along v; a triangle: in four.
    pub(crate) most: [u32; 2],
}

impl Start {
    /// A surface that is seen for the first time.
    pub(crate) const SURFACE: Start = Start { expected: None, most: [Leaves::MOST_CUTS; 2] };
}

/// A tree of cuts, and what is predicted of it.
#[derive(Clone, Debug)]
pub(crate) struct Rectangles {
    pub(crate) leaves: Leaves,
    /// The energy of its noise after one walk [W²/m²].
    pub(crate) noise: f64,
    /// The energy that its fits catch, as far as the pilot tells [W²/m²].
    pub(crate) caught: f64,
    /// The energy that gains are expected to have that no cut takes [W²/m²].
    pub(crate) left: f64,
}

/// The walks of a pilot, and those of the job that it chooses patches for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct JobWalks {
    pub(crate) pilot: f64,
    pub(crate) job: f64,
}

/// The rectangles of a surface for a job of some walks, by what a pilot of fewer walks has seen. `start` is what is known of the whole.
pub(crate) fn rectangles(images: &Images, walks: JobWalks, start: Start) -> Rectangles {
    let JobWalks { pilot, job: walks } = walks;
    let proven = Proven::new(images, pilot, start.most);
    let expected = start.expected.map(|gain| [gain; 2]);
    let mut open = vec![RectanglePart { expected, caught: images.caught([0, 0])[0] }];
    let (mut noise, mut caught, mut left) = (0.0, 0.0, 0.0);
    let leaves = Leaves::grow(|leaf| {
        let part = open.pop().expect("a part for each call");
        let own = images.noise(leaf.levels, leaf.at);
        let gains = [0, 1].map(|axis| part.gain(&proven, (leaf, axis), own / pilot));
        let axis = proven.cut(leaf).or_else(|| {
            let axis = usize::from(gains[1] >= gains[0]);
            (gains[axis] > UNKNOWNS * own / walks).then_some(axis)
        });
        let axis = axis.filter(|&axis| leaf.levels[axis] < proven.limit[axis]);
        match axis {
            Some(axis) => open.extend(part.halves(images, &gains, (leaf, axis)).into_iter().rev()),
            None => {
                noise += UNKNOWNS * own;
                caught += part.caught;
                left += TAIL * (gains[0] + gains[1]);
            }
        }
        axis
    });
    Rectangles { leaves, noise, caught, left }
}

/// A part of the surface on the way down.
struct RectanglePart {
    /// The gains that are expected of it along both axes; `None` of the whole surface.
    expected: Option<[f64; 2]>,
    /// The energy that the fit on it catches.
    caught: f64,
}

impl RectanglePart {
    /// What a cut along an axis gains, by the pilot and by what is expected. `noise` is that of an unknown in the pilot.
    fn gain(&self, proven: &Proven, (leaf, axis): (CutCell, usize), noise: f64) -> f64 {
        let expected = self.expected.map(|expected| expected[axis]);
        let Some(seen) = proven.seen(leaf, axis) else { return expected.unwrap_or(0.0) };
        let expected = expected.unwrap_or(seen.max(0.0));
        let variance = (4.0 * expected + 2.0 * UNKNOWNS * noise) * noise;
        let misfit = MISFIT * expected * MISFIT * expected;
        let both =
            if variance > 0.0 { (seen * misfit + expected * variance) / (misfit + variance) } else { seen };
        let is_proven = seen > PROOF * UNKNOWNS * noise;
        if is_proven { both.max(seen) } else { both.max(0.0) }
    }

    /// Its halves.
    fn halves(
        &self,
        images: &Images,
        gains: &[f64; 2],
        (leaf, axis): (CutCell, usize),
    ) -> [RectanglePart; 2] {
        let expected = [0, 1].map(|k| gains[k] * if k == axis { FALL } else { SHARE });
        leaf.halves(axis).map(|half| {
            let is_seen = (0..2).all(|k| half.levels[k] <= images.top[k]);
            let caught = match is_seen {
                true => images.caught(half.levels)[((half.at[0] << half.levels[1]) + half.at[1]) as usize],
                false => 0.5 * (self.caught + gains[axis]),
            };
            RectanglePart { expected: Some(expected), caught }
        })
    }
}

/// The cuts that a pilot proves.
struct Proven<'a> {
    images: &'a Images,
    /// By grid and axis, what is gained, cell by cell.
    gains: Vec<[Option<Vec<f64>>; 2]>,
    /// By grid and cell, the axis of the cut; `None` for none.
    cuts: Vec<Vec<Option<u8>>>,
    /// How often a part may be halved along each axis.
    limit: [u32; 2],
}

impl<'a> Proven<'a> {
    fn new(images: &'a Images, pilot: f64, most: [u32; 2]) -> Self {
        let gains = levels(images.top).map(|grid| [0, 1].map(|axis| images.gains(grid, axis))).collect();
        let cuts = levels(images.top).map(|[a, b]| vec![None; 1 << (a + b)]).collect();
        let limit = [0, 1].map(|k| (images.top[k] + BEYOND).min(most[k]));
        let mut proven = Proven { images, gains, cuts, limit };
        let mut best: Vec<Vec<f64>> = levels(images.top).map(|[a, b]| vec![0.0; 1 << (a + b)]).collect();
        for grid in levels(images.top).rev() {
            for axis in 0..2 {
                proven.look(&mut best, grid, axis, pilot);
            }
        }
        proven
    }

    fn place(&self, [a, b]: [u32; 2]) -> usize {
        (a * (self.images.top[1] + 1) + b) as usize
    }

    /// Looks at cuts of all cells of a grid along an axis, given the best trees in the halves.
    fn look(&mut self, best: &mut [Vec<f64>], grid: [u32; 2], axis: usize, pilot: f64) {
        let place = self.place(grid);
        let Some(gains) = &self.gains[place][axis] else { return };
        let mut finer = grid;
        finer[axis] += 1;
        let mut found = gains.clone();
        for (cell, of_half) in best[self.place(finer)].iter().enumerate() {
            found[halved(finer, cell, axis)] += of_half;
        }
        for (cell, found) in found.into_iter().enumerate() {
            let at = [cell as u32 >> grid[1], cell as u32 & ((1 << grid[1]) - 1)];
            let gain = found - PROOF * UNKNOWNS * self.images.noise(grid, at) / pilot;
            if gain > best[place][cell] {
                best[place][cell] = gain;
                self.cuts[place][cell] = Some(axis as u8);
            }
        }
    }

    /// The number of a part among the cells of its grid; `None` beyond the pilot's.
    fn cell(&self, leaf: CutCell) -> Option<(usize, usize)> {
        let is_seen = (0..2).all(|k| leaf.levels[k] <= self.images.top[k]);
        is_seen.then(|| (self.place(leaf.levels), ((leaf.at[0] << leaf.levels[1]) + leaf.at[1]) as usize))
    }

    /// The axis along which a part is proven to be cut.
    fn cut(&self, leaf: CutCell) -> Option<usize> {
        let (grid, cell) = self.cell(leaf)?;
        self.cuts[grid][cell].map(usize::from)
    }

    /// What a cut was seen to gain.
    fn seen(&self, leaf: CutCell, axis: usize) -> Option<f64> {
        let (grid, cell) = self.cell(leaf)?;
        Some(self.gains[grid][axis].as_ref()?[cell])
    }
}
