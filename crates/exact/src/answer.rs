//! Everything that is known exactly about a scene.

use std::sync::Arc;

use radiosity::{IndexChoice, Scene, SceneError, SceneSpec};
use thiserror::Error;

use crate::box_scene::{BoxScene, NotABox};
use crate::exchange::ExchangeMatrix;
use crate::system::{RadiositySystem, Singular, Solution};

/// The most patches that are solved for: two dense matrices of them take 1.6 GB.
pub const MAX_PATCHES: u64 = 10_000;

/// Why a scene cannot be solved exactly.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ExactError {
    /// The scene itself is not valid.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The geometry is not one whose form factors are known in closed form.
    #[error(transparent)]
    Geometry(#[from] NotABox),
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
    /// The system cannot be solved.
    #[error(transparent)]
    Singular(#[from] Singular),
}

/// The exact solution of a scene's radiosity system, and what predictions about walks need.
#[derive(Clone, Debug)]
pub struct Exact {
    system: RadiositySystem,
    emittance: Vec<f64>,
    total_power: f64,
    solution: Solution,
    xi: Vec<f64>,
}

impl Exact {
    /// Solves a scene that is a closed box of axis-aligned rectangles; vectors are in patch order.
    ///
    /// # Errors
    /// [`ExactError`], if the scene is not valid, not such a box, or too large.
    pub fn of_scene(spec: &SceneSpec) -> Result<Self, ExactError> {
        check_size(spec)?;
        let scene = Scene::build(spec, IndexChoice::Flat)?;
        let exchange = ExchangeMatrix::of_box(&BoxScene::recognise(spec)?);
        let reflectance = scene.patches().iter().map(|patch| patch.reflectance).collect();
        let emittance = scene.patches().iter().map(|patch| patch.emittance).collect();
        Ok(Self::new(Arc::new(exchange), reflectance, emittance)?)
    }

    /// Solves the system of given form factors, reflectances in [0, 1) and emittances [W/m²], one per patch.
    ///
    /// # Errors
    /// [`Singular`] if a reflectance is 1 to working precision.
    ///
    /// # Panics
    /// Unless there is one of each per patch.
    pub fn new(
        exchange: Arc<ExchangeMatrix>,
        reflectance: Vec<f64>,
        emittance: Vec<f64>,
    ) -> Result<Self, Singular> {
        let system = RadiositySystem::new(exchange, reflectance)?;
        let solution = system.solve(&emittance);
        let total_power = emittance.iter().zip(system.exchange().areas()).map(|(e, a)| e * a).sum();
        let xi = system.xi();
        Ok(Exact { system, emittance, total_power, solution, xi })
    }

    /// The form factors.
    pub fn exchange(&self) -> &ExchangeMatrix {
        self.system.exchange()
    }

    /// The factored system, which solves for other emittances at little cost.
    pub fn system(&self) -> &RadiositySystem {
        &self.system
    }

    /// E_i [W/m²] of every patch.
    pub fn emittance(&self) -> &[f64] {
        &self.emittance
    }

    /// Φ_T: total self-emitted power [W].
    pub fn total_power(&self) -> f64 {
        self.total_power
    }

    /// B, b, H, φ and the residual.
    pub fn solution(&self) -> &Solution {
        &self.solution
    }

    /// ξ_i: incoming power on patch i when it alone emits unit power.
    pub fn xi(&self) -> &[f64] {
        &self.xi
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
