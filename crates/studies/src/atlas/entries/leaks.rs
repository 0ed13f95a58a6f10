//! Scenes that are not closed, or not where they face.

use exact::Exact;
use radiosity::{EstimatorKind, Method, SceneSpec, Shape, Sides};
use report::{Axis, Chart};
use stats::Measured;

use crate::arithmetic::ratio;
use crate::atlas::entry::{Entry, Finding};
use crate::claim::Claim;
use crate::lab::Lab;
use crate::numbers::{measured, number};
use crate::series::{seen, theory};
use crate::told::run;
use crate::walking::{CONFIDENCE, Failure, estimate, experiment, walk};

pub const OPEN: Entry =
    Entry { name: "open-scenes", title: "Open scenes, and gaps that nobody meant to leave", study: open };

pub const BACKS: Entry = Entry {
    name: "back-faces",
    title: "Back faces: walls that face the wrong way take all light",
    study: backs,
};

/// The part of walks that an ending took, over runs of different seeds.
fn part(
    lab: &Lab,
    spec: &SceneSpec,
    size: (u64, u64),
    of: fn(&radiosity::Counts) -> u64,
) -> Result<Measured, Failure> {
    let (runs, walks) = size;
    let experiment = experiment(spec, Method::shooting(EstimatorKind::Collision))?;
    let parts =
        lab.each_seed(runs, |seed| of(&walk::<2>(&experiment, seed, walks).counts) as f64 / walks as f64);
    Ok(proportion_of_walks(&parts, walks))
}

/// Where no walk of any run ended so, the error is that of one walk in all.
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

fn open(lab: &Lab) -> Result<Finding, Failure> {
    let sweep = lab.pick(vec![1e-3, 1.0], vec![1e-5, 1e-4, 1e-3, 1e-2, 0.1, 0.3, 1.0]);
    let size = lab.pick((20, 50_000), (100, 300_000));
    let (mut line, mut marks) = (Vec::new(), Vec::new());
    let mut claims = Vec::new();
    for &gap in &sweep {
        let spec = gap_in_the_ceiling(gap);
        let exact = Exact::of_scene(&spec)?;
        let absorbed =
            exact.solution().incoming.iter().zip(exact.reflectance()).map(|(phi, r)| (1.0 - r) * phi);
        let lost = 1.0 - absorbed.sum::<f64>() / exact.total_power();
        let found = part(lab, &spec, size, |counts| counts.escaped)?;
        claims.push(Claim::equal(format!("a gap of {gap} m: part of the walks that escape"), found, lost));
        line.push((gap, lost));
        marks.push((gap, found));
    }
    let closed = part(lab, &gap_in_the_ceiling(0.0), size, |counts| counts.escaped)?;
    claims.push(Claim::sure("none escapes where there is no gap", closed.value == 0.0).instead());
    let said = |gap: f64| -> Result<Vec<String>, Failure> {
        let run = run(
            &experiment(&gap_in_the_ceiling(gap), Method::shooting(EstimatorKind::Collision))?,
            1,
            size.1,
            None,
        );
        let about = run.checks.iter().filter(|check| check.name == "escape");
        Ok(about
            .map(|check| {
                format!(
                    "a gap of {gap} m, check `escape`, {}: {}",
                    if check.ok { "passes" } else { "fails" },
                    check.message
                )
            })
            .collect())
    };
    let told = [said(1e-3)?, said(1.0)?].concat();
    claims.push(Claim::told(&told, "if it is meant to be closed, it has a gap"));
    claims.push(Claim::told(&told, "passes"));
    let first = marks[0];
    Ok(Finding {
        predicted: "Walks that leave carry their power away: what escapes is Φ_T − Σ(1 − R_i)φ_i, by the exact \
                    solution. A wide opening is part of a scene; a crack between walls that were meant to meet is a \
                    mistake that darkens everything by about as much as it lets out, and no interval knows."
            .into(),
        seen: format!("Through a gap of {} m {} of the walks escape.", first.0, measured(first.1)),
        told,
        instead: format!(
            "Close the gap: with the ceiling at full width {} of {} walks escape. Below 10⁻¹⁴ of the scene's size gaps \
             need no care: facets are made larger by as much.",
            number(closed.value),
            size.0 * size.1
        ),
        claims,
        chart: Chart {
            title: "A cube with a gap in its ceiling, R = 0.5".into(),
            x: Axis::log("width of the gap [m]"),
            y: Axis::log("part of the walks that escape"),
            series: vec![theory("exact", line), seen("seen", marks)],
        },
    })
}

