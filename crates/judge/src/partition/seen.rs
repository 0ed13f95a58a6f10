//! What a pilot has seen of the light on a surface: how much of it each grid catches.

use radiosity::{Experiment, Shape, Side, Tally, linear::Fit};

use super::grid::Grid;
use super::images::Images;
use super::laws::MeasuredDoublings;
use super::quarters::Quarters;

/// Landings on a cell of a part of a surface, in the mean.
const LANDINGS_PER_CELL: f64 = 4.0;

/// The cells of a part of a surface, and how often it is doubled along an edge, at the most.
const MOST_CELLS: f64 = 4096.0;
const MOST_LEVELS: u32 = 8;

/// What is fitted to the light on every patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Basis {
    /// The mean of the light on a patch.
    Constant,
    /// A linear function of the place.
    Linear,
}

impl Basis {
    /// Numbers that are estimated of every patch.
    pub(crate) fn unknowns(self) -> f64 {
        match self {
            Basis::Constant => 1.0,
            Basis::Linear => 3.0,
        }
    }
}

/// The tallies of a pilot: independent groups of as many walks each, and all of them together.
pub struct PilotTallies<'a> {
    /// The sums of the groups; they need no squares.
    pub groups: &'a [Tally],
    /// The sum of all groups, with squares.
    pub all: &'a Tally,
}

/// The shape of a part of a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct PartShape {
    /// The coarsest grid, [`Grid::Quad`] or [`Grid::Triangle`], of one cell.
    pub(super) base: Grid,
    /// The area [m²].
    pub(super) area: f64,
    /// The lengths of the edges [m].
    pub(super) edges: [f64; 2],
}

/// The arrival of a walk on one side of a part of a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct SideArrival {
    /// The group of the walk.
    pub(super) group: usize,
    /// The place, in coordinates of 0 … 1 along the edges of the part.
    pub(super) at: [f64; 2],
    /// The light that it stands for in the estimate of its group, by channel [W].
    pub(super) light: [f64; 3],
}

/// The light on one surface, all channels and sides together. An *energy* is the integral over the surface of the square of
/// a fit [W²/m²].
#[derive(Clone, Debug)]
pub struct SurfaceLight {
    /// The coarsest grid that may be chosen.
    pub(crate) base: Grid,
    /// Whether another may be chosen.
    pub(crate) free: bool,
    /// How often the pilot's grid doubles the cells of `base` along u and v (a triangle's: along u).
    pub(crate) top: [u32; 2],
    /// The energies that constants catch on every grid, and those that linear fits do, by [`SurfaceLight::place`].
    caught: [Vec<f64>; 2],
    /// The expected energy of the error of one cell after one walk, of means and of linear fits.
    pub(crate) noise: [f64; 2],
    /// What cells of the coarsest grid err by beyond that because hits of one walk on different cells go together: the energy of the noise that the
    /// surface's cells have in common, after one walk, whatever their number.
    pub(crate) shared: f64,
    /// What linear fits catch cell by cell, where the surface may be cut into rectangles.
    pub(crate) images: Option<Images>,
    /// The same of a triangle, which may be cut into triangles of different sizes.
    pub(crate) quarters: Option<Quarters>,
    /// Walks of the pilot.
    pub(crate) walks: f64,
    /// Length of the edges of the surface along u and v [m].
    pub(crate) edges: [f64; 2],
    /// The area of one side [m²].
    pub(crate) area: f64,
}

