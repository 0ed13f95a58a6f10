//! Where gathering walks are born.

use crate::method::Birth;
use crate::scene::Scene;

/// p_i: the probability that a gathering walk is born on face i, for every face.
pub fn birth_probabilities(scene: &Scene, birth: &Birth) -> Vec<f64> {
    let faces = scene.faces();
    match birth {
        Birth::Area => {
            let total: f64 = faces.iter().map(|face| face.area).sum();
            faces.iter().map(|face| face.area / total).collect()
        }
        Birth::Uniform => vec![1.0 / faces.len() as f64; faces.len()],
        Birth::Patches(patches) => {
            let chosen: Vec<u32> = patches.iter().flat_map(|&patch| faces.of_patch(patch)).collect();
            let mut probabilities = vec![0.0; faces.len()];
            for &face in &chosen {
                probabilities[face as usize] = 1.0 / chosen.len() as f64;
            }
            probabilities
        }
    }
}
