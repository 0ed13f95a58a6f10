//! The panes that rays cross on their way.

use glam::DVec3;

use super::{Scene, SceneError};
use crate::geometry::pane::{Glass, PaneSpec};
use crate::geometry::spec::Shape;
use crate::trace::ray::Ray;

/// The panes of a scene. A ray meets each in turn: windows are few.
#[derive(Clone, Debug, Default)]
pub(crate) struct Panes(Vec<Pane>);

#[derive(Clone, Debug)]
struct Pane {
    corner: DVec3,
    normal: DVec3,
    /// What local coordinates u and v are measured with [1/m].
    duals: [DVec3; 2],
    is_triangle: bool,
    glass: Glass,
}

impl Panes {
    /// The panes of a scene, whose coordinates are relative to `origin`.
    pub(super) fn new(specs: &[PaneSpec], origin: DVec3) -> Result<Self, SceneError> {
        specs.iter().map(|spec| Pane::new(spec, origin)).collect::<Result<_, _>>().map(Panes)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// What the panes take of memory [bytes].
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.0[..])
    }

    /// The part of the light that passes all panes on the way along a ray as far as `t`.
    pub(crate) fn passed(&self, ray: &Ray, t: f64) -> f64 {
        self.0.iter().map(|pane| pane.passed(ray, t)).product()
    }
}

impl Pane {
    fn new(spec: &PaneSpec, origin: DVec3) -> Result<Self, SceneError> {
        if let Some(fault) = spec.fault() {
            return Err(SceneError::Whole(format!(
                "pane {:?}: {fault}; correct its keys, or remove it",
                spec.name
            )));
        }
        let (corner, u, v) = spec.shape.edges();
        let across = u.cross(v);
        let square = across.length_squared();
        Ok(Pane {
            corner: corner - origin,
            normal: across / square.sqrt(),
            duals: [v.cross(across) / square, across.cross(u) / square],
            is_triangle: matches!(spec.shape, Shape::Triangle { .. }),
            glass: Glass::new(spec.transmittance),
        })
    }

    fn passed(&self, ray: &Ray, until: f64) -> f64 {
        let along = self.normal.dot(ray.direction);
        let t = self.normal.dot(self.corner - ray.origin) / along;
        if !(t > 0.0 && t < until) {
            return 1.0;
        }
        let [u, v] = self.duals.map(|dual| dual.dot(ray.origin + t * ray.direction - self.corner));
        let is_inside =
            u >= 0.0 && v >= 0.0 && if self.is_triangle { u + v <= 1.0 } else { u <= 1.0 && v <= 1.0 };
        if !is_inside {
            return 1.0;
        }
        self.glass.passes((along.abs() / ray.direction.length()).min(1.0))
    }
}

impl Scene {
    /// Whether light crosses panes on its way.
    pub(crate) fn has_panes(&self) -> bool {
        !self.parts.panes.is_empty()
    }

    /// How many panes there are.
    pub fn pane_count(&self) -> usize {
        self.parts.panes.0.len()
    }

    /// The part of the light that passes all panes on the way along a ray as far as `t`, in units of the ray's direction; 1 without panes.
    pub fn passed_panes(&self, ray: &Ray, t: f64) -> f64 {
        self.parts.panes.passed(ray, t)
    }
}

/// The random bits of a survival whose walk first passes panes with a probability: `None` where they stop it. Those of a walk that
/// passes are uniform again.
#[inline]
pub(crate) fn thin(bits: u64, passed: f64) -> Option<u64> {
    if passed >= 1.0 {
        return Some(bits);
    }
    let drawn = bits as f64 / TWO_64;
    (drawn < passed).then(|| (drawn / passed * TWO_64) as u64)
}

/// 2⁶⁴.
const TWO_64: f64 = 18_446_744_073_709_551_616.0;
