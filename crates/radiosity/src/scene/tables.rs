//! Births of light by tables of intensities, many side by side.
//!
//! A cell of the table is chosen by its flux (an alias table), and the angles within it by inversion: C by the flux of its half planes, which is
//! linear in C, then γ by the flux below it in the half plane. So two numbers that are evenly spread give evenly spread light within each cell.

use std::ops::{Add, Div, Mul, Sub};

use photometry::{Cell, Distribution, strip_flux};

use crate::random::rng::units;
use crate::random::sampling::AliasTable;
use crate::simd::batch::WIDTH;
use crate::simd::isa::{Isa, on_isa};
use crate::simd::real::Real;
use crate::simd::table::Table;

/// Numbers of a row: what a birth needs of a cell, or of a lamp.
const NUMBERS: usize = 16;

/// Steps of Halley's method to the angle γ of a birth. They treble the digits of a first guess that is good to a tenth.
const STEPS: usize = 2;

/// The tables of the lamps of a scene, as births need them.
#[derive(Clone, Debug)]
pub(crate) struct LightTables {
    /// Of each table: how its cells are chosen, and the number of the first.
    choices: Vec<(AliasTable, u32)>,
    cells: Table<NUMBERS>,
    /// Of each lamp: its position, and the axes of its table in the scene.
    lamps: Table<NUMBERS>,
}

/// Births at lamps with tables.
#[derive(Clone, Debug)]
pub(crate) struct TableBirths<const N: usize> {
    /// Numbers of lamps.
    pub(crate) lamp: [u32; N],
    /// Numbers of cells.
    pub(crate) cell: [u32; N],
    /// Random bits for the direction.
    pub(crate) direction: [u64; N],
}

impl<const N: usize> Default for TableBirths<N> {
    fn default() -> Self {
        TableBirths { lamp: [0; N], cell: [0; N], direction: [0; N] }
    }
}

impl LightTables {
    /// The tables, and of each lamp twelve numbers: its position, and the axes of its table in the scene. `None` without a table.
    pub(super) fn new(tables: &[Distribution], lamps: impl Iterator<Item = [f64; 12]>) -> Option<Self> {
        let (mut choices, mut rows) = (Vec::new(), Vec::new());
        for table in tables {
            let cells = table.cells();
            let fluxes: Vec<f64> = cells.iter().map(|cell| cell.flux).collect();
            choices.push((AliasTable::new(&fluxes), rows.len() as u32));
            rows.extend(cells.iter().map(row));
        }
        let lamp = |numbers: [f64; 12]| std::array::from_fn(|i| numbers.get(i).copied().unwrap_or(0.0));
        let lamps = Table::new(lamps.map(lamp).collect());
        (!rows.is_empty()).then(|| LightTables { choices, cells: Table::new(rows), lamps })
    }

    /// What the tables take of memory [bytes].
    pub(super) fn bytes(&self) -> usize {
        let choices = self.choices.iter().map(|(choice, _)| choice.bytes()).sum::<usize>();
        choices + self.cells.bytes() + self.lamps.bytes()
    }

    /// The number of the cell of a table that 64 random bits choose.
    #[inline(always)]
    pub(crate) fn choose(&self, table: u32, bits: u64) -> u32 {
        let (choice, first) = &self.choices[table as usize];
        first + choice.choose(bits) as u32
    }

    /// Births will soon take place in these cells.
    #[inline(always)]
    pub(crate) fn expect(&self, cells: &[u32]) {
        self.cells.expect(cells);
    }

    /// Origins [m] and directions of `len` births.
    pub(crate) fn bear(
        &self,
        isa: Isa,
        (births, len): (&TableBirths<WIDTH>, usize),
        rays: &mut [[f64; WIDTH]; 6],
    ) {
        let tables = self;
        on_isa!(isa, bear_all(tables: &LightTables, births: &TableBirths<WIDTH>, len: usize, rays: &mut [[f64; WIDTH]; 6]));
    }

    /// Origin [m] and direction of one birth.
    pub(super) fn bear_one(&self, births: &TableBirths<1>) -> [f64; 6] {
        let [t, u] = units::<f64>(&births.direction);
        let direction = table_direction(*self.cells.row(births.cell[0]), t, u);
        from_lamps(*self.lamps.row(births.lamp[0]), direction)
    }
}

