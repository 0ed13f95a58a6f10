//! The form factors of any scene of parallelograms and triangles, open or closed, with whatever stands between.

use crate::contour;
use crate::exchange::{ExchangeMatrix, Uncertain};
use crate::face::{ConvexPiece, ExchangeFace, FAR, FaceScene};
use crate::form_factor;
use crate::occlusion::{Between, Occluders};
use crate::penumbra::{Estimated, Penumbra};
use crate::polygon::{CutPlane, Polygon, in_front};

/// The relative error of exchanges without occlusion: closed forms, contour integrals, cubature from afar.
const CLEAR_ERROR: f64 = 1e-9;

/// The error that partly occluded exchanges between n faces aim at, relative to what they would be without,
/// point to point: 2·10⁻³ from 300 faces on, less where fewer pairs leave more time for each.
fn penumbra_error(n: usize) -> f64 {
    (2e-8 * (n as f64).powi(2)).clamp(2e-5, 2e-3)
}

/// Hears which part of the work is done.
pub(crate) type ProgressWatch<'a> = &'a (dyn Fn(f64) + Sync);

/// One row of the lower triangle: its exchange areas up to the diagonal, and the pairs that were hard.
struct ExchangeRow {
    i: usize,
    exchange: Vec<f64>,
    uncertain: Vec<Uncertain>,
}

/// Everything that the exchange of two faces depends on.
struct PairGeometry {
    scene: FaceScene,
    occluders: Occluders,
    /// The relative error that partly occluded exchanges aim at: see [`penumbra_error`].
    penumbra_error: f64,
}

/// The exchange areas between the faces of a scene.
///
/// Pairs that nothing occludes, as a conservative test of the surfaces against the convex hull of the pair
/// proves, err by about 10⁻⁹ of themselves. Others are integrated adaptively, with an estimated error that
/// [`ExchangeMatrix::row_errors`] sums up. Rows are shared out to threads; the result does not depend on them.
/// `watch` hears now and then which part of the pairs is done.
pub(crate) fn exchange(scene: FaceScene, watch: ProgressWatch<'_>) -> ExchangeMatrix {
    let penumbra_error = penumbra_error(scene.faces.len());
    exchange_to(penumbra_error, scene, watch)
}

/// The exchange areas with partly occluded ones aiming at this relative error.
fn exchange_to(penumbra_error: f64, scene: FaceScene, watch: ProgressWatch<'_>) -> ExchangeMatrix {
    let occluders = Occluders::new(&scene.outlines, scene.tolerance);
    let geometry = PairGeometry { scene, occluders, penumbra_error };
    let mut rows = geometry.rows(watch);
    rows.sort_by_key(|row| row.i);
    let areas = geometry.scene.faces.iter().map(|face| face.area).collect();
    let matrix = ExchangeMatrix::new(areas, |i, j| rows[i].exchange[j]);
    let uncertain = rows.into_iter().flat_map(|row| row.uncertain).collect();
    matrix.with_errors(CLEAR_ERROR, uncertain)
}

impl PairGeometry {
    /// All rows, the last one first. Long rows come first, so that the threads end together.
    fn rows(&self, watch: ProgressWatch<'_>) -> Vec<ExchangeRow> {
        let all = self.scene.faces.len();
        parallel::on_all_cores(all, |done| {
            // Row n has n pairs, and the long ones come first.
            let n = all - done;
            watch(1.0 - (n as f64 / all as f64).powi(2));
            self.row(n - 1)
        })
    }

    fn row(&self, i: usize) -> ExchangeRow {
        let mut row = ExchangeRow { i, exchange: Vec::with_capacity(i + 1), uncertain: vec![] };
        for j in 0..=i {
            let Estimated { value, error } = self.pair(&self.scene.faces[i], &self.scene.faces[j]);
            row.exchange.push(value);
            if error > 0.0 {
                row.uncertain.push(Uncertain { i, j, error });
            }
        }
        row
    }

