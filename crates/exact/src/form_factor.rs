//! Closed-form form factors between axis-aligned rectangles that nothing occludes.
//!
//! Source: Ehlert & Smith, *View factors for perpendicular and parallel rectangular plates*, J. Thermophysics
//! and Heat Transfer 7(1) 1993; Howell's catalogue of configuration factors, C-11 … C-16. Both write A_iF_ij
//! as a sum over the corners of an indefinite integral, whose terms cancel where the rectangles are small
//! against their distance; there [`crate::cubature`] takes over. They cancel, too, where one rectangle is huge
//! against the other, which is then cut in two.

use std::f64::consts::PI;

use crate::cubature;
use crate::rectangle::Rectangle;

/// The form factor F_ij from `i` to `j`: the fraction of the power leaving the front of `i`, diffusely and
/// uniformly, that arrives at the front of `j` if nothing is in between. 0 if coplanar or facing away; what
/// lies behind either plane does not count.
///
/// The absolute error is about 10⁻¹⁵ where lengths and distances differ by factors up to 10, 10⁻¹³ up to
/// 1 : 100, 10⁻¹¹ where one is longer than the other's longest side by more; a form factor of 0 may come out negative by as much.
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
    pair.exchange_area()
}

/// Two rectangles with different normal axes see each other where each is in front of the other's plane.
fn perpendicular(i: &Rectangle, j: &Rectangle) -> f64 {
    let (x, xi) = (j.heights_of(i), i.heights_of(j));
    if x[1] == 0.0 || xi[1] == 0.0 {
        return 0.0;
    }
    let shared = 3 - i.axis - j.axis;
    let pair = Perpendicular { x, xi, y: [i.interval(shared), j.interval(shared)] };
    pair.exchange_area()
}

/// The longest side of one rectangle over that of another from which the longer one is cut in two: the terms of a closed form are as large as
/// the square of its length, and what is left of them may be the area of the shorter one.
const HUGE: f64 = 100.0;

/// The rectangle of two, and its side, that is to be cut in two, if any; sides are intervals.
fn huge(sides: [[[f64; 2]; 2]; 2]) -> Option<[usize; 2]> {
    let lengths = sides.map(|sides| sides.map(length));
    let longest = lengths.map(|[a, b]| a.max(b));
    let rectangle = usize::from(longest[1] > longest[0]);
    let side = usize::from(lengths[rectangle][1] > lengths[rectangle][0]);
    (longest[rectangle] > HUGE * longest[1 - rectangle]).then_some([rectangle, side])
}

fn halves([low, high]: [f64; 2]) -> [[f64; 2]; 2] {
    let middle = 0.5 * (low + high);
    [[low, middle], [middle, high]]
}

/// Facing rectangles `distance` apart; along x and y the interval of either [m].
struct Parallel {
    distance: f64,
    x: [[f64; 2]; 2],
    y: [[f64; 2]; 2],
}

impl Parallel {
    /// Near parts of a huge rectangle by the closed form, others by cubature.
    fn exchange_area(&self) -> f64 {
        if let Some(rule) = cubature::rule(self.separation()) {
            return self.cubature(rule);
        }
        let sides = [0, 1].map(|rectangle| [self.x[rectangle], self.y[rectangle]]);
        let Some([rectangle, side]) = huge(sides) else { return self.closed_form() };
        let with = |half: [f64; 2]| {
            let (mut x, mut y) = (self.x, self.y);
            (if side == 0 { &mut x } else { &mut y })[rectangle] = half;
            Parallel { distance: self.distance, x, y }
        };
        halves(sides[rectangle][side]).map(|half| with(half).exchange_area()).iter().sum()
    }

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
    /// Near parts of a huge rectangle by the closed form, others by cubature.
    fn exchange_area(&self) -> f64 {
        if let Some(rule) = cubature::rule(self.separation()) {
            return self.cubature(rule);
        }
        let sides = [[self.x, self.y[0]], [self.xi, self.y[1]]];
        let Some([rectangle, side]) = huge(sides) else { return self.closed_form() };
        let with = |half: [f64; 2]| {
            let mut sides = sides;
            sides[rectangle][side] = half;
            let [[x, y], [xi, other_y]] = sides;
            Perpendicular { x, xi, y: [y, other_y] }
        };
        halves(sides[rectangle][side]).map(|half| with(half).exchange_area()).iter().sum()
    }

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

    /// A small tile above a huge square sees hardly anything else, and one that stands on edge sees it in half of its directions, up to 4·10⁻¹⁰ each
    /// at these sizes; the tile's own plane is a huge distance from the edge.
    #[test]
    fn a_huge_rectangle_fills_the_view_of_a_small_one() {
        for (half, side) in [(50.0, 0.01), (5e3, 1e-3), (5e4, 1e-2), (5e4, 1e-3), (5e5, 1e-3)] {
            let across = [[-half, half], [0.3, 0.3 + side]];
            let facing = Parallel { distance: 1.0, x: across, y: across };
            let on_edge = Perpendicular { x: [0.0, half], xi: [0.5, 0.5 + side], y: across };
            let area = side * side;
            // All but h²/L² of the view of a point at height h over the middle of a disc of radius L, which lies between two squares.
            let missing = 2.5 / (half * half);
            let [f, g] = [facing.exchange_area(), on_edge.exchange_area()].map(|exchange| exchange / area);
            assert!((1.0 - f).abs() < missing + 1e-9, "{half}, {side}: {f}");
            assert!((0.5 - g).abs() < 1.0 / half + 1e-9, "{half}, {side}: {g}");
        }
    }

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
