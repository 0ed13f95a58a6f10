//! Entry of the atlas: coordinates that are hard on floating point, in furnaces, whose answer is known whatever their
//! shape (B = E/(1 − R)).

use glam::DVec3;
use radiosity::{Estimate, EstimatorKind, Method, SceneSpec, Sides, Solution};
use report::{Axis, Chart, Series};
use stats::Measured;

use crate::atlas::entry::{Entry, StudyFinding};
use crate::claim::{Claim, ClaimJudge};
use crate::judged_run::run;
use crate::lab::Lab;
use crate::walking::{CONFIDENCE, Failure, estimate, experiment, walk};
use report::words::{measured, number};

/// The edges of a box of 24 patches [m].
const BOX: DVec3 = DVec3::new(1.0, 0.8, 0.6);

/// A cube in which B = 1, deformed to a box.
fn furnace(to: impl Fn(DVec3) -> DVec3) -> SceneSpec {
    scenes::moved(&scenes::furnace(2, 0.5), to)
}

/// The furnace with a sheet across the part `part` of its middle, which reflects and emits on both sides.
fn with_sheet(part: f64) -> SceneSpec {
    let mut spec = furnace(|corner| corner * BOX);
    let floor = SceneSpec::new(vec![spec.surfaces[0].clone()]);
    let (middle, flat) = (0.5 * BOX, DVec3::new(part, part, 0.0));
    let mut sheet = scenes::moved(&floor, |corner| middle + (corner - middle) * flat);
    sheet.surfaces[0].sides = Sides::Both;
    spec.surfaces.append(&mut sheet.surfaces);
    spec
}

pub(crate) const FAR_ORIGIN: Entry = Entry {
    name: "far-from-the-origin",
    title: "Coordinates offset by 10⁶ m and more",
    study: |lab| {
        let sweep = lab.pick(vec![1e6, 1e14], vec![1.0, 1e3, 1e6, 1e9, 1e10, 1e12, 1e13, 1e14, 1e15, 1e16]);
        GeometrySweep {
            sweep,
            safe: |offset| offset <= 1e9,
            scene: |offset| {
                let offset = DVec3::new(offset, -0.7 * offset, 0.3 * offset);
                furnace(|corner| corner * BOX + offset)
            },
            axis: "offset of a 1 m box [m]",
            title: "A furnace far from the origin",
            predicted: "At an offset d coordinates are multiples of 2⁻⁵²d: edges that were meant to meet part by as \
                        much. Facets are made larger by a slack of 2⁻⁴⁶ of the largest coordinate, so that nothing \
                        falls through; B = E/(1 − R) = 1 in a furnace, whatever becomes of its shape. Once the slack \
                        is as large as the box there is nothing left to trace.",
            instead: "Move the scene to the origin, in double precision, before it is written: there",
            remedy: || furnace(|corner| corner * BOX),
        }
        .study(lab)
    },
};

pub(crate) const SCALES: Entry = Entry {
    name: "scales",
    title: "Scales of 10⁻⁶ m, 10⁶ m, and far beyond",
    study: |lab| {
        let all = vec![1e-150, 1e-30, 1e-9, 1e-6, 1e-3, 1.0, 1e3, 1e6, 1e9, 1e30, 1e150, 1e160];
        GeometrySweep {
            sweep: lab.pick(vec![1e-6, 1e6, 1e160], all),
            safe: |scale| (1e-30..=1e30).contains(&scale),
            scene: |scale| furnace(|corner| corner * BOX * scale),
            axis: "edge of the box [m]",
            title: "A furnace of any size",
            predicted: "Form factors have no unit: B is the same at every scale, until areas leave the range of \
                        64-bit floating point (10^±308).",
            instead: "Choose a unit in which the scene is neither 10⁻¹⁵⁰ nor 10¹⁵⁰ long: in a box of 1",
            remedy: || furnace(|corner| corner * BOX),
        }
        .study(lab)
    },
};

