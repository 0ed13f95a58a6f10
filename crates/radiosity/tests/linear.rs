//! The linear basis: slopes of scores, and what they tell of the light's spread over patches.

use crate::common::{box_scene, cube54, quad, surface};
use glam::DVec3;
use radiosity::{
    Birth, Chains, Direction, Estimates, Estimator, EstimatorKind, Experiment, IndexChoice, Method, Scene,
    SceneSpec, Sequence, Shape, Sides, Space, Spectrum, Tally, Walks,
    methods::{BatchScore, Batches, InfiniteEnd, Sampler, Score, Solve},
};

/// A room with all that scenes may have: cells, a two-sided plate, a triangle in rows and one of a single cell.
fn room() -> SceneSpec {
    let mut spec = cube54();
    let plate = quad(DVec3::new(0.3, 0.2, 0.5), DVec3::X * 0.5, DVec3::new(0.0, 0.4, 0.1), [2, 3]);
    let triangle = |rows, z: f64| Shape::Triangle {
        a: DVec3::new(0.2, 0.2, z),
        b: DVec3::new(0.8, 0.3, z),
        c: DVec3::new(0.4, 0.9, z + 0.1),
        rows,
    };
    for shape in [plate, triangle(3, 0.2), triangle(1, 0.7)] {
        spec.surfaces.push(radiosity::SurfaceSpec {
            sides: Sides::Both,
            emittance: 0.2.into(),
            ..surface(shape, 0.6)
        });
    }
    spec
}

fn coloured(mut spec: SceneSpec) -> SceneSpec {
    spec.surfaces[1].reflectance = Spectrum::rgb([0.9, 0.3, 0.1]);
    spec.surfaces[6].emittance = Spectrum::rgb([0.0, 0.1, 0.9]);
    spec
}

/// The room with groups: two walls whole and bent into one, halves of a third, both plates of triangles as one patch of two sides.
fn grouped(spec: SceneSpec) -> SceneSpec {
    let label = |cell: u32| match cell {
        18..36 => 18,
        36..45 => 36 + (cell - 36) / 5,
        60.. => 60,
        _ => cell,
    };
    let mut spec = spec;
    spec.surfaces[3].reflectance = spec.surfaces[2].reflectance;
    spec.grouped(&(0..70).map(label).collect::<Vec<u32>>())
}

fn experiment(spec: &SceneSpec, method: impl Into<Method>) -> Experiment {
    Experiment::new(Scene::build(spec, IndexChoice::Auto).unwrap(), method).unwrap()
}

fn tally(experiment: &Experiment, seed: u64, walks: std::ops::Range<u64>) -> Tally {
    let mut board = experiment.board();
    experiment.walk(&Sequence::new(seed), walks, &mut board);
    board.take().unwrap()
}

fn walks(direction: Direction, space: Space, score: Score) -> Method {
    Walks { direction, space, score }.into()
}

/// Chains of links of some rays.
fn chains(rays: u64, linear: bool) -> Method {
    Chains { rays, linear, solve: Solve::Links, final_gather: vec![] }.into()
}

const ROULETTE: Estimator = Estimator::Infinite(InfiniteEnd::Roulette { threshold: 0.01 });

/// Every method that has slopes, beside the one that has none.
fn methods() -> Vec<[Method; 2]> {
    let estimators = [
        Estimator::Collision,
        Estimator::Absorption,
        Estimator::Survival,
        Estimator::Direct,
        ROULETTE,
        Estimator::Infinite(InfiniteEnd::Length { length: 4 }),
    ];
    let mut methods = Vec::new();
    for space in [Space::Discrete, Space::Continuous] {
        for estimator in estimators {
            for direction in [Direction::Shooting, Direction::Gathering(Birth::Area)] {
                methods.push(
                    [Score::Of(estimator), Score::Linear(estimator)]
                        .map(|score| walks(direction.clone(), space, score)),
                );
            }
            methods.push(
                [BatchScore::Of(estimator, space), BatchScore::Linear(estimator, space)]
                    .map(|score| Method::Batches(Batches { walks: 50, sampler: Sampler::Sobol, score })),
            );
        }
    }
    methods.push([false, true].map(|linear| chains(600, linear)));
    // Rays enough for shadow rays.
    methods.push([false, true].map(|linear| chains(1_200, linear)));
    methods
}

/// What a patch's mean is made of does not depend on whether slopes are asked for.
#[test]
fn means_are_those_of_a_constant_job() {
    for spec in [room(), coloured(room()), grouped(coloured(room()))] {
        for [constant, linear] in methods() {
            let [constant, linear] = [constant, linear].map(|method| experiment(&spec, method));
            let samples = 6_000 / constant.unit().paths();
            let [a, b] = [&constant, &linear].map(|experiment| tally(experiment, 7, 3..samples));
            assert_eq!(a.counts, b.counts);
            for face in 0..constant.scene().faces().len() {
                for channel in 0..constant.scene().channels() {
                    assert_eq!(a.patch(face, channel), b.patch(face, channel), "{:?}", linear.method());
                }
                assert_eq!(a.events(face), b.events(face));
            }
        }
    }
}

