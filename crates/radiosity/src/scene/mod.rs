//! The scene that walks run in: valid and immutable once built.

pub(crate) mod births;
mod check;
pub(crate) mod cones;
mod groups;
pub(crate) mod lamps;
mod lit_parts;
pub(crate) mod panes;
pub(crate) mod repeat;
pub(crate) mod retracing;
pub(crate) mod scatter;
pub(crate) mod sealed;
pub(crate) mod sheets;
pub(crate) mod tables;
mod traced;
pub(crate) mod view;

use std::sync::{Arc, OnceLock};

use glam::DVec3;
use thiserror::Error;

use crate::executor::{self, ParallelFor, in_turn};
use crate::geometry::basis::LinearBasis;
use crate::geometry::face::{Face, Faces};
use crate::geometry::frame::Frames;
use crate::geometry::lamp::LampSpec;
use crate::geometry::landing::Landings;
use crate::geometry::leaf_table::LeafTable;
use crate::geometry::pane::PaneSpec;
use crate::geometry::piece::Pieces;
use crate::geometry::places::Places;
use crate::geometry::planes::{Body, Planes};
use crate::geometry::spec::Side;
use crate::geometry::spec::{SKY, SceneSpec, Shape, Spectrum};
use crate::geometry::surface::Surface;
use crate::geometry::tints::Tints;
use crate::random::rng::{WalkRng, unit_32};
use crate::simd::isa::Isa;
use crate::trace::Index;
use crate::trace::facet::Facets;
use crate::trace::ray::Ray;
use crate::trace::stack::Stack;
use births::{Birthplace, Births, Origin};
use lamps::PointLamps;
use lit_parts::LitParts;
use panes::Panes;
use scatter::Scatter;
use sealed::Sealed;
use sheets::Sheets;

/// What is wrong with a scene. `surface` counts from 0.
///
/// ```
/// use radiosity::{IndexChoice, Scene, SceneError, SceneSpec};
///
/// let mirror = SceneSpec::furnace(1, 1.0);
/// let Err(SceneError::Surface { surface, key, problem }) = Scene::build(&mirror, IndexChoice::Auto) else {
///     panic!("a reflectance of 1 is refused");
/// };
/// assert_eq!((surface, key), (0, "reflectance"), "{problem}");
/// ```
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
///
/// ```
/// use radiosity::{IndexChoice, Scene, SceneSpec};
///
/// let cube = SceneSpec::furnace(1, 0.5);
/// assert!(!Scene::build(&cube, IndexChoice::Auto)?.has_tree(), "six squares need none");
/// assert!(Scene::build(&cube, IndexChoice::Tree)?.has_tree());
/// # Ok::<(), radiosity::SceneError>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum IndexChoice {
    /// A tree where there are more than a handful of surfaces.
    #[default]
    Auto,
    /// No tree: each ray meets every surface.
    Flat,
    /// A tree, however few there are.
    Tree,
    /// As [`IndexChoice::Auto`], by a tree that is built faster: for few rays.
    Draft,
}

/// Surfaces, patches, emitters, and the index that rays are traced with. Clones share all of it.
///
/// ```
/// use radiosity::{IndexChoice, Scene, SceneSpec};
///
/// let scene = Scene::build(&SceneSpec::furnace(3, 0.5), IndexChoice::Auto)?;
/// assert_eq!(scene.faces().into_iter().count(), 54);
/// assert!((scene.total_power(0) - 3.0).abs() < 1e-12, "six faces of 1 m² that emit 0.5 W/m²");
/// # Ok::<(), radiosity::SceneError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Scene {
    pub(crate) parts: Arc<Parts>,
}

/// What a scene consists of.
#[derive(Clone, Debug)]
pub(crate) struct Parts {
    names: Vec<Arc<str>>,
    surfaces: Vec<Surface>,
    faces: Faces,
    channels: usize,
    power: [f64; 3],
    emitters: Births,
    pub(crate) lamps: PointLamps,
    pub(crate) panes: Panes,
    pub(crate) sheets: Sheets,
    /// How the scene repeats; `None` where there is one copy of it.
    pub(crate) repeat: Option<repeat::Repeat>,
    /// Points of patches that are groups of cells, made when a walk first asks for them; `None` where every cell is a patch.
    scatter: OnceLock<Option<Scatter>>,
    max_reflectance: Spectrum,
    origin: DVec3,
    pub(crate) isa: Isa,
    pub(crate) frames: Arc<Frames>,
    pub(crate) landings: Landings,
    pub(crate) tints: Tints,
    /// Where arrivals find their leaves; `None` where no surface is cut into leaves.
    pub(crate) places: Option<Places>,
    /// The linear bases of groups, made when a method first asks for them; `None` where every cell is a patch.
    planes: OnceLock<Option<Planes>>,
    /// Faces that light cannot reach, found when precision is first judged with faces unhit.
    sealed: OnceLock<Sealed>,
    lit_parts: OnceLock<Arc<LitParts>>,
    stacks: Arc<[Stack]>,
    pub(crate) facets: Arc<Facets>,
    pub(crate) index: Arc<Index>,
    hash: [u8; 32],
}

