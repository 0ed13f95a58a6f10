//! Rays that leave surfaces: points from local coordinates, directions from random bits, many side by side.

use crate::isa::{Isa, on_isa};
use crate::real::Real;
use crate::sampling::cosine_directions;
use crate::surface::{Side, Surface};
use crate::trace::{Rays, WIDTH};

/// Where the walks of a batch leave from.
#[derive(Clone, Debug)]
pub(crate) struct Departures {
    pub(crate) surface: [u32; WIDTH],
    pub(crate) side: [Side; WIDTH],
    /// Local coordinates on the surface.
    pub(crate) uv: [[f64; WIDTH]; 2],
    /// Random bits for sin²θ.
    pub(crate) polar: [u32; WIDTH],
    /// Random bits for φ.
    pub(crate) turn: [u32; WIDTH],
}

impl Default for Departures {
    fn default() -> Self {
        Departures {
            surface: [0; WIDTH],
            side: [Side::Front; WIDTH],
            uv: [[0.0; WIDTH]; 2],
            polar: [0; WIDTH],
            turn: [0; WIDTH],
        }
    }
}

impl Departures {
    /// The rays of the first `len` departures, cosine-distributed about the normals. Their directions have length 1
    /// within 10⁻¹¹.
    pub(crate) fn leave(&self, isa: Isa, surfaces: &[Surface], len: usize, rays: &mut Rays) {
        rays.len = len;
        let departures = self;
        on_isa!(isa, leave(departures: &Departures, surfaces: &[Surface], rays: &mut Rays));
    }
}

#[inline(always)]
fn leave<R: Real>(departures: &Departures, surfaces: &[Surface], rays: &mut Rays) {
    let len = rays.len.min(WIDTH);
    for first in (0..len).step_by(R::N) {
        let local = cosine_directions::<R>(&departures.polar[first..], &departures.turn[first..]);
        for (axis, component) in local.into_iter().enumerate() {
            component.store(&mut rays.direction[axis][first..]);
        }
    }
    for i in 0..len {
        let surface = &surfaces[departures.surface[i] as usize];
        let local = rays.direction.each_ref().map(|row| row[i]);
        let direction = surface.to_scene(departures.side[i], local);
        let origin = surface.point(departures.uv.each_ref().map(|row| row[i]));
        for axis in 0..3 {
            rays.direction[axis][i] = direction[axis];
            rays.origin[axis][i] = origin[axis];
        }
        rays.from[i] = departures.surface[i];
    }
}
