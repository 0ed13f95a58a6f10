//! Contacts: edges that miss their neighbours.

use std::collections::BTreeMap;

use glam::DVec3;
use radiosity::{Scene, SceneSpec, Shape, rays::Ray};

use crate::finding::{Finding, Kind};
use crate::nearby::{NearPoint, Nearby, triangles};
use crate::pierce::pierces;
use crate::pilot::{Draws, LightPilot, extent};

/// The number of points on every edge at which neighbours are looked for; in large scenes fewer, [`MOST_POINTS`] in
/// all.
const EDGE_POINTS: usize = 8;
const MOST_POINTS: usize = 300_000;

/// The most points at gaps from which rays look for a way out; of more points, a regular sample.
const MOST_GAPS: usize = 4096;

/// The part of the scene's extent below which an edge was meant to touch another surface.
const GAP: f64 = 5e-3;

/// The part of the extent below which gaps are cracks: vertices that were not merged, or T-junctions.
const CRACK: f64 = 1e-4;

/// The number of rays that look for a way out of a gap.
const GAP_RAYS: u32 = 256;

/// A point on an edge that no other surface touches.
struct Free {
    surface: u32,
    point: DVec3,
    /// The length of edge that the point stands for [m].
    length: f64,
    /// The nearest other surface within the gap.
    nearest: Option<NearPoint>,
}

impl Free {
    /// Whether the point's own surface reaches it only through the nearest one: a leg that ends beneath the floor leaves
    /// no gap there.
    fn is_beyond(&self, spec: &SceneSpec) -> bool {
        let Some(near) = self.nearest else { return false };
        let corners = spec.surfaces[self.surface as usize].shape.corners();
        let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let nearest = &spec.surfaces[near.surface as usize].shape;
        triangles(nearest).iter().any(|triangle| pierces([middle, self.point], triangle))
    }
}

/// All contacts of a scene.
pub(crate) struct Contacts {
    free: Vec<Free>,
    extent: f64,
}

impl Contacts {
    pub(crate) fn find(spec: &SceneSpec, scene: &Scene) -> Self {
        let (nearby, extent) = (Nearby::new(spec), extent(scene));
        // Edges touch if only rounding parts them; facets are larger than their surfaces by 2⁻⁴⁶ of the largest
        // coordinate.
        let corners = spec.surfaces.iter().flat_map(|surface| surface.shape.corners());
        let largest = corners.fold(extent, |largest, corner| largest.max(corner.abs().max_element()));
        let touch = largest / (1_u64 << 45) as f64;
        let count = spec.surfaces.len();
        let on_edges = (MOST_POINTS / (4 * count)).clamp(1, EDGE_POINTS) as u32;
        let mut contacts = Contacts { free: Vec::new(), extent };
        for number in 0..count as u32 {
            let shape = &spec.surfaces[number as usize].shape;
            for (start, end) in edges(shape) {
                let edge = ProbedEdge { surface: number, start, end, points: on_edges };
                let free = edge.free_points(&nearby, touch, GAP * extent);
                contacts.free.extend(free.filter(|free| !free.is_beyond(spec)));
            }
        }
        contacts
    }

    /// Gaps between an edge and its neighbour that light leaves the scene through, a finding for each pair of surfaces.
    pub(crate) fn leaks(&self, scene: &Scene, pilot: &LightPilot) -> Vec<Finding> {
        let mut pairs: BTreeMap<[u32; 2], (f64, f64, DVec3)> = BTreeMap::new();
        let near_gaps = self.free.iter().filter(|free| free.nearest.is_some());
        let every = near_gaps.clone().count() / MOST_GAPS + 1;
        for free in near_gaps.step_by(every) {
            let Some(near) = free.nearest.filter(|near| leads_out(scene, pilot, free, near)) else {
                continue;
            };
            let pair = [free.surface.min(near.surface), free.surface.max(near.surface)];
            let (area, width, _) = pairs.entry(pair).or_insert((0.0, 0.0, free.point));
            *area += near.distance * free.length * every as f64;
            *width = width.max(near.distance);
        }
        let walls: f64 = scene.faces().iter().map(|face| face.area).sum();
        let finding = |([a, b], (area, width, point)): ([u32; 2], (f64, f64, DVec3))| {
            let kind = if width < CRACK * self.extent { Kind::Crack } else { Kind::Leak };
            Finding {
                kind,
                surfaces: vec![a, b],
                // The power is taken as if the gap were a part of the walls: light is about alike everywhere.
                power: pilot.power * area / walls,
                message: format!(
                    "between {} and {} is a gap of {width:.3e} m near {}: light gets out",
                    scene.surface_name(a),
                    scene.surface_name(b),
                    place(point)
                ),
            }
        };
        pairs.into_iter().map(finding).collect()
    }

