//! Entries of the atlas: R → 1, walks that take 1/(1 − R) rays, in one room and in two that hardly exchange light.

use std::sync::Arc;

use exact::Exact;
use radiosity::{EstimatorKind, Method, SceneSpec};
use report::{Axis, Chart, Series};
use stats::Measured;

use super::absorption;
use crate::arithmetic::{ratio, root};
use crate::atlas::entry::{Entry, StudyFinding};
use crate::claim::Claim;
use crate::judged_run::run;
use crate::lab::Lab;
use crate::series::SweepCurve;
use crate::walking::{Failure, experiment, receivers, squared_error};
use report::words::{measured, number};

pub(crate) const ONE_ROOM: Entry = Entry {
    name: "long-walks",
    title: "R → 1: the scores of a long walk depend on each other",
    study: |lab| {
        LongWalkRoom {
            scene: absorption::scene,
            what: "In the 54-patch cube",
            theory: "The recurrent potential ξ_i, what returns to a patch of a unit of power that it sends out, tends \
                     to A_i/(A_T(1 − R)), so that the variance of collision shooting for one walk, \
                     b[(R_iΦ_T/A_i)(1 + 2R_iξ_i) − b] (S97 table 3), tends to b²: a walk tells as much as one number, \
                     and takes 1/(1 − R) rays. For equal rays the squared error grows as 1/(1 − R). Chains solve a \
                     system in which only differences of B go along links, and these fade as R → 1.",
            title: "R → 1 in the 54-patch cube",
        }
        .study(lab)
    },
};

pub(crate) const TWO_ROOMS: Entry = Entry {
    name: "two-rooms",
    title: "R → 1 in two rooms that exchange 1 %",
    study: |lab| {
        LongWalkRoom {
            scene: |reflectance| scenes::two_rooms(0.1, reflectance),
            what: "In two rooms with a hole of 1 % between them",
            theory: "As long as walks die before they find the hole (R = 0.9), the room without a lamp is a matter of \
                     rare walks; near R = 1 each walk has been everywhere, and they err as in one room. BS's \
                     iterations carry an error from each to the next, through the hole as slowly as light \
                     does; chains that solve the system of their links do not iterate over rays.",
            title: "R → 1 in two rooms",
        }
        .study(lab)
    },
};

struct LongWalkRoom {
    scene: fn(f64) -> SceneSpec,
    what: &'static str,
    theory: &'static str,
    title: &'static str,
}

/// The sweep over reflectances, from equal rays.
struct LongWalksSweep {
    rays: u64,
    reflectances: Vec<f64>,
    walked: SweepCurve,
    chained: Vec<(f64, Measured)>,
    claims: Vec<Claim>,
}

impl LongWalksSweep {
    fn drive(lab: &Lab, scene: fn(f64) -> SceneSpec) -> Result<Self, Failure> {
        let reflectances = lab.pick(vec![0.9, 0.999], vec![0.9, 0.99, 0.999, 0.9999]);
        let (runs, rays) = lab.pick((60, 1_u64 << 14), (200, 1 << 17));
        let exact = Exact::of_scene(&scene(0.5))?;
        let exchange = Arc::new(exact.exchange().clone());
        let (walked, chained, claims) = Default::default();
        let mut sweep = LongWalksSweep { rays, reflectances, walked, chained, claims };
        for reflectance in sweep.reflectances.clone() {
            let spec = scene(reflectance);
            let all = vec![reflectance; exact.face_count()];
            let exact = Exact::new(exchange.clone(), all, exact.emittance().to_vec())?;
            let truth = &exact.solution().radiosity;
            let walks = experiment(&spec, Method::shooting(EstimatorKind::Collision))?;
            let patches = receivers(&walks);
            let n = (rays as f64 * (1.0 - reflectance)) as u64;
            let variances = exact.shooting_variances(EstimatorKind::Collision);
            let relative = patches.iter().map(|&i| variances[i] / (truth[i] * truth[i])).sum::<f64>();
            let predicted = relative / (patches.len() as f64 * n as f64);
            let by_walks = squared_error(lab, runs, &walks, n, &patches, truth);
            let eight = experiment(&spec, Method::chains(rays / 8))?;
            let by_chains = squared_error(lab, runs, &eight, 8, &patches, truth);
            let what = format!("R = {reflectance}: squared error of walks over theory");
            sweep.claims.push(Claim::equal(&what, ratio(by_walks, predicted), 1.0));
            sweep.walked.push(1.0 - reflectance, predicted.sqrt(), root(by_walks));
            sweep.chained.push((1.0 - reflectance, root(by_chains)));
        }
        Ok(sweep)
    }

    fn chart(self, title: &str) -> Chart {
        let [line, walked] = self.walked.series("walks, S97 table 3", "walks, seen");
        Chart {
            title: format!("{title}: errors of {} rays", self.rays),
            x: Axis::log("1 − R"),
            y: Axis::log("rms relative error of B"),
            series: vec![line, walked, Series::measured("eight chains", self.chained)],
        }
    }
}

impl LongWalkRoom {
    fn study(self, lab: &Lab) -> Result<StudyFinding, Failure> {
        let sweep = LongWalksSweep::drive(lab, self.scene)?;
        let (rays, mut claims) = (sweep.rays, sweep.claims.clone());
        let last = sweep.reflectances.len() - 1;
        let (first, brightest) = (sweep.reflectances[0], sweep.reflectances[last]);
        let (walks, chain) = (sweep.walked.last(), sweep.chained[last].1);
        let what = "error of chains at the brightest, half that of walks";
        claims.push(Claim::below(what, chain, 0.5 * walks.value).instead());
        let bright = experiment(&(self.scene)(0.999), Method::shooting(EstimatorKind::Collision))?;
        let messages = run(&bright, 1, 20, None).messages();
        claims.push(Claim::messages(&messages, "a walk may take 1000 rays"));
        Ok(StudyFinding {
            predicted: self.theory.into(),
            seen: format!(
                "{} the rms relative error of {rays} rays is {} by walks at R = {first}, {} at R = {brightest}.",
                self.what,
                measured(sweep.walked.seen_at(0)),
                measured(walks)
            ),
            messages,
            instead: format!(
                "walk = \"jacobi\": {} at R = {first} and {} at R = {brightest}, from as many rays: {} times less.",
                measured(sweep.chained[0].1),
                measured(chain),
                number(walks.value / chain.value)
            ),
            claims,
            chart: sweep.chart(self.title),
        })
    }
}
