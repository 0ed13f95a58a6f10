//! Uniform directions in the solid angle of a flat face, seen from a point.
//!
//! J. Arvo, *Stratified sampling of spherical triangles*, SIGGRAPH 1995.

use std::f64::consts::PI;

use glam::DVec3;

/// A triangle of directions.
struct SphericalTriangle {
    /// Its corners, of length 1.
    corners: [DVec3; 3],
    /// The angles at them.
    angles: [f64; 3],
}

impl SphericalTriangle {
    /// The triangle whose corners lie in these directions.
    fn new(ways: [DVec3; 3]) -> Self {
        let corners = ways.map(DVec3::normalize_or_zero);
        let angle = |i: usize| {
            let [at, to, other] = [0, 1, 2].map(|k| corners[(i + k) % 3]);
            at.cross(to).angle_between(at.cross(other))
        };
        SphericalTriangle { corners, angles: [0, 1, 2].map(angle) }
    }

    /// Its solid angle [sr].
    fn area(&self) -> f64 {
        (self.angles.iter().sum::<f64>() - PI).max(0.0)
    }

    /// A uniform direction, by two uniform numbers: the first chooses the triangle on one side of a great circle through the second corner, the other a place on
    /// that circle.
    fn direction(&self, [part, along]: [f64; 2]) -> DVec3 {
        let ([a, b, c], alpha) = (self.corners, self.angles[0]);
        let (s, t) = (part * self.area() - alpha).sin_cos();
        let (sin, cos) = alpha.sin_cos();
        let (u, v) = (t - cos, s + sin * a.dot(b));
        let q = ((v * t - u * s) * cos - v) / ((v * s + u * t) * sin);
        let on = |from: DVec3, to: DVec3, cos: f64| {
            // Where the sine of a corner is 0, the triangle has no area, and any direction will do.
            let cos = if cos.is_nan() { 1.0 } else { cos.clamp(-1.0, 1.0) };
            from * cos + (to - to.dot(from) * from).normalize_or_zero() * (1.0 - cos * cos).sqrt()
        };
        let end = on(a, c, q);
        on(b, end, 1.0 - along * (1.0 - end.dot(b)))
    }
}

/// A flat face with three or four corners, seen from a point that is not in its plane.
pub(super) struct FaceInView {
    triangles: Vec<SphericalTriangle>,
    eye: DVec3,
    corner: DVec3,
    normal: DVec3,
    area: f64,
}

/// A point of a face, and its weight in a mean over the face.
pub(super) struct PointInView {
    pub(super) place: DVec3,
    /// The density of uniform points at that place, over the density of points in view.
    pub(super) weight: f64,
}

/// Nearer to the plane of a face than this part of its size a point sees it as a line.
const LEVEL: f64 = 1e-6;

/// Nearer than this many of its radii a face differs so much in distance that uniform points are a poor choice.
const NEAR: f64 = 2.0;

/// How a point sees a face.
pub(super) enum FaceView {
    /// From afar, where uniform points serve as well: no point of the face is nearer than this.
    Far(f64),
    /// From its own plane: not at all.
    Edge,
    /// From nearby.
    Near(FaceInView),
}

impl FaceView {
    /// A face with these corners, three or four, as it is seen from a point.
    pub(super) fn from(eye: DVec3, corners: &[DVec3]) -> Self {
        let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let radius = corners.iter().map(|corner| corner.distance(middle)).fold(0.0, f64::max);
        let distance = eye.distance(middle);
        let Some(&[a, b, c]) = corners.first_chunk().filter(|_| distance <= NEAR * radius) else {
            return FaceView::Far(distance - radius);
        };
        let normal = (b - a).cross(c - a).normalize_or_zero();
        if normal.dot(eye - a).abs() <= LEVEL * radius {
            return FaceView::Edge;
        }
        let triangles = (2..corners.len())
            .map(|i| SphericalTriangle::new([a, corners[i - 1], corners[i]].map(|corner| corner - eye)));
        FaceView::Near(FaceInView {
            triangles: triangles.collect(),
            eye,
            corner: a,
            normal,
            area: area(corners),
        })
    }
}

