//! No index: every facet is met in turn by many rays side by side. The fastest for a handful of surfaces.
//!
//! A sketch of the facets in f32 says which one a ray meets first and how near any other may be, with bounds on all
//! that f32 rounds away. Then the one facet is met in full, and that is the answer if its t is below the bound of
//! the others. In the few cases that the sketch cannot decide, every facet is met in full. Of a wall of a closed room,
//! which nothing is behind, the sketch is that of its plane: beyond the wall's edge a ray has met another wall before.

use glam::DVec3;

use crate::geometry::surface::Surface;
use crate::simd::batch::WIDTH;
use crate::simd::isa::{Isa, on_isa};
use crate::simd::real::Real;
use crate::trace::facet::{Facet, Facets};
use crate::trace::layers::Layers;
use crate::trace::meet::{Best, FacetLanes, RayLanes, meet, meet_layer, meet_one};
use crate::trace::ray::{Hits, Rays};

/// Scenes of more surfaces are traced flat only to check the tree: there every facet is met in full.
const MOST_SKETCHES: usize = 4096;

/// The flat index: every ray meets every facet.
#[derive(Clone, Debug)]
pub(crate) struct Flat {
    /// What rays are traced with.
    isa: Isa,
    /// Alike ones side by side. Empty where they do not pay, or f32 cannot hold the scene.
    sketches: Vec<Sketch>,
    /// The bounds of the sketches hold of rays that begin at coordinates up to this [m].
    reach: f32,
}

impl Flat {
    /// What the sketches take of memory [bytes].
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&self.sketches[..])
    }

    /// The index of these surfaces; many rays begin as far out as `births` [m], beside those that begin on surfaces.
    pub(crate) fn new(isa: Isa, surfaces: &[Surface], facets: &Facets, births: f64) -> Self {
        // Without vectors of f32 to speak of, meeting facets in full takes less time.
        if isa == Isa::Portable || surfaces.len() > MOST_SKETCHES {
            return Flat { isa, sketches: Vec::new(), reach: 0.0 };
        }
        let corners: Vec<DVec3> = surfaces.iter().flat_map(|surface| surface.outline()).collect();
        let reach = corners.iter().fold(0.0_f64, |reach, corner| reach.max(corner.abs().max_element()));
        // Rays from farther away are met in full.
        let reach = reach.max(births.min(MOST_BIRTHS * reach));
        let walls = walls(surfaces, &corners, facets);
        let plane = |number| facets.layers().map_or(number, |layers| layers.plane(number));
        let sketch = |((number, facet), wall)| Sketch {
            plane: plane(number),
            ..Sketch::new(number, &facet, wall, reach, facets.slack())
        };
        let mut sketches: Vec<Sketch> = (0..).zip(facets.iter()).zip(walls).map(sketch).collect();
        sketches.sort_by_key(|sketch| sketch.part);
        let holds = (1e-9..1e9).contains(&reach) && sketches.iter().all(|sketch| sketch.uv_margin < 1e9);
        Flat { isa, sketches: if holds { sketches } else { Vec::new() }, reach: (reach * ROUNDED_UP) as f32 }
    }

    /// How many sketches are those of planes.
    #[cfg(test)]
    pub(crate) fn walls(&self) -> usize {
        self.sketches.iter().filter(|sketch| sketch.part == FacetPart::Plane).count()
    }

    /// The least (t, rank) among the facets that each ray meets.
    pub(crate) fn closest_hits(&self, facets: &Facets, rays: &Rays, hits: &mut Hits) {
        let flat = self;
        match facets.layers() {
            None => on_isa!(self.isa, distinct(flat: &Flat, facets: &Facets, rays: &Rays, hits: &mut Hits)),
            Some(layers) => {
                on_isa!(self.isa, layered(flat: &Flat, facets: &Facets, layers: &Layers, rays: &Rays, hits: &mut Hits));
            }
        }
    }
}

