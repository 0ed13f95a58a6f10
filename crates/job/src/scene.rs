//! The scene file.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use glam::DVec3;
use radiosity::{IndexChoice, Scene, SceneError, SceneSpec, Shape, Sides, Spectrum, SurfaceSpec};

use crate::document::{Table, Value};
use crate::error::{Error, Place, Spot};
use crate::source::Source;

/// A scene as written, and where.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneFile {
    path: PathBuf,
    spec: SceneSpec,
    /// Per surface.
    sites: Vec<SurfaceSite>,
    materials: BTreeMap<String, Lines>,
}

/// Where a surface is written.
#[derive(Clone, Debug, PartialEq)]
struct SurfaceSite {
    material: String,
    lines: Lines,
}

/// The lines of a table, from 1.
#[derive(Clone, Debug, PartialEq)]
struct Lines {
    header: usize,
    keys: Vec<(&'static str, usize)>,
}

impl Lines {
    /// The line of a key, or of the table where the key is absent.
    fn of(&self, key: &str) -> usize {
        self.keys.iter().find(|(known, _)| *known == key).map_or(self.header, |&(_, line)| line)
    }
}

impl SceneFile {
    /// The scene file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What it says; its numbers are checked by [`SceneFile::build`].
    pub fn spec(&self) -> &SceneSpec {
        &self.spec
    }

    /// The number of patches.
    pub fn patch_count(&self) -> u64 {
        self.spec.surfaces.iter().map(|surface| surface.shape.cell_count()).sum()
    }

    /// Checks the numbers and builds the scene.
    ///
    /// # Errors
    /// [`Error::Scene`]: what [`Scene::build`] refuses, with the line of the surface's or material's key.
    pub fn build(&self, index: IndexChoice) -> Result<Scene, Error> {
        Scene::build(&self.spec, index).map_err(|error| self.locate(error))
    }

    fn locate(&self, error: SceneError) -> Error {
        match error {
            SceneError::Surface { surface, key, problem } => {
                let (line, key) = self.locate_key(surface, key);
                let place = Place { file: self.path.clone(), spot: Spot::Line(line), key };
                Error::Scene { place: Box::new(place), problem }
            }
            SceneError::Whole(problem) => {
                let place = Place { file: self.path.clone(), spot: Spot::File, key: String::new() };
                Error::Scene { place: Box::new(place), problem }
            }
        }
    }

