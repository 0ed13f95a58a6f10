//! Surfaces that are cut into rectangles of different sizes.

use crate::common::{quad, room_with_plates};
use radiosity::{
    Birth, Chains, Direction, Estimator, Experiment, IndexChoice, Method, Scene, SceneError, SceneSpec,
    Sequence, Shape, Side, Solution, Space, Spectrum, Tally, Walks,
    methods::{BatchScore, Batches, Iterations, Sampler, Score, Solve},
    surfaces::{Faces, Leaves},
};
use stats::Measured;

/// A cube of 54 cells in which a plate of two sides and a triangle in rows hang.
fn room() -> SceneSpec {
    room_with_plates([1, 1])
}

fn coloured(mut spec: SceneSpec) -> SceneSpec {
    spec.surfaces[1].reflectance = Spectrum::rgb([0.9, 0.3, 0.1]);
    spec.surfaces[0].cell_emittance = vec![(4, Spectrum::rgb([1.0, 0.5, 0.1]))];
    spec
}

/// The scene with some surfaces cut otherwise.
fn cut(mut spec: SceneSpec, cuts: &[(usize, &Leaves)]) -> SceneSpec {
    for &(number, leaves) in cuts {
        let (corner, u, v) = spec.surfaces[number].shape.edges();
        let (corner_u, corner_v) = (corner + u, corner + v);
        spec.surfaces[number].shape = Shape::Divided { corner, corner_u, corner_v, leaves: leaves.clone() };
    }
    spec
}

fn on_grid(mut spec: SceneSpec, surfaces: &[usize], grid: [u32; 2]) -> SceneSpec {
    for &number in surfaces {
        let (corner, u, v) = spec.surfaces[number].shape.edges();
        spec.surfaces[number].shape = quad(corner, u, v, grid);
    }
    spec
}

fn experiment(spec: &SceneSpec, method: impl Into<Method>) -> Experiment {
    Experiment::new(Scene::build(spec, IndexChoice::Auto).unwrap(), method).unwrap()
}

fn tally(experiment: &Experiment, seed: u64, walks: u64) -> Tally {
    let mut board = experiment.board();
    experiment.walk(&Sequence::new(seed), 0..walks, &mut board);
    board.take().unwrap()
}

fn methods() -> Vec<Method> {
    let mut methods = Vec::new();
    for space in [Space::Discrete, Space::Continuous] {
        for direction in [Direction::Shooting, Direction::Gathering(Birth::Area)] {
            for score in [Score::Of, Score::Linear] {
                let score = score(Estimator::Collision);
                methods.push(Walks { direction: direction.clone(), space, score }.into());
            }
        }
    }
    methods
}

/// Chains and batches, and how many of them are tried.
fn chains() -> Vec<(Method, u64)> {
    let links = |final_gather| Chains { rays: 2_000, linear: false, solve: Solve::Links, final_gather };
    let iterations = Solve::Iterations(Iterations::default());
    let score = BatchScore::Of(Estimator::Collision, Space::Discrete);
    vec![
        (links(vec![]).into(), 8),
        (links(vec![1, 3]).into(), 8),
        (Chains { rays: 2_000, linear: false, solve: iterations, final_gather: vec![] }.into(), 8),
        (Batches { walks: 1_024, sampler: Sampler::Sobol, score }.into(), 8),
    ]
}

fn is_shooting(method: &Method) -> bool {
    matches!(method, Method::Walks(Walks { direction: Direction::Shooting, .. }))
}

/// A leaf that is all of its surface is the surface of one cell, to the last bit, by every method, in grey and in colour.
#[test]
fn a_surface_of_one_leaf_is_one_of_one_cell() {
    let all = [1, 2, 3, 4, 5, 6];
    let whole = Leaves::whole();
    for spec in [room(), coloured(room())] {
        let plain = on_grid(spec.clone(), &all, [1, 1]);
        let divided = cut(spec, &all.map(|surface| (surface, &whole)));
        for (method, samples) in methods().into_iter().map(|method| (method, 10_000)).chain(chains()) {
            let [a, b] = [&plain, &divided].map(|spec| tally(&experiment(spec, method.clone()), 5, samples));
            assert_eq!(a, b, "{method:?}");
        }
    }
}

/// The face of each leaf of a scene and the one of another scene that has the leaf's place on a grid.
fn twins(divided: &Faces, plain: &Faces, surface: u32, leaves: &Leaves) -> Vec<[usize; 2]> {
    let mut twins = Vec::new();
    for side in [Side::Front, Side::Back] {
        let firsts = [divided, plain].map(|faces| faces.first_piece_on(surface, side));
        let [Some(first), Some(other)] = firsts else { continue };
        twins.extend((0..).zip(leaves.iter()).map(|(number, leaf)| {
            let cell = leaf.at[0] * leaf.grid()[1] + leaf.at[1];
            [(first + number) as usize, (other + cell) as usize]
        }));
    }
    twins
}

