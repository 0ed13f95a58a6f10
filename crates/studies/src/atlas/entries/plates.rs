//! Near-coincident plates.

use exact::Exact;
use radiosity::{EstimatorKind, Method};
use report::{Axis, Chart};
use stats::Measured;

use crate::atlas::entry::{Entry, Finding};
use crate::claim::{Claim, Judge};
use crate::lab::Lab;
use crate::numbers::{measured, number};
use crate::series::{seen, theory};
use crate::told::run;
use crate::walking::{Failure, estimate, experiment, solve};

pub const ENTRY: Entry =
    Entry { name: "near-plates", title: "Plates that nearly coincide: gaps from 1 m to 10⁻¹⁶ m", study };

const REFLECTANCE: f64 = 0.5;

/// The plate that does not emit.
const DARK: usize = 1;

fn study(lab: &Lab) -> Result<Finding, Failure> {
    let all = vec![1.0, 0.1, 1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-13, 1e-14, 1e-15, 1e-16];
    let sweep = lab.pick(vec![1.0, 1e-3, 1e-10, 1e-15], all);
    let (runs, walks) = lab.pick((20, 20_000), (100, 200_000));
    // B₂ = R₂E₁/(1 − R₁R₂) between infinite plates.
    let infinite = REFLECTANCE / (1.0 - REFLECTANCE * REFLECTANCE);
    let (mut line, mut marks, mut told) = (Vec::new(), Vec::new(), Vec::new());
    let mut claims = Vec::new();
    let mut least = 1.0;
    for &gap in &sweep {
        let spec = scenes::plates(gap, REFLECTANCE);
        // Closed forms of facing squares lose digits below this, and differ from infinite plates by less than it.
        let truth = if gap >= 1e-6 { Exact::of_scene(&spec)?.solution().radiosity[DARK] } else { infinite };
        let experiment = experiment(&spec, Method::shooting(EstimatorKind::Collision))?;
        let found = lab.each_seed(runs, |seed| estimate(&solve(&experiment, seed, walks), DARK).radiosity);
        let found = Measured::of(&found);
        line.push((gap, truth));
        marks.push((gap, found));
        let right = Claim::equal(format!("{gap:e} m: B of the second plate"), found, truth);
        if Judge::EACH.passes(&right) {
            claims.push(right);
            least = gap;
            continue;
        }
        let words = run(&experiment, 1, walks, None).told();
        let said = words.iter().any(|line| line.contains("left the scene"));
        claims.push(Claim::sure(
            format!("{gap:e} m: B is {}, and the program says why", measured(found)),
            said,
        ));
        if told.is_empty() {
            told = words.iter().map(|line| format!("at {gap:e} m: {line}")).collect();
        }
    }
    claims.push(Claim::sure(format!("gaps down to {least:e} m are resolved"), least <= 1e-10));
    let doubled = {
        let mut spec = scenes::plates(1.0, REFLECTANCE);
        spec.surfaces.push(spec.surfaces[DARK].clone());
        experiment(&spec, Method::shooting(EstimatorKind::Collision))?
    };
    let words = run(&doubled, 1, walks, None).told();
    told.extend(words.iter().map(|line| format!("of a plate that is there twice: {line}")));
    claims.push(Claim::told(&told, "`unhit`"));
    let once = experiment(&scenes::plates(1.0, REFLECTANCE), Method::shooting(EstimatorKind::Collision))?;
    let once = run(&once, 1, walks, None);
    claims.push(Claim::sure("without the double every patch is hit", !once.fails("unhit")).instead());
    Ok(Finding {
        predicted: format!(
            "As the gap h closes, F → 1 − O(h ln 1/h) and B₂ → R₂E₁/(1 − R₁R₂) = {}. A start within the slack (2⁻⁴⁶ of the \
             largest coordinate, 1.4·10⁻¹⁴ m here) of a plane counts as on it, and meets it at once if it goes against \
             its front: plates that face each other exchange all light even where rounding makes them one plane. \
             Of two that lie on each other and face the same way the first takes all.",
            number(infinite)
        ),
        seen: format!(
            "B₂ agrees down to a gap of {} m. A plate that is there twice is hit once: its double is in the dark.",
            number(least)
        ),
        told,
        instead: "Remove what is there twice: the patches that are flagged `unhit` in patches.csv are the ones. Plates \
                  that face each other need no care."
            .into(),
        claims,
        chart: Chart {
            title: "Two unit plates that face each other, R = 0.5".into(),
            x: Axis::log("gap [m]"),
            y: Axis::linear("B of the plate that does not emit [W/m²]"),
            series: vec![theory("exact, and infinite plates below 10⁻⁶ m", line), seen("seen", marks)],
        },
    })
}
