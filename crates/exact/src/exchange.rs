//! The form factors of a scene as one symmetric matrix.

use faer::Mat;

use crate::box_scene::BoxScene;
use crate::form_factor::exchange_area;

/// Patch areas and the dense, symmetric matrix of exchange areas A_iF_ij. Geometry only: every set of
/// reflectances and emittances shares it.
#[derive(Clone, Debug)]
pub struct ExchangeMatrix {
    areas: Vec<f64>,
    exchange: Mat<f64>,
}

impl ExchangeMatrix {
    /// n × n exchange areas [m²] of patches with the n `areas` [m²], each pair asked for once, `(i, j)` with
    /// i ≥ j.
    pub fn new(areas: Vec<f64>, exchange_area: impl Fn(usize, usize) -> f64) -> Self {
        let n = areas.len();
        let mut exchange = Mat::zeros(n, n);
        for j in 0..n {
            for i in j..n {
                let area = exchange_area(i, j);
                (exchange[(i, j)], exchange[(j, i)]) = (area, area);
            }
        }
        ExchangeMatrix { areas, exchange }
    }

    /// The exchange areas between the patches of a box, in closed form.
    pub fn of_box(scene: &BoxScene) -> Self {
        let patches = scene.patches();
        let areas = patches.iter().map(|patch| patch.area()).collect();
        Self::new(areas, |i, j| exchange_area(&patches[i], &patches[j]))
    }

    /// The number of patches n.
    pub fn patch_count(&self) -> usize {
        self.areas.len()
    }

    /// A_i [m²] of every patch.
    pub fn areas(&self) -> &[f64] {
        &self.areas
    }

    /// A_iF_ij [m²].
    pub fn exchange_area(&self, i: usize, j: usize) -> f64 {
        self.exchange[(i, j)]
    }

    /// F_ij.
    pub fn form_factor(&self, i: usize, j: usize) -> f64 {
        self.exchange[(i, j)] / self.areas[i]
    }

    /// φ_i = Σ_j A_iF_ij B_j [W]: what arrives on every patch from patches of these radiosities [W/m²].
    ///
    /// # Panics
    /// Unless there is one radiosity per patch.
    pub fn incoming(&self, radiosity: &[f64]) -> Vec<f64> {
        assert_eq!(radiosity.len(), self.patch_count(), "one radiosity per patch");
        // Row sums over columns, which are what lies together; the matrix is symmetric.
        let product = |i: usize| self.exchange.col(i).iter().zip(radiosity).map(|(s, b)| s * b).sum();
        (0..self.patch_count()).map(product).collect()
    }

    /// max_i |Σ_j F_ij − 1|: 0 in a closed scene if the form factors are exact.
    pub fn closure_defect(&self) -> f64 {
        let row_sums = self.incoming(&vec![1.0; self.patch_count()]);
        let defects = row_sums.iter().zip(&self.areas).map(|(sum, area)| (sum / area - 1.0).abs());
        defects.fold(0.0, f64::max)
    }
}
