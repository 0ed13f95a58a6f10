//! Marks against those of plain walks, whole number by whole number.

use std::collections::BTreeMap;

use super::*;
use crate::random::rng::Sequence;
use crate::walk::{Space, plain};
use crate::{EstimatorKind, Experiment, IndexChoice, Method, groups::PatchGroup};
use crate::{Scene, SceneSpec, Shape, Sides, Spectrum, SurfaceSpec};
use glam::DVec3;

/// The patches of a [`cube`], of which the last is of no material.
const FACES: u32 = 30;

/// A closed cube of five patches a side, whose reflectances are those of its channels.
fn cube(reflectance: Spectrum, emittance: Spectrum) -> SceneSpec {
    let (o, e, axes) = (DVec3::ZERO, DVec3::ONE, DVec3::AXES);
    let surface = |i: usize| {
        let (u, v) = (axes[(i + 1) % 3], axes[(i + 2) % 3]);
        let (corner, u, v) = if i < 3 { (o, u, v) } else { (e, -v, -u) };
        let (corner_u, corner_v) = (corner + u, corner + v);
        let shape = Shape::Parallelogram { corner, corner_u, corner_v, cells: [5, 1] };
        SurfaceSpec {
            name: None,
            shape,
            sides: Sides::Front,
            reflectance,
            emittance,
            cell_emittance: vec![],
            transmittance: Default::default(),
        }
    };
    SceneSpec::new((0..6).map(surface).collect())
}

/// Patches dealt to materials in turn.
fn materials(count: u32) -> Vec<PatchGroup> {
    let patches = |m: u32| (m..FACES - 1).step_by(count as usize).map(|patch| (patch, patch)).collect();
    (0..count).map(|m| PatchGroup { name: m.to_string(), patches: patches(m) }).collect()
}

/// The rows of marks of some walks.
fn marks(spec: &SceneSpec, kind: EstimatorKind, count: u32, walks: u64) -> Vec<Vec<u128>> {
    let scene = Scene::build(spec, IndexChoice::Flat).unwrap();
    let experiment = Experiment::new(scene, Method::shooting(kind)).unwrap();
    let experiment = experiment.with_groups(&[], &materials(count)).unwrap();
    let mut board = experiment.board();
    experiment.walk(&Sequence::new(3), 0..walks, &mut board);
    let tally = board.take().unwrap();
    let first = experiment.rows() - (count * FACES) as usize;
    let columns = tally.layout().columns();
    tally.sums()[first * columns..].chunks_exact(columns).map(<[u128]>::to_vec).collect()
}

/// Σx and Σx² of the marks of plain walks, row by row.
fn plain_marks(spec: &SceneSpec, kind: EstimatorKind, count: u32, walks: usize) -> Vec<Vec<u128>> {
    let scene = Scene::build(spec, IndexChoice::Flat).unwrap();
    let mut rows = vec![vec![0; 2]; (FACES * count) as usize];
    for rng in Sequence::new(3).walks_from(0).take(walks) {
        let mut arrivals = vec![0_u128; count as usize];
        let mut scored: BTreeMap<usize, u128> = BTreeMap::new();
        plain::walk(&scene, Space::Discrete, rng, |face, survives| {
            if face < FACES - 1 {
                arrivals[(face % count) as usize] += 1;
            }
            let scores = match kind {
                EstimatorKind::Absorption => !survives,
                EstimatorKind::Survival => survives,
                _ => true,
            };
            for (m, mark) in arrivals.iter().enumerate().filter(|_| scores) {
                *scored.entry(m * FACES as usize + face as usize).or_default() += mark;
            }
        });
        for (row, x) in scored {
            rows[row][0] += x;
            rows[row][1] += x * x;
        }
    }
    rows
}

/// Walks that are short, that are longer than is kept side by side, and of which some are; of materials in one block, in
/// several, and in more than are looked at without a question.
#[test]
fn marks_are_those_of_plain_walks() {
    for (reflectance, walks) in [(0.5, 3_000), (0.93, 1_000), (0.995, 100)] {
        let spec = cube(reflectance.into(), 1.0.into());
        for kind in [EstimatorKind::Collision, EstimatorKind::Survival, EstimatorKind::Absorption] {
            for count in [1, 3, 11, 29] {
                let plain = plain_marks(&spec, kind, count, walks);
                let found = marks(&spec, kind, count, walks as u64);
                assert_eq!(found, plain, "{kind:?}, {reflectance}, {count} materials");
            }
        }
    }
}

/// Where all channels are alike, weights are 1, and marks those of hits: in units of 2⁻⁴⁰.
#[test]
fn weights_of_one_are_hits() {
    for (reflectance, walks) in [(0.6, 3_000), (0.995, 100)] {
        let hits = marks(&cube(reflectance.into(), 1.0.into()), EstimatorKind::Collision, 3, walks);
        // One channel differs where it scores nothing, so that the scene has colours.
        let coloured = cube(Spectrum::rgb([reflectance; 3]), Spectrum::rgb([1.0, 1.0, 0.0]));
        let fine = marks(&coloured, EstimatorKind::Collision, 3, walks);
        for (hits, fine) in hits.iter().zip(&fine) {
            let [sum, squares] = [hits[0], hits[1]];
            assert_eq!(fine[..6], [sum << 40, squares << 80, sum << 40, squares << 80, 0, 0]);
        }
    }
}

/// Cells that are full are emptied into rows, and nothing is lost.
#[test]
fn full_cells_are_emptied() {
    let mut board = Marked::<u32, 1>::new([2, 3], 2);
    for _ in 0..3 {
        assert!(board.make_room(60_000));
        board.cells[1].begin(&[[0, 0, 60_000, 0, 0, 0, 0, 0]], 0);
    }
    assert!(!board.make_room(70_000), "its square has no room in 32 bits");
    board.raise_row(MarkRow { face: 1, material: 2, channel: 0 }, 10, 70_000);
    let square = |x: u128| x * x;
    let expected = [250_000, 3 * square(60_000) + square(70_010) - square(10)];
    assert_eq!(board.take().unwrap()[10..], expected);
    assert_eq!(board.take().unwrap(), [0; 12]);
}
