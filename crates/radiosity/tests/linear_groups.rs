//! Linear fits on patches that are groups of cells.

use crate::common::{box_walls, experiment, surface, walk};
use glam::DVec3;
use radiosity::{
    Birth, Direction, Estimates, Estimator, IndexChoice, SceneSpec, Shape, Sides, Space, SurfaceSpec, Walks,
    methods::Score,
};

/// Walls of which no two edges are alike, so that every group of a wall's cells has axes of its own.
const SIZE: DVec3 = DVec3::new(1.0, 2.0, 4.0);

fn linear() -> Walks {
    let score = Score::Linear(Estimator::Collision);
    Walks { direction: Direction::Shooting, space: Space::Continuous, score }
}

/// A box with these walls, in which a lamp hangs.
fn room(walls: Vec<Shape>) -> SceneSpec {
    let lamp = Shape::parallelogram(DVec3::new(0.1, 0.3, 0.2), 0.5 * DVec3::X, 0.5 * DVec3::Z, [1, 1]);
    let lamp = SurfaceSpec { sides: Sides::Both, ..surface(lamp, 0.2).emitting(1.0) };
    let walls = walls.into_iter().map(|wall| surface(wall, 0.6));
    SceneSpec::new(walls.chain([lamp]).collect())
}

/// By function of a patch on a wall that is a group, the function of the wall as one cell: 0 for u, 1 for v.
fn edge_of(wall: &Shape, k: usize) -> usize {
    let (_, u, v) = wall.edges();
    if u.length() > v.length() { k } else { 1 - k }
}

/// The same walks on walls of one cell each and on walls of six cells that are one patch: the scores are alike, and so are slopes, but for
/// hits that rounding puts on the other side of a step of ψ (two units), of which there is less than one in 1,000.
#[test]
fn a_group_of_the_cells_of_a_wall_is_the_wall() {
    let walls = box_walls(SIZE, [1, 1]);
    let whole = experiment(&room(walls.clone()), IndexChoice::Flat, linear());
    let labels: Vec<u32> = (0..37).map(|cell| cell / 6).collect();
    let cells = room(box_walls(SIZE, [2, 3])).grouped(&labels);
    let grouped = experiment(&cells, IndexChoice::Flat, linear());
    let [one, other] = [&whole, &grouped].map(|experiment| walk(experiment, 5, 0..40_000));
    assert_eq!(one.counts, other.counts);
    let [estimates, of_groups] = [(&whole, &one), (&grouped, &other)]
        .map(|(experiment, tally)| Estimates::new(experiment, tally, 0.95));
    for face in 0..8 {
        assert_eq!(one.patch(face, 0), other.patch(face, 0));
        let [slopes, of_group] = [&estimates, &of_groups].map(|estimates| estimates.slopes(face).unwrap()[0]);
        assert!((slopes.energy - of_group.energy).abs() < 1e-6 * slopes.energy.abs());
        for k in 0..2 {
            let axis = walls.get(face).map_or(k, |wall| edge_of(wall, k));
            let [a, b] = [(&one, axis), (&other, k)].map(|(tally, k)| tally.slope(face, 0, k).0 as f64);
            assert!((a - b).abs() < 2.0 + 2e-3 * one.events(face) as f64, "face {face}, axis {k}: {a}, {b}");
            assert!((slopes.gradient[axis] - of_group.gradient[k]).abs() < 1e-5);
        }
    }
}

/// The triangles of walls, two or eight for each of the cells of these, have other walks but the same light: of gradients over all
/// patches and 120 pairs of runs the mean squared z is 1 ± 0.05. Its standard error is 0.009, and 0.05 is exceeded by chance less than once in
/// 10⁶.
#[test]
fn groups_of_triangles_tell_what_cells_tell() {
    const RUNS: u64 = 120;
    const WALKS: u64 = 20_000;
    let whole = room(box_walls(SIZE, [4, 4]));
    let cells = experiment(&whole, IndexChoice::Auto, linear());
    let (triangles, labels) = triangulated(&whole);
    let groups = experiment(&triangles.grouped(&labels), IndexChoice::Auto, linear());
    let (mut squares, mut count) = (0.0, 0.0);
    for run in 0..RUNS {
        let walks = 2 * run * WALKS..(2 * run + 1) * WALKS;
        let others = walks.end..walks.end + WALKS;
        let [one, other] = [(&cells, walks), (&groups, others)].map(|(experiment, walks)| {
            let tally = walk(experiment, 17, walks);
            let estimates = Estimates::new(experiment, &tally, 0.95);
            (0..96).map(|patch| estimates.slopes(patch).unwrap()[0]).collect::<Vec<_>>()
        });
        for (patch, (a, b)) in one.iter().zip(&other).enumerate() {
            let (Some(a_errors), Some(b_errors)) = (a.gradient_error, b.gradient_error) else { continue };
            for (k, error) in b_errors.into_iter().enumerate() {
                let axis = edge_of(&whole.surfaces[patch / 16].shape, k);
                let z = (a.gradient[axis] - b.gradient[k]) / a_errors[axis].hypot(error);
                (squares, count) = (squares + z * z, count + 1.0);
            }
        }
    }
    println!("{:.3} of {count}", squares / count);
    assert!(count > 20_000.0 && (squares / count - 1.0).abs() < 0.05, "{} of {count}", squares / count);
}

