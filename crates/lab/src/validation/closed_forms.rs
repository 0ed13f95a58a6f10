//! Closed forms of exchange factors.

use std::f64::consts::PI;

use glam::DVec3;

/// Identical, parallel rectangles opposite each other, sides over distance X and Y (Howell C-11).
pub(super) fn opposed_rectangles(x: f64, y: f64) -> f64 {
    let (x1, y1) = (1.0 + x * x, 1.0 + y * y);
    let logarithm = 0.5 * (x1 * y1 / (x1 + y * y)).ln();
    let across = x * y1.sqrt() * (x / y1.sqrt()).atan() + y * x1.sqrt() * (y / x1.sqrt()).atan();
    std::f64::consts::FRAC_2_PI / (x * y) * (logarithm + across - x * x.atan() - y * y.atan())
}

/// From a rectangle of width W to one of height H at a right angle to it, along a common edge of length 1 (Howell C-14).
pub(super) fn perpendicular_rectangles(w: f64, h: f64) -> f64 {
    let (w2, h2) = (w * w, h * h);
    let (both, diagonal) = (1.0 + w2 + h2, (w2 + h2).sqrt());
    let logarithm = ((1.0 + w2) * (1.0 + h2) / both).ln()
        + w2 * (w2 * both / ((1.0 + w2) * (w2 + h2))).ln()
        + h2 * (h2 * both / ((1.0 + h2) * (w2 + h2))).ln();
    let angles = w * (1.0 / w).atan() + h * (1.0 / h).atan() - diagonal * (1.0 / diagonal).atan();
    std::f64::consts::FRAC_1_PI / w * (angles + 0.25 * logarithm)
}

/// From the rectangle x₀ … x₁ by y₀ … y₁ to another of such ranges in the parallel plane at distance 1 (Howell C-13).
pub(super) fn parallel_rectangles(from: [[f64; 2]; 2], to: [[f64; 2]; 2]) -> f64 {
    // The indefinite fourfold integral at the differences of two corners.
    let integral = |x: f64, y: f64| {
        let (x1, y1) = (x.hypot(1.0), y.hypot(1.0));
        let angles = y * x1 * (y / x1).atan() + x * y1 * (x / y1).atan();
        std::f64::consts::FRAC_1_PI * 0.5 * (angles - 0.5 * (1.0 + x * x + y * y).ln())
    };
    let mut sum = 0.0;
    for corners in 0..16_u32 {
        let [i, j, k, l] = [0, 1, 2, 3].map(|bit| (corners >> bit & 1) as usize);
        let sign = if corners.count_ones() % 2 == 0 { 1.0 } else { -1.0 };
        sum += sign * integral(from[0][i] - to[0][k], from[1][j] - to[1][l]);
    }
    sum / ((from[0][1] - from[0][0]) * (from[1][1] - from[1][0]))
}

/// From the strip x₀ … x₁ of a floor to the strip z₀ … z₁ of a wall at a right angle to it, both of length 1: floor and wall meet
/// at x = z = 0 (Howell C-14 and the algebra of factors).
pub(super) fn perpendicular_strips([x0, x1]: [f64; 2], [z0, z1]: [f64; 2]) -> f64 {
    // A·F from the edge up to x and z.
    let exchanged = |x: f64, z: f64| if x * z > 0.0 { x * perpendicular_rectangles(x, z) } else { 0.0 };
    (exchanged(x1, z1) - exchanged(x0, z1) - exchanged(x1, z0) + exchanged(x0, z0)) / (x1 - x0)
}

/// From an element below one corner of a parallel rectangle of sides a and b at distance 1 to that rectangle (Howell, class B).
pub(super) fn element_to_parallel_corner(a: f64, b: f64) -> f64 {
    let (a1, b1) = (a.hypot(1.0), b.hypot(1.0));
    std::f64::consts::FRAC_1_PI * 0.5 * (a / a1 * (b / a1).atan() + b / b1 * (a / b1).atan())
}

/// From an element to a rectangle at a right angle to it, whose one side b begins beside the element at distance 1 and whose other
/// side is c, away from the element's plane (Howell, class B).
pub(super) fn element_to_perpendicular_corner(b: f64, c: f64) -> f64 {
    let slant = c.hypot(1.0);
    std::f64::consts::FRAC_1_PI * 0.5 * (b.atan() - (b / slant).atan() / slant)
}

