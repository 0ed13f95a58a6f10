//! `annual.csv`, `annual.ill` and `daylight.json`: the daylight of a year, place by place.

use std::io::{self, Seek, Write};

use serde::Serialize;
use sky::{BoundedValue, Matrix, Metrics, TARGETS};

use crate::export::npz::Archive;
use crate::export::{Column, ColumnCells, write_columns_parquet};

/// A row of `annual.csv`.
#[derive(Clone, Debug)]
pub struct DaylightRow<'a> {
    /// The name of the sensor.
    pub sensor: &'a str,
    /// The cell of it.
    pub cell: [u32; 2],
    /// The middle of the cell [m].
    pub middle: [f64; 3],
    /// Walks that were born there.
    pub walks: u64,
    /// The daylight factor [%].
    pub daylight_factor: BoundedValue,
    /// The figures of the year.
    pub metrics: Metrics,
}

/// Writes the figures of every place, each with the ends of its interval.
///
/// # Errors
/// Those of `writer`.
pub fn write_daylight(writer: impl Write, rows: &[DaylightRow<'_>]) -> io::Result<()> {
    let mut table = csv::Writer::from_writer(writer);
    let place = ["sensor", "u", "v", "x", "y", "z", "walks"].map(String::from);
    let columns = figure_names()
        .into_iter()
        .flat_map(|name| [name.clone(), format!("{name}_low"), format!("{name}_high")]);
    table.write_record(place.into_iter().chain(columns))?;
    for row in rows {
        let DaylightRow { sensor, cell, middle, walks, .. } = row;
        let numbers: Vec<f64> =
            row.figures().iter().flat_map(|known| [known.value, known.low, known.high]).collect();
        table.serialize((sensor, cell, middle, walks, numbers))?;
    }
    table.flush()
}

/// The figures of a place.
const FIGURES: usize = 5 + TARGETS.len();

/// The names of the figures, as in [`DaylightRow::figures`].
fn figure_names() -> [String; FIGURES] {
    let known = ["daylight_factor", "mean", "autonomy", "useful", "excess"];
    std::array::from_fn(|figure| match known.get(figure) {
        Some(&name) => name.into(),
        None => format!("daylight_{}", TARGETS[figure - known.len()]),
    })
}

impl DaylightRow<'_> {
    /// All figures of the place.
    fn figures(&self) -> [BoundedValue; FIGURES] {
        let Metrics { mean, enough, useful, excess, daylight } = self.metrics;
        let known = [self.daylight_factor, mean, enough, useful, excess];
        std::array::from_fn(|figure| match known.get(figure) {
            Some(&known) => known,
            None => daylight[figure - known.len()],
        })
    }
}

/// Writes the light of every place in a line, hour by hour, to a hundredth.
///
/// # Errors
/// Those of `writer`.
pub fn write_ill(
    mut writer: impl Write,
    places: impl Iterator<Item = impl Iterator<Item = f64>>,
) -> io::Result<()> {
    for place in places {
        let line: Vec<String> = place.map(|light| format!("{light:.2}")).collect();
        writeln!(writer, "{}", line.join(" "))?;
    }
    Ok(())
}

/// What places have received, for arrays and data frames.
pub struct DaylightArrays<'a> {
    /// The places.
    pub rows: &'a [DaylightRow<'a>],
    /// The coefficients of each place [sr], and their standard errors.
    pub coefficients: [&'a Matrix; 2],
    /// The month, the day, and the hour that ends, hour by hour.
    pub hours: &'a [[u32; 3]],
    /// The light of each place in each hour, and its standard error [lx].
    pub light: &'a [&'a [[f64; 2]]],
}

