//! Which faces become one patch.

use glam::DVec3;
use import::{GroupLimits, groups};
use radiosity::{SceneSpec, Shape, SurfaceSpec};

fn triangle(corners: [DVec3; 3]) -> SurfaceSpec {
    let [a, b, c] = corners;
    SurfaceSpec::new(Shape::Triangle { a, b, c, rows: 1 }, 0.5)
}

/// A sheet of n × n squares of two triangles each over the unit square, bent by `height`.
fn sheet(n: u32, height: impl Fn(f64, f64) -> f64) -> Vec<SurfaceSpec> {
    let point = |i: u32, j: u32| {
        let [x, y] = [i, j].map(|i| f64::from(i) / f64::from(n));
        DVec3::new(x, y, height(x, y))
    };
    let square = |(i, j): (u32, u32)| {
        let [a, b, c, d] = [point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)];
        [triangle([a, b, c]), triangle([a, c, d])]
    };
    (0..n).flat_map(|i| (0..n).map(move |j| (i, j))).flat_map(square).collect()
}

fn grouping(size: f64, angle: f64) -> GroupLimits {
    GroupLimits { size, angle }
}

/// The number of groups, and the largest.
fn count(labels: &[u32]) -> (usize, usize) {
    let mut sorted = labels.to_vec();
    sorted.sort_unstable();
    let groups: Vec<usize> = sorted.chunk_by(|a, b| a == b).map(<[u32]>::len).collect();
    (groups.len(), groups.into_iter().max().unwrap_or(0))
}

/// A flat sheet of 8 × 8 squares falls in squares of the largest size that divides it.
#[test]
fn a_flat_sheet_falls_in_equal_squares() {
    let spec = SceneSpec::new(sheet(8, |_, _| 0.0));
    for (size, groups_of, largest) in
        [(2.0, 1, 128), (1.0, 1, 128), (0.5, 4, 32), (0.3, 16, 8), (0.25, 16, 8)]
    {
        let labels = groups(&spec, |_| Some(0), &grouping(size, 20.0));
        assert_eq!(count(&labels), (groups_of, largest), "size {size}");
        assert_eq!(labels[0], 0, "groups have the number of their first cell");
    }
    // Cells of one surface are neighbours as surfaces are.
    let whole = Shape::parallelogram(DVec3::ZERO, DVec3::X, DVec3::Y, [8, 8]);
    let labels =
        groups(&SceneSpec::new(vec![SurfaceSpec::new(whole, 0.5)]), |_| Some(0), &grouping(0.5, 20.0));
    assert_eq!(count(&labels), (4, 16));
}

/// A roof with sides at 30° to the floor: no group goes over the ridge below an angle of 60°.
#[test]
fn faces_of_a_group_face_one_way() {
    let slope = 30.0_f64.to_radians().tan();
    let roof = SceneSpec::new(sheet(8, |x, _| slope * (0.5 - (x - 0.5).abs())));
    let of = |angle| count(&groups(&roof, |_| Some(0), &grouping(2.0, angle)));
    assert_eq!((of(20.0), of(59.0), of(61.0)), ((2, 64), (2, 64), (1, 128)));
    // On a round one the angle counts from the first face of a group, so that it does not creep around.
    let round = SceneSpec::new(sheet(32, |x, _| (1.0 - (2.0 * x - 1.0).powi(2)).max(0.0).sqrt() / 2.0));
    let labels = groups(&round, |_| Some(0), &grouping(2.0, 20.0));
    let normal = |cell: usize| {
        let (_, u, v) = round.surfaces[cell].shape.edges();
        u.cross(v).normalize()
    };
    let least = 20.0_f64.to_radians().cos();
    assert!((0..labels.len()).all(|cell| normal(cell).dot(normal(labels[cell] as usize)) >= least));
    // The first face is at 80°; jumps between faces may be large there.
    assert!((5..=10).contains(&count(&labels).0), "{:?}: 160° in steps of 20°", count(&labels));
}

/// Faces of other kinds, faces that share a corner alone, and faces that run the same way along their edge stay apart.
#[test]
fn neighbours_share_an_edge_and_a_kind() {
    let spec = SceneSpec::new(sheet(2, |_, _| 0.0));
    let all = grouping(2.0, 20.0);
    assert_eq!(count(&groups(&spec, |surface| Some(surface as u32 / 4), &all)), (2, 4));
    // The fourth triangle lies in a corner and has no neighbour but the third.
    assert_eq!(count(&groups(&spec, |surface| (surface > 2).then_some(0), &all)), (5, 4));
    assert_eq!(count(&groups(&spec, |_| None, &all)), (8, 1));
    let [o, x, y] = [DVec3::ZERO, DVec3::X, DVec3::Y];
    let corner_alone = SceneSpec::new(vec![triangle([o, x, y]), triangle([o, -x, -y])]);
    assert_eq!(count(&groups(&corner_alone, |_| Some(0), &all)), (2, 1));
    let one_way = |second| SceneSpec::new(vec![triangle([o, x, y]), triangle(second)]);
    assert_eq!(count(&groups(&one_way([x, x + y, y]), |_| Some(0), &all)), (1, 2));
    // The second is upside down: its front is on the other side.
    assert_eq!(count(&groups(&one_way([y, x + y, x]), |_| Some(0), &grouping(2.0, 90.0))), (2, 1));
    // Vertices that differ by rounding are one.
    let off = DVec3::splat(1e-15);
    assert_eq!(count(&groups(&one_way([x + off, x + y, y - off]), |_| Some(0), &all)), (1, 2));
    // A face that emits cell by cell stays alone.
    let mut lit = spec.clone();
    lit.surfaces[0].cell_emittance = vec![(0, 1.0.into())];
    assert_eq!(count(&groups(&lit, |_| Some(0), &all)), (2, 7));
}

#[test]
fn a_scene_has_its_groups_again() {
    let spec = SceneSpec::new(sheet(24, |x, y| 0.3 * (6.0 * x).sin() * (4.0 * y).cos()));
    let of = || groups(&spec, |surface| Some(surface as u32 / 600), &grouping(0.2, 15.0));
    let labels = of();
    assert!((1..20).all(|_| of() == labels));
    let grouped = spec.clone().grouped(&labels);
    assert_eq!(grouped.patch_count(), count(&labels).0 as u64);
    assert!(grouped.patch_count() < spec.cell_count() / 4);
}
