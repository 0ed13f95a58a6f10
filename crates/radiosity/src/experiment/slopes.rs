//! How light is spread over patches: linear fits of it, what is lost without them, and what of either is noise.

use stats::Moments;

use crate::experiment::Experiment;
use crate::experiment::chains::Student;
use crate::experiment::meaning::Meaning;
use crate::experiment::solution::Estimates;
use crate::geometry::face::Face;
use crate::geometry::spec::Corners;
use crate::scene::Scene;
use crate::tally::Tally;

/// What is known of how the light of one face is spread over it, in one channel.
///
/// With (u, v) from 0 to 1 along the edges of the cell, the best linear fit of the radiosity is
///
/// - B + `gradient[0]`·(u − ½) + `gradient[1]`·(v − ½) in a parallelogram,
/// - B + `gradient[0]`·(u − ⅓) + `gradient[1]`·(v − (1 − u)/2) in a triangle.
///
/// In both, `gradient[0]` is what B grows by from the side (or corner) u = 0 to u = 1 along the middle line, and
/// `gradient[1]` what it grows by from v = 0 to v = 1 across. On a group of cells they are what the fit grows by from one end of the
/// group to the other, along the two principal axes on which it extends most; the fit is B + `gradient[k]`·(x − o)·e_k/L_k of both,
/// x being the place, o the centroid, and L_k the length of the group along the axis e_k. The largest coordinate of e_k is positive. Estimates of the two do not depend on each other's definition:
/// the functions that they belong to are orthogonal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slopes {
    /// The growth of B along the two coordinates of the face [W/m²].
    pub gradient: [f64; 2],
    /// The standard errors of the gradients for the whole run [W/m²]; `None` where too few walks tell.
    pub gradient_error: Option<[f64; 2]>,
    /// The mean of the squared difference between the linear fit and its mean, freed of the noise of the estimates
    /// [(W/m²)²]. Without bias, so that it may be negative.
    pub energy: f64,
    /// The standard error of `energy`.
    pub energy_error: Option<f64>,
    /// The variance of the estimated fit about the true one, its mean apart, over the face [(W/m²)²].
    noise: f64,
}

impl Slopes {
    /// `None` where no walk could tell.
    pub(super) fn new(
        experiment: &Experiment,
        tally: &Tally,
        (i, face): (usize, &Face),
        channel: usize,
        student: Option<&Student>,
    ) -> Option<Self> {
        let meaning = experiment.meaning_of((i, face), channel, tally)?;
        let per_unit = Worth::of(&meaning, face, channel, tally).of_slope;
        let basis = experiment.scene().basis_of(face);
        let (none, known) = ([0.0; 2], Some([0.0; 2]));
        let mut slopes =
            Slopes { gradient: none, gradient_error: known, energy: 0.0, energy_error: None, noise: 0.0 };
        let mut energy_variance = Some(0.0);
        for k in 0..2 {
            let (sum, sum_sq) = tally.slope(i, channel, k);
            let moments = Moments { n: tally.counts.walks, sum: sum.unsigned_abs(), sum_sq };
            let mean = per_unit * sum as f64 / moments.n as f64;
            // Where nothing was scored, nothing is known of what a score would do.
            let error = moments.standard_error().filter(|_| sum_sq > 0).map(|error| per_unit * error);
            let square = basis.mean_squares[k];
            let stretch = basis.growth[k] / square;
            slopes.gradient[k] = mean * stretch;
            let deviation = student.map_or(Some(1.0), |student| student.deviation);
            slopes.gradient_error =
                slopes.gradient_error.zip(error).zip(deviation).map(|((mut errors, error), deviation)| {
                    errors[k] = deviation * error * stretch;
                    errors
                });
            let variance = error.map_or(0.0, |error| error * error / square);
            let energy = mean * mean / square - variance;
            slopes.energy += energy;
            slopes.noise += variance;
            // Of c² − σ̂², c normal of variance σ²: 4c²σ² + 2σ⁴ in the mean of what c² says.
            energy_variance = energy_variance
                .zip(error)
                .map(|(sum, _)| sum + (4.0 * energy.max(0.0) + 2.0 * variance) * variance);
        }
        slopes.energy_error = energy_variance.map(f64::sqrt);
        Some(slopes)
    }

    /// The root mean square of the difference between the linear fit and its mean [W/m²]: what is lost where the mean stands
    /// for all of the patch. 0 where noise explains all that is seen.
    pub fn spread(&self) -> f64 {
        self.energy.max(0.0).sqrt()
    }

    /// What the linear fit adds to the mean at places where gradients count with these factors ([`Scene::corners_on_fit`]) [W/m²],
    /// as far as it is likely: the fit is shrunk by the part of its square that is noise.
    pub fn at(&self, places: &[[f64; 2]]) -> Vec<f64> {
        let seen = self.energy.max(0.0);
        let likely = if seen > 0.0 { seen / (seen + self.noise) } else { 0.0 };
        let Slopes { gradient: [u, v], .. } = *self;
        places.iter().map(|[s, t]| likely * (u * s + v * t)).collect()
    }

