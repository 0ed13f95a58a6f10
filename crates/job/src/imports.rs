//! The table `[import]` of jobs, and meshes read by its options.

use std::fs;
use std::io;
use std::path::Path;

use import::{
    Faults, Files, Format, GROUP_ANGLE, GroupLimits, MaterialOverride, Mesh, Options, SidesChoice, UpAxis,
};

use crate::bytes::all_bytes;
use crate::document::{KeyTable, Value};
use crate::error::Error;
use crate::keys::OVERRIDE_KEYS;
use crate::material::read_spectrum;
use crate::near;
use crate::sky::read_emittance;
use crate::word::Keyword;

impl Keyword for UpAxis {
    const ALL: &'static [Self] = &[UpAxis::X, UpAxis::Y, UpAxis::Z];

    fn word(self) -> &'static str {
        match self {
            UpAxis::X => "x",
            UpAxis::Y => "y",
            UpAxis::Z => "z",
        }
    }
}

impl Keyword for Faults {
    const ALL: &'static [Self] = &[Faults::Report, Faults::Refuse];

    fn word(self) -> &'static str {
        match self {
            Faults::Report => "report",
            Faults::Refuse => "refuse",
        }
    }
}

/// Reads `[import]`; what is not written has its default.
pub(crate) fn read_options(mut table: KeyTable<'_>) -> Result<Options, Error> {
    let default = Options::default();
    let length = "it is a length";
    Ok(Options {
        up: table.take("up").map(|value| value.word()).transpose()?,
        unit: table.take("unit").map(|value| positive(&value, length)).transpose()?.unwrap_or(default.unit),
        sides: table.take("sides").map(|value| read_sides(&value)).transpose()?.unwrap_or(default.sides),
        patch_size: table.take("patch_size").map(|value| positive(&value, length)).transpose()?,
        max_patch_area: None,
        faults: table.take("faults").map(|value| value.word()).transpose()?.unwrap_or(default.faults),
        join: table.take("join").map(|value| value.boolean()).transpose()?.unwrap_or(default.join),
        reflectance_limit: table.take("reflectance_limit").map(|value| read_limit(&value)).transpose()?,
        strict: table.take("strict").map(|value| value.boolean()).transpose()?.unwrap_or(default.strict),
        sky: table.take("sky").map(read_emittance).transpose()?,
        curve_error: table
            .take("curve_error")
            .map(|value| read_curve_error(&value))
            .transpose()?
            .unwrap_or(default.curve_error),
        materials: table.take("material").map(read_overrides).transpose()?.unwrap_or_default(),
    })
}

/// Reads how faces are grouped; `None` where they are not.
pub(crate) fn read_grouping(table: &mut KeyTable<'_>) -> Result<Option<GroupLimits>, Error> {
    let (size, angle) = (table.take("group_size"), table.take("group_angle"));
    let Some(size) = size else {
        let useless = |angle: Value<'_>| {
            let remedy = "write group_size, too, or remove the key";
            Err(angle.refuse("there is no group_size".into(), "without it no faces are grouped", remedy))
        };
        return angle.map_or(Ok(None), useless);
    };
    let angle = angle.map(|value| read_group_angle(&value)).transpose()?;
    Ok(Some(GroupLimits { size: positive(&size, "it is a length")?, angle: angle.unwrap_or(GROUP_ANGLE) }))
}

fn read_group_angle(value: &Value<'_>) -> Result<f64, Error> {
    let angle = value.number()?;
    if (0.0..=90.0).contains(&angle) {
        return Ok(angle);
    }
    Err(value.refuse(
        format!("{angle} is outside [0, 90]"),
        "it is the angle in degrees by which faces of a group may turn away from its first one",
        "choose an angle such as 20",
    ))
}

pub(crate) fn positive(value: &Value<'_>, why: &'static str) -> Result<f64, Error> {
    let number = value.number()?;
    if number > 0.0 {
        return Ok(number);
    }
    Err(value.refuse(format!("{number} is not above 0"), why, "choose a positive number"))
}

fn read_limit(value: &Value<'_>) -> Result<f64, Error> {
    let limit = value.number()?;
    if (0.0..1.0).contains(&limit) {
        return Ok(limit);
    }
    let remedy = "choose 0 ≤ reflectance_limit < 1, such as 0.95";
    Err(value.refuse(format!("{limit} is outside [0, 1)"), "reflectances are clamped to it", remedy))
}

fn read_curve_error(value: &Value<'_>) -> Result<f64, Error> {
    let error = value.number()?;
    if (1e-6..=0.3).contains(&error) {
        return Ok(error);
    }
    Err(value.refuse(
        format!("{error} is outside [0.000001, 0.3]"),
        "it is how far facets may lie inside a curved surface, in parts of its radius",
        "choose a number such as 0.0125, which is 20 facets round a circle",
    ))
}

fn read_sides(value: &Value<'_>) -> Result<SidesChoice, Error> {
    if value.is_string() {
        return match value.string()? {
            "file" => Ok(SidesChoice::File),
            other => Err(Error::UnknownWord {
                place: value.place(),
                found: other.into(),
                hint: near::hint(other, ["file"].into_iter()),
                choices: "\"file\", 1 or 2".into(),
            }),
        };
    }
    match value.integer(1..=2, "a surface has two sides")? {
        1 => Ok(SidesChoice::One),
        _ => Ok(SidesChoice::Two),
    }
}

/// The overrides in the order in which they are written.
fn read_overrides(value: Value<'_>) -> Result<Vec<MaterialOverride>, Error> {
    let mut values: Vec<(String, Value<'_>)> = value.any_table()?.into_values().collect();
    values.sort_by_key(|(_, value)| value.start());
    values.into_iter().map(|(pattern, value)| read_override(pattern, value)).collect()
}

fn read_override(pattern: String, value: Value<'_>) -> Result<MaterialOverride, Error> {
    let mut table = value.table(OVERRIDE_KEYS)?;
    let mut spectrum = |key| table.take(key).map(read_spectrum).transpose();
    let (reflectance, emittance) = (spectrum("reflectance")?, spectrum("emittance")?);
    let power = table.take("power");
    if let (Some(power), Some(_)) = (&power, emittance) {
        return Err(power.refuse(
            "there is an emittance, too".into(),
            "the power over the area is the emittance",
            "write one of them",
        ));
    }
    Ok(MaterialOverride {
        pattern,
        reflectance,
        emittance,
        power: power.map(read_spectrum).transpose()?,
        sides: table.take("sides").map(|value| read_sides(&value)).transpose()?,
        leave_out: table.take("leave_out").map(|value| value.boolean()).transpose()?,
    })
}

/// Reads a mesh file and those that it names.
pub(crate) fn read_mesh(path: &Path, format: Format, options: &Options) -> Result<Mesh, Error> {
    let content = all_bytes(path)?;
    // Devices and pipes may never end.
    let mut open = |path: &Path| match fs::metadata(path)?.is_file() {
        true => fs::read(path),
        false => Err(io::Error::from(io::ErrorKind::InvalidInput)),
    };
    import::read(path, &content, format, options.curve_error, &mut Files::new(&mut open))
        .map_err(Error::of_mesh)
}
