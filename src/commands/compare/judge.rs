//! The ranking of methods by the time they take.

use super::contender::Convergence;
use super::measure::ContenderResult;

/// The rms relative errors for which methods are ranked.
pub(super) const LEVELS: [f64; 5] = [0.3, 0.1, 0.03, 0.01, 0.003];

/// The points of one method, sorted by rays.
pub(super) struct MethodCurve<'a> {
    /// The name of the method.
    pub method: &'a str,
    /// The points, of which there is at least one.
    pub points: Vec<&'a ContenderResult>,
}

/// The curves of some points, in the order of each curve's first point.
pub(super) fn curves(points: &[ContenderResult]) -> Vec<MethodCurve<'_>> {
    let mut curves: Vec<MethodCurve<'_>> = Vec::new();
    for point in points {
        match curves.iter_mut().find(|curve| curve.method == point.method) {
            Some(curve) => curve.points.push(point),
            None => curves.push(MethodCurve { method: &point.method, points: vec![point] }),
        }
    }
    curves.iter_mut().for_each(|curve| curve.points.sort_by_key(|point| point.rays));
    curves
}

impl MethodCurve<'_> {
    /// The point with the most rays.
    pub(super) fn last(&self) -> &ContenderResult {
        self.points.last().expect("a curve has points")
    }

    /// The processor time that an rms relative error takes [s]; `None` if a bias keeps the method from it.
    pub(super) fn time_to(&self, rms: f64) -> Option<f64> {
        self.cost_to(rms, |point| point.seconds)
    }

    /// The number of paths of a job that an rms relative error takes.
    pub(super) fn paths_to(&self, rms: f64) -> Option<u64> {
        Some(self.cost_to(rms, |point| point.paths as f64)?.round().max(1.0) as u64)
    }

    /// The cost of an rms relative error. For walks it follows from the merit of all their points. Other methods follow
    /// their points, and beyond these fall as walks do.
    fn cost_to(&self, rms: f64, cost: fn(&ContenderResult) -> f64) -> Option<f64> {
        let wanted = rms * rms;
        let as_walks = |point: &ContenderResult| cost(point) * point.squared_error / wanted;
        let last = self.last();
        if last.kind == Convergence::Walks {
            // Relative to the squared error itself, longer runs know it no better, so all points weigh alike.
            let costs = self.points.iter().map(|point| as_walks(point).ln());
            return Some((costs.sum::<f64>() / self.points.len() as f64).exp());
        }
        let within =
            |pair: &&[&ContenderResult]| (pair[1].squared_error..=pair[0].squared_error).contains(&wanted);
        if let Some([a, b]) = self.points.windows(2).find(within).map(|pair| [pair[0], pair[1]]) {
            let slope = (cost(b) / cost(a)).ln() / (b.squared_error / a.squared_error).ln();
            return Some(cost(a) * (slope * (wanted / a.squared_error).ln()).exp());
        }
        if wanted > self.points[0].squared_error {
            // Chains need a number of rays each: no run of them may be shorter than the first point.
            let first = self.points[0];
            return Some(if last.kind == Convergence::Chains { cost(first) } else { as_walks(first) });
        }
        (last.kind == Convergence::Chains).then(|| as_walks(last))
    }

    /// The uncertainty of such a time as a factor, by the standard errors of the squared errors.
    fn doubt(&self) -> f64 {
        let doubts = self.points.iter().map(|p| p.squared_error_error / p.squared_error);
        1.0 + 2.0 * doubts.fold(0.0, f64::max) / (self.points.len() as f64).sqrt()
    }
}

/// Whether no other point is both faster and more accurate.
pub(super) fn is_pareto(point: &ContenderResult, points: &[ContenderResult]) -> bool {
    let beats = |other: &&ContenderResult| {
        other.seconds <= point.seconds && other.squared_error <= point.squared_error && **other != *point
    };
    !points.iter().any(|other| beats(&other))
}

/// The points that no other beats, the fastest first.
pub(super) fn front(points: &[ContenderResult]) -> Vec<&ContenderResult> {
    let mut front: Vec<&ContenderResult> = points.iter().filter(|point| is_pareto(point, points)).collect();
    front.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
    front
}

