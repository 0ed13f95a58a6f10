//! What a scene is written as: surfaces, materials, cells. A [`SceneSpec`] travels to the workers and is
//! hashed; [`crate::Scene::build`] checks it and makes the immutable scene that walks run in.

use std::collections::HashMap;
use std::ops::Index;
use std::sync::Arc;

use arrayvec::ArrayVec;
use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::lamp::LampsSpec;
use super::leaves::Leaves;
use super::pane::PaneSpec;

/// The outline of a planar surface and how it is cut into patches.
///
/// ```
/// use glam::DVec3;
/// use radiosity::Shape;
///
/// let triangle = Shape::Triangle { a: DVec3::ZERO, b: DVec3::X, c: DVec3::Y, rows: 4 };
/// assert_eq!((triangle.area(), triangle.cell_count()), (0.5, 16));
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Shape {
    /// A parallelogram given by a corner and its two neighbours [m]; the front faces (u − c) × (v − c).
    /// `cells` = (n_u, n_v); patch = first + i_u·n_v + i_v.
    Parallelogram {
        /// The corner c of the parallelogram [m].
        corner: DVec3,
        /// c + u, the next corner along u.
        corner_u: DVec3,
        /// c + v, the next corner along v.
        corner_v: DVec3,
        /// Cells along u and v.
        cells: [u32; 2],
    },
    /// A triangle a, b, c [m], front by the right-hand rule, cut into `rows`² congruent triangles. Row r
    /// from a holds 2r + 1 of them, alternating, from the ab side; patch = first + r² + position.
    Triangle {
        /// Vertex a of the triangle [m].
        a: DVec3,
        /// Vertex b of the triangle [m].
        b: DVec3,
        /// Vertex c of the triangle [m].
        c: DVec3,
        /// The number of rows k.
        rows: u32,
    },
    /// A parallelogram as above, cut into rectangles of different sizes in its own coordinates; patch = first + number of the leaf.
    Divided {
        /// The corner c of the parallelogram [m].
        corner: DVec3,
        /// c + u, the next corner along u.
        corner_u: DVec3,
        /// c + v, the next corner along v.
        corner_v: DVec3,
        /// The rectangles.
        leaves: Leaves,
    },
}

/// The corners of an outline: three of a triangle, four of a parallelogram.
pub type Corners<T = DVec3> = ArrayVec<T, 4>;

/// Which sides of a surface reflect and emit.
///
/// ```
/// use radiosity::Sides;
///
/// assert_eq!([Sides::Front, Sides::Both].map(Sides::count), [1.0, 2.0]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Sides {
    /// Only the front; a ray that meets the back is absorbed there and counted.
    Front,
    /// Both. Each side of a patch is an unknown of its own; emittance and area are those of one side.
    Both,
}

impl Sides {
    /// The number of active sides: 1 or 2.
    pub fn count(self) -> f64 {
        match self {
            Sides::Front => 1.0,
            Sides::Both => 2.0,
        }
    }
}

/// The side of a surface that a ray leaves or meets.
///
/// ```
/// use radiosity::Side;
///
/// assert_eq!([Side::Front, Side::Back].map(Side::sign), [1.0, -1.0]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The side its normal points to.
    Front,
    /// The side away from the normal.
    Back,
}

impl Side {
    /// 1 for the front, −1 for the back.
    pub fn sign(self) -> f64 {
        match self {
            Side::Front => 1.0,
            Side::Back => -1.0,
        }
    }
}

/// A reflectance or an emittance: one number per channel (red, green, blue). Grey where they are equal.
///
/// ```
/// use radiosity::Spectrum;
///
/// let red = Spectrum::rgb([0.6, 0.1, 0.1]);
/// assert!(!red.is_grey() && Spectrum::from(0.5).is_grey());
/// assert_eq!(red.max(), 0.6);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Spectrum([f64; 3]);

impl Spectrum {
    /// Nothing in any channel.
    pub const BLACK: Spectrum = Spectrum([0.0; 3]);

    /// One number per channel.
    pub const fn rgb(channels: [f64; 3]) -> Self {
        Spectrum(channels)
    }

    /// The numbers of the red, green and blue channel.
    pub fn channels(self) -> [f64; 3] {
        self.0
    }

