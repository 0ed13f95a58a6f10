//! The exact variance of walks that carry the weights of several channels along one path.
//!
//! What decides the path is shared: a walk is born on source s with probability p_s and survives on face j with
//! probability σ_j. The weight of a channel makes up for the difference: at birth it is w_s = (Φ_s/Φ_T)/p_s, Φ being
//! the channel's powers, and at every hit survived it is multiplied by R_j/σ_j. (A gathering walk is born with
//! weight 1; an infinite one is never absorbed, and multiplied by R_j.)
//!
//! The mean square of the weight then travels like light: Σ E W² over the hits on a face obeys the power system
//! with reflectances Q_j = σ_j (R_j/σ_j)² = R_j²/σ_j and source powers p_sw_s². What a weight W on face i still
//! returns to i in the mean is W R_iξ_i, ξ being the channel's own. So in every formula of
//! [`Exact::shooting_variances`] and [`Exact::gathering_variances`] the light of the second moment is carried by Q where
//! it is by R for one channel: with σ = R and p_s = Φ_s/Φ_T, Q is R and w is 1.

use radiosity::{
    EstimatorKind,
    methods::{AbsorptionMode, Event},
};

use crate::answer::Exact;
use crate::system::{RadiositySystem, Singular};

/// What decides the paths of walks, face by face.
#[derive(Clone, Debug, PartialEq)]
pub struct SharedPath {
    /// σ_i: the probability of survival, at least the reflectance of every channel and 0 only where all are.
    pub survival: Vec<f64>,
    /// p_s: the probability that a shooting walk is born on a face, above 0 where any channel emits.
    pub source: Vec<f64>,
}

impl SharedPath {
    /// σ is the greatest reflectance of the channels; p the mean, over those that emit, of Φ_s/Φ_T.
    ///
    /// # Panics
    /// If there is no channel, or if they have unlike numbers of faces.
    pub fn of(channels: &[&Exact]) -> Self {
        let n = channels[0].face_count();
        let survival = (0..n).map(|i| channels.iter().map(|c| c.reflectance()[i]).fold(0.0, f64::max));
        let bright: Vec<Vec<f64>> =
            channels.iter().filter(|c| c.total_power() > 0.0).map(|c| shares(c)).collect();
        let mean = |s: usize| bright.iter().map(|shares| shares[s]).sum::<f64>() / bright.len() as f64;
        SharedPath { survival: survival.collect(), source: (0..n).map(mean).collect() }
    }
}

/// Φ_s/Φ_T of every face.
fn shares(channel: &Exact) -> Vec<f64> {
    let powers = channel.emittance().iter().zip(channel.areas()).map(|(e, a)| e * a);
    powers.map(|power| power / channel.total_power()).collect()
}

/// One channel of walks with shared paths.
#[derive(Clone, Debug)]
pub struct WeightedWalk<'a> {
    channel: &'a Exact,
    path: &'a SharedPath,
    /// Carries second moments: reflectances Q_j = R_j²/σ_j.
    squares: RadiositySystem,
}

/// A source face that a gathering walk meets: σ_s, E_s > 0 and b_s [W/m²].
struct Met {
    sigma: f64,
    e: f64,
    b: f64,
}

impl<'a> WeightedWalk<'a> {
    /// The weights of a channel along such paths.
    ///
    /// # Errors
    /// [`Singular`] if light all but never dies.
    ///
    /// # Panics
    /// Unless there are as many faces, each with a survival of at least the channel's reflectance.
    pub fn new(channel: &'a Exact, path: &'a SharedPath) -> Result<Self, Singular> {
        assert_eq!(path.source.len(), channel.face_count(), "one probability per face");
        let q = |(r, sigma): (&f64, &f64)| {
            assert!(r <= sigma, "a walk survives with {sigma}, less than the reflectance {r}");
            if *r > 0.0 { r * r / sigma } else { 0.0 }
        };
        let squares = channel.reflectance().iter().zip(&path.survival).map(q).collect();
        let squares = channel.system().with_reflectance(squares)?;
        Ok(WeightedWalk { channel, path, squares })
    }

