//! Many rays on their way through the tree at once.
//!
//! One ray at a time, a traversal waits: for the branch that was mispredicted and for the node that is not in
//! the cache. Here a few dozen rays are under way together. Each round takes a step with each of them, first those
//! at a node, then those at a leaf, then those that look for something on their stack, without a branch that
//! depends on the ray; the item that a ray comes to next is fetched into the cache while the others take their step.
//!
//! All of it is f32 and only culls. A facet that a ray might meet, by the bounds of f32, becomes a candidate;
//! the candidates that are left are met in f64 by [`meet_alone`], so the answer is the same as without a tree.

use std::hint::select_unpredictable;

use super::layout::{CHILDREN, Item, LEAF_LINES, Leaf, NODE_LINES, Node, Tree, node_at};
use super::probe::Probe;
use super::scratch::{
    ACTIVE, CANDIDATES, Flight, Gate, Queues, ROUNDING, Scratch, Step, quad, quad_mut, row,
};
use crate::simd::batch::WIDTH;
use crate::simd::isa::{Kernel, Simd};
use crate::simd::prefetch::prefetch;
use crate::simd::sixteen::{GROUP, GROUPS, LANES, NO_KEY, Sixteen, lane_of};
use crate::trace::facet::Facets;
use crate::trace::meet::{Best, meet_alone, meet_each};
use crate::trace::ray::{Hit, Hits, Ray, Rays};

/// The leaves that four rays have come to.
struct FourLeaves<'a>([Leaf<'a>; GROUPS]);

impl FourLeaves<'_> {
    #[inline(always)]
    fn load<L: Sixteen>(&self, row: usize) -> L {
        L::groups(self.0.map(|leaf| leaf.row(row)))
    }

    /// The dot product of three rows and a vector.
    #[inline(always)]
    fn dot<L: Sixteen>(&self, first: usize, v: &[L; 3]) -> L {
        let sum = self.load::<L>(first).mul(v[0]);
        let sum = self.load::<L>(first + 1).mul_add(v[1], sum);
        self.load::<L>(first + 2).mul_add(v[2], sum)
    }
}

impl Tree {
    /// The least (t, rank) among the facets that each ray meets. Directions must be between 1/4 and
    /// 1 + 10⁻⁹ long.
    pub(crate) fn closest_hits(&self, facets: &Facets, rays: &Rays, scratch: &mut Scratch, hits: &mut Hits) {
        self.trace::<false>(None, facets, rays, scratch, hits);
    }

    /// [`Tree::closest_hits`], or with a probe.
    pub(super) fn trace<const PROBED: bool>(
        &self,
        probe: Option<&Probe>,
        facets: &Facets,
        rays: &Rays,
        scratch: &mut Scratch,
        hits: &mut Hits,
    ) {
        self.isa.run(Batch { call: Call::<PROBED> { tree: self, facets, rays, probe }, scratch, hits });
    }
}

/// A call with its arguments.
struct Batch<'a, const PROBED: bool> {
    call: Call<'a, PROBED>,
    scratch: &'a mut Scratch,
    hits: &'a mut Hits,
}

impl<const PROBED: bool> Kernel for Batch<'_, PROBED> {
    #[inline(always)]
    fn run<S: Simd>(self) {
        self.call.run::<S::Singles>(self.scratch, self.hits);
    }
}

impl Tree {
    /// The nearest hit of one ray of any length.
    pub(crate) fn closest_hit(&self, facets: &Facets, ray: &Ray) -> Option<Hit> {
        // The kernel wants directions of about unit length. A power of two changes no bit of the hit but the
        // exponent of t.
        let largest = ray.direction.abs().max_element();
        let scale = f64::from_bits((1.0 / largest).to_bits() & f64::INFINITY.to_bits()) * 0.5;
        let mut rays = Rays::default();
        rays.push(&Ray { direction: ray.direction * scale, ..*ray });
        let mut hits = Hits::default();
        self.closest_hits(facets, &rays, &mut Scratch::default(), &mut hits);
        hits.get(0).map(|hit| Hit { t: hit.t * scale, ..hit })
    }
}

