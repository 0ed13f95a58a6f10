//! The scene file, read and checked: what it says, and where.

mod grouping;
mod read;
mod surface;

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use import::{Format, Imported, Mesh, Options, Spots};
use parallel::run_on_all_cores;
use radiosity::{
    IndexChoice, Scene, SceneError, SceneSpec, Shape, Spectrum, SurfaceSpec,
    lamps::LampsSpec,
    sensors::SensorSpec,
    surfaces::{Leaves, SKY},
};

use crate::cut::Cut;
use crate::error::{Error, SourceLocation, SourceSpot};
use crate::finishes::Finishes;
use crate::lighting::bounds;
use crate::partition::misfit;
use crate::planes::PlaneTarget;
use crate::site::{Lines, SurfaceSite};
use crate::sky::sky_box;
pub(crate) use read::{is_toml, unknown_format};
pub use read::{load_scene, load_scene_with};

/// A scene as written, and where.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneFile {
    path: PathBuf,
    spec: SceneSpec,
    /// Per surface of the file itself.
    sites: Vec<SurfaceSite>,
    /// The meshes, whose surfaces follow.
    meshes: Vec<MeshSite>,
    /// Name and lines of each material, by its number.
    materials: Vec<(String, Lines)>,
    finishes: Finishes,
    /// The surfaces whose cells are left to the program, in ascending order.
    auto: Vec<usize>,
    sensors: Vec<SensorSpec>,
    /// What is demanded of planes.
    demands: Vec<PlaneTarget>,
    /// The number of the first surface of the sky, behind all others; `None` without one.
    sky: Option<usize>,
    notes: Vec<String>,
    /// The textures of imported materials, by the names of these.
    textures: HashMap<String, String>,
    /// Whether the light of an imported scene is in lumens.
    luminous: bool,
    /// The unit that an imported file is likely to be written in [m], where that is not the one taken.
    likely_unit: Option<f64>,
}

/// What one material of a scene covers.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialRow {
    /// Its name; `sky` for that.
    pub name: String,
    /// How many surfaces have it.
    pub surfaces: u64,
    /// The area of its surfaces [m²].
    pub area: f64,
    /// Its reflectance.
    pub reflectance: Spectrum,
    /// The emittance of each active side [W/m²].
    pub emittance: Spectrum,
    /// How many sides are active.
    pub sides: u8,
    /// The texture whose mean is in the reflectance.
    pub texture: Option<String>,
}

/// Where a mesh's surfaces come from.
#[derive(Clone, Debug, PartialEq)]
struct MeshSite {
    file: PathBuf,
    /// The number of its first surface.
    first: usize,
    spots: Spots,
    /// Object and material of each surface, by their numbers in the mesh.
    kinds: Vec<[u32; 2]>,
    /// Whether the size of its patches is said.
    is_cut: bool,
}

impl SceneFile {
    /// The path of the scene file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What it says; its numbers are checked by [`SceneFile::build`].
    pub fn spec(&self) -> &SceneSpec {
        &self.spec
    }

    /// What its surfaces are made of.
    pub fn finishes(&self) -> &Finishes {
        &self.finishes
    }

    /// What is demanded of its planes.
    pub fn demands(&self) -> &[PlaneTarget] {
        &self.demands
    }

    /// Places where light is measured, in the order of the file.
    pub fn sensors(&self) -> &[SensorSpec] {
        &self.sensors
    }

    /// What was left out, changed or assumed of meshes, a sentence each.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// The materials of its surfaces, the largest area first. Equal names with other values have rows of their own.
    pub fn materials(&self) -> Vec<MaterialRow> {
        let mut rows: Vec<MaterialRow> = Vec::new();
        let mut numbers = HashMap::new();
        for (surface, name) in self.spec.surfaces.iter().zip(self.finishes.of_surfaces()) {
            let light = [surface.reflectance, surface.emittance].map(|of| of.channels().map(f64::to_bits));
            let number = *numbers.entry((name, light, surface.sides as u8)).or_insert_with(|| {
                let name = self.finishes.names()[name as usize].clone();
                rows.push(MaterialRow {
                    texture: self.textures.get(&name).cloned(),
                    name,
                    surfaces: 0,
                    area: 0.0,
                    reflectance: surface.reflectance,
                    emittance: surface.emittance,
                    sides: surface.sides.count() as u8,
                });
                rows.len() - 1
            });
            rows[number].surfaces += 1;
            rows[number].area += surface.shape.area();
        }
        rows.sort_by(|a, b| b.area.total_cmp(&a.area));
        rows
    }

    /// The least and the greatest coordinates of its surfaces, a sky aside [m].
    pub fn bounds(&self) -> [[f64; 3]; 2] {
        let (low, high) = bounds(&self.spec.surfaces[..self.sky.unwrap_or(self.spec.surfaces.len())]);
        [low.to_array(), high.to_array()]
    }

