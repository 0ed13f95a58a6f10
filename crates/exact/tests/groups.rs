//! Sources, mixtures of them, and derivatives by materials, against dense solutions: whether intervals are true.

use crate::common::{Numbers, plain_box};
use exact::Exact;
use glam::DVec3;
use radiosity::{
    Estimate, Estimates, EstimatorKind, Experiment, IndexChoice, Method, Scene, SceneSpec, Sequence,
    Spectrum, Tally,
    groups::{Groups, PatchGroup},
    sensitivity::{Derivative, Influences, Property},
};

const LEVEL: f64 = 0.95;

/// Estimators whose paths go on, that of direct light aside.
const GOING_ON: [EstimatorKind; 4] =
    [EstimatorKind::Absorption, EstimatorKind::Survival, EstimatorKind::Collision, EstimatorKind::Infinite];

/// A box of 2 × 1 × 1 m, 2 × 1 patches a wall: a floor lamp, a ceiling of which one cell emits, a wall that emits a little.
fn room(coloured: bool) -> SceneSpec {
    let mut spec = plain_box(DVec3::ZERO, DVec3::new(2.0, 1.0, 1.0), [2, 1], 0.0, 0.0);
    for (number, surface) in spec.surfaces.iter_mut().enumerate() {
        surface.reflectance = match (number / 2, coloured) {
            (0, false) => 0.7.into(),
            (1, false) => 0.4.into(),
            (_, false) => 0.8.into(),
            (0, true) => Spectrum::rgb([0.7, 0.5, 0.6]),
            (1, true) => Spectrum::rgb([0.2, 0.4, 0.5]),
            (_, true) => Spectrum::rgb([0.8, 0.6, 0.3]),
        };
    }
    spec.surfaces[0].emittance = if coloured { Spectrum::rgb([2.0, 1.0, 0.5]) } else { 2.0.into() };
    spec.surfaces[1].cell_emittance = vec![(1, 5.0.into())];
    spec.surfaces[4].emittance = if coloured { Spectrum::rgb([0.2, 0.3, 0.9]) } else { 0.3.into() };
    spec
}

fn group(name: &str, patches: &[(u32, u32)]) -> PatchGroup {
    PatchGroup { name: name.into(), patches: patches.into() }
}

/// The floor, the cell of the ceiling (with one that does not emit); the wall is left over.
fn sources() -> Vec<PatchGroup> {
    vec![group("floor", &[(0, 1)]), group("spot", &[(2, 3)])]
}

/// Pairs of opposed walls.
fn materials() -> Vec<PatchGroup> {
    vec![group("level", &[(0, 3)]), group("long", &[(4, 7)]), group("short", &[(8, 11)])]
}

fn experiment(spec: &SceneSpec, kind: EstimatorKind) -> Experiment {
    Experiment::new(Scene::build(spec, IndexChoice::Auto).unwrap(), Method::shooting(kind)).unwrap()
}

fn walk(experiment: &Experiment, seed: u64, walks: u64) -> Tally {
    let mut board = experiment.board();
    experiment.walk(&Sequence::new(seed), 0..walks, &mut board);
    board.take().unwrap()
}

/// A scene with other emittances: the factors of floor, spot and the wall.
fn scaled(spec: &SceneSpec, factors: [f64; 3]) -> SceneSpec {
    let mut spec = spec.clone();
    let times = |e: Spectrum, factor: f64| Spectrum::rgb(e.channels().map(|e| e * factor));
    spec.surfaces[0].emittance = times(spec.surfaces[0].emittance, factors[0]);
    spec.surfaces[1].cell_emittance[0].1 = times(spec.surfaces[1].cell_emittance[0].1, factors[1]);
    spec.surfaces[4].emittance = times(spec.surfaces[4].emittance, factors[2]);
    spec
}

/// B of every face, channel by channel.
fn truth(spec: &SceneSpec) -> Vec<Vec<f64>> {
    let exact = Exact::of_channels(spec, &|_| {}).unwrap();
    exact.iter().map(|exact| exact.solution().radiosity.clone()).collect()
}

/// How estimates lie to the truth.
#[derive(Default)]
struct Verdict {
    squares: f64,
    covered: u32,
    count: u32,
}

