//! The form factors of a scene as one symmetric matrix.

use crate::box_scene::BoxScene;
use crate::dense::DenseMatrix;
use crate::form_factor::exchange_area;

/// The areas of faces and the dense, symmetric matrix of exchange areas A_iF_ij. Geometry only: every set of
/// reflectances and emittances shares it.
#[derive(Clone, Debug)]
pub struct ExchangeMatrix {
    areas: Vec<f64>,
    exchange: DenseMatrix,
    /// The error of every exchange area relative to itself.
    relative_error: f64,
    /// Pairs that err by more.
    uncertain: Vec<Uncertain>,
}

/// A pair whose exchange area has an estimated error [m²].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Uncertain {
    pub i: usize,
    pub j: usize,
    pub error: f64,
}

impl ExchangeMatrix {
    /// n × n exchange areas [m²] of faces with the n `areas` [m²], each pair asked for once, `(i, j)` with
    /// i ≥ j; taken as exact.
    pub fn new(areas: Vec<f64>, exchange_area: impl Fn(usize, usize) -> f64) -> Self {
        let n = areas.len();
        let mut exchange = DenseMatrix::zeros(n, n);
        for j in 0..n {
            for i in j..n {
                let area = exchange_area(i, j);
                (exchange[(i, j)], exchange[(j, i)]) = (area, area);
            }
        }
        ExchangeMatrix { areas, exchange, relative_error: 0.0, uncertain: vec![] }
    }

    /// The exchange areas between the patches of a box, in closed form. A box is closed: how far the rows are
    /// from 1 tells the error.
    pub fn of_box(scene: &BoxScene) -> Self {
        let patches = scene.patches();
        let areas = patches.iter().map(|patch| patch.area()).collect();
        let matrix = Self::new(areas, |i, j| exchange_area(&patches[i], &patches[j]));
        let defect = matrix.closure_defect();
        matrix.with_errors(defect, vec![])
    }

    /// The exchange areas of faces that are groups of these: face i is part of face `face_of[i]` of `faces`.
    pub(crate) fn grouped(&self, face_of: &[u32], faces: usize) -> Self {
        let mut areas = vec![0.0; faces];
        let mut exchange = DenseMatrix::zeros(faces, faces);
        for (i, &group) in face_of.iter().enumerate() {
            areas[group as usize] += self.areas[i];
            for (j, area) in self.exchange.column(i).iter().enumerate() {
                exchange[(face_of[j] as usize, group as usize)] += area;
            }
        }
        // Both sums of a pair have the same terms in another order.
        for (j, i) in (0..faces).flat_map(|j| (j + 1..faces).map(move |i| (j, i))) {
            exchange[(j, i)] = exchange[(i, j)];
        }
        let group = |face: usize| face_of[face] as usize;
        let uncertain =
            self.uncertain.iter().map(|pair| Uncertain { i: group(pair.i), j: group(pair.j), ..*pair });
        let uncertain = uncertain.collect();
        ExchangeMatrix { areas, exchange, relative_error: self.relative_error, uncertain }
    }

    /// The matrix with these errors in place of its own.
    pub(crate) fn with_errors(self, relative_error: f64, uncertain: Vec<Uncertain>) -> Self {
        ExchangeMatrix { relative_error, uncertain, ..self }
    }

    /// Pairs that err by more than rounding.
    #[cfg(test)]
    pub(crate) fn uncertain(&self) -> &[Uncertain] {
        &self.uncertain
    }

    /// The number n of faces.
    pub fn face_count(&self) -> usize {
        self.areas.len()
    }

    /// A_i [m²] of every face.
    pub fn areas(&self) -> &[f64] {
        &self.areas
    }

    /// A_iF_ij: the exchange area of two faces [m²].
    pub fn exchange_area(&self, i: usize, j: usize) -> f64 {
        self.exchange[(i, j)]
    }

    /// F_ij: the part of the light of face i that arrives on face j.
    pub fn form_factor(&self, i: usize, j: usize) -> f64 {
        self.exchange[(i, j)] / self.areas[i]
    }

    /// φ_i = Σ_j A_iF_ij B_j [W]: what arrives on every face from faces of these radiosities [W/m²].
    ///
    /// # Panics
    /// Unless there is one radiosity per face.
    pub fn incoming(&self, radiosity: &[f64]) -> Vec<f64> {
        assert_eq!(radiosity.len(), self.face_count(), "one radiosity per face");
        // Row sums over columns, which are what lies together; the matrix is symmetric.
        let product = |i: usize| self.exchange.column(i).iter().zip(radiosity).map(|(s, b)| s * b).sum();
        (0..self.face_count()).map(product).collect()
    }

    /// The most that φ_i [W] may be off where radiosities are these [W/m²]: Σ_j |δ(A_iF_ij)| B_j.
    ///
    /// # Panics
    /// Unless there is one radiosity per face.
    pub fn incoming_error(&self, radiosity: &[f64]) -> Vec<f64> {
        let mut error: Vec<f64> =
            self.incoming(radiosity).iter().map(|phi| self.relative_error * phi).collect();
        for pair in &self.uncertain {
            error[pair.i] += pair.error * radiosity[pair.j];
            error[pair.j] += pair.error * radiosity[pair.i];
        }
        error
    }

    /// Σ_j F_ij of every row: 1 where no light leaves the scene.
    pub fn row_sums(&self) -> Vec<f64> {
        self.per_area(self.incoming(&vec![1.0; self.face_count()]))
    }

    /// The estimated error Σ_j |δF_ij| of every row.
    pub fn row_errors(&self) -> Vec<f64> {
        self.per_area(self.incoming_error(&vec![1.0; self.face_count()]))
    }

    /// max_i |Σ_j F_ij − 1|: 0 in a closed scene if the form factors are exact.
    pub fn closure_defect(&self) -> f64 {
        self.row_sums().iter().map(|sum| (sum - 1.0).abs()).fold(0.0, f64::max)
    }

    fn per_area(&self, of_rows: Vec<f64>) -> Vec<f64> {
        of_rows.iter().zip(&self.areas).map(|(x, area)| x / area).collect()
    }
}
