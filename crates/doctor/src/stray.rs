//! Lamps without area that hang outside of their room.

use glam::DVec3;
use radiosity::{Scene, rays::Ray};

use crate::pilot::Draws;

/// The rays that set out from each lamp.
const RAYS: usize = 256;

/// The part of a lamp's rays from which on it is said to be lost.
const STRAY: f64 = 0.95;

/// The lamps of which nearly all light is lost at once though no surface is flipped, a sentence each: they hang outside of the box of all surfaces, or
/// most of that light meets nothing.
pub(crate) fn stray_lamps(scene: &Scene) -> Vec<String> {
    if scene.lamp_count() == 0 {
        return Vec::new();
    }
    let corners = || scene.surfaces().iter().flat_map(|surface| surface.outline());
    let low = corners().fold(DVec3::INFINITY, DVec3::min);
    let high = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
    let is_outside = |place: DVec3| place.cmplt(low).any() || place.cmpgt(high).any();
    let is_lit = |&lamp: &usize| (0..scene.channels()).any(|channel| scene.lamp_power(lamp, channel) > 0.0);
    (0..scene.lamp_count()).filter(is_lit).filter_map(|lamp| stray(scene, lamp, &is_outside)).collect()
}

fn stray(scene: &Scene, lamp: usize, is_outside: &dyn Fn(DVec3) -> bool) -> Option<String> {
    let [place, _] = scene.lamp_place(lamp)?;
    let mut draws = Draws::new(lamp as u64);
    let rays: Vec<Ray> =
        (0..RAYS).map(|_| scene.lamp_birth(lamp, [0; 3].map(|_: u64| draws.bits()))).collect();
    let (mut lost, mut escaped) = (0_u32, 0_u32);
    let mut backs = vec![0_u32; scene.surfaces().len()];
    for hit in scene.closest_hits(&rays) {
        match hit {
            None => (lost, escaped) = (lost + 1, escaped + 1),
            Some(hit) if !scene.surfaces()[hit.surface as usize].is_active(hit.side) => {
                lost += 1;
                backs[hit.surface as usize] += 1;
            }
            Some(_) => {}
        }
    }
    let part = f64::from(lost) / RAYS as f64;
    if part < STRAY || !is_outside(place) && 2 * escaped < lost {
        return None;
    }
    let most = (0..).zip(&backs).filter(|(_, rays)| **rays > 0).max_by_key(|(_, rays)| **rays);
    let behind =
        most.map_or(String::new(), |(surface, _)| format!(", behind {}", scene.surface_name(surface)));
    // Lamps hang a little off the plane that they are written in.
    let [x, y, z] = (place + scene.origin()).to_array().map(|x| (1e3 * x).round() / 1e3);
    Some(format!(
        "{:.0} % of the light of the lamp at ({x}, {y}, {z}) m is lost at once: it hangs outside of its room{behind}, or is aimed away from it; correct its position, which is in metres, or its aim",
        100.0 * part
    ))
}
