//! `patches.vtu`: an unstructured grid of the Visualization Toolkit in XML, a cell a row of `patches.csv`; where a patch
//! is a group of cells, a cell of the grid for each of these, with the numbers of the row.
//!
//! Arrays are base64 of 64-bit little-endian numbers after their length in bytes, as the file format of VTK's XML readers
//! has it. A missing estimate is written as NaN. Words become numbers: `surface` its position among the names in the
//! order of rows, `side` 0 (front) or 1 (back), `flags` the sum of 1 (emitter), 2 (rare), 4 (unsampled), 8 (bias).

use std::collections::HashMap;
use std::io::{self, Write};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use radiosity::Estimates;

use super::table::{Column, ColumnCells, columns, corners};

/// VTK's numbers of cell types.
const TRIANGLE: i64 = 5;
const QUAD: i64 = 9;

/// Words of the column `flags`, from the lowest bit.
const FLAGS: [&str; 4] = ["emitter", "rare", "unsampled", "bias"];

/// Writes the patches with their corners and all numbers of the table.
///
/// # Errors
/// Those of `writer`.
pub fn write_vtu(mut writer: impl Write, estimates: &Estimates) -> io::Result<()> {
    let (mut points, mut connectivity, mut offsets, mut types) = (vec![], vec![], vec![], vec![]);
    let mut rows = Vec::new();
    for (row, corners) in corners(estimates) {
        rows.push(row);
        for corner in &corners {
            connectivity.push((points.len() / 3) as i64);
            points.extend(corner.to_array());
        }
        offsets.push(connectivity.len() as i64);
        types.push(if corners.len() == 3 { TRIANGLE } else { QUAD });
    }
    writeln!(writer, "<?xml version=\"1.0\"?>")?;
    writeln!(
        writer,
        "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">"
    )?;
    writeln!(writer, "<UnstructuredGrid>")?;
    let (corners, cells) = (points.len() / 3, types.len());
    writeln!(writer, "<Piece NumberOfPoints=\"{corners}\" NumberOfCells=\"{cells}\">")?;
    writeln!(writer, "<Points>")?;
    floats(&mut writer, "Points", " NumberOfComponents=\"3\"", points)?;
    writeln!(writer, "</Points>\n<Cells>")?;
    integers(&mut writer, "connectivity", connectivity)?;
    integers(&mut writer, "offsets", offsets)?;
    integers(&mut writer, "types", types)?;
    let columns = columns(estimates)?;
    let active = columns.iter().map(|column| &column.name).find(|name| name.starts_with("radiosity"));
    writeln!(writer, "</Cells>\n<CellData Scalars=\"{}\">", active.expect("every table has it"))?;
    for Column { name, cells } in columns {
        match cells.of_rows(&rows) {
            ColumnCells::Number(cells) => {
                floats(&mut writer, &name, "", cells.into_iter().map(|cell| cell.unwrap_or(f64::NAN)))?;
            }
            // Integers have no word for what is unknown.
            ColumnCells::Whole(cells) => match cells.iter().copied().collect::<Option<Vec<i64>>>() {
                Some(known) => integers(&mut writer, &name, known)?,
                None => {
                    let number = |cell: Option<i64>| cell.map_or(f64::NAN, |cell| cell as f64);
                    floats(&mut writer, &name, "", cells.into_iter().map(number))?;
                }
            },
            ColumnCells::Words(words) => integers(&mut writer, &name, numbers(&name, &words))?,
        }
    }
    writeln!(writer, "</CellData>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>")
}

/// The numbers that stand for the words of a column.
fn numbers(name: &str, words: &[String]) -> Vec<i64> {
    if name == "flags" {
        let bits = |words: &String| -> i64 {
            words
                .split('|')
                .filter_map(|word| FLAGS.iter().position(|flag| *flag == word))
                .map(|bit| 1 << bit)
                .sum()
        };
        return words.iter().map(bits).collect();
    }
    let mut known = HashMap::new();
    let mut number = |word: &str| {
        let next = known.len() as i64;
        *known.entry(word.to_owned()).or_insert(next)
    };
    if name == "side" {
        for side in ["front", "back"] {
            number(side);
        }
    }
    words.iter().map(|word| number(word)).collect()
}

fn floats(
    writer: impl Write,
    name: &str,
    more: &str,
    values: impl IntoIterator<Item = f64>,
) -> io::Result<()> {
    array(writer, "Float64", name, more, values.into_iter().map(f64::to_le_bytes))
}

fn integers(writer: impl Write, name: &str, values: impl IntoIterator<Item = i64>) -> io::Result<()> {
    array(writer, "Int64", name, "", values.into_iter().map(i64::to_le_bytes))
}

fn array(
    mut writer: impl Write,
    kind: &str,
    name: &str,
    more: &str,
    values: impl Iterator<Item = [u8; 8]>,
) -> io::Result<()> {
    let mut bytes = vec![0; 8];
    values.for_each(|value| bytes.extend(value));
    let length = bytes.len() as u64 - 8;
    bytes[..8].copy_from_slice(&length.to_le_bytes());
    write!(writer, "<DataArray type=\"{kind}\" Name=\"{name}\" format=\"binary\"{more}>")?;
    writer.write_all(STANDARD.encode(bytes).as_bytes())?;
    writeln!(writer, "</DataArray>")
}

#[cfg(test)]
mod tests {
    use radiosity::{IndexChoice, Scene, Spectrum};

    use super::*;
    use crate::scenes::{cube_spec, experiment, shot};

    /// The array that viewers colour by at first exists, in colour, too.
    #[test]
    fn the_active_array_exists() {
        for (lamp, name) in
            [(Spectrum::from(1.0), "radiosity"), (Spectrum::rgb([3.0, 2.0, 1.0]), "radiosity_r")]
        {
            let mut spec = cube_spec();
            spec.surfaces[1].cell_emittance = vec![(4, lamp)];
            let experiment = experiment(&Scene::build(&spec, IndexChoice::Auto).unwrap());
            let tally = shot(&experiment);
            let mut vtu = Vec::new();
            write_vtu(&mut vtu, &Estimates::new(&experiment, &tally, 0.95)).unwrap();
            let text = String::from_utf8(vtu).unwrap();
            for words in ["<CellData Scalars", "Float64\" Name"] {
                assert!(text.contains(&format!("{words}=\"{name}\"")), "{words} {name}");
            }
        }
    }
}