    fn locate_key(&self, surface: usize, key: &str) -> (usize, String) {
        let site = &self.sites[surface];
        let label = label(surface, self.spec.surfaces[surface].name.as_deref());
        if matches!(key, "reflectance" | "emittance") {
            let line = self.materials[&site.material].of(key);
            return (line, format!("material.{}.{key}, used by {label}", site.material));
        }
        (site.lines.of(key), format!("{label}: {key}"))
    }
}

/// Reads a scene file.
///
/// # Errors
/// A file that cannot be read, is not TOML or of a format without reader, or says what is unknown, missing, not
/// allowed or not built yet.
pub fn load_scene(path: &Path) -> Result<SceneFile, Error> {
    refuse_other_formats(path)?;
    let source = Source::read(path, "[material.NAME] tables and [[surface]] tables")?;
    let mut table = Table::root(&source, &["material", "surface", "mesh"])?;
    if let Some(mesh) = table.take("mesh") {
        return Err(Error::NotBuilt {
            place: mesh.place(),
            what: "a [[mesh]]".into(),
            remedy: "write its triangles as [[surface]] tables".into(),
        });
    }
    let materials = read_materials(&mut table)?;
    let mut spec = SceneSpec { surfaces: Vec::new() };
    let mut sites = Vec::new();
    let written = table.take("surface").map(Value::array).transpose()?.unwrap_or_default();
    for (number, value) in written.into_iter().enumerate() {
        let (surface, site) = read_surface(value, number, &materials)?;
        spec.surfaces.push(surface);
        sites.push(site);
    }
    let materials = materials.into_iter().map(|(name, material)| (name, material.lines)).collect();
    Ok(SceneFile { path: path.into(), spec, sites, materials })
}

pub(crate) fn is_toml(path: &Path) -> bool {
    extension(path) == "toml"
}

fn extension(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_lowercase()
}

fn refuse_other_formats(path: &Path) -> Result<(), Error> {
    let format = extension(path);
    let (format, planned) = match format.as_str() {
        "toml" => return Ok(()),
        "" if path.is_dir() => return Err(Error::Folder { file: path.into() }),
        "" => ("scenes without extension".into(), false),
        "obj" | "gltf" | "glb" | "mgf" => (format!(".{format}"), true),
        _ => (format!(".{format}"), false),
    };
    Err(Error::SceneFormat { file: path.into(), format, planned, remedy: "write the scene as .toml" })
}

/// What `[material.NAME]` says.
struct Material {
    reflectance: Spectrum,
    emittance: Spectrum,
    lines: Lines,
}

fn read_materials(table: &mut Table<'_>) -> Result<BTreeMap<String, Material>, Error> {
    let Some(value) = table.take("material") else { return Ok(BTreeMap::new()) };
    value.any_table()?.into_values().map(|(name, value)| Ok((name, read_material(value)?))).collect()
}

fn read_material(value: Value<'_>) -> Result<Material, Error> {
    let mut lines = Lines { header: value.line(), keys: Vec::new() };
    let mut table = value.table(&["reflectance", "emittance"])?;
    let mut spectrum = |key| {
        let Some(value) = table.take(key) else { return Ok(Spectrum::BLACK) };
        lines.keys.push((key, value.line()));
        read_spectrum(value)
    };
    Ok(Material { reflectance: spectrum("reflectance")?, emittance: spectrum("emittance")?, lines })
}

/// A number, or one for each of red, green and blue.
fn read_spectrum(value: Value<'_>) -> Result<Spectrum, Error> {
    if !value.is_array() {
        return value.number().map(Spectrum::from);
    }
    let [r, g, b] = value.exactly("a number, or three: [r, g, b]")?;
    Ok(Spectrum::rgb([r.number()?, g.number()?, b.number()?]))
}

const SURFACE_KEYS: &[&str] = &["name", "material", "quad", "triangle", "patches", "sides", "emit"];

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
    materials: &BTreeMap<String, Material>,
) -> Result<(SurfaceSpec, SurfaceSite), Error> {
    let mut lines = Lines { header: value.line(), keys: Vec::new() };
    let mut table = value.table_called(format!("{}: ", label(number, None)), SURFACE_KEYS)?;
    let name = table.take("name").map(|value| read_surface_name(&value)).transpose()?;
    table.rename(format!("{}: ", label(number, name.as_deref())));
    for key in ["quad", "triangle", "patches", "emit"] {
        lines.keys.extend(table.line(key).map(|line| (key, line)));
    }
    let (material_name, material) = read_material_name(&mut table, materials)?;
    let shape = read_shape(&mut table)?;
    let sides = table.take("sides").map(|value| read_sides(&value)).transpose()?.unwrap_or(Sides::Front);
    let cell_emittance = table.take("emit").map(|value| read_emit(value, &shape)).transpose()?;
    let surface = SurfaceSpec {
        name,
        shape,
        sides,
        reflectance: material.reflectance,
        emittance: material.emittance,
        cell_emittance: cell_emittance.unwrap_or_default(),
    };
    Ok((surface, SurfaceSite { material: material_name, lines }))
}

fn read_surface_name(value: &Value<'_>) -> Result<String, Error> {
    let name = value.string()?;
    if name.trim().is_empty() || name.contains(char::is_control) {
        return Err(value.refuse(
            format!("{name:?} cannot name a surface"),
            "it is shown in the rows of its patches",
            "write a visible name on one line, or remove the key to show the surface's number",
        ));
    }
    Ok(name.into())
}

fn read_material_name<'m>(
    table: &mut Table<'_>,
    materials: &'m BTreeMap<String, Material>,
) -> Result<(String, &'m Material), Error> {
    let value =
        table.require("material", "a surface takes its reflectance from it", "material = \"NAME\"")?;
    let name = value.string()?;
    let material = materials.get(name).ok_or_else(|| Error::UnknownMaterial {
        place: value.place(),
        material: name.into(),
        known: materials.keys().cloned().collect(),
    })?;
    Ok((name.into(), material))
}

