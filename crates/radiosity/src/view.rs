//! Looking at a scene: what pictures ask beyond what walks do. Coordinates are relative to
//! [`Scene::origin`].

use glam::DVec3;

use crate::scene::Scene;
use crate::surface::Surface;
use crate::trace::{Hit, Ray};

impl Scene {
    /// The nearest surface along a ray, whichever of its sides is met; `None` where the ray leaves the scene.
    pub fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        self.index.closest_hit(&self.facets, ray)
    }
}

impl Surface {
    /// Every corner of the outline [m].
    pub fn outline(&self) -> Vec<DVec3> {
        let others = [[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
        let others = if self.is_triangle() { &others[..2] } else { &others[..] };
        std::iter::once(&[0.0, 0.0]).chain(others).map(|&uv| self.point(uv)).collect()
    }
}
