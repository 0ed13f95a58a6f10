//! Whether a segment goes through a triangle: by exact predicates, since rounding would decide where they all but touch.

use glam::DVec3;
use robust::{Coord3D, orient3d};

/// Whether the ends of a segment lie strictly on either side of a triangle's plane, and the segment meets the triangle.
/// Exact for the coordinates as given (J. R. Shewchuk, *Adaptive precision floating-point arithmetic*, 1997).
pub(crate) fn pierces([from, to]: [DVec3; 2], [a, b, c]: &[DVec3; 3]) -> bool {
    let volume = |p: DVec3, q: DVec3, r: DVec3, s: DVec3| orient3d(coord(p), coord(q), coord(r), coord(s));
    let (below, above) = (volume(*a, *b, *c, from), volume(*a, *b, *c, to));
    let opposite = (below < 0.0 && above > 0.0) || (below > 0.0 && above < 0.0);
    if !opposite {
        return false;
    }
    let turns = [volume(from, to, *a, *b), volume(from, to, *b, *c), volume(from, to, *c, *a)];
    turns.iter().all(|turn| *turn >= 0.0) || turns.iter().all(|turn| *turn <= 0.0)
}

fn coord(point: DVec3) -> Coord3D<f64> {
    Coord3D { x: point.x, y: point.y, z: point.z }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn touching_is_not_piercing() {
        let triangle = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let at = |z: f64| DVec3::new(0.25, 0.25, z);
        assert!(pierces([at(1.0), at(-1.0)], &triangle) && pierces([at(-1.0), at(1.0)], &triangle));
        // The products of such heights underflow in floating point.
        assert!(pierces([at(1e-200), at(-1e-200)], &triangle));
        assert!(!pierces([at(1.0), at(0.0)], &triangle) && !pierces([at(1.0), at(0.5)], &triangle));
        assert!(!pierces([at(1.0) + DVec3::X, at(-1.0) + DVec3::X], &triangle));
    }
}
