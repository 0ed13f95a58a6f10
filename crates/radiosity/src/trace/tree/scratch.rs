//! What a wavefront keeps of its rays.

use super::layout::{Item, LEVELS, Line, Tree};
use crate::simd::batch::WIDTH;
use crate::simd::sixteen::{GROUP, GROUPS, LANES, NO_KEY, Quad, Row, Sixteen, lane_of};
use crate::trace::ray::{Hits, Rays};

/// Rays under way at once. More hide more latency, until they do not fit the first-level cache.
pub(super) const ACTIVE: usize = 32;

/// Candidates that a ray can hold: a row of them, and what one leaf may add.
pub(super) const CANDIDATES: usize = LANES + GROUP;

/// Half the distance from 1 to the next f32: the largest relative error of one operation.
pub(super) const ROUNDING: f32 = 0.5 * f32::EPSILON;

/// A batch of rays as the tree sees them, in tree coordinates.
#[derive(Clone, Debug)]
pub(super) struct Forms {
    pub(super) origin: [[f32; WIDTH]; 3],
    pub(super) direction: [[f32; WIDTH]; 3],
    pub(super) inverse: [[f32; WIDTH]; 3],
    /// Offsets of the planes by which the ray enters a box and leaves it: t = plane · inverse − offset, as early or as
    /// late as rounding could make it.
    pub(super) enter: [[f32; WIDTH]; 3],
    pub(super) leave: [[f32; WIDTH]; 3],
    /// Whether it enters by the upper plane.
    pub(super) downwards: [[bool; WIDTH]; 3],
    /// The part of the uncertainty of t, times |n·d|, that does not grow with t.
    pub(super) uncertainty: [f32; WIDTH],
}

/// A ray under way as nodes see it: a cache line, with the fields of [`Forms`].
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(64))]
pub(super) struct Gate {
    pub(super) inverse: [f32; 3],
    pub(super) enter: [f32; 3],
    pub(super) leave: [f32; 3],
    pub(super) downwards: [bool; 3],
}

/// A ray under way as leaves see it: a cache line.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(64))]
pub(super) struct Flight {
    /// The origin, and the uncertainty of [`Forms`].
    pub(super) start: Quad,
    /// The direction, and a parameter that the nearest hit cannot exceed.
    pub(super) way: Quad,
    /// The bits of the surface that it leaves, four times.
    pub(super) from: Quad,
}

impl Flight {
    pub(super) const UNCERTAINTY: usize = 3;
    pub(super) const BEST: usize = 3;

    #[inline(always)]
    pub(super) fn best(&self) -> f32 {
        self.way[Self::BEST]
    }
}

impl Forms {
    /// Prepares a batch.
    ///
    /// With e = [`ROUNDING`], O the origin, d the direction (|d| ≤ 1) and m a plane of a box, |m| ≤ 1: `inverse` is 1/d
    /// within 2.01 e, so m · `inverse` is m/d within 3.1 e |m/d|, and `middle`, of an origin that was itself
    /// rounded, O/d within 5.2 e |O/d|; adding `error` and the last subtraction err by e (|m| + 2 |O|)/|d| more,
    /// fused or not. In all that is less than 8 e (|O| + 1)/|d|, and `error` is at least that. A component below
    /// 2⁻⁴⁰ is replaced: on the way to a hit, of length |O| + √3 at most, that moves the ray by less than
    /// 2⁻³⁷ (|O| + 2), which the unused part of `error`, 8 e for each length of 1, covers too.
    #[inline(always)]
    #[expect(
        clippy::needless_range_loop,
        reason = "lane by lane over many arrays: this is what gets vectorised"
    )]
    pub(super) fn set(&mut self, rays: &Rays, tree: &Tree) {
        let len = rays.len;
        let mut reach = [2.0; WIDTH];
        for axis in 0..3 {
            for i in 0..len {
                let origin = (rays.origin[axis][i] * tree.scale) as f32;
                self.origin[axis][i] = origin;
                self.direction[axis][i] = rays.direction[axis][i] as f32;
                reach[i] += origin.abs();
            }
        }
        for i in 0..len {
            self.uncertainty[i] = 30.0 * ROUNDING * reach[i] + 2.0 * tree.slack;
        }
        for axis in 0..3 {
            for i in 0..len {
                // Directions nearer to a plane of boxes are taken as that far from it, so that 0 · ∞ does not occur.
                const LEAST: f32 = 1.0 / (1_u64 << 40) as f32;
                let direction = self.direction[axis][i];
                let inverse = 1.0 / direction.abs().max(LEAST).copysign(direction);
                let middle = self.origin[axis][i] * inverse;
                let error = 8.0 * ROUNDING * reach[i] * inverse.abs();
                self.inverse[axis][i] = inverse;
                self.downwards[axis][i] = inverse < 0.0;
                self.enter[axis][i] = middle + error;
                self.leave[axis][i] = middle - error;
            }
        }
    }
}

