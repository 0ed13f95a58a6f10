//! How often intervals of factors, and of the heat that follows from them, hold the truth.

use exact::Exact;
use exchange::{
    Balance, BoundaryCondition, ExchangeCounts, Factors, HeatEstimate, Intervals, SparseFactors, SparseRow,
};
use radiosity::{
    IndexChoice, Scene, SceneSpec, Sequence, Space,
    exchange::{ExchangeRows, FactorKind},
};
use stats::{Coverage, Interval, Measured};

use crate::claim::{Claim, ClaimBound};
use crate::lab::Lab;
use crate::papers::Findings;

const LEVEL: f64 = 0.95;

/// What is asked of intervals of this level: the part that holds the truth.
const ASKED: ClaimBound = ClaimBound::Between(0.94, 0.97);

/// Walks of a row, so that factors of the cube expect from a third of a count to some hundreds.
const WALKS: [u64; 6] = [16, 64, 181, 512, 1448, 4096];

/// Ranges of expected counts.
const RANGES: [[f64; 2]; 5] = [[0.1, 1.0], [1.0, 3.0], [3.0, 10.0], [10.0, 30.0], [30.0, 300.0]];

pub(super) fn run(lab: &Lab) -> Findings {
    let cube = BlackCube::new();
    Findings {
        published: "What is asked of an interval of 95 %: that it holds the truth in 94 to 97 % of cases. Where fewer than three counts are \
                    expected, an interval that holds at no hit is missed on one side alone; then 94 % at least are asked for."
            .into(),
        experiment: format!(
            "A cube of 54 facets, each a group, whose factors are known in closed form. Intervals of sparse rows (mid-P), and those of \
             `factors.csv`, by the counts that a factor expects: {WALKS:?} walks a row. Heat: the facets of the floor at 400 K, of the \
             ceiling at 300 K, those of the walls insulated, all black, 1,000 walks a row; truth is the balance by exact factors. The \
             facets of a run depend on each other, so that the standard error is that between runs."
        ),
        rows: [of_counts(lab, &cube), of_heat(lab, &cube)].concat(),
        ..Findings::default()
    }
}

/// A cube of 54 black facets, and the factors between them.
struct BlackCube {
    rows: ExchangeRows,
    truth: Vec<Vec<f64>>,
    areas: Vec<f64>,
    surfaces: Vec<u32>,
}

impl BlackCube {
    fn new() -> Self {
        let mut spec: SceneSpec = scenes::cube(3);
        spec.surfaces.iter_mut().for_each(|surface| surface.emittance = 1.0.into());
        let exact = Exact::of_scene(&spec).expect("the cube has a solution");
        let facets = exact.face_count();
        let row = |i: usize| (0..facets).map(|j| exact.exchange().form_factor(i, j).max(0.0)).collect();
        let truth: Vec<Vec<f64>> = (0..facets).map(row).collect();
        let scene = Scene::build(&spec, IndexChoice::Auto).expect("the scene is valid");
        let surfaces = scene.faces().iter().map(|face| face.surface).collect();
        let groups = ((0..facets as u32).collect(), facets as u32);
        let rows = ExchangeRows::new(scene, (FactorKind::FirstHit, Space::Discrete), groups, None)
            .expect("the groups are those of the scene");
        BlackCube { rows, truth, areas: exact.areas().to_vec(), surfaces }
    }

    /// The counted rows of a run.
    fn counted(&self, seed: u64, run: u64, walks: u64) -> Vec<SparseRow> {
        let (sequence, mut board) = (Sequence::new(seed), self.rows.board());
        let mut row = |group| {
            self.rows.walk(&sequence, group, run * walks..(run + 1) * walks, &mut board);
            SparseRow::new(board.take().0)
        };
        (0..self.rows.groups() as u32).map(&mut row).collect()
    }
}

/// The coverage of both kinds of intervals, range by range.
#[derive(Clone, Copy, Default)]
struct Ranges {
    sparse: [Coverage; RANGES.len()],
    dense: [Coverage; RANGES.len()],
}

