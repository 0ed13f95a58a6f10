//! S97 table 4 and the bounds of §§2.2 and 3.3: how close the bounds on errors are.

use exact::{ESTIMATORS, Exact, VarianceBounds};
use radiosity::{Birth, Direction, EstimatorKind, Scene, SceneSpec};
use report::{Axis, Chart, Series, Style};
use stats::Measured;

use crate::arithmetic::counted;
use crate::claim::{Claim, ClaimBound};
use crate::lab::Lab;
use crate::papers::Chapter;
use crate::papers::findings::{Drawing, Findings};
use crate::papers::walkers::{DIRECTIONS, experiment, mean_by_area, method, name, predicted};
use crate::series::point;
use crate::walking::TallyReader;

/// The chapter of S97 table 4.
pub(crate) const CHAPTER: Chapter = Chapter {
    name: "s97-bounds",
    title: "S97 table 4 and §§2.2, 3.3: bounds on errors, and how loose they are",
    run,
};

/// The walks of a run.
const WALKS: u64 = 1_000;

/// The bound on E(MSE) over the measured value, estimator by estimator.
struct Looseness {
    scene: &'static str,
    factors: Vec<f64>,
}

fn run(lab: &Lab) -> Findings {
    let scenes = [
        ("54-patch cube", scenes::cube(3)),
        ("six-patch cube, R = 0.9", scenes::furnace(1, 0.9)),
        ("corridor 1 × 1 × 4", scenes::corridor(4)),
    ];
    let runs = lab.pick(200, 2_000);
    let mut seeds = 301..;
    let (mut rows, mut loose) = (Vec::new(), Vec::new());
    for (scene, spec) in &scenes {
        let exact = Exact::of_scene(spec).expect("a closed box");
        let bounds = VarianceBounds::of(&exact);
        let (mut factors, mut tightest) = (Vec::new(), counted(0.0));
        for (direction, estimator) in DIRECTIONS.iter().flat_map(|d| ESTIMATORS.map(|e| (d, e))) {
            let seed = seeds.next().expect("seeds do not end");
            let (measured, theory) = errors(lab, spec, &exact, direction, estimator, [seed, runs]);
            let bound = bound_on_error(&bounds, direction, estimator);
            let what = format!("{scene}: E(MSE), {}", name(direction, estimator));
            rows.push(Claim::of(what, measured, ClaimBound::Is(theory)).published(bound));
            factors.push(bound / measured.value);
            if measured.value / bound > tightest.value {
                tightest = scaled(measured, 1.0 / bound);
            }
        }
        rows.push(Claim::of(
            format!("{scene}: the largest of these over its bound"),
            tightest,
            ClaimBound::AtMost(1.0),
        ));
        loose.push(Looseness { scene, factors });
        rows.extend(largest_variances(scene, spec, &exact, &bounds));
    }
    let all = || loose.iter().flat_map(|l| l.factors.iter().copied());
    let (least, most) = (all().fold(f64::INFINITY, f64::min), all().fold(0.0, f64::max));
    Findings {
        published: "Bounds on the area-weighted mean squared error of one walk (table 4; here under *theirs*), and on \
                    the largest variance of any patch (shooting 2.4, gathering §3.3). No numbers."
            .into(),
        experiment: format!(
            "{runs} runs of {WALKS} discrete walks with each of the eight estimators in three closed boxes, births of \
             gathering by area. Theory: the closed forms of the variances, summed over patches by area."
        ),
        rows,
        remarks: vec![format!(
            "Every bound holds. They are loose by factors of {least:.1} to {most:.0}: they replace every reflectance \
             by the largest and every area by the smallest, so they are near the truth only where all patches are alike. \
             Walks planned by a bound are too many by the same factor."
        )],
        figures: vec![figure(&loose)],
    }
}

/// E(MSE) of one walk, measured and by theory [W²/m⁴].
fn errors(
    lab: &Lab,
    spec: &SceneSpec,
    exact: &Exact,
    direction: &Direction,
    estimator: EstimatorKind,
    [seed, runs]: [u64; 2],
) -> (Measured, f64) {
    let method = method(direction.clone(), estimator);
    let experiment = experiment(spec, method.clone());
    let (reader, truth) = (TallyReader::new(&experiment), &exact.solution().reflected);
    let squares = lab.runs(&experiment, seed, runs as usize, WALKS, |tally| {
        let squares = reader.reflected(tally).into_iter().zip(truth).map(|(b, t)| (b - t).powi(2));
        WALKS as f64 * mean_by_area(exact, squares)
    });
    let theory = mean_by_area(exact, predicted(exact, experiment.scene(), &method));
    (Measured::of(&squares), theory)
}

fn bound_on_error(bounds: &VarianceBounds, direction: &Direction, estimator: EstimatorKind) -> f64 {
    match direction {
        Direction::Shooting => bounds.shooting_error(estimator),
        _ => bounds.gathering_error(estimator),
    }
}

fn scaled(measured: Measured, factor: f64) -> Measured {
    Measured { value: measured.value * factor, standard_error: measured.standard_error * factor }
}

/// The largest variance of absorption on any patch, by the closed form, under its bound.
fn largest_variances(name: &str, spec: &SceneSpec, exact: &Exact, bounds: &VarianceBounds) -> [Claim; 2] {
    let scene = Scene::build(spec, radiosity::IndexChoice::Flat).expect("scenes made by rule are valid");
    let largest = |direction: Direction| {
        let method = method(direction, EstimatorKind::Absorption);
        predicted(exact, &scene, &method).into_iter().fold(0.0, f64::max)
    };
    let row = |direction: &str, value: f64, bound: f64| {
        let label = format!("{name}: largest variance, {direction}, absorption (closed form)");
        Claim::of(label, counted(value), ClaimBound::AtMost(bound))
    };
    [
        row("shooting", largest(Direction::Shooting), bounds.shooting_variance()),
        row("gathering", largest(Direction::Gathering(Birth::Area)), bounds.gathering_variance()),
    ]
}

/// The chart of how loose the bounds are, estimator by estimator.
fn figure(loose: &[Looseness]) -> Drawing {
    let series = loose.iter().map(|l| Series {
        name: l.scene.into(),
        style: Style::Marks,
        points: l.factors.iter().zip(1..).map(|(&factor, i)| point(f64::from(i), counted(factor))).collect(),
    });
    let chart = Chart {
        title: "How loose the bounds on E(MSE) are".into(),
        x: Axis::linear("1 – 4 shooting, 5 – 8 gathering: absorption, survival, collision, infinite"),
        y: Axis::log("bound over measured"),
        series: series.collect(),
    };
    Drawing::chart("s97-bounds.svg", "S97 table 4: bound over measured E(MSE)", &chart)
}