/// Leaves that are the cells of a grid score as these do, to the last bit, and lie where they do.
#[test]
fn leaves_of_one_size_are_cells_of_a_grid() {
    let leaves = Leaves::grow(|part| match part.levels {
        [0, _] => Some(0),
        [_, 0..=1] => Some(1),
        [1, 2] => Some(0),
        _ => None,
    });
    assert_eq!((leaves.len(), leaves.grid()), (16, [4, 4]));
    let all = [1, 2, 3, 4, 5, 6];
    for spec in [room(), coloured(room())] {
        let plain = on_grid(spec.clone(), &all, [4, 4]);
        let divided = cut(spec, &all.map(|surface| (surface, &leaves)));
        // Births of gathering walks are drawn among cells in their order, which is another one.
        for method in methods().into_iter().filter(is_shooting) {
            let both = [&plain, &divided].map(|spec| experiment(spec, method.clone()));
            let [a, b] = both.each_ref().map(|experiment| tally(experiment, 5, 20_000));
            assert_eq!(a.counts, b.counts);
            let [of_plain, of_divided] = both.each_ref().map(|experiment| experiment.scene().faces());
            for surface in all {
                for [leaf, cell] in twins(of_divided, of_plain, surface as u32, &leaves) {
                    let (x, y) = (of_plain.get(cell), of_divided.get(leaf));
                    assert_eq!((x.area, x.centroid, x.side), (y.area, y.centroid, y.side));
                    let [x, y] = [(of_plain, cell), (of_divided, leaf)]
                        .map(|(faces, i)| faces.piece_corners(i as u32));
                    assert_eq!(x, y);
                    for channel in 0..both[0].scene().channels() {
                        assert_eq!(a.patch(cell, channel), b.patch(leaf, channel), "{method:?}");
                        if method.is_linear() {
                            let slope = |tally: &Tally, i| [0, 1].map(|k| tally.slope(i, channel, k));
                            assert_eq!(slope(&a, cell), slope(&b, leaf), "{method:?}");
                        }
                    }
                }
            }
        }
    }
}

/// Rectangles cut at random, from 1 to 8 levels deep.
fn random_leaves(seed: u64) -> Leaves {
    let mut state = seed;
    Leaves::grow(|part| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let (lot, depth) = (state >> 60, part.levels[0] + part.levels[1]);
        (depth == 0 || depth < 8 && lot < 11).then_some(usize::from(lot % 2 == 1))
    })
}

/// Continuous walks are the same on leaves and on a fine grid: the hits of a leaf are those of its cells, exactly, and its slopes follow
/// from theirs, up to a slope unit for each hit and each of the roundings on both sides.
#[test]
fn leaves_add_up_what_finer_cells_have_scored() {
    const FINE: u32 = 256;
    let all = [1, 3, 6];
    let trees = [11, 12, 13].map(random_leaves);
    assert!(trees.iter().all(|leaves| leaves.len() > 4), "{trees:?}");
    let cuts: Vec<(usize, &Leaves)> = all.into_iter().zip(&trees).collect();
    let method = Walks {
        direction: Direction::Shooting,
        space: Space::Continuous,
        score: Score::Linear(Estimator::Collision),
    };
    let both = [on_grid(room(), &all, [FINE, FINE]), cut(room(), &cuts)]
        .map(|spec| experiment(&spec, method.clone()));
    let [fine, own] = both.each_ref().map(|experiment| tally(experiment, 5, 100_000));
    let [of_fine, of_own] = both.each_ref().map(|experiment| experiment.scene().faces());
    let unit = fine.layout().slope_units() as f64;
    for (surface, leaves) in all.into_iter().zip(&trees) {
        for side in [Side::Front, Side::Back] {
            let firsts = [of_own, of_fine].map(|faces| faces.first_piece_on(surface as u32, side));
            let [Some(first), Some(first_fine)] = firsts else { continue };
            for (number, leaf) in leaves.iter().enumerate() {
                let size = leaf.grid().map(|n| FINE / n);
                let (mut hits, mut slopes) = (0, [0.0; 2]);
                for (i, j) in (0..size[0]).flat_map(|i| (0..size[1]).map(move |j| (i, j))) {
                    let cell = [leaf.at[0] * size[0] + i, leaf.at[1] * size[1] + j];
                    let face = (first_fine + cell[0] * FINE + cell[1]) as usize;
                    let score = fine.patch(face, 0)[0];
                    hits += score;
                    for (k, at) in [i, j].into_iter().enumerate() {
                        // ψ of the leaf is that of the cell's middle, and the cell's own ψ, as narrow as the cell.
                        let middle = (2.0 * f64::from(at) + 1.0) / f64::from(size[k]) - 1.0;
                        let (slope, _) = fine.slope(face, 0, k);
                        slopes[k] += unit * middle * score as f64 + slope as f64 / f64::from(size[k]);
                    }
                }
                let face = first as usize + number;
                assert_eq!(own.patch(face, 0)[0], hits, "surface {surface}, leaf {number}");
                for (k, slope) in slopes.into_iter().enumerate() {
                    let off = (own.slope(face, 0, k).0 as f64 - slope).abs();
                    assert!(off <= 2.0 * hits as f64 + 1e-6, "leaf {number}: {off} units of {hits} hits");
                }
            }
        }
    }
}

