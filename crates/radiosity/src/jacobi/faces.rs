//! What chains keep of faces: they ask for all of them again and again.

use crate::geometry::face::Face;
use crate::scene::Scene;

/// The faces of a scene, made once.
pub(crate) struct FaceTable<'a> {
    pub(crate) scene: &'a Scene,
    /// The faces in the order of their numbers.
    pub(crate) list: Vec<Face>,
    /// A: the areas of the faces [m²].
    pub(crate) areas: Vec<f64>,
}

impl<'a> FaceTable<'a> {
    pub(crate) fn new(scene: &'a Scene) -> Self {
        let list: Vec<Face> = scene.faces().iter().collect();
        let areas = list.iter().map(|face| face.area).collect();
        FaceTable { scene, list, areas }
    }

    /// H of every face in every channel [W/m²] from φ [W].
    pub(crate) fn per_area(&self, incoming: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let per_area =
            |incoming: &Vec<f64>| incoming.iter().zip(&self.areas).map(|(x, area)| x / area).collect();
        incoming.iter().map(per_area).collect()
    }
}

/// What is kept channel by channel, face-major and channel-minor.
pub(crate) fn face_major(by_channel: &[Vec<f64>]) -> Vec<f64> {
    let faces = 0..by_channel.first().map_or(0, Vec::len);
    faces.flat_map(|face| by_channel.iter().map(move |channel| channel[face])).collect()
}
