//! Everything that is known exactly about a scene.

use std::sync::{Arc, OnceLock};

use radiosity::{IndexChoice, Scene, SceneError, SceneSpec, lamps::Emission};
use thiserror::Error;

use crate::box_scene::{BoxScene, NotABox};
use crate::exchange::ExchangeMatrix;
use crate::face::FaceScene;
use crate::found::FormFactors;
use crate::general;
use crate::lamps::LampLight;
use crate::system::{RadiositySystem, Singular, SystemSolution};

/// The most patches that are solved for: two dense matrices of them take 1.6 GB.
pub const MAX_PATCHES: u64 = 10_000;

/// The most faces of a scene that is not a closed axis-aligned box.
pub const MAX_GENERAL_FACES: u64 = 4_000;

/// Why a scene cannot be solved exactly.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ExactError {
    /// The scene itself is not valid.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// More than [`MAX_PATCHES`] patches.
    #[error(
        "the scene has {patches} patches, more than {MAX_PATCHES} (the two dense matrices would take \
         {gigabytes:.1} GB, and the work grows with the cube); use coarser patches"
    )]
    TooManyPatches {
        /// The patches of the scene.
        patches: u64,
        /// The memory that it would take [10⁹ bytes].
        gigabytes: f64,
    },
    /// More than [`MAX_GENERAL_FACES`] faces in a scene that is not a box.
    #[error(
        "the scene has {faces} faces, more than {MAX_GENERAL_FACES} (form factors with shadows would \
         take up to {minutes:.0} minutes of one core, and {gigabytes:.1} GB); use coarser patches. Closed boxes of \
         axis-aligned rectangles may have {MAX_PATCHES}, but {because}"
    )]
    TooManyFaces {
        /// The faces of the scene.
        faces: u64,
        /// The time that it would take, roughly [min of one core].
        minutes: f64,
        /// The memory that it would take [10⁹ bytes].
        gigabytes: f64,
        /// Why it is not a box.
        because: NotABox,
    },
    /// Parallel light.
    #[error(
        "the scene has a distant lamp, a [[lamp]] with `illuminance` (which parts of a face it lights is found from the place of a lamp, and it has none); remove it, or run the job"
    )]
    DistantLamp,
    /// A peak of light.
    #[error(
        "lamp {lamp} (from 0) lights a surface from much nearer than the size of its patches (the peak of light under it would be missed); move it away, remove it, or run the job"
    )]
    NearLamp {
        /// The number of the lamp.
        lamp: usize,
    },
    /// Light that is weakened on its way.
    #[error(
        "the scene has panes, and the form factors of the system that is solved are those of free sight (light would be too much); remove each [[pane]], or run the job"
    )]
    Panes,
    /// Light that comes through surfaces.
    #[error(
        "a surface transmits light, and each side of a patch is solved for by what comes in on it alone (light would be lost); remove `transmittance` from its material, or ask `radwalk daylight`, which takes it"
    )]
    Transmission,
    /// The system cannot be solved.
    #[error(transparent)]
    Singular(#[from] Singular),
}

/// The exact solution of a scene's radiosity system, and what predictions about walks need. Vectors are in the order
/// of faces ([`radiosity::surfaces::Faces`]).
#[derive(Clone, Debug)]
pub struct Exact {
    form_factors: FormFactors,
    system: RadiositySystem,
    emittance: Vec<f64>,
    lamps: LampLight,
    solution: SystemSolution,
    total_power: f64,
    xi: Vec<f64>,
    squared: OnceLock<Squared>,
}

/// The solution of the scene whose reflectances are squared: ψ, β (SInf §3).
#[derive(Clone, Debug)]
pub(crate) struct Squared {
    pub system: RadiositySystem,
    pub solution: SystemSolution,
}

