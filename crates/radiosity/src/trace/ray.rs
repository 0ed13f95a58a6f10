//! Rays and where they meet surfaces, one by one and in batches.

use glam::DVec3;

use crate::geometry::spec::Side;
use crate::simd::batch::WIDTH;

/// A ray from a point on a surface.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Where it starts [m].
    pub origin: DVec3,
    /// Where it goes; of any length.
    pub direction: DVec3,
    /// The surface it leaves, which, being planar, it cannot meet. [`Ray::FREE`] for none.
    pub from: u32,
}

impl Ray {
    /// The `from` of a ray that leaves no surface.
    pub const FREE: u32 = u32::MAX;
}

/// Where a ray meets a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Ray parameter of the hit point.
    pub t: f64,
    /// The surface that is met.
    pub surface: u32,
    /// Local coordinates on it, in [0, 1].
    pub uv: [f64; 2],
    /// The side that is met.
    pub side: Side,
}

/// A batch of rays, each component side by side.
#[derive(Clone, Debug)]
pub(crate) struct Rays {
    pub(crate) origin: [[f64; WIDTH]; 3],
    pub(crate) direction: [[f64; WIDTH]; 3],
    pub(crate) from: [u32; WIDTH],
    pub(crate) len: usize,
}

impl Default for Rays {
    fn default() -> Self {
        Rays { origin: [[0.0; WIDTH]; 3], direction: [[0.0; WIDTH]; 3], from: [Ray::FREE; WIDTH], len: 0 }
    }
}

impl Rays {
    /// Adds a ray; there must be room.
    #[inline(always)]
    pub(crate) fn push(&mut self, ray: &Ray) {
        for axis in 0..3 {
            self.origin[axis][self.len] = ray.origin[axis];
            self.direction[axis][self.len] = ray.direction[axis];
        }
        self.from[self.len] = ray.from;
        self.len += 1;
    }

    #[inline(always)]
    pub(crate) fn get(&self, i: usize) -> Ray {
        Ray {
            origin: DVec3::from_array(self.origin.each_ref().map(|row| row[i])),
            direction: DVec3::from_array(self.direction.each_ref().map(|row| row[i])),
            from: self.from[i],
        }
    }
}

/// Where the rays of a batch meet surfaces.
#[derive(Clone, Debug)]
pub(crate) struct Hits {
    pub(crate) t: [f64; WIDTH],
    /// `Hits::NONE` where nothing is met.
    pub(crate) surface: [u32; WIDTH],
    pub(crate) uv: [[f64; WIDTH]; 2],
    /// 1 where the front is met, −1 where the back is.
    pub(crate) facing: [f64; WIDTH],
}

impl Default for Hits {
    fn default() -> Self {
        Hits {
            t: [f64::INFINITY; WIDTH],
            surface: [Self::NONE; WIDTH],
            uv: [[0.0; WIDTH]; 2],
            facing: [1.0; WIDTH],
        }
    }
}

impl Hits {
    /// The surface of no hit.
    pub(crate) const NONE: u32 = u32::MAX;

    /// Takes over what ray `j` of another batch has met, as that of ray `i`.
    pub(crate) fn take(&mut self, i: usize, other: &Hits, j: usize) {
        (self.t[i], self.surface[i], self.facing[i]) = (other.t[j], other.surface[j], other.facing[j]);
        self.uv.iter_mut().zip(&other.uv).for_each(|(row, other)| row[i] = other[j]);
    }

    #[inline(always)]
    pub(crate) fn get(&self, i: usize) -> Option<Hit> {
        (self.surface[i] != Self::NONE).then(|| Hit {
            t: self.t[i],
            surface: self.surface[i],
            uv: [self.uv[0][i], self.uv[1][i]],
            side: if self.facing[i] > 0.0 { Side::Front } else { Side::Back },
        })
    }
}
