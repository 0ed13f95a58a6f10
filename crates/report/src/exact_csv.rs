//! `exact.csv`: the deterministic solution, and the variance that one walk of each estimator would have.

use std::io::{self, Write};

/// The columns, in patch order; all of one length. The variances are of B for one walk, in the order
/// absorption, survival, collision, infinite; `None` leaves a column empty, and so does a variance that is
/// not finite its cell (a patch that no walk is born on).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExactColumns {
    /// B [W/m²].
    pub radiosity: Vec<f64>,
    /// b = B − E [W/m²].
    pub reflected: Vec<f64>,
    /// H [W/m²].
    pub irradiance: Vec<f64>,
    /// ξ: received importance (S97 §2).
    pub xi: Vec<f64>,
    /// Variances of shooting [W²/m⁴].
    pub var_shoot: [Option<Vec<f64>>; 4],
    /// Variances of gathering [W²/m⁴].
    pub var_gather: [Option<Vec<f64>>; 4],
}

const HEADER: [&str; 13] = [
    "patch",
    "radiosity",
    "reflected",
    "irradiance",
    "xi",
    "var_shoot_absorption",
    "var_shoot_survival",
    "var_shoot_collision",
    "var_shoot_infinite",
    "var_gather_absorption",
    "var_gather_survival",
    "var_gather_collision",
    "var_gather_infinite",
];

/// Writes the columns.
///
/// # Errors
/// Those of `writer`, and columns of unequal lengths.
pub fn write_exact(writer: impl Write, columns: &ExactColumns) -> io::Result<()> {
    check_lengths(columns)?;
    let mut table = csv::Writer::from_writer(writer);
    table.write_record(HEADER)?;
    for patch in 0..columns.radiosity.len() {
        let values = [&columns.radiosity, &columns.reflected, &columns.irradiance, &columns.xi];
        let values = values.map(|column| column[patch]);
        let variance = |column: &Option<Vec<f64>>| {
            column.as_ref().map(|variances| variances[patch]).filter(|variance| variance.is_finite())
        };
        table.serialize((
            patch,
            values,
            columns.var_shoot.each_ref().map(variance),
            columns.var_gather.each_ref().map(variance),
        ))?;
    }
    table.flush()
}

fn check_lengths(columns: &ExactColumns) -> io::Result<()> {
    let patches = columns.radiosity.len();
    let always = [&columns.reflected, &columns.irradiance, &columns.xi];
    let variances = columns.var_shoot.iter().chain(&columns.var_gather).flatten();
    for column in always.into_iter().chain(variances) {
        if column.len() != patches {
            let problem = format!("columns of {patches} and {} patches do not make a table", column.len());
            return Err(io::Error::new(io::ErrorKind::InvalidInput, problem));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(columns: &ExactColumns) -> io::Result<String> {
        let mut bytes = Vec::new();
        write_exact(&mut bytes, columns)?;
        Ok(String::from_utf8(bytes).unwrap())
    }

    fn columns() -> ExactColumns {
        ExactColumns {
            radiosity: vec![1.5, 1e-20],
            reflected: vec![0.5, 1e300],
            irradiance: vec![1.0, 2.0],
            xi: vec![0.1, 1.0 / 3.0],
            var_shoot: [None, None, Some(vec![4.0, 5e-9]), None],
            var_gather: [Some(vec![f64::INFINITY, 6.0]), None, None, Some(vec![f64::NAN, 7.0])],
        }
    }

    #[test]
    fn columns_are_as_the_format_says() {
        assert_eq!(
            text(&columns()).unwrap(),
            "patch,radiosity,reflected,irradiance,xi,\
             var_shoot_absorption,var_shoot_survival,var_shoot_collision,var_shoot_infinite,\
             var_gather_absorption,var_gather_survival,var_gather_collision,var_gather_infinite\n\
             0,1.5,0.5,1.0,0.1,,,4.0,,,,,\n\
             1,1e-20,1e300,2.0,0.3333333333333333,,,5e-9,,6.0,,,7.0\n"
        );
    }

    #[test]
    fn unequal_columns_are_refused() {
        let mut short = columns();
        short.xi.pop();
        assert!(text(&short).is_err());
        let mut short = columns();
        short.var_shoot[2] = Some(vec![1.0]);
        assert!(text(&short).is_err());
    }
}
