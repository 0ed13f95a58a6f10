//! Rows that are counted one by one: the same walks as between dense groups, and a sky in patches.
//!
//! Seeds are fixed. Limits are said beside them.

use crate::common::Grouped;
use exchange::{Intervals, SparseRow};
use glam::DVec3;
use radiosity::{
    SceneSpec, Sequence, Shape, Space,
    daylight::SkyPatches,
    exchange::{ExchangeRows, FactorKind},
};
use stats::Coverage;

use crate::shapes::{grey, painted, quad, room};

/// A walled room that is open on one side, with a one-sided plate in it.
fn open_room() -> SceneSpec {
    let mut walls: Vec<Shape> = room([2.0, 1.0, 1.0], 2);
    walls.remove(1);
    let mut spec = painted(walls, 0.5, 1.0);
    spec.surfaces.push(grey(quad([0.9, 0.1, 0.1], [0.0, 0.0, 0.6], [0.0, 0.7, 0.0], [1, 1]), 0.3, 1.0));
    spec
}

/// The rows of a scene, in pieces that do not begin or end together.
fn rows(grouped: &Grouped, kind: FactorKind, walks: u64, sky: Option<SkyPatches>) -> Vec<SparseRow> {
    let groups = (grouped.group_of_face.clone(), grouped.groups as u32);
    let rows = ExchangeRows::new(grouped.scene.clone(), (kind, Space::Discrete), groups, sky).unwrap();
    let (sequence, mut board) = (Sequence::new(7), rows.board());
    let row = |group: u32| {
        for part in [0..walks / 3, walks / 3..walks] {
            rows.walk(&sequence, group, part, &mut board);
        }
        SparseRow::new(board.take().0)
    };
    (0..rows.groups() as u32).map(row).collect()
}

#[test]
fn rows_are_those_of_dense_groups() {
    let spec = open_room();
    for kind in [FactorKind::FirstHit, FactorKind::Absorbed] {
        for grouped in [Grouped::by_face(&spec), Grouped::by_surface(&spec)] {
            let dense = grouped.count(kind, 7, 0, 3000);
            for (i, row) in rows(&grouped, kind, 3000, None).iter().enumerate() {
                let counts: Vec<u64> =
                    (0..grouped.groups as u32 + 2).map(|column| row.count(column).into()).collect();
                assert_eq!(counts, dense.row(i), "{kind:?} row {i}");
            }
        }
    }
}

/// Each sky patch is seen by a horizontal plate as the integral over it says, and by a plate that faces down not at all. A chi-square
/// sum of more than 2,305 + 6·√(2·2,305) is a false alarm once in 10⁹.
#[test]
fn a_plate_in_the_open_sees_the_sky_by_direction() {
    let plate = |u: DVec3, v: DVec3| Shape::Parallelogram {
        corner: DVec3::ZERO,
        corner_u: u,
        corner_v: v,
        cells: [1, 1],
    };
    let (up, down) = (plate(DVec3::X, DVec3::Y), plate(DVec3::Y, DVec3::X));
    for size in SkyPatches::SIZES {
        let sky = SkyPatches::new(size).unwrap();
        const WALKS: u64 = 1 << 18;
        let by_face = |shape: &Shape| Grouped::by_face(&painted([shape.clone()], 0.5, 1.0));
        let seen = &rows(&by_face(&up), FactorKind::FirstHit, WALKS, Some(sky.clone()))[0];
        let chi_square: f64 = sky
            .horizontal_factors()
            .iter()
            .zip(3..)
            .map(|(&p, column)| {
                let expected = p * WALKS as f64;
                (f64::from(seen.count(column)) - expected).powi(2) / expected
            })
            .sum();
        let freedom = f64::from(size - 1);
        let z = (chi_square - freedom) / (2.0 * freedom).sqrt();
        assert!(z.abs() < 6.0, "{size} patches: {z}");
        assert_eq!((seen.count(2), seen.walks()), (0, WALKS), "nothing leaves below the horizon");
        let below = &rows(&by_face(&down), FactorKind::FirstHit, WALKS, Some(sky))[0];
        assert_eq!(below.entries(), [(2, WALKS as u32)]);
    }
}

