//! A stack: surfaces in one plane, in the order of their layers.

use glam::DVec3;

/// Surfaces in one plane, each of which overlaps with another one.
#[derive(Clone, Debug, PartialEq)]
pub struct Stack {
    /// Unit normal of the plane, on the side that the front of the surface with the least number faces.
    pub normal: DVec3,
    /// By their layers: the first is met first by a ray that goes against `normal`.
    pub surfaces: Vec<u32>,
    /// n·x of the points x of the plane, relative to [`crate::Scene::origin`] [m].
    pub(crate) offset: f64,
}
