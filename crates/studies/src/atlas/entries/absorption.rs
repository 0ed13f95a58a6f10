//! Absorption at R near 1.

use exact::Exact;
use radiosity::{EstimatorKind, Method, SceneSpec};
use report::{Axis, Chart};
use stats::Measured;

use crate::arithmetic::ratio;
use crate::atlas::entry::{Entry, Finding};
use crate::claim::Claim;
use crate::lab::Lab;
use crate::numbers::{measured, number};
use crate::series::{seen, theory};
use crate::told::run;
use crate::walking::{Failure, experiment, receivers, squared_error};

pub const ENTRY: Entry = Entry {
    name: "absorption-in-the-bright",
    title: "R → 1: absorption shooting hears of a walk once, at its end",
    study,
};

/// The 54-patch cube of one reflectance.
pub fn scene(reflectance: f64) -> SceneSpec {
    let mut spec = scenes::cube(3);
    spec.surfaces.iter_mut().for_each(|face| face.reflectance = reflectance.into());
    spec
}

const KINDS: [EstimatorKind; 2] = [EstimatorKind::Absorption, EstimatorKind::Collision];

fn study(lab: &Lab) -> Result<Finding, Failure> {
    let sweep = lab.pick(vec![0.5, 0.99], vec![0.5, 0.9, 0.99, 0.999]);
    let (runs, rays) = lab.pick((40, 40_000.0), (200, 400_000.0));
    let mut lines = [const { Vec::new() }; 2];
    let mut marks = [const { Vec::new() }; 2];
    let mut claims = Vec::new();
    for &reflectance in &sweep {
        let spec = scene(reflectance);
        let exact = Exact::of_scene(&spec)?;
        let walks = (rays * (1.0 - reflectance)) as u64;
        for (k, kind) in KINDS.into_iter().enumerate() {
            let experiment = experiment(&spec, Method::shooting(kind))?;
            let patches = receivers(&experiment);
            let (variances, b) = (exact.shooting_variances(kind), &exact.solution().reflected);
            let predicted = patches.iter().map(|&i| variances[i] / (b[i] * b[i])).sum::<f64>()
                / (patches.len() as f64 * walks as f64);
            let measured =
                squared_error(lab, runs, &experiment, walks, &patches, &exact.solution().radiosity);
            let over = ratio(measured, predicted);
            claims.push(Claim::equal(
                format!("R = {reflectance}: squared error of {} over theory", kind.word()),
                over,
                1.0,
            ));
            lines[k].push((1.0 - reflectance, predicted));
            marks[k].push((1.0 - reflectance, measured));
        }
    }
    let brightest = *sweep.last().expect("a sweep has points");
    let told =
        run(&experiment(&scene(brightest), Method::shooting(EstimatorKind::Absorption))?, 1, 4000, None)
            .told();
    claims.push(Claim::told(&told, "collision has up to"));
    let last = |marks: &[(f64, Measured)]| marks[marks.len() - 1].1;
    let (worse, better) = (last(&marks[0]), last(&marks[1]));
    claims.push(
        Claim::below(
            "squared error of collision at the brightest, below half that of absorption",
            better,
            0.5 * worse.value,
        )
        .instead(),
    );
    let series = (0..2).flat_map(|k| {
        let name = KINDS[k].word();
        [
            theory(&format!("{name}, S97 table 3"), lines[k].iter().copied()),
            seen(&format!("{name}, seen"), marks[k].iter().copied()),
        ]
    });
    let chart = Chart {
        title: format!("Squared error of {rays:.0} rays in the 54-patch cube"),
        x: Axis::log("1 − R"),
        y: Axis::log("mean squared relative error"),
        series: series.collect(),
    };
    Ok(Finding {
        predicted: "Absorption scores Φ_T/(1 − R_i) at the end of a walk: variance b[R_iΦ_T/(A_i(1 − R_i)) − b] \
                    (S97 table 3). A walk takes 1/(1 − R) rays and tells of one patch. Collision scores all of them; \
                    its recurrent potential ξ grows as 1/(1 − R) too, but is shared by all patches: with n patches \
                    absorption has about n/2 times its variance."
            .into(),
        seen: format!(
            "At R = {brightest} the mean squared relative error is {} by absorption and {} by collision, from equal \
             rays.",
            measured(worse),
            measured(better)
        ),
        told,
        instead: format!(
            "Write estimator = \"collision\": {} times less at R = {brightest}, as measured; or chains, which the \
             entry on long walks compares.",
            number(worse.value / better.value)
        ),
        claims,
        chart,
    })
}