/// Σ of squared z-scores of means and gradients of shooting against those of gathering walks, and their number.
fn squared_scores(spec: &SceneSpec, space: Space) -> (f64, usize) {
    let of = |direction: Direction| {
        let score = Score::Linear(Estimator::Collision);
        let experiment = experiment(spec, Walks { direction, space, score });
        let tally = tally(&experiment, 3, 1 << 20);
        let channels = 0..experiment.scene().channels();
        let faces = 0..experiment.scene().faces().len();
        let fits = faces.flat_map(|face| channels.clone().map(move |channel| (face, channel)));
        fits.map(|(face, channel)| experiment.fit(&tally, face, channel).unwrap()).collect::<Vec<_>>()
    };
    let [shot, gathered] = [of(Direction::Shooting), of(Direction::Gathering(Birth::Area))];
    let (mut sum, mut count) = (0.0, 0);
    for (a, b) in shot.iter().zip(&gathered) {
        let variance = a.mean_variance + b.mean_variance;
        if variance > 0.0 {
            // The gradients' own variances add up to that of the fit: ∫ψ_k² is 1/12 of a squared gradient in a parallelogram.
            let off: f64 = (0..2).map(|k| (a.gradient[k] - b.gradient[k]).powi(2) / 12.0).sum();
            let noise = a.slope_variance + b.slope_variance;
            sum += (a.mean - b.mean).powi(2) / variance + 2.0 * off / noise;
            count += 3;
        }
    }
    (sum, count)
}

/// Two ways to the same light that share no births and no scores, on rectangles cut at random, in both spaces and in colour: the mean
/// squared z-score of means and gradients is 1. With n scores its standard error is √(2/n), a tenth more for the gradients that share
/// their noise: below 5 standard errors (false-alarm rate 10⁻⁶).
#[test]
fn gathering_finds_what_shooting_finds_on_leaves() {
    let trees = [21, 22, 23, 24, 25, 26].map(random_leaves);
    let cuts: Vec<(usize, &Leaves)> = (1..=6).zip(&trees).collect();
    for (spec, space) in [
        (room(), Space::Continuous),
        (room(), Space::Discrete),
        (coloured(room()), Space::Continuous),
        (coloured(room()), Space::Discrete),
    ] {
        let mut spec = cut(spec, &cuts);
        // Parallelograms alone, whose gradients weigh alike.
        spec.surfaces.truncate(7);
        let (sum, count) = squared_scores(&spec, space);
        let n = count as f64;
        println!("{space:?}: {} of {count}", sum / n);
        assert!(count > 100 && (sum / n - 1.0).abs() < 5.0 * 1.1 * (2.0 / n).sqrt(), "{} of {n}", sum / n);
    }
}

/// The mean squared z-score of what chains find against walks, over all patches and channels.
fn squared_scores_of_chains(chained: &Experiment, walked: &Experiment, seed: u64) -> f64 {
    const CHAINS: u64 = 256;
    let (chains, walks) = (tally(chained, seed, CHAINS), tally(walked, seed + 1_000, 1 << 20));
    let [a, b] = [(chained, &chains), (walked, &walks)].map(|(e, tally)| Solution::new(e, tally, 0.95));
    let squares: Vec<f64> = (0..chained.scene().faces().len())
        .flat_map(|face| a.face(face).unwrap().into_iter().zip(b.face(face).unwrap()))
        .filter_map(|(a, b)| {
            let [of_chains, of_walks] = [a.std_error?, b.std_error?];
            let variance = of_chains * of_chains + of_walks * of_walks;
            (variance > 0.0).then(|| (a.radiosity - b.radiosity).powi(2) / variance)
        })
        .collect();
    assert!(squares.len() > 100);
    squares.iter().sum::<f64>() / squares.len() as f64
}

