//! How far the answer of the discretised system is from that of the integral equation.
//!
//! Discrete walks go on from a fresh point of the patch that they hit, and so solve the radiosity system of the patches; continuous walks go on
//! from the hit, and their means over patches are those of the integral equation's solution. A control of continuous walks in G groups
//! tells the difference. With d the discrete irradiance of a patch, c_g that of group g, and A the area,
//!
//! D² = Σ A·[mean over g ≠ h of (d − c_g)(d − c_h)] − Σ A·σ_d²
//!
//! has no bias, since groups are independent; the distance is D over the root mean square of H, found from products of groups as well. Its
//! interval is that of the jackknife over groups (Student, G − 1 degrees of freedom), so that what walks score on several patches at once is in
//! it, widened by the noise of the discrete result.

use radiosity::{
    Estimates, EstimatorKind, Experiment, Method, Sequence, Space, Tally, Walks, methods::AbsorptionMode,
};
use report::DiscretisedSummary;

/// G, the number of groups of the control.
const GROUPS: usize = 16;

/// The control takes this part of the rays of the result …
const SHARE: u64 = 16;

/// … but at least the first, and at most the second of these.
const LEAST_RAYS: u64 = 1 << 15;
const MOST_RAYS: u64 = 1 << 21;

/// A result of fewer rays is not examined.
const EXAMINED_RAYS: u64 = 1 << 16;

/// Walks that tell how many rays a walk takes.
const FIRST_WALKS: u64 = 256;

/// What sets the numbers of the control apart from those of the result.
const APART: u64 = 0xD15C_2E7E_D000_0001;

/// A control of continuous walks in the scene of a discrete result.
pub struct DiscretisedControl {
    experiment: Experiment,
    sequence: Sequence,
    walks_per_group: u64,
}

impl DiscretisedControl {
    /// The number of parts that [`DiscretisedControl::group`] makes.
    pub const GROUPS: usize = GROUPS;

    /// The control of a result, by its seed and its rays; `None` where the result is not of the discretised system, or too short to be
    /// examined.
    pub fn new(estimates: &Estimates, seed: u64) -> Option<Self> {
        let rays = estimates.tally().counts.rays;
        if !is_discretised(estimates.experiment().method()) || rays < EXAMINED_RAYS {
            return None;
        }
        let walks = Walks { space: Space::Continuous, ..Walks::shooting(EstimatorKind::Collision) };
        let experiment = Experiment::new(estimates.scene().clone(), Method::Walks(walks)).ok()?;
        let sequence = Sequence::new(seed ^ APART);
        let control = DiscretisedControl { experiment, sequence, walks_per_group: FIRST_WALKS };
        let rays_per_walk = control.group(0).counts.rays as f64 / FIRST_WALKS as f64;
        let budget = (rays / SHARE).clamp(LEAST_RAYS, MOST_RAYS) as f64;
        let walks_per_group = (budget / rays_per_walk / GROUPS as f64).ceil() as u64;
        Some(DiscretisedControl { walks_per_group: walks_per_group.max(2), ..control })
    }

    /// The tally of one group.
    pub fn group(&self, number: usize) -> Tally {
        let first = number as u64 * self.walks_per_group;
        let (mut board, mut tally) = (self.experiment.board(), self.experiment.tally());
        self.experiment.walk(&self.sequence, first..first + self.walks_per_group, &mut board);
        board.add_to(&mut tally).expect("a control is short");
        tally
    }

    /// H of a face in one channel, by the tally of a group [W/m²].
    fn irradiance(&self, tally: &Tally, face: usize, channel: usize) -> f64 {
        let meaning = self.experiment.meaning(face, channel, tally);
        let per_unit = meaning.map_or(0.0, |m| m.unit * m.irradiance_per_event.unwrap_or(0.0));
        per_unit * tally.patch(face, channel)[0] as f64 / tally.counts.walks as f64
    }

