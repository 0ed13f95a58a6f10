//! Stochastic Jacobi iterations as BS §4 has them.
//!
//! One iteration propagates the power P of all faces by n rays. A ray leaves face j with probability P_j/P_T, carries
//! P_T/n, and where it lands on l the power φ_l has come in, of which R_lφ_l is reflected. *Incremental* iterations
//! propagate power that has not been shot yet, by rays in proportion to it, and their results add up to a first solution.
//! *Regular* ones propagate all power, and their results are averaged by their rays.
//!
//! Nothing is truncated. Every ray of the incremental phase carries the same part of the light; how many set out is the
//! unshot power over that part, rounded at random so that the mean is right, and the phase ends when no ray is left to
//! shoot. So its solution is unbiased; a regular iteration is where its input is; and since all regular ones have the
//! same number of rays (within one) their plain mean is, too. That holds for random rays. The points of one Sobol
//! sequence depend on each other, also between iterations: there a bias may remain, of a smaller order than the error.

use super::beams::DirectLight;
use super::cast::{Caster, systematic};
use super::faces::{FaceTable, face_major};
use super::numbers::RayNumbers;
use super::outcome::ChainOutcome;
use super::plan::{Iterations, RayBirths};
use crate::random::Sampler;
use crate::random::rng::WalkRng;
use crate::random::sampling::AliasTable;
use crate::scene::Scene;

/// The first phase takes no face for brighter than one that absorbs this part: its rays would stand for more light than there is.
const LEAST_ABSORBING: f64 = 1.0 / 16.0;

/// What an iteration propagates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IterationPhase {
    /// Power that has not been shot yet: results add up.
    Incremental,
    /// All power: results are averaged.
    Regular,
}

/// The result of one iteration of a chain.
#[derive(Clone, Debug, PartialEq)]
pub struct Iteration {
    /// The power that the iteration propagated.
    pub phase: IterationPhase,
    /// The number of rays of the iteration.
    pub rays: u64,
    /// H that its rays brought [W/m²], face-major, channel-minor. Of one regular iteration b = R·H.
    pub irradiance: Vec<f64>,
}

/// Power of every face [W], channel by channel.
type FacePowers = Vec<Vec<f64>>;

/// One chain of `rays` rays; `observe` sees φ of each face [W] after each iteration. `None` once `go_on` returns false.
pub(crate) fn chain(
    faces: &FaceTable,
    rng: WalkRng,
    rays: u64,
    plan: Iterations,
    observe: &mut dyn FnMut(IterationPhase, u64, &FacePowers),
    go_on: &dyn Fn() -> bool,
) -> Option<ChainOutcome> {
    let numbers = match plan.sampler {
        Sampler::Random => RayNumbers::random(rng),
        Sampler::Sobol => RayNumbers::sobol(rng),
    };
    Shooter::new(faces, numbers, plan).run(rays, observe, go_on)
}

/// What every iteration of a chain came to.
pub(crate) fn observed(scene: &Scene, rng: WalkRng, rays: u64, plan: Iterations) -> Vec<Iteration> {
    let faces = FaceTable::new(scene);
    let mut iterations = Vec::new();
    let mut observe = |phase, rays, incoming: &FacePowers| {
        iterations.push(Iteration { phase, rays, irradiance: face_major(&faces.per_area(incoming)) });
    };
    chain(&faces, rng, rays, plan, &mut observe, &|| true).expect("the chain is never told to stop");
    iterations
}

