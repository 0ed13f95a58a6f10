//! Lights without area: KHR_lights_punctual and EXT_lights_ies. Both shine along −z of their node.

use std::collections::HashMap;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
use std::path::Path;

use glam::{DAffine3, DVec3};
use photometry::Luminaire;
use radiosity::{
    Spectrum,
    lamps::{Emission, LampSpec, LampsSpec},
};

use super::buffers::{Data, decode_data, decode_percent};
use super::json::{At, LightJson, ProfileUse, element};
use crate::error::UnplacedError;
use crate::files::Files;
use crate::tally::NoteCounts;

/// The least difference of the cosines between which a spot fades (KHR_lights_punctual, inner and outer cone angles).
const SHARPEST: f64 = 0.001;

/// The lights of a scene's nodes, in their order.
#[derive(Debug, Default)]
pub(super) struct GltfLights {
    /// Each lamp; the profile whose table it has, by number.
    lights: Vec<(LampSpec, Option<usize>)>,
}

impl GltfLights {
    /// Adds a light of KHR_lights_punctual, in cd, or in lx from far away.
    pub(super) fn add(&mut self, json: &LightJson, node: &str, place: &DAffine3, tally: &mut NoteCounts) {
        let emission = match json.kind.as_str() {
            "point" => Emission::Uniform,
            "spot" => spot(json.spot.inner_cone_angle, json.spot.outer_cone_angle),
            "directional" => Emission::Distant { rim: 1.0 },
            _ => return tally.count("lights of no known type left out"),
        };
        let name = json.name.as_deref().filter(|name| !name.is_empty()).unwrap_or(node);
        let strength = (json.color, json.intensity);
        self.hang((name, place), emission, strength, None, tally);
    }

    /// Adds a light of EXT_lights_ies.
    pub(super) fn add_profile(
        &mut self,
        json: &ProfileUse,
        node: &str,
        place: &DAffine3,
        tally: &mut NoteCounts,
    ) {
        let strength = (json.color, json.multiplier);
        self.hang((node, place), Emission::Uniform, strength, Some(json.light), tally);
    }

    fn hang(
        &mut self,
        (name, place): (&str, &DAffine3),
        emission: Emission,
        (color, intensity): (Option<[f64; 3]>, Option<f64>),
        profile: Option<usize>,
        tally: &mut NoteCounts,
    ) {
        let strength = color.unwrap_or([1.0; 3]).map(|channel| channel * intensity.unwrap_or(1.0));
        let is_light = strength.iter().all(|&channel| (0.0..f64::MAX).contains(&channel));
        let strength = Spectrum::rgb(strength);
        let Some(axes) = axes(place).filter(|_| is_light && strength.is_lit()) else {
            return tally.count("lights without direction or intensity left out");
        };
        let lamp =
            LampSpec { name: name.into(), axes, ..LampSpec::new(place.translation, emission, strength) };
        self.lights.push((lamp, profile));
    }

    /// The lamps, with the tables of their profiles, each read once.
    ///
    /// # Errors
    /// A profile that does not exist, cannot be read, or is no file of LM-63.
    pub(super) fn into_lamps(
        self,
        data: &Data<'_>,
        path: &Path,
        files: &mut Files<'_>,
        tally: &mut NoteCounts,
    ) -> Result<LampsSpec, At> {
        let mut lamps = LampsSpec::default();
        let mut known = HashMap::new();
        for (mut lamp, profile) in self.lights {
            tally.count("lights without area, which are lamps in cd, or in lx from far away");
            if let Some(profile) = profile {
                let number = match known.get(&profile) {
                    Some(number) => *number,
                    None => {
                        let luminaire = read_profile(data, profile, path, files)?;
                        lamps.tables.push(luminaire.distribution);
                        lamps.openings.push(luminaire.shape);
                        let number = lamps.tables.len() as u32 - 1;
                        known.insert(profile, number);
                        number
                    }
                };
                lamp.emission = Emission::Table(number);
            }
            lamps.list.push(lamp);
        }
        Ok(lamps)
    }
}

