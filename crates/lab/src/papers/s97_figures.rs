//! S97 figs 2 and 3, SInf fig 1: the variance of every patch of the 54-patch cube under eight estimators.

use exact::{ESTIMATORS, Exact};
use radiosity::{
    Direction, EstimatorKind,
    methods::{AbsorptionMode, Event, InfiniteEnd},
};
use report::{Axis, Chart, Series, Style};
use stats::Measured;

use crate::arithmetic::{counted, quotient};
use crate::claim::{Claim, ClaimBound};
use crate::lab::Lab;
use crate::papers::Chapter;
use crate::papers::findings::{Drawing, Findings};
use crate::papers::walkers::{DIRECTIONS, experiment, method, name, predicted};
use crate::series::point;
use crate::walking::TallyReader;

/// The chapter of S97 figs 2, 3 and SInf fig 1.
pub(crate) const CHAPTER: Chapter = Chapter {
    name: "s97-figures",
    title: "S97 figs 2 and 3, SInf fig 1: variances in the 54-patch cube",
    run,
};

/// The number of runs and the walks of a run, as published.
const RUNS: usize = 100;
const WALKS: u64 = 10_000;

/// The curves that one panel of a figure compares.
struct PanelCurves {
    direction: Direction,
    estimator: EstimatorKind,
    /// The variance of one walk with the true ξ (for gathering: b_s).
    theory: Vec<f64>,
    /// The variance with ξ = 0 (b_s = 0), as in the papers.
    simplified: Vec<f64>,
    /// The measured variance of 100 runs, as published.
    measured: Vec<Measured>,
    /// The squared errors of the patches in many runs, times the walks of a run.
    squares: Vec<Vec<f64>>,
}

fn run(lab: &Lab) -> Findings {
    let exact = Exact::of_scene(&scenes::cube(3)).expect("a closed box");
    let pairs = DIRECTIONS.iter().flat_map(|direction| ESTIMATORS.map(|estimator| (direction, estimator)));
    let comparisons: Vec<PanelCurves> = pairs
        .zip(201..)
        .map(|((direction, estimator), seed)| compare(lab, &exact, direction, estimator, seed))
        .collect();
    let mut rows: Vec<Claim> = comparisons.iter().flat_map(rows_of).collect();
    rows.extend(orders(&comparisons));
    Findings {
        published: "Variances of one walk on each patch of a cube with faces of 3 × 3 patches, reflectances 0.3 … \
                    0.8 by face, a source of 1 W/m² in the middle of the first face: mean squared errors of 100 runs \
                    of 10⁴ paths beside the closed forms with ξ = 0 (gathering: b_s = 0). As charts, without numbers."
            .into(),
        experiment: format!(
            "The same 100 runs of 10⁴ walks, drawn with twice the scatter that theory expects of them; and {} runs of \
             10⁴ walks for the ratios below, means over all 54 patches. The infinite estimators are cut off where \
             ΠR < 0.001, as published. Theory: exact radiosities, true ξ.",
            many_runs(lab)
        ),
        rows,
        remarks: vec![
            "ξ matters little here: the closed forms with ξ = 0 are too small by the ratio shown, which 100 runs of \
             10⁴ walks (± 2 % for all patches together) can hardly tell from 1. The papers' approximation was a good \
             one for their experiment, and is not the truth."
                .into(),
        ],
        figures: figures(&comparisons),
    }
}

/// The number of runs for the ratios.
fn many_runs(lab: &Lab) -> usize {
    lab.pick(RUNS, 2_000)
}