    /// Whether all channels are equal.
    pub fn is_grey(self) -> bool {
        self.0[0] == self.0[1] && self.0[1] == self.0[2]
    }

    /// Whether any channel is above 0.
    pub fn is_lit(self) -> bool {
        self.max() > 0.0
    }

    /// The largest of the channels' numbers.
    pub fn max(self) -> f64 {
        self.0.into_iter().fold(0.0, f64::max)
    }
}

impl From<f64> for Spectrum {
    fn from(grey: f64) -> Self {
        Spectrum([grey; 3])
    }
}

impl Index<usize> for Spectrum {
    type Output = f64;

    fn index(&self, channel: usize) -> &f64 {
        &self.0[channel]
    }
}

/// One planar surface with its material.
///
/// ```
/// use glam::DVec3;
/// use radiosity::{Shape, Sides, SurfaceSpec};
///
/// let square = Shape::parallelogram(DVec3::ZERO, DVec3::X, DVec3::Y, [1, 1]);
/// let lamp = SurfaceSpec { sides: Sides::Both, ..SurfaceSpec::new(square, 0.5).emitting(10.0) };
/// assert_eq!(lamp.emittance.channels(), [10.0; 3]);
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SurfaceSpec {
    /// The name that outputs show; `None` shows the surface's number.
    pub name: Option<Arc<str>>,
    /// The outline of the surface and its cells.
    pub shape: Shape,
    /// The sides that reflect and emit.
    pub sides: Sides,
    /// Reflectance R, every channel in [0, 1).
    pub reflectance: Spectrum,
    /// Emittance E [W/m²] of every cell that `cell_emittance` does not name.
    pub emittance: Spectrum,
    /// (cell index within the surface, E [W/m²]).
    pub cell_emittance: Vec<(u32, Spectrum)>,
    /// Transmittance T, R + T below 1: what comes in on one side leaves the other with the cosine about its normal as density. By reciprocity it is the
    /// same for both sides. A job carries it behind all else, so that jobs from before stay readable.
    #[serde(skip)]
    pub transmittance: Spectrum,
}

impl SurfaceSpec {
    /// A surface of one reflectance, with one active side, that does not emit.
    pub fn new(shape: Shape, reflectance: impl Into<Spectrum>) -> Self {
        SurfaceSpec {
            name: None,
            shape,
            sides: Sides::Front,
            reflectance: reflectance.into(),
            emittance: Spectrum::BLACK,
            cell_emittance: Vec::new(),
            transmittance: Spectrum::BLACK,
        }
    }

    /// R + T, channel by channel: the probability that light goes on from the surface.
    pub fn passed_on(&self) -> Spectrum {
        Spectrum::rgb(std::array::from_fn(|c| self.reflectance[c] + self.transmittance[c]))
    }

    /// The surface with two sides that passes a part of the light on to the other side.
    pub fn transmitting(self, transmittance: impl Into<Spectrum>) -> Self {
        SurfaceSpec { transmittance: transmittance.into(), sides: Sides::Both, ..self }
    }

    /// The surface with an emittance [W/m²] on all of it.
    pub fn emitting(self, emittance: impl Into<Spectrum>) -> Self {
        SurfaceSpec { emittance: emittance.into(), ..self }
    }
}

/// What the six sides of a box that stands for the sky are called.
pub const SKY: &str = "sky";

/// A whole scene: surfaces in the order that numbers them. Right-handed coordinates, metres.
///
/// ```
/// use glam::DVec3;
/// use radiosity::{SceneSpec, Shape, SurfaceSpec};
///
/// let wall = |z, u, v| Shape::parallelogram(DVec3::new(0.0, 0.0, z), u, v, [2, 2]);
/// let floor = SurfaceSpec::new(wall(0.0, DVec3::X, DVec3::Y), 0.2);
/// let ceiling = SurfaceSpec::new(wall(3.0, DVec3::Y, DVec3::X), 0.8).emitting(100.0);
/// assert_eq!(SceneSpec::new(vec![floor, ceiling]).patch_count(), 8);
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SceneSpec {
    /// Surface number = index here.
    pub surfaces: Vec<SurfaceSpec>,
    /// The patch of every cell, in the order of surfaces and their cells, where patches are groups of cells: patches are numbered
    /// in the order of their first cells. Empty where every cell is a patch. A job carries these numbers behind all else, so that
    /// jobs from before there were groups stay readable.
    #[serde(skip)]
    pub patch_of_cell: Vec<u32>,
    /// Lamps without area. A job carries them behind all else, too.
    #[serde(skip)]
    pub lamps: LampsSpec,
    /// Panes that light crosses. A job carries them behind all else, too.
    #[serde(skip)]
    pub panes: Vec<PaneSpec>,
}

