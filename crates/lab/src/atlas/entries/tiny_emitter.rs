//! Entry of the atlas: an emitter so small that walks hardly find it.

use exact::Exact;
use radiosity::{Birth, EstimatorKind, Method, SceneSpec, methods::birth_probabilities};
use report::{Axis, Chart, Series};
use stats::Measured;

use crate::arithmetic::{ratio, root};
use crate::atlas::entry::{Entry, StudyFinding};
use crate::claim::Claim;
use crate::judged_run::run;
use crate::lab::Lab;
use crate::series::SweepCurve;
use crate::walking::{Failure, experiment, squared_error};
use report::words::measured;

pub(crate) const ENTRY: Entry =
    Entry { name: "tiny-emitter", title: "A tiny emitter: gathering walks hardly ever find it", study };

/// The patch of the ceiling.
const CEILING: usize = 3;

/// A cube whose emitter has the part `part` of the area, with equal power for any area.
fn scene(part: f64) -> SceneSpec {
    let mut spec = scenes::cube_with_tile((6.0 * part).sqrt(), 0.5);
    spec.surfaces[0].emittance = (1.0 / (6.0 * part)).into();
    spec
}

/// The sweep over areas of the emitter.
struct TinyEmitterSweep {
    walks: u64,
    gathered: SweepCurve,
    shot: Vec<(f64, Measured)>,
    claims: Vec<Claim>,
}

impl TinyEmitterSweep {
    fn drive(lab: &Lab) -> Result<Self, Failure> {
        let parts = lab.pick(vec![1e-2, 1e-4, 1e-8], vec![1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8]);
        let (runs, walks) = lab.pick((200, 20_000), (400, 50_000));
        let mut sweep =
            TinyEmitterSweep { walks, gathered: SweepCurve::new(), shot: Vec::new(), claims: Vec::new() };
        for part in parts {
            let spec = scene(part);
            let exact = Exact::of_scene(&spec)?;
            let truth = &exact.solution().radiosity;
            let gathers = experiment(&spec, Method::gathering(Birth::Area, EstimatorKind::Collision))?;
            let born = birth_probabilities(gathers.scene(), &Birth::Area);
            let variance = exact.gathering_variances(EstimatorKind::Collision, &born)[CEILING];
            let predicted =
                variance.ok_or("walks are born on the ceiling")? / (walks as f64 * truth[CEILING].powi(2));
            let by_gathering = squared_error(lab, runs, &gathers, walks, &[CEILING], truth);
            let shoots = experiment(&spec, Method::shooting(EstimatorKind::Collision))?;
            sweep.gathered.push(part, predicted.sqrt(), root(by_gathering));
            sweep.shot.push((part, root(squared_error(lab, runs, &shoots, walks, &[CEILING], truth))));
            if predicted < 0.05 {
                let what = format!("{part:e} of the area: squared error over theory");
                sweep.claims.push(Claim::equal(what, ratio(by_gathering, predicted), 1.0));
            }
        }
        Ok(sweep)
    }

    fn chart(self) -> Chart {
        let [line, gathered] = self.gathered.series("gathering, S97 table 3", "gathering, seen");
        Chart {
            title: format!("Errors of {} walks from and to an emitter of 1 W", self.walks),
            x: Axis::log("area of the emitter over that of the scene"),
            y: Axis::log("rms relative error of B of the ceiling"),
            series: vec![line, gathered, Series::measured("shooting, seen", self.shot)],
        }
    }
}

fn study(lab: &Lab) -> Result<StudyFinding, Failure> {
    let sweep = TinyEmitterSweep::drive(lab)?;
    let (walks, mut claims) = (sweep.walks, sweep.claims.clone());
    let tiniest = experiment(&scene(1e-8), Method::gathering(Birth::Area, EstimatorKind::Collision))?;
    let messages = run(&tiniest, 1, walks, None).messages();
    claims.push(Claim::messages(&messages, "about as rarely met"));
    claims.push(Claim::messages(&messages, "`unhit`"));
    let [first, last] = [sweep.shot[0].1, sweep.shot[sweep.shot.len() - 1].1];
    let what = "error of shooting at the tiniest, twice that at the largest";
    claims.push(Claim::below(what, last, 2.0 * first.value).instead());
    Ok(StudyFinding {
        predicted: "A gathering walk meets an emitter in proportion to its area, and scores its exitance, which for \
                    given power is the larger: variance (R_i/p_i)Σ_s(E_s + 2b_s)b_is − b_i² (S97 table 3) ∝ 1/A_s. \
                    Shooting starts at the emitter: its variance does not know how large that is."
            .into(),
        seen: format!(
            "The rms relative error of the ceiling after {walks} walks, of which a sixth are born there, grows from {} \
             at 10⁻² of the area to {}, nothing being found, at 10⁻⁸.",
            measured(sweep.gathered.seen_at(0)),
            measured(sweep.gathered.last())
        ),
        messages,
        instead: format!(
            "Shoot: walk = \"shooting\" errs by {} at 10⁻² and by {} at 10⁻⁸.",
            measured(first),
            measured(last)
        ),
        claims,
        chart: sweep.chart(),
    })
}