/// What rays have left to visit and might meet. Slot s of a wavefront has the s-th part of each array.
#[derive(Clone, Debug)]
pub(crate) struct Scratch {
    pub(super) forms: Forms,
    pub(super) gates: [Gate; ACTIVE],
    pub(super) flights: [Flight; ACTIVE],
    pub(super) stacks: Stacks,
    pub(super) queues: Queues,
    /// Of the rays that are at a node, in the order of their queue: the key of the nearest box that they enter.
    pub(super) nearest: [u32; ACTIVE],
    /// Those of the rays that are at a leaf, in the order of their queue.
    pub(super) glances: [Glances; ACTIVE / GROUPS],
    pub(super) candidates: [Candidates; ACTIVE],
    /// The candidates that are left at the end.
    pub(super) finalists: Finalists,
}

impl Default for Scratch {
    fn default() -> Self {
        Scratch {
            forms: Forms {
                origin: [[0.0; WIDTH]; 3],
                direction: [[0.0; WIDTH]; 3],
                inverse: [[0.0; WIDTH]; 3],
                enter: [[0.0; WIDTH]; 3],
                leave: [[0.0; WIDTH]; 3],
                downwards: [[false; WIDTH]; 3],
                uncertainty: [0.0; WIDTH],
            },
            gates: [Gate::default(); ACTIVE],
            flights: [Flight::default(); ACTIVE],
            stacks: Stacks::default(),
            queues: Queues::default(),
            nearest: [NO_KEY; ACTIVE],
            glances: [Glances::NONE; ACTIVE / GROUPS],
            candidates: [Candidates::default(); ACTIVE],
            finalists: Finalists::default(),
        }
    }
}

/// What each ray has yet to visit: for each node on its way down, from the root on, the children that it has entered
/// and not visited.
#[derive(Clone, Debug)]
pub(super) struct Stacks {
    /// The keys of these children, by level; [`NO_KEY`] in the other lanes.
    keys: [[Line; ACTIVE]; LEVELS],
    /// The first line of the node.
    nodes: [[u32; ACTIVE]; LEVELS],
    /// The bits of the least key of each level.
    least: [Line; ACTIVE],
    /// The level that is free next.
    top: [u32; ACTIVE],
}

impl Stacks {
    const NONE: Line = Line([f32::from_bits(NO_KEY); LANES]);

    #[inline(always)]
    pub(super) fn clear(&mut self, slot: usize) {
        self.least[slot] = Self::NONE;
        self.top[slot] = 0;
    }

    /// Puts the children of a node on the stack, whose keys are given.
    #[inline(always)]
    pub(super) fn push<L: Sixteen>(&mut self, slot: usize, node: usize, keys: L) {
        let level = self.top[slot] as usize % LEVELS;
        keys.store(&mut self.keys[level][slot].0);
        self.nodes[level][slot] = node as u32;
    }

    /// Takes the child with the least `key` from those that were put on the stack last.
    #[inline(always)]
    pub(super) fn take_nearest<L: Sixteen>(&mut self, slot: usize, key: u32) {
        self.take::<L>(slot, self.top[slot] as usize % LEVELS, key);
    }

