//! The radiosity system of counted links.
//!
//! B_i = E_i + R_i Σ_j F_ij B_j with Σ_j F_ij + (lost part) = 1 also reads
//! A_i(1 − R_i)/R_i·B_i + Σ_j K_ij (B_i − B_j) + (lost area)·B_i = A_i E_i/R_i: only differences of B go along links, so
//! that a uniform B is exact whatever the counts, and Σ A(1 − R)H + lost = Φ_T whatever they are. The matrix is
//! symmetric and diagonally dominant: conjugate gradients find what Jacobi iterations converge to in far fewer steps
//! (M. R. Hestenes & E. Stiefel, J. Res. Nat. Bur. Standards 49 (1952)), and 0 ≤ B ≤ max E/(1 − R).

use super::links::Links;

/// More steps than any system has taken; what is left of the residual then is below the noise of the links.
const MOST_STEPS: usize = 1000;

/// B of every face [W/m²] in one channel, until the residual has fallen to this part of the emission's, both in the
/// norm of the inverse diagonal. `start` is a guess. `None` once `go_on` says no.
pub(crate) fn solve(
    channel: usize,
    links: &Links,
    start: Option<&Vec<f64>>,
    residual: f64,
    go_on: &dyn Fn() -> bool,
) -> Option<Vec<f64>> {
    let system = System::new(channel, links);
    let mut b: Vec<f64> = system.emittance.clone();
    if let Some(start) = start {
        let reflecting = b.iter_mut().zip(start).zip(&system.reflects).filter(|(_, reflects)| **reflects);
        reflecting.for_each(|((b, start), _)| *b = *start);
    }
    let mut image = vec![0.0; b.len()];
    system.apply(&b, &mut image);
    let mut rest: Vec<f64> =
        system.emission.iter().zip(&image).map(|(emission, image)| emission - image).collect();
    system.fix_black(&mut rest);
    let goal = residual * residual * system.norm(&system.emission);
    let mut norm = system.norm(&rest);
    let mut direction = system.scaled(&rest);
    for _ in 0..MOST_STEPS {
        if norm <= goal {
            break;
        }
        if !go_on() {
            return None;
        }
        system.apply(&direction, &mut image);
        system.fix_black(&mut image);
        let step = norm / direction.iter().zip(&image).map(|(p, image)| p * image).sum::<f64>();
        b.iter_mut().zip(&direction).for_each(|(b, p)| *b += step * p);
        rest.iter_mut().zip(&image).for_each(|(rest, image)| *rest -= step * image);
        let before = norm;
        norm = system.norm(&rest);
        let keep = norm / before;
        direction.iter_mut().zip(system.scaled(&rest)).for_each(|(p, z)| *p = z + keep * *p);
    }
    Some(b)
}

/// The matrix and the right-hand side of one channel.
struct System<'a> {
    links: &'a Links<'a>,
    /// [m²]; 1 where the face is black, whose B = E is known.
    diagonal: Vec<f64>,
    /// A_i E_i/R_i [W]; 0 where black.
    emission: Vec<f64>,
    emittance: Vec<f64>,
    reflects: Vec<bool>,
}

impl<'a> System<'a> {
    fn new(channel: usize, links: &'a Links<'a>) -> Self {
        let faces = links.faces;
        let reflects: Vec<bool> = faces.list.iter().map(|face| face.reflectance[channel] > 0.0).collect();
        let emittance: Vec<f64> = faces.list.iter().map(|face| face.emittance[channel]).collect();
        let rows = faces.areas.iter().zip(links.total()).zip(&faces.list);
        let (diagonal, emission) = rows
            .map(|((area, total), face)| match face.reflectance[channel] {
                0.0 => (1.0, 0.0),
                r => (area * (1.0 - r) / r + total, area * face.emittance[channel] / r),
            })
            .unzip();
        System { links, diagonal, emission, emittance, reflects }
    }

    /// y = (matrix)·x.
    fn apply(&self, x: &[f64], y: &mut [f64]) {
        for ((y, x), diagonal) in y.iter_mut().zip(x).zip(&self.diagonal) {
            *y = diagonal * x;
        }
        self.links.add_incoming(-1.0, x, y);
    }

    /// Black faces take no part: nothing is left to find there.
    fn fix_black(&self, x: &mut [f64]) {
        x.iter_mut().zip(&self.reflects).filter(|(_, reflects)| !**reflects).for_each(|(x, _)| *x = 0.0);
    }

    fn norm(&self, x: &[f64]) -> f64 {
        x.iter().zip(&self.diagonal).map(|(x, diagonal)| x * x / diagonal).sum()
    }

    fn scaled(&self, x: &[f64]) -> Vec<f64> {
        x.iter().zip(&self.diagonal).map(|(x, diagonal)| x / diagonal).collect()
    }
}