pub(crate) const SLIVERS: Entry = Entry {
    name: "slivers",
    title: "Slivers: boxes and triangles of aspect 10²…10¹³",
    study: |lab| {
        let all = vec![1e1, 1e2, 1e4, 1e6, 1e8, 1e10, 1e11, 1e12, 1e13];
        GeometrySweep {
            sweep: lab.pick(vec![1e4, 1e8, 1e13], all),
            safe: |aspect| aspect <= 1e8,
            scene: |aspect| furnace(|corner| corner * DVec3::new(1.0, 1.0 / aspect, 0.5)),
            axis: "aspect of the walls",
            title: "A furnace that becomes a slit",
            predicted: "Two large walls at a distance 1/a exchange nearly all; the narrow walls between them have \
                        1/a of the area. B = 1 on all of them, as long as the width of the slit is beyond the slack \
                        of 2⁻⁴⁶ = 1.4·10⁻¹⁴ of the largest coordinate.",
            instead: "Make what is that narrow wider, or leave it out: a sheet with `sides = 2` has no narrow walls. \
                      On both sides of one that hangs in the furnace, and on its walls,",
            remedy: || with_sheet(0.5),
        }
        .study(lab)
    },
};

pub(crate) const WEDGES: Entry = Entry {
    name: "wedges",
    title: "Acute wedges: two walls that meet at 10⁻¹…10⁻¹³ rad",
    study: |lab| {
        let all = vec![1.0, 1e-1, 1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-11, 1e-12, 1e-13];
        GeometrySweep {
            sweep: lab.pick(vec![1e-2, 1e-6, 1e-13], all),
            safe: |angle| angle >= 1e-8,
            scene: |angle| scenes::wedge(angle, 0.5),
            axis: "angle [rad]",
            title: "A furnace in a wedge",
            predicted: "In a closed wedge of angle θ light goes to and fro between its sides, F = 1 − sin(θ/2) for \
                        long ones, and near the edge over any distance, however short. B is still 1. Rays that start \
                        within slack/θ of the edge cannot tell its sides apart.",
            instead: "Walls that are meant to lie on each other are one wall with `sides = 2`. On both sides of one \
                      that divides the furnace, and on its walls,",
            remedy: || with_sheet(1.0),
        }
        .study(lab)
    },
};

/// A sweep over shapes of one furnace.
struct GeometrySweep {
    sweep: Vec<f64>,
    /// The points of the sweep where nothing may go wrong.
    safe: fn(f64) -> bool,
    scene: fn(f64) -> SceneSpec,
    axis: &'static str,
    title: &'static str,
    predicted: &'static str,
    /// The remedy in words, up to the B that it gives.
    instead: &'static str,
    /// The furnace that the remedy gives.
    remedy: fn() -> SceneSpec,
}

/// The outcome of one shape.
enum ShapeOutcome {
    /// The scene was refused.
    Refused(String),
    /// The mean B of the patch that is furthest off in standard errors (`None` if nothing arrives), the number of
    /// patches, the part of the walks that escaped, and the program's words.
    Walked { radiosity: Option<Measured>, among: usize, escaped: f64, messages: Vec<String> },
}

/// The outcome of all shapes.
#[derive(Default)]
struct Answers {
    claims: Vec<Claim>,
    messages: Vec<String>,
    radiosities: Vec<(f64, Measured)>,
    losses: Vec<(f64, f64)>,
    /// The points of the sweep where nothing may go wrong, with the B that was measured there.
    safe: Vec<(f64, Option<Measured>)>,
    refused: usize,
}

impl Answers {
    fn add(&mut self, at: f64, is_safe: bool, answer: ShapeOutcome, runs: u64) {
        match answer {
            ShapeOutcome::Refused(why) => {
                self.claims.push(Claim::sure(format!("{at:e} is refused"), !is_safe));
                self.messages.push(format!("at {at:e}: {why}"));
                self.refused += 1;
            }
            ShapeOutcome::Walked { radiosity, among, escaped, messages } => {
                self.losses.push((at, escaped));
                self.radiosities.extend(radiosity.map(|radiosity| (at, radiosity)));
                let unknown = Measured { value: f64::NAN, standard_error: f64::NAN };
                let what = format!("{at:e}: B of the patch that is furthest off");
                let right = Claim::furthest(&what, radiosity.unwrap_or(unknown), 1.0, among, runs);
                if is_safe {
                    self.claims.push(Claim::sure(format!("{at:e}: no walk escapes"), escaped == 0.0));
                    self.claims.push(right);
                    self.safe.push((at, radiosity));
                } else {
                    let said = messages.iter().any(|line| line.contains("left the scene"));
                    let what = format!("{at:e}: B is right, or the program says that it may not be");
                    self.claims.push(Claim::sure(what, said || ClaimJudge::EACH.passes(&right)));
                    let messages = messages.iter().filter(|_| escaped > 0.0);
                    self.messages.extend(messages.map(|line| format!("at {at:e}: {line}")));
                }
            }
        }
    }