/// From an element to a parallel disc of radius r at distance 1, whose axis is a away from the element (Howell, class B).
pub(super) fn element_to_disc(r: f64, a: f64) -> f64 {
    let sum = 1.0 + a * a + r * r;
    0.5 * (1.0 - (1.0 + a * a - r * r) / (sum * sum - 4.0 * a * a * r * r).sqrt())
}

/// From a disc of radius R₁ to a coaxial annulus between radii R₂ and R₃ at distance 1.
pub(super) fn disc_to_annulus(r1: f64, [r2, r3]: [f64; 2]) -> f64 {
    coaxial_discs(r1, r3) - coaxial_discs(r1, r2)
}

/// From a disc of radius R₁ to a coaxial one of radius R₂ at distance 1 (Howell C-41).
pub(super) fn coaxial_discs(r1: f64, r2: f64) -> f64 {
    let s = 1.0 + (1.0 + r2 * r2) / (r1 * r1);
    0.5 * (s - (s * s - 4.0 * (r2 / r1).powi(2)).sqrt())
}

/// Endless parallel strips of width 1 at distance H (Howell C-1).
pub(super) fn strips(h: f64) -> f64 {
    (1.0 + h * h).sqrt() - h
}

/// From one endless strip to another, by points on their edges: crossed strings (Hottel). Nothing is between them, and both ends
/// of each see the other.
pub(super) fn crossed_strings([a, b]: [[f64; 2]; 2], [c, d]: [[f64; 2]; 2]) -> f64 {
    let far = |p: [f64; 2], q: [f64; 2]| (p[0] - q[0]).hypot(p[1] - q[1]);
    let crossed = [far(a, c) + far(b, d), far(a, d) + far(b, c)];
    (crossed[0] - crossed[1]).abs() / (2.0 * far(a, b))
}

/// Endless plates of one width along a common edge, at an angle [rad] (Howell C-3).
pub(super) fn wedge(angle: f64) -> f64 {
    1.0 - (0.5 * angle).sin()
}

/// From side a to side b of an endless prism with three sides (Hottel's crossed strings).
pub(super) fn prism(a: f64, b: f64, c: f64) -> f64 {
    0.5 * (a + b - c) / a
}

/// From a sphere to a coaxial disc of radius `b` at distance 1 from its centre, or to a rectangle of sides a and b there, a corner of which is
/// nearest to the centre: the solid angle over 4π, whatever the radius of the sphere.
pub(super) fn sphere_to_corner_or_disc(a: Option<f64>, b: f64) -> f64 {
    match a {
        None => 0.5 * (1.0 - 1.0 / b.hypot(1.0)),
        Some(a) => (a * b / (1.0 + a * a + b * b).sqrt()).atan() / (4.0 * PI),
    }
}

/// From the outer of two coaxial cylinders of length h and radii 1 and r, to the inner one and to itself (Howell C-91).
pub(super) fn coaxial_cylinders(r: f64, h: f64) -> [f64; 2] {
    let (r2, h2) = (r * r, h * h);
    let (a, b) = (h2 + r2 - 1.0, h2 - r2 + 1.0);
    let ends =
        ((a + 2.0).powi(2) - 4.0 * r2).sqrt() * (b / (r * a)).acos() + b * (1.0 / r).asin() - 0.5 * PI * a;
    let inner = ((b / a).acos() - ends / (2.0 * h)) / PI;
    let gap = 4.0 * (r2 - 1.0);
    let long = (4.0 * r2 + h2).sqrt() / h;
    let arcs = long * ((gap + h2 / r2 * (r2 - 2.0)) / (h2 + gap)).asin() - ((r2 - 2.0) / r2).asin();
    let own = 2.0 * (2.0 * (r2 - 1.0).sqrt() / h).atan() - 0.5 * h * (arcs + 0.5 * PI * (long - 1.0));
    [(1.0 - inner) / r, 1.0 - 1.0 / r + own / (PI * r)]
}

