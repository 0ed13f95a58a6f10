//! The intensities of a luminaire, interpolated bilinearly in (C, γ): their flux, and the cells that births of light are drawn from.

use std::f64::consts::PI;
use std::ops::{Add, Mul, Sub};

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::arithmetic::{angle, sin_cos, sine_versine};

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
    /// The flux of the interpolated intensities over all directions [lm].
    flux: f64,
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

/// A range of angles over which the intensity is bilinear in (C, γ).
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    /// Sine and cosine of its least C.
    pub c: [f64; 2],
    /// Sine and cosine of its least γ.
    pub gamma: [f64; 2],
    /// Its width in C, at most [`Cell::WIDEST_C`], and in γ, at most [`Cell::WIDEST_GAMMA`] [rad].
    pub widths: [f64; 2],
    /// The intensities at its corners [cd]: by C, then by γ.
    pub candela: [[f64; 2]; 2],
    /// Its flux [lm].
    pub flux: f64,
}

impl Cell {
    /// The widest cell in C [rad].
    pub const WIDEST_C: f64 = PI / 4.0;
    /// The widest cell in γ [rad].
    pub const WIDEST_GAMMA: f64 = PI / 16.0;

    /// The mean over C of the intensity: its value at the least γ [cd], and its slope in γ [cd/rad].
    pub fn strip(&self) -> [f64; 2] {
        let [[a0, a1], [b0, b1]] = self.candela;
        let [p, q] = [0.5 * (a0 + b0), 0.5 * (a1 + b1)];
        [p, (q - p) / self.widths[1]]
    }
}

/// ∫₀^δ (p + m t) sin(γ₀ + t) dt: the flux of a strip of unit width in C, from sine and cosine of γ₀ and sin δ and 1 − cos δ.
#[inline(always)]
pub fn strip_flux<R>([p, m]: [R; 2], [s, c]: [R; 2], delta: R, [sine, versine]: [R; 2]) -> R
where
    R: Copy + Add<Output = R> + Sub<Output = R> + Mul<Output = R>,
{
    let level = c * versine + s * sine;
    let slope = s * (delta * sine - versine) + c * (sine - delta + delta * versine);
    p * level + m * slope
}

/// The edges of cells along one angle.
struct Edges {
    degrees: Vec<f64>,
    /// The width of each cell [rad].
    widths: Vec<f64>,
}

impl Edges {
    fn new(degrees: Vec<f64>) -> Self {
        let widths = degrees.windows(2).map(|pair| (pair[1] - pair[0]) * (PI / 180.0)).collect();
        Edges { degrees, widths }
    }

    /// Edges at all angles of the table, at `equator` [°] where that lies between them, and between those that are farther apart than `widest` [rad].
    fn of(angles: &[f64], widest: f64, equator: Option<f64>) -> Self {
        let mut nodes = angles.to_vec();
        let range = angles[0]..angles[angles.len() - 1];
        nodes.extend(equator.filter(|angle| range.contains(angle) && !angles.contains(angle)));
        nodes.sort_by(f64::total_cmp);
        let mut degrees = vec![nodes[0]];
        for pair in nodes.windows(2) {
            let parts = ((pair[1] - pair[0]) / widest.to_degrees()).ceil().max(1.0);
            let within = |k: u32| pair[0] + (pair[1] - pair[0]) * (f64::from(k) / parts);
            degrees.extend((1..parts as u32).map(within));
            degrees.push(pair[1]);
        }
        Edges::new(degrees)
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

impl Distribution {
    /// The distribution of a table: azimuths that cover at most 360° and angles γ in [0, 180], both ascending [°], and intensities [cd]
    /// by azimuth. `None` where all is dark.
    pub(crate) fn new(poles: Poles, c: Vec<f64>, gamma: Vec<f64>, candela: Vec<f64>) -> Option<Self> {
        let mut light = Distribution { poles, c, gamma, candela, flux: 0.0 };
        light.flux = light.cells().iter().map(|cell| cell.flux).sum();
        (light.flux > 0.0).then_some(light)
    }

    /// The flux of the interpolated intensities over all directions [lm], in closed form.
    pub fn flux(&self) -> f64 {
        self.flux
    }

    /// The cells of the table in its own frame, whose axes are [`Distribution::axes`]. Within each the intensity is bilinear; none reaches over γ = 90°.
    pub fn cells(&self) -> Vec<Cell> {
        let columns = Edges::of(&self.c, Cell::WIDEST_C, None);
        let rows = Edges::of(&self.gamma, Cell::WIDEST_GAMMA, Some(90.0));
        let mut cells = Vec::with_capacity(columns.widths.len() * rows.widths.len());
        for (column, &width) in columns.degrees.windows(2).zip(&columns.widths) {
            for (row, &height) in rows.degrees.windows(2).zip(&rows.widths) {
                let candela = [column[0], column[1]].map(|c| [row[0], row[1]].map(|gamma| self.at(c, gamma)));
                let (c, gamma) = (sin_cos(column[0]), sin_cos(row[0]));
                let mut cell = Cell { c, gamma, widths: [width, height], candela, flux: 0.0 };
                cell.flux = (width * strip_flux(cell.strip(), gamma, height, sine_versine(height))).max(0.0);
                cells.push(cell);
            }
        }
        cells
    }

    /// The axes of the table in the frame of the luminaire: C = 0° at the equator, C = 90° there, and the pole γ = 180°.
    pub fn axes(&self) -> [DVec3; 3] {
        DVec3::AXES.map(|axis| self.turned_out(axis))
    }

    /// The intensity [cd] in a direction of any length, in the frame of the luminaire.
    pub fn intensity(&self, direction: DVec3) -> f64 {
        let d = self.turned_in(direction);
        let c = angle(d.y, d.x);
        let c = if c < self.c[0] { c + 360.0 } else { c };
        self.at(c, angle((d.x * d.x + d.y * d.y).sqrt(), -d.z))
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