/// Which facets are walls of a closed room: all corners lie before their planes or on them, nothing else is on the same
/// plane, and the areas of all such, as vectors along their normals, cancel. Where a lid is missing they do not, and rays that
/// leave through it would be sketched in vain. Where this test is wrong, tracing takes longer and finds the same hits.
fn walls(surfaces: &[Surface], corners: &[DVec3], facets: &Facets) -> Vec<bool> {
    /// 1 − cos of the least angle between different planes.
    const APART: f64 = 1e-6;
    const OPEN: f64 = 1e-6;
    let before = |facet: &Facet, corner: &DVec3| facet.normal.dot(*corner) - facet.offset >= -facets.slack();
    let is_outmost = |facet: &Facet| corners.iter().all(|corner| before(facet, corner));
    let outmost: Vec<(usize, DVec3)> = facets
        .iter()
        .enumerate()
        .filter_map(|(number, facet)| is_outmost(&facet).then_some((number, facet.normal)))
        .collect();
    let areas = outmost.iter().map(|&(number, _)| {
        let [u, v] = surfaces[number].edges();
        u.cross(v) * if surfaces[number].is_triangle() { 0.5 } else { 1.0 }
    });
    let (sum, all) = areas.fold((DVec3::ZERO, 0.0), |(sum, all), area| (sum + area, all + area.length()));
    let mut walls = vec![false; surfaces.len()];
    if sum.length() <= OPEN * all {
        for &(number, normal) in &outmost {
            let alike = outmost.iter().filter(|other| other.1.dot(normal) > 1.0 - APART).count();
            walls[number] = alike == 1;
        }
    }
    walls
}

/// Births farther out than this, in the coordinates of surfaces, would make the bounds of all rays too loose.
const MOST_BIRTHS: f64 = 16.0;

/// Points of the corners and births are within reach after every rounding.
const ROUNDED_UP: f64 = 1.0 + 1e-5;

/// Rays that are sketched side by side.
const SKETCHED: usize = 16;

/// A facet in f32, and bounds on the errors of what is computed with it.
///
/// With unit roundoff ε = 2⁻²⁴, |o| ≤ S on every axis and |d| = 1, the plane or coordinate n·o − c costs an error
/// of at most (5NS + 4|c|)ε, N = Σ|n_k|: one ε for rounding n, one for o, three for the sums; and n·d one of 5Nε.
/// The bounds below add these up and double the sum.
#[derive(Clone, Debug)]
struct Sketch {
    /// The number of the surface.
    number: u32,
    /// The least surface in its plane, where surfaces coincide.
    plane: u32,
    normal: [f32; 3],
    offset: f32,
    u_axis: [f32; 3],
    u_offset: f32,
    v_axis: [f32; 3],
    v_offset: f32,
    part: FacetPart,
    /// A bound on the rounding error of the height over the plane, with the slack of facets.
    height_margin: f32,
    /// A bound on the rounding error of u·|n·d|, of v·|n·d| and of their sum.
    uv_margin: f32,
}

/// What of a facet is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum FacetPart {
    Plane,
    Triangle,
    Parallelogram,
}

/// The bound on the error of n·d.
const APPROACH_MARGIN: f32 = 2.0 * 5.0 * 1.7320509 * EPSILON;
/// The unit roundoff of f32.
const EPSILON: f32 = f32::EPSILON / 2.0;

impl Sketch {
    /// The sketch of a facet, or of its plane where it is a `wall`, in a scene whose points have coordinates up to `reach`.
    /// Starts within `slack` of the plane count as on it.
    fn new(number: u32, facet: &Facet, wall: bool, reach: f64, slack: f64) -> Self {
        let epsilon = f64::from(EPSILON);
        let one_norm = |axis: DVec3| axis.abs().element_sum();
        let (n, s) = (one_norm(facet.normal), reach);
        let height = n * s + facet.offset.abs();
        let height_error = (5.0 * n * s + 4.0 * facet.offset.abs()) * epsilon;
        // The error of (x·o − c)|n·d| + h(x·d).
        let uv_error = |axis: DVec3, offset: f64| {
            let a = one_norm(axis);
            let coordinate = a * s + offset.abs();
            (5.0 * a * s + 4.0 * offset.abs()) * epsilon
                + coordinate * 5.0 * n * epsilon
                + height_error * a
                + height * 5.0 * a * epsilon
                + 2.0 * (coordinate + height * a) * epsilon
        };
        let uv = uv_error(facet.u_axis, facet.u_offset) + uv_error(facet.v_axis, facet.v_offset);
        let narrow = |axis: DVec3| axis.as_vec3().to_array();
        Sketch {
            number,
            plane: number,
            normal: narrow(facet.normal),
            offset: facet.offset as f32,
            u_axis: narrow(facet.u_axis),
            u_offset: facet.u_offset as f32,
            v_axis: narrow(facet.v_axis),
            v_offset: facet.v_offset as f32,
            part: match (wall, facet.triangle) {
                (true, _) => FacetPart::Plane,
                (false, true) => FacetPart::Triangle,
                (false, false) => FacetPart::Parallelogram,
            },
            height_margin: (2.0 * height_error + slack) as f32,
            uv_margin: (2.0 * uv) as f32,
        }
    }
}

