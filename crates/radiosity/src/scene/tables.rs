//! Births of light by tables of intensities, many side by side.
//!
//! A cell of the table is chosen by its flux (an alias table), then C and y = cos γ within it. Over y light is spread evenly over solid angle, so
//! that the density of births is the intensity, which is linear in C and nearly so in y: its curvature over y is that of γ. The density is the sum
//! of two, which are chosen by their fluxes:
//!
//! - the **floor** of a cell, bilinear in (C, y), nowhere above the intensity;
//! - the **rest** above it in each of its two half planes, a thousandth of the light, whose angles are found by bisection.
//!
//! A density 1 + s(2t − 1) over [0, 1] needs no inversion: an even number t becomes 1 − t with the probability by which the density at t falls
//! short of 1, if it does.

use photometry::{Cell, Distribution, strip_flux};

use crate::random::rng::units;
use crate::random::sampling::AliasTable;
use crate::simd::batch::WIDTH;
use crate::simd::isa::{Isa, on_isa};
use crate::simd::real::Real;
use crate::simd::table::Table;

/// What a birth needs of a cell: a cache line.
const OF_CELL: usize = 8;

/// What a birth needs of a lamp.
pub(super) const OF_LAMP: usize = 16;

/// A cell with more than one part in this many of its flux above its floor is halved in γ.
const SHARE_OF_REST: f64 = 128.0;

/// How often, at most.
const HALVINGS: u32 = 3;

/// Halvings of the width of a cell in the search for an angle: as fine as its random number.
const BISECTIONS: usize = 32;

/// In place of the number of a cell: what lies above the floors of a table, whose number is added.
const ABOVE: u32 = 1 << 31;

/// 32 random bits and this are 64 with the middle of what 32 more would be.
const MIDDLE: u64 = 1 << 31;

/// 2⁻³².
const HALF_WORD: f64 = 1.0 / 4_294_967_296.0;

/// The tables of the lamps of a scene, as births need them.
#[derive(Clone, Debug)]
pub(crate) struct LightTables {
    /// Alias tables over floors of cells, and all that lies above them: the probability of the first of two cells, and both.
    columns: Vec<(f64, [u32; 2])>,
    cells: Table<OF_CELL>,
    /// Of each table: how what lies above its floors is chosen, and the number of the first.
    above: Vec<(Option<AliasTable>, u32)>,
    rests: Vec<Rest>,
    /// Of each lamp: its position, the axes of its table in the scene, the first column of its table, and how many it has.
    lamps: Table<OF_LAMP>,
}

/// The cells of a batch of births.
type BatchCells = [u32; WIDTH];

/// Rays of two batches of births at lamps, each component in a row: three of the origin [m], then three of the direction.
pub(crate) type LampRays = [[f64; 2 * WIDTH]; 6];

impl LightTables {
    /// The tables, and of each lamp the number of its table and twelve more: its position, and the axes of the table in the scene. `None`
    /// without a table.
    pub(super) fn new(
        tables: &[Distribution],
        lamps: impl Iterator<Item = (Option<u32>, [f64; 12])>,
    ) -> Option<Self> {
        let (mut columns, mut first_columns, mut above) = (Vec::new(), Vec::new(), Vec::new());
        let (mut rows, mut rests) = (Vec::new(), Vec::new());
        for (number, table) in (0..).zip(tables) {
            let (first, first_rest) = (rows.len() as u32, rests.len() as u32);
            let (mut of_floors, mut of_rests) = (Vec::new(), Vec::new());
            for cell in table.cells() {
                halved(&CellFloor::of(cell), HALVINGS, &mut |floor| {
                    rows.push(floor.row());
                    of_floors.push(floor.flux());
                    for rest in floor.rests().into_iter().filter(|rest| rest.flux > 0.0) {
                        of_rests.push(0.5 * rest.flux * rest.width_c);
                        rests.push(rest);
                    }
                });
            }
            let last = of_floors.len() as u32;
            of_floors.push(of_rests.iter().sum());
            first_columns.push(columns.len());
            let cell = |column: u32| if column == last { ABOVE | number } else { first + column };
            let kept = AliasTable::new(&of_floors).into_columns();
            columns.extend((0..).zip(kept).map(|(column, (threshold, alias))| {
                (threshold as f64 * HALF_WORD * HALF_WORD, [cell(column), cell(alias)])
            }));
            above.push(((!of_rests.is_empty()).then(|| AliasTable::new(&of_rests)), first_rest));
        }
        first_columns.push(columns.len());
        let row = |(table, numbers): (Option<u32>, [f64; 12])| {
            let table = table.map_or(0, |table| table as usize);
            let [first, end] = [first_columns[table], first_columns[table + 1]];
            let mut row = [0.0; OF_LAMP];
            row[..12].copy_from_slice(&numbers);
            (row[12], row[13]) = (first as f64, (end - first) as f64);
            row
        };
        (!rows.is_empty()).then(|| LightTables {
            lamps: Table::new(lamps.map(row).collect()),
            columns,
            cells: Table::new(rows),
            above,
            rests,
        })
    }

