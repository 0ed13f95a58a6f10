//! Temperatures and fluxes of groups.

use std::collections::HashMap;
use std::path::Path;

use exchange::BoundaryCondition;
use import::matches;
use serde::{Deserialize, Serialize};

use crate::document::{KeyTable, Value};
use crate::error::Error;
use crate::source::SourceText;

/// What a file says of the groups of an enclosure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Enclosure {
    /// The temperature of the environment that what escapes meets [K]; 0 where none is given.
    pub environment: Option<f64>,
    /// What is given of each group.
    pub given: Vec<BoundaryCondition>,
    /// What replaces the emissivity of each group's surfaces, 1 − reflectance.
    pub emissivities: Vec<Option<f64>>,
}

const FILE_KEYS: &[&str] = &["environment", "group"];
const GROUP_KEYS: &[&str] = &["name", "temperature", "flux", "emissivity"];

/// What a group goes by.
#[derive(Clone, Debug)]
pub struct GroupNames {
    /// Its own name.
    pub own: String,
    /// The name of the surface that it is a part of, and the group's area [m²]; `None` where it is no part.
    pub part_of: Option<(String, f64)>,
}

impl GroupNames {
    /// A whole that goes by one name.
    pub fn whole(own: String) -> Self {
        GroupNames { own, part_of: None }
    }

    /// The name that a message uses.
    fn name(&self) -> &str {
        self.part_of.as_ref().map_or(&self.own, |(surface, _)| surface)
    }

    /// The surface whose part it is, where a pattern names it, and the area of the part.
    fn named_surface(&self, pattern: &str) -> Option<(&str, f64)> {
        let (surface, area) = self.part_of.as_ref()?;
        matches(pattern, surface).then_some((&**surface, *area))
    }

    fn is_called(&self, pattern: &str) -> bool {
        matches(pattern, &self.own) || self.named_surface(pattern).is_some()
    }
}

/// Reads what is given of groups. What is given of a surface is given of all of its parts: they share its flux by area. Later entries win.
///
/// # Errors
/// A file that cannot be read, says what is unknown or not allowed, or leaves a group out.
pub fn load_enclosure(path: &Path, names: &[GroupNames]) -> Result<Enclosure, Error> {
    let source = SourceText::read(path, "[[group]] tables, each with a name and a temperature or a flux")?;
    let mut file = KeyTable::root(&source, FILE_KEYS)?;
    let environment = file.take("environment").map(|value| read_kelvin(&value)).transpose()?;
    let place = file.place("group");
    let list = file.require("group", "a balance needs temperatures", "[[group]] with name = \"*\"")?;
    let (mut given, mut emissivities) = (vec![None; names.len()], vec![None; names.len()]);
    for (number, value) in list.tables("group")?.into_iter().enumerate() {
        let mut table = value.table_called(format!("group {number}: "), GROUP_KEYS)?;
        let pattern = table.require("name", "an entry is about a group", "name = \"walls\"")?;
        let (pattern, chosen) = find(&pattern, names)?;
        let mut areas: HashMap<&str, f64> = HashMap::new();
        for (surface, area) in chosen.iter().filter_map(|&group| names[group].named_surface(pattern)) {
            *areas.entry(surface).or_default() += area;
        }
        let emissivity = table.take("emissivity").map(|value| read_emissivity(&value)).transpose()?;
        let condition = read_condition(table)?;
        for group in chosen {
            let part =
                names[group].named_surface(pattern).map_or(1.0, |(surface, area)| area / areas[surface]);
            given[group] = Some(match condition {
                BoundaryCondition::Flux(flux) => BoundaryCondition::Flux(flux * part),
                temperature => temperature,
            });
            emissivities[group] = emissivity.or(emissivities[group]);
        }
    }
    if let Some(missing) = given.iter().position(Option::is_none) {
        return Err(Error::Refused {
            place,
            problem: format!("nothing is given of group {:?}", names[missing].name()),
            why: "each group has a temperature, or a flux from which it follows",
            remedy: "add a [[group]] for it; name = \"*\" stands for all".into(),
        });
    }
    Ok(Enclosure { environment, given: given.into_iter().flatten().collect(), emissivities })
}

/// The pattern that a value is, and the groups that it names.
fn find<'a>(value: &'a Value<'_>, names: &[GroupNames]) -> Result<(&'a str, Vec<usize>), Error> {
    let pattern = value.string()?;
    let chosen: Vec<usize> = (0..names.len()).filter(|&group| names[group].is_called(pattern)).collect();
    if !chosen.is_empty() {
        return Ok((pattern, chosen));
    }
    let mut known: Vec<String> = names.iter().map(|names| format!("{:?}", names.name())).collect();
    known.dedup();
    known.truncate(12);
    let known = known.join(", ");
    Err(value.refuse(
        format!("no group is called {pattern:?}"),
        "the names are those of --groups",
        format!("write one of {known} (* stands for any text)"),
    ))
}

fn read_condition(mut table: KeyTable<'_>) -> Result<BoundaryCondition, Error> {
    match (table.take("temperature"), table.take("flux")) {
        (Some(temperature), None) => Ok(BoundaryCondition::Temperature(read_kelvin(&temperature)?)),
        (None, Some(flux)) => Ok(BoundaryCondition::Flux(flux.number()?)),
        (Some(_), Some(flux)) => Err(flux.refuse(
            "the group has a temperature, too".into(),
            "one follows from the other",
            "remove one of them",
        )),
        (None, None) => Err(Error::MissingKey {
            place: table.place("temperature"),
            why: "what is not given cannot be solved for",
            remedy: "temperature = 300.0, in K, or flux = 0.0, in W".into(),
        }),
    }
}

fn read_kelvin(value: &Value<'_>) -> Result<f64, Error> {
    let kelvin = value.number()?;
    if (0.0..=1e6).contains(&kelvin) {
        return Ok(kelvin);
    }
    Err(value.refuse(
        format!("{kelvin} K is outside [0, 10⁶]"),
        "temperatures are absolute",
        "write kelvin, such as 293.15",
    ))
}

fn read_emissivity(value: &Value<'_>) -> Result<f64, Error> {
    let emissivity = value.number()?;
    if emissivity > 0.0 && emissivity <= 1.0 {
        return Ok(emissivity);
    }
    Err(value.refuse(
        format!("{emissivity} is outside (0, 1]"),
        "it is the part of what arrives that is absorbed, and what is never absorbed never ends",
        "choose 0 < emissivity ≤ 1",
    ))
}
