//! Light of lamps without area, straight on faces.
//!
//! A lamp is a point: what it sees of a face, past all occluders, is cut out as polygons, over which I cos θ/d² is integrated adaptively.

use glam::DVec3;
use radiosity::Scene;

use crate::answer::ExactError;
use crate::face::{ConvexPiece, FaceScene};
use crate::occlusion::Occluders;
use crate::penumbra::{Estimated, integral, wholes};
use crate::polygon::{Polygons, area};

/// The relative error that the light of a lamp on what it sees of a face aims at.
const ERROR: f64 = 1e-7;

/// How far in front of its place a lamp hangs, in tolerances: one in the plane of a surface is on the side that it is aimed at.
const LIFT: f64 = 10.0;

/// Faces are cut into parts that look narrower than this from the lamp [rad], so that no beam falls between the points of a rule, but no more
/// than so often.
const WIDEST: f64 = 0.1;
const MOST_CUTS: f64 = 5.0;

/// A lamp nearer to a face than its radius over this may not light it: no rule would find the peak.
const NEAREST: f64 = 200.0;

/// The light of lamps on faces, before it is reflected.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LampLight {
    /// The power that meets each face [W]; empty where there is no lamp.
    pub incoming: Vec<f64>,
    /// Its error, as estimated [W].
    pub error: Vec<f64>,
    /// The power of all lamps [W].
    pub total_power: f64,
}

impl LampLight {
    /// The light of a scene's lamps, channel by channel.
    ///
    /// # Errors
    /// If a lamp is distant, or lights a face from too near.
    pub(crate) fn of(scene: &Scene, faces: &FaceScene) -> Result<Vec<Self>, ExactError> {
        let lamps = 0..scene.lamp_count();
        // Places relative to the origin of the faces.
        let shift = scene.origin() - faces.origin;
        let places: Vec<DVec3> = lamps
            .clone()
            .map(|lamp| {
                let [place, aim] = scene.lamp_place(lamp).ok_or(ExactError::DistantLamp)?;
                Ok(place + shift + LIFT * faces.tolerance * aim)
            })
            .collect::<Result<_, ExactError>>()?;
        let occluders = Occluders::around(&faces.outlines, &places, faces.tolerance);
        let all = occluders.all();
        let face_of = |piece: usize| scene.faces().face_of(piece as u32) as usize;
        let channels = scene.channels();
        let mut light = vec![
            LampLight {
                incoming: vec![0.0; scene.faces().len()],
                error: vec![0.0; scene.faces().len()],
                total_power: 0.0
            };
            channels
        ];
        for (lamp, &place) in lamps.zip(&places) {
            let powers: Vec<f64> = (0..channels).map(|channel| scene.lamp_power(lamp, channel)).collect();
            let brightest = (0..channels).max_by(|a, b| powers[*a].total_cmp(&powers[*b])).unwrap_or(0);
            if powers[brightest] <= 0.0 {
                continue;
            }
            let beam = LampChannel { scene, lamp, channel: brightest, place, shift };
            let on_pieces = parallel::on_all_cores(faces.faces.len(), |piece| {
                let exposed = faces.faces[piece].exposed.iter();
                let parts = exposed.map(|part| beam.on(part, (&occluders, &all), faces.tolerance));
                parts
                    .collect::<Option<Vec<_>>>()
                    .map(|parts| parts.into_iter().fold(Estimated::default(), Estimated::plus))
            });
            for (channel, light) in light.iter_mut().enumerate() {
                let part = powers[channel] / powers[brightest];
                light.total_power += powers[channel];
                for (piece, found) in on_pieces.iter().enumerate() {
                    let Estimated { value, error } = found.ok_or(ExactError::NearLamp { lamp })?;
                    light.incoming[face_of(piece)] += part * value;
                    light.error[face_of(piece)] += part * error;
                }
            }
        }
        Ok(light)
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.incoming.is_empty()
    }
}

/// The light of one lamp in one channel.
struct LampChannel<'a> {
    scene: &'a Scene,
    lamp: usize,
    channel: usize,
    /// Its place relative to the origin of the faces [m], and that of the scene from there.
    place: DVec3,
    shift: DVec3,
}

impl LampChannel<'_> {
    /// The power that meets a piece of a face [W]; `None` where the lamp shines on it from too near.
    fn on(
        &self,
        piece: &ConvexPiece,
        (occluders, all): (&Occluders, &[usize]),
        tolerance: f64,
    ) -> Option<Estimated> {
        let (normal, height) = (piece.plane.normal, piece.plane.height(self.place));
        if height <= tolerance {
            return Some(Estimated::default());
        }
        let irradiance =
            |point: DVec3| self.scene.lamp_unshaded(self.lamp, point - self.shift, normal)[self.channel];
        let mut visible = Polygons::default();
        occluders.see(self.place, &piece.polygon, all, &mut visible);
        let foot = self.place - height * normal;
        let is_near = height * NEAREST < piece.radius && foot.distance(piece.center) <= piece.radius;
        if is_near && !visible.is_empty() && around(foot, normal, height).any(|point| irradiance(point) > 0.0)
        {
            return None;
        }
        let distance = (self.place.distance(piece.center) - piece.radius).max(height);
        let cuts = (2.0 * piece.radius / (WIDEST * distance)).log2().ceil().clamp(1.0, MOST_CUTS) as u32;
        let of_part = |part: &[DVec3]| {
            let parts = wholes(part);
            let rough = integral(&irradiance, &parts, f64::INFINITY, cuts).value;
            integral(&irradiance, &parts, ERROR * rough / area(part), cuts)
        };
        Some(visible.iter().map(of_part).fold(Estimated::default(), Estimated::plus))
    }
}

/// Points of a plane under a lamp at this height [m], as far as 2⁷ heights away in 16 directions.
fn around(foot: DVec3, normal: DVec3, height: f64) -> impl Iterator<Item = DVec3> {
    let (u, v) = normal.any_orthonormal_pair();
    let ring = move |power: i32| {
        (0..16).map(move |k| {
            let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / 16.0).sin_cos();
            foot + height * 2.0_f64.powi(power) * (cos * u + sin * v)
        })
    };
    (-3..8).flat_map(ring)
}