impl SurfaceLight {
    /// What the pilot saw of a surface whose cells it has doubled `top` times along u and v; `None`: its cells are not to be
    /// chosen.
    pub fn new(
        experiment: &Experiment,
        tallies: &PilotTallies<'_>,
        (surface, shape): (usize, &Shape),
        (base, top): (Grid, Option<[u32; 2]>),
    ) -> Self {
        let scene = experiment.scene();
        let (free, top) = (top.is_some(), top.unwrap_or([0; 2]));
        let (_, e_u, e_v) = shape.edges();
        let fine = GridCells::new(base.doubled(top));
        let [levels_u, levels_v] = top.map(|top| top as usize + 1);
        let mut light = SurfaceLight {
            base,
            free,
            top,
            caught: [vec![0.0; levels_u * levels_v], vec![0.0; levels_u * levels_v]],
            noise: [0.0; 2],
            shared: 0.0,
            images: (free && base == Grid::Quad([1, 1])).then(|| Images::new(top)),
            quarters: (free && base == Grid::Triangle(1)).then(|| Quarters::new(top[0])),
            walks: tallies.all.counts.walks as f64,
            edges: [e_u.length(), e_v.length()],
            area: shape.area(),
        };
        for side in [Side::Front, Side::Back] {
            let Some(first) = scene.faces().first_piece_on(surface as u32, side) else { continue };
            for channel in 0..scene.channels() {
                let pieces = first..first + fine.count() as u32;
                let faces = || pieces.clone().map(|piece| scene.faces().face_of(piece) as usize);
                let all = faces().map(|face| experiment.fit(tallies.all, face, channel));
                let Some(all) = all.collect::<Option<Vec<Fit>>>() else { continue };
                // Of many surfaces only one side is lit.
                if all.iter().all(|fit| fit.mean_variance == 0.0) {
                    continue;
                }
                let mut integrals = Integrals::none(tallies.groups.len(), all.len());
                for (cell, face) in faces().enumerate() {
                    let fits = experiment.fits_of_parts((tallies.all, tallies.groups), face, channel);
                    if let Some(fits) = fits {
                        fine.integrate(cell, shape.area(), fits, &mut integrals);
                    }
                }
                light.add(&fine, shape.area(), &all, integrals);
            }
        }
        light.images.iter_mut().for_each(Images::spread_noise);
        light.quarters.iter_mut().for_each(Quarters::spread_noise);
        light
    }

    /// The light on a part of a surface, from the places where the walks of some groups arrive on each of its sides.
    pub(super) fn of_landings(
        PartShape { base, area, edges }: PartShape,
        sides: &[Vec<SideArrival>],
        groups: usize,
        walks: f64,
    ) -> Self {
        let landings: usize = sides.iter().map(Vec::len).sum();
        let top = levels_for(base, edges, (landings as f64 / LANDINGS_PER_CELL).max(4.0));
        let is_quad = matches!(base, Grid::Quad(_));
        let [levels_u, levels_v] = top.map(|top| top as usize + 1);
        let mut light = SurfaceLight {
            base,
            free: true,
            top,
            caught: [vec![0.0; levels_u * levels_v], vec![0.0; levels_u * levels_v]],
            noise: [0.0; 2],
            shared: 0.0,
            images: is_quad.then(|| Images::new(top)),
            quarters: (!is_quad).then(|| Quarters::new(top[0])),
            walks,
            edges,
            area,
        };
        let fine = GridCells::new(base.doubled(top));
        for landings in sides {
            let cells: Vec<usize> = landings.iter().map(|one| fine.cell_at(one.at)).collect();
            for channel in 0..3 {
                if landings.iter().all(|one| one.light[channel] == 0.0) {
                    continue;
                }
                let mut integrals = Integrals::none(groups, fine.count());
                let mut squares = vec![0.0; fine.count()];
                for (&cell, &SideArrival { group, at: [u, v], light }) in cells.iter().zip(landings) {
                    let found = light[channel];
                    squares[cell] += found * found;
                    for (k, part) in [found, found * u, found * v].into_iter().enumerate() {
                        integrals.cell_mut(cell)[k * groups + group] += part;
                    }
                }
                // Of the mean of all groups: every landing is one of its own, and each of three unknowns errs alike.
                let per_cell = (fine.count() as f64 / area / groups as f64).powi(2);
                let fit = |square: f64| Fit {
                    mean: 0.0,
                    gradient: [0.0; 2],
                    mean_variance: per_cell * square,
                    slope_variance: 2.0 * per_cell * square,
                };
                let fits: Vec<Fit> = squares.into_iter().map(fit).collect();
                light.add(&fine, area, &fits, integrals);
            }
        }
        light.images.iter_mut().for_each(Images::spread_noise);
        light.quarters.iter_mut().for_each(Quarters::spread_noise);
        light
    }

