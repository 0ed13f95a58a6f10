//! Groups of patches that a job names: `[[source]]` and `[sensitivity]`.

use std::collections::BTreeSet;

use radiosity::groups::{Groups, PatchGroup};

use crate::document::{KeyTable, Value};
use crate::error::{Error, SourceLocation};
use crate::keys::{JOB_LISTS, SENSITIVITY_KEYS, SOURCE_KEYS};
use crate::method::read_patches;
use crate::near;
use crate::scene::SceneFile;

/// What a job says of sources, and of materials whose influence is measured.
pub(crate) fn read_groups(
    table: &mut KeyTable<'_>,
    scene: &SceneFile,
) -> Result<[Vec<PatchGroup>; 2], Error> {
    let sources = table.take("source").map(|value| read_sources(value, scene)).transpose()?;
    let sensitivity = table.take("sensitivity").map(|value| read_sensitivity(value, scene)).transpose()?;
    Ok([sources, sensitivity].map(Option::unwrap_or_default))
}

/// Reads `[[source]]` tables. That sources have emitters, and share none, is seen when the scene is built.
fn read_sources(value: Value<'_>, scene: &SceneFile) -> Result<Vec<PatchGroup>, Error> {
    let mut names = BTreeSet::new();
    let mut sources = Vec::new();
    for (number, value) in value.tables(JOB_LISTS[0])?.into_iter().enumerate() {
        let mut table = value.table_called(format!("source {number}: "), SOURCE_KEYS)?;
        let name = table.require(
            "name",
            "outputs and `radwalk combine` tell sources by their names",
            "name = \"lamp\", or another",
        )?;
        let written = read_name(&name)?;
        if !names.insert(written.clone()) {
            return Err(name.refuse(
                format!("a source before this one is called {written:?}, too"),
                "outputs and `radwalk combine` tell sources by their names",
                "give each a name of its own",
            ));
        }
        table.rename(format!("source {number} ({written:?}): "));
        sources.push(PatchGroup { name: written, patches: runs(&read_members(table, scene)?) });
    }
    Ok(sources)
}

fn read_name(value: &Value<'_>) -> Result<String, Error> {
    let name =
        value.name("source", "it is shown in the rows of its light", "write a visible name on one line")?;
    if name == Groups::REST {
        return Err(value.refuse(
            format!("{name:?} cannot name a source"),
            "the emitters that no source holds are called so",
            "write another name",
        ));
    }
    Ok(name)
}

/// The patches of the surfaces, materials and patches that a source names, in ascending order.
fn read_members(mut table: KeyTable<'_>, scene: &SceneFile) -> Result<BTreeSet<u32>, Error> {
    let place = table.place("surfaces");
    let [surfaces, materials, patches, lamps] =
        ["surfaces", "materials", "patches", "lamps"].map(|key| table.take(key));
    if surfaces.is_none() && materials.is_none() && patches.is_none() && lamps.is_none() {
        return Err(Error::MissingKey {
            place,
            why: "a source is a group of emitters",
            remedy: "surfaces = [\"…\"], materials = [\"…\"], patches = [0, 1] or lamps = [\"…\"]".into(),
        });
    }
    let first_cells = first_cells(scene);
    let mut cells = BTreeSet::new();
    let mut add = |surface: usize| cells.extend(first_cells[surface]..first_cells[surface + 1]);
    for value in surfaces.map(Value::array).transpose()?.unwrap_or_default() {
        surfaces_of(&value, scene)?.into_iter().for_each(&mut add);
    }
    for value in materials.map(Value::array).transpose()?.unwrap_or_default() {
        let names = materials_of(&value, scene)?;
        let of_surfaces = scene.finishes().of_surfaces().into_iter().enumerate();
        of_surfaces.filter(|(_, material)| names.contains(material)).for_each(|(surface, _)| add(surface));
    }
    let mut members = patches_of(&cells, scene, &place)?;
    if let Some(patches) = patches {
        let (why, instead) = ("a source holds some patch", "remove the key");
        members.extend(read_patches(patches, scene.known_patch_count(), why, instead)?);
    }
    for value in lamps.map(Value::array).transpose()?.unwrap_or_default() {
        // Lamps are numbered behind the patches.
        let behind = |lamp: usize| u32::try_from(scene.patch_count() + lamp as u64).unwrap_or(u32::MAX);
        members.extend(lamps_of(&value, scene)?.into_iter().map(behind));
    }
    Ok(members)
}

/// The patches of the cells that `place` names: whole ones.
fn patches_of(
    cells: &BTreeSet<u32>,
    scene: &SceneFile,
    place: &SourceLocation,
) -> Result<BTreeSet<u32>, Error> {
    let patch_of_cell = &scene.spec().patch_of_cell;
    if patch_of_cell.is_empty() {
        return Ok(cells.clone());
    }
    let patches: BTreeSet<u32> = cells.iter().map(|&cell| patch_of_cell[cell as usize]).collect();
    let missing =
        (0..).zip(patch_of_cell).find(|(cell, patch)| patches.contains(patch) && !cells.contains(cell));
    let Some((cell, patch)) = missing else { return Ok(patches) };
    let first_cells = first_cells(scene);
    let surface = first_cells.partition_point(|&first| first <= cell) - 1;
    let name =
        scene.spec().surfaces[surface].name.as_deref().map_or_else(|| surface.to_string(), str::to_owned);
    Err(Error::Refused {
        place: place.clone().into(),
        problem: format!("patch {patch} is a group of faces of which some are named, and {name} is not"),
        why: "light is told apart by whole patches",
        remedy: "name all faces of the object, or remove import.group_size".into(),
    })
}

