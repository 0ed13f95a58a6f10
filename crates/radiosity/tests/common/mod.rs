//! Scenes for the tests of this folder.
#![allow(dead_code, reason = "each test file uses its own part")]

use std::ops::Range;

use glam::{DMat3, DVec3};
use radiosity::{
    EstimatorKind, Experiment, IndexChoice, Method, Scene, SceneSpec, Sequence, Shape, Sides, Space,
    Spectrum, SurfaceSpec, Tally, Walks,
};
use stats::{Measured, Moments};

pub(crate) fn surface(shape: Shape, reflectance: f64) -> SurfaceSpec {
    SurfaceSpec {
        name: None,
        shape,
        sides: Sides::Front,
        reflectance: reflectance.into(),
        emittance: Spectrum::BLACK,
        cell_emittance: vec![],
        transmittance: Default::default(),
    }
}

/// A parallelogram c, c + u, c + v.
pub(crate) fn quad(c: DVec3, u: DVec3, v: DVec3, cells: [u32; 2]) -> Shape {
    Shape::Parallelogram { corner: c, corner_u: c + u, corner_v: c + v, cells }
}

/// The shape with its front on the other side.
pub(crate) fn flipped(shape: Shape) -> Shape {
    match shape {
        Shape::Parallelogram { corner, corner_u, corner_v, cells: [nu, nv] } => {
            Shape::Parallelogram { corner, corner_u: corner_v, corner_v: corner_u, cells: [nv, nu] }
        }
        Shape::Triangle { a, b, c, rows } => Shape::Triangle { a, b: c, c: b, rows },
        Shape::Divided { corner, corner_u, corner_v, leaves } => {
            Shape::Divided { corner, corner_u: corner_v, corner_v: corner_u, leaves: leaves.transposed() }
        }
    }
}

/// The six walls of a box from 0 to `size`, facing inwards: z low, z high, y low, y high, x low, x high.
pub(crate) fn box_walls(size: DVec3, cells: [u32; 2]) -> Vec<Shape> {
    let DVec3 { x, y, z } = size;
    let (ex, ey, ez) = (DVec3::X * x, DVec3::Y * y, DVec3::Z * z);
    vec![
        quad(DVec3::ZERO, ex, ey, cells),
        quad(ez, ey, ex, cells),
        quad(DVec3::ZERO, ez, ex, cells),
        quad(ey, ex, ez, cells),
        quad(DVec3::ZERO, ey, ez, cells),
        quad(ex, ez, ey, cells),
    ]
}

/// A closed box with the reflectances of S97 fig. 2 (0.3 … 0.8 by wall), cell 0 of the first wall emitting.
pub(crate) fn box_scene(size: DVec3, cells: [u32; 2]) -> SceneSpec {
    let mut surfaces: Vec<SurfaceSpec> = box_walls(size, cells)
        .into_iter()
        .zip([0.3, 0.4, 0.5, 0.6, 0.7, 0.8])
        .map(|(shape, reflectance)| surface(shape, reflectance))
        .collect();
    surfaces[0].cell_emittance = vec![(0, 1.0.into())];
    SceneSpec::new(surfaces)
}

/// The 54-patch cube of S97 fig. 2: its emitter is the patch in the middle of the first face.
pub(crate) fn cube54() -> SceneSpec {
    let mut scene = box_scene(DVec3::ONE, [3, 3]);
    scene.surfaces[0].cell_emittance = vec![(4, 1.0.into())];
    scene
}

/// A cube of 54 cells in which a plate of these cells and a triangle in rows hang, both with two sides.
pub(crate) fn room_with_plates(cells: [u32; 2]) -> SceneSpec {
    let mut spec = cube54();
    let plate = quad(DVec3::new(0.3, 0.2, 0.5), DVec3::X * 0.5, DVec3::new(0.0, 0.4, 0.1), cells);
    let triangle = Shape::Triangle {
        a: DVec3::new(0.2, 0.2, 0.2),
        b: DVec3::new(0.8, 0.3, 0.2),
        c: DVec3::new(0.4, 0.9, 0.3),
        rows: 2,
    };
    for shape in [plate, triangle] {
        spec.surfaces.push(SurfaceSpec { sides: Sides::Both, ..surface(shape, 0.6) });
    }
    spec
}

