//! Everything that is known exactly about a scene.

use std::sync::{Arc, OnceLock};

use radiosity::{IndexChoice, Scene, SceneError, SceneSpec, SurfaceSpec};
use thiserror::Error;

use crate::accuracy::FormFactors;
use crate::box_scene::{BoxScene, NotABox};
use crate::exchange::ExchangeMatrix;
use crate::faces::Faces;
use crate::general;
use crate::system::{RadiositySystem, Singular, Solution};

/// The most patches that are solved for: two dense matrices of them take 1.6 GB.
pub const MAX_PATCHES: u64 = 10_000;

/// The most faces (patches, those with two sides twice) of a scene that is not a closed axis-aligned box.
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
        "the scene has {faces} patch sides, more than {MAX_GENERAL_FACES} (form factors with shadows would \
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
    /// The system cannot be solved.
    #[error(transparent)]
    Singular(#[from] Singular),
}

/// The exact solution of a scene's radiosity system, and what predictions about walks need. Vectors are in
/// patch order; a two-sided patch reports the mean of its sides (B, b, H) or their sum (A, φ).
#[derive(Clone, Debug)]
pub struct Exact {
    form_factors: FormFactors,
    faces: Faces,
    system: RadiositySystem,
    /// E [W/m²] of every face.
    emittance: Vec<f64>,
    /// The solution face by face.
    by_face: Solution,
    solution: Solution,
    areas: Vec<f64>,
    total_power: f64,
    /// ξ of every face: incoming power on all sides of its patch when it alone emits unit power.
    xi_by_face: Vec<f64>,
    xi: Vec<f64>,
    squared: OnceLock<Squared>,
}

/// The same scene with every reflectance replaced by its square, face by face: ψ, β (SInf §3).
#[derive(Clone, Debug)]
pub(crate) struct Squared {
    pub system: RadiositySystem,
    pub solution: Solution,
}

impl Exact {
    /// Solves a scene: closed boxes of axis-aligned rectangles in closed form, to about 10⁻¹²; any other, open
    /// or closed, with shadows, to what [`crate::Accuracy::of`] then says. Every machine finds the same, however many
    /// threads it has, but for the last digits of its mathematical functions.
    ///
    /// # Errors
    /// [`ExactError`], if the scene is not valid or too large.
    pub fn of_scene(spec: &SceneSpec) -> Result<Self, ExactError> {
        check_size(spec)?;
        let scene = Scene::build(spec, IndexChoice::Flat)?;
        let (form_factors, faces, exchange) = match BoxScene::recognise(spec) {
            Ok(closed) => {
                let faces = Faces::one_sided(scene.patches().len());
                (FormFactors::ClosedForm, faces, ExchangeMatrix::of_box(&closed))
            }
            Err(because) => {
                check_general_size(spec, &because)?;
                let (faces, exchange) = general::exchange(spec);
                (FormFactors::General { because }, faces, exchange)
            }
        };
        let reflectance: Vec<f64> = scene.patches().iter().map(|patch| patch.reflectance[0]).collect();
        let emittance: Vec<f64> = scene.patches().iter().map(|patch| patch.emittance[0]).collect();
        let exact = Self::of_faces(faces, Arc::new(exchange), &reflectance, &emittance)?;
        Ok(Exact { form_factors, ..exact })
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
        let faces = Faces::one_sided(exchange.face_count());
        Self::of_faces(faces, exchange, &reflectance, &emittance)
    }

    /// Solves for faces whose form factors are given, and patches of given reflectance and emittance.
    fn of_faces(
        faces: Faces,
        exchange: Arc<ExchangeMatrix>,
        reflectance: &[f64],
        emittance: &[f64],
    ) -> Result<Self, Singular> {
        let emittance = faces.spread(emittance);
        let system = RadiositySystem::new(exchange, faces.spread(reflectance))?;
        let by_face = system.solve(&emittance);
        let areas = faces.sum(system.exchange().areas());
        let total_power = emittance.iter().zip(system.exchange().areas()).map(|(e, a)| e * a).sum();
        let xi_by_face = xi_by_face(&faces, &system);
        Ok(Exact {
            form_factors: FormFactors::Given,
            solution: by_face.by_patch(&faces),
            xi: faces.weighted_mean(&xi_by_face, &by_face.incoming),
            squared: OnceLock::new(),
            faces,
            system,
            emittance,
            by_face,
            areas,
            total_power,
            xi_by_face,
        })
    }

    /// How the form factors were found.
    pub fn form_factors(&self) -> &FormFactors {
        &self.form_factors
    }