/// The area of a triangle or a parallelogram.
fn area(corners: &[DVec3]) -> f64 {
    let across = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    0.5 * across.length() * (corners.len() - 2) as f64
}

/// The most that a sample of a face finds of a lamp of intensity 1 at a place [1/m²]: cos θ/d², or what all directions together bring.
pub(crate) fn most_of_unit_lamp(lamp: DVec3, corners: &[DVec3]) -> f64 {
    match FaceView::from(lamp, corners) {
        FaceView::Far(distance) => distance.powi(-2),
        FaceView::Edge | FaceView::Near(_) => 2.0 * PI / area(corners),
    }
}

impl FaceInView {
    /// A point by two uniform numbers in (0, 1).
    pub(super) fn point(&self, [choice, along]: [f64; 2]) -> PointInView {
        let all: f64 = self.triangles.iter().map(SphericalTriangle::area).sum();
        let mut left = choice * all;
        let mut chosen = &self.triangles[0];
        for triangle in &self.triangles {
            chosen = triangle;
            if left <= triangle.area() {
                break;
            }
            left -= triangle.area();
        }
        let direction = chosen.direction([(left / chosen.area()).min(1.0), along]);
        let upright = self.normal.dot(direction);
        let distance = self.normal.dot(self.corner - self.eye) / upright;
        let place = self.eye + distance * direction;
        PointInView { place, weight: all * distance * distance / (self.area * upright.abs()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// From a point over one corner of an a × b rectangle at height 1 the solid angle is atan(ab/√(1 + a² + b²)); points in view, weighed, have the
    /// moments of uniform points.
    #[test]
    fn weighed_points_in_view_are_uniform_points() {
        for (eye, [a, b]) in
            [([0.0, 0.0, 1.0], [1.0, 2.0]), ([0.0, 0.0, 0.02], [0.7, 0.3]), ([0.3, 0.1, -0.05], [0.5, 0.5])]
        {
            let corners = [[0.0, 0.0], [a, 0.0], [a, b], [0.0, b]].map(|[x, y]| DVec3::new(x, y, 0.0));
            let FaceView::Near(face) = FaceView::from(eye.into(), &corners) else { panic!("it is near") };
            let all: f64 = face.triangles.iter().map(SphericalTriangle::area).sum();
            let [x, y, h] = eye;
            let quadrant = |a: f64, b: f64| {
                let (a, b) = (a / h.abs(), b / h.abs());
                (a * b / (1.0 + a * a + b * b).sqrt()).atan()
            };
            let exact = quadrant(x, y) + quadrant(x, b - y) + quadrant(a - x, y) + quadrant(a - x, b - y);
            assert!((all - exact).abs() < 1e-12, "{all} {exact}");
            // The mean of x·cos/d² over the face, by a grid of uniform points and by one of points in view.
            const N: u32 = 2000;
            let grid = |f: &dyn Fn([f64; 2]) -> f64| {
                let at = |i: u32| (f64::from(i) + 0.5) / f64::from(N);
                let sum: f64 = (0..N * N).map(|i| f([at(i / N), at(i % N)])).sum();
                sum / f64::from(N * N)
            };
            let light = |place: DVec3| {
                let way = place - DVec3::from(eye);
                (1.0 + place.x) * way.z.abs() / way.length().powi(3)
            };
            let uniform = grid(&|[r, s]| light(DVec3::new(a * r, b * s, 0.0)));
            let in_view = grid(&|numbers| {
                let PointInView { place, weight } = face.point(numbers);
                assert!((0.0..=a).contains(&(place.x + 1e-9).min(a)) && place.y < b + 1e-9, "{place}");
                weight * light(place)
            });
            assert!((in_view / uniform - 1.0).abs() < 1e-3, "{in_view} {uniform}");
        }
    }

    #[test]
    fn far_faces_and_those_seen_edge_on_have_uniform_points() {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let view = |z| FaceView::from(DVec3::new(0.2, 0.2, z), &corners);
        assert!(matches!(view(0.3), FaceView::Near(_)));
        assert!(matches!(view(5.0), FaceView::Far(distance) if distance > 4.0));
        assert!(matches!(view(0.0), FaceView::Edge));
    }
}
