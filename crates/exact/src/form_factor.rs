//! Closed-form form factors between axis-aligned rectangles that nothing occludes.
//!
//! Source: Ehlert & Smith, *View factors for perpendicular and parallel rectangular plates*, J. Thermophysics
//! and Heat Transfer 7(1) 1993; Howell's catalogue of configuration factors, C-11 … C-16. Both write A_iF_ij
//! as a sum over the corners of an indefinite integral, whose terms cancel where the rectangles are small
//! against their distance; there [`crate::cubature`] takes over.

use std::f64::consts::PI;

use crate::cubature;
use crate::rectangle::Rectangle;

/// The form factor F_ij from `i` to `j`: the fraction of the power leaving the front of `i`, diffusely and
/// uniformly, that arrives at the front of `j` if nothing is in between. 0 if coplanar or facing away; what
/// lies behind either plane does not count.
///
/// The absolute error is about 10⁻¹⁵ where lengths and distances differ by factors up to 10, 10⁻¹³ up to
/// 1 : 100, 10⁻¹¹ up to 1 : 10⁴; a form factor of 0 may come out negative by as much.
pub fn form_factor(i: &Rectangle, j: &Rectangle) -> f64 {
    exchange_area(i, j) / i.area()
}

/// The exchange area A_iF_ij = A_jF_ji [m²], as accurate as the form factor; see [`form_factor`].
pub fn exchange_area(i: &Rectangle, j: &Rectangle) -> f64 {
    if i.axis == j.axis { parallel(i, j) } else { perpendicular(i, j) }
}

/// Two rectangles with one normal axis see each other if they face each other.
fn parallel(i: &Rectangle, j: &Rectangle) -> f64 {
    let [distance, _] = i.heights_of(j);
    if i.facing == j.facing || distance == 0.0 {
        return 0.0;
    }
    let [p, q] = i.spanned();
    let pair = Parallel { distance, x: [i.interval(p), j.interval(p)], y: [i.interval(q), j.interval(q)] };
    match cubature::rule(pair.separation()) {
        Some(rule) => pair.cubature(rule),
        None => pair.closed_form(),
    }
}

/// Two rectangles with different normal axes see each other where each is in front of the other's plane.
fn perpendicular(i: &Rectangle, j: &Rectangle) -> f64 {
    let (x, xi) = (j.heights_of(i), i.heights_of(j));
    if x[1] == 0.0 || xi[1] == 0.0 {
        return 0.0;
    }
    let shared = 3 - i.axis - j.axis;
    let pair = Perpendicular { x, xi, y: [i.interval(shared), j.interval(shared)] };
    match cubature::rule(pair.separation()) {
        Some(rule) => pair.cubature(rule),
        None => pair.closed_form(),
    }
}

/// Facing rectangles `distance` apart; along x and y the interval of either [m].
struct Parallel {
    distance: f64,
    x: [[f64; 2]; 2],
    y: [[f64; 2]; 2],
}

impl Parallel {
    /// Ehlert & Smith's G for parallel plates over all corners, Howell C-13.
    fn closed_form(&self) -> f64 {
        let scale = self.distance.max(reach(self.x)).max(reach(self.y));
        let z2 = (self.distance / scale).powi(2);
        let corner = |u: f64, v: f64| {
            let (u, v) = (u / scale, v / scale);
            let (a, b) = ((u * u + z2).sqrt(), (v * v + z2).sqrt());
            v * a * (v / a).atan() + u * b * (u / b).atan() - 0.5 * z2 * (u * u + v * v + z2).ln()
        };
        let sum = mixed_difference(self.x, |u| mixed_difference(self.y, |v| corner(u, v)));
        scale * scale * sum / (2.0 * PI)
    }

    /// The kernel is z²/(π r⁴).
    fn cubature(&self, rule: cubature::Rule) -> f64 {
        let z2 = self.distance * self.distance;
        z2 / PI
            * cubature::inverse_fourth_power(
                &cubature::differences(rule, self.x),
                &cubature::differences(rule, self.y),
                &[cubature::Term { weight: 1.0, square: z2 }],
            )
    }

    fn separation(&self) -> f64 {
        let nearest = norm([gap(self.x), gap(self.y), self.distance]);
        nearest / [self.x[0], self.x[1], self.y[0], self.y[1]].map(length).into_iter().fold(0.0, f64::max)
    }
}

/// Rectangles in planes at right angles: the distance x of one from the line where the planes meet, the
/// distance ξ of the other, and along that line the interval of either [m].
struct Perpendicular {
    x: [f64; 2],
    xi: [f64; 2],
    y: [[f64; 2]; 2],
}

