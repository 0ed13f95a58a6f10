//! Patches that are groups of cells.

use crate::common::{box_scene, experiment, quad, room_with_plates, surface, walk};
use glam::DVec3;
use radiosity::{
    Estimator, Experiment, IndexChoice, Scene, SceneError, SceneSpec, Shape, Side, Space, Spectrum, Unfit,
    Walks,
    methods::{BatchScore, Batches, InfiniteEnd, Sampler},
    surfaces::Face,
};

const ROULETTE: Estimator = Estimator::Infinite(InfiniteEnd::Roulette { threshold: 0.01 });

/// A cube of 54 cells in which two plates of two sides hang, a parallelogram and a triangle in rows.
fn room() -> SceneSpec {
    let mut spec = room_with_plates([2, 3]);
    spec.surfaces[6..].iter_mut().for_each(|plate| plate.emittance = 0.2.into());
    spec
}

/// The room with groups: the second wall is one patch, of the third every row; the plates are one patch of two sides, but for one
/// cell of each.
fn labels() -> Vec<u32> {
    let label = |cell: u32| match cell {
        9..18 => 9,
        18..27 => 18 + (cell - 18) / 3,
        54 | 60 => cell,
        55.. => 55,
        _ => cell,
    };
    (0..64).map(label).collect()
}

fn coloured(mut spec: SceneSpec) -> SceneSpec {
    spec.surfaces[1].reflectance = Spectrum::rgb([0.9, 0.3, 0.1]);
    spec.surfaces[0].cell_emittance = vec![(4, Spectrum::rgb([1.0, 0.5, 0.1]))];
    spec
}

/// The scores of a group are those of its members, added up: continuous walks are the same with and without groups. To the last
/// unit, for every estimator, in grey and in colour, with and without a tree.
#[test]
fn sums_of_a_group_are_those_of_its_members() {
    let estimators = [Estimator::Collision, Estimator::Absorption, Estimator::Survival, ROULETTE];
    for spec in [room(), coloured(room())] {
        for (estimator, index) in estimators.into_iter().zip([IndexChoice::Flat, IndexChoice::Tree].repeat(2))
        {
            let method = Walks { space: Space::Continuous, ..Walks::shooting(estimator) };
            let fine = experiment(&spec, index, method.clone());
            let grouped = experiment(&spec.clone().grouped(&labels()), index, method);
            let [alone, together] = [&fine, &grouped].map(|experiment| walk(experiment, 5, 0..20_000));
            assert_eq!(alone.counts, together.counts);
            let faces = grouped.scene().faces();
            assert_eq!((faces.len(), faces.piece_count(), faces.patch_count()), (46, 74, 43));
            for face in 0..faces.len() {
                for channel in 0..grouped.scene().channels() {
                    let members = faces.pieces(face).map(|piece| alone.patch(piece as usize, channel)[0]);
                    let sum: u128 = members.sum();
                    assert_eq!(together.patch(face, channel)[0], sum, "{estimator:?}, face {face}");
                }
            }
        }
    }
}

/// A scene that is cut anew from another one of the same surfaces is the scene that is built of them, to the last unit of every score.
#[test]
fn a_scene_that_is_cut_anew_is_built_so() {
    let mut layered = room();
    layered.surfaces.push(layered.surfaces[6].clone());
    for (spec, labels) in [(room(), labels()), (layered, Vec::new())] {
        let other = if labels.is_empty() { spec.clone() } else { spec.clone().grouped(&labels) };
        for index in [IndexChoice::Flat, IndexChoice::Tree] {
            let built = Scene::build(&other, index).unwrap();
            let mut coarse = spec.clone();
            let Shape::Parallelogram { cells, .. } = &mut coarse.surfaces[1].shape else { unreachable!() };
            *cells = [1, 1];
            let cut = Scene::build(&coarse, index).unwrap().recut(&other).unwrap();
            assert_eq!(cut.hash(), built.hash());
            for space in [Space::Continuous, Space::Discrete] {
                let method = Walks { space, ..Walks::shooting(ROULETTE) };
                let [one, two] = [&built, &cut]
                    .map(|scene| walk(&Experiment::new(scene.clone(), method.clone()).unwrap(), 3, 0..5_000));
                assert_eq!(one, two, "{space:?}, {index:?}");
            }
            // A scene that is cut as it was keeps nothing but its cells: names are those of the new one.
            let mut named = other.clone();
            named.surfaces[1].name = Some("floor".into());
            let renamed = cut.recut(&other).unwrap().recut(&named).unwrap();
            assert_eq!((renamed.hash(), renamed.surface_name(1)), (built.hash(), "floor"));
            assert_eq!(renamed.recut(&other).unwrap().surface_name(1), built.surface_name(1));
        }
    }
}