    /// The form factors, face by face.
    pub fn exchange(&self) -> &ExchangeMatrix {
        self.system.exchange()
    }

    /// The factored system of the faces, which solves for other emittances at little cost.
    pub fn system(&self) -> &RadiositySystem {
        &self.system
    }

    /// Which faces the patches have.
    pub fn faces(&self) -> &Faces {
        &self.faces
    }

    /// The number of patches n.
    pub fn patch_count(&self) -> usize {
        self.faces.patch_count()
    }

    /// A_i [m²] of every patch: the area that exchanges light, that of both sides of a two-sided patch.
    pub fn areas(&self) -> &[f64] {
        &self.areas
    }

    /// R_i of every patch.
    pub fn reflectance(&self) -> &[f64] {
        &self.system.reflectance()[..self.patch_count()]
    }

    /// E_i [W/m²] of every patch.
    pub fn emittance(&self) -> &[f64] {
        &self.emittance[..self.patch_count()]
    }

    /// Φ_T: total self-emitted power [W].
    pub fn total_power(&self) -> f64 {
        self.total_power
    }

    /// B, b, H, φ and the residual.
    pub fn solution(&self) -> &Solution {
        &self.solution
    }

    /// B, b, H, φ face by face.
    pub fn solution_by_face(&self) -> &Solution {
        &self.by_face
    }

    /// ξ_i: incoming power on patch i when it alone emits unit power; from its sides, if it has two, in the
    /// proportion of what arrives on them, which is the ξ_i that the variances of shooting depend on.
    pub fn xi(&self) -> &[f64] {
        &self.xi
    }

    /// The solution of the scene whose every reflectance is replaced by its square (SInf §3): its incoming powers
    /// are ψ_i [W], its reflected radiosities β_i [W/m²].
    pub fn squared_solution(&self) -> Solution {
        self.squared().solution.by_patch(&self.faces)
    }

    /// The solution where patch `source` emits what it does and no other does anything: its reflected radiosities
    /// are b_is [W/m²].
    ///
    /// # Panics
    /// If there is no such patch.
    pub fn solution_of_source(&self, source: usize) -> Solution {
        self.system.solve(&self.alone(source)).by_patch(&self.faces)
    }

    /// The same with every reflectance replaced by its square: β_is [W/m²].
    ///
    /// # Panics
    /// If there is no such patch.
    pub fn squared_solution_of_source(&self, source: usize) -> Solution {
        self.squared().system.solve(&self.alone(source)).by_patch(&self.faces)
    }

    /// The emittances of all faces but those of one patch put out.
    fn alone(&self, source: usize) -> Vec<f64> {
        assert!(source < self.patch_count(), "patch {source} of {}", self.patch_count());
        let kept = |(face, &e): (usize, &f64)| if self.faces.patch_of(face) == source { e } else { 0.0 };
        self.emittance.iter().enumerate().map(kept).collect()
    }

    /// E [W/m²] of every face.
    pub(crate) fn emittance_by_face(&self) -> &[f64] {
        &self.emittance
    }

    /// ξ of every face, towards all sides of its patch.
    pub(crate) fn xi_by_face(&self) -> &[f64] {
        &self.xi_by_face
    }

    /// The scene of squared reflectances, solved when first asked for.
    pub(crate) fn squared(&self) -> &Squared {
        self.squared.get_or_init(|| {
            let squares = self.system.reflectance().iter().map(|r| r * r).collect();
            let system = self.system.with_reflectance(squares);
            let system = system.expect("R² < R where R > 0, and with R the system is regular");
            let solution = system.solve(&self.emittance);
            Squared { system, solution }
        })
    }
}

/// ξ of every face, towards all sides of its patch.
fn xi_by_face(faces: &Faces, system: &RadiositySystem) -> Vec<f64> {
    let mut xi = system.xi();
    let pairs = faces.pairs();
    for ([front, back], across) in pairs.iter().zip(system.xi_across(&pairs)) {
        xi[*front] += across;
        xi[*back] += across;
    }
    xi
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
fn check_general_size(spec: &SceneSpec, because: &NotABox) -> Result<(), ExactError> {
    let of_surface = |s: &SurfaceSpec| s.shape.cell_count() * s.sides.count() as u64;
    let faces = spec.surfaces.iter().map(of_surface).sum();
    if faces <= MAX_GENERAL_FACES {
        return Ok(());
    }
    let square = (faces as f64).powi(2);
    let minutes = 0.5 * square * (5e-5 + 6e-8 * spec.surfaces.len() as f64) / 60.0;
    Err(ExactError::TooManyFaces { faces, minutes, gigabytes: 32e-9 * square, because: because.clone() })
}
