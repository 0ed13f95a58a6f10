//! Scenes that repeat along x and y without end, as the streets of a city do: one cell of them is walked in.
//!
//! A ray that leaves the cell through a side enters it again at the opposite one. The cell is the box of the scene, so that whatever a ray
//! meets in it is nearer than all that lies behind its sides. Each copy is met by the ray as it was, its origin shifted by whole periods:
//! nothing is added up along the way.

use std::sync::Arc;

use glam::DVec3;

use super::{Scene, SceneError};
use crate::geometry::surface::Surface;
use crate::simd::batch::WIDTH;
use crate::trace::ray::{Hits, Ray, Rays};
use crate::trace::tree::Scratch;

/// The most cells that a ray crosses along one axis. One that goes further is all but level, and escapes: with a period as long as the scene
/// is high, it rises by less than 10⁻⁶ of its length.
const FARTHEST: i64 = 1 << 20;

/// The number of the cell that a ray is in, along x and y.
type CellNumber = [i64; 2];

/// How a scene repeats.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Repeat {
    /// The periods along x and y [m]; infinite where there is one copy.
    periods: [f64; 2],
    /// The least and the largest coordinates of the scene, relative to its origin [m].
    low: DVec3,
    high: DVec3,
}

impl Repeat {
    /// The next cell that a ray enters; `None` where it leaves above or below all cells, or beside a single one.
    fn next(&self, ray: &Ray, cell: CellNumber) -> Option<CellNumber> {
        let ends = [0, 1].map(|axis| {
            let (along, forward) = (ray.direction[axis], ray.direction[axis] > 0.0);
            let side = match (self.periods[axis].is_finite(), forward) {
                (true, _) => self.low[axis] + self.periods[axis] * (cell[axis] + i64::from(forward)) as f64,
                (false, true) => self.high[axis],
                (false, false) => self.low[axis],
            };
            if along == 0.0 { f64::INFINITY } else { (side - ray.origin[axis]) / along }
        });
        let axis = usize::from(ends[1] < ends[0]);
        if !(ends[axis].is_finite() && self.periods[axis].is_finite()) {
            return None;
        }
        let (height, rise) = (ray.origin.z + ends[axis] * ray.direction.z, ray.direction.z);
        if rise >= 0.0 && height > self.high.z || rise <= 0.0 && height < self.low.z {
            return None;
        }
        let mut next = cell;
        next[axis] += ray.direction[axis].signum() as i64;
        (next[axis].abs() < FARTHEST).then_some(next)
    }

    /// A ray as the copy of the scene in a cell is met by it.
    fn shifted(&self, ray: &Ray, cell: CellNumber) -> Ray {
        let shift = [0, 1].map(|axis| match cell[axis] {
            0 => 0.0,
            steps => steps as f64 * self.periods[axis],
        });
        Ray { origin: ray.origin - DVec3::new(shift[0], shift[1], 0.0), from: Ray::FREE, ..*ray }
    }
}

/// The copies of a scene that rays meet behind the sides of its cell.
pub(crate) struct Copies {
    repeat: Repeat,
    rays: Box<Rays>,
    hits: Box<Hits>,
    /// Walks that look for a copy, each with the cell that it is in.
    waiting: Vec<(usize, CellNumber)>,
}

impl Copies {
    pub(crate) fn new(repeat: Repeat) -> Self {
        Copies { repeat, rays: Box::default(), hits: Box::default(), waiting: Vec::with_capacity(WIDTH) }
    }

