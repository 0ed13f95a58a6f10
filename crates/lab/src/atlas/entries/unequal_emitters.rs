//! Entry of the atlas: emitters of unequal power, of which the dim one sends hardly any walks.

use exact::Exact;
use radiosity::{Birth, EstimatorKind, Method};
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
    Entry { name: "unequal-emitters", title: "Emitters of unequal power: the dim one gets few walks", study };

/// The ceiling of the dim room.
const DIM: usize = 7;

/// The sweep over powers of the dim lamp.
struct UnequalEmittersSweep {
    walks: u64,
    shot: SweepCurve,
    gathered: Vec<(f64, Measured)>,
    claims: Vec<Claim>,
}

impl UnequalEmittersSweep {
    fn drive(lab: &Lab) -> Result<Self, Failure> {
        let powers = lab.pick(vec![1.0, 1e-2, 1e-12], vec![1.0, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-12]);
        let (runs, walks) = lab.pick((100, 20_000), (200, 100_000));
        let mut sweep =
            UnequalEmittersSweep { walks, shot: SweepCurve::new(), gathered: Vec::new(), claims: Vec::new() };
        for dim in powers {
            let spec = scenes::unequal_rooms(dim);
            let exact = Exact::of_scene(&spec)?;
            let truth = &exact.solution().radiosity;
            let variance = exact.shooting_variances(EstimatorKind::Collision)[DIM];
            let predicted = variance / (walks as f64 * truth[DIM].powi(2));
            let of = |method| -> Result<Measured, Failure> {
                Ok(squared_error(lab, runs, &experiment(&spec, method)?, walks, &[DIM], truth))
            };
            let by_shooting = of(Method::shooting(EstimatorKind::Collision))?;
            sweep.shot.push(dim, predicted.sqrt(), root(by_shooting));
            let by_gathering = of(Method::gathering(Birth::Area, EstimatorKind::Collision))?;
            sweep.gathered.push((dim, root(by_gathering)));
            if predicted < 0.05 {
                let what = format!("{dim:e} of the power: squared error over theory");
                sweep.claims.push(Claim::equal(&what, ratio(by_shooting, predicted), 1.0));
            }
        }
        Ok(sweep)
    }

    /// The power of the dimmest lamp.
    fn dimmest(&self) -> f64 {
        self.gathered[self.gathered.len() - 1].0
    }

    fn chart(self) -> Chart {
        let [line, shot] = self.shot.series("shooting, S97 table 3", "shooting, seen");
        Chart {
            title: format!("Two rooms apart: the dimmer after {} walks", self.walks),
            x: Axis::log("power of the dim lamp over that of the other"),
            y: Axis::log("rms relative error of its ceiling"),
            series: vec![line, shot, Series::measured("gathering, seen", self.gathered)],
        }
    }
}

fn study(lab: &Lab) -> Result<StudyFinding, Failure> {
    let sweep = UnequalEmittersSweep::drive(lab)?;
    let (walks, mut claims) = (sweep.walks, sweep.claims.clone());
    let spec = scenes::unequal_rooms(1e-12);
    let messages =
        run(&experiment(&spec, Method::shooting(EstimatorKind::Collision))?, 1, walks, None).messages();
    claims.push(Claim::messages(&messages, "`unhit`"));
    let [first, last] = [sweep.gathered[0].1, sweep.gathered[sweep.gathered.len() - 1].1];
    let what = "error of gathering at the dimmest, twice that of equals";
    claims.push(Claim::below(what, last, 2.0 * first.value).instead());
    let dimmest = sweep.dimmest();
    Ok(StudyFinding {
        predicted: "Shooting chooses emitters by power: of two rooms whose lamps have the powers 1 and ε, the dim one \
                    gets εN of N walks, and errs by 1/√(εN) (b[(R_iΦ_T/A_i)(1 + 2R_iξ_i) − b], S97 table 3, with \
                    the power Φ_T of both)."
            .into(),
        seen: format!(
            "After {walks} walks the ceiling of the dim room errs by {} for ε = 1 and by {} for ε = {dimmest:e}, where no \
             walk was born in it.",
            measured(sweep.shot.seen_at(0)),
            measured(sweep.shot.last())
        ),
        messages,
        instead: format!(
            "Gather: walk = \"gathering\". Walks are born in both rooms alike, and the light of the dim lamp is rounded at random, so that \
             none is lost: the error is {} for ε = 1 and {} for ε = {dimmest:e}.",
            measured(first),
            measured(last)
        ),
        claims,
        chart: sweep.chart(),
    })
}
