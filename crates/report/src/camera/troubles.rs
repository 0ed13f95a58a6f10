//! What is wrong with where a camera stands.

use job::{NamedView, View};
use radiosity::{
    Scene,
    rays::{Hit, Ray},
};

use super::Camera;
use super::choice::{STAND_SIZE, TRIAL_SIZE};
use crate::bounds::Bounds;

/// An eye nearer to what it sees than this part of the scene's size stands on it.
const ON_A_WALL: f64 = 1e-3;

/// What is wrong with where the views of a job let the camera stand: a sentence each.
pub fn view_troubles(scene: &Scene, view: &View, named: &[NamedView]) -> Vec<String> {
    let named = named.iter().map(|of| (format!("[views.{}]", of.name), view.from_stand(of.stand)));
    let all = std::iter::once(("[view]".to_owned(), *view)).chain(named);
    all.flat_map(|(table, view)| troubles_of(scene, &view, &table)).collect()
}

/// What is wrong with the view of a table.
fn troubles_of(scene: &Scene, view: &View, table: &str) -> Vec<String> {
    let Some(stand) = &view.stand else { return Vec::new() };
    let camera = Camera::at(scene, stand, view.size.unwrap_or(STAND_SIZE).map(|side| side.min(TRIAL_SIZE)));
    let [width, height] = camera.size;
    let middles = (0..height).flat_map(|y| (0..width).map(move |x| [x, y].map(|k| f64::from(k) + 0.5)));
    let middles: Vec<[f64; 2]> = middles.collect();
    let rays: Vec<Ray> = middles
        .iter()
        .map(|&[x, y]| Ray {
            origin: camera.eye,
            direction: camera.direction(x, y).normalize(),
            from: Ray::FREE,
        })
        .collect();
    let first: Vec<Hit> = scene.closest_hits(&rays).into_iter().flatten().collect();
    let seen = camera.look(scene, &middles).into_iter().flatten().count();
    if seen == 0 {
        let why = if first.is_empty() {
            "no surface is in front of it"
        } else {
            "surfaces show it only their backs"
        };
        return vec![format!("{table} sees nothing: {why}; move eye or look_at, or remove {table}")];
    }
    let bounds = Bounds::of(scene);
    let share = |part: usize, whole: usize| format!("{:.0} %", 100.0 * part as f64 / whole as f64);
    let most = |hits: usize| hits > 0 && 2 * hits > first.len();
    let near = ON_A_WALL * bounds.size().max_element();
    let close = first.iter().filter(|hit| hit.t < near).count();
    if most(close) {
        let wall =
            scene.surface_name(first.iter().min_by(|a, b| a.t.total_cmp(&b.t)).map_or(0, |hit| hit.surface));
        return vec![format!(
            "the eye of {table} stands on a wall: {} of what it sees is nearer than {near:.1e} m, \"{wall}\" first; move it away",
            share(close, first.len())
        )];
    }
    let is_back = |hit: &&Hit| !scene.surfaces()[hit.surface as usize].is_active(hit.side);
    let backs = first.iter().filter(is_back).count();
    if bounds.contains(camera.eye) && most(backs) {
        return vec![format!(
            "the eye of {table} stands inside a wall or a block: {} of what it meets first are backs of one-sided surfaces, \
             which are left out of the picture; move it to where fronts face it",
            share(backs, first.len())
        )];
    }
    Vec::new()
}
