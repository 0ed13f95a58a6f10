//! The radiosity system B_i = E_i + R_i Σ_j F_ij B_j, solved densely.
//!
//! With S_ij = A_iF_ij symmetric and s_i = √(R_i/A_i), the unknowns y_i = √(R_iA_i) H_i obey
//! (I − K) y = s ∘ S E with K_ij = s_i S_ij s_j: symmetric and, for R < 1, positive definite. So Cholesky's
//! factor L does, at half the work and memory of a general one, and faces with R = 0 need no special care.

use std::sync::Arc;

use thiserror::Error;

use crate::dense::{Cholesky, DenseMatrix};
use crate::exchange::ExchangeMatrix;

/// Right-hand sides solved for at a time: enough to be fast, few against the matrix.
const BLOCK: usize = 256;

/// The system has no unique solution to working precision.
#[derive(Clone, Debug, Error, PartialEq)]
#[error(
    "the radiosity system is singular (a reflectance is 1 to working precision, so light would never die); \
     lower the highest reflectance"
)]
pub struct Singular;

/// A scene's form factors with one set of reflectances, factored: solves for any emittances.
#[derive(Clone, Debug)]
pub struct RadiositySystem {
    exchange: Arc<ExchangeMatrix>,
    reflectance: Vec<f64>,
    /// s_i = √(R_i/A_i), which makes the system symmetric [1/m].
    scale: Vec<f64>,
    /// L with L Lᵀ = I − K.
    factor: Cholesky,
}

/// The solution of the radiosity system for one set of emittances, face by face.
#[derive(Clone, Debug, PartialEq)]
pub struct SystemSolution {
    /// B_i: the radiosity of each face [W/m²].
    pub radiosity: Vec<f64>,
    /// b_i = B_i − E_i: reflected radiosity [W/m²].
    pub reflected: Vec<f64>,
    /// H_i = φ_i/A_i: irradiance [W/m²].
    pub irradiance: Vec<f64>,
    /// φ_i = Σ_j F_ji (Φ_j + R_jφ_j): incoming power [W].
    pub incoming: Vec<f64>,
    /// max_i |B_i − E_i − R_i Σ_j F_ij B_j| / max_i B_i.
    pub residual: f64,
}

impl RadiositySystem {
    /// Factors the system for one reflectance R in [0, 1) per face.
    ///
    /// # Errors
    /// [`Singular`] if the matrix is not positive definite to working precision.
    ///
    /// # Panics
    /// Unless there is one reflectance per face.
    pub fn new(exchange: Arc<ExchangeMatrix>, reflectance: Vec<f64>) -> Result<Self, Singular> {
        let n = exchange.face_count();
        assert_eq!(reflectance.len(), n, "one reflectance per face");
        let scale: Vec<f64> = reflectance.iter().zip(exchange.areas()).map(|(r, a)| (r / a).sqrt()).collect();
        let matrix = DenseMatrix::from_fn(n, n, |i, j| {
            let identity = if i == j { 1.0 } else { 0.0 };
            identity - scale[i] * exchange.exchange_area(i, j) * scale[j]
        });
        let factor = Cholesky::new(matrix).ok_or(Singular)?;
        Ok(RadiositySystem { exchange, reflectance, scale, factor })
    }

    /// The system of the same form factors with another reflectance in [0, 1) per face.
    ///
    /// # Errors
    /// [`Singular`] if the matrix is not positive definite to working precision.
    ///
    /// # Panics
    /// Unless there is one reflectance per face.
    pub fn with_reflectance(&self, reflectance: Vec<f64>) -> Result<Self, Singular> {
        Self::new(Arc::clone(&self.exchange), reflectance)
    }

    /// The form factors it was made from.
    pub fn exchange(&self) -> &ExchangeMatrix {
        &self.exchange
    }

    /// R_i of every face.
    pub fn reflectance(&self) -> &[f64] {
        &self.reflectance
    }