/// A group of one cell is that cell, and the faces of a group add up to it.
#[test]
fn faces_of_groups_are_made_of_their_pieces() {
    let spec = room();
    let alone = Scene::build(&spec, IndexChoice::Flat).unwrap();
    let grouped = Scene::build(&spec.grouped(&labels()), IndexChoice::Flat).unwrap();
    let (alone, faces) = (alone.faces(), grouped.faces());
    for (i, face) in faces.iter().enumerate() {
        let pieces: Vec<u32> = faces.pieces(i).collect();
        let members: Vec<Face> = pieces.iter().map(|&piece| alone.get(piece as usize)).collect();
        assert!(members.iter().all(|member| member.side == face.side));
        assert!(pieces.iter().all(|&piece| faces.face_of(piece) as usize == i));
        assert!((members.iter().map(|member| member.area).sum::<f64>() - face.area).abs() < 1e-15);
        if let [member] = &members[..] {
            assert_eq!(Face { patch: face.patch, ..*member }, face);
        }
        let other = faces.of_patch(face.patch).find(|&other| other as usize != i);
        assert_eq!(other.is_some(), members[0].surface >= 6, "the plates have two sides");
    }
    // The second wall, in the plane z = 1.
    let wall = faces.get(9);
    assert!((wall.centroid - DVec3::new(0.5, 0.5, 1.0)).length() < 1e-15 && wall.side == Side::Front);
    let plates = faces.face_of(55);
    assert!(faces.may_see_itself(plates as usize) && !faces.may_see_itself(9));
}