    /// Takes the child with the least key of a level.
    #[inline(always)]
    fn take<L: Sixteen>(&mut self, slot: usize, level: usize, key: u32) {
        let keys = &mut self.keys[level][slot].0;
        let others = L::load(keys).without(key);
        others.store(keys);
        let least = others.least();
        self.least[slot].0[level] = f32::from_bits(least);
        self.top[slot] = level as u32 + u32::from(least != NO_KEY);
    }

    /// The first line of a node and its nearest child that is left, on the deepest level with one that the ray enters by
    /// `best`. What deeper levels have is farther away, and forgotten.
    #[inline(always)]
    pub(super) fn pop<L: Sixteen>(&mut self, slot: usize, best: f32) -> Option<(usize, usize)> {
        let live = L::load(&self.least[slot].0).below(best.to_bits() + LANES as u32);
        let level = live.checked_ilog2().unwrap_or(0) as usize % LEVELS;
        let (key, node) = (self.least[slot].0[level].to_bits(), self.nodes[level][slot] as usize);
        self.take::<L>(slot, level, key);
        (live != 0).then_some((node, lane_of(key)))
    }
}

impl Default for Stacks {
    fn default() -> Self {
        Stacks {
            keys: [[Self::NONE; ACTIVE]; LEVELS],
            nodes: [[0; ACTIVE]; LEVELS],
            least: [Self::NONE; ACTIVE],
            top: [0; ACTIVE],
        }
    }
}

/// Rays by the kind of their next item.
#[derive(Clone, Debug)]
pub(super) struct Queues {
    pub(super) steps: [[Step; ACTIVE]; Item::KINDS],
    pub(super) lens: [usize; Item::KINDS],
}

impl Default for Queues {
    fn default() -> Self {
        let none = Step { slot: 0, ray: 0, item: Item::new(Item::DONE, 0) };
        Queues { steps: [[none; ACTIVE]; Item::KINDS], lens: [0; Item::KINDS] }
    }
}

impl Queues {
    #[inline(always)]
    pub(super) fn push(&mut self, step: Step) {
        let kind = step.item.kind();
        let len = self.lens[kind];
        // A ray is in one queue at a time, so there is room.
        self.steps[kind][len % ACTIVE] = step;
        self.lens[kind] = len + 1;
    }
}

#[derive(Clone, Copy, Debug)]
#[repr(C, align(8))]
pub(super) struct Step {
    pub(super) slot: u16,
    pub(super) ray: u16,
    pub(super) item: Item,
}

/// What four rays might meet in their leaves: a group for each, of a lane for each facet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Glances {
    /// The parameter that the nearest hit of the ray cannot exceed, in each lane.
    pub(super) best: Line,
    /// The least parameter at which a facet might be met.
    pub(super) enter: Line,
    /// The bits of surface numbers.
    pub(super) surface: Line,
    /// Bit i: the facet of lane i might be met.
    pub(super) bits: u32,
}

impl Glances {
    const NONE: Self =
        Glances { best: Line([0.0; LANES]), enter: Line([0.0; LANES]), surface: Line([0.0; LANES]), bits: 0 };
}

/// Facets that a ray might meet, with the least parameter at which.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Candidates {
    pub(super) t: [f32; CANDIDATES],
    pub(super) surface: [f32; CANDIDATES],
    pub(super) len: usize,
}

/// The surfaces that rays might meet.
#[derive(Clone, Debug)]
pub(super) struct Finalists {
    /// One for each ray.
    pub(super) one: [u32; WIDTH],
    /// The others, hardly any: rays and surfaces.
    pub(super) others: Vec<(usize, u32)>,
}

impl Default for Finalists {
    fn default() -> Self {
        Finalists { one: [Hits::NONE; WIDTH], others: vec![] }
    }
}

#[inline(always)]
pub(super) fn row(values: &[f32], start: usize) -> &Row {
    values[start..start + LANES].try_into().expect("a row")
}

/// Group k of a row.
#[inline(always)]
pub(super) fn quad(row: &Row, k: usize) -> &Quad {
    row[GROUP * k..][..GROUP].try_into().expect("a group")
}

#[inline(always)]
pub(super) fn quad_mut(values: &mut [f32], start: usize) -> &mut Quad {
    (&mut values[start..start + GROUP]).try_into().expect("a group")
}
