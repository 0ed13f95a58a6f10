//! Entries of the atlas: scenes that are not closed, and walls that face the wrong way.

use exact::Exact;
use radiosity::{EstimatorKind, Experiment, Method, SceneSpec, Shape, Sides, Solution};
use report::{Axis, Chart, Check};
use stats::Measured;

use crate::arithmetic::ratio;
use crate::atlas::entry::{Entry, StudyFinding};
use crate::claim::Claim;
use crate::judged_run::run;
use crate::lab::Lab;
use crate::series::SweepCurve;
use crate::walking::{CONFIDENCE, Failure, estimate, experiment, walk};
use report::words::{measured, number};

pub(crate) const OPEN: Entry =
    Entry { name: "open-scenes", title: "Open scenes, and gaps that were not meant to be", study: open };

pub(crate) const BACKS: Entry = Entry {
    name: "back-faces",
    title: "Back faces: walls that face the wrong way take all light",
    study: backs,
};

/// The number of runs, and the walks of each.
#[derive(Clone, Copy)]
struct SampleSize {
    runs: u64,
    walks: u64,
}

/// The part of walks that an ending took, over runs of different seeds.
fn part(
    lab: &Lab,
    spec: &SceneSpec,
    size: SampleSize,
    of: fn(&radiosity::Counts) -> u64,
) -> Result<Measured, Failure> {
    let SampleSize { runs, walks } = size;
    let experiment = experiment(spec, Method::shooting(EstimatorKind::Collision))?;
    let parts = lab.each_seed(runs, |seed| of(&walk(&experiment, seed, walks).counts) as f64 / walks as f64);
    Ok(proportion_of_walks(&parts, walks))
}

/// The mean part over runs; if no walk of any run ended so, the error is that of one walk in all.
fn proportion_of_walks(parts: &[f64], walks: u64) -> Measured {
    let measured = Measured::of(parts);
    let least = 1.0 / (parts.len() as f64 * walks as f64);
    Measured { standard_error: measured.standard_error.max(least), ..measured }
}

/// A unit cube, R = 0.5, whose ceiling leaves a gap of this width along a wall; a patch of the floor emits.
fn gap_in_the_ceiling(gap: f64) -> SceneSpec {
    let mut spec = scenes::cube(3);
    spec.surfaces.iter_mut().for_each(|surface| surface.reflectance = 0.5.into());
    if gap >= 1.0 {
        spec.surfaces.remove(1);
    } else if let Shape::Parallelogram { corner_v, .. } = &mut spec.surfaces[1].shape {
        // z = 1, u along y, v along x: x ends before the wall.
        corner_v.x -= gap;
    }
    spec
}

/// The sweep over widths of the gap.
struct Gaps {
    /// The number of runs, and the walks of each.
    size: SampleSize,
    curve: SweepCurve,
    claims: Vec<Claim>,
}

impl Gaps {
    fn drive(lab: &Lab) -> Result<Self, Failure> {
        let gaps = lab.pick(vec![1e-3, 1.0], vec![1e-5, 1e-4, 1e-3, 1e-2, 0.1, 0.3, 1.0]);
        let [runs, walks] = lab.pick([20, 50_000], [100, 300_000]);
        let size = SampleSize { runs, walks };
        let mut sweep = Gaps { size, curve: SweepCurve::new(), claims: Vec::new() };
        for gap in gaps {
            let spec = gap_in_the_ceiling(gap);
            let exact = Exact::of_scene(&spec)?;
            let absorbed =
                exact.solution().incoming.iter().zip(exact.reflectance()).map(|(phi, r)| (1.0 - r) * phi);
            let lost = 1.0 - absorbed.sum::<f64>() / exact.total_power();
            let found = part(lab, &spec, size, |counts| counts.escaped)?;
            let what = format!("a gap of {gap} m: part of the walks that escape");
            sweep.claims.push(Claim::equal(what, found, lost));
            sweep.curve.push(gap, lost, found);
        }
        Ok(sweep)
    }

    fn chart(self) -> Chart {
        Chart {
            title: "A cube with a gap in its ceiling, R = 0.5".into(),
            x: Axis::log("width of the gap [m]"),
            y: Axis::log("part of the walks that escape"),
            series: self.curve.series("exact", "seen").into(),
        }
    }
}

/// The words of the check `escape` about a gap.
fn said_of_a_gap(gap: f64, walks: u64) -> Result<Vec<String>, Failure> {
    let experiment = experiment(&gap_in_the_ceiling(gap), Method::shooting(EstimatorKind::Collision))?;
    let run = run(&experiment, 1, walks, None);
    let about = run.checks.iter().filter(|check| check.name == "escape");
    let line = |check: &Check| {
        let verdict = check.verdict.words();
        format!("a gap of {gap} m, check `escape`, {verdict}: {}", check.message)
    };
    Ok(about.map(line).collect())
}

fn open(lab: &Lab) -> Result<StudyFinding, Failure> {
    let sweep = Gaps::drive(lab)?;
    let (SampleSize { runs, walks }, mut claims) = (sweep.size, sweep.claims.clone());
    let closed = part(lab, &gap_in_the_ceiling(0.0), sweep.size, |counts| counts.escaped)?;
    claims.push(Claim::sure("none escapes where there is no gap", closed.value == 0.0).instead());
    let messages = [said_of_a_gap(1e-3, walks)?, said_of_a_gap(1.0, walks)?].concat();
    claims.push(Claim::messages(&messages, "if it is meant to be closed, it has a gap"));
    claims.push(Claim::messages(&messages, "passed"));
    let (narrowest, escaped) = sweep.curve.marks()[0];
    Ok(StudyFinding {
        predicted: "Walks that leave carry their power away: what escapes is Φ_T − Σ(1 − R_i)φ_i, by the exact \
                    solution. A wide opening is part of a scene; a crack between walls that were meant to meet is a \
                    mistake that darkens everything by about as much as it lets out, and no interval knows."
            .into(),
        seen: format!("Through a gap of {narrowest} m {} of the walks escape.", measured(escaped)),
        messages,
        instead: format!(
            "Close the gap: with the ceiling at full width {} of {} walks escape. Below 10⁻¹⁴ of the scene's size gaps \
             need no care: facets are made larger by as much.",
            number(closed.value),
            runs * walks
        ),
        claims,
        chart: sweep.chart(),
    })
}

