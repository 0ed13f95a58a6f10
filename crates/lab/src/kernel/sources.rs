//! What it costs to tell sources apart and to measure what materials do: `radwalk-lab sources`
//! prints rates of walks, each against walks without groups that are timed in turn, as tables for `docs/guide/sources.md`.

use std::time::Instant;

use radiosity::{
    EstimatorKind, Experiment, IndexChoice, Method, Scene, SceneSpec, Sequence, Spectrum, groups::PatchGroup,
};
use scenes::{cornell, cube, interior};

use super::Failure;

/// Walks of one measurement.
const WALKS: u64 = 1 << 19;

/// Measurements of each; the median counts.
const TURNS: u64 = 9;

pub(crate) fn run() -> Result<(), Failure> {
    println!("| scene | 1 source | 4 | 16 | 1 material | 3 | 10 |\n|---|---|---|---|---|---|---|");
    for (name, spec) in [
        ("cube54", cube(3)),
        ("Cornell box, grey", cornell().with_colour(false)),
        ("Cornell box", cornell().with_colour(true)),
        ("interior, 2,000 triangles", interior(2000)),
    ] {
        let spec = lit(spec);
        let scene = Scene::build(&spec, IndexChoice::Auto)?;
        let plain = Experiment::new(scene, Method::shooting(EstimatorKind::Collision))?;
        let mut cells = Vec::new();
        for (sources, materials) in [(1, 0), (4, 0), (16, 0), (0, 1), (0, 3), (0, 10)] {
            let apart = plain.clone().with_groups(&parts(&spec, sources), &parts(&spec, materials))?;
            cells.push(format!("{:.2}", rate_over(&apart, &plain)));
        }
        println!("| {name} | {} |", cells.join(" | "));
    }
    Ok(())
}

trait DealtColours {
    fn with_colour(self, colour: bool) -> Self;
}

impl DealtColours for SceneSpec {
    /// The scene in three channels, or in the second of them.
    fn with_colour(mut self, colour: bool) -> Self {
        for surface in &mut self.surfaces {
            if !colour {
                surface.reflectance = surface.reflectance[1].into();
                surface.emittance = surface.emittance[1].into();
            }
        }
        self
    }
}

/// The scene with all its surfaces of one reflectance and lit, so that any surfaces are a source and a material.
fn lit(mut spec: SceneSpec) -> SceneSpec {
    let coloured = spec.channels() > 1;
    for surface in &mut spec.surfaces {
        let grey = 0.7;
        surface.reflectance = if coloured { Spectrum::rgb([0.7, 0.6, 0.5]) } else { grey.into() };
        surface.emittance = 1.0.into();
        surface.cell_emittance.clear();
    }
    spec
}

/// `count` groups, to which the patches are dealt in turn.
fn parts(spec: &SceneSpec, count: u32) -> Vec<PatchGroup> {
    let patches: u64 = spec.surfaces.iter().map(|surface| surface.shape.cell_count()).sum();
    let of =
        |group: u32| (group..patches as u32).step_by(count as usize).map(|patch| (patch, patch)).collect();
    (0..count).map(|group| PatchGroup { name: group.to_string(), patches: of(group) }).collect()
}

/// The median of the rates of an experiment over those of another.
fn rate_over(experiment: &Experiment, other: &Experiment) -> f64 {
    let seconds = |experiment: &Experiment, turn: u64| {
        let mut board = experiment.board();
        let start = Instant::now();
        experiment.walk(&Sequence::new(turn), 0..WALKS, &mut board);
        start.elapsed().as_secs_f64()
    };
    let mut rates: Vec<f64> =
        (0..TURNS).map(|turn| seconds(other, turn) / seconds(experiment, turn)).collect();
    rates.sort_by(f64::total_cmp);
    rates[rates.len() / 2]
}
