//! Groups of faces, between which exchange factors are counted.

use std::path::{Path, PathBuf};

use import::matches;
use radiosity::{Scene, Side, surfaces::Faces};

use crate::document::{KeyTable, Value};
use crate::error::Error;
use crate::scene::SceneFile;
use crate::source::SourceText;

/// The rule that assigns faces to groups.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Grouping {
    /// Each face is a group.
    ByPatch,
    /// Surfaces of one name are a group, with both of their sides.
    BySurface,
    /// Surfaces of one material are a group, with both of their sides.
    ByMaterial,
    /// A file lists the groups.
    File(PathBuf),
}

/// Groups of the faces of a scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FaceGroups {
    /// The name of each group.
    pub names: Vec<String>,
    /// The group of each face.
    pub of_face: Vec<u32>,
}

/// What a file of groups does not name.
const REST: &str = "rest";

const FILE_KEYS: &[&str] = &["group"];
const GROUP_KEYS: &[&str] = &["name", "surfaces", "materials", "patches"];

impl FaceGroups {
    /// The groups of a scene.
    ///
    /// # Errors
    /// Of a file: one that cannot be read, or says what is unknown, or puts a face in two groups.
    pub fn of(grouping: &Grouping, file: &SceneFile, scene: &Scene) -> Result<Self, Error> {
        match grouping {
            Grouping::ByPatch => Ok(FaceGroups::by_patch(scene.faces())),
            Grouping::BySurface => {
                Ok(FaceGroups::by_name(scene, |surface| scene.surface_name(surface).to_owned()))
            }
            Grouping::ByMaterial => {
                let finishes = file.finishes();
                let of = finishes.of_surfaces();
                Ok(FaceGroups::by_name(scene, |surface| {
                    finishes.names()[of[surface as usize] as usize].clone()
                }))
            }
            Grouping::File(path) => GroupReader::new(file, scene).read(path),
        }
    }

    fn by_patch(faces: &Faces) -> Self {
        let name = |face: radiosity::surfaces::Face| match (faces.back_of(face.patch), face.side) {
            (None, _) => face.patch.to_string(),
            (Some(_), Side::Front) => format!("{} front", face.patch),
            (Some(_), Side::Back) => format!("{} back", face.patch),
        };
        FaceGroups { names: faces.iter().map(name).collect(), of_face: (0..faces.len() as u32).collect() }
    }

    /// A group for each name, in the order of the first surfaces that have it.
    fn by_name(scene: &Scene, name: impl Fn(u32) -> String) -> Self {
        let (mut names, mut numbers) = (Vec::new(), std::collections::HashMap::new());
        let of_surface: Vec<u32> = (0..scene.surfaces().len() as u32)
            .map(|surface| {
                let name = name(surface);
                *numbers.entry(name.clone()).or_insert_with(|| {
                    names.push(name);
                    names.len() as u32 - 1
                })
            })
            .collect();
        let of_face = scene.faces().iter().map(|face| of_surface[face.surface as usize]).collect();
        FaceGroups { names, of_face }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.names.len()
    }
}

/// Reads a file of groups.
struct GroupReader<'a> {
    file: &'a SceneFile,
    scene: &'a Scene,
    /// The material of each surface.
    materials: Vec<u32>,
    names: Vec<String>,
    of_face: Vec<Option<u32>>,
}

impl<'a> GroupReader<'a> {
    fn new(file: &'a SceneFile, scene: &'a Scene) -> Self {
        let of_face = vec![None; scene.faces().len()];
        GroupReader { file, scene, materials: file.finishes().of_surfaces(), names: Vec::new(), of_face }
    }

    fn read(mut self, path: &Path) -> Result<FaceGroups, Error> {
        let source =
            SourceText::read(path, "[[group]] tables, each with a name and surfaces, materials or patches")?;
        let mut file = KeyTable::root(&source, FILE_KEYS)?;
        let list = file.require("group", "a file of groups holds them", "[[group]] with name = \"walls\"")?;
        for (number, value) in list.tables("group")?.into_iter().enumerate() {
            self.group(value.table_called(format!("group {number}: "), GROUP_KEYS)?)?;
        }
        if self.of_face.contains(&None) {
            self.names.push(REST.into());
        }
        let rest = self.names.len() as u32 - 1;
        Ok(FaceGroups {
            of_face: self.of_face.into_iter().map(|group| group.unwrap_or(rest)).collect(),
            names: self.names,
        })
    }

    fn group(&mut self, mut table: KeyTable<'_>) -> Result<(), Error> {
        let value = table.require("name", "tables of factors tell groups by it", "name = \"walls\"")?;
        let name = value.string()?.to_owned();
        if name.trim().is_empty()
            || name.contains(char::is_control)
            || name == REST
            || self.names.contains(&name)
        {
            return Err(value.refuse(
                format!("{name:?} cannot name a group"),
                "each has a visible name of its own on one line; \"rest\" is what no group names",
                "choose another name",
            ));
        }
        self.names.push(name);
        let place = table.place("surfaces");
        let (surfaces, materials, patches) =
            (table.take("surfaces"), table.take("materials"), table.take("patches"));
        if surfaces.is_none() && materials.is_none() && patches.is_none() {
            let remedy = "surfaces = [\"floor\"], materials = [\"white\"] or patches = [0, 1]".into();
            return Err(Error::MissingKey { place, why: "a group holds something", remedy });
        }
        let (scene, names) = (self.scene, self.file.finishes().names());
        for value in surfaces.map(Value::array).transpose()?.into_iter().flatten() {
            self.take_surfaces(&value, "surface", |surface| scene.surface_name(surface).to_owned())?;
        }
        let of = self.materials.clone();
        for value in materials.map(Value::array).transpose()?.into_iter().flatten() {
            self.take_surfaces(&value, "material", |surface| names[of[surface as usize] as usize].clone())?;
        }
        for value in patches.map(Value::array).transpose()?.into_iter().flatten() {
            let last = scene.faces().patch_count() as u64 - 1;
            let patch = value.integer(0..=last, "patches are numbered from 0 in the scene")? as u32;
            for face in scene.faces().of_patch(patch) {
                self.take(&value, face)?;
            }
        }
        Ok(())
    }

    /// Takes the faces of surfaces whose name, or whose material's, matches.
    fn take_surfaces(
        &mut self,
        value: &Value<'_>,
        what: &str,
        name: impl Fn(u32) -> String,
    ) -> Result<(), Error> {
        let pattern = value.string()?;
        let matching: Vec<bool> =
            (0..self.scene.surfaces().len() as u32).map(|surface| matches(pattern, &name(surface))).collect();
        if !matching.contains(&true) {
            return Err(value.refuse(
                format!("no {what} is called {pattern:?}"),
                "a group holds faces of the scene",
                "correct the name (* stands for any text)",
            ));
        }
        for (number, face) in self.scene.faces().iter().enumerate() {
            if matching[face.surface as usize] {
                self.take(value, number as u32)?;
            }
        }
        Ok(())
    }

    /// Takes a face for the last group.
    fn take(&mut self, value: &Value<'_>, face: u32) -> Result<(), Error> {
        let group = self.names.len() as u32 - 1;
        match self.of_face[face as usize].replace(group) {
            Some(other) if other != group => {
                let patch = self.scene.faces().get(face as usize).patch;
                let [first, second] = [other, group].map(|group| &self.names[group as usize]);
                Err(value.refuse(
                    format!("patch {patch} is in group {first:?} and in group {second:?}"),
                    "what arrives on a patch is counted for one group",
                    "name it once",
                ))
            }
            _ => Ok(()),
        }
    }
}
