//! What S97 §5 leaves open: the efficiency of all estimators, the biased ones with their squared bias.

use exact::{ESTIMATORS, Exact, RadiositySystem};
use radiosity::{
    Chains, Direction, Estimator, EstimatorKind, Experiment, Method, SceneSpec, Tally, Walks,
    methods::{InfiniteEnd, Iterations, RayBirths, Solve},
};
use report::{Axis, Chart, Series, Style};
use stats::Measured;

use crate::arithmetic::quotient;
use crate::claim::{Claim, ClaimBound};
use crate::lab::Lab;
use crate::papers::Chapter;
use crate::papers::findings::{Drawing, Findings};
use crate::papers::walkers::{DIRECTIONS, experiment, mean_by_area, method, name, predicted};
use crate::series::point;
use crate::walking::TallyReader;
use report::words::number;

/// The chapter of S97 §5, "to study the efficiency of biased estimators".
pub(crate) const CHAPTER: Chapter = Chapter {
    name: "efficiency",
    title: "S97 §5: the efficiency of all estimators, biased ones included",
    run,
};

/// A way to spend rays.
struct RayStrategy {
    name: String,
    method: Method,
    /// The walks of the way, if their variance has a closed form.
    known: Option<Walks>,
}

/// The result of a way in a scene.
struct Entrant {
    name: String,
    biased: bool,
    /// The mean squared error × rays, by area [W²/m⁴].
    error: Measured,
    /// The mean squared error × rays by the closed form.
    theory: Option<f64>,
    /// The part of the squared bias in it.
    squared_bias: Measured,
}

/// A scene with the results of all ways in it, collision shooting first.
struct Contest {
    scene: &'static str,
    results: Vec<Entrant>,
}

fn run(lab: &Lab) -> Findings {
    let rays = lab.pick(10_000, 50_000);
    let runs = lab.pick(100, 200);
    let scenes = [
        ("54-patch cube", scenes::cube(3)),
        ("corridor 1 × 1 × 4", scenes::corridor(4)),
        ("six-patch cube, R = 0.9", scenes::furnace(1, 0.9)),
    ];
    let contests: Vec<Contest> =
        scenes.iter().map(|(scene, spec)| contest(lab, scene, spec, [rays, runs])).collect();
    let mut rows: Vec<Claim> = contests.iter().flat_map(rows_of).collect();
    rows.extend(lost_by_length(lab, &scenes[0].1, runs as usize));
    Findings {
        published: "\"Our future work will be to study the efficiency of biased estimators\" (S97 §5); \"a study of the \
                    relative efficiencies of both kinds of estimators remains to be done\" (SInf §6). No numbers."
            .into(),
        experiment: format!(
            "{runs} runs of about {rays} rays of every way, errors against the exact solution, squares averaged by area. \
             *Efficiency*: 1/(mean squared error × rays), over that of collision shooting; of biased ways the error \
             contains the squared bias, which rays do not diminish, so that their efficiency holds for this many rays \
             only. Theory: closed forms and mean lengths of walks from another solve."
        ),
        rows,
        remarks: vec![table(&contests), winners(&contests, rays)],
        figures: vec![figure(lab, &scenes[0].1)],
    }
}

