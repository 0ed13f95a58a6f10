//! Faces, the unknowns of the radiosity system: the active sides of patches.
//!
//! The face with the number of a patch is its front. The backs of two-sided patches follow the fronts, in patch order.
//! In scenes without two-sided surfaces faces and patches have the same numbers. A face consists of one piece, whose number it has,
//! or, where patches are groups of cells, of the pieces that its partition gives it.

use super::partition::CellGroups;
pub use super::piece::Face;
use super::piece::Pieces;
use super::spec::{Corners, Shape, Side};

/// The faces of a scene, by number.
#[derive(Clone, Debug)]
pub struct Faces {
    pieces: Pieces,
    /// The groups of pieces; `None` where every piece is a face.
    partition: Option<CellGroups>,
}

impl Faces {
    /// What the faces take of memory [bytes].
    pub(crate) fn bytes(&self) -> usize {
        self.pieces.bytes() + self.partition.as_ref().map_or(0, CellGroups::bytes)
    }

    /// The faces of a valid scene that has these pieces.
    pub(crate) fn new(pieces: Pieces, patch_of_cell: &[u32]) -> Self {
        let groups = !patch_of_cell.is_empty();
        let partition = groups.then(|| CellGroups::new(&pieces, patch_of_cell));
        Faces { pieces, partition }
    }

    /// The outlines of the surfaces and their cells, in the order of the surfaces.
    pub fn shapes(&self) -> impl Iterator<Item = &Shape> {
        self.pieces.shapes()
    }

    /// How many there are.
    #[expect(clippy::len_without_is_empty, reason = "no scene is without faces")]
    pub fn len(&self) -> usize {
        self.partition.as_ref().map_or(self.pieces.len(), CellGroups::len)
    }

    /// The number of patches.
    pub fn patch_count(&self) -> usize {
        self.partition.as_ref().map_or(self.pieces.cell_count(), CellGroups::patch_count)
    }

    /// Whether some patch has two faces.
    pub fn two_sided(&self) -> bool {
        self.pieces.len() > self.pieces.cell_count()
    }

    /// Whether patches are groups of cells.
    pub fn are_grouped(&self) -> bool {
        self.partition.is_some()
    }

    /// The patch of every cell, in the order of surfaces and their cells; empty where every cell is a patch.
    pub fn patch_of_cell(&self) -> Vec<u32> {
        let cells = self.partition.iter().flat_map(|_| 0..self.pieces.cell_count() as u32);
        // The number of a cell is that of its front, and that of a front's face is its patch.
        cells.map(|cell| self.face_of(cell)).collect()
    }

    /// The groups, where patches are groups of cells.
    #[inline(always)]
    pub(crate) fn partition(&self) -> Option<&CellGroups> {
        self.partition.as_ref()
    }

    /// Face number `i`.
    ///
    /// # Panics
    /// Where there is none.
    pub fn get(&self, i: usize) -> Face {
        match &self.partition {
            None => self.pieces.get(i as u32),
            Some(partition) => partition.face(&self.pieces, i as u32),
        }
    }

    /// The number of pieces, the active sides of cells.
    pub fn piece_count(&self) -> usize {
        self.pieces.len()
    }

    /// The pieces of surfaces that emit somewhere, in ascending order.
    pub(crate) fn pieces_of_emitters(&self) -> impl Iterator<Item = u32> {
        self.pieces.of_emitters()
    }

    /// Whether a surface or some of its cells emit.
    pub(crate) fn may_emit(&self, surface: u32) -> bool {
        self.pieces.may_emit(surface as usize)
    }

    /// A piece as a face of its own: with its own cell, centroid and area, and the patch that it belongs to.
    ///
    /// # Panics
    /// Where there is none.
    pub fn piece(&self, piece: u32) -> Face {
        let own = self.pieces.get(piece);
        match &self.partition {
            None => own,
            // The number of a cell is that of its front, and that of a front's face is its patch.
            Some(partition) => Face { patch: partition.face_of(own.patch), ..own },
        }
    }

    /// The backs of cells in ascending order, each with the front of its cell.
    pub(crate) fn backs_of_cells(&self) -> impl Iterator<Item = (u32, u32)> {
        self.pieces.backs()
    }

    /// The face that a piece belongs to.
    #[inline(always)]
    pub fn face_of(&self, piece: u32) -> u32 {
        self.partition.as_ref().map_or(piece, |partition| partition.face_of(piece))
    }

    /// The pieces of face `i`, in ascending order.
    pub fn pieces(&self, i: usize) -> impl Iterator<Item = u32> {
        let (alone, group) = match &self.partition {
            None => (Some(i as u32), &[][..]),
            Some(partition) => (None, partition.pieces(i as u32)),
        };
        alone.into_iter().chain(group.iter().copied())
    }

    /// Whether rays from face `i` may meet it, since it lies on several surfaces.
    pub fn may_see_itself(&self, i: usize) -> bool {
        self.partition.as_ref().is_some_and(|partition| partition.may_see_itself(i as u32))
    }

    /// The corners of a piece in the coordinates of the file [m], counter-clockwise as seen from its own side: four of a
    /// parallelogram's cell, three of a triangle's.
    ///
    /// # Panics
    /// Where there is no such piece.
    pub fn piece_corners(&self, piece: u32) -> Corners {
        self.pieces.corners(piece)
    }

    /// Whether a piece is a triangle, which has three corners; all others have four.
    pub fn is_triangle(&self, piece: u32) -> bool {
        self.pieces.is_triangle(piece)
    }

    /// The corners of a piece in the local coordinates of its surface, in the order of its front's.
    pub(crate) fn corners_on_surface(&self, piece: u32) -> Corners<[f64; 2]> {
        self.pieces.corners_on_surface(piece)
    }

    /// The weights of the corners of a piece, in the order of [`Faces::piece_corners`], at local coordinates of its surface that
    /// lie in it: bilinear, or barycentric in triangles, whose fourth is 0.
    ///
    /// # Panics
    /// Where there is no such piece.
    pub fn corner_weights(&self, piece: u32, uv: [f64; 2]) -> [f64; 4] {
        self.pieces.corner_weights(piece, uv)
    }

    /// The number of the first piece on one side of a surface; the others follow in cell order. `None` where the side is
    /// not active.
    pub fn first_piece_on(&self, surface: u32, side: Side) -> Option<u32> {
        self.pieces.first_on(surface, side)
    }

    /// The back of a patch; `None` where it has none.
    pub fn back_of(&self, patch: u32) -> Option<u32> {
        match &self.partition {
            None => self.pieces.back_of(patch),
            Some(partition) => partition.back_of(patch),
        }
    }

    /// The numbers of the faces of a patch: its front and, where it has one, its back.
    pub fn of_patch(&self, patch: u32) -> impl Iterator<Item = u32> {
        std::iter::once(patch).chain(self.back_of(patch))
    }

    /// All of them in order.
    pub fn iter(&self) -> FaceIter<'_> {
        FaceIter { faces: self, range: 0..self.len() }
    }

    /// The numbers of all faces, those of a patch next to each other, in patch order: how outputs list them.
    pub fn by_patch(&self) -> impl Iterator<Item = usize> {
        (0..self.patch_count() as u32).flat_map(|patch| self.of_patch(patch)).map(|face| face as usize)
    }

    /// The faces in the order of outputs, each with its pieces one by one: (face, piece).
    pub fn pieces_by_patch(&self) -> impl Iterator<Item = (usize, u32)> {
        self.by_patch().flat_map(|face| self.pieces(face).map(move |piece| (face, piece)))
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