/// A continuous walk does not know how surfaces are cut. On cells that are a step of ψ wide, its hits alone tell its slopes:
/// walk by walk, to the last bit.
#[test]
fn slopes_are_those_of_the_hits() {
    const STEPS: u32 = 4096;
    let cut = |cells: [u32; 2]| {
        let mut spec = box_scene(DVec3::new(1.0, 2.0, 0.7), [1, 1]);
        // The emitter is not the floor, whose cells are distinguished by births.
        spec.surfaces[0].cell_emittance.clear();
        spec.surfaces[1].emittance = 1.0.into();
        spec.surfaces[0].reflectance = 0.9.into();
        let Shape::Parallelogram { cells: floor, .. } = &mut spec.surfaces[0].shape else { unreachable!() };
        *floor = cells;
        spec
    };
    let score = Score::Linear(Estimator::Collision);
    let linear = experiment(&cut([2, 2]), walks(Direction::Shooting, Space::Continuous, score));
    for (k, cells) in [[2 * STEPS, 2], [2, 2 * STEPS]].into_iter().enumerate() {
        let fine = walks(Direction::Shooting, Space::Continuous, Score::Of(Estimator::Collision));
        let fine = experiment(&cut(cells), fine);
        let (mut sums, mut squares, mut together) = ([0_i128; 4], [0_u128; 4], linear.tally());
        for walk in 0..300 {
            let [hits, slopes] = [&fine, &linear].map(|experiment| tally(experiment, 11, walk..walk + 1));
            together.merge(&slopes).unwrap();
            let mut of_walk = [0_i128; 4];
            for cell in 0..cells[0] * cells[1] {
                let (i, j) = (cell / cells[1], cell % cells[1]);
                let [i, j] = if k == 0 { [i / STEPS, j] } else { [i, j / STEPS] };
                let step = [cell / cells[1], cell % cells[1]][k] % STEPS;
                let psi = i128::from(2 * step + 1) - i128::from(STEPS);
                of_walk[(2 * i + j) as usize] += psi * hits.patch(cell as usize, 0)[0] as i128;
            }
            for (face, slope) in of_walk.into_iter().enumerate() {
                sums[face] += slope;
                squares[face] += slope.unsigned_abs().pow(2);
            }
        }
        for face in 0..4 {
            assert_eq!(together.slope(face, 0, k), (sums[face], squares[face]), "face {face}, axis {k}");
            assert!(squares[face] > 0);
        }
    }
}

/// All methods estimate one answer: of each two the mean of z² over gradients is 1 within five of its standard errors, √(2/n)
/// of n numbers that hardly depend on each other, and twice that for dependent ones. Where nothing is wrong, one of the 27
/// comparisons exceeds that once in 10,000.
#[test]
fn methods_agree_on_gradients() {
    for spec in [room(), coloured(room()), grouped(room())] {
        for space in [Space::Discrete, Space::Continuous] {
            // Walks number 10⁷ and on, for others than those of the reference.
            let solve = |method: Method, first: u64, samples: u64| {
                let experiment = experiment(&spec, method);
                let first = first / experiment.unit().paths();
                let tally = tally(&experiment, 5, first..first + samples);
                let estimates = Estimates::new(&experiment, &tally, 0.95);
                let faces = 0..experiment.scene().faces().len();
                let channels = faces.flat_map(|i| estimates.slopes(i).unwrap());
                channels.map(|s| (s.gradient, s.gradient_error.unwrap())).collect::<Vec<_>>()
            };
            let shooting = |estimator| walks(Direction::Shooting, space, Score::Linear(estimator));
            let reference = solve(shooting(Estimator::Collision), 0, 400_000);
            let gathering = Direction::Gathering(Birth::Uniform);
            let batches = Batches {
                walks: 5_000,
                sampler: Sampler::Random,
                score: BatchScore::Linear(Estimator::Collision, space),
            };
            let mut others = vec![
                (shooting(Estimator::Absorption), 400_000),
                (shooting(ROULETTE), 200_000),
                (walks(gathering, space, Score::Linear(EstimatorKind::Collision.into())), 1_500_000),
                (batches.into(), 60),
            ];
            if space == Space::Discrete {
                others.push((chains(20_000, true), 60));
            }
            for (method, samples) in others {
                let words = format!("{method:?}");
                let other = solve(method, 10_000_000, samples);
                let z = reference.iter().zip(&other).flat_map(|((a, a_error), (b, b_error))| {
                    (0..2).map(move |k| (a[k] - b[k]) / a_error[k].hypot(b_error[k]))
                });
                let z: Vec<f64> = z.collect();
                let mean = z.iter().map(|z| z * z).sum::<f64>() / z.len() as f64;
                let limit = 5.0 * 2.0 * (2.0 / z.len() as f64).sqrt();
                println!("{words}: {mean:.3} of {}", z.len());
                assert!((mean - 1.0).abs() < limit, "{words}: {mean}, {limit}");
            }
        }
    }
}
