//! Scene files on their way to a [`SceneFile`]: TOML with its meshes, part by part where the parts allow it, or a mesh alone.

#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use import::{Format, Imported, MaterialOverride, Options};
use radiosity::{Shape, Spectrum, SurfaceSpec, lamps::LampsSpec, surfaces::PaneSpec};

use super::SceneFile;
use super::surface::{can_name_a_surface, read_surface};
use crate::document::{KeyTable, Value};
use crate::error::{Error, MESH_FORMATS, SourceLocation, SourceSpot};
use crate::imports::{positive, read_mesh};
use crate::keys::{LISTS, MESH_KEYS, SCENE_KEYS};
use crate::lamps::read_lamps;
use crate::lighting::{Lit, OpenLamps, read_lit};
use crate::material::{MaterialTable, Materials, find_material, read_materials};
use crate::panes::read_panes;
use crate::plain::{PlainSurface, plain_surfaces};
use crate::planes::read_planes;
use crate::sensors::read_sensors;
use crate::site::SurfaceSite;
use crate::sky::read_sky;
use crate::source::{SourceText, Split};

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
    let Lit { imported, sky } = read_lit(path, format, options)?;
    let luminous = imported.luminous;
    let mut scene = SceneFile::of_import(path, imported, options);
    scene.luminous = luminous || sky.is_some();
    sky.into_iter().for_each(|emittance| scene.add_sky(emittance));
    Ok(scene)
}

fn load_toml(path: &Path, options: &Options) -> Result<SceneFile, Error> {
    let source = SourceText::read(path, "[material.NAME] tables and [[surface]] tables")?;
    match read_parts(&source, options)? {
        Some(scene) => Ok(scene),
        None => read_whole(&source, options),
    }
}

/// Reads a scene part by part; `None` where a part is not TOML by itself.
fn read_parts(source: &SourceText, options: &Options) -> Result<Option<SceneFile>, Error> {
    let split = source.split();
    let rest = split.rest(source).filter(|(_, rest)| !rest.contains_key("surface"));
    let Some((part, rest)) = rest else { return Ok(None) };
    SceneReader::new(KeyTable::part(part, rest, SCENE_KEYS)?, source.file(), options)?
        .read_parts(source, &split)
}

/// Reads a scene as one document, which tells what is wrong with it.
fn read_whole(source: &SourceText, options: &Options) -> Result<SceneFile, Error> {
    let mut table = KeyTable::root(source, SCENE_KEYS)?;
    let surfaces = table.take("surface");
    let mut reader = SceneReader::new(table, source.file(), options)?;
    surfaces.map_or(Ok(()), |surfaces| reader.surfaces(surfaces))?;
    reader.finish()
}

/// A TOML scene on its way.
struct SceneReader<'a, 'o> {
    scene: SceneFile,
    materials: Materials,
    lamps: LampsSpec,
    panes: Vec<PaneSpec>,
    meshes: Option<Value<'a>>,
    sky: Option<Spectrum>,
    options: &'o Options,
}

impl<'a, 'o> SceneReader<'a, 'o> {
    /// Reads all but surfaces.
    fn new(mut table: KeyTable<'a>, path: &Path, options: &'o Options) -> Result<Self, Error> {
        let materials = read_materials(&mut table)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let mut sensors = table.take("sensor").map_or(Ok(Vec::new()), read_sensors)?;
        let demands = read_planes(["plane", "points"].map(|list| table.take(list)), folder, &mut sensors)?;
        let lamps = table.take("lamp").map(|value| read_lamps(value, folder)).transpose()?;
        let lines = |(name, material): (&String, &MaterialTable)| (name.clone(), material.lines.clone());
        let scene = SceneFile {
            materials: materials.iter().map(lines).collect(),
            sensors,
            demands,
            luminous: lamps.is_some(),
            ..SceneFile::empty(path)
        };
        let sky = table.take("sky").map(read_sky).transpose()?;
        let panes = table.take("pane").map_or(Ok(Vec::new()), read_panes)?;
        let lamps = lamps.unwrap_or_default();
        Ok(SceneReader { scene, materials, lamps, panes, meshes: table.take("mesh"), sky, options })
    }

