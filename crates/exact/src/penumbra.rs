//! The exchange between two polygons that see only parts of each other.
//!
//! A_iF_ij is the integral over i of the form factor from a point to what it sees of j. That form factor is
//! closed (Lambert's, of j less the shadows of the occluders) and continuous, with kinks where shadows begin
//! to touch; triangles and parallelograms of i are cut in four where a rule of degree 5 and one of degree 2 or 3 disagree.

use std::cell::RefCell;

use glam::DVec3;

use crate::cubature::GAUSS_3;
use crate::occlusion::Occluders;
use crate::polygon::{CutPlane, Polygons, area, bounding_sphere, fan, point_form_factor};

/// Cuts of a triangle at most; the least then is 4⁻⁸ of the largest.
const DEPTH: u32 = 8;

/// How often both ways are made to agree, each time twice as finely and with one cut more, wanted or not: a shadow that no point
/// has met asks for none.
const ROUNDS: u32 = 6;

/// The round that tells whether polygons of which no point sees the other are dark to each other: its points are a seventieth of a
/// polygon away from its edges, so that between squares a side apart a slit along the edge is met if 2·10⁻⁵ of the light go through.
const ROUND_IN_THE_DARK: u32 = 3;

/// Two polygons in front of each other, with what stands between them.
pub(crate) struct Penumbra<'a> {
    occluders: &'a Occluders,
    /// Numbers of the occluders that count.
    between: &'a [usize],
    /// What a point sees, kept from point to point.
    seen: RefCell<Polygons>,
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
struct IntegrationPoint<'a> {
    normal: DVec3,
    target: &'a [DVec3],
}

impl<'a> Penumbra<'a> {
    pub(crate) fn new(occluders: &'a Occluders, between: &'a [usize]) -> Self {
        Penumbra { occluders, between, seen: RefCell::default() }
    }

    /// A_iF_ij [m²] of polygons `p` and `q` with the planes they lie in, to about `tolerance` [m²].
    ///
    /// Integrated over `p` and, independently, over `q`, more finely until both agree: where all points of one
    /// miss a sliver of light, those of the other need not. The points of one are no mirror image of the
    /// other's, so that the errors are not, either. No error below the tolerance is claimed.
    pub(crate) fn exchange_area(
        &self,
        p: (&[DVec3], &CutPlane),
        q: (&[DVec3], &CutPlane),
        tolerance: f64,
    ) -> Estimated {
        let towards_q = IntegrationPoint { normal: p.1.normal, target: q.0 };
        let towards_p = IntegrationPoint { normal: q.1.normal, target: p.0 };
        let both = |round: u32| {
            let goal = tolerance * 0.5_f64.powi(round as i32);
            Estimated::between(
                integral(&|point| self.seen(&towards_q, point), &wholes(p.0), goal / area(p.0), round),
                integral(&|point| self.seen(&towards_p, point), &triangles(q.0), goal / area(q.0), round),
                tolerance,
            )
        };
        let mut estimated = both(0);
        let first = if estimated.value == 0.0 { ROUND_IN_THE_DARK } else { 1 };
        for round in first..ROUNDS {
            if estimated.error <= tolerance && (estimated.value > 0.0 || round > first) {
                break;
            }
            estimated = both(round);
        }
        estimated
    }

    /// The form factor from a point to what it sees of the target.
    fn seen(&self, view: &IntegrationPoint, point: DVec3) -> f64 {
        let mut seen = self.seen.borrow_mut();
        self.occluders.see(point, view.target, self.between, &mut seen);
        seen.iter().map(|part| point_form_factor(point, view.normal, part)).sum()
    }
}

/// What is integrated over polygons, by point.
type Integrand<'a> = &'a dyn Fn(DVec3) -> f64;

/// The integral over parts, each cut `least` times at least, to an error per area of about `density`.
pub(crate) fn integral(seen: Integrand, parts: &[QuadratureDomain], density: f64, least: u32) -> Estimated {
    let parts = parts.iter().map(|part| refined(seen, part, density, [least, DEPTH]));
    parts.fold(Estimated::default(), Estimated::plus)
}

/// The integral over a part, cut in four until the error per area is below `density`, at least `least` and at
/// most `most` times.
fn refined(seen: Integrand, part: &QuadratureDomain, density: f64, [least, most]: [u32; 2]) -> Estimated {
    if least == 0 {
        let whole = match part {
            QuadratureDomain::Triangle(corners) => over_triangle(seen, *corners),
            QuadratureDomain::Parallelogram(corners) => over_parallelogram(seen, *corners),
        };
        if most == 0 || whole.error <= density * part.area() {
            return whole;
        }
    }
    let cuts = [least.saturating_sub(1), most - 1];
    let parts = part.quarters().into_iter().map(|quarter| refined(seen, &quarter, density, cuts));
    parts.fold(Estimated::default(), Estimated::plus)
}

