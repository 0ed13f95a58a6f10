//! The tables `[[plane]]` and `[[points]]` of a scene: points at which light is measured, in a grid or from a file.

use std::path::Path;

use glam::DVec3;
use radiosity::{
    planes::PlaneFigure,
    sensors::{SensorShape, SensorSpec},
};
use serde::{Deserialize, Serialize};

use crate::bytes::all_bytes;
use crate::document::{KeyTable, Value};
use crate::error::Error;
use crate::imports::positive;
use crate::keys::{DEMAND_KEYS, LISTS, PLANE_KEYS, POINTS_KEYS};
use crate::shape::read_point;
use crate::word::Keyword;

/// The most points of a plane along one side.
const MOST_ALONG: f64 = 4096.0;

/// What is measured at the points of a plane.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Measure {
    /// Illuminance on the side that a point faces.
    #[default]
    Planar,
    /// On the curved side of an upright cylinder.
    Cylindrical,
    /// On the half of it that a point faces.
    Semicylindrical,
    /// Glare at an eye that looks along the direction of a point.
    Ugr,
}

impl Keyword for Measure {
    const ALL: &'static [Self] = &[Self::Planar, Self::Cylindrical, Self::Semicylindrical, Self::Ugr];

    fn word(self) -> &'static str {
        match self {
            Measure::Planar => "planar",
            Measure::Cylindrical => "cylindrical",
            Measure::Semicylindrical => "semicylindrical",
            Measure::Ugr => "ugr",
        }
    }
}

impl Measure {
    /// It at some points.
    fn at(self, points: Vec<[DVec3; 2]>, grid: [u32; 2]) -> SensorShape {
        match self {
            Measure::Planar => SensorShape::Points { points, grid },
            Measure::Cylindrical => SensorShape::Cylinders { points, grid, half: false },
            Measure::Semicylindrical => SensorShape::Cylinders { points, grid, half: true },
            Measure::Ugr => SensorShape::Eyes { points, grid },
        }
    }
}

/// What a figure of a plane is to reach.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlaneTarget {
    /// The plane, by its number among sensors.
    pub sensor: u32,
    /// The figure.
    pub figure: PlaneFigure,
    /// What it is to be at least [lx, or 1]; of UGR at most.
    pub least: f64,
}