/// From the inside of a tube of radius 1 and length h to itself (Howell C-78).
pub(super) fn tube_to_itself(h: f64) -> f64 {
    1.0 + 0.5 * h - (0.5 * h).hypot(1.0)
}

/// From a ring of a tube of radius 1 to another one of it, by their lengths and the gap between them (Howell C-78 and the algebra of factors).
pub(super) fn tube_rings([from, to]: [f64; 2], gap: f64) -> f64 {
    // What a tube of length h exchanges with itself, over 2π.
    let own = |h: f64| h * tube_to_itself(h);
    (own(from + gap + to) - own(from + gap) - own(gap + to) + own(gap)) / (2.0 * from)
}

/// Between coaxial cylinders of length h and radii 1 and r, and the rings that close their ends (Howell C-91 and the algebra of factors).
pub(super) struct RingFactors {
    pub(super) inner_to_ring: f64,
    pub(super) outer_to_ring: f64,
    pub(super) ring_to_inner: f64,
    pub(super) ring_to_outer: f64,
    pub(super) ring_to_ring: f64,
}

pub(super) fn rings(r: f64, h: f64) -> RingFactors {
    let [to_inner, own] = coaxial_cylinders(r, h);
    let [inner_to_ring, outer_to_ring] = [1.0 - r * to_inner, 1.0 - to_inner - own].map(|ends| 0.5 * ends);
    // Areas of the cylinders over that of a ring.
    let over_ring = 2.0 * h / (r * r - 1.0);
    let [ring_to_inner, ring_to_outer] = [over_ring * inner_to_ring, over_ring * r * outer_to_ring];
    let ring_to_ring = 1.0 - ring_to_inner - ring_to_outer;
    RingFactors { inner_to_ring, outer_to_ring, ring_to_inner, ring_to_outer, ring_to_ring }
}

/// From the first end of a frustum of height 1 and these radii to its wall, from the wall to this end, and from the wall to itself (Howell C-41 and
/// the algebra of factors).
pub(super) fn frustum([r1, r2]: [f64; 2]) -> [f64; 3] {
    let wall = (r1 + r2) * (r1 - r2).hypot(1.0);
    let [first, second] = [[r1, r2], [r2, r1]].map(|[r, s]| 1.0 - coaxial_discs(r, s));
    let [to_first, to_second] = [r1 * r1 * first / wall, r2 * r2 * second / wall];
    [first, to_first, 1.0 - to_first - to_second]
}

/// From the inside of a cone of height h on a base of radius 1 to itself: its base has the part 1/√(1 + h²) of its area.
pub(super) fn cone_to_itself(h: f64) -> f64 {
    1.0 - 1.0 / h.hypot(1.0)
}

/// From the inside of a part of a sphere of radius 1 and some height to itself: its opening has the part 1 − h/2 of its area.
pub(super) fn bowl_to_itself(height: f64) -> f64 {
    0.5 * height
}

/// From a sphere to the wall of a coaxial tube of radius R around it, whose ends are h away from its centre.
pub(super) fn sphere_to_tube(r: f64, h: f64) -> f64 {
    h / h.hypot(r)
}

/// From an element that faces up to a sphere of radius r about a point at x and z, all of which lies above it (Howell, class B).
pub(super) fn element_to_sphere(r: f64, [x, z]: [f64; 2]) -> f64 {
    r * r * z / x.hypot(z).powi(3)
}

/// From a plane to an endless row of parallel tubes of diameter d at steps of 1 before it (Hottel).
pub(super) fn plane_to_tubes(d: f64) -> f64 {
    let gap = (1.0 - d * d).sqrt();
    1.0 - gap + d * (gap / d).atan()
}

/// From the rectangle x by y of a floor to y by z of the wall at x = 0 (Howell C-15).
pub(super) fn floor_to_wall([x, y]: [[f64; 2]; 2], [s, z]: [[f64; 2]; 2]) -> f64 {
    // The indefinite fourfold integral.
    let integral = |x: f64, z: f64, w: f64| {
        let (c, w) = (x.hypot(z), w.abs());
        let logarithm = (c * c - w * w) * c.hypot(w).max(f64::MIN_POSITIVE).ln();
        (w * c * w.atan2(c) - 0.5 * logarithm) / (2.0 * PI)
    };
    let mut sum = 0.0;
    for corners in 0..16_u32 {
        let [i, j, k, l] = [0, 1, 2, 3].map(|bit| (corners >> bit & 1) as usize);
        let sign = if corners.count_ones() % 2 == 0 { 1.0 } else { -1.0 };
        sum += sign * integral(x[i], z[l], y[j] - s[k]);
    }
    sum / ((x[1] - x[0]) * (y[1] - y[0]))
}