impl Verdict {
    fn add(&mut self, (value, error, [low, high]): (f64, f64, [f64; 2]), truth: f64) {
        let z = (value - truth) / error;
        self.squares += z * z;
        self.covered += u32::from(low <= truth && truth <= high);
        self.count += 1;
    }

    fn add_estimate(&mut self, estimate: &Estimate, truth: f64) {
        let &Estimate { radiosity, std_error, ci_low, ci_high, .. } = estimate;
        self.add((radiosity, std_error.unwrap(), [ci_low, ci_high]), truth);
    }

    fn add_derivative(&mut self, derivative: &Derivative, truth: f64) {
        let &Derivative { value, std_error, ci_low, ci_high } = derivative;
        self.add((value, std_error.unwrap(), [ci_low, ci_high]), truth);
    }

    fn mean_squared_z(&self) -> f64 {
        self.squares / f64::from(self.count)
    }

    fn coverage(&self) -> f64 {
        f64::from(self.covered) / f64::from(self.count)
    }
}

/// What is distinguished does not change what is found of all together, nor how walks end.
#[test]
fn sums_of_all_sources_are_those_without_sources() {
    for coloured in [false, true] {
        for kind in GOING_ON {
            let plain = experiment(&room(coloured), kind);
            let apart = plain.clone().with_groups(&sources(), &materials()).unwrap();
            let (without, with) = (walk(&plain, 3, 2_000), walk(&apart, 3, 2_000));
            assert_eq!(with.sums()[..without.sums().len()], *without.sums(), "{kind:?}");
            assert_eq!(with.counts, without.counts);
            assert_eq!(with.patches(), apart.rows());
            assert_eq!(apart.groups().unwrap().sources(), ["floor", "spot", Groups::REST]);
            // Source by source the light adds up.
            let all = Estimates::new(&apart, &with, LEVEL);
            let of = |source| Estimates::of_source(&apart, &with, LEVEL, source).unwrap();
            let each: Vec<Estimates> = (0..3).map(of).collect();
            for face in 0..12 {
                for (c, whole) in all.face(face).unwrap().iter().enumerate() {
                    let parts = || each.iter().map(|source| source.face(face).unwrap()[c]);
                    let sum: f64 = parts().map(|part| part.radiosity).sum();
                    assert!((sum - whole.radiosity).abs() < 1e-12 * sum, "{sum} and {}", whole.radiosity);
                    assert_eq!(parts().map(|part| part.hits).sum::<u128>(), whole.hits);
                }
            }
        }
    }
}

/// Tallies of parts of the walks add up to that of all, in any order: with groups, too.
#[test]
fn parts_of_the_walks_add_up() {
    for kind in [EstimatorKind::Collision, EstimatorKind::Infinite] {
        let apart = experiment(&room(false), kind).with_groups(&sources(), &materials()).unwrap();
        let whole = walk(&apart, 5, 3_000);
        let mut board = apart.board();
        let mut tally = apart.tally();
        for part in [2_000..3_000, 0..700, 700..2_000] {
            apart.walk(&Sequence::new(5), part, &mut board);
            board.add_to(&mut tally).unwrap();
        }
        assert_eq!(tally, whole);
    }
}

/// The light of a source is that of the scene with its emitters alone: 12 faces, 3 sources, 4 estimators and 10 seeds, in
/// grey and in colour. Were all independent, 1,440 squares of z would have a mean of 1 ± 0.037, and a coverage of 95 ± 0.6 %;
/// faces and sources depend on each other, so that four times as much is allowed for twice these errors.
#[test]
fn a_source_is_the_scene_with_its_emitters_alone() {
    for coloured in [false, true] {
        let mut verdict = Verdict::default();
        let truths = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
            .map(|factors| truth(&scaled(&room(coloured), factors)));
        for (seed, kind) in (11..51).zip(GOING_ON.into_iter().cycle()) {
            let apart = experiment(&room(coloured), kind).with_groups(&sources(), &[]).unwrap();
            let tally = walk(&apart, seed, 20_000);
            for (source, truth) in truths.iter().enumerate() {
                let estimates = Estimates::of_source(&apart, &tally, LEVEL, source).unwrap();
                for (c, truth) in truth.iter().enumerate() {
                    for (face, &truth) in truth.iter().enumerate() {
                        verdict.add_estimate(&estimates.face(face).unwrap()[c], truth);
                    }
                }
            }
        }
        let (z2, coverage) = (verdict.mean_squared_z(), verdict.coverage());
        assert!((0.7..1.3).contains(&z2), "mean squared z {z2}");
        assert!((0.90..0.99).contains(&coverage), "coverage {coverage}");
    }
}