    /// Lets the rays that have met nothing meet the copies of the scene, cell by cell.
    #[inline(never)]
    pub(crate) fn meet(
        &mut self,
        scene: &Scene,
        (rays, len): (&Rays, usize),
        scratch: &mut Scratch,
        hits: &mut Hits,
    ) {
        let Copies { repeat, rays: shifted, hits: found, waiting } = self;
        let parts = &*scene.parts;
        waiting.clear();
        waiting.extend((0..len).filter(|&lane| hits.surface[lane] == Hits::NONE).map(|lane| (lane, [0, 0])));
        loop {
            waiting.retain_mut(|(lane, cell)| {
                let next = repeat.next(&rays.get(*lane), *cell);
                *cell = next.unwrap_or(*cell);
                next.is_some()
            });
            if waiting.is_empty() {
                return;
            }
            shifted.len = 0;
            waiting.iter().for_each(|&(lane, cell)| shifted.push(&repeat.shifted(&rays.get(lane), cell)));
            parts.index.closest_hits(&parts.facets, shifted, scratch, found);
            let mut place = 0;
            waiting.retain(|&(lane, _)| {
                hits.take(lane, found, place);
                place += 1;
                hits.surface[lane] == Hits::NONE
            });
        }
    }
}

impl Scene {
    /// The scene in a plane of copies of itself, at steps of `periods` along x and y [m]; a period of 0 stands for one copy. Walks alone know of
    /// the copies: what else looks at the scene sees one.
    ///
    /// # Errors
    /// A scene that is longer than its period, whose copies would run through each other.
    pub fn repeated(&self, periods: [f64; 2]) -> Result<Self, SceneError> {
        let corners: Vec<DVec3> = self.surfaces().iter().flat_map(Surface::outline).collect();
        let first = corners.first().copied().unwrap_or_default();
        let [low, high] =
            corners.iter().fold([first; 2], |[low, high], &corner| [low.min(corner), high.max(corner)]);
        for (axis, name) in ["x", "y"].into_iter().enumerate() {
            let (period, length) = (periods[axis], high[axis] - low[axis]);
            // Rounding of corners is no overlap.
            if period != 0.0 && !(period.is_finite() && period >= length * (1.0 - 1e-9)) {
                return Err(SceneError::Whole(format!(
                    "the scene is {length} m long in {name}, and is to repeat every {period} m (copies would run through each other); give a period of at least its length, or 0 where it does not repeat"
                )));
            }
        }
        let finite = periods.map(|period| if period == 0.0 { f64::INFINITY } else { period });
        let mut hasher = blake3::Hasher::new();
        hasher.update(&self.hash()).update(b"repeats");
        for period in periods {
            hasher.update(&period.to_bits().to_le_bytes());
        }
        let mut parts = (*self.parts).clone();
        parts.repeat = Some(Repeat { periods: finite, low, high });
        parts.hash = *hasher.finalize().as_bytes();
        Ok(Scene { parts: Arc::new(parts) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::spec::{SceneSpec, Shape, Side, SurfaceSpec};
    use crate::random::rng::{Sequence, unit_32};
    use crate::scene::IndexChoice;

    const PERIODS: [f64; 2] = [3.0, 2.0];

    /// A street and a leaning roof, moved by a number of cells.
    fn cell(steps: [i32; 2]) -> Vec<SurfaceSpec> {
        let at = |x: f64, y: f64, z: f64| {
            DVec3::new(x + f64::from(steps[0]) * PERIODS[0], y + f64::from(steps[1]) * PERIODS[1], z)
        };
        let quad =
            |corner, corner_u, corner_v| Shape::Parallelogram { corner, corner_u, corner_v, cells: [1, 1] };
        [
            quad(at(0.0, 0.0, 0.0), at(3.0, 0.0, 0.0), at(0.0, 2.0, 0.0)),
            quad(at(0.5, 0.25, 0.0), at(0.5, 0.25, 1.5), at(0.5, 1.75, 0.0)),
            quad(at(1.5, 0.25, 0.0), at(1.5, 1.75, 0.0), at(1.5, 0.25, 1.0)),
            Shape::Triangle { a: at(0.5, 0.25, 1.5), b: at(1.5, 0.25, 1.0), c: at(0.5, 1.75, 1.5), rows: 1 },
            Shape::Triangle {
                a: at(2.25, 0.5, 0.25),
                b: at(2.75, 1.5, 0.25),
                c: at(2.25, 1.25, 1.25),
                rows: 1,
            },
        ]
        .map(|shape| SurfaceSpec::new(shape, 0.5).emitting(1.0))
        .into()
    }

    fn scene(surfaces: Vec<SurfaceSpec>) -> Scene {
        Scene::build(&SceneSpec::new(surfaces), IndexChoice::Auto).unwrap()
    }

    /// Rays in a cell that repeats meet what they meet in seven by seven cells, at the same place, unless they leave these through a side.
    #[test]
    fn rays_meet_what_they_meet_among_many_copies() {
        let steps = || (-3..=3).flat_map(|x| (-3..=3).map(move |y| [x, y]));
        let others = steps().filter(|steps| *steps != [0, 0]).flat_map(cell);
        let (one, many) = (scene(cell([0, 0])), scene(cell([0, 0]).into_iter().chain(others).collect()));
        assert!((one.origin() - many.origin()).length() < 1e-12);
        let repeated = one.repeated(PERIODS).unwrap();
        let mut copies = Copies::new(repeated.parts.repeat.unwrap());
        let (mut scratch, mut hits) = (Box::<Scratch>::default(), Box::<Hits>::default());
        let (mut met, mut left) = ([0; 2], 0);
        for batch in 0..40 {
            let mut rays = Box::<Rays>::default();
            let mut rng = Sequence::new(5).walk(batch);
            for lane in 0..WIDTH as u32 {
                let (from, side) = (lane % 5, if lane % 3 == 0 { Side::Back } else { Side::Front });
                let surface = &one.surfaces()[from as usize];
                let uv = surface.point_in_cell(0, [0, 1].map(|_| unit_32(rng.bits() as u32)));
                rays.push(&Ray {
                    origin: surface.point(uv),
                    direction: surface.direction(side, rng.bits()),
                    from,
                });
            }
            one.parts.index.closest_hits(&one.parts.facets, &rays, &mut scratch, &mut hits);
            copies.meet(&repeated, (&rays, WIDTH), &mut scratch, &mut hits);
            for lane in 0..WIDTH {
                let (ray, found) = (rays.get(lane), hits.get(lane));
                let truth = many.closest_hit(&ray);
                let Some(truth) = truth else {
                    // What leaves upwards or downwards before the last cell ends escapes; the rest is not known.
                    let ends = [10.5, 7.0]
                        .into_iter()
                        .zip(ray.direction.truncate().to_array())
                        .zip(ray.origin.to_array());
                    let end = ends.map(|((half, along), from)| (half * along.signum() - from) / along);
                    let height = ray.origin.z + end.fold(f64::INFINITY, f64::min) * ray.direction.z;
                    left += 1;
                    assert!(found.is_none() || height.abs() < 0.76, "{ray:?}: {found:?}");
                    continue;
                };
                let found = found.unwrap();
                assert_eq!((found.surface, found.side), (truth.surface % 5, truth.side), "{ray:?}");
                assert!((found.t - truth.t).abs() < 1e-12 * (1.0 + truth.t), "{ray:?}");
                met[usize::from(truth.surface >= 5)] += 1;
            }
        }
        assert!(met.iter().all(|count| *count > 500) && left > 500, "{met:?} {left}");
    }

    #[test]
    fn copies_must_not_run_through_each_other() {
        let one = scene(cell([0, 0]));
        let fault = one.repeated([3.0, 1.9]).unwrap_err().to_string();
        assert!(fault.contains("2 m long in y") && fault.contains("1.9 m"), "{fault}");
        assert!(one.repeated([f64::NAN, 2.0]).is_err());
        let hashes =
            [[0.0, 2.0], [3.0, 2.0], [3.0, 0.0]].map(|periods| one.repeated(periods).unwrap().hash());
        assert!(
            hashes.iter().all(|hash| *hash != one.hash()) && hashes[0] != hashes[1] && hashes[1] != hashes[2]
        );
    }
}
