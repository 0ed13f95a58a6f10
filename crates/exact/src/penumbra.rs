//! The exchange between two polygons that see only parts of each other.
//!
//! A_iF_ij is the integral over i of the form factor from a point to what it sees of j. That form factor is
//! closed (Lambert's, of j less the shadows of the occluders) and continuous, with kinks where shadows begin
//! to touch; the triangles of i are cut where a rule of degree 5 and one of degree 2 disagree.

use glam::DVec3;

use crate::occlusion::Occluders;
use crate::polygon::{Plane, area, bounding_sphere, fan, point_form_factor};

/// Cuts of a triangle at most; the least then is 4⁻⁸ of the largest.
const DEPTH: u32 = 8;

/// How often both ways are made to agree, each time eight times more finely.
const ROUNDS: u32 = 3;

/// By how many cuts more each time, wanted or not: a shadow that no point has met asks for none.
const LEAST_CUTS: u32 = 2;

/// Two polygons in front of each other, with what stands between them.
pub(crate) struct Penumbra<'a> {
    pub occluders: &'a Occluders,
    /// Numbers of the occluders that count.
    pub between: &'a [usize],
}

/// An integral and an estimate of its error [m²].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Estimated {
    pub value: f64,
    pub error: f64,
}

impl Estimated {
    /// An integral without an error worth mentioning.
    pub(crate) fn certain(value: f64) -> Self {
        Estimated { value, error: 0.0 }
    }

    /// The mean of two estimates of the same; it errs by no more than they differ, if they err independently.
    fn between(self, other: Estimated, least: f64) -> Self {
        let error = (self.value - other.value).abs().max(self.error.min(other.error)).max(least);
        Estimated { value: 0.5 * (self.value + other.value), error }
    }

    /// The sum of two integrals, and of their errors.
    pub(crate) fn plus(self, other: Estimated) -> Self {
        Estimated { value: self.value + other.value, error: self.error + other.error }
    }
}

/// A point of the integration: it looks along `normal` at `target`.
struct View<'a> {
    normal: DVec3,
    target: &'a [DVec3],
}

impl Penumbra<'_> {
    /// A_iF_ij [m²] of polygons `p` and `q` with the planes they lie in, to about `tolerance` [m²].
    ///
    /// Integrated over `p` and, independently, over `q`, more finely until both agree: where all points of one
    /// miss a sliver of light, those of the other need not. The triangles of one are no mirror image of the
    /// other's, so that the errors are not, either. No error below the tolerance is claimed.
    pub(crate) fn exchange_area(
        &self,
        p: (&[DVec3], &Plane),
        q: (&[DVec3], &Plane),
        tolerance: f64,
    ) -> Estimated {
        let towards_q = View { normal: p.1.normal, target: q.0 };
        let towards_p = View { normal: q.1.normal, target: p.0 };
        let both = |round: u32| {
            let goal = tolerance * 8.0_f64.powi(-(round as i32));
            let least = LEAST_CUTS * round;
            Estimated::between(
                self.integral(&towards_q, fan(p.0), goal / area(p.0), least),
                self.integral(&towards_p, star(q.0), goal / area(q.0), least),
                tolerance,
            )
        };
        let mut estimated = both(0);
        for round in 1..ROUNDS {
            if estimated.error <= tolerance {
                break;
            }
            estimated = both(round);
        }
        estimated
    }

    /// The integral over triangles, each cut `least` times at least, to an error per area of about `density`.
    fn integral(
        &self,
        view: &View,
        triangles: impl Iterator<Item = [DVec3; 3]>,
        density: f64,
        least: u32,
    ) -> Estimated {
        let parts = triangles.map(|triangle| self.refined(view, triangle, density, [least, DEPTH]));
        parts.fold(Estimated::default(), Estimated::plus)
    }

    /// The integral over a triangle, cut in four until the error per area is below `density`, at least `least` and at
    /// most `most` times.
    fn refined(&self, view: &View, triangle: [DVec3; 3], density: f64, [least, most]: [u32; 2]) -> Estimated {
        if least == 0 {
            let whole = self.over(view, triangle);
            if most == 0 || whole.error <= density * area(&triangle) {
                return whole;
            }
        }
        let [a, b, c] = triangle;
        let [ab, bc, ca] = [0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)];
        let quarters = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [bc, ca, ab]];
        let cuts = [least.saturating_sub(1), most - 1];
        let parts = quarters.into_iter().map(|quarter| self.refined(view, quarter, density, cuts));
        parts.fold(Estimated::default(), Estimated::plus)
    }

    /// The integral over a triangle by Radon's rule of degree 5 (1948). Its error is taken as an eighth of the
    /// difference to the rule of degree 2 on four of the same seven points: at kinks, too, it is the better.
    fn over(&self, view: &View, [a, b, c]: [DVec3; 3]) -> Estimated {
        let root = 15.0_f64.sqrt();
        let (outer, w_outer) = ((6.0 - root) / 21.0, (155.0 - root) / 400.0);
        let (inner, w_inner) = ((6.0 + root) / 21.0, (155.0 + root) / 400.0);
        // Four points integrate squares if this is the weight of the outer three.
        let w_corner = (1.0 / 18.0) / ((2.0 * outer * outer + (1.0 - 2.0 * outer).powi(2)) / 3.0 - 1.0 / 9.0);
        let orbit = |t: f64| {
            let near = |x: DVec3, y: DVec3, z: DVec3| self.seen(view, x * (1.0 - 2.0 * t) + (y + z) * t);
            (near(a, b, c) + near(b, c, a) + near(c, a, b)) / 3.0
        };
        let (middle, outer, inner) = (self.seen(view, (a + b + c) / 3.0), orbit(outer), orbit(inner));
        let area = area(&[a, b, c]);
        let fine = 0.225 * middle + w_outer * outer + w_inner * inner;
        let coarse = (1.0 - w_corner) * middle + w_corner * outer;
        Estimated { value: area * fine, error: 0.125 * area * (fine - coarse).abs() }
    }

    /// The form factor from a point to what it sees of the target.
    fn seen(&self, view: &View, point: DVec3) -> f64 {
        let parts = self.occluders.visible(point, view.target, self.between);
        parts.iter().map(|part| point_form_factor(point, view.normal, part)).sum()
    }
}

/// The triangles of a convex polygon around the mean of its corners.
fn star(polygon: &[DVec3]) -> impl Iterator<Item = [DVec3; 3]> {
    let (middle, _) = bounding_sphere(polygon);
    (0..polygon.len()).map(move |k| [middle, polygon[k], polygon[(k + 1) % polygon.len()]])
}
