//! What a ray meets: a surface's plane and the map to its local coordinates.

use glam::DVec3;

use super::layers::Layers;
use super::stack::Stack;
use crate::executor::ParallelFor;
use crate::geometry::spec::Sides;
use crate::geometry::surface::Surface;
use crate::simd::table::Table;

/// What tracing needs of a surface: its plane and the affine map to its local coordinates. A facet is the
/// surface grown by the scene's slack on every edge, so that nothing falls through where two meet.
#[derive(Clone, Debug)]
pub(crate) struct Facet {
    pub(crate) normal: DVec3,
    /// n·x of the points x of the plane.
    pub(crate) offset: f64,
    pub(crate) u_axis: DVec3,
    pub(crate) u_offset: f64,
    pub(crate) v_axis: DVec3,
    pub(crate) v_offset: f64,
    pub(crate) triangle: bool,
    pub(crate) two_sided: bool,
}

impl Facet {
    /// The facet of a surface in the plane n·x = `offset`.
    fn new(surface: &Surface, offset: f64, slack: f64) -> Self {
        let normal = surface.normal();
        let [u_axis, v_axis] = surface.dual_basis();
        let (grow_u, grow_v) = (slack * u_axis.length(), slack * v_axis.length());
        let corner = surface.corner();
        let (scale_u, scale_v) = if surface.is_triangle() {
            let grow_w = slack * (u_axis + v_axis).length();
            let scale = 1.0 / (1.0 + grow_u + grow_v + grow_w);
            (scale, scale)
        } else {
            (1.0 / (1.0 + 2.0 * grow_u), 1.0 / (1.0 + 2.0 * grow_v))
        };
        Facet {
            normal,
            offset,
            u_axis: u_axis * scale_u,
            u_offset: (u_axis.dot(corner) - grow_u) * scale_u,
            v_axis: v_axis * scale_v,
            v_offset: (v_axis.dot(corner) - grow_v) * scale_v,
            triangle: surface.is_triangle(),
            two_sided: surface.sides() == Sides::Both,
        }
    }

    fn numbers(&self) -> [f64; FACET_NUMBERS] {
        let mut numbers = [0.0; FACET_NUMBERS];
        let planes = [(self.normal, self.offset), (self.u_axis, self.u_offset), (self.v_axis, self.v_offset)];
        for (plane, (axis, offset)) in numbers.chunks_exact_mut(4).zip(planes) {
            plane.copy_from_slice(&axis.extend(offset).to_array());
        }
        numbers[12] = f64::from(u8::from(self.triangle));
        numbers[13] = f64::from(u8::from(self.two_sided));
        numbers
    }

    #[inline(always)]
    fn from_numbers(numbers: &[f64; FACET_NUMBERS]) -> Self {
        let plane = |k: usize| (DVec3::from_slice(&numbers[4 * k..]), numbers[4 * k + 3]);
        let [(normal, offset), (u_axis, u_offset), (v_axis, v_offset)] = [0, 1, 2].map(plane);
        let (triangle, two_sided) = (numbers[12] != 0.0, numbers[13] != 0.0);
        Facet { normal, offset, u_axis, u_offset, v_axis, v_offset, triangle, two_sided }
    }
}

/// Numbers of a facet in a table.
const FACET_NUMBERS: usize = 16;

/// The facets of a scene in surface order.
#[derive(Clone, Debug)]
pub(crate) struct Facets {
    /// A row for each facet: normal and offset; axis and offset of u, and of v; 1 for a triangle, else 0; 1 for two sides,
    /// else 0.
    table: Table<FACET_NUMBERS>,
    slack: f64,
    /// Where some surfaces coincide.
    layers: Option<Layers>,
}

impl Facets {
    /// What the facets take of memory [bytes].
    pub(crate) fn bytes(&self) -> usize {
        self.table.bytes() + self.layers.as_ref().map_or(0, Layers::bytes)
    }

    /// The facets of surfaces of which some lie in the planes of stacks.
    pub(crate) fn new(surfaces: &[Surface], stacks: &[Stack], slack: f64, executor: &ParallelFor) -> Self {
        let mut offsets: Vec<f64> = surfaces.iter().map(|s| s.normal().dot(s.corner())).collect();
        let faces_normal =
            |surface: u32, stack: &Stack| surfaces[surface as usize].normal().dot(stack.normal) > 0.0;
        for stack in stacks {
            for &surface in &stack.surfaces {
                let same_way = faces_normal(surface, stack);
                offsets[surface as usize] = if same_way { stack.offset } else { -stack.offset };
            }
        }
        let numbers = |i: usize| Facet::new(&surfaces[i], offsets[i], slack).numbers();
        Facets {
            table: Table::make(executor, surfaces.len(), numbers),
            slack,
            layers: Layers::new(surfaces.len(), stacks, faces_normal),
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.table.len()
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = Facet> {
        (0..self.len() as u32).map(|surface| self.get(surface))
    }

    #[inline(always)]
    pub(crate) fn get(&self, surface: u32) -> Facet {
        Facet::from_numbers(self.table.row(surface))
    }

    /// The numbers of all.
    #[inline(always)]
    pub(crate) fn table(&self) -> &Table<FACET_NUMBERS> {
        &self.table
    }

    /// A ray will soon meet this facet.
    #[inline(always)]
    pub(crate) fn expect(&self, surface: u32) {
        self.table.expect(&[surface]);
        if let Some(layers) = &self.layers {
            layers.expect(surface);
        }
    }

    /// The layers, where some surfaces coincide.
    #[inline(always)]
    pub(crate) fn layers(&self) -> Option<&Layers> {
        self.layers.as_ref()
    }

    /// By how much facets are larger than their surfaces [m].
    pub(crate) fn slack(&self) -> f64 {
        self.slack
    }
}
