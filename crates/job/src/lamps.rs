//! The tables `[[lamp]]` of a scene: lamps without area, from the files of luminaires or by their intensity.

use std::path::{Path, PathBuf};

use glam::DVec3;
use radiosity::{
    Spectrum,
    lamps::{Emission, LampSpec, LampsSpec},
};

use crate::document::{KeyTable, Value};
use crate::error::Error;
use crate::imports::positive;
use crate::keys::LAMP_KEYS;
use crate::keys::LISTS;
use crate::lamp::load_lamp;
use crate::material::read_spectrum;
use crate::shape::read_point;

/// The key of a file that a lamp has already, and the number of its table.
type NamedFile = Vec<(PathBuf, u32)>;

/// Reads the `[[lamp]]` tables of a scene in this folder.
pub(crate) fn read_lamps(value: Value<'_>, folder: &Path) -> Result<LampsSpec, Error> {
    let mut lamps = LampsSpec::default();
    let mut known = NamedFile::new();
    for (number, value) in value.tables(LISTS[3])?.into_iter().enumerate() {
        let mut table = value.table_called(format!("lamp {number}: "), LAMP_KEYS)?;
        let name = table.take("name");
        let name = name.map_or(Ok(number.to_string()), |value| {
            value.name("lamp", "sources and messages tell lamps by it", "write a visible name on one line")
        })?;
        table.rename(format!("lamp {number} ({name:?}): "));
        let (emission, strength) =
            read_emission(&mut table, LampFiles { folder, lamps: &mut lamps, known: &mut known })?;
        let lamp = LampSpec { name, ..LampSpec::new(DVec3::ZERO, emission, strength) };
        lamps.list.push(place(table, lamp)?);
    }
    Ok(lamps)
}

/// Hangs a lamp where its table says.
fn place(mut table: KeyTable<'_>, lamp: LampSpec) -> Result<LampSpec, Error> {
    let is_distant = matches!(lamp.emission, Emission::Distant { .. });
    let position = match (table.take("position"), is_distant) {
        (Some(value), false) => read_point(value)?,
        (None, true) => DVec3::ZERO,
        (Some(value), true) => {
            return Err(value.refuse(
                "a lamp that is far away does not use this key".into(),
                "its light comes from a direction alone",
                "remove the key, or write `intensity` in place of `illuminance`",
            ));
        }
        (None, false) => {
            return Err(Error::MissingKey {
                place: table.place("position"),
                why: "a lamp hangs somewhere",
                remedy: "position = [x, y, z], in metres: the centre of its luminous opening".into(),
            });
        }
    };
    let aim = table.take("aim");
    if aim.is_none() && is_distant {
        return Err(Error::MissingKey {
            place: table.place("aim"),
            why: "light from far away comes from some direction",
            remedy: "aim = [0, 0, -1], the way that it goes".into(),
        });
    }
    let aim = aim.map(|value| read_direction(value)).transpose()?.unwrap_or(DVec3::NEG_Z);
    let rotation = table.take("rotation").map(|value| value.number()).transpose()?.unwrap_or(0.0);
    Ok(LampSpec { position, ..lamp }.aimed(aim, rotation))
}

/// A direction of any length but 0.
fn read_direction(value: Value<'_>) -> Result<DVec3, Error> {
    let place = value.place();
    let direction = read_point(value)?;
    if direction.is_finite() && direction.try_normalize().is_some() {
        return Ok(direction);
    }
    Err(Error::Refused {
        place,
        problem: "it has no direction".into(),
        why: "light goes along it",
        remedy: "write [0, 0, -1] for down, or another vector".into(),
    })
}

/// The files of luminaires that a scene names, as far as they are read.
struct LampFiles<'a> {
    /// The folder of the scene.
    folder: &'a Path,
    /// The lamps so far, with the tables that they share.
    lamps: &'a mut LampsSpec,
    /// The number of the table of each file that is read.
    known: &'a mut NamedFile,
}

