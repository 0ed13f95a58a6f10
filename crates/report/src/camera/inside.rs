//! A camera that stands in a room, where a person could.
//!
//! Columns over the ground plan are searched for gaps between a floor and what is above it. In each gap an eye stands as high as
//! a person's, or in the same proportion where the unit of the scene is odd. An eye is in a room where nearly all rays around
//! it meet sides that reflect. Of the views from all eyes the camera takes the one that shows most lit area without
//! furniture in its face.

use std::collections::HashSet;

use glam::DVec3;
use job::Stand;
use parallel::on_all_cores;
use radiosity::{
    Scene, Side,
    rays::{Hit, Lookout, Ray},
};

use super::choice::{CLEARLY_MORE, Frame, TRIAL_SIZE};
use super::{Camera, Sight};
use crate::bounds::Bounds;

/// Columns searched along each side of the ground plan.
const COLUMNS: usize = 11;

/// The height of an eye above the floor, and the heights of gaps that people stand in [m].
const EYE: f64 = 1.55;
const STANDING: [f64; 2] = [1.9, 30.0];

/// The height of an eye at most, as a part of its gap.
const EYE_PART: f64 = 0.58;

/// Gaps lower than this part of the scene's height hold no eye.
const LOWEST_GAP: f64 = 0.12;

/// Floors at heights that differ by less than this part of the scene's height are one floor; a floor has at least this part of
/// the eyes. Tables have less.
const SAME_FLOOR: f64 = 0.03;
const FLOOR_SHARE: f64 = 0.1;

/// Surfaces that a column meets at most.
const MEETINGS: usize = 200;

/// Rays around an eye, and the part of them that must meet sides that reflect, not the sky: rooms have windows and doors.
const AROUND: usize = 192;
const ENCLOSED: f64 = 0.8;

/// Eyes whose views are tried.
const EYES: usize = 48;

/// Directions tried from an eye, around it and below the horizon [degrees].
const AZIMUTHS: usize = 16;
const PITCHES: [f64; 2] = [3.0, 12.0];

/// The field of view between the lower and the upper edge of the picture [degrees]: that of a 24 mm lens.
const FOV: f64 = 52.0;

/// What is nearer than this part of an eye's mean distance to its surroundings is in its face.
const IN_ITS_FACE: f64 = 0.3;

/// An eye is the worse the more it is nearer to a wall than this part of that distance.
const CLEARANCE: f64 = 0.25;

/// An eye that touches a surface, nearer than this part of the scene's height, is in no room: in a corner all around it may be at distance
/// 0, and what it looks at would be where it stands.
const TOUCHING: f64 = 1e-6;

/// Surfaces in sight count by this power of their number, beside the area: a view of a bare wall shows no room.
const VARIETY: f64 = 0.2;

/// A view of a room.
#[derive(Clone, Copy, Debug)]
pub(super) struct Inside {
    pub(super) stand: Stand,
    /// The lit area in sight [m²].
    pub(super) area: f64,
    /// Whether the room is as high as rooms of people are.
    pub(super) is_for_people: bool,
}

/// A place for an eye.
#[derive(Clone, Copy)]
struct Eye {
    place: DVec3,
    /// The height of the floor below it [m].
    floor: f64,
    /// The mean distance to what is around it, and the least [m].
    reach: f64,
    clearance: f64,
    is_for_people: bool,
}

/// A way to look: from an eye, in a direction.
#[derive(Clone, Copy)]
struct CameraPose {
    eye: Eye,
    azimuth: f64,
    pitch: f64,
}

/// The best view from the inside for a picture of a shape (width over height); `None` where the scene encloses no place for an eye.
pub(super) fn inside(
    scene: &Scene,
    frame: &Frame,
    aspect: f64,
    lit: &(impl Fn(u32) -> bool + Sync),
) -> Option<Inside> {
    let bounds = Bounds::below_sky(scene);
    let columns = on_all_cores(COLUMNS * COLUMNS, |number| eyes_of_column(scene, frame, &bounds, number));
    let looks: Vec<CameraPose> =
        chosen(columns.concat(), frame.height(&bounds)).into_iter().flat_map(CameraPose::around).collect();
    let size = [TRIAL_SIZE, (f64::from(TRIAL_SIZE) / aspect).ceil() as u32];
    let values = on_all_cores(looks.len(), |number| {
        let camera = Camera::standing(scene, frame, &looks[number].stand(scene, frame), size);
        value(&camera, scene, &looks[number].eye, lit)
    });
    let mut best: Option<(f64, Inside)> = None;
    for (look, (value, area)) in looks.iter().zip(values) {
        if value > best.as_ref().map_or(0.0, |(most, _)| most * CLEARLY_MORE) {
            let stand = look.stand(scene, frame);
            best = Some((value, Inside { stand, area, is_for_people: look.eye.is_for_people }));
        }
    }
    best.map(|(_, inside)| inside)
}

/// The eyes whose views are tried: on floors and not on tables, where people can stand if there are such places.
fn chosen(mut eyes: Vec<Eye>, height: f64) -> Vec<Eye> {
    // In what is as high as one storey, all other gaps are below furniture.
    let is_storey = (STANDING[0]..2.0 * STANDING[0]).contains(&height);
    if is_storey || eyes.iter().any(|eye| eye.is_for_people) {
        eyes.retain(|eye| eye.is_for_people);
    }
    let on_floor_of =
        |eye: &Eye| eyes.iter().filter(|other| (other.floor - eye.floor).abs() < SAME_FLOOR * height).count();
    let counts: Vec<usize> = eyes.iter().map(on_floor_of).collect();
    let least = FLOOR_SHARE * eyes.len() as f64;
    let kept = eyes.iter().zip(counts).filter(|&(_, count)| count as f64 >= least);
    let mut kept: Vec<Eye> = kept.map(|(eye, _)| *eye).collect();
    // Evenly over all: those of the largest hall have much in sight, and so have those in the corners of small rooms.
    kept.sort_by(|a, b| b.reach.total_cmp(&a.reach));
    let step = kept.len().div_ceil(EYES).max(1);
    kept.into_iter().step_by(step).collect()
}

