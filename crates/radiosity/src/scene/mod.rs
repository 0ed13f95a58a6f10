//! The scene that walks run in: valid and immutable once built.

pub(crate) mod births;
mod groups;
pub(crate) mod retracing;
pub(crate) mod scatter;
pub(crate) mod view;

use std::sync::Arc;

use glam::DVec3;
use thiserror::Error;

use crate::geometry::face::Faces;
use crate::geometry::frame::Frames;
use crate::geometry::landing::Landings;
use crate::geometry::leaf_table::LeafTable;
use crate::geometry::places::Places;
use crate::geometry::spec::Side;
use crate::geometry::spec::{SceneSpec, Shape, Spectrum};
use crate::geometry::surface::Surface;
use crate::geometry::tints::Tints;
use crate::random::rng::{WalkRng, unit_32};
use crate::simd::isa::Isa;
use crate::trace::Index;
use crate::trace::coplanar::stacks;
use crate::trace::facet::Facets;
use crate::trace::flat::Flat;
use crate::trace::stack::Stack;
use crate::trace::tree::{BinaryTree, Tree};
use births::{Births, Origin};
use scatter::Scatter;

/// The most patches a scene may have: patch numbers are 32 bits wide.
const MAX_PATCHES: u64 = 1 << 31;

/// The most cells of the grids that hold the leaves of all surfaces: a table has the leaf of each.
const MAX_GRID_CELLS: u64 = 1 << 24;

/// Up to this many surfaces, meeting every facet is faster than a tree (with AVX-512 up to twice as many).
const FLAT_SURFACES: usize = 96;

/// What is wrong with a scene. `surface` counts from 0.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum SceneError {
    /// A value of one surface is not allowed.
    #[error("{problem}")]
    Surface {
        /// The number of the surface.
        surface: usize,
        /// The key at fault, as scene files write it.
        key: &'static str,
        /// The message: problem, reason, remedy.
        problem: String,
    },
    /// The scene as a whole is not allowed.
    #[error("{0}")]
    Whole(String),
}

/// How to look for the nearest surface. The answer is the same with each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum IndexChoice {
    /// A tree where there are more than a handful of surfaces.
    #[default]
    Auto,
    /// No tree: each ray meets every surface.
    Flat,
    /// A tree, however few there are.
    Tree,
}

/// Surfaces, patches, emitters, and the index that rays are traced with. Clones share all of it.
#[derive(Clone, Debug)]
pub struct Scene {
    pub(crate) parts: Arc<Parts>,
}

/// What a scene consists of.
#[derive(Clone, Debug)]
pub(crate) struct Parts {
    names: Vec<String>,
    surfaces: Vec<Surface>,
    faces: Faces,
    channels: usize,
    power: [f64; 3],
    emitters: Births,
    /// Points of patches that are groups of cells; `None` where every cell is a patch.
    pub(crate) scatter: Option<Scatter>,
    max_reflectance: Spectrum,
    origin: DVec3,
    pub(crate) isa: Isa,
    pub(crate) frames: Frames,
    pub(crate) landings: Landings,
    pub(crate) tints: Tints,
    /// Where arrivals find their leaves; `None` where no surface is cut into leaves.
    pub(crate) places: Option<Places>,
    stacks: Vec<Stack>,
    pub(crate) facets: Facets,
    pub(crate) index: Index,
    hash: [u8; 32],
}

/// What a scene takes of memory [bytes].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Memory {
    /// Surfaces with their names, faces, and the tables that walks look them up in.
    pub surfaces: usize,
    /// What rays find the nearest surface by: the tree, where there is one.
    pub index: usize,
}

impl Scene {
    /// Checks a scene and prepares it for walks.
    ///
    /// # Errors
    /// Names the surface and key at fault: a number that is not finite, a reflectance outside [0, 1), a
    /// negative emittance, no area, no cells; or a scene without surfaces, without emitters, with too many
    /// patches.
    pub fn build(spec: &SceneSpec, index: IndexChoice) -> Result<Self, SceneError> {
        Scene::build_for(spec, index, Isa::best())
    }