/// All ways: the eight walks, infinite walks that are cut off, and chains.
fn ways(rays: u64, patches: u64) -> Vec<RayStrategy> {
    let walks = DIRECTIONS.iter().flat_map(|direction| ESTIMATORS.map(|estimator| (direction, estimator)));
    let mut ways: Vec<RayStrategy> = walks
        .map(|(direction, estimator)| RayStrategy {
            name: name(direction, estimator),
            method: method(direction.clone(), estimator).into(),
            known: Some(method(direction.clone(), estimator)),
        })
        .collect();
    // The others are compared with collision shooting.
    ways.sort_by_key(|way| way.name != "shooting, collision");
    let ends = [
        ("weight < 0.1", InfiniteEnd::Cutoff { threshold: 0.1 }),
        ("weight < 0.01", InfiniteEnd::Cutoff { threshold: 0.01 }),
        ("4 hits", InfiniteEnd::Length { length: 4 }),
    ];
    for (direction, (word, end)) in DIRECTIONS.iter().flat_map(|d| ends.map(|end| (d, end))) {
        ways.push(RayStrategy {
            name: format!("{} cut at {word}", name(direction, EstimatorKind::Infinite)),
            method: method(direction.clone(), Estimator::Infinite(end)).into(),
            known: None,
        });
    }
    let solves = [
        ("Jacobi iterations, multinomial births", iterations(RayBirths::Multinomial)),
        ("Jacobi iterations, systematic births", iterations(RayBirths::Systematic)),
        ("Jacobi, links solved", Solve::Links),
    ];
    // Links need 16 rays per patch.
    let chains = solves.into_iter().filter(|(_, solve)| *solve != Solve::Links || rays >= 16 * patches);
    ways.extend(chains.map(|(word, solve)| RayStrategy {
        name: word.into(),
        method: Chains { rays, linear: false, solve, final_gather: Vec::new() }.into(),
        known: None,
    }));
    ways
}

fn iterations(births: RayBirths) -> Solve {
    Solve::Iterations(Iterations { births, ..Iterations::default() })
}

fn contest(lab: &Lab, scene: &'static str, spec: &SceneSpec, [rays, runs]: [u64; 2]) -> Contest {
    let exact = Exact::of_scene(spec).expect("a closed box");
    let ways = ways(rays, exact.face_count() as u64).into_iter().zip(801..);
    let results = ways.map(|(way, seed)| result(lab, spec, &exact, way, seed, [rays, runs])).collect();
    Contest { scene, results }
}

fn result(
    lab: &Lab,
    spec: &SceneSpec,
    exact: &Exact,
    way: RayStrategy,
    seed: u64,
    [rays, runs]: [u64; 2],
) -> Entrant {
    let experiment = experiment(spec, way.method.clone());
    let (walks, rays_per_walk) = length(lab, &experiment, exact, rays);
    let (errors, mean) = errors(lab, &experiment, exact, seed, runs as usize, walks);
    let per_run = walks as f64 * rays_per_walk;
    let squares: Vec<f64> =
        errors.iter().map(|run| per_run * mean_by_area(exact, run.iter().map(|e| e * e))).collect();
    let error = Measured::of(&squares);
    // The square of the mean over runs contains a part of their variance.
    let of_mean = per_run * mean_by_area(exact, mean.iter().map(|e| e * e));
    let part = 1.0 / runs as f64;
    let squared_bias = (of_mean - part * error.value) / (1.0 - part);
    let theory = way
        .known
        .map(|walks| rays_per_walk * mean_by_area(exact, predicted(exact, experiment.scene(), &walks)));
    Entrant {
        biased: experiment.is_biased(),
        name: way.name,
        error,
        theory,
        squared_bias: Measured { value: squared_bias.max(0.0), standard_error: 0.0 },
    }
}

/// The walks of a run of `rays` rays, and the rays of a walk: for analog walks by theory, for others by a sample.
fn length(lab: &Lab, experiment: &Experiment, exact: &Exact, rays: u64) -> (u64, f64) {
    if !experiment.unit().is_walk() {
        return (1, rays as f64);
    }
    let method = experiment.method();
    let rays_per_walk = match (method.estimator_kind(), method.direction()) {
        (Some(EstimatorKind::Infinite), _) | (_, None) => {
            let counts = lab.tally(experiment, 800, 100_000).counts;
            counts.rays as f64 / counts.walks as f64
        }
        (_, Some(direction)) => analog_length(exact, direction),
    };
    ((rays as f64 / rays_per_walk).round() as u64, rays_per_walk)
}