    /// Adds the light of one side in one channel: by cell, the fit to it, and the integrals that groups of walks say.
    fn add(&mut self, fine: &GridCells, area: f64, all: &[Fit], mut of_v: Integrals) {
        let per_cell = self.walks * area / (fine.count() as f64 * fine.count() as f64);
        let of_means: f64 = all.iter().map(|fit| fit.mean_variance).sum();
        let of_slopes: f64 = all.iter().map(|fit| fit.slope_variance).sum();
        self.noise[0] += per_cell * of_means;
        self.shared -= per_cell * of_means * self.base.cells() as f64;
        self.noise[1] += per_cell * (of_means + of_slopes);
        let per_unknown = self.walks * area / fine.count() as f64 / Basis::Linear.unknowns();
        let noise = || all.iter().map(|fit| per_unknown * (fit.mean_variance + fit.slope_variance));
        self.images.iter_mut().for_each(|images| images.add_noise(noise()));
        self.quarters.iter_mut().for_each(|quarters| quarters.add_noise(noise()));
        let cells = |levels: [u32; 2]| GridCells::new(self.base.doubled(levels));
        for i in (0..=self.top[0]).rev() {
            if i < self.top[0] {
                of_v = cells([i + 1, self.top[1]]).gather(&cells([i, self.top[1]]), &of_v);
            }
            let mut of_both = None;
            for j in (0..=self.top[1]).rev() {
                if j < self.top[1] {
                    let finer = of_both.as_ref().unwrap_or(&of_v);
                    of_both = Some(cells([i, j + 1]).gather(&cells([i, j]), finer));
                }
                let caught = cells([i, j]).caught(of_both.as_ref().unwrap_or(&of_v), area);
                if [i, j] == [0, 0] {
                    let coarsest = of_both.as_ref().unwrap_or(&of_v);
                    self.shared += self.walks * coarsest.noise(area / self.base.cells() as f64);
                }
                let place = self.place([i, j]);
                for (basis, sum) in [0, 1]
                    .map(|basis| caught.iter().map(|cell| cell[basis]).sum::<f64>())
                    .into_iter()
                    .enumerate()
                {
                    self.caught[basis][place] += sum;
                }
                let linear = || caught.iter().map(|[_, linear]| *linear);
                self.images.iter_mut().for_each(|images| images.add_caught([i, j], linear()));
                self.quarters.iter_mut().for_each(|quarters| quarters.add_caught(i, linear()));
            }
        }
    }

    /// The light where patches have to be cells of grids, or rectangles.
    pub fn without_groups(self) -> Self {
        SurfaceLight { quarters: None, ..self }
    }

    /// Light of which a pilot has seen this, for tests.
    #[cfg(test)]
    pub(super) fn known(
        top: [u32; 2],
        caught: impl Fn(Basis, [u32; 2]) -> f64,
        noise: [f64; 2],
        walks: f64,
    ) -> Self {
        let levels = || (0..=top[0]).flat_map(|i| (0..=top[1]).map(move |j| [i, j]));
        SurfaceLight {
            base: Grid::Quad([1, 1]),
            free: true,
            top,
            caught: [Basis::Constant, Basis::Linear]
                .map(|basis| levels().map(|at| caught(basis, at)).collect()),
            noise,
            shared: 0.0,
            images: None,
            quarters: None,
            walks,
            edges: [1.0, 1.0],
            area: 1.0,
        }
    }

    fn place(&self, levels: [u32; 2]) -> usize {
        let [i, j] = [0, 1].map(|k| levels[k].min(self.top[k]) as usize);
        i * (self.top[1] as usize + 1) + j
    }

    /// The energy that fits catch on a grid, or on the pilot's where that is coarser. Without bias.
    pub(crate) fn caught(&self, basis: Basis, levels: [u32; 2]) -> f64 {
        self.caught[basis as usize][self.place(levels)]
    }

