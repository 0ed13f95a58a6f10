//! Light straight from emitters, H_d, apart from the light that has been reflected.
//!
//! Direct light varies most from face to face, and the counts of rays between a small emitter and many faces are as noisy as
//! counts are. Shadow rays bring it with the noise of the kernel alone; links then carry b = B − E, which is smooth. Near
//! emitters, where the kernel varies most, links bring it (`near.rs`).

use std::sync::Mutex;

use super::aim::{PILOT_SEED, density};
use super::cast::systematic;
use super::faces::FaceTable;
use super::halves::LinkRays;
use super::lamps::{EmittingPieces, emitted_power, emitted_shares};
use super::near::NearThresholds;
use super::numbers::RayNumbers;
use super::place::psi;
use super::shadow::{LitShadowRay, ShadowCaster};
use crate::random::rng::{Sequence, WalkRng};
use crate::thread_pool::{PARTS_PER_THREAD, ThreadPool};

/// At most one in this many rays of a chain is a shadow ray.
const SHADOW_SHARE: u64 = 4;

/// The rays per face that links keep for themselves: with fewer, intervals of chains are too narrow.
const RAYS_OF_LINKS: u64 = 32;

/// The largest part of the area that may emit. Where all of it does, links are exact: B hardly differs along them.
const MOST_EMITTING: f64 = 0.125;

/// The shadow rays of a pilot from each of its faces.
const PILOT_RAYS: u32 = 8;

/// A pilot shoots at most one ray for this many of the chain.
const PILOT_PART: u64 = 32;

/// Near light may err by this many times what all light would along links, in squares. It did by 16 times in an office of 741 polygons, whose lamp
/// lies in a reflector: there links of near light had next to no rays.
const MOST_NEAR: f64 = 4.0;

/// Direct light of one chain.
pub(super) struct Direct<'a> {
    faces: &'a FaceTable<'a>,
    lamps: EmittingPieces,
    /// The shadow rays of each face.
    rays: Vec<u32>,
    bounds: NearThresholds,
    /// H by shadow rays [W/m²], face-major and channel-minor.
    far: Vec<f64>,
    /// The means of H·ψ₁ and H·ψ₂ in the same order; empty where they are not asked for.
    slopes: Vec<[f64; 2]>,
}

/// What a shadow ray of a pilot says, in units of Φ_T. Light that comes along links from a lamp has A_i times the variance light · e/(d_i + d_j),
/// since K_ij has the variance K_ij/(d_i + d_j), d the rays per area.
struct PilotSight {
    /// The face that it leaves.
    face: u32,
    /// The light that it stands for, and the near light of that [1/m²]: the kernel, since a lamp is chosen by its part of Φ_T.
    all: f64,
    near: f64,
    /// e: what its lamp emits [1/m²].
    emitted: f64,
}

impl PilotSight {
    fn new(&LitShadowRay { face, lamp, kernel, .. }: &LitShadowRay, far: f64) -> Self {
        PilotSight { face, all: kernel, near: kernel - far, emitted: lamp.part / lamp.piece.area }
    }
}

impl<'a> Direct<'a> {
    /// Shadow rays for a chain of `rays` rays in all, where they pay. What pays is a
    /// function of the scene and of `rays`. `None` in place of an answer once `pool` no longer want it.
    pub(super) fn where_it_pays(
        faces: &'a FaceTable<'a>,
        rays: u64,
        pool: &dyn ThreadPool,
    ) -> Option<Option<Self>> {
        let blind = density(&faces.areas, &[]);
        let spare = rays.saturating_sub(RAYS_OF_LINKS * faces.list.len() as u64);
        let shadow = (rays / SHADOW_SHARE).min(spare);
        let emitting = faces.list.iter().filter(|face| face.emittance.is_lit()).map(|face| face.area);
        let emitting = emitting.sum::<f64>();
        let is_small = emitting > 0.0 && emitting <= MOST_EMITTING * faces.areas.iter().sum::<f64>();
        if shadow == 0 || !is_small {
            return Some(None);
        }
        let of_links: Vec<f64> = blind.iter().map(|part| part * (rays - shadow) as f64).collect();
        let shadows = systematic(&blind, shadow, 0.5);
        let bounds = NearThresholds::new(faces, &of_links, &shadows, &emitted_shares(faces));
        let direct = Direct {
            faces,
            lamps: EmittingPieces::new(faces),
            rays: shadows,
            bounds,
            far: Vec::new(),
            slopes: Vec::new(),
        };
        let pays = direct.beats_links(rays, pool)?;
        Some(pays.then_some(direct))
    }