/// Mixtures with a seed and factors of their own, against dense solutions and against fresh runs of the mixed scene:
/// (against solutions, mean squared z against runs).
fn mixtures(count: u64, walks: u64, coloured: bool) -> (Verdict, f64) {
    let (mut numbers, mut verdict) = (Numbers(22), Verdict::default());
    let (mut squares, mut differences) = (0.0, 0_u32);
    for mixture in 0..count {
        let kind = GOING_ON[(mixture % 4) as usize];
        let factors = std::array::from_fn(|_| numbers.between(0.0, 2.0));
        let mixed = scaled(&room(coloured), factors);
        let apart = experiment(&room(coloured), kind).with_groups(&sources(), &[]).unwrap();
        let apart = apart.with_mixture(&room(coloured), &factors).unwrap();
        let tally = walk(&apart, 100 + mixture, walks);
        let fresh = experiment(&mixed, kind);
        let fresh_tally = walk(&fresh, 90_000 + mixture, walks);
        let (combined, run) =
            (Estimates::new(&apart, &tally, LEVEL), Estimates::new(&fresh, &fresh_tally, LEVEL));
        for (c, truth) in truth(&mixed).iter().enumerate() {
            for (face, &truth) in truth.iter().enumerate() {
                let [ours, theirs] = [&combined, &run].map(|estimates| estimates.face(face).unwrap()[c]);
                verdict.add_estimate(&ours, truth);
                let variance = ours.std_error.unwrap().powi(2) + theirs.std_error.unwrap().powi(2);
                squares += (ours.radiosity - theirs.radiosity).powi(2) / variance;
                differences += 1;
            }
        }
    }
    (verdict, squares / f64::from(differences))
}

/// 24 mixtures of 12 faces: a mean squared z of 1 ± 0.35, by the spread between 24 correlated sets of some 5 degrees of
/// freedom each about 5 standard errors.
#[test]
fn mixtures_are_fresh_runs_of_the_mixed_scene() {
    for coloured in [false, true] {
        let (verdict, between) = mixtures(24, 20_000, coloured);
        for z2 in [verdict.mean_squared_z(), between] {
            assert!((0.65..1.35).contains(&z2), "mean squared z {z2}");
        }
        assert!(verdict.coverage() > 0.925, "coverage {}", verdict.coverage());
    }
}

/// Issue 22 asks for 200 mixtures, with a coverage of 94 to 96 %.
#[test]
#[ignore = "takes a minute"]
fn two_hundred_mixtures_have_true_intervals() {
    for coloured in [false, true] {
        let (verdict, between) = mixtures(200, 100_000, coloured);
        let (z2, coverage) = (verdict.mean_squared_z(), verdict.coverage());
        println!(
            "coloured {coloured}: z² {z2:.4} to solutions, {between:.4} to runs; coverage {coverage:.4}"
        );
        assert!((0.9..1.1).contains(&z2) && (0.9..1.1).contains(&between), "mean squared z {z2}, {between}");
        assert!((0.94..0.96).contains(&coverage), "coverage {coverage}");
    }
}

/// A mixture that is the scene itself is reported as the scene itself, to the bit; and of half the light everything is half.
#[test]
fn equal_factors_change_nothing_but_the_scale() {
    let plain = experiment(&room(false), EstimatorKind::Collision).with_groups(&sources(), &[]).unwrap();
    let tally = walk(&plain, 1, 4_000);
    let of = |factor: f64| plain.clone().with_mixture(&room(false), &[factor; 3]).unwrap();
    let (same, half) = (of(1.0), of(0.5));
    let [plain, same, half] =
        [&plain, &same, &half].map(|experiment| Estimates::new(experiment, &tally, LEVEL));
    for face in 0..12 {
        let [plain, same, half] = [&plain, &same, &half].map(|estimates| estimates.face(face).unwrap()[0]);
        assert_eq!(plain, same);
        for (whole, half) in [(plain.radiosity, half.radiosity), (plain.ci_high, half.ci_high)] {
            assert!((whole - 2.0 * half).abs() < 1e-14 * whole, "{whole} and {half}");
        }
    }
    assert!(half.scene().faces().get(0).emittance[0] == 1.0, "the mixture's own E");
}