    /// Reads the surfaces part by part; `None` where a part is not TOML by itself.
    fn read_parts(mut self, source: &SourceText, split: &Split) -> Result<Option<SceneFile>, Error> {
        for surfaces in split.surfaces() {
            let (text, line) = surfaces.text(source);
            if self.plain_surfaces(text, line).is_some() {
                continue;
            }
            let Some((part, table)) = surfaces.document(source) else { return Ok(None) };
            let mut table = KeyTable::part(part, table, SCENE_KEYS)?;
            if let Some(surfaces) = table.take("surface") {
                self.surfaces(surfaces)?;
            }
        }
        self.finish().map(Some)
    }

    /// Reads surfaces without a document; `None` where any of them needs one.
    fn plain_surfaces(&mut self, text: &str, line: u32) -> Option<()> {
        let surfaces = plain_surfaces(text, line)?;
        let materials: Vec<&MaterialTable> =
            surfaces.iter().map(|surface| self.materials.get(&*surface.material)).collect::<Option<_>>()?;
        let mut names = surfaces.iter().filter_map(|surface| surface.name.as_deref());
        names.all(can_name_a_surface).then_some(())?;
        for (surface, material) in surfaces.into_iter().zip(materials) {
            let PlainSurface { name, shape, sides, header, outline, cells, .. } = surface;
            let [quad, triangle] = match shape {
                Shape::Parallelogram { .. } | Shape::Divided { .. } => [outline, 0],
                Shape::Triangle { .. } => [0, outline],
            };
            let keys = [quad, triangle, cells.unwrap_or(0), 0];
            let site = SurfaceSite { material: material.number, header, keys };
            let surface = SurfaceSpec {
                name: name.map(Arc::from),
                shape,
                sides,
                reflectance: material.reflectance,
                emittance: material.emittance,
                cell_emittance: Vec::new(),
                transmittance: material.transmittance,
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
        let mut unused: Vec<&str> = self.options.materials.iter().map(|entry| &entry.pattern[..]).collect();
        let mut lamps = OpenLamps::default();
        for (number, value) in meshes.into_iter().enumerate() {
            let (file, imported, finish, options) = self.mesh(value, number)?;
            unused.retain(|pattern| options.materials.iter().all(|entry| entry.pattern != *pattern));
            let first = self.scene.spec.surfaces.len();
            // The scene's own material is of both sides.
            if finish.is_none() {
                lamps.add(&imported, first);
            }
            self.scene.add(&file, imported, finish.as_deref(), &options);
            let material = finish.and_then(|name| self.materials.get(&name));
            for surface in &mut self.scene.spec.surfaces[first..] {
                surface.transmittance = material.map_or(Spectrum::BLACK, |material| material.transmittance);
            }
        }
        self.scene.notes.extend(lamps.aim(&mut self.scene.spec));
        if let Some(pattern) = unused.first().filter(|_| !self.scene.meshes.is_empty()) {
            return Err(Error::Refused {
                place: Box::new(SourceLocation {
                    file: self.scene.path.clone(),
                    spot: SourceSpot::File,
                    key: format!("import.material.{pattern:?}"),
                }),
                problem: "no mesh has such a material or part".into(),
                why: "it would change nothing",
                remedy: "correct the name, or remove the entry".into(),
            });
        }
        // Those of meshes stand behind those of the scene.
        let of_meshes = std::mem::replace(&mut self.scene.spec.lamps, self.lamps);
        self.scene.spec.lamps.append(of_meshes);
        if let Some(emittance) = self.sky {
            self.scene.add_sky(emittance);
        }
        self.scene.spec.panes = self.panes;
        Ok(self.scene)
    }

    /// The file of a mesh, its surfaces, the material that all of them have, where the scene gives them one, and how it was read.
    fn mesh(
        &self,
        value: Value<'_>,
        number: usize,
    ) -> Result<(PathBuf, Imported, Option<String>, Options), Error> {
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
                reflectance: Some(material.reflectance),
                emittance: Some(material.emittance),
                ..MaterialOverride::of("*")
            });
        }
        let imported = mesh.into_scene(&path, format, &options).map_err(Error::of_mesh)?;
        Ok((path, imported, finish, options))
    }
}

pub(crate) fn is_toml(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"))
}

pub(crate) fn unknown_format(path: &Path) -> Error {
    match path.extension() {
        None if path.is_dir() => Error::Folder { file: path.into() },
        None => Error::SceneFormat { file: path.into(), format: "files without extension".into() },
        Some(extension) => {
            let format = format!(".{} scenes", extension.to_string_lossy().to_lowercase());
            Error::SceneFormat { file: path.into(), format }
        }
    }
}
