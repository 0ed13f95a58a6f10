//! The sides of patches that exchange light. The sides of a two-sided patch are separate: what arrives on one leaves
//! from it.

use crate::scene::{Patch, Scene};
use crate::spec::Sides;
use crate::surface::Side;

/// One active side of a patch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Face {
    pub(crate) patch: u32,
    pub(crate) surface: u32,
    pub(crate) side: Side,
}

/// The faces of a scene: the fronts in patch order, then the backs of two-sided surfaces.
pub(crate) struct Faces<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) list: Vec<Face>,
    /// A [m²].
    pub(crate) areas: Vec<f64>,
    /// For each surface the face of its first cell's back; of no meaning where it has none.
    first_back: Vec<u32>,
}

impl<'a> Faces<'a> {
    pub(crate) fn new(scene: &'a Scene) -> Self {
        let patches = || (0_u32..).zip(scene.patches());
        let face =
            |(number, patch): (u32, &Patch), side| Face { patch: number, surface: patch.surface, side };
        let fronts = patches().map(|patch| face(patch, Side::Front));
        let backs =
            patches().filter(|(_, patch)| patch.sides == Sides::Both).map(|patch| face(patch, Side::Back));
        let list: Vec<Face> = fronts.chain(backs).collect();
        let mut first_back = vec![u32::MAX; scene.surfaces().len()];
        for (number, face) in (0..).zip(&list).skip(scene.patches().len()) {
            let first = &mut first_back[face.surface as usize];
            *first = number.min(*first);
        }
        let areas = list.iter().map(|face| scene.patches()[face.patch as usize].area).collect();
        Faces { scene, list, areas, first_back }
    }

    /// The patch of every face.
    pub(crate) fn patches(&self) -> impl Iterator<Item = &Patch> {
        self.list.iter().map(|face| &self.scene.patches()[face.patch as usize])
    }

    /// The face of a cell.
    #[inline(always)]
    pub(crate) fn at(&self, surface: u32, cell: u32, side: Side) -> u32 {
        let first = match side {
            Side::Front => self.scene.surfaces()[surface as usize].first_patch(),
            Side::Back => self.first_back[surface as usize],
        };
        first + cell
    }
}
