//! Walks whose work is counted: box tests, facet tests, steps to the patch.
//!
//! The program's own tree has sixteen children per node and counts nothing. This one is the tree of S97's argument: two
//! children per node, one ray at a time.

use glam::DVec3;
use radiosity::{
    Direction, IndexChoice, Scene, SceneSpec, Sequence, Shape, Side, WalkRng, methods::birth_probabilities,
    rays::Ray,
};

/// The work of tracing, counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct TraceWork {
    /// The number of rays.
    pub rays: u64,
    /// The number of boxes that rays were tested against, in a tree of the surfaces.
    pub boxes: u64,
    /// The number of surfaces that rays were tested against in it.
    pub facets: u64,
    /// The number of quarters that were chosen to find a patch on its surface by hierarchy.
    pub quarters: u64,
}

/// A node: its box, and two children or up to [`LEAF`] facets.
enum BoxTree {
    Split { bounds: [DVec3; 2], children: [Box<BoxTree>; 2] },
    Leaf { bounds: [DVec3; 2], facets: Vec<u32> },
}

/// The most facets in a leaf.
const LEAF: usize = 2;

/// A facet: one parallelogram.
struct Parallelogram {
    corner: DVec3,
    u: DVec3,
    v: DVec3,
}

/// A scene of parallelograms that counts the work done in it.
pub(crate) struct CountedScene {
    scene: Scene,
    facets: Vec<Parallelogram>,
    cells: Vec<[u32; 2]>,
    root: BoxTree,
}

impl CountedScene {
    /// The counted form of a closed scene.
    pub(crate) fn new(spec: &SceneSpec) -> Self {
        let scene = Scene::build(spec, IndexChoice::Tree).expect("scenes made by rule are valid");
        let facet = |shape: &Shape| {
            let (corner, u, v) = shape.edges();
            Parallelogram { corner: corner - scene.origin(), u, v }
        };
        let facets: Vec<Parallelogram> = spec.surfaces.iter().map(|surface| facet(&surface.shape)).collect();
        let cells = spec.surfaces.iter().map(|surface| match surface.shape {
            Shape::Parallelogram { cells, .. } => cells,
            Shape::Triangle { rows, .. } => [rows, rows],
            Shape::Divided { .. } => unreachable!("scenes made by rule have grids"),
        });
        let cells = cells.collect();
        let root = BoxTree::new(&facets, (0..facets.len() as u32).collect());
        CountedScene { scene, facets, cells, root }
    }

    /// The work of `walks` discrete analog walks of a direction.
    pub(crate) fn walk(&self, direction: &Direction, seed: u64, walks: u64) -> TraceWork {
        let births = self.births(direction);
        let sequence = Sequence::new(seed);
        let mut work = TraceWork::default();
        sequence.walks_from(0).take(walks as usize).for_each(|rng| self.one_walk(&births, rng, &mut work));
        work
    }

    /// The cumulative probabilities of births.
    fn births(&self, direction: &Direction) -> Vec<f64> {
        let powers: Vec<f64> = match direction {
            Direction::Gathering(birth) => birth_probabilities(&self.scene, birth),
            Direction::Shooting => {
                self.scene.faces().iter().map(|p| p.power(0) / self.scene.total_power(0)).collect()
            }
        };
        let sums = powers.into_iter().scan(0.0, |sum, p| {
            *sum += p;
            Some(*sum)
        });
        sums.collect()
    }

    fn one_walk(&self, births: &[f64], mut rng: WalkRng, work: &mut TraceWork) {
        let lot = uniform(&mut rng);
        let mut patch = births.partition_point(|&sum| sum <= lot).min(births.len() - 1) as u32;
        loop {
            let number = self.scene.faces().get(patch as usize).surface;
            let surface = &self.scene.surfaces()[number as usize];
            let uv = [uniform(&mut rng), uniform(&mut rng)];
            let uv = surface.inside(surface.point_in_cell(patch - surface.piece(0, Side::Front), uv));
            let direction = surface.direction(Side::Front, rng.bits());
            let ray = Ray { origin: surface.point(uv), direction, from: number };
            let Some(hit) = self.scene.closest_hit(&ray) else { return };
            work.rays += 1;
            let found = self.find(&ray, work);
            debug_assert!(found.is_some_and(|(_, t)| (t - hit.t).abs() < 1e-9), "{found:?} {hit:?}");
            work.quarters += descents(self.cells[hit.surface as usize]);
            let surface = &self.scene.surfaces()[hit.surface as usize];
            if !surface.survives(rng.bits()) {
                return;
            }
            patch = surface.piece(surface.cell_at(hit.uv), hit.side);
        }
    }

    /// The nearest facet along a ray and its t.
    fn find(&self, ray: &Ray, work: &mut TraceWork) -> Option<(u32, f64)> {
        let mut nearest = None;
        self.visit(&self.root, ray, &mut nearest, work);
        nearest
    }

