//! The rays of one chain, cast by several threads.
//!
//! The n-th ray of a face is a function of the chain, the face and n, and links are counted, so that the links of a chain
//! and their order do not depend on the number of threads.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use super::cast::{Caster, Meeting};
use super::near::LandingCounts;
use crate::thread_pool::{PARTS_PER_THREAD, ThreadPool};

/// The fewest rays of a part.
const RAYS_OF_PART: u64 = 1 << 12;

/// Successive rays of successive faces.
#[derive(Debug, PartialEq)]
struct RaySlice {
    first_face: usize,
    /// Rays of the first face that the part before has shot.
    skipped: u32,
    /// Rays of each face, from the first on.
    rays: Vec<u32>,
}

/// Shoots `rays[i]` more rays from each face i, and counts where they land. `None` once `pool` no longer want it.
pub(super) fn cast(
    caster: &mut Caster,
    rays: &[u32],
    landed: &mut LandingCounts,
    pool: &dyn ThreadPool,
) -> Option<()> {
    let go_on = || pool.go_on();
    let parts = parts(rays, pool.count());
    if parts.len() < 2 {
        caster.cast(0, rays, &go_on, |from, to, meeting| landed.count(from, to, meeting))?;
        landed.end_row();
        return Some(());
    }
    let found: Vec<Mutex<Option<LandingCounts>>> = parts.iter().map(|_| Mutex::new(None)).collect();
    let (template, sums) = (caster.fresh_copy(), Mutex::new(&mut *caster));
    let empty = landed.empty(rays.len());
    pool.share(parts.len(), &|number| {
        let RaySlice { first_face, skipped, rays } = &parts[number];
        let (mut caster, mut part) = (template.fresh_copy(), empty.empty(template.shot.len()));
        caster.shot[*first_face] += skipped;
        let cast = caster.cast(*first_face, rays, &go_on, |from, to, meeting| part.count(from, to, meeting));
        if cast.is_some() {
            part.end_row();
            sums.lock().expect("no thread panics with it").take_over(&caster);
            *found[number].lock().expect("no thread panics with it") = Some(part);
        }
    });
    let mut joined = landed.empty(rays.len());
    for part in found {
        joined.join(&part.into_inner().expect("no thread panics with it")?);
    }
    landed.extend(&joined);
    caster.shot.iter_mut().zip(rays).for_each(|(shot, more)| *shot += more);
    Some(())
}

/// Shoots all rays of a caster once more; `land(i, j, meeting)` for each of face i that lands on a face j, `lose(i, meeting)` for each that
/// lands on none. `None` once `pool` no longer want it.
pub(super) fn shoot_again(
    caster: &Caster,
    pool: &dyn ThreadPool,
    land: &(dyn Fn(u32, u32, &Meeting) + Sync),
    lose: &(dyn Fn(u32, &Meeting) + Sync),
) -> Option<()> {
    let parts = parts(&caster.shot, pool.count());
    let wanted = AtomicBool::new(true);
    let afresh = Mutex::new(caster.afresh());
    pool.share(parts.len(), &|number| {
        let RaySlice { first_face, skipped, rays } = &parts[number];
        let mut caster = afresh.lock().expect("no thread panics with it").afresh();
        caster.shot[*first_face] = *skipped;
        if caster.cast_all(*first_face, rays, &|| pool.go_on(), land, lose).is_none() {
            wanted.store(false, Ordering::Relaxed);
        }
    });
    wanted.into_inner().then_some(())
}

/// Cuts rays into parts of about the same number for `pool` threads: one part where there is one thread, or where rays are few.
fn parts(rays: &[u32], pool: usize) -> Vec<RaySlice> {
    let total: u64 = rays.iter().map(|&rays| u64::from(rays)).sum();
    let most = if pool > 1 { (PARTS_PER_THREAD * pool) as u64 } else { 1 };
    let per_part = total.div_ceil(most).max(RAYS_OF_PART);
    let mut parts: Vec<RaySlice> = Vec::new();
    let mut room = 0;
    for (face, &rays) in rays.iter().enumerate() {
        let mut left = rays;
        loop {
            if room == 0 && left > 0 {
                parts.push(RaySlice { first_face: face, skipped: rays - left, rays: Vec::new() });
                room = per_part;
            }
            let taken = u64::from(left).min(room) as u32;
            if let Some(part) = parts.last_mut() {
                part.rays.push(taken);
            }
            (left, room) = (left - taken, room - u64::from(taken));
            if left == 0 {
                break;
            }
        }
    }
    parts
}

#[cfg(test)]
mod tests {
    use std::thread;

