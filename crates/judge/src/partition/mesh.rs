//! What a pilot has seen of the light on meshes, part by part of the trees of their cells, and which parts become patches.

use radiosity::{Experiment, Fit, Tally};

use super::clusters::Clusters;
use super::gains::{CAUTION, Gains};
use super::part::Seen;
use super::seen::PilotTallies;

/// A part that this many walks have hit is believed as much as the part around it.
const FEW: f64 = 8.0;

/// What is foretold of the noise of a part that fewer walks have hit is that of the part around it: a part that chance made bright is cut
/// more often than others.
const MANY: f64 = 50.0;

/// The light on meshes.
pub struct MeshLight<'a> {
    clusters: &'a Clusters,
    /// The parts that the pilot's patches are: below them it sees nothing.
    finest: &'a [bool],
    seen: Vec<Seen>,
    /// All energy, without bias [W²/m²].
    energy: f64,
    /// Walks of the pilot.
    walks: f64,
}

/// Which parts of meshes become patches.
#[derive(Clone, Debug, Default)]
pub struct Grouped {
    /// By place in the order of the trees, the number of the part that its cell is in.
    pub part_of_place: Vec<u32>,
    /// The foretold noise [W²/m²].
    pub noise: f64,
    /// The foretold energy that the means leave out [W²/m²].
    pub lost: f64,
}

impl<'a> MeshLight<'a> {
    /// What the pilot saw. Its patches on meshes are the parts of `finest`, each of which has its patch in `patch_of_part`.
    pub fn new(
        experiment: &Experiment,
        tallies: &PilotTallies,
        (clusters, finest): (&'a Clusters, &'a [bool]),
        patch_of_part: &[Option<u32>],
    ) -> Self {
        let mut light = MeshLight {
            clusters,
            finest,
            seen: vec![Seen::default(); clusters.parts.len()],
            energy: 0.0,
            walks: tallies.all.counts.walks as f64,
        };
        let faces = experiment.scene().faces();
        for is_back in [false, true] {
            let face = |part: usize| match is_back {
                false => patch_of_part[part],
                true => faces.back_of(patch_of_part[part]?),
            };
            for channel in 0..experiment.scene().channels() {
                let fit = |part: usize| {
                    let face = face(part)? as usize;
                    Some((face, experiment.fit(&tallies.all, face, channel)?))
                };
                light.add((tallies, channel), fit);
            }
        }
        let finest = light.seen.iter().zip(light.finest).filter(|(_, finest)| **finest);
        light.energy = finest.map(|(seen, _)| seen.energy).sum();
        light.seen.iter_mut().for_each(|seen| (seen.raw, seen.foretold) = (seen.energy, seen.noise));
        light.smooth();
        light
    }

    /// Light of which a pilot of some walks has seen this down to single cells, for tests: b of each cell, and ν of an unknown where b is 1.
    #[cfg(test)]
    pub(super) fn known(
        clusters: &'a Clusters,
        finest: &'a [bool],
        (b, noise): (&[f64], f64),
        walks: f64,
    ) -> Self {
        let mut seen = vec![Seen::default(); clusters.parts.len()];
        for (number, part) in clusters.parts.iter().enumerate().rev() {
            let [from, to] = part.cells.map(|cell| cell as usize);
            let cells = &clusters.cells[from..to];
            let mean = cells.iter().map(|&cell| b[cell as usize]).sum::<f64>() / cells.len() as f64;
            let energy = part.area * mean * mean;
            let noise = noise * mean;
            seen[number] = Seen { energy, noise, hits: 1e3, raw: energy, foretold: noise, gain: 0.0 };
            if let Some([a, b]) = part.halves {
                seen[number].gain = seen[a as usize].energy + seen[b as usize].energy - energy;
            }
        }
        let energy = clusters.cells.iter().map(|&cell| b[cell as usize] * b[cell as usize]).sum();
        MeshLight { clusters, finest, seen, energy, walks }
    }

    /// Adds the light of one side in one channel.
    fn add(
        &mut self,
        (tallies, channel): (&PilotTallies, usize),
        fit: impl Fn(usize) -> Option<(usize, Fit)>,
    ) {
        let groups = tallies.groups.len();
        let n = groups as f64;
        // By part, the integrals of the light as each group of walks estimates them, and the variance of that of all, times the area.
        let mut integrals = vec![0.0; groups * self.seen.len()];
        let mut variances = vec![0.0; self.seen.len()];
        let mut means = vec![0.0; self.seen.len()];
        for (number, part) in self.clusters.parts.iter().enumerate().rev() {
            let at = number * groups;
            if self.finest[number] {
                let Some((face, all)) = fit(number) else { continue };
                let sum = |tally: &Tally| tally.patch(face, channel)[0] as f64;
                let per_event = part.area * all.mean / sum(&tallies.all).max(1.0) * n;
                for (group, tally) in tallies.groups.iter().enumerate() {
                    integrals[at + group] = per_event * sum(tally);
                }
                (means[number], variances[number]) =
                    (part.area * all.mean, part.area * part.area * all.mean_variance);
            } else if let Some([a, b]) = self.seen_halves(number) {
                for group in 0..groups {
                    integrals[at + group] = integrals[a * groups + group] + integrals[b * groups + group];
                }
                (means[number], variances[number]) = (means[a] + means[b], variances[a] + variances[b]);
                let [area_a, area_b] = [a, b].map(|half| self.clusters.parts[half].area);
                let step = |group: usize| {
                    integrals[a * groups + group] / area_a - integrals[b * groups + group] / area_b
                };
                self.seen[number].gain += area_a * area_b / part.area * pairs((0..groups).map(step), n);
            } else {
                continue;
            }
            let seen = &mut self.seen[number];
            seen.energy += pairs((0..groups).map(|group| integrals[at + group]), n) / part.area;
            seen.noise += self.walks * variances[number] / part.area;
            if variances[number] > 0.0 {
                seen.hits += means[number] * means[number] / variances[number];
            }
        }
    }

