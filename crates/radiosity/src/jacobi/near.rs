//! Near light: what shadow rays cannot bring well.
//!
//! Where an emitter is near, k = cos θ cos θ′/(πr²) is large, and a shadow ray would bring a spike. Rays of links find a pair
//! of points with a density in proportion to k. The power heuristic (E. Veach & L. J. Guibas, *Optimally combining sampling
//! techniques for Monte Carlo rendering*, SIGGRAPH 1995, β = 2) weighs the two: a shadow ray brings k·k₀²/(k² + k₀²), k₀/2 at
//! most, and a ray of links the part k²/(k² + k₀²) of what it joins. k₀ is known before any ray is shot, so that it causes no
//! bias.

use super::cast::Meeting;
use super::faces::FaceTable;
use super::links::LinkTable;

/// k₀ over the k at which as many shadow rays as rays of links would find a pair of points.
const LEAN: f64 = 0.5;

/// A whole ray, in the units in which parts of rays are counted.
const WHOLE: f64 = 65_536.0;

/// k₀ of every pair of faces.
pub(super) struct NearThresholds {
    /// LEAN times the shadow rays per area of each face [1/m²].
    shadows: Vec<f64>,
    /// The rays of links per area of each face as far as they are known beforehand [1/m²].
    links: Vec<f64>,
    /// The part of all shadow rays that go to an area of each face [1/m²]; 0 where it does not emit.
    emitted: Vec<f64>,
}

impl NearThresholds {
    /// The bounds of chains in which each face shoots about `links` rays, and `shadows` shadow rays of which the part
    /// `emitted` goes to each face.
    pub(super) fn new(faces: &FaceTable, links: &[f64], shadows: &[u32], emitted: &[f64]) -> Self {
        let per_area = |rays: f64, area: &f64| rays / area;
        let areas = &faces.areas;
        NearThresholds {
            shadows: shadows
                .iter()
                .zip(areas)
                .map(|(&n, area)| per_area(LEAN * f64::from(n), area))
                .collect(),
            links: links.iter().zip(areas).map(|(&n, area)| per_area(n, area)).collect(),
            emitted: emitted.iter().zip(areas).map(|(&n, area)| per_area(n, area)).collect(),
        }
    }

    /// The rays of links per area of a face as far as they are known beforehand [1/m²].
    pub(super) fn links(&self, face: u32) -> f64 {
        self.links[face as usize]
    }

    /// k₀ of light from face j to face i [1/m²].
    fn of(&self, i: usize, j: usize) -> f64 {
        self.shadows[i] * self.emitted[j] / (self.links[i] + self.links[j])
    }

    /// What a shadow ray from face i to an emitter j brings of k of its ends [1/m²].
    pub(super) fn far(&self, i: u32, j: u32, kernel: f64) -> f64 {
        let over = kernel / self.of(i as usize, j as usize);
        kernel / (1.0 + over * over)
    }

    /// The part of a ray that joins face i to an emitter j that counts as near light, given k of its ends.
    fn part(&self, i: u32, j: u32, kernel: f64) -> u64 {
        let under = self.of(i as usize, j as usize) / kernel;
        (WHOLE / (1.0 + under * under) + 0.5) as u64
    }

    /// The parts of a ray between two faces along which near light arrives where it comes from, and where it goes to.
    pub(super) fn near_parts(&self, from: u32, to: u32, kernel: impl Fn() -> f64) -> [f64; 2] {
        if !self.emits(from) && !self.emits(to) {
            return [0.0; 2];
        }
        let kernel = kernel();
        [[from, to], [to, from]]
            .map(|[i, j]| if self.emits(j) { self.part(i, j, kernel) as f64 / WHOLE } else { 0.0 })
    }

    fn emits(&self, face: u32) -> bool {
        self.emitted[face as usize] > 0.0
    }
}

/// What a chain keeps of where its rays land. The rays of a face come one after the other.
pub(super) struct LandingCounts<'a> {
    pub(super) links: LinkTable,
    near: Option<Near<'a>>,
}

/// The rays that bring near light.
struct Near<'a> {
    bounds: &'a NearThresholds,
    /// Parts of rays along which light arrives where they come from, where they go to.
    ways: [LinkTable<u64>; 2],
}

