//! What a pilot has seen of the light on meshes, part by part of the trees of their cells, and which parts become patches.

use glam::DVec3;
use radiosity::Experiment;

use super::clusters::Clusters;
use super::gains::{CAUTION, Gains};
use super::moments::{PartFrames, PartMoments, Pool};
use super::part::PartEstimate;
use super::seen::{Basis, PilotTallies};

/// A part that this many walks have hit is believed as much as the part around it.
const FEW: f64 = 8.0;

/// What is predicted of the noise of a part that fewer walks have hit is that of the part around it: a part that chance made bright is cut
/// more often than others.
const MANY: f64 = 50.0;

/// A part that the pilot did not see halved has halves where they may gain this part of their cost.
const WORTH: f64 = 0.25;

/// The light on the parts of meshes, as the tallies of a pilot give it.
pub struct MeshLight {
    clusters: Clusters,
    /// What the pilot saw of the parts that are no parts of its patches, and what follows of the others.
    seen: Vec<PartEstimate>,
    /// The number of the former, which come first.
    measured: usize,
    /// All energy, without bias [W²/m²].
    energy: f64,
    /// The noise that the parts of an object have in common after one walk, all objects together [W²/m²].
    shared: f64,
    /// Walks of the pilot.
    walks: f64,
}

/// Which parts of meshes become patches.
#[derive(Clone, Debug, Default)]
pub struct Grouped {
    /// By cell, the number of the part that it is in.
    pub part_of_cell: Vec<u32>,
    /// The predicted noise [W²/m²].
    pub noise: f64,
    /// The predicted energy that the fits leave out [W²/m²].
    pub lost: f64,
}

impl MeshLight {
    /// What the pilot saw. Its patches on meshes are the parts that are not halved, each of which has its patch in `patch_of_part`.
    pub fn new(
        experiment: &Experiment,
        tallies: &PilotTallies<'_>,
        clusters: Clusters,
        patch_of_part: &[Option<u32>],
    ) -> Self {
        let scene = experiment.scene();
        let is_linear = experiment.method().is_linear();
        let frames = is_linear.then(|| PartFrames::new(scene, &clusters, patch_of_part));
        let measured = clusters.parts.len();
        let (seen, walks) = (vec![PartEstimate::default(); measured], tallies.all.counts.walks as f64);
        let mut light = MeshLight { clusters, seen, measured, energy: 0.0, shared: 0.0, walks };
        for is_back in [false, true] {
            if is_back && !scene.faces().two_sided() {
                continue;
            }
            let face = |part: usize| {
                let patch = patch_of_part[part]?;
                if is_back { scene.faces().back_of(patch) } else { Some(patch) }
            };
            for channel in 0..scene.channels() {
                light.add(experiment, tallies, channel, frames.as_ref(), face);
            }
        }
        light.compare_halves();
        let basis = if is_linear { Basis::Linear } else { Basis::Constant };
        let finest = light.seen.iter().zip(&light.clusters.parts).filter(|(_, part)| part.halves.is_none());
        light.energy = finest.map(|(seen, _)| seen.caught[basis as usize]).sum();
        light.smooth();
        light
    }

    /// Light of which a pilot of some walks has seen this down to single cells, for tests: b of each cell, and ν of an unknown where b is 1.
    #[cfg(test)]
    pub(super) fn known(clusters: Clusters, (b, noise): (&[f64], f64), walks: f64) -> Self {
        let mut seen = vec![PartEstimate::default(); clusters.parts.len()];
        for (number, part) in clusters.parts.iter().enumerate().rev() {
            let cells = || clusters.cells_of(part);
            let mean = cells().map(|cell| b[cell as usize]).sum::<f64>() / cells().count() as f64;
            let energy = part.area * mean * mean;
            let noise = noise * mean;
            seen[number] = PartEstimate {
                energy,
                noise,
                hits: 1e3,
                caught: [energy; 2],
                predicted: noise,
                gain: [0.0; 2],
            };
        }
        let cells = clusters.roots.iter().flat_map(|&root| clusters.cells_of(&clusters.parts[root as usize]));
        let energy = cells.map(|cell| b[cell as usize] * b[cell as usize]).sum();
        let measured = seen.len();
        let mut light = MeshLight { clusters, seen, measured, energy, shared: 0.0, walks };
        light.compare_halves();
        light
    }

