//! Many rays on their way through the tree at once.
//!
//! One ray at a time, a traversal waits: for the branch that was mispredicted and for the node that is not in
//! the cache. Here a few dozen rays are under way together. Each round takes one step with each of them, first
//! those whose next item is a node, then those at a leaf, without a branch that depends on the ray; the item that
//! a ray comes to next is fetched into the cache while the others take their step.
//!
//! All of it is f32 and only culls. A facet that a ray might meet, as far as f32 can tell, becomes a candidate;
//! the candidates that are left are met in f64 by [`Facets::meet`], so the answer is the same as without a tree.

use std::hint::select_unpredictable;

#[cfg(target_arch = "x86_64")]
use super::lanes::{Avx2, Avx512};
use super::lanes::{LANES, Lanes, Portable, Row, lane_of, value_of};
use super::{Item, Leaf, Line, Node, Tree};
use crate::isa::Isa;
use crate::prefetch::prefetch;
use crate::trace::{Facets, Hits, Rays, WIDTH};

/// Rays under way at once. More hide more latency, until they do not fit the first-level cache.
const ACTIVE: usize = 32;

/// Candidates that a ray can hold.
const CANDIDATES: usize = 2 * LANES;

/// Half the distance from 1 to the next f32: the largest relative error of one operation.
const ROUNDING: f32 = 0.5 * f32::EPSILON;

/// A batch of rays as the tree sees them, in tree coordinates.
#[derive(Clone, Debug)]
struct Forms {
    origin: [[f32; WIDTH]; 3],
    direction: [[f32; WIDTH]; 3],
    inverse: [[f32; WIDTH]; 3],
    /// Of the planes by which the ray enters a box and leaves it: t = plane · inverse − this, as early or as
    /// late as rounding could make it.
    enter: [[f32; WIDTH]; 3],
    leave: [[f32; WIDTH]; 3],
    /// The part of the uncertainty of t, times |n·d|, that does not grow with t.
    uncertainty: [f32; WIDTH],
    /// A parameter that the nearest hit cannot exceed.
    best: [f32; WIDTH],
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
    fn set(&mut self, rays: &Rays, tree: &Tree) {
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
            self.best[i] = f32::INFINITY;
        }
        for axis in 0..3 {
            for i in 0..len {
                const LEAST: f32 = 1.0 / (1_u64 << 40) as f32;
                let direction = self.direction[axis][i];
                let inverse = 1.0 / direction.abs().max(LEAST).copysign(direction);
                let middle = self.origin[axis][i] * inverse;
                let error = 8.0 * ROUNDING * reach[i] * inverse.abs();
                self.inverse[axis][i] = inverse;
                self.enter[axis][i] = middle + error;
                self.leave[axis][i] = middle - error;
            }
        }
    }
}

/// What rays have left to visit and might meet. Slot s of a wavefront has the s-th part of each array.
#[derive(Clone, Debug)]
pub(crate) struct Scratch {
    forms: Box<Forms>,
    stacks: Stacks,
    queues: Queues,
    candidates: [Candidates; ACTIVE],
    /// The candidates that are left at the end: ray and surface.
    finalists: Vec<(u32, u32)>,
}

impl Default for Scratch {
    fn default() -> Self {
        Scratch {
            forms: Box::new(Forms {
                origin: [[0.0; WIDTH]; 3],
                direction: [[0.0; WIDTH]; 3],
                inverse: [[0.0; WIDTH]; 3],
                enter: [[0.0; WIDTH]; 3],
                leave: [[0.0; WIDTH]; 3],
                uncertainty: [0.0; WIDTH],
                best: [0.0; WIDTH],
            }),
            stacks: Stacks::default(),
            queues: [[Step { slot: 0, ray: 0, item: Item::DONE }; ACTIVE + 1]; 3],
            candidates: [Candidates::default(); ACTIVE],
            finalists: vec![],
        }
    }
}

