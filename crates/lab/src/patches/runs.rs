//! Runs of a scene on a grid.

use glam::DVec3;
use job::Cut;
use radiosity::{
    Direction, Estimator, EstimatorKind, Experiment, IndexChoice, Scene, SceneSpec, Sequence, Side, Space,
    SurfaceSpec, Tally, Walks, linear::Fit, methods::Score,
};

use crate::clock::thread_seconds;
pub use crate::walking::Failure;

/// Walks of the method that jobs have by default, on a grid.
pub fn experiment(spec: &SceneSpec, cuts: &[Cut], linear: bool) -> Result<Experiment, Failure> {
    let mut spec = spec.clone();
    let fits = spec.surfaces.iter_mut().zip(cuts).all(|(surface, cut)| cut.clone().apply(surface));
    assert!(fits, "rooms are of quads that emit as a whole");
    let estimator: Estimator = EstimatorKind::Collision.into();
    let score = if linear { Score::Linear(estimator) } else { Score::Of(estimator) };
    let walks = Walks { direction: Direction::Shooting, space: Space::Continuous, score };
    Ok(Experiment::new(Scene::build(&spec, IndexChoice::Auto)?, walks)?)
}

pub fn walk(experiment: &Experiment, seed: u64, walks: u64) -> Tally {
    let (sequence, mut board) = (Sequence::new(seed), experiment.board());
    let mut tally = experiment.tally();
    let mut next = 0;
    while next < walks {
        let end = walks.min(next + (1 << 20));
        experiment.walk(&sequence, next..end, &mut board);
        board.add_to(&mut tally).expect("few walks");
        next = end;
    }
    tally
}

/// The fits of all faces, the back of a surface behind its front.
pub fn fits(experiment: &Experiment, tally: &Tally) -> Vec<Fit> {
    let scene = experiment.scene();
    let mut fits = Vec::new();
    for (number, surface) in scene.surfaces().iter().enumerate() {
        for side in [Side::Front, Side::Back] {
            let Some(first) = scene.faces().first_piece_on(number as u32, side) else { continue };
            let of = |face: u32| experiment.fit(tally, face as usize, 0).expect("walks that are shot");
            fits.extend((first..first + surface.cell_count()).map(of));
        }
    }
    fits
}

/// The energy of the error after one walk, of means and of linear fits, from a tally of linear fits.
pub fn noise(experiment: &Experiment, tally: &Tally) -> [f64; 2] {
    let faces = experiment.scene().faces();
    let mut noise = [0.0; 2];
    for (face, known) in faces.iter().enumerate() {
        let fit = experiment.fit(tally, face, 0).expect("walks that are shot");
        noise[0] += known.area * fit.mean_variance;
        noise[1] += known.area * (fit.mean_variance + fit.slope_variance);
    }
    noise.map(|noise| noise * tally.counts.walks as f64)
}

/// Square cells of one size, about this many.
pub fn cut_all(spec: &SceneSpec, cells: f64) -> Vec<Cut> {
    let area: f64 = spec.surfaces.iter().map(|surface| surface.shape.area()).sum();
    let size = (area / cells).sqrt();
    let along = |edge: DVec3| (edge.length() / size).round().max(1.0) as u32;
    let cut = |surface: &SurfaceSpec| {
        let (_, u, v) = surface.shape.edges();
        Cut::Grid([along(u), along(v)])
    };
    spec.surfaces.iter().map(cut).collect()
}

/// Does the same three times. Returns the least processor time [s], and what was made.
pub fn fastest<T>(make: impl Fn() -> T) -> (f64, T) {
    let timed = || {
        let began = thread_seconds();
        let made = make();
        (thread_seconds() - began, made)
    };
    let (mut least, mut made) = timed();
    for _ in 1..3 {
        let (time, again) = timed();
        (least, made) = (least.min(time), again);
    }
    (least, made)
}
