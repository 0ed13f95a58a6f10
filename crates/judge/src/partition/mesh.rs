//! What a pilot has seen of the light on meshes, part by part of the trees of their cells, and which parts become patches.

use glam::DVec3;
use radiosity::Experiment;

use super::clusters::Clusters;
use super::gains::{CAUTION, Gains};
use super::moments::{Frames, Moments, Pool};
use super::part::Seen;
use super::seen::{Basis, PilotTallies};

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
        tallies: &PilotTallies<'_>,
        (clusters, finest): (&'a Clusters, &'a [bool]),
        patch_of_part: &[Option<u32>],
    ) -> Self {
        let scene = experiment.scene();
        let is_linear = experiment.method().is_linear();
        let frames = is_linear.then(|| Frames::new(scene, (clusters, finest), patch_of_part));
        let mut light = MeshLight {
            clusters,
            finest,
            seen: vec![Seen::default(); clusters.parts.len()],
            energy: 0.0,
            walks: tallies.all.counts.walks as f64,
        };
        for is_back in [false, true] {
            if is_back && !scene.faces().two_sided() {
                continue;
            }
            let face = |part: usize| {
                let patch = patch_of_part[part]?;
                if is_back { scene.faces().back_of(patch) } else { Some(patch) }
            };
            for channel in 0..scene.channels() {
                light.add((experiment, tallies, channel), frames.as_ref(), face);
            }
        }
        light.compare_halves();
        let basis = if is_linear { Basis::Linear } else { Basis::Constant };
        let finest = light.seen.iter().zip(light.finest).filter(|(_, finest)| **finest);
        light.energy = finest.map(|(seen, _)| seen.caught[basis as usize]).sum();
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
            seen[number] =
                Seen { energy, noise, hits: 1e3, caught: [energy; 2], foretold: noise, gain: [0.0; 2] };
        }
        let energy = clusters.cells.iter().map(|&cell| b[cell as usize] * b[cell as usize]).sum();
        let mut light = MeshLight { clusters, finest, seen, energy, walks };
        light.compare_halves();
        light
    }

    /// Adds the light of one side in one channel; `face` is that side of a part which is a patch of the pilot.
    fn add(
        &mut self,
        (experiment, tallies, channel): (&Experiment, &PilotTallies<'_>, usize),
        frames: Option<&Frames>,
        face: impl Fn(usize) -> Option<u32>,
    ) {
        let n = tallies.groups.len();
        let mut pool = Pool::new(self.seen.len(), n);
        // By part, the integral of the light, and the variance of its estimate.
        let mut sums = vec![[0.0; 2]; self.seen.len()];
        for (number, part) in self.clusters.parts.iter().enumerate().rev() {
            if self.finest[number] {
                let Some(face) = face(number).map(|face| face as usize) else { continue };
                let moments = pool.add(number);
                if let Some(all) = experiment.fit(&tallies.all, face, channel) {
                    sums[number] = [part.area * all.mean, part.area * part.area * all.mean_variance];
                    let patch = experiment.scene().faces().get(face).patch;
                    let arms = frames.map_or([DVec3::ZERO; 2], |_| experiment.scene().body_of(patch).arms);
                    let fits = experiment.fits_of_parts(tallies.groups, face, channel).unwrap_or_default();
                    for (moments, [mean, u, v]) in moments.iter_mut().zip(fits) {
                        let DVec3 { x, y, z } = part.area * (u * arms[0] + v * arms[1]);
                        *moments = [part.area * mean, x, y, z];
                    }
                }
            } else if let Some(halves) = self.seen_halves(number) {
                let parts = halves.map(|half| &self.clusters.parts[half]);
                pool.join(number, halves, parts.map(|half| half.middle[0] - part.middle[0]));
                sums[number] = [0, 1].map(|k| sums[halves[0]][k] + sums[halves[1]][k]);
            } else {
                continue;
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
            seen.foretold = seen.noise;
            if variance > 0.0 {
                seen.hits += integral * integral / variance;
            }
        }
    }

    /// Takes down what halving each part gains, where the pilot sees it.
    fn compare_halves(&mut self) {
        for number in 0..self.seen.len() {
            if let Some([a, b]) = self.seen_halves(number) {
                let caught = [a, b, number].map(|part| self.seen[part].caught);
                self.seen[number].gain = [0, 1].map(|k| caught[0][k] + caught[1][k] - caught[2][k]);
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

    /// The parts that make the least error under a basis after a number of walks.
    pub fn choose(&self, basis: Basis, walks: f64) -> Grouped {
        let is_seen: Vec<bool> = self.seen_parts();
        let gains = Gains::new(self.clusters, (&self.seen, &is_seen), (basis, self.walks));
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
            let own = lost[number] + basis.unknowns() * self.seen[number].noise / walks;
            whole[number] = own <= parts;
            least[number] = own.min(parts);
        }
        let mut grouped = Grouped { part_of_place: vec![0; self.clusters.cells.len()], ..Grouped::default() };
        // Below the pilot's patches means gain as rates say in the mean; linear fits gain more there, at the edges of shadows.
        let caution = if basis == Basis::Constant { CAUTION } else { 1.0 };
        let mut caught = 0.0;
        // Each with whether it is beyond what the pilot saw.
        let mut open: Vec<(u32, bool)> = self.clusters.roots.iter().map(|&root| (root, false)).collect();
        while let Some((number, is_beyond)) = open.pop() {
            let (part, seen) = (&self.clusters.parts[number as usize], &self.seen[number as usize]);
            let is_finest = self.finest[number as usize];
            match part.halves {
                Some(halves) if !whole[number as usize] => {
                    caught += if is_finest && !is_beyond { seen.caught[basis as usize] } else { 0.0 };
                    open.extend(halves.map(|half| (half, is_beyond || is_finest)));
                }
                _ => {
                    let [from, to] = part.cells.map(|cell| cell as usize);
                    grouped.part_of_place[from..to].fill(number);
                    grouped.noise += basis.unknowns() * seen.foretold / walks;
                    caught += if is_beyond { 0.0 } else { seen.caught[basis as usize] };
                    grouped.lost += unseen[number as usize] / caution;
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

/// The energies of coefficients without bias: of each the mean product of two groups of walks' estimates, over all pairs.
fn energies(groups: &[Moments], coefficients: impl Fn(&Moments) -> [f64; 3]) -> [f64; 3] {
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
