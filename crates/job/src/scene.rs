//! The scene file, read and checked.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use import::{Format, Imported, MaterialOverride, Mesh, Options, Spots};
use radiosity::{IndexChoice, Scene, SceneError, SceneSpec, SensorSpec, Shape, Sides, Spectrum, SurfaceSpec};

use crate::cut::Cut;
use crate::document::{Table, Value};
use crate::emit::read_emit;
use crate::error::{Error, MESH_FORMATS, Place, Spot};
use crate::finishes::Finishes;
use crate::imports::{import_scene, positive, read_mesh};
use crate::keys::{LISTS, SCENE_KEYS};
use crate::material::{Material, Materials, find_material, read_materials};
use crate::partition::{AUTO, misfit};
use crate::plain::{PlainSurface, plain_surfaces};
use crate::sensors::read_sensors;
use crate::shape::{read_corners, read_grid, read_rows};
use crate::site::{Lines, SITE_KEYS, SurfaceSite};
use crate::sky::{SKY, read_sky, sky_box};
use crate::source::{Source, Split};

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
    /// The number of the first surface of the sky, behind all others; `None` without one.
    sky: Option<usize>,
    notes: Vec<String>,
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

    /// Places where light is measured, in the order of the file.
    pub fn sensors(&self) -> &[SensorSpec] {
        &self.sensors
    }

    /// What was left out, changed or assumed of meshes, a sentence each.
    pub fn notes(&self) -> &[String] {
        &self.notes
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
        for surface in &mut self.spec.surfaces[..surfaces] {
            match &mut surface.shape {
                _ if !surface.cell_emittance.is_empty() => {}
                Shape::Parallelogram { cells, .. } => *cells = [1, 1],
                Shape::Triangle { rows, .. } => *rows = 1,
            }
        }
        let spec = &self.spec.surfaces;
        let is_cut = |&surface: &usize| match spec[surface].shape {
            Shape::Triangle { .. } => spec[surface].cell_emittance.is_empty(),
            Shape::Parallelogram { .. } => true,
        };
        self.auto.retain(is_cut);
    }

    /// Cuts every surface so. Nothing is left to the program then.
    ///
    /// # Errors
    /// In words, where the surfaces have no such cells.
    pub(crate) fn cut(&mut self, cuts: &[Cut]) -> Result<(), String> {
        let surfaces = self.spec.surfaces.len();
        if cuts.len() != surfaces {
            return Err(format!("there are {} surfaces, and the scene has {surfaces}", cuts.len()));
        }
        for (number, (surface, cut)) in self.spec.surfaces.iter_mut().zip(cuts).enumerate() {
            if !cut.apply(surface) {
                let name = label(number, surface.name.as_deref());
                return Err(format!("{name} has other corners, or cells that emit and would be torn"));
            }
        }
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
        Scene::build(&self.spec, index).map_err(|error| self.locate(error))
    }

    /// [`SceneFile::build`] of the scene with other cells.
    ///
    /// # Errors
    /// As [`SceneFile::build`]; cells that its surfaces cannot have.
    pub fn build_cut(&self, cuts: &[Cut], index: IndexChoice) -> Result<Scene, Error> {
        let mut scene = self.clone();
        scene.cut(cuts).map_err(|problem| misfit(problem, (Spot::File, &self.path, "patches")))?;
        scene.build(index)
    }

    /// The same surfaces in one channel, all of which emit 1 W/m², without sensors: exchange factors are about surfaces, not
    /// about their light. `reflectance` replaces that of a surface.
    pub fn for_exchange(&self, channel: usize, reflectance: impl Fn(usize) -> Option<f64>) -> Self {
        let mut scene = SceneFile { sensors: Vec::new(), ..self.clone() };
        for (number, surface) in scene.spec.surfaces.iter_mut().enumerate() {
            surface.reflectance = reflectance(number).unwrap_or(surface.reflectance[channel]).into();
            surface.emittance = 1.0.into();
            surface.cell_emittance.clear();
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
            SceneError::Whole(problem) => {
                (Place { file: self.path.clone(), spot: Spot::File, key: String::new() }, problem)
            }
        };
        Error::Scene { place: Box::new(place), problem }
    }

    fn locate_key(&self, surface: usize, key: &str) -> Place {
        let name = self.spec.surfaces[surface].name.as_deref();
        let label = label(surface, name);
        if self.sky.is_some_and(|sky| sky <= surface) {
            return Place { file: self.path.clone(), spot: Spot::File, key: format!("sky, {label}: {key}") };
        }
        let Some(site) = self.sites.get(surface) else {
            let mesh = self.meshes.iter().rfind(|mesh| mesh.first <= surface);
            let mesh = mesh.expect("surfaces that the file does not hold are those of a mesh");
            let spot = mesh.spots.of(surface - mesh.first, name).into();
            return Place { file: mesh.file.clone(), spot, key: format!("{label}: {key}") };
        };
        let (line, key) = match key {
            "reflectance" | "emittance" => {
                let (material, lines) = &self.materials[site.material as usize];
                (lines.of(key), format!("material.{material}.{key}, used by {label}"))
            }
            key => (site.of(key), format!("{label}: {key}")),
        };
        Place { file: self.path.clone(), spot: Spot::Line(line), key }
    }
}

