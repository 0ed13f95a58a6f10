//! Bounds on the number of walks that hold before any walk is shot, given how dark the scene is (S97 §§2.2, 2.3, 3.3).

use exact::VarianceBounds;
use job::Target;
use radiosity::{Birth, Direction, Estimates, Experiment, methods::birth_probabilities, precision::Quantity};
use stats::{foresight, normal_quantile};

use crate::target::{about, looks};

/// An upper bound on the number of walks that bring every variance below a threshold, in any scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bound {
    /// b of the darkest patch that the target is about, as the pilot estimates it [W/m²].
    pub darkest: f64,
    /// The variance of B that the target asks for [W²/m⁴].
    pub threshold: f64,
    /// The bound on any patch's variance of B for one walk [W²/m⁴].
    pub variance: f64,
    /// The number of walks that brings every variance below the threshold.
    pub walks: f64,
    /// The walk count at which a run that needs these walks ends by its rule of stopping.
    pub ends: u64,
    /// The most rays of these walks in expectation; for shooting only.
    pub rays: Option<f64>,
}

impl Bound {
    /// The bound for walks in a grey scene. `None` in colour, for chains, with a final gather, for net fluxes and the irradiance of black
    /// faces, on which S97 bounds nothing, and if the pilot has not seen the darkest patch.
    pub fn new(experiment: &Experiment, target: &Target, estimates: &Estimates, level: f64) -> Option<Self> {
        let scene = experiment.scene();
        if scene.channels() > 1 || !experiment.method().final_gather().is_empty() {
            return None;
        }
        let is_bounded = match target.quantity {
            Quantity::Irradiance => about(estimates, target).all(|(_, face, _)| face.reflectance.is_lit()),
            Quantity::Radiosity => true,
            Quantity::Net => false,
        };
        if !is_bounded {
            return None;
        }
        let bounds = VarianceBounds::of_scene(scene, 0);
        let variance = variance(experiment, &bounds)?;
        let darkest = darkest(estimates, target).filter(|&b| b > 0.0)?;
        // Half of the interval is z standard errors.
        let z = normal_quantile(0.5 + 0.5 * level);
        let threshold = (target.relative_error * darkest / z).powi(2);
        let by_scores = target.min_hits as f64 * (variance / darkest.powi(2) + 1.0);
        let walks = (variance / threshold).max(by_scores).max(target.min_paths as f64);
        // This is the look that shows that twice its walks will do; foresight asks for a little more than half.
        let promising = walks * (target.relative_error / foresight(target.relative_error)).powi(2);
        let look = looks(experiment, u64::MAX).into_iter().find(|&look| look as f64 >= promising)?;
        let shooting = experiment.method().direction() == Some(&Direction::Shooting);
        Some(Bound {
            darkest,
            threshold,
            variance,
            walks,
            ends: look.saturating_mul(2),
            rays: shooting.then(|| bounds.shooting_rays(walks)),
        })
    }
}

/// The largest variance that any patch can have for one walk [W²/m⁴].
fn variance(experiment: &Experiment, bounds: &VarianceBounds) -> Option<f64> {
    let kind = experiment.method().estimator_kind()?;
    match experiment.method().direction()? {
        Direction::Shooting => Some(bounds.shooting_variance_of(kind)),
        Direction::Gathering(birth) => {
            Some(bounds.gathering_variance_of(kind, least_birth(experiment, birth)))
        }
    }
}

fn least_birth(experiment: &Experiment, birth: &Birth) -> f64 {
    let births = birth_probabilities(experiment.scene(), birth);
    births.into_iter().filter(|&p| p > 0.0).fold(1.0, f64::min)
}

/// b, the reflected part of B, of the darkest patch that the target needs, as the pilot estimates it: the darkest part of the area
/// may miss the target. Where B = b the relative errors of B and H are one; where B is more, that of B is less.
fn darkest(estimates: &Estimates, target: &Target) -> Option<f64> {
    let dark = about(estimates, target).filter(|(_, patch, _)| patch.reflectance.is_lit());
    let mut patches: Vec<(f64, f64)> =
        dark.map(|(_, patch, b)| (b[0].radiosity - patch.emittance[0], patch.area)).collect();
    patches.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut spared =
        (1.0 - target.fraction) * patches.iter().map(|(_, area)| area).sum::<f64>() * (1.0 + 1e-9);
    let decisive = patches.into_iter().find(|(_, area)| {
        spared -= area;
        spared < 0.0
    });
    decisive.map(|(b, _)| b)
}