    /// What the tables take of memory [bytes].
    pub(super) fn bytes(&self) -> usize {
        let above = self.above.iter().filter_map(|(above, _)| above.as_ref()).map(AliasTable::bytes);
        size_of_val(&self.columns[..])
            + above.sum::<usize>()
            + size_of_val(&self.rests[..])
            + self.cells.bytes()
            + self.lamps.bytes()
    }

    /// The rays of the first `len` births of a batch at lamps with tables, made of three times 64 random bits, from number `from` on. Births at
    /// other lamps, or at none, get some ray.
    pub(crate) fn bear(
        &self,
        isa: Isa,
        (lamps, len): (&[u32; WIDTH], usize),
        bits: [&[u64; WIDTH]; 3],
        (rays, from): (&mut LampRays, usize),
    ) {
        let (tables, mut cells) = (self, [0; WIDTH]);
        let (chosen, rows) = (&mut cells, (&mut *rays, from));
        on_isa!(isa, bear_all(
            tables: &LightTables,
            lamps: &[u32; WIDTH],
            len: usize,
            bits: [&[u64; WIDTH]; 3],
            chosen: &mut BatchCells,
            rows: (&mut LampRays, usize),
        ));
        let is_above = |cell: &u32| cell & ABOVE != 0;
        if cells[..len].iter().fold(0, |all, cell| all | cell) & ABOVE != 0 {
            for (i, cell) in cells[..len].iter().enumerate().filter(|(_, cell)| is_above(cell)) {
                let direction = self.direction_above(*cell, [bits[1][i], bits[2][i]]);
                let ray = from_lamps(*self.lamps.row(lamps[i]), direction);
                rays.iter_mut().zip(ray).for_each(|(row, x)| row[from + i] = x);
            }
        }
    }

    /// Origin [m] and direction of a birth at a lamp with a table.
    pub(super) fn bear_one(&self, lamp: usize, [place, point, direction]: [u64; 3]) -> [f64; 6] {
        let row = *self.lamps.row(lamp as u32);
        let (column, rest) = column::<f64>(row, &[place]);
        let cell = self.cell(column as usize, rest);
        let direction = match cell & ABOVE {
            0 => floor_direction(*self.cells.row(cell), units(&[direction]), units(&[point])[1]),
            _ => self.direction_above(cell, [point, direction]),
        };
        from_lamps(row, direction)
    }

    /// The cell that a number in [0, 1) chooses in a column.
    #[inline(always)]
    fn cell(&self, column: usize, number: f64) -> u32 {
        let (probability, [first, second]) = self.columns[column];
        // Where fluxes are uneven, no processor guesses which it is.
        std::hint::select_unpredictable(number < probability, first, second)
    }

    /// A direction above the floors of a table, in its frame. The lower half of the first bits chooses the half plane.
    #[cold]
    fn direction_above(&self, table: u32, [point, direction]: [u64; 2]) -> [f64; 3] {
        let (above, first) = &self.above[(table & !ABOVE) as usize];
        let above = above.as_ref().expect("what has no flux is not chosen");
        self.rests[*first as usize + above.choose(point << 32 | MIDDLE)].direction(units(&[direction]))
    }
}

