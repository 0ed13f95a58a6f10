//! Entry of the atlas: one walk, and no hits.

use exact::Exact;
use radiosity::{EstimatorKind, Experiment, Method};
use report::{Axis, Chart, Series};
use stats::Measured;

use crate::arithmetic::proportion;
use crate::atlas::entry::{Entry, StudyFinding};
use crate::claim::Claim;
use crate::judged_run::run;
use crate::lab::Lab;
use crate::walking::{Failure, covered, estimate, experiment, receivers, solve};
use report::words::measured;

pub(crate) const ENTRY: Entry =
    Entry { name: "few-walks", title: "One walk, and patches without a hit", study };

/// The sweep over numbers of walks.
struct FewWalksSweep {
    walks: Vec<u64>,
    /// The parts of the patches that the usual intervals and radwalk's cover, and that no walk has hit.
    naive: Vec<(f64, Measured)>,
    ours: Vec<(f64, Measured)>,
    unhit: Vec<(f64, Measured)>,
    claims: Vec<Claim>,
}

impl FewWalksSweep {
    fn drive(lab: &Lab, experiment: &Experiment, patches: &[usize]) -> Result<Self, Failure> {
        let truth = Exact::of_scene(&scenes::cube(3))?.solution().radiosity.clone();
        let all = lab.pick(vec![1, 10, 100], vec![1, 2, 4, 10, 30, 100, 300, 1000, 3000]);
        let runs = lab.pick(400, 4000);
        let (naive, ours, unhit, claims) = Default::default();
        let mut sweep = FewWalksSweep { walks: all.clone(), naive, ours, unhit, claims };
        for walks in all {
            let found = lab.each_seed(runs, |seed| {
                let solution = solve(experiment, seed, walks);
                let normal = |&&i: &&usize| {
                    let estimate = estimate(&solution, i);
                    (estimate.radiosity - truth[i]).abs() <= 1.96 * estimate.std_error.unwrap_or(0.0)
                };
                let part = |n: usize| n as f64 / patches.len() as f64;
                let none = patches.iter().filter(|&&i| estimate(&solution, i).hits == 0).count();
                let normal = patches.iter().filter(normal).count();
                (part(normal), covered(&solution, patches, &truth), part(none))
            });
            let of =
                |pick: fn(&(f64, f64, f64)) -> f64| proportion(&found.iter().map(pick).collect::<Vec<_>>());
            let at = walks as f64;
            sweep.naive.push((at, of(|f| f.0)));
            sweep.ours.push((at, of(|f| f.1)));
            sweep.unhit.push((at, of(|f| f.2)));
            sweep.claims.push(Claim::at_least(format!("{walks} walks: coverage"), of(|f| f.1), 0.95));
        }
        let what = "coverage of ± 1.96 standard errors after one walk";
        sweep.claims.push(Claim::below(what, sweep.naive[0].1, 0.5));
        Ok(sweep)
    }

    fn chart(self) -> Chart {
        Chart {
            title: "The 54-patch cube after few walks".into(),
            x: Axis::log("walks"),
            y: Axis::linear("part of the patches"),
            series: vec![
                Series::measured("covered by ± 1.96 standard errors", self.naive),
                Series::measured("covered by radwalk's 95 % intervals", self.ours),
                Series::measured("without a hit", self.unhit),
                Series::theory("95 %", self.walks.iter().map(|&walks| (walks as f64, 0.95))),
            ],
        }
    }
}

fn study(lab: &Lab) -> Result<StudyFinding, Failure> {
    let experiment = experiment(&scenes::cube(3), Method::shooting(EstimatorKind::Collision))?;
    let patches = receivers(&experiment);
    let sweep = FewWalksSweep::drive(lab, &experiment, &patches)?;
    let mut claims = sweep.claims.clone();
    let one = solve(&experiment, 1, 1);
    let silent = patches.iter().all(|&i| estimate(&one, i).std_error.is_none());
    claims.push(Claim::sure("one walk has no standard error", silent));
    let open = patches.iter().all(|&i| estimate(&one, i).ci_high > estimate(&one, i).ci_low);
    claims.push(Claim::sure("no interval is a point", open));
    let messages = run(&experiment, 1, 1, None).messages();
    for word in ["`unhit`", "`rare`"] {
        claims.push(Claim::messages(&messages, word));
    }
    let after = run(&experiment, 1, 200_000, None).messages();
    claims.push(Claim::sure("after 200,000 walks no check fails", after.is_empty()).instead());
    let last = sweep.walks.len() - 1;
    Ok(StudyFinding {
        predicted: "After one walk nothing is known of the variance. A patch that no walk has hit has B̂ = E and a \
                    sample variance of 0: ± 1.96 standard errors is a point there. Without a hit in n walks, scores \
                    of bounded E[x²]/E[x] still give an upper bound (Cauchy & Schwarz), with one or two a Poisson \
                    one (Garwood), widened."
            .into(),
        seen: format!(
            "After one walk {} of the patches are unhit; ± 1.96 standard errors cover {}, radwalk's intervals {}. \
             After {} walks they cover {} and {}.",
            measured(sweep.unhit[0].1),
            measured(sweep.naive[0].1),
            measured(sweep.ours[0].1),
            sweep.walks[last],
            measured(sweep.naive[last].1),
            measured(sweep.ours[last].1)
        ),
        messages,
        instead: "Walk on, with `--resume --paths 200000`: then every check passes. Until then trust intervals, which are true from \
                  the first walk on."
            .into(),
        claims,
        chart: sweep.chart(),
    })
}