impl Gate {
    /// Where the ray enters sixteen slabs of an axis. A closure would not always be inlined, and then not be compiled for the
    /// instruction set.
    #[inline(always)]
    fn enters<L: Sixteen>(&self, node: &Node, axis: usize) -> L {
        let plane = &node[2 * axis + usize::from(self.downwards[axis])].0;
        L::load(plane).mul_sub(L::splat(self.inverse[axis]), L::splat(self.enter[axis]))
    }

    /// Where the ray leaves sixteen slabs of an axis.
    #[inline(always)]
    fn leaves<L: Sixteen>(&self, node: &Node, axis: usize) -> L {
        let plane = &node[2 * axis + usize::from(!self.downwards[axis])].0;
        L::load(plane).mul_sub(L::splat(self.inverse[axis]), L::splat(self.leave[axis]))
    }
}

struct Call<'a, const PROBED: bool> {
    tree: &'a Tree,
    facets: &'a Facets,
    rays: &'a Rays,
    probe: Option<&'a Probe<'a>>,
}

impl<const PROBED: bool> Call<'_, PROBED> {
    /// The probe, if there is one: without it nothing of it is compiled.
    #[inline(always)]
    fn probe(&self) -> Option<&Probe<'_>> {
        if PROBED { self.probe } else { None }
    }

    /// A ray takes a step.
    #[inline(always)]
    fn see(&self, step: Step) {
        if let Some(probe) = self.probe() {
            probe.see(step);
        }
    }

    /// The whole batch: `ACTIVE` rays at once, the next one as soon as one is done.
    #[inline(always)]
    fn run<L: Sixteen>(&self, scratch: &mut Scratch, hits: &mut Hits) {
        scratch.finalists.others.clear();
        scratch.forms.set(self.rays, self.tree);
        let mut next = self.rays.len.min(ACTIVE);
        for slot in 0..next {
            self.start(slot, slot, scratch);
        }
        while scratch.queues.lens != [0; Item::KINDS] {
            self.visit_nodes::<L>(scratch);
            self.visit_leaves::<L>(scratch);
            for i in 0..std::mem::take(&mut scratch.queues.lens[Item::POP]) {
                let step = scratch.queues.steps[Item::POP][i % ACTIVE];
                self.pop::<L>(step, scratch);
            }
            for i in 0..std::mem::take(&mut scratch.queues.lens[Item::DONE]) {
                let step = scratch.queues.steps[Item::DONE][i % ACTIVE];
                self.finish::<L>(step, scratch);
                if next < self.rays.len {
                    self.start(step.slot as usize, next, scratch);
                    next += 1;
                }
            }
        }
        meet_each(self.tree.isa, self.facets, &scratch.finalists.one, self.rays, hits);
        for &(ray, surface) in &scratch.finalists.others {
            let mut best = Best::of(self.facets, hits.get(ray));
            meet_alone(self.facets, surface, &self.rays.get(ray), &mut best);
            best.store(hits, ray);
        }
    }

    /// Sends a ray on its way.
    #[inline(always)]
    fn start(&self, slot: usize, ray: usize, scratch: &mut Scratch) {
        let forms = &scratch.forms;
        let at = |rows: &[[f32; WIDTH]; 3]| rows.each_ref().map(|row| row[ray]);
        scratch.gates[slot] = Gate {
            inverse: at(&forms.inverse),
            enter: at(&forms.enter),
            leave: at(&forms.leave),
            downwards: forms.downwards.each_ref().map(|row| row[ray]),
        };
        let ([x, y, z], [dx, dy, dz]) = (at(&forms.origin), at(&forms.direction));
        scratch.flights[slot] = Flight {
            start: [x, y, z, forms.uncertainty[ray]],
            way: [dx, dy, dz, self.probe().map_or(f32::INFINITY, |probe| probe.bound(ray))],
            from: [f32::from_bits(self.rays.from[ray]); GROUP],
        };
        scratch.stacks.clear(slot);
        scratch.candidates[slot].len = 0;
        let step = Step {
            slot: slot as u16,
            ray: ray as u16,
            item: self.probe().map_or(Item::ROOT, |probe| probe.first(ray)),
        };
        scratch.queues.push(step);
    }

    /// Queues a step, and has its item fetched meanwhile.
    #[inline(always)]
    fn queue(&self, step: Step, queues: &mut Queues) {
        queues.push(step);
        let first = self.tree.lines.as_ptr().wrapping_add(step.item.line());
        prefetch(first, LEAF_LINES);
        let rest = select_unpredictable(step.item.kind() == Item::NODE, LEAF_LINES, 0);
        prefetch(first.wrapping_add(rest), NODE_LINES - LEAF_LINES);
    }

    /// Takes a ray's next item from its stack.
    #[inline(always)]
    fn pop<L: Sixteen>(&self, step: Step, scratch: &mut Scratch) {
        self.see(Step { item: Item::new(Item::POP, 0), ..step });
        let slot = step.slot as usize % ACTIVE;
        let next = scratch.stacks.pop::<L>(slot, scratch.flights[slot].best());
        let (node, child) = next.unwrap_or((0, 0));
        let item = self.child(node, child);
        let item = select_unpredictable(next.is_some(), item, Item::new(Item::DONE, 0));
        self.queue(Step { item, ..step }, &mut scratch.queues);
    }

    /// A child of the node that begins with a line.
    #[inline(always)]
    fn child(&self, node: usize, number: usize) -> Item {
        Item(self.tree.lines[node + CHILDREN].0[number].to_bits())
    }

    /// Takes a step with the rays that are at a node. What a step waits for is a long chain: in two loops of shorter chains the processor
    /// has more rays in sight at a time.
    #[inline(always)]
    fn visit_nodes<L: Sixteen>(&self, scratch: &mut Scratch) {
        let len = std::mem::take(&mut scratch.queues.lens[Item::NODE]);
        for i in 0..len {
            let step = scratch.queues.steps[Item::NODE][i % ACTIVE];
            self.see(step);
            scratch.nearest[i % ACTIVE] = self.enter_boxes::<L>(step, scratch);
        }
        for i in 0..len {
            let step = scratch.queues.steps[Item::NODE][i % ACTIVE];
            let item = self.go_down::<L>(step, scratch.nearest[i % ACTIVE], scratch);
            self.queue(Step { item, ..step }, &mut scratch.queues);
        }
    }

    /// Puts the boxes of a node that a ray enters on its stack; the key of the nearest.
    #[inline(always)]
    fn enter_boxes<L: Sixteen>(&self, step: Step, scratch: &mut Scratch) -> u32 {
        let slot = step.slot as usize % ACTIVE;
        let gate = &scratch.gates[slot];
        let node = node_at(&self.tree.lines, step.item.line());
        let [x, y, z]: [L; 3] = [gate.enters(node, 0), gate.enters(node, 1), gate.enters(node, 2)];
        let enter = x.max(y).max(z).max(L::splat(0.0));
        let [x, y, z]: [L; 3] = [gate.leaves(node, 0), gate.leaves(node, 1), gate.leaves(node, 2)];
        let leave = x.min(y).min(z.min(L::splat(scratch.flights[slot].best())));
        let keys = enter.keys(enter.le(leave));
        scratch.stacks.push(slot, step.item.line(), keys);
        keys.least()
    }

    /// Of the boxes that a ray enters, the nearest is next.
    #[inline(always)]
    fn go_down<L: Sixteen>(&self, step: Step, nearest: u32, scratch: &mut Scratch) -> Item {
        let child = self.child(step.item.line(), lane_of(nearest));
        scratch.stacks.take_nearest::<L>(step.slot as usize % ACTIVE, nearest);
        select_unpredictable(nearest == NO_KEY, Item::new(Item::POP, 0), child)
    }

    /// Takes a step with the rays that are at a leaf, four at a time; what is left waits until there are four, or
    /// nothing else is to do.
    #[inline(always)]
    fn visit_leaves<L: Sixteen>(&self, scratch: &mut Scratch) {
        let len = std::mem::take(&mut scratch.queues.lens[Item::LEAF]);
        let rest = if scratch.queues.lens == [0; Item::KINDS] { 0 } else { len % GROUPS };
        for first in (0..len - rest).step_by(GROUPS) {
            let last = len - 1;
            let steps = [0, 1, 2, 3].map(|k| scratch.queues.steps[Item::LEAF][last.min(first + k) % ACTIVE]);
            self.look_at_four::<L>(&steps, first / GROUPS % (ACTIVE / GROUPS), scratch);
        }
        for i in 0..len - rest {
            let step = scratch.queues.steps[Item::LEAF][i % ACTIVE];
            self.see(step);
            self.note_candidates::<L>(step, i % ACTIVE, scratch);
            self.pop::<L>(step, scratch);
        }
        // They move up; no ray was queued here that had not been taken out.
        for i in len - rest..len {
            let step = scratch.queues.steps[Item::LEAF][i % ACTIVE];
            scratch.queues.push(step);
        }
    }

    /// Finds which facets of its leaf each of four rays might meet, and no later than when it surely meets one.
    ///
    /// Let e = [`ROUNDING`], O the origin, d the direction (|d| ≤ 1 + 10⁻⁹), all lengths in tree coordinates, where
    /// points of facets lie within √3 of the middle, and s the slack.
    /// - Rounding n and d and three products and sums: a = n·d errs by 5.1 e. Rounding O and the offset too,
    ///   h = offset − n·O errs by 6.1 e (|O| + √3), and s may lie between h and the distance that
    ///   [`crate::trace::meet`] takes as 0: together H = 7 e r + s, r = `reach` = |O|₁ + 2.
    /// - Where |a| > 16 e, the true |a| is at least |a|/2, and t = h/a errs by less than
    ///   2 (H + 9 e |t|)/|a| (the roundings of t itself are 3.1 e |t|).
    /// - The point O + t d errs by that and e (2 |O| + 3 |t|); u of it, by `steepness` times that, and by
    ///   5 e `steepness` (|O| + |t|) + 9 e `steepness` in its own products and sums; v and u + v alike, `steepness` being
    ///   the sum of their slopes.
    ///
    /// As |a| ≤ 1 + 6 e, everything is below E = (30 e (r + |t|) + 2 s)/|a| in t, and `steepness` · E in u, v and
    /// u + v. The errors of the f64 arithmetic are 2⁻²⁹ of these. A facet that is met with |a| ≤ 16 e is
    /// taken without looking. None of those is *surely* met: there E > 1.8 |t| + 3.
    #[inline(always)]
    fn look_at_four<L: Sixteen>(&self, steps: &[Step; GROUPS], four: usize, scratch: &mut Scratch) {
        let slots = steps.map(|step| step.slot as usize % ACTIVE);
        let leaves = FourLeaves(steps.map(|step| Leaf::at(&self.tree.lines, step.item.line())));
        let flights = &scratch.flights;
        let start = L::groups(slots.map(|slot| &flights[slot].start));
        let way = L::groups(slots.map(|slot| &flights[slot].way));
        let from = L::groups(slots.map(|slot| &flights[slot].from));
        let [origin, direction] = [start, way].map(|v| [0, 1, 2].map(|axis| v.spread(axis)));
        let (uncertainty, best) = (start.spread(Flight::UNCERTAINTY), way.spread(Flight::BEST));
        let approach = leaves.dot(Leaf::NORMAL, &direction);
        let depth = leaves.load::<L>(Leaf::NORMAL + 3).sub(leaves.dot(Leaf::NORMAL, &origin));
        let inverse = approach.recip();
        let t = depth.mul(inverse);
        let error = t.abs().mul_add(L::splat(30.0 * ROUNDING), uncertainty).mul(inverse.abs());
        let point = [0, 1, 2].map(|axis| t.mul_add(direction[axis], origin[axis]));
        let u = leaves.dot(Leaf::U, &point).sub(leaves.load(Leaf::U + 3));
        let v = leaves.dot(Leaf::V, &point).sub(leaves.load(Leaf::V + 3));
        let steepness: L = leaves.load(Leaf::STEEPNESS);
        let margin = steepness.abs().mul(error);
        let least = u.min(v);
        let greatest = u.max(v).add(least.where_negative(steepness));
        let (earliest, latest) = (t.sub(error), t.add(error));
        let [zero, one] = [0.0, 1.0].map(L::splat);

        let grazing = approach.abs().le(L::splat(16.0 * ROUNDING));
        let surfaces: L = leaves.load(Leaf::SURFACE);
        let other = surfaces.differs(from);
        let inside = L::and(zero.sub(margin).le(least), greatest.le(one.add(margin)));
        let ahead = L::and(earliest.le(best), zero.le(latest));
        let maybe = L::and(L::or(grazing, L::and(inside, ahead)), other);
        let surely_inside = L::and(margin.le(least), greatest.le(one.sub(margin)));
        let surely = L::and(L::and(surely_inside, zero.le(earliest)), other);

        let glances = &mut scratch.glances[four];
        latest.least_of_groups(surely).min(best).store(&mut glances.best.0);
        // A grazing one has no number for t.
        earliest.zero_where(grazing).store(&mut glances.enter.0);
        surfaces.store(&mut glances.surface.0);
        glances.bits = L::bits(maybe);
    }

    /// Notes what [`Call::look_at_four`] has found for ray i of the queue.
    #[inline(always)]
    fn note_candidates<L: Sixteen>(&self, step: Step, i: usize, scratch: &mut Scratch) {
        let (slot, k) = (step.slot as usize % ACTIVE, i % GROUPS);
        let glances = &scratch.glances[i / GROUPS];
        scratch.flights[slot].way[Flight::BEST] = glances.best.0[GROUP * k];
        let candidates = &mut scratch.candidates[slot];
        let (bits, len) = (glances.bits >> (GROUP * k) & ((1 << GROUP) - 1), candidates.len % LANES);
        L::compress_group(quad(&glances.enter.0, k), bits, quad_mut(&mut candidates.t, len));
        L::compress_group(quad(&glances.surface.0, k), bits, quad_mut(&mut candidates.surface, len));
        candidates.len = len + bits.count_ones() as usize;
        if candidates.len >= LANES {
            self.settle(step, scratch);
        }
    }

    /// Meets all candidates of a ray now, and keeps the nearest.
    #[cold]
    fn settle(&self, step: Step, scratch: &mut Scratch) {
        let (slot, ray) = (step.slot as usize, step.ray as usize);
        let candidates = &mut scratch.candidates[slot];
        let mut nearest = Best::none();
        for surface in &candidates.surface[..std::mem::take(&mut candidates.len)] {
            meet_alone(self.facets, surface.to_bits(), &self.rays.get(ray), &mut nearest);
        }
        if let Some(hit) = nearest.hit() {
            let (best, t) = (&mut scratch.flights[slot].way[Flight::BEST], (hit.t * self.tree.scale) as f32);
            *best = best.min(t.next_up());
            candidates.t[0] = t.next_down();
            candidates.surface[0] = f32::from_bits(hit.surface);
            candidates.len = 1;
        }
    }

    /// Keeps the candidates that are near enough, hardly ever more than one. There are fewer than a row of them:
    /// else [`Call::note_candidates`] has met them.
    #[inline(always)]
    fn finish<L: Sixteen>(&self, step: Step, scratch: &mut Scratch) {
        let (slot, ray) = (step.slot as usize % ACTIVE, step.ray as usize % WIDTH);
        let (candidates, finalists) = (&scratch.candidates[slot], &mut scratch.finalists);
        let near = L::load(row(&candidates.t, 0)).le(L::splat(scratch.flights[slot].best()));
        let bits = L::bits(near) & ((1 << candidates.len) - 1);
        let one = candidates.surface[bits.trailing_zeros() as usize % CANDIDATES].to_bits();
        finalists.one[ray] = select_unpredictable(bits == 0, Hits::NONE, one);
        self.facets.expect(one);
        let mut others = bits & bits.wrapping_sub(1);
        while others != 0 {
            let other = candidates.surface[others.trailing_zeros() as usize % CANDIDATES].to_bits();
            finalists.others.push((ray, other));
            others &= others - 1;
        }
    }
}