#[inline(always)]
fn bear_all<R: Real>(
    tables: &LightTables,
    lamps: &[u32; WIDTH],
    len: usize,
    [places, points, directions]: [&[u64; WIDTH]; 3],
    cells: &mut BatchCells,
    (rays, from): (&mut LampRays, usize),
) {
    let len = len.min(WIDTH);
    // One lamp alone is looked up once.
    let (is_alone, alone) = (tables.lamps.len() == 1, R::rows(&tables.lamps, &[0; WIDTH]));
    let (mut chosen, mut rest) = ([0_u32; WIDTH], [0.0; WIDTH]);
    for first in (0..len).step_by(R::N) {
        let lamp = if is_alone { alone } else { R::rows(&tables.lamps, &lamps[first..]) };
        let found = column(lamp, &places[first..]);
        found.0.store_u32(&mut chosen[first..]);
        found.1.store(&mut rest[first..]);
    }
    for i in 0..len {
        cells[i] = tables.cell(chosen[i] as usize, rest[i]);
    }
    for first in (0..len).step_by(R::N) {
        let row = R::rows(&tables.cells, &cells[first..]);
        let [_, v] = units::<R>(&points[first..]);
        let direction = floor_direction(row, units::<R>(&directions[first..]), v);
        let lamp = if is_alone { alone } else { R::rows(&tables.lamps, &lamps[first..]) };
        let ray = from_lamps(lamp, direction);
        for axis in 0..6 {
            ray[axis].store(&mut rays[axis][from + first..]);
        }
    }
}

/// The columns of N lamps' tables that 64 random bits choose, and what they leave undecided: numbers in [0, 1).
#[inline(always)]
fn column<R: Real>(lamp: [R; OF_LAMP], bits: &[u64]) -> (R, R) {
    let [.., first, count, _, _] = lamp;
    let [high, low] = R::load_halves(bits);
    let number = (high + low * R::splat(HALF_WORD)) * (count * R::splat(HALF_WORD));
    let (column, last) = (number.floor(), count - R::splat(1.0));
    // The largest numbers may be rounded up to the end of the last column. Where there is no lamp there may be no column: it is the first.
    let column = R::select(column.lt(last), column, last).max(R::splat(0.0));
    (first + column, number - column)
}

/// Origin and direction of rays that leave lamps in these directions of their tables.
#[inline(always)]
pub(super) fn from_lamps<R: Real>(lamp: [R; OF_LAMP], [x, y, z]: [R; 3]) -> [R; 6] {
    let [px, py, pz, ux, uy, uz, vx, vy, vz, wx, wy, wz, ..] = lamp;
    [px, py, pz, ux * x + vx * y + wx * z, uy * x + vy * y + wy * z, uz * x + vz * y + wz * z]
}

/// The directions in the frames of their tables that numbers t, u and v in (0, 1) choose on the floors of N cells.
#[inline(always)]
fn floor_direction<R: Real>(row: [R; OF_CELL], numbers: [R; 2], v: R) -> [R; 3] {
    let [y, height, _, _, _, sin_c, cos_c, width_c] = row;
    let [t, u] = folded(row, numbers, v);
    let (one, y) = (R::splat(1.0), y - height * t);
    let sin = ((one - y) * (one + y)).max(R::splat(0.0)).sqrt();
    let turn = sine_versine((u - R::splat(0.5)) * width_c);
    let [sin_c, cos_c] = turned([sin_c, cos_c], turn);
    [sin * cos_c, sin * sin_c, R::splat(0.0) - y]
}