impl<'a> LandingCounts<'a> {
    /// No ray yet, between `faces` faces; with `bounds`, near light counts apart.
    pub(super) fn new(faces: usize, bounds: Option<&'a NearThresholds>) -> Self {
        let near = bounds.map(|bounds| Near { bounds, ways: [0, 1].map(|_| LinkTable::new(faces)) });
        LandingCounts { links: LinkTable::new(faces), near }
    }

    /// The same with no ray yet.
    pub(super) fn empty(&self, faces: usize) -> Self {
        LandingCounts::new(faces, self.near.as_ref().map(|near| near.bounds))
    }

    /// Counts a ray.
    #[inline(always)]
    pub(super) fn count(&mut self, from: u32, to: u32, meeting: &Meeting) {
        self.links.count(from, to, 1);
        if let Some(near) = &mut self.near
            && (near.bounds.emits(from) || near.bounds.emits(to))
        {
            near.count(from, to, meeting.kernel());
        }
    }

    /// Closes the open row.
    pub(super) fn end_row(&mut self) {
        self.links.end_row();
        self.near.iter_mut().flat_map(|near| &mut near.ways).for_each(LinkTable::end_row);
    }

    /// Takes over the rows of one that goes on where this one ends, as [`LinkTable::join`] does.
    pub(super) fn join(&mut self, later: &Self) {
        self.links.join(&later.links);
        self.each_way(later, LinkTable::join);
    }

    /// Takes over the rows of one whose rays come after those of this one.
    pub(super) fn extend(&mut self, later: &Self) {
        self.links.extend(&later.links);
        self.each_way(later, LinkTable::extend);
    }

    fn each_way(&mut self, later: &Self, take: impl Fn(&mut LinkTable<u64>, &LinkTable<u64>)) {
        if let (Some(near), Some(later)) = (&mut self.near, &later.near) {
            near.ways.iter_mut().zip(&later.ways).for_each(|(own, later)| take(own, later));
        }
    }

    /// Calls `bring(i, j, K)` for all near light that arrives at a face i from an emitter j: the exchange area [m²] that it
    /// comes through, in a fixed order.
    pub(super) fn near_light(&self, shot: &[u32], areas: &[f64], mut bring: impl FnMut(usize, usize, f64)) {
        let density = |face: usize| f64::from(shot[face]) / areas[face];
        for (way, table) in self.near.iter().flat_map(|near| &near.ways).enumerate() {
            for link in table.links() {
                let ends = [link.from as usize, link.to as usize];
                let exchange = link.rays as f64 / WHOLE / (density(ends[0]) + density(ends[1]));
                bring(ends[way], ends[1 - way], exchange);
            }
        }
    }
}

impl Near<'_> {
    fn count(&mut self, from: u32, to: u32, kernel: f64) {
        for (table, [i, j]) in self.ways.iter_mut().zip([[from, to], [to, from]]) {
            let part = if self.bounds.emits(j) { self.bounds.part(i, j, kernel) } else { 0 };
            if part > 0 {
                table.count(from, to, part);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SceneSpec;
    use crate::scene::{IndexChoice, Scene};

    /// What shadow rays bring and what links bring is together the whole kernel, at any k.
    #[test]
    fn near_light_and_far_light_are_all_light() {
        let scene = Scene::build(&SceneSpec::furnace(1, 0.5), IndexChoice::Auto).unwrap();
        let faces = FaceTable::new(&scene);
        let emitted = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let bounds = NearThresholds::new(&faces, &[30.0; 6], &[10, 10, 10, 10, 10, 0], &emitted);
        let most = bounds.of(1, 0);
        assert!((most - LEAN * 10.0 / 60.0).abs() < 1e-15, "{most}");
        for k in [0.0, 0.5 * most, most, 1.5 * most, 100.0 * most] {
            let near = bounds.part(1, 0, k) as f64 / WHOLE * k;
            let far = bounds.far(1, 0, k);
            assert!((near + far - k).abs() <= k / WHOLE && far <= 0.5 * most, "{k}: {near} {far}");
        }
        assert_eq!(bounds.part(1, 0, f64::INFINITY) as f64, WHOLE, "layers in contact");
        assert_eq!(bounds.part(5, 0, 1e-9) as f64, WHOLE, "a face without shadow rays");
    }
}