/// The items that each ray has yet to visit, the next one on top, with the parameter at which it enters them.
#[derive(Clone, Debug, Default)]
struct Stacks {
    enter: Vec<f32>,
    items: Vec<f32>,
    /// Entries of one ray.
    stride: usize,
    /// The first free entry of each.
    top: [usize; ACTIVE],
}

impl Stacks {
    /// Where a stack begins: a whole window above entries that no ray enters.
    const BOTTOM: usize = LANES;
    /// From here on the last item is the next, whatever its distance.
    const HIGH: usize = Self::BOTTOM + 4 * LANES;

    /// Makes room for a tree of some levels: a node's children replace it, and a row is written whole.
    fn fit(&mut self, levels: usize) {
        let stride = Self::HIGH + (LANES - 1) * levels + 2 * LANES;
        if stride != self.stride {
            self.stride = stride;
            self.enter = vec![f32::NAN; ACTIVE * stride];
            self.items = vec![0.0; ACTIVE * stride];
        }
    }

    fn clear(&mut self, slot: usize) {
        self.top[slot] = slot * self.stride + Self::BOTTOM;
    }

    /// The entry among the last sixteen that should be next: its key and where it is.
    #[inline(always)]
    fn peek<L: Lanes>(&self, slot: usize) -> (u32, usize) {
        let top = self.top[slot];
        let key = L::load(row(&self.enter, top - LANES)).least_key_of_all();
        let high = top > slot * self.stride + Self::HIGH;
        select_unpredictable(high, (0, top - 1), (key, top - LANES + lane_of(key)))
    }

    /// Takes out the entry at `at`: the last one fills its place.
    #[inline(always)]
    fn take(&mut self, slot: usize, at: usize) -> Item {
        let last = self.top[slot] - 1;
        let item = Item(self.items[at].to_bits());
        self.enter[at] = self.enter[last];
        self.items[at] = self.items[last];
        self.top[slot] = last;
        item
    }

    /// Adds the lanes of a node's children whose bits are set.
    #[inline(always)]
    fn push<L: Lanes>(&mut self, slot: usize, bits: u32, enter: L, children: L) {
        let top = self.top[slot];
        enter.compress(bits, row_mut(&mut self.enter, top));
        children.compress(bits, row_mut(&mut self.items, top));
        self.top[slot] = top + bits.count_ones() as usize;
    }
}

/// Rays by the kind of their next item: node, leaf, none.
type Queues = [[Step; ACTIVE + 1]; 3];

#[derive(Clone, Copy, Debug)]
struct Step {
    slot: u16,
    ray: u16,
    item: Item,
}

/// Facets that a ray might meet, with the least parameter at which.
#[derive(Clone, Copy, Debug, Default)]
struct Candidates {
    t: [f32; CANDIDATES],
    surface: [f32; CANDIDATES],
    len: usize,
}

#[inline(always)]
fn row(values: &[f32], start: usize) -> &Row {
    values[start..start + LANES].try_into().expect("a row")
}

#[inline(always)]
fn row_mut(values: &mut [f32], start: usize) -> &mut Row {
    (&mut values[start..start + LANES]).try_into().expect("a row")
}

impl Leaf<'_> {
    #[inline(always)]
    fn load<L: Lanes>(&self, row: usize) -> L {
        L::load(self.row(row))
    }

    /// The dot product of three rows and a vector.
    #[inline(always)]
    fn dot<L: Lanes>(&self, first: usize, v: &[L; 3]) -> L {
        let sum = self.load::<L>(first).mul(v[0]);
        let sum = self.load::<L>(first + 1).mul_add(v[1], sum);
        self.load::<L>(first + 2).mul_add(v[2], sum)
    }
}

impl Tree {
    /// The least (t, surface number) among the facets that each ray meets. Directions must be between 1/4 and
    /// 1 + 10⁻⁹ long.
    pub(crate) fn closest_hits(&self, facets: &Facets, rays: &Rays, scratch: &mut Scratch, hits: &mut Hits) {
        let call = Call { tree: self, facets, rays };
        match self.isa {
            Isa::Portable => call.run::<Portable>(scratch, hits),
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `Isa::available` has found the instruction set.
            Isa::Avx2 => unsafe { call.run_avx2(scratch, hits) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `Isa::available` has found the instruction set.
            Isa::Avx512 => unsafe { call.run_avx512(scratch, hits) },
        }
    }
}

struct Call<'a> {
    tree: &'a Tree,
    facets: &'a Facets,
    rays: &'a Rays,
}

