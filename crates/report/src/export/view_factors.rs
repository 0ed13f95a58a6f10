//! View factors in the files that other programs read. Each takes the square part of a matrix, whose columns are its rows.
//!
//! View3D (G. N. Walton, NISTIR 6925; `doc/view3d-manual.tex`), uDALES (`vfsparse.inp`), EnergyPlus (*Input Output Reference*,
//! `ZoneProperty:UserViewFactors:BySurfaceName`) and OpenFOAM (`viewFactorsGen`). Programs of the first three kinds take what is missing
//! of 1 for the sky or the surroundings.

use std::io::{self, Write};

use super::matrix_rows::{MatrixRow, MatrixRows};

/// A row's entries in the columns that are rows, too.
pub(super) fn square<'a>(matrix: &dyn MatrixRows, row: &MatrixRow<'a>) -> &'a [(u32, f64)] {
    let rows = matrix.rows() as u32;
    &row.entries[..row.entries.partition_point(|&(column, _)| column < rows)]
}

/// Writes the text file of View3D (`out=0`): a line of the program, its version, out, encl, emit and the number of rows; the areas,
/// a line for each row of factors, the emissivities.
///
/// # Errors
/// Those of `writer` and of the matrix.
pub fn write_view3d(
    mut writer: impl Write,
    (areas, emissivities): (&[f64], &[f64]),
    matrix: &dyn MatrixRows,
) -> io::Result<()> {
    writeln!(writer, "radwalk {} 0 0 0 {}", env!("CARGO_PKG_VERSION"), matrix.rows())?;
    write_words(&mut writer, areas.iter().map(|area| format!("{area}")))?;
    let mut line = vec![0.0; matrix.rows()];
    matrix.each(&mut |row| {
        line.fill(0.0);
        square(matrix, &row).iter().for_each(|&(column, factor)| line[column as usize] = factor);
        write_words(&mut writer, line.iter().map(|factor| format!("{factor}")))
    })?;
    write_words(&mut writer, emissivities.iter().map(|emissivity| format!("{emissivity}")))
}

/// Writes words on a line.
fn write_words(mut writer: impl Write, words: impl Iterator<Item = String>) -> io::Result<()> {
    for (place, word) in words.enumerate() {
        write!(writer, "{}{word}", if place == 0 { "" } else { " " })?;
    }
    writeln!(writer)
}

/// Writes the sparse text of uDALES: row, column, factor of each entry, counted from 1.
///
/// # Errors
/// Those of `writer` and of the matrix.
pub fn write_udales(mut writer: impl Write, matrix: &dyn MatrixRows) -> io::Result<()> {
    matrix.each(&mut |row| {
        let i = row.row + 1;
        let entries = square(matrix, &row).iter();
        entries.clone().try_for_each(|(j, factor)| writeln!(writer, "{i} {} {factor}", j + 1))
    })
}

/// Writes the sky view factors of uDALES (`svf.inp`): what is left of 1 of each row, but for the last column where it holds factors to surfaces that were
/// dropped.
///
/// # Errors
/// Those of `writer` and of the matrix.
pub fn write_udales_sky(
    mut writer: impl Write,
    matrix: &dyn MatrixRows,
    has_dropped: bool,
) -> io::Result<()> {
    writeln!(writer, "# sky view factors")?;
    let dropped = has_dropped.then(|| matrix.columns() as u32 - 1);
    matrix.each(&mut |row| {
        let rest = row.entries.last().filter(|(column, _)| Some(*column) == dropped);
        let seen: f64 = square(matrix, &row).iter().chain(rest).map(|(_, factor)| factor).sum();
        writeln!(writer, "{}", (1.0 - seen).max(0.0))
    })
}

