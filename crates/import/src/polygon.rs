//! Cutting of polygons, also with holes, into triangles.

use glam::{DVec2, DVec3};

/// The triangles of a polygon, and its faults.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Triangulation {
    /// The triangles, as indices of the polygon's corners.
    pub(crate) triangles: Vec<[usize; 3]>,
    /// Whether corners lie off the common plane by more than [`FLAT`] of the polygon's size.
    pub(crate) bent: bool,
    /// Whether the triangles do not add up to the polygon's area: its outline crosses itself.
    pub(crate) crossed: bool,
}

/// The most distance of corners from the plane of their polygon, in parts of its size, that is not reported.
const FLAT: f64 = 1e-3;

/// The most relative difference of areas before an outline counts as crossed.
const SAME_AREA: f64 = 1e-6;

/// Cuts a polygon into triangles that keep its orientation. Corners from `holes[i]` on, to the next hole or the end,
/// are the outline of hole i. Convex polygons become a fan from their first corner; others are cut by their ears.
pub(crate) fn cut(corners: &[DVec3], holes: &[usize]) -> Triangulation {
    if corners.len() == 3 {
        return Triangulation { triangles: vec![[0, 1, 2]], ..Triangulation::default() };
    }
    let outline = &corners[..holes.first().copied().unwrap_or(corners.len())];
    let normal = newell(outline);
    if corners.len() < 3 || normal.length_squared() == 0.0 || !normal.is_finite() {
        // Without a plane there is no area: one degenerate triangle stands for the polygon in the counts.
        return Triangulation {
            triangles: vec![[0, 0, 0]; usize::from(!corners.is_empty())],
            ..Triangulation::default()
        };
    }
    let flat: Vec<DVec2> = corners.iter().map(|&corner| flatten(corner, normal)).collect();
    let bent = is_bent(corners, normal.normalize());
    if holes.is_empty() && is_convex(&flat) {
        let triangles = (2..corners.len()).map(|i| [0, i - 1, i]).collect();
        return Triangulation { triangles, bent, crossed: false };
    }
    let triangles = cut_ears(&flat, holes);
    let crossed = !same_area(&flat, holes, &triangles);
    Triangulation { triangles, bent, crossed }
}

/// The unit normal of an outline that runs counter-clockwise seen from its front; `None` if it has no area.
pub(crate) fn normal(outline: &[DVec3]) -> Option<DVec3> {
    newell(outline).try_normalize()
}

/// Twice the area of a closed outline, along its normal (Newell's sum).
fn newell(outline: &[DVec3]) -> DVec3 {
    let origin = outline.first().copied().unwrap_or_default();
    let next = |i: usize| outline[(i + 1) % outline.len()] - origin;
    (0..outline.len()).map(|i| (outline[i] - origin).cross(next(i))).sum()
}

/// Drops the axis that the normal is longest along; counter-clockwise seen from the normal stays so.
fn flatten(point: DVec3, normal: DVec3) -> DVec2 {
    let size = normal.abs();
    let (x, y, along) = if size.x >= size.y && size.x >= size.z {
        (point.y, point.z, normal.x)
    } else if size.y >= size.z {
        (point.z, point.x, normal.y)
    } else {
        (point.x, point.y, normal.z)
    };
    if along > 0.0 { DVec2::new(x, y) } else { DVec2::new(y, x) }
}

fn is_bent(corners: &[DVec3], normal: DVec3) -> bool {
    let heights = corners.iter().map(|corner| (*corner - corners[0]).dot(normal));
    let (low, high) =
        heights.fold((0.0_f64, 0.0_f64), |(low, high), height| (low.min(height), high.max(height)));
    let size = corners.iter().fold(0.0_f64, |size, corner| size.max(corner.distance(corners[0])));
    high - low > FLAT * size
}

/// Whether every corner turns left, by more than rounding.
fn is_convex(flat: &[DVec2]) -> bool {
    let n = flat.len();
    let edge = |i: usize| flat[(i + 1) % n] - flat[i % n];
    let left = |i: usize| edge(i).perp_dot(edge(i + 1)) > 1e-12 * edge(i).length() * edge(i + 1).length();
    // Outlines that wind round twice also turn left everywhere.
    let turn: f64 = (0..n).map(|i| edge(i).angle_to(edge(i + 1))).sum();
    (0..n).all(left) && turn < 1.5 * std::f64::consts::TAU
}