    /// By how much the spread may be larger: one standard error of its square [W/m²].
    pub fn spread_error(&self) -> Option<f64> {
        self.energy_error.map(|error| (self.energy.max(0.0) + error).sqrt() - self.spread())
    }
}

impl Scene {
    /// At the corners of a piece, in the order of its front's, by what factors the two gradients of [`Slopes`] of its face count in the
    /// linear fit there.
    pub fn corners_on_fit(&self, piece: u32) -> Corners<[f64; 2]> {
        let face = self.faces().piece(piece);
        let Some(planes) = self.planes() else {
            return match self.surfaces()[face.surface as usize].is_triangle() {
                true => Corners::from_iter([[-1.0 / 3.0, -0.5], [2.0 / 3.0, 0.0], [-1.0 / 3.0, 0.5]]),
                false => Corners::from([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]]),
            };
        };
        let growth = planes.basis(face.patch).growth;
        let place = |uv: [f64; 2]| {
            let psi = planes.at(piece, uv);
            // A function that is left out does not grow.
            [0, 1].map(|k| if growth[k] > 0.0 { psi[k] / growth[k] } else { 0.0 })
        };
        self.faces().corners_on_surface(piece).into_iter().map(place).collect()
    }
}

/// What the sums of a tally say of the light on one face in one channel: a linear fit, and how far chance moves it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// The mean of b, the reflected radiosity, over the face [W/m²].
    pub mean: f64,
    /// The gradient, defined as in [`Slopes`] [W/m²].
    pub gradient: [f64; 2],
    /// The variance of the mean [(W/m²)²].
    pub mean_variance: f64,
    /// The variance of the fit about the true one, its mean apart, over the face [(W/m²)²].
    pub slope_variance: f64,
}

/// What one unit of a sum on a face is worth, in one channel, after one walk [W/m²].
struct Worth {
    of_mean: f64,
    /// Of the integral of a function of the basis.
    of_slope: f64,
}

impl Worth {
    fn of(meaning: &Meaning, face: &Face, channel: usize, tally: &Tally) -> Self {
        let per_event = face.reflectance[channel] * meaning.irradiance_per_event.unwrap_or(0.0);
        let of_mean = per_event * meaning.unit;
        Worth { of_mean, of_slope: of_mean / tally.layout().slope_units() as f64 }
    }
}

impl Experiment {
    /// The linear fit to the light of face i in one channel; the mean alone where the method asks for no slopes. `None` where no walk
    /// could tell.
    pub fn fit(&self, tally: &Tally, i: usize, channel: usize) -> Option<Fit> {
        let face = self.scene().faces().get(i);
        let meaning = self.meaning_of((i, &face), channel, tally)?;
        let (gradient, slope_variance) = match self.method().is_linear() {
            true => Slopes::new(self, tally, (i, &face), channel, None).map(|of| (of.gradient, of.noise))?,
            false => ([0.0; 2], 0.0),
        };
        let per_unit = Worth::of(&meaning, &face, channel, tally).of_mean;
        let sums = tally.patch(i, channel);
        let moments = Moments { n: tally.counts.walks, sum: sums[0], sum_sq: sums[1] };
        let error = per_unit * moments.standard_error().unwrap_or(0.0);
        Some(Fit { mean: per_unit * moments.mean()?, gradient, mean_variance: error * error, slope_variance })
    }

    /// The mean and the gradient of the [`Fit`] that each part of a tally says by itself [W/m²]. The parts need no squares. `None` where
    /// walks do not tell.
    pub fn fits_of_parts<'a>(
        &self,
        (whole, parts): (&Tally, &'a [Tally]),
        i: usize,
        channel: usize,
    ) -> Option<impl Iterator<Item = [f64; 3]> + use<'a>> {
        let face = self.scene().faces().get(i);
        let worth = Worth::of(&self.meaning_of((i, &face), channel, whole)?, &face, channel, whole);
        let of_gradients = self.method().is_linear().then(|| {
            let basis = self.scene().basis_of(&face);
            [0, 1].map(|k| worth.of_slope * (basis.growth[k] / basis.mean_squares[k]))
        });
        let fit = move |part: &Tally| {
            let per_walk = 1.0 / part.counts.walks as f64;
            let gradient = of_gradients
                .map(|worth| [0, 1].map(|k| worth[k] * per_walk * number(part.slope_sum(i, channel, k))));
            let mean = worth.of_mean * per_walk * number(part.patch(i, channel)[0] as i128);
            let [u, v] = gradient.unwrap_or_default();
            [mean, u, v]
        };
        parts.iter().all(|part| part.counts.walks > 0).then(|| parts.iter().map(fit))
    }
}

