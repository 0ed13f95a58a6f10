//! Light on small cells of all faces, and errors of runs against references.

use std::path::Path;

use job::Job;
use radiosity::{Estimates, Experiment, Scene, Side, Tally};

use super::runs::{Failure, experiment, uniform, walk};

/// The largest cells of a reference [m²].
const FINE: f64 = 5e-4;

/// Faces above this area are distinguished [m²].
const LARGE: f64 = 1e-3;

/// One side of a face in a reference.
struct ReferenceSheet {
    surface: u32,
    side: Side,
    /// Its cells are the `rows`² cells of a triangle.
    rows: u32,
    /// Its first cell among those of all sheets.
    first: usize,
    area: f64,
}

/// Two independent runs on small cells.
pub struct Reference {
    sheets: Vec<ReferenceSheet>,
    /// The reflected light of every cell [W/m²].
    b: [Vec<f64>; 2],
    /// The energy of the light on all cells, and that of the means of faces above 10 cm² [W²/m²].
    energy: [f64; 2],
}

/// Squared errors over energies: on all cells, and of the means of faces above 10 cm².
#[derive(Clone, Copy)]
pub struct LightErrors {
    /// Of noise and discretisation.
    pub total: [f64; 2],
    /// Of discretisation alone.
    pub lost: [f64; 2],
}

impl Reference {
    /// The references of a job.
    pub fn new(job: &Path, walks: u64) -> Result<Self, Failure> {
        let (fine, _) = experiment(job, &uniform(job, FINE)?, Job::build_scene)?;
        let (mut sheets, mut first) = (Vec::new(), 0);
        for (number, surface) in (0..).zip(fine.scene().surfaces()) {
            for side in [Side::Front, Side::Back] {
                let Some(piece) = fine.scene().faces().first_piece_on(number, side) else { continue };
                let cells = surface.cell_count();
                let area = f64::from(cells) * fine.scene().faces().piece(piece).area;
                sheets.push(ReferenceSheet { surface: number, side, rows: cells.isqrt(), first, area });
                first += cells as usize;
            }
        }
        let mut reference = Reference { sheets, b: [Vec::new(), Vec::new()], energy: [0.0; 2] };
        let tallies = parallel::on_all_cores(2, |number| walk(&fine, 101 + number as u64, walks));
        reference.b = [0, 1].map(|number| reference.light(&fine, &tallies[number]));
        let nothing = vec![0.0; first];
        reference.energy = reference.product([&nothing, &nothing]);
        Ok(reference)
    }

    /// The reflected light that a run has found, on the cells of the reference.
    pub fn light(&self, experiment: &Experiment, tally: &Tally) -> Vec<f64> {
        let (scene, estimates) = (experiment.scene(), Estimates::new(experiment, tally, 0.95));
        // The mean and the gradient of every face.
        let mut of_face = vec![[0.0; 3]; scene.faces().len()];
        for (face, known, channels) in estimates.known() {
            let [u, v] = estimates.slopes(face).map_or([0.0; 2], |slopes| slopes[0].gradient);
            of_face[face] = [channels[0].radiosity - known.emittance[0], u, v];
        }
        let is_linear = experiment.method().is_linear();
        let mut b = Vec::new();
        for sheet in &self.sheets {
            let own = scene.surfaces()[sheet.surface as usize].cell_count().isqrt();
            let [front, first] = [Side::Front, sheet.side].map(|side| {
                scene.faces().first_piece_on(sheet.surface, side).expect("a side of the reference")
            });
            // Both grids halve the rows of the face again and again, so that the finer one has parts of the cells of both.
            let finest = own.max(sheet.rows);
            let mut sums = vec![[0.0; 2]; (sheet.rows * sheet.rows) as usize];
            for at in (0..finest * finest).map(|part| centre(part, finest)) {
                let [sum, parts] = &mut sums[cell_at(at, sheet.rows) as usize];
                let cell = cell_at(at, own);
                let [mean, u, v] = of_face[scene.faces().face_of(first + cell) as usize];
                let [s, t] = if is_linear { on_fit(scene, front + cell, at) } else { [0.0; 2] };
                *sum += mean + u * s + v * t;
                *parts += 1.0;
            }
            b.extend(sums.into_iter().map(|[sum, parts]| sum / parts));
        }
        b
    }

    /// The errors of two independent runs on the same patches.
    pub fn errors(&self, runs: [&[f64]; 2]) -> LightErrors {
        let over = |products: [f64; 2]| [products[0] / self.energy[0], products[1] / self.energy[1]];
        let own = runs.map(|run| over(self.product([run, run])));
        let total = [0, 1].map(|k| 0.5 * (own[0][k] + own[1][k]));
        LightErrors { total, lost: over(self.product(runs)) }
    }

    /// The integral of the product of what two runs differ in from the two references, over all cells and over the means of large faces.
    fn product(&self, runs: [&[f64]; 2]) -> [f64; 2] {
        let mut products = [0.0; 2];
        for sheet in &self.sheets {
            let count = (sheet.rows * sheet.rows) as usize;
            let cells = sheet.first..sheet.first + count;
            let off = |k: usize, cell: usize| runs[k][cell] - self.b[k][cell];
            let sum: f64 = cells.clone().map(|cell| off(0, cell) * off(1, cell)).sum();
            products[0] += sheet.area / count as f64 * sum;
            if sheet.area > LARGE {
                let mean = |k: usize| cells.clone().map(|cell| off(k, cell)).sum::<f64>() / count as f64;
                products[1] += sheet.area * mean(0) * mean(1);
            }
        }
        products
    }
}

/// By what factors the gradients of its face count in the linear fit at a point of a piece.
fn on_fit(scene: &Scene, piece: u32, at: [f64; 2]) -> [f64; 2] {
    let weights = scene.faces().corner_weights(piece, at);
    let corners = scene.corners_on_fit(piece);
    [0, 1].map(|k| corners.iter().zip(weights).map(|(corner, weight)| weight * corner[k]).sum())
}

/// The centroid of a cell of a triangle of some rows.
fn centre(cell: u32, rows: u32) -> [f64; 2] {
    let row = cell.isqrt();
    let position = cell - row * row;
    let [i, j] = [row - position / 2, position / 2].map(f64::from);
    let (k, third) = (f64::from(rows), 1.0 / 3.0);
    match position.is_multiple_of(2) {
        true => [(i + third) / k, (j + third) / k],
        false => [(i - third) / k, (j + 1.0 - third) / k],
    }
}

/// The cell of a triangle of some rows that holds a point.
fn cell_at([u, v]: [f64; 2], rows: u32) -> u32 {
    let (u, v) = (u * f64::from(rows), v * f64::from(rows));
    let inverted = u32::from(u.fract() + v.fract() >= 1.0);
    let row = u as u32 + v as u32 + inverted;
    row * row + 2 * v as u32 + inverted
}
