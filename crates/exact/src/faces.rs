//! The sides of patches that exchange light.

/// Which faces each of n patches has. Face i < n is the front of patch i; the backs of the two-sided patches
/// follow, in patch order. So without two-sided patches faces and patches are the same.
///
/// Nothing passes through a surface: the faces of a two-sided patch are unknowns of their own, and a walk
/// leaves from the side that it hit. Only what is reported of the patch combines them.
#[derive(Clone, Debug, PartialEq)]
pub struct Faces {
    patches: usize,
    /// The patch of every back, ascending.
    backs: Vec<usize>,
}

impl Faces {
    /// n patches with one face each.
    pub fn one_sided(patches: usize) -> Self {
        Faces { patches, backs: vec![] }
    }

    /// The faces of patches of which these have two sides.
    pub fn new(two_sided: &[bool]) -> Self {
        let backs = (0..two_sided.len()).filter(|&patch| two_sided[patch]).collect();
        Faces { patches: two_sided.len(), backs }
    }

    /// The number of patches.
    pub fn patch_count(&self) -> usize {
        self.patches
    }

    /// The number of faces.
    pub fn face_count(&self) -> usize {
        self.patches + self.backs.len()
    }

    /// The patch that a face is a side of.
    pub fn patch_of(&self, face: usize) -> usize {
        if face < self.patches { face } else { self.backs[face - self.patches] }
    }

    /// Front and back of every two-sided patch.
    pub(crate) fn pairs(&self) -> Vec<[usize; 2]> {
        self.backs.iter().enumerate().map(|(n, &front)| [front, self.patches + n]).collect()
    }

    /// What belongs to patches, given to each of their faces.
    pub(crate) fn spread(&self, of_patches: &[f64]) -> Vec<f64> {
        (0..self.face_count()).map(|face| of_patches[self.patch_of(face)]).collect()
    }

    /// Sums over the faces of patches: powers and areas.
    pub(crate) fn sum(&self, of_faces: &[f64]) -> Vec<f64> {
        let mut sums = of_faces[..self.patches].to_vec();
        for [front, back] in self.pairs() {
            sums[front] += of_faces[back];
        }
        sums
    }

    /// Means over the faces of patches: what is per area, the faces of a patch being equally large.
    pub(crate) fn mean(&self, of_faces: &[f64]) -> Vec<f64> {
        let mut means = self.sum(of_faces);
        for &patch in &self.backs {
            means[patch] *= 0.5;
        }
        means
    }

    /// Means over the faces of patches with these weights ≥ 0, plain means where the weights vanish.
    pub(crate) fn weighted_mean(&self, of_faces: &[f64], weights: &[f64]) -> Vec<f64> {
        let mut means = self.mean(of_faces);
        for [front, back] in self.pairs() {
            let total = weights[front] + weights[back];
            if total > 0.0 {
                means[front] = (weights[front] * of_faces[front] + weights[back] * of_faces[back]) / total;
            }
        }
        means
    }
}
