//! Infinite walks that are cut off.

use exact::Exact;
use radiosity::{Estimator, EstimatorKind, InfiniteEnd, Method, SceneSpec};
use report::{Axis, Chart};
use stats::Measured;

use super::absorption;
use crate::atlas::entry::{Entry, Finding};
use crate::claim::Claim;
use crate::lab::Lab;
use crate::numbers::{measured, number};
use crate::series::{seen, theory};
use crate::told::run;
use crate::walking::{Failure, estimate, experiment, receivers, solve};

pub const ENTRY: Entry = Entry {
    name: "cut-off",
    title: "Infinite walks that are cut off lose light, whatever their intervals say",
    study,
};

const REFLECTANCE: f64 = 0.8;

fn scene() -> SceneSpec {
    absorption::scene(REFLECTANCE)
}

fn method(infinite: InfiniteEnd) -> Method {
    Method::shooting(Estimator::Infinite(infinite))
}

/// The part of the reflected radiosity of all receivers that comes after so many hits: Neumann's series, cut.
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

/// What runs miss of the receivers' light, and the least bound that any patch was given, as parts of it.
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

fn study(lab: &Lab) -> Result<Finding, Failure> {
    let exact = Exact::of_scene(&scene())?;
    let patches = receivers(&experiment(&scene(), Method::shooting(EstimatorKind::Collision))?);
    let lengths = lab.pick(vec![2, 8], vec![1, 2, 4, 8, 12, 16, 24, 32]);
    let (runs, walks) = lab.pick((20, 10_000), (100, 30_000));
    let (mut line, mut cut, mut short, mut bounds) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut claims = Vec::new();
    for &length in &lengths {
        let predicted = lost(&exact, &patches, length);
        let (part, bound) = missing(lab, runs, walks, InfiniteEnd::Length { length }, &exact)?;
        claims.push(Claim::equal(format!("light lost after {length} hits"), part, predicted));
        claims.push(Claim::sure(
            format!("the bound after {length} hits, {}, is above it", number(bound)),
            bound >= predicted,
        ));
        // Every wall reflects alike: the weight falls below this threshold with that hit.
        let threshold = REFLECTANCE.powi(length as i32) * 1.001;
        let (by_weight, _) = missing(lab, runs, walks, InfiniteEnd::Cutoff { threshold }, &exact)?;
        claims.push(Claim::equal(
            format!("light lost below a weight of {}", number(threshold)),
            by_weight,
            predicted,
        ));
        line.push((f64::from(length), predicted));
        cut.push((f64::from(length), part));
        short.push((f64::from(length), by_weight));
        bounds.push((f64::from(length), bound));
    }
    let biased = experiment(&scene(), method(InfiniteEnd::Length { length: 2 }))?;
    let biased_run = run(&biased, 1, walks, None);
    let flags = biased_run.flags(&biased, 20);
    let mut told = biased_run.told();
    told.push(format!("flags of patch 20 in patches.csv: `{flags}`"));
    claims.push(Claim::told(&told, "walks were cut off"));
    claims.push(Claim::sure("the patch is flagged `bias`", flags.split('|').any(|flag| flag == "bias")));
    let (roulette, _) = missing(lab, runs, walks, InfiniteEnd::default(), &exact)?;
    claims.push(Claim::equal("light lost under roulette", roulette, 0.0).instead());
    Ok(Finding {
        predicted: format!(
            "A walk that is cut after L hits keeps the first L terms of Neumann's series: what is lost is the rest, \
             R^L and a little, bounded by the power that was not distributed. In the 54-patch cube, R = \
             {REFLECTANCE} everywhere, exact form factors give {} of the reflected light after 2 hits.",
            number(lost(&exact, &patches, 2))
        ),
        seen: format!(
            "After {} hits the runs miss {} of it; a weight threshold that is crossed there, {}. No interval knows: \
             their standard errors fall with the walks, the bias stays. `bias_bound` is above it everywhere.",
            lengths[0],
            measured(cut[0].1),
            measured(short[0].1)
        ),
        told,
        instead: format!(
            "infinite = {{ end = \"roulette\" }}, the default, has no bias: the runs miss {} of the light.",
            measured(roulette)
        ),
        claims,
        chart: Chart {
            title: format!("Light that walks lose when they are cut off, R = {REFLECTANCE}"),
            x: Axis::linear("hits before the cut"),
            y: Axis::log("part of the reflected light that is lost"),
            series: vec![
                theory("rest of Neumann's series", line),
                theory("bias_bound, as reported", bounds),
                seen("end = \"length\", seen", cut),
                seen("end = \"cutoff\", seen", short),
            ],
        },
    })
}