/// The integral over a parallelogram, given by a corner and its two neighbours, by Gauss's product rule of degree 5. Its error
/// is taken as an eighth of the difference to the rule of degree 3 on five of the same nine points.
fn over_parallelogram(seen: Integrand, [corner, corner_u, corner_v]: [DVec3; 3]) -> Estimated {
    let (u, v) = (corner_u - corner, corner_v - corner);
    let seen = |s: f64, t: f64| seen(corner + u * s + v * t);
    let (mut fine, mut diagonal) = (0.0, 0.0);
    for (k, &(s, w_s)) in GAUSS_3.iter().enumerate() {
        for (l, &(t, w_t)) in GAUSS_3.iter().enumerate() {
            let here = seen(s, t);
            fine += w_s * w_t * here;
            // With the weight 5/36 at the outer four, squares are integrated: 4·5/36·(3/5)/4 is 1/12, the variance on [0, 1].
            diagonal += match (k, l) {
                (1, 1) => 4.0 / 9.0 * here,
                (0 | 2, 0 | 2) => 5.0 / 36.0 * here,
                _ => 0.0,
            };
        }
    }
    let area = u.cross(v).length();
    Estimated { value: area * fine, error: 0.125 * area * (fine - diagonal).abs() }
}

/// The integral over a triangle by Radon's rule of degree 5 (1948). Its error is taken as an eighth of the
/// difference to the rule of degree 2 on four of the same seven points: at kinks, too, it is the better.
fn over_triangle(seen: Integrand, [a, b, c]: [DVec3; 3]) -> Estimated {
    let root = 15.0_f64.sqrt();
    let (outer, w_outer) = ((6.0 - root) / 21.0, (155.0 - root) / 400.0);
    let (inner, w_inner) = ((6.0 + root) / 21.0, (155.0 + root) / 400.0);
    // Four points integrate squares if this is the weight of the outer three.
    let w_corner = (1.0 / 18.0) / ((2.0 * outer * outer + (1.0 - 2.0 * outer).powi(2)) / 3.0 - 1.0 / 9.0);
    let orbit = |t: f64| {
        let near = |x: DVec3, y: DVec3, z: DVec3| seen(x * (1.0 - 2.0 * t) + (y + z) * t);
        (near(a, b, c) + near(b, c, a) + near(c, a, b)) / 3.0
    };
    let (middle, outer, inner) = (seen((a + b + c) / 3.0), orbit(outer), orbit(inner));
    let area = area(&[a, b, c]);
    let fine = 0.225 * middle + w_outer * outer + w_inner * inner;
    let coarse = (1.0 - w_corner) * middle + w_corner * outer;
    Estimated { value: area * fine, error: 0.125 * area * (fine - coarse).abs() }
}

/// What is integrated over by one rule.
pub(crate) enum QuadratureDomain {
    /// The corners.
    Triangle([DVec3; 3]),
    /// A corner and its two neighbours.
    Parallelogram([DVec3; 3]),
}

impl QuadratureDomain {
    fn area(&self) -> f64 {
        match self {
            QuadratureDomain::Triangle(corners) => area(corners),
            QuadratureDomain::Parallelogram([corner, u, v]) => (u - corner).cross(v - corner).length(),
        }
    }

    /// Its four equal quarters.
    fn quarters(&self) -> [QuadratureDomain; 4] {
        match *self {
            QuadratureDomain::Triangle([a, b, c]) => {
                let [ab, bc, ca] = [0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)];
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [bc, ca, ab]].map(QuadratureDomain::Triangle)
            }
            QuadratureDomain::Parallelogram([corner, corner_u, corner_v]) => {
                let (u, v) = (0.5 * (corner_u - corner), 0.5 * (corner_v - corner));
                [corner, corner + u, corner + v, corner + u + v]
                    .map(|corner| QuadratureDomain::Parallelogram([corner, corner + u, corner + v]))
            }
        }
    }
}

/// Whether a polygon is a parallelogram, but for rounding.
fn is_parallelogram(polygon: &[DVec3]) -> bool {
    let [a, b, c, d] = polygon else { return false };
    (a + c).distance(b + d) <= 1e-9 * a.distance(*c)
}

/// A parallelogram as it is, other convex polygons in triangles.
pub(crate) fn wholes(polygon: &[DVec3]) -> Vec<QuadratureDomain> {
    match is_parallelogram(polygon) {
        true => vec![QuadratureDomain::Parallelogram([polygon[0], polygon[1], polygon[3]])],
        false => fan(polygon).map(QuadratureDomain::Triangle).collect(),
    }
}

/// The triangles of a parallelogram on either side of a diagonal, of other convex polygons around the mean of the corners.
fn triangles(polygon: &[DVec3]) -> Vec<QuadratureDomain> {
    if is_parallelogram(polygon) {
        return fan(polygon).map(QuadratureDomain::Triangle).collect();
    }
    let (middle, _) = bounding_sphere(polygon);
    let edge = |k: usize| [middle, polygon[k], polygon[(k + 1) % polygon.len()]];
    (0..polygon.len()).map(edge).map(QuadratureDomain::Triangle).collect()
}
