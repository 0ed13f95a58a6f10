//! Ceilings: the least error of partitions that are chosen with the truth known.
//!
//! The noise of a fit on a cell after N walks is that of its unknowns, ν/N each, ν in proportion to the light there.

use super::truth::{CellEnergies, Truth};

/// How surfaces may be cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cutting {
    /// A grid for each surface, of powers of two.
    Grids,
    /// Square blocks of cells of such a grid: quadtrees.
    Quadtrees,
    /// Rectangles, each cut in two across u or across v or left whole.
    Rectangles,
}

/// The least error, and the patches that it takes.
#[derive(Clone, Copy, Default)]
pub struct Ceiling {
    pub error: f64,
    pub patches: f64,
}

impl Ceiling {
    fn plus(self, other: Self) -> Self {
        Ceiling { error: self.error + other.error, patches: self.patches + other.patches }
    }

    fn least(self, other: Self) -> Self {
        if other.error < self.error { other } else { self }
    }
}

/// The energies of all sheets on all grids of powers of two.
pub struct GridOracle {
    sheets: Vec<Levels>,
}

/// The energies of a sheet on the grids of 2^i × 2^j cells, i = 0 … top[0] by rows.
struct Levels {
    top: [usize; 2],
    cells: Vec<Vec<CellEnergies>>,
}

impl Levels {
    fn at(&self, [i, j]: [usize; 2]) -> usize {
        i * (self.top[1] + 1) + j
    }

    /// All levels, the finest first: parts come before what they are parts of.
    fn finest_first(&self) -> impl Iterator<Item = [usize; 2]> + use<> {
        let [top_u, top_v] = self.top;
        (0..=top_u).rev().flat_map(move |i| (0..=top_v).rev().map(move |j| [i, j]))
    }
}

impl GridOracle {
    pub fn new(truth: &Truth) -> Self {
        let levels = |sheet: &super::truth::Sheet| {
            let top = sheet.top.map(|top| top as usize);
            let grids = (0..=top[0]).flat_map(|i| (0..=top[1]).map(move |j| [1 << i, 1 << j]));
            Levels { top, cells: grids.map(|grid| sheet.energies(grid)).collect() }
        };
        GridOracle { sheets: truth.sheets.iter().map(levels).collect() }
    }

    /// The least error after some walks, of fits of some degrees, one for each leaf (of grids: for each sheet).
    pub fn best(&self, cutting: Cutting, degrees: &[usize], walks: f64) -> Ceiling {
        let leaf = |cell: &CellEnergies, degree: usize| Ceiling {
            error: cell.lost(degree) + cell.noise_of(degree) / walks,
            patches: 1.0,
        };
        let best = |sheet: &Levels| match cutting {
            Cutting::Grids => {
                let on = |cells: &[CellEnergies], degree| {
                    cells.iter().map(|cell| leaf(cell, degree)).fold(Ceiling::default(), Ceiling::plus)
                };
                let all =
                    sheet.cells.iter().flat_map(|cells| degrees.iter().map(|&degree| on(cells, degree)));
                all.reduce(Ceiling::least).expect("a grid")
            }
            _ => trees(sheet, cutting, &|cell| {
                degrees.iter().map(|&degree| leaf(cell, degree)).reduce(Ceiling::least).expect("a degree")
            }),
        };
        self.sheets.iter().map(best).fold(Ceiling::default(), Ceiling::plus)
    }
}

/// The best trees on one sheet, from the leaves up.
fn trees(sheet: &Levels, cutting: Cutting, leaf: &dyn Fn(&CellEnergies) -> Ceiling) -> Ceiling {
    let mut best: Vec<Vec<Ceiling>> = vec![Vec::new(); sheet.cells.len()];
    let mut least: Option<Ceiling> = None;
    for [i, j] in sheet.finest_first() {
        let [nu, nv] = [1_usize << i, 1 << j];
        let mut cells: Vec<Ceiling> = sheet.cells[sheet.at([i, j])].iter().map(leaf).collect();
        let mut cut = |[du, dv]: [usize; 2]| {
            if i + du > sheet.top[0] || j + dv > sheet.top[1] {
                return;
            }
            let parts = &best[sheet.at([i + du, j + dv])];
            for (cell, own) in cells.iter_mut().enumerate() {
                let (iu, iv) = (cell / nv, cell % nv);
                let all = (0..1 << du).flat_map(|a| (0..1 << dv).map(move |b| (a, b)));
                let sum = all
                    .map(|(a, b)| parts[((iu << du) + a) * (nv << dv) + (iv << dv) + b])
                    .fold(Ceiling::default(), Ceiling::plus);
                *own = own.least(sum);
            }
        };
        match cutting {
            Cutting::Rectangles => {
                cut([1, 0]);
                cut([0, 1]);
            }
            _ => cut([1, 1]),
        }
        debug_assert_eq!(cells.len(), nu * nv);
        let whole = cells.iter().copied().fold(Ceiling::default(), Ceiling::plus);
        least = Some(least.map_or(whole, |least| least.least(whole)));
        let at = sheet.at([i, j]);
        best[at] = cells;
    }
    least.expect("a level")
}
