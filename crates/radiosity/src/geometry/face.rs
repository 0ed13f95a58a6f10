//! Faces, the unknowns of the radiosity system: the active sides of patches. They are made when they are asked for, so
//! that a scene of a million patches on six surfaces keeps six records.
//!
//! The face with the number of a patch is its front. The backs of two-sided patches follow the fronts, in patch order.
//! In scenes without two-sided surfaces faces and patches have the same numbers.

use glam::DVec3;

use crate::geometry::cells::{cell_centroid, cell_corners, corner_weights};
use crate::geometry::spec::Side;
use crate::geometry::spec::{SceneSpec, Shape, Sides, Spectrum};

/// One side of a patch. Nothing passes through a surface: light that arrives on one side leaves from it.
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
    /// Its centroid, in the coordinates of the file [m].
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
    /// Of a cell [m²].
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

/// The faces of a scene, by number.
#[derive(Clone, Debug)]
pub struct Faces {
    surfaces: Vec<Common>,
    /// Runs of backs, in the order of face numbers.
    backs: Vec<Backs>,
    /// Emittances of single patches, in ascending order.
    single: Vec<(u32, Spectrum)>,
    patches: usize,
    len: usize,
}

impl Faces {
    /// What the faces take of memory [bytes].
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&self.surfaces[..]) + size_of_val(&self.backs[..]) + size_of_val(&self.single[..])
    }

    /// The faces of a valid scene.
    pub(crate) fn new(spec: &SceneSpec) -> Self {
        let mut faces = Faces { surfaces: vec![], backs: vec![], single: vec![], patches: 0, len: 0 };
        for surface in &spec.surfaces {
            let cells = surface.shape.cell_count();
            let first = faces.patches as u32;
            faces.surfaces.push(Common {
                first,
                shape: surface.shape,
                area: surface.shape.area() / cells as f64,
                reflectance: surface.reflectance,
                emittance: surface.emittance,
            });
            let single = surface.cell_emittance.iter().map(|&(cell, emittance)| (first + cell, emittance));
            faces.single.extend(single);
            faces.patches += cells as usize;
        }
        faces.len = faces.patches;
        for (number, surface) in (0..).zip(&spec.surfaces).filter(|(_, s)| s.sides == Sides::Both) {
            faces.backs.push(Backs { first: faces.len as u32, surface: number });
            faces.len += surface.shape.cell_count() as usize;
        }
        // Of several for one cell the last one counts.
        faces.single.reverse();
        faces.single.sort_by_key(|&(patch, _)| patch);
        faces.single.dedup_by_key(|&mut (patch, _)| patch);
        faces
    }

    /// The outlines of the surfaces and their cells, in the order of the surfaces.
    pub fn shapes(&self) -> impl Iterator<Item = &Shape> {
        self.surfaces.iter().map(|surface| &surface.shape)
    }

    /// How many there are.
    #[expect(clippy::len_without_is_empty, reason = "no scene is without faces")]
    pub fn len(&self) -> usize {
        self.len
    }

    /// The number of patches.
    pub fn patch_count(&self) -> usize {
        self.patches
    }

    /// Whether some patch has two faces.
    pub fn two_sided(&self) -> bool {
        self.len > self.patches
    }

    /// Face number `i`.
    ///
    /// # Panics
    /// Where there is none.
    pub fn get(&self, i: usize) -> Face {
        assert!(i < self.len, "face {i} of {}", self.len);
        let (patch, side) = self.place(i as u32);
        let surface = self.surfaces.partition_point(|surface| surface.first <= patch) - 1;
        let common = &self.surfaces[surface];
        let cell = patch - common.first;
        let (corner, e_u, e_v) = common.shape.edges();
        let [u, v] = cell_centroid(&common.shape, cell);
        let single = self.single.binary_search_by_key(&patch, |&(patch, _)| patch);
        Face {
            patch,
            side,
            surface: surface as u32,
            cell: common.shape.cell_label(cell),
            centroid: corner + e_u * u + e_v * v,
            area: common.area,
            reflectance: common.reflectance,
            emittance: single.map_or(common.emittance, |i| self.single[i].1),
        }
    }

    /// The corners of face `i` in the coordinates of the file [m], counter-clockwise as seen from its own side: four of a
    /// parallelogram's cell, three of a triangle's.
    ///
    /// # Panics
    /// Where there is no such face.
    pub fn corners(&self, i: usize) -> Vec<DVec3> {
        let Face { patch, side, surface, .. } = self.get(i);
        let Common { first, shape, .. } = &self.surfaces[surface as usize];
        let (corner, e_u, e_v) = shape.edges();
        let point = |[u, v]: [f64; 2]| corner + e_u * u + e_v * v;
        let mut corners: Vec<DVec3> = cell_corners(shape, patch - first).into_iter().map(point).collect();
        if side == Side::Back {
            corners.reverse();
        }
        corners
    }

    /// The weights of the corners of face `i`, in the order of [`Faces::corners`], at local coordinates of its surface that
    /// lie in it: bilinear, or barycentric in triangles, whose fourth is 0.
    ///
    /// # Panics
    /// Where there is no such face.
    pub fn corner_weights(&self, i: usize, uv: [f64; 2]) -> [f64; 4] {
        let Face { patch, side, surface, .. } = self.get(i);
        let Common { first, shape, .. } = &self.surfaces[surface as usize];
        let mut weights = corner_weights(shape, patch - first, uv);
        if side == Side::Back {
            weights.reverse();
        }
        weights.resize(4, 0.0);
        weights.try_into().expect("four")
    }

    /// The patch and side of a face.
    fn place(&self, face: u32) -> (u32, Side) {
        let before = self.backs.partition_point(|backs| backs.first <= face);
        match before.checked_sub(1).map(|i| self.backs[i]) {
            None => (face, Side::Front),
            Some(backs) => (self.surfaces[backs.surface as usize].first + (face - backs.first), Side::Back),
        }
    }

    /// The number of the first face on one side of a surface; the others follow in cell order. `None` where the side is
    /// not active.
    pub fn first_on(&self, surface: u32, side: Side) -> Option<u32> {
        match side {
            Side::Front => Some(self.surfaces[surface as usize].first),
            Side::Back => {
                let found = self.backs.binary_search_by_key(&surface, |backs| backs.surface);
                found.ok().map(|i| self.backs[i].first)
            }
        }
    }

    /// The back of a patch; `None` where it has none.
    pub fn back_of(&self, patch: u32) -> Option<u32> {
        let surface = self.surfaces.partition_point(|surface| surface.first <= patch) - 1;
        let first = self.first_on(surface as u32, Side::Back)?;
        Some(first + (patch - self.surfaces[surface].first))
    }

    /// The numbers of the faces of a patch: its front and, where it has one, its back.
    pub fn of_patch(&self, patch: u32) -> impl Iterator<Item = u32> {
        std::iter::once(patch).chain(self.back_of(patch))
    }

    /// All of them in order.
    pub fn iter(&self) -> FaceIter<'_> {
        FaceIter { faces: self, range: 0..self.len }
    }

    /// The numbers of all faces, those of a patch next to each other, in patch order: how outputs list them.
    pub fn by_patch(&self) -> impl Iterator<Item = usize> {
        (0..self.patches as u32).flat_map(|patch| self.of_patch(patch)).map(|face| face as usize)
    }
}

impl<'a> IntoIterator for &'a Faces {
    type Item = Face;
    type IntoIter = FaceIter<'a>;

    fn into_iter(self) -> FaceIter<'a> {
        self.iter()
    }
}

/// An iterator over faces in the order of their numbers.
#[derive(Clone, Debug)]
pub struct FaceIter<'a> {
    faces: &'a Faces,
    range: std::ops::Range<usize>,
}

impl Iterator for FaceIter<'_> {
    type Item = Face;

    fn next(&mut self) -> Option<Face> {
        self.range.next().map(|i| self.faces.get(i))
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        self.range.size_hint()
    }
}

impl ExactSizeIterator for FaceIter<'_> {}