/// The places (t, u) within N cells, from least γ and C, with the density of their floors, from even numbers t, u and v: 1 − t for t
/// where v says so, then 1 − u for u, with what is left of v.
#[inline(always)]
fn folded<R: Real>(row: [R; OF_CELL], [t, u]: [R; 2], v: R) -> [R; 2] {
    let [_, _, low, first, more, ..] = row;
    let (one, two) = (R::splat(1.0), R::splat(2.0));
    // The density of t. What is left of v is v/min(1, m), or (v − m)/(1 − m) where t is reflected.
    let m = low + (two - (low + low)) * t;
    let stays = v.lt(m);
    let left = R::select(stays, v * m.max(one), (v - m) * (two - m));
    let scale = R::select(stays, one, one - m);
    let t = R::select(stays, t, one - t);
    let m = R::select(stays, m, two - m);
    // m times the density of u, given t, is the floor there.
    let at_least_c = first + more * t;
    let rise = m - at_least_c;
    let floor = at_least_c + (rise + rise) * u;
    [t, R::select(left.lt(floor * scale), u, one - u)]
}

/// A cell, and the floor in each of its half planes at either side: its values at the least and at the largest γ [cd].
#[derive(Clone, Copy, Debug)]
struct CellFloor {
    cell: Cell,
    /// cos γ at the least γ, less cos γ at the largest.
    height: f64,
    values: [[f64; 2]; 2],
}

impl CellFloor {
    fn of(cell: Cell) -> Self {
        let Cell { gamma: [sin, cos], widths: [_, width], candela, .. } = cell;
        let drop = |delta: f64| {
            let [sine, versine] = sine_versine(delta);
            (cos * versine + sin * sine, turned([sin, cos], [sine, versine])[0])
        };
        let ((middle, sin_middle), (height, sin_end)) = (drop(0.5 * width), drop(width));
        let line = |[p, q]: [f64; 2]| {
            let (half, slope) = (0.5 * (p + q), (q - p) / width);
            // Where the intensity is concave over y, its chord; else its tangent in the middle, or at the darker end.
            let steepness = slope / sin_middle;
            let tangent = [half - steepness * middle, half + steepness * (height - middle)];
            match () {
                () if half >= p + (q - p) * (middle / height) => [p, q],
                () if tangent[0].min(tangent[1]) >= 0.0 => tangent,
                () if p < q => [p, p + slope / sin * height],
                () => [q - slope / sin_end * height, q],
            }
        };
        CellFloor { cell, height, values: candela.map(line) }
    }

    /// The flux below the floor [lm].
    fn flux(&self) -> f64 {
        0.25 * self.values.as_flattened().iter().sum::<f64>() * self.height * self.cell.widths[0]
    }

    /// What a birth needs of the floor, in the order in which [`floor_direction`] and [`folded`] read it.
    fn row(&self) -> [f64; OF_CELL] {
        let Cell { gamma: [_, cos], widths: [width_c, _], .. } = self.cell;
        let [[a0, a1], [b0, b1]] = self.values;
        let mean = 0.25 * (a0 + a1 + b0 + b1);
        let per_mean = if mean > 0.0 { 1.0 / mean } else { 0.0 };
        let [sin_c, cos_c] = self.middle();
        let (low, first, more) = (0.5 * (a0 + b0), a0, a1 - a0);
        [cos, self.height, low * per_mean, first * per_mean, more * per_mean, sin_c, cos_c, width_c]
    }

    /// Sine and cosine of C in the middle of the cell.
    fn middle(&self) -> [f64; 2] {
        turned(self.cell.c, sine_versine(0.5 * self.cell.widths[0]))
    }

    /// What lies above the floor in either half plane.
    fn rests(&self) -> [Rest; 2] {
        let Cell { gamma, widths: [width_c, width], candela, .. } = self.cell;
        [0, 1].map(|side| {
            let ([p, q], [low, high]) = (candela[side], self.values[side]);
            let slopes = [(q - p) / width, (high - low) / (2.0 * self.height)];
            let (middle, is_last) = (self.middle(), side == 1);
            let mut rest = Rest { gamma, width, above: p - low, slopes, middle, width_c, is_last, flux: 0.0 };
            rest.flux = rest.below(width).0.max(0.0);
            rest
        })
    }
}

