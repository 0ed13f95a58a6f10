//! Entry of the atlas: areas of very unequal size, which Sh91 assumes away.

use exact::Exact;
use radiosity::{Birth, EstimatorKind, Method, SceneSpec};
use report::{Axis, Chart, Series};
use stats::Measured;

use crate::arithmetic::{ratio, root};
use crate::atlas::entry::{Entry, StudyFinding};
use crate::claim::Claim;
use crate::judged_run::run;
use crate::lab::Lab;
use crate::series::SweepCurve;
use crate::walking::{Failure, coverage, experiment, squared_error};
use report::words::{measured, number};

pub(crate) const ENTRY: Entry = Entry {
    name: "area-ratios",
    title: "Area ratios down to 10⁻⁸: shooting walks miss the small patch",
    study,
};

/// The patch in the floor's corner.
const TILE: usize = 0;

/// The cube whose floor patch has the part `part` of all area; the ceiling emits.
fn scene(part: f64) -> SceneSpec {
    let mut spec = scenes::cube_with_tile((6.0 * part).sqrt(), 0.5);
    spec.surfaces[3].emittance = 1.0.into();
    spec
}

/// The sweep over sizes of the small patch.
struct AreaRatiosSweep {
    walks: u64,
    parts: Vec<f64>,
    shot: SweepCurve,
    gathered: Vec<(f64, Measured)>,
    /// The coverage of the intervals of shooting.
    covers: Vec<(f64, Measured)>,
    claims: Vec<Claim>,
}

impl AreaRatiosSweep {
    fn drive(lab: &Lab) -> Result<Self, Failure> {
        let parts = lab.pick(vec![1e-2, 1e-4, 1e-8], vec![1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8]);
        let (runs, walks) = lab.pick((200, 20_000), (400, 50_000));
        let (shot, gathered, covers, claims) = Default::default();
        let mut sweep = AreaRatiosSweep { walks, parts, shot, gathered, covers, claims };
        for part in sweep.parts.clone() {
            sweep.at(lab, part, runs)?;
        }
        Ok(sweep)
    }

    fn at(&mut self, lab: &Lab, part: f64, runs: u64) -> Result<(), Failure> {
        let (walks, spec) = (self.walks, scene(part));
        let exact = Exact::of_scene(&spec)?;
        let truth = &exact.solution().radiosity;
        let variance = exact.shooting_variances(EstimatorKind::Collision)[TILE] / walks as f64;
        let predicted = variance.sqrt() / truth[TILE];
        let shoots = experiment(&spec, Method::shooting(EstimatorKind::Collision))?;
        let born = Birth::Patches(vec![TILE as u32]);
        let gathers = experiment(&spec, Method::gathering(born, EstimatorKind::Collision))?;
        let of = |experiment| squared_error(lab, runs, experiment, walks, &[TILE], truth);
        let squared = of(&shoots);
        self.shot.push(part, predicted, root(squared));
        self.gathered.push((part, root(of(&gathers))));
        let rate = coverage(lab, runs, &shoots, walks, &[TILE], truth);
        let what = format!("{part:e} of the area: coverage of shooting's intervals");
        self.claims.push(Claim::at_least(what, rate, 0.95));
        self.covers.push((part, rate));
        if predicted < 1.0 {
            let over = ratio(squared, predicted * predicted);
            let what = format!("{part:e} of the area: squared error over theory");
            self.claims.push(Claim::equal(what, over, 1.0));
        }
        Ok(())
    }

    fn chart(self) -> Chart {
        let [line, shot] = self.shot.series("shooting, S97 table 3", "shooting, seen");
        Chart {
            title: format!("Error of a small patch after {} walks", self.walks),
            x: Axis::log("area of the patch over that of the scene"),
            y: Axis::log("rms relative error of B"),
            series: vec![
                line,
                shot,
                Series::measured("gathering from the patch", self.gathered),
                Series::measured("coverage of shooting's 95 % intervals", self.covers),
            ],
        }
    }
}

fn study(lab: &Lab) -> Result<StudyFinding, Failure> {
    let sweep = AreaRatiosSweep::drive(lab)?;
    let (walks, mut claims) = (sweep.walks, sweep.claims.clone());
    let smallest_of_all = experiment(&scene(1e-8), Method::shooting(EstimatorKind::Collision))?;
    let messages = run(&smallest_of_all, 1, walks, None).messages();
    claims.push(Claim::messages(&messages, "`unhit`"));
    claims.push(Claim::messages(&messages, "about as rarely hit"));
    let last = sweep.parts.len() - 1;
    let [largest, smallest] = [0, last].map(|point| sweep.gathered[point].1);
    let what = "relative error of gathering at the smallest, twice that at the largest";
    claims.push(Claim::below(what, smallest, 2.0 * largest.value).instead());
    let smallest_shot = sweep.shot.last();
    Ok(StudyFinding {
        predicted: "Sh91's linear time assumes area ratios that are bounded; S97's bound N ≥ V⁻¹A_min⁻¹… has the \
                    smallest area in it. Shooting hits a patch φ_i/Φ_T times a walk, in proportion to A_i, so that \
                    the relative error grows as A_i^(−1/2); once no walk hits, B̂ = E and the error is 1."
            .into(),
        seen: format!(
            "With {walks} walks into a cube whose floor has one small patch, its relative error is {} at 10⁻⁸ of the \
             area; its interval still covers in {} of runs, being an upper bound where nothing hit.",
            measured(smallest_shot),
            measured(sweep.covers[last].1)
        ),
        messages,
        instead: format!(
            "Let walks start there: walk = \"gathering\", birth = {{ patches = [{TILE}] }}. Its error with as many \
             walks is {} at 10⁻⁸ and {} at 10⁻²: {} times less than shooting's, whatever the size.",
            measured(smallest),
            measured(largest),
            number(smallest_shot.value / smallest.value)
        ),
        claims,
        chart: sweep.chart(),
    })
}
