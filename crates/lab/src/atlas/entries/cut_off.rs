//! Entry of the atlas: infinite walks that are cut off.

use exact::Exact;
use radiosity::{Estimator, EstimatorKind, Method, SceneSpec, methods::InfiniteEnd};
use report::{Axis, Chart, Series};
use stats::Measured;

use super::absorption;
use crate::atlas::entry::{Entry, StudyFinding};
use crate::claim::Claim;
use crate::judged_run::run;
use crate::lab::Lab;
use crate::series::SweepCurve;
use crate::walking::{Failure, estimate, experiment, receivers, solve};
use report::words::{measured, number};

pub(crate) const ENTRY: Entry = Entry {
    name: "cut-off",
    title: "Infinite walks that are cut off: lost light that no estimate includes",
    study,
};

const REFLECTANCE: f64 = 0.8;

fn scene() -> SceneSpec {
    absorption::scene(REFLECTANCE)
}

fn method(infinite: InfiniteEnd) -> Method {
    Method::shooting(Estimator::Infinite(infinite))
}

/// The part of the reflected radiosity of all receivers that comes after `hits` hits, by Neumann's series.
fn lost(exact: &Exact, patches: &[usize], hits: u32) -> f64 {
    let exchange = exact.exchange();
    let mut radiosity = exact.emittance().to_vec();
    let mut kept = vec![0.0; radiosity.len()];
    for _ in 0..hits {
        let incoming = exchange.incoming(&radiosity);
        let reflected = incoming.iter().zip(exchange.areas()).zip(exact.reflectance());
        radiosity = reflected.map(|((phi, area), r)| r * phi / area).collect();
        kept.iter_mut().zip(&radiosity).for_each(|(kept, b)| *kept += b);
    }
    let all: f64 = patches.iter().map(|&i| exact.solution().reflected[i]).sum();
    1.0 - patches.iter().map(|&i| kept[i]).sum::<f64>() / all
}

/// The part of the receivers' light that runs miss, and the least bound that any patch was given as a part of its
/// light.
fn missing(
    lab: &Lab,
    runs: u64,
    walks: u64,
    end: InfiniteEnd,
    exact: &Exact,
) -> Result<(Measured, f64), Failure> {
    let experiment = experiment(&scene(), method(end))?;
    let patches = receivers(&experiment);
    let truth = &exact.solution().radiosity;
    let all: f64 = patches.iter().map(|&i| truth[i]).sum();
    let found = lab.each_seed(runs, |seed| {
        let solution = solve(&experiment, seed, walks);
        let of = |i: &usize| estimate(&solution, *i);
        let sum: f64 = patches.iter().map(|i| of(i).radiosity).sum();
        let bound: f64 = patches.iter().map(|i| of(i).bias_bound).sum();
        (1.0 - sum / all, bound / all)
    });
    let bound = found.iter().map(|&(_, bound)| bound).fold(f64::INFINITY, f64::min);
    Ok((Measured::of(&found.iter().map(|&(part, _)| part).collect::<Vec<_>>()), bound))
}

/// The sweep over the hits before a walk is cut.
struct CutOffSweep {
    /// The numbers of hits, the runs, and the walks of each.
    lengths: Vec<u32>,
    runs: u64,
    walks: u64,
    /// The parts of the light that are lost if a walk is cut after some hits, and if it is cut below the weight that it
    /// then has.
    cut: SweepCurve,
    short: Vec<(f64, Measured)>,
    /// The parts that the program's bounds allow to be lost.
    bounds: Vec<(f64, f64)>,
    claims: Vec<Claim>,
}

impl CutOffSweep {
    fn drive(lab: &Lab, exact: &Exact, patches: &[usize]) -> Result<Self, Failure> {
        let lengths = lab.pick(vec![2, 8], vec![1, 2, 4, 8, 12, 16, 24, 32]);
        let (runs, walks) = lab.pick((20, 10_000), (100, 30_000));
        let (cut, short, bounds, claims) = Default::default();
        let mut sweep = CutOffSweep { lengths, runs, walks, cut, short, bounds, claims };
        for length in sweep.lengths.clone() {
            let (at, predicted) = (f64::from(length), lost(exact, patches, length));
            let (part, bound) = missing(lab, runs, walks, InfiniteEnd::Length { length }, exact)?;
            sweep.claims.push(Claim::equal(format!("light lost after {length} hits"), part, predicted));
            let what = format!("the bound after {length} hits, {}, is above it", number(bound));
            sweep.claims.push(Claim::sure(what, bound >= predicted));
            // Every wall reflects alike: the weight falls below this threshold with that hit.
            let threshold = REFLECTANCE.powi(length as i32) * 1.001;
            let (by_weight, _) = missing(lab, runs, walks, InfiniteEnd::Cutoff { threshold }, exact)?;
            let what = format!("light lost below a weight of {}", number(threshold));
            sweep.claims.push(Claim::equal(what, by_weight, predicted));
            sweep.cut.push(at, predicted, part);
            sweep.short.push((at, by_weight));
            sweep.bounds.push((at, bound));
        }
        Ok(sweep)
    }

    fn chart(self) -> Chart {
        let [line, cut] = self.cut.series("rest of Neumann's series", "end = \"length\", seen");
        Chart {
            title: format!("Light that walks lose when they are cut off, R = {REFLECTANCE}"),
            x: Axis::linear("hits before the cut"),
            y: Axis::log("part of the reflected light that is lost"),
            series: vec![
                line,
                Series::theory("bias_bound, as reported", self.bounds),
                cut,
                Series::measured("end = \"cutoff\", seen", self.short),
            ],
        }
    }
}

fn study(lab: &Lab) -> Result<StudyFinding, Failure> {
    let exact = Exact::of_scene(&scene())?;
    let patches = receivers(&experiment(&scene(), Method::shooting(EstimatorKind::Collision))?);
    let sweep = CutOffSweep::drive(lab, &exact, &patches)?;
    let mut claims = sweep.claims.clone();
    let biased = experiment(&scene(), method(InfiniteEnd::Length { length: 2 }))?;
    let biased_run = run(&biased, 1, sweep.walks, None);
    let flags = biased_run.flags(&biased, 20);
    let mut messages = biased_run.messages();
    messages.push(format!("flags of patch 20 in patches.csv: `{flags}`"));
    claims.push(Claim::messages(&messages, "walks were cut off"));
    claims.push(Claim::sure("the patch is flagged `bias`", flags.split('|').any(|flag| flag == "bias")));
    let (roulette, _) = missing(lab, sweep.runs, sweep.walks, InfiniteEnd::default(), &exact)?;
    claims.push(Claim::equal("light lost under roulette", roulette, 0.0).instead());
    Ok(StudyFinding {
        predicted: format!(
            "A walk that is cut after L hits keeps the first L terms of Neumann's series: what is lost is the rest, \
             R^L and a little, bounded by the power that was not distributed. In the 54-patch cube, R = \
             {REFLECTANCE} everywhere, exact form factors give {} of the reflected light after 2 hits.",
            number(lost(&exact, &patches, 2))
        ),
        seen: format!(
            "After {} hits the runs miss {} of it; a weight threshold that is crossed there, {}. No standard error knows: \
             they fall with the walks, the bias stays. `bias_bound` is above it everywhere.",
            sweep.lengths[0],
            measured(sweep.cut.seen_at(0)),
            measured(sweep.short[0].1)
        ),
        messages,
        instead: format!(
            "infinite = {{ end = \"roulette\" }}, the default, has no bias: the runs miss {} of the light.",
            measured(roulette)
        ),
        claims,
        chart: sweep.chart(),
    })
}
