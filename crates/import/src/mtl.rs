//! Wavefront MTL: the diffuse part of materials.

use std::path::Path;

use glam::DVec2;
use radiosity::Spectrum;

use crate::error::{Error, FileSpot, UnplacedError};
use crate::mesh::{LostProperty, Material};
use crate::text::{LogicalLines, name, number, rest, words};
use crate::texture::{Placing, Wrap};

/// A material of a library, with the images that it names.
#[derive(Debug)]
pub(crate) struct MtlEntry {
    pub(crate) material: Material,
    /// The image of `map_Kd`, which the colour is multiplied by.
    pub(crate) colour: Option<MtlImage>,
    /// The image of `map_Ke`.
    pub(crate) emission: Option<MtlImage>,
}

/// An image that a material names, and how it lies on faces.
#[derive(Debug)]
pub(crate) struct MtlImage {
    pub(crate) name: String,
    pub(crate) placing: Placing,
}

/// Reads a material library.
pub(crate) fn read(path: &Path, text: &[u8]) -> Result<Vec<MtlEntry>, Error> {
    let mut entries: Vec<MtlEntry> = Vec::new();
    let mut lines = LogicalLines::new(text);
    while let Some((number, line)) = lines.next() {
        let done = statement(line, &mut entries);
        done.map_err(|fault| fault.at(path, FileSpot::Line(number)))?;
    }
    Ok(entries)
}

fn statement(line: &[u8], entries: &mut Vec<MtlEntry>) -> Result<(), UnplacedError> {
    let mut arguments = words(line);
    let keyword = arguments.next().unwrap_or_default().to_ascii_lowercase();
    if keyword == b"newmtl" {
        let name = match rest(line) {
            name if name.is_empty() => "default".into(),
            name => name,
        };
        // The format's default of a material without Kd is black.
        let material = Material { reflectance: Spectrum::BLACK, ..Material::unknown(name) };
        entries.push(MtlEntry { material, colour: None, emission: None });
        return Ok(());
    }
    // Lines before the first material belong to none.
    let Some(MtlEntry { material, colour: colour_image, emission }) = entries.last_mut() else {
        return Ok(());
    };
    match keyword.as_slice() {
        b"kd" => material.reflectance = colour(&mut arguments)?,
        b"ke" => material.emittance = colour(&mut arguments)?,
        b"ks" if colour(&mut arguments)?.is_lit() => material.loses(LostProperty::Mirror),
        b"d" => material.passes(1.0 - opacity(&mut arguments)?),
        // Some programs write 1 for what is opaque, others for what is clear.
        b"tr" if opacity(&mut arguments)? > 0.0 => material.loses(LostProperty::Transparency),
        b"map_kd" => *colour_image = image(line),
        b"map_ke" => *emission = image(line),
        b"map_d" => material.loses(LostProperty::Transparency),
        _ => {}
    }
    Ok(())
}

/// Reads three channels, or one number for all.
fn colour<'a>(words: &mut impl Iterator<Item = &'a [u8]>) -> Result<Spectrum, UnplacedError> {
    let first = words.next();
    if let Some(kind @ (b"spectral" | b"xyz")) = first {
        return Err(UnplacedError::new(
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
fn opacity<'a>(words: &mut impl Iterator<Item = &'a [u8]>) -> Result<f64, UnplacedError> {
    let first = words.next();
    number(if first == Some(b"-halo") { words.next() } else { first })
}

/// The image behind a keyword and its options, which begin with `-`; names may hold spaces. Of the options `-s` scales places, `-o` moves them
/// then, and `-clamp on` ends the image at its edges.
fn image(line: &[u8]) -> Option<MtlImage> {
    let mut left = rest(line);
    let (mut scale, mut offset, mut placing) = (DVec2::ONE, DVec2::ZERO, Placing::FROM_BELOW);
    while let Some(option) = left.strip_prefix('-') {
        let (option, mut behind) = option.split_once(char::is_whitespace)?;
        let most = match option {
            "o" | "s" | "t" => 3,
            "mm" => 2,
            _ => 1,
        };
        for count in 0..most {
            let trimmed = behind.trim_start();
            let (word, more) = trimmed.split_once(char::is_whitespace).unwrap_or((trimmed, ""));
            let value = word.parse::<f64>().ok().filter(|value| value.is_finite());
            // Of a place, the second and third number may be left out.
            if count > 0 && value.is_none() {
                break;
            }
            match (option, value) {
                ("s", Some(value)) if count < 2 => scale[count] = value,
                ("o", Some(value)) if count < 2 => offset[count] = value,
                ("clamp", _) if word == "on" => placing.wrap = [Wrap::Clamp; 2],
                _ => {}
            }
            behind = more;
        }
        left = behind.trim_start().to_owned();
    }
    let placing = placing.after(scale, offset);
    Some(MtlImage { name: left, placing }).filter(|image| !image.name.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_are_named_behind_their_options() {
        for (line, name) in [
            ("map_Kd wood.png", "wood.png"),
            ("map_Kd  my wood floor.png", "my wood floor.png"),
            ("map_Kd -s 2 2 1 -clamp on wood.png", "wood.png"),
            ("map_Kd -o 0.5 wood.png", "wood.png"),
            ("map_Kd -mm 0 1 -bm 2 tex/wood.png", "tex/wood.png"),
        ] {
            assert_eq!(image(line.as_bytes()).unwrap().name, name, "{line}");
        }
        assert!(image(b"map_Kd").is_none());
    }
}