/// Chains, whose final gather is of two leaves, against walks that know no chain, on rectangles cut at random, in grey and in colour. The mean squared z-score
/// of each of eight seeds is a sample of its own, since the patches of a chain depend on each other: their mean is 1 within 4.5 of its own
/// standard errors, and 0.01 for the errors of 256 chains. With Student's 7 degrees of freedom the false-alarm rate of each is 3·10⁻³,
/// once and for all with these seeds.
#[test]
fn chains_find_what_walks_find_on_leaves() {
    let trees = [21, 22, 23, 24, 25, 26].map(random_leaves);
    let cuts: Vec<(usize, &Leaves)> = (1..=6).zip(&trees).collect();
    for spec in [room(), coloured(room())] {
        let spec = cut(spec, &cuts);
        let walks = Walks {
            direction: Direction::Shooting,
            space: Space::Discrete,
            score: Score::Of(Estimator::Collision),
        };
        let chains = Chains { rays: 1 << 13, linear: false, solve: Solve::Links, final_gather: vec![20, 30] };
        let (chained, walked) = (experiment(&spec, chains), experiment(&spec, walks));
        let found: Vec<f64> = (1..=8).map(|seed| squared_scores_of_chains(&chained, &walked, seed)).collect();
        let mean = Measured::of(&found);
        println!("{mean:?}");
        assert!((mean.value - 1.0).abs() < 4.5 * mean.standard_error + 0.01, "{mean:?}");
    }
}

/// Light is emitted by leaves in proportion to their areas: a wall that glows evenly makes the same light however it is cut. Six walls
/// and both sides of the plate, differences of 2²⁰ walks each: below 4.5 standard errors (false-alarm rate 10⁻⁴).
#[test]
fn leaves_emit_by_their_areas() {
    for emittance in [Spectrum::from(1.0), Spectrum::rgb([1.0, 0.4, 0.1])] {
        let glowing = |leaves: &Leaves| {
            let mut spec = on_grid(room(), &[0, 1, 2, 3, 4, 5], [1, 1]);
            spec.surfaces[0].cell_emittance.clear();
            for surface in [2, 6] {
                spec.surfaces[surface].emittance = emittance;
            }
            let spec = cut(spec, &[(2, leaves), (6, leaves)]);
            let score = Score::Of(Estimator::Collision);
            let walks = Walks { direction: Direction::Shooting, space: Space::Continuous, score };
            (Scene::build(&spec, IndexChoice::Auto).unwrap().total_power(0), experiment(&spec, walks))
        };
        let [(power, whole), (same_power, parted)] = [glowing(&Leaves::whole()), glowing(&random_leaves(31))];
        assert!((power / same_power - 1.0).abs() < 1e-12);
        let [a, b] = [(&whole, 1), (&parted, 2)].map(|(experiment, seed)| tally(experiment, seed, 1 << 20));
        for surface in [0, 1, 3, 4, 5, 7] {
            for channel in 0..whole.scene().channels() {
                let sums = [(&whole, &a), (&parted, &b)].map(|(experiment, tally)| {
                    let faces = experiment.scene().faces();
                    let first = faces.first_piece_on(surface, Side::Front).unwrap();
                    tally.patch(first as usize, channel)
                });
                let n = (1_u64 << 20) as f64;
                let moments = sums.map(|sums| [sums[0] as f64 / n, sums[1] as f64 / n]);
                let variance: f64 = moments.iter().map(|[mean, square]| (square - mean * mean) / n).sum();
                let off = (moments[0][0] - moments[1][0]).abs();
                assert!(off < 4.5 * variance.sqrt(), "surface {surface}: {off} of {}", variance.sqrt());
            }
        }
    }
}

/// Tables of too many cells are refused when the scene is built.
#[test]
fn too_many_cells_are_refused() {
    let deep = Leaves::grow(|part| match part {
        part if part.at != [0, 0] => None,
        part if part.levels[0] < Leaves::MOST_CUTS => Some(0),
        _ => Some(1),
    });
    assert_eq!((deep.len(), deep.grid()), (21, [1024, 1024]));
    let mut spec = cut(room(), &[(1, &deep)]);
    assert!(Scene::build(&spec, IndexChoice::Auto).is_ok());
    let wall = spec.surfaces[1].clone();
    spec.surfaces.extend(std::iter::repeat_n(wall, 16));
    let error = Scene::build(&spec, IndexChoice::Auto).unwrap_err();
    assert!(matches!(&error, SceneError::Whole(problem) if problem.contains("grids of")), "{error}");
}
