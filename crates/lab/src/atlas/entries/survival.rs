//! Entry of the atlas: R → 0 under survival.

use exact::Exact;
use radiosity::{EstimatorKind, Method, SceneSpec};
use report::{Axis, Chart, Series};
use stats::Measured;

use crate::arithmetic::ratio;
use crate::atlas::entry::{Entry, StudyFinding};
use crate::claim::Claim;
use crate::judged_run::run;
use crate::lab::Lab;
use crate::walking::{Failure, SeededWalks, estimate, experiment, solve, variance_over};
use report::words::{measured, number};

pub(crate) const ENTRY: Entry = Entry {
    name: "survival-in-the-dark",
    title: "R → 0: survival shooting scores only walks that survive on dark patches",
    study,
};

/// The 54-patch cube whose patches 18 … 26, one face, have this reflectance.
fn scene(dark: f64) -> SceneSpec {
    let mut spec = scenes::cube(3);
    spec.surfaces[2].reflectance = dark.into();
    spec
}

/// The patch in the middle of the dark face.
const PATCH: usize = 22;

struct SurvivalPoint {
    dark: f64,
    /// The predicted variance of b over b² for one walk: survival, collision.
    predicted: [f64; 2],
    /// The measured variance over the predicted one.
    ratio: [Measured; 2],
}

fn study(lab: &Lab) -> Result<StudyFinding, Failure> {
    let sweep = lab.pick(vec![0.3, 0.03], vec![0.3, 0.1, 0.03, 0.01, 0.003, 0.001]);
    let walks = lab.pick(400_000, 20_000_000);
    let points = sweep.iter().map(|&dark| point(dark, walks)).collect::<Result<Vec<_>, Failure>>()?;
    let last = points.last().expect("a sweep has points");
    let survival = experiment(&scene(0.001), Method::shooting(EstimatorKind::Survival))?;
    let messages = run(&survival, 1, 20_000, None).messages();
    let gain = last.predicted[0] / last.predicted[1];
    let mut claims: Vec<Claim> = points.iter().flat_map(of_point).collect();
    claims.push(Claim::messages(&messages, "collision has up to 1000 times less variance"));
    claims.push(Claim::messages(&messages, "`rare`"));
    let (remedy, truth) = irradiance_of_black(walks)?;
    claims.push(
        Claim::equal("R = 0: irradiance by collision over theory", ratio(remedy, truth), 1.0).instead(),
    );
    let kinds = ["survival", "collision"];
    let series = (0..2).flat_map(|kind| {
        let predicted = points.iter().map(move |p| (p.dark, p.predicted[kind]));
        let found = points.iter().map(move |p| {
            let Measured { value, standard_error } = p.ratio[kind];
            let scale = p.predicted[kind];
            (p.dark, Measured { value: value * scale, standard_error: standard_error * scale })
        });
        [
            Series::theory(&format!("{}, S97 table 3", kinds[kind]), predicted),
            Series::measured(&format!("{}, seen", kinds[kind]), found),
        ]
    });
    Ok(StudyFinding {
        predicted: "Survival shooting scores Φ_T/R_i where a walk survives: its variance for one walk is \
                    b[(R_iΦ_T/A_i)(1/R_i + 2ξ_i) − b] (S97 table 3), which over b² grows as 1/R_i; that of collision, \
                    b[(R_iΦ_T/A_i)(1 + 2R_iξ_i) − b], does not. At R_i = 0 no walk survives: b = 0 is known, but not \
                    the irradiance."
            .into(),
        seen: format!(
            "In the 54-patch cube with one dark face the sample variances are {} (survival) and {} (collision) of \
             these at R = {}.",
            measured(last.ratio[0]),
            measured(last.ratio[1]),
            last.dark
        ),
        messages,
        instead: format!(
            "Write estimator = \"collision\": at R = {} its variance is {} times less, as measured above, and its \
             irradiances are known down to R = 0: there that of the dark patch is {} of what theory says.",
            last.dark,
            number(gain),
            measured(ratio(remedy, truth))
        ),
        claims,
        chart: Chart {
            title: "Variance of a dark patch, for one walk".into(),
            x: Axis::log("reflectance of the patch"),
            y: Axis::log("variance of b for one walk, over b²"),
            series: series.collect(),
        },
    })
}

fn point(dark: f64, walks: u64) -> Result<SurvivalPoint, Failure> {
    let spec = scene(dark);
    let exact = Exact::of_scene(&spec)?;
    let of = |kind: EstimatorKind| -> Result<(f64, Measured), Failure> {
        let variance = exact.shooting_variances(kind)[PATCH];
        let experiment = experiment(&spec, Method::shooting(kind))?;
        let ratio = variance_over(&experiment, SeededWalks { seed: 3, walks }, PATCH, variance);
        Ok((variance / exact.solution().reflected[PATCH].powi(2), ratio))
    };
    let survival = of(EstimatorKind::Survival)?;
    let collision = of(EstimatorKind::Collision)?;
    Ok(SurvivalPoint { dark, predicted: [survival.0, collision.0], ratio: [survival.1, collision.1] })
}

/// The irradiance of the dark patch if it reflects nothing [W/m²], by collision walks and by the exact solution.
fn irradiance_of_black(walks: u64) -> Result<(Measured, f64), Failure> {
    let spec = scene(0.0);
    let exact = Exact::of_scene(&spec)?;
    let seen =
        estimate(&solve(&experiment(&spec, Method::shooting(EstimatorKind::Collision))?, 3, walks), PATCH);
    let (value, standard_error) =
        seen.irradiance.zip(seen.irradiance_error).ok_or("collision walks tell irradiances")?;
    Ok((Measured { value, standard_error }, exact.solution().incoming[PATCH] / exact.areas()[PATCH]))
}

fn of_point(point: &SurvivalPoint) -> Vec<Claim> {
    let claim = |(kind, ratio): (&str, Measured)| {
        Claim::equal(format!("R = {}: variance of {kind} over theory", point.dark), ratio, 1.0)
    };
    ["survival", "collision"].into_iter().zip(point.ratio).map(claim).collect()
}
