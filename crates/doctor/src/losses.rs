//! Losses of a scene's power, by a few thousand walks before a run.

use radiosity::Scene;

use crate::pilot::LightPilot;

/// The number of walks that are followed. A part of a hundredth is known to a tenth of itself.
const WALKS: u64 = 8192;

/// The power that is lost, summed over channels.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Losses {
    /// The power Φ_T of all emitters [W].
    pub(crate) power: f64,
    /// The part of it that leaves its lamp and meets no side that reflects.
    pub(crate) at_once: f64,
    /// The part of it that ends on the backs of one-sided surfaces, sooner or later.
    pub(crate) on_backs: f64,
    /// The number of walks that were followed.
    pub(crate) walks: f64,
    /// The surfaces whose light is lost at once, and how much [W], the most first.
    pub(crate) lamps: Vec<(u32, f64)>,
    /// The surfaces whose backs take power, and how much [W], the most first.
    pub(crate) backs: Vec<(u32, f64)>,
}

/// Follows light from the emitters of a scene. The answer depends on the scene alone.
pub(crate) fn losses(scene: &Scene) -> Losses {
    Losses::of(&LightPilot::follow_some(scene, WALKS..=WALKS))
}

impl Losses {
    pub(crate) fn of(pilot: &LightPilot) -> Self {
        let ranked = |power: &dyn Fn(u32) -> f64| {
            let lossy = (0..pilot.emission.len() as u32).map(|surface| (surface, power(surface)));
            let mut ranked: Vec<(u32, f64)> = lossy.filter(|&(_, power)| power > 0.0).collect();
            // Ties keep the order of surfaces.
            ranked.sort_by(|a, b| b.1.total_cmp(&a.1));
            ranked
        };
        let lamps = ranked(&|surface| pilot.lost_at_once(surface));
        let backs = ranked(&|surface| pilot.back(surface));
        let part = |ranked: &[(u32, f64)]| ranked.iter().map(|(_, power)| power).sum::<f64>() / pilot.power;
        Losses {
            at_once: part(&lamps),
            on_backs: part(&backs),
            walks: pilot.walks(),
            power: pilot.power,
            lamps,
            backs,
        }
    }

    /// The standard error of the part on backs, at most: that of walks which lose all of their power or none.
    pub(crate) fn backs_error(&self) -> f64 {
        (self.on_backs * (1.0 - self.on_backs).max(0.0) / self.walks).sqrt()
    }
}
