//! Rays that leave surfaces: points from local coordinates, directions from random bits, many side by side.

use crate::geometry::frame::{Frame, Frames};
use crate::random::sampling::cosine_directions;
use crate::simd::batch::WIDTH;
use crate::simd::isa::{Isa, on_isa};
use crate::simd::real::Real;
use crate::trace::ray::Rays;

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
}

impl Default for Departures {
    fn default() -> Self {
        Departures { surface: [0; WIDTH], facing: [1.0; WIDTH], uv: [[0.0; WIDTH]; 2], direction: [0; WIDTH] }
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

    /// Puts departure `from` in place of departure `to`.
    #[inline(always)]
    pub(crate) fn copy(&mut self, from: usize, to: usize) {
        self.surface[to] = self.surface[from];
        self.facing[to] = self.facing[from];
        self.uv.iter_mut().for_each(|row| row[to] = row[from]);
        self.direction[to] = self.direction[from];
    }
}

#[inline(always)]
fn leave<R: Real>(departures: &Departures, frames: &Frames, rays: &mut Rays) {
    for first in (0..rays.len.min(WIDTH)).step_by(R::N) {
        let frame = Frame::<R>::each(frames, &departures.surface[first..]);
        let facing = R::load(&departures.facing[first..]);
        let direction = frame.direction(facing, cosine_directions::<R>(&departures.direction[first..]));
        let origin = frame.point(departures.uv.each_ref().map(|row| R::load(&row[first..])));
        for axis in 0..3 {
            direction[axis].store(&mut rays.direction[axis][first..]);
            origin[axis].store(&mut rays.origin[axis][first..]);
        }
    }
}