    /// The halves of a part, where the pilot sees them.
    fn seen_halves(&self, part: usize) -> Option<[usize; 2]> {
        let halves = self.clusters.parts[part].halves.filter(|_| !self.finest[part])?;
        Some(halves.map(|half| half as usize))
    }

    /// Gives every part that few walks have hit noise and energy by the part around it.
    ///
    /// A part of a share s of the area is expected to have s times the hits k of the part around it. Light is taken to be r =
    /// (k_part + 1)/(s·k + 1) times that of the part around: noise is in proportion to light, energy to its square.
    fn smooth(&mut self) {
        let mut is_beyond = vec![false; self.seen.len()];
        for number in 0..self.seen.len() {
            let (part, around) = (&self.clusters.parts[number], self.seen[number]);
            for half in part.halves.into_iter().flatten().map(|half| half as usize) {
                is_beyond[half] = is_beyond[number] || self.finest[number];
                let share = self.clusters.parts[half].area / part.area;
                let seen = &mut self.seen[half];
                if is_beyond[half] {
                    *seen = Seen {
                        energy: share * around.energy,
                        noise: around.noise,
                        foretold: around.foretold,
                        ..Seen::default()
                    };
                    continue;
                }
                seen.foretold = if seen.hits >= MANY { seen.noise } else { around.foretold };
                let ratio = (seen.hits + 1.0) / (share * around.hits + 1.0);
                let mixed = |own: f64, told: f64| (seen.hits * own.max(0.0) + FEW * told) / (seen.hits + FEW);
                seen.noise = mixed(seen.noise, ratio * around.noise);
                seen.energy = mixed(seen.energy, ratio * ratio * share * around.energy);
            }
        }
    }

    /// The parts that make the least error after a number of walks.
    pub fn choose(&self, walks: f64) -> Grouped {
        let is_seen: Vec<bool> = self.seen_parts();
        let gains = Gains::new(self.clusters, (&self.seen, &is_seen), self.walks);
        let count = self.seen.len();
        // By part: the least error of it and its parts; what its mean leaves out, and how much of that the pilot has not seen.
        let (mut least, mut lost, mut unseen) = (vec![0.0; count], vec![0.0; count], vec![0.0; count]);
        let mut whole = vec![true; count];
        for number in (0..count).rev() {
            lost[number] = gains.expected[number];
            unseen[number] = if is_seen[number] { 0.0 } else { lost[number] };
            let mut parts = f64::INFINITY;
            if let Some([a, b]) =
                self.clusters.parts[number].halves.map(|halves| halves.map(|half| half as usize))
            {
                lost[number] += lost[a] + lost[b];
                unseen[number] += unseen[a] + unseen[b];
                parts = least[a] + least[b];
            }
            let own = lost[number] + self.seen[number].noise / walks;
            whole[number] = own <= parts;
            least[number] = own.min(parts);
        }
        let mut grouped = Grouped { part_of_place: vec![0; self.clusters.cells.len()], ..Grouped::default() };
        let mut caught = 0.0;
        // Each with whether it is beyond what the pilot saw.
        let mut open: Vec<(u32, bool)> = self.clusters.roots.iter().map(|&root| (root, false)).collect();
        while let Some((number, is_beyond)) = open.pop() {
            let (part, seen) = (&self.clusters.parts[number as usize], &self.seen[number as usize]);
            let is_finest = self.finest[number as usize];
            match part.halves {
                Some(halves) if !whole[number as usize] => {
                    caught += if is_finest && !is_beyond { seen.raw } else { 0.0 };
                    open.extend(halves.map(|half| (half, is_beyond || is_finest)));
                }
                _ => {
                    let [from, to] = part.cells.map(|cell| cell as usize);
                    grouped.part_of_place[from..to].fill(number);
                    grouped.noise += seen.foretold / walks;
                    caught += if is_beyond { 0.0 } else { seen.raw };
                    grouped.lost += unseen[number as usize] / CAUTION;
                }
            }
        }
        grouped.lost += (self.energy - caught).max(0.0);
        grouped
    }

    /// All energy that the pilot has seen.
    pub fn energy(&self) -> f64 {
        self.energy
    }

    /// Which parts the pilot saw halved.
    fn seen_parts(&self) -> Vec<bool> {
        let mut is_seen = vec![false; self.seen.len()];
        let mut open = self.clusters.roots.clone();
        while let Some(part) = open.pop() {
            if let Some(halves) = self.seen_halves(part as usize) {
                is_seen[part as usize] = true;
                open.extend(halves.map(|half| half as u32));
            }
        }
        is_seen
    }
}

/// The mean product of two groups of walks' estimates of a number, over all pairs: its square without bias.
fn pairs(each: impl Iterator<Item = f64>, n: f64) -> f64 {
    let (mut sum, mut squares) = (0.0, 0.0);
    for x in each {
        sum += x;
        squares += x * x;
    }
    (sum * sum - squares) / (n * (n - 1.0))
}
