//! Rays that `radiosity` traces, counted.
#![allow(dead_code, reason = "every test file uses its own part")]

use exact::Exact;
use radiosity::{IndexChoice, Scene, SceneSpec, Side, rays::Ray, surfaces::Face};

use crate::common::Numbers;

/// A source of random rays in a scene.
pub struct Rays<'a> {
    pub scene: &'a Scene,
    pub numbers: Numbers,
}

impl Rays<'_> {
    /// The face that a diffuse ray from another meets; `None` if it escapes or meets a back that is not active.
    pub fn next(&mut self, face: usize) -> Option<usize> {
        let faces = self.scene.faces();
        let Face { patch, side, surface: number, .. } = faces.get(face);
        let surface = &self.scene.surfaces()[number as usize];
        let cell = patch - faces.first_piece_on(number, Side::Front).expect("fronts are active");
        // Uniforms strictly inside (0, 1).
        let [u, v] = [(); 2].map(|()| self.numbers.uniform().max(1e-12));
        let origin = surface.point(surface.point_in_cell(cell, [u, v]));
        let ray = Ray { origin, direction: surface.direction(side, self.numbers.bits()), from: number };
        let hit = self.scene.closest_hit(&ray)?;
        let met = &self.scene.surfaces()[hit.surface as usize];
        met.is_active(hit.side).then(|| met.piece(met.cell_at(hit.uv), hit.side) as usize)
    }
}

/// Form factors are the fractions of rays: some 3·10³ z-scores at |z| < 5 and their mean square, with the
/// stated error of a row on top; false-alarm rate 2·10⁻³, once and for all with this seed.
#[track_caller]
pub fn assert_rays_agree(spec: &SceneSpec) {
    const RAYS: u32 = 80_000;
    let exact = Exact::of_scene(spec).unwrap();
    let scene = Scene::build(spec, IndexChoice::Flat).unwrap();
    let mut rays = Rays { scene: &scene, numbers: Numbers(33) };
    let errors = exact.exchange().row_errors();
    let (mut squares, mut count) = (0.0, 0.0);
    for (face, &error) in errors.iter().enumerate() {
        let mut hits = vec![0_u32; exact.face_count()];
        for _ in 0..RAYS {
            if let Some(met) = rays.next(face) {
                hits[met] += 1;
            }
        }
        for (j, &hits) in hits.iter().enumerate() {
            let f = exact.exchange().form_factor(face, j);
            let off = (f64::from(hits) / f64::from(RAYS) - f).abs();
            let noise = (f.max(1e-9) * (1.0 - f).max(0.0) / f64::from(RAYS)).sqrt();
            assert!(off <= 5.0 * noise + error, "from {face} to {j}: {off:e} off {f:e}");
            if f.min(1.0 - f) * f64::from(RAYS) > 20.0 {
                squares += (off / noise).powi(2);
                count += 1.0;
            }
        }
    }
    let mean: f64 = squares / count;
    println!("mean squared z of {count} pairs: {mean:.3}");
    assert!((mean - 1.0).abs() < 6.0 * (2.0_f64 / count).sqrt(), "mean squared z of {count}: {mean}");
}
