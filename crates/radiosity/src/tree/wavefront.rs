//! Many rays on their way through the tree at once.
//!
//! One ray at a time, a traversal waits: for the branch that was mispredicted and for the node that is not in
//! the cache. Here a few dozen rays are under way together. Each round takes one step with each of them, first
//! those whose next item is a node, then those at a leaf, without a branch that depends on the ray; the item that
//! a ray comes to next is fetched into the cache while the others take their step.
//!
//! All of it is f32 and only culls. A facet that a ray might meet, as far as f32 can tell, becomes a candidate;
//! the candidates that are left are met in f64 by [`Facets::meet`], so the answer is the same as without a tree.

#[cfg(target_arch = "x86_64")]
use super::lanes::{Avx2, Avx512};
use super::lanes::{LANES, Lanes, Portable, Row};
use super::{Item, Leaf, Node, Tree};
use crate::isa::Isa;
use crate::prefetch::prefetch;
use crate::trace::{Facets, Hits, Rays};

/// Rays under way at once. More hide more latency, until they do not fit the first-level cache.
const ACTIVE: usize = 32;

/// Candidates that a ray can hold.
const CANDIDATES: usize = 3 * LANES;

/// Half the distance from 1 to the next f32: the largest relative error of one operation.
const ROUNDING: f32 = 0.5 * f32::EPSILON;

/// A ray as the tree sees it, in tree coordinates.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(64))]
struct Form {
    origin: [f32; 3],
    direction: [f32; 3],
    inverse: [f32; 3],
    /// Of the planes by which the ray enters a box and leaves it: t = plane · inverse − this, as early or as
    /// late as rounding could make it.
    enter: [f32; 3],
    leave: [f32; 3],
    /// Bit a: the direction is negative along axis a.
    octant: u32,
    /// The part of the uncertainty of t, times |n·d|, that does not grow with t.
    uncertainty: f32,
    /// A parameter that the nearest hit cannot exceed.
    best: f32,
    /// The surface that the ray leaves.
    from: u32,
    /// Its number in the batch.
    ray: u32,
}

impl Form {
    #[inline(always)]
    fn new(rays: &Rays, ray: usize, tree: &Tree) -> Self {
        let origin = rays.origin.map(|row| (row[ray] * tree.scale) as f32);
        let direction = rays.direction.map(|row| row[ray] as f32);
        let reach = origin[0].abs() + origin[1].abs() + origin[2].abs() + 2.0;
        let mut form = Form {
            origin,
            direction,
            uncertainty: 30.0 * ROUNDING * reach + 2.0 * tree.slack,
            best: f32::INFINITY,
            from: rays.from[ray],
            ray: ray as u32,
            ..Form::default()
        };
        for axis in 0..3 {
            const LEAST: f32 = 1.0 / (1_u64 << 40) as f32;
            let d = direction[axis].abs().max(LEAST).copysign(direction[axis]);
            let inverse = 1.0 / d;
            let middle = origin[axis] * inverse;
            let error = 8.0 * ROUNDING * reach * inverse.abs();
            form.inverse[axis] = inverse;
            form.enter[axis] = middle + error;
            form.leave[axis] = middle - error;
            form.octant |= (d.to_bits() >> 31) << axis;
        }
        form
    }
}

/// What rays have left to visit and might meet. Slot s of a wavefront has the s-th part of each array.
#[derive(Clone, Debug)]
pub(crate) struct Scratch {
    forms: [Form; ACTIVE],
    stacks: Stacks,
    queues: Queues,
    candidates: [Candidates; ACTIVE],
    finalists: Finalists,
}

