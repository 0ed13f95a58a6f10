//! The choice of triangles of different sizes for one triangle: a tree of cuts, each in four congruent parts.
//!
//! As with [rectangles](super::tree), a cut *gains* the energy that the linear fits on its quarters catch beyond the one on the part, and costs the
//! noise of the unknowns that it adds. Cuts that the pilot proves come first, and then those that are expected to pay.

use super::grid::Grid;
use super::images::AROUND;
use super::seen::{Basis, GridCells};
use super::tree::{JobWalks, MISFIT, PROOF, Start, TAIL};

/// Unknowns that a cut adds: four linear fits in place of one.
const UNKNOWNS: f64 = 9.0;

/// The part of a gain that each quarter is expected to gain: a fourth of an eighth. Along the edge of a shadow all quarters together gain half as much as
/// the part, in smooth light a sixteenth.
const FALL: f64 = 1.0 / 32.0;

/// Cuts beyond the pilot's grid, and all cuts at the most.
const BEYOND: u32 = 2;
pub(super) const MOST_CUTS: u32 = 8;

/// Numbers by cell, for every level up to a finest one: level l has 4^l cells.
#[derive(Clone, Debug)]
pub(crate) struct Quarters {
    /// The energy that linear fits catch, without bias.
    caught: Vec<Vec<f64>>,
    /// The energy of the error of one unknown after one walk.
    noise: Vec<Vec<f64>>,
}

/// A tree of cuts, and what is predicted of it.
pub(crate) struct Triangles {
    /// The rows of the triangle's cells.
    pub(crate) rows: u32,
    /// The patch of each cell, from 0 on, in the order of their first cells.
    pub(crate) patch_of_cell: Vec<u32>,
    /// The energy of its noise after one walk [W²/m²].
    pub(crate) noise: f64,
    /// The energy that its fits catch, as far as the pilot tells [W²/m²].
    pub(crate) caught: f64,
    /// The energy that gains are expected to have that no cut takes [W²/m²].
    pub(crate) left: f64,
}

/// The cells of a level.
fn cells(level: u32) -> GridCells {
    GridCells::new(Grid::Triangle(1 << level))
}

impl Quarters {
    /// Quarters without light, up to a level.
    pub(crate) fn new(top: u32) -> Self {
        let empty: Vec<Vec<f64>> = (0..=top).map(|level| vec![0.0; 1 << (2 * level)]).collect();
        Quarters { caught: empty.clone(), noise: empty }
    }

    fn top(&self) -> u32 {
        self.caught.len() as u32 - 1
    }

    /// Adds what is caught on the cells of a level.
    pub(crate) fn add_caught(&mut self, level: u32, caught: impl Iterator<Item = f64>) {
        self.caught[level as usize].iter_mut().zip(caught).for_each(|(sum, part)| *sum += part);
    }

    /// Adds the noise on the cells of the finest level.
    pub(crate) fn add_noise(&mut self, noise: impl Iterator<Item = f64>) {
        let finest = self.noise.last_mut().expect("a coarsest level");
        finest.iter_mut().zip(noise).for_each(|(sum, part)| *sum += part);
    }

    /// Makes out the noise of all levels from that of the finest: the mean over the cells in a cell, mixed with that of the cell around.
    pub(crate) fn spread_noise(&mut self) {
        for level in (0..self.top()).rev() {
            let of =
                |cell: usize| cells(level).quarters(cell).map(|part| self.noise[level as usize + 1][part]);
            self.noise[level as usize] =
                (0..1 << (2 * level)).map(|cell| of(cell).iter().sum::<f64>() / 4.0).collect();
        }
        for level in 0..self.top() {
            let parts = AROUND * f64::from(1_u32 << (2 * (self.top() - level - 1)));
            for cell in 0..1 << (2 * level) {
                let around = self.noise[level as usize][cell];
                for part in cells(level).quarters(cell) {
                    let own = &mut self.noise[level as usize + 1][part];
                    *own = (parts * *own + around) / (parts + 1.0);
                }
            }
        }
    }

    /// The noise after one walk and the energy that is caught where the triangle stays whole.
    pub(crate) fn whole(&self) -> [f64; 2] {
        [Basis::Linear.unknowns() * self.noise[0][0], self.caught[0][0]]
    }

    /// What cutting a cell that the pilot saw cut was seen to gain.
    fn gain(&self, level: u32, cell: usize) -> f64 {
        let finer = &self.caught[level as usize + 1];
        cells(level).quarters(cell).iter().map(|&part| finer[part]).sum::<f64>()
            - self.caught[level as usize][cell]
    }

    /// By level and cell, whether a pilot of some walks proves that it is to be cut.
    fn proven(&self, pilot: f64) -> Vec<Vec<bool>> {
        let (mut cuts, mut best) = (Vec::new(), vec![0.0; 1 << (2 * self.top())]);
        for level in (0..self.top()).rev() {
            let of = |cell: usize| {
                let parts: f64 = cells(level).quarters(cell).iter().map(|&part| best[part]).sum();
                self.gain(level, cell) + parts - PROOF * UNKNOWNS * self.noise[level as usize][cell] / pilot
            };
            best = (0..1 << (2 * level)).map(|cell| f64::max(of(cell), 0.0)).collect();
            cuts.push(best.iter().map(|&best| best > 0.0).collect());
        }
        cuts.reverse();
        cuts
    }