/// From one endless cylinder of radius 1 to another, with a gap between them (crossed strings).
pub(super) fn parallel_cylinders(gap: f64) -> f64 {
    let x = 1.0 + 0.5 * gap;
    ((x * x - 1.0).sqrt() + (1.0 / x).asin() - x) / PI
}

/// From an endless strip a … b to an endless cylinder of radius 1 with its axis at distance l above 0.
pub(super) fn strip_to_cylinder([a, b]: [f64; 2], l: f64) -> f64 {
    ((b / l).atan() - (a / l).atan()) / (b - a)
}

/// From one of two plates in a V to the other, by their widths, along a common edge of length 1 at an angle [rad] (Howell C-16): the mean
/// over the first, by the midpoints of cells, of Lambert's formula for the factor from an element to a polygon.
pub(super) fn plates_in_v(angle: f64, [w, h]: [f64; 2]) -> f64 {
    let n = 400;
    let middle = |k: u32| (f64::from(k) + 0.5) / f64::from(n);
    let (top, edge) = (h * DVec3::new(angle.cos(), 0.0, angle.sin()), DVec3::Y);
    let corners = [DVec3::ZERO, edge, edge + top, top];
    let element = |(i, j): (u32, u32)| {
        let seen = corners.map(|corner| corner - DVec3::new(w * middle(i), middle(j), 0.0));
        let arc = |k: usize| {
            let (from, to) = (seen[k], seen[(k + 1) % 4]);
            let across = from.cross(to);
            across.z / across.length() * across.length().atan2(from.dot(to))
        };
        (0..4).map(arc).sum::<f64>().abs() / (2.0 * PI)
    };
    (0..n).flat_map(|i| (0..n).map(move |j| (i, j))).map(element).sum::<f64>() / f64::from(n * n)
}

