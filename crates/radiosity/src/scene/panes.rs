//! The panes that rays cross on their way.

use arrayvec::ArrayVec;
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
        let mut rims = ArrayVec::<f64, 8>::new();
        let mut part = 1.0;
        for Crossing { t, on_rim, passes } in self.0.iter().filter_map(|pane| pane.crossing(ray, t)) {
            // Where panes adjoin light crosses one of them.
            if on_rim {
                if rims.iter().any(|rim| (rim - t).abs() <= SAME * t) {
                    continue;
                }
                // Of more rims than these some are crossed as often as they are there.
                let _ = rims.try_push(t);
            }
            part *= passes;
        }
        part
    }
}

/// The part of a pane's sides within which a crossing is on its rim.
const RIM: f64 = 1e-12;

/// The part of their distance within which two crossings are at one place.
const SAME: f64 = 1e-9;

/// Where a ray crosses a pane.
struct Crossing {
    t: f64,
    on_rim: bool,
    /// The part of the light that passes.
    passes: f64,
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

    fn crossing(&self, ray: &Ray, until: f64) -> Option<Crossing> {
        let along = self.normal.dot(ray.direction);
        let t = self.normal.dot(self.corner - ray.origin) / along;
        if !(t > 0.0 && t < until) {
            return None;
        }
        let [u, v] = self.duals.map(|dual| dual.dot(ray.origin + t * ray.direction - self.corner));
        // How far the crossing is within the pane.
        let within = u.min(v).min(if self.is_triangle { 1.0 - u - v } else { (1.0 - u).min(1.0 - v) });
        (within >= -RIM).then(|| Crossing {
            t,
            on_rim: within <= RIM,
            passes: self.glass.passes((along.abs() / ray.direction.length()).min(1.0)),
        })
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
