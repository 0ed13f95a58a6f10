//! Axis-aligned rectangles with a front.

use glam::DVec3;

/// The direction along its axis in which a rectangle's front looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Facing {
    /// The front faces larger coordinates.
    Up,
    /// The front faces smaller coordinates.
    Down,
}

/// An axis-aligned rectangle that radiates from its front [m].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rectangle {
    /// The axis of the normal: 0, 1, 2 for x, y, z.
    pub axis: usize,
    /// The direction of the normal along that axis.
    pub facing: Facing,
    /// The corner with the smallest coordinates [m].
    pub lo: DVec3,
    /// The corner with the largest coordinates [m]; equals `lo` along `axis`.
    pub hi: DVec3,
}

impl Rectangle {
    /// The area of the rectangle [m²].
    pub fn area(&self) -> f64 {
        let [p, q] = self.spanned();
        (self.hi[p] - self.lo[p]) * (self.hi[q] - self.lo[q])
    }

    /// The two axes that the rectangle extends along, ascending.
    pub(crate) fn spanned(&self) -> [usize; 2] {
        [[1, 2], [0, 2], [0, 1]][self.axis]
    }

    /// The rectangle's extent along one axis [m].
    pub(crate) fn interval(&self, axis: usize) -> [f64; 2] {
        [self.lo[axis], self.hi[axis]]
    }

    /// The distances in front of this rectangle's plane [m] that another one reaches over, ascending. What is
    /// behind the plane counts as in the plane: neither exchanges anything.
    pub(crate) fn heights_of(&self, other: &Rectangle) -> [f64; 2] {
        let level = self.lo[self.axis];
        let [lo, hi] = other.interval(self.axis);
        match self.facing {
            Facing::Up => [lo - level, hi - level],
            Facing::Down => [level - hi, level - lo],
        }
        .map(|height| height.max(0.0))
    }
}
