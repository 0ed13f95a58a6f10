//! The points that are measured so far, as rows of `compare.csv`.

use std::io::{self, Write};

use super::measure::Point;

/// The points of a table.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    points: Vec<Point>,
}

impl Rows {
    /// The rows of a table that `build` measured, and how many others there are.
    pub fn read(table: &[u8], build: &str) -> (Self, usize) {
        // A line without an end may lack digits of its last number.
        let whole = table.iter().rposition(|&byte| byte == b'\n').map_or(0, |end| end + 1);
        let mut lost = usize::from(whole < table.len());
        let mut points = Vec::new();
        for row in csv::Reader::from_reader(&table[..whole]).deserialize::<Point>() {
            match row {
                Ok(point) if point.build == build => points.push(point),
                _ => lost += 1,
            }
        }
        (Rows { points }, lost)
    }

    /// How many rows there are.
    pub fn count(&self) -> usize {
        self.points.len()
    }

    /// A row that was measured before.
    pub fn find(&self, key: &str, method: &str, rays: u64, runs: usize) -> Option<&Point> {
        let is_it = |p: &&Point| (&p.key[..], &p.method[..], p.rays, p.runs) == (key, method, rays, runs);
        self.points.iter().find(is_it)
    }

    /// Adds the row of a measurement.
    pub fn add(&mut self, point: Point) {
        self.points.push(point);
    }

    /// Writes the table.
    ///
    /// # Errors
    /// Those of `table`.
    pub fn write(&self, table: &mut impl Write) -> io::Result<()> {
        let mut writer = csv::Writer::from_writer(table);
        self.points.iter().try_for_each(|point| writer.serialize(point))?;
        writer.flush()
    }
}