/// The mean number of rays of an analog walk. For shooting it is Σφ/Φ_T. For gathering from patch i it is
/// L_i = 1 + Σ_j F_ijR_jL_j, so that R_iL_i is the radiosity of a scene whose emittances are its reflectances.
fn analog_length(exact: &Exact, direction: &Direction) -> f64 {
    if *direction == Direction::Shooting {
        return exact.solution().incoming.iter().sum::<f64>() / exact.total_power();
    }
    let system: &RadiositySystem = exact.system();
    let lit = system.solve(exact.reflectance()).radiosity;
    mean_by_area(exact, lit.iter().zip(exact.reflectance()).map(|(b, r)| b / r))
}

/// The errors of b in every run, and those of their mean.
fn errors(
    lab: &Lab,
    experiment: &Experiment,
    exact: &Exact,
    seed: u64,
    runs: usize,
    walks: u64,
) -> (Vec<Vec<f64>>, Vec<f64>) {
    let (reader, truth) = (TallyReader::new(experiment), &exact.solution().reflected);
    let read =
        |tally: &Tally| reader.reflected(tally).iter().zip(truth).map(|(b, t)| b - t).collect::<Vec<f64>>();
    let errors = lab.runs(experiment, seed, runs, walks, read);
    let mean = (0..truth.len()).map(|i| errors.iter().map(|run| run[i]).sum::<f64>() / runs as f64).collect();
    (errors, mean)
}

/// The claims on efficiencies, held to theory if there is one.
fn rows_of(contest: &Contest) -> Vec<Claim> {
    let first = &contest.results[0];
    let row = |result: &Entrant| {
        let efficiency = quotient(first.error, result.error);
        let claim = match (first.theory, result.theory) {
            (Some(reference), Some(theory)) => ClaimBound::Is(reference / theory),
            _ => ClaimBound::Nothing,
        };
        Claim::of(format!("{}: efficiency of {}", contest.scene, result.name), efficiency, claim)
    };
    let theory = first.theory.expect("collision shooting has a closed form");
    let reference = format!("{}: error² × rays of {}", contest.scene, first.name);
    let mut rows = vec![Claim::of(reference, first.error, ClaimBound::Is(theory))];
    rows.extend(contest.results[1..].iter().map(row));
    rows
}

/// Claims that the bias of walks that are cut off after four hits is a Neumann series less its first four terms.
fn lost_by_length(lab: &Lab, spec: &SceneSpec, runs: usize) -> Vec<Claim> {
    let exact = Exact::of_scene(spec).expect("a closed box");
    let (r, exchange) = (exact.reflectance(), exact.exchange());
    let mut light = exact.emittance().to_vec();
    let mut reached = vec![0.0; light.len()];
    for _ in 0..4 {
        let gathered =
            |i: usize| (0..light.len()).map(|j| exchange.form_factor(i, j) * light[j]).sum::<f64>();
        light = (0..light.len()).map(|i| r[i] * gathered(i)).collect();
        reached.iter_mut().zip(&light).for_each(|(sum, b)| *sum += b);
    }
    let missing = mean_by_area(&exact, exact.solution().reflected.iter().zip(&reached).map(|(b, s)| b - s));
    let rows = DIRECTIONS.iter().zip(891..).map(|(direction, seed)| {
        let infinite = InfiniteEnd::Length { length: 4 };
        let method = method(direction.clone(), Estimator::Infinite(infinite));
        let (errors, _) = errors(lab, &experiment(spec, method), &exact, seed, runs, 5_000);
        let means: Vec<f64> = errors.iter().map(|run| -mean_by_area(&exact, run.iter().copied())).collect();
        let label = format!(
            "54-patch cube: mean of b that {} misses, cut at 4 hits [W/m²]",
            name(direction, EstimatorKind::Infinite)
        );
        Claim::of(label, Measured::of(&means), ClaimBound::Is(missing))
    });
    rows.collect()
}