impl SceneSpec {
    /// A scene in which every cell is a patch.
    pub fn new(surfaces: Vec<SurfaceSpec>) -> Self {
        SceneSpec { surfaces, patch_of_cell: Vec::new(), lamps: LampsSpec::default(), panes: Vec::new() }
    }

    /// The scene whose patches are the groups of cells that have equal labels. There is a label for each cell, in the order of
    /// surfaces and their cells.
    pub fn grouped(self, labels: &[u32]) -> Self {
        let mut patches = 0;
        let mut is_next = |label: u32| {
            patches += u32::from(label == patches);
            label < patches
        };
        // Labels that are numbers of patches already are looked up nowhere.
        let patch_of_cell = match labels.iter().all(|&label| is_next(label)) {
            true => labels.to_vec(),
            false => numbered(labels),
        };
        let groups = patch_of_cell.iter().max().is_some_and(|&last| (last as usize) + 1 < labels.len());
        SceneSpec { patch_of_cell: if groups { patch_of_cell } else { Vec::new() }, ..self }
    }

    /// The number of cells.
    pub fn cell_count(&self) -> u64 {
        self.surfaces.iter().fold(0, |sum, surface| sum.saturating_add(surface.shape.cell_count()))
    }

    /// The number of patches.
    pub fn patch_count(&self) -> u64 {
        let of_groups = self.patch_of_cell.iter().max().map(|last| u64::from(*last) + 1);
        of_groups.unwrap_or_else(|| self.cell_count())
    }

    /// A furnace: a closed cube of 1 m in 6·n² patches, each of reflectance R and of emittance 1 − R W/m². Light is the same
    /// everywhere, B = E/(1 − R) = 1 W/m² exactly.
    pub fn furnace(n: u32, reflectance: f64) -> Self {
        let sides = (0..6).map(|side| {
            let (u, v) = (DVec3::AXES[(side + 1) % 3], DVec3::AXES[(side + 2) % 3]);
            let shape = match side < 3 {
                true => Shape::parallelogram(DVec3::ZERO, u, v, [n, n]),
                false => Shape::parallelogram(DVec3::ONE, -v, -u, [n, n]),
            };
            SurfaceSpec::new(shape, reflectance).emitting(1.0 - reflectance)
        });
        SceneSpec::new(sides.collect())
    }

    /// 1 where every reflectance and emittance is grey, else 3.
    pub fn channels(&self) -> usize {
        let grey = |surface: &SurfaceSpec| {
            let mut cells = surface.cell_emittance.iter();
            surface.reflectance.is_grey()
                && surface.transmittance.is_grey()
                && surface.emittance.is_grey()
                && cells.all(|(_, emittance)| emittance.is_grey())
        };
        let grey_lamps = self.lamps.list.iter().all(|lamp| lamp.strength.is_grey());
        if self.surfaces.iter().all(grey) && grey_lamps { 1 } else { 3 }
    }

    /// The grey scene that one channel sees.
    pub fn channel(&self, channel: usize) -> SceneSpec {
        let mut grey = self.clone();
        for surface in &mut grey.surfaces {
            let cells = surface.cell_emittance.iter_mut().map(|(_, emittance)| emittance);
            let whole = [&mut surface.reflectance, &mut surface.emittance, &mut surface.transmittance];
            for spectrum in whole.into_iter().chain(cells) {
                *spectrum = spectrum[channel].into();
            }
        }
        for lamp in &mut grey.lamps.list {
            lamp.strength = lamp.strength[channel].into();
        }
        grey
    }
}

