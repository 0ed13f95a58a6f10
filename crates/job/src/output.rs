//! The tables `[output]` and `[view]`: which files a run writes, and from where its picture is taken.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::document::{KeyTable, Value};
use crate::error::Error;
use crate::keys::{NAMED_VIEW_KEYS, VIEW_KEYS};
use crate::shape::read_point;
use crate::vocabulary::{FOV, MAX_PIXELS, OutputFile, Vantage};
use crate::word::Keyword;

/// The table `[view]`: how the picture is taken. What is absent is chosen from the scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct View {
    /// Where the camera stands. Default: where most of what is lit is seen.
    pub stand: Option<Stand>,
    /// From where it looks, if nothing says where it stands. Default: from inside where people could stand or walls hide
    /// the inside, else from outside. It travels behind the groups of cells.
    #[serde(skip)]
    pub from: Option<Vantage>,
    /// Width and height of the picture [pixels]. Default: 800 on the longer side.
    pub size: Option<[u32; 2]>,
    /// The light of the picture, 1 being white paper, over the radiosity [m²/W], in the channel that most power is emitted in.
    /// Default: by the middle pixel, as far as the brightest allow.
    pub exposure: Option<f64>,
}

/// Where a camera stands.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stand {
    /// The place of the eye [m].
    pub eye: DVec3,
    /// The point in the middle of the picture [m].
    pub look_at: DVec3,
    /// The direction that is up in the picture. Default: that of the scene.
    pub up: Option<DVec3>,
    /// The angle between the lower and the upper edge [degrees].
    pub fov: f64,
}

/// A view beside the first, by its name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NamedView {
    /// Letters, digits, `-` and `_`.
    pub name: String,
    /// Where the camera stands.
    pub stand: Stand,
}

impl View {
    /// A view from another stand, in the size and exposure of this one.
    pub fn from_stand(&self, stand: Stand) -> View {
        View { stand: Some(stand), from: None, ..*self }
    }
}

/// The field of view of a stand that names none [degrees].
const DEFAULT_FOV: f64 = 40.0;

/// The sine of the smallest angle between the direction of view and the one that is up.
const PARALLEL: f64 = 1e-6;

/// Reads `[output]`; `None` where the job leaves the choice of files to the program.
pub(crate) fn read_output(mut table: KeyTable<'_>) -> Result<Option<Vec<OutputFile>>, Error> {
    let Some(value) = table.take("files") else { return Ok(None) };
    let mut files = Vec::new();
    for value in value.array()? {
        let file: OutputFile = value.word()?;
        if files.contains(&file) {
            return Err(value.refuse(
                format!("{:?} is there twice", file.word()),
                "each file is written once",
                "remove one of them",
            ));
        }
        files.push(file);
    }
    Ok(Some(files))
}

/// Reads the table `[view]` of a job.
pub(crate) fn read_view(mut table: KeyTable<'_>) -> Result<View, Error> {
    let size = table.take("size").map(read_size).transpose()?;
    let exposure = table.take("exposure").map(|value| read_exposure(&value)).transpose()?;
    let from = table.take("from").map(|value| Ok((value.word()?, value.place()))).transpose()?;
    let stand = read_stand(table)?;
    match from {
        Some((_, place)) if stand.is_some() => Err(Error::Refused {
            place,
            problem: "from beside eye".into(),
            why: "the eye tells where the camera stands",
            remedy: "remove one of them".into(),
        }),
        from => Ok(View { stand, from: from.map(|(from, _)| from), size, exposure }),
    }
}

/// Reads the tables `[views.NAME]` of a job, in the order of their names.
pub(crate) fn read_views(value: Value<'_>) -> Result<Vec<NamedView>, Error> {
    let is_plain = |name: &str| {
        !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '-' | '_'))
    };
    let mut views = Vec::new();
    for (name, value) in value.any_table()?.into_values() {
        if !is_plain(&name) {
            return Err(value.refuse(
                format!("{name:?} cannot name a view"),
                "the file of its picture takes its name",
                "write a name of letters, digits, - and _, as in [views.door]",
            ));
        }
        let table = value.table(NAMED_VIEW_KEYS)?;
        let place = table.place("eye");
        let stand = read_stand(table)?.ok_or_else(|| Error::MissingKey {
            place,
            why: "a view with a name is one from a place",
            remedy: "eye = [x, y, z] and look_at = [x, y, z] in metres".into(),
        })?;
        views.push(NamedView { name, stand });
    }
    Ok(views)
}

fn read_stand(mut table: KeyTable<'_>) -> Result<Option<Stand>, Error> {
    let Some(eye) = table.take("eye") else {
        let Some((key, value)) = VIEW_KEYS[1..].iter().find_map(|key| Some((*key, table.take(key)?))) else {
            return Ok(None);
        };
        return Err(value.refuse(
            format!("{key} without eye"),
            "it tells how an eye looks that stands somewhere",
            "add eye = [x, y, z] and look_at = [x, y, z], or remove the key: the camera is then chosen from the scene",
        ));
    };
    let look_at = table.require("look_at", "an eye looks at something", "look_at = [x, y, z] in metres")?;
    let (eye, aim) = (read_point(eye)?, look_at.place());
    let look_at = read_point(look_at)?;
    let way = look_at - eye;
    if way == DVec3::ZERO || !way.length().is_finite() {
        return Err(Error::Refused {
            place: aim,
            problem: "eye and look_at are one point, or without end apart".into(),
            why: "that is no direction",
            remedy: "move one of them".into(),
        });
    }
    let up = table.take("up").map(|value| read_up(value, way)).transpose()?;
    let fov = table.take("fov").map(|value| read_fov(&value)).transpose()?.unwrap_or(DEFAULT_FOV);
    Ok(Some(Stand { eye, look_at, up, fov }))
}

fn read_up(value: Value<'_>, way: DVec3) -> Result<DVec3, Error> {
    let place = value.place();
    let up = read_point(value)?;
    if way.cross(up).length() > PARALLEL * way.length() * up.length() {
        return Ok(up);
    }
    Err(Error::Refused {
        place,
        problem: "up is along the direction of view, or no direction".into(),
        why: "the picture could be turned any way then",
        remedy: "give another direction, such as [0, 1, 0] for a view from above".into(),
    })
}

fn read_size(value: Value<'_>) -> Result<[u32; 2], Error> {
    let elements = value.exactly::<2>("two integers: [width, height] in pixels")?;
    let why = "pictures have pixels, and must fit the memory";
    let [width, height] = elements.map(|element| element.integer(1..=MAX_PIXELS, why));
    Ok([width? as u32, height? as u32])
}

fn read_exposure(value: &Value<'_>) -> Result<f64, Error> {
    let exposure = value.number()?;
    if exposure > 0.0 {
        return Ok(exposure);
    }
    Err(value.refuse(
        format!("{exposure} is not above 0"),
        "it is the light of the picture, 1 being white paper, over the radiosity",
        "choose 1/B, B being the radiosity of what is to look like white paper, or remove the key",
    ))
}

fn read_fov(value: &Value<'_>) -> Result<f64, Error> {
    let fov = value.number()?;
    if (FOV[0]..=FOV[1]).contains(&fov) {
        return Ok(fov);
    }
    Err(value.refuse(
        format!("{fov} is outside [{}, {}]", FOV[0], FOV[1]),
        "it is the angle between the lower and the upper edge of the picture, in degrees",
        "choose one such as 40",
    ))
}