    /// What a cut in four was seen to gain, of a part of a surface; `None` where too few walks arrive for that.
    pub(super) fn first_cut(&self) -> Option<MeasuredDoublings> {
        let of_quad = self.images.as_ref().map(|images| images.noise([0, 0], [0, 0]));
        let of_triangle =
            self.quarters.as_ref().map(|quarters| quarters.whole()[0] / Basis::Linear.unknowns());
        let finer = self.top.map(|top| top.min(1));
        (finer != [0, 0]).then(|| MeasuredDoublings {
            gain: self.caught(Basis::Linear, finer) - self.caught(Basis::Linear, [0, 0]),
            noise: of_quad.or(of_triangle).unwrap_or(0.0),
            unknowns: Basis::Linear.unknowns() * (self.cells(finer) - 1.0),
        })
    }

    /// All energy that the pilot has seen.
    pub fn energy(&self) -> f64 {
        self.caught(Basis::Linear, self.top)
    }

    /// The number of cells of a grid.
    pub(crate) fn cells(&self, levels: [u32; 2]) -> f64 {
        self.base.doubled(levels).cells() as f64
    }
}

/// The integrals of b, b·u and b·v over every cell, as one group of walks estimates them: integrals over a coarser cell are the sums of
/// those over its parts, and the fit on it follows from them.
#[derive(Clone, Debug)]
struct Integrals {
    /// The number of groups.
    groups: usize,
    /// Of every cell b of all groups, then b·u and b·v of all groups.
    of_cells: Vec<f64>,
}

impl Integrals {
    fn none(groups: usize, cells: usize) -> Self {
        Integrals { groups, of_cells: vec![0.0; 3 * groups * cells] }
    }

    fn cells(&self) -> impl Iterator<Item = &[f64]> {
        self.of_cells.chunks_exact(3 * self.groups)
    }

    /// The energy of the error of the means of cells of some area, by the spread between groups.
    fn noise(&self, area: f64) -> f64 {
        let n = self.groups as f64;
        let of_cell = |cell: &[f64]| {
            let b = &cell[..self.groups];
            let [sum, squares] = [b.iter().sum::<f64>(), b.iter().map(|b| b * b).sum::<f64>()];
            (squares - sum * sum / n) / (n * (n - 1.0))
        };
        self.cells().map(of_cell).sum::<f64>() / area
    }

    fn cell_mut(&mut self, cell: usize) -> &mut [f64] {
        &mut self.of_cells[3 * self.groups * cell..][..3 * self.groups]
    }
}

/// The cells of a grid, in coordinates of 0 … 1 along the edges of the surface.
pub(super) struct GridCells {
    cut: Grid,
}

impl GridCells {
    pub(super) fn new(cut: Grid) -> Self {
        GridCells { cut }
    }

    fn count(&self) -> usize {
        self.cut.cells() as usize
    }

    /// The centroid of a cell, and 1 or, for a triangle's cell that stands on its head, −1.
    pub(super) fn centre(&self, cell: usize) -> ([f64; 2], f64) {
        match self.cut {
            Grid::Quad([nu, nv]) => {
                let [iu, iv] = [cell / nv as usize, cell % nv as usize];
                ([(iu as f64 + 0.5) / f64::from(nu), (iv as f64 + 0.5) / f64::from(nv)], 1.0)
            }
            Grid::Triangle(rows) => {
                let row = cell.isqrt();
                let position = cell - row * row;
                let [i, j] = [row - position / 2, position / 2].map(|step| step as f64);
                let (k, third) = (f64::from(rows), 1.0 / 3.0);
                match position.is_multiple_of(2) {
                    true => ([(i + third) / k, (j + third) / k], 1.0),
                    false => ([(i - third) / k, (j + 1.0 - third) / k], -1.0),
                }
            }
        }
    }