/// A cell of a surface, by the numbers of both.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfaceCell {
    pub(crate) surface: u32,
    pub(crate) cell: u32,
}

/// The memory that the parts of a scene take [bytes].
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
        Scene::build_on(spec, index, &in_turn)
    }

    /// [`Scene::build`] on the threads of an executor, for scenes of many surfaces.
    ///
    /// # Errors
    /// As [`Scene::build`].
    pub fn build_on(
        spec: &SceneSpec,
        index: IndexChoice,
        executor: &ParallelFor,
    ) -> Result<Self, SceneError> {
        Scene::build_with(spec, (index, Isa::best()), executor)
    }

    /// Builds a scene whose walks take no instruction of AVX-512, to measure what processors without it would do.
    ///
    /// # Errors
    /// As [`Scene::build`].
    pub fn build_without_avx512(spec: &SceneSpec, index: IndexChoice) -> Result<Self, SceneError> {
        Scene::build_with(spec, (index, Isa::best_without_avx512()), &in_turn)
    }

    /// Builds a scene for walks on an instruction set that this machine has.
    #[cfg(test)]
    pub(crate) fn build_for(spec: &SceneSpec, index: IndexChoice, isa: Isa) -> Result<Self, SceneError> {
        Scene::build_with(spec, (index, isa), &in_turn)
    }

    fn build_with(
        spec: &SceneSpec,
        (index, isa): (IndexChoice, Isa),
        executor: &ParallelFor,
    ) -> Result<Self, SceneError> {
        let [min, max] = extent(spec);
        let trace = |surfaces: &mut [Surface], births: f64| {
            traced::Traced::new(surfaces, (slack(min, max), births), (index, isa), executor)
        };
        Scene::assemble(spec, isa, executor, trace)
    }

    /// A scene of the same surfaces in other cells, or with other groups: what rays find surfaces by is kept, all else is given up before the new
    /// scene is made. It is the scene that [`Scene::build`] makes.
    ///
    /// # Errors
    /// As [`Scene::build`].
    ///
    /// # Panics
    /// Where the surfaces are others.
    pub fn recut(self, spec: &SceneSpec) -> Result<Self, SceneError> {
        assert!(self.has_surfaces_of(spec), "a scene is cut anew in the same surfaces");
        if self.is_of(spec) {
            return Ok(self);
        }
        let Parts { frames, stacks, facets, index, isa, .. } = &*self.parts;
        let traced = traced::Traced {
            frames: frames.clone(),
            stacks: stacks.clone(),
            facets: facets.clone(),
            index: index.clone(),
        };
        let isa = *isa;
        drop(self);
        Scene::assemble(spec, isa, &in_turn, |surfaces, _| {
            traced::lie_in(surfaces, &traced.stacks);
            traced
        })
    }

    /// Whether this is the scene that would be made of a valid one, with the same names.
    fn is_of(&self, spec: &SceneSpec) -> bool {
        let parts = &*self.parts;
        parts.names == names(spec) && parts.hash == hash(spec, !parts.stacks.is_empty())
    }

    /// Whether rays find the same surfaces in the scene that this would make: of the same corners and sides, in the same order.
    pub fn has_surfaces_of(&self, spec: &SceneSpec) -> bool {
        let own = self.faces().shapes().map(Shape::edges).zip(self.surfaces().iter().map(Surface::sides));
        own.eq(spec.surfaces.iter().map(|surface| (surface.shape.edges(), surface.sides)))
    }

    /// Checks a scene and puts it together; `trace` makes what rays need of its surfaces.
    fn assemble(
        spec: &SceneSpec,
        isa: Isa,
        executor: &ParallelFor,
        trace: impl FnOnce(&mut [Surface], f64) -> traced::Traced,
    ) -> Result<Self, SceneError> {
        check::check(spec)?;
        let pieces = Pieces::new(spec);
        groups::check_groups(spec, &pieces)?;
        let [min, max] = extent(spec);
        let origin = 0.5 * (min + max);

        let faces = Faces::new(pieces, &spec.patch_of_cell);
        let mut surfaces = executor::collect(executor, spec.surfaces.len(), |number| {
            let first = |side| faces.first_piece_on(number as u32, side);
            let front = first(Side::Front).expect("every surface has a front");
            Surface::new(&spec.surfaces[number], front, first(Side::Back), origin)
        });
        let channels = spec.channels();
        let lamps = PointLamps::new(&spec.lamps, ([min, max], has_sky(spec)), slack(min, max))?;
        let panes = Panes::new(&spec.panes, origin)?;
        let (emitters, power) = emission(&surfaces, &faces, &lamps, channels)?;
        let traced::Traced { frames, stacks, facets, index } = trace(&mut surfaces, lamps.farthest_birth());
        let places = Places::new(&surfaces, &faces);
        let sheets = Sheets::new(&spec.surfaces, &stacks)?;
        let hash = hash(spec, !stacks.is_empty());
        let most = |c: usize| spec.surfaces.iter().fold(0.0, |max: f64, s| max.max(s.passed_on()[c]));
        let parts = Parts {
            names: names(spec),
            isa,
            frames,
            landings: Landings::new(&surfaces, places.as_ref()),
            tints: Tints::new(&surfaces, channels),
            places,
            planes: OnceLock::new(),
            sealed: OnceLock::new(),
            lit_parts: OnceLock::new(),
            scatter: OnceLock::new(),
            surfaces,
            faces,
            channels,
            power,
            emitters,
            lamps,
            panes,
            sheets,
            repeat: None,
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

    /// The highest probability in the scene that light goes on, by reflection or transmission, channel by channel.
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
        matches!(*self.parts.index, Index::Tree(_))
    }

    /// How many boxes a node of that tree holds.
    pub fn tree_width(&self) -> Option<usize> {
        self.has_tree().then_some(crate::trace::tree::WIDTH)
    }

    /// What the scene takes of memory while it is walked in.
    pub fn memory(&self) -> Memory {
        let parts = &*self.parts;
        let names: usize = parts.names.iter().map(|name| size_of_val(name) + name.len()).sum();
        let stacks: usize = parts.stacks.iter().map(|stack| size_of_val(&stack.surfaces[..])).sum();
        let leaves = parts.surfaces.iter().filter_map(Surface::leaves).map(LeafTable::bytes).sum();
        let tables = [
            leaves,
            size_of_val(&parts.surfaces[..]),
            parts.faces.bytes(),
            parts.emitters.bytes(),
            parts.lamps.bytes(),
            parts.panes.bytes(),
            parts.sheets.bytes(),
            parts.scatter.get().and_then(Option::as_ref).map_or(0, Scatter::bytes),
            parts.frames.bytes(),
            parts.landings.bytes(),
            parts.tints.bytes(),
            parts.places.as_ref().map_or(0, Places::bytes),
            parts.planes.get().and_then(Option::as_ref).map_or(0, Planes::bytes),
            parts.facets.bytes(),
        ];
        Memory { surfaces: names + stacks + tables.iter().sum::<usize>(), index: parts.index.bytes() }
    }

    /// The surfaces before the box that stands for the sky: all, unless the last six are black, emit, and are called [`SKY`]. The box is
    /// around the room, not in it.
    pub fn surfaces_before_sky(&self) -> usize {
        let all = self.surfaces().len();
        if self.parts.lamps.has_sky { all - SKY_SIDES } else { all }
    }

    /// A digest of all that walks can see: geometry, cells, sides, reflectances, emittances, lamps, panes.
    pub fn hash(&self) -> [u8; 32] {
        self.parts.hash
    }

    /// The ray with which a walk is born: from a uniform point of an emitting face, by the cosine law, or from a lamp without area, by
    /// its own distribution. Emitter s is chosen with probability Φ_s/Φ_T.
    pub(crate) fn emit(&self, rng: &mut WalkRng) -> Ray {
        self.birth(std::array::from_fn(|_| rng.bits()))
    }

    /// The ray of a birth that four times 64 random bits choose.
    pub(crate) fn birth(&self, [choice, place, point, direction]: [u64; 4]) -> Ray {
        match self.emitters().choose::<1>([choice, place]).0 {
            Birthplace::Lamp(lamp) => self.parts.lamps.birth(lamp, [place, point, direction]),
            Birthplace::Cell(Origin { surface: from, cell, side }) => {
                let surface = &self.surfaces()[from as usize];
                let point = surface.point_in_cell(cell, [(point >> 32) as u32, point as u32].map(unit_32));
                Ray { origin: surface.point(point), direction: surface.direction(side, direction), from }
            }
        }
    }

    /// The face that is, or that holds, an active side of a cell of a surface.
    #[inline(always)]
    pub fn face_at(&self, surface: u32, cell: u32, side: Side) -> u32 {
        self.parts.faces.face_of(self.parts.surfaces[surface as usize].piece(cell, side))
    }

    /// Points of patches that are groups of cells; `None` where every cell is a patch.
    #[inline(always)]
    pub(crate) fn points_of_groups(&self) -> Option<&Scatter> {
        let make = || self.faces().are_grouped().then(|| Scatter::new(self.faces(), self.surfaces()));
        self.parts.scatter.get_or_init(make).as_ref()
    }

    /// The cell of a surface that a face consists of, or that a piece of a face is a side of.
    #[inline(always)]
    pub(crate) fn cell_of(&self, face: &Face) -> SurfaceCell {
        SurfaceCell { surface: face.surface, cell: self.surfaces()[face.surface as usize].cell_of(face) }
    }

    /// Surface and local coordinates of the uniform point of a face that 64 random bits choose, given a cell of the face.
    #[inline(always)]
    pub(crate) fn scatter(&self, cell: SurfaceCell, face: u32, bits: u64) -> (u32, [f64; 2]) {
        match self.points_of_groups() {
            None => self.point_in_cell(cell, bits),
            Some(scatter) => self.point_in_group(scatter, cell, face, bits),
        }
    }

    /// [`Scene::scatter`] where faces are groups of cells. It stands apart, so that scenes without groups do not pay for it.
    #[inline(never)]
    fn point_in_group(&self, scatter: &Scatter, cell: SurfaceCell, face: u32, bits: u64) -> (u32, [f64; 2]) {
        match scatter.choose(face, bits) {
            None => self.point_in_cell(cell, bits),
            Some(([surface, cell], point)) => {
                (surface, self.surfaces()[surface as usize].point_in_cell(cell, point))
            }
        }
    }

    /// The uniform point of a cell of a surface.
    #[inline(always)]
    fn point_in_cell(&self, SurfaceCell { surface, cell }: SurfaceCell, bits: u64) -> (u32, [f64; 2]) {
        let point = [(bits >> 32) as u32, bits as u32].map(unit_32);
        (surface, self.surfaces()[surface as usize].point_in_cell(cell, point))
    }

    /// The linear bases of a scene whose patches are groups; `None` where every cell is a patch.
    #[inline(always)]
    pub(crate) fn planes(&self) -> Option<&Planes> {
        let make = || Planes::new(self.surfaces(), self.faces());
        self.parts.planes.get_or_init(make).as_ref()
    }

    /// By face: the part of its area that light comes to by paths that go on from where they arrive, above 0 where a face was `hit`. The executor
    /// runs the search for it, once for each scene: a second and more among a million faces.
    pub fn lit_parts(&self, hit: &[bool], executor: &ParallelFor) -> Vec<f64> {
        self.searched_parts(executor).given(self, hit, executor)
    }

    /// Searches ahead for what [`Scene::lit_parts`] needs of the scene.
    pub fn search_for_light(&self, executor: &ParallelFor) {
        self.searched_parts(executor);
    }

    fn searched_parts(&self, executor: &ParallelFor) -> &LitParts {
        self.parts.lit_parts.get_or_init(|| Arc::new(LitParts::new(self, executor)))
    }

    /// The faces that no path of light joins to an emitter, where paths go on from any point of a face.
    pub fn sealed(&self) -> &Sealed {
        self.parts.sealed.get_or_init(|| Sealed::new(self))
    }

    /// The linear basis of a face.
    pub(crate) fn basis_of(&self, face: &Face) -> LinearBasis {
        match self.planes() {
            None => LinearBasis::of(self.surfaces()[face.surface as usize].is_triangle()),
            Some(planes) => planes.basis(face.patch),
        }
    }

    /// How the area of a patch is spread.
    pub fn body_of(&self, patch: u32) -> Body {
        match self.planes() {
            // The number of a patch is that of its front, a piece.
            None => Body::of_cell(&self.faces().piece_corners(patch)),
            Some(planes) => planes.body(patch),
        }
    }

    /// Where shooting walks are born: emitters, with probability Φ_s/Φ_T.
    pub(crate) fn emitters(&self) -> &Births {
        &self.parts.emitters
    }
}

