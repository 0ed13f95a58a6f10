//! Areas of very unequal size: what Sh91 assumes away.

use exact::Exact;
use radiosity::{Birth, EstimatorKind, Method, SceneSpec};
use report::{Axis, Chart};
use stats::Measured;

use crate::arithmetic::{ratio, root};
use crate::atlas::entry::{Entry, Finding};
use crate::claim::Claim;
use crate::lab::Lab;
use crate::numbers::{measured, number};
use crate::series::{seen, theory};
use crate::told::run;
use crate::walking::{Failure, coverage, experiment, squared_error};

pub const ENTRY: Entry = Entry {
    name: "area-ratios",
    title: "Area ratios down to 10⁻⁸: walks that are shot miss the small patch",
    study,
};

/// The floor's corner patch.
const TILE: usize = 0;

/// Its part of the area of all decides how large it is; the ceiling emits.
fn scene(part: f64) -> SceneSpec {
    let mut spec = scenes::cube_with_tile((6.0 * part).sqrt(), 0.5);
    spec.surfaces[3].emittance = 1.0.into();
    spec
}

fn study(lab: &Lab) -> Result<Finding, Failure> {
    let sweep = lab.pick(vec![1e-2, 1e-4, 1e-8], vec![1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8]);
    let (runs, walks) = lab.pick((200, 20_000), (400, 50_000));
    let (mut line, mut shot, mut gathered, mut covers) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut claims = Vec::new();
    for &part in &sweep {
        let spec = scene(part);
        let exact = Exact::of_scene(&spec)?;
        let truth = &exact.solution().radiosity;
        let variance = exact.shooting_variances(EstimatorKind::Collision)[TILE] / walks as f64;
        let predicted = variance.sqrt() / truth[TILE];
        let shoots = experiment(&spec, Method::shooting(EstimatorKind::Collision))?;
        let gathers = experiment(
            &spec,
            Method::gathering(Birth::Patches(vec![TILE as u32]), EstimatorKind::Collision),
        )?;
        let of = |experiment| squared_error(lab, runs, experiment, walks, &[TILE], truth);
        let squared = of(&shoots);
        line.push((part, predicted));
        shot.push((part, root(squared)));
        gathered.push((part, root(of(&gathers))));
        let rate = coverage(lab, runs, &shoots, walks, &[TILE], truth);
        claims.push(Claim::at_least(
            format!("{part:e} of the area: coverage of shooting's intervals"),
            rate,
            0.95,
        ));
        covers.push(rate);
        if predicted < 1.0 {
            let over = ratio(squared, predicted * predicted);
            claims.push(Claim::equal(format!("{part:e} of the area: squared error over theory"), over, 1.0));
        }
    }
    let told =
        run(&experiment(&scene(1e-8), Method::shooting(EstimatorKind::Collision))?, 1, walks, None).told();
    claims.push(Claim::told(&told, "`unhit`"));
    claims.push(Claim::told(&told, "about as rarely hit"));
    let [largest, smallest] = [gathered[0].1, gathered[gathered.len() - 1].1];
    claims.push(
        Claim::below(
            "relative error of gathering at the smallest, twice that at the largest",
            smallest,
            2.0 * largest.value,
        )
        .instead(),
    );
    let smallest_shot = shot[shot.len() - 1].1;
    Ok(Finding {
        predicted: "Sh91's linear time assumes area ratios that are bounded; S97's bound N ≥ V⁻¹A_min⁻¹… has the \
                    smallest area in it. Shooting hits a patch φ_i/Φ_T times a walk, in proportion to A_i, so that \
                    the relative error grows as A_i^(−1/2); once no walk hits, B̂ = E and the error is 1."
            .into(),
        seen: format!(
            "With {walks} walks into a cube whose floor has one small patch, its relative error is {} at 10⁻⁸ of the \
             area; its interval still covers in {} of runs, being an upper bound where nothing hit.",
            measured(smallest_shot),
            measured(covers[covers.len() - 1])
        ),
        told,
        instead: format!(
            "Let walks start there: walk = \"gathering\", birth = {{ patches = [{TILE}] }}. Its error with as many \
             walks is {} at 10⁻⁸ and {} at 10⁻²: {} times less than shooting's, whatever the size.",
            measured(smallest),
            measured(largest),
            number(smallest_shot.value / smallest.value)
        ),
        claims,
        chart: Chart {
            title: format!("Error of a small patch after {walks} walks"),
            x: Axis::log("area of the patch over that of the scene"),
            y: Axis::log("rms relative error of B"),
            series: vec![
                theory("shooting, S97 table 3", line),
                seen("shooting, seen", shot),
                seen("gathering from the patch", gathered),
                seen("coverage of shooting's 95 % intervals", covers.iter().zip(&sweep).map(coverage_at)),
            ],
        },
    })
}

fn coverage_at((rate, part): (&Measured, &f64)) -> (f64, Measured) {
    (*part, *rate)
}