    /// The unit that an imported file is likely to be written in [m], where that is not the one taken.
    pub fn likely_unit(&self) -> Option<f64> {
        self.likely_unit
    }

    /// Whether the light of the scene is in lumens.
    pub(crate) fn is_luminous(&self) -> bool {
        self.luminous
    }

    /// Whether any of its surfaces are those of meshes.
    pub fn has_mesh(&self) -> bool {
        !self.meshes.is_empty()
    }

    /// The kind of each surface that may be grouped with others, a number: surfaces of one object and one material of a mesh are of one kind.
    /// `None` for other surfaces, and for those whose cells emit by themselves.
    pub fn kinds(&self) -> Vec<Option<u32>> {
        let mut kinds = vec![None; self.spec.surfaces.len()];
        let mut numbers = HashMap::new();
        for (mesh, site) in self.meshes.iter().enumerate() {
            for (surface, kind) in (site.first..).zip(&site.kinds) {
                let spec = &self.spec.surfaces[surface];
                let light = [spec.reflectance, spec.emittance].map(|of| of.channels().map(f64::to_bits));
                let next = numbers.len() as u32;
                let number = *numbers.entry((mesh, kind, spec.sides as u8, light)).or_insert(next);
                kinds[surface] = spec.cell_emittance.is_empty().then_some(number);
            }
        }
        kinds
    }

    /// The surfaces whose cells are left to the program.
    pub(crate) fn auto(&self) -> &[usize] {
        &self.auto
    }

    /// Leaves the cells of all surfaces to the program but those of the sky. A surface whose cells emit by themselves keeps them
    /// as the coarsest.
    pub(crate) fn leave_cells(&mut self) {
        let surfaces = self.sky.unwrap_or(self.spec.surfaces.len());
        self.auto = (0..surfaces).collect();
        let whole = |surface: &&mut SurfaceSpec| surface.cell_emittance.is_empty();
        for surface in self.spec.surfaces[..surfaces].iter_mut().filter(whole) {
            match &mut surface.shape {
                Shape::Parallelogram { cells, .. } => *cells = [1, 1],
                Shape::Triangle { rows, .. } => *rows = 1,
                Shape::Divided { leaves, .. } => *leaves = Leaves::whole(),
            }
        }
        let spec = &self.spec.surfaces;
        let is_cut = |&surface: &usize| match spec[surface].shape {
            Shape::Triangle { .. } => spec[surface].cell_emittance.is_empty(),
            Shape::Parallelogram { .. } | Shape::Divided { .. } => true,
        };
        self.auto.retain(is_cut);
    }

    /// Leaves to the program the cells of all surfaces but those of which the file says `patches`, `emit` or a size of patches, and but those of the sky.
    pub(crate) fn leave_unsaid_cells(&mut self) {
        let says = |site: &SurfaceSite| site.has("patches") || site.has("emit");
        let unsaid =
            self.sites.iter().enumerate().filter(|(_, site)| !says(site)).map(|(surface, _)| surface);
        let of_meshes = self.meshes.iter().filter(|mesh| !mesh.is_cut);
        let faces = of_meshes.flat_map(|mesh| mesh.first..mesh.first + mesh.kinds.len());
        let mut open: Vec<usize> = self.auto.iter().copied().chain(unsaid).chain(faces).collect();
        open.sort_unstable();
        open.dedup();
        self.auto = open;
    }

    /// Cuts every surface so, and groups the cells that have equal labels, unless there are no labels. Nothing is left to the program then.
    ///
    /// # Errors
    /// In words, where the surfaces have no such cells.
    pub(crate) fn cut(&mut self, cuts: &[Cut], groups: &[u32]) -> Result<(), String> {
        let spec = std::mem::replace(&mut self.spec, SceneSpec::new(Vec::new()));
        self.spec = cut_spec(spec, cuts, groups)?;
        self.auto.clear();
        Ok(())
    }

    /// The number of patches.
    pub fn patch_count(&self) -> u64 {
        self.spec.patch_count()
    }

    /// The number of patches; `None` where the program has yet to cut them.
    pub(crate) fn known_patch_count(&self) -> Option<u64> {
        self.auto.is_empty().then(|| self.patch_count())
    }

    /// Checks the numbers and builds the scene.
    ///
    /// # Errors
    /// [`Error::Scene`]: what [`Scene::build`] refuses, with the line of the surface's or material's key.
    pub fn build(&self, index: IndexChoice) -> Result<Scene, Error> {
        Scene::build_on(&self.spec, index, &run_on_all_cores).map_err(|error| self.locate(error))
    }

