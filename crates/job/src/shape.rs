//! Points, corners and cells, as surfaces and sensors have them.

use glam::DVec3;

use crate::document::Value;
use crate::error::Error;

/// Patch numbers are 32 bits wide, and so are the numbers that count them.
const CELLS_WIDTH: &str = "a surface has at least one patch, and patch numbers are 32 bits wide";

pub(crate) fn read_corners(value: Value<'_>) -> Result<[DVec3; 3], Error> {
    let [a, b, c] = value.exactly("three corners: [[x, y, z], [x, y, z], [x, y, z]]")?;
    Ok([read_point(a)?, read_point(b)?, read_point(c)?])
}

pub(crate) fn read_point(value: Value<'_>) -> Result<DVec3, Error> {
    let [x, y, z] = value.exactly("a point in metres: [x, y, z]")?;
    Ok(DVec3::new(x.number()?, y.number()?, z.number()?))
}

pub(crate) fn read_grid(value: Value<'_>) -> Result<[u32; 2], Error> {
    let place = value.place();
    let [nu, nv] = value.exactly("the cells of a quad along u and v: [nu, nv]")?;
    let [nu, nv] = [read_cells(&nu)?, read_cells(&nv)?];
    if nu.checked_mul(nv).is_none() {
        return Err(Error::Refused {
            place,
            problem: format!("{nu} × {nv} patches are too many"),
            why: CELLS_WIDTH,
            remedy: "choose fewer".into(),
        });
    }
    Ok([nu, nv])
}

fn read_cells(value: &Value<'_>) -> Result<u32, Error> {
    Ok(value.integer(1..=u64::from(u32::MAX), CELLS_WIDTH)? as u32)
}

pub(crate) fn read_rows(value: &Value<'_>) -> Result<u32, Error> {
    if value.is_array() {
        return Err(value.wrong_type("the rows of a triangle: one integer k, for k² patches"));
    }
    Ok(value.integer(1..=u64::from(u16::MAX), CELLS_WIDTH)? as u32)
}
