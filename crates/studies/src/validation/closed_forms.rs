//! Closed forms of exchange factors.

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

/// From a disc of radius R₁ to a coaxial one of radius R₂ at distance 1 (Howell C-41).
pub(super) fn coaxial_discs(r1: f64, r2: f64) -> f64 {
    let s = 1.0 + (1.0 + r2 * r2) / (r1 * r1);
    0.5 * (s - (s * s - 4.0 * (r2 / r1).powi(2)).sqrt())
}

/// Endless parallel strips of width 1 at distance H (Howell C-1).
pub(super) fn strips(h: f64) -> f64 {
    (1.0 + h * h).sqrt() - h
}

/// Endless plates of one width along a common edge, at an angle [rad] (Howell C-3).
pub(super) fn wedge(angle: f64) -> f64 {
    1.0 - (0.5 * angle).sin()
}

/// From side a to side b of an endless prism with three sides (Hottel's crossed strings).
pub(super) fn prism(a: f64, b: f64, c: f64) -> f64 {
    0.5 * (a + b - c) / a
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
        // Of the absorbed part the body keeps the rest: as much as reciprocity tells of B₂₁.
        let (e1, e2, f) = (0.7, 0.4, 0.25);
        let b12 = absorbed_by_enclosure(e1, e2, f);
        let b22 = (b12 - e2) / (1.0 - e2);
        assert!((e1 * f * b12 - e2 * (1.0 - b22)).abs() < 1e-15, "{b12} {b22}");
    }
}