/// Two vectors at a time: each alone would wait for its own results more often than it computes.
#[inline(always)]
fn bear_all<R: Real>(
    tables: &LightTables,
    births: &TableBirths<WIDTH>,
    len: usize,
    rays: &mut [[f64; WIDTH]; 6],
) {
    for first in (0..len.min(WIDTH)).step_by(2 * R::N) {
        let next = first + R::N;
        let TableBirths { lamp, cell, direction } = births;
        let (a, b) = (R::rows(&tables.cells, &cell[first..]), R::rows(&tables.cells, &cell[next..]));
        let mut cells = [Twice(a[0], b[0]); NUMBERS];
        for k in 1..NUMBERS {
            cells[k] = Twice(a[k], b[k]);
        }
        let ([t0, u0], [t1, u1]) = (units::<R>(&direction[first..]), units::<R>(&direction[next..]));
        let [x, y, z] = table_direction(cells, Twice(t0, t1), Twice(u0, u1));
        let ray = from_lamps(R::rows(&tables.lamps, &lamp[first..]), [x.0, y.0, z.0]);
        let second = from_lamps(R::rows(&tables.lamps, &lamp[next..]), [x.1, y.1, z.1]);
        for axis in 0..6 {
            ray[axis].store(&mut rays[axis][first..]);
            second[axis].store(&mut rays[axis][next..]);
        }
    }
}

/// Origin and direction of rays that leave lamps in these directions of their tables.
#[inline(always)]
fn from_lamps<R: Real>(lamp: [R; NUMBERS], [x, y, z]: [R; 3]) -> [R; 6] {
    let [px, py, pz, ux, uy, uz, vx, vy, vz, wx, wy, wz, ..] = lamp;
    [px, py, pz, ux * x + vx * y + wx * z, uy * x + vy * y + wy * z, uz * x + vz * y + wz * z]
}

/// What a birth needs of a cell, in the order in which [`table_direction`] reads it.
fn row(cell: &Cell) -> [f64; NUMBERS] {
    let Cell { c: [sin_c, cos_c], gamma: [sin, cos], widths: [width_c, width], candela, .. } = *cell;
    let [[a0, a1], [b0, b1]] = candela;
    let turn = sine_versine::<f64>(width);
    let sin_end = turned([sin, cos], turn)[0].max(0.0);
    // The flux of half planes at either side, each over the width in γ.
    let [first, last] =
        candela.map(|[p, q]| strip_flux([p, (q - p) / width], [sin, cos], width, turn).max(0.0));
    let ([ab0, ab1], fluxes) = ([b0 - a0, b1 - a1], [first, last - first]);
    [
        sin,
        cos,
        sin_end,
        width,
        1.0 / width,
        a0,
        ab0,
        a1,
        ab1,
        fluxes[0],
        fluxes[1],
        last,
        sin_c,
        cos_c,
        width_c,
        0.0,
    ]
}

/// The directions in the frames of their tables that two numbers in (0, 1) choose in N cells.
#[inline(always)]
fn table_direction<R: Number>(cell: [R; NUMBERS], xi1: R, xi2: R) -> [R; 3] {
    let [_, _, _, _, _, _, _, _, _, first, _, last, sin_c, cos_c, width_c, _] = cell;
    let u = invert_linear(first, last, xi2);
    let [sin_c, cos_c] = turned([sin_c, cos_c], wide_sine_versine(u * width_c));
    let (_, [sin, cos]) = polar_angle(cell, u, xi1);
    [sin * cos_c, sin * sin_c, R::splat(0.0) - cos]
}

/// In the half planes at the parts u of the widths of N cells: the angles above their least γ below which the parts t of their fluxes
/// are [rad], and sine and cosine of γ there.
#[inline(always)]
fn polar_angle<R: Number>(cell: [R; NUMBERS], u: R, t: R) -> (R, [R; 2]) {
    let [sin, cos, sin_end, width, per_width, a0, ab0, a1, ab1, flux, more, ..] = cell;
    let (p, q) = (a0 + ab0 * u, a1 + ab1 * u);
    let m = (q - p) * per_width;
    let target = t * (flux + more * u);
    let mut delta = width * invert_linear(p * sin, q * sin_end, t);
    let (mut step, mut at) = (R::splat(0.0), [sin, cos]);
    for _ in 0..STEPS {
        let turn = sine_versine(delta);
        at = turned([sin, cos], turn);
        let [s, c] = at;
        let excess = strip_flux([p, m], [sin, cos], delta, turn) - target;
        let intensity = p + m * delta;
        let density = intensity * s;
        let slope = m * s + intensity * c;
        let twice = density + density;
        let next = delta - excess * twice / (twice * density - excess * slope).max(f64::MIN_POSITIVE);
        let next = next.at_most(width).max(0.0);
        (step, delta) = (next - delta, next);
    }
    // The last step is short: four terms of sine and cosine are as good as all.
    let square = step * step;
    let sine = step - step * square * R::splat(1.0 / 6.0);
    let versine = square * (R::splat(0.5) - square * R::splat(1.0 / 24.0));
    (delta, turned(at, [sine, versine]))
}