/// How a lamp's light is spread, and what it is multiplied by.
fn read_emission(table: &mut KeyTable<'_>, files: LampFiles<'_>) -> Result<(Emission, Spectrum), Error> {
    let factor = table.take("factor").map(|value| read_strength(value)).transpose()?;
    let [file, intensity, illuminance] = ["file", "intensity", "illuminance"].map(|key| table.take(key));
    let [cone, diameter] = ["cone", "diameter"].map(|key| table.take(key));
    let useless = |value: Option<Value<'_>>, of: &str| match value {
        None => Ok(()),
        Some(value) => Err(value.refuse(
            format!("it goes with `{of}` alone"),
            "the key would change nothing",
            format!("remove it, or write `{of}`"),
        )),
    };
    let (emission, strength) = match (file, intensity, illuminance) {
        (Some(file), None, None) => {
            useless(cone, "intensity")?;
            useless(diameter, "illuminance")?;
            (Emission::Table(table_of(&file, files)?), Spectrum::from(1.0))
        }
        (None, Some(intensity), None) => {
            useless(diameter, "illuminance")?;
            let emission = cone.map_or(Ok(Emission::Uniform), |cone| read_cone(cone))?;
            (emission, read_strength(intensity)?)
        }
        (None, None, Some(illuminance)) => {
            useless(cone, "intensity")?;
            let rim = diameter.map_or(Ok(1.0), |value| read_rim(&value))?;
            let strength = read_strength(illuminance)?;
            // Light from the rim of a wide disc falls on the plane across its aim at an angle.
            let mean_cosine = 0.5 * (1.0 + rim);
            (Emission::Distant { rim }, Spectrum::rgb(strength.channels().map(|e| e / mean_cosine)))
        }
        (None, None, None) => {
            return Err(Error::MissingKey {
                place: table.place("file"),
                why: "a lamp gives light",
                remedy:
                    "file = \"lamp.ies\", intensity = 100.0 (cd) or illuminance = 1000.0 (lx, from far away)"
                        .into(),
            });
        }
        (file, intensity, illuminance) => {
            let two = [illuminance, intensity, file].into_iter().flatten().next().expect("two are there");
            return Err(two.refuse(
                "the lamp has its light from another key, too".into(),
                "its light is that of a file, or of one number",
                "keep one of file, intensity and illuminance; `factor` makes the light of a file weaker",
            ));
        }
    };
    let factor = factor.unwrap_or(Spectrum::from(1.0));
    Ok((emission, Spectrum::rgb(std::array::from_fn(|c| strength[c] * factor[c]))))
}

/// A number from 0 on, or three.
fn read_strength(value: Value<'_>) -> Result<Spectrum, Error> {
    let place = value.place();
    let strength = read_spectrum(value)?;
    if strength.channels().iter().all(|&s| s >= 0.0) {
        return Ok(strength);
    }
    Err(Error::Refused {
        place,
        problem: "a channel is below 0".into(),
        why: "light is not negative",
        remedy: "write a number from 0 on, or [r, g, b]".into(),
    })
}

/// The number of the table that a file holds: lamps of one file share it.
fn table_of(file: &Value<'_>, files: LampFiles<'_>) -> Result<u32, Error> {
    let LampFiles { folder, lamps, known } = files;
    let path = folder.join(file.string()?);
    if let Some((_, number)) = known.iter().find(|(known, _)| *known == path) {
        return Ok(*number);
    }
    let luminaire = load_lamp(&path).map_err(|error| match error {
        Error::Missing { file: missing } => file.refuse(
            format!("there is no file {}", missing.display()),
            "luminaires are looked for relative to the scene",
            "correct the path",
        ),
        error => error,
    })?;
    let number = lamps.tables.len() as u32;
    lamps.tables.push(luminaire.distribution);
    lamps.openings.push(luminaire.shape);
    known.push((path, number));
    Ok(number)
}

/// The angles from the axis at which a spot begins to fade and at which it is dark.
fn read_cone(value: Value<'_>) -> Result<Emission, Error> {
    let place = value.place();
    let [inner, outer] = value.exactly("two angles from the axis in degrees: [full, dark]")?;
    let [inner, outer] = [inner.number()?, outer.number()?];
    if 0.0 <= inner && inner < outer && outer <= 180.0 {
        let [inner, outer] = [inner, outer].map(|degrees| degrees.to_radians().cos());
        return Ok(Emission::Spot { inner, outer });
    }
    Err(Error::Refused {
        place,
        problem: format!("[{inner}, {outer}] is no cone"),
        why: "its light is full up to the first angle from the axis, and fades up to the second, in degrees",
        remedy: "write 0 ≤ first < second ≤ 180".into(),
    })
}

/// The cosine of the angular radius of a distant disc.
fn read_rim(value: &Value<'_>) -> Result<f64, Error> {
    let diameter = positive(value, "it is the angle in degrees that the disc takes up, 0.53 of the sun")?;
    if diameter < 180.0 {
        return Ok((0.5 * diameter).to_radians().cos());
    }
    Err(value.refuse(
        format!("{diameter} is not below 180"),
        "the disc takes up this angle, in degrees",
        "write 0.53 for the sun, or remove the key for parallel light",
    ))
}