/// Where walks are born, and Φ_T of each channel [W]: some light must be emitted, and not without end.
fn emission(
    surfaces: &[Surface],
    faces: &Faces,
    lamps: &PointLamps,
    channels: usize,
) -> Result<(Births, [f64; 3]), SceneError> {
    // Piece by piece, so that groups change no bit of it.
    let lit: Vec<Face> = faces.pieces_of_emitters().map(|piece| faces.piece(piece)).collect();
    let power = std::array::from_fn(|c| {
        let of_lamps: f64 = (0..lamps.len()).map(|lamp| lamps.power(lamp, c)).sum();
        lit.iter().map(|piece| piece.power(c)).sum::<f64>() + of_lamps
    });
    let Some(emitters) = Births::of_emitters(surfaces, faces, lamps, channels, power) else {
        return Err(SceneError::Whole(
            "the scene has no emitter (no walk could start); give a material an `emittance` above 0, or a surface an `emit`, or add a [[lamp]]".into(),
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

/// The corners of the box around a scene [m].
fn extent(spec: &SceneSpec) -> [DVec3; 2] {
    let corners = || spec.surfaces.iter().flat_map(|surface| surface.shape.corners());
    [corners().fold(DVec3::INFINITY, DVec3::min), corners().fold(DVec3::NEG_INFINITY, DVec3::max)]
}

/// The surfaces that stand for the sky.
const SKY_SIDES: usize = 6;

/// Whether the last surfaces stand for the sky ([`Scene::surfaces_before_sky`]).
fn has_sky(spec: &SceneSpec) -> bool {
    let is_side = |surface: &crate::SurfaceSpec| {
        let is_black = !surface.reflectance.is_lit();
        is_black && surface.emittance.is_lit() && surface.name.as_deref() == Some(SKY)
    };
    spec.surfaces.len() > SKY_SIDES && spec.surfaces.iter().rev().take(SKY_SIDES).all(is_side)
}

/// By how much a facet is larger than its surface, on every edge [m]: 2⁻⁴⁶ of the largest coordinate or
/// extent, 128 times the rounding of such a coordinate. Vertices that were meant to coincide differ by a few
/// such roundings; nothing may fall through between them.
fn slack(min: DVec3, max: DVec3) -> f64 {
    let largest = min.abs().max(max.abs()).max(max - min).max_element();
    largest / (1_u64 << 46) as f64
}

fn names(spec: &SceneSpec) -> Vec<Arc<str>> {
    let name = |(number, surface): (usize, &crate::SurfaceSpec)| {
        surface.name.clone().unwrap_or_else(|| number.to_string().into())
    };
    spec.surfaces.iter().enumerate().map(name).collect()
}

/// Bytes that are hashed at once.
const HASHED: usize = 1 << 16;

fn hash(spec: &SceneSpec, layered: bool) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    // Many bytes at once are hashed side by side.
    let mut bytes = Vec::with_capacity(HASHED + (1 << 10));
    let mut numbers = |values: &[f64]| {
        bytes.extend(values.iter().flat_map(|value| value.to_bits().to_le_bytes()));
        if bytes.len() >= HASHED {
            hasher.update(&bytes);
            bytes.clear();
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
    hasher.update(&bytes);
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
        let bytes: Vec<u8> = spec.patch_of_cell.iter().flat_map(|patch| patch.to_le_bytes()).collect();
        hasher.update(&bytes);
    }
    if !spec.lamps.list.is_empty() {
        // Results from before sensors and faces had scales of their own are of another scene.
        hasher.update(b"lamps, by distance");
        let tables = spec.lamps.tables.iter().flat_map(|table| table.numbers());
        for number in spec.lamps.list.iter().flat_map(LampSpec::numbers).chain(tables) {
            hasher.update(&number.to_bits().to_le_bytes());
        }
    }
    if spec.surfaces.iter().any(|surface| surface.transmittance.is_lit()) {
        hasher.update(b"transmittances");
        for number in spec.surfaces.iter().flat_map(|surface| surface.transmittance.channels()) {
            hasher.update(&number.to_bits().to_le_bytes());
        }
    }
    if !spec.panes.is_empty() {
        hasher.update(b"panes");
        for number in spec.panes.iter().flat_map(PaneSpec::numbers) {
            hasher.update(&number.to_bits().to_le_bytes());
        }
    }
    *hasher.finalize().as_bytes()
}