/// One regular iteration of `rays` random rays whose input is B of every face [W/m²] (face-major, channel-minor): H of
/// every face [W/m²]. Its variance is that of BS eq. (22), divided by `rays`, where births are
/// multinomial.
///
/// # Panics
/// Unless there is one B per face and channel.
pub fn stochastic_iteration(
    scene: &Scene,
    births: RayBirths,
    rng: WalkRng,
    radiosity: &[f64],
    rays: u64,
) -> Vec<f64> {
    let (faces, channels) = (FaceTable::new(scene), scene.channels());
    assert_eq!(radiosity.len(), faces.list.len() * channels, "one B per face and channel");
    let of_channel = |c: usize| {
        let power = faces.areas.iter().zip(radiosity.iter().skip(c).step_by(channels));
        power.map(|(area, b)| area * b).collect()
    };
    let power = (0..channels).map(of_channel).collect();
    let plan = Iterations { births, sampler: Sampler::Random, ..Iterations::default() };
    let mut shooter = Shooter::new(&faces, RayNumbers::random(rng), plan);
    let incoming = shooter.regular(&power, rays, &|| true).expect("the iteration is never told to stop");
    face_major(&faces.per_area(&incoming))
}

struct Shooter<'a> {
    faces: &'a FaceTable<'a>,
    caster: Caster<'a>,
    plan: Iterations,
}

impl<'a> Shooter<'a> {
    fn new(faces: &'a FaceTable<'a>, numbers: RayNumbers, plan: Iterations) -> Self {
        Shooter { faces, caster: Caster::new(faces, numbers), plan }
    }

    fn run(
        mut self,
        rays: u64,
        observe: &mut dyn FnMut(IterationPhase, u64, &FacePowers),
        go_on: &dyn Fn() -> bool,
    ) -> Option<ChainOutcome> {
        let emitted = self.emitted();
        let lamps = DirectLight::of(self.faces, self.caster.rng(), rays, go_on)?;
        let rays = rays - lamps.as_ref().map_or(0, |lamps| lamps.rays);
        let of_lamps = lamps.as_ref().map(|lamps| self.powers(&lamps.irradiance));
        let mut incoming = self.incremental(of_lamps.as_ref(), rays, observe, go_on)?;
        let (left, count) = (rays.saturating_sub(self.caster.rays()), u64::from(self.plan.regular));
        for k in 0..count {
            // The average so far is what goes on (BS: approximations are averaged rather than replaced).
            let power = sum(&emitted, &self.reflected(&incoming));
            let rays = left * (k + 1) / count - left * k / count;
            let mut landed = self.regular(&power, rays, go_on)?;
            observe(IterationPhase::Regular, rays, &landed);
            if let Some(of_lamps) = &of_lamps {
                landed = sum(&landed, of_lamps);
            }
            let weight = 1.0 / (k + 1) as f64;
            incoming = zip(&incoming, &landed, |mean, new| mean + weight * (new - mean));
        }
        let power = sum(&emitted, &self.reflected(&incoming));
        let mut lost: Vec<[f64; 2]> = power.iter().map(|power| self.lost(power)).collect();
        for (lost, of_lamps) in lost.iter_mut().zip(lamps.iter().flat_map(|lamps| &lamps.lost)) {
            *lost = [0, 1].map(|way| lost[way] + of_lamps[way]);
        }
        let outcome = ChainOutcome::new(self.faces, &self.caster, &self.faces.per_area(&incoming), &lost);
        Some(outcome.with_shadow_rays(lamps.map_or(0, |lamps| lamps.rays)))
    }

    /// φ of every face from H.
    fn powers(&self, irradiance: &[Vec<f64>]) -> FacePowers {
        let of_channel = |h: &Vec<f64>| h.iter().zip(&self.faces.areas).map(|(h, area)| h * area).collect();
        irradiance.iter().map(of_channel).collect()
    }

