//! Pieces: the active sides of cells. They are made when they are asked for, so that a scene of a million cells on six
//! surfaces keeps six records.
//!
//! The piece with the number of a cell is its front. The backs of two-sided cells follow the fronts, in cell order.

use glam::DVec3;

use crate::geometry::cells::{cell_centroid, cell_corners, corner_weights};
use crate::geometry::spec::{Corners, SceneSpec, Shape, Side, Sides, Spectrum};

/// One side of a patch. Nothing passes through a surface: light that arrives on one side leaves from it. Of a group of cells,
/// surface and cell are those of its first cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Face {
    /// The number of the patch.
    pub patch: u32,
    /// Which side of the patch it is.
    pub side: Side,
    /// The surface that the patch is a cell of.
    pub surface: u32,
    /// The cell's label on that surface (parallelogram: i_u, i_v; triangle: row, position).
    pub cell: [u32; 2],
    /// The centroid of the cell, in the coordinates of the file [m].
    pub centroid: DVec3,
    /// A: the area of one side [m²].
    pub area: f64,
    /// R: the reflectance, per channel.
    pub reflectance: Spectrum,
    /// E: the emittance of one side [W/m²], per channel.
    pub emittance: Spectrum,
}

impl Face {
    /// Φ: self-emitted power in one channel [W].
    pub fn power(&self, channel: usize) -> f64 {
        self.area * self.emittance[channel]
    }
}

/// What the cells of a surface have in common.
#[derive(Clone, Debug)]
struct Common {
    /// The number of the first front, which is that of the first patch.
    first: u32,
    shape: Shape,
    /// The area of the surface [m²].
    area: f64,
    reflectance: Spectrum,
    emittance: Spectrum,
}

/// The backs of the cells of a two-sided surface.
#[derive(Clone, Copy, Debug)]
struct Backs {
    /// The number of the first one.
    first: u32,
    surface: u32,
}

/// Runs of consecutive numbers, found by a number in them.
#[derive(Clone, Debug)]
struct Runs {
    /// The first number of each run, in ascending order.
    firsts: Vec<u32>,
    /// By number in steps of 2^`shift`, the run that holds it: searches begin there. There are no more steps than runs.
    guide: Vec<u32>,
    shift: u32,
}

impl Runs {
    /// Runs that begin so and end before a number.
    fn new(firsts: Vec<u32>, end: u32) -> Self {
        let Some(&begin) = firsts.first() else { return Runs { firsts, guide: Vec::new(), shift: 0 } };
        let mut shift = 0;
        while (end - begin) as usize >> shift > firsts.len() {
            shift += 1;
        }
        let mut run = 0;
        let guide = (0..=(end - begin) >> shift).map(|step| {
            while firsts.get(run + 1).is_some_and(|&first| first - begin <= step << shift) {
                run += 1;
            }
            run as u32
        });
        Runs { guide: guide.collect(), firsts, shift }
    }

    /// The run of a number; `None` where it is before all of them.
    #[inline(always)]
    fn of(&self, number: u32) -> Option<usize> {
        let step = (number.checked_sub(*self.firsts.first()?)? >> self.shift) as usize;
        let low = self.guide[step] as usize;
        let high = self.guide.get(step + 1).map_or(self.firsts.len(), |&run| run as usize + 1);
        Some(low + self.firsts[low..high].partition_point(|&first| first <= number) - 1)
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.firsts[..]) + size_of_val(&self.guide[..])
    }
}

/// The pieces of a scene, by number.
#[derive(Clone, Debug)]
pub(crate) struct Pieces {
    surfaces: Vec<Common>,
    /// The fronts of each surface.
    fronts: Runs,
    /// The backs of each of `backs`.
    behind: Runs,
    /// Runs of backs, in the order of their numbers.
    backs: Vec<Backs>,
    /// Emittances of single cells, in ascending order.
    single: Vec<(u32, Spectrum)>,
    cells: usize,
    len: usize,
}

impl Pieces {
    /// The outlines of the surfaces and their cells, in the order of the surfaces.
    pub(crate) fn shapes(&self) -> impl Iterator<Item = &Shape> {
        self.surfaces.iter().map(|surface| &surface.shape)
    }