    /// The four cells that a triangle's cell becomes where rows are doubled.
    pub(super) fn quarters(&self, cell: usize) -> [usize; 4] {
        let Grid::Triangle(rows) = self.cut else { unreachable!("quarters are of triangles") };
        let ([u, v], sign) = self.centre(cell);
        let finer = GridCells::new(Grid::Triangle(2 * rows));
        // From the centroid to half of the way to each corner.
        let step = sign / (6.0 * f64::from(rows));
        let off = [[0.0, 0.0], [-step, -step], [2.0 * step, -step], [-step, 2.0 * step]];
        off.map(|[du, dv]| finer.cell_at([u + du, v + dv]))
    }

    /// The cell that holds a point that lies on no edge.
    pub(super) fn cell_at(&self, [u, v]: [f64; 2]) -> usize {
        match self.cut {
            Grid::Quad([nu, nv]) => (u * f64::from(nu)) as usize * nv as usize + (v * f64::from(nv)) as usize,
            Grid::Triangle(rows) => {
                let (u, v) = (u * f64::from(rows), v * f64::from(rows));
                let inverted = usize::from(u.fract() + v.fract() >= 1.0);
                let row = u as usize + v as usize + inverted;
                row * row + 2 * v as usize + inverted
            }
        }
    }

    /// Writes down the integrals over a cell of linear functions, one for each group, given by means and gradients.
    fn integrate(
        &self,
        cell: usize,
        area: f64,
        fits: impl Iterator<Item = [f64; 3]>,
        integrals: &mut Integrals,
    ) {
        let area = area / self.count() as f64;
        let groups = integrals.groups;
        let (centre, sign) = self.centre(cell);
        let (of_b, of_places) = integrals.cell_mut(cell).split_at_mut(groups);
        let (of_u, of_v) = of_places.split_at_mut(groups);
        for (group, [mean, g, h]) in fits.enumerate() {
            let [du, dv] = self.tilt(sign, [g, h]);
            of_b[group] = area * mean;
            of_u[group] = area * (du + centre[0] * mean);
            of_v[group] = area * (dv + centre[1] * mean);
        }
    }

    /// The means over a cell of b·(u − u_c) and b·(v − v_c), (u_c, v_c) its centroid. `sign` is that of [`GridCells::centre`].
    fn tilt(&self, sign: f64, [g, h]: [f64; 2]) -> [f64; 2] {
        match self.cut {
            Grid::Quad([nu, nv]) => [g / (12.0 * f64::from(nu)), h / (12.0 * f64::from(nv))],
            // The variance of a coordinate over a triangle is 1/18, the covariance of both −1/36.
            Grid::Triangle(rows) => {
                let scale = sign / f64::from(rows);
                [scale * g / 18.0, scale * (h / 24.0 - g / 36.0)]
            }
        }
    }

    /// Adds up the integrals of the cells that each cell of a coarser grid is made of.
    fn gather(&self, coarse: &GridCells, integrals: &Integrals) -> Integrals {
        let mut sums = Integrals::none(integrals.groups, coarse.count());
        for (cell, parts) in integrals.cells().enumerate() {
            let around = sums.cell_mut(coarse.cell_at(self.centre(cell).0));
            around.iter_mut().zip(parts).for_each(|(sum, part)| *sum += part);
        }
        sums
    }

