//! From surfaces to a wide tree: obvhs builds a binary one, which is folded into nodes of sixteen children
//! and leaves of up to sixteen facets so that the expected work of a ray is least.

use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;

use super::binary::BinaryTree;
use super::layout::{CHILDREN, Item, LEAF_LINES, LEVELS, Leaf, Line, Node, Tree};
use crate::simd::isa::Isa;
use crate::simd::sixteen::{GROUP, GROUPS, LANES};
use crate::trace::facet::{Facet, Facets};

/// The work of a leaf, relative to that of a node.
const LEAF_WORK: f32 = 0.5;

impl Tree {
    /// A tree over facets, through which rays are traced on an instruction set.
    pub(crate) fn new(binary: &BinaryTree, facets: &Facets, isa: Isa) -> Self {
        let mut tree =
            Tree { lines: vec![], scale: binary.scale, slack: (facets.slack() * binary.scale) as f32, isa };
        Fold::new(binary).emit(&mut tree, facets);
        tree.lines.shrink_to_fit();
        tree
    }
}

/// The least expected work of a subtree of the binary tree, by how many slots of a wide node it may fill: the
/// dynamic program of Ylitie, Karras & Laine, *Efficient Incoherent Ray Traversal on GPUs Through Compressed
/// Wide BVHs* (HPG 2017), section 4.1. A ray's chance to open a box is taken as its surface area.
struct Fold<'a> {
    binary: &'a Bvh2,
    /// The boxes of the surfaces.
    boxes: &'a [Aabb],
    /// `work[n][i − 1]`: of subtree n in up to i slots.
    work: Vec<[f32; LANES]>,
    /// Facets under each node.
    facets: Vec<u32>,
}

impl<'a> Fold<'a> {
    fn new(BinaryTree { tree: binary, boxes, .. }: &'a BinaryTree) -> Self {
        let count = binary.nodes.len();
        let mut fold = Fold { binary, boxes, work: vec![[0.0; LANES]; count], facets: vec![0; count] };
        let mut order = vec![0];
        let mut next = 0;
        while next < order.len() {
            order.extend(fold.children(order[next]).into_iter().flatten());
            next += 1;
        }
        for &node in order.iter().rev() {
            fold.weigh(node);
        }
        fold
    }

    fn children(&self, node: usize) -> Option<[usize; 2]> {
        let node = &self.binary.nodes[node];
        (!node.is_leaf()).then_some([node.first_index as usize, node.first_index as usize + 1])
    }

    fn weigh(&mut self, node: usize) {
        let area = self.binary.nodes[node].aabb.half_area();
        let Some(children) = self.children(node) else {
            self.facets[node] = self.binary.nodes[node].prim_count;
            self.work[node] = [area * LEAF_WORK; LANES];
            return;
        };
        self.facets[node] = children.iter().map(|&child| self.facets[child]).sum();
        let as_node = area + self.split(children, LANES).0;
        let as_one = if self.fits_leaf(node) { as_node.min(area * LEAF_WORK) } else { as_node };
        let mut work = [as_one; LANES];
        for slots in 2..=LANES {
            work[slots - 1] = work[slots - 2].min(self.split(children, slots).0);
        }
        self.work[node] = work;
    }

    /// The best way to share `slots` ≥ 2 between two children: (work, slots of the first).
    fn split(&self, [a, b]: [usize; 2], slots: usize) -> (f32, usize) {
        (1..slots)
            .map(|first| (self.work[a][first - 1] + self.work[b][slots - first - 1], first))
            .fold((f32::INFINITY, 1), |best, way| if way.0 < best.0 { way } else { best })
    }

    fn fits_leaf(&self, node: usize) -> bool {
        self.facets[node] as usize <= GROUP
    }

    fn is_leaf(&self, node: usize) -> bool {
        let area = self.binary.nodes[node].aabb.half_area();
        self.fits_leaf(node) && area * LEAF_WORK <= self.work[node][0]
    }

    /// The subtrees that fill the slots of a wide node made of `node`.
    fn slots(&self, node: usize) -> Vec<usize> {
        let mut filled = vec![];
        let mut open = vec![];
        match self.children(node) {
            Some(children) => {
                let first = self.split(children, LANES).1;
                open.extend([(children[1], LANES - first), (children[0], first)]);
            }
            None => filled.push(node),
        }
        while let Some((node, slots)) = open.pop() {
            match self.children(node) {
                Some(children) if slots > 1 && self.split(children, slots).0 < self.work[node][0] => {
                    let first = self.split(children, slots).1;
                    open.extend([(children[1], slots - first), (children[0], first)]);
                }
                _ => filled.push(node),
            }
        }
        filled
    }

