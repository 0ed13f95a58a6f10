//! The box that holds a scene.

use glam::DVec3;
use radiosity::{Scene, surfaces::Surface};

/// The box that holds a scene [m].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bounds {
    pub(crate) min: DVec3,
    pub(crate) max: DVec3,
}

impl Bounds {
    pub(crate) fn of(scene: &Scene) -> Self {
        Bounds::of_surfaces(scene.surfaces())
    }

    /// The box that holds what a scene has beside a sky.
    pub(crate) fn below_sky(scene: &Scene) -> Self {
        Bounds::of_surfaces(&scene.surfaces()[..scene.surfaces_before_sky()])
    }

    fn of_surfaces(surfaces: &[Surface]) -> Self {
        let corners = surfaces.iter().flat_map(|surface| surface.outline());
        let nothing = Bounds { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };
        corners.fold(nothing, |bounds, corner| Bounds {
            min: bounds.min.min(corner),
            max: bounds.max.max(corner),
        })
    }

    pub(crate) fn middle(&self) -> DVec3 {
        0.5 * (self.min + self.max)
    }

    pub(crate) fn size(&self) -> DVec3 {
        self.max - self.min
    }

    pub(crate) fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|i| {
            let pick = |axis: usize| if i >> axis & 1 == 0 { self.min[axis] } else { self.max[axis] };
            DVec3::new(pick(0), pick(1), pick(2))
        })
    }

    pub(crate) fn contains(&self, point: DVec3) -> bool {
        point.cmpge(self.min).all() && point.cmple(self.max).all()
    }

    /// Where a ray enters the box [ray parameter]; `None` where it misses it.
    pub(crate) fn entry(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        let (t0, t1) = ((self.min - origin) / direction, (self.max - origin) / direction);
        let (enter, leave) = (t0.min(t1).max_element(), t0.max(t1).min_element());
        (enter <= leave && leave >= 0.0).then_some(enter.max(0.0))
    }
}
