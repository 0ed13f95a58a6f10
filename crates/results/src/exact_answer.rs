//! The deterministic solution of a job's scene, as tables and summaries have it.

use exact::{ESTIMATORS, Exact, ExactError, SharedPath, SystemAccuracy, VarianceBounds, WeightedWalk};
use job::Job;
use radiosity::{Scene, methods::birth_probabilities};
use report::{Check, ExactBounds, ExactColumns, ExactSummary, Units};

use crate::outputs::units;

/// The solution of one channel.
pub struct ExactAnswer {
    /// The solution of the radiosity system.
    exact: Exact,
    /// The columns of `exact.csv`, as numbers.
    pub columns: ExactColumns,
    /// The fields of `exact.json`, as values.
    pub summary: ExactSummary,
}

impl ExactAnswer {
    /// F_ij and B_ij from face i to every face: what meets it first, and what it absorbs of what face i alone emits.
    pub fn factors_of(&self, i: usize) -> Vec<[f64; 2]> {
        let exact = &self.exact;
        let mut emittance = vec![0.0; exact.face_count()];
        emittance[i] = 1.0 / exact.areas()[i];
        let incoming = exact.system().solve(&emittance).incoming;
        let absorbed =
            incoming.iter().zip(exact.reflectance()).map(|(phi, reflectance)| (1.0 - reflectance) * phi);
        absorbed.enumerate().map(|(j, absorbed)| [exact.exchange().form_factor(i, j), absorbed]).collect()
    }
}

/// Solves the scene of a job, channel by channel. `now` hears what is being done, and `watch` which part of the form factors is
/// found.
///
/// # Errors
/// Scenes with too many faces, and systems without a solution.
pub fn solve(
    job: &Job,
    scene: &Scene,
    now: &dyn Fn(&'static str),
    watch: &(dyn Fn(f64) + Sync),
) -> Result<Vec<ExactAnswer>, ExactError> {
    now("finding form factors and solving for light");
    let channels = Exact::of_channels(job.scene.spec(), watch)?;
    now("predicting variances");
    let in_colour = channels.len() > 1;
    let shared =
        (in_colour && scene.lamp_count() == 0).then(|| SharedPath::of(&channels.iter().collect::<Vec<_>>()));
    let birth = birth_probabilities(scene, &job.method.birth);
    let answer = |exact: Exact| {
        let walk = shared.as_ref().map(|shared| WeightedWalk::new(&exact, shared)).transpose()?;
        let accuracy = SystemAccuracy::of(&exact);
        let columns = columns(&exact, (walk.as_ref(), in_colour), &accuracy, &birth);
        let summary = summary(&exact, &accuracy, scene, units(job.light));
        Ok(ExactAnswer { exact, columns, summary })
    };
    channels.into_iter().map(answer).collect()
}

/// What holds of the whole scene.
fn summary(exact: &Exact, accuracy: &SystemAccuracy, scene: &Scene, units: Units) -> ExactSummary {
    let [row_sum_min, row_sum_max] = accuracy.row_sums;
    let worst = accuracy.worst(exact);
    let worst_face = worst.map(|(face, _)| scene.faces().get(face));
    // What they are made of, emittances, does not say how bright lamps make a scene.
    let bounds = exact.lamps().is_empty().then(|| VarianceBounds::of(exact));
    let bound = |of: &dyn Fn(&VarianceBounds) -> f64| bounds.as_ref().map_or(f64::NAN, of);
    ExactSummary {
        version: env!("CARGO_PKG_VERSION").into(),
        scene_hash: scene.hash(),
        patches: scene.faces().patch_count(),
        faces: exact.face_count(),
        total_power: exact.total_power(),
        units,
        form_factors: accuracy.form_factors.to_string(),
        row_sum_min,
        row_sum_max,
        row_error: accuracy.row_error,
        residual: accuracy.residual,
        max_relative_error: worst.map(|(_, error)| error),
        worst_patch: worst_face.map(|face| face.patch),
        worst_side: worst_face.filter(|_| scene.faces().two_sided()).map(|face| face.side),
        undetermined: accuracy.undetermined(exact),
        bounds: ExactBounds {
            shooting_variance: bound(&VarianceBounds::shooting_variance),
            gathering_variance: bound(&VarianceBounds::gathering_variance),
            shooting_mse: ESTIMATORS.map(|estimator| bound(&|bounds| bounds.shooting_error(estimator))),
            gathering_mse: ESTIMATORS.map(|estimator| bound(&|bounds| bounds.gathering_error(estimator))),
        },
        checks: vec![rows_check(accuracy)],
    }
}

/// Whether the rows of form factors can be.
fn rows_check(accuracy: &SystemAccuracy) -> Check {
    let message = if accuracy.rows_possible {
        "no row of form factors sums to more than 1 by more than its error"
    } else {
        "a row of form factors sums to more than 1 by more than its error (surfaces that cross may be \
         the reason); do not trust this solution"
    };
    Check { name: "rows".into(), verdict: accuracy.rows_possible.into(), message: message.into() }
}

/// The columns of `exact.csv`; `birth` is p_i of every face. In colour the variances are those of `walk`, which
/// serves all channels. In the light of lamps, which no gathering walk meets, those of shooting a grey scene alone are known.
fn columns(
    exact: &Exact,
    (walk, in_colour): (Option<&WeightedWalk<'_>>, bool),
    accuracy: &SystemAccuracy,
    birth: &[f64],
) -> ExactColumns {
    let solution = exact.solution();
    let squared = exact.squared_solution();
    // What is not defined is no number, and becomes an empty cell.
    let or_none =
        |variances: Vec<Option<f64>>| variances.into_iter().map(|v| v.unwrap_or(f64::NAN)).collect();
    ExactColumns {
        radiosity: solution.radiosity.clone(),
        reflected: solution.reflected.clone(),
        irradiance: solution.irradiance.clone(),
        xi: exact.xi().to_vec(),
        var_shoot: ESTIMATORS.map(|estimator| match walk {
            Some(walk) => Some(walk.shooting_variances(estimator)),
            None => (!in_colour).then(|| exact.shooting_variances(estimator)),
        }),
        var_gather: ESTIMATORS.map(|estimator| match walk {
            Some(walk) => Some(or_none(walk.gathering_variances(estimator, birth))),
            None if !exact.lamps().is_empty() => None,
            None => Some(or_none(exact.gathering_variances(estimator, birth))),
        }),
        psi: squared.incoming.clone(),
        beta: squared.reflected.clone(),
        radiosity_error: accuracy.radiosity_error.clone(),
    }
}
