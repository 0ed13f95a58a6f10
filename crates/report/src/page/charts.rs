//! The charts of the page: the error over the run, and over the area.

use radiosity::Estimates;

use crate::chart::{Axis, Chart, ChartPoint, Series, Style};
use crate::summary::TargetReport;

/// Points of the curve of errors over the area.
const PROFILE_POINTS: usize = 200;

/// A walk count at which the error was looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Milestone {
    /// N, the number of paths.
    pub paths: f64,
    /// The relative half-width that half of the area keeps within.
    pub median_relative_error: f64,
    /// The largest relative half-width.
    pub max_relative_error: f64,
}

/// The errors at the looks, and the law 1/√N from the last one.
pub(super) fn convergence(milestones: &[Milestone], target: Option<&TargetReport>) -> Option<Chart> {
    let known = |error: fn(&Milestone) -> f64| -> Vec<ChartPoint> {
        let points = milestones.iter().map(|at| ChartPoint { x: at.paths, y: 100.0 * error(at), error: 0.0 });
        points.filter(|point| point.y.is_finite() && point.y > 0.0).collect()
    };
    let half = known(|at| at.median_relative_error);
    let (first, last) = (*half.first()?, *half.last()?);
    if half.len() < 2 {
        return None;
    }
    let law = [first.x, last.x].map(|x| ChartPoint { x, y: last.y * (last.x / x).sqrt(), error: 0.0 });
    let mut series = vec![
        Series { name: "median by area".into(), style: Style::Joined, points: half },
        Series {
            name: "the worst patch".into(),
            style: Style::Joined,
            points: known(|at| at.max_relative_error),
        },
        Series { name: "1/√paths through the last look".into(), style: Style::Line, points: law.into() },
    ];
    if let Some(target) = target {
        let points =
            [first.x, last.x].map(|x| ChartPoint { x, y: 100.0 * target.relative_error, error: 0.0 });
        series.push(Series { name: "target".into(), style: Style::Line, points: points.into() });
    }
    series.retain(|series| !series.points.is_empty());
    Some(Chart {
        title: "Error over the run".into(),
        x: Axis::log("paths"),
        y: Axis::log("half-width over estimate [%]"),
        series,
    })
}

/// The error over the parts of the area that keep within it.
pub(super) fn profile(estimates: &Estimates) -> Option<Chart> {
    let mut errors: Vec<(f64, f64)> = Vec::new();
    for (_, face, known) in estimates.iter() {
        let Some(known) = known.filter(|_| !face.emittance.is_lit()) else { continue };
        let error = known.iter().map(|estimate| estimate.relative_error()).fold(0.0, f64::max);
        if error.is_finite() && error > 0.0 {
            errors.push((error, face.area));
        }
    }
    errors.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = errors.iter().map(|&(_, area)| area).sum();
    let mut below = 0.0;
    let mut points: Vec<ChartPoint> = Vec::new();
    for (error, area) in errors {
        below += area;
        let x = 100.0 * below / total;
        if points.last().is_none_or(|last| x - last.x >= 100.0 / PROFILE_POINTS as f64) {
            points.push(ChartPoint { x, y: 100.0 * error, error: 0.0 });
        }
    }
    (points.len() > 1).then(|| Chart {
        title: "Error over the area".into(),
        x: Axis::linear("part of the area that is known at least as well [%]"),
        y: Axis::log("half-width over estimate [%]"),
        series: vec![Series { name: "patches that do not emit".into(), style: Style::Line, points }],
    })
}
