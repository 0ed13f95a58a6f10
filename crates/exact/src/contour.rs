//! The exchange between two convex polygons that see the whole of each other, any way they lie.
//!
//! Stokes' theorem twice: A_iF_ij = 1/2π ∮∮ ln r dr_i·dr_j around either outline (Sparrow 1963; Schröder &
//! Hanrahan 1993). The integral along an edge of j is closed; that along an edge of i is left to adaptive
//! Gauss–Kronrod, which takes the s ln s of touching edges in its stride.

use std::f64::consts::TAU;

use glam::DVec3;

use crate::polygon::area;

/// The absolute error aimed at, relative to the geometric mean of the areas.
const TOLERANCE: f64 = 1e-12;

/// Halvings at most: 2⁻⁴⁰ of an edge integrates s ln s below rounding.
const DEPTH: u32 = 40;

/// Nodes of Kronrod's rule on [−1, 1], their weights, and the weights of Gauss's rule at every second node
/// (Piessens et al., *QUADPACK*, qk15); symmetric about the last.
const KRONROD: [[f64; 3]; 8] = [
    [0.991_455_371_120_812_6, 0.022_935_322_010_529_224, 0.0],
    [0.949_107_912_342_758_5, 0.063_092_092_629_978_55, 0.129_484_966_168_869_7],
    [0.864_864_423_359_769_1, 0.104_790_010_322_250_18, 0.0],
    [0.741_531_185_599_394_4, 0.140_653_259_715_525_92, 0.279_705_391_489_276_64],
    [0.586_087_235_467_691_1, 0.169_004_726_639_267_9, 0.0],
    [0.405_845_151_377_397_2, 0.190_350_578_064_785_4, 0.381_830_050_505_118_9],
    [0.207_784_955_007_898_47, 0.204_432_940_075_298_9, 0.0],
    [0.0, 0.209_482_141_084_727_83, 0.417_959_183_673_469_4],
];

/// What rounding may make of the integrand, relative to the terms that it is the sum of.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// After this many halvings an interval is left where the integrand changes by no more than rounding: beside a sliver that is
/// everywhere, and all intervals would be halved to the last depth.
const BEFORE_ROUNDING: u32 = 8;

/// A_iF_ij [m²] of two polygons, each wholly in front of the other's plane, that nothing occludes. The error is
/// about 10⁻¹² of the geometric mean of the areas, or what rounding makes of the logarithms: more for slivers.
pub(crate) fn exchange_area(i: &[DVec3], j: &[DVec3]) -> f64 {
    let tolerance = TOLERANCE * (area(i) * area(j)).sqrt();
    // Any unit of length does, as outlines are closed; this one keeps the logarithms small.
    let unit = j.iter().map(|corner| corner.distance(i[0])).fold(0.0, f64::max);
    let edges: Vec<ContourEdge> = edges(j).map(|[from, to]| ContourEdge::new(from, to, unit)).collect();
    let along = |[from, to]: [DVec3; 2]| {
        let span = to - from;
        let weights: Vec<f64> = edges.iter().map(|edge| edge.direction.dot(span)).collect();
        let integrand = |s: f64| {
            let point = from + span * s;
            edges.iter().zip(&weights).map(|(edge, w)| w * edge.logarithm_seen_from(point)).sum()
        };
        // No term is much larger than its weight times the unit.
        let noise = ROUNDING * unit * weights.iter().map(|w| w.abs()).sum::<f64>();
        integral(&integrand, [0.0, 1.0], [tolerance, noise], DEPTH)
    };
    (edges_of(i, along) / TAU).max(0.0)
}

fn edges(polygon: &[DVec3]) -> impl Iterator<Item = [DVec3; 2]> {
    polygon.iter().enumerate().map(|(k, &from)| [from, polygon[(k + 1) % polygon.len()]])
}

fn edges_of(polygon: &[DVec3], along: impl Fn([DVec3; 2]) -> f64) -> f64 {
    edges(polygon).filter(|[from, to]| from != to).map(along).sum()
}

