//! Patches that are groups of cells.
//!
//! A *piece* is one active side of a cell. Pieces are numbered as faces are where every cell is a patch: the fronts of all cells,
//! then the backs of two-sided ones. A partition says which face each piece belongs to. Patches are numbered in the order of
//! their first cells, and the backs of two-sided patches follow the fronts, in patch order.

use glam::DVec3;

use super::piece::{Face, Pieces};
use super::spec::Side;

/// The groups of a scene.
#[derive(Clone, Debug)]
pub(crate) struct Partition {
    face_of_piece: Vec<u32>,
    /// The pieces of all faces, face by face.
    pieces: Vec<u32>,
    /// Where the pieces of each face begin; their number last.
    first: Vec<u32>,
    /// The patches with backs, in ascending order.
    backs: Vec<u32>,
    /// The area of each patch [m²], and its centroid [m].
    middles: Vec<(f64, DVec3)>,
    /// Whether the pieces of each face lie on several surfaces.
    on_several: Vec<bool>,
}

impl Partition {
    /// What the partition takes of memory [bytes].
    pub(crate) fn bytes(&self) -> usize {
        let numbers = [&self.face_of_piece, &self.pieces, &self.first, &self.backs];
        numbers.iter().map(|numbers| size_of_val(&numbers[..])).sum::<usize>()
            + size_of_val(&self.middles[..])
            + size_of_val(&self.on_several[..])
    }

    /// The groups of the pieces of a valid scene.
    pub(super) fn new(cells: &Pieces, patch_of_cell: &[u32]) -> Self {
        let piece_count = cells.len();
        let patches = patch_of_cell.iter().max().map_or(0, |last| *last as usize + 1);
        let patch_of = |piece: u32| patch_of_cell[cells.cell_of(piece).0 as usize];
        let of_backs = (patch_of_cell.len() as u32..piece_count as u32).map(patch_of);
        let mut backs: Vec<u32> = of_backs.collect();
        backs.sort_unstable();
        backs.dedup();
        let face = |piece: u32| match cells.cell_of(piece).1 {
            Side::Front => patch_of(piece),
            Side::Back => {
                let place = backs.binary_search(&patch_of(piece)).expect("the back of a patch with backs");
                (patches + place) as u32
            }
        };
        let face_of_piece: Vec<u32> = (0..piece_count as u32).map(face).collect();
        let mut pieces: Vec<u32> = (0..piece_count as u32).collect();
        pieces.sort_by_key(|&piece| face_of_piece[piece as usize]);
        let mut first = vec![0; patches + backs.len() + 1];
        face_of_piece.iter().for_each(|&face| first[face as usize + 1] += 1);
        (1..first.len()).for_each(|face| first[face] += first[face - 1]);
        let (middles, on_several) = (Vec::new(), Vec::new());
        let mut partition = Partition { face_of_piece, pieces, first, backs, middles, on_several };
        let surfaces = cells.surfaces_of_cells();
        let surface = |piece: u32| surfaces[cells.cell_of(piece).0 as usize];
        let is_on_several = |face: u32| {
            let pieces = partition.pieces(face);
            pieces.iter().any(|&piece| surface(piece) != surface(pieces[0]))
        };
        partition.on_several = (0..partition.len() as u32).map(is_on_several).collect();
        partition.middles = (0..patches as u32).map(|patch| middle(cells, partition.pieces(patch))).collect();
        partition
    }

    pub(super) fn len(&self) -> usize {
        self.first.len() - 1
    }

    pub(super) fn patch_count(&self) -> usize {
        self.middles.len()
    }

    /// The face of a piece; of any other number, 0.
    #[inline(always)]
    pub(crate) fn face_of(&self, piece: u32) -> u32 {
        self.face_of_piece.get(piece as usize).copied().unwrap_or(0)
    }

    /// The pieces of a face, in ascending order.
    pub(crate) fn pieces(&self, face: u32) -> &[u32] {
        &self.pieces[self.first[face as usize] as usize..self.first[face as usize + 1] as usize]
    }

    /// The back of a patch; `None` where it has none.
    pub(super) fn back_of(&self, patch: u32) -> Option<u32> {
        self.backs.binary_search(&patch).ok().map(|place| (self.patch_count() + place) as u32)
    }

    /// The patch of a face.
    fn patch_of(&self, face: u32) -> u32 {
        match (face as usize).checked_sub(self.patch_count()) {
            None => face,
            Some(place) => self.backs[place],
        }
    }

    /// A face with the surface and the label of its first piece.
    pub(super) fn face(&self, cells: &Pieces, face: u32) -> Face {
        let first = cells.get(self.pieces(face)[0]);
        let patch = self.patch_of(face);
        let (area, centroid) = self.middles[patch as usize];
        Face { patch, area, centroid, ..first }
    }

    /// Whether rays from a face may meet it: whether its pieces lie on several surfaces.
    pub(super) fn may_see_itself(&self, face: u32) -> bool {
        self.on_several[face as usize]
    }
}

/// The area of pieces, and their centroid. Those of a single piece are its own, to the last bit.
fn middle(cells: &Pieces, pieces: &[u32]) -> (f64, DVec3) {
    let members: Vec<Face> = pieces.iter().map(|&piece| cells.get(piece)).collect();
    let area: f64 = members.iter().map(|piece| piece.area).sum();
    match &members[..] {
        [piece] => (area, piece.centroid),
        _ => (area, members.iter().map(|piece| piece.centroid * (piece.area / area)).sum()),
    }
}
