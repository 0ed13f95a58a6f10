//! A job as it travels and as `tally.bin` keeps it, and the walks that a process makes of it.

use std::borrow::Cow;
use std::ops::Range;

use job::{NamedView, Partition, PlaneTarget, Vantage};
use parallel::run_on_all_cores;
use photometry::LuminousOpening;
use protocol::CheckpointFault;
use protocol::codec::{CodecError, decode_serde, encode_serde};
use radiosity::{
    Board, Experiment, IndexChoice, Overflow, Scene, SceneSpec, Sequence, Spectrum, Tally,
    daylight::DaylightSpec, lamps::LampsSpec, precision::Quantity, surfaces::PaneSpec,
};
use serde::{Deserialize, Serialize};

use crate::settings::Settings;

/// All that a process has to know of a job.
#[derive(Serialize, Deserialize)]
struct Packed<'a> {
    scene: Cow<'a, SceneSpec>,
    tree: bool,
    settings: Settings,
    /// The patch of every cell, as in [`SceneSpec::patch_of_cell`].
    patch_of_cell: Vec<u32>,
    /// The quantity of [`Settings::target`].
    quantity: Quantity,
    /// [`Settings::chooses_method`].
    chooses_method: bool,
    /// From where the picture of [`Settings::view`] looks.
    vantage: Option<Vantage>,
    /// [`SceneSpec::lamps`].
    lamps: LampsSpec,
    /// [`SceneSpec::panes`].
    panes: Vec<PaneSpec>,
    /// [`Settings::demands`].
    demands: Vec<PlaneTarget>,
    /// [`LampsSpec::openings`].
    openings: Vec<LuminousOpening>,
    /// [`Settings::views`].
    views: Vec<NamedView>,
    /// [`Settings::daylight`].
    daylight: Option<DaylightSpec>,
    /// [`SurfaceSpec::transmittance`](radiosity::SurfaceSpec::transmittance) of each surface; empty where none transmits.
    transmittances: Vec<Spectrum>,
}

/// Bytes of settings that came after the first format 5 of `tally.bin`: notes of imports, units of light, sensors and what is
/// asked of them, files, the three parts of the view, the two of the materials, exchange factors, sources, materials whose
/// influence is measured, the factors of a mixture, the total error, what a pilot has predicted, groups of cells, the
/// quantity that a target is about, whether the program chose the method, from where the picture looks, the two lists of lamps, panes, what is demanded
/// of planes, the openings of luminaires, views with names, daylight coefficients, and
/// transmittances.
const LATER_SETTINGS: usize = 28;

/// The bytes of a job.
///
/// # Errors
/// Where the scene is too large for one message.
pub(crate) fn pack(scene: &Scene, spec: &SceneSpec, settings: &Settings) -> Result<Vec<u8>, CodecError> {
    encode_serde(&Packed {
        scene: Cow::Borrowed(spec),
        tree: scene.has_tree(),
        settings: settings.clone(),
        patch_of_cell: spec.patch_of_cell.clone(),
        quantity: quantity_of(settings),
        chooses_method: settings.chooses_method,
        vantage: settings.view.from,
        lamps: spec.lamps.clone(),
        panes: spec.panes.clone(),
        demands: settings.demands.clone(),
        openings: spec.lamps.openings.clone(),
        views: settings.views.clone(),
        daylight: settings.daylight.clone(),
        transmittances: transmittances(spec),
    })
}

/// The bytes of a job with other settings.
///
/// # Errors
/// In words, where the bytes are no job, or become too many.
pub(crate) fn repack(bytes: &[u8], change: impl FnOnce(&mut Settings)) -> Result<Vec<u8>, String> {
    let mut packed = decode(bytes)?;
    change(&mut packed.settings);
    packed.quantity = quantity_of(&packed.settings);
    packed.vantage = packed.settings.view.from;
    packed.views.clone_from(&packed.settings.views);
    encode_serde(&packed).map_err(|error| error.to_string())
}

/// The transmittance of each surface; empty where none transmits.
fn transmittances(spec: &SceneSpec) -> Vec<Spectrum> {
    match spec.surfaces.iter().any(|surface| surface.transmittance.is_lit()) {
        true => spec.surfaces.iter().map(|surface| surface.transmittance).collect(),
        false => Vec::new(),
    }
}

/// The quantity that the job's target is about.
fn quantity_of(settings: &Settings) -> Quantity {
    settings.target.as_ref().map_or_else(Quantity::default, |target| target.quantity)
}

fn decode(bytes: &[u8]) -> Result<Packed<'static>, String> {
    // Jobs that were kept before the last settings were there end before these, each of which is a byte of 0 where the job
    // says nothing of it.
    let packed = decode_serde(bytes);
    let longer = |more: usize| decode_serde(&[bytes, &vec![0; more]].concat()).ok();
    let packed = packed.or_else(|error| (1..=LATER_SETTINGS).find_map(longer).ok_or(error));
    let mut packed: Packed = packed.map_err(|error| error.to_string())?;
    let scene = packed.scene.to_mut();
    scene.patch_of_cell.clone_from(&packed.patch_of_cell);
    scene.lamps.clone_from(&packed.lamps);
    scene.lamps.openings.clone_from(&packed.openings);
    scene.panes.clone_from(&packed.panes);
    for (surface, transmittance) in scene.surfaces.iter_mut().zip(&packed.transmittances) {
        surface.transmittance = *transmittance;
    }
    if let Some(target) = &mut packed.settings.target {
        target.quantity = packed.quantity;
    }
    packed.settings.chooses_method = packed.chooses_method;
    packed.settings.view.from = packed.vantage;
    packed.settings.demands.clone_from(&packed.demands);
    packed.settings.views.clone_from(&packed.views);
    packed.settings.daylight.clone_from(&packed.daylight);
    Ok(packed)
}