/// The number of the first cell of every surface, and the number of all cells. A scene of more patches than have numbers
/// is refused when it is built.
fn first_cells(scene: &SceneFile) -> Vec<u32> {
    let cells = scene.spec().surfaces.iter().map(|surface| surface.shape.cell_count());
    let ends = cells.scan(0_u64, |end, cells| {
        *end += cells;
        Some(u32::try_from(*end).unwrap_or(u32::MAX))
    });
    std::iter::once(0).chain(ends).collect()
}

/// Surfaces by number, or by a name in which `*` stands for any text.
fn surfaces_of(value: &Value<'_>, scene: &SceneFile) -> Result<Vec<usize>, Error> {
    let surfaces = &scene.spec().surfaces;
    if !value.is_string() {
        let last = surfaces.len().saturating_sub(1) as u64;
        return Ok(vec![value.integer(0..=last, "the scene's surfaces are numbered from 0")? as usize]);
    }
    let pattern = value.string()?;
    let name_of = |surface: usize| surfaces[surface].name.as_deref();
    let is_meant = |&surface: &usize| name_of(surface).is_some_and(|name| import::matches(pattern, name));
    let meant: Vec<usize> = (0..surfaces.len()).filter(is_meant).collect();
    if meant.is_empty() {
        let hint = near::hint(pattern, (0..surfaces.len()).filter_map(name_of));
        return Err(value.refuse(
            format!("no surface is called {pattern:?}"),
            "a source holds surfaces by their names or numbers",
            format!("{hint}write the name of a surface, a part of it and *, or a number"),
        ));
    }
    Ok(meant)
}

/// Lamps without area by number, or by a name in which `*` stands for any text.
fn lamps_of(value: &Value<'_>, scene: &SceneFile) -> Result<Vec<usize>, Error> {
    let lamps = &scene.spec().lamps.list;
    if lamps.is_empty() {
        let why = "a source holds those of its `lamps`";
        return Err(value.refuse(
            "the scene has no [[lamp]]".into(),
            why,
            "name `surfaces`, or remove the key",
        ));
    }
    if !value.is_string() {
        let last = lamps.len().saturating_sub(1) as u64;
        return Ok(vec![value.integer(0..=last, "the scene's lamps are numbered from 0")? as usize]);
    }
    let pattern = value.string()?;
    let meant: Vec<usize> =
        (0..lamps.len()).filter(|&lamp| import::matches(pattern, &lamps[lamp].name)).collect();
    if meant.is_empty() {
        return Err(value.refuse(
            format!("no lamp is called {pattern:?}"),
            "a source holds lamps by their names or numbers",
            format!(
                "{}write the name of a [[lamp]], a part of it and *, or a number",
                near::hint(pattern, lamps.iter().map(|lamp| &lamp.name[..]))
            ),
        ));
    }
    Ok(meant)
}

/// Materials by a name in which `*` stands for any text.
fn materials_of(value: &Value<'_>, scene: &SceneFile) -> Result<Vec<u32>, Error> {
    let pattern = value.string()?;
    let names = scene.finishes().names();
    let meant: Vec<u32> =
        (0..).zip(names).filter(|(_, name)| import::matches(pattern, name)).map(|(i, _)| i).collect();
    if meant.is_empty() {
        let hint = near::hint(pattern, names.iter().map(|name| &name[..]));
        return Err(value.refuse(
            format!("no surface is of a material {pattern:?}"),
            "materials are told by the names that surfaces have them by",
            format!("{hint}choose from {}", names.join(", ")),
        ));
    }
    Ok(meant)
}

/// Numbers that follow each other, as runs.
fn runs(patches: &BTreeSet<u32>) -> Vec<(u32, u32)> {
    let mut runs: Vec<(u32, u32)> = Vec::new();
    for &patch in patches {
        match runs.last_mut() {
            Some((_, last)) if *last + 1 == patch => *last = patch,
            _ => runs.push((patch, patch)),
        }
    }
    runs
}

/// Reads `[sensitivity]`: the materials whose influence on every patch is measured, each as the group of its patches.
fn read_sensitivity(value: Value<'_>, scene: &SceneFile) -> Result<Vec<PatchGroup>, Error> {
    let mut table = value.table(SENSITIVITY_KEYS)?;
    let materials = table.require(
        "materials",
        "it says what light is sensitive to",
        "materials = \"all\", or a list of materials",
    )?;
    let place = materials.place();
    let numbers: BTreeSet<u32> = match materials.is_string() {
        true if materials.string()? == "all" => (0..scene.finishes().names().len() as u32).collect(),
        true => {
            return Err(materials.refuse(
                "this is neither \"all\" nor a list".into(),
                "it names materials",
                "write materials = \"all\", or materials = [\"…\"]",
            ));
        }
        false => {
            let mut numbers = BTreeSet::new();
            for value in materials.array()? {
                numbers.extend(materials_of(&value, scene)?);
            }
            numbers
        }
    };
    if numbers.is_empty() {
        return Err(Error::Refused {
            place: place.clone(),
            problem: "it names no material".into(),
            why: "light is sensitive to materials",
            remedy: "name a material of the scene, or remove [sensitivity]".into(),
        });
    }
    let first_cells = first_cells(scene);
    let of_surfaces = scene.finishes().of_surfaces();
    let group = |number: u32| {
        let is_of = |&surface: &usize| of_surfaces[surface] == number;
        let surfaces = (0..of_surfaces.len()).filter(is_of);
        let cells = surfaces.flat_map(|surface| first_cells[surface]..first_cells[surface + 1]).collect();
        let patches = patches_of(&cells, scene, &place)?;
        Ok(PatchGroup { name: scene.finishes().names()[number as usize].clone(), patches: runs(&patches) })
    };
    numbers.into_iter().map(group).collect()
}