    /// The shadow rays of all faces.
    pub(super) fn rays(&self) -> u64 {
        self.rays.iter().map(|&rays| u64::from(rays)).sum()
    }

    /// How light is divided between shadow rays and links.
    pub(super) fn bounds(&self) -> &NearThresholds {
        &self.bounds
    }

    /// Whether shadow rays bring direct light with a smaller squared error than half of the rays would as counts, and near light does not err by
    /// much more than all light would, by a pilot from some of the faces. In units of Φ_T, a count of m of `n` rays errs by A_i·h²/m = h/n,
    /// since m = A_i·h·n.
    fn beats_links(&self, rays: u64, pool: &dyn ThreadPool) -> Option<bool> {
        let shares: Vec<f64> = self.rays.iter().map(|&rays| f64::from(rays)).collect();
        let sample = rays / (PILOT_PART * u64::from(PILOT_RAYS)) + 1;
        let chosen = systematic(&shares, sample.min(self.rays.len() as u64), 0.5);
        let pilot: Vec<u32> = chosen.iter().map(|&times| times.min(1) * PILOT_RAYS).collect();
        let mut sums = vec![[0.0; 2]; pilot.len()];
        let mut sights: Vec<PilotSight> = Vec::new();
        // Of one seed: chains with the same number of rays decide alike.
        let numbers = RayNumbers::sobol(Sequence::new(PILOT_SEED).walk(0));
        let mut caster = ShadowCaster::new(self.faces, &self.lamps, numbers);
        caster.cast(0, &pilot, &|| pool.go_on(), |sight| {
            let far = self.bounds.far(sight.face, sight.lamp.face, sight.kernel);
            let [sum, squares] = &mut sums[sight.face as usize];
            (*sum, *squares) = (*sum + far, *squares + far * far);
            sights.push(PilotSight::new(sight, far));
        })?;
        let n = f64::from(PILOT_RAYS);
        let per_share = sample as f64 / self.rays() as f64;
        let stands_for = |face: usize| 1.0 / (per_share * shares[face]).min(1.0);
        let (mut by_shadows, mut by_counts) = (0.0, 0.0);
        for (face, [sum, squares]) in sums.into_iter().enumerate().filter(|&(face, _)| pilot[face] > 0) {
            let variance = (squares - sum * sum / n) / (n - 1.0);
            by_shadows += stands_for(face) * self.faces.areas[face] * variance / shares[face];
            by_counts += stands_for(face) * (sum / n) / (0.5 * rays as f64);
        }
        let over_sights = |of: &dyn Fn(&PilotSight) -> f64| -> f64 {
            sights.iter().map(|sight| stands_for(sight.face as usize) * of(sight) / n).sum()
        };
        let noise = |sight: &PilotSight, of_lamps: f64| {
            sight.emitted / (self.bounds.links(sight.face) + of_lamps * sight.emitted)
        };
        let near_part = over_sights(&|sight| self.faces.areas[sight.face as usize] * sight.near).min(1.0);
        // Other light asks for as many rays as all emitted light would.
        let of_near = (rays - self.rays()) as f64 * near_part / (1.0 + near_part);
        let near = over_sights(&|sight| sight.near * sight.near / sight.all * noise(sight, of_near));
        let all = over_sights(&|sight| sight.all * noise(sight, 0.5 * rays as f64));
        Some(by_shadows < by_counts && near < MOST_NEAR * all)
    }

    /// What a shadow ray brings of the emittance of its lamp.
    fn brought(&self, &LitShadowRay { face, lamp, kernel, .. }: &LitShadowRay) -> f64 {
        self.bounds.far(face, lamp.face, kernel) * lamp.piece.area / lamp.part
    }