/// The floor, or where more than a small part of the flux lies above it, those of both halves of its cell in γ, `times` times at most.
fn halved(floor: &CellFloor, times: u32, keep: &mut impl FnMut(&CellFloor)) {
    let Cell { gamma, widths: [width_c, width], candela, .. } = floor.cell;
    let above: f64 = floor.rests().iter().map(|rest| 0.5 * rest.flux * width_c).sum();
    if times == 0 || above * SHARE_OF_REST <= floor.flux() + above {
        return keep(floor);
    }
    let half = 0.5 * width;
    let middle = candela.map(|[p, q]| 0.5 * (p + q));
    let halves = [
        (gamma, [0, 1].map(|side| [candela[side][0], middle[side]])),
        (turned(gamma, sine_versine(half)), [0, 1].map(|side| [middle[side], candela[side][1]])),
    ];
    for (gamma, candela) in halves {
        let cell = Cell { gamma, widths: [width_c, half], candela, ..floor.cell };
        halved(&CellFloor::of(cell), times - 1, keep);
    }
}

/// The intensity less the floor over one half plane at the side of a cell. Towards the other side it falls to 0 as a linear function of C.
#[derive(Clone, Copy, Debug)]
struct Rest {
    /// Sine and cosine of the least γ, and the width in γ [rad].
    gamma: [f64; 2],
    width: f64,
    /// The intensity less the floor at the least γ [cd].
    above: f64,
    /// The slope of the intensity in γ [cd/rad], and half of that of the floor in −cos γ [cd].
    slopes: [f64; 2],
    /// Sine and cosine of C in the middle, and the width in C [rad].
    middle: [f64; 2],
    width_c: f64,
    /// Whether it is the half plane at the largest C.
    is_last: bool,
    /// Its flux per width in C [lm/rad].
    flux: f64,
}

impl Rest {
    /// The flux within an angle of the least γ per width in C [lm/rad], and sine and cosine of γ there.
    fn below(&self, delta: f64) -> (f64, [f64; 2]) {
        let ([sin, cos], [slope, half]) = (self.gamma, self.slopes);
        let turn = sine_versine(delta);
        let drop = cos * turn[1] + sin * turn[0];
        (
            strip_flux([self.above, slope], self.gamma, delta, turn) - half * drop * drop,
            turned(self.gamma, turn),
        )
    }

    /// The direction in the frame of the table that two numbers in (0, 1) choose.
    #[cold]
    fn direction(&self, [t, u]: [f64; 2]) -> [f64; 3] {
        let (target, mut delta, mut step) = (t * self.flux, 0.0, self.width);
        for _ in 0..BISECTIONS {
            step *= 0.5;
            if self.below(delta + step).0 < target {
                delta += step;
            }
        }
        let [sin, cos] = self.below(delta + 0.5 * step).1;
        let u = if self.is_last { u.sqrt() } else { 1.0 - (1.0 - u).sqrt() };
        let [sin_c, cos_c] = turned(self.middle, sine_versine((u - 0.5) * self.width_c));
        [sin * cos_c, sin * sin_c, -cos]
    }
}

/// Sine and cosine of the sum of two angles, from sine and cosine of one, and sin x and 1 − cos x of the other.
#[inline(always)]
fn turned<R: Real>([sin, cos]: [R; 2], [sine, versine]: [R; 2]) -> [R; 2] {
    [sin + (cos * sine - sin * versine), cos - (cos * versine + sin * sine)]
}

/// (−1)^k / n! for n = 1, 3, 5 … and n = 2, 4, 6 ….
const SERIES: [[f64; 6]; 2] = [series(1), series(2)];

const fn series(first: u64) -> [f64; 6] {
    let mut terms = [0.0; 6];
    let (mut k, mut factorial) = (0, first);
    while k < 6 {
        let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
        terms[k] = sign / factorial as f64;
        let n = first + 2 * k as u64;
        factorial *= (n + 1) * (n + 2);
        k += 1;
    }
    terms
}