fn read_shape(table: &mut Table<'_>) -> Result<Shape, Error> {
    let (quad, triangle, patches) = (table.take("quad"), table.take("triangle"), table.take("patches"));
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
    Ok(shape)
}

fn read_corners(value: Value<'_>) -> Result<[DVec3; 3], Error> {
    let [a, b, c] = value.exactly("three corners: [[x, y, z], [x, y, z], [x, y, z]]")?;
    Ok([read_corner(a)?, read_corner(b)?, read_corner(c)?])
}

fn read_corner(value: Value<'_>) -> Result<DVec3, Error> {
    let [x, y, z] = value.exactly("a corner in metres: [x, y, z]")?;
    Ok(DVec3::new(x.number()?, y.number()?, z.number()?))
}

/// Patch numbers are 32 bits wide, and so are the numbers that count them.
const CELLS_WIDTH: &str = "a surface has at least one patch, and patch numbers are 32 bits wide";

fn read_grid(value: Value<'_>) -> Result<[u32; 2], Error> {
    let place = value.place();
    let [nu, nv] = value.exactly("the cells of a quad along u and v: [nu, nv]")?;
    let [nu, nv] = [read_cells(&nu)?, read_cells(&nv)?];
    if nu.checked_mul(nv).is_none() {
        return Err(Error::Refused {
            place,
            problem: format!("{nu} × {nv} patches are too many"),
            why: CELLS_WIDTH,
            remedy: "choose fewer".into(),
        });
    }
    Ok([nu, nv])
}

fn read_cells(value: &Value<'_>) -> Result<u32, Error> {
    Ok(value.integer(1..=u64::from(u32::MAX), CELLS_WIDTH)? as u32)
}

fn read_rows(value: &Value<'_>) -> Result<u32, Error> {
    if value.is_array() {
        return Err(value.wrong_type("the rows of a triangle: one integer k, for k² patches"));
    }
    Ok(value.integer(1..=u64::from(u16::MAX), CELLS_WIDTH)? as u32)
}

fn read_sides(value: &Value<'_>) -> Result<Sides, Error> {
    match value.integer(1..=2, "a surface has two sides, and the front is always active")? {
        1 => Ok(Sides::Front),
        _ => Ok(Sides::Both),
    }
}

/// (cell index, emittance [W/m²]) per entry.
fn read_emit(value: Value<'_>, shape: &Shape) -> Result<Vec<(u32, Spectrum)>, Error> {
    let mut listed = BTreeSet::new();
    let mut emit = Vec::new();
    for value in value.array()? {
        let place = value.place();
        let mut table = value.table(&["cell", "emittance"])?;
        let cell = table.require("cell", "an entry is about one cell", "cell = [i, j]")?;
        let emittance = table.require("emittance", "an entry changes it", "emittance = 1.0, in W/m²")?;
        let cell = read_cell(cell, shape)?;
        if !listed.insert(cell) {
            let [i, j] = shape.cell_label(cell);
            return Err(Error::Refused {
                place,
                problem: format!("cell [{i}, {j}] is listed twice"),
                why: "it has one emittance",
                remedy: "list it once".into(),
            });
        }
        emit.push((cell, read_spectrum(emittance)?));
    }
    Ok(emit)
}

fn read_cell(value: Value<'_>, shape: &Shape) -> Result<u32, Error> {
    let [i, j] = value.exactly("a cell: [iu, iv] of a quad, [row, position] of a triangle")?;
    let label = match *shape {
        Shape::Parallelogram { cells: [nu, nv], .. } => [read_step(&i, nu - 1)?, read_step(&j, nv - 1)?],
        Shape::Triangle { rows, .. } => {
            let row = read_step(&i, rows - 1)?;
            [row, read_step(&j, 2 * row)?]
        }
    };
    Ok(shape.cell_index(label).expect("a cell within bounds, as just found"))
}

fn read_step(value: &Value<'_>, last: u32) -> Result<u32, Error> {
    Ok(value.integer(0..=u64::from(last), "cells are counted from 0 within the surface")? as u32)
}
