//! What linear fits catch of the light on every cell of every grid of a surface, for trees of cuts: rectangles are such cells.

/// Numbers by cell, for every grid of 2^a × 2^b cells up to a finest one.
#[derive(Clone, Debug)]
pub(crate) struct Images {
    /// The levels of the finest grid.
    pub(crate) top: [u32; 2],
    /// By grid, the energy that linear fits catch, without bias, by cell.
    caught: Vec<Vec<f64>>,
    /// By grid, the energy of the error of one unknown after one walk, by cell.
    noise: Vec<Vec<f64>>,
}

/// What the noise of a cell of the pilot's grid is mixed with that of the cell around it: one part in this many. Cells without a hit
/// would else have none.
pub(crate) const AROUND: f64 = 8.0;

impl Images {
    /// Images without light.
    pub(crate) fn new(top: [u32; 2]) -> Self {
        let empty = || levels(top).map(|[a, b]| vec![0.0; 1 << (a + b)]).collect::<Vec<Vec<f64>>>();
        Images { top, caught: empty(), noise: empty() }
    }

    fn place(&self, [a, b]: [u32; 2]) -> usize {
        (a * (self.top[1] + 1) + b) as usize
    }

    /// What is caught on each cell of a grid.
    pub(crate) fn caught(&self, levels: [u32; 2]) -> &[f64] {
        &self.caught[self.place(levels)]
    }

    /// Adds what is caught on the cells of a grid.
    pub(crate) fn add_caught(&mut self, levels: [u32; 2], caught: impl Iterator<Item = f64>) {
        let place = self.place(levels);
        self.caught[place].iter_mut().zip(caught).for_each(|(sum, part)| *sum += part);
    }

    /// Adds the noise on the cells of the finest grid.
    pub(crate) fn add_noise(&mut self, noise: impl Iterator<Item = f64>) {
        let place = self.place(self.top);
        self.noise[place].iter_mut().zip(noise).for_each(|(sum, part)| *sum += part);
    }

    /// Makes out the noise of all grids from that of the finest: the mean over the cells in a cell, mixed with that of the cell around.
    pub(crate) fn spread_noise(&mut self) {
        let sums: Vec<Vec<f64>> = levels(self.top).map(|grid| self.sums_of_noise(grid)).collect();
        for [a, b] in levels(self.top) {
            let parts = f64::from(1_u32 << (self.top[0] - a + self.top[1] - b));
            let own = &sums[self.place([a, b])];
            let around = self.noise_around([a, b]);
            let mixed = |(sum, around): (&f64, f64)| (AROUND * sum + around) / (AROUND * parts + 1.0);
            let noise = match around {
                None => own.iter().map(|sum| sum / parts).collect(),
                Some(around) => own.iter().zip(around).map(mixed).collect(),
            };
            let place = self.place([a, b]);
            self.noise[place] = noise;
        }
    }

    /// The noise of the cells around those of a grid, which is coarser along one axis; `None` of the coarsest.
    fn noise_around(&self, [a, b]: [u32; 2]) -> Option<Vec<f64>> {
        let axis = if a > 0 { 0 } else { 1 };
        let mut coarse = [a, b];
        coarse[axis] = coarse[axis].checked_sub(1)?;
        let noise = &self.noise[self.place(coarse)];
        Some((0..1 << (a + b)).map(|cell| noise[halved([a, b], cell, axis)]).collect())
    }

    /// The sum of the noise of the finest cells in each cell of a grid.
    fn sums_of_noise(&self, [a, b]: [u32; 2]) -> Vec<f64> {
        let mut sums = vec![0.0; 1 << (a + b)];
        let [da, db] = [self.top[0] - a, self.top[1] - b];
        for (cell, noise) in self.noise[self.place(self.top)].iter().enumerate() {
            let [i, j] = [cell >> self.top[1], cell & ((1 << self.top[1]) - 1)];
            sums[(i >> da << b) + (j >> db)] += noise;
        }
        sums
    }

    /// The energy of the error of one unknown of a cell after one walk; of a cell beyond the finest grid, of the one around it.
    pub(crate) fn noise(&self, levels: [u32; 2], at: [u32; 2]) -> f64 {
        let within = [0, 1].map(|k| levels[k].min(self.top[k]));
        let [i, j] = [0, 1].map(|k| at[k] >> (levels[k] - within[k]));
        self.noise[self.place(within)][((i << within[1]) + j) as usize]
    }

    /// What halving each cell of a grid along an axis gains, cell by cell; `None` beyond the finest grid.
    pub(crate) fn gains(&self, levels: [u32; 2], axis: usize) -> Option<Vec<f64>> {
        let mut finer = levels;
        finer[axis] += 1;
        (finer[axis] <= self.top[axis]).then(|| {
            let mut gains: Vec<f64> = self.caught(levels).iter().map(|caught| -caught).collect();
            for (cell, caught) in self.caught(finer).iter().enumerate() {
                gains[halved(finer, cell, axis)] += caught;
            }
            gains
        })
    }
}

/// The levels of all grids up to a finest one, coarse ones before those that are finer along any axis.
pub(crate) fn levels(top: [u32; 2]) -> impl DoubleEndedIterator<Item = [u32; 2]> {
    (0..=top[0]).flat_map(move |a| (0..=top[1]).map(move |b| [a, b]))
}

/// The cell around a cell in the grid that is coarser along an axis.
pub(crate) fn halved([_, b]: [u32; 2], cell: usize, axis: usize) -> usize {
    let [i, j] = [cell >> b, cell & ((1 << b) - 1)];
    match axis {
        0 => ((i >> 1) << b) + j,
        _ => (i << (b - 1)) + (j >> 1),
    }
}