/// The parts of unit lengths below which linear densities from a to b hold the parts t.
#[inline(always)]
fn invert_linear<R: Number>(a: R, b: R, t: R) -> R {
    let root = (a * a + t * (b * b - a * a)).max(0.0).sqrt();
    (t * (a + b) / (a + root).max(f64::MIN_POSITIVE)).at_most(R::splat(1.0))
}

/// Sine and cosine of the sum of two angles, from sine and cosine of one, and sin x and 1 − cos x of the other.
#[inline(always)]
fn turned<R: Number>([sin, cos]: [R; 2], [sine, versine]: [R; 2]) -> [R; 2] {
    [sin + (cos * sine - sin * versine), cos - (cos * versine + sin * sine)]
}

/// (−1)^k / n! for n = 1, 3, 5 … and n = 2, 4, 6 ….
const SERIES: [[f64; 8]; 2] = [series(1), series(2)];

const fn series(first: u64) -> [f64; 8] {
    let mut terms = [0.0; 8];
    let (mut k, mut factorial) = (0, first);
    while k < 8 {
        let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
        terms[k] = sign / factorial as f64;
        let n = first + 2 * k as u64;
        factorial *= (n + 1) * (n + 2);
        k += 1;
    }
    terms
}

/// sin x and 1 − cos x for |x| up to [`Cell::WIDEST_GAMMA`], to rounding: five terms, in the order in which they wait least for each other.
#[inline(always)]
fn sine_versine<R: Number>(x: R) -> [R; 2] {
    let (x2, [sine, versine]) = (x * x, SERIES);
    let x4 = x2 * x2;
    [
        x * four_terms(&sine, x2, x4, x4 * R::splat(sine[4])),
        x2 * four_terms(&versine, x2, x4, x4 * R::splat(versine[4])),
    ]
}

/// sin x and 1 − cos x for |x| up to [`Cell::WIDEST_C`], to rounding: eight terms.
#[inline(always)]
fn wide_sine_versine<R: Number>(x: R) -> [R; 2] {
    let (x2, [sine, versine]) = (x * x, SERIES);
    let x4 = x2 * x2;
    let [sine_end, versine_end] = [upper_terms(&sine, x2, x4), upper_terms(&versine, x2, x4)];
    [x * four_terms(&sine, x2, x4, sine_end), x2 * four_terms(&versine, x2, x4, versine_end)]
}

/// The first four terms of a polynomial in y, whose fifth and further terms over y² are given.
#[inline(always)]
fn four_terms<R: Number>(series: &[f64; 8], y: R, y2: R, further: R) -> R {
    let [a, b, c, d] = [series[0], series[1], series[2], series[3]];
    (R::splat(a) + R::splat(b) * y) + y2 * ((R::splat(c) + R::splat(d) * y) + further)
}

/// The last four terms of a polynomial in y over y².
#[inline(always)]
fn upper_terms<R: Number>(series: &[f64; 8], y: R, y2: R) -> R {
    let [a, b, c, d] = [series[4], series[5], series[6], series[7]];
    y2 * ((R::splat(a) + R::splat(b) * y) + y2 * (R::splat(c) + R::splat(d) * y))
}

/// What the angles of births are computed with: one vector, or two.
trait Number: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> {
    fn splat(x: f64) -> Self;
    fn sqrt(self) -> Self;
    /// The larger of this and a number.
    fn max(self, least: f64) -> Self;
    fn at_most(self, most: Self) -> Self;
}

