//! Wavefront MTL: the diffuse part of materials.

use std::path::Path;

use radiosity::Spectrum;

use crate::error::{Error, Fault, Spot};
use crate::mesh::Material;
use crate::text::{Lines, name, number, rest, words};

/// Reads a material library.
pub(crate) fn read(path: &Path, text: &[u8]) -> Result<Vec<Material>, Error> {
    let mut materials: Vec<Material> = Vec::new();
    let mut lines = Lines::new(text);
    while let Some((number, line)) = lines.next() {
        let done = statement(line, &mut materials);
        done.map_err(|fault| fault.at(path, Spot::Line(number)))?;
    }
    Ok(materials)
}

fn statement(line: &[u8], materials: &mut Vec<Material>) -> Result<(), Fault> {
    let mut arguments = words(line);
    let keyword = arguments.next().unwrap_or_default().to_ascii_lowercase();
    if keyword == b"newmtl" {
        let name = match rest(line) {
            name if name.is_empty() => "default".into(),
            name => name,
        };
        // The format's default of a material without Kd is black.
        materials.push(Material { reflectance: Spectrum::BLACK, ..Material::unknown(name) });
        return Ok(());
    }
    // Lines before the first material belong to none.
    let Some(material) = materials.last_mut() else { return Ok(()) };
    match keyword.as_slice() {
        b"kd" => material.reflectance = colour(&mut arguments)?,
        b"ke" => material.emittance = colour(&mut arguments)?,
        b"ks" => drop_if_lit(material, "specular reflectance", colour(&mut arguments)?),
        b"d" => drop_if_lit(material, "transparency", (1.0 - opacity(&mut arguments)?).into()),
        b"tr" => drop_if_lit(material, "transparency", opacity(&mut arguments)?.into()),
        b"map_kd" => drop_map(material, "its diffuse texture (Kd is taken as written)", line),
        b"map_ke" => drop_map(material, "its emission texture (Ke is taken as written)", line),
        b"map_d" => drop_map(material, "its transparency texture", line),
        _ => {}
    }
    Ok(())
}

/// Reads three channels, or one number for all.
fn colour<'a>(words: &mut impl Iterator<Item = &'a [u8]>) -> Result<Spectrum, Fault> {
    let first = words.next();
    if let Some(kind @ (b"spectral" | b"xyz")) = first {
        return Err(Fault::new(
            format!("the colour is given as {}", name(kind)),
            "reflectance is read as red, green, blue",
            "write three numbers",
        ));
    }
    let red = number(first)?;
    let Some(green) = words.next() else { return Ok(red.into()) };
    let (green, blue) = (number(Some(green))?, number(words.next())?);
    Ok(Spectrum::rgb([red, green, blue]))
}

/// Reads a number, perhaps after the word `-halo`.
fn opacity<'a>(words: &mut impl Iterator<Item = &'a [u8]>) -> Result<f64, Fault> {
    let first = words.next();
    number(if first == Some(b"-halo") { words.next() } else { first })
}

fn drop_if_lit(material: &mut Material, what: &str, amount: Spectrum) {
    if amount.is_lit() {
        material.dropped.push(format!("{what} {}", crate::in_words(amount)));
    }
}

fn drop_map(material: &mut Material, what: &str, line: &[u8]) {
    material.dropped.push(format!("{what} {}", rest(line)));
}