    fn visit(&self, node: &BoxTree, ray: &Ray, nearest: &mut Option<(u32, f64)>, work: &mut TraceWork) {
        match node {
            BoxTree::Leaf { facets, .. } => {
                for &number in facets.iter().filter(|&&number| number != ray.from) {
                    work.facets += 1;
                    let limit = nearest.map_or(f64::INFINITY, |(_, t)| t);
                    if let Some(t) = self.facets[number as usize].meet(ray).filter(|&t| t < limit) {
                        *nearest = Some((number, t));
                    }
                }
            }
            BoxTree::Split { children, .. } => {
                work.boxes += 2;
                let entries = children.each_ref().map(|child| entry(child.bounds(), ray));
                let first = usize::from(entries[1] < entries[0]);
                for child in [first, 1 - first] {
                    if entries[child] < nearest.map_or(f64::INFINITY, |(_, t)| t) {
                        self.visit(&children[child], ray, nearest, work);
                    }
                }
            }
        }
    }
}

/// The number of halvings of both sides until one cell is left.
fn descents([nu, nv]: [u32; 2]) -> u64 {
    u64::from(nu.max(nv).next_power_of_two().ilog2())
}

fn uniform(rng: &mut WalkRng) -> f64 {
    ((rng.bits() >> 11) as f64 + 0.5) * (1.0 / (1_u64 << 53) as f64)
}

/// The distance at which a ray enters a box; infinite if it misses.
fn entry([low, high]: [DVec3; 2], ray: &Ray) -> f64 {
    const SLACK: f64 = 1e-9;
    let inverse = ray.direction.recip();
    let (a, b) = ((low - ray.origin - SLACK) * inverse, (high - ray.origin + SLACK) * inverse);
    let (near, far) = (a.min(b).max_element().max(0.0), a.max(b).min_element());
    if near <= far { near } else { f64::INFINITY }
}

impl Parallelogram {
    fn corners(&self) -> [DVec3; 4] {
        [self.corner, self.corner + self.u, self.corner + self.v, self.corner + self.u + self.v]
    }

    /// The t at which the ray meets the facet, edges and a little more included.
    fn meet(&self, ray: &Ray) -> Option<f64> {
        let normal = self.u.cross(self.v);
        let approach = normal.dot(ray.direction);
        let t = normal.dot(self.corner - ray.origin) / approach;
        let offset = ray.origin + ray.direction * t - self.corner;
        let square = normal.length_squared();
        let (u, v) = (offset.cross(self.v).dot(normal) / square, self.u.cross(offset).dot(normal) / square);
        let inside = |x: f64| (-1e-9..=1.0 + 1e-9).contains(&x);
        (approach != 0.0 && t > 0.0 && inside(u) && inside(v)).then_some(t)
    }
}

impl BoxTree {
    /// Halves the facets along the longest side of their middles.
    fn new(facets: &[Parallelogram], mut members: Vec<u32>) -> Self {
        let corners = members.iter().flat_map(|&i| facets[i as usize].corners());
        let bounds =
            corners.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], p| [low.min(p), high.max(p)]);
        if members.len() <= LEAF {
            return BoxTree::Leaf { bounds, facets: members };
        }
        let middle = |i: u32| {
            let facet = &facets[i as usize];
            facet.corner + 0.5 * (facet.u + facet.v)
        };
        let spread = members.iter().fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], &i| {
            [low.min(middle(i)), high.max(middle(i))]
        });
        let axis = (spread[1] - spread[0]).max_position();
        members.sort_by(|&a, &b| middle(a)[axis].total_cmp(&middle(b)[axis]).then(a.cmp(&b)));
        let upper = members.split_off(members.len() / 2);
        BoxTree::Split { bounds, children: [members, upper].map(|half| Box::new(BoxTree::new(facets, half))) }
    }

    fn bounds(&self) -> [DVec3; 2] {
        match self {
            BoxTree::Split { bounds, .. } | BoxTree::Leaf { bounds, .. } => *bounds,
        }
    }
}

#[cfg(test)]
mod tests {
    use radiosity::Birth;

    use super::*;

    /// Every ray of two thousand walks finds the same facet in the counted tree as in the program's own (`debug_assert`
    /// in `one_walk`).
    #[test]
    fn the_counted_tree_finds_what_the_programs_tree_finds() {
        for spec in [scenes::cube_of_surfaces(4), scenes::room(4)] {
            let counted = CountedScene::new(&spec);
            for direction in [Direction::Shooting, Direction::Gathering(Birth::Area)] {
                let work = counted.walk(&direction, 7, 1_000);
                assert!(work.rays > 1_500 && work.boxes > work.rays && work.facets > work.rays, "{work:?}");
            }
        }
    }

    #[test]
    fn a_surface_of_n_cells_takes_log_n_halvings() {
        assert_eq!([1, 2, 3, 4, 5, 24].map(|n| descents([n, 1])), [0, 1, 2, 2, 3, 5]);
    }
}
