//! Convex polygons in space: cutting them by planes, and what a point sees of one.

use std::f64::consts::TAU;

use glam::DVec3;

/// The corners of a planar convex polygon [m], counterclockwise seen from its front; empty if nothing is left.
pub(crate) type Polygon = Vec<DVec3>;

/// A plane: the points x with normal·x = offset.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CutPlane {
    /// Unit normal; points to the front.
    pub normal: DVec3,
    offset: f64,
}

impl CutPlane {
    /// The plane through a point with a normal of any length above 0.
    pub(crate) fn through(point: DVec3, normal: DVec3) -> Self {
        let normal = normal.normalize();
        CutPlane { normal, offset: normal.dot(point) }
    }

    /// How far a point is in front [m].
    pub(crate) fn height(&self, point: DVec3) -> f64 {
        self.normal.dot(point) - self.offset
    }

    /// The plane seen from behind.
    pub(crate) fn flipped(&self) -> Self {
        CutPlane { normal: -self.normal, offset: -self.offset }
    }

    /// Whether no point is further behind than `tolerance` [m].
    pub(crate) fn is_all_in_front(&self, points: &[DVec3], tolerance: f64) -> bool {
        points.iter().all(|&point| self.height(point) >= -tolerance)
    }

    /// The lowest and the highest of some points.
    pub(crate) fn range(&self, points: &[DVec3]) -> [f64; 2] {
        range(points.iter().map(|&point| self.height(point)))
    }
}

/// The part of a polygon in front of a plane. What is within `tolerance` [m] of the plane follows the rest.
pub(crate) fn in_front(polygon: &[DVec3], plane: &CutPlane, tolerance: f64) -> Polygon {
    let [low, high] = plane.range(polygon);
    if high <= tolerance {
        return vec![];
    }
    if low >= -tolerance {
        return polygon.to_vec();
    }
    // Sutherland & Hodgman 1974
    let mut kept = Polygon::with_capacity(polygon.len() + 1);
    for (k, &from) in polygon.iter().enumerate() {
        let to = polygon[(k + 1) % polygon.len()];
        let (start, end) = (plane.height(from), plane.height(to));
        if start >= 0.0 {
            kept.push(from);
        }
        if (start >= 0.0) != (end >= 0.0) {
            kept.push(from + (to - from) * (start / (start - end)));
        }
    }
    kept
}

/// Convex polygons, the corners of all of them in one list; what is needed to cut them is kept from cut to cut.
#[derive(Clone, Debug, Default)]
pub(crate) struct Polygons {
    list: List,
    /// What is left of `list` while it is cut.
    kept: List,
    /// A polygon while planes cut it one after the other: what is behind all planes so far, and behind the next one.
    rest: [Polygon; 2],
    /// Its corners' heights above a plane [m].
    heights: Vec<f64>,
}

/// Corners of polygons side by side, and where each polygon ends.
#[derive(Clone, Debug, Default)]
struct List {
    corners: Polygon,
    ends: Vec<usize>,
}

impl List {
    fn clear(&mut self) {
        self.corners.clear();
        self.ends.clear();
    }

    fn push(&mut self, polygon: &[DVec3]) {
        self.corners.extend_from_slice(polygon);
        self.end();
    }

    /// Makes a polygon of the corners since the last one.
    fn end(&mut self) {
        self.ends.push(self.corners.len());
    }

    fn iter(&self) -> impl Iterator<Item = &[DVec3]> {
        let begins = std::iter::once(&0).chain(&self.ends);
        begins.zip(&self.ends).map(|(&begin, &end)| &self.corners[begin..end])
    }
}

impl Polygons {
    /// One polygon, in place of those before.
    pub(crate) fn begin(&mut self, polygon: &[DVec3]) {
        self.list.clear();
        self.list.push(polygon);
    }

    /// All of them.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &[DVec3]> {
        self.list.iter()
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.list.ends.is_empty()
    }

    /// Takes away all that is behind every one of some planes. The rest stays, in convex parts.
    pub(crate) fn take_away(&mut self, planes: &[CutPlane], tolerance: f64) {
        let whole = |polygon: &[DVec3]| planes.iter().any(|plane| plane.is_all_in_front(polygon, tolerance));
        let Polygons { list, kept, rest: [rest, next], heights } = self;
        let Some(first) = list.iter().position(|polygon| !whole(polygon)) else { return };
        kept.clear();
        for (number, polygon) in list.iter().enumerate() {
            if number < first || number > first && whole(polygon) {
                kept.push(polygon);
                continue;
            }
            rest.clear();
            rest.extend_from_slice(polygon);
            for plane in planes {
                split(rest, plane, tolerance, (kept, next), heights);
                std::mem::swap(rest, next);
                if rest.is_empty() {
                    break;
                }
            }
        }
        std::mem::swap(list, kept);
    }
}

