//! Boxes to test with, and a source of numbers to vary them.
#![allow(dead_code, reason = "every test file uses its own part")]

use exact::{Facing, Rectangle};
use glam::DVec3;
use radiosity::{SceneSpec, Shape, Sides, SurfaceSpec};

/// SplitMix64 (Steele, Lea & Flood 2014): the same numbers everywhere.
pub struct Numbers(pub u64);

impl Numbers {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn between(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * self.uniform()
    }

    /// Uniform in 0 … n − 1.
    pub fn below(&mut self, n: u32) -> u32 {
        (self.bits() % u64::from(n)) as u32
    }
}

pub const WALLS: [(usize, Facing); 6] = [
    (0, Facing::Up),
    (0, Facing::Down),
    (1, Facing::Up),
    (1, Facing::Down),
    (2, Facing::Up),
    (2, Facing::Down),
];

pub fn rectangle(axis: usize, facing: Facing, lo: [f64; 3], hi: [f64; 3]) -> Rectangle {
    Rectangle { axis, facing, lo: lo.into(), hi: hi.into() }
}

/// The wall that faces that way, of the box from `lo` to `hi`.
pub fn wall(axis: usize, facing: Facing, mut lo: DVec3, mut hi: DVec3) -> Rectangle {
    match facing {
        Facing::Up => hi[axis] = lo[axis],
        Facing::Down => lo[axis] = hi[axis],
    }
    Rectangle { axis, facing, lo, hi }
}

/// A rectangle as a grey surface, its corner one of four (`turn` modulo 4).
pub fn surface(rectangle: &Rectangle, turn: u32, cells: [u32; 2], r: f64, e: f64) -> SurfaceSpec {
    let (p, q) = ((rectangle.axis + 1) % 3, (rectangle.axis + 2) % 3);
    let at = |on_p: bool, on_q: bool| {
        let mut corner = rectangle.lo;
        corner[p] = if on_p { rectangle.hi[p] } else { rectangle.lo[p] };
        corner[q] = if on_q { rectangle.hi[q] } else { rectangle.lo[q] };
        corner
    };
    // Counterclockwise seen from the end of the axis.
    let ring = [at(false, false), at(true, false), at(true, true), at(false, true)];
    let [corner, next, last] = [0, 1, 3].map(|k| ring[(turn as usize + k) % 4]);
    let (corner_u, corner_v) = match rectangle.facing {
        Facing::Up => (next, last),
        Facing::Down => (last, next),
    };
    SurfaceSpec {
        name: None,
        shape: Shape::Parallelogram { corner, corner_u, corner_v, cells },
        sides: Sides::Front,
        reflectance: r.into(),
        emittance: e.into(),
        cell_emittance: vec![],
        transmittance: Default::default(),
    }
}

/// A box of six surfaces with one grid and one material.
pub fn plain_box(lo: DVec3, hi: DVec3, cells: [u32; 2], r: f64, e: f64) -> SceneSpec {
    let surfaces = WALLS.map(|(axis, facing)| surface(&wall(axis, facing, lo, hi), 0, cells, r, e));
    SceneSpec::new(surfaces.into())
}

/// A box of random place, proportions up to 1 : 10, split walls, grids and orientations.
pub fn random_box(numbers: &mut Numbers, r: f64, e: f64) -> SceneSpec {
    let mut three = |lo: f64, hi: f64| {
        DVec3::new(numbers.between(lo, hi), numbers.between(lo, hi), numbers.between(lo, hi))
    };
    let (lo, size) = (three(-20.0, 20.0), three(1.0, 10.0));
    let hi = lo + size;
    let mut surfaces = vec![];
    for (axis, facing) in WALLS {
        let whole = wall(axis, facing, lo, hi);
        let across = (axis + 1 + numbers.below(2) as usize) % 3;
        let cut = numbers.between(whole.lo[across], whole.hi[across]);
        let (mut near, mut far) = (whole, whole);
        (near.hi[across], far.lo[across]) = (cut, cut);
        let tiles = if numbers.below(2) == 0 { vec![whole] } else { vec![near, far] };
        for tile in tiles {
            let cells = [1 + numbers.below(5), 1 + numbers.below(5)];
            surfaces.push(surface(&tile, numbers.below(4), cells, r, e));
        }
    }
    SceneSpec::new(surfaces)
}

/// The 54-patch cube of S97 figs 2 and 3: faces 3×3 of reflectance 0.3 … 0.8, the emitter of emittance 1 in
/// the middle of the first.
pub fn cube_54() -> SceneSpec {
    let mut spec = plain_box(DVec3::ZERO, DVec3::ONE, [3, 3], 0.0, 0.0);
    for (face, surface) in spec.surfaces.iter_mut().enumerate() {
        surface.reflectance = [0.3, 0.4, 0.5, 0.6, 0.7, 0.8][face].into();
    }
    spec.surfaces[0].cell_emittance = vec![(4, 1.0.into())];
    spec
}

/// Panics unless the values agree to `tolerance`, absolutely.
#[track_caller]
pub fn assert_near(value: f64, expected: f64, tolerance: f64) {
    let off = (value - expected).abs();
    assert!(off <= tolerance, "{value} is {off:e} off {expected}, more than {tolerance:e}");
}
