//! Gauss–Legendre product rules for rectangles that are far apart.
//!
//! The closed forms cancel there: with rectangles of side h at distance D their relative error grows like
//! 10⁻¹⁶ (D/h)⁴, while an n-point rule along every side errs by about (4D/h)⁻²ⁿ. The rules below take over
//! where both are near 10⁻¹³.

/// Nodes and weights on [0, 1].
pub(crate) type Rule = &'static [(f64, f64)];

pub(crate) const GAUSS_3: Rule = &[
    (0.11270166537925831, 0.2777777777777778),
    (0.5, 0.4444444444444444),
    (0.8872983346207417, 0.2777777777777778),
];

pub(crate) const GAUSS_4: Rule = &[
    (0.06943184420297371, 0.17392742256872692),
    (0.33000947820757187, 0.32607257743127305),
    (0.6699905217924281, 0.32607257743127305),
    (0.9305681557970263, 0.17392742256872692),
];

pub(crate) const GAUSS_5: Rule = &[
    (0.046910077030668004, 0.11846344252809454),
    (0.23076534494715845, 0.23931433524968324),
    (0.5, 0.28444444444444444),
    (0.7692346550528415, 0.23931433524968324),
    (0.953089922969332, 0.11846344252809454),
];

const GAUSS_6: Rule = &[
    (0.03376524289842399, 0.08566224618958518),
    (0.16939530676686773, 0.1803807865240693),
    (0.38069040695840156, 0.23395696728634552),
    (0.6193095930415985, 0.23395696728634552),
    (0.8306046932331322, 0.1803807865240693),
    (0.966234757101576, 0.08566224618958518),
];

/// The rule for rectangles whose smallest distance is `separation` times their longest side; `None` where
/// the closed form is better.
pub(crate) fn rule(separation: f64) -> Option<Rule> {
    match separation {
        s if s >= 32.0 => Some(GAUSS_3),
        s if s >= 16.0 => Some(GAUSS_4),
        s if s >= 8.0 => Some(GAUSS_5),
        s if s >= 4.0 => Some(GAUSS_6),
        _ => None,
    }
}

/// One node of the integral along one axis: its weight and the square of the distance along that axis.
#[derive(Clone, Copy)]
pub(crate) struct Term {
    pub weight: f64,
    pub square: f64,
}

/// ∫∫ f((a − b)²) da db over two intervals.
pub(crate) fn differences(rule: Rule, [a, b]: [[f64; 2]; 2]) -> Vec<Term> {
    let (length_a, length_b) = (a[1] - a[0], b[1] - b[0]);
    let pairs = rule.iter().flat_map(|node_a| rule.iter().map(move |node_b| (node_a, node_b)));
    pairs
        .map(|(&(t_a, w_a), &(t_b, w_b))| {
            let difference = (a[0] - b[0]) + t_a * length_a - t_b * length_b;
            Term { weight: w_a * w_b * length_a * length_b, square: difference * difference }
        })
        .collect()
}

/// ∫ h f(h²) dh over one interval.
pub(crate) fn distances(rule: Rule, [lo, hi]: [f64; 2]) -> Vec<Term> {
    let term = |&(t, weight): &(f64, f64)| {
        let distance = lo + t * (hi - lo);
        Term { weight: weight * (hi - lo) * distance, square: distance * distance }
    };
    rule.iter().map(term).collect()
}

/// The integral of r⁻⁴ over all axes, r² being the sum of the squares. Fastest with the longest list first.
pub(crate) fn inverse_fourth_power(x: &[Term], y: &[Term], z: &[Term]) -> f64 {
    let mut over_yz = vec![0.0; x.len()];
    for (y, z) in y.iter().flat_map(|y| z.iter().map(move |z| (y, z))) {
        let (weight, square) = (y.weight * z.weight, y.square + z.square);
        for (sum, x) in over_yz.iter_mut().zip(x) {
            let r2 = x.square + square;
            *sum += weight / (r2 * r2);
        }
    }
    over_yz.iter().zip(x).map(|(sum, x)| sum * x.weight).sum()
}
