//! Discomfort glare: what of a luminaire shines at an eye, and how much its place counts (CIE 117:1995).

use std::f64::consts::FRAC_PI_4;

use glam::DVec3;

use crate::LuminousOpening;

impl LuminousOpening {
    /// The area that is seen from a direction of length 1 in the frame of the luminaire [m²]; 0 of a point.
    pub fn projected_area(&self, towards: DVec3) -> f64 {
        let d = towards.abs().to_array();
        match *self {
            LuminousOpening::Point => 0.0,
            LuminousOpening::Rectangle { x, y } => x * y * d[2],
            LuminousOpening::Disc { x, y } => FRAC_PI_4 * x * y * d[2],
            LuminousOpening::Box { size: [x, y, z] } => y * z * d[0] + x * z * d[1] + x * y * d[2],
            LuminousOpening::Cylinder { size, axis } => {
                let [i, j] = [(axis + 1) % 3, (axis + 2) % 3];
                let side = size[axis] * (size[i] * d[j]).hypot(size[j] * d[i]);
                FRAC_PI_4 * size[i] * size[j] * d[axis] + side
            }
            LuminousOpening::Ellipsoid { size: [x, y, z] } => {
                let [a, b, c] = [y * z * d[0], x * z * d[1], x * y * d[2]];
                FRAC_PI_4 * (a * a + b * b + c * c).sqrt()
            }
        }
    }
}

/// Guth's position index of a source in a direction from the eye, the line of sight being horizontal and z up: ln p = (35.2 − 0.31889 τ − 1.22 e^(−2τ/9))
/// 10⁻³ σ + (21 + 0.26667 τ − 0.002963 τ²) 10⁻⁵ σ², σ the angle to the line of sight and τ that of the plane of both to the vertical [°]
/// (CIE 117:1995). `None` of a source that is not above the line of sight, and in front of the eye: the index is that of such alone.
pub fn position_index(sight: DVec3, towards: DVec3) -> Option<f64> {
    let (forward, up) = (sight.dot(towards), towards.z);
    let aside = sight.cross(DVec3::Z).dot(towards);
    if forward <= 0.0 || up < 0.0 {
        return None;
    }
    let sigma = up.hypot(aside).atan2(forward).to_degrees();
    let tau = aside.abs().atan2(up).to_degrees();
    let linear = 35.2 - 0.31889 * tau - 1.22 * (-2.0 * tau / 9.0).exp();
    let square = 21.0 + 0.26667 * tau - 0.002963 * tau * tau;
    Some((1e-3 * linear * sigma + 1e-5 * square * sigma * sigma).exp())
}
