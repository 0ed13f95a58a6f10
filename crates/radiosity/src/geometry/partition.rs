//! Patches that are groups of cells.
//!
//! A *piece* is one active side of a cell. Pieces are numbered as faces are where every cell is a patch: the fronts of all cells,
//! then the backs of two-sided ones. A partition says which face each piece belongs to. Patches are numbered in the order of
//! their first cells, and the backs of two-sided patches follow the fronts, in patch order.

use glam::DVec3;

use super::piece::{Face, Pieces};

/// The groups of a scene.
#[derive(Clone, Debug)]
pub(crate) struct CellGroups {
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

impl CellGroups {
    /// What the partition takes of memory [bytes].
    pub(crate) fn bytes(&self) -> usize {
        let numbers = [&self.face_of_piece, &self.pieces, &self.first, &self.backs];
        numbers.iter().map(|numbers| size_of_val(&numbers[..])).sum::<usize>()
            + size_of_val(&self.middles[..])
            + size_of_val(&self.on_several[..])
    }

    /// The groups of the pieces of a valid scene.
    pub(super) fn new(cells: &Pieces, patch_of_cell: &[u32]) -> Self {
        let patches = patch_of_cell.iter().max().map_or(0, |last| *last as usize + 1);
        let mut has_back = vec![false; patches];
        let cells_of_backs: Vec<u32> = cells.backs().map(|(_, cell)| cell).collect();
        cells_of_backs.iter().for_each(|&cell| has_back[patch_of_cell[cell as usize] as usize] = true);
        let backs: Vec<u32> = (0..patches as u32).filter(|&patch| has_back[patch as usize]).collect();
        let mut back_of = vec![0; patches];
        (patches as u32..).zip(&backs).for_each(|(face, &patch)| back_of[patch as usize] = face);
        let of_backs = cells_of_backs.iter().map(|&cell| back_of[patch_of_cell[cell as usize] as usize]);
        let face_of_piece: Vec<u32> = patch_of_cell.iter().copied().chain(of_backs).collect();
        let (pieces, first) = by_face(&face_of_piece, patches + backs.len());
        let (middles, on_several) = (Vec::new(), Vec::new());
        let mut partition = CellGroups { face_of_piece, pieces, first, backs, middles, on_several };
        let surfaces = cells.surfaces_of_cells();
        let surface = |piece: u32| match (piece as usize).checked_sub(patch_of_cell.len()) {
            None => surfaces[piece as usize],
            Some(back) => surfaces[cells_of_backs[back] as usize],
        };
        let is_on_several = |face: u32| {
            let pieces = partition.pieces(face);
            pieces.iter().any(|&piece| surface(piece) != surface(pieces[0]))
        };
        partition.on_several = (0..partition.len() as u32).map(is_on_several).collect();
        let mut members = Vec::new();
        let middle = |patch: u32| {
            // The number of a cell is that of its front.
            let own = partition.pieces(patch).iter();
            members.clear();
            members.extend(own.map(|&cell| cells.middle(cell, surfaces[cell as usize] as usize)));
            middle(&members)
        };
        partition.middles = (0..patches as u32).map(middle).collect();
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

/// The pieces of all faces, face by face and in ascending order, and where those of each face begin; their number last.
fn by_face(face_of_piece: &[u32], faces: usize) -> (Vec<u32>, Vec<u32>) {
    let mut first = vec![0; faces + 1];
    face_of_piece.iter().for_each(|&face| first[face as usize + 1] += 1);
    (1..first.len()).for_each(|face| first[face] += first[face - 1]);
    let (mut next, mut pieces) = (first.clone(), vec![0; face_of_piece.len()]);
    for (piece, &face) in (0..).zip(face_of_piece) {
        let place = &mut next[face as usize];
        pieces[*place as usize] = piece;
        *place += 1;
    }
    (pieces, first)
}

/// The area of cells, and their centroid. Those of a single cell are its own, to the last bit.
fn middle(members: &[(f64, DVec3)]) -> (f64, DVec3) {
    let area: f64 = members.iter().map(|(area, _)| area).sum();
    match members {
        [(_, centroid)] => (area, *centroid),
        _ => (area, members.iter().map(|(own, centroid)| centroid * (own / area)).sum()),
    }
}