/// The ranking of methods for one error.
pub(super) struct Advice<'a> {
    /// The rms relative error that is asked for.
    pub rms: f64,
    /// The methods by the time that they take [s], the best first.
    pub ranking: Vec<(&'a MethodCurve<'a>, f64)>,
    /// The number of methods that the measurement cannot tell from the best.
    pub alike: usize,
}

/// Ranks the curves for every error of [`LEVELS`].
pub(super) fn advice<'a>(curves: &'a [MethodCurve<'a>]) -> Vec<Advice<'a>> {
    LEVELS.into_iter().map(|rms| advise(curves, rms)).collect()
}

fn advise<'a>(curves: &'a [MethodCurve<'a>], rms: f64) -> Advice<'a> {
    let mut ranking: Vec<(&MethodCurve<'a>, f64)> =
        curves.iter().filter_map(|curve| Some((curve, curve.time_to(rms)?))).collect();
    ranking.sort_by(|a, b| a.1.total_cmp(&b.1));
    let (best, least) = (ranking[0].0.doubt(), ranking[0].1);
    let alike = ranking.iter().take_while(|(curve, time)| *time < least * best * curve.doubt()).count();
    Advice { rms, ranking, alike }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(
        method: &str,
        kind: Convergence,
        rays: u64,
        seconds: f64,
        squared_error: f64,
    ) -> ContenderResult {
        ContenderResult {
            build: String::new(),
            job: "cube".into(),
            key: String::new(),
            method: method.into(),
            rays,
            runs: 8,
            kind,
            paths: rays,
            traced: rays,
            seconds,
            squared_error,
            squared_error_error: 0.01 * squared_error,
            worst: 0.0,
            p99: 0.0,
            memory: None,
            traffic: 0,
        }
    }

    fn points() -> Vec<ContenderResult> {
        vec![
            point("walks", Convergence::Walks, 1, 1.0, 1e-2),
            point("walks", Convergence::Walks, 10, 10.0, 1e-3),
            point("chains", Convergence::Chains, 1, 2.0, 1e-2),
            point("chains", Convergence::Chains, 10, 20.0, 1e-4),
            point("cut", Convergence::Biased, 1, 0.5, 1e-2),
            point("cut", Convergence::Biased, 10, 5.0, 5e-3),
        ]
    }

    #[test]
    fn times_follow_the_points() {
        let points = points();
        let curves = curves(&points);
        let times = |rms: f64| curves.iter().map(|curve| curve.time_to(rms)).collect::<Vec<_>>();
        let close = |a: Option<f64>, b: f64| (a.unwrap() / b - 1.0).abs() < 1e-12;
        // For walks, time·error² = 0.01. For chains, a tenth of the time costs a hundred times the squared error.
        let at = times(1e-3f64.sqrt());
        assert!(close(at[0], 10.0) && close(at[1], 2.0 * 10f64.sqrt()) && at[2].is_none(), "{at:?}");
        let beyond = times(1e-5f64.sqrt());
        assert!(close(beyond[0], 1000.0) && close(beyond[1], 200.0) && beyond[2].is_none(), "{beyond:?}");
        assert!(close(times(0.2)[2], 0.125));
        // A run of the first curve has one path.
        assert_eq!((curves[0].paths_to(0.1), curves[1].paths_to(1e-2)), (Some(1), Some(10)));
        assert!(close(times(0.3)[1], 2.0), "chains have a shortest length");
    }

    #[test]
    fn the_best_depends_on_the_error() {
        let points = points();
        let curves = curves(&points);
        assert_eq!(advise(&curves, 0.3).ranking[0].0.method, "cut");
        let fine = advise(&curves, 0.01);
        assert_eq!((fine.ranking[0].0.method, fine.ranking.len(), fine.alike), ("chains", 2, 1));
        let pareto: Vec<bool> = points.iter().map(|point| is_pareto(point, &points)).collect();
        assert_eq!(pareto, [false, true, false, true, true, true]);
        let front: Vec<f64> = front(&points).iter().map(|point| point.seconds).collect();
        assert_eq!(front, [0.5, 5.0, 10.0, 20.0]);
    }
}
