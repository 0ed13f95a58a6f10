//! S97 tables 1 and 2: how the work for a given variance grows with the number of patches.

use exact::Exact;
use radiosity::{Birth, Direction, EstimatorKind, Experiment, IndexChoice, Scene, SceneSpec};
use report::{Axis, Chart, Series, Style};

use crate::arithmetic::counted;
use crate::claim::{Claim, ClaimBound};
use crate::clock::thread_seconds;
use crate::lab::Lab;
use crate::papers::Chapter;
use crate::papers::counted::{CountedScene, TraceWork};
use crate::papers::findings::{Drawing, Findings};
use crate::papers::walkers::{DIRECTIONS, method, predicted, refined};
use crate::series::point;

/// The chapter of S97 tables 1 and 2.
pub(crate) const CHAPTER: Chapter =
    Chapter { name: "s97-complexity", title: "S97 tables 1 and 2: growth of counted work", run };

/// The variance that every patch is to have [W²/m⁴]; only its constancy matters.
const VARIANCE: f64 = 1e-6;

/// The number of walks whose work is counted.
const SAMPLE: u64 = 2_000;

/// The way in which a scene grows.
#[derive(Clone, Copy, PartialEq)]
enum Scenario {
    /// The scene gets more surfaces of the same area: a longer corridor, with a surface for every patch.
    Surfaces,
    /// The six surfaces of a room get finer patches.
    Patches,
}

/// The way of finding a hit, in S97's four cases.
#[derive(Clone, Copy, PartialEq)]
enum Case {
    TreeAndGrid,
    TreeAndHierarchy,
    FlatAndGrid,
    FlatAndHierarchy,
}

const CASES: [Case; 4] =
    [Case::TreeAndGrid, Case::TreeAndHierarchy, Case::FlatAndGrid, Case::FlatAndHierarchy];

/// One size of a scene, with a direction of walks.
struct SceneSize {
    surfaces: f64,
    patches: f64,
    /// The walks by absorption that bring every variance below [`VARIANCE`].
    walks: f64,
    /// The work of [`SAMPLE`] walks.
    work: TraceWork,
    /// The processor time of a walk with the program's tree and without it [s].
    seconds: [f64; 2],
}

fn run(lab: &Lab) -> Findings {
    let (mut rows, mut figures) = (Vec::new(), Vec::new());
    for scenario in [Scenario::Surfaces, Scenario::Patches] {
        let scales: &[u32] = match scenario {
            Scenario::Surfaces => lab.pick(&[2, 4, 8, 16], &[2, 4, 8, 16, 32, 64]),
            Scenario::Patches => lab.pick(&[1, 2, 3, 4], &[1, 2, 3, 4, 6]),
        };
        let scenes: Vec<Grown> = scales.iter().map(|&scale| Grown::new(scenario, scale)).collect();
        let mut series = Vec::new();
        for direction in &DIRECTIONS {
            let sizes: Vec<SceneSize> = scenes.iter().map(|scene| scene.measure(lab, direction)).collect();
            rows.extend(CASES.map(|case| growth(&sizes, scenario, direction, case)));
            rows.extend(times(&sizes, scenario, direction));
            series.extend([Case::TreeAndGrid, Case::FlatAndGrid].map(|case| line(&sizes, direction, case)));
        }
        figures.push(figure(scenario, series));
    }
    Findings {
        published: "Orders of the cost at a given variance in the number of patches n. *Scenario 1*: more surfaces of the \
                    same smallest area, n/n_s constant; *scenario 2*: patches cut finer. *Cases*: 1 structured scene and \
                    bounded cost for the patch on its surface, 2 structured and hierarchical patches, 3 and 4 the same \
                    without structure. Shooting: log n, log n, n, n and n, n log n, n, n log n; gathering: n log n, \
                    n log n, n², n² and n, n log n, n, n log n."
            .into(),
        experiment: format!(
            "Counted work, so that nothing is left to the clock: walks × (box tests + facet tests + steps to the patch) of \
             a walk. Walks: those of the absorption estimator that bring the largest variance of any patch (closed form) to \
             a given value. Tests: of {SAMPLE} real walks through a binary tree of boxes, or against all surfaces; one step \
             in a grid, as many as quarters are chosen in a hierarchy. Scenario 1: a corridor of 1 × 1 × L m in patches of \
             ⅓ m, each a surface, L = {}; scenario 2: the 54-patch cube with every patch cut in k², k = {}. Exponent: the \
             least-squares slope of log work against log n. A factor log n adds the slope of log log n over these \
             n, at most.",
            lab.pick("2 … 16", "2 … 64"),
            lab.pick("1 … 4", "1 … 6")
        ),
        rows,
        remarks: vec![REMARK.into()],
        figures,
    }
}