/// Writes the object of EnergyPlus: the name of a zone, then surface, surface, factor of every pair, those of 0, too.
///
/// # Errors
/// Those of `writer` and of the matrix.
pub fn write_energyplus(
    mut writer: impl Write,
    zone: &str,
    names: &[String],
    matrix: &dyn MatrixRows,
) -> io::Result<()> {
    let special = |name: &&str| name.contains([',', ';', '!', '\n']);
    if let Some(name) = std::iter::once(zone).chain(names.iter().map(String::as_str)).find(special) {
        return Err(io::Error::new(
            io::ErrorKind::InvalidInput,
            format!(
                "{name:?} has a comma, a semicolon or an exclamation mark, which end fields of EnergyPlus and cannot be quoted; give the job or the surface another name"
            ),
        ));
    }
    write!(writer, "ZoneProperty:UserViewFactors:BySurfaceName,\n  {zone}")?;
    matrix.each(&mut |row| {
        let mut entries = square(matrix, &row).iter().peekable();
        let from = &names[row.row];
        names.iter().enumerate().try_for_each(|(j, to)| {
            let factor = entries.next_if(|(column, _)| *column as usize == j).map_or(0.0, |entry| entry.1);
            write!(writer, ",\n  {from},{to},{factor}")
        })
    })?;
    writeln!(writer, ";")
}

/// What a file of lists of OpenFOAM holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FoamList {
    /// `F`: the factors of each row that are not 0.
    Factors,
    /// `globalFaceFaces`: the columns of these.
    Columns,
}

/// Writes the header of a file of OpenFOAM in text.
fn write_foam_header(mut writer: impl Write, class: &str, object: &str) -> io::Result<()> {
    writeln!(
        writer,
        "FoamFile\n{{\n    version     2.0;\n    format      ascii;\n    class       {class};\n    location    \"constant\";\n    object      {object};\n}}\n"
    )
}

/// Writes `F` or `globalFaceFaces` of OpenFOAM as text: for each row a list.
///
/// # Errors
/// Those of `writer` and of the matrix.
pub fn write_openfoam(mut writer: impl Write, list: FoamList, matrix: &dyn MatrixRows) -> io::Result<()> {
    let (class, object) = match list {
        FoamList::Factors => ("scalarListList", "F"),
        FoamList::Columns => ("labelListList", "globalFaceFaces"),
    };
    write_foam_header(&mut writer, class, object)?;
    writeln!(writer, "{}\n(", matrix.rows())?;
    matrix.each(&mut |row| {
        let entries = square(matrix, &row);
        write!(writer, "{}(", entries.len())?;
        let words = entries.iter().map(|(column, factor)| match list {
            FoamList::Factors => format!("{factor}"),
            FoamList::Columns => format!("{column}"),
        });
        for (place, word) in words.enumerate() {
            write!(writer, "{}{word}", if place == 0 { "" } else { " " })?;
        }
        writeln!(writer, ")")
    })?;
    writeln!(writer, ")")
}

