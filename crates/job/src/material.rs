//! The materials of a scene.

use std::collections::BTreeMap;

use radiosity::Spectrum;

use crate::document::{KeyTable, Value};
use crate::error::Error;
use crate::keys::MATERIAL_KEYS;
use crate::site::Lines;

/// A material as `[material.NAME]` describes it.
pub(crate) struct MaterialTable {
    pub(crate) number: u32,
    pub(crate) reflectance: Spectrum,
    pub(crate) emittance: Spectrum,
    pub(crate) transmittance: Spectrum,
    pub(crate) lines: Lines,
}

/// Materials by name; their numbers are those of this order.
pub(crate) type Materials = BTreeMap<String, MaterialTable>;

pub(crate) fn read_materials(table: &mut KeyTable<'_>) -> Result<Materials, Error> {
    let Some(value) = table.take("material") else { return Ok(BTreeMap::new()) };
    let mut materials: Materials = BTreeMap::new();
    for (name, value) in value.any_table()?.into_values() {
        materials.insert(name, read_material(value)?);
    }
    for (number, material) in (0..).zip(materials.values_mut()) {
        material.number = number;
    }
    Ok(materials)
}

fn read_material(value: Value<'_>) -> Result<MaterialTable, Error> {
    let mut lines = Lines { header: value.line(), keys: Vec::new() };
    let mut table = value.table(MATERIAL_KEYS)?;
    let mut spectrum = |key| {
        let Some(value) = table.take(key) else { return Ok(Spectrum::BLACK) };
        lines.keys.push((key, value.line()));
        read_spectrum(value)
    };
    Ok(MaterialTable {
        number: 0,
        reflectance: spectrum("reflectance")?,
        emittance: spectrum("emittance")?,
        transmittance: spectrum("transmittance")?,
        lines,
    })
}

/// A number, or one for each of red, green and blue.
pub(crate) fn read_spectrum(value: Value<'_>) -> Result<Spectrum, Error> {
    if !value.is_array() {
        return value.number().map(Spectrum::from);
    }
    let [r, g, b] = value.exactly("a number, or three: [r, g, b]")?;
    Ok(Spectrum::rgb([r.number()?, g.number()?, b.number()?]))
}

/// The material that a value names.
pub(crate) fn find_material<'m>(
    value: &Value<'_>,
    materials: &'m Materials,
) -> Result<&'m MaterialTable, Error> {
    let name = value.string()?;
    materials.get(name).ok_or_else(|| Error::UnknownMaterial {
        place: value.place(),
        material: name.into(),
        known: materials.keys().cloned().collect(),
    })
}