    /// [`SceneFile::build`] of the scene with other cells, grouped by equal labels where there are any.
    ///
    /// # Errors
    /// As [`SceneFile::build`]; cells that its surfaces cannot have.
    pub fn build_cut(&self, cells: (&[Cut], &[u32]), index: IndexChoice) -> Result<Scene, Error> {
        Scene::build_on(&self.spec_cut(cells)?, index, &run_on_all_cores).map_err(|error| self.locate(error))
    }

    /// A scene of these surfaces, cut anew with cells and groups as [`SceneFile::build_cut`] takes them.
    ///
    /// # Errors
    /// As [`SceneFile::build_cut`].
    pub fn recut(&self, scene: Scene, cells: (&[Cut], &[u32])) -> Result<Scene, Error> {
        scene.recut(&self.spec_cut(cells)?).map_err(|error| self.locate(error))
    }

    /// The scene with other cells, as [`SceneFile::build_cut`] takes them.
    ///
    /// # Errors
    /// Cells that its surfaces cannot have.
    pub fn spec_cut(&self, (cuts, groups): (&[Cut], &[u32])) -> Result<SceneSpec, Error> {
        cut_spec(self.spec.clone(), cuts, groups)
            .map_err(|problem| misfit(problem, SourceSpot::File, &self.path, "patches"))
    }

    /// The same surfaces in one channel, all of which emit 1 W/m², without sensors: exchange factors are about surfaces, not
    /// about their light. `reflectance` replaces that of a surface.
    pub fn for_exchange(&self, channel: usize, reflectance: impl Fn(usize) -> Option<f64>) -> Self {
        let mut scene = SceneFile { sensors: Vec::new(), ..self.clone() };
        scene.spec.lamps = LampsSpec::default();
        for (number, surface) in scene.spec.surfaces.iter_mut().enumerate() {
            surface.reflectance = reflectance(number).unwrap_or(surface.reflectance[channel]).into();
            surface.transmittance = surface.transmittance[channel].into();
            surface.emittance = 1.0.into();
            surface.cell_emittance.clear();
        }
        scene
    }

    /// The same surfaces in one channel with the sensors, without the sky: daylight comes from a sky of its own, and the light of surfaces
    /// plays no part.
    pub fn for_daylight(&self, channel: usize) -> Self {
        let scene = self.for_exchange(channel, |_| None);
        SceneFile { sensors: self.sensors.clone(), ..scene.without_sky() }
    }

    /// The scene without its sky: what would end there escapes.
    pub fn without_sky(&self) -> Self {
        let mut scene = SceneFile { sky: None, ..self.clone() };
        if let Some(first) = self.sky {
            scene.spec.surfaces.truncate(first);
        }
        scene
    }

    /// Turns round what the doctor finds flipped, in memory: the file stays as it is.
    fn turn_flipped(&mut self) -> Result<(), Error> {
        let turned = doctor::turn_flipped(&mut self.spec).map_err(|error| self.locate(error))?;
        if !turned.is_empty() {
            let (count, names) = (turned.len(), turned.join(", "));
            self.notes
                .push(format!("repair: {count} surfaces are turned round, the file is unchanged: {names}"));
        }
        Ok(())
    }

    /// What [`Scene::build`] says of the scene, with the place in its file.
    pub fn locate(&self, error: SceneError) -> Error {
        let (place, problem) = match error {
            SceneError::Surface { surface, key, problem } => (self.locate_key(surface, key), problem),
            SceneError::Whole(mut problem) => {
                // A mesh file has none of the keys that a scene file is lit by.
                if self.has_mesh() && problem.contains("no emitter") {
                    problem.push_str("; light a mesh by --light NAME=1000lm or --sky");
                }
                (
                    SourceLocation { file: self.path.clone(), spot: SourceSpot::File, key: String::new() },
                    problem,
                )
            }
        };
        Error::Scene { place: Box::new(place), problem }
    }

    fn locate_key(&self, surface: usize, key: &str) -> SourceLocation {
        let name = self.spec.surfaces[surface].name.as_deref();
        let label = label(surface, name);
        if self.sky.is_some_and(|sky| sky <= surface) {
            return SourceLocation {
                file: self.path.clone(),
                spot: SourceSpot::File,
                key: format!("sky, {label}: {key}"),
            };
        }
        let Some(site) = self.sites.get(surface) else {
            let mesh = self.meshes.iter().rfind(|mesh| mesh.first <= surface);
            let mesh = mesh.expect("surfaces that the file does not hold are those of a mesh");
            let spot = mesh.spots.of(surface - mesh.first, name).into();
            return SourceLocation { file: mesh.file.clone(), spot, key: format!("{label}: {key}") };
        };
        let (line, key) = match key {
            "reflectance" | "emittance" => {
                let (material, lines) = &self.materials[site.material as usize];
                (lines.of(key), format!("material.{material}.{key}, used by {label}"))
            }
            key => (site.of(key), format!("{label}: {key}")),
        };
        SourceLocation { file: self.path.clone(), spot: SourceSpot::Line(line), key }
    }
}

