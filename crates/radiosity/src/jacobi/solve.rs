//! The radiosity system of counted links.
//!
//! B_i = E_i + R_i Σ_j F_ij B_j with Σ_j F_ij + (lost part) = 1 also reads
//! A_i(1 − R_i)/R_i·B_i + Σ_j K_ij (B_i − B_j) + (lost area)·B_i = A_i E_i/R_i: only differences of B go along links, so
//! that a uniform B is exact whatever the counts, and Σ A(1 − R)H + lost = Φ_T whatever they are. The matrix is
//! symmetric and diagonally dominant: conjugate gradients find what Jacobi iterations converge to in far fewer steps
//! (M. R. Hestenes & E. Stiefel, J. Res. Nat. Bur. Standards 49 (1952)), and 0 ≤ B ≤ max E/(1 − R).

use super::links::Links;
use crate::thread_pool::ThreadPool;

/// More steps than any system has taken; what is left of the residual then is below the noise of the links.
const MOST_STEPS: usize = 1000;

/// Light that comes to faces otherwise than along links.
#[derive(Default)]
pub(crate) struct Straight {
    /// H_d of every face, channel by channel [W/m²]; `None` where there is none.
    pub(crate) irradiance: Option<Vec<Vec<f64>>>,
    /// Whether the light that faces emit is in it.
    pub(crate) has_emitted: bool,
}

/// B of every face [W/m²], channel by channel, until the residual has fallen to this part of the source's, both in the
/// norm of the inverse diagonal. H_d adds A_i·H_d to the source. Where that has the light that faces emit, it is b = B − E that is found: the
/// same system without A_i E_i/R_i. `start` is a guess, or empty. `None` once `pool` no longer want it.
pub(crate) fn solve(
    links: &Links,
    direct: &Straight,
    start: &[Vec<f64>],
    residual: f64,
    pool: &dyn ThreadPool,
) -> Option<Vec<Vec<f64>>> {
    match links.faces.scene.channels() {
        1 => LinkSystem::<1>::new(links, direct, pool).solve(start, residual),
        _ => LinkSystem::<3>::new(links, direct, pool).solve(start, residual),
    }
}

/// Numbers of all faces, in C channels each.
type FaceNumbers<const C: usize> = Vec<[f64; C]>;

/// The matrices and the right-hand sides of C channels, which share their links.
struct LinkSystem<'a, const C: usize> {
    links: &'a Links<'a>,
    pool: &'a dyn ThreadPool,
    /// [m²]; 1 where the face is black, whose B = E is known.
    diagonal: FaceNumbers<C>,
    /// A_i E_i/R_i and A_i·H_d [W]; 0 where black.
    emission: FaceNumbers<C>,
    /// What is known of the unknown where a face is black [W/m²].
    known: FaceNumbers<C>,
    reflects: Vec<[bool; C]>,
}

impl<'a, const C: usize> LinkSystem<'a, C> {
    fn new(links: &'a Links<'a>, direct: &Straight, pool: &'a dyn ThreadPool) -> Self {
        let faces = links.faces;
        let rows = || faces.areas.iter().zip(links.total()).zip(&faces.list);
        let diagonal = rows().map(|((area, total), face)| {
            std::array::from_fn(|c| match face.reflectance[c] {
                0.0 => 1.0,
                r => area * (1.0 - r) / r + total,
            })
        });
        let emission = rows().enumerate().map(|(i, ((area, _), face))| {
            std::array::from_fn(|c| match (face.reflectance[c], &direct.irradiance) {
                (0.0, _) => 0.0,
                (_, Some(h)) if direct.has_emitted => area * h[c][i],
                (r, Some(h)) => area * (face.emittance[c] / r + h[c][i]),
                (r, None) => area * face.emittance[c] / r,
            })
        });
        let known = faces.list.iter().map(|face| match direct.has_emitted {
            true => [0.0; C],
            false => std::array::from_fn(|c| face.emittance[c]),
        });
        LinkSystem {
            links,
            pool,
            diagonal: diagonal.collect(),
            emission: emission.collect(),
            known: known.collect(),
            reflects: faces
                .list
                .iter()
                .map(|face| std::array::from_fn(|c| face.reflectance[c] > 0.0))
                .collect(),
        }
    }