    /// The exchange area of two faces, with an error only if it is beyond [`CLEAR_ERROR`]: through the gap between two
    /// layers, or between what no layers cover of them.
    fn pair(&self, i: &ExchangeFace, j: &ExchangeFace) -> Estimated {
        if let Some(area) = self.scene.layers.exchange_area(&i.whole(), &j.whole()) {
            return Estimated::certain(area);
        }
        let pairs = i.exposed.iter().flat_map(|p| j.exposed.iter().map(move |q| self.pieces(p, q)));
        pairs.fold(Estimated::default(), Estimated::plus)
    }

    /// The exchange area of pieces of two faces.
    fn pieces(&self, i: &ConvexPiece, j: &ConvexPiece) -> Estimated {
        let tolerance = self.scene.tolerance;
        let (p, q) = (in_front(&i.polygon, &j.plane, tolerance), in_front(&j.polygon, &i.plane, tolerance));
        if p.is_empty() || q.is_empty() {
            return Estimated::default();
        }
        let goal = self.penumbra_error * at_most(i, j);
        match self.occluders.between(&p, &q) {
            Between::Everything => Estimated::default(),
            Between::Nothing => {
                let whole = p == i.polygon && q == j.polygon;
                Estimated::certain(clear(i, j, whole).unwrap_or_else(|| contour::exchange_area(&p, &q)))
            }
            Between::Some(between) => {
                let parts_p = self.occluders.cut(&p, &between);
                let parts_q = self.occluders.cut(&q, &between);
                let goal = goal / (parts_p.len() * parts_q.len()) as f64;
                let pairs = parts_p.iter().flat_map(|p| parts_q.iter().map(move |q| (p, q)));
                let parts = pairs.map(|(p, q)| self.parts((p, &i.plane), (q, &j.plane), goal));
                parts.fold(Estimated::default(), Estimated::plus)
            }
        }
    }

    /// The exchange area of parts of faces, to about `goal` [m²] where something occludes.
    fn parts(&self, p: (&Polygon, &CutPlane), q: (&Polygon, &CutPlane), goal: f64) -> Estimated {
        match self.occluders.between(p.0, q.0) {
            Between::Everything => Estimated::default(),
            Between::Nothing => Estimated::certain(contour::exchange_area(p.0, q.0)),
            Between::Some(between) => {
                let penumbra = Penumbra::new(&self.occluders, &between);
                penumbra.exchange_area((p.0, p.1), (q.0, q.1), goal)
            }
        }
    }
}

/// Unoccluded exchanges that have an easier way than contours: axis-aligned rectangles, and pieces far apart of
/// which each is wholly in front of the other.
fn clear(i: &ConvexPiece, j: &ConvexPiece, whole: bool) -> Option<f64> {
    if let (Some(i), Some(j)) = (&i.rectangle, &j.rectangle) {
        return Some(form_factor::exchange_area(i, j));
    }
    let diameter = 2.0 * i.radius.max(j.radius);
    let separation = (i.center.distance(j.center) - i.radius - j.radius) / diameter;
    let rule = FAR.iter().position(|&(least, _)| whole && separation >= least)?;
    Some(cubature(i, j, rule))
}

/// ∫∫ cosθ cosθ′/(πr²) by product rules.
fn cubature(i: &ConvexPiece, j: &ConvexPiece, rule: usize) -> f64 {
    let mut sum = 0.0;
    for &(x, w_x) in &i.nodes[rule] {
        for &(y, w_y) in &j.nodes[rule] {
            let line = y - x;
            let square = line.length_squared();
            sum += w_x * w_y * i.plane.normal.dot(line) * -j.plane.normal.dot(line) / (square * square);
        }
    }
    sum / std::f64::consts::PI
}