/// Reads a scene file, meshes with the defaults of `[import]`.
///
/// # Errors
/// A file that cannot be read, is of a format without reader, or says what is unknown, missing or not allowed.
pub fn load_scene(path: &Path) -> Result<SceneFile, Error> {
    load_scene_with(path, &Options::default())
}

/// Reads a scene file: TOML with its meshes, or a mesh.
///
/// # Errors
/// As [`load_scene`].
pub fn load_scene_with(path: &Path, options: &Options) -> Result<SceneFile, Error> {
    if is_toml(path) {
        return load_toml(path, options);
    }
    let Some(format) = Format::of(path) else { return Err(unknown_format(path)) };
    Ok(SceneFile::of_import(path, import_scene(path, format, options)?))
}

pub(crate) const MESH_KEYS: &[&str] = &["file", "material", "max_patch_area"];

fn load_toml(path: &Path, options: &Options) -> Result<SceneFile, Error> {
    let source = Source::read(path, "[material.NAME] tables and [[surface]] tables")?;
    match read_parts(&source, options)? {
        Some(scene) => Ok(scene),
        None => read_whole(&source, options),
    }
}

/// Reads a scene part by part; `None` where a part is not TOML by itself.
fn read_parts(source: &Source, options: &Options) -> Result<Option<SceneFile>, Error> {
    let split = source.split();
    let rest = split.rest(source).filter(|(_, rest)| !rest.contains_key("surface"));
    let Some((part, rest)) = rest else { return Ok(None) };
    Reader::new(Table::part(part, rest, SCENE_KEYS)?, source.file(), options)?.read_parts(source, &split)
}

/// Reads a scene as one document, which tells what is wrong with it.
fn read_whole(source: &Source, options: &Options) -> Result<SceneFile, Error> {
    let mut table = Table::root(source, SCENE_KEYS)?;
    let surfaces = table.take("surface");
    let mut reader = Reader::new(table, source.file(), options)?;
    surfaces.map_or(Ok(()), |surfaces| reader.surfaces(surfaces))?;
    reader.finish()
}

/// A TOML scene on its way.
struct Reader<'a, 'o> {
    scene: SceneFile,
    materials: Materials,
    meshes: Option<Value<'a>>,
    sky: Option<Spectrum>,
    options: &'o Options,
}

impl<'a, 'o> Reader<'a, 'o> {
    /// Reads all but surfaces.
    fn new(mut table: Table<'a>, path: &Path, options: &'o Options) -> Result<Self, Error> {
        let materials = read_materials(&mut table)?;
        let scene = SceneFile {
            path: path.into(),
            spec: SceneSpec::new(Vec::new()),
            sites: Vec::new(),
            meshes: Vec::new(),
            materials: materials
                .iter()
                .map(|(name, material)| (name.clone(), material.lines.clone()))
                .collect(),
            finishes: Finishes::default(),
            auto: Vec::new(),
            sensors: table.take("sensor").map_or(Ok(Vec::new()), read_sensors)?,
            sky: None,
            notes: Vec::new(),
        };
        let sky = table.take("sky").map(read_sky).transpose()?;
        Ok(Reader { scene, materials, meshes: table.take("mesh"), sky, options })
    }