/// Discrete walks go on from uniform points of a group: means and shares of 200,000 points on an L of three squares and a
/// triangle. Six z-scores at 4.5 σ: false-alarm rate 4·10⁻⁵, once and for all with this seed. A black plate close above shows
/// where each ray has left.
#[test]
fn walks_go_on_from_uniform_points_of_a_group() {
    // A white L in the plane z = 0 below the plate, so that a ray arrives above where it left.
    let white = |shape| surface(shape, 0.999_999);
    let corner = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
    let square = quad(DVec3::ZERO, DVec3::X, DVec3::Y, [1, 1]);
    let tall = quad(corner(0.0, 1.0, 0.0), DVec3::X, DVec3::Y * 2.0, [1, 2]);
    let triangle = Shape::Triangle {
        a: corner(1.0, 0.0, 0.0),
        b: corner(3.0, 0.0, 0.0),
        c: corner(1.0, 1.0, 0.0),
        rows: 1,
    };
    let gap = 1e-4;
    let plate = quad(corner(-1.0, -1.0, gap), DVec3::Y * 6.0, DVec3::X * 6.0, [600, 600]);
    // Light comes from a small lamp between both, which only the square sees.
    let mut lamp = surface(quad(corner(0.4, 0.4, gap / 2.0), DVec3::Y * 0.01, DVec3::X * 0.01, [1, 1]), 0.0);
    lamp.emittance = 1.0.into();
    let spec = SceneSpec::new(vec![white(square), white(tall), white(triangle), surface(plate, 0.0), lamp]);
    let labels: Vec<u32> = (0..4).map(|_| 0).chain(4..4 + 360_000 + 1).collect();
    let experiment =
        experiment(&spec.grouped(&labels), IndexChoice::Flat, Walks::shooting(Estimator::Collision));
    let tally = walk(&experiment, 3, 0..200_000);
    let faces = experiment.scene().faces();
    let (mut n, mut sums) = (0.0, [[0.0; 2]; 6]);
    // Areas and first and second moments of the square, the tall rectangle and the triangle.
    let (square, tall, triangle) = (1.0, 2.0, 1.0);
    let total = square + tall + triangle;
    let x = (0.5 * square + 0.5 * tall + (1.0 + 2.0 / 3.0) * triangle) / total;
    let y = (0.5 * square + 2.0 * tall + 1.0 / 3.0 * triangle) / total;
    for face in 0..faces.len() {
        let place = faces.get(face);
        let hits = tally.patch(face, 0)[0] as f64;
        if place.surface != 3 || hits == 0.0 {
            continue;
        }
        n += hits;
        let DVec3 { x: px, y: py, .. } = place.centroid;
        let on = |holds: bool, expected: f64| f64::from(u8::from(holds)) - expected;
        let values = [
            px - x,
            py - y,
            on(px < 1.0 && py < 1.0, square / total),
            on(px < 1.0 && py >= 1.0, tall / total),
            on(px < 1.0 && py >= 2.0, 0.5 * tall / total),
            on(px >= 1.0, triangle / total),
        ];
        for (sum, value) in sums.iter_mut().zip(values) {
            sum[0] += hits * value;
            sum[1] += hits * value * value;
        }
    }
    assert!(n > 190_000.0, "{n} of 200,000 walks went on");
    for [sum, squares] in sums {
        let z: f64 = sum / squares.sqrt();
        assert!(z.abs() < 4.5, "{z}");
    }
}

#[test]
fn groups_that_no_patch_can_be_are_refused() {
    let build = |spec: SceneSpec| Scene::build(&spec, IndexChoice::Flat).map(drop);
    let spec = box_scene(DVec3::ONE, [2, 1]);
    let with = |labels: &[u32]| spec.clone().grouped(labels);
    // The emitter and its neighbour.
    let emitter = build(with(&[0, 0, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11]));
    let Err(SceneError::Surface { surface: 0, key: "patches", problem }) = emitter else {
        panic!("{emitter:?}")
    };
    assert!(problem.contains("another emittance"), "{problem}");
    let walls = build(with(&[0, 1, 2, 3, 3, 5, 6, 7, 8, 9, 10, 11]));
    let Err(SceneError::Surface { surface: 2, problem, .. }) = walls else { panic!("{walls:?}") };
    assert!(problem.contains("another reflectance"), "{problem}");
    let short = build(SceneSpec { patch_of_cell: vec![0; 11], ..spec.clone() });
    assert!(matches!(&short, Err(SceneError::Whole(problem)) if problem.contains("11 cells")), "{short:?}");
    let skipped =
        build(SceneSpec { patch_of_cell: vec![0, 2, 1, 3, 4, 5, 6, 7, 8, 9, 10, 11], ..spec.clone() });
    assert!(
        matches!(&skipped, Err(SceneError::Whole(problem)) if problem.contains("in the order")),
        "{skipped:?}"
    );
    assert!(with(&[7, 3, 2, 1, 0, 12, 6, 9, 8, 11, 10, 5]).patch_of_cell.is_empty(), "every cell is a patch");
}

#[test]
fn methods_that_groups_have_no_meaning_for_are_refused() {
    let scene = Scene::build(&room().grouped(&labels()), IndexChoice::Flat).unwrap();
    let gathered = |patch: u32| {
        let score = BatchScore::FinalGather(vec![patch]);
        let batches = Batches { walks: 1024, sampler: Sampler::Sobol, score };
        Experiment::new(scene.clone(), batches).err()
    };
    assert_eq!(gathered(9), Some(Unfit::GatheredGroup { patch: 9 }));
    assert_eq!(gathered(8), None);
}
