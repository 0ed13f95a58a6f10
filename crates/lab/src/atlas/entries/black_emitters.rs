//! Entry of the atlas: emitters that do not reflect, which gathering by survival does not see.

use exact::Exact;
use radiosity::{Birth, EstimatorKind, Method, SceneSpec, methods::birth_probabilities};
use report::{Axis, Chart};
use stats::Measured;

use crate::arithmetic::{ratio, root};
use crate::atlas::entry::{Entry, StudyFinding};
use crate::claim::Claim;
use crate::judged_run::run;
use crate::lab::Lab;
use crate::series::SweepCurve;
use crate::walking::{Failure, SeededWalks, experiment, squared_error, variance_over};
use report::words::{measured, number};

pub(crate) const ENTRY: Entry = Entry {
    name: "black-emitters",
    title: "Emitters that do not reflect, under gathering by survival",
    study,
};

/// The patch that is examined: in the middle of the last face of the 54-patch cube.
const PATCH: usize = 49;

const KINDS: [EstimatorKind; 2] = [EstimatorKind::Survival, EstimatorKind::Collision];

fn scene(reflectance: f64) -> SceneSpec {
    let mut spec = scenes::cube(3);
    spec.surfaces[0].reflectance = reflectance.into();
    spec
}

fn birth() -> Birth {
    Birth::Patches(vec![PATCH as u32])
}

/// The sweep over reflectances of the emitter.
struct BlackEmittersSweep {
    darkest: f64,
    /// The variances of b for one walk over b², by either kind of score.
    curves: [SweepCurve; 2],
    claims: Vec<Claim>,
}

impl BlackEmittersSweep {
    fn drive(lab: &Lab) -> Result<Self, Failure> {
        let walks = lab.pick(200_000, 5_000_000);
        let (mut curves, mut claims, mut darkest) = ([const { SweepCurve::new() }; 2], Vec::new(), 0.0);
        for reflectance in lab.pick(vec![0.3, 0.03], vec![0.3, 0.1, 0.03, 0.01, 0.003]) {
            let spec = scene(reflectance);
            let exact = Exact::of_scene(&spec)?;
            for (kind, curve) in KINDS.into_iter().zip(&mut curves) {
                let experiment = experiment(&spec, Method::gathering(birth(), kind))?;
                let born = birth_probabilities(experiment.scene(), &birth());
                let variance =
                    exact.gathering_variances(kind, &born)[PATCH].ok_or("walks are born on the patch")?;
                let over = variance_over(&experiment, SeededWalks { seed: 5, walks }, PATCH, variance);
                let what = format!("R = {reflectance}: variance of {} over theory", kind.word());
                claims.push(Claim::equal(what, over, 1.0));
                let scale = variance / exact.solution().reflected[PATCH].powi(2);
                let found =
                    Measured { value: over.value * scale, standard_error: over.standard_error * scale };
                curve.push(reflectance, scale, found);
            }
            darkest = reflectance;
        }
        Ok(BlackEmittersSweep { darkest, curves, claims })
    }

    fn chart(self) -> Chart {
        let series = KINDS.into_iter().zip(self.curves).flat_map(|(kind, curve)| {
            curve.series(&format!("{}, S97 table 3", kind.word()), &format!("{}, seen", kind.word()))
        });
        Chart {
            title: "Variance of gathering, for one walk".into(),
            x: Axis::log("reflectance of the emitter"),
            y: Axis::log("variance of b for one walk, over b²"),
            series: series.collect(),
        }
    }
}

/// The program's words about an emitter that reflects nothing, and about one that hardly reflects.
fn messages(claims: &mut Vec<Claim>) -> Result<Vec<String>, Failure> {
    let by_survival = |reflectance| {
        experiment(&scene(reflectance), Method::gathering(Birth::Area, EstimatorKind::Survival))
    };
    let refused = by_survival(0.0).err().map(|why| format!("at R = 0: {why}"));
    let mut messages: Vec<String> = refused.into_iter().collect();
    claims.push(Claim::messages(&messages, "its light would be lost"));
    let dim = by_survival(0.01)?;
    messages.extend(run(&dim, 1, 20_000, None).messages().into_iter().filter(|line| line.contains("`fit`")));
    claims.push(Claim::messages(&messages, "collision has up to 100 times less variance"));
    Ok(messages)
}

fn study(lab: &Lab) -> Result<StudyFinding, Failure> {
    let sweep = BlackEmittersSweep::drive(lab)?;
    let mut claims = sweep.claims.clone();
    let messages = messages(&mut claims)?;
    let at_zero = experiment(&scene(0.0), Method::gathering(birth(), EstimatorKind::Collision))?;
    let truth = Exact::of_scene(&scene(0.0))?.solution().radiosity.clone();
    let (runs, few) = lab.pick((40, 20_000), (100, 100_000));
    let remedy = squared_error(lab, runs, &at_zero, few, &[PATCH], &truth);
    let expected = sweep.curves[1].last_predicted() / few as f64;
    let what = "R = 0: squared error of collision over that at the end of the sweep";
    claims.push(Claim::equal(what, ratio(remedy, expected), 1.0).instead());
    Ok(StudyFinding {
        predicted: "Gathering by survival scores E_s/R_s where a walk survives on a source: variance \
                    (R_i/p_i)Σ_s(E_s + 2b_s)b_is/R_s − b_i² (S97 table 3), which grows as 1/R_s. At R_s = 0 no walk \
                    survives there and the light is lost: the estimate would be 0 with an error of 0."
            .into(),
        seen: format!(
            "At R_s = {} the variance over b² is {} by survival and {} by collision.",
            sweep.darkest,
            measured(sweep.curves[0].last()),
            measured(sweep.curves[1].last())
        ),
        messages,
        instead: format!(
            "Write estimator = \"collision\": at R_s = 0 its rms relative error after {few} \
             walks is {}, where theory has {}.",
            measured(root(remedy)),
            number(expected.sqrt())
        ),
        claims,
        chart: sweep.chart(),
    })
}