    /// The first solution: φ of all faces, power propagated until none is left. `of_lamps` is what lamps without area bring to faces.
    fn incremental(
        &mut self,
        of_lamps: Option<&FacePowers>,
        rays: u64,
        observe: &mut dyn FnMut(IterationPhase, u64, &FacePowers),
        go_on: &dyn Fn() -> bool,
    ) -> Option<FacePowers> {
        let mut unshot = self.emitted();
        let mut incoming = zip(&unshot, &unshot, |_, _| 0.0);
        if let Some(of_lamps) = of_lamps {
            unshot = sum(&unshot, &self.reflected(of_lamps));
            incoming.clone_from(of_lamps);
        }
        // No more light is under way than Φ_T/(1 − R_max): this phase takes the rays of one regular iteration at most, in
        // the mean. One bright face does not keep it from shooting: half of the rays are enough of a bound beyond.
        let most_absorbing = (1.0 - self.faces.scene.max_reflectance().max()).max(LEAST_ABSORBING);
        let share_of_ray = (self.plan.regular + 1) as f64 / (rays as f64 * most_absorbing);
        loop {
            let shares = self.shares(&unshot);
            let total: f64 = shares.iter().sum();
            // And never more than half of all rays, whatever chance does.
            let spare = (0.5 * rays as f64 - self.caster.rays() as f64).max(1.0);
            let per_ray = share_of_ray.max(2.0 * total / spare);
            let count = (total / per_ray + self.caster.rng().pair()[0]) as u64;
            if count == 0 {
                return Some(incoming);
            }
            let landed = self.propagate(&unshot, &shares, count, per_ray, go_on)?;
            observe(IterationPhase::Incremental, count, &landed);
            incoming = sum(&incoming, &landed);
            unshot = self.reflected(&landed);
        }
    }

    /// φ when `rays` rays carry all of `power`.
    fn regular(&mut self, power: &FacePowers, rays: u64, go_on: &dyn Fn() -> bool) -> Option<FacePowers> {
        let shares = self.shares(power);
        let per_ray = shares.iter().sum::<f64>() / rays.max(1) as f64;
        self.propagate(power, &shares, rays, per_ray, go_on)
    }

    /// φ that `power` brings by rays that stand for `per_ray` of its shares each.
    fn propagate(
        &mut self,
        power: &FacePowers,
        shares: &[f64],
        rays: u64,
        per_ray: f64,
        go_on: &dyn Fn() -> bool,
    ) -> Option<FacePowers> {
        let births = match self.plan.births {
            RayBirths::Systematic => systematic(shares, rays, self.caster.rng().pair()[0]),
            RayBirths::Multinomial => multinomial(shares, rays, self.caster.rng()),
        };
        let carried = |(power, share): (&f64, &f64)| if *share > 0.0 { power / share * per_ray } else { 0.0 };
        let carried: FacePowers =
            power.iter().map(|power| power.iter().zip(shares).map(carried).collect()).collect();
        let mut incoming: FacePowers = vec![vec![0.0; shares.len()]; power.len()];
        self.caster.cast(0, &births, go_on, |from, to, _| {
            for (incoming, carried) in incoming.iter_mut().zip(&carried) {
                incoming[to as usize] += carried[from as usize];
            }
        })?;
        Some(incoming)
    }

    /// What a face's chance of a ray is in proportion to: its part of Φ_T, the mean of the channels that have light.
    fn shares(&self, power: &FacePowers) -> Vec<f64> {
        let scene = self.faces.scene;
        let lit: Vec<usize> = (0..power.len()).filter(|&c| scene.total_power(c) > 0.0).collect();
        let share = |face: usize| {
            lit.iter().map(|&c| power[c][face] / scene.total_power(c)).sum::<f64>() / lit.len().max(1) as f64
        };
        (0..self.faces.list.len()).map(share).collect()
    }

    /// Φ of every face.
    fn emitted(&self) -> FacePowers {
        let of_channel = |c: usize| {
            let faces = self.faces.list.iter().zip(&self.faces.areas);
            faces.map(|(face, area)| face.emittance[c] * area).collect()
        };
        (0..self.faces.scene.channels()).map(of_channel).collect()
    }

