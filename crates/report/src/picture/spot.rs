//! What is seen at points of a picture.

use radiosity::{Scene, Side};

use crate::camera::{Camera, Sight};

/// Rows of pixels that are looked at together.
pub(super) const BAND: usize = 16;

/// What is seen at a point of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spot {
    /// The piece of a face, or [`Spot::NONE`].
    piece: u32,
    /// The surface that the piece is on.
    pub(super) surface: u32,
    /// The side in sight.
    pub(super) side: Side,
    /// Where on the surface.
    uv: [f32; 2],
}

impl Spot {
    /// In place of a piece and its surface.
    const NONE: u32 = u32::MAX;

    /// Beyond the scene.
    const NOTHING: Spot = Spot { piece: Spot::NONE, surface: Spot::NONE, side: Side::Front, uv: [0.0; 2] };

    fn of(sight: &Sight) -> Self {
        let [u, v] = sight.uv;
        Spot { piece: sight.piece, surface: sight.surface, side: sight.side, uv: [u as f32, v as f32] }
    }

    /// What it is on.
    pub(super) fn piece(&self) -> Option<u32> {
        (self.piece != Spot::NONE).then_some(self.piece)
    }

    /// Whether two spots are on one side of one surface, or both beyond the scene.
    pub(super) fn is_beside(&self, other: &Spot) -> bool {
        (self.surface, self.side) == (other.surface, other.side)
    }

    /// Where on its surface, in local coordinates.
    pub(super) fn uv(&self) -> [f64; 2] {
        self.uv.map(f64::from)
    }

    /// What a camera sees at some points of the picture.
    pub(super) fn seen_by(camera: &Camera, scene: &Scene, points: &[[f64; 2]]) -> Vec<Self> {
        let mut spots = vec![Spot::NOTHING; points.len()];
        camera.each_sight(scene, points, |point, sight| spots[point] = Spot::of(&sight));
        spots
    }
}
