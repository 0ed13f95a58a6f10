//! Entry of the atlas: absorption at R near 1.

use exact::Exact;
use radiosity::{EstimatorKind, Method, SceneSpec};
use report::{Axis, Chart};

use crate::arithmetic::ratio;
use crate::atlas::entry::{Entry, StudyFinding};
use crate::claim::Claim;
use crate::judged_run::run;
use crate::lab::Lab;
use crate::series::SweepCurve;
use crate::walking::{Failure, experiment, receivers, squared_error};
use report::words::{measured, number};

pub(crate) const ENTRY: Entry = Entry {
    name: "absorption-in-the-bright",
    title: "R → 1: absorption shooting scores once per walk, at its end",
    study,
};

/// The 54-patch cube of one reflectance.
pub(crate) fn scene(reflectance: f64) -> SceneSpec {
    let mut spec = scenes::cube(3);
    spec.surfaces.iter_mut().for_each(|face| face.reflectance = reflectance.into());
    spec
}

const KINDS: [EstimatorKind; 2] = [EstimatorKind::Absorption, EstimatorKind::Collision];

/// The sweep over reflectances, with equal rays.
struct AbsorptionSweep {
    rays: f64,
    brightest: f64,
    /// The mean squared relative errors of either kind of score.
    curves: [SweepCurve; 2],
    claims: Vec<Claim>,
}

impl AbsorptionSweep {
    fn drive(lab: &Lab) -> Result<Self, Failure> {
        let reflectances = lab.pick(vec![0.5, 0.99], vec![0.5, 0.9, 0.99, 0.999]);
        let (runs, rays) = lab.pick((40, 40_000.0), (200, 400_000.0));
        let (mut curves, mut claims, mut brightest) = ([const { SweepCurve::new() }; 2], Vec::new(), 0.0);
        for reflectance in reflectances {
            let spec = scene(reflectance);
            let exact = Exact::of_scene(&spec)?;
            let walks = (rays * (1.0 - reflectance)) as u64;
            for (kind, curve) in KINDS.into_iter().zip(&mut curves) {
                let experiment = experiment(&spec, Method::shooting(kind))?;
                let patches = receivers(&experiment);
                let (variances, b) = (exact.shooting_variances(kind), &exact.solution().reflected);
                let predicted = patches.iter().map(|&i| variances[i] / (b[i] * b[i])).sum::<f64>()
                    / (patches.len() as f64 * walks as f64);
                let measured =
                    squared_error(lab, runs, &experiment, walks, &patches, &exact.solution().radiosity);
                let what = format!("R = {reflectance}: squared error of {} over theory", kind.word());
                claims.push(Claim::equal(what, ratio(measured, predicted), 1.0));
                curve.push(1.0 - reflectance, predicted, measured);
            }
            brightest = reflectance;
        }
        Ok(AbsorptionSweep { rays, brightest, curves, claims })
    }

    fn chart(self) -> Chart {
        let series = KINDS.into_iter().zip(self.curves).flat_map(|(kind, curve)| {
            curve.series(&format!("{}, S97 table 3", kind.word()), &format!("{}, seen", kind.word()))
        });
        Chart {
            title: format!("Squared error of {:.0} rays in the 54-patch cube", self.rays),
            x: Axis::log("1 − R"),
            y: Axis::log("mean squared relative error"),
            series: series.collect(),
        }
    }
}

fn study(lab: &Lab) -> Result<StudyFinding, Failure> {
    let sweep = AbsorptionSweep::drive(lab)?;
    let (brightest, mut claims) = (sweep.brightest, sweep.claims.clone());
    let dim = experiment(&scene(brightest), Method::shooting(EstimatorKind::Absorption))?;
    let messages = run(&dim, 1, 4000, None).messages();
    claims.push(Claim::messages(&messages, "collision has up to"));
    let [worse, better] = [0, 1].map(|kind: usize| sweep.curves[kind].last());
    let what = "squared error of collision at the brightest, below half that of absorption";
    claims.push(Claim::below(what, better, 0.5 * worse.value).instead());
    Ok(StudyFinding {
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
        messages,
        instead: format!(
            "Write estimator = \"collision\": {} times less at R = {brightest}, as measured; or chains, which the \
             entry on long walks compares.",
            number(worse.value / better.value)
        ),
        claims,
        chart: sweep.chart(),
    })
}