impl DaylightArrays<'_> {
    /// Writes arrays for NumPy: `sensor`, `cell` and `middle` of the places, `coefficients` and `coefficients_error` by place and number of the sky
    /// vector, `time` by hour, `light` and `light_error` by place and hour, `walks` by place, and under its name in `annual.csv` each figure with the
    /// ends of its interval by place.
    ///
    /// # Errors
    /// Those of `writer`.
    pub fn write_npz(&self, writer: impl Write + Seek) -> io::Result<()> {
        let mut archive = Archive::new(writer);
        archive.words("sensor", self.rows.iter().map(|row| row.sensor))?;
        let places = |of: &dyn Fn(&DaylightRow<'_>) -> Vec<f64>| self.rows.iter().map(of).collect::<Vec<_>>();
        archive.matrix("cell", &places(&|row| row.cell.map(f64::from).to_vec()))?;
        archive.matrix("middle", &places(&|row| row.middle.to_vec()))?;
        for (name, matrix) in ["coefficients", "coefficients_error"].into_iter().zip(self.coefficients) {
            let rows: Vec<Vec<f64>> = matrix.numbers.chunks(matrix.columns).map(<[f64]>::to_vec).collect();
            archive.matrix(name, &rows)?;
        }
        let time: Vec<Vec<f64>> = self.hours.iter().map(|time| time.map(f64::from).to_vec()).collect();
        archive.matrix("time", &time)?;
        for (which, name) in ["light", "light_error"].into_iter().enumerate() {
            let light = self.light.iter().map(|place| place.iter().map(|hour| hour[which]).collect());
            archive.matrix(name, &light.collect::<Vec<Vec<f64>>>())?;
        }
        archive.matrix("walks", &places(&|row| vec![row.walks as f64]))?;
        for (figure, name) in figure_names().iter().enumerate() {
            let ends = |row: &DaylightRow<'_>| {
                let BoundedValue { value, low, high } = row.figures()[figure];
                vec![value, low, high]
            };
            archive.matrix(name, &places(&ends))?;
        }
        archive.finish()
    }

    /// Writes a row for each place and hour: `place` (the row of `annual.csv`, from 0), `sensor`, `month`, `day`, `hour`, `light`, `std_error`.
    ///
    /// # Errors
    /// Those of `writer`.
    pub fn write_parquet(&self, writer: impl Write + Send) -> io::Result<()> {
        write_columns_parquet(writer, self.rows.len(), |place| self.columns(place))
    }

    /// The rows of a place.
    fn columns(&self, place: usize) -> Vec<Column> {
        let hours = self.hours.len();
        let column = |name: &str, cells| Column { name: name.into(), cells };
        let time = |which: usize| self.hours.iter().map(move |time| Some(time[which].into())).collect();
        let light = |which: usize| self.light[place].iter().map(|hour| Some(hour[which])).collect();
        vec![
            column("place", ColumnCells::Whole(vec![Some(place as i64); hours])),
            column("sensor", ColumnCells::Words(vec![self.rows[place].sensor.to_owned(); hours])),
            column("month", ColumnCells::Whole(time(0))),
            column("day", ColumnCells::Whole(time(1))),
            column("hour", ColumnCells::Whole(time(2))),
            column("light", ColumnCells::Number(light(0))),
            column("std_error", ColumnCells::Number(light(1))),
        ]
    }
}

/// `daylight.json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DaylightSummary {
    /// Of the program.
    pub version: String,
    /// Of the walks.
    pub seed: u64,
    /// The place of the weather.
    pub city: String,
    /// Hours of the weather file.
    pub hours: usize,
    /// Patches of the sky.
    pub patches: usize,
    /// The reflectance of the ground.
    pub ground: f64,
    /// Places where light is measured.
    pub places: usize,
    /// All walks.
    pub walks: u64,
    /// Their rays.
    pub rays: u64,
    /// The part of the walks that ended on backs.
    pub back: f64,
    /// The level of intervals.
    pub confidence: f64,
    /// The relative half-width that is asked of yearly means.
    pub tolerance: f64,
    /// Whether every place meets it.
    pub reached: bool,
    /// The illuminance that is enough [lx].
    pub enough: f64,
    /// Between these daylight is useful [lx].
    pub useful: [f64; 2],
    /// The first and the last of the occupied hours, by their ends.
    pub occupied: [u32; 2],
    /// By what part of themselves yearly means change where reflected sun comes from one patch in place of four: the median and the most.
    pub sun_smear: [f64; 2],
    /// The level by EN 17037 of each sensor that faces up.
    pub levels: Vec<LevelSummary>,
    /// Wall time of walking [s].
    pub seconds: f64,
    /// Processor time of walking [s].
    pub cpu_seconds: f64,
}

