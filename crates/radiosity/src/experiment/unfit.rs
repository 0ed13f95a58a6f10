//! Methods that would be wrong in a scene.

use thiserror::Error;

use crate::geometry::sensor::SensorError;
use crate::method::{Birth, Direction, Method, Walks};
use crate::scene::Scene;

/// A method that would be wrong in this scene.
///
/// ```
/// use radiosity::{Birth, EstimatorKind, Experiment, IndexChoice, Method, Scene, SceneSpec, Unfit};
///
/// let black = Scene::build(&SceneSpec::furnace(1, 0.0), IndexChoice::Auto)?;
/// let gathering = Method::gathering(Birth::Area, EstimatorKind::Survival);
/// assert_eq!(Experiment::new(black, gathering).unwrap_err(), Unfit::BlackEmitter { patch: 0 });
/// # Ok::<(), radiosity::SceneError>(())
/// ```
#[derive(Clone, Debug, Error, PartialEq)]
pub enum Unfit {
    /// Gathering by survival scores where a walk survives on an emitter.
    #[error(
        "patch {patch} emits and has reflectance 0, and gathering by survival scores only where walks survive (its light would be lost); choose another estimator"
    )]
    BlackEmitter {
        /// The patch that emits.
        patch: usize,
    },
    /// No gathering walk meets a lamp without area.
    #[error(
        "gathering walks find light where they meet what emits, and a [[lamp]] has no area that they could meet (shadow rays from arrivals would score 1/d², which has no bound near a lamp); write walk = \"shooting\" or walk = \"jacobi\""
    )]
    GatheredLamps,
    /// Radiosities of sheets follow from the light of both sides.
    #[error(
        "a surface transmits light, and the radiosity of a side follows here from what comes in on that side alone (light would be lost); remove `transmittance` from its material, or ask `radwalk daylight`, which takes it"
    )]
    Transmission,
    /// All rays of chains that land count alike.
    #[error(
        "the rays of chains count alike where they land, and panes pass a part of the light (it would be too much); write walk = \"shooting\", or remove each [[pane]]"
    )]
    PanesOfChains,
    /// The best mix of absorption and survival is a matter of one channel.
    #[error(
        "`mix` compares collision, absorption and survival on the same walks, which needs a grey scene; run one channel at a time, or remove `mix`"
    )]
    MixInColour,
    /// No walk can be born, and nothing gathered, where there is no patch.
    #[error("patch {patch} is chosen, but the scene has {patches} patches; choose from 0 to {last}", last = patches - 1)]
    NoSuchPatch {
        /// The number of the chosen patch.
        patch: u32,
        /// Patches of the scene.
        patches: usize,
    },
    /// Rays of a final gather leave one plane.
    #[error(
        "patch {patch} of the final gather is a group of cells (its rays leave one cell); choose other patches, or remove the groups (import.group_size)"
    )]
    GatheredGroup {
        /// The number of the chosen patch.
        patch: u32,
    },
    /// Exchange factors belong to one channel.
    #[error(
        "exchange factors are those of one reflectance for each surface, and the scene has three channels; choose one of them"
    )]
    ExchangeInColour,
    /// Daylight coefficients belong to one channel.
    #[error(
        "daylight coefficients are those of one reflectance for each surface, and the scene has three channels; choose one of them"
    )]
    DaylightInColour,
    /// Walks of daylight leave planes.
    #[error(
        "sensor {name:?} measures cylindrical illuminance or glare, and daylight is gathered on planes; leave it out, or write planes that face four ways in its place"
    )]
    DaylightOffPlanes {
        /// The name of the sensor.
        name: String,
    },
    /// Nothing measures the daylight.
    #[error(
        "the scene has no sensor (daylight coefficients are those of places where light is measured); add a [[sensor]] to the scene file"
    )]
    NoSensors,
    /// Groups that leave faces out, are empty, or walk more than their share of the sequence.
    #[error(
        "the groups of the exchange factors are not those of the scene (each face belongs to one, each has a face), or one walks more than 2⁴⁰ walks; change groups or walks"
    )]
    NoSuchGroups,
    /// Segments of daylight coefficients that no cell has.
    #[error(
        "the walks of the daylight coefficients are not those of the scene's sensors (each is of a cell, which walks up to 2⁴⁰ walks); change sensors or walks"
    )]
    NoSuchCells,
    /// Patches of the sky that are neither Tregenza's nor Reinhart's.
    #[error("{patches} patches of the sky (Tregenza has 145, Reinhart 577 or 2305); choose one of these")]
    NoSuchSky {
        /// The number of patches.
        patches: u32,
    },
    /// A sensor that cannot measure anything.
    #[error(transparent)]
    Sensor(#[from] SensorError),
    /// A sensor sees all patches.
    #[error(
        "sensors gather the light of every patch that they see, and gathering walks that are born on chosen patches tell of no others; remove `birth`, or the sensors"
    )]
    SensorsOfFewPatches,
    /// What sensors gather lacks the light that was cut off.
    #[error(
        "walks are cut off, and sensors and planes gather what the rest of them found (intervals would have no room for what is missing); write end = \"roulette\", or remove each [[sensor]], [[plane]] and [[points]]"
    )]
    CutOffSensors,
    /// A gathering walk meets the light of several sources.
    #[error(
        "a gathering walk meets emitters of several sources and scores all of them at once, so that its score belongs to none of them; write walk = \"shooting\", whose walks are born on one emitter, or remove [[source]] and [sensitivity]"
    )]
    GatheredSources,
    /// Gradients have no sums by source.
    #[error(
        "basis = \"linear\" estimates the gradients of the light of all sources together; remove `basis`, or remove [[source]] and [sensitivity]"
    )]
    LinearSources,
    /// Absorption and survival beside collision have no sums by source.
    #[error(
        "`mix` compares estimators on the light of all sources together; remove `mix`, or remove [[source]] and [sensitivity]"
    )]
    MixedSources,
    /// The walks of a batch, or the rays of a chain, carry the light of all sources.
    #[error(
        "batches and chains are one sample of the light of all sources together, and the covariances of their sources are not kept; write walk = \"shooting\" with sampler = \"random\" and without final_gather, or remove [[source]] and [sensitivity]"
    )]
    SourcesOfBatches,
    /// Marks of materials are kept of faces alone.
    #[error(
        "sensors and planes gather what walks have found, of which the derivatives by materials are not kept; remove [sensitivity], or remove each [[sensor]], [[plane]] and [[points]]"
    )]
    SensitiveSensors,
    /// What is cut off depends on reflectances, too.
    #[error(
        "walks are cut off, and what is cut off depends on the reflectances as well (the derivatives would lack it); write end = \"roulette\", or remove [sensitivity]"
    )]
    CutOffInfluence,
    /// A lamp without area in two sources.
    #[error(
        "lamp {lamp} is in sources {:?} and {:?} (a walk that is born there could not be told to be of one of them); take it out of one", names[0], names[1]
    )]
    SharedLamp {
        /// The number of the lamp, from 0.
        lamp: usize,
        /// The names of both sources.
        names: [String; 2],
    },
    /// An emitter in two sources.
    #[error(
        "patch {patch} emits, and sources {:?} and {:?} both hold it (a walk that is born there could not be told to be of one of them); take it out of one", names[0], names[1]
    )]
    SharedEmitter {
        /// The number of the emitting patch.
        patch: u32,
        /// The names of both sources.
        names: [String; 2],
    },
    /// A source without emitters.
    #[error(
        "source {name:?} holds no patch that emits (no walk would be born there); give its patches an emittance, or remove the source"
    )]
    DarkSource {
        /// The name of the source.
        name: String,
    },
    /// A material of several reflectances, or without surfaces.
    #[error(
        "the surfaces of material {name:?} do not have one reflectance (radiosities have no derivative by it); choose other materials in [sensitivity]"
    )]
    UnevenMaterial {
        /// The name of the material.
        name: String,
    },
    /// More sums than can be numbered.
    #[error(
        "{classes} kinds of emitters are told apart on {faces} faces, which are more than 2³² sums; use fewer sources and materials, or coarser patches"
    )]
    TooManySums {
        /// Sources by materials of emitters.
        classes: usize,
        /// Faces of the scene.
        faces: usize,
    },
}