    /// The variance of the channel's B_i [W²/m⁴] for one shooting walk, face by face; 0 where R_i = 0.
    pub fn shooting_variances(&self, estimator: EstimatorKind) -> Vec<f64> {
        let squares = match estimator.absorption() {
            AbsorptionMode::Analog => self.squares.solve(&self.births()).incoming,
            AbsorptionMode::Implicit => self.channel.squared().system.solve(&self.births()).incoming,
            AbsorptionMode::DirectOnly => self.channel.exchange().incoming(&self.births()),
        };
        let expected = self.channel.scored(estimator);
        let scored = self.returned(estimator, &squares);
        let variance = |i: usize| {
            let (r, b) = (self.channel.reflectance()[i], expected[i]);
            let sigma = self.path.survival[i];
            let value = match estimator.event() {
                Event::Absorption => r * r / (1.0 - sigma),
                // R²/σ is 0 where σ is.
                Event::Survival => self.squares.reflectance()[i],
                Event::Arrival => r * r,
            };
            value * scored[i] / self.channel.areas()[i].powi(2) - b * b
        };
        (0..self.channel.face_count()).map(variance).collect()
    }

    /// The variance of the channel's B_i [W²/m⁴] for one gathering walk that is born on face i with probability
    /// `birth[i]`. `None` where no walk is born; and everywhere, for survival, if no walk survives on a source:
    /// its light would be lost.
    ///
    /// # Panics
    /// Unless there is one probability per face.
    pub fn gathering_variances(&self, estimator: EstimatorKind, birth: &[f64]) -> Vec<Option<f64>> {
        assert_eq!(birth.len(), self.channel.face_count(), "one probability per face");
        let lost = |(&e, &sigma): (&f64, &f64)| e > 0.0 && sigma == 0.0;
        if estimator.event() == Event::Survival
            && self.channel.emittance().iter().zip(&self.path.survival).any(lost)
        {
            return vec![None; birth.len()];
        }
        let c = |s: Met| {
            let later = if estimator.scores_again() { 2.0 * s.b } else { 0.0 };
            (s.e + later) / estimator.event().probability(s.sigma)
        };
        let squares = match estimator.absorption() {
            AbsorptionMode::Analog => self.gathered(&self.squares, c),
            AbsorptionMode::Implicit => self.gathered(&self.channel.squared().system, c),
            AbsorptionMode::DirectOnly => {
                let incoming = self.channel.exchange().incoming(&self.gains(c));
                incoming.iter().zip(self.channel.areas()).map(|(phi, area)| phi / area).collect()
            }
        };
        let expected = self.channel.scored(estimator);
        let variance = |(i, &p): (usize, &f64)| {
            let (r, b) = (self.channel.reflectance()[i], expected[i]);
            (p > 0.0).then(|| r * r * squares[i] / p - b * b)
        };
        birth.iter().enumerate().map(variance).collect()
    }

    /// Φ_T²p_sw_s²/A_s of every face [W²/m²]: the mean square of what sets out, as an emittance.
    fn births(&self) -> Vec<f64> {
        let square = |s: usize| {
            let power = self.channel.emittance()[s] * self.channel.areas()[s];
            if power > 0.0 { power * power / (self.path.source[s] * self.channel.areas()[s]) } else { 0.0 }
        };
        (0..self.channel.face_count()).map(square).collect()
    }

    /// The mean squares that arrive on every face [W²], with what their walks still return to it: twice
    /// the product, unless a score ends the walk.
    fn returned(&self, estimator: EstimatorKind, squares: &[f64]) -> Vec<f64> {
        if !estimator.scores_again() {
            return squares.to_vec();
        }
        let terms = squares.iter().zip(self.channel.reflectance()).zip(self.channel.xi());
        terms.map(|((square, r), xi)| square * (1.0 + 2.0 * r * xi)).collect()
    }

    /// The mean square of what a walk gathers that is born on a face [W²/m⁴], if it gains c_sE_s on the sources
    /// it meets.
    fn gathered(&self, system: &RadiositySystem, c: impl Fn(Met) -> f64) -> Vec<f64> {
        system.solve(&self.gains(c)).irradiance
    }

    /// c_sE_s of every face.
    fn gains(&self, c: impl Fn(Met) -> f64) -> Vec<f64> {
        let gain = |(face, &e): (usize, &f64)| {
            let b = self.channel.solution().reflected[face];
            let sigma = self.path.survival[face];
            if e > 0.0 { c(Met { sigma, e, b }) * e } else { 0.0 }
        };
        self.channel.emittance().iter().enumerate().map(gain).collect()
    }
}
