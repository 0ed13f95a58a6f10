//! A `[[surface]]` table, read with its keys' lines.

use std::sync::Arc;

use radiosity::{Shape, Sides, SurfaceSpec};

use super::label;
use crate::document::{KeyTable, Value};
use crate::emit::read_emit;
use crate::error::Error;
use crate::keys::SURFACE_KEYS;
use crate::material::{MaterialTable, Materials, find_material};
use crate::shape::{read_corners, read_grid, read_rows};
use crate::site::{SITE_KEYS, SurfaceSite};
use crate::vocabulary::AUTO;

/// A surface, where it is in the file, and whether its cells are left to the program.
pub(super) fn read_surface(
    value: Value<'_>,
    number: usize,
    materials: &Materials,
) -> Result<(SurfaceSpec, SurfaceSite, bool), Error> {
    let header = value.line() as u32;
    let mut table = value.table_called(format!("{}: ", label(number, None)), SURFACE_KEYS)?;
    let name = table.take("name").map(|value| read_surface_name(&value)).transpose()?;
    table.rename(format!("{}: ", label(number, name.as_deref())));
    let keys = SITE_KEYS.map(|key| table.line(key).unwrap_or(0) as u32);
    let material = read_material_name(&mut table, materials)?;
    let (shape, auto) = read_shape(&mut table)?;
    let sides = table.take("sides").map(|value| read_sides(&value)).transpose()?.unwrap_or(Sides::Front);
    let emit = table.take("emit");
    if let (true, Some(emit)) = (auto, &emit) {
        return Err(emit.refuse(
            "cells of this surface emit, and it has none yet".into(),
            "patches = \"auto\" cuts it when the job is run",
            "give the part that emits a surface of its own, or write the cells",
        ));
    }
    let cell_emittance = emit.map(|value| read_emit(value, &shape)).transpose()?;
    let surface = SurfaceSpec {
        name: name.map(Arc::from),
        shape,
        sides,
        reflectance: material.reflectance,
        emittance: material.emittance,
        cell_emittance: cell_emittance.unwrap_or_default(),
        transmittance: material.transmittance,
    };
    Ok((surface, SurfaceSite { material: material.number, header, keys }, auto))
}

fn read_surface_name(value: &Value<'_>) -> Result<String, Error> {
    let name = value.string()?;
    if !can_name_a_surface(name) {
        return Err(value.refuse(
            format!("{name:?} cannot name a surface"),
            "it is shown in the rows of its patches",
            "write a visible name on one line, or remove the key to show the surface's number",
        ));
    }
    Ok(name.into())
}

/// Whether a name is visible, on one line.
pub(super) fn can_name_a_surface(name: &str) -> bool {
    !name.trim().is_empty() && !name.contains(char::is_control)
}

fn read_material_name<'m>(
    table: &mut KeyTable<'_>,
    materials: &'m Materials,
) -> Result<&'m MaterialTable, Error> {
    let value =
        table.require("material", "a surface takes its reflectance from it", "material = \"NAME\"")?;
    find_material(&value, materials)
}

/// The shape of a surface, and whether its cells are left to the program.
fn read_shape(table: &mut KeyTable<'_>) -> Result<(Shape, bool), Error> {
    let (quad, triangle, patches) = (table.take("quad"), table.take("triangle"), table.take("patches"));
    let auto = patches.as_ref().is_some_and(|value| value.string().is_ok_and(|word| word == AUTO));
    let patches = patches.filter(|_| !auto);
    let shape = match (quad, triangle) {
        (Some(quad), None) => {
            let [corner, corner_u, corner_v] = read_corners(quad)?;
            let cells = patches.map(read_grid).transpose()?.unwrap_or([1, 1]);
            Shape::Parallelogram { corner, corner_u, corner_v, cells }
        }
        (None, Some(triangle)) => {
            let [a, b, c] = read_corners(triangle)?;
            let rows = patches.as_ref().map(read_rows).transpose()?.unwrap_or(1);
            Shape::Triangle { a, b, c, rows }
        }
        (Some(_), Some(triangle)) => {
            return Err(triangle.refuse(
                "the surface has a quad too".into(),
                "a surface is one or the other",
                "write two [[surface]] tables",
            ));
        }
        (None, None) => {
            return Err(Error::MissingKey {
                place: table.place("quad"),
                why: "a surface needs an outline",
                remedy: "quad = [[x, y, z], [x, y, z], [x, y, z]] or triangle = [[…], […], […]]".into(),
            });
        }
    };
    Ok((shape, auto))
}

fn read_sides(value: &Value<'_>) -> Result<Sides, Error> {
    match value.integer(1..=2, "a surface has two sides, and the front is always active")? {
        1 => Ok(Sides::Front),
        _ => Ok(Sides::Both),
    }
}