    /// The surfaces whose free edges pass nearest to rays out of the scene, most rays first.
    pub(crate) fn rims(&self, scene: &Scene, ways_out: &[Ray]) -> Vec<u32> {
        // Of many free edges, a sample is examined.
        let every = self.free.len() / 4096 + 1;
        let mut counts: BTreeMap<u32, u32> = BTreeMap::new();
        for ray in ways_out {
            let away = |free: &Free| {
                let towards = free.point - scene.origin() - ray.origin;
                let along = towards.dot(ray.direction).max(0.0);
                (towards - ray.direction * along).length_squared()
            };
            let free = self.free.iter().step_by(every).filter(|free| free.surface != ray.from);
            if let Some(nearest) = free.min_by(|a, b| away(a).total_cmp(&away(b))) {
                *counts.entry(nearest.surface).or_default() += 1;
            }
        }
        let mut rims: Vec<(u32, u32)> = counts.into_iter().collect();
        rims.sort_by_key(|&(_, count)| std::cmp::Reverse(count));
        rims.into_iter().map(|(surface, _)| surface).collect()
    }
}

fn edges(shape: &Shape) -> Vec<(DVec3, DVec3)> {
    let corners = shape.corners();
    (0..corners.len()).map(|i| (corners[i], corners[(i + 1) % corners.len()])).collect()
}

/// An edge and the number of points at which it is examined.
struct ProbedEdge {
    surface: u32,
    start: DVec3,
    end: DVec3,
    points: u32,
}

impl ProbedEdge {
    /// The points that no other surface touches, with the nearest within `gap` [m].
    fn free_points(self, nearby: &Nearby, touch: f64, gap: f64) -> impl Iterator<Item = Free> {
        let ProbedEdge { surface, start, end, points } = self;
        (0..points).filter_map(move |i| {
            let point = start.lerp(end, (f64::from(i) + 0.5) / f64::from(points));
            let nearest = nearby.nearest(point, surface, touch..gap);
            let touches = nearest.is_some_and(|nearest| nearest.distance <= touch);
            let length = start.distance(end) / f64::from(points);
            (!touches).then_some(Free { surface, point, length, nearest })
        })
    }
}

/// Whether rays from the middle of a gap leave the scene, and others arrive at sides that the pilot has seen lit: beneath
/// a floor, by the foot of a leg that goes through it, they arrive at the floor's underside, where no light is.
fn leads_out(scene: &Scene, pilot: &LightPilot, free: &Free, near: &NearPoint) -> bool {
    let middle = 0.5 * (free.point + near.point) - scene.origin();
    let mut draws = Draws::new(u64::from(free.surface) ^ middle.x.to_bits());
    let (mut out, mut inside) = (false, false);
    for _ in 0..GAP_RAYS {
        let z = 2.0 * draws.uniform() - 1.0;
        let (sin, cos) = (std::f64::consts::TAU * draws.uniform()).sin_cos();
        let across = (1.0 - z * z).sqrt();
        let direction = DVec3::new(across * cos, across * sin, z);
        match scene.closest_hit(&Ray { origin: middle, direction, from: Ray::FREE }) {
            None => out = true,
            Some(hit) => inside |= pilot.is_lit(hit.surface, hit.side) && hit.t > near.distance,
        }
    }
    out && inside
}

pub(crate) fn place(point: DVec3) -> String {
    format!("({:.3}, {:.3}, {:.3})", point.x, point.y, point.z)
}