fn compare(
    lab: &Lab,
    exact: &Exact,
    direction: &Direction,
    estimator: EstimatorKind,
    seed: u64,
) -> PanelCurves {
    let cut = InfiniteEnd::Cutoff { threshold: 0.001 };
    let method = method(direction.clone(), estimator.ending(cut));
    let experiment = experiment(&scenes::cube(3), method.clone());
    let reader = TallyReader::new(&experiment);
    let truth = &exact.solution().reflected;
    let runs = lab.runs(&experiment, seed, many_runs(lab), WALKS, |tally| reader.reflected(tally));
    let theory = predicted(exact, experiment.scene(), &method);
    let simplified = simplified(exact, direction, estimator);
    let square = |(b, t): (&f64, &f64)| WALKS as f64 * (b - t).powi(2);
    let squares: Vec<Vec<f64>> = runs.iter().map(|run| run.iter().zip(truth).map(square).collect()).collect();
    let of_patch = |i: usize| Measured::of(&squares[..RUNS].iter().map(|run| run[i]).collect::<Vec<_>>());
    PanelCurves {
        measured: (0..truth.len()).map(of_patch).collect(),
        squares,
        direction: direction.clone(),
        estimator,
        theory,
        simplified,
    }
}

/// The closed forms of S97 and SInf with ξ = 0 for shooting and b_s = 0 for gathering, of one source s: Σ_s c_sb_is is
/// then c_sb_i.
fn simplified(exact: &Exact, direction: &Direction, estimator: EstimatorKind) -> Vec<f64> {
    let (reflected, squared) = (&exact.solution().reflected, &exact.squared_solution().reflected);
    let source = exact.emittance().iter().position(|&e| e > 0.0).expect("one source");
    let (e_s, r_s) = (exact.emittance()[source], exact.reflectance()[source]);
    let variance = |i: usize| {
        let (b, beta, r, area) = (reflected[i], squared[i], exact.reflectance()[i], exact.areas()[i]);
        let density = exact.total_power() / area;
        let births = exact.areas().iter().sum::<f64>() / area;
        let second_moment = match (direction, estimator) {
            (Direction::Shooting, EstimatorKind::Absorption) => b * r * density / (1.0 - r),
            (Direction::Shooting, EstimatorKind::Survival) => b * density,
            (Direction::Shooting, EstimatorKind::Collision) => b * r * density,
            (Direction::Shooting, _) => beta * density,
            (_, EstimatorKind::Absorption) => r * births * e_s / (1.0 - r_s) * b,
            (_, EstimatorKind::Survival) => r * births * e_s / r_s * b,
            (_, EstimatorKind::Collision) => r * births * e_s * b,
            _ => births * e_s * beta,
        };
        second_moment - b * b
    };
    (0..reflected.len()).map(variance).collect()
}

fn rows_of(comparison: &PanelCurves) -> [Claim; 2] {
    let PanelCurves { direction, estimator, theory, simplified, squares, .. } = comparison;
    let what = format!("{}, {}", panel_name(direction, *estimator), name(direction, *estimator));
    let over = |variances: &[f64]| {
        let mean = |run: &Vec<f64>| {
            run.iter().zip(variances).map(|(square, v)| square / v).sum::<f64>() / variances.len() as f64
        };
        Measured::of(&squares.iter().map(mean).collect::<Vec<_>>())
    };
    let zero = if *direction == Direction::Shooting { "ξ = 0" } else { "b_s = 0" };
    [
        Claim::of(format!("{what}: measured over theory"), over(theory), ClaimBound::Is(1.0)),
        Claim::of(
            format!("{what}: measured over theory with {zero}"),
            over(simplified),
            ClaimBound::About(1.0),
        ),
    ]
}

/// The panel of the paper that shows a direction and an estimator.
fn panel_name(direction: &Direction, estimator: EstimatorKind) -> String {
    let shooting = *direction == Direction::Shooting;
    let letter = match (estimator.absorption(), estimator.event()) {
        (AbsorptionMode::Implicit, _) => return format!("SInf fig 1 {}", if shooting { "a" } else { "b" }),
        (_, Event::Absorption) => "a",
        (_, Event::Survival) => "b",
        (_, Event::Arrival) => "c",
    };
    format!("S97 fig {} {letter}", if shooting { 2 } else { 3 })
}