impl Call<'_> {
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
    fn run_avx2(&self, scratch: &mut Scratch, hits: &mut Hits) {
        self.run::<Avx2>(scratch, hits);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
    fn run_avx512(&self, scratch: &mut Scratch, hits: &mut Hits) {
        self.run::<Avx512>(scratch, hits);
    }

    /// The whole batch: `ACTIVE` rays at once, the next one as soon as one is done.
    #[inline(always)]
    fn run<L: Lanes>(&self, scratch: &mut Scratch, hits: &mut Hits) {
        scratch.stacks.fit(self.tree.levels);
        scratch.finalists.clear();
        hits.clear(self.rays.len);
        scratch.forms.set(self.rays, self.tree);
        let mut next = self.rays.len.min(ACTIVE);
        let mut lens = [0; 3];
        for slot in 0..next {
            self.start(slot, scratch);
            self.queue(
                Step { slot: slot as u16, ray: slot as u16, item: Item::node(0) },
                &mut scratch.queues,
                &mut lens,
            );
        }
        while lens.iter().any(|&len| len > 0) {
            for i in 0..std::mem::take(&mut lens[0]) {
                let step = scratch.queues[0][i];
                let item = self.visit_node::<L>(step, scratch);
                self.queue(Step { item, ..step }, &mut scratch.queues, &mut lens);
            }
            for i in 0..std::mem::take(&mut lens[1]) {
                let step = scratch.queues[1][i];
                let item = self.visit_leaf::<L>(step, scratch, hits);
                self.queue(Step { item, ..step }, &mut scratch.queues, &mut lens);
            }
            for i in 0..std::mem::take(&mut lens[2]) {
                let step = scratch.queues[2][i];
                // Sixteen entries that are too far: there may be others below.
                let slot = step.slot as usize;
                if scratch.stacks.top[slot] > slot * scratch.stacks.stride + Stacks::BOTTOM + LANES {
                    scratch.stacks.top[slot] -= LANES;
                    let item = self.next::<L>(step, scratch);
                    self.queue(Step { item, ..step }, &mut scratch.queues, &mut lens);
                    continue;
                }
                self.finish(step, scratch);
                if next < self.rays.len {
                    self.start(slot, scratch);
                    self.queue(
                        Step { ray: next as u16, item: Item::node(0), ..step },
                        &mut scratch.queues,
                        &mut lens,
                    );
                    next += 1;
                }
            }
        }
        for i in 0..scratch.finalists.len() {
            let (ray, surface) = scratch.finalists[i];
            self.facets.meet_in(surface, self.rays, ray as usize, hits);
        }
    }

    /// Empties a slot for another ray.
    #[inline(always)]
    fn start(&self, slot: usize, scratch: &mut Scratch) {
        scratch.stacks.clear(slot);
        scratch.candidates[slot].len = 0;
    }

    /// Appends a step to the queue of its kind, without a branch: written to all, counted in one. The item is
    /// fetched meanwhile.
    #[inline(always)]
    fn queue(&self, step: Step, queues: &mut Queues, lens: &mut [usize; 3]) {
        let item = step.item;
        let kind = item.kind();
        for k in 0..3 {
            queues[k][lens[k]] = step;
            lens[k] += usize::from(k == kind);
        }
        let (base, size) = if item.kind() == 1 {
            (self.tree.leaves.as_ptr().cast::<u8>(), size_of::<Line>())
        } else {
            (self.tree.nodes.as_ptr().cast::<u8>(), size_of::<Node>())
        };
        prefetch(base.wrapping_add(item.index() * size), 7);
    }

    /// Enters the boxes of a node: to the nearest that the ray meets, else to one from the stack, which gets the
    /// others. The stack is read before it is written, so that no load waits for a store.
    #[inline(always)]
    fn visit_node<L: Lanes>(&self, step: Step, scratch: &mut Scratch) -> Item {
        let (slot, ray) = (step.slot as usize, step.ray as usize);
        let (forms, stacks) = (&scratch.forms, &mut scratch.stacks);
        let rows = &self.tree.nodes[step.item.index()].rows;
        let best = forms.best[ray];
        let (stacked, at) = stacks.peek::<L>(slot);
        let [near, far] = [0, 1].map(|side| {
            [0, 1, 2].map(|axis| {
                let inverse = forms.inverse[axis][ray];
                let negative = (inverse.to_bits() >> 31) as usize;
                let bias = if side == 0 { &forms.enter } else { &forms.leave };
                L::load(&rows[2 * axis + (negative ^ side)])
                    .mul_sub(L::splat(inverse), L::splat(bias[axis][ray]))
            })
        });
        let enter = near[0].max(near[1]).max(near[2]).max(L::splat(0.0));
        let leave = far[0].min(far[1]).min(far[2].min(L::splat(best)));
        let mask = enter.le(leave);
        let bits = L::bits(mask);
        let nearest = enter.least_key(mask);
        let child = Item(rows[Node::CHILDREN][lane_of(nearest)].to_bits());
        let from_stack = bits == 0;
        let live = bits != 0 || value_of(stacked) <= best.to_bits();
        // With no child to go to, an entry leaves the stack; with one, the last entry takes its own place.
        let last = stacks.top[slot] - 1;
        let stacked = stacks.take(slot, select_unpredictable(from_stack & live, at, last));
        stacks.top[slot] += usize::from(!(from_stack & live));
        let others = bits & !(1 << lane_of(nearest));
        stacks.push(slot, others, enter, L::load(&rows[Node::CHILDREN]));
        select_unpredictable(live, select_unpredictable(from_stack, stacked, child), Item::DONE)
    }

    /// The nearest of the last sixteen entries on the stack, if it is near enough; else `Item::DONE`.
    #[inline(always)]
    fn next<L: Lanes>(&self, step: Step, scratch: &mut Scratch) -> Item {
        let (slot, ray) = (step.slot as usize, step.ray as usize);
        let stacks = &mut scratch.stacks;
        let (key, at) = stacks.peek::<L>(slot);
        let live = value_of(key) <= scratch.forms.best[ray].to_bits();
        let item = stacks.take(slot, at);
        stacks.top[slot] += usize::from(!live);
        select_unpredictable(live, item, Item::DONE)
    }

    /// Notes which facets of a leaf the ray might meet, and no later than when it surely meets one.
    ///
    /// Let e = [`ROUNDING`], O the origin, d the direction (|d| ≤ 1 + 10⁻⁹), all lengths in tree coordinates, where
    /// points of facets lie within √3 of the middle, and s the slack.
    /// - Rounding n and d and three products and sums: a = n·d errs by 5.1 e. Rounding O and the offset too,
    ///   h = n·O − offset errs by 6.1 e (|O| + √3), and s may lie between h and the distance that
    ///   [`crate::trace::Facet::meet`] takes as 0: together H = 7 e r + s, r = `reach` = |O|₁ + 2.
    /// - Where |a| > 16 e, the true |a| is at least |a|/2, and t = −h/a errs by less than
    ///   2 (H + 9 e |t|)/|a| (three roundings of t itself are 3 e |t|).
    /// - The point O + t d errs by that and e (2 |O| + 3 |t|); u of it, by `steepness` times that, and by
    ///   5 e `steepness` (|O| + |t|) + 9 e `steepness` in its own products and sums; v and u + v alike, `steepness` being
    ///   the sum of their slopes.
    ///
    /// As |a| ≤ 1 + 6 e, everything is below E = (30 e (r + |t|) + 2 s)/|a| in t, and `steepness` · E in u, v and
    /// u + v. The errors of the f64 arithmetic are 2⁻²⁹ of these. A facet that is met with |a| ≤ 16 e is
    /// taken without looking. None of those is *surely* met: there E > 1.8 |t| + 3.
    #[inline(always)]
    fn visit_leaf<L: Lanes>(&self, step: Step, scratch: &mut Scratch, hits: &mut Hits) -> Item {
        let (slot, ray) = (step.slot as usize, step.ray as usize);
        let forms = &mut scratch.forms;
        let leaf = Leaf::at(&self.tree.leaves, step.item.index());
        let [origin, direction] =
            [&forms.origin, &forms.direction].map(|v| v.each_ref().map(|row| L::splat(row[ray])));
        let approach = leaf.dot(Leaf::NORMAL, &direction);
        let height = leaf.dot(Leaf::NORMAL, &origin).sub(leaf.load(Leaf::NORMAL + 3));
        let inverse = approach.recip();
        let t = L::splat(0.0).sub(height).mul(inverse);
        let error =
            t.abs().mul_add(L::splat(30.0 * ROUNDING), L::splat(forms.uncertainty[ray])).mul(inverse.abs());
        let point = [0, 1, 2].map(|axis| t.mul_add(direction[axis], origin[axis]));
        let u = leaf.dot(Leaf::U, &point).sub(leaf.load(Leaf::U + 3));
        let v = leaf.dot(Leaf::V, &point).sub(leaf.load(Leaf::V + 3));
        let steepness: L = leaf.load(Leaf::STEEPNESS);
        let margin = steepness.abs().mul(error);
        let least = u.min(v);
        let greatest = u.max(v).add(least.where_negative(steepness));
        let (earliest, latest) = (t.sub(error), t.add(error));
        let [zero, one] = [0.0, 1.0].map(L::splat);

        let grazing = approach.abs().le(L::splat(16.0 * ROUNDING));
        let surfaces: L = leaf.load(Leaf::SURFACE);
        let other = L::and(surfaces.differs(self.rays.from[ray]), L::first(leaf.count));
        let inside = L::and(zero.sub(margin).le(least), greatest.le(one.add(margin)));
        let ahead = L::and(earliest.le(L::splat(forms.best[ray])), zero.le(latest));
        let maybe = L::and(L::or(grazing, L::and(inside, ahead)), other);
        let surely_inside = L::and(margin.le(least), greatest.le(one.sub(margin)));
        let surely = L::and(L::and(surely_inside, zero.le(earliest)), other);

        forms.best[ray] = forms.best[ray].min(latest.least(surely));
        let bits = L::bits(maybe);
        let candidates = &mut scratch.candidates[slot];
        let len = candidates.len;
        earliest.compress(bits, row_mut(&mut candidates.t, len));
        surfaces.compress(bits, row_mut(&mut candidates.surface, len));
        candidates.len = len + bits.count_ones() as usize;
        if candidates.len > CANDIDATES - LANES {
            self.settle(step, scratch, hits);
        }
        self.next::<L>(step, scratch)
    }

    /// Meets all candidates of a ray now.
    #[cold]
    fn settle(&self, step: Step, scratch: &mut Scratch, hits: &mut Hits) {
        let ray = step.ray as usize;
        let candidates = &mut scratch.candidates[step.slot as usize];
        let best = &mut scratch.forms.best[ray];
        for surface in &candidates.surface[..std::mem::take(&mut candidates.len)] {
            self.facets.meet_in(surface.to_bits(), self.rays, ray, hits);
        }
        *best = best.min(((hits.t[ray] * self.tree.scale) as f32).next_up());
    }

    /// Keeps the candidates that are near enough, and fetches their facets.
    #[inline(always)]
    fn finish(&self, step: Step, scratch: &mut Scratch) {
        let best = scratch.forms.best[step.ray as usize];
        let candidates = &scratch.candidates[step.slot as usize];
        for (&t, surface) in candidates.t.iter().zip(&candidates.surface).take(candidates.len) {
            // A grazing one has no number for t.
            if t <= best || t.is_nan() {
                let surface = surface.to_bits();
                prefetch(std::ptr::from_ref(self.facets.get(surface)), 2);
                scratch.finalists.push((u32::from(step.ray), surface));
            }
        }
    }
}