/// The 54-patch cube with the last `walls` of its walls turned round; patches keep their places.
fn turned(walls: usize, sides: Sides) -> SceneSpec {
    let mut spec = scenes::cube(3);
    for surface in spec.surfaces.iter_mut().rev().take(walls) {
        surface.sides = sides;
        if let Shape::Parallelogram { corner_u, corner_v, .. } = &mut surface.shape {
            std::mem::swap(corner_u, corner_v);
        }
    }
    spec
}

/// The cube as the rest of it sees walls that are turned round: with black walls.
fn blackened(walls: usize) -> SceneSpec {
    let mut spec = scenes::cube(3);
    spec.surfaces.iter_mut().rev().take(walls).for_each(|surface| surface.reflectance = 0.0.into());
    spec
}

/// A wall that still faces inwards.
const PATCH: usize = 13;

/// The sweep over walls that are turned round.
struct Turned {
    /// The number of runs, and the walks of each.
    size: SampleSize,
    curve: SweepCurve,
    claims: Vec<Claim>,
}

impl Turned {
    fn drive(lab: &Lab) -> Result<Self, Failure> {
        let [runs, walks] = lab.pick([20, 50_000], [100, 500_000]);
        let size = SampleSize { runs, walks };
        let mut sweep = Turned { size, curve: SweepCurve::new(), claims: Vec::new() };
        for walls in lab.pick(vec![1, 3], vec![0, 1, 2, 3, 4]) {
            let black = Exact::of_scene(&blackened(walls))?;
            let first = 54 - 9 * walls;
            let taken = black.solution().incoming[first..].iter().sum::<f64>() / black.total_power();
            let spec = turned(walls, Sides::Front);
            let found = part(lab, &spec, size, |counts| counts.absorbed_back)?;
            let what = format!("{walls} walls: part of the walks that end on backs");
            sweep.claims.push(Claim::equal(what, found, taken));
            sweep.curve.push(walls as f64, taken, found);
        }
        Ok(sweep)
    }

    /// The part of the walks that end on one wall.
    fn of_one_wall(&self) -> Result<Measured, Failure> {
        let one = self.curve.marks().iter().find(|(walls, _)| *walls == 1.0);
        Ok(one.ok_or("the sweep has no point with one wall")?.1)
    }

    fn chart(self) -> Chart {
        Chart {
            title: "The 54-patch cube with walls turned round".into(),
            x: Axis::linear("walls turned round"),
            y: Axis::linear("part of the walks that end on backs"),
            series: self.curve.series("exact, those walls black", "seen").into(),
        }
    }
}

/// The mean B of [`PATCH`] over runs [W/m²].
fn radiosity(lab: &Lab, experiment: &Experiment, SampleSize { runs, walks }: SampleSize) -> Measured {
    Measured::of(&lab.each_seed(runs, |seed| {
        let solution = Solution::new(experiment, &walk(experiment, seed, walks), CONFIDENCE);
        estimate(&solution, PATCH).radiosity
    }))
}

fn backs(lab: &Lab) -> Result<StudyFinding, Failure> {
    let sweep = Turned::drive(lab)?;
    let (size, mut claims) = (sweep.size, sweep.claims.clone());
    // The patch is darker by the light that backs do not return.
    let wrong = experiment(&turned(1, Sides::Front), Method::shooting(EstimatorKind::Collision))?;
    let found = radiosity(lab, &wrong, size);
    let expected = Exact::of_scene(&blackened(1))?.solution().radiosity[PATCH];
    let meant = Exact::of_scene(&scenes::cube(3))?.solution().radiosity[PATCH];
    let what = "one wall: B of patch 13 over that of black walls";
    claims.push(Claim::equal(what, ratio(found, expected), 1.0));
    claims.push(Claim::below("… over what was meant", ratio(found, meant), 1.0));
    let messages = run(&wrong, 1, size.walks, None).messages();
    claims.push(Claim::messages(&messages, "ended on the back of a one-sided surface"));
    let two_sided = experiment(&turned(1, Sides::Both), Method::shooting(EstimatorKind::Collision))?;
    let right = ratio(radiosity(lab, &two_sided, size), meant);
    let what = "with `sides = 2`: B of patch 13 over what was meant";
    claims.push(Claim::equal(what, right, 1.0).instead());
    Ok(StudyFinding {
        predicted: "A ray that meets the back of a one-sided surface is absorbed there: a wall that is turned round is \
                    black to those inside, and takes Σφ_i of the scene whose reflectance there is 0."
            .into(),
        seen: format!(
            "With one wall turned round {} of the walks end on backs, and patch {PATCH} has {} of the light that was \
             meant for it.",
            measured(sweep.of_one_wall()?),
            measured(ratio(found, meant))
        ),
        messages,
        instead: format!(
            "Turn the wall (swap u and v), or write `sides = 2`: then patch {PATCH} has {} of what was meant.",
            measured(right)
        ),
        claims,
        chart: sweep.chart(),
    })
}