    /// What the pieces take of memory [bytes].
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.surfaces[..])
            + self.fronts.bytes()
            + self.behind.bytes()
            + size_of_val(&self.backs[..])
            + size_of_val(&self.single[..])
    }

    /// The pieces of a valid scene.
    pub(crate) fn new(spec: &SceneSpec) -> Self {
        let [fronts, behind] = [(); 2].map(|()| Runs::new(Vec::new(), 0));
        let surfaces = Vec::with_capacity(spec.surfaces.len());
        let mut pieces = Pieces { surfaces, fronts, behind, backs: vec![], single: vec![], cells: 0, len: 0 };
        for surface in &spec.surfaces {
            let cells = surface.shape.cell_count();
            let first = pieces.cells as u32;
            pieces.surfaces.push(Common {
                first,
                shape: surface.shape.clone(),
                area: surface.shape.area(),
                reflectance: surface.reflectance,
                emittance: surface.emittance,
            });
            let single = surface.cell_emittance.iter().map(|&(cell, emittance)| (first + cell, emittance));
            pieces.single.extend(single);
            pieces.cells += cells as usize;
        }
        let firsts = pieces.surfaces.iter().map(|surface| surface.first).collect();
        pieces.fronts = Runs::new(firsts, pieces.cells as u32);
        pieces.len = pieces.cells;
        for (number, surface) in (0..).zip(&spec.surfaces).filter(|(_, s)| s.sides == Sides::Both) {
            pieces.backs.push(Backs { first: pieces.len as u32, surface: number });
            pieces.len += surface.shape.cell_count() as usize;
        }
        let firsts = pieces.backs.iter().map(|backs| backs.first).collect();
        pieces.behind = Runs::new(firsts, pieces.len as u32);
        // Of several for one cell the last one counts.
        pieces.single.reverse();
        pieces.single.sort_by_key(|&(cell, _)| cell);
        pieces.single.dedup_by_key(|&mut (cell, _)| cell);
        pieces
    }

    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// The number of cells.
    pub(crate) fn cell_count(&self) -> usize {
        self.cells
    }

    /// The pieces of surfaces that emit somewhere, in ascending order.
    pub(super) fn of_emitters(&self) -> impl Iterator<Item = u32> {
        let fronts = (0..self.surfaces.len()).map(|surface| (surface, self.surfaces[surface].first));
        let backs = self.backs.iter().map(|backs| (backs.surface as usize, backs.first));
        let runs = fronts.chain(backs).filter(|&(surface, _)| self.may_emit(surface));
        runs.flat_map(|(surface, first)| first..first + self.surfaces[surface].shape.cell_count() as u32)
    }

    /// Whether a surface or some of its cells emit.
    pub(super) fn may_emit(&self, surface: usize) -> bool {
        let Common { first, shape, emittance, .. } = &self.surfaces[surface];
        let single = self.single.partition_point(|(cell, _)| cell < first);
        let next = self.single.get(single).map(|&(cell, _)| u64::from(cell - first));
        emittance.is_lit() || next.is_some_and(|offset| offset < shape.cell_count())
    }

    /// By cell, the number of its surface.
    pub(crate) fn surfaces_of_cells(&self) -> Vec<u32> {
        let of_surface = |(number, common): (u32, &Common)| {
            std::iter::repeat_n(number, common.shape.cell_count() as usize)
        };
        (0..).zip(&self.surfaces).flat_map(of_surface).collect()
    }

    /// Piece number `i`, as the face that it is where every cell is a patch.
    ///
    /// # Panics
    /// Where there is none.
    pub(crate) fn get(&self, i: u32) -> Face {
        assert!((i as usize) < self.len, "piece {i} of {}", self.len);
        let (number, side) = self.cell_of(i);
        let surface = self.surface_of(number);
        let common = &self.surfaces[surface];
        let (area, centroid) = self.middle(number, surface);
        Face {
            patch: number,
            side,
            surface: surface as u32,
            cell: common.shape.cell_label(number - common.first),
            centroid,
            area,
            reflectance: common.reflectance,
            emittance: self.emittance(number, surface),
        }
    }

    /// The area of a cell of a surface [m²], and its centroid [m].
    pub(super) fn middle(&self, cell: u32, surface: usize) -> (f64, DVec3) {
        let Common { first, shape, area, .. } = &self.surfaces[surface];
        let (corner, e_u, e_v) = shape.edges();
        let [u, v] = cell_centroid(shape, cell - first);
        (shape.area_of_cell(*area, cell - first), corner + e_u * u + e_v * v)
    }

    /// The emittance of a cell of a surface.
    pub(crate) fn emittance(&self, cell: u32, surface: usize) -> Spectrum {
        let single = self.single.binary_search_by_key(&cell, |&(cell, _)| cell);
        single.map_or(self.surfaces[surface].emittance, |i| self.single[i].1)
    }

    /// The corners of a piece in the coordinates of the file [m], counter-clockwise as seen from its own side: four of a
    /// parallelogram's cell, three of a triangle's.
    pub(super) fn corners(&self, i: u32) -> Corners {
        let (shape, cell, side) = self.shape_of(i);
        let mut corners = shape.cell_corners(cell);
        if side == Side::Back {
            corners.reverse();
        }
        corners
    }

    /// The corners of a piece in the local coordinates of its surface, in the order of its front's.
    pub(super) fn corners_on_surface(&self, i: u32) -> Corners<[f64; 2]> {
        let (shape, cell, _) = self.shape_of(i);
        cell_corners(shape, cell)
    }

    /// The weights of the corners of a piece, in the order of [`Pieces::corners`], at local coordinates of its surface that
    /// lie in it: bilinear, or barycentric in triangles, whose fourth is 0.
    pub(super) fn corner_weights(&self, i: u32, uv: [f64; 2]) -> [f64; 4] {
        let (shape, cell, side) = self.shape_of(i);
        let mut weights = corner_weights(shape, cell, uv);
        if side == Side::Back {
            let corners = if matches!(shape, Shape::Triangle { .. }) { 3 } else { 4 };
            weights[..corners].reverse();
        }
        weights
    }

    /// Whether a piece is a triangle.
    pub(super) fn is_triangle(&self, i: u32) -> bool {
        matches!(self.shape_of(i).0, Shape::Triangle { .. })
    }

    /// The surface of a piece, the cell on it, and the side.
    fn shape_of(&self, i: u32) -> (&Shape, u32, Side) {
        let (cell, side) = self.cell_of(i);
        let Common { first, shape, .. } = &self.surfaces[self.surface_of(cell)];
        (shape, cell - first, side)
    }

    /// The surface that a cell lies on.
    pub(super) fn surface_of(&self, cell: u32) -> usize {
        self.fronts.of(cell).expect("the first surface has the first cell")
    }

    /// The cell of a piece, counted through all surfaces, and the side of it.
    pub(crate) fn cell_of(&self, piece: u32) -> (u32, Side) {
        match self.behind.of(piece).map(|run| self.backs[run]) {
            None => (piece, Side::Front),
            Some(backs) => (self.surfaces[backs.surface as usize].first + (piece - backs.first), Side::Back),
        }
    }

    /// The backs of cells in ascending order, each with its cell, whose number is that of its front.
    pub(super) fn backs(&self) -> impl Iterator<Item = (u32, u32)> {
        self.backs.iter().flat_map(|backs| {
            let Common { first, shape, .. } = &self.surfaces[backs.surface as usize];
            (0..shape.cell_count() as u32).map(move |cell| (backs.first + cell, first + cell))
        })
    }

    /// The number of the first piece on one side of a surface; the others follow in cell order. `None` where the side is
    /// not active.
    pub(super) fn first_on(&self, surface: u32, side: Side) -> Option<u32> {
        match side {
            Side::Front => Some(self.surfaces[surface as usize].first),
            Side::Back => {
                let found = self.backs.binary_search_by_key(&surface, |backs| backs.surface);
                found.ok().map(|i| self.backs[i].first)
            }
        }
    }

    /// The back of a cell; `None` where it has none.
    pub(super) fn back_of(&self, cell: u32) -> Option<u32> {
        let surface = self.surface_of(cell);
        let first = self.first_on(surface as u32, Side::Back)?;
        Some(first + (cell - self.surfaces[surface].first))
    }
}