    /// Reads the surfaces part by part; `None` where a part is not TOML by itself.
    fn read_parts(mut self, source: &Source, split: &Split) -> Result<Option<SceneFile>, Error> {
        for surfaces in split.surfaces() {
            let (text, line) = surfaces.text(source);
            if self.plain_surfaces(text, line).is_some() {
                continue;
            }
            let Some((part, table)) = surfaces.document(source) else { return Ok(None) };
            let mut table = Table::part(part, table, SCENE_KEYS)?;
            if let Some(surfaces) = table.take("surface") {
                self.surfaces(surfaces)?;
            }
        }
        self.finish().map(Some)
    }

    /// Reads surfaces without a document; `None` where any of them needs one.
    fn plain_surfaces(&mut self, text: &str, line: u32) -> Option<()> {
        let surfaces = plain_surfaces(text, line)?;
        let materials: Vec<&Material> =
            surfaces.iter().map(|surface| self.materials.get(&*surface.material)).collect::<Option<_>>()?;
        let mut names = surfaces.iter().filter_map(|surface| surface.name.as_deref());
        names.all(can_name_a_surface).then_some(())?;
        for (surface, material) in surfaces.into_iter().zip(materials) {
            let PlainSurface { name, shape, sides, header, outline, cells, .. } = surface;
            let [quad, triangle] = match shape {
                Shape::Parallelogram { .. } => [outline, 0],
                Shape::Triangle { .. } => [0, outline],
            };
            let keys = [quad, triangle, cells.unwrap_or(0), 0];
            let site = SurfaceSite { material: material.number, header, keys };
            let surface = SurfaceSpec {
                name: name.map(Cow::into_owned),
                shape,
                sides,
                reflectance: material.reflectance,
                emittance: material.emittance,
                cell_emittance: Vec::new(),
            };
            self.scene.push(surface, site);
        }
        Some(())
    }

    fn surfaces(&mut self, value: Value<'_>) -> Result<(), Error> {
        for value in value.tables(LISTS[0])? {
            let number = self.scene.spec.surfaces.len();
            let (surface, site, auto) = read_surface(value, number, &self.materials)?;
            if auto {
                self.scene.auto.push(number);
            }
            self.scene.push(surface, site);
        }
        Ok(())
    }

    /// Adds the meshes behind all surfaces, and the sky behind these.
    fn finish(mut self) -> Result<SceneFile, Error> {
        let meshes =
            self.meshes.take().map(|meshes| meshes.tables(LISTS[1])).transpose()?.unwrap_or_default();
        for (number, value) in meshes.into_iter().enumerate() {
            let (file, imported, finish) = self.mesh(value, number)?;
            self.scene.add(&file, imported, finish.as_deref());
        }
        if let Some(emittance) = self.sky {
            self.scene.add_sky(emittance);
        }
        Ok(self.scene)
    }

