//! Walks that are about to set out, a batch at a time: their numbers, and the rays of those that are born at lamps.

use crate::random::rng::Numbers;
use crate::scene::Scene;
use crate::scene::births::Nursery;
use crate::scene::tables::LampRays;
use crate::simd::batch::WIDTH;

/// In place of the number of a lamp where a walk is born on a plane.
const NO_LAMP: u32 = u32::MAX;

/// Walks that are about to set out.
pub(super) struct Newborns<'a, B, N, I> {
    scene: &'a Scene,
    pub(super) births: &'a B,
    starts: I,
    pub(super) generators: N,
    /// Cradle, cell, point, direction.
    pub(super) draws: [[u64; WIDTH]; 4],
    next: usize,
    len: usize,
    /// Where each is born.
    lamps: [u32; WIDTH],
    /// The rays of those that are born at lamps. A walk leaves before two further batches are born: those of two are kept.
    rays: LampRays,
    /// The number of the first ray of the batch.
    first_ray: usize,
}

impl<'a, B, N: Numbers, I: Iterator<Item = N::Place>> Newborns<'a, B, N, I> {
    pub(super) fn new(scene: &'a Scene, births: &'a B, generators: N, starts: I) -> Self {
        Newborns {
            scene,
            births,
            starts,
            generators,
            draws: [[0; WIDTH]; 4],
            next: 0,
            len: 0,
            lamps: [NO_LAMP; WIDTH],
            rays: [[0.0; 2 * WIDTH]; 6],
            first_ray: 0,
        }
    }

    /// The place of the next one in the queue; `None` where all have set out.
    #[inline(always)]
    pub(super) fn pop<const C: usize>(&mut self) -> Option<usize>
    where
        B: Nursery<C>,
    {
        if self.next == self.len {
            self.fill();
        }
        (self.next < self.len).then(|| {
            self.next += 1;
            self.next - 1
        })
    }

    /// The number of the lamp at which a newborn is born, if it is, and that of its ray.
    #[inline(always)]
    pub(super) fn at_lamp(&self, newborn: usize) -> Option<[u32; 2]> {
        let lamp = self.lamps[newborn];
        (lamp != NO_LAMP).then(|| [lamp, (self.first_ray + newborn) as u32])
    }

    /// The rays of walks that are born at lamps.
    #[inline(always)]
    pub(super) fn lamp_rays(&self) -> &LampRays {
        &self.rays
    }

    fn fill<const C: usize>(&mut self)
    where
        B: Nursery<C>,
    {
        (self.next, self.len) = (0, 0);
        for walk in self.starts.by_ref().take(WIDTH) {
            self.generators.set(self.len, &walk);
            self.len += 1;
        }
        self.generators.births(self.scene.parts.isa, &mut self.draws);
        if !self.scene.parts.lamps.is_empty() && self.len > 0 {
            self.light();
        }
    }

    /// Bears the rays of those that are born at lamps.
    #[inline(never)]
    fn light<const C: usize>(&mut self)
    where
        B: Nursery<C>,
    {
        let scene = self.scene;
        let (len, of_scene) = (self.len.min(WIDTH), &scene.parts.lamps);
        let [cradles, places, points, directions] = &self.draws;
        match self.births.only_lamp() {
            Some(lamp) => self.lamps = [lamp; WIDTH],
            None => {
                for (lamp, &cradle) in self.lamps[..len].iter_mut().zip(cradles) {
                    *lamp = self.births.lamp(cradle).unwrap_or(NO_LAMP);
                }
            }
        }
        if self.lamps[..len].iter().all(|&lamp| lamp == NO_LAMP) {
            return;
        }
        self.first_ray = WIDTH - self.first_ray;
        let (rays, first) = (&mut self.rays, self.first_ray);
        if let Some(tables) = of_scene.tables() {
            tables.bear(scene.parts.isa, (&self.lamps, len), [places, points, directions], (rays, first));
        }
        if let Some(cones) = of_scene.cones() {
            cones.bear(scene.parts.isa, (&self.lamps, len), [places, points, directions], (rays, first));
        }
    }
}