fn of_counts(lab: &Lab, cube: &BlackCube) -> Vec<Claim> {
    let runs: usize = lab.pick(40, 1000);
    let tasks = runs * WALKS.len();
    let found = lab.each(
        tasks,
        || Intervals::new(LEVEL),
        |intervals, task| {
            let (run, walks) = ((task / WALKS.len()) as u64, WALKS[task % WALKS.len()]);
            cover(cube, &cube.counted(walks, run, walks), walks, intervals)
        },
    );
    let mut all = Ranges::default();
    for ranges in &found {
        for k in 0..RANGES.len() {
            all.sparse[k].merge(&ranges.sparse[k]);
            all.dense[k].merge(&ranges.dense[k]);
        }
    }
    let mut claims = Vec::new();
    for (k, [from, to]) in RANGES.into_iter().enumerate() {
        let label = |kind: &str| format!("{kind}: coverage where {from} to {to} counts are expected");
        let rate = |coverage: Coverage| coverage.rate(LEVEL).expect("there are intervals of this range");
        let asked = if to > 3.0 { ASKED } else { ClaimBound::AtLeast(0.94) };
        claims.push(Claim::of(label("sparse rows"), rate(all.sparse[k]), asked));
        claims.push(Claim::of(label("`factors.csv`"), rate(all.dense[k]), ClaimBound::AtLeast(0.94)));
    }
    let mut few = Coverage::default();
    all.sparse[1..3].iter().for_each(|coverage| few.merge(coverage));
    let rate = few.rate(LEVEL).expect("there are intervals of few counts");
    claims.push(Claim::of("sparse rows: coverage where 1 to 10 counts are expected", rate, ASKED));
    claims
}

fn cover(cube: &BlackCube, rows: &[SparseRow], walks: u64, intervals: &mut Intervals) -> Ranges {
    let mut ranges = Ranges::default();
    let mut counts = ExchangeCounts::none(rows.len());
    let columns = 0..rows.len() as u32 + 2;
    let counted = |row: &SparseRow| columns.clone().map(|column| row.count(column).into()).collect();
    counts.add(&rows.iter().map(counted).collect::<Vec<Vec<u64>>>());
    let dense = Factors::new(&counts, LEVEL);
    for (i, row) in rows.iter().enumerate() {
        for (j, &truth) in cube.truth[i].iter().enumerate() {
            let expected = truth * walks as f64;
            let Some(k) = RANGES.iter().position(|[from, to]| (*from..*to).contains(&expected)) else {
                continue;
            };
            ranges.sparse[k].record(&intervals.of(row.count(j as u32), walks).interval, truth);
            ranges.dense[k].record(&dense.get(i, j).interval, truth);
        }
    }
    ranges
}

fn of_heat(lab: &Lab, cube: &BlackCube) -> Vec<Claim> {
    const WALKS: u64 = 1000;
    let given: Vec<BoundaryCondition> = cube
        .surfaces
        .iter()
        .map(|surface| match surface {
            0 => BoundaryCondition::Temperature(400.0),
            1 => BoundaryCondition::Temperature(300.0),
            _ => BoundaryCondition::Flux(0.0),
        })
        .collect();
    let solve = |factors: &SparseFactors| {
        let (emitting_areas, given) = (&cube.areas[..], &given[..]);
        let balance = Balance { factors, emitting_areas, given, environment: None, level: LEVEL };
        let solved = balance.solve().expect("some temperatures are given");
        [solved.fluxes, solved.temperatures]
    };
    // Factors as counts of very many walks.
    let mut counts = ExchangeCounts::none(cube.truth.len());
    let whole = |row: &Vec<f64>| row.iter().map(|p| (p * 2.0_f64.powi(50)) as u64).chain([0, 0]).collect();
    counts.add(&cube.truth.iter().map(whole).collect::<Vec<Vec<u64>>>());
    let truth = solve(&SparseFactors::from(&counts));
    let runs = lab.pick(100, 4000);
    let found = lab.each(
        runs,
        || (),
        |(), run| {
            let mut factors = SparseFactors::default();
            let rows = cube.counted(1, run as u64, WALKS);
            rows.iter().for_each(|row| factors.push(row, rows.len() as u32));
            let found = solve(&factors);
            [0, 1].map(|k| held(&found[k], &truth[k]))
        },
    );
    let mean = |k: usize| {
        let parts = found.iter().map(|parts| parts[k]);
        let value = parts.clone().sum::<f64>() / runs as f64;
        let variance = parts.map(|part| (part - value).powi(2)).sum::<f64>() / (runs - 1) as f64;
        Measured { value, standard_error: (variance / runs as f64).sqrt() }
    };
    let label = |of: &str| format!("heat: coverage of {of}");
    vec![
        Claim::of(label("the net fluxes of facets"), mean(0), ASKED),
        Claim::of(label("the temperatures of insulated facets"), mean(1), ASKED),
    ]
}

/// The part of the estimates with an interval that hold the truth.
fn held(found: &[HeatEstimate], truth: &[HeatEstimate]) -> f64 {
    let mut coverage = Coverage::default();
    for (found, truth) in found.iter().zip(truth).filter(|(found, _)| found.std_error.is_some()) {
        coverage.record(&Interval { low: found.low, high: found.high }, truth.value);
    }
    coverage.rate(LEVEL).map_or(0.0, |rate| rate.value)
}