/// A spot, full in the inner cone and dark from the outer one on, whose half angles are in radians.
fn spot(inner: Option<f64>, outer: Option<f64>) -> Emission {
    let outer = outer.filter(|angle| (0.0..=FRAC_PI_2).contains(angle)).unwrap_or(FRAC_PI_4).cos();
    let inner = inner.filter(|angle| (0.0..=FRAC_PI_2).contains(angle)).unwrap_or(0.0).cos();
    let outer = outer.min(1.0 - SHARPEST);
    Emission::Spot { inner: inner.max(outer + SHARPEST), outer }
}

/// The axes of a node in the scene, without its scale: −z is kept, and x in the plane of both. `None` where it has no direction.
fn axes(place: &DAffine3) -> Option<[DVec3; 3]> {
    let z = place.matrix3.z_axis.try_normalize()?;
    let x = place.matrix3.x_axis.reject_from_normalized(z).try_normalize()?;
    Some([x, z.cross(x), z])
}

/// Reads a profile: of a view, of a data URI or of a file beside this one.
fn read_profile(data: &Data<'_>, number: usize, path: &Path, files: &mut Files<'_>) -> Result<Luminaire, At> {
    let at = |problem: String, why: String| {
        let remedy = "put an LM-63 file there, or remove the light";
        (format!("EXT_lights_ies.lights[{number}]"), UnplacedError::new(problem, why, remedy))
    };
    let profiles = &data.document.extensions.profiles.lights;
    let json = element(profiles, number, "lights", "EXT_lights_ies")?;
    let content = match (json.buffer_view, json.uri.as_deref()) {
        (Some(view), _) => data.view(view).map(<[u8]>::to_vec),
        (None, Some(uri)) => match uri.strip_prefix("data:") {
            Some(encoded) => decode_data(encoded),
            None => {
                let name = decode_percent(uri);
                let read = files.beside(path, &name);
                Some(
                    read.map_err(|error| {
                        at(format!("the profile {name:?} cannot be read"), error.to_string())
                    })?
                    .1,
                )
            }
        },
        (None, None) => None,
    };
    let content = content.ok_or_else(|| at("there is no profile".into(), "the light is in it".into()))?;
    Luminaire::read(&content).map_err(|error| {
        at(format!("the profile is malformed at line {error}"), "its light is not known".into())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spots_have_the_cones_of_the_extension() {
        let Emission::Spot { inner, outer } = spot(None, None) else { unreachable!() };
        assert_eq!([inner, outer], [1.0, FRAC_PI_4.cos()]);
        // A sharp edge, and one at the axis, fade over the least difference of cosines.
        for (angles, expected) in
            [([0.5, 0.5], [0.5_f64.cos() + SHARPEST, 0.5_f64.cos()]), ([0.0, 0.0], [1.0, 0.999])]
        {
            let Emission::Spot { inner, outer } = spot(Some(angles[0]), Some(angles[1])) else {
                unreachable!()
            };
            assert!((inner - expected[0]).abs() < 1e-12 && (outer - expected[1]).abs() < 1e-12, "{angles:?}");
        }
    }

    #[test]
    fn axes_forget_scale_and_mirrors() {
        let place = DAffine3::from_scale_rotation_translation(
            DVec3::new(2.0, -3.0, 0.5),
            glam::DQuat::from_rotation_y(0.7),
            DVec3::ONE,
        );
        let [x, y, z] = axes(&place).unwrap();
        assert!((x.cross(y) - z).length() < 1e-12 && (z.length() - 1.0).abs() < 1e-12);
        assert!((z - glam::DQuat::from_rotation_y(0.7) * DVec3::Z).length() < 1e-12);
        assert_eq!(axes(&DAffine3::from_scale(DVec3::new(1.0, 1.0, 0.0))), None);
    }
}