/// The eyes in the gaps of a column.
fn eyes_of_column(scene: &Scene, frame: &Frame, bounds: &Bounds, number: usize) -> Vec<Eye> {
    let at = |k: usize| (k as f64 + 0.5) / COLUMNS as f64 - 0.5;
    let size = bounds.size();
    let offset = frame.right * at(number % COLUMNS) * size.dot(frame.right.abs())
        + frame.front * at(number / COLUMNS) * size.dot(frame.front.abs());
    let height = frame.height(bounds);
    let bottom = bounds.middle() + offset - frame.up * 0.51 * height;
    let mut eyes = Vec::new();
    let mut floor: Option<f64> = None;
    let mut ray = Ray { origin: bottom, direction: frame.up, from: Ray::FREE };
    for _ in 0..MEETINGS {
        let Some(hit) = scene.closest_hit(&ray) else { break };
        let surface = &scene.surfaces()[hit.surface as usize];
        let (below, above) = match hit.side {
            Side::Front => (Side::Front, Side::Back),
            Side::Back => (Side::Back, Side::Front),
        };
        ray = Ray { origin: ray.origin + frame.up * hit.t, from: hit.surface, ..ray };
        let ceiling = (ray.origin - bottom).dot(frame.up);
        if let Some(floor) = floor.filter(|_| surface.is_active(below)) {
            let gap = ceiling - floor;
            if gap > LOWEST_GAP * height {
                let is_for_people = (STANDING[0]..STANDING[1]).contains(&gap);
                let above_floor = if is_for_people { EYE.min(EYE_PART * gap) } else { EYE_PART * gap };
                let place = bottom + frame.up * (floor + above_floor);
                let reach = reach(scene, place).filter(|[_, clearance]| *clearance > TOUCHING * height);
                eyes.extend(reach.map(|[reach, clearance]| Eye {
                    place,
                    floor,
                    reach,
                    clearance,
                    is_for_people,
                }));
            }
        }
        floor = surface.is_active(above).then_some(ceiling);
    }
    eyes
}

/// The mean distance from a place to what is around it, and the least [m]; `None` where it is in no room.
fn reach(scene: &Scene, place: DVec3) -> Option<[f64; 2]> {
    let golden = std::f64::consts::PI * (3.0 - 5_f64.sqrt());
    let direction = |k: usize| {
        let z = 1.0 - (2 * k + 1) as f64 / AROUND as f64;
        let (sin, cos) = (golden * k as f64).sin_cos();
        let flat = (1.0 - z * z).sqrt();
        DVec3::new(flat * cos, flat * sin, z).normalize()
    };
    let rays: Vec<Ray> =
        (0..AROUND).map(|k| Ray { origin: place, direction: direction(k), from: Ray::FREE }).collect();
    let (mut met, mut distance, mut least) = (0.0, 0.0, f64::INFINITY);
    let (surfaces, before_sky) = (scene.surfaces(), scene.surfaces_before_sky());
    Lookout::new(scene).each_closest_hit(&rays, |_, hit| {
        let encloses = |hit: &Hit| {
            (hit.surface as usize) < before_sky && surfaces[hit.surface as usize].is_active(hit.side)
        };
        if let Some(hit) = hit.filter(encloses) {
            (met, distance, least) = (met + 1.0, distance + hit.t, least.min(hit.t));
        }
    });
    (met >= ENCLOSED * AROUND as f64).then(|| [distance / met, least])
}

impl CameraPose {
    fn around(eye: Eye) -> impl Iterator<Item = CameraPose> {
        let azimuth = |k: usize| 360.0 * k as f64 / AZIMUTHS as f64;
        (0..AZIMUTHS).flat_map(move |k| PITCHES.map(|pitch| CameraPose { eye, azimuth: azimuth(k), pitch }))
    }

    fn stand(&self, scene: &Scene, frame: &Frame) -> Stand {
        let (sin_a, cos_a) = self.azimuth.to_radians().sin_cos();
        let (sin_p, cos_p) = self.pitch.to_radians().sin_cos();
        let level = frame.right * sin_a - frame.front * cos_a;
        let eye = self.eye.place + scene.origin();
        let look_at = eye + (level * cos_p - frame.up * sin_p) * self.eye.reach;
        Stand { eye, look_at, up: Some(frame.up), fov: FOV }
    }
}

/// How much a view shows, and the lit area in sight [m²].
fn value(camera: &Camera, scene: &Scene, eye: &Eye, lit: &impl Fn(u32) -> bool) -> (f64, f64) {
    let (mut seen, mut near) = (HashSet::new(), 0.0);
    let area = camera.visible_area(scene, |sight: &Sight| {
        near += f64::from(u8::from(sight.distance < IN_ITS_FACE * eye.reach));
        let lit = lit(sight.piece);
        if lit {
            seen.insert(sight.surface);
        }
        lit
    });
    let near = near / f64::from(camera.size[0] * camera.size[1]);
    let room = (eye.clearance / (CLEARANCE * eye.reach)).min(1.0);
    (area * room * (1.0 - near).powi(4) * (seen.len() as f64).powf(VARIETY), area)
}