    /// The file of a mesh, its surfaces, and the material that all of them have, where the scene gives them one.
    fn mesh(&self, value: Value<'_>, number: usize) -> Result<(PathBuf, Imported, Option<String>), Error> {
        let mut table = value.table_called(format!("mesh {number}: "), MESH_KEYS)?;
        let file = table.require(
            "file",
            "a mesh is read from one",
            "file = \"chair.obj\", relative to the scene",
        )?;
        let path = self.scene.path.parent().unwrap_or(Path::new("")).join(file.string()?);
        let format = Format::of(&path).ok_or_else(|| {
            let remedy = format!("name a file that ends in {MESH_FORMATS}");
            file.refuse(
                format!("{:?} is of no known format", path.display()),
                "its name tells how to read it",
                remedy,
            )
        })?;
        let area = table.take("max_patch_area");
        let max_patch_area = area.map(|value| positive(&value, "it is an area in m²")).transpose()?;
        let mut options = Options { max_patch_area, ..self.options.clone() };
        let mesh = read_mesh(&path, format, &options).map_err(|error| match error {
            Error::Missing { file: missing } if missing == path => file.refuse(
                format!("there is no file {}", missing.display()),
                "meshes are looked for relative to the scene",
                "correct the path",
            ),
            error => error,
        })?;
        options.materials.retain(|entry| mesh.has_material(&entry.pattern));
        let mut finish = None;
        if let Some(value) = table.take("material") {
            let material = find_material(&value, &self.materials)?;
            finish = Some(value.string()?.to_owned());
            options.materials.push(MaterialOverride {
                pattern: "*".into(),
                reflectance: Some(material.reflectance),
                emittance: Some(material.emittance),
                power: None,
                sides: None,
            });
        }
        let imported = mesh.into_scene(&path, format, &options).map_err(Error::of_mesh)?;
        Ok((path, imported, finish))
    }
}

impl SceneFile {
    /// The scene of a mesh in memory; `name` stands for its file.
    pub(crate) fn of_mesh(name: &Path, mesh: Mesh, options: &Options) -> Result<Self, Error> {
        // Arrays say as little of an axis as PLY does: their vertices are taken as they are.
        let imported = mesh.into_scene(name, Format::Ply, options).map_err(Error::of_mesh)?;
        Ok(SceneFile::of_import(name, imported))
    }

    /// The scene that is one mesh.
    fn of_import(file: &Path, imported: Imported) -> Self {
        let mut scene = SceneFile {
            path: file.into(),
            spec: SceneSpec::new(Vec::new()),
            sites: Vec::new(),
            meshes: Vec::new(),
            materials: Vec::new(),
            finishes: Finishes::default(),
            auto: Vec::new(),
            sensors: Vec::new(),
            sky: None,
            notes: Vec::new(),
        };
        scene.add(file, imported, None);
        scene
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
        for side in sky_box(&self.spec.surfaces, &self.sensors, emittance) {
            self.finishes.push(SKY);
            self.spec.surfaces.push(side);
        }
    }

    /// Adds the surfaces of a mesh, whose materials are its own unless all have one `finish`.
    fn add(&mut self, file: &Path, imported: Imported, finish: Option<&str>) {
        let Imported { spec, spots, notes, materials, names, parts } = imported;
        let kinds = parts.iter().zip(&materials).map(|(&part, &material)| [part, material]).collect();
        let name = |material: u32| finish.unwrap_or(&names[material as usize]);
        materials.into_iter().for_each(|material| self.finishes.push(name(material)));
        self.meshes.push(MeshSite { file: file.into(), first: self.spec.surfaces.len(), spots, kinds });
        if self.spec.surfaces.is_empty() {
            self.spec = spec;
        } else {
            self.spec.surfaces.extend(spec.surfaces);
        }
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        self.notes.extend(notes.into_iter().map(|note| format!("{name}: {note}")));
    }
}

pub(crate) fn is_toml(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"))
}

fn unknown_format(path: &Path) -> Error {
    match path.extension() {
        None if path.is_dir() => Error::Folder { file: path.into() },
        None => Error::SceneFormat { file: path.into(), format: "scenes without extension".into() },
        Some(extension) => {
            let format = format!(".{}", extension.to_string_lossy().to_lowercase());
            Error::SceneFormat { file: path.into(), format }
        }
    }
}

pub(crate) const SURFACE_KEYS: &[&str] =
    &["name", "material", "quad", "triangle", "patches", "sides", "emit"];

/// What messages call a surface.
fn label(number: usize, name: Option<&str>) -> String {
    match name {
        Some(name) => format!("surface {number} ({name:?})"),
        None => format!("surface {number}"),
    }
}