    /// The means of H·ψ₁ and H·ψ₂ by shadow rays [W/m²], face-major and channel-minor.
    pub(super) fn slopes(&self) -> &[[f64; 2]] {
        &self.slopes
    }

    /// Shoots the shadow rays of all faces, and looks at how their light is spread where slopes are asked for. `None` once `pool`, which
    /// share them, no longer want it.
    pub(super) fn cast(&mut self, rng: &mut WalkRng, with_slopes: bool, pool: &dyn ThreadPool) -> Option<()> {
        let numbers = RayNumbers::independent(rng);
        let parts = if pool.count() > 1 { PARTS_PER_THREAD * pool.count() } else { 1 };
        let of_part = self.rays.len().div_ceil(parts);
        let found: Vec<Mutex<Option<[Vec<f64>; 3]>>> =
            self.rays.chunks(of_part).map(|_| Mutex::new(None)).collect();
        pool.share(found.len(), &|part| {
            let first = part * of_part;
            let rays = &self.rays[first..(first + of_part).min(self.rays.len())];
            let far = self.far(first, rays, (numbers.clone(), with_slopes), pool);
            *found[part].lock().expect("no thread panics with it") = far;
        });
        let parts = found.into_iter().map(|part| part.into_inner().expect("no thread panics with it"));
        for [far, first, second] in parts.collect::<Option<Vec<_>>>()? {
            self.far.extend(far);
            self.slopes.extend(first.into_iter().zip(second).map(|(first, second)| [first, second]));
        }
        Some(())
    }

    /// H by shadow rays of the faces from `first` on, which shoot `rays`, and the means of H·ψ₁ and H·ψ₂, which are empty where they are
    /// not asked for.
    fn far(
        &self,
        first: usize,
        rays: &[u32],
        (numbers, with_slopes): (RayNumbers, bool),
        pool: &dyn ThreadPool,
    ) -> Option<[Vec<f64>; 3]> {
        let channels = self.faces.scene.channels();
        let asked = if with_slopes { 3 } else { 1 };
        let mut far = [0, 1, 2].map(|k| vec![0.0; if k < asked { channels * rays.len() } else { 0 }]);
        let mut caster = ShadowCaster::new(self.faces, &self.lamps, numbers);
        caster.cast(first, rays, &|| pool.go_on(), |sight| {
            let place = sight.face as usize - first;
            let brought = self.brought(sight) / f64::from(rays[place]);
            let [u, v] = if with_slopes { psi(self.faces.scene, sight.place) } else { [0.0; 2] };
            for (far, factor) in far.iter_mut().zip([1.0, u, v]).take(asked) {
                let sums = &mut far[channels * place..][..channels];
                let light = |c: usize| sight.lamp.piece.emittance[c] * brought;
                sums.iter_mut().enumerate().for_each(|(c, h)| *h += light(c) * factor);
            }
        })?;
        Some(far)
    }

    /// H_d of every face in every channel [W/m²].
    pub(super) fn irradiance(&self, rays: &LinkRays) -> Vec<Vec<f64>> {
        let channels = self.faces.scene.channels();
        let of_channel = |c: usize| self.far.iter().skip(c).step_by(channels).copied().collect();
        let mut irradiance: Vec<Vec<f64>> = (0..channels).map(of_channel).collect();
        rays.near_light(&self.faces.areas, |i, j, exchange| {
            let emittance = self.faces.list[j].emittance;
            let per_area = exchange / self.faces.areas[i];
            irradiance.iter_mut().enumerate().for_each(|(c, h)| h[i] += emittance[c] * per_area);
        });
        let closed = rays.lost.iter().all(|&lost| lost == [0; 2]);
        for (c, irradiance) in irradiance.iter_mut().enumerate() {
            balance(irradiance, &self.faces.areas, emitted_power(self.faces, c), closed);
        }
        irradiance
    }

    /// The radiosity that goes along links [W/m²]: b, and of E the part that is near light.
    pub(super) fn along_links(&self, rays: &LinkRays, reflected: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let mut part = vec![0.0; self.faces.areas.len()];
        rays.near_light(&self.faces.areas, |_, j, exchange| {
            part[j] += exchange / self.faces.areas[j];
        });
        let faces = || self.faces.list.iter().zip(&part);
        let sum = |(c, b): (usize, &Vec<f64>)| {
            let each = faces().zip(b).map(|((face, part), b)| b + face.emittance[c] * part.min(1.0));
            each.collect()
        };
        reflected.iter().enumerate().map(sum).collect()
    }
}