/// Surfaces that are cut so, and their cells grouped by equal labels, unless there are no labels.
fn cut_spec(mut spec: SceneSpec, cuts: &[Cut], groups: &[u32]) -> Result<SceneSpec, String> {
    let surfaces = spec.surfaces.len();
    if cuts.len() != surfaces {
        return Err(format!("there are {} surfaces, and the scene has {surfaces}", cuts.len()));
    }
    for (number, (surface, cut)) in spec.surfaces.iter_mut().zip(cuts).enumerate() {
        if !cut.clone().apply(surface) {
            let name = label(number, surface.name.as_deref());
            return Err(format!("{name} has other corners, or cells that emit and would be torn"));
        }
    }
    let cells = spec.cell_count();
    match groups.len() {
        0 => Ok(spec),
        given if given as u64 == cells => Ok(spec.grouped(groups)),
        given => Err(format!("groups are given for {given} cells, and the scene has {cells}")),
    }
}

impl SceneFile {
    /// The scene of a mesh in memory; `name` stands for its file.
    pub(crate) fn of_mesh(name: &Path, mesh: Mesh, options: &Options) -> Result<Self, Error> {
        // Arrays say as little of an axis as PLY does: their vertices are taken as they are.
        let imported = mesh.into_scene(name, Format::Ply, options).map_err(Error::of_mesh)?;
        Ok(SceneFile::of_import(name, imported, options))
    }

    /// The scene that is one mesh.
    fn of_import(file: &Path, imported: Imported, options: &Options) -> Self {
        let mut scene = SceneFile::empty(file);
        scene.add(file, imported, None, options);
        scene
    }

    /// A scene without surfaces.
    fn empty(file: &Path) -> Self {
        SceneFile {
            path: file.into(),
            spec: SceneSpec::new(Vec::new()),
            sites: Vec::new(),
            meshes: Vec::new(),
            materials: Vec::new(),
            finishes: Finishes::default(),
            auto: Vec::new(),
            sensors: Vec::new(),
            demands: Vec::new(),
            sky: None,
            notes: Vec::new(),
            textures: HashMap::new(),
            luminous: false,
            likely_unit: None,
        }
    }

    /// Adds a surface of the file itself.
    fn push(&mut self, surface: SurfaceSpec, site: SurfaceSite) {
        self.finishes.push(&self.materials[site.material as usize].0);
        self.spec.surfaces.push(surface);
        self.sites.push(site);
    }

    /// Adds the sky behind all surfaces. A scene without any has nothing that it could light.
    fn add_sky(&mut self, emittance: Spectrum) {
        if self.spec.surfaces.is_empty() {
            return;
        }
        self.sky = Some(self.spec.surfaces.len());
        for side in sky_box(&self.spec, &self.sensors, emittance) {
            self.finishes.push(SKY);
            self.spec.surfaces.push(side);
        }
    }

    /// Adds the surfaces of a mesh, whose materials are its own unless all have one `finish`.
    fn add(&mut self, file: &Path, imported: Imported, finish: Option<&str>, options: &Options) {
        let Imported { spec, spots, notes, materials, names, parts, textures, likely_unit, .. } = imported;
        let named = names.iter().zip(textures).filter_map(|(name, texture)| Some((name.clone(), texture?)));
        self.textures.extend(named);
        self.likely_unit = self.likely_unit.or(likely_unit.map(|(_, length)| length));
        let kinds = parts.iter().zip(&materials).map(|(&part, &material)| [part, material]).collect();
        let name = |material: u32| finish.unwrap_or(&names[material as usize]);
        materials.into_iter().for_each(|material| self.finishes.push(name(material)));
        let first = self.spec.surfaces.len();
        let is_cut = options.patch_size.is_some() || options.max_patch_area.is_some();
        self.meshes.push(MeshSite { file: file.into(), first, spots, kinds, is_cut });
        self.luminous |= !spec.lamps.list.is_empty();
        self.spec.lamps.append(spec.lamps);
        match self.spec.surfaces.is_empty() {
            true => self.spec.surfaces = spec.surfaces,
            false => self.spec.surfaces.extend(spec.surfaces),
        }
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        self.notes.extend(notes.into_iter().map(|note| format!("{name}: {note}")));
    }
}

/// What messages call a surface.
fn label(number: usize, name: Option<&str>) -> String {
    match name {
        Some(name) => format!("surface {number} ({name:?})"),
        None => format!("surface {number}"),
    }
}
