//! The errors that a solution states for itself.

use crate::answer::Exact;
use crate::found::FormFactors;

/// What sums of form factors that are taken as exact may be off, and radiosities relative to the greatest.
const ROUNDING: f64 = 1e-12;

/// The errors of a solution of the radiosity system. They do not include the discretisation: the system takes
/// the radiosity of a face to be uniform.
#[derive(Clone, Debug, PartialEq)]
pub struct SystemAccuracy {
    /// How the form factors were found.
    pub form_factors: FormFactors,
    /// The least and the greatest Σ_j F_ij: 1 in a closed scene; what is missing is light that leaves the
    /// scene or dies on backs.
    pub row_sums: [f64; 2],
    /// The greatest estimated error Σ_j |δF_ij| of a row.
    pub row_error: f64,
    /// Whether no row sums to more than 1 by more than its estimated error: more light than there is would be a
    /// fault of the form factors.
    pub rows_possible: bool,
    /// max_i |B_i − E_i − R_i Σ_j F_ij B_j| / max_i B_i of the solution.
    pub residual: f64,
    /// How far B_i may be off [W/m²] through both, face by face: the solution of the system with the sources
    /// R_i (Σ_j |δF_ij| B_j + δH_i) + residual · max B, the residual being no less than R_i roundings, to first order in the errors; δH_i is that of the light of lamps.
    pub radiosity_error: Vec<f64>,
}

impl SystemAccuracy {
    /// The face where δB_i/B_i is greatest, and that error, among those that are not [`Self::undetermined`].
    pub fn worst(&self, exact: &Exact) -> Option<(usize, f64)> {
        let relative = |(error, b): (&f64, &f64)| error / b;
        let errors = self.radiosity_error.iter().zip(&exact.solution().radiosity).map(relative).enumerate();
        errors.filter(|(_, error)| *error < 1.0).max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// How many faces have a δB_i of B_i or more: too dark, or too nearly shut off, for the form factors to tell. Faces
    /// that light cannot reach are not among them: their errors are roundings.
    pub fn undetermined(&self, exact: &Exact) -> usize {
        let radiosity = &exact.solution().radiosity;
        let rounding = ROUNDING * radiosity.iter().copied().fold(0.0, f64::max);
        let pairs = self.radiosity_error.iter().zip(radiosity);
        pairs.filter(|(error, b)| error >= b && **error > rounding).count()
    }

    /// The accuracy of a solution, at the price of one more.
    pub fn of(exact: &Exact) -> Self {
        let (exchange, system) = (exact.exchange(), exact.system());
        let solution = exact.solution();
        let brightest = solution.radiosity.iter().copied().fold(0.0, f64::max);
        let source = |(i, error): (usize, f64)| {
            let reflectance = system.reflectance()[i];
            // A residual of 0 is one that roundings of the products hide.
            let residual = solution.residual.max(f64::EPSILON * reflectance);
            reflectance * error / exchange.areas()[i] + residual * brightest
        };
        let mut errors = exchange.incoming_error(&solution.radiosity);
        errors.iter_mut().zip(&exact.lamps().error).for_each(|(error, of_lamps)| *error += of_lamps);
        let sources: Vec<f64> = errors.into_iter().enumerate().map(source).collect();
        let (row_sums, row_errors) = (exchange.row_sums(), exchange.row_errors());
        let possible = |(sum, error): (&f64, &f64)| *sum <= 1.0 + error.max(ROUNDING);
        SystemAccuracy {
            form_factors: exact.form_factors().clone(),
            row_sums: [
                row_sums.iter().copied().fold(f64::INFINITY, f64::min),
                row_sums.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            ],
            row_error: row_errors.iter().copied().fold(0.0, f64::max),
            rows_possible: row_sums.iter().zip(&row_errors).all(possible),
            residual: solution.residual,
            radiosity_error: system.solve(&sources).radiosity,
        }
    }
}