/// The findings of the sketches for some rays.
struct Guess {
    /// A lower bound of the least t, and whose it is; `Hits::NONE` where nothing can be met.
    t: [f32; SKETCHED],
    surface: [u32; SKETCHED],
    /// A lower bound of every other t.
    other: [f32; SKETCHED],
}

/// Where no surfaces coincide.
#[inline(always)]
fn distinct<R: Real>(flat: &Flat, facets: &Facets, rays: &Rays, hits: &mut Hits) {
    closest_hits::<R, false>(flat, facets, None, rays, hits);
}

/// Finds the closest hits where some surfaces coincide.
#[inline(always)]
fn layered<R: Real>(flat: &Flat, facets: &Facets, layers: &Layers, rays: &Rays, hits: &mut Hits) {
    closest_hits::<R, true>(flat, facets, Some(layers), rays, hits);
}

/// `LAYERED` is whether there are layers.
#[inline(always)]
fn closest_hits<R: Real, const LAYERED: bool>(
    flat: &Flat,
    facets: &Facets,
    layers: Option<&Layers>,
    rays: &Rays,
    hits: &mut Hits,
) {
    for first in (0..rays.len.min(WIDTH)).step_by(SKETCHED) {
        // Closures would not be compiled for the instruction set.
        let guess = if flat.sketches.is_empty() {
            None
        } else {
            Some(guess::<R, LAYERED>(flat, &Starts::new(layers, rays, first)))
        };
        for part in (0..SKETCHED).step_by(R::N).filter(|part| first + part < rays.len) {
            let taken = u64::MAX >> (64 - (rays.len - first - part).min(R::N));
            let certain = match &guess {
                Some(guess) => decide::<R>((facets, layers), rays, first, part, guess, hits),
                None => 0,
            };
            if certain & taken != taken {
                meet_all::<R>(facets, layers, rays, first + part, hits);
            }
        }
    }
}

/// Some rays in f32.
struct Starts {
    origin: [[f32; SKETCHED]; 3],
    direction: [[f32; SKETCHED]; 3],
    /// The surfaces that they leave.
    from: [u32; SKETCHED],
    /// The planes of these, where surfaces coincide.
    plane: [u32; SKETCHED],
}

impl Starts {
    #[inline(always)]
    fn new(layers: Option<&Layers>, rays: &Rays, first: usize) -> Self {
        let (mut origin, mut direction) = ([[0.0; SKETCHED]; 3], [[0.0; SKETCHED]; 3]);
        for axis in 0..3 {
            for lane in 0..SKETCHED {
                origin[axis][lane] = rays.origin[axis][first + lane] as f32;
                direction[axis][lane] = rays.direction[axis][first + lane] as f32;
            }
        }
        let mut from = [0; SKETCHED];
        from.copy_from_slice(&rays.from[first..][..SKETCHED]);
        let mut plane = [0; SKETCHED];
        if let Some(layers) = layers {
            for (plane, &from) in plane.iter_mut().zip(&from) {
                *plane = layers.plane(from);
            }
        }
        Starts { origin, direction, from, plane }
    }
}

/// The first facet that each ray may meet.
#[inline(always)]
fn guess<R: Real, const LAYERED: bool>(flat: &Flat, starts: &Starts) -> Guess {
    let mut guess = Guess {
        t: [f32::INFINITY; SKETCHED],
        surface: [Hits::NONE; SKETCHED],
        other: [f32::INFINITY; SKETCHED],
    };
    for row in &starts.origin {
        for (other, coordinate) in guess.other.iter_mut().zip(row) {
            *other = if coordinate.abs() <= flat.reach { *other } else { f32::NEG_INFINITY };
        }
    }
    // In any order: facets at the same t are not ordered here.
    for alike in flat.sketches.chunk_by(|a, b| a.part == b.part) {
        let guess = &mut guess;
        match alike[0].part {
            FacetPart::Plane => {
                for sketch in alike {
                    look::<R, PLANE, LAYERED>(sketch, starts, guess);
                }
            }
            FacetPart::Triangle => {
                for sketch in alike {
                    look::<R, TRIANGLE, LAYERED>(sketch, starts, guess);
                }
            }
            FacetPart::Parallelogram => {
                for sketch in alike {
                    look::<R, PARALLELOGRAM, LAYERED>(sketch, starts, guess);
                }
            }
        }
    }
    guess
}

const PLANE: u8 = FacetPart::Plane as u8;
const TRIANGLE: u8 = FacetPart::Triangle as u8;
const PARALLELOGRAM: u8 = FacetPart::Parallelogram as u8;

