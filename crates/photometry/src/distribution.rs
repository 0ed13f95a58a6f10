//! The intensities of a luminaire, interpolated bilinearly in (C, γ): their flux, and directions drawn in proportion to them.

use std::f64::consts::PI;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::arithmetic::{angle, sin_cos, sine_versine};

/// The widest cell of the table of cells [°]: the range of [`sine_versine`]. Wider steps of a file are cut, which changes no value.
const WIDEST_CELL: f64 = 45.0;

/// The direction of the poles of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Poles {
    /// γ = 0 is down (types A and C).
    Vertical,
    /// γ = 0 is −x, and C = 0, γ = 90° is down (type B).
    Horizontal,
}

/// A table of intensities [cd] over (C, γ), and the cells between its nodes. It is kept and sent as the table alone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "CandelaTable", into = "CandelaTable")]
pub struct Distribution {
    poles: Poles,
    /// Azimuths C [°], ascending over at most 360°. Where they cover less, the rest is dark.
    c: Vec<f64>,
    /// Angles γ from the lower pole [°], ascending in [0, 180]. Where they cover less, the rest is dark.
    gamma: Vec<f64>,
    /// Intensities [cd]; node (i, j) at `i * gamma.len() + j`.
    candela: Vec<f64>,
    columns: Edges,
    rows: Edges,
    /// Intensities [cd] at the edges of cells; node (i, j) at `i * rows.degrees.len() + j`.
    nodes: Vec<f64>,
    /// The flux of all rows below each edge of rows [lm].
    below: Vec<f64>,
    /// The flux of the cells of a row before each edge of columns [lm]; row j from `j * columns.degrees.len()`.
    before: Vec<f64>,
}

/// What a distribution is made of.
#[derive(Serialize, Deserialize)]
struct CandelaTable {
    poles: Poles,
    c: Vec<f64>,
    gamma: Vec<f64>,
    candela: Vec<f64>,
}

impl From<Distribution> for CandelaTable {
    fn from(Distribution { poles, c, gamma, candela, .. }: Distribution) -> Self {
        CandelaTable { poles, c, gamma, candela }
    }
}

impl TryFrom<CandelaTable> for Distribution {
    type Error = &'static str;

    fn try_from(CandelaTable { poles, c, gamma, candela }: CandelaTable) -> Result<Self, Self::Error> {
        let ascends = |angles: &[f64]| {
            angles.len() > 1 && angles.windows(2).all(|pair| pair[0] < pair[1] && pair[1] - pair[0] <= 360.0)
        };
        let is_sound = ascends(&c)
            && ascends(&gamma)
            && c[c.len() - 1] - c[0] <= 360.0
            && (0.0..=180.0).contains(&gamma[0])
            && gamma[gamma.len() - 1] <= 180.0
            && candela.len() == c.len() * gamma.len()
            && candela.iter().all(|candela| candela.is_finite() && *candela >= 0.0);
        let light = is_sound.then(|| Distribution::new(poles, c, gamma, candela)).flatten();
        light.ok_or("the intensities are no table of a luminaire")
    }
}

/// The edges of cells along one angle.
#[derive(Clone, Debug, PartialEq)]
struct Edges {
    degrees: Vec<f64>,
    /// Sine and cosine at each edge.
    turns: Vec<[f64; 2]>,
    /// The width of each cell [rad].
    widths: Vec<f64>,
}

impl Edges {
    /// Edges at all angles of the table, and between those that are far apart.
    fn new(angles: &[f64]) -> Self {
        let mut degrees = vec![angles[0]];
        for pair in angles.windows(2) {
            let parts = ((pair[1] - pair[0]) / WIDEST_CELL).ceil().max(1.0);
            let inner = (1..parts as u32).map(|k| pair[0] + (pair[1] - pair[0]) * (f64::from(k) / parts));
            degrees.extend(inner.chain([pair[1]]));
        }
        let turns = degrees.iter().map(|&degrees| sin_cos(degrees)).collect();
        let widths = degrees.windows(2).map(|pair| (pair[1] - pair[0]) * (PI / 180.0)).collect();
        Edges { degrees, turns, widths }
    }

    fn cells(&self) -> usize {
        self.widths.len()
    }

    /// Sine and cosine of the angle `delta` [rad] above edge `at`.
    fn turn(&self, at: usize, delta: f64) -> [f64; 2] {
        let ([s, c], [sine, versine]) = (self.turns[at], sine_versine(delta));
        [s - s * versine + c * sine, c - c * versine - s * sine]
    }
}