    /// The B that is furthest off where nothing may go wrong.
    fn worst(&self) -> Option<Measured> {
        let known = self.safe.iter().filter_map(|(_, radiosity)| *radiosity);
        known.max_by(|a, b| a.z(1.0).abs().total_cmp(&b.z(1.0).abs()))
    }
}

impl GeometrySweep {
    fn study(self, lab: &Lab) -> Result<StudyFinding, Failure> {
        let (runs, walks) = lab.pick((20, 10_000), (100, 100_000));
        let mut answers = Answers::default();
        for &at in &self.sweep {
            answers.add(at, (self.safe)(at), answer(lab, &(self.scene)(at), runs, walks), runs);
        }
        let (remedied, remedy) = self.remedied(lab, runs, walks)?;
        let worst = answers.worst().ok_or("no point of the sweep is safe")?;
        let (first, last) = (answers.safe[0].0, answers.safe[answers.safe.len() - 1].0);
        let refused = answers.refused;
        let Answers { mut claims, mut messages, radiosities, losses, .. } = answers;
        claims.extend(remedied);
        if messages.is_empty() {
            messages.push("nothing: every check passes, and the answer is right".into());
        }
        Ok(StudyFinding {
            predicted: self.predicted.into(),
            seen: format!(
                "From {} to {} B = {} on the patch that is furthest off, and none of {} walks escapes. Of the rest \
                 of the sweep {refused} scenes are refused.",
                number(first),
                number(last),
                measured(worst),
                runs * walks
            ),
            messages,
            instead: format!(
                "{} B = {} on the patch that is furthest off, and no walk escapes.",
                self.instead,
                measured(remedy)
            ),
            claims,
            chart: self.chart(radiosities, losses),
        })
    }

    /// The claims about the furnace that the remedy gives, and its B.
    fn remedied(&self, lab: &Lab, runs: u64, walks: u64) -> Result<([Claim; 2], Measured), Failure> {
        match answer(lab, &(self.remedy)(), runs, walks) {
            ShapeOutcome::Refused(why) => Err(why.into()),
            ShapeOutcome::Walked { radiosity, among, escaped, .. } => {
                let closed = Claim::sure("no walk escapes", escaped == 0.0).instead();
                let radiosity = radiosity.ok_or("nothing arrives anywhere")?;
                let what = "B of the patch that is furthest off";
                let right = Claim::furthest(what, radiosity, 1.0, among, runs).instead();
                Ok(([closed, right], radiosity))
            }
        }
    }

    fn chart(&self, radiosities: Vec<(f64, Measured)>, losses: Vec<(f64, f64)>) -> Chart {
        Chart {
            title: self.title.into(),
            x: Axis::log(self.axis),
            y: Axis::linear("B [W/m²]; part of the walks that escape"),
            series: vec![
                Series::theory("E/(1 − R)", self.sweep.iter().map(|&at| (at, 1.0))),
                Series::measured("B, seen", radiosities),
                Series::theory("part of the walks that escape", losses),
            ],
        }
    }
}

fn answer(lab: &Lab, spec: &SceneSpec, runs: u64, walks: u64) -> ShapeOutcome {
    let experiment = match experiment(spec, Method::shooting(EstimatorKind::Collision)) {
        Ok(experiment) => experiment,
        Err(why) => return ShapeOutcome::Refused(why.to_string()),
    };
    let patches = experiment.scene().faces().len();
    let found = lab.each_seed(runs, |seed| {
        let tally = walk(&experiment, seed, walks);
        let solution = Solution::new(&experiment, &tally, CONFIDENCE);
        let estimates: Vec<Estimate> = (0..patches).map(|i| estimate(&solution, i)).collect();
        (estimates, tally.counts.escaped as f64 / walks as f64)
    });
    // Rare scores are not normal; other entries are about their intervals.
    let often = |i: &usize| found.iter().all(|(estimates, _)| !estimates[*i].is_rare());
    let of_patch = |i: usize| {
        Measured::of(&found.iter().map(|(estimates, _)| estimates[i].radiosity).collect::<Vec<_>>())
    };
    let doubt = |b: &Measured| b.z(1.0).abs();
    let radiosity = (0..patches).filter(often).map(of_patch).max_by(|a, b| doubt(a).total_cmp(&doubt(b)));
    let escaped = found.iter().map(|&(_, escaped)| escaped).sum::<f64>() / runs as f64;
    ShapeOutcome::Walked {
        radiosity,
        among: patches,
        escaped,
        messages: run(&experiment, 1, walks, None).messages(),
    }
}
