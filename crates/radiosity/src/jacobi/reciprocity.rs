//! Whether rays see both ways: links are used in both directions, which is right only where A_i F_ij = A_j F_ji.
//!
//! Of n_i rays from face i, c_ij meet face j: c_ij·A_i/n_i and c_ji·A_j/n_j both expect the exchange area. Over all j the
//! one is what leaves i, the other what arrives there; a tracer that what is seen from A does not see A shows in their
//! difference, measured by its own standard error.

use super::cast::{Caster, systematic};
use super::faces::FaceTable;
use super::links::{Link, LinkTable};
use super::numbers::RayNumbers;
use crate::random::rng::WalkRng;

/// The least number of effective rays in either direction for a face to be compared.
const TELLING: f64 = 30.0;

/// How what arrives at faces agrees with what leaves them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reciprocity {
    /// Faces that enough rays left and met.
    pub faces: usize,
    /// The mean of their squared differences over the variances of these; at most 1 in the mean where rays are as random
    /// as Poisson's.
    pub mean_squared_z: f64,
    /// The largest difference, in standard errors.
    pub worst: f64,
    /// The face that has it.
    pub worst_face: Option<u32>,
}

/// Shoots `rays` rays from all faces, by area and a few from each.
pub(crate) fn reciprocity(faces: &FaceTable, rng: WalkRng, rays: u64) -> Reciprocity {
    let mut caster = Caster::new(faces, RayNumbers::sobol(rng));
    let mut table = LinkTable::new(faces.areas.len());
    let (total, count) = (faces.areas.iter().sum::<f64>(), faces.areas.len() as f64);
    let shares: Vec<f64> = faces.areas.iter().map(|area| area / total + 1.0 / count).collect();
    let offset = caster.rng().pair()[0];
    let births = systematic(&shares, rays, offset);
    caster
        .cast(0, &births, &|| true, |from, to, _| table.count(from, to, 1))
        .expect("the rays are never told to stop");
    table.end_row();
    compare(table.links(), &caster.shot, &faces.areas)
}

/// Sums of the areas that rays stand for, and of their squares.
#[derive(Clone, Copy, Default)]
struct AreaFlow {
    sum: f64,
    squares: f64,
}

impl AreaFlow {
    fn add(&mut self, rays: f64, area: f64) {
        self.sum += rays * area;
        self.squares += rays * area * area;
    }

    /// The number of equal rays with the same information.
    fn effective(&self) -> f64 {
        if self.squares > 0.0 { self.sum * self.sum / self.squares } else { 0.0 }
    }
}

/// Compares both directions of the links, given the numbers of rays that faces shot.
fn compare(links: &[Link], shot: &[u32], areas: &[f64]) -> Reciprocity {
    let mut flows = vec![[AreaFlow::default(); 2]; areas.len()];
    let per_ray: Vec<f64> = areas.iter().zip(shot).map(|(area, &shot)| area / f64::from(shot)).collect();
    // What a face sees that shot no rays is unknown.
    for link in links.iter().filter(|link| shot[link.to as usize] > 0) {
        let (from, to, rays) = (link.from as usize, link.to as usize, f64::from(link.rays));
        flows[from][0].add(rays, per_ray[from]);
        flows[to][1].add(rays, per_ray[from]);
    }
    let mut found = Reciprocity::default();
    for (face, [leaves, arrives]) in (0..).zip(&flows) {
        if leaves.effective().min(arrives.effective()) < TELLING {
            continue;
        }
        let z = (leaves.sum - arrives.sum).abs() / (leaves.squares + arrives.squares).sqrt();
        found.faces += 1;
        found.mean_squared_z += z * z;
        if z > found.worst {
            (found.worst, found.worst_face) = (z, Some(face));
        }
    }
    found.mean_squared_z /= found.faces.max(1) as f64;
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three faces of 1, 1 and 2 m²; the third is seen by the first, and by `seen` in 100 of what it sees of it.
    fn links(seen: u32) -> Vec<Link> {
        let link = |from, to, rays| Link { from, to, rays };
        vec![link(0, 1, 5_000), link(0, 2, 5_000), link(1, 0, 5_000), link(2, 0, 50 * seen)]
    }

    #[test]
    fn rays_that_see_both_ways_agree() {
        // 10,000 rays of 1e-4 m² from the first and second, 20,000 from the third.
        let found = compare(&links(100), &[10_000, 10_000, 20_000], &[1.0, 1.0, 2.0]);
        assert_eq!((found.faces, found.worst), (3, 0.0));
    }

    #[test]
    fn what_sees_and_is_not_seen_is_found() {
        let found = compare(&links(60), &[10_000, 10_000, 20_000], &[1.0, 1.0, 2.0]);
        // 0.5 m² less 0.3 m², of 5,000 and 3,000 rays of 1e-4 m².
        assert!((found.worst - 0.2 / (8_000.0_f64).sqrt() / 1e-4).abs() < 1e-9, "{found:?}");
        assert_eq!(found.worst_face, Some(2));
        assert!(found.mean_squared_z > 100.0);
    }

    #[test]
    fn faces_that_shot_nothing_or_little_are_left_out() {
        let found = compare(&links(60), &[10_000, 10_000, 0], &[1.0, 1.0, 2.0]);
        assert_eq!((found.faces, found.worst), (2, 0.0));
        let few: Vec<Link> = links(60).iter().map(|link| Link { rays: link.rays / 200, ..*link }).collect();
        // 25 rays between the first two, and 50 leave and 40 arrive at the first.
        assert_eq!(compare(&few, &[50, 50, 100], &[1.0, 1.0, 2.0]).faces, 1);
    }
}