    /// Builds a scene for walks on an instruction set that this machine has.
    pub(crate) fn build_for(spec: &SceneSpec, index: IndexChoice, isa: Isa) -> Result<Self, SceneError> {
        check(spec)?;
        groups::check_groups(spec)?;
        let corners = || spec.surfaces.iter().flat_map(|surface| surface.shape.corners());
        let min = corners().fold(DVec3::INFINITY, DVec3::min);
        let max = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
        let origin = 0.5 * (min + max);
        let slack = slack(min, max);

        let faces = Faces::new(spec);
        let mut surfaces: Vec<Surface> = (0..)
            .zip(&spec.surfaces)
            .map(|(number, surface)| {
                let [front, back] = [Side::Front, Side::Back].map(|side| faces.first_piece_on(number, side));
                Surface::new(surface, front.expect("every surface has a front"), back, origin)
            })
            .collect();
        let channels = spec.channels();
        let (emitters, power) = emission(&surfaces, &faces, channels)?;
        let tree = match index {
            IndexChoice::Auto => surfaces.len() > FLAT_SURFACES,
            IndexChoice::Flat => false,
            IndexChoice::Tree => true,
        };
        let binary = tree.then(|| BinaryTree::new(&surfaces, slack));
        let stacks = stacks(&surfaces, slack, binary.as_ref());
        for stack in &stacks {
            stack.surfaces.iter().for_each(|&surface| surfaces[surface as usize].lie_in(stack.normal));
        }
        let facets = Facets::new(&surfaces, &stacks, slack);
        let index = match &binary {
            Some(binary) => Index::Tree(Tree::new(binary, &facets)),
            None => Index::Flat(Flat::new(isa, &surfaces, &facets)),
        };
        let places = Places::new(&surfaces, &faces);
        let hash = hash(spec, !stacks.is_empty());
        let most = |c: usize| spec.surfaces.iter().fold(0.0, |max: f64, s| max.max(s.reflectance[c]));
        let parts = Parts {
            names: names(spec),
            isa,
            frames: Frames::new(surfaces.iter().map(Surface::frame)),
            landings: Landings::new(&surfaces, places.as_ref()),
            tints: Tints::new(&surfaces, channels),
            places,
            scatter: faces.are_grouped().then(|| Scatter::new(&faces, &surfaces)),
            surfaces,
            faces,
            channels,
            power,
            emitters,
            max_reflectance: Spectrum::rgb(std::array::from_fn(most)),
            origin,
            stacks,
            facets,
            index,
            hash,
        };
        Ok(Scene { parts: Arc::new(parts) })
    }

    /// The surfaces, by number.
    pub fn surfaces(&self) -> &[Surface] {
        &self.parts.surfaces
    }

    /// The name that outputs show for a surface.
    pub fn surface_name(&self, surface: u32) -> &str {
        &self.parts.names[surface as usize]
    }

    /// The faces, by number.
    pub fn faces(&self) -> &Faces {
        &self.parts.faces
    }

    /// 1 where every reflectance and emittance is grey, else 3.
    pub fn channels(&self) -> usize {
        self.parts.channels
    }

    /// Φ_T: total self-emitted power in one channel [W].
    pub fn total_power(&self, channel: usize) -> f64 {
        self.parts.power[channel]
    }

    /// The highest reflectance in the scene, channel by channel.
    pub fn max_reflectance(&self) -> Spectrum {
        self.parts.max_reflectance
    }

    /// What scene coordinates are relative to, in the coordinates of the file [m].
    pub fn origin(&self) -> DVec3 {
        self.parts.origin
    }

    /// The surfaces that coincide, plane by plane.
    pub fn stacks(&self) -> &[Stack] {
        &self.parts.stacks
    }

    /// Whether rays are traced through a tree of boxes.
    pub fn has_tree(&self) -> bool {
        matches!(self.parts.index, Index::Tree(_))
    }

    /// How many boxes a node of that tree holds.
    pub fn tree_width(&self) -> Option<usize> {
        self.has_tree().then_some(crate::trace::tree::WIDTH)
    }

    /// What the scene takes of memory while it is walked in.
    pub fn memory(&self) -> Memory {
        let parts = &*self.parts;
        let names: usize = parts.names.iter().map(|name| size_of::<String>() + name.capacity()).sum();
        let stacks: usize = parts.stacks.iter().map(|stack| size_of_val(&stack.surfaces[..])).sum();
        let leaves = parts.surfaces.iter().filter_map(Surface::leaves).map(LeafTable::bytes).sum();
        let tables = [
            leaves,
            size_of_val(&parts.surfaces[..]),
            parts.faces.bytes(),
            parts.emitters.bytes(),
            parts.scatter.as_ref().map_or(0, Scatter::bytes),
            parts.frames.bytes(),
            parts.landings.bytes(),
            parts.tints.bytes(),
            parts.places.as_ref().map_or(0, Places::bytes),
            parts.facets.bytes(),
        ];
        Memory { surfaces: names + stacks + tables.iter().sum::<usize>(), index: parts.index.bytes() }
    }

    /// A digest of all that walks can see: geometry, cells, sides, reflectances, emittances.
    pub fn hash(&self) -> [u8; 32] {
        self.parts.hash
    }

    /// A walk is born on an emitter: surface, side and local coordinates of a uniform point of it. Face s is chosen with
    /// probability Φ_s/Φ_T.
    pub(crate) fn emit(&self, rng: &mut WalkRng) -> (u32, Side, [f64; 2]) {
        let ([choice, place], point) = ([rng.bits(), rng.bits()], rng.pair());
        let (Origin { surface, cell, side }, _) = self.emitters().choose::<1>([choice, place]);
        (surface, side, self.surfaces()[surface as usize].point_in_cell(cell, point))
    }