/// A scene with triangles in place of the cells of parallelograms, and the cell that each is a part of. Every other cell has two, the
/// rest has two in four rows.
fn triangulated(spec: &SceneSpec) -> (SceneSpec, Vec<u32>) {
    let (mut surfaces, mut labels, mut number) = (Vec::new(), Vec::new(), 0);
    for of in &spec.surfaces {
        for cell in 0..of.shape.cell_count() as u32 {
            let corners = of.shape.cell_corners(cell);
            for (i, j, k) in [(0, 1, 2), (2, 3, 0)] {
                let rows = 1 + cell % 2;
                let shape = Shape::Triangle { a: corners[i], b: corners[j], c: corners[k], rows };
                labels.extend((0..rows * rows).map(|_| number));
                surfaces.push(SurfaceSpec { shape, ..of.clone() });
            }
            number += 1;
        }
    }
    (SceneSpec::new(surfaces), labels)
}

/// What a run on groups tells of its errors against a run of 10 times the walks or more on 8 × 8 cells for each patch: the total is within a
/// factor of 1.5 of the true one. The patches are coarse, and a lamp hangs beside a wall.
#[test]
fn the_total_error_that_a_run_tells_is_true() {
    const FINE: u32 = 8;
    let whole = room(box_walls(SIZE, [2, 2]));
    let (triangles, labels) = triangulated(&whole);
    let groups = experiment(&triangles.grouped(&labels), IndexChoice::Auto, linear());
    let constant = Walks { score: Score::Of(Estimator::Collision), ..linear() };
    let fine = experiment(&room(box_walls(SIZE, [2 * FINE; 2])), IndexChoice::Auto, constant);
    let truth = walk(&fine, 3, 0..3_000_000);
    let truth = Estimates::new(&fine, &truth, 0.95);
    for walks in [3_000, 300_000] {
        let tally = walk(&groups, 4, 0..walks);
        let estimates = Estimates::new(&groups, &tally, 0.95);
        let (mut error, mut light) = (0.0, 0.0);
        for (i, face, known) in truth.known().filter(|(_, face, _)| face.surface < 6) {
            let cell = i as u32 % (4 * FINE * FINE);
            let [u, v] = [cell / (2 * FINE), cell % (2 * FINE)].map(|at| at / FINE);
            let patch = 4 * face.surface + 2 * u + v;
            let off = known[0].radiosity - estimates.face(patch as usize).unwrap()[0].radiosity;
            let noise = known[0].std_error.unwrap().powi(2);
            error += face.area * (off * off - noise);
            light += face.area * (known[0].radiosity.powi(2) - noise);
        }
        let (accuracy, error) = (estimates.accuracy().unwrap(), (error / light).sqrt());
        println!("{walks}: {error:.4}, told {accuracy:?}");
        assert!((accuracy.total / error).ln().abs() < 1.5_f64.ln(), "{walks}: {error}, told {accuracy:?}");
    }
}