/// [`mod@crate::trace::meet`] with all coordinates multiplied by |n·d|, which needs no division to decide what is outside.
#[inline(always)]
fn look<R: Real, const PART: u8, const LAYERED: bool>(sketch: &Sketch, starts: &Starts, guess: &mut Guess) {
    let Starts { origin, direction, from, plane } = starts;
    for lane in 0..SKETCHED {
        let (o, d) = (origin.each_ref().map(|row| row[lane]), direction.each_ref().map(|row| row[lane]));
        let along = |axis: [f32; 3], x: [f32; 3], sum: f32| {
            let sum = R::mul_add_f32(axis[0], x[0], sum);
            R::mul_add_f32(axis[2], x[2], R::mul_add_f32(axis[1], x[1], sum))
        };
        let approach = along(sketch.normal, d, 0.0);
        let height = along(sketch.normal, o, -sketch.offset);
        let distance = if approach < 0.0 { height } else { -height };
        let approach = approach.abs();
        let inside = PART == PLANE || {
            let u_along = along(sketch.u_axis, d, 0.0);
            let u = R::mul_add_f32(distance, u_along, along(sketch.u_axis, o, -sketch.u_offset) * approach);
            let v_along = along(sketch.v_axis, d, 0.0);
            let v = R::mul_add_f32(distance, v_along, along(sketch.v_axis, o, -sketch.v_offset) * approach);
            let least = if u < v { u } else { v };
            let greatest = if u > v { u } else { v };
            let most = if PART == TRIANGLE { u + v } else { greatest };
            (least >= -sketch.uv_margin) & (most <= approach + sketch.uv_margin)
        };
        let may_meet = (distance >= -sketch.height_margin) & inside & (from[lane] != sketch.number);
        let t = (distance - sketch.height_margin) / (approach + APPROACH_MARGIN);
        let t = if may_meet { t } else { f32::INFINITY };
        // All are read before one is written: a read that a comparison decides on would keep the loop from vectors on AArch64.
        let (best, surface, other) = (guess.t[lane], guess.surface[lane], guess.other[lane]);
        let worse = if t > best { t } else { best };
        let other = if worse < other { worse } else { other };
        // The sketch cannot decide which side is met of a facet that is seen edge-on.
        let edge_on = (approach <= APPROACH_MARGIN) & (from[lane] != sketch.number);
        // Nor whether a layer of the plane that the ray leaves is in front.
        let layer = LAYERED & (plane[lane] == sketch.plane) & (from[lane] != sketch.number);
        guess.other[lane] = if edge_on | layer { f32::NEG_INFINITY } else { other };
        guess.surface[lane] = if t < best { sketch.number } else { surface };
        guess.t[lane] = if t < best { t } else { best };
    }
}

/// Meets, for each of N rays, the facet that the sketch names; bit i of the result: the answer for ray i is certain.
#[inline(always)]
fn decide<R: Real>(
    (facets, layers): (&Facets, Option<&Layers>),
    rays: &Rays,
    first: usize,
    part: usize,
    guess: &Guess,
    hits: &mut Hits,
) -> u64 {
    let surfaces = &guess.surface[part..];
    let best = meet_one::<R>(facets, layers, surfaces, rays, first + part);
    best.store(hits, first + part);
    let number = R::load_u32(surfaces);
    let none = R::splat(f64::from(Hits::NONE));
    // The bounds were rounded to f32 twice.
    const ROUNDED: f64 = 1.0 - 2.0 * f32::EPSILON as f64;
    let mut bound = [0.0; 8];
    for (bound, &other) in bound.iter_mut().zip(&guess.other[part..][..R::N]) {
        *bound = f64::from(other) * ROUNDED;
    }
    let bound = R::load(&bound);
    let nothing = R::bits(R::splat(f64::MAX).lt(bound)) & !R::bits(number.ne(none));
    nothing | R::bits(best.t.lt(bound) & number.ne(none))
}

/// N rays meet every facet.
#[inline(always)]
fn meet_all<R: Real>(facets: &Facets, layers: Option<&Layers>, rays: &Rays, first: usize, hits: &mut Hits) {
    let lanes = RayLanes::<R>::at(rays, first);
    let mut best = Best::none();
    for (surface, facet) in (0..).zip(facets.iter()) {
        let (facet, number) = (FacetLanes::of(&facet), R::splat(f64::from(surface)));
        match layers {
            None => meet(&facet, facets.slack(), &lanes, number, &mut best),
            Some(layers) => {
                let (layer, from) = (layers.lanes(&[surface; 8]), layers.lanes(&rays.from[first..]));
                meet_layer(&facet, facets.slack(), &lanes, number, [&layer, &from], &mut best);
            }
        }
    }
    best.store(hits, first);
}