/// A sum as a floating-point number: where it has 64 bits, in a tenth of the time.
#[inline]
fn number(sum: i128) -> f64 {
    #[cold]
    #[inline(never)]
    fn large(sum: i128) -> f64 {
        sum as f64
    }
    match i64::try_from(sum) {
        Ok(sum) => sum as f64,
        Err(_) => large(sum),
    }
}

/// The two errors of a solution that takes the mean of each patch for all of it, over the root mean square of the reflected
/// light: relative L2 norms over the area of all faces that walks tell of, all channels together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Accuracy {
    /// What walks leave unknown of the means.
    pub noise: f64,
    /// What the means leave out of the light's spread over their patches, as far as a linear fit tells.
    pub discretisation: f64,
    /// Noise and discretisation together: the root of the sum of their squares.
    pub total: f64,
    /// The noise of the linear fits: that of the means and of the slopes.
    pub linear_noise: f64,
}

/// The form in which tables and pictures show the light on a patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReportedAnswer {
    /// Its mean.
    Means,
    /// A linear fit.
    Linear,
}

/// The errors of an answer, as parts of the root mean square of the reflected light: relative L2 norms over the area of all faces that walks tell of,
/// all channels together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AnswerError {
    /// Whose errors they are.
    pub answer: ReportedAnswer,
    /// What walks leave unknown.
    pub noise: f64,
    /// What patches are too coarse for.
    pub discretisation: f64,
    /// Both together: the root of the sum of their squares.
    pub total: f64,
}

impl Estimates<'_> {
    /// How the light of face i is spread over it, channel by channel; `None` where no walk could tell, or the method does
    /// not ask for it.
    pub fn slopes(&self, i: usize) -> Option<Vec<Slopes>> {
        if !self.experiment().method().is_linear() {
            return None;
        }
        let face = self.scene().faces().get(i);
        let of_channel = |channel| {
            Slopes::new(self.experiment(), self.tally(), (i, &face), channel, self.student.as_ref())
        };
        (0..self.scene().channels()).map(of_channel).collect()
    }

    /// Noise and discretisation of the solution; `None` where the method asks for no slopes, or no reflected light stands out
    /// from the noise.
    pub fn accuracy(&self) -> Option<Accuracy> {
        let Energies { noise, of_slopes, spread, light } = self.energies()?;
        self.experiment().method().is_linear().then_some(())?;
        let part = |energy: f64| (energy.max(0.0) / light).sqrt();
        (light > 0.0).then(|| Accuracy {
            noise: part(noise),
            discretisation: part(spread),
            total: part(noise + spread.max(0.0)),
            linear_noise: part(noise + of_slopes),
        })
    }

    /// The errors of what tables and pictures show. `predicted` is the discretisation that a pilot predicted of it; without it, linear fits do not tell
    /// what they leave out, and the errors are those of the means. `None` where nothing tells how light is spread over patches, or no
    /// reflected light stands out from the noise.
    pub fn answer_error(&self, predicted: Option<f64>) -> Option<AnswerError> {
        let linear = self.experiment().method().is_linear();
        let Energies { noise, of_slopes, spread, light } = self.energies()?;
        let (answer, noise, light) = match predicted {
            Some(_) if linear => (ReportedAnswer::Linear, noise + of_slopes, light + spread),
            _ => (ReportedAnswer::Means, noise, light),
        };
        let part = |energy: f64| (energy.max(0.0) / light).sqrt();
        let discretisation = predicted.or_else(|| linear.then(|| part(spread)))?;
        let noise = part(noise);
        let total = (noise * noise + discretisation * discretisation).sqrt();
        (light > 0.0).then_some(AnswerError { answer, noise, discretisation, total })
    }

    /// Sums over the area of all faces that walks tell of. `None` where walks do not tell of the slopes that the method asks for.
    fn energies(&self) -> Option<Energies> {
        let linear = self.experiment().method().is_linear();
        let mut sums = Energies::default();
        for (i, face, known) in self.known() {
            for (c, estimate) in known.iter().enumerate() {
                let reflected = estimate.radiosity - face.emittance[c];
                let variance = estimate.std_error.unwrap_or(0.0).powi(2);
                sums.noise += face.area * variance;
                sums.light += face.area * (reflected * reflected - variance);
            }
            for slopes in if linear { self.slopes(i)? } else { Vec::new() } {
                sums.of_slopes += face.area * slopes.noise;
                sums.spread += face.area * slopes.energy;
            }
        }
        Some(sums)
    }
}

/// Energies of a solution: integrals over the area [W²/m²].
#[derive(Default)]
struct Energies {
    /// Of the noise of the means.
    noise: f64,
    /// Of the noise of the slopes.
    of_slopes: f64,
    /// Of the light's spread over patches, without bias.
    spread: f64,
    /// Of the means, without bias.
    light: f64,
}