/// sin x and 1 − cos x for |x| up to half of [`Cell::WIDEST_C`], to rounding.
#[inline(always)]
fn sine_versine<R: Real>(x: R) -> [R; 2] {
    let (x2, [sine, versine]) = (x * x, SERIES);
    let x4 = x2 * x2;
    [x * polynomial(&sine, x2, x4), x2 * polynomial(&versine, x2, x4)]
}

/// A polynomial in y, in the order in which its terms wait least for each other.
#[inline(always)]
fn polynomial<R: Real>(series: &[f64; 6], y: R, y2: R) -> R {
    let [a, b, c, d, e, f] = *series;
    let (first, second, third) = (linear(a, b, y), linear(c, d, y), linear(e, f, y));
    first + y2 * (second + y2 * third)
}

#[inline(always)]
fn linear<R: Real>(a: f64, b: f64, y: R) -> R {
    R::splat(a) + R::splat(b) * y
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::rng::{Sequence, WalkRng};

    /// A cell from γ [°] on, with these intensities at its corners.
    fn cell(gamma: f64, width: f64, candela: [[f64; 2]; 2]) -> Cell {
        let ([sin, cos], width) = (gamma.to_radians().sin_cos().into(), width.to_radians());
        Cell { c: [0.0, 1.0], gamma: [sin, cos], widths: [0.5, width], candela, flux: 1.0 }
    }

    /// Cells on both sides of the equator, at both poles, with dark edges and steep slopes.
    fn cells() -> Vec<Cell> {
        let mut rng = Sequence::new(5).walk(0);
        let cell = |number: usize| {
            let [x, y] = rng.pair();
            let mut candela = [rng.pair(), rng.pair()];
            let width = 0.001 + 11.249 * x;
            let gamma = match number % 7 {
                0 => 0.0,
                1 => 180.0 - width,
                2..=4 => y * (90.0 - width),
                _ => 90.0 + y * (90.0 - width),
            };
            if number % 4 < 2 {
                candela.iter_mut().for_each(|plane| plane[number % 4] = 0.0);
            }
            self::cell(gamma, width, candela)
        };
        (0..2000).map(cell).collect()
    }

    /// Floors are nowhere above the intensities nor below 0, both together have the flux of the cell, and of what lies above a floor the part
    /// below the angle that a number chooses is that number.
    #[test]
    fn floors_and_rests_are_the_light_of_their_cell() {
        for cell in cells() {
            let floor = CellFloor::of(cell);
            let (peak, name) = (cell.candela.as_flattened().iter().copied().fold(0.0, f64::max), cell);
            assert!(floor.values.as_flattened().iter().all(|value| *value >= -1e-12 * peak), "{name:?}");
            let rests = floor.rests();
            let turn = sine_versine(cell.widths[1]);
            let flux = cell.widths[0] * strip_flux(cell.strip(), cell.gamma, cell.widths[1], turn);
            let above: f64 = rests.iter().map(|rest| 0.5 * rest.flux * rest.width_c).sum();
            assert!((floor.flux() + above - flux).abs() < 1e-12 * peak, "{name:?}");
            for (side, rest) in rests.iter().enumerate() {
                let [p, q] = cell.candela[side];
                let mut before = 0.0;
                for k in 1..=32 {
                    let part = f64::from(k) / 32.0;
                    let delta = part * cell.widths[1];
                    let [sine, versine] = sine_versine(delta);
                    let drop = cell.gamma[1] * versine + cell.gamma[0] * sine;
                    let [low, high] = floor.values[side];
                    let height = low + (high - low) * (drop / floor.height);
                    assert!(height <= p + (q - p) * part + 1e-10 * peak, "{name:?} at {part}");
                    let below = rest.below(delta).0;
                    assert!(below >= before - 1e-13 * peak, "{name:?} at {part}");
                    before = below;
                }
                if rest.flux > 1e-9 * peak {
                    let t = 0.3;
                    let [x, y, z] = rest.direction([t, 0.5]);
                    let delta = (x.hypot(y)).atan2(-z) - cell.gamma[0].atan2(cell.gamma[1]);
                    let error = (rest.below(delta).0 / rest.flux - t).abs();
                    assert!(error < 1e-4, "{error:e} of {name:?}");
                }
            }
        }
    }

    /// 32³ even numbers spread as the floor does: four moments of the places, within the error of the middle rule with a jump.
    #[test]
    fn folded_numbers_have_the_density_of_the_floor() {
        const EVEN: u32 = 32;
        for cell in cells().into_iter().step_by(10) {
            let row = CellFloor::of(cell).row();
            let [_, _, low, first, more, ..] = row;
            let even = |k: u32| (f64::from(k) + 0.5) / f64::from(EVEN);
            let mut sums = [0.0; 3];
            for k in 0..EVEN.pow(3) {
                let [t, u] = folded(row, [even(k % EVEN), even(k / EVEN % EVEN)], even(k / EVEN.pow(2)));
                assert!((0.0..=1.0).contains(&t) && (0.0..=1.0).contains(&u), "{cell:?}");
                [t, u, t * u].iter().zip(&mut sums).for_each(|(x, sum)| *sum += x);
            }
            // The density is f + (r − f)·2u with f = first + more·t and r = low + 2(1 − low)·t, whose mean is 1.
            let mean = |power: i32| {
                let [f, r] = [[first, more], [low, 2.0 * (1.0 - low)]].map(|[a, b]| {
                    let whole = a + 0.5 * b;
                    if power == 0 { whole } else { 0.5 * a + b / 3.0 }
                });
                [f, r]
            };
            let ([f, r], [ft, rt]) = (mean(0), mean(1));
            let expected = [rt, 0.5 * f + (r - f) * 2.0 / 3.0, 0.5 * ft + (rt - ft) * 2.0 / 3.0];
            for (sum, expected) in sums.iter().zip(expected) {
                let error = sum / f64::from(EVEN.pow(3)) - expected;
                assert!(error.abs() < 4e-3, "{error:e} of {expected} for {cell:?}");
            }
        }
    }

    /// Each instruction set finds what one birth alone does, of three lamps, one of them without a table.
    #[test]
    fn instruction_sets_bear_alike() {
        let file = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 3 4 1 2 0 0 0\n1 1 10\n0 40 100\n0 90 180 270\n\
                    9 5 1\n7 2 0\n1 1 8\n4 0 3\n";
        let table = photometry::Luminaire::read(file.as_bytes()).unwrap().distribution;
        let axes = [1.0, 2.0, 3.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
        for lamps in [vec![Some(0)], vec![Some(1), None, Some(0)]] {
            let numbers: Vec<_> = lamps.iter().map(|&table| (table, axes)).collect();
            let tables = LightTables::new(&[table.clone(), table.clone()], numbers.into_iter()).unwrap();
            let mut rng: WalkRng = Sequence::new(8).walk(0);
            for len in [WIDTH, 77, 1] {
                // Where a walk is born on a plane, the number of its lamp is that of none.
                let number = |i: usize| if i % 7 == 3 { u32::MAX } else { (i % lamps.len()) as u32 };
                let lamp: [u32; WIDTH] = std::array::from_fn(number);
                let bits: [[u64; WIDTH]; 3] = std::array::from_fn(|_| std::array::from_fn(|_| rng.bits()));
                for isa in Isa::available() {
                    let mut rays = [[0.0; 2 * WIDTH]; 6];
                    tables.bear(isa, (&lamp, len), bits.each_ref(), (&mut rays, WIDTH));
                    for i in (0..len).filter(|&i| lamps.get(lamp[i] as usize).is_some_and(Option::is_some)) {
                        let alone = tables.bear_one(lamp[i] as usize, bits.map(|row| row[i]));
                        assert_eq!(rays.map(|row| row[WIDTH + i]), alone, "{isa:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn series_are_good_to_rounding() {
        for k in -1000..=1000 {
            let x = f64::from(k) / 2000.0 * Cell::WIDEST_C;
            let expected = [x.sin(), 2.0 * (0.5 * x).sin().powi(2)];
            let found = sine_versine(x);
            assert!(found.iter().zip(expected).all(|(f, e)| (f - e).abs() <= 1e-15), "{x}");
        }
    }
}
