//! Surfaces that coincide are layers: those in front cover those behind, and two that face each other with nothing
//! between exchange all their light through the gap, which has no thickness.

use glam::DVec3;
use radiosity::{Side, surfaces::Stack};

use crate::polygon::{CutPlane, Polygon, Polygons, area, doubled_area_vector, in_front};

/// The layers of a scene.
#[derive(Clone, Debug)]
pub(crate) struct PlaneLayers {
    surfaces: Vec<LayerMember>,
    tolerance: f64,
}

/// A surface among the layers of its plane.
#[derive(Clone, Debug, Default)]
struct LayerMember {
    /// Surfaces in front of its front, and of its back.
    covers: [Vec<u32>; 2],
    /// Planes through its edges, perpendicular to it, with their fronts outside. Empty where it is alone in its plane.
    prism: Vec<CutPlane>,
}

/// A part of one side of a surface.
pub(crate) struct SideRegion<'a> {
    pub surface: u32,
    pub side: Side,
    pub polygon: &'a [DVec3],
}

impl PlaneLayers {
    /// The layers of surfaces with these outlines, counterclockwise seen from their fronts. Lengths below `tolerance` [m]
    /// count as 0: surfaces that are nearer to each other without being in one of the `stacks` are layers by height.
    pub(crate) fn new(outlines: &[Polygon], stacks: &[Stack], tolerance: f64) -> Self {
        let mut layers = PlaneLayers { surfaces: vec![LayerMember::default(); outlines.len()], tolerance };
        let mut stack_of = vec![None; outlines.len()];
        for (number, stack) in stacks.iter().enumerate() {
            for (place, &surface) in stack.surfaces.iter().enumerate() {
                stack_of[surface as usize] = Some(number);
                let looks_up = doubled_area_vector(&outlines[surface as usize]).dot(stack.normal) > 0.0;
                let (above, below) = (&stack.surfaces[..place], &stack.surfaces[place + 1..]);
                above.iter().for_each(|&other| layers.put(surface, other, looks_up));
                below.iter().for_each(|&other| layers.put(surface, other, !looks_up));
            }
        }
        let planes: Vec<CutPlane> = outlines.iter().map(|outline| plane_of(outline)).collect();
        let areas: Vec<f64> = outlines.iter().map(|outline| area(outline)).collect();
        for (a, b) in (0..outlines.len()).flat_map(|a| (0..a).map(move |b| (a, b))) {
            // The plane of the larger one is known more exactly.
            let (large, small) = if areas[a] > areas[b] { (a, b) } else { (b, a) };
            let in_one_stack = stack_of[a].is_some() && stack_of[a] == stack_of[b];
            if in_one_stack || !layers.near(&outlines[small], &planes[large], &outlines[large]) {
                continue;
            }
            let [low, high] = planes[large].range(&outlines[small]);
            let in_front = low + high > 0.0;
            let same_way = planes[large].normal.dot(planes[small].normal) > 0.0;
            layers.put(large as u32, small as u32, in_front);
            layers.put(small as u32, large as u32, in_front != same_way);
        }
        for (layer, outline) in layers.surfaces.iter_mut().zip(outlines) {
            if !layer.covers.iter().all(Vec::is_empty) {
                layer.prism = prism(outline);
            }
        }
        layers
    }

    /// Notes that a surface has another one in front of its front, or else of its back.
    fn put(&mut self, surface: u32, other: u32, before_front: bool) {
        self.surfaces[surface as usize].covers[usize::from(!before_front)].push(other);
    }

    /// Whether a polygon lies in a plane, but for roundings, and overlaps with another one there.
    fn near(&self, polygon: &[DVec3], plane: &CutPlane, other: &[DVec3]) -> bool {
        let [low, high] = plane.range(polygon);
        low >= -self.tolerance && high <= self.tolerance && !self.common(polygon, other).is_empty()
    }

    /// The layers in front of a part of a surface.
    fn covers(&self, part: &SideRegion) -> &[u32] {
        &self.surfaces[part.surface as usize].covers[usize::from(part.side == Side::Back)]
    }

    /// What no layer in front covers of a part of a surface, in convex pieces.
    pub(crate) fn exposed(&self, part: &SideRegion) -> Vec<Polygon> {
        self.uncovered(part.polygon.to_vec(), self.covers(part))
    }

    /// A_iF_ij [m²] of parts of two layers that face each other: the area of their overlap that no layer between covers.
    /// `None` unless each has the other in front.
    pub(crate) fn exchange_area(&self, i: &SideRegion, j: &SideRegion) -> Option<f64> {
        let (before_i, before_j) = (self.covers(i), self.covers(j));
        if !before_i.contains(&j.surface) || !before_j.contains(&i.surface) {
            return None;
        }
        let between: Vec<u32> = before_i.iter().copied().filter(|layer| before_j.contains(layer)).collect();
        let pieces = self.uncovered(self.common(i.polygon, j.polygon), &between);
        Some(pieces.iter().map(|piece| area(piece)).sum())
    }

    /// What of a polygon no surface of these covers.
    fn uncovered(&self, polygon: Polygon, covering: &[u32]) -> Vec<Polygon> {
        let mut rest = Polygons::default();
        rest.begin(&polygon);
        for &surface in covering {
            rest.take_away(&self.surfaces[surface as usize].prism, self.tolerance);
        }
        rest.iter().map(<[DVec3]>::to_vec).collect()
    }

    /// The polygon that two polygons in one plane share; empty if they share none.
    fn common(&self, i: &[DVec3], j: &[DVec3]) -> Polygon {
        let inside = |polygon: Polygon, plane: CutPlane| in_front(&polygon, &plane.flipped(), self.tolerance);
        prism(j).into_iter().fold(i.to_vec(), inside)
    }
}

fn plane_of(polygon: &[DVec3]) -> CutPlane {
    CutPlane::through(polygon[0], doubled_area_vector(polygon))
}

/// Planes through the edges of a polygon that are perpendicular to it, with their fronts outside.
fn prism(polygon: &[DVec3]) -> Vec<CutPlane> {
    let normal = doubled_area_vector(polygon);
    let edges = polygon.iter().enumerate().map(|(k, &from)| (from, polygon[(k + 1) % polygon.len()]));
    edges.map(|(from, to)| CutPlane::through(from, (to - from).cross(normal))).collect()
}
