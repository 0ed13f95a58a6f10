//! The order of surfaces that coincide, as rays need it.

use crate::simd::real::Real;
use crate::simd::table::Table;
use crate::trace::ray::Ray;
use crate::trace::stack::Stack;

/// Which plane a surface is in, and its place there. Of surfaces at the same t a ray meets that of the least *rank*:
/// in one plane ranks follow the layers, and over all surfaces they are a permutation of the numbers for rays of either
/// direction, so that there is one order, whatever planes meet at an edge.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Layer {
    /// The least surface of the plane, its own number where it is alone.
    plane: u32,
    /// 1 where its front is on the side of the plane's normal, else −1.
    facing: f64,
    /// For rays that meet its front, its back.
    ranks: [u32; 2],
}

/// The layers of all surfaces of a scene in which some coincide.
#[derive(Clone, Debug)]
pub(crate) struct Layers {
    table: Table<8>,
}

impl Layers {
    /// What the layers take of memory [bytes].
    pub(crate) fn bytes(&self) -> usize {
        self.table.bytes()
    }

    /// `None` where no surfaces coincide. `facing` says whether the front of a surface is on the side of a stack's normal.
    pub(crate) fn new(count: usize, stacks: &[Stack], facing: impl Fn(u32, &Stack) -> bool) -> Option<Self> {
        if stacks.is_empty() {
            return None;
        }
        let alone = |plane| Layer { plane, facing: 1.0, ranks: [plane; 2] };
        let mut layers: Vec<Layer> = (0..count as u32).map(alone).collect();
        for stack in stacks {
            let mut numbers = stack.surfaces.clone();
            numbers.sort_unstable();
            let ranks = numbers.iter().zip(numbers.iter().rev());
            for (&surface, (&downwards, &upwards)) in stack.surfaces.iter().zip(ranks) {
                let (facing, ranks) = match facing(surface, stack) {
                    true => (1.0, [downwards, upwards]),
                    false => (-1.0, [upwards, downwards]),
                };
                layers[surface as usize] = Layer { plane: numbers[0], facing, ranks };
            }
        }
        let row = |layer: &Layer| {
            let [front, back] = layer.ranks.map(f64::from);
            [f64::from(layer.plane), layer.facing, front, back, 0.0, 0.0, 0.0, 0.0]
        };
        Some(Layers { table: Table::new(layers.iter().map(row).collect()) })
    }

    /// The least surface in the plane of a surface, itself where it is alone; [`Ray::FREE`] where it is none.
    #[inline(always)]
    pub(crate) fn plane(&self, surface: u32) -> u32 {
        if surface == Ray::FREE { surface } else { self.table.row(surface)[0] as u32 }
    }

    /// The layer of a surface will soon be asked for.
    #[inline(always)]
    pub(crate) fn expect(&self, surface: u32) {
        self.table.expect(&[surface]);
    }

    /// The layers of the surfaces that N rays have to do with; none of their own where that is [`Ray::FREE`].
    #[inline(always)]
    pub(crate) fn lanes<R: Real>(&self, surfaces: &[u32]) -> LayerLanes<R> {
        let [plane, facing, front, back, ..] = R::rows(&self.table, surfaces);
        let free = R::splat(f64::from(Ray::FREE));
        let plane = R::select(R::load_u32(surfaces).ne(free), plane, R::splat(-1.0));
        LayerLanes { plane, facing, ranks: [front, back] }
    }
}

/// The layers of N surfaces.
#[derive(Clone, Copy)]
pub(crate) struct LayerLanes<R> {
    pub(crate) plane: R,
    pub(crate) facing: R,
    pub(crate) ranks: [R; 2],
}
