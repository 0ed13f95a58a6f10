//! Rays that leave surfaces: points from local coordinates, directions from random bits, many side by side.

use crate::geometry::frame::{Frames, SurfaceFrame};
use crate::random::sampling::cosine_directions;
use crate::scene::tables::LampRays;
use crate::simd::batch::{Lanes, WIDTH};
use crate::simd::isa::{Isa, on_isa};
use crate::simd::real::Real;
use crate::trace::ray::{Ray, Rays};

/// Where the walks of a batch leave from.
#[derive(Clone, Debug)]
pub(crate) struct Departures {
    pub(crate) surface: [u32; WIDTH],
    /// 1 where it is the front that a walk leaves, −1 where it is the back.
    pub(crate) facing: [f64; WIDTH],
    /// Local coordinates on the surface.
    pub(crate) uv: [[f64; WIDTH]; 2],
    /// Random bits for the direction.
    pub(crate) direction: [u64; WIDTH],
    /// Those that leave lamps, and the numbers of their rays.
    free: Lanes,
    ray: [u32; WIDTH],
}

impl Default for Departures {
    fn default() -> Self {
        Departures {
            surface: [0; WIDTH],
            facing: [1.0; WIDTH],
            uv: [[0.0; WIDTH]; 2],
            direction: [0; WIDTH],
            free: Lanes::default(),
            ray: [0; WIDTH],
        }
    }
}

impl Departures {
    /// The rays of the first `len` departures, cosine-distributed about the normals. Their directions have length 1
    /// within 10⁻¹¹.
    pub(crate) fn leave(&self, isa: Isa, frames: &Frames, len: usize, rays: &mut Rays) {
        rays.len = len;
        rays.from = self.surface;
        let departures = self;
        on_isa!(isa, leave(departures: &Departures, frames: &Frames, rays: &mut Rays));
    }

    /// Puts the rays from lamps in place of those from surfaces.
    #[inline(always)]
    pub(crate) fn leave_lamps(&self, born: &LampRays, rays: &mut Rays) {
        self.free.each(|lane| {
            let number = self.ray[lane] as usize % (2 * WIDTH);
            for axis in 0..3 {
                rays.origin[axis][lane] = born[axis][number];
                rays.direction[axis][lane] = born[axis + 3][number];
            }
            rays.from[lane] = Ray::FREE;
        });
    }

    /// A departure from a lamp, by the number of its ray.
    #[inline(always)]
    pub(crate) fn set_free(&mut self, lane: usize, ray: u32) {
        self.free.insert(lane);
        // The departure reads the frame of this surface, and does not use it.
        self.surface[lane] = 0;
        self.ray[lane] = ray;
    }

    /// All departures leave surfaces, until others are set.
    #[inline(always)]
    pub(crate) fn bind(&mut self) {
        self.free = Lanes::default();
    }

    /// Puts departure `from` in place of departure `to`.
    #[inline(always)]
    pub(crate) fn copy(&mut self, from: usize, to: usize) {
        self.surface[to] = self.surface[from];
        self.facing[to] = self.facing[from];
        self.uv.iter_mut().for_each(|row| row[to] = row[from]);
        self.direction[to] = self.direction[from];
        if self.free.has(from) {
            self.set_free(to, self.ray[from]);
        }
    }
}

#[inline(always)]
fn leave<R: Real>(departures: &Departures, frames: &Frames, rays: &mut Rays) {
    for first in (0..rays.len.min(WIDTH)).step_by(R::N) {
        let frame = SurfaceFrame::<R>::each(frames, &departures.surface[first..]);
        let facing = R::load(&departures.facing[first..]);
        let direction = frame.direction(facing, cosine_directions::<R>(&departures.direction[first..]));
        let origin = frame.point(departures.uv.each_ref().map(|row| R::load(&row[first..])));
        for axis in 0..3 {
            direction[axis].store(&mut rays.direction[axis][first..]);
            origin[axis].store(&mut rays.origin[axis][first..]);
        }
    }
}