    use super::*;
    use crate::SceneSpec;
    use crate::jacobi::aim::aim;
    use crate::jacobi::linked::chain;
    use crate::jacobi::links::LinkTable;
    use crate::jacobi::{ChainOutcome, FaceTable};
    use crate::random::rng::Sequence;
    use crate::scene::{IndexChoice, Scene};

    /// Threads that take parts from the last to the first.
    struct Threads(usize);

    impl ThreadPool for Threads {
        fn go_on(&self) -> bool {
            true
        }

        fn count(&self) -> usize {
            self.0
        }

        fn share(&self, parts: usize, part: &(dyn Fn(usize) + Sync)) {
            let left = Mutex::new((0..parts).rev().collect::<Vec<_>>());
            let next = || left.lock().expect("no thread panics with it").pop();
            thread::scope(|scope| {
                for _ in 0..self.0 {
                    scope.spawn(|| std::iter::from_fn(next).for_each(part));
                }
            });
        }
    }

    /// A furnace of 216 patches, one wall of which is dark, so that faces shoot unlike numbers of rays.
    fn room() -> Scene {
        let mut spec = SceneSpec::furnace(6, 0.5);
        spec.surfaces[0].emittance = 0.0.into();
        Scene::build(&spec, IndexChoice::Auto).unwrap()
    }

    /// A room of 216 patches with a small lamp, whose light shadow rays bring.
    fn room_with_a_lamp() -> Scene {
        let mut spec = SceneSpec::furnace(6, 0.5);
        spec.surfaces.iter_mut().for_each(|surface| surface.emittance = 0.0.into());
        spec.surfaces[0].cell_emittance.push((0, 1.0.into()));
        Scene::build(&spec, IndexChoice::Auto).unwrap()
    }

    fn bits(outcome: ChainOutcome) -> (Vec<u64>, Vec<u64>) {
        let numbers = outcome.irradiance.iter().chain(outcome.slopes.as_flattened());
        (numbers.map(|h| h.to_bits()).collect(), outcome.landed)
    }

    #[test]
    fn a_chain_is_the_same_to_the_last_bit_by_any_number_of_threads() {
        for scene in [room(), room_with_a_lamp()] {
            let faces = FaceTable::new(&scene);
            let of = |pool: &dyn ThreadPool| {
                let aim = aim(&faces, 300_000, pool).unwrap();
                bits(chain(&faces, Sequence::new(7).walk(3), (300_000, &aim), true, pool).unwrap())
            };
            let alone = of(&|| true);
            for threads in [2, 3, 7] {
                assert_eq!(of(&Threads(threads)), alone, "{threads} threads");
            }
        }
    }

    #[test]
    fn a_chain_that_is_not_wanted_any_more_ends() {
        struct Unwanted;
        impl ThreadPool for Unwanted {
            fn go_on(&self) -> bool {
                false
            }
            fn count(&self) -> usize {
                4
            }
        }
        let scene = room();
        let (faces, rng) = (FaceTable::new(&scene), Sequence::new(7).walk(3));
        assert!(aim(&faces, 300_000, &Unwanted).is_none());
        let aim = aim(&faces, 300_000, &|| true).unwrap();
        assert!(chain(&faces, rng, (300_000, &aim), false, &Unwanted).is_none());
    }

    #[test]
    fn parts_hold_every_ray_once() {
        let rays = [0, 10_000, 0, 3, 70_000, 1, 0];
        for pool in [1, 2, 5] {
            let parts = parts(&rays, pool);
            assert_eq!(parts.len() == 1, pool == 1, "{pool}");
            let mut shot = [0; 7];
            for RaySlice { first_face, skipped, rays } in &parts {
                assert_eq!(shot[*first_face], *skipped, "{parts:?}");
                shot[*first_face..].iter_mut().zip(rays).for_each(|(shot, rays)| *shot += rays);
            }
            assert_eq!(shot, rays);
        }
        assert!(parts(&[0, 0], 3).is_empty());
    }

    #[test]
    fn a_row_that_is_cut_is_joined() {
        let counted = |rays: &[(u32, u32)]| {
            let mut table = LinkTable::<u32>::new(3);
            rays.iter().for_each(|&(from, to)| table.count(from, to, 1));
            table.end_row();
            table
        };
        let rays = [(0, 1), (0, 2), (1, 2), (1, 0), (1, 2), (1, 1), (1, 0), (2, 0), (2, 2)];
        for cut in 0..=rays.len() {
            let mut joined = counted(&rays[..cut]);
            joined.join(&counted(&rays[cut..]));
            assert_eq!(joined.links(), counted(&rays).links(), "cut at {cut}");
        }
    }
}