/// Adds the part of a polygon in front of a plane to a list, and puts the part behind it in place of `behind`: [`in_front`] of both
/// sides of the plane, together.
fn split(
    polygon: &[DVec3],
    plane: &CutPlane,
    tolerance: f64,
    (front, behind): (&mut List, &mut Polygon),
    heights: &mut Vec<f64>,
) {
    behind.clear();
    heights.clear();
    heights.extend(polygon.iter().map(|&corner| plane.height(corner)));
    let [low, high] = range(heights.iter().copied());
    if low >= -tolerance || high <= tolerance {
        // What is within the tolerance of the plane is of no side.
        if high > tolerance {
            front.push(polygon);
        }
        if low < -tolerance {
            behind.extend_from_slice(polygon);
        }
        return;
    }
    let next = |k: usize| if k + 1 < polygon.len() { k + 1 } else { 0 };
    for (k, (&from, &start)) in polygon.iter().zip(&*heights).enumerate() {
        let (to, end) = (polygon[next(k)], heights[next(k)]);
        if start >= 0.0 {
            front.corners.push(from);
        }
        if start <= 0.0 {
            behind.push(from);
        }
        let crosses = [(start >= 0.0) != (end >= 0.0), (start <= 0.0) != (end <= 0.0)];
        if crosses != [false; 2] {
            let crossing = from + (to - from) * (start / (start - end));
            if crosses[0] {
                front.corners.push(crossing);
            }
            if crosses[1] {
                behind.push(crossing);
            }
        }
    }
    front.end();
}

/// The lowest and the highest of some heights.
fn range(heights: impl Iterator<Item = f64>) -> [f64; 2] {
    heights
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], height| [low.min(height), high.max(height)])
}

/// The triangles of a convex polygon around its first corner.
pub(crate) fn fan(polygon: &[DVec3]) -> impl Iterator<Item = [DVec3; 3]> {
    polygon[1..].windows(2).map(|edge| [polygon[0], edge[0], edge[1]])
}

/// The area of a planar polygon [m²].
pub(crate) fn area(polygon: &[DVec3]) -> f64 {
    0.5 * doubled_area_vector(polygon).length()
}

/// Twice the area [m²] times the unit normal of the front.
pub(crate) fn doubled_area_vector(polygon: &[DVec3]) -> DVec3 {
    polygon.windows(2).skip(1).map(|edge| (edge[0] - polygon[0]).cross(edge[1] - polygon[0])).sum()
}

/// The mean of the corners, and the distance of the farthest from it [m].
pub(crate) fn bounding_sphere(polygon: &[DVec3]) -> (DVec3, f64) {
    let center = polygon.iter().sum::<DVec3>() / polygon.len() as f64;
    let radius = polygon.iter().map(|corner| corner.distance(center)).fold(0.0, f64::max);
    (center, radius)
}

/// The form factor from a point with this unit normal to the front of a polygon above its horizon (Lambert
/// 1760): 1/2π Σ over the edges of the angle they subtend × the cosine to the normal of their plane.
pub(crate) fn point_form_factor(point: DVec3, normal: DVec3, polygon: &[DVec3]) -> f64 {
    let mut from = polygon[polygon.len() - 1] - point;
    let mut sum = 0.0;
    for corner in polygon {
        let to = corner - point;
        let cross = from.cross(to);
        let sine = cross.length();
        if sine > 0.0 {
            // Counterclockwise from the polygon's front is clockwise from the point.
            sum -= sine.atan2(from.dot(to)) * normal.dot(cross) / sine;
        }
        from = to;
    }
    sum / TAU
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The unit square at height 1, facing down.
    fn ceiling() -> Polygon {
        vec![DVec3::Z, DVec3::new(0.0, 1.0, 1.0), DVec3::ONE, DVec3::new(1.0, 0.0, 1.0)]
    }

    /// Howell C-11: 1/2π (x/√(1+x²) atan(y/√(1+x²)) + y/√(1+y²) atan(x/√(1+y²))) at x = y = 1.
    #[test]
    fn a_point_below_the_corner_of_a_square() {
        let expected = 2.0 / TAU * 0.5_f64.sqrt() * 0.5_f64.sqrt().atan();
        assert!((point_form_factor(DVec3::ZERO, DVec3::Z, &ceiling()) - expected).abs() < 1e-15);
    }

    #[test]
    fn both_parts_of_a_cut_polygon_make_the_whole() {
        let plane = CutPlane::through(DVec3::new(0.5, 0.6, 0.0), DVec3::new(1.0, 2.0, 0.5));
        let parts = [plane, plane.flipped()].map(|plane| in_front(&ceiling(), &plane, 1e-12));
        let whole = point_form_factor(DVec3::ZERO, DVec3::Z, &ceiling());
        let sum: f64 = parts.iter().map(|part| point_form_factor(DVec3::ZERO, DVec3::Z, part)).sum();
        assert!((sum - whole).abs() < 1e-15 && parts.iter().all(|part| area(part) > 0.1));
        assert!((parts.iter().map(|part| area(part)).sum::<f64>() - 1.0).abs() < 1e-15);
    }
}