/// An edge that is integrated along in closed form.
struct ContourEdge {
    from: DVec3,
    direction: DVec3,
    length: f64,
    /// One over the unit of length, squared.
    scale: f64,
}

impl ContourEdge {
    fn new(from: DVec3, to: DVec3, unit: f64) -> Self {
        let length = from.distance(to);
        ContourEdge { from, direction: (to - from).normalize_or_zero(), length, scale: 1.0 / (unit * unit) }
    }

    /// ∫ (1 + ln r) dt along the edge, r being the distance from a point in the unit of length; the 1 cancels
    /// around an outline.
    fn logarithm_seen_from(&self, point: DVec3) -> f64 {
        let offset = self.from - point;
        let start = offset.dot(self.direction);
        let away = (offset - self.direction * start).length();
        let end = start + self.length;
        let logarithm = |t: f64| {
            let square = t * t + away * away;
            if square > 0.0 { 0.5 * t * (square * self.scale).ln() } else { 0.0 }
        };
        logarithm(end) - logarithm(start) + away * (end.atan2(away) - start.atan2(away))
    }
}

/// ∫ f ds, halving the interval until the error is estimated to be below the tolerance, or f is left with nothing but noise.
fn integral(f: &impl Fn(f64) -> f64, [a, b]: [f64; 2], [tolerance, noise]: [f64; 2], depth: u32) -> f64 {
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    let (mut kronrod, mut gauss, mut size) = (0.0, 0.0, 0.0);
    for [node, weight, gauss_weight] in KRONROD {
        let (left, right) = (f(middle - half * node), f(middle + half * node));
        // Both are the middle at the last node.
        let share = if node == 0.0 { 0.5 } else { 1.0 };
        kronrod += share * weight * (left + right);
        gauss += share * gauss_weight * (left + right);
        size += share * weight * (left.abs() + right.abs());
    }
    let difference = half * (kronrod - gauss).abs();
    let is_noise = depth + BEFORE_ROUNDING <= DEPTH && difference <= 2.0 * half * noise;
    if depth == 0 || is_noise || error(difference, half * size) <= tolerance {
        return half * kronrod;
    }
    let part = |part: [f64; 2]| integral(f, part, [tolerance, noise], depth - 1);
    part([a, middle]) + part([middle, b])
}

/// QUADPACK's estimate of the error of Kronrod's sum from its difference to Gauss's; `size` is ∫|f|, of which
/// differences below rounding carry no information.
fn error(difference: f64, size: f64) -> f64 {
    if difference <= 64.0 * f64::EPSILON * size {
        0.0
    } else {
        size * (200.0 * difference / size).powf(1.5).min(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(corner: DVec3, u: DVec3, v: DVec3) -> [DVec3; 4] {
        [corner, corner + u, corner + u + v, corner + v]
    }

    /// The published values of opposed and of perpendicular squares, these with a shared edge.
    #[test]
    fn unit_squares() {
        let floor = square(DVec3::ZERO, DVec3::X, DVec3::Y);
        let opposed = square(DVec3::Z, DVec3::Y, DVec3::X);
        let wall = square(DVec3::ZERO, DVec3::Y, DVec3::Z);
        assert!((exchange_area(&floor, &opposed) - 0.199_824_895_698_387_3).abs() < 1e-14);
        assert!((exchange_area(&floor, &wall) - 0.200_043_776_075_403_2).abs() < 1e-13);
    }

    /// All of a sum over the edges of a sliver is rounding where the other polygon is as thin. It is not looked at ever more finely.
    #[test]
    fn two_slivers_come_to_an_end() {
        let corner = DVec3::new(1.0 / 3.0 - 0.5, -0.75, 0.387_220_136_219_135_65 - 1.0);
        let (across, along) = (5e-13 * DVec3::new(1.0, 2.0, 0.5), DVec3::new(0.43, 1.0, 1.0));
        let (sliver, beside) = (square(corner, across, along), square(corner + across, across, along));
        for exchanged in [exchange_area(&sliver, &beside), exchange_area(&beside, &sliver)] {
            assert!((0.0..=area(&sliver)).contains(&exchanged), "{exchanged}");
        }
    }
}
