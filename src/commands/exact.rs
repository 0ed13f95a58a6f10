//! `radwalk exact`: the radiosity system itself, without any randomness.

use exact::{Accuracy, Bounds, ESTIMATORS, Exact, ExactError, SharedPath, WeightedWalk};
use job::{Grouping, Groups};
use radiosity::{Scene, birth_probabilities};
use report::{Check, ExactBounds, ExactColumns, ExactSummary, OutputFolder, Units};
use results::units;
use tracing::warn;
use voice::{Phase, say};

use crate::args::ExactArgs;
use crate::commands::coordinate::default_folder;
use crate::fault::{Fault, Outcome};

/// Solves a job's scene and writes `exact.csv` and `exact.json`; in colour, a pair for each channel.
pub(crate) fn exact(args: &ExactArgs) -> Result<Outcome, Fault> {
    let phase = Phase::begin("reading the scene");
    let job = job::load(&args.job.job, &args.job.overrides())?;
    // The job's own error messages know the line of the file that is at fault.
    let scene = job.build_scene()?;
    let path = args.out.out.clone().unwrap_or_else(|| default_folder(&job));
    let files: &[[&str; 3]] = if scene.channels() == 1 { &GREY_FILES } else { &CHANNEL_FILES };
    let folder = OutputFolder::claim(&path, files.as_flattened(), args.out.force)?;
    phase.now("finding form factors and solving for light");
    let channels = Exact::of_channels(job.scene.spec(), &|part| phase.done(part))?;
    phase.now("predicting variances");
    let shared = (channels.len() > 1).then(|| SharedPath::of(&channels.iter().collect::<Vec<_>>()));
    let names = (scene.faces().len() <= MOST_FACTORS)
        .then(|| Groups::of(&Grouping::ByPatch, &job.scene, &scene).map(|groups| groups.names))
        .transpose()?;
    let birth = birth_probabilities(&scene, &job.method.birth);
    for (exact, [table, page, factors]) in channels.iter().zip(files) {
        let walk = shared.as_ref().map(|shared| WeightedWalk::new(exact, shared)).transpose();
        let walk = walk.map_err(ExactError::from)?;
        let accuracy = Accuracy::of(exact);
        let columns = columns(exact, walk.as_ref(), &accuracy, &birth);
        let summary = summary(exact, &accuracy, &scene, units(job.light));
        folder.write(table, |file| report::write_exact(file, scene.faces(), &columns))?;
        folder.write(page, |file| summary.write(file))?;
        if let Some(names) = &names {
            folder
                .write(factors, |file| report::write_exact_factors(file, names, |i| factors_of(exact, i)))?;
        }
        if !args.out.quiet {
            describe(&summary);
        }
    }
    drop(phase);
    if !args.out.quiet {
        say(&format!("written to {}", folder.path().display()));
    }
    Ok(Outcome::Done)
}

/// The most faces whose factors are written: every pair of them is a row.
const MOST_FACTORS: usize = 512;

const GREY_FILES: [[&str; 3]; 1] = [["exact.csv", "exact.json", "exact-factors.csv"]];

const CHANNEL_FILES: [[&str; 3]; 3] = [
    ["exact_r.csv", "exact_r.json", "exact-factors_r.csv"],
    ["exact_g.csv", "exact_g.json", "exact-factors_g.csv"],
    ["exact_b.csv", "exact_b.json", "exact-factors_b.csv"],
];

/// F_ij and B_ij from face i to every face: what meets it first, and what it absorbs of what face i alone emits.
fn factors_of(exact: &Exact, i: usize) -> Vec<[f64; 2]> {
    let mut emittance = vec![0.0; exact.face_count()];
    emittance[i] = 1.0 / exact.areas()[i];
    let incoming = exact.system().solve(&emittance).incoming;
    let absorbed =
        incoming.iter().zip(exact.reflectance()).map(|(phi, reflectance)| (1.0 - reflectance) * phi);
    absorbed.enumerate().map(|(j, absorbed)| [exact.exchange().form_factor(i, j), absorbed]).collect()
}

/// A few lines for people.
fn describe(summary: &ExactSummary) {
    say(&format!("{} patches solved to a residual of {:.1e}", summary.patches, summary.residual));
    say(&format!("form factors found {}", summary.form_factors));
    say(&format!(
        "their rows sum to {:.6} … {:.6} (1: no light is lost), with an error of at most {:.1e}",
        summary.row_sum_min, summary.row_sum_max, summary.row_error
    ));
    if let (Some(error), Some(face)) = (summary.max_relative_error, summary.worst_face()) {
        say(&format!("so the relative error of radiosities is at most {error:.1e} ({face})"));
    }
    if summary.undetermined > 0 {
        say(&format!("{} faces are too dark: their errors exceed their radiosities", summary.undetermined));
    }
    for check in summary.checks.iter().filter(|check| !check.ok) {
        warn!("{}", check.message);
    }
}

/// What holds of the whole scene.
fn summary(exact: &Exact, accuracy: &Accuracy, scene: &Scene, units: Units) -> ExactSummary {
    let [row_sum_min, row_sum_max] = accuracy.row_sums;
    let worst = accuracy.worst(exact);
    let worst_face = worst.map(|(face, _)| scene.faces().get(face));
    let bounds = Bounds::of(exact);
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
            shooting_variance: bounds.shooting_variance(),
            gathering_variance: bounds.gathering_variance(),
            shooting_mse: ESTIMATORS.map(|estimator| bounds.shooting_error(estimator)),
            gathering_mse: ESTIMATORS.map(|estimator| bounds.gathering_error(estimator)),
        },
        checks: vec![rows_check(accuracy)],
    }
}

/// Whether the rows of form factors can be.
fn rows_check(accuracy: &Accuracy) -> Check {
    let message = if accuracy.rows_possible {
        "no row of form factors sums to more than 1 by more than its error"
    } else {
        "a row of form factors sums to more than 1 by more than its error (surfaces that cross may be \
         the reason); do not trust this solution"
    };
    Check { name: "rows".into(), ok: accuracy.rows_possible, message: message.into() }
}

/// The columns of `exact.csv`; `birth` is p_i of every face. In colour the variances are those of `walk`, which
/// serves all channels.
fn columns(
    exact: &Exact,
    walk: Option<&WeightedWalk<'_>>,
    accuracy: &Accuracy,
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
        var_shoot: ESTIMATORS.map(|estimator| {
            Some(walk.map_or_else(
                || exact.shooting_variances(estimator),
                |walk| walk.shooting_variances(estimator),
            ))
        }),
        var_gather: ESTIMATORS.map(|estimator| {
            let alone = || exact.gathering_variances(estimator, birth);
            Some(or_none(walk.map_or_else(alone, |walk| walk.gathering_variances(estimator, birth))))
        }),
        psi: squared.incoming.clone(),
        beta: squared.reflected.clone(),
        radiosity_error: accuracy.radiosity_error.clone(),
    }
}