/// B of every face, channel by channel, where one material has another reflectance.
fn with_reflectance(spec: &SceneSpec, material: usize, by: f64) -> Vec<Vec<f64>> {
    let mut spec = spec.clone();
    for surface in &mut spec.surfaces[2 * material..2 * material + 2] {
        surface.reflectance = Spectrum::rgb(surface.reflectance.channels().map(|r| r + by));
    }
    truth(&spec)
}

/// Derivatives by reflectances and emittances of `runs` runs for each estimator, against central differences of solutions.
fn derivatives(spec: &SceneSpec, runs: u64, walks: u64) -> [Verdict; 2] {
    const STEP: f64 = 1e-4;
    let mut verdicts = [Verdict::default(), Verdict::default()];
    let differences: Vec<[Vec<Vec<f64>>; 2]> =
        (0..3).map(|material| [STEP, -STEP].map(|step| with_reflectance(spec, material, step))).collect();
    let alone = truth(&scaled(spec, [0.0, 0.0, 1.0]));
    for (estimator, kind) in (0..).zip(GOING_ON) {
        let apart = experiment(spec, kind).with_groups(&[], &materials()).unwrap();
        for run in 0..runs {
            let tally = walk(&apart, 1000 * (estimator + 1) + run, walks);
            let influences = Influences::new(&apart, &tally, LEVEL).unwrap();
            for (material, [above, below]) in differences.iter().enumerate() {
                for face in 0..12 {
                    let by_r = influences.of(material, Property::Reflectance, face);
                    for (c, derivative) in by_r.iter().enumerate() {
                        let truth = (above[c][face] - below[c][face]) / (2.0 * STEP);
                        verdicts[0].add_derivative(&derivative.unwrap(), truth);
                    }
                }
            }
            for face in 0..12 {
                // The lamps of the first material do not emit alike, and the second has none.
                for material in [0, 1] {
                    let by_e = influences.of(material, Property::Emittance, face);
                    assert!(by_e.iter().all(Option::is_none));
                }
                let by_e = influences.of(2, Property::Emittance, face);
                let truths = alone.iter().map(|of_channel| of_channel[face]);
                for ((c, derivative), truth) in by_e.iter().enumerate().zip(truths) {
                    verdicts[1].add_derivative(&derivative.unwrap(), truth / spec.surfaces[4].emittance[c]);
                }
            }
        }
    }
    verdicts
}

/// Four estimators, 3 materials, 12 faces, in grey and in colour. Marks of one walk are far apart, so that 1 ± 0.35 is
/// about 5 standard errors of a mean squared z here.
#[test]
fn derivatives_are_differences_of_solutions() {
    for coloured in [false, true] {
        for verdict in derivatives(&room(coloured), 3, 30_000) {
            let (z2, coverage) = (verdict.mean_squared_z(), verdict.coverage());
            assert!((0.65..1.35).contains(&z2), "mean squared z {z2}");
            assert!(coverage > 0.92, "coverage {coverage}");
        }
    }
}

/// Issue 22 asks for a mean squared z within 1 ± 0.1 in three boxes.
#[test]
#[ignore = "takes minutes"]
fn derivatives_in_three_boxes_have_true_intervals() {
    let mut bright = room(false);
    bright.surfaces.iter_mut().for_each(|surface| surface.reflectance = 0.9.into());
    for (name, spec) in [("grey", room(false)), ("coloured", room(true)), ("bright", bright)] {
        for (verdict, by) in derivatives(&spec, 50, 100_000).iter().zip(["R", "E"]) {
            let (z2, coverage) = (verdict.mean_squared_z(), verdict.coverage());
            println!("{name}, by {by}: z² {z2:.4}, coverage {coverage:.4} of {}", verdict.count);
            assert!((0.9..1.1).contains(&z2), "mean squared z {z2}");
            assert!((0.94..0.96).contains(&coverage), "coverage {coverage}");
        }
    }
}