/// Whether a method's answer would be right, but for emitters that [`super::gathering`] refuses.
pub(super) fn check(scene: &Scene, method: &Method) -> Result<(), Unfit> {
    if method.is_mix() && scene.channels() > 1 {
        return Err(Unfit::MixInColour);
    }
    if scene.transmits() {
        return Err(Unfit::Transmission);
    }
    if scene.lamp_count() > 0 {
        check_lamps(method)?;
    }
    if scene.has_panes() && matches!(method, Method::Chains(_)) {
        return Err(Unfit::PanesOfChains);
    }
    if let Method::Walks(Walks { direction: Direction::Gathering(Birth::Patches(chosen)), .. }) = method {
        check_patches(chosen, scene)?;
    }
    let faces = scene.faces();
    check_patches(method.final_gather(), scene)?;
    let is_group = |patch: &&u32| faces.pieces(**patch as usize).nth(1).is_some();
    let group = method.final_gather().iter().find(is_group);
    group.map_or(Ok(()), |&patch| Err(Unfit::GatheredGroup { patch }))
}

/// Whether a method finds the light of lamps without area.
fn check_lamps(method: &Method) -> Result<(), Unfit> {
    match method {
        Method::Walks(Walks { direction: Direction::Gathering(_), .. }) => Err(Unfit::GatheredLamps),
        Method::Walks(_) | Method::Batches(_) | Method::Chains(_) => Ok(()),
    }
}

/// Whether the walks estimate every face that sensors may see, and all of its light.
pub(super) fn check_sensors(method: &Method) -> Result<(), Unfit> {
    match method {
        Method::Walks(Walks { direction: Direction::Gathering(Birth::Patches(_)), .. }) => {
            Err(Unfit::SensorsOfFewPatches)
        }
        method if method.is_biased() => Err(Unfit::CutOffSensors),
        _ => Ok(()),
    }
}

/// Whether every chosen patch is one of the scene.
fn check_patches(chosen: &[u32], scene: &Scene) -> Result<(), Unfit> {
    let patches = scene.faces().patch_count();
    let unknown = chosen.iter().find(|&&patch| patch as usize >= patches);
    unknown.map_or(Ok(()), |&patch| Err(Unfit::NoSuchPatch { patch, patches }))
}