    /// Adds the light of one side in one channel; `face` is that side of a part which is a patch of the pilot.
    fn add(
        &mut self,
        experiment: &Experiment,
        tallies: &PilotTallies<'_>,
        channel: usize,
        frames: Option<&PartFrames>,
        face: impl Fn(usize) -> Option<u32>,
    ) {
        let n = tallies.groups.len();
        let mut pool = Pool::new(self.seen.len(), n);
        // By part, the integral of the light, and the variance of its estimate.
        let mut sums = vec![[0.0; 2]; self.seen.len()];
        let mut is_root = vec![false; self.seen.len()];
        self.clusters.roots.iter().for_each(|&root| is_root[root as usize] = true);
        for (number, part) in self.clusters.parts.iter().enumerate().rev() {
            let halves = part.halves.map(|halves| halves.map(|half| half as usize));
            if halves.is_none() {
                let Some(face) = face(number).map(|face| face as usize) else { continue };
                let moments = pool.add(number);
                if let Some(all) = experiment.fit(tallies.all, face, channel) {
                    sums[number] = [part.area * all.mean, part.area * part.area * all.mean_variance];
                    let patch = experiment.scene().faces().get(face).patch;
                    let arms = frames.map_or([DVec3::ZERO; 2], |_| experiment.scene().body_of(patch).arms);
                    let fits = experiment.fits_of_parts((tallies.all, tallies.groups), face, channel);
                    for (moments, [mean, u, v]) in moments.iter_mut().zip(fits.into_iter().flatten()) {
                        let DVec3 { x, y, z } = part.area * (u * arms[0] + v * arms[1]);
                        *moments = [part.area * mean, x, y, z];
                    }
                }
            } else if let Some(halves) = halves {
                let parts = halves.map(|half| &self.clusters.parts[half]);
                pool.join(number, halves, parts.map(|half| half.middle[0] - part.middle[0]));
                sums[number] = [0, 1].map(|k| sums[halves[0]][k] + sums[halves[1]][k]);
            }
            if pool.of(number).is_empty() {
                continue;
            }
            let seen = &mut self.seen[number];
            let energies = energies(pool.of(number), |moments| match frames {
                None => [moments[0] / part.area.sqrt(), 0.0, 0.0],
                Some(frames) => frames.coefficients(number, part.area, moments),
            });
            seen.energy += energies[0];
            seen.caught[0] += energies[0];
            seen.caught[1] += energies.iter().sum::<f64>();
            let [integral, variance] = sums[number];
            seen.noise += self.walks * variance / part.area;
            seen.predicted = seen.noise;
            if is_root[number] {
                let of_groups = spread(pool.of(number)) / part.area;
                self.shared += self.walks * (of_groups - variance / part.area);
            }
            if variance > 0.0 {
                seen.hits += integral * integral / variance;
            }
        }
    }

    /// Takes down what halving each part gains.
    fn compare_halves(&mut self) {
        for (number, part) in self.clusters.parts.iter().enumerate() {
            if let Some([a, b]) = part.halves {
                let caught = [a as usize, b as usize, number].map(|part| self.seen[part].caught);
                self.seen[number].gain = [0, 1].map(|k| caught[0][k] + caught[1][k] - caught[2][k]);
            }
        }
    }

    /// Gives every part that few walks have hit noise and energy by the part around it.
    ///
    /// A part of a share s of the area is expected to have s times the hits k of the part around it. Light is taken to be r =
    /// (k_part + 1)/(s·k + 1) times that of the part around: noise is in proportion to light, energy to its square.
    fn smooth(&mut self) {
        for number in 0..self.seen.len() {
            let (part, around) = (&self.clusters.parts[number], self.seen[number]);
            for half in part.halves.into_iter().flatten().map(|half| half as usize) {
                let share = self.clusters.parts[half].area / part.area;
                let seen = &mut self.seen[half];
                seen.predicted = if seen.hits >= MANY { seen.noise } else { around.predicted };
                let ratio = (seen.hits + 1.0) / (share * around.hits + 1.0);
                let mixed =
                    |own: f64, prior: f64| (seen.hits * own.max(0.0) + FEW * prior) / (seen.hits + FEW);
                seen.noise = mixed(seen.noise, ratio * around.noise);
                seen.energy = mixed(seen.energy, ratio * ratio * share * around.energy);
            }
        }
    }