    /// The triangles for a job of some walks, by what a pilot of fewer walks has seen. `start` is what is known of the whole.
    pub(crate) fn triangles(&self, walks: JobWalks, start: Start) -> Triangles {
        let JobWalks { pilot, job: walks } = walks;
        let proven = self.proven(pilot);
        let most = (self.top() + BEYOND).min(MOST_CUTS).min(start.most[0]);
        let (expected, caught) = (start.expected, self.caught[0][0]);
        let mut open = vec![TrianglePart { level: 0, cell: 0, expected, caught, noise: 0.0 }];
        let (mut leaves, mut finest) = (Vec::new(), 0);
        let (mut noise, mut caught, mut left) = (0.0, 0.0, 0.0);
        while let Some(mut part) = open.pop() {
            part.noise = self.noise.get(part.level as usize).map_or(part.noise, |noise| noise[part.cell]);
            let gain = self.gain_of(&part, pilot);
            let is_proven = proven.get(part.level as usize).is_some_and(|cuts| cuts[part.cell]);
            if part.level < most && (is_proven || gain > UNKNOWNS * part.noise / walks) {
                let quarters = cells(part.level).quarters(part.cell);
                open.extend(quarters.map(|cell| self.quarter(&part, gain, cell)));
                finest = finest.max(part.level + 1);
            } else {
                noise += Basis::Linear.unknowns() * part.noise;
                caught += part.caught;
                left += TAIL * gain;
                leaves.push((part.level, part.cell));
            }
        }
        Triangles { rows: 1 << finest, patch_of_cell: patches(&leaves, finest), noise, caught, left }
    }

    /// What cutting a part gains, by the pilot and by what is expected.
    fn gain_of(&self, part: &TrianglePart, pilot: f64) -> f64 {
        if part.level >= self.top() {
            return part.expected.unwrap_or(0.0);
        }
        let (seen, noise) = (self.gain(part.level, part.cell), part.noise / pilot);
        let expected = part.expected.unwrap_or(seen.max(0.0));
        let variance = (4.0 * expected + 2.0 * UNKNOWNS * noise) * noise;
        let misfit = MISFIT * expected * MISFIT * expected;
        let both =
            if variance > 0.0 { (seen * misfit + expected * variance) / (misfit + variance) } else { seen };
        if seen > PROOF * UNKNOWNS * noise { both.max(seen) } else { both.max(0.0) }
    }

    /// A quarter of a part that gains `gain` by being cut.
    fn quarter(&self, part: &TrianglePart, gain: f64, cell: usize) -> TrianglePart {
        let level = part.level + 1;
        let seen = self.caught.get(level as usize).map(|caught| caught[cell]);
        let caught = seen.unwrap_or(0.25 * (part.caught + gain));
        TrianglePart { level, cell, expected: Some(FALL * gain), caught, noise: part.noise }
    }
}

/// A part of the triangle on the way down.
struct TrianglePart {
    level: u32,
    cell: usize,
    /// What cutting it is expected to gain; `None` of the whole triangle.
    expected: Option<f64>,
    /// The energy that the fit on it catches.
    caught: f64,
    /// The noise of an unknown after one walk.
    noise: f64,
}

/// The patch of each cell of the finest level, where these parts are patches.
fn patches(leaves: &[(u32, usize)], finest: u32) -> Vec<u32> {
    let mut leaf_of_cell = vec![0; 1 << (2 * finest)];
    for (leaf, &(level, cell)) in leaves.iter().enumerate() {
        let mut within = vec![cell];
        for level in level..finest {
            within = within.into_iter().flat_map(|cell| cells(level).quarters(cell)).collect();
        }
        within.into_iter().for_each(|cell| leaf_of_cell[cell] = leaf);
    }
    let (mut numbers, mut next) = (vec![None; leaves.len()], 0..);
    leaf_of_cell
        .into_iter()
        .map(|leaf| *numbers[leaf].get_or_insert_with(|| next.next().expect("few leaves")))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Light that varies in one corner alone, with a gain of 1 at each level, and no noise to speak of.
    fn corner(top: u32) -> Quarters {
        let mut quarters = Quarters::new(top);
        for level in 0..=top {
            let caught = |cell: usize| if cell == 0 { 10.0 + f64::from(level) } else { 0.0 };
            quarters.add_caught(level, (0..1 << (2 * level)).map(caught));
        }
        quarters.add_noise((0..1 << (2 * top)).map(|_| 1.0));
        quarters.spread_noise();
        quarters
    }

    #[test]
    fn cuts_are_where_the_light_varies() {
        let tree = corner(4).triangles(JobWalks { pilot: 1e2, job: 1e2 }, Start::SURFACE);
        assert_eq!(tree.rows, 16);
        // Three quarters of each level, and the last four.
        assert_eq!(tree.patch_of_cell.iter().max(), Some(&12));
        assert_eq!(tree.patch_of_cell.iter().filter(|&&patch| patch == tree.patch_of_cell[255]).count(), 64);
        assert!((tree.caught - 14.0).abs() < 1e-9 && (tree.noise - 39.0).abs() < 1e-9, "{}", tree.caught);
    }

    #[test]
    fn even_light_stays_whole() {
        let mut quarters = Quarters::new(3);
        (0..=3).for_each(|level| {
            quarters.add_caught(level, (0..1 << (2 * level)).map(|_| 1.0 / f64::from(1 << (2 * level))));
        });
        quarters.add_noise((0..64).map(|_| 1.0));
        quarters.spread_noise();
        let tree = quarters.triangles(JobWalks { pilot: 1e3, job: 1e4 }, Start::SURFACE);
        assert_eq!((tree.rows, tree.patch_of_cell), (1, vec![0]));
    }

    #[test]
    fn parts_of_all_levels_cover_the_triangle_once() {
        let mut seen = vec![0; 256];
        (0..64).for_each(|cell| cells(3).quarters(cell).iter().for_each(|&part| seen[part] += 1));
        assert_eq!(seen, vec![1; 256]);
    }
}