/// The size of an exchange area [m²]: that of two small patches at this distance, but no larger than either.
fn at_most(i: &ConvexPiece, j: &ConvexPiece) -> f64 {
    let square = i.center.distance_squared(j.center).max((i.radius + j.radius).powi(2) / 4.0);
    (i.area * j.area / (std::f64::consts::PI * square)).min(i.area).min(j.area)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use radiosity::SceneSpec;

    use super::*;
    use crate::shapes::{bumpy_ball, furnished_room, l_room, painted, turned};
    use crate::{Exact, SystemAccuracy};

    /// The relative error aimed at where pairs are many.
    const GOAL: f64 = 2e-3;

    /// How the errors stated of a solution compare with its differences to a finer one.
    struct Judgement {
        pairs: usize,
        /// Pairs off by more than stated, and by more than twice that.
        over: [usize; 2],
        /// The greatest ratio of what a row is off, Σ_j |δF_ij|, to what is stated.
        row: f64,
        /// The greatest ratio of what a radiosity is off to what is stated.
        radiosity: f64,
    }

    /// A furnace but for its first face, which is brighter, solved twice.
    fn judged(spec: &SceneSpec, finer: f64) -> Judgement {
        let [coarse, fine] =
            [GOAL, GOAL * finer].map(|goal| Arc::new(exchange_to(goal, FaceScene::new(spec, &[]), &|_| ())));
        let n = coarse.face_count();
        let solved = |matrix: &Arc<ExchangeMatrix>| {
            let emittance = (0..n).map(|face| if face == 0 { 10.0 } else { 0.1 }).collect();
            Exact::new(Arc::clone(matrix), vec![0.7; n], emittance).unwrap()
        };
        let (mut over, mut rows) = ([0; 2], vec![0.0; n]);
        for pair in coarse.uncertain() {
            let off = (coarse.exchange_area(pair.i, pair.j) - fine.exchange_area(pair.i, pair.j)).abs();
            over[0] += usize::from(off > pair.error);
            over[1] += usize::from(off > 2.0 * pair.error);
            rows[pair.i] += off / coarse.areas()[pair.i];
            rows[pair.j] += off / coarse.areas()[pair.j];
        }
        let greatest = |off: &mut dyn Iterator<Item = f64>, stated: &[f64]| {
            off.zip(stated).map(|(off, stated)| off / stated).fold(0.0, f64::max)
        };
        let (b, b_fine) = (solved(&coarse), solved(&fine));
        let pairs = b.solution().radiosity.iter().zip(&b_fine.solution().radiosity);
        Judgement {
            pairs: coarse.uncertain().len(),
            over,
            row: greatest(&mut rows.iter().copied(), &coarse.row_errors()),
            radiosity: greatest(
                &mut pairs.map(|(coarse, fine)| (coarse - fine).abs()),
                &SystemAccuracy::of(&b).radiosity_error,
            ),
        }
    }

    #[track_caller]
    fn assert_stated_errors_hold(name: &str, spec: &SceneSpec, finer: f64) {
        let Judgement { pairs, over, row, radiosity } = judged(spec, finer);
        println!(
            "{name}: of {pairs} pairs {} are off by more than stated, {} by more than twice that; rows by at most \
             {row:.2} of it, radiosities by {radiosity:.2}",
            over[0], over[1]
        );
        assert!(pairs > 100 && 50 * over[0] <= pairs && 500 * over[1] <= pairs, "{over:?} of {pairs}");
        assert!(row < 1.0 && radiosity < 1.0, "{name}: {row} {radiosity}");
    }

    #[test]
    fn stated_errors_hold_against_a_finer_solution() {
        assert_stated_errors_hold("L", &turned(&painted(l_room(4), 0.5, 1.0)), 0.02);
        assert_stated_errors_hold("bumpy ball", &painted(bumpy_ball(1), 0.5, 1.0), 0.02);
    }

    #[test]
    #[ignore = "takes minutes"]
    fn stated_errors_hold_in_a_furnished_room() {
        assert_stated_errors_hold("bumpy ball of 320", &painted(bumpy_ball(2), 0.5, 1.0), 0.02);
        assert_stated_errors_hold("furnished room", &furnished_room(1.0), 0.02);
    }
}
