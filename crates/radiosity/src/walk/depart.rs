//! Rays that leave surfaces: points from local coordinates, directions from random bits, many side by side.

use crate::geometry::frame::{Frames, SurfaceFrame};
use crate::random::sampling::cosine_directions;
use crate::scene::tables::{LightTables, TableBirths};
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
    /// Those that leave no surface, whose rays are known.
    free: Lanes,
    /// Origins and directions of these rays [m].
    known: [[f64; WIDTH]; 6],
    /// Those that leave lamps with tables.
    tabled: Lanes,
    births: TableBirths<WIDTH>,
    /// The same births side by side, and their rays.
    queue: TableBirths<WIDTH>,
    born: [[f64; WIDTH]; 6],
}

impl Default for Departures {
    fn default() -> Self {
        Departures {
            surface: [0; WIDTH],
            facing: [1.0; WIDTH],
            uv: [[0.0; WIDTH]; 2],
            direction: [0; WIDTH],
            free: Lanes::default(),
            known: [[0.0; WIDTH]; 6],
            tabled: Lanes::default(),
            births: TableBirths::default(),
            queue: TableBirths::default(),
            born: [[0.0; WIDTH]; 6],
        }
    }
}

impl Departures {
    /// The rays of the first `len` departures, cosine-distributed about the normals. Their directions have length 1
    /// within 10⁻¹¹.
    pub(crate) fn leave(&self, isa: Isa, frames: &Frames, len: usize, rays: &mut Rays) {
        rays.len = len;
        rays.from = self.surface;
        let (departures, leaving) = (self, &mut *rays);
        on_isa!(isa, leave(departures: &Departures, frames: &Frames, leaving: &mut Rays));
        if !self.free.is_empty() {
            self.leave_freely(rays);
        }
    }

    /// Puts the known rays in place of those from surfaces.
    #[inline(never)]
    fn leave_freely(&self, rays: &mut Rays) {
        self.free.each(|lane| {
            let rows = rays.origin.iter_mut().chain(&mut rays.direction);
            rows.zip(&self.known).for_each(|(row, known)| row[lane] = known[lane]);
            rays.from[lane] = Ray::FREE;
        });
    }

    /// Puts the rays of those that leave lamps with tables in their places: side by side, whatever lanes they are in.
    #[inline(never)]
    pub(crate) fn leave_by_tables(&mut self, isa: Isa, tables: &LightTables, rays: &mut Rays) {
        let Departures { births, queue, born, .. } = self;
        let mut len = 0;
        self.tabled.each(|lane| {
            queue.lamp[len] = births.lamp[lane];
            queue.cell[len] = births.cell[lane];
            queue.direction[len] = births.direction[lane];
            len += 1;
        });
        tables.expect(&queue.cell[..len]);
        tables.bear(isa, (queue, len), born);
        len = 0;
        self.tabled.each(|lane| {
            for axis in 0..3 {
                rays.origin[axis][lane] = born[axis][len];
                rays.direction[axis][lane] = born[axis + 3][len];
            }
            rays.from[lane] = Ray::FREE;
            len += 1;
        });
    }

    /// A departure that leaves a lamp with a table, by the numbers of the lamp and of a cell of its table.
    #[inline(always)]
    pub(crate) fn set_tabled(&mut self, lane: usize, [lamp, cell]: [u32; 2], direction: u64) {
        self.tabled.insert(lane);
        // The departure reads the frame of this surface, and does not use it.
        self.surface[lane] = 0;
        self.births.lamp[lane] = lamp;
        self.births.cell[lane] = cell;
        self.births.direction[lane] = direction;
    }

    /// A departure that leaves no surface: its ray is this one.
    pub(crate) fn set_free(&mut self, lane: usize, ray: &Ray) {
        self.free.insert(lane);
        // The departure reads the frame of this surface, and does not use it.
        self.surface[lane] = 0;
        let coordinates = ray.origin.to_array().into_iter().chain(ray.direction.to_array());
        self.known.iter_mut().zip(coordinates).for_each(|(row, x)| row[lane] = x);
    }

    /// All departures leave surfaces, until others are set.
    #[inline(always)]
    pub(crate) fn bind(&mut self) {
        self.free = Lanes::default();
        self.tabled = Lanes::default();
    }

    /// Puts departure `from` in place of departure `to`.
    #[inline(always)]
    pub(crate) fn copy(&mut self, from: usize, to: usize) {
        self.surface[to] = self.surface[from];
        self.facing[to] = self.facing[from];
        self.uv.iter_mut().for_each(|row| row[to] = row[from]);
        self.direction[to] = self.direction[from];
        if self.free.has(from) {
            self.free.insert(to);
            self.known.iter_mut().for_each(|row| row[to] = row[from]);
        }
        if self.tabled.has(from) {
            let TableBirths { lamp, cell, direction } = &self.births;
            self.set_tabled(to, [lamp[from], cell[from]], direction[from]);
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