    /// Writes nodes and leaves, a parent before its children, a subtree in one piece.
    fn emit(&self, tree: &mut Tree, facets: &Facets) {
        let lines = &mut tree.lines;
        lines.extend(empty_node());
        let mut open = vec![(SlotContents::Subtree(0), 0, 1)];
        while let Some((source, first, level)) = open.pop() {
            for (slot, child) in self.parts(source, level).into_iter().enumerate() {
                let (next, bounds) = (lines.len(), self.bounds(&child));
                let item = if self.makes_leaf(&child) {
                    lines.extend(leaf(&self.surfaces_of(child), facets, tree.scale));
                    Item::new(Item::LEAF, next)
                } else {
                    lines.extend(empty_node());
                    open.push((child, next, level + 1));
                    Item::new(Item::NODE, next)
                };
                for axis in 0..3 {
                    lines[first + 2 * axis].0[slot] = bounds.min[axis];
                    lines[first + 2 * axis + 1].0[slot] = bounds.max[axis];
                }
                lines[first + CHILDREN].0[slot] = f32::from_bits(item.0);
            }
        }
    }

    /// What fills the slots of the wide node of a level: the best for a ray, but where the tree would become too deep for that as many facets
    /// for each.
    fn parts(&self, source: SlotContents, level: usize) -> Vec<SlotContents> {
        let subtree = match source {
            SlotContents::Subtree(node) if level + levels_of(self.facets[node]) <= LEVELS => node,
            other => {
                let surfaces = self.surfaces_of(other);
                let each = surfaces.len().div_ceil(LANES);
                return surfaces.chunks(each).map(|part| SlotContents::Surfaces(part.to_vec())).collect();
            }
        };
        self.slots(subtree).into_iter().map(SlotContents::Subtree).collect()
    }

    fn bounds(&self, part: &SlotContents) -> Aabb {
        match part {
            SlotContents::Subtree(node) => self.binary.nodes[*node].aabb,
            SlotContents::Surfaces(surfaces) => {
                let boxes = surfaces.iter().map(|&surface| self.boxes[surface as usize]);
                boxes.reduce(|all, one| all.union(&one)).expect("no part is empty")
            }
        }
    }

    fn makes_leaf(&self, part: &SlotContents) -> bool {
        match part {
            SlotContents::Subtree(node) => self.is_leaf(*node),
            SlotContents::Surfaces(surfaces) => surfaces.len() <= GROUP,
        }
    }

    fn surfaces_of(&self, part: SlotContents) -> Vec<u32> {
        match part {
            SlotContents::Subtree(node) => self.surfaces(node),
            SlotContents::Surfaces(surfaces) => surfaces,
        }
    }

    /// The surfaces under a node.
    fn surfaces(&self, node: usize) -> Vec<u32> {
        let mut surfaces = vec![];
        let mut open = vec![node];
        while let Some(node) = open.pop() {
            match self.children(node) {
                Some([a, b]) => open.extend([b, a]),
                None => {
                    let node = &self.binary.nodes[node];
                    let range = node.first_index as usize..(node.first_index + node.prim_count) as usize;
                    surfaces.extend(&self.binary.primitive_indices[range]);
                }
            }
        }
        surfaces
    }
}

/// What a slot of a wide node is filled with: a subtree of the binary tree, or surfaces.
enum SlotContents {
    Subtree(usize),
    Surfaces(Vec<u32>),
}

/// The levels of nodes that this many facets take where each node has as many of them in all of its slots.
fn levels_of(facets: u32) -> usize {
    let leaves = (facets as usize).div_ceil(GROUP).max(1);
    leaves.next_power_of_two().ilog2().div_ceil(LANES.ilog2()).max(1) as usize
}

/// A node without children: boxes that nothing can meet.
fn empty_node() -> Node {
    let [min, max] = [Line([f32::MAX; LANES]), Line([-f32::MAX; LANES])];
    [min, max, min, max, min, max, Line([0.0; LANES])]
}

/// The lines of a leaf.
fn leaf(surfaces: &[u32], facets: &Facets, scale: f64) -> [Line; LEAF_LINES] {
    let mut lines = [Line([f32::NAN; LANES]); LEAF_LINES];
    let mut write = |row: usize, lane: usize, number: f32| {
        lines[row / GROUPS].0[row % GROUPS * GROUP + lane] = number;
    };
    for (lane, &surface) in surfaces.iter().enumerate() {
        write(Leaf::SURFACE, lane, f32::from_bits(surface));
        for (row, number) in column(&facets.get(surface), scale).into_iter().enumerate() {
            write(Leaf::NORMAL + row, lane, number);
        }
    }
    lines
}

/// A facet in a leaf, from the row of its normal on.
fn column(facet: &Facet, scale: f64) -> [f32; Leaf::ROWS - 1] {
    let (n, u, v) = (facet.normal, facet.u_axis / scale, facet.v_axis / scale);
    let steepness = (u.length() + v.length()) * (1.0 + 1e-6);
    let signed = if facet.triangle { -steepness } else { steepness };
    let offset = facet.offset * scale;
    [n.x, n.y, n.z, offset, u.x, u.y, u.z, facet.u_offset, v.x, v.y, v.z, facet.v_offset, signed]
        .map(|number| number as f32)
}