impl<R: Real> Number for R {
    #[inline(always)]
    fn splat(x: f64) -> Self {
        R::splat(x)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        R::sqrt(self)
    }
    #[inline(always)]
    fn max(self, least: f64) -> Self {
        R::max(self, R::splat(least))
    }
    #[inline(always)]
    fn at_most(self, most: Self) -> Self {
        R::select(self.lt(most), self, most)
    }
}

/// Two vectors.
#[derive(Clone, Copy)]
struct Twice<R>(R, R);

macro_rules! twice_operator {
    ($($trait:ident $method:ident $operator:tt),*) => {
        $(impl<R: Real> $trait for Twice<R> {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Twice(self.0 $operator other.0, self.1 $operator other.1)
            }
        })*
    };
}

twice_operator!(Add add +, Sub sub -, Mul mul *, Div div /);

impl<R: Real> Number for Twice<R> {
    #[inline(always)]
    fn splat(x: f64) -> Self {
        Twice(R::splat(x), R::splat(x))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Twice(R::sqrt(self.0), R::sqrt(self.1))
    }
    #[inline(always)]
    fn max(self, least: f64) -> Self {
        Twice(Number::max(self.0, least), Number::max(self.1, least))
    }
    #[inline(always)]
    fn at_most(self, most: Self) -> Self {
        Twice(self.0.at_most(most.0), self.1.at_most(most.1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::rng::Sequence;

    /// A cell from γ [°] on, with these intensities at its corners.
    fn cell(gamma: f64, width: f64, candela: [[f64; 2]; 2]) -> Cell {
        let ([sin, cos], width) = (gamma.to_radians().sin_cos().into(), width.to_radians());
        Cell { c: [0.0, 1.0], gamma: [sin, cos], widths: [0.5, width], candela, flux: 1.0 }
    }

    /// The part of a cell's flux below the angle that a number chooses is that number: at dark edges, with steep slopes, where sin γ doubles, and
    /// at the poles, where cells are so narrow that intensities hardly change in them.
    #[test]
    fn the_flux_below_the_angle_is_the_number() {
        let mut rng = Sequence::new(5).walk(0);
        for number in 0..20_000 {
            let [x, y] = rng.pair();
            let mut candela = [rng.pair(), rng.pair()];
            let width = 0.001 + 11.249 * x;
            let gamma = match number % 7 {
                0 => 0.0,
                1 => 180.0 - width,
                _ => 2.0 * width + y * (180.0 - 5.0 * width),
            };
            let (dark, is_pole) = (number % 4, number % 7 < 2);
            for plane in &mut candela {
                match (is_pole, dark) {
                    (true, _) => plane[1] = plane[0] * (1.0 + 0.002 * (y - 0.5)),
                    (false, 0 | 1) => plane[dark] = 0.0,
                    _ => {}
                }
            }
            let cell = cell(gamma, width, candela);
            let row = row(&cell);
            for t in [1e-9, rng.pair()[0], 1.0 - 1e-9] {
                let u = rng.pair()[0];
                let (delta, [sin, cos]) = polar_angle(row, u, t);
                let [p, q] = [0, 1].map(|i| candela[0][i] + u * (candela[1][i] - candela[0][i]));
                let flux = |delta: f64| {
                    strip_flux([p, (q - p) / cell.widths[1]], cell.gamma, delta, sine_versine(delta))
                };
                let error = (flux(delta) / flux(cell.widths[1]) - t).abs();
                assert!(error < 1e-9, "{error:e} at {t} of {gamma}° + {width}°, {candela:?}");
                let angle = gamma.to_radians() + delta;
                let off = (sin - angle.sin()).abs().max((cos - angle.cos()).abs());
                assert!(off < 1e-12, "{off:e} at {t} of {gamma}° + {width}°, {candela:?}");
            }
        }
    }

    #[test]
    fn series_are_good_to_rounding() {
        for k in 0..=1000 {
            let part = f64::from(k) / 1000.0;
            for (found, x) in [
                (sine_versine(part * Cell::WIDEST_GAMMA), part * Cell::WIDEST_GAMMA),
                (wide_sine_versine(part * Cell::WIDEST_C), part * Cell::WIDEST_C),
            ] {
                let expected = [x.sin(), 2.0 * (0.5 * x).sin().powi(2)];
                assert!(found.iter().zip(expected).all(|(f, e)| (f - e).abs() <= 4e-16 * (1.0 + e)), "{x}");
            }
        }
    }
}
