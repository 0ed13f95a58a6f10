//! Emittances of single cells of a surface.

use std::collections::BTreeSet;

use radiosity::{Shape, Spectrum};

use crate::document::Value;
use crate::error::Error;
use crate::keys::EMIT_KEYS;
use crate::material::read_spectrum;

/// (cell index, emittance [W/m²]) per entry.
pub(crate) fn read_emit(value: Value<'_>, shape: &Shape) -> Result<Vec<(u32, Spectrum)>, Error> {
    let mut listed = BTreeSet::new();
    let mut emit = Vec::new();
    for value in value.array()? {
        let place = value.place();
        let mut table = value.table(EMIT_KEYS)?;
        let cell = table.require("cell", "an entry is about one cell", "cell = [i, j]")?;
        let emittance = table.require("emittance", "an entry changes it", "emittance = 1.0, in W/m²")?;
        let cell = read_cell(cell, shape)?;
        if !listed.insert(cell) {
            let [i, j] = shape.cell_label(cell);
            return Err(Error::Refused {
                place,
                problem: format!("cell [{i}, {j}] is listed twice"),
                why: "it has one emittance",
                remedy: "list it once".into(),
            });
        }
        emit.push((cell, read_spectrum(emittance)?));
    }
    Ok(emit)
}

fn read_cell(value: Value<'_>, shape: &Shape) -> Result<u32, Error> {
    let [i, j] = value.exactly("a cell: [iu, iv] of a quad, [row, position] of a triangle")?;
    let label = match *shape {
        Shape::Parallelogram { cells: [nu, nv], .. } => [read_step(&i, nu - 1)?, read_step(&j, nv - 1)?],
        Shape::Triangle { rows, .. } => {
            let row = read_step(&i, rows - 1)?;
            [row, read_step(&j, 2 * row)?]
        }
        Shape::Divided { .. } => unreachable!("surfaces are written with grids"),
    };
    Ok(shape.cell_index(label).expect("a cell within bounds, as just found"))
}

fn read_step(value: &Value<'_>, last: u32) -> Result<u32, Error> {
    Ok(value.integer(0..=u64::from(last), "cells are counted from 0 within the surface")? as u32)
}
