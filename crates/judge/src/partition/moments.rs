//! What a pilot's groups of walks say of the light on parts of meshes, from the finest up: the moments of a part are sums of those of its
//! halves, and the linear fit to its light follows from them.

use glam::DVec3;
use radiosity::{
    Scene,
    linear::{Covariance, outer_square, principal_axes},
};

use super::clusters::{Cluster, Clusters};

/// What one group of walks says of a part: the integral of the light [W], and that of the light times the place, from the centroid of the
/// part on [W m].
pub(super) type PartMoments = [f64; 4];

/// An axis along which the variance is below this part of the largest one has no fit.
const NARROW: f64 = 1e-12;

/// How parts of meshes lie.
pub(super) struct PartFrames {
    /// By part, e_k/√(λ_k·A): e_k the two principal axes on which it extends most, λ_k the variances along them, and A
    /// its area. With the first moments they make the coefficients of functions that are orthonormal over the part.
    across: Vec<[[f64; 3]; 2]>,
}

impl PartFrames {
    /// The frames of the parts that are patches of the pilot, and of all that are made of such.
    pub(super) fn new(scene: &Scene, clusters: &Clusters, patch_of_part: &[Option<u32>]) -> Self {
        let mut across = vec![[[0.0; 3]; 2]; clusters.parts.len()];
        let mut covariances: Vec<Covariance> = vec![[[0.0; 3]; 3]; clusters.parts.len()];
        for (number, part) in clusters.parts.iter().enumerate().rev() {
            covariances[number] = match (patch_of_part[number], part.halves) {
                (_, Some(halves)) => together(clusters, part, halves, &covariances),
                (Some(patch), None) => scene.body_of(patch).covariance,
                (None, None) => continue,
            };
            across[number] = across_of(&covariances[number], part.area);
        }
        PartFrames { across }
    }

    /// The coefficients of the linear fit to a part that has these moments.
    pub(super) fn coefficients(&self, part: usize, area: f64, [sum, x, y, z]: &PartMoments) -> [f64; 3] {
        let along = |[a, b, c]: [f64; 3]| a * x + b * y + c * z;
        let [first, second] = self.across[part];
        [sum / area.sqrt(), along(first), along(second)]
    }
}

/// The covariance of a part that consists of two.
fn together(
    clusters: &Clusters,
    whole: &Cluster,
    halves: [u32; 2],
    covariances: &[Covariance],
) -> Covariance {
    let mut sum = [[0.0; 3]; 3];
    for half in halves.map(|half| half as usize) {
        let part = &clusters.parts[half];
        let share = part.area / whole.area;
        let off = outer_square(part.middle[0] - whole.middle[0], share);
        for ((sum, own), off) in
            sum.as_flattened_mut().iter_mut().zip(covariances[half].as_flattened()).zip(off.as_flattened())
        {
            *sum += share * own + off;
        }
    }
    sum
}

fn across_of(covariance: &Covariance, area: f64) -> [[f64; 3]; 2] {
    let axes = principal_axes(*covariance);
    [0, 1].map(|k| {
        let (variance, axis) = axes[k];
        match variance > NARROW * axes[0].0 {
            true => (axis / (variance * area).sqrt()).to_array(),
            false => [0.0; 3],
        }
    })
}

/// The moments of the parts whose wholes have not been made up yet: few at once, where wholes follow their halves.
pub(super) struct Pool {
    groups: usize,
    moments: Vec<PartMoments>,
    free: Vec<usize>,
    /// By part, where its moments are.
    slots: Vec<Option<u32>>,
}

impl Pool {
    pub(super) fn new(parts: usize, groups: usize) -> Self {
        Pool { groups, moments: Vec::new(), free: Vec::new(), slots: vec![None; parts] }
    }

    /// The moments of a part, by group; none of a part that none were added of.
    pub(super) fn of(&mut self, part: usize) -> &mut [PartMoments] {
        match self.slots[part] {
            Some(slot) => &mut self.moments[slot as usize * self.groups..][..self.groups],
            None => &mut [],
        }
    }

    /// Room for the moments of a part, all 0.
    pub(super) fn add(&mut self, part: usize) -> &mut [PartMoments] {
        let slot = self.free.pop().unwrap_or_else(|| {
            self.moments.resize(self.moments.len() + self.groups, [0.0; 4]);
            self.moments.len() / self.groups - 1
        });
        self.slots[part] = Some(slot as u32);
        let moments = self.of(part);
        moments.fill([0.0; 4]);
        moments
    }

    /// Puts a part in place of its halves, whose centroids are at these places from that of the part on.
    pub(super) fn join(&mut self, part: usize, halves: [usize; 2], places: [DVec3; 2]) {
        // Cells of one kind have as many sides: both halves have moments, or neither.
        let [Some(a), Some(b)] = halves.map(|half| self.slots[half].map(|slot| slot as usize)) else {
            return;
        };
        for group in 0..self.groups {
            let [one, other] = [a, b].map(|slot| self.moments[slot * self.groups + group]);
            let shifted = |[sum, x, y, z]: PartMoments, at: DVec3| {
                [sum, x + sum * at.x, y + sum * at.y, z + sum * at.z]
            };
            let (one, other) = (shifted(one, places[0]), shifted(other, places[1]));
            self.moments[a * self.groups + group] = std::array::from_fn(|k| one[k] + other[k]);
        }
        self.slots[part] = Some(a as u32);
        self.free.push(b);
    }
}