/// Intervals of factors that expect fewer than ten counts hold the truth in the mean: a cube of 54 faces at 64 to 1024 walks a row, about 1
/// to 10 of which meet each face, with as many cells for each number of these. 95 % less 0.5 % is more than 30 standard errors away from what is found.
#[test]
fn intervals_of_few_counts_hold() {
    let spec = scenes::cube(3);
    let grouped = Grouped::by_face(&spec);
    let truth = grouped.truth(&spec, FactorKind::FirstHit);
    let groups = (grouped.group_of_face.clone(), grouped.groups as u32);
    let place = (FactorKind::FirstHit, Space::Discrete);
    let rows = ExchangeRows::new(grouped.scene.clone(), place, groups, None).unwrap();
    let (sequence, mut board, mut intervals) = (Sequence::new(11), rows.board(), Intervals::new(0.95));
    let mut few = Coverage::default();
    for walks in [64, 128, 256, 512, 1024] {
        for run in 0..walks / 8 {
            for (i, truth) in truth.iter().enumerate() {
                rows.walk(&sequence, i as u32, run * walks..(run + 1) * walks, &mut board);
                let row = SparseRow::new(board.take().0);
                let cells = (0..).zip(&truth[..grouped.groups]);
                for (j, &p) in cells.filter(|(_, p)| **p > 0.0 && **p * (walks as f64) < 10.0) {
                    few.record(&intervals.of(row.count(j), walks).interval, p);
                }
            }
        }
    }
    let rate = few.rate(0.95).unwrap();
    println!("{rate:?}");
    assert!((0.945..0.97).contains(&rate.value), "{rate:?}");
}

/// An endless street canyon as one cell that repeats along both axes: ground, two walls, a roof. The factors are those of crossed strings
/// (H. C. Hottel, 1954), and those of absorption what a system of three surfaces makes of them. 15 z-scores: one is beyond 4.5 by chance once in
/// 10,000 seeds.
#[test]
fn a_street_that_repeats_has_the_factors_of_crossed_strings() {
    let (width, height, block, length) = (2.0, 3.0, 1.0, 1.5);
    let along = [0.0, length, 0.0];
    let spec = painted(
        [
            quad([0.0; 3], [width, 0.0, 0.0], along, [1, 1]),
            quad([0.0; 3], along, [0.0, 0.0, height], [1, 1]),
            quad([width, 0.0, 0.0], [0.0, 0.0, height], along, [1, 1]),
            quad([width, 0.0, height], [block, 0.0, 0.0], along, [1, 1]),
        ],
        0.4,
        1.0,
    );
    let mut grouped = Grouped::by_face(&spec);
    grouped.scene = grouped.scene.repeated([width + block, length]).unwrap();
    let (up, across) = ((1.0 + (height / width).powi(2)).sqrt(), (1.0 + (width / height).powi(2)).sqrt());
    let (ground_sky, wall_wall) = (up - height / width, across - width / height);
    let (ground_wall, wall_sky) = (0.5 * (1.0 - ground_sky), 0.5 * (1.0 - wall_wall));
    let first: [[f64; 3]; 3] =
        [[0.0, ground_wall, ground_wall], [wall_sky, 0.0, wall_wall], [wall_sky, wall_wall, 0.0]];
    // B = F (1 − R) + F R B, term by term.
    let mut absorbed = [[0.0; 3]; 3];
    for _ in 0..200 {
        absorbed = first.map(|row| {
            std::array::from_fn(|j| 0.6 * row[j] + (0..3).map(|k| 0.4 * row[k] * absorbed[k][j]).sum::<f64>())
        });
    }
    const WALKS: u64 = 1 << 18;
    let mut scores = Vec::new();
    for (kind, truth) in [(FactorKind::FirstHit, first), (FactorKind::Absorbed, absorbed)] {
        let rows = rows(&grouped, kind, WALKS, None);
        // Nothing is above a roof.
        assert_eq!(rows[3].entries(), [(5, WALKS as u32)]);
        for (row, truth) in rows.iter().zip(&truth) {
            assert_eq!(row.walks(), WALKS);
            assert_eq!((row.count(3), row.count(4)), (0, 0), "no ray meets the roof or a back");
            for (column, &p) in (0..).zip(truth) {
                let expected = p * WALKS as f64;
                match p {
                    0.0 => assert_eq!(row.count(column), 0),
                    _ => {
                        scores.push((f64::from(row.count(column)) - expected) / (expected * (1.0 - p)).sqrt())
                    }
                }
            }
        }
    }
    println!("{scores:?}");
    assert!(scores.len() == 15 && scores.iter().all(|z| z.abs() < 4.5), "{scores:?}");
}