/// A floor and a wall of a box that are one patch: its slopes are those that the hits in 2 × 256² cells say, given the places of these. The
/// principal axes are those of two rectangles with the edge x = z = 0 in common.
#[test]
fn the_fit_on_a_bent_group_is_that_of_its_cells() {
    const N: u32 = 256;
    let spec = |cells: [u32; 2]| {
        let mut walls = box_walls(SIZE, [1, 1]);
        for wall in [0, 4] {
            let Shape::Parallelogram { cells: own, .. } = &mut walls[wall] else { unreachable!() };
            *own = cells;
        }
        room(walls)
    };
    let grouped = spec([1, 1]).grouped(&[0, 1, 2, 3, 0, 5, 6]);
    let grouped = experiment(&grouped, IndexChoice::Flat, linear());
    let constant = Walks { score: Score::Of(Estimator::Collision), ..linear() };
    let fine = experiment(&spec([N, N]), IndexChoice::Flat, constant);
    let [slopes, hits] = [&grouped, &fine].map(|experiment| walk(experiment, 9, 0..100_000));

    let functions = functions();
    let (mut sums, mut all) = ([0.0; 2], 0.0);
    let faces = fine.scene().faces();
    for (i, face) in faces.iter().enumerate().filter(|(_, face)| [0, 4].contains(&face.surface)) {
        let number = hits.patch(i, 0)[0] as f64;
        all += number;
        (0..2).for_each(|k| sums[k] += number * functions[k](face.centroid));
    }
    assert_eq!(all, slopes.patch(0, 0)[0] as f64);
    for (k, sum) in sums.into_iter().enumerate() {
        let slope = slopes.slope(0, 0, k).0 as f64 / 4096.0;
        // ψ grows by less than 1/64 from one edge of a cell to the other: five standard errors of what hits are off by, one in 10⁶ by chance.
        let limit = 5.0 * all.sqrt() / 64.0 / 12_f64.sqrt();
        println!("{slope}, {sum} ± {limit} of {all}");
        assert!((slope - sum).abs() < limit && slope.abs() > 10.0 * limit);
    }
}

/// ψ₁ and ψ₂ on the floor 1 × 2 and the wall 2 × 4 of the box, in closed form.
fn functions() -> [impl Fn(DVec3) -> f64; 2] {
    let DVec3 { x: a, y: b, z: c } = SIZE;
    // The floor is a part a/(a + c) of the area, the centroid at a²/2(a + c), b/2, c²/2(a + c).
    let (floor, wall) = (a / (a + c), c / (a + c));
    let centre = DVec3::new(0.5 * a * floor, 0.5 * b, 0.5 * c * wall);
    let xx = floor * a * a / 3.0 - centre.x * centre.x;
    let zz = wall * c * c / 3.0 - centre.z * centre.z;
    let xz = -centre.x * centre.z;
    let yy = b * b / 12.0;
    // The larger eigenvalue of the matrix of x and z; the other one is below that of y.
    let root = (0.25 * (xx - zz) * (xx - zz) + xz * xz).sqrt();
    let [most, least] = [0.5 * (xx + zz) + root, 0.5 * (xx + zz) - root];
    assert!(most > yy && yy > least);
    // z has the larger coordinate, which is positive.
    let first = DVec3::new(xz, 0.0, most - xx).normalize();
    assert!(first.z > first.x.abs());
    let corners = [DVec3::ZERO, DVec3::new(a, 0.0, 0.0), DVec3::new(a, b, 0.0), DVec3::new(0.0, b, c)];
    [first, DVec3::Y].map(|axis| {
        let reach = corners.iter().map(|&corner| (corner - centre).dot(axis).abs()).fold(0.0, f64::max);
        move |x: DVec3| (x - centre).dot(axis) / reach
    })
}

/// Across a group that is a needle nothing is fitted; walks that are born there tell of the gradient along it.
#[test]
fn a_needle_has_no_gradient_across() {
    let mut spec = room(box_walls(SIZE, [1, 1]));
    let needle = Shape::parallelogram(DVec3::new(0.3, 0.3, 2.0), DVec3::X * 0.3, DVec3::Y * 1e-7, [2, 1]);
    spec.surfaces.push(surface(needle, 0.5).emitting(0.1));
    let gathering = Walks { direction: Direction::Gathering(Birth::Patches(vec![7])), ..linear() };
    let experiment = experiment(&spec.grouped(&[0, 1, 2, 3, 4, 5, 6, 7, 7]), IndexChoice::Flat, gathering);
    let tally = walk(&experiment, 1, 0..20_000);
    let slopes = Estimates::new(&experiment, &tally, 0.95).slopes(7).unwrap()[0];
    assert!(slopes.gradient_error.unwrap()[0] > 0.0 && slopes.gradient[0] != 0.0, "{slopes:?}");
    assert_eq!(slopes.gradient[1], 0.0);
}