    /// The energies that constants and linear fits catch on each of these cells, from the integrals of each group of walks.
    ///
    /// The square of an estimate is too large by its variance; products of estimates of different groups are not, and their mean
    /// over all pairs of groups is what is taken.
    fn caught(&self, integrals: &Integrals, area: f64) -> Vec<[f64; 2]> {
        let area = area / self.count() as f64;
        let groups = integrals.groups;
        let n = groups as f64;
        let pairs = |product: f64, products: f64| (product - products) / (n * (n - 1.0) * area);
        let [with_uu, with_uv, with_vv] = self.inverse_covariance();
        let of_cell = |(cell, of_cell): (usize, &[f64])| {
            let centre = self.centre(cell).0;
            let (b, [u, v]) = (&of_cell[..groups], [1, 2].map(|k| &of_cell[k * groups..][..groups]));
            // Sums over groups of the integrals of b, b·(u − u_c), b·(v − v_c), and of their products.
            let mut sums = [0.0; 7];
            for group in 0..groups {
                let b = b[group];
                let [u, v] = [u[group] - centre[0] * b, v[group] - centre[1] * b];
                let parts = [b, u, v, b * b, u * u, u * v, v * v];
                sums.iter_mut().zip(parts).for_each(|(sum, part)| *sum += part);
            }
            let [b, u, v, bb, uu, uv, vv] = sums;
            let constant = pairs(b * b, bb);
            let slopes =
                with_uu * pairs(u * u, uu) + with_vv * pairs(v * v, vv) + 2.0 * with_uv * pairs(u * v, uv);
            [constant, constant + slopes]
        };
        integrals.cells().enumerate().map(of_cell).collect()
    }

    /// The inverse of the covariance matrix of the coordinates over a cell: of u with u, u with v, v with v.
    fn inverse_covariance(&self) -> [f64; 3] {
        match self.cut {
            Grid::Quad([nu, nv]) => {
                [12.0 * f64::from(nu) * f64::from(nu), 0.0, 12.0 * f64::from(nv) * f64::from(nv)]
            }
            Grid::Triangle(rows) => {
                [24.0, 12.0, 24.0].map(|factor| factor * f64::from(rows) * f64::from(rows))
            }
        }
    }
}

/// The doublings along u and v that cut a cell into about a given number of cells. Longer edges are doubled first.
fn levels_for(base: Grid, edges: [f64; 2], cells: f64) -> [u32; 2] {
    let mut levels = [0, 0];
    loop {
        let axis = match base {
            Grid::Quad(_) => {
                let [u, v] = [0, 1].map(|k| edges[k] / f64::from(1_u32 << levels[k]));
                usize::from(v > u)
            }
            Grid::Triangle(_) => 0,
        };
        let mut finer = levels;
        finer[axis] += 1;
        if base.doubled(finer).cells() as f64 > cells.min(MOST_CELLS) || finer[axis] > MOST_LEVELS {
            return levels;
        }
        levels = finer;
    }
}