const REMARK: &str = "The orders hold in what can be counted. Times (shown, not judged: they are those of one machine while \
    it did other things) follow them but for the flat search, which looks at sixteen rays at once and is far below its \
    order at these sizes. A hierarchy of patches costs a logarithm where a grid costs nothing, as table 1 has it; in \
    scenario 2 that is what keeps cases 2 and 4 from being linear.";

/// A scene of one size in both forms.
struct Grown {
    /// The scene as its work is counted.
    surfaces: SceneSpec,
    /// The scene as its variances are solved for, with the same patches.
    exact: Exact,
}

impl Grown {
    fn new(scenario: Scenario, scale: u32) -> Self {
        let spec = match scenario {
            Scenario::Surfaces => scenes::corridor(scale),
            Scenario::Patches => refined(&scenes::cube(3), scale),
        };
        let exact = Exact::of_scene(&spec).expect("a closed box");
        let surfaces = if scenario == Scenario::Surfaces { scenes::in_cells(&spec) } else { spec };
        Grown { surfaces, exact }
    }

    fn measure(&self, lab: &Lab, direction: &Direction) -> SceneSize {
        let scene = |index| Scene::build(&self.surfaces, index).expect("scenes made by rule are valid");
        let method = method(direction.clone(), EstimatorKind::Absorption);
        let tree = scene(IndexChoice::Tree);
        let largest = predicted(&self.exact, &tree, &method).into_iter().fold(0.0, f64::max);
        let work = CountedScene::new(&self.surfaces).walk(direction, 701, SAMPLE);
        let (surfaces, patches) = (tree.surfaces().len() as f64, tree.faces().len() as f64);
        let seconds = [tree, scene(IndexChoice::Flat)].map(|scene| {
            let experiment = Experiment::new(scene, method.clone()).expect("walks fit every scene");
            time_of_walk(&experiment, lab.pick(20_000, 500_000))
        });
        SceneSize { surfaces, patches, walks: largest / VARIANCE, work, seconds }
    }
}

fn time_of_walk(experiment: &Experiment, walks: u64) -> f64 {
    let mut board = experiment.board();
    let began = thread_seconds();
    experiment.walk(&radiosity::Sequence::new(702), 0..walks, &mut board);
    (thread_seconds() - began) / walks as f64
}

impl SceneSize {
    /// The tests and steps of all walks that the variance asks for.
    fn tests(&self, case: Case) -> f64 {
        let TraceWork { rays, boxes, facets, quarters } = self.work;
        let (rays, boxes, facets) = (rays as f64, boxes as f64, facets as f64);
        let of_sample = match case {
            Case::TreeAndGrid => boxes + facets + rays,
            Case::TreeAndHierarchy => boxes + facets + quarters as f64,
            Case::FlatAndGrid => rays * self.surfaces + rays,
            Case::FlatAndHierarchy => rays * self.surfaces + quarters as f64,
        };
        self.walks * of_sample / SAMPLE as f64
    }
}

/// The powers of n and of log n in S97 tables 1 and 2.
fn order(scenario: Scenario, direction: &Direction, case: Case) -> (f64, bool) {
    let structured = matches!(case, Case::TreeAndGrid | Case::TreeAndHierarchy);
    let gathering = if *direction == Direction::Shooting { 0.0 } else { 1.0 };
    match scenario {
        Scenario::Surfaces if structured => (gathering, true),
        Scenario::Surfaces => (1.0 + gathering, false),
        Scenario::Patches => (1.0, matches!(case, Case::TreeAndHierarchy | Case::FlatAndHierarchy)),
    }
}