impl Exact {
    /// Solves a scene: closed boxes of axis-aligned rectangles in closed form, to about 10⁻¹²; any other, open
    /// or closed, with shadows, to what [`crate::SystemAccuracy::of`] then says. Every machine finds the same, however many
    /// threads it has, but for the last digits of its mathematical functions.
    ///
    /// # Errors
    /// [`ExactError`], if the scene is not valid or too large.
    pub fn of_scene(spec: &SceneSpec) -> Result<Self, ExactError> {
        let channels = Self::of_channels(&spec.channel(0), &|_| ())?;
        Ok(channels.into_iter().next().expect("one channel is grey"))
    }

    /// [`Exact::of_scene`] for every channel of a scene, whose form factors are found once. `watch` hears which part of the
    /// pairs of faces is done, from several threads.
    ///
    /// # Errors
    /// As [`Exact::of_scene`].
    pub fn of_channels(spec: &SceneSpec, watch: &(dyn Fn(f64) + Sync)) -> Result<Vec<Self>, ExactError> {
        check_size(spec)?;
        if !spec.panes.is_empty() {
            return Err(ExactError::Panes);
        }
        if spec.surfaces.iter().any(|surface| surface.transmittance.is_lit()) {
            return Err(ExactError::Transmission);
        }
        if spec.lamps.list.iter().any(|lamp| matches!(lamp.emission, Emission::Distant { .. })) {
            return Err(ExactError::DistantLamp);
        }
        let scene = Scene::build(spec, IndexChoice::Flat)?;
        let (form_factors, exchange) = match BoxScene::recognise(spec) {
            Ok(closed) => (FormFactors::ClosedForm, ExchangeMatrix::of_box(&closed)),
            Err(because) => {
                check_general_size(&scene, &because)?;
                let faces = FaceScene::new(spec, scene.stacks());
                (FormFactors::General { because }, general::exchange(faces, watch))
            }
        };
        let lamps = match scene.lamp_count() {
            0 => vec![LampLight::default(); scene.channels()],
            _ => LampLight::of(&scene, &FaceScene::new(spec, scene.stacks()))?,
        };
        let faces = scene.faces();
        let exchange = Arc::new(if faces.are_grouped() {
            let face_of: Vec<u32> =
                (0..faces.piece_count() as u32).map(|piece| faces.face_of(piece)).collect();
            exchange.grouped(&face_of, faces.len())
        } else {
            exchange
        });
        let solve = |channel: usize| {
            let reflectance = faces.iter().map(|face| face.reflectance[channel]).collect();
            let emittance = faces.iter().map(|face| face.emittance[channel]).collect();
            let exact = Self::lit(Arc::clone(&exchange), reflectance, emittance, lamps[channel].clone())?;
            Ok(Exact { form_factors: form_factors.clone(), ..exact })
        };
        (0..scene.channels()).map(solve).collect()
    }

    /// Solves the system of given form factors, reflectances in [0, 1) and emittances [W/m²], one per face.
    ///
    /// # Errors
    /// [`Singular`] if a reflectance is 1 to working precision.
    ///
    /// # Panics
    /// Unless there is one of each per face.
    pub fn new(
        exchange: Arc<ExchangeMatrix>,
        reflectance: Vec<f64>,
        emittance: Vec<f64>,
    ) -> Result<Self, Singular> {
        Self::lit(exchange, reflectance, emittance, LampLight::default())
    }

    /// [`Exact::new`] in the light of lamps, too.
    fn lit(
        exchange: Arc<ExchangeMatrix>,
        reflectance: Vec<f64>,
        emittance: Vec<f64>,
        lamps: LampLight,
    ) -> Result<Self, Singular> {
        let system = RadiositySystem::new(exchange, reflectance)?;
        let solution = system.solve_lit(&emittance, &lamps.incoming);
        let emitted: f64 = emittance.iter().zip(system.exchange().areas()).map(|(e, a)| e * a).sum();
        let total_power = emitted + lamps.total_power;
        Ok(Exact {
            form_factors: FormFactors::Given,
            xi: system.xi(),
            squared: OnceLock::new(),
            system,
            emittance,
            lamps,
            solution,
            total_power,
        })
    }

