//! Looking at a scene: what pictures ask beyond what walks do. Coordinates are relative to
//! [`Scene::origin`].

use crate::geometry::spec::Corners;
use crate::geometry::surface::Surface;
use crate::scene::Scene;
use crate::simd::batch::WIDTH;
use crate::trace::ray::{Hit, Hits, Ray, Rays};
use crate::trace::tree::Scratch;

impl Scene {
    /// The nearest surface along a ray, whichever of its sides is met; `None` where the ray leaves the scene.
    pub fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        self.parts.index.closest_hit(&self.parts.facets, ray)
    }

    /// [`Lookout::closest_hits`], once.
    pub fn closest_hits(&self, rays: &[Ray]) -> Vec<Option<Hit>> {
        Lookout::new(self).closest_hits(rays)
    }
}

/// What looks at a scene need beside it, kept from look to look.
pub struct Lookout<'a> {
    scene: &'a Scene,
    rays: Box<Rays>,
    hits: Box<Hits>,
    scratch: Box<Scratch>,
}

impl<'a> Lookout<'a> {
    /// A place to look at a scene from.
    pub fn new(scene: &'a Scene) -> Self {
        Lookout { scene, rays: Box::default(), hits: Box::default(), scratch: Box::default() }
    }

    /// The nearest hits of many rays, whose directions have length 1 within 10⁻⁹: far less work than one by one.
    pub fn closest_hits(&mut self, rays: &[Ray]) -> Vec<Option<Hit>> {
        let mut found = Vec::with_capacity(rays.len());
        self.each_closest_hit(rays, |_, hit| found.push(hit));
        found
    }

    /// [`Lookout::closest_hits`], handed on one by one, in order, each with the number of its ray.
    pub fn each_closest_hit(&mut self, rays: &[Ray], mut see: impl FnMut(usize, Option<Hit>)) {
        let parts = &self.scene.parts;
        for (part, first) in rays.chunks(WIDTH).zip((0..).step_by(WIDTH)) {
            self.rays.len = 0;
            part.iter().for_each(|ray| self.rays.push(ray));
            parts.index.closest_hits(&parts.facets, &self.rays, &mut self.scratch, &mut self.hits);
            (0..part.len()).for_each(|i| see(first + i, self.hits.get(i)));
        }
    }
}

impl Surface {
    /// Every corner of the outline [m].
    pub fn outline(&self) -> Corners {
        let others = [[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
        let others = if self.is_triangle() { &others[..2] } else { &others[..] };
        std::iter::once(&[0.0, 0.0]).chain(others).map(|&uv| self.point(uv)).collect()
    }
}