/// The 54-patch cube with so many of its last walls turned round, their patches the same.
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

/// What the rest of the cube sees of them: black walls.
fn blackened(walls: usize) -> SceneSpec {
    let mut spec = scenes::cube(3);
    spec.surfaces.iter_mut().rev().take(walls).for_each(|surface| surface.reflectance = 0.0.into());
    spec
}

fn backs(lab: &Lab) -> Result<Finding, Failure> {
    let sweep = lab.pick(vec![1, 3], vec![0, 1, 2, 3, 4]);
    let (runs, walks) = lab.pick((20, 50_000), (100, 500_000));
    let (mut line, mut marks) = (Vec::new(), Vec::new());
    let mut claims = Vec::new();
    for &walls in &sweep {
        let black = Exact::of_scene(&blackened(walls))?;
        let first = 54 - 9 * walls;
        let taken = black.solution().incoming[first..].iter().sum::<f64>() / black.total_power();
        let spec = turned(walls, Sides::Front);
        let found = part(lab, &spec, (runs, walks), |counts| counts.absorbed_back)?;
        claims.push(Claim::equal(
            format!("{walls} walls: part of the walks that end on backs"),
            found,
            taken,
        ));
        line.push((walls as f64, taken));
        marks.push((walls as f64, found));
    }
    // A wall that still faces inwards is darker by what the backs do not return.
    const PATCH: usize = 13;
    let wrong = experiment(&turned(1, Sides::Front), Method::shooting(EstimatorKind::Collision))?;
    let found = Measured::of(&lab.each_seed(runs, |seed| {
        let solution = radiosity::Solution::new(&wrong, &walk::<2>(&wrong, seed, walks), CONFIDENCE);
        estimate(&solution, PATCH).radiosity
    }));
    let expected = Exact::of_scene(&blackened(1))?.solution().radiosity[PATCH];
    let meant = Exact::of_scene(&scenes::cube(3))?.solution().radiosity.clone();
    claims.push(Claim::equal(
        "one wall: B of patch 13 over that of black walls",
        ratio(found, expected),
        1.0,
    ));
    claims.push(Claim::below("… over what was meant", ratio(found, meant[PATCH]), 1.0));
    let told = run(&wrong, 1, walks, None).told();
    claims.push(Claim::told(&told, "ended on the back of a one-sided surface"));
    let two_sided = experiment(&turned(1, Sides::Both), Method::shooting(EstimatorKind::Collision))?;
    let right = Measured::of(&lab.each_seed(runs, |seed| {
        let solution = radiosity::Solution::new(&two_sided, &walk::<2>(&two_sided, seed, walks), CONFIDENCE);
        estimate(&solution, PATCH).radiosity
    }));
    claims.push(
        Claim::equal("with `sides = 2`: B of patch 13 over what was meant", ratio(right, meant[PATCH]), 1.0)
            .instead(),
    );
    Ok(Finding {
        predicted: "A ray that meets the back of a one-sided surface is absorbed there: a wall that is turned round is \
                    black to those inside, and takes Σφ_i of the scene whose reflectance there is 0."
            .into(),
        seen: format!(
            "With one wall turned round {} of the walks end on backs, and patch {PATCH} has {} of the light that was \
             meant for it.",
            measured(marks.iter().find(|(walls, _)| *walls == 1.0).map_or(found, |(_, part)| *part)),
            measured(ratio(found, meant[PATCH]))
        ),
        told,
        instead: format!(
            "Turn the wall (swap u and v), or write `sides = 2`: then patch {PATCH} has {} of what was meant.",
            measured(ratio(right, meant[PATCH]))
        ),
        claims,
        chart: Chart {
            title: "The 54-patch cube with walls turned round".into(),
            x: Axis::linear("walls turned round"),
            y: Axis::linear("part of the walks that end on backs"),
            series: vec![theory("exact, those walls black", line), seen("seen", marks)],
        },
    })
}