/// B₁₂ from a convex body of emissivity ε₁ to the enclosure around it of emissivity ε₂, whose area is 1/f of the body's: both
/// equations of Gebhart with F₁₁ = 0, F₁₂ = 1, F₂₁ = f.
pub(super) fn absorbed_by_enclosure(e1: f64, e2: f64, f: f64) -> f64 {
    // B₁₂ = ε₂ + ρ₂B₂₂ and B₂₂ = F₂₂ε₂ + f·ρ₁B₁₂ + F₂₂ρ₂B₂₂.
    let (r1, r2, own) = (1.0 - e1, 1.0 - e2, 1.0 - f);
    (e2 * (1.0 - own * r2) + r2 * own * e2) / (1.0 - own * r2 - r2 * f * r1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cube is closed; factors of rectangles are reciprocal; bodies that absorb all keep nothing.
    #[test]
    fn closed_forms_agree_with_each_other() {
        let cube = opposed_rectangles(1.0, 1.0) + 4.0 * perpendicular_rectangles(1.0, 1.0);
        assert!((cube - 1.0).abs() < 1e-14, "{cube}");
        for (w, h) in [(0.5, 2.0), (3.0, 0.2)] {
            let [there, back] = [w * perpendicular_rectangles(w, h), h * perpendicular_rectangles(h, w)];
            assert!((there - back).abs() < 1e-14, "{there} {back}");
        }
        assert!((opposed_rectangles(1e6, 1.0) - strips(1.0)).abs() < 1e-5);
        assert!((perpendicular_rectangles(1e-5, 1e-5) - wedge(std::f64::consts::FRAC_PI_2)).abs() < 1e-5);
        assert!((prism(1.0, 1.0, 1.0) - wedge(std::f64::consts::FRAC_PI_3)).abs() < 1e-15);
        assert!((coaxial_discs(1.0, 1e6) - 1.0).abs() < 1e-9);
        assert!((absorbed_by_enclosure(0.3, 1.0, 0.25) - 1.0).abs() < 1e-15);
        let units = [[0.0, 1.0], [0.0, 1.0]];
        assert!((parallel_rectangles(units, units) - opposed_rectangles(1.0, 1.0)).abs() < 1e-14);
        assert!(
            (crossed_strings([[0.0, 0.0], [1.0, 0.0]], [[0.0, 2.0], [1.0, 2.0]]) - strips(2.0)).abs() < 1e-15
        );
        assert!(
            (perpendicular_strips([0.0, 2.0], [0.0, 0.5]) - perpendicular_rectangles(2.0, 0.5)).abs() < 1e-15
        );
        let (x, z) = ([0.5, 1.5], [0.25, 1.0]);
        let strips = floor_to_wall([x, units[0]], [units[0], z]);
        assert!((strips - perpendicular_strips(x, z)).abs() < 1e-14, "{strips}");
        let [whole, parts @ ..] =
            [[0.5, 2.0], [0.5, 1.2], [1.2, 2.0]].map(|y| floor_to_wall([x, units[0]], [y, z]));
        assert!((whole - parts[0] - parts[1]).abs() < 1e-14, "{whole} {parts:?}");
        assert!(
            (floor_to_wall([[0.0, 2.0], units[0]], [units[0], [0.0, 0.5]])
                - perpendicular_rectangles(2.0, 0.5))
            .abs()
                < 1e-14
        );
        // Of the absorbed part the body keeps the rest: as much as reciprocity tells of B₂₁.
        let (e1, e2, f) = (0.7, 0.4, 0.25);
        let b12 = absorbed_by_enclosure(e1, e2, f);
        let b22 = (b12 - e2) / (1.0 - e2);
        assert!((e1 * f * b12 - e2 * (1.0 - b22)).abs() < 1e-15, "{b12} {b22}");
    }

    /// ∫ cos cos/(πr²) over a surface from an element at the origin that faces up, by the midpoints of n × n cells.
    fn by_quadrature(cell: impl Fn(f64, f64) -> ([f64; 3], [f64; 3])) -> f64 {
        let n = 1000;
        let middle = |k: u32| (f64::from(k) + 0.5) / f64::from(n);
        let mut sum = 0.0;
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            // The point, and the normal times the area of the whole at unit density.
            let (p, normal) = cell(middle(i), middle(j));
            let r2: f64 = p.iter().map(|x| x * x).sum();
            let towards: f64 = p.iter().zip(normal).map(|(x, n)| -x * n).sum();
            sum += p[2] * towards / (std::f64::consts::PI * r2 * r2);
        }
        sum / f64::from(n * n)
    }

    /// Factors from elements are integrals over what they see; those from rectangles and discs are means of them.
    #[test]
    fn factors_from_elements_are_integrals() {
        let parallel = by_quadrature(|u, v| ([0.8 * u, 1.7 * v, 1.0], [0.0, 0.0, -0.8 * 1.7]));
        assert!((parallel - element_to_parallel_corner(0.8, 1.7)).abs() < 1e-6, "{parallel}");
        let wall = by_quadrature(|u, v| ([1.0, 2.0 * u, 1.5 * v], [-2.0 * 1.5, 0.0, 0.0]));
        assert!((wall - element_to_perpendicular_corner(2.0, 1.5)).abs() < 1e-6, "{wall}");
        for away in [0.0, 0.4, 2.0] {
            let disc = by_quadrature(|u, v| {
                let (radius, (sin, cos)) = (0.7 * u, (std::f64::consts::TAU * v).sin_cos());
                ([away + radius * cos, radius * sin, 1.0], [0.0, 0.0, -std::f64::consts::TAU * 0.7 * radius])
            });
            assert!((disc - element_to_disc(0.7, away)).abs() < 1e-6, "{away}: {disc}");
        }
        let (from, to) = ([[0.0, 1.0], [0.0, 2.0]], [[0.5, 2.0], [-1.0, 0.3]]);
        let n = 200;
        let middle = |[low, high]: [f64; 2], k: u32| low + (high - low) * (f64::from(k) + 0.5) / f64::from(n);
        let corner = |a: f64, b: f64| a.signum() * b.signum() * element_to_parallel_corner(a.abs(), b.abs());
        let mut mean = 0.0;
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let [x, y] = [middle(from[0], i), middle(from[1], j)];
            let [[x0, x1], [y0, y1]] = [to[0].map(|edge| edge - x), to[1].map(|edge| edge - y)];
            mean += corner(x1, y1) - corner(x0, y1) - corner(x1, y0) + corner(x0, y0);
        }
        mean /= f64::from(n * n);
        assert!((mean - parallel_rectangles(from, to)).abs() < 1e-5, "{mean}");
    }

    /// The midpoints of n parts of a range.
    fn midpoints(from: f64, to: f64, n: u32) -> impl Iterator<Item = f64> {
        (0..n).map(move |k| from + (to - from) * (f64::from(k) + 0.5) / f64::from(n))
    }

    /// The factor from a cylinder of length h, whose points see something at the distance d(s) across the axis, s being the sine of the
    /// angle from the normal about the axis, on either side of it: ∫∫ cos²ε dε ds over what lies between both ends, ε being the elevation.
    fn along(h: f64, [from, to]: [f64; 2], d: impl Fn(f64) -> f64) -> f64 {
        let n = 2000;
        let below = |t: f64| t.atan() + t / (1.0 + t * t);
        let seen = |s: f64| midpoints(0.0, h, n / 4).map(|z| below(z / d(s))).sum::<f64>();
        let mean = midpoints(from, to, n).map(seen).sum::<f64>() / f64::from(n * (n / 4));
        // Both sides, and both directions along the axis.
        2.0 * (to - from) * mean / PI
    }

    /// The factor from points of a cylinder or strip, with the direction of their normals, to an endless cylinder of radius 1.
    fn to_cylinder(points: impl Iterator<Item = ([f64; 2], f64)>, [x, z]: [f64; 2]) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for ([px, pz], normal) in points {
            let (middle, half) = ((z - pz).atan2(x - px) - normal, (1.0 / (x - px).hypot(z - pz)).asin());
            let middle = (middle + PI).rem_euclid(2.0 * PI) - PI;
            let sine = |angle: f64| angle.clamp(-0.5 * PI, 0.5 * PI).sin();
            sum += 0.5 * (sine(middle + half) - sine(middle - half));
            count += 1.0;
        }
        sum / count
    }

    #[test]
    fn factors_of_cylinders_are_integrals() {
        for (r, h) in [(2.0_f64, 2.0), (1.25, 1.0), (3.0, 10.0)] {
            let chord = |s: f64| 2.0 * (1.0 - s * s).sqrt();
            let gap = |s: f64| 0.5 * r * chord(s) - (1.0 - (r * s).powi(2)).sqrt();
            let integrals = [along(h, [0.0, 1.0 / r], gap), along(h, [1.0 / r, 1.0], |s| r * chord(s))];
            for (found, known) in integrals.into_iter().zip(coaxial_cylinders(r, h)) {
                assert!((found - known).abs() < 1e-5, "{r} {h}: {found} {known}");
            }
            assert!((along(h, [0.0, 1.0], chord) - tube_to_itself(h)).abs() < 1e-5);
            // All that the wall sees of both ends, each end sees of the wall.
            let end = 1.0 - coaxial_discs(1.0 / h, 1.0 / h);
            assert!((0.5 * (1.0 - tube_to_itself(h)) * 2.0 * h - end).abs() < 1e-14);
        }
        for gap in [0.1, 2.0] {
            let round = midpoints(-PI, PI, 20_000).map(|angle| ([angle.cos(), angle.sin()], angle));
            let found = to_cylinder(round, [2.0 + gap, 0.0]);
            assert!((found - parallel_cylinders(gap)).abs() < 1e-6, "{gap}: {found}");
        }
        for [a, b, l] in [[-1.0, 1.0, 1.5], [0.5, 4.0, 2.0]] {
            let strip = midpoints(a, b, 2000).map(|x| ([x, 0.0], 0.5 * PI));
            let found = to_cylinder(strip, [0.0, l]);
            assert!((found - strip_to_cylinder([a, b], l)).abs() < 1e-6, "{a} {b} {l}: {found}");
        }
    }

    /// Rings of a tube, a frustum that is nearly a tube or a cone, rings that are narrow or wide, a row of tubes that touch.
    #[test]
    fn factors_of_bodies_of_revolution_have_their_limits() {
        // What a tube sees of itself is what its halves see of themselves and of each other.
        let halves = tube_to_itself(0.7) + tube_rings([0.7, 0.7], 0.0);
        assert!((halves - tube_to_itself(1.4)).abs() < 1e-15, "{halves}");
        let [there, back] = [0.5 * tube_rings([0.5, 2.0], 0.3), 2.0 * tube_rings([2.0, 0.5], 0.3)];
        assert!((there - back).abs() < 1e-15, "{there} {back}");
        let ends = 2.0 * frustum([1.0, 1.0])[1] + frustum([1.0, 1.0])[2];
        assert!((ends - 1.0).abs() < 1e-15 && (frustum([1.0, 1.0])[2] - tube_to_itself(1.0)).abs() < 1e-15);
        assert!((frustum([1.0, 1e-9])[2] - cone_to_itself(1.0)).abs() < 1e-8);
        assert!((frustum([1.0, 1e-9])[0] - 1.0).abs() < 1e-8);
        let far = rings(1.5, 1e-4);
        assert!((far.ring_to_ring - 1.0).abs() < 1e-3, "{}", far.ring_to_ring);
        assert!((rings(1e4, 1.0).ring_to_ring - 1.0).abs() < 1e-3);
        assert!((plane_to_tubes(1.0) - 1.0).abs() < 1e-15);
        // A tube's part of a hemisphere that is far away: by the angle that its diameter takes of the half-turn.
        assert!((plane_to_tubes(1e-3) / (0.5 * PI * 1e-3) - 1.0).abs() < 1e-3);
        assert!((sphere_to_tube(1.0, 2.0) + 2.0 * sphere_to_corner_or_disc(None, 0.5) - 1.0).abs() < 1e-15);
        assert!(
            (element_to_sphere(0.8, [0.0, 1.6]) - element_to_disc(0.5_f64.asin().tan(), 0.0)).abs() < 1e-15
        );
    }

    /// The solid angle that a sphere's centre sees, by quadrature; plates at a right angle and long ones in closed form.
    #[test]
    fn factors_of_spheres_and_plates_are_integrals() {
        let solid_angle = |cell: &dyn Fn(f64, f64) -> ([f64; 2], f64)| {
            let n = 500;
            let both = midpoints(0.0, 1.0, n).flat_map(|u| midpoints(0.0, 1.0, n).map(move |v| (u, v)));
            let seen = both.map(|(u, v)| {
                let ([x, y], area) = cell(u, v);
                area / (1.0 + x * x + y * y).powf(1.5)
            });
            seen.sum::<f64>() / f64::from(n * n)
        };
        let disc = solid_angle(&|u, _| ([0.7 * u, 0.0], 2.0 * PI * 0.7 * 0.7 * u));
        let rectangle = solid_angle(&|u, v| ([1.5 * u, 0.4 * v], 1.5 * 0.4));
        assert!((disc / (4.0 * PI) - sphere_to_corner_or_disc(None, 0.7)).abs() < 1e-6);
        assert!((rectangle / (4.0 * PI) - sphere_to_corner_or_disc(Some(1.5), 0.4)).abs() < 1e-6);
        for (w, h) in [(1.0, 1.0), (2.0, 0.5)] {
            let found = plates_in_v(0.5 * PI, [w, h]);
            assert!((found - perpendicular_rectangles(w, h)).abs() < 2e-5, "{w} {h}: {found}");
        }
        let narrow = plates_in_v(PI / 3.0, [1e-3; 2]);
        assert!((narrow - wedge(PI / 3.0)).abs() < 1e-3, "{narrow}");
        let [there, back] = [2.0 * plates_in_v(1.0, [2.0, 0.5]), 0.5 * plates_in_v(1.0, [0.5, 2.0])];
        assert!((there - back).abs() < 2e-5, "{there} {back}");
    }
}