/// Reads `[[plane]]` and `[[points]]`, puts them behind the sensors, and returns what is demanded of them; `folder` is that of the scene.
pub(crate) fn read_planes(
    [planes, points]: [Option<Value<'_>>; 2],
    folder: &Path,
    sensors: &mut Vec<SensorSpec>,
) -> Result<Vec<PlaneTarget>, Error> {
    let mut demands = Vec::new();
    let planes = planes.map(|planes| planes.tables(LISTS[4])).transpose()?.unwrap_or_default();
    let points = points.map(|points| points.tables(LISTS[5])).transpose()?.unwrap_or_default();
    for (number, value) in planes.into_iter().enumerate() {
        let mut table = value.table_called(format!("plane {number}: "), PLANE_KEYS)?;
        let name = read_name(&mut table, format!("plane {number}"), sensors)?;
        table.rename(format!("plane {number} ({name:?}): "));
        let measure = table.word("measure")?;
        read_demands(&mut table, (sensors.len() as u32, measure), &mut demands)?;
        sensors.push(SensorSpec { name, shape: read_grid(table, measure)? });
    }
    for (number, value) in points.into_iter().enumerate() {
        let mut table = value.table_called(format!("points {number}: "), POINTS_KEYS)?;
        let file = table.require(
            "file",
            "points are read from one",
            "file = \"desk.pts\", relative to the scene",
        )?;
        let stem = Path::new(file.string()?).file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let name = read_name(&mut table, stem, sensors)?;
        let measure = table.word("measure")?;
        read_demands(&mut table, (sensors.len() as u32, measure), &mut demands)?;
        sensors.push(SensorSpec { name, shape: read_file(&file, folder, measure)? });
    }
    Ok(demands)
}

/// What is demanded of a plane.
fn read_demands(
    table: &mut KeyTable<'_>,
    (sensor, measure): (u32, Measure),
    demands: &mut Vec<PlaneTarget>,
) -> Result<(), Error> {
    let Some(value) = table.take("demand") else { return Ok(()) };
    let mut table = value.table(DEMAND_KEYS)?;
    for (key, figure, why) in [
        ("mean", PlaneFigure::Mean, "it is the least mean in lx"),
        ("minimum", PlaneFigure::Minimum, "it is the least illuminance of a point in lx"),
        ("uniformity", PlaneFigure::Uniformity, "it is the least U₀, the minimum over the mean"),
        ("diversity", PlaneFigure::Diversity, "it is the least U_d, the minimum over the maximum"),
        ("ugr", PlaneFigure::Ugr, "it is the largest UGR of an eye"),
    ] {
        let Some(value) = table.take(key) else { continue };
        let least = positive(&value, why)?;
        if figure == PlaneFigure::Ugr && measure != Measure::Ugr {
            return Err(value.refuse(
                "the points of this plane are no eyes".into(),
                why,
                "write measure = \"ugr\", or remove the key",
            ));
        }
        let is_ratio = matches!(figure, PlaneFigure::Uniformity | PlaneFigure::Diversity);
        if is_ratio && least > 1.0 {
            return Err(value.refuse(
                format!("{least} is above 1"),
                why,
                "write a number up to 1, such as 0.6",
            ));
        }
        demands.push(PlaneTarget { sensor, figure, least });
    }
    Ok(())
}

/// The name of a plane, which no other sensor has.
fn read_name(table: &mut KeyTable<'_>, default: String, sensors: &[SensorSpec]) -> Result<String, Error> {
    let place = table.place("name");
    let (name, place) = match table.take("name") {
        Some(value) => {
            let name =
                value.name("plane", "its figures are shown by it", "write a visible name on one line")?;
            (name, value.place())
        }
        None => (default, place),
    };
    match sensors.iter().all(|sensor| sensor.name != name) {
        true => Ok(name),
        false => Err(Error::Refused {
            place,
            problem: format!("a sensor or plane before this one is called {name:?}, too"),
            why: "outputs and targets tell them by their names",
            remedy: "give each a name of its own".into(),
        }),
    }
}

/// The points of a grid: the middles of cells that are as near to squares of `spacing` as fit the sides.
fn read_grid(mut table: KeyTable<'_>, measure: Measure) -> Result<SensorShape, Error> {
    let origin = table.require("origin", "a plane has a corner", "origin = [x, y, z], in metres")?;
    let origin = read_point(origin)?;
    let mut side = |key| {
        let value =
            table.require(key, "a plane has two sides from its corner", format!("{key} = [x, y, z]"))?;
        read_point(value)
    };
    let [u, v] = [side("u")?, side("v")?];
    let place_of_v = table.place("v");
    let spacing =
        table.require("spacing", "it is the distance of the points", "spacing = 0.25, in metres")?;
    let place = spacing.place();
    let spacing = positive(&spacing, "it is the distance of the points in metres")?;
    let height = table.take("height").map(|value| value.number()).transpose()?.unwrap_or(0.0);
    let normal = table.take("normal").map(|value| read_point(value)).transpose()?;
    let upwards = u.cross(v).normalize_or_zero();
    // A work plane looks up, whatever the order of its sides.
    let upwards = if upwards.z < 0.0 { -upwards } else { upwards };
    let along = [u, v].map(|side| (side.length() / spacing).round().max(1.0));
    if upwards == DVec3::ZERO {
        return Err(Error::Refused {
            place: place_of_v,
            problem: "u and v lie on a line".into(),
            why: "the sides of a plane span an area",
            remedy: "choose another side".into(),
        });
    }
    if !along.iter().all(|&points| points <= MOST_ALONG) {
        return Err(Error::Refused {
            place,
            problem: format!("{} × {} points", along[0], along[1]),
            why: "a side of a plane has 4096 points at most",
            remedy: "choose shorter sides, or a larger spacing".into(),
        });
    }
    let horizontal = match measure {
        Measure::Planar | Measure::Cylindrical => None,
        Measure::Semicylindrical => Some((
            "half of a cylinder faces a horizontal direction",
            "normal = [0, 1, 0], the direction from which people are looked at",
        )),
        Measure::Ugr => {
            Some(("an eye looks along a horizontal direction", "normal = [0, 1, 0], the line of sight"))
        }
    };
    if let (Some((why, remedy)), None) = (horizontal, normal) {
        return Err(Error::MissingKey { place: table.place("normal"), why, remedy: remedy.into() });
    }
    let normal = normal.unwrap_or(upwards);
    let at =
        |i: f64, j: f64| origin + upwards * height + u * ((i + 0.5) / along[0]) + v * ((j + 0.5) / along[1]);
    let grid = along.map(|points| points as u32);
    let points = (0..grid[0]).flat_map(|i| (0..grid[1]).map(move |j| (i, j)));
    let points = points.map(|(i, j)| [at(i.into(), j.into()), normal]).collect();
    checked(measure.at(points, grid), &table.place("normal"))
}

/// The points of a file as Radiance has them: x y z dx dy dz in each line.
fn read_file(file: &Value<'_>, folder: &Path, measure: Measure) -> Result<SensorShape, Error> {
    let path = folder.join(file.string()?);
    let bad = |problem: String| {
        let why = "every line of it is a point and the direction that it faces: x y z dx dy dz";
        file.refuse(problem, why, "correct the file, or the path, which is relative to the scene")
    };
    let bytes = all_bytes(&path).map_err(|error| bad(error.to_string()))?;
    let text = String::from_utf8(bytes).map_err(|_| bad(format!("{} is not text", path.display())))?;
    let mut points = Vec::new();
    for (line, text) in (1..).zip(text.lines()) {
        let text = text.split('#').next().unwrap_or_default().trim();
        if text.is_empty() {
            continue;
        }
        let numbers: Result<Vec<f64>, _> = text.split_whitespace().map(str::parse).collect();
        let Ok(&[x, y, z, dx, dy, dz]) = numbers.as_deref() else {
            return Err(bad(format!("{}:{line}: this is not six numbers", path.display())));
        };
        points.push([DVec3::new(x, y, z), DVec3::new(dx, dy, dz)]);
    }
    let grid = [points.len() as u32, 1];
    checked(measure.at(points, grid), &file.place())
}

fn checked(shape: SensorShape, place: &crate::error::SourceLocation) -> Result<SensorShape, Error> {
    match shape.check() {
        Ok(()) => Ok(shape),
        Err((_, problem)) => Err(Error::Refused {
            place: place.clone().into(),
            problem,
            why: "light is measured at points, on the side that each faces",
            remedy: "correct the points".into(),
        }),
    }
}