/// Moves every corner of a scene.
pub(crate) fn map_corners(scene: &SceneSpec, map: impl Fn(DVec3) -> DVec3) -> SceneSpec {
    let surfaces = scene.surfaces.iter().map(|s| SurfaceSpec { shape: s.shape.moved(&map), ..s.clone() });
    SceneSpec::new(surfaces.collect())
}

/// A rotation along no axis of symmetry.
pub(crate) fn rotation() -> DMat3 {
    DMat3::from_rotation_z(0.7) * DMat3::from_rotation_x(1.1) * DMat3::from_rotation_y(-0.4)
}

/// A closed mesh: an icosahedron divided `levels` times, pushed onto a bumpy sphere, facing inwards.
pub(crate) fn bumpy_sphere(levels: u32, rows: u32) -> SceneSpec {
    let phi = 0.5 * (1.0 + 5f64.sqrt());
    let vertex = |x: f64, y: f64, z: f64| DVec3::new(x, y, z).normalize();
    let v = [
        vertex(-1.0, phi, 0.0),
        vertex(1.0, phi, 0.0),
        vertex(-1.0, -phi, 0.0),
        vertex(1.0, -phi, 0.0),
        vertex(0.0, -1.0, phi),
        vertex(0.0, 1.0, phi),
        vertex(0.0, -1.0, -phi),
        vertex(0.0, 1.0, -phi),
        vertex(phi, 0.0, -1.0),
        vertex(phi, 0.0, 1.0),
        vertex(-phi, 0.0, -1.0),
        vertex(-phi, 0.0, 1.0),
    ];
    let faces = [
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    let mut triangles: Vec<[DVec3; 3]> = faces.iter().map(|f| f.map(|i| v[i])).collect();
    for _ in 0..levels {
        triangles = triangles
            .iter()
            .flat_map(|&[a, b, c]| {
                let (ab, bc, ca) = ((a + b).normalize(), (b + c).normalize(), (c + a).normalize());
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    // A function of the vertex alone, so that neighbours agree to the last bit.
    let bump = |p: DVec3| p * (1.0 + 0.1 * (7.0 * p.x).sin() * (5.0 * p.y).cos());
    let mut surfaces: Vec<SurfaceSpec> = triangles
        .iter()
        .map(|&[a, b, c]| surface(Shape::Triangle { a: bump(a), b: bump(c), c: bump(b), rows }, 0.8))
        .collect();
    surfaces[0].emittance = 1.0.into();
    SceneSpec::new(surfaces)
}

/// The method of discrete or continuous collision shooting.
pub(crate) fn collision(space: Space) -> Walks {
    Walks { space, ..Walks::shooting(EstimatorKind::Collision) }
}

/// A scene with a method.
pub(crate) fn experiment(spec: &SceneSpec, index: IndexChoice, method: impl Into<Method>) -> Experiment {
    Experiment::new(Scene::build(spec, index).unwrap(), method).unwrap()
}

/// The tallies of `blocks` blocks that share the first `walks` walks of a seed's sequence, for [`variance`].
pub(crate) fn walk_in_blocks(experiment: &Experiment, seed: u64, walks: u64, blocks: u64) -> Vec<Tally> {
    let size = walks / blocks;
    (0..blocks).map(|block| walk(experiment, seed, block * size..(block + 1) * size)).collect()
}

/// The variance of one walk's score on a patch, with the error that the scatter of blocks tells.
pub(crate) fn variance(blocks: &[Tally], patch: usize) -> Measured {
    let of_patch = |tally: &Tally| {
        let sums = tally.patch(patch, 0);
        Moments { n: tally.counts.walks, sum: sums[0], sum_sq: sums[1] }
    };
    stats::variance_of_blocks(blocks.iter().map(of_patch)).unwrap()
}

/// The tally of some walks.
pub(crate) fn walk(experiment: &Experiment, seed: u64, walks: Range<u64>) -> Tally {
    let sequence = Sequence::new(seed);
    let mut board = experiment.board();
    let mut tally = experiment.tally();
    let mut next = walks.start;
    while next < walks.end {
        let end = walks.end.min(next + (1 << 20));
        experiment.walk(&sequence, next..end, &mut board);
        tally.merge(&board.take().unwrap()).unwrap();
        next = end;
    }
    tally
}