/// The claims that figs 2 d and 3 d show: which estimator is better where.
fn orders(comparisons: &[PanelCurves]) -> Vec<Claim> {
    use EstimatorKind::{Absorption, Collision, Survival};
    let order = |figure: u32,
                 a: EstimatorKind,
                 b: EstimatorKind,
                 where_: &str,
                 among: &dyn Fn(f64) -> bool| {
        let direction = &DIRECTIONS[figure as usize - 2];
        let of = |estimator| {
            let found = comparisons.iter().find(|c| c.direction == *direction && c.estimator == estimator);
            found.expect("all are compared").errors_among(among)
        };
        let ([a_measured, a_theory], [b_measured, b_theory]) = (of(a), of(b));
        let label = format!("S97 fig {figure} d: {} over {}{where_}", a.word(), b.word());
        Claim::of(label, quotient(a_measured, b_measured), ClaimBound::Is(a_theory.value / b_theory.value))
    };
    let all = |_: f64| true;
    vec![
        order(2, Absorption, Survival, ", patches of R < ½", &|r| r < 0.45),
        order(2, Absorption, Survival, ", patches of R > ½", &|r| r > 0.55),
        order(2, Collision, Absorption, ", all patches", &all),
        order(2, Collision, Survival, ", all patches", &all),
        order(3, Absorption, Survival, " (R_s = 0.3)", &all),
        order(3, Collision, Absorption, "", &all),
    ]
}

impl PanelCurves {
    /// The mean over patches of some reflectances of the measured errors of many runs, and of theory.
    fn errors_among(&self, among: &dyn Fn(f64) -> bool) -> [Measured; 2] {
        let chosen: Vec<usize> = (0..54).filter(|&i| among(0.3 + 0.1 * (i / 9) as f64)).collect();
        let mean =
            |of: &dyn Fn(usize) -> f64| chosen.iter().map(|&i| of(i)).sum::<f64>() / chosen.len() as f64;
        let measured: Vec<f64> = self.squares.iter().map(|run| mean(&|i| run[i])).collect();
        [Measured::of(&measured), counted(mean(&|i| self.theory[i]))]
    }
}

/// The panels: theory with twice the scatter of 100 runs, and the measurement.
fn figures(comparisons: &[PanelCurves]) -> Vec<Drawing> {
    let panels = comparisons.iter().map(|comparison| {
        let PanelCurves { direction, estimator, theory, simplified, measured, .. } = comparison;
        // The mean of n squares of normal deviates scatters by √(2/n).
        let scatter = 2.0 * (2.0 / RUNS as f64).sqrt();
        let expected = |v: &f64| Measured { value: *v, standard_error: scatter * v };
        let zero =
            if *direction == Direction::Shooting { "theory with ξ = 0" } else { "theory with b_s = 0" };
        let values = measured.iter().map(|m| counted(m.value));
        let title = format!("{}: {}", panel_name(direction, *estimator), name(direction, *estimator));
        panel(
            &title,
            vec![
                series("theory, with twice the scatter that 100 runs have", theory.iter().map(expected)),
                series(zero, simplified.iter().map(|v| counted(*v))),
                series("measured: mean squared errors of 100 runs", values),
            ],
        )
    });
    let together = DIRECTIONS.iter().map(|direction| {
        let mine = comparisons.iter().filter(|c| c.direction == *direction);
        let finite = mine.filter(|c| c.estimator != EstimatorKind::Infinite);
        let figure = if *direction == Direction::Shooting { 2 } else { 3 };
        let measured =
            |c: &PanelCurves| series(c.estimator.word(), c.measured.iter().map(|m| counted(m.value)));
        panel(&format!("S97 fig {figure} d: all three, measured"), finite.map(measured).collect())
    });
    panels.chain(together).collect()
}

/// A chart over the patches.
fn panel(title: &str, series: Vec<Series>) -> Drawing {
    let chart = Chart {
        title: title.into(),
        x: Axis::linear("patch"),
        y: Axis::linear("variance of B, one walk [W²/m⁴]"),
        series,
    };
    let place = title.split([',', ':']).next().unwrap_or(title);
    Drawing::chart(&format!("{}.svg", place.to_lowercase().replace(' ', "-")), title, &chart)
}

fn series(name: &str, values: impl Iterator<Item = Measured>) -> Series {
    let points = values.zip(1..).map(|(value, patch)| point(f64::from(patch), value));
    Series { name: name.into(), style: Style::Marks, points: points.collect() }
}
