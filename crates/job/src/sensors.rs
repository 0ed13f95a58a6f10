//! Sensors in scene files, and what a target asks of them.

use std::collections::BTreeSet;

use radiosity::sensors::{SensorShape, SensorSpec};
use serde::{Deserialize, Serialize};

use crate::document::{KeyTable, Value};
use crate::error::Error;
use crate::keys::LISTS;
use crate::keys::SENSOR_KEYS;
use crate::near;
use crate::shape::{read_corners, read_grid, read_point};
use crate::target::read_relative_error;
use crate::vocabulary::Unhit;

/// The accuracy that is asked of sensors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SensorTarget {
    /// Sensors by number, and the half-width of the interval over the estimate that every patch of each must keep within.
    pub sensors: Vec<(u32, f64)>,
    /// Walks (Jacobi: rays) before which no look is taken; default 1024.
    pub min_paths: u64,
    /// What a patch of a sensor counts for that no light was found for.
    pub unhit: Unhit,
}

/// Reads the `[[sensor]]` tables of a scene.
pub(crate) fn read_sensors(value: Value<'_>) -> Result<Vec<SensorSpec>, Error> {
    let mut names = BTreeSet::new();
    let mut sensors = Vec::new();
    for (number, value) in value.tables(LISTS[2])?.into_iter().enumerate() {
        let mut table = value.table_called(format!("sensor {number}: "), SENSOR_KEYS)?;
        let place = table.place("name");
        let (name, place) = match table.take("name") {
            Some(value) => (read_name(&value)?, value.place()),
            None => (number.to_string(), place),
        };
        if !names.insert(name.clone()) {
            return Err(Error::Refused {
                place,
                problem: format!("a sensor before this one is called {name:?}, too"),
                why: "outputs and targets tell sensors by their names",
                remedy: "give each a name of its own".into(),
            });
        }
        table.rename(format!("sensor {number} ({name:?}): "));
        sensors.push(SensorSpec { name, shape: read_shape(table)? });
    }
    Ok(sensors)
}

fn read_name(value: &Value<'_>) -> Result<String, Error> {
    value.name(
        "sensor",
        "it is shown in the rows of its patches",
        "write a visible name on one line, or remove the key to show the sensor's number",
    )
}

fn read_shape(mut table: KeyTable<'_>) -> Result<SensorShape, Error> {
    let places = SENSOR_KEYS.iter().map(|&key| (key, table.place_of(key))).collect::<Vec<_>>();
    let [quad, patches, point, normal] = ["quad", "patches", "point", "normal"].map(|key| table.take(key));
    let shape = match (quad, point) {
        (Some(quad), None) => {
            if let Some(normal) = normal {
                return Err(normal.refuse(
                    "a quad does not use this key".into(),
                    "its front is on the side of u × v",
                    "remove the key; swap two corners to turn the sensor round",
                ));
            }
            let [corner, corner_u, corner_v] = read_corners(quad)?;
            let cells = patches.map(read_grid).transpose()?.unwrap_or([1, 1]);
            SensorShape::Quad { corner, corner_u, corner_v, cells }
        }
        (None, Some(point)) => {
            if let Some(patches) = patches {
                return Err(patches.refuse(
                    "a point does not use this key".into(),
                    "it is measured at one place",
                    "remove the key, or write a quad",
                ));
            }
            let normal = normal.ok_or_else(|| Error::MissingKey {
                place: table.place("normal"),
                why: "a point measures what arrives on the side that it faces",
                remedy: "normal = [0, 0, 1], for one that faces up".into(),
            })?;
            SensorShape::Point { point: read_point(point)?, normal: read_point(normal)? }
        }
        (Some(_), Some(point)) => {
            return Err(point.refuse(
                "the sensor has a quad too".into(),
                "a sensor is one or the other",
                "write two [[sensor]] tables",
            ));
        }
        (None, None) => {
            return Err(Error::MissingKey {
                place: table.place("quad"),
                why: "a sensor measures somewhere",
                remedy:
                    "quad = [[x, y, z], [x, y, z], [x, y, z]], or point = [x, y, z] and normal = [x, y, z]"
                        .into(),
            });
        }
    };
    shape.check().map_err(|(key, problem)| {
        let place = places.into_iter().find(|&(known, _)| known == key).map(|(_, place)| place);
        Error::Refused {
            place: place.unwrap_or_else(|| table.place(key)),
            problem,
            why: "light is measured on one side of a place in the scene",
            remedy: "correct the key".into(),
        }
    })?;
    Ok(shape)
}

/// What `[target] sensors` asks for: of all sensors alike, or of some by name.
pub(crate) fn read_sensor_errors(value: Value<'_>, sensors: &[SensorSpec]) -> Result<Vec<(u32, f64)>, Error> {
    if sensors.is_empty() {
        return Err(value.refuse(
            "the scene has no sensors".into(),
            "the key says how well they must be known",
            "add a [[sensor]] table to the scene file, or remove the key",
        ));
    }
    if !value.is_table() {
        let error = read_relative_error(&value)?;
        return Ok((0..sensors.len() as u32).map(|sensor| (sensor, error)).collect());
    }
    let place = value.place();
    let mut errors = Vec::new();
    for (name, value) in value.any_table()?.into_values() {
        let number = sensors.iter().position(|sensor| sensor.name == name).ok_or_else(|| {
            let names = || sensors.iter().map(|sensor| &sensor.name[..]);
            value.refuse(
                format!("the scene has no sensor {name:?}"),
                "a target is about sensors by their names",
                format!(
                    "{}choose from {}",
                    near::hint(&name, names()),
                    names().collect::<Vec<_>>().join(", ")
                ),
            )
        })?;
        errors.push((number as u32, read_relative_error(&value)?));
    }
    if errors.is_empty() {
        return Err(Error::Refused {
            place,
            problem: "the table is empty".into(),
            why: "a target is about some sensor",
            remedy: "write sensors = 0.05 for all, or sensors = { NAME = 0.05 }".into(),
        });
    }
    errors.sort_unstable_by_key(|&(number, _)| number);
    Ok(errors)
}