impl Perpendicular {
    /// Ehlert & Smith's G for perpendicular plates over all corners, Howell C-15:
    /// w c atan(w/c) − ¼ (c² − w²) ln(c² + w²) with c² = x² + ξ².
    ///
    /// The differences remove what depends on c or w alone. Left out here, it costs no digits: c² ln c² turns
    /// −c² ln(c² + w²) into −c² ln(1 + w²/c²), and w² ln w² turns w² ln(c² + w²) into w² ln(1 + c²/w²).
    fn closed_form(&self) -> f64 {
        let scale = self.x[1].max(self.xi[1]).max(reach(self.y));
        let corner = |x: f64, xi: f64, w: f64| {
            let (x, xi, w) = (x / scale, xi / scale, w.abs() / scale);
            let c = (x * x + xi * xi).sqrt();
            // Every term tends to 0 with either.
            if c.min(w) < f64::MIN_POSITIVE.sqrt() {
                return 0.0;
            }
            let part = |p: f64, q: f64| 0.25 * p * p * (q / p).powi(2).ln_1p();
            w * c * (w / c).atan() - part(c, w) + part(w, c)
        };
        let along = |x: f64, xi: f64| mixed_difference(self.y, |w| corner(x, xi, w));
        let ([x1, x2], [xi1, xi2]) = (self.x, self.xi);
        let sum = along(x2, xi2) - along(x2, xi1) - along(x1, xi2) + along(x1, xi1);
        scale * scale * sum / (2.0 * PI)
    }

    /// The kernel is xξ/(π r⁴).
    fn cubature(&self, rule: cubature::Rule) -> f64 {
        cubature::inverse_fourth_power(
            &cubature::differences(rule, self.y),
            &cubature::distances(rule, self.x),
            &cubature::distances(rule, self.xi),
        ) / PI
    }

    fn separation(&self) -> f64 {
        let nearest = norm([self.x[0], self.xi[0], gap(self.y)]);
        nearest / [self.x, self.xi, self.y[0], self.y[1]].map(length).into_iter().fold(0.0, f64::max)
    }
}

/// Σ (−1)^{k+l} g(a_k − b_l) over the ends of two intervals.
fn mixed_difference([a, b]: [[f64; 2]; 2], g: impl Fn(f64) -> f64) -> f64 {
    (g(a[1] - b[1]) - g(a[1] - b[0])) - (g(a[0] - b[1]) - g(a[0] - b[0]))
}

/// The largest distance between points of two intervals.
fn reach([a, b]: [[f64; 2]; 2]) -> f64 {
    (a[1] - b[0]).max(b[1] - a[0])
}

/// The smallest distance between points of two intervals.
fn gap([a, b]: [[f64; 2]; 2]) -> f64 {
    (a[0] - b[1]).max(b[0] - a[1]).max(0.0)
}

fn length([lo, hi]: [f64; 2]) -> f64 {
    hi - lo
}

fn norm([x, y, z]: [f64; 3]) -> f64 {
    (x * x + y * y + z * z).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Unit squares beyond the distance where cubature takes over, aside from one another by more and more.
    #[test]
    fn cubature_takes_over_where_the_closed_forms_are_still_good() {
        for step in 0..10 {
            let shift = 0.3 * f64::from(step);
            let aside = [[0.0, 1.0], [shift, shift + 1.0]];
            let pair = Parallel { distance: 4.0, x: aside, y: [[0.0, 1.0], [0.5, 1.5]] };
            let rule = cubature::rule(pair.separation()).expect("far enough for cubature");
            let off = pair.cubature(rule) - pair.closed_form();
            assert!(off.abs() < 3e-15, "parallel, {shift} aside: {off:e}");

            let pair = Perpendicular { x: [4.0, 5.0], xi: [0.5, 1.5], y: aside };
            let rule = cubature::rule(pair.separation()).expect("far enough for cubature");
            let off = pair.cubature(rule) - pair.closed_form();
            assert!(off.abs() < 3e-15, "perpendicular, {shift} aside: {off:e}");
        }
    }

    /// Each rule where it takes over, against the richest one.
    #[test]
    fn the_rules_are_fine_enough_where_they_take_over() {
        let best = cubature::rule(4.0).expect("the first rule");
        for separation in [8.0, 16.0, 32.0] {
            let rule = cubature::rule(separation).expect("far enough for cubature");
            let square = [[0.0, 1.0], [0.0, 1.0]];
            let facing = Parallel { distance: separation, x: square, y: square };
            let off = facing.cubature(rule) / facing.cubature(best) - 1.0;
            assert!(off.abs() < 1e-11, "parallel, {separation} apart: {off:e}");
            let corner = Perpendicular { x: [separation, separation + 1.0], xi: [0.0, 1.0], y: square };
            let off = corner.cubature(rule) / corner.cubature(best) - 1.0;
            assert!(off.abs() < 1e-11, "perpendicular, {separation} apart: {off:e}");
        }
    }
}