/// The level of a sensor by EN 17037: `none`, `minimum`, `medium` or `high`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LevelSummary {
    /// The name of the sensor.
    pub sensor: String,
    /// By the lower ends of intervals.
    pub low: &'static str,
    /// By the upper ends.
    pub high: &'static str,
}

impl DaylightSummary {
    /// Writes the summary as JSON.
    ///
    /// # Errors
    /// Those of `writer`.
    pub fn write(&self, writer: &mut dyn Write) -> io::Result<()> {
        serde_json::to_writer_pretty(&mut *writer, self)?;
        writer.write_all(b"\n")
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::RowAccessor;

    use super::*;
    use crate::export::npz::tests::arrays;

    /// Two places in three hours, read back number by number.
    #[test]
    fn arrays_and_rows_are_read_back() {
        let known = BoundedValue { value: 1.0, low: 0.5, high: 1.5 };
        let metrics =
            Metrics { mean: known, enough: known, useful: known, excess: known, daylight: [known; 4] };
        let row = |sensor, cell| DaylightRow {
            sensor,
            cell,
            middle: [0.0, 1.0, 2.0],
            walks: 4096,
            daylight_factor: known,
            metrics,
        };
        let rows = [row("desk", [0, 0]), row("Tür", [0, 1])];
        let matrix = Matrix { rows: 2, columns: 4, numbers: (0..8).map(f64::from).collect() };
        let light = [[[1.0, 0.1], [2.0, 0.2], [3.0, 0.3]], [[4.0, 0.4], [5.0, 0.5], [6.0, 0.6]]];
        let light: Vec<&[[f64; 2]]> = light.iter().map(|place| &place[..]).collect();
        let all = DaylightArrays {
            rows: &rows,
            coefficients: [&matrix, &matrix],
            hours: &[[1, 10, 12], [1, 10, 13], [12, 20, 1]],
            light: &light,
        };
        let mut bytes = Cursor::new(Vec::new());
        all.write_npz(&mut bytes).unwrap();
        let found = arrays(bytes.get_ref());
        let names: Vec<&str> = found.iter().map(|(name, _)| &**name).collect();
        let expected = "sensor cell middle coefficients coefficients_error time light light_error walks daylight_factor mean autonomy useful excess daylight_100 daylight_300 daylight_500 daylight_750";
        assert_eq!(names.join(" ").replace(".npy", ""), expected);
        assert!(found[6].1.ends_with(&6.0_f64.to_le_bytes()) && found[3].1.ends_with(&7.0_f64.to_le_bytes()));
        assert!(
            [1.0_f64, 0.5, 1.5].iter().rev().zip(found[11].1.rchunks(8)).all(|(x, y)| x.to_le_bytes() == y)
        );
        let header = String::from_utf8_lossy(&found[6].1[10..128]).into_owned();
        assert!(header.contains("'shape': (2, 3)"), "{header}");

        let mut file = Vec::new();
        all.write_parquet(&mut file).unwrap();
        let reader = SerializedFileReader::new(bytes::Bytes::from(file)).unwrap();
        let rows: Vec<_> = reader.get_row_iter(None).unwrap().map(Result::unwrap).collect();
        assert_eq!(rows.len(), 6);
        let names: Vec<&String> = rows[0].get_column_iter().map(|(name, _)| name).collect();
        assert_eq!(names, ["place", "sensor", "month", "day", "hour", "light", "std_error"]);
        assert_eq!((rows[4].get_long(0).unwrap(), rows[4].get_string(1).unwrap().as_str()), (1, "Tür"));
        assert_eq!((rows[5].get_long(2).unwrap(), rows[5].get_long(4).unwrap()), (12, 1));
        assert_eq!((rows[4].get_double(5).unwrap(), rows[4].get_double(6).unwrap()), (5.0, 0.5));
    }
}
