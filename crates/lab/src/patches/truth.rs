//! The truth about a scene: two references of independent walks on a grid much finer than any that is judged.
//!
//! Products of what both say have no bias: the noise of one is independent of that of the other.

use std::cell::RefCell;
use std::collections::HashMap;

use job::Cut;
use judge::partition::{Grid, doublings};
use radiosity::{SceneSpec, Shape, Side, linear::Fit, surfaces::CutCell};

use super::runs::{Failure, experiment, fits, walk};

/// Points of a reference's cell along each edge, at which its fits are taken.
const POINTS: u32 = 4;

/// Monomials up to the second degree: 1, 3 or 6 of them span constants, linear functions and quadratics.
const MONOMIALS: usize = 6;

/// Unknowns of a patch by degree.
pub const UNKNOWNS: [usize; 3] = [1, 3, 6];

/// The light of a scene.
pub struct Truth {
    pub sheets: Vec<Sheet>,
    /// Cells of a reference.
    pub cells: usize,
}

/// The light on one side of one surface.
pub struct Sheet {
    pub surface: usize,
    pub side: Side,
    area: f64,
    /// How often a reference's grid halves the edges along u and v.
    pub top: [u32; 2],
    cells: [u32; 2],
    /// The fits of both references, cell by cell.
    fits: [Vec<Fit>; 2],
    /// By cell, the energy of the error of a mean and of a slope after one walk, were it the only cell of this light.
    noise: Vec<[f64; 2]>,
    /// The energies of the cells of grids that were asked for, by their levels.
    levels: RefCell<HashMap<[u32; 2], Vec<CellEnergies>>>,
}

/// Energies over one cell of a grid [W²/m²].
#[derive(Clone, Copy, Default)]
pub struct CellEnergies {
    /// That of the light.
    pub whole: f64,
    /// That of the best fits to it, by degree.
    pub caught: [f64; 3],
    /// Of the error of a mean and of a slope after one walk.
    pub noise: [f64; 2],
    /// The area of the cell [m²].
    pub area: f64,
}

impl CellEnergies {
    /// What a fit of a degree leaves out.
    pub fn lost(&self, degree: usize) -> f64 {
        self.whole - self.caught[degree]
    }

    /// Noise after one walk of a fit of a degree.
    pub fn noise_of(&self, degree: usize) -> f64 {
        self.noise[0] + (UNKNOWNS[degree] - 1) as f64 * self.noise[1]
    }
}

impl Truth {
    /// Walks both references, side by side, on about this many cells.
    pub fn new(spec: &SceneSpec, cells: f64, walks: u64) -> Result<Self, Failure> {
        let area: f64 = spec.surfaces.iter().map(|surface| surface.shape.area()).sum();
        let top = |shape: &Shape| doublings(shape, Grid::Quad([1, 1]), area / cells);
        let tops: Vec<[u32; 2]> = spec.surfaces.iter().map(|surface| top(&surface.shape)).collect();
        let cuts: Vec<Cut> = tops.iter().map(|&top| Grid::Quad([1, 1]).doubled(top).cut()).collect();
        let experiment = experiment(spec, &cuts, true)?;
        let reference = |seed| fits(&experiment, &walk(&experiment, (1 << 40) | seed as u64, walks));
        let both = parallel::on_all_cores(2, reference);
        let mut both: [Vec<Fit>; 2] = both.try_into().expect("there are two references");
        let faces = experiment.scene().faces();
        let cells = faces.len();
        let mut sheets = Vec::new();
        // Sheets from the last one on: the fits of each are split off.
        for (surface, &top) in tops.iter().enumerate().rev() {
            for side in [Side::Back, Side::Front] {
                let Some(_) = faces.first_piece_on(surface as u32, side) else { continue };
                let cells = top.map(|top| 1 << top);
                let count = (cells[0] * cells[1]) as usize;
                let fits = both.each_mut().map(|fits: &mut Vec<Fit>| fits.split_off(fits.len() - count));
                let area = spec.surfaces[surface].shape.area();
                let noise = noise(&fits, area / count as f64, walks as f64);
                let levels = RefCell::default();
                sheets.push(Sheet { surface, side, area, top, cells, fits, noise, levels });
            }
        }
        sheets.reverse();
        Ok(Truth { sheets, cells })
    }

    /// The energy of all light.
    pub fn energy(&self) -> f64 {
        self.sheets.iter().flat_map(|sheet| sheet.energies([1, 1])).map(|cell| cell.whole).sum()
    }

    /// What fits of each degree leave out on patches that are cut so.
    pub fn lost(&self, cuts: &[Cut]) -> [f64; 3] {
        let mut lost = [0.0; 3];
        for sheet in &self.sheets {
            for cell in sheet.cut(&cuts[sheet.surface]) {
                lost.iter_mut().enumerate().for_each(|(degree, lost)| *lost += cell.lost(degree));
            }
        }
        lost
    }
}

/// The noise of each cell, from the variances of both references.
fn noise(fits: &[Vec<Fit>; 2], area: f64, walks: f64) -> Vec<[f64; 2]> {
    let of = |(a, b): (&Fit, &Fit)| {
        let mean = 0.5 * (a.mean_variance + b.mean_variance);
        let slope = 0.25 * (a.slope_variance + b.slope_variance);
        [mean, slope].map(|variance| area * walks * variance)
    };
    fits[0].iter().zip(&fits[1]).map(of).collect()
}