/// The claim on the exponent of counted work against that of the tables.
fn growth(sizes: &[SceneSize], scenario: Scenario, direction: &Direction, case: Case) -> Claim {
    let exponent = slope(sizes.iter().map(|size| [size.patches, size.tests(case)]));
    let (power, logarithm) = order(scenario, direction, case);
    // The amount that a factor log n adds to an exponent over these sizes.
    let by_log = slope(sizes.iter().map(|size| [size.patches, size.patches.ln()]));
    let most = power + if logarithm { by_log } else { 0.0 };
    let order = match (power, logarithm) {
        (0.0, true) => "log n".into(),
        (1.0, true) => "n log n".into(),
        (1.0, _) => "n".into(),
        (p, _) => format!("n^{p}"),
    };
    let label = format!("{}: O({order}), exponent", label(scenario, direction, case));
    Claim::of(label, counted(exponent), ClaimBound::Between(power - SLACK, most + SLACK))
}

/// The most deviation of exponents in small scenes, where constant parts still bend the lines.
const SLACK: f64 = 0.1;

/// The claims on the exponents of processor time, with the program's tree and without.
fn times(sizes: &[SceneSize], scenario: Scenario, direction: &Direction) -> [Claim; 2] {
    [(0, Case::TreeAndGrid), (1, Case::FlatAndGrid)].map(|(which, case)| {
        let exponent = slope(sizes.iter().map(|size| [size.patches, size.walks * size.seconds[which]]));
        let label = format!("{}: exponent of time", label(scenario, direction, case));
        Claim::of(label, counted(exponent), ClaimBound::Nothing)
    })
}

fn label(scenario: Scenario, direction: &Direction, case: Case) -> String {
    let scenario = if scenario == Scenario::Surfaces { 1 } else { 2 };
    let direction =
        if matches!(direction, Direction::Gathering(Birth::Area)) { "gathering" } else { "shooting" };
    let case = CASES.iter().position(|&c| c == case).expect("one of four") + 1;
    format!("{direction}, scenario {scenario}, case {case}")
}

/// The least-squares slope of log y against log x.
fn slope(points: impl Iterator<Item = [f64; 2]>) -> f64 {
    let logs: Vec<[f64; 2]> = points.map(|point| point.map(f64::ln)).collect();
    let mean = |k: usize| logs.iter().map(|p| p[k]).sum::<f64>() / logs.len() as f64;
    let (x, y) = (mean(0), mean(1));
    let product = |k: usize, middle: f64| logs.iter().map(|p| (p[0] - x) * (p[k] - middle)).sum::<f64>();
    product(1, y) / product(0, x)
}

fn line(sizes: &[SceneSize], direction: &Direction, case: Case) -> Series {
    let structure = if case == Case::TreeAndGrid { "tree, grid (case 1)" } else { "flat, grid (case 3)" };
    let direction = if *direction == Direction::Shooting { "shooting" } else { "gathering" };
    let points = sizes.iter().map(|size| point(size.patches, counted(size.tests(case))));
    Series { name: format!("{direction}, {structure}"), style: Style::Joined, points: points.collect() }
}

fn figure(scenario: Scenario, series: Vec<Series>) -> Drawing {
    let number = if scenario == Scenario::Surfaces { 1 } else { 2 };
    let what = if number == 1 { "more surfaces" } else { "finer patches" };
    let chart = Chart {
        title: format!("S97 scenario {number}, {what}: work for a largest variance of 10⁻⁶ W²/m⁴"),
        x: Axis::log("patches n"),
        y: Axis::log("box tests, facet tests, steps to the patch"),
        series,
    };
    let caption = format!("S97 tables 1, 2: scenario {number}");
    Drawing::chart(&format!("s97-scenario{number}.svg"), caption, &chart)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_exponents() {
        let points = [1.0, 2.0, 4.0, 8.0_f64].map(|x| [x, 3.0 * x.powf(1.5)]);
        assert!((slope(points.into_iter()) - 1.5).abs() < 1e-12);
    }
}
