//! Where the power of a scene vanishes, in a few thousand walks: for those that are about to run it.

use radiosity::Scene;

use crate::pilot::Pilot;

/// Walks that are followed. A part of a hundredth is known to a tenth of itself.
const WALKS: u64 = 8192;

/// Power that serves nothing. All channels together.
#[derive(Clone, Debug, PartialEq)]
pub struct Losses {
    /// Φ_T [W].
    pub power: f64,
    /// The part of it that leaves its lamp and meets no side that reflects.
    pub at_once: f64,
    /// The part of it that ends on the backs of one-sided surfaces, sooner or later.
    pub on_backs: f64,
    /// The surfaces whose light is lost at once, and how much [W], the most first.
    pub lamps: Vec<(u32, f64)>,
    /// The surfaces whose backs take power, and how much [W], the most first.
    pub backs: Vec<(u32, f64)>,
}

/// Follows light from the emitters of a scene. The answer depends on the scene alone.
pub fn losses(scene: &Scene) -> Losses {
    Pilot::follow_some(scene, WALKS..=WALKS).losses()
}