    /// The distance that all groups tell, with an interval of this level.
    pub fn distance(
        &self,
        estimates: &Estimates,
        groups: &[Tally],
        level: f64,
    ) -> Option<DiscretisedSummary> {
        let mut sums = JackknifeSums::default();
        for (i, face, known) in estimates.known() {
            for (c, estimate) in known.iter().enumerate() {
                if estimate.irradiance_interval.is_some() {
                    let control: Vec<f64> = groups.iter().map(|tally| self.irradiance(tally, i, c)).collect();
                    let estimate = DiscreteEstimate {
                        irradiance: estimate.irradiance.unwrap_or(0.0),
                        noise: estimate.irradiance_error.unwrap_or(0.0).powi(2),
                    };
                    sums.add(face.area, estimate, &control);
                }
            }
        }
        sums.distance(level)
    }
}

/// Whether a method solves the radiosity system of the patches, not the integral equation. What comes straight from the emitters is the same
/// in both.
pub fn is_discretised(method: &Method) -> bool {
    let direct = method.estimator_kind().is_some_and(|kind| kind.absorption() == AbsorptionMode::DirectOnly);
    method.space() == Space::Discrete && !direct
}

/// The irradiance of a face in the discrete result [W/m²], and the variance of its estimate.
struct DiscreteEstimate {
    irradiance: f64,
    noise: f64,
}

/// Sums over faces and channels, by group.
#[derive(Default)]
struct JackknifeSums {
    /// Σ A·(d − c_g)·Σ_(h ≠ g)(d − c_h).
    differences: [f64; GROUPS],
    /// Σ A·c_g·Σ_(h ≠ g) c_h.
    products: [f64; GROUPS],
    /// Σ A·σ² of the discrete result, and of the mean of the groups.
    noise: [f64; 2],
}

impl JackknifeSums {
    /// Adds a face in a channel: its estimate, and the irradiance that each group of the control finds there.
    fn add(&mut self, area: f64, estimate: DiscreteEstimate, control: &[f64]) {
        let DiscreteEstimate { irradiance: discrete, noise } = estimate;
        let all: f64 = control.iter().sum();
        let groups = control.len() as f64;
        let whole = groups * discrete - all;
        let mut squares = 0.0;
        for (g, c) in control.iter().enumerate() {
            let difference = discrete - c;
            self.differences[g] += area * difference * (whole - difference);
            self.products[g] += area * c * (all - c);
            squares += (c - all / groups).powi(2);
        }
        self.noise[0] += area * noise;
        self.noise[1] += area * squares / (groups * (groups - 1.0));
    }

    fn distance(&self, level: f64) -> Option<DiscretisedSummary> {
        let groups = GROUPS as f64;
        // D² over the mean square of H, without the group `but`.
        let ratio = |but: Option<usize>| {
            let without =
                |sums: &[f64; GROUPS]| sums.iter().sum::<f64>() - but.map_or(0.0, |g| 2.0 * sums[g]);
            let left = if but.is_some() { groups - 1.0 } else { groups };
            let pairs = left * (left - 1.0);
            (without(&self.differences) / pairs - self.noise[0]) / (without(&self.products) / pairs)
        };
        let squared = ratio(None);
        let without: Vec<f64> = (0..GROUPS).map(|g| ratio(Some(g))).collect();
        let mean = without.iter().sum::<f64>() / groups;
        let scatter = without.iter().map(|one| (one - mean).powi(2)).sum::<f64>();
        let error = ((groups - 1.0) / groups * scatter).sqrt() * (1.0 + self.noise[0] / self.noise[1]);
        let half_width = stats::student_quantile(0.5 + 0.5 * level, GROUPS as u64 - 1) * error;
        let root = |squared: f64| squared.max(0.0).sqrt();
        half_width.is_finite().then(|| DiscretisedSummary {
            distance: root(squared),
            low: root(squared - half_width),
            high: root(squared + half_width),
        })
    }
}
