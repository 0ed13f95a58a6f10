//! The series of charts.

use report::{ChartPoint, Series};
use stats::Measured;

/// A point of a chart, with its error bar.
pub(crate) fn point(x: f64, y: Measured) -> ChartPoint {
    ChartPoint { x, y: y.value, error: y.standard_error }
}

/// The theory and the measurements along a sweep.
#[derive(Clone, Debug, Default)]
pub(crate) struct SweepCurve {
    line: Vec<(f64, f64)>,
    marks: Vec<(f64, Measured)>,
}

impl SweepCurve {
    /// A curve without any points.
    pub(crate) const fn new() -> Self {
        SweepCurve { line: Vec::new(), marks: Vec::new() }
    }

    /// Adds a point of the sweep: the prediction there, and the measurement.
    pub(crate) fn push(&mut self, x: f64, predicted: f64, seen: Measured) {
        self.line.push((x, predicted));
        self.marks.push((x, seen));
    }

    /// The measurement at a point.
    ///
    /// # Panics
    /// If the sweep has no such point.
    pub(crate) fn seen_at(&self, point: usize) -> Measured {
        self.marks[point].1
    }

    /// The measurement at the end of the sweep.
    ///
    /// # Panics
    /// If the sweep has no point.
    pub(crate) fn last(&self) -> Measured {
        self.marks.last().expect("a sweep has points").1
    }

    /// The prediction at the end of the sweep.
    ///
    /// # Panics
    /// If the sweep has no point.
    pub(crate) fn last_predicted(&self) -> f64 {
        self.line.last().expect("a sweep has points").1
    }

    /// The measurements with their places in the sweep.
    pub(crate) fn marks(&self) -> &[(f64, Measured)] {
        &self.marks
    }

    /// The two series of a chart.
    pub(crate) fn series(self, theory_says: &str, is_seen: &str) -> [Series; 2] {
        [Series::theory(theory_says, self.line), Series::measured(is_seen, self.marks)]
    }
}