    /// How the form factors were found.
    pub fn form_factors(&self) -> &FormFactors {
        &self.form_factors
    }

    /// The exchange areas and form factors of all pairs of faces.
    pub fn exchange(&self) -> &ExchangeMatrix {
        self.system.exchange()
    }

    /// The factored system, which solves for other emittances at little cost.
    pub fn system(&self) -> &RadiositySystem {
        &self.system
    }

    /// The number of faces n.
    pub fn face_count(&self) -> usize {
        self.emittance.len()
    }

    /// A_i [m²] of every face.
    pub fn areas(&self) -> &[f64] {
        self.exchange().areas()
    }

    /// R_i of every face.
    pub fn reflectance(&self) -> &[f64] {
        self.system.reflectance()
    }

    /// E_i [W/m²] of every face.
    pub fn emittance(&self) -> &[f64] {
        &self.emittance
    }

    /// What lamps without area bring.
    pub fn lamps(&self) -> &LampLight {
        &self.lamps
    }

    /// Φ_T: total emitted power, that of lamps included [W].
    pub fn total_power(&self) -> f64 {
        self.total_power
    }

    /// B, b, H, φ and the residual.
    pub fn solution(&self) -> &SystemSolution {
        &self.solution
    }

    /// ξ_i: incoming power on face i when it alone emits unit power.
    pub fn xi(&self) -> &[f64] {
        &self.xi
    }

    /// The solution of the scene whose every reflectance is replaced by its square (SInf §3): its incoming powers
    /// are ψ_i [W], its reflected radiosities β_i [W/m²].
    pub fn squared_solution(&self) -> &SystemSolution {
        &self.squared().solution
    }

    /// The solution where face `source` emits what it does and no other does anything: its reflected radiosities
    /// are b_is [W/m²].
    ///
    /// # Panics
    /// If there is no such face.
    pub fn solution_of_source(&self, source: usize) -> SystemSolution {
        self.system.solve(&self.alone(source))
    }

    /// The solution of [`Self::solution_of_source`] with every reflectance replaced by its square: β_is [W/m²].
    ///
    /// # Panics
    /// If there is no such face.
    pub fn squared_solution_of_source(&self, source: usize) -> SystemSolution {
        self.squared().system.solve(&self.alone(source))
    }

    /// The emittances of all faces but one put out.
    fn alone(&self, source: usize) -> Vec<f64> {
        let mut alone = vec![0.0; self.face_count()];
        alone[source] = self.emittance[source];
        alone
    }

    /// The scene of squared reflectances, solved when first asked for.
    pub(crate) fn squared(&self) -> &Squared {
        self.squared.get_or_init(|| {
            let squares = self.system.reflectance().iter().map(|r| r * r).collect();
            let system = self.system.with_reflectance(squares);
            let system = system.expect("R² < R where R > 0, and with R the system is regular");
            let solution = system.solve_lit(&self.emittance, &self.lamps.incoming);
            Squared { system, solution }
        })
    }
}

fn check_size(spec: &SceneSpec) -> Result<(), ExactError> {
    let patches = spec.surfaces.iter().fold(0_u64, |sum, s| sum.saturating_add(s.shape.cell_count()));
    if patches <= MAX_PATCHES {
        return Ok(());
    }
    let gigabytes = 16e-9 * (patches as f64).powi(2);
    Err(ExactError::TooManyPatches { patches, gigabytes })
}

/// Work and memory grow with the square of the faces. A partly hidden pair costs about 50 µs, each surface that
/// might stand between 60 ns.
fn check_general_size(scene: &Scene, because: &NotABox) -> Result<(), ExactError> {
    let faces = scene.faces().piece_count() as u64;
    if faces <= MAX_GENERAL_FACES {
        return Ok(());
    }
    let square = (faces as f64).powi(2);
    let minutes = 0.5 * square * (5e-5 + 6e-8 * scene.surfaces().len() as f64) / 60.0;
    Err(ExactError::TooManyFaces { faces, minutes, gigabytes: 32e-9 * square, because: because.clone() })
}