    /// R φ of every face.
    fn reflected(&self, incoming: &FacePowers) -> FacePowers {
        let reflectance = |c: usize| self.faces.list.iter().map(move |face| face.reflectance[c]);
        let channels = incoming.iter().enumerate();
        channels
            .map(|(c, incoming)| incoming.iter().zip(reflectance(c)).map(|(x, r)| r * x).collect())
            .collect()
    }

    /// The parts of a channel's power that escape and that end on backs [W], estimated from the rays of the whole chain.
    fn lost(&self, power: &[f64]) -> [f64; 2] {
        let rays = self.caster.lost.iter().zip(&self.caster.shot).zip(power);
        rays.fold([0.0; 2], |sum, ((lost, &shot), power)| {
            std::array::from_fn(|way| sum[way] + power * f64::from(lost[way]) / f64::from(shot.max(1)))
        })
    }
}

fn zip(a: &FacePowers, b: &FacePowers, of: impl Fn(f64, f64) -> f64) -> FacePowers {
    a.iter().zip(b).map(|(a, b)| a.iter().zip(b).map(|(a, b)| of(*a, *b)).collect()).collect()
}

fn sum(a: &FacePowers, b: &FacePowers) -> FacePowers {
    zip(a, b, |a, b| a + b)
}

/// How many of `total` rays each face shoots if each ray chooses for itself in proportion to `shares` ≥ 0, all alike
/// where none is above 0.
fn multinomial(shares: &[f64], total: u64, rng: &mut WalkRng) -> Vec<u32> {
    let table = if shares.iter().any(|&share| share > 0.0) {
        AliasTable::new(shares)
    } else {
        AliasTable::new(&vec![1.0; shares.len()])
    };
    let mut counts = vec![0; shares.len()];
    for _ in 0..total {
        counts[table.choose(rng.bits())] += 1;
    }
    counts
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::geometry::spec::{SceneSpec, Shape, Sides, Spectrum, SurfaceSpec};
    use crate::random::rng::Sequence;
    use crate::scene::IndexChoice;

    /// A closed box of unlike walls.
    fn room() -> Scene {
        let axes = [2.0 * DVec3::X, DVec3::Y, DVec3::Z];
        let wall = |i: usize| {
            let (u, v) = (axes[(i + 1) % 3], axes[(i + 2) % 3]);
            let [corner, u, v] = if i < 3 { [DVec3::ZERO, u, v] } else { [axes[i - 3], v, u] };
            SurfaceSpec {
                name: None,
                shape: Shape::Parallelogram {
                    corner,
                    corner_u: corner + u,
                    corner_v: corner + v,
                    cells: [2, 2],
                },
                sides: Sides::Front,
                reflectance: (0.4 + 0.1 * i as f64).into(),
                emittance: if i == 0 { 1.0.into() } else { Spectrum::BLACK },
                cell_emittance: vec![],
                transmittance: Default::default(),
            }
        };
        Scene::build(&SceneSpec::new((0..6).map(wall).collect()), IndexChoice::Auto).unwrap()
    }

    /// Progressive refinement (Sh91): zones shoot their unshot power one after the other, in random order, by rays that
    /// carry as much as those of the incremental phase.
    fn progressive(faces: &FaceTable, rng: WalkRng, per_ray: f64) -> Vec<f64> {
        let plan = Iterations::default();
        let mut shooter = Shooter::new(faces, RayNumbers::random(rng), plan);
        let mut unshot = shooter.emitted();
        let mut incoming = vec![0.0; faces.list.len()];
        while let left @ 1.. = unshot[0].iter().filter(|power| **power > 0.0).count() {
            let choice = (shooter.caster.rng().pair()[0] * left as f64) as usize;
            let zone = (0..incoming.len()).filter(|&i| unshot[0][i] > 0.0).nth(choice).unwrap();
            let mut power: FacePowers = vec![vec![0.0; incoming.len()]];
            std::mem::swap(&mut power[0][zone], &mut unshot[0][zone]);
            let shares = shooter.shares(&power);
            let count = (shares[zone] / per_ray + shooter.caster.rng().pair()[0]) as u64;
            let landed = shooter.propagate(&power, &shares, count, per_ray, &|| true).unwrap();
            unshot = sum(&unshot, &shooter.reflected(&landed));
            incoming.iter_mut().zip(&landed[0]).for_each(|(sum, landed)| *sum += landed);
        }
        incoming
    }

    /// The incremental phase is progressive refinement but for the order: the same mean, and the same variance for rays of
    /// the same power. Two means of 2,000 runs at 4.5 standard errors for 24 patches: false-alarm rate 2·10⁻⁴, once and for
    /// all; of the variances' ratio the standard error is 3 %, and zones that are rounded one by one add 1 %.
    #[test]
    fn progressive_refinement_is_the_incremental_phase_in_another_order() {
        const RUNS: u64 = 2000;
        let scene = room();
        let faces = FaceTable::new(&scene);
        let (rays, sequence) = (9000, Sequence::new(8));
        let plan = Iterations::default();
        let per_ray = f64::from(plan.regular + 1) / (rays as f64 * (1.0 - scene.max_reflectance().max()));
        let incremental = |rng| {
            let mut shooter = Shooter::new(&faces, RayNumbers::random(rng), plan);
            shooter.incremental(None, rays, &mut |_, _, _| {}, &|| true).unwrap().remove(0)
        };
        let moments = |of: &dyn Fn(WalkRng) -> Vec<f64>, first: u64| {
            let runs: Vec<Vec<f64>> = (first..first + RUNS).map(|run| of(sequence.walk(run))).collect();
            let mean = |i: usize| runs.iter().map(|run| run[i]).sum::<f64>() / RUNS as f64;
            let patch = |i: usize| {
                let mean = mean(i);
                let variance =
                    runs.iter().map(|run| (run[i] - mean).powi(2)).sum::<f64>() / (RUNS - 1) as f64;
                (mean, variance)
            };
            (0..24).map(patch).collect::<Vec<_>>()
        };
        let ours = moments(&incremental, 0);
        let theirs = moments(&|rng| progressive(&faces, rng, per_ray), RUNS);
        let mut ratio = 0.0;
        for ((our_mean, our_variance), (mean, variance)) in ours.iter().zip(&theirs) {
            let error = ((our_variance + variance) / RUNS as f64).sqrt();
            assert!((our_mean - mean).abs() < 4.5 * error, "{our_mean}, {mean} ± {error}");
            ratio += variance / our_variance / 24.0;
        }
        println!("{ratio}");
        assert!((ratio - 1.0).abs() < 0.12, "{ratio}");
    }

    #[test]
    fn every_ray_of_a_chain_is_shot_once() {
        let scene = room();
        for births in [RayBirths::Systematic, RayBirths::Multinomial] {
            for rays in [24, 384, 5001] {
                let plan = Iterations { births, ..Iterations::default() };
                let iterations = observed(&scene, Sequence::new(1).walk(0), rays, plan);
                assert_eq!(iterations.iter().map(|iteration| iteration.rays).sum::<u64>(), rays);
                let regular =
                    iterations.iter().filter(|iteration| iteration.phase == IterationPhase::Regular);
                assert_eq!(regular.count(), 8);
            }
        }
    }

    #[test]
    fn rays_choose_their_faces_in_proportion() {
        let counts = multinomial(&[1.0, 0.0, 3.0], 40_000, &mut Sequence::new(2).walk(0));
        // 87 is the standard deviation; four of them are a false alarm in 16,000.
        assert!(counts[1] == 0 && counts[0].abs_diff(10_000) < 350 && counts[0] + counts[2] == 40_000);
        let alike = multinomial(&[0.0; 4], 4000, &mut Sequence::new(2).walk(0));
        assert!(alike.iter().all(|count| count.abs_diff(1000) < 120), "{alike:?}");
    }
}