impl Sheet {
    /// The energies of each patch, in the order of their numbers.
    pub fn cut(&self, cut: &Cut) -> Vec<CellEnergies> {
        match cut {
            Cut::Grid(grid) => self.energies(*grid),
            Cut::Leaves(leaves) => leaves.iter().map(|leaf| self.leaf(leaf)).collect(),
            Cut::Rows(_) => unreachable!("rooms are of quads"),
        }
    }

    /// The energies of one rectangle; of one smaller than the points of the reference are apart, none.
    fn leaf(&self, leaf: CutCell) -> CellEnergies {
        let mut levels = self.levels.borrow_mut();
        let grid = levels.entry(leaf.levels).or_insert_with(|| self.energies(leaf.grid()));
        grid[(leaf.at[0] * leaf.grid()[1] + leaf.at[1]) as usize]
    }

    /// The energies of each cell of a grid.
    pub fn energies(&self, grid: [u32; 2]) -> Vec<CellEnergies> {
        let mut sums = vec![CellSums::default(); (grid[0] * grid[1]) as usize];
        let points = self.cells.map(|cells| cells * POINTS);
        // Of the points along an edge: the cell of the grid, the place in it, and the cell of the reference with the place there.
        let along = |axis: usize| -> Vec<(usize, f64, usize, f64)> {
            let of = |i: u32| {
                let at = (f64::from(i) + 0.5) / f64::from(points[axis]) * f64::from(grid[axis]);
                let inside = (f64::from(i % POINTS) + 0.5) / f64::from(POINTS) - 0.5;
                (at as usize, at.fract() - 0.5, (i / POINTS) as usize, inside)
            };
            (0..points[axis]).map(of).collect()
        };
        let (us, vs) = (along(0), along(1));
        let weight = self.area / (f64::from(points[0]) * f64::from(points[1]));
        for &(iu, x, fine_u, s) in &us {
            for &(iv, y, fine_v, t) in &vs {
                let fine = fine_u * self.cells[1] as usize + fine_v;
                let light = self.fits.each_ref().map(|fits| {
                    let Fit { mean, gradient: [g, h], .. } = fits[fine];
                    mean + g * s + h * t
                });
                sums[iu * grid[1] as usize + iv].add(weight, [x, y], light, self.noise[fine]);
            }
        }
        sums.iter().map(CellSums::energies).collect()
    }
}

/// Sums over the points of one cell.
#[derive(Clone, Default)]
struct CellSums {
    area: f64,
    whole: f64,
    /// Products of monomials, row by row up to the diagonal.
    gram: [[f64; MONOMIALS]; MONOMIALS],
    /// The light of each reference times each monomial.
    moments: [[f64; MONOMIALS]; 2],
    noise: [f64; 2],
}

impl CellSums {
    fn add(&mut self, weight: f64, [x, y]: [f64; 2], light: [f64; 2], noise: [f64; 2]) {
        let monomials = [1.0, x, y, x * x, x * y, y * y];
        self.area += weight;
        self.whole += weight * light[0] * light[1];
        for (i, (row, monomial)) in self.gram.iter_mut().zip(monomials).enumerate() {
            let weighted = weight * monomial;
            row[..=i].iter_mut().zip(monomials).for_each(|(sum, other)| *sum += weighted * other);
            self.moments[0][i] += weighted * light[0];
            self.moments[1][i] += weighted * light[1];
        }
        self.noise.iter_mut().zip(noise).for_each(|(sum, noise)| *sum += weight * noise);
    }

    /// The energy that a fit catches is aᵀG⁻¹b, G the products of monomials, a and b the moments of both references. With
    /// G = LLᵀ it is the product of L⁻¹a and L⁻¹b, whose first terms are those of the lower degrees.
    fn energies(&self) -> CellEnergies {
        let area = self.area;
        if area == 0.0 {
            return CellEnergies::default();
        }
        let mut l = [[0.0; MONOMIALS]; MONOMIALS];
        let mut solved = [[0.0; MONOMIALS]; 2];
        let (mut caught, mut sum) = ([0.0; 3], 0.0);
        for i in 0..MONOMIALS {
            for j in 0..=i {
                let rest = self.gram[i][j] - (0..j).map(|k| l[i][k] * l[j][k]).sum::<f64>();
                l[i][j] = match (i == j, l[j][j] > 0.0) {
                    // Too few points tell of this monomial.
                    (true, _) if rest < 1e-6 * self.gram[i][i] || rest <= 0.0 => 0.0,
                    (true, _) => rest.sqrt(),
                    (false, true) => rest / l[j][j],
                    (false, false) => 0.0,
                };
            }
            if l[i][i] > 0.0 {
                for (solved, moments) in solved.iter_mut().zip(&self.moments) {
                    let rest = moments[i] - (0..i).map(|k| l[i][k] * solved[k]).sum::<f64>();
                    solved[i] = rest / l[i][i];
                }
                sum += solved[0][i] * solved[1][i];
            }
            UNKNOWNS.iter().zip(&mut caught).for_each(|(&unknowns, caught)| {
                if unknowns == i + 1 {
                    *caught = sum;
                }
            });
        }
        let noise = self.noise.map(|noise| noise / area);
        CellEnergies { whole: self.whole, caught, noise, area }
    }
}