impl Default for Scratch {
    fn default() -> Self {
        Scratch {
            forms: [Form::default(); ACTIVE],
            stacks: Stacks::default(),
            queues: [[Step { slot: 0, item: Item::DONE }; ACTIVE + 1]; 3],
            candidates: [Candidates::default(); ACTIVE],
            finalists: Finalists::default(),
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
    /// Where a stack begins: below it, so that [`Stacks::pop`] may look at eight entries at once, are seven that
    /// no ray enters, and `Item::DONE`, which every ray does.
    const BOTTOM: usize = LANES;

    /// Makes room for a tree of some levels: a node's children replace it, and a row is written whole.
    fn fit(&mut self, levels: usize) {
        let stride = Self::BOTTOM + (LANES - 1) * levels + 2 * LANES;
        if stride != self.stride {
            self.stride = stride;
            self.enter = vec![f32::NAN; ACTIVE * stride];
            self.items = vec![0.0; ACTIVE * stride];
            for slot in 0..ACTIVE {
                self.enter[slot * stride + Self::BOTTOM - 1] = f32::NEG_INFINITY;
                self.items[slot * stride + Self::BOTTOM - 1] = f32::from_bits(Item::DONE.0);
            }
        }
    }

    fn clear(&mut self, slot: usize) {
        self.top[slot] = slot * self.stride + Self::BOTTOM;
    }

    /// The next item that the ray enters before `best`.
    #[inline(always)]
    fn peek<L: Lanes>(&self, slot: usize, best: f32) -> (Item, usize) {
        let mut top = self.top[slot];
        loop {
            let window = L::load(row(&self.enter, top - LANES));
            let bits = L::bits(window.le(L::splat(best)));
            if bits != 0 {
                top -= 1 + (bits << (32 - LANES)).leading_zeros() as usize;
                return (Item(self.items[top].to_bits()), top);
            }
            top -= LANES;
        }
    }
}

/// Rays by the kind of their next item: node, leaf, none.
type Queues = [[Step; ACTIVE + 1]; 3];

#[derive(Clone, Copy, Debug)]
struct Step {
    slot: u32,
    item: Item,
}

/// Facets that a ray might meet, with the least parameter at which.
#[derive(Clone, Copy, Debug, Default)]
struct Candidates {
    t: [f32; CANDIDATES],
    surface: [f32; CANDIDATES],
    len: usize,
}

/// The candidates that are left at the end: ray and surface.
#[derive(Clone, Debug, Default)]
struct Finalists {
    list: Vec<(u32, u32)>,
}

#[inline(always)]
fn row(values: &[f32], start: usize) -> &Row {
    values[start..start + LANES].try_into().expect("a row")
}

#[inline(always)]
fn row_mut(values: &mut [f32], start: usize) -> &mut Row {
    (&mut values[start..start + LANES]).try_into().expect("a row")
}

impl Tree {
    /// The least (t, surface number) among the facets that each ray meets. Directions must have a length of 1
    /// within a factor of 2 below.
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

    #[inline(always)]
    fn run<L: Lanes>(&self, scratch: &mut Scratch, hits: &mut Hits) {
        scratch.stacks.fit(self.tree.levels);
        scratch.finalists.list.clear();
        hits.clear(self.rays.len);
        let mut next = self.rays.len.min(ACTIVE);
        let mut lens = [0; 3];
        for slot in 0..next {
            self.start(slot, slot, scratch);
            self.queue(slot, Item::node(0), &mut scratch.queues, &mut lens);
        }
        while lens[0] + lens[1] > 0 {
            for i in 0..std::mem::take(&mut lens[0]) {
                let Step { slot, item } = scratch.queues[0][i];
                let item = self.visit_node::<L>(slot as usize, item.index(), scratch);
                self.queue(slot as usize, item, &mut scratch.queues, &mut lens);
            }
            for i in 0..std::mem::take(&mut lens[1]) {
                let Step { slot, item } = scratch.queues[1][i];
                let item = self.visit_leaf::<L>(slot as usize, item.index(), scratch, hits);
                self.queue(slot as usize, item, &mut scratch.queues, &mut lens);
            }
            for i in 0..std::mem::take(&mut lens[2]) {
                let slot = scratch.queues[2][i].slot as usize;
                self.finish(slot, scratch);
                if next < self.rays.len {
                    self.start(slot, next, scratch);
                    next += 1;
                    self.queue(slot, Item::node(0), &mut scratch.queues, &mut lens);
                }
            }
        }
        for i in 0..scratch.finalists.list.len() {
            if let Some(&(_, ahead)) = scratch.finalists.list.get(i + 6) {
                prefetch(std::ptr::from_ref(self.facets.get(ahead)), 2);
            }
            let (ray, surface) = scratch.finalists.list[i];
            self.meet(ray, surface, hits);
        }
    }

    #[inline(always)]
    fn start(&self, slot: usize, ray: usize, scratch: &mut Scratch) {
        scratch.forms[slot] = Form::new(self.rays, ray, self.tree);
        scratch.stacks.clear(slot);
        scratch.candidates[slot].len = 0;
    }

    #[inline(always)]
    fn queue(&self, slot: usize, item: Item, queues: &mut Queues, lens: &mut [usize; 3]) {
        let kind = item.kind();
        for k in 0..3 {
            queues[k][lens[k]] = Step { slot: slot as u32, item };
            lens[k] += usize::from(k == kind);
        }
        let (base, size) = if item.kind() == 1 {
            (self.tree.leaves.as_ptr().cast::<u8>(), size_of::<Leaf>())
        } else {
            (self.tree.nodes.as_ptr().cast::<u8>(), size_of::<Node>())
        };
        prefetch(base.wrapping_add(item.index() * size), 4);
    }

    #[inline(always)]
    fn visit_node<L: Lanes>(&self, slot: usize, index: usize, scratch: &mut Scratch) -> Item {
        let form = &scratch.forms[slot];
        let rows = &self.tree.nodes[index].rows;
        let (mut enter, mut leave) = (L::splat(0.0), L::splat(form.best));
        for axis in 0..3 {
            let negative = (form.octant >> axis & 1) as usize;
            let inverse = L::splat(form.inverse[axis]);
            let near = L::load(&rows[2 * axis + negative]).mul_sub(inverse, L::splat(form.enter[axis]));
            let far = L::load(&rows[2 * axis + (1 - negative)]).mul_sub(inverse, L::splat(form.leave[axis]));
            enter = enter.max(near);
            leave = leave.min(far);
        }
        // The nearest last: it would go on top of the stack.
        let flip = (form.octant ^ 7) as usize;
        let enter = enter.flip_lanes(flip);
        let bits = L::bits(enter.le(leave.flip_lanes(flip)));
        let stacks = &mut scratch.stacks;
        let (below, top) = stacks.peek::<L>(slot, form.best);
        let nearest = (31 - (bits | 1).leading_zeros()) as usize;
        let child = Item(rows[Node::CHILDREN][(nearest ^ flip) & 7].to_bits());
        let start = stacks.top[slot];
        enter.compress(bits, row_mut(&mut stacks.enter, start));
        L::load(&rows[Node::CHILDREN]).flip_lanes(flip).compress(bits, row_mut(&mut stacks.items, start));
        let (next, top) = std::hint::select_unpredictable(
            bits == 0,
            (below, top),
            (child, start.wrapping_add(bits.count_ones() as usize).wrapping_sub(1)),
        );
        stacks.top[slot] = top;
        next
    }

    #[inline(always)]
    fn visit_leaf<L: Lanes>(
        &self,
        slot: usize,
        index: usize,
        scratch: &mut Scratch,
        hits: &mut Hits,
    ) -> Item {
        let form = &mut scratch.forms[slot];
        let rows = &self.tree.leaves[index].rows;
        let dot = |first: usize, v: &[L; 3]| {
            let sum = L::load(&rows[first]).mul(v[0]);
            let sum = L::load(&rows[first + 1]).mul_add(v[1], sum);
            L::load(&rows[first + 2]).mul_add(v[2], sum)
        };
        let [origin, direction] = [form.origin, form.direction].map(|v| v.map(L::splat));
        let approach = dot(0, &direction);
        let height = dot(0, &origin).sub(L::load(&rows[3]));
        let inverse = approach.recip();
        let t = L::splat(0.0).sub(height).mul(inverse);
        let error = t.abs().mul_add(L::splat(30.0 * ROUNDING), L::splat(form.uncertainty)).mul(inverse.abs());
        let point = [0, 1, 2].map(|axis| t.mul_add(direction[axis], origin[axis]));
        let u = dot(4, &point).sub(L::load(&rows[7]));
        let v = dot(8, &point).sub(L::load(&rows[11]));
        let steepness = L::load(&rows[Leaf::STEEPNESS]);
        let margin = steepness.abs().mul(error);
        let least = u.min(v);
        let greatest = u.max(v).add(least.where_negative(steepness));
        let (earliest, latest) = (t.sub(error), t.add(error));
        let [zero, one] = [0.0, 1.0].map(L::splat);

        let grazing = approach.abs().le(L::splat(16.0 * ROUNDING));
        let other = L::load(&rows[Leaf::SURFACE]).differs(form.from);
        let inside = L::and(zero.sub(margin).le(least), greatest.le(one.add(margin)));
        let ahead = L::and(earliest.le(L::splat(form.best)), zero.le(latest));
        let maybe = L::and(L::or(grazing, L::and(inside, ahead)), other);
        let surely_inside = L::and(margin.le(least), greatest.le(one.sub(margin)));
        // Not grazing: there the error is larger than 1, and t could not be.
        let surely = L::and(L::and(surely_inside, zero.le(earliest)), other);

        form.best = form.best.min(latest.least(surely));
        let bits = L::bits(maybe);
        let candidates = &mut scratch.candidates[slot];
        let len = candidates.len;
        earliest.compress(bits, row_mut(&mut candidates.t, len));
        L::load(&rows[Leaf::SURFACE]).compress(bits, row_mut(&mut candidates.surface, len));
        candidates.len = len + bits.count_ones() as usize;
        if candidates.len > CANDIDATES - LANES {
            self.settle(slot, scratch, hits);
        }
        let best = scratch.forms[slot].best;
        let (item, top) = scratch.stacks.peek::<L>(slot, best);
        scratch.stacks.top[slot] = top;
        item
    }

    /// Meets all candidates of a ray now.
    #[cold]
    fn settle(&self, slot: usize, scratch: &mut Scratch, hits: &mut Hits) {
        let candidates = &mut scratch.candidates[slot];
        let form = &mut scratch.forms[slot];
        for surface in &candidates.surface[..std::mem::take(&mut candidates.len)] {
            self.meet(form.ray, surface.to_bits(), hits);
        }
        form.best = form.best.min(((hits.t[form.ray as usize] * self.tree.scale) as f32).next_up());
    }

    #[inline(always)]
    fn finish(&self, slot: usize, scratch: &mut Scratch) {
        let Form { ray, best, .. } = scratch.forms[slot];
        let candidates = &scratch.candidates[slot];
        for i in 0..candidates.len {
            if candidates.t[i].partial_cmp(&best) != Some(std::cmp::Ordering::Greater) {
                scratch.finalists.list.push((ray, candidates.surface[i].to_bits()));
            }
        }
    }

    #[inline(always)]
    fn meet(&self, ray: u32, surface: u32, hits: &mut Hits) {
        let ray = ray as usize;
        let mut best = hits.get(ray);
        self.facets.meet(surface, &self.rays.get(ray), &mut best);
        if let Some(hit) = best {
            hits.set(ray, hit);
        }
    }
}
