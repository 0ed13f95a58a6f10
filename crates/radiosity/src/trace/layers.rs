//! The order of surfaces that coincide, as rays need it.

use crate::geometry::spec::Side;
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

    /// `None` where no surfaces coincide. `facing` tells of a surface whether its front is on the side of a stack's normal.
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

    fn get(&self, surface: u32) -> Layer {
        let [plane, facing, front, back, ..] = *self.table.row(surface);
        Layer { plane: plane as u32, facing, ranks: [front as u32, back as u32] }
    }

    /// The least surface in the plane of a surface, itself where it is alone; [`Ray::FREE`] where it is none.
    #[inline(always)]
    pub(crate) fn plane(&self, surface: u32) -> u32 {
        if surface == Ray::FREE { surface } else { self.table.row(surface)[0] as u32 }
    }

    /// The rank of a surface for rays that meet it on a side.
    pub(crate) fn rank(&self, surface: u32, side: Side) -> u32 {
        self.get(surface).rank(side)
    }

    /// The relation of a surface that a ray would meet on `side` to the one it leaves.
    pub(crate) fn relation(&self, surface: u32, side: Side, ray: &Ray) -> Relation {
        if ray.from == Ray::FREE {
            return Relation::Apart;
        }
        let (layer, from) = (self.get(surface), self.get(ray.from));
        if layer.plane != from.plane {
            return Relation::Apart;
        }
        // The side of `from` that rays of this direction meet: not the one that this ray leaves.
        let from_side = if layer.facing == from.facing { side } else { side.other() };
        if layer.rank(side) > from.rank(from_side) { Relation::InFront } else { Relation::Behind }
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

impl Layer {
    fn rank(&self, side: Side) -> u32 {
        self.ranks[usize::from(side == Side::Back)]
    }
}

/// Where a surface is, seen from the one that a ray leaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Relation {
    /// In another plane.
    Apart,
    /// A layer of the same plane that the ray has passed, or that it leaves.
    Behind,
    /// A layer of the same plane that the ray meets at once.
    InFront,
}

/// The layers of N surfaces.
#[derive(Clone, Copy)]
pub(crate) struct LayerLanes<R> {
    pub(crate) plane: R,
    pub(crate) facing: R,
    pub(crate) ranks: [R; 2],
}
