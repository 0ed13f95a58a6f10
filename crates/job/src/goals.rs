//! The table `[target]`: what is asked of patches and of sensors.

use std::collections::HashSet;

use radiosity::{Birth, precision::Quantity, sensors::SensorSpec};

use crate::document::{KeyTable, Value};
use crate::error::Error;
use crate::method::{Beside, MethodTable, WalkKind, read_patches};
use crate::sensors::{SensorTarget, read_sensor_errors};
use crate::target::{Target, TotalTarget, read_relative_error};
use crate::vocabulary::Unhit;

/// The part of the patch area that must meet a target that names none.
const DEFAULT_FRACTION: f64 = 0.99;

/// The walks at the first look at a target: the spread of fewer walks is too uncertain.
pub(crate) const DEFAULT_MIN_PATHS: u64 = 1 << 10;

/// The least number of scores on a patch whose spread is trusted.
const DEFAULT_MIN_HITS: u64 = 10;

/// The table `[target]` before the scene is read: which patches and sensors there are is known only then.
#[derive(Default)]
pub(crate) struct Goals<'a> {
    patches: Option<Value<'a>>,
    sensors: Option<Value<'a>>,
    total_error: Option<Value<'a>>,
    of_patches: Option<Target>,
    min_paths: u64,
    unhit: Unhit,
}

/// What is asked of the parts of a result; `None` where nothing is.
pub(crate) struct AskedGoals {
    pub(crate) target: Option<Target>,
    pub(crate) sensor_target: Option<SensorTarget>,
    pub(crate) total_target: Option<TotalTarget>,
}

impl<'a> Goals<'a> {
    pub(crate) fn read(mut table: KeyTable<'a>) -> Result<Self, Error> {
        let [patches, sensors, total_error] =
            ["patches", "sensors", "total_error"].map(|key| table.take(key));
        let asks_more = sensors.is_some() || total_error.is_some();
        let relative_error =
            match asks_more && !table.has_any(&["fraction", "min_hits", "quantity"]) && patches.is_none() {
                true => table.take("relative_error"),
                false => Some(table.require(
                    "relative_error",
                    "a target is an accuracy",
                    "relative_error = 0.01, or remove [target]",
                )?),
            };
        let fraction = table.take("fraction").map(|value| read_fraction(&value)).transpose()?;
        let mut count = |key: &str, default: u64, why: &'static str| {
            table.take(key).map_or(Ok(default), |value| value.integer(0..=i64::MAX as u64, why))
        };
        let min_paths = count("min_paths", DEFAULT_MIN_PATHS, "it is a number of walks")?;
        let min_hits = count("min_hits", DEFAULT_MIN_HITS, "it is a number of scores")?;
        let relative_error = relative_error.map(|value| read_relative_error(&value)).transpose()?;
        let unhit = table.word("unhit")?;
        let quantity = table.word::<Quantity>("quantity")?;
        let of_patches = relative_error.map(|relative_error| Target {
            relative_error,
            fraction: fraction.unwrap_or(DEFAULT_FRACTION),
            min_paths,
            min_hits,
            unhit,
            patches: None,
            quantity,
        });
        Ok(Goals { patches, sensors, total_error, of_patches, min_paths, unhit })
    }

    /// What is asked of patches, of sensors, and of noise and discretisation together, where a pilot tells of them if it `has_pilot`.
    pub(crate) fn about(
        self,
        (patch_count, has_pilot): (Option<u64>, bool),
        method: &MethodTable,
        sensors: &[SensorSpec],
    ) -> Result<AskedGoals, Error> {
        let Goals { patches, min_paths, unhit, .. } = self;
        let patches = patches.map(|value| read_target_patches(value, patch_count, method)).transpose()?;
        let target = self.of_patches.map(|target| Target { patches, ..target });
        let errors = self.sensors.map(|value| read_sensor_errors(value, sensors)).transpose()?;
        let of_sensors = errors.map(|sensors| SensorTarget { sensors, min_paths, unhit });
        let total_error =
            self.total_error.map(|value| read_total_error(&value, method, has_pilot)).transpose()?;
        let total = total_error.map(|total_error| TotalTarget { total_error, min_paths });
        Ok(AskedGoals { target, sensor_target: of_sensors, total_target: total })
    }
}

/// The patches that a target is about. Their number is known only when the scene is read.
fn read_target_patches(
    value: Value<'_>,
    patch_count: Option<u64>,
    method: &MethodTable,
) -> Result<Vec<u32>, Error> {
    let place = value.place();
    let patches =
        read_patches(value, patch_count, "a target is about some patch", "remove the key: all count")?;
    let (WalkKind::Gathering, Birth::Patches(born)) = (method.walk, &method.birth) else {
        return Ok(patches);
    };
    let born: HashSet<u32> = born.iter().copied().collect();
    match patches.iter().find(|patch| !born.contains(patch)) {
        None => Ok(patches),
        Some(patch) => Err(Error::Refused {
            place,
            problem: format!("no walk is born on patch {patch}"),
            why: "gathering walks tell of the patch that they are born on, and of no other",
            remedy: format!("add {patch} to method.birth.patches, or take it out here"),
        }),
    }
}

/// `has_pilot`: whether a pilot tells how light is spread over patches.
fn read_total_error(value: &Value<'_>, method: &MethodTable, has_pilot: bool) -> Result<f64, Error> {
    if !has_pilot && method.beside != Beside::Slopes {
        return Err(value.refuse(
            "the job does not find out how light is spread over patches".into(),
            "the total error is that of walks and of patches that are too coarse, and means do not tell the second",
            "write basis = \"linear\" in [method], or relative_error here",
        ));
    }
    read_relative_error(value)
}

fn read_fraction(value: &Value<'_>) -> Result<f64, Error> {
    let fraction = value.number()?;
    if fraction > 0.0 && fraction <= 1.0 {
        return Ok(fraction);
    }
    Err(value.refuse(
        format!("{fraction} is outside (0, 1]"),
        "it is the part of the patch area that must meet the target",
        "choose 0 < fraction ≤ 1",
    ))
}