/// Where an angle lies between two nodes: the first of them, and the part of the way to the second.
fn locate(angles: &[f64], angle: f64) -> Option<(usize, f64)> {
    if !(angles[0]..=angles[angles.len() - 1]).contains(&angle) {
        return None;
    }
    let first = angles.partition_point(|&node| node <= angle).clamp(1, angles.len() - 1) - 1;
    Some((first, (angle - angles[first]) / (angles[first + 1] - angles[first])))
}

/// The cell of a cumulative sum that holds x, and the part of the cell below x. Cells of no width hold nothing.
fn invert(sums: &[f64], x: f64) -> (usize, f64) {
    let total = sums[sums.len() - 1];
    let cell = if x < total {
        sums.partition_point(|&sum| sum <= x) - 1
    } else {
        sums.partition_point(|&sum| sum < total) - 1
    };
    let part = (x - sums[cell]) / (sums[cell + 1] - sums[cell]);
    (cell, part.clamp(0.0, 1.0))
}

/// The part u of a unit length below which a linear density from a to b holds the part t.
fn invert_linear(a: f64, b: f64, t: f64) -> f64 {
    let root = (a * a + t * (b * b - a * a)).max(0.0).sqrt();
    if a + root > 0.0 { (t * (a + b) / (a + root)).min(1.0) } else { t }
}

/// ∫₀^δ (p + m t) sin(γ₀ + t) dt, with the sine and cosine of γ₀: the flux of a strip of unit width in C.
fn strip(p: f64, m: f64, [s, c]: [f64; 2], delta: f64) -> f64 {
    let [sine, versine] = sine_versine(delta);
    let level = c * versine + s * sine;
    let slope = s * (delta * sine - versine) + c * (sine - delta + delta * versine);
    p * level + m * slope
}

impl Distribution {
    /// The distribution of a table: azimuths that cover at most 360° and angles γ in [0, 180], both ascending [°], and intensities [cd]
    /// by azimuth. `None` where all is dark.
    pub(crate) fn new(poles: Poles, c: Vec<f64>, gamma: Vec<f64>, candela: Vec<f64>) -> Option<Self> {
        let (columns, rows) = (Edges::new(&c), Edges::new(&gamma));
        let mut light = Distribution {
            poles,
            c,
            gamma,
            candela,
            columns,
            rows,
            nodes: Vec::new(),
            below: vec![0.0],
            before: Vec::new(),
        };
        let node = |&c: &f64| light.rows.degrees.iter().map(move |&gamma| (c, gamma));
        light.nodes =
            light.columns.degrees.iter().flat_map(node).map(|(c, gamma)| light.at(c, gamma)).collect();
        let mut total = 0.0;
        for row in 0..light.rows.cells() {
            let mut sum = 0.0;
            light.before.push(sum);
            for column in 0..light.columns.cells() {
                sum += light.cell_flux(column, row);
                light.before.push(sum);
            }
            total += sum;
            light.below.push(total);
        }
        (total > 0.0).then_some(light)
    }

    /// The flux of the interpolated intensities over all directions [lm], in closed form.
    pub fn flux(&self) -> f64 {
        self.below[self.below.len() - 1]
    }

    /// The intensity [cd] in a direction of any length, in the frame of the luminaire.
    pub fn intensity(&self, direction: DVec3) -> f64 {
        let d = self.turned_in(direction);
        let c = angle(d.y, d.x);
        let c = if c < self.c[0] { c + 360.0 } else { c };
        self.at(c, angle((d.x * d.x + d.y * d.y).sqrt(), -d.z))
    }

    /// A unit direction whose density over solid angle is intensity over flux, from two numbers in [0, 1). The first chooses γ and
    /// the second C, each by inversion, so that evenly spread pairs of numbers give evenly spread light.
    pub fn sample(&self, xi1: f64, xi2: f64) -> DVec3 {
        let (row, t1) = invert(&self.below, xi1 * self.flux());
        let edges = self.columns.degrees.len();
        let before = &self.before[row * edges..(row + 1) * edges];
        let (column, t2) = invert(before, xi2 * before[edges - 1]);
        let delta = self.invert_strip(column, row, t1);
        let [[a0, a1], [b0, b1]] = self.corners(column, row);
        let v = delta / self.rows.widths[row];
        let u = invert_linear(a0 + (a1 - a0) * v, b0 + (b1 - b0) * v, t2);
        let [sin_gamma, cos_gamma] = self.rows.turn(row, delta);
        let [sin_c, cos_c] = self.columns.turn(column, u * self.columns.widths[column]);
        self.turned_out(DVec3::new(sin_gamma * cos_c, sin_gamma * sin_c, -cos_gamma))
    }