    /// Conjugate gradients, all channels at the same pace; those that are done stay as they are.
    fn solve(&self, start: &[Vec<f64>], residual: f64) -> Option<Vec<Vec<f64>>> {
        let mut b = self.begin(start);
        let mut image = vec![[0.0; C]; b.len()];
        self.apply(&b, &mut image);
        let mut rest = self.emission.clone();
        each(&mut rest, &image, |rest, image, _| *rest -= image);
        self.fix_black(&mut rest);
        let goal = self.norm(&self.source()).map(|norm| residual * residual * norm);
        let mut norm = self.norm(&rest);
        let mut direction = self.scaled(&rest);
        for _ in 0..MOST_STEPS {
            let goes_on: [bool; C] = std::array::from_fn(|c| norm[c] > goal[c]);
            if !goes_on.contains(&true) {
                break;
            }
            if !self.pool.go_on() {
                return None;
            }
            self.apply(&direction, &mut image);
            self.fix_black(&mut image);
            let along = dot(&direction, &image);
            let step: [f64; C] = std::array::from_fn(|c| if goes_on[c] { norm[c] / along[c] } else { 0.0 });
            each(&mut b, &direction, |b, p, c| *b += step[c] * p);
            each(&mut rest, &image, |rest, image, c| *rest -= step[c] * image);
            let before = norm;
            norm = self.norm(&rest);
            let keep: [f64; C] = std::array::from_fn(|c| if goes_on[c] { norm[c] / before[c] } else { 0.0 });
            each(&mut direction, &self.scaled(&rest), |p, z, c| *p = z + keep[c] * *p);
        }
        Some((0..C).map(|c| b.iter().map(|b| b[c]).collect()).collect())
    }

    /// The right-hand side of the faces that reflect: their own emission and what comes from black emitters, whose B = E is
    /// known.
    fn source(&self) -> FaceNumbers<C> {
        let mut known = self.known.clone();
        for (b, reflects) in known.iter_mut().zip(&self.reflects) {
            for c in 0..C {
                b[c] = if reflects[c] { 0.0 } else { b[c] };
            }
        }
        let mut source = self.emission.clone();
        self.links.add_incoming(1.0, &known, &mut source, self.pool);
        self.fix_black(&mut source);
        source
    }

    /// The guess, where there is one and the face reflects.
    fn begin(&self, start: &[Vec<f64>]) -> FaceNumbers<C> {
        let mut b = self.known.clone();
        for (c, start) in start.iter().enumerate() {
            let reflecting = b.iter_mut().zip(start).zip(&self.reflects).filter(|(_, reflects)| reflects[c]);
            reflecting.for_each(|((b, start), _)| b[c] = *start);
        }
        b
    }

    /// y = (matrix of the system)·x.
    fn apply(&self, x: &[[f64; C]], y: &mut [[f64; C]]) {
        y.copy_from_slice(&self.diagonal);
        each(y, x, |y, x, _| *y *= x);
        self.links.add_incoming(-1.0, x, y, self.pool);
    }

    /// Black faces take no part: nothing is left to find there.
    fn fix_black(&self, x: &mut [[f64; C]]) {
        for (x, reflects) in x.iter_mut().zip(&self.reflects) {
            for c in 0..C {
                x[c] = if reflects[c] { x[c] } else { 0.0 };
            }
        }
    }

    fn norm(&self, x: &[[f64; C]]) -> [f64; C] {
        let mut sum = [0.0; C];
        for (x, diagonal) in x.iter().zip(&self.diagonal) {
            for c in 0..C {
                sum[c] += x[c] * x[c] / diagonal[c];
            }
        }
        sum
    }

    fn scaled(&self, x: &[[f64; C]]) -> FaceNumbers<C> {
        let mut scaled = x.to_vec();
        each(&mut scaled, &self.diagonal, |x, diagonal, _| *x /= diagonal);
        scaled
    }
}

/// Changes every number of `x` by the one of `y` and the channel that both belong to.
#[inline(always)]
fn each<const C: usize>(x: &mut [[f64; C]], y: &[[f64; C]], change: impl Fn(&mut f64, f64, usize)) {
    for (x, y) in x.iter_mut().zip(y) {
        for c in 0..C {
            change(&mut x[c], y[c], c);
        }
    }
}

fn dot<const C: usize>(x: &[[f64; C]], y: &[[f64; C]]) -> [f64; C] {
    let mut sum = [0.0; C];
    for (x, y) in x.iter().zip(y) {
        for c in 0..C {
            sum[c] += x[c] * y[c];
        }
    }
    sum
}
