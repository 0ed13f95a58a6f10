//! The tables `[[pane]]` of a scene: clear glass that light crosses.

use radiosity::{
    Shape,
    surfaces::{CLEAREST, PaneSpec},
};

use crate::document::{KeyTable, Value};
use crate::error::Error;
use crate::keys::{LISTS, PANE_KEYS};
use crate::shape::read_corners;

/// Reads the `[[pane]]` tables of a scene.
pub(crate) fn read_panes(value: Value<'_>) -> Result<Vec<PaneSpec>, Error> {
    value.tables(LISTS[6])?.into_iter().enumerate().map(|(number, value)| read_pane(value, number)).collect()
}

fn read_pane(value: Value<'_>, number: usize) -> Result<PaneSpec, Error> {
    let mut table = value.table_called(format!("pane {number}: "), PANE_KEYS)?;
    let name = table.take("name").map_or(Ok(number.to_string()), |value| {
        value.name("pane", "messages tell panes by it", "write a visible name on one line")
    })?;
    table.rename(format!("pane {number} ({name:?}): "));
    let transmittance = read_transmittance(&mut table)?;
    let quad = table.require("quad", "a pane has an outline", "quad = [[x, y, z], [x, y, z], [x, y, z]]")?;
    let place = quad.place();
    let [corner, corner_u, corner_v] = read_corners(quad)?;
    let shape = Shape::Parallelogram { corner, corner_u, corner_v, cells: [1, 1] };
    let (_, u, v) = shape.edges();
    if u.is_finite() && v.is_finite() && u.cross(v).try_normalize().is_some() {
        return Ok(PaneSpec { name, shape, transmittance });
    }
    Err(Error::Refused {
        place,
        problem: "the pane has no area".into(),
        why: "light crosses it there",
        remedy: "write a corner and its two neighbours, not on one line".into(),
    })
}

fn read_transmittance(table: &mut KeyTable<'_>) -> Result<f64, Error> {
    let value = table.require(
        "transmittance",
        "glass passes a part of the light",
        "transmittance = 0.8, at normal incidence",
    )?;
    let transmittance = value.number()?;
    if transmittance > 0.0 && transmittance <= CLEAREST {
        return Ok(transmittance);
    }
    let remedy = match transmittance > CLEAREST {
        true => "write at most 0.918, or remove the pane: an opening needs none",
        false => "write a number above 0, or a [[surface]] in place of the pane",
    };
    Err(value.refuse(
        format!("{transmittance} is no transmittance of clear glass"),
        "its faces reflect 8.2 % of the light, and something passes",
        remedy,
    ))
}