    /// The brightest direction of the table: C and γ [°] of its frame, and the intensity [cd].
    pub(crate) fn brightest(&self) -> (DVec3, f64) {
        let mut best = (0, 0.0);
        for (index, &candela) in self.candela.iter().enumerate() {
            if candela > best.1 {
                best = (index, candela);
            }
        }
        let [c, gamma] = [self.c[best.0 / self.gamma.len()], self.gamma[best.0 % self.gamma.len()]];
        let ([sin_c, cos_c], [sin_gamma, cos_gamma]) = (sin_cos(c), sin_cos(gamma));
        (self.turned_out(DVec3::new(sin_gamma * cos_c, sin_gamma * sin_c, -cos_gamma)), best.1)
    }

    /// The largest intensity [cd].
    pub fn peak(&self) -> f64 {
        self.brightest().1
    }

    /// Every number of the table, in one order: two distributions are equal where these are.
    pub fn numbers(&self) -> impl Iterator<Item = f64> {
        let sizes = [self.poles as u8 as f64, self.c.len() as f64, self.gamma.len() as f64];
        sizes.into_iter().chain([&self.c, &self.gamma, &self.candela].into_iter().flatten().copied())
    }

    /// The least and the largest γ of the table [°], where its poles are vertical.
    pub(crate) fn heights(&self) -> Option<[f64; 2]> {
        (self.poles == Poles::Vertical).then(|| [self.gamma[0], self.gamma[self.gamma.len() - 1]])
    }

    /// The interpolated intensity [cd] at angles of the table [°]; 0 outside of it.
    fn at(&self, c: f64, gamma: f64) -> f64 {
        let (Some((i, u)), Some((j, v))) = (locate(&self.c, c), locate(&self.gamma, gamma)) else {
            return 0.0;
        };
        let along = |i: usize| {
            let plane = &self.candela[i * self.gamma.len() + j..];
            plane[0] + (plane[1] - plane[0]) * v
        };
        let (a, b) = (along(i), along(i + 1));
        a + (b - a) * u
    }

    /// The intensities at the corners of a cell: first by column, then by row.
    fn corners(&self, column: usize, row: usize) -> [[f64; 2]; 2] {
        [column, column + 1].map(|i| {
            let plane = &self.nodes[i * self.rows.degrees.len() + row..];
            [plane[0], plane[1]]
        })
    }

    /// The mean over C of a cell's intensity: its value at the lower edge, and its slope in γ [1/rad].
    fn strip_of(&self, column: usize, row: usize) -> [f64; 2] {
        let [[a0, a1], [b0, b1]] = self.corners(column, row);
        let [p, q] = [0.5 * (a0 + b0), 0.5 * (a1 + b1)];
        [p, (q - p) / self.rows.widths[row]]
    }

    fn cell_flux(&self, column: usize, row: usize) -> f64 {
        let [p, m] = self.strip_of(column, row);
        let flux = self.columns.widths[column] * strip(p, m, self.rows.turns[row], self.rows.widths[row]);
        flux.max(0.0)
    }

    /// The angle above the lower edge of a cell [rad] below which the cell holds the part t of its flux: Newton's steps, within
    /// bounds that close in, to rounding.
    fn invert_strip(&self, column: usize, row: usize, t: f64) -> f64 {
        let (width, turn) = (self.rows.widths[row], self.rows.turns[row]);
        let [p, m] = self.strip_of(column, row);
        let target = t * strip(p, m, turn, width);
        let density = |delta: f64| (p + m * delta) * self.rows.turn(row, delta)[0];
        let [mut low, mut high] = [0.0, width];
        let mut delta = width * invert_linear(density(0.0).max(0.0), density(width).max(0.0), t);
        for _ in 0..60 {
            let excess = strip(p, m, turn, delta) - target;
            if excess > 0.0 {
                high = delta;
            } else {
                low = delta;
            }
            let newton = delta - excess / density(delta);
            let next = if newton >= low && newton <= high { newton } else { 0.5 * (low + high) };
            let step = (next - delta).abs();
            delta = next;
            if step <= 1e-15 {
                break;
            }
        }
        delta
    }

    /// A direction of the luminaire in the frame of the table.
    fn turned_in(&self, d: DVec3) -> DVec3 {
        match self.poles {
            Poles::Vertical => d,
            Poles::Horizontal => DVec3::new(-d.z, d.y, d.x),
        }
    }

    /// A direction of the table in the frame of the luminaire.
    fn turned_out(&self, d: DVec3) -> DVec3 {
        match self.poles {
            Poles::Vertical => d,
            Poles::Horizontal => DVec3::new(d.z, d.y, -d.x),
        }
    }
}