    /// Solves for one emittance E [W/m²] per face.
    ///
    /// # Panics
    /// Unless there is one emittance per face.
    pub fn solve(&self, emittance: &[f64]) -> SystemSolution {
        let direct = self.exchange.incoming(emittance);
        let mut whitened = DenseMatrix::from_fn(direct.len(), 1, |i, _| self.scale[i] * direct[i]);
        self.factor.solve_lower(&mut whitened);
        let mut y = whitened.column(0).to_vec();
        self.factor.solve_transposed(&mut y);
        let shot: Vec<f64> = (0..emittance.len()).map(|i| emittance[i] + self.scale[i] * y[i]).collect();
        self.gather(emittance, &shot)
    }

    /// Solves for one emittance E [W/m²] per face, and what meets each from elsewhere [W]; nothing where there are no such numbers.
    pub(crate) fn solve_lit(&self, emittance: &[f64], met: &[f64]) -> SystemSolution {
        if met.is_empty() {
            return self.solve(emittance);
        }
        let irradiance = |i: usize| met[i] / self.exchange.areas()[i];
        let reflected = |i: usize| self.reflectance[i] * irradiance(i);
        let sources: Vec<f64> = emittance.iter().enumerate().map(|(i, e)| e + reflected(i)).collect();
        let mut solution = self.solve(&sources);
        for (i, met) in met.iter().enumerate() {
            solution.reflected[i] += reflected(i);
            solution.irradiance[i] += irradiance(i);
            solution.incoming[i] += met;
        }
        solution
    }

    /// One more bounce of a radiosity that already solves the system: gives φ where R = 0, too.
    fn gather(&self, emittance: &[f64], shot: &[f64]) -> SystemSolution {
        let incoming = self.exchange.incoming(shot);
        let irradiance: Vec<f64> =
            incoming.iter().zip(self.exchange.areas()).map(|(phi, a)| phi / a).collect();
        let reflected: Vec<f64> = irradiance.iter().zip(&self.reflectance).map(|(h, r)| r * h).collect();
        let radiosity: Vec<f64> = emittance.iter().zip(&reflected).map(|(e, b)| e + b).collect();
        let residual = self.residual(emittance, &radiosity);
        SystemSolution { radiosity, reflected, irradiance, incoming, residual }
    }

    fn residual(&self, emittance: &[f64], radiosity: &[f64]) -> f64 {
        let incoming = self.exchange.incoming(radiosity);
        let (mut largest, mut off) = (0.0_f64, 0.0_f64);
        for (i, phi) in incoming.iter().enumerate() {
            let reflected = self.reflectance[i] * phi / self.exchange.areas()[i];
            off = off.max((radiosity[i] - emittance[i] - reflected).abs());
            largest = largest.max(radiosity[i]);
        }
        if largest > 0.0 { off / largest } else { 0.0 }
    }

    /// ξ_i: the incoming power on every face when it alone emits unit power (S97; BS's ζ_i is R_iξ_i).
    ///
    /// ξ_i = F_ii + k_iᵀ(I − K)⁻¹k_i = F_ii + |L⁻¹k_i|² with (k_i)_j = s_jS_ji/√A_i.
    pub fn xi(&self) -> Vec<f64> {
        let faces: Vec<usize> = (0..self.exchange.face_count()).collect();
        let mut xi: Vec<f64> = faces.iter().map(|&i| self.exchange.form_factor(i, i)).collect();
        for block in faces.chunks(BLOCK) {
            let whitened = self.whitened(block);
            for (c, &i) in block.iter().enumerate() {
                xi[i] += whitened.column(c).iter().map(|w| w * w).sum::<f64>();
            }
        }
        xi
    }

    /// L⁻¹k_i of some faces i, column by column.
    fn whitened(&self, faces: &[usize]) -> DenseMatrix {
        let mut k = DenseMatrix::from_fn(self.scale.len(), faces.len(), |j, c| {
            let i = faces[c];
            self.scale[j] * self.exchange.exchange_area(j, i) / self.exchange.areas()[i].sqrt()
        });
        self.factor.solve_lower(&mut k);
        k
    }
}