/// The table of efficiencies, with ways down and scenes across; the squared bias is a part of the squared error.
fn table(contests: &[Contest]) -> String {
    let mut lines = vec![
        format!("| efficiency | {} |", contests.iter().map(|c| c.scene).collect::<Vec<_>>().join(" | ")),
        format!("|---|{}", "---|".repeat(contests.len())),
    ];
    for result in &contests[0].results {
        let cell = |contest: &Contest| {
            let Some(mine) = contest.results.iter().find(|r| r.name == result.name) else {
                return "–".into();
            };
            let efficiency = number(contest.results[0].error.value / mine.error.value);
            let bias = 100.0 * mine.squared_bias.value / mine.error.value;
            if mine.biased { format!("{efficiency} ({bias:.0} % bias²)") } else { efficiency }
        };
        let cells = contests.iter().map(cell).collect::<Vec<_>>().join(" | ");
        lines.push(format!("| {} | {cells} |", result.name));
    }
    lines.join("\n")
}

/// The sentence that names the best way in each scene.
fn winners(contests: &[Contest], rays: u64) -> String {
    let best = |contest: &Contest, among: &dyn Fn(&&Entrant) -> bool| {
        let best =
            contest.results.iter().filter(among).min_by(|a, b| a.error.value.total_cmp(&b.error.value));
        best.map_or("nothing".into(), |best| {
            let times = number(contest.results[0].error.value / best.error.value);
            format!("{} (× {times})", best.name)
        })
    };
    let sentences = contests.iter().map(|contest| {
        format!(
            "In the {} the best of all is {}; of walks {}; of unbiased walks {}.",
            contest.scene,
            best(contest, &|_| true),
            best(contest, &|r| !r.name.starts_with("Jacobi")),
            best(contest, &|r| !r.name.starts_with("Jacobi") && !r.biased)
        )
    });
    format!(
        "{} Gathering spends its rays on all patches one by one, and loses wherever light comes from few places. Cutting \
         off pays as long as the squared bias is small beside the variance, which at {rays} rays it may be and at 100 \
         times as many is not. Where B is the same everywhere, as in the six-patch cube, links solved are exact but for \
         rounding, whatever the rays.",
        sentences.collect::<Vec<_>>().join(" ")
    )
}

/// The chart of error against rays in one scene, where biased ways level off.
fn figure(lab: &Lab, spec: &SceneSpec) -> Drawing {
    let exact = Exact::of_scene(spec).expect("a closed box");
    let powers: &[u32] = lab.pick(&[10, 12, 14, 16], &[10, 12, 14, 16, 18, 20]);
    let wanted = [
        "shooting, collision",
        "shooting, infinite",
        "shooting, infinite cut at weight < 0.1",
        "gathering, collision",
        "Jacobi, links solved",
    ];
    let series = wanted.map(|wanted| {
        let points = powers.iter().filter_map(|power| {
            let rays = 1_u64 << power;
            let way = ways(rays, exact.face_count() as u64).into_iter().find(|way| way.name == wanted)?;
            let runs = lab.pick(10, 20);
            let result = result(lab, spec, &exact, way, 895, [rays, runs]);
            let rms = (result.error.value / rays as f64).sqrt();
            let error = 0.5 * rms * result.error.standard_error / result.error.value;
            Some(point(rays as f64, Measured { value: rms, standard_error: error }))
        });
        Series { name: wanted.into(), style: Style::Joined, points: points.collect() }
    });
    let chart = Chart {
        title: "54-patch cube: error against rays".into(),
        x: Axis::log("rays"),
        y: Axis::log("rms error of B [W/m²]"),
        series: series.into(),
    };
    Drawing::chart("efficiency.svg", "Error against rays: what is cut off levels off", &chart)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A walk has 1/(1 − R) rays if all reflectances are alike.
    #[test]
    fn walks_are_as_long_as_reflectances_allow() {
        let exact = Exact::of_scene(&scenes::furnace(2, 0.75)).unwrap();
        for direction in &DIRECTIONS {
            assert!((analog_length(&exact, direction) - 4.0).abs() < 1e-9);
        }
    }
}
