//! The walk as the papers write it: one alone, without lanes, weights or tallies. **Start reading here.**
//!
//! A shooting walk estimates the solution of the power system φ_i = Σ_j F_ji (Φ_j + R_j φ_j), φ_i being the power that comes
//! in on patch i [W] (S97 §2.1). Unrolled, that is Σ over paths s → … → i of Φ_s F_s· R· F·· … F·i: the walk is born on
//! source s with probability Φ_s/Φ_T, goes from j to i with probability F_ji (a cosine-distributed ray from a uniform point of
//! j meets i so often), and survives on i with probability R_i. So of N walks
//!
//! - collision: φ_i ≈ Φ_T/N × arrivals on i (S97 proposition 2.14),
//! - absorption: φ_i ≈ Φ_T/(N·(1 − R_i)) × deaths on i (S97 proposition 2.1),
//! - survival: φ_i ≈ Φ_T/(N·R_i) × survivals on i (S97 proposition 2.9),
//!
//! and the reflected radiosity is b_i = (R_i/A_i)·φ_i, to which E_i is added: nothing is scored at the birth. All that
//! `walk/batch.rs` and what it calls do is this walk, a hundred at a time; its tests compare it with this one, bit for bit.

use super::Space;
use super::batch::WalkEnd;
use crate::random::rng::WalkRng;
use crate::scene::panes::thin;
use crate::scene::{Scene, SurfaceCell};
use crate::trace::ray::Ray;

/// One grey walk from the emitters; `arrived` is told each face that the walk arrives on, and whether it survives there.
///
/// ```
/// use radiosity::{IndexChoice, Scene, SceneSpec, Sequence, Space, methods::WalkEnd, plain_walk};
///
/// let scene = Scene::build(&SceneSpec::furnace(1, 0.5), IndexChoice::Auto)?;
/// let mut met = Vec::new();
/// let end = plain_walk(&scene, Space::Discrete, Sequence::new(1).walk(0), |face, survives| met.push((face, survives)));
/// assert_eq!((end, met.last().map(|&(_, survives)| survives)), (WalkEnd::Absorbed, Some(false)));
/// # Ok::<(), radiosity::SceneError>(())
/// ```
pub fn walk(scene: &Scene, space: Space, mut rng: WalkRng, mut arrived: impl FnMut(u32, bool)) -> WalkEnd {
    // Emit: a source with probability Φ_s/Φ_T, a uniform point of it, and a direction by its distribution.
    let mut ray = scene.emit(&mut rng);
    loop {
        // Trace.
        let hit = scene.closest_hit(&ray);
        // Panes on the way pass the walk with a probability; the survival that follows shares their random number.
        let passed = scene.passed_panes(&ray, hit.map_or(f64::INFINITY, |hit| hit.t));
        let Some(survival) = thin(rng.bits(), passed) else { return WalkEnd::Absorbed };
        let Some(hit) = hit else { return WalkEnd::Escaped };
        let surface = &scene.surfaces()[hit.surface as usize];
        if !surface.is_active(hit.side) {
            return WalkEnd::AbsorbedBack;
        }
        // Arrive, and survive with probability R. Every arrival draws three numbers, used or not.
        let cell = surface.cell_at(hit.uv);
        let (survives, fresh) = (surface.survives(survival), rng.bits());
        let face = scene.face_at(hit.surface, cell, hit.side);
        arrived(face, survives);
        if !survives {
            return WalkEnd::Absorbed;
        }
        // A sheet passes some of the survivors on to its other side.
        let side = scene.parts.sheets.leaves(hit.surface, hit.side, survival);
        // Scatter: from a fresh point of the patch, or from the hit point (BS §2). The cosine of the angle to the normal is the density
        // of directions.
        let (from, point) = match space {
            Space::Discrete => scene.scatter(SurfaceCell { surface: hit.surface, cell }, face, fresh),
            Space::Continuous => (hit.surface, surface.inside(hit.uv)),
        };
        let surface = &scene.surfaces()[from as usize];
        let (origin, direction) = (surface.point(point), surface.direction(side, rng.bits()));
        ray = Ray { origin, direction, from };
    }
}