/// Writes one of the maps by which OpenFOAM's processors exchange faces, for a case on one processor: `subMap` and `constructMap` are the list
/// of all faces, `constructMapDim` is how many there are.
///
/// # Errors
/// Those of `writer`.
pub fn write_openfoam_map(mut writer: impl Write, object: &str, faces: usize) -> io::Result<()> {
    if object == "constructMapDim" {
        write_foam_header(&mut writer, "labelList", object)?;
        return writeln!(writer, "1({faces})");
    }
    write_foam_header(&mut writer, "labelListList", object)?;
    write!(writer, "1\n(\n{faces}(")?;
    (0..faces).try_for_each(|face| write!(writer, "{}{face}", if face == 0 { "" } else { " " }))?;
    writeln!(writer, ")\n)")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two surfaces in the open, and a third that sees only the second: columns of what escapes follow.
    fn matrix() -> Vec<Vec<f64>> {
        vec![vec![0.0, 0.25, 0.0, 0.75], vec![0.125, 0.0, 0.375, 0.5], vec![0.0, 1.0, 0.0, 0.0]]
    }

    fn text(write: impl FnOnce(&mut Vec<u8>) -> io::Result<()>) -> String {
        let mut bytes = Vec::new();
        write(&mut bytes).unwrap();
        String::from_utf8(bytes).unwrap()
    }

    /// As `ReadF0s` of View3D reads it (`src/readvf.c`): a line, then numbers between blanks, areas, rows, emissivities.
    #[test]
    fn view3d_reads_areas_rows_and_emissivities() {
        let areas = ([1.0, 2.0, 0.5], [0.9, 0.8, 1.0]);
        let text = text(|writer| write_view3d(writer, (&areas.0, &areas.1), &matrix()));
        let (header, rest) = text.split_once('\n').unwrap();
        assert!(header.len() < 35, "longer headers are taken for numbers");
        let words: Vec<&str> = header.split(' ').collect();
        assert_eq!((words.len(), &words[2..]), (6, &["0", "0", "0", "3"][..]));
        let numbers: Vec<f64> = rest.split_whitespace().map(|word| word.parse().unwrap()).collect();
        assert_eq!(numbers[..3], areas.0);
        assert_eq!(numbers[3..12], [0.0, 0.25, 0.0, 0.125, 0.0, 0.375, 0.0, 1.0, 0.0]);
        assert_eq!(numbers[12..], areas.1);
    }

    /// As uDALES reads it (`src/initfac.f90`): three numbers a line, counted from 1; the sky after a line of words.
    #[test]
    fn udales_reads_triples_and_the_sky() {
        let triples = text(|writer| write_udales(writer, &matrix()));
        assert_eq!(triples, "1 2 0.25\n2 1 0.125\n2 3 0.375\n3 2 1\n");
        let sky = text(|writer| write_udales_sky(writer, &matrix(), false));
        assert_eq!(sky, "# sky view factors\n0.75\n0.5\n0\n");
        let mut dropped = matrix();
        dropped.iter_mut().for_each(|row| row.push(0.125));
        dropped[2] = vec![0.0; dropped[2].len()];
        let sky = text(|writer| write_udales_sky(writer, &dropped, true));
        assert_eq!(sky, "# sky view factors\n0.625\n0.375\n1\n");
    }

    /// As the *Input Output Reference* of EnergyPlus has it: fields between commas, the last before a semicolon; n² factors.
    #[test]
    fn energyplus_reads_every_pair() {
        let names = ["floor", "wall", "roof"].map(String::from);
        let text = text(|writer| write_energyplus(writer, "attic", &names, &matrix()));
        let object = text.trim_end().strip_suffix(';').unwrap();
        let fields: Vec<&str> = object.split(',').map(str::trim).collect();
        assert_eq!(
            fields[..5],
            ["ZoneProperty:UserViewFactors:BySurfaceName", "attic", "floor", "floor", "0"]
        );
        assert_eq!(fields.len(), 2 + 3 * 9);
        let factors = fields[2..].chunks(3).map(|triple| triple[2].parse::<f64>().unwrap());
        assert_eq!(factors.collect::<Vec<_>>(), [0.0, 0.25, 0.0, 0.125, 0.0, 0.375, 0.0, 1.0, 0.0]);
        assert_eq!(fields[5..8], ["floor", "wall", "0.25"]);
    }

    /// Lists of lists as OpenFOAM writes them in text: the number of elements, then these in parentheses.
    #[test]
    fn openfoam_reads_lists_of_lists() {
        let factors = text(|writer| write_openfoam(writer, FoamList::Factors, &matrix()));
        assert!(factors.contains("class       scalarListList;") && factors.contains("object      F;"));
        assert!(factors.ends_with("\n3\n(\n1(0.25)\n2(0.125 0.375)\n1(1)\n)\n"), "{factors}");
        let columns = text(|writer| write_openfoam(writer, FoamList::Columns, &matrix()));
        assert!(columns.ends_with("\n3\n(\n1(1)\n2(0 2)\n1(1)\n)\n"), "{columns}");
    }

    /// As `viewFactor.C` of the OpenFOAM Foundation reads them beside `F`: a list for each processor, and a list of one number.
    #[test]
    fn openfoam_reads_the_maps_of_one_processor() {
        for object in ["subMap", "constructMap"] {
            let map = text(|writer| write_openfoam_map(writer, object, 3));
            assert!(
                map.contains("class       labelListList;") && map.contains(&format!("object      {object};"))
            );
            assert!(map.ends_with("}\n\n1\n(\n3(0 1 2)\n)\n"), "{map}");
        }
        let size = text(|writer| write_openfoam_map(writer, "constructMapDim", 3));
        assert!(size.contains("class       labelList;") && size.ends_with("}\n\n1(3)\n"), "{size}");
    }
}
