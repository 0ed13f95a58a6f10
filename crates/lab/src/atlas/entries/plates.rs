//! Entry of the atlas: plates that nearly coincide.

use exact::Exact;
use radiosity::{EstimatorKind, Method};
use report::{Axis, Chart};
use stats::Measured;

use crate::atlas::entry::{Entry, StudyFinding};
use crate::claim::{Claim, ClaimJudge};
use crate::judged_run::run;
use crate::lab::Lab;
use crate::series::SweepCurve;
use crate::walking::{Failure, estimate, experiment, solve};
use report::words::{measured, number};

pub(crate) const ENTRY: Entry =
    Entry { name: "near-plates", title: "Plates that nearly coincide: gaps from 1 m to 10⁻¹⁶ m", study };

const REFLECTANCE: f64 = 0.5;

/// B₂ = R₂E₁/(1 − R₁R₂) between infinite plates, with E₁ = 1 [W/m²].
const INFINITE: f64 = REFLECTANCE / (1.0 - REFLECTANCE * REFLECTANCE);

/// The plate that does not emit.
const DARK: usize = 1;

/// The sweep over gaps between the plates.
struct PlatesSweep {
    walks: u64,
    curve: SweepCurve,
    /// The least gap at which B is right [m].
    least: f64,
    /// The program's words where B is wrong.
    messages: Vec<String>,
    claims: Vec<Claim>,
}

impl PlatesSweep {
    fn drive(lab: &Lab) -> Result<Self, Failure> {
        let all = vec![1.0, 0.1, 1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-13, 1e-14, 1e-15, 1e-16];
        let gaps = lab.pick(vec![1.0, 1e-3, 1e-10, 1e-15], all);
        let (runs, walks) = lab.pick((20, 20_000), (100, 200_000));
        let mut sweep = PlatesSweep {
            walks,
            curve: SweepCurve::new(),
            least: 1.0,
            messages: Vec::new(),
            claims: Vec::new(),
        };
        for gap in gaps {
            sweep.at(lab, gap, runs)?;
        }
        let least = sweep.least;
        sweep.claims.push(Claim::sure(format!("gaps down to {least:e} m are resolved"), least <= 1e-10));
        Ok(sweep)
    }

    fn at(&mut self, lab: &Lab, gap: f64, runs: u64) -> Result<(), Failure> {
        let (spec, walks) = (scenes::plates(gap, REFLECTANCE), self.walks);
        // The closed forms of facing squares lose digits below this gap, and differ from infinite plates by less than
        // it.
        let truth = if gap >= 1e-6 { Exact::of_scene(&spec)?.solution().radiosity[DARK] } else { INFINITE };
        let experiment = experiment(&spec, Method::shooting(EstimatorKind::Collision))?;
        let found = lab.each_seed(runs, |seed| estimate(&solve(&experiment, seed, walks), DARK).radiosity);
        let found = Measured::of(&found);
        self.curve.push(gap, truth, found);
        let right = Claim::equal(format!("{gap:e} m: B of the second plate"), found, truth);
        if ClaimJudge::EACH.passes(&right) {
            self.claims.push(right);
            self.least = gap;
            return Ok(());
        }
        let words = run(&experiment, 1, walks, None).messages();
        let said = words.iter().any(|line| line.contains("left the scene"));
        let what = format!("{gap:e} m: B is {}, and the program says why", measured(found));
        self.claims.push(Claim::sure(what, said));
        if self.messages.is_empty() {
            self.messages = words.iter().map(|line| format!("at {gap:e} m: {line}")).collect();
        }
        Ok(())
    }

    fn chart(self) -> Chart {
        Chart {
            title: "Two unit plates that face each other, R = 0.5".into(),
            x: Axis::log("gap [m]"),
            y: Axis::linear("B of the plate that does not emit [W/m²]"),
            series: self.curve.series("exact, and infinite plates below 10⁻⁶ m", "seen").into(),
        }
    }
}

fn study(lab: &Lab) -> Result<StudyFinding, Failure> {
    let sweep = PlatesSweep::drive(lab)?;
    let (walks, least) = (sweep.walks, sweep.least);
    let (mut claims, mut messages) = (sweep.claims.clone(), sweep.messages.clone());
    let mut twice = scenes::plates(1.0, REFLECTANCE);
    twice.surfaces.push(twice.surfaces[DARK].clone());
    let doubled = experiment(&twice, Method::shooting(EstimatorKind::Collision))?;
    let words = run(&doubled, 1, walks, None).messages();
    messages.extend(words.iter().map(|line| format!("of a plate that is there twice: {line}")));
    claims.push(Claim::messages(&messages, "is sealed"));
    let once = experiment(&scenes::plates(1.0, REFLECTANCE), Method::shooting(EstimatorKind::Collision))?;
    let once = run(&once, 1, walks, None);
    claims.push(
        Claim::sure(
            "without the double no patch is sealed",
            !once.messages().iter().any(|line| line.contains("is sealed")),
        )
        .instead(),
    );
    Ok(StudyFinding {
        predicted: format!(
            "As the gap h closes, F → 1 − O(h ln 1/h) and B₂ → R₂E₁/(1 − R₁R₂) = {}. Planes within the slack (2⁻⁴⁶ of the \
             largest coordinate, 1.4·10⁻¹⁴ m here) are one plane, whose surfaces are layers in a fixed order with the \
             fronts outermost: plates that face each other then turn their backs to each other, and exchange nothing. \
             Of two that lie on each other and face the same way the first takes all.",
            number(INFINITE)
        ),
        seen: format!(
            "B₂ agrees down to a gap of {} m; where the plates are one plane, B₂ is 0. A plate that is there twice is hit \
             once: its double is in the dark.",
            number(least)
        ),
        messages,
        instead: "Remove what is there twice: `radwalk check` names the pairs. Leave a gap of more than the slack between \
                  plates that face each other."
            .into(),
        claims,
        chart: sweep.chart(),
    })
}