fn read_surface(
    value: Value<'_>,
    number: usize,
    materials: &Materials,
) -> Result<(SurfaceSpec, SurfaceSite, bool), Error> {
    let header = value.line() as u32;
    let mut table = value.table_called(format!("{}: ", label(number, None)), SURFACE_KEYS)?;
    let name = table.take("name").map(|value| read_surface_name(&value)).transpose()?;
    table.rename(format!("{}: ", label(number, name.as_deref())));
    let keys = SITE_KEYS.map(|key| table.line(key).unwrap_or(0) as u32);
    let material = read_material_name(&mut table, materials)?;
    let (shape, auto) = read_shape(&mut table)?;
    let sides = table.take("sides").map(|value| read_sides(&value)).transpose()?.unwrap_or(Sides::Front);
    let emit = table.take("emit");
    if let (true, Some(emit)) = (auto, &emit) {
        return Err(emit.refuse(
            "cells of this surface emit, and it has none yet".into(),
            "patches = \"auto\" cuts it when the job is run",
            "give the part that emits a surface of its own, or write the cells",
        ));
    }
    let cell_emittance = emit.map(|value| read_emit(value, &shape)).transpose()?;
    let surface = SurfaceSpec {
        name,
        shape,
        sides,
        reflectance: material.reflectance,
        emittance: material.emittance,
        cell_emittance: cell_emittance.unwrap_or_default(),
    };
    Ok((surface, SurfaceSite { material: material.number, header, keys }, auto))
}

fn read_surface_name(value: &Value<'_>) -> Result<String, Error> {
    let name = value.string()?;
    if !can_name_a_surface(name) {
        return Err(value.refuse(
            format!("{name:?} cannot name a surface"),
            "it is shown in the rows of its patches",
            "write a visible name on one line, or remove the key to show the surface's number",
        ));
    }
    Ok(name.into())
}

/// Whether a name is visible, on one line.
fn can_name_a_surface(name: &str) -> bool {
    !name.trim().is_empty() && !name.contains(char::is_control)
}

fn read_material_name<'m>(table: &mut Table<'_>, materials: &'m Materials) -> Result<&'m Material, Error> {
    let value =
        table.require("material", "a surface takes its reflectance from it", "material = \"NAME\"")?;
    find_material(&value, materials)
}

/// The shape of a surface, and whether its cells are left to the program.
fn read_shape(table: &mut Table<'_>) -> Result<(Shape, bool), Error> {
    let (quad, triangle, patches) = (table.take("quad"), table.take("triangle"), table.take("patches"));
    let auto = patches.as_ref().is_some_and(|value| value.string().is_ok_and(|word| word == AUTO));
    let patches = patches.filter(|_| !auto);
    let shape = match (quad, triangle) {
        (Some(quad), None) => {
            let [corner, corner_u, corner_v] = read_corners(quad)?;
            let cells = patches.map(read_grid).transpose()?.unwrap_or([1, 1]);
            Shape::Parallelogram { corner, corner_u, corner_v, cells }
        }
        (None, Some(triangle)) => {
            let [a, b, c] = read_corners(triangle)?;
            let rows = patches.as_ref().map(read_rows).transpose()?.unwrap_or(1);
            Shape::Triangle { a, b, c, rows }
        }
        (Some(_), Some(triangle)) => {
            return Err(triangle.refuse(
                "the surface has a quad too".into(),
                "a surface is one or the other",
                "write two [[surface]] tables",
            ));
        }
        (None, None) => {
            return Err(Error::MissingKey {
                place: table.place("quad"),
                why: "a surface needs an outline",
                remedy: "quad = [[x, y, z], [x, y, z], [x, y, z]] or triangle = [[…], […], […]]".into(),
            });
        }
    };
    Ok((shape, auto))
}

fn read_sides(value: &Value<'_>) -> Result<Sides, Error> {
    match value.integer(1..=2, "a surface has two sides, and the front is always active")? {
        1 => Ok(Sides::Front),
        _ => Ok(Sides::Both),
    }
}

mod grouping;
#[cfg(test)]
mod tests;
