//! Walks that are about to set out, a batch at a time: their numbers, and the rays of those that are born at lamps.

use crate::random::rng::Numbers;
use crate::scene::Scene;
use crate::scene::births::Nursery;
use crate::scene::tables::LampRays;
use crate::simd::batch::WIDTH;

/// In place of the number of a lamp where a walk is born on a plane.
const NO_LAMP: u32 = u32::MAX;

/// Births at lamps side by side, without those on planes between them: at lamps with tables from the front on, at others from the end on.
struct LampBirths {
    lamps: [u32; WIDTH],
    /// Three times 64 random bits of each.
    bits: [[u64; WIDTH]; 3],
}

/// Walks that are about to set out.
pub(super) struct Newborns<'a, B, N, I> {
    scene: &'a Scene,
    pub(super) births: &'a B,
    starts: I,
    pub(super) generators: N,
    /// Source, cell, point, direction.
    pub(super) draws: [[u64; WIDTH]; 4],
    next: usize,
    len: usize,
    /// Where each is born.
    lamps: [u32; WIDTH],
    /// The places of those that are born at lamps in `at_lamps`, and of their rays in the batch's.
    places: [u32; WIDTH],
    at_lamps: LampBirths,
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
            places: [0; WIDTH],
            at_lamps: LampBirths { lamps: [0; WIDTH], bits: [[0; WIDTH]; 3] },
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
        (lamp != NO_LAMP).then(|| [lamp, self.first_ray as u32 + self.places[newborn]])
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
        let (len, of_scene) = (self.len.min(WIDTH), &self.scene.parts.lamps);
        match self.births.only_lamp() {
            Some(lamp) => self.lamps = [lamp; WIDTH],
            None => {
                for (lamp, &source) in self.lamps[..len].iter_mut().zip(&self.draws[0]) {
                    *lamp = self.births.lamp(source).unwrap_or(NO_LAMP);
                }
            }
        }
        let count = self.lamps[..len].iter().filter(|&&lamp| lamp != NO_LAMP).count();
        if count == 0 {
            return;
        }
        self.first_ray = WIDTH - self.first_ray;
        match (of_scene.tables(), of_scene.cones()) {
            // All of one kind are side by side as they are.
            (Some(_), None) | (None, Some(_)) if count == len => {
                self.places = std::array::from_fn(|newborn| newborn as u32);
                let [_, places, points, directions] = &self.draws;
                let births = (&self.lamps, [places, points, directions]);
                of_scene.bear(self.scene.parts.isa, births, [len, 0], (&mut self.rays, self.first_ray));
            }
            _ => {
                let parts = self.gather(len);
                let births = (&self.at_lamps.lamps, self.at_lamps.bits.each_ref());
                of_scene.bear(self.scene.parts.isa, births, parts, (&mut self.rays, self.first_ray));
            }
        }
    }

    /// Puts births at lamps side by side. Returns where those at lamps with tables end, and where the others begin.
    fn gather(&mut self, len: usize) -> [usize; 2] {
        let of_scene = &self.scene.parts.lamps;
        let LampBirths { lamps, bits } = &mut self.at_lamps;
        let (mut end, mut begin) = (0, WIDTH);
        for (newborn, &lamp) in self.lamps[..len].iter().enumerate() {
            if lamp == NO_LAMP {
                continue;
            }
            let has_table = of_scene.has_table(lamp as usize);
            begin -= usize::from(!has_table);
            // Which it is no processor guesses.
            let place = std::hint::select_unpredictable(has_table, end, begin);
            end += usize::from(has_table);
            self.places[newborn] = place as u32;
            lamps[place] = lamp;
            for (to, from) in bits.iter_mut().zip(&self.draws[1..]) {
                to[place] = from[newborn];
            }
        }
        [end, begin]
    }
}