/// The numbers of labels, in the order in which they first occur.
fn numbered(labels: &[u32]) -> Vec<u32> {
    let mut numbers = HashMap::new();
    let number = |&label: &u32| {
        let next = numbers.len() as u32;
        *numbers.entry(label).or_insert(next)
    };
    labels.iter().map(number).collect()
}

impl Shape {
    /// A parallelogram from a corner and the two edges there [m], its front on the side of u × v, in n_u × n_v cells.
    pub fn parallelogram(corner: DVec3, u: DVec3, v: DVec3, cells: [u32; 2]) -> Self {
        Shape::Parallelogram { corner, corner_u: corner + u, corner_v: corner + v, cells }
    }

    /// The number of patches the surface is cut into.
    pub fn cell_count(&self) -> u64 {
        match *self {
            Shape::Parallelogram { cells: [nu, nv], .. } => u64::from(nu) * u64::from(nv),
            Shape::Triangle { rows, .. } => u64::from(rows) * u64::from(rows),
            Shape::Divided { ref leaves, .. } => leaves.len() as u64,
        }
    }

    /// The index of the cell that is written as `[i, j]` (parallelogram: i_u, i_v; triangle: row, position; leaves: number, 0).
    /// `None` outside the surface.
    pub fn cell_index(&self, [i, j]: [u32; 2]) -> Option<u32> {
        match *self {
            Shape::Parallelogram { cells: [nu, nv], .. } => (i < nu && j < nv).then(|| i * nv + j),
            Shape::Triangle { rows, .. } => (i < rows && j <= 2 * i).then(|| i * i + j),
            Shape::Divided { ref leaves, .. } => ((i as usize) < leaves.len() && j == 0).then_some(i),
        }
    }

    /// The inverse of [`Shape::cell_index`].
    pub fn cell_label(&self, cell: u32) -> [u32; 2] {
        match *self {
            Shape::Parallelogram { cells: [_, nv], .. } => [cell / nv, cell % nv],
            Shape::Triangle { .. } => {
                let row = cell.isqrt();
                [row, cell - row * row]
            }
            Shape::Divided { .. } => [cell, 0],
        }
    }

    /// The corner that local coordinates start from, and the two edges from it [m].
    pub fn edges(&self) -> (DVec3, DVec3, DVec3) {
        match *self {
            Shape::Parallelogram { corner, corner_u, corner_v, .. }
            | Shape::Divided { corner, corner_u, corner_v, .. } => {
                (corner, corner_u - corner, corner_v - corner)
            }
            Shape::Triangle { a, b, c, .. } => (a, b - a, c - a),
        }
    }

    /// Every corner of the outline [m].
    pub fn corners(&self) -> Corners {
        match *self {
            Shape::Parallelogram { corner, corner_u, corner_v, .. }
            | Shape::Divided { corner, corner_u, corner_v, .. } => {
                Corners::from([corner, corner_u, corner_u + (corner_v - corner), corner_v])
            }
            Shape::Triangle { a, b, c, .. } => Corners::from_iter([a, b, c]),
        }
    }

    /// Area of the whole surface, one side [m²].
    pub fn area(&self) -> f64 {
        let (_, e_u, e_v) = self.edges();
        let cross = e_u.cross(e_v).length();
        match self {
            Shape::Parallelogram { .. } | Shape::Divided { .. } => cross,
            Shape::Triangle { .. } => 0.5 * cross,
        }
    }

    /// The area of a cell of a surface of this outline, of this `area` [m²].
    pub(crate) fn area_of_cell(&self, area: f64, cell: u32) -> f64 {
        match self {
            Shape::Divided { leaves, .. } => {
                let [nu, nv] = leaves.get(cell).grid();
                area / f64::from(nu * nv)
            }
            _ => area / self.cell_count() as f64,
        }
    }

    /// The shape with every corner moved; its cells stay.
    pub fn moved(&self, to: impl Fn(DVec3) -> DVec3) -> Self {
        let mut shape = self.clone();
        match &mut shape {
            Shape::Parallelogram { corner: a, corner_u: b, corner_v: c, .. }
            | Shape::Triangle { a, b, c, .. }
            | Shape::Divided { corner: a, corner_u: b, corner_v: c, .. } => {
                [a, b, c].into_iter().for_each(|corner| *corner = to(*corner));
            }
        }
        shape
    }
}