    /// The face that is, or that holds, an active side of a cell of a surface.
    #[inline(always)]
    pub fn face_at(&self, surface: u32, cell: u32, side: Side) -> u32 {
        self.parts.faces.face_of(self.parts.surfaces[surface as usize].piece(cell, side))
    }

    /// Surface and local coordinates of the uniform point of a face that 64 random bits choose, given a cell of the face.
    #[inline(always)]
    pub(crate) fn scatter(&self, cell: (u32, u32), face: u32, bits: u64) -> (u32, [f64; 2]) {
        match &self.parts.scatter {
            None => self.point_in_cell(cell, bits),
            Some(scatter) => self.point_in_group(scatter, cell, face, bits),
        }
    }

    /// [`Scene::scatter`] where faces are groups of cells. It stands apart, so that scenes without groups do not pay for it.
    #[inline(never)]
    fn point_in_group(&self, scatter: &Scatter, cell: (u32, u32), face: u32, bits: u64) -> (u32, [f64; 2]) {
        match scatter.choose(face, bits) {
            None => self.point_in_cell(cell, bits),
            Some(([surface, cell], point)) => {
                (surface, self.surfaces()[surface as usize].point_in_cell(cell, point))
            }
        }
    }

    /// The uniform point of a cell of a surface.
    #[inline(always)]
    fn point_in_cell(&self, (surface, cell): (u32, u32), bits: u64) -> (u32, [f64; 2]) {
        let point = [(bits >> 32) as u32, bits as u32].map(unit_32);
        (surface, self.surfaces()[surface as usize].point_in_cell(cell, point))
    }

    /// Where shooting walks are born: emitters, with probability Φ_s/Φ_T.
    pub(crate) fn emitters(&self) -> &Births {
        &self.parts.emitters
    }
}

/// Whether every surface is valid, and there are neither none nor too many.
fn check(spec: &SceneSpec) -> Result<(), SceneError> {
    if spec.surfaces.is_empty() {
        return Err(SceneError::Whole(
            "the scene has no surface (nothing could be hit); add a [[surface]] or a [[mesh]]".into(),
        ));
    }
    for (number, surface) in spec.surfaces.iter().enumerate() {
        check_surface(surface).map_err(|(key, problem)| SceneError::Surface {
            surface: number,
            key,
            problem,
        })?;
    }
    let face_count: f64 = spec.surfaces.iter().map(|s| s.shape.cell_count() as f64 * s.sides.count()).sum();
    if face_count > MAX_PATCHES as f64 {
        return Err(SceneError::Whole(format!(
            "the scene has {face_count} patches (two-sided ones count twice), more than {MAX_PATCHES} (their numbers are 32 bits wide); use coarser `patches`"
        )));
    }
    let grid_cells = spec.surfaces.iter().map(|surface| match &surface.shape {
        Shape::Divided { leaves, .. } => leaves.grid().map(u64::from).iter().product::<u64>(),
        _ => 0,
    });
    let grid_cells: u64 = grid_cells.sum();
    if grid_cells > MAX_GRID_CELLS {
        return Err(SceneError::Whole(format!(
            "the rectangles that surfaces are cut into lie on grids of {grid_cells} cells, more than {MAX_GRID_CELLS} (walks look them up in a table); cut them less often"
        )));
    }
    Ok(())
}

/// Where walks are born, and Φ_T of each channel [W]: some light must be emitted, and not without end.
fn emission(surfaces: &[Surface], faces: &Faces, channels: usize) -> Result<(Births, [f64; 3]), SceneError> {
    // Piece by piece, so that groups change no bit of it.
    let pieces = || (0..faces.piece_count() as u32).map(|piece| faces.piece(piece));
    let power = std::array::from_fn(|c| pieces().map(|piece| piece.power(c)).sum());
    let Some(emitters) = Births::of_emitters(surfaces, faces, channels, power) else {
        return Err(SceneError::Whole(
            "the scene has no emitter (no walk could start); give a material an `emittance` above 0, or a surface an `emit`".into(),
        ));
    };
    if !power.iter().all(|power| power.is_finite()) {
        return Err(SceneError::Whole(
            "the emitted power of the scene is not finite (it overflows); give smaller `emittance`s or areas"
                .into(),
        ));
    }
    Ok((emitters, power))
}

/// By how much a facet is larger than its surface, on every edge [m]: 2⁻⁴⁶ of the largest coordinate or
/// extent, 128 times the rounding of such a coordinate. Vertices that were meant to coincide differ by a few
/// such roundings; nothing may fall through between them.
fn slack(min: DVec3, max: DVec3) -> f64 {
    let largest = min.abs().max(max.abs()).max(max - min).max_element();
    largest / (1_u64 << 46) as f64
}

