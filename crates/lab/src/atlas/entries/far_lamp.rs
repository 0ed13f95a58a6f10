//! Entry of the atlas: a lamp so far away that hardly any of its walks reach the scene.

use exact::Exact;
use radiosity::{EstimatorKind, Experiment, Method, SceneSpec};
use report::{Axis, Chart, Series};
use stats::Measured;

use crate::arithmetic::{ratio, root};
use crate::atlas::entry::{Entry, StudyFinding};
use crate::claim::Claim;
use crate::judged_run::run;
use crate::lab::Lab;
use crate::series::SweepCurve;
use crate::walking::{Failure, experiment, squared_error};
use report::words::{measured, number};

pub(crate) const ENTRY: Entry =
    Entry { name: "far-lamp", title: "A far lamp: most shooting walks miss the scene", study };

/// The patch in the middle of the floor.
const MIDDLE: usize = 4;

/// A lamp at a distance, with all lengths of the lamp times `scale`, and walks from it.
fn lamp(distance: f64, scale: f64) -> Result<(Exact, Experiment), Failure> {
    let spec: SceneSpec = scenes::far_lamp(distance, scale);
    Ok((Exact::of_scene(&spec)?, experiment(&spec, Method::shooting(EstimatorKind::Collision))?))
}

/// The sweep over distances of the lamp.
struct FarLampSweep {
    runs: u64,
    walks: u64,
    distances: Vec<f64>,
    curve: SweepCurve,
    claims: Vec<Claim>,
}

impl FarLampSweep {
    fn drive(lab: &Lab) -> Result<Self, Failure> {
        let distances = lab.pick(vec![1.0, 10.0, 1000.0], vec![1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0]);
        let (runs, walks) = lab.pick((100, 50_000), (100, 500_000));
        let (mut curve, mut claims) = (SweepCurve::new(), Vec::new());
        for &distance in &distances {
            let (exact, experiment) = lamp(distance, 1.0)?;
            let truth = &exact.solution().radiosity;
            let variance = exact.shooting_variances(EstimatorKind::Collision)[MIDDLE];
            let predicted = variance / (walks as f64 * truth[MIDDLE].powi(2));
            let squared = squared_error(lab, runs, &experiment, walks, &[MIDDLE], truth);
            curve.push(distance, predicted.sqrt(), root(squared));
            if predicted < 0.1 {
                let what = format!("{distance} m: squared error over theory");
                claims.push(Claim::equal(&what, ratio(squared, predicted), 1.0));
            }
        }
        Ok(FarLampSweep { runs, walks, distances, curve, claims })
    }

    fn chart(self, remedy: Measured) -> Chart {
        let [line, errors] = self.curve.series("S97 table 3", "seen");
        Chart {
            title: format!("A lamp of 0.1 m above a floor of 1 m: {} walks", self.walks),
            x: Axis::log("height of the lamp [m]"),
            y: Axis::log("rms relative error of the floor's middle"),
            series: vec![
                line,
                errors,
                Series::measured("remedy: as large in the sky, at 10 m", [(1000.0, remedy)]),
            ],
        }
    }
}

/// A lamp at 10 m that is as large in the sky as one at 1000 m: the factor in its light, and the error of its walks.
fn nearer(lab: &Lab, sweep: &FarLampSweep, truth: &[f64]) -> Result<(f64, Measured), Failure> {
    let (near, experiment) = lamp(1000.0, 0.01)?;
    let near_truth = &near.solution().radiosity;
    let off = near_truth[MIDDLE] / truth[MIDDLE] - 1.0;
    Ok((off, root(squared_error(lab, sweep.runs, &experiment, sweep.walks, &[MIDDLE], near_truth))))
}

fn study(lab: &Lab) -> Result<StudyFinding, Failure> {
    let sweep = FarLampSweep::drive(lab)?;
    let (walks, mut claims) = (sweep.walks, sweep.claims.clone());
    let (exact, experiment) = lamp(1000.0, 1.0)?;
    let messages = run(&experiment, 1, walks, None).messages();
    claims.push(Claim::messages(&messages, "a lamp that is smaller and nearer"));
    let (off, remedy) = nearer(lab, &sweep, &exact.solution().radiosity)?;
    let far_error = sweep.curve.last();
    let what = format!("the near lamp lights the floor as the far one does, to {}", number(off.abs()));
    claims.push(Claim::sure(what, off.abs() < 0.01).instead());
    claims.push(Claim::below("its error, half of the far one's", remedy, 0.5 * far_error.value).instead());
    Ok(StudyFinding {
        predicted: "Of the walks of a lamp at the distance d a part F ∝ 1/d² arrives; the rest leaves the scene. The \
                    relative error is 1/√(N·F_i), ∝ d. Gathering fares no better, since F is as small seen from the \
                    floor, times its area over that of the lamp."
            .into(),
        seen: format!(
            "After {walks} walks the rms relative error of the floor's middle is {} at {} m and {} at {} m.",
            measured(sweep.curve.seen_at(0)),
            sweep.distances[0],
            measured(far_error),
            sweep.distances[sweep.distances.len() - 1]
        ),
        messages,
        instead: format!(
            "Write a `quad` for the lamp that has the same exitance and looks as large from nearer by, which gives the \
             same light: at 10 m instead of 1000 m, and a hundredth as wide, the floor's middle differs by {} (exactly solved), and the error of as \
             many walks is {}.",
            number(off.abs()),
            measured(remedy)
        ),
        claims,
        chart: sweep.chart(remedy),
    })
}
