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

/// B of every face [W/m²], channel by channel. What is solved for is b = B − E, whose source is what comes along the links straight from emitters,
/// Σ_j K_ij E_j − (Σ_j K_ij + lost area − A_i)·E_i: A_i E_i/R_i of an emitter that is small or nearly black would drown it. The residual falls to
/// this part of the source's, both in the norm of the inverse diagonal. H_d adds A_i·H_d to the source. Where that has the light that faces emit,
/// it is the source alone, and b is the answer. `start` is a guess of the answer, or empty. `None` once `pool` no longer want it.
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
    /// [m²]; 1 where the face is black, whose b = 0 is known.
    diagonal: FaceNumbers<C>,
    /// What comes straight from emitters [W]; 0 where black.
    source: FaceNumbers<C>,
    /// What the answer has beside b: E, where it goes along links [W/m²].
    emitted: FaceNumbers<C>,
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
        let emitted: FaceNumbers<C> = faces
            .list
            .iter()
            .map(|face| match direct.has_emitted {
                true => [0.0; C],
                false => std::array::from_fn(|c| face.emittance[c]),
            })
            .collect();
        let of_own = |(i, (emitted, (area, total))): (usize, (&[f64; C], (&f64, &f64)))| {
            let straight = |c: usize| direct.irradiance.as_ref().map_or(0.0, |h| area * h[c][i]);
            std::array::from_fn(|c| (area - total) * emitted[c] + straight(c))
        };
        let areas = faces.areas.iter().zip(links.total());
        let mut source: FaceNumbers<C> = emitted.iter().zip(areas).enumerate().map(of_own).collect();
        if !direct.has_emitted {
            links.add_incoming(1.0, &emitted, &mut source, pool);
        }
        let mut system = LinkSystem {
            links,
            pool,
            diagonal: diagonal.collect(),
            source: Vec::new(),
            emitted,
            reflects: faces
                .list
                .iter()
                .map(|face| std::array::from_fn(|c| face.reflectance[c] > 0.0))
                .collect(),
        };
        system.fix_black(&mut source);
        system.source = source;
        system
    }

    /// Conjugate gradients, all channels at the same pace; those that are done stay as they are.
    fn solve(&self, start: &[Vec<f64>], residual: f64) -> Option<Vec<Vec<f64>>> {
        let mut b = self.begin(start);
        let mut image = vec![[0.0; C]; b.len()];
        self.apply(&b, &mut image);
        let mut rest = self.source.clone();
        each(&mut rest, &image, |rest, image, _| *rest -= image);
        self.fix_black(&mut rest);
        let goal = self.norm(&self.source).map(|norm| residual * residual * norm);
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
        each(&mut b, &self.emitted, |b, emitted, _| *b += emitted);
        Some((0..C).map(|c| b.iter().map(|b| b[c]).collect()).collect())
    }

    /// b by the guess, where there is one and the face reflects; else 0.
    fn begin(&self, start: &[Vec<f64>]) -> FaceNumbers<C> {
        let mut b = vec![[0.0; C]; self.emitted.len()];
        for (c, start) in start.iter().enumerate() {
            for (i, b) in b.iter_mut().enumerate().filter(|(i, _)| self.reflects[*i][c]) {
                b[c] = start[i] - self.emitted[i][c];
            }
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