/// Scales direct light so that all the power arrives that is emitted, where no ray was lost.
fn balance(irradiance: &mut [f64], areas: &[f64], power: f64, closed: bool) {
    let arrives: f64 = irradiance.iter().zip(areas).map(|(h, area)| h * area).sum();
    if closed && arrives > 0.0 {
        irradiance.iter_mut().for_each(|h| *h *= power / arrives);
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::{IndexChoice, Scene};
    use crate::{SceneSpec, Shape, SurfaceSpec};

    fn pays(spec: &SceneSpec, rays: u64) -> bool {
        let scene = Scene::build(spec, IndexChoice::Auto).unwrap();
        let faces = FaceTable::new(&scene);
        Direct::where_it_pays(&faces, rays, &|| true).unwrap().is_some()
    }

    /// A scene of parallelograms with other lengths.
    fn scaled(spec: &SceneSpec, factor: f64) -> SceneSpec {
        let mut spec = spec.clone();
        for surface in &mut spec.surfaces {
            let Shape::Parallelogram { corner, corner_u, corner_v, .. } = &mut surface.shape else {
                panic!()
            };
            [corner, corner_u, corner_v].into_iter().for_each(|point| *point *= factor);
        }
        spec
    }

    #[test]
    fn shadow_rays_go_where_little_of_the_area_emits() {
        let mut spec = SceneSpec::furnace(3, 0.5);
        assert!(!pays(&spec, 10_000), "all emits");
        spec.surfaces.iter_mut().for_each(|surface| surface.emittance = 0.0.into());
        spec.surfaces[0].cell_emittance.push((4, 1.0.into()));
        // In millimetres and in kilometres, too.
        for power in [-12, 0, 12] {
            let spec = scaled(&spec, 2.0_f64.powi(power));
            assert!(pays(&spec, 10_000) && pays(&spec, 40 * 54));
            assert!(!pays(&spec, 32 * 54), "links need all rays");
        }
    }

    /// Of a lamp in a small reflector nearly all light that counts is near light, which shadow rays leave to links.
    #[test]
    fn a_lamp_in_a_reflector_has_no_shadow_rays() {
        let mut spec = SceneSpec::furnace(8, 0.5);
        spec.surfaces.iter_mut().for_each(|surface| surface.emittance = 0.0.into());
        let [x, y, z] = DVec3::AXES;
        let corner = DVec3::new(0.49, 0.49, 0.98);
        let quad = |corner, u: DVec3, v: DVec3| Shape::parallelogram(corner, 0.02 * u, 0.02 * v, [1, 1]);
        spec.surfaces.push(SurfaceSpec::new(quad(corner + 0.01 * z, y, x), 0.0).emitting(1.0));
        assert!(pays(&spec, 1 << 19) && pays(&scaled(&spec, 64.0), 1 << 19));
        for (from, u, v) in [(DVec3::ZERO, y, z), (0.02 * x, z, y), (DVec3::ZERO, z, x), (0.02 * y, x, z)] {
            spec.surfaces.push(SurfaceSpec::new(quad(corner + from, u, v), 0.8));
        }
        assert!(!pays(&spec, 1 << 19) && !pays(&scaled(&spec, 64.0), 1 << 19));
    }

    #[test]
    fn what_arrives_in_a_closed_scene_is_what_is_emitted() {
        let areas = [1.0, 2.0];
        let balanced = |mut h: [f64; 2], closed| {
            balance(&mut h, &areas, 10.0, closed);
            h
        };
        assert_eq!(balanced([1.0, 2.0], true), [2.0, 4.0]);
        assert_eq!(balanced([1.0, 2.0], false), [1.0, 2.0], "the rest is lost");
        assert_eq!(balanced([4.0, 8.0], false), [4.0, 8.0], "a bound on one side would be a bias");
        assert_eq!(balanced([0.0; 2], true), [0.0; 2]);
    }
}