fn cut_ears(flat: &[DVec2], holes: &[usize]) -> Vec<[usize; 3]> {
    let numbers: Vec<f64> = flat.iter().flat_map(|point| point.to_array()).collect();
    let ears = earcutr::earcut(&numbers, holes, 2).unwrap_or_default();
    let oriented = |ear: &[usize]| {
        let [a, b, c] = [ear[0], ear[1], ear[2]];
        if (flat[b] - flat[a]).perp_dot(flat[c] - flat[a]) < 0.0 { [a, c, b] } else { [a, b, c] }
    };
    ears.chunks_exact(3).map(oriented).collect()
}

fn same_area(flat: &[DVec2], holes: &[usize], triangles: &[[usize; 3]]) -> bool {
    let ends = holes.iter().copied().chain([flat.len()]);
    let starts = [0].into_iter().chain(holes.iter().copied());
    let rings: Vec<f64> = starts.zip(ends).map(|(start, end)| ring_area(&flat[start..end]).abs()).collect();
    let expected = rings[0] - rings[1..].iter().sum::<f64>();
    let covered: f64 =
        triangles.iter().map(|[a, b, c]| (flat[*b] - flat[*a]).perp_dot(flat[*c] - flat[*a]).abs()).sum();
    (covered - expected).abs() <= SAME_AREA * rings[0]
}

/// Twice the signed area of a ring.
fn ring_area(ring: &[DVec2]) -> f64 {
    (1..ring.len().saturating_sub(1)).map(|i| (ring[i] - ring[0]).perp_dot(ring[i + 1] - ring[0])).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(corners: &[DVec3], cut: &Triangulation) -> DVec3 {
        let corner = |i: usize| corners[i];
        let twice =
            cut.triangles.iter().map(|&[a, b, c]| (corner(b) - corner(a)).cross(corner(c) - corner(a)));
        0.5 * twice.sum::<DVec3>()
    }

    fn points(points: &[[f64; 3]]) -> Vec<DVec3> {
        points.iter().map(|&point| point.into()).collect()
    }

    #[test]
    fn a_convex_polygon_is_a_fan() {
        let square = points(&[[0., 0., 1.], [0., 1., 1.], [1., 1., 1.], [1., 0., 1.]]);
        assert_eq!(cut(&square, &[]).triangles, [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn a_concave_polygon_keeps_area_and_orientation_in_every_direction() {
        let flat = [[0., 0.], [2., 0.], [2., 1.], [1., 1.], [1., 2.], [0., 2.]];
        let turns: [fn([f64; 2]) -> DVec3; 6] = [
            |[x, y]| DVec3::new(x, y, 3.0),
            |[x, y]| DVec3::new(y, x, 3.0),
            |[x, y]| DVec3::new(3.0, x, y),
            |[x, y]| DVec3::new(3.0, y, x),
            |[x, y]| DVec3::new(y, 3.0, x),
            |[x, y]| DVec3::new(x, 3.0, y),
        ];
        for turn in turns {
            let corners: Vec<DVec3> = flat.into_iter().map(turn).collect();
            let found = cut(&corners, &[]);
            assert!((area(&corners, &found) - 0.5 * newell(&corners)).length() < 1e-12);
            assert_eq!((found.triangles.len(), found.bent, found.crossed), (4, false, false));
        }
    }

    #[test]
    fn holes_are_left_out() {
        let corners = points(&[
            [0., 0., 0.],
            [3., 0., 0.],
            [3., 3., 0.],
            [0., 3., 0.],
            [1., 1., 0.],
            [1., 2., 0.],
            [2., 2., 0.],
            [2., 1., 0.],
        ]);
        let found = cut(&corners, &[4]);
        assert!((area(&corners, &found) - DVec3::Z * 8.0).length() < 1e-12);
        assert!(!found.crossed);
    }

    #[test]
    fn a_seam_to_a_hole_is_no_fault() {
        let corners = points(&[
            [0., 0., 0.],
            [3., 0., 0.],
            [3., 3., 0.],
            [0., 3., 0.],
            [0., 0., 0.],
            [1., 1., 0.],
            [1., 2., 0.],
            [2., 2., 0.],
            [2., 1., 0.],
            [1., 1., 0.],
        ]);
        let found = cut(&corners, &[]);
        assert!((area(&corners, &found) - DVec3::Z * 8.0).length() < 1e-12);
    }

    #[test]
    fn bent_and_crossed_outlines_are_reported() {
        let bent = points(&[[0., 0., 0.], [1., 0., 0.2], [1., 1., 0.], [0., 1., 0.2]]);
        assert!(cut(&bent, &[]).bent);
        let crossed = points(&[[0., 0., 0.], [2., 2., 0.], [2., 0., 0.], [0., 3., 0.]]);
        assert!(cut(&crossed, &[]).crossed);
    }
}