/// The cells of a pilot's grid: those of the coarsest, doubled along the longer edge of a cell while its area is above `area`.
pub fn doublings(shape: &Shape, base: Grid, area: f64) -> [u32; 2] {
    let (_, e_u, e_v) = shape.edges();
    let mut levels = [0, 0];
    loop {
        let cut = base.doubled(levels);
        if shape.area() / cut.cells() as f64 <= area || cut.cells() >= 1 << 30 {
            return levels;
        }
        match cut {
            Grid::Quad([nu, nv]) => {
                let along_v = e_v.length() * f64::from(nu) > e_u.length() * f64::from(nv);
                levels[usize::from(along_v)] += 1;
            }
            Grid::Triangle(_) => levels[0] += 1,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The energies that constants and linear fits catch on all cells together.
    fn caught(cells: &GridCells, groups: &Integrals, area: f64) -> [f64; 2] {
        let each = cells.caught(groups, area);
        [0, 1].map(|basis| each.iter().map(|cell| cell[basis]).sum())
    }

    /// Integrals that each group of walks says.
    fn of_groups(groups: &[Vec<[f64; 3]>]) -> Integrals {
        let mut integrals = Integrals::none(groups.len(), groups[0].len());
        for (group, cells) in groups.iter().enumerate() {
            for (cell, parts) in cells.iter().enumerate() {
                let of_cell = integrals.cell_mut(cell);
                parts.iter().enumerate().for_each(|(k, &part)| of_cell[k * groups.len() + group] = part);
            }
        }
        integrals
    }

    /// The integrals of a function over cells of a surface, by the middles of many points.
    fn integrals(cells: &GridCells, area: f64, f: impl Fn([f64; 2]) -> f64) -> Vec<[f64; 3]> {
        const N: usize = 1200;
        let (mut sums, mut points) = (vec![[0.0; 3]; cells.count()], vec![0.0; cells.count()]);
        let triangle = matches!(cells.cut, Grid::Triangle(_));
        for (i, j) in (0..N).flat_map(|i| (0..N).map(move |j| (i, j))) {
            let at = [i, j].map(|step| (step as f64 + 0.5) / N as f64);
            if triangle && i + j + 1 >= N {
                continue;
            }
            let cell = cells.cell_at(at);
            for (sum, factor) in sums[cell].iter_mut().zip([1.0, at[0], at[1]]) {
                *sum += factor * f(at);
            }
            points[cell] += 1.0;
        }
        let area = area / cells.count() as f64;
        sums.iter().zip(points).map(|(sum, n)| sum.map(|sum| area * sum / n)).collect()
    }

    /// A linear function is caught whole by a linear fit on any grid, and its mean by a constant; what a constant on a cell leaves
    /// out is the variance within the cell. Points lie on a grid, so that all is within a few parts in a thousand.
    #[test]
    fn linear_fits_catch_linear_light_and_constants_its_means() {
        let f = |[u, v]: [f64; 2]| 2.0 + 3.0 * u - v;
        for (base, fine, coarse) in [
            (Grid::Quad([1, 1]), Grid::Quad([8, 4]), Grid::Quad([2, 4])),
            (Grid::Triangle(1), Grid::Triangle(8), Grid::Triangle(2)),
        ] {
            let fine = GridCells::new(fine);
            let area = 5.0;
            let coarse = GridCells::new(coarse);
            let groups = fine.gather(&coarse, &of_groups(&vec![integrals(&fine, area, f); 2]));
            let [constant, linear] = caught(&coarse, &groups, area);
            let whole = GridCells::new(base);
            let [whole_constant, whole] = caught(&whole, &coarse.gather(&whole, &groups), area);
            // Variances of u and v and their covariance, over the surface and over a cell of the coarse grid.
            let (mean, variance, within) = match base {
                Grid::Quad(_) => (3.0, 10.0 / 12.0, 9.0 / 48.0 + 1.0 / 192.0),
                Grid::Triangle(_) => (8.0 / 3.0, 10.0 / 18.0 + 6.0 / 36.0, (10.0 / 18.0 + 6.0 / 36.0) / 4.0),
            };
            let near = |found: f64, expected: f64| (found / area - expected).abs() < 0.005 * expected;
            assert!(near(whole_constant, mean * mean), "{base:?}: {whole_constant}");
            assert!(near(whole, mean * mean + variance), "{base:?}: {whole}");
            assert!(near(linear, mean * mean + variance), "{base:?}: {linear}");
            assert!(near(linear - constant, within), "{base:?}: {linear}, {constant}");
        }
    }

    /// Each group of walks adds noise of its own. Squares of their mean would be too large by a quarter of the noise's; products
    /// of different groups are not: 400 cells of noise ±1 around 0 catch nothing, within 4.5 standard errors √(2·400)/√(4·3)
    /// (false-alarm rate 10⁻⁵).
    #[test]
    fn noise_catches_no_energy() {
        let cells = GridCells::new(Grid::Quad([20, 20]));
        let mut state = 1_u64;
        let mut sign = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            if state >> 63 == 0 { 1.0 } else { -1.0 }
        };
        let groups: Vec<Vec<[f64; 3]>> =
            (0..4).map(|_| (0..400).map(|_| [sign(), 0.0, 0.0]).collect()).collect();
        let [constant, _] = caught(&cells, &of_groups(&groups), 400.0);
        assert!(constant.abs() < 4.5 * (800.0_f64 / 12.0).sqrt(), "{constant}");
    }

    #[test]
    fn every_cell_holds_its_centre() {
        for cut in [Grid::Quad([3, 5]), Grid::Triangle(1), Grid::Triangle(7)] {
            let cells = GridCells::new(cut);
            assert!((0..cells.count()).all(|cell| cells.cell_at(cells.centre(cell).0) == cell), "{cut:?}");
        }
    }
}