/// The partition that a pilot has chosen for the job that was packed; `None` where there was no pilot.
///
/// # Errors
/// In words, where the bytes are no job.
pub(crate) fn partition(bytes: &[u8]) -> Result<Option<Partition>, String> {
    let Packed { scene, settings, .. } = decode(bytes)?;
    let shapes = scene.surfaces.iter().map(|surface| &surface.shape);
    Ok(settings.forecast.map(|_| settings.partition_of(shapes, scene.patch_of_cell.clone())))
}

/// The settings of the job that was packed.
///
/// # Errors
/// In words, where the bytes are no job.
pub(crate) fn settings(bytes: &[u8]) -> Result<Settings, String> {
    Ok(decode(bytes)?.settings)
}

/// Settings and scene with the method that was packed.
///
/// # Errors
/// In words, where the bytes are no job or the scene is invalid.
pub(crate) fn unpack(bytes: &[u8]) -> Result<(Settings, Experiment), String> {
    let Packed { scene: spec, tree, settings, .. } = decode(bytes)?;
    let index = if tree { IndexChoice::Tree } else { IndexChoice::Flat };
    let scene = Scene::build_on(&spec, index, &run_on_all_cores).map_err(|error| error.to_string())?;
    if let Some(daylight) = &settings.daylight {
        let experiment =
            Experiment::of_daylight(scene, daylight.clone()).map_err(|error| error.to_string())?;
        return Ok((settings, experiment));
    }
    let experiment = Experiment::new(scene, settings.method.walks())
        .and_then(|experiment| experiment.with_sensors(&settings.sensors))
        .and_then(|experiment| experiment.with_groups(&settings.sources, &settings.sensitivity))
        .and_then(|experiment| match &settings.exchange {
            Some(exchange) => experiment.with_exchange(exchange.clone()),
            None => Ok(experiment),
        })
        .map_err(|error| error.to_string())?;
    let experiment = match settings.mixture.is_empty() {
        true => experiment,
        false => experiment.with_mixture(&spec, &settings.mixture).map_err(|error| error.to_string())?,
    };
    Ok((settings, experiment))
}

/// Whether a tally has the patches and sums of an experiment: one that was forged may not.
///
/// # Errors
/// Where it has others.
pub(crate) fn check_shape(tally: &Tally, experiment: &Experiment) -> Result<(), CheckpointFault> {
    let expected = (experiment.layout(), experiment.rows());
    if (tally.layout(), tally.patches()) == expected {
        Ok(())
    } else if tally.patches() == experiment.scene().faces().patch_count() {
        Err(CheckpointFault::Superseded(
            "it has one sum for both sides of a two-sided patch, and each side is an unknown of its own now",
        ))
    } else {
        Err(CheckpointFault::Contradiction("its sums are not those of its scene and method"))
    }
}

/// A process's replica of a job.
pub struct Replica {
    experiment: Experiment,
    sequence: Sequence,
    job_hash: [u8; 32],
}

impl Replica {
    /// Builds the replica from what the coordinator sent.
    ///
    /// # Errors
    /// As [`unpack`].
    pub fn decode(bytes: &[u8]) -> Result<Self, String> {
        let (settings, experiment) = unpack(bytes)?;
        Ok(Replica::new(experiment, &settings, settings.seed))
    }

    /// A replica that walks as the settings say, but for the seed.
    pub fn new(experiment: Experiment, settings: &Settings, seed: u64) -> Self {
        let job_hash = settings.job_hash(experiment.scene().hash(), seed);
        Replica::of(experiment, seed, job_hash)
    }

    /// A replica of the job with this digest.
    pub(crate) fn of(experiment: Experiment, seed: u64, job_hash: [u8; 32]) -> Self {
        Replica { experiment, sequence: Sequence::new(seed), job_hash }
    }

    /// The method at work in the scene.
    pub fn experiment(&self) -> &Experiment {
        &self.experiment
    }

    /// The experiment itself, without the replica.
    pub fn into_experiment(self) -> Experiment {
        self.experiment
    }

    /// Where its walks take their numbers from.
    pub fn sequence(&self) -> &Sequence {
        &self.sequence
    }

    /// The digest of scene, method and seed.
    pub fn job_hash(&self) -> [u8; 32] {
        self.job_hash
    }

    /// The tally of some walks.
    ///
    /// # Errors
    /// Where a sum overflows.
    pub fn trace(&self, walks: Range<u64>, board: &mut Board) -> Result<Tally, Overflow> {
        self.experiment.walk(&self.sequence, walks, board);
        board.take()
    }
}

#[cfg(test)]
mod tests {
    use radiosity::Sides;

    use super::*;

    #[test]
    fn one_sum_for_both_sides_is_of_an_earlier_version() {
        let mut spec = scenes::cube(1);
        spec.surfaces[2].sides = Sides::Both;
        let scene = Scene::build(&spec, IndexChoice::Auto).unwrap();
        let method = job::MethodTable::default().walks();
        let experiment = Experiment::new(scene, method).unwrap();
        let fault = |sums: usize| {
            let tally = Tally::new(sums, experiment.layout());
            check_shape(&tally, &experiment).map_err(|fault| fault.to_string())
        };
        assert!(fault(6).unwrap_err().contains("one sum for both sides"));
        assert!(fault(5).unwrap_err().contains("not those of its scene"));
        assert_eq!(fault(7), Ok(()));
    }
}
