//! Series of charts.

use report::{Point, Series, Style};
use stats::Measured;

/// What theory says along a sweep.
pub(crate) fn theory(name: &str, points: impl IntoIterator<Item = (f64, f64)>) -> Series {
    let points = points.into_iter().map(|(x, y)| Point { x, y, error: 0.0 }).collect();
    Series { name: name.into(), style: Style::Line, points }
}

/// What is seen along a sweep.
pub(crate) fn seen(name: &str, points: impl IntoIterator<Item = (f64, Measured)>) -> Series {
    let points = points.into_iter().map(|(x, y)| point(x, y)).collect();
    Series { name: name.into(), style: Style::Joined, points }
}

/// A point of a chart, with its error bar.
pub(crate) fn point(x: f64, y: Measured) -> Point {
    Point { x, y: y.value, error: y.standard_error }
}

/// What theory says and what is seen along a sweep.
#[derive(Clone, Debug, Default)]
pub(crate) struct Curve {
    line: Vec<(f64, f64)>,
    marks: Vec<(f64, Measured)>,
}

impl Curve {
    /// Without a point yet.
    pub(crate) const fn new() -> Self {
        Curve { line: Vec::new(), marks: Vec::new() }
    }

    /// A point of the sweep: what theory says there, and what is seen.
    pub(crate) fn push(&mut self, x: f64, predicted: f64, seen: Measured) {
        self.line.push((x, predicted));
        self.marks.push((x, seen));
    }

    /// What is seen at a point.
    ///
    /// # Panics
    /// Where the sweep has no such point.
    pub(crate) fn seen_at(&self, point: usize) -> Measured {
        self.marks[point].1
    }

    /// What is seen at the end of the sweep.
    ///
    /// # Panics
    /// Where the sweep has no point.
    pub(crate) fn last(&self) -> Measured {
        self.marks.last().expect("a sweep has points").1
    }

    /// What theory says at the end of the sweep.
    ///
    /// # Panics
    /// Where the sweep has no point.
    pub(crate) fn last_predicted(&self) -> f64 {
        self.line.last().expect("a sweep has points").1
    }

    /// What is seen.
    pub(crate) fn marks(&self) -> &[(f64, Measured)] {
        &self.marks
    }

    /// Both lines of a chart.
    pub(crate) fn series(self, theory_says: &str, is_seen: &str) -> [Series; 2] {
        [theory(theory_says, self.line), seen(is_seen, self.marks)]
    }
}
