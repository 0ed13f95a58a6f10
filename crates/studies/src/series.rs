//! Series of charts.

use report::{Point, Series, Style};
use stats::Measured;

/// What theory says along a sweep.
pub fn theory(name: &str, points: impl IntoIterator<Item = (f64, f64)>) -> Series {
    let points = points.into_iter().map(|(x, y)| Point { x, y, error: 0.0 }).collect();
    Series { name: name.into(), style: Style::Line, points }
}

/// What is seen along a sweep.
pub fn seen(name: &str, points: impl IntoIterator<Item = (f64, Measured)>) -> Series {
    let points = points.into_iter().map(|(x, y)| point(x, y)).collect();
    Series { name: name.into(), style: Style::Joined, points }
}

/// A point of a chart, with its error bar.
pub fn point(x: f64, y: Measured) -> Point {
    Point { x, y: y.value, error: y.standard_error }
}