type Fault = (&'static str, String);

fn check_surface(surface: &crate::SurfaceSpec) -> Result<(), Fault> {
    let outline = match surface.shape {
        Shape::Parallelogram { .. } | Shape::Divided { .. } => "quad",
        Shape::Triangle { .. } => "triangle",
    };
    let corners = surface.shape.corners();
    if !corners.iter().all(|corner| corner.is_finite()) {
        return Err((outline, "a corner is not a finite number; write finite coordinates in metres".into()));
    }
    let (_, e_u, e_v) = surface.shape.edges();
    let (area, extent) = (e_u.cross(e_v).length(), e_u.length() * e_v.length());
    let largest = corners.iter().fold(0.0_f64, |max, corner| max.max(corner.abs().max_element()));
    // Below this the direction of the normal is rounding noise.
    let noise = 8.0 * f64::EPSILON * largest * e_u.length().max(e_v.length());
    if !(area.is_finite() && extent.is_finite() && area > noise && area > 1e-12 * extent) {
        return Err((
            outline,
            format!(
                "the surface has no area ({area:e} m²; its corners coincide or lie on a line); remove it or move a corner"
            ),
        ));
    }
    if surface.shape.cell_count() == 0 {
        return Err((
            "patches",
            "a surface must have at least one patch; write 1 or more along each side".into(),
        ));
    }
    if surface.shape.cell_count() > MAX_PATCHES {
        return Err(("patches", format!("more than {MAX_PATCHES} patches on one surface; use fewer")));
    }
    check_reflectance(surface.reflectance).map_err(|problem| ("reflectance", problem))?;
    check_emittance(surface.emittance).map_err(|problem| ("emittance", problem))?;
    for &(cell, emittance) in &surface.cell_emittance {
        if u64::from(cell) >= surface.shape.cell_count() {
            return Err(("emit", format!("cell {cell} does not exist on this surface")));
        }
        check_emittance(emittance).map_err(|problem| ("emit", problem))?;
    }
    Ok(())
}

fn check_reflectance(reflectance: Spectrum) -> Result<(), String> {
    let outside = reflectance.channels().into_iter().find(|channel| !(0.0..1.0).contains(channel));
    outside.map_or(Ok(()), |outside| {
        Err(format!(
            "{outside} is outside [0, 1) (walks would never end, or power be negative); choose 0 ≤ reflectance < 1"
        ))
    })
}

fn check_emittance(emittance: Spectrum) -> Result<(), String> {
    let outside = emittance.channels().into_iter().find(|channel| !(channel.is_finite() && *channel >= 0.0));
    outside.map_or(Ok(()), |outside| {
        Err(format!(
            "{outside} is not a finite number ≥ 0 (surfaces cannot emit negative power); give W/m² ≥ 0"
        ))
    })
}

fn names(spec: &SceneSpec) -> Vec<String> {
    let name = |(number, surface): (usize, &crate::SurfaceSpec)| {
        surface.name.clone().unwrap_or_else(|| number.to_string())
    };
    spec.surfaces.iter().enumerate().map(name).collect()
}

fn hash(spec: &SceneSpec, layered: bool) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    let mut numbers = |values: &[f64]| {
        for value in values {
            hasher.update(&value.to_bits().to_le_bytes());
        }
    };
    for surface in &spec.surfaces {
        let (kind, cells) = match surface.shape {
            Shape::Parallelogram { cells, .. } => (0.0, cells),
            Shape::Triangle { rows, .. } => (1.0, [rows, 0]),
            Shape::Divided { ref leaves, .. } => (2.0, leaves.grid()),
        };
        numbers(&[kind, f64::from(cells[0]), f64::from(cells[1])]);
        for corner in surface.shape.corners() {
            numbers(&corner.to_array());
        }
        numbers(&[surface.sides.count()]);
        numbers(&surface.reflectance.channels());
        numbers(&surface.emittance.channels());
        numbers(&[surface.cell_emittance.len() as f64]);
        for &(cell, emittance) in &surface.cell_emittance {
            numbers(&[f64::from(cell)]);
            numbers(&emittance.channels());
        }
    }
    for surface in &spec.surfaces {
        if let Shape::Divided { leaves, .. } = &surface.shape {
            hasher.update(leaves.text().as_bytes());
        }
    }
    // Results from before there were layers are of another scene.
    if layered {
        hasher.update(b"layers");
    }
    // Those of scenes without groups stay what they were.
    if !spec.patch_of_cell.is_empty() {
        hasher.update(b"groups");
        spec.patch_of_cell.iter().for_each(|patch| {
            hasher.update(&patch.to_le_bytes());
        });
    }
    *hasher.finalize().as_bytes()
}