    /// The parts that make the least error under a basis after a number of walks, of a scene of some cells.
    pub fn choose(&mut self, basis: Basis, walks: f64, cells: usize) -> Grouped {
        let mut gains = Gains::new(&self.clusters, &self.seen[..self.measured], (basis, self.walks));
        self.go_beyond(&mut gains, basis, walks);
        let whole = self.whole(&gains, basis, walks);
        let mut grouped = Grouped::default();
        // Below the pilot's patches means gain as rates say in the mean; linear fits gain more there, at the edges of shadows.
        let caution = if basis == Basis::Constant { CAUTION } else { 1.0 };
        let (mut caught, mut chosen) = (0.0, Vec::new());
        let mut open = self.clusters.roots.clone();
        while let Some(number) = open.pop() {
            let part = number as usize;
            let is_beyond = part >= self.measured;
            let (halves, seen) = (self.clusters.parts[part].halves, &self.seen[part]);
            // Below the pilot's patches no part is known to catch more than they do.
            let is_finest = !is_beyond && halves.is_none_or(|[half, _]| half as usize >= self.measured);
            caught += if is_finest { seen.caught[basis as usize] } else { 0.0 };
            match halves {
                Some(halves) if !whole.of_part[part] => open.extend(halves),
                _ => {
                    chosen.push(number);
                    grouped.noise += basis.unknowns() * seen.predicted / walks;
                    caught += if is_beyond || is_finest { 0.0 } else { seen.caught[basis as usize] };
                    grouped.lost += whole.unseen[part] / caution;
                }
            }
        }
        grouped.lost += (self.energy - caught).max(0.0);
        grouped.part_of_cell = self.clusters.part_of_cell(chosen, cells);
        grouped
    }

    /// Halves the pilot's patches, and their parts in turn, as far as it may pay, and tells what is expected of them: parts are lit as the
    /// patch that they are of.
    fn go_beyond(&mut self, gains: &mut Gains, basis: Basis, walks: f64) {
        let mut number = 0;
        while number < self.clusters.parts.len() {
            let (part, around) = (self.clusters.parts[number], self.seen[number]);
            let cost = basis.unknowns() * around.noise / walks;
            let is_measured = gains.has_measured(&part);
            if !is_measured && part.halves.is_none() && gains.promise(number, &part, &around) > WORTH * cost {
                for half in self.clusters.halve(number).into_iter().flatten() {
                    let share = self.clusters.parts[half].area / part.area;
                    let energy = share * around.energy;
                    let PartEstimate { noise, predicted, .. } = around;
                    self.seen.push(PartEstimate { energy, noise, predicted, ..PartEstimate::default() });
                }
            }
            if !is_measured {
                gains.tell(&self.clusters, number, around.energy);
            }
            number += 1;
        }
    }

    /// Finds the best parts from the finest up: a part is whole where that and its noise are no more than the least error of its halves.
    fn whole(&self, gains: &Gains, basis: Basis, walks: f64) -> Wholes {
        let count = self.seen.len();
        let mut wholes = Wholes { of_part: vec![true; count], unseen: vec![0.0; count] };
        // By part: the least error of it and its parts, and what its fit leaves out.
        let (mut least, mut lost) = (vec![0.0; count], vec![0.0; count]);
        for (number, part) in self.clusters.parts.iter().enumerate().rev() {
            lost[number] = gains.expected[number];
            wholes.unseen[number] = if gains.has_measured(part) { 0.0 } else { lost[number] };
            let mut parts = f64::INFINITY;
            if let Some([a, b]) = part.halves.map(|halves| halves.map(|half| half as usize)) {
                lost[number] += lost[a] + lost[b];
                wholes.unseen[number] += wholes.unseen[a] + wholes.unseen[b];
                parts = least[a] + least[b];
            }
            let own = lost[number] + basis.unknowns() * self.seen[number].noise / walks;
            wholes.of_part[number] = own <= parts;
            least[number] = own.min(parts);
        }
        wholes
    }

    /// The noise that the parts of an object have in common after one walk: what whole objects err by beyond the noise of their parts [W²/m²].
    pub fn shared(&self) -> f64 {
        self.shared
    }

    /// All energy that the pilot has seen.
    pub fn energy(&self) -> f64 {
        self.energy
    }
}

/// Which parts are better whole than halved.
struct Wholes {
    of_part: Vec<bool>,
    /// By part, the energy that its fit leaves out, as far as the pilot has not seen it [W²/m²].
    unseen: Vec<f64>,
}

/// The variance of an integral, by the spread between groups of walks.
fn spread(groups: &[PartMoments]) -> f64 {
    let n = groups.len() as f64;
    let [sum, squares] = groups.iter().fold([0.0; 2], |[sum, squares], [b, ..]| [sum + b, squares + b * b]);
    (squares - sum * sum / n) / (n * (n - 1.0))
}

/// The energies of coefficients without bias: of each the mean product of two groups of walks' estimates, over all pairs.
fn energies(groups: &[PartMoments], coefficients: impl Fn(&PartMoments) -> [f64; 3]) -> [f64; 3] {
    let n = groups.len() as f64;
    let (mut sums, mut squares) = ([0.0; 3], [0.0; 3]);
    for moments in groups {
        for (k, x) in coefficients(moments).into_iter().enumerate() {
            sums[k] += x;
            squares[k] += x * x;
        }
    }
    [0, 1, 2].map(|k| (sums[k] * sums[k] - squares[k]) / (n * (n - 1.0)))
}
