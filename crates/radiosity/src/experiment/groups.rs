//! Groups of patches that are distinguished: the sources of light, and the materials whose influence is asked for.
//!
//! A shooting walk is born on one emitter, so that it belongs to one *class*: the emitters of one source and one material.
//! Each class has sums of its own for every face. In a tally the rows of faces hold the sums of all classes together, as if
//! there were no groups; the rows of every class but the first follow them. What the first class has scored is what the
//! others leave over, exactly.

use serde::{Deserialize, Serialize};

use super::unfit::Unfit;
use crate::geometry::face::{Face, Faces};
use crate::geometry::spec::Spectrum;
use crate::method::{Direction, Method, Score, Walks};
use crate::scene::Scene;
use crate::tally::Tally;
use crate::walk::marks::NO_MATERIAL;

/// A group of patches, by name.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PatchGroup {
    /// The name of the group.
    pub name: String,
    /// Runs of patches: the first and the last number of each. Lamps without area are numbered behind all patches.
    pub patches: Vec<(u32, u32)>,
}

/// A material whose influence is asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct SensitivityMaterial {
    /// The name of the material.
    pub name: String,
    /// R of all its faces.
    pub reflectance: Spectrum,
    /// E of all its faces that emit [W/m²]; `None` where none does, or not all alike.
    pub emittance: Option<Spectrum>,
}

/// The source and the material of the emitters of a class.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Class {
    pub(super) source: u32,
    pub(super) material: u32,
}

/// The sources of a scene, each multiplied by a factor.
#[derive(Clone, Debug)]
pub(super) struct Mixture {
    /// The factor by which the emittance of each source is multiplied.
    pub(super) factors: Vec<f64>,
    /// The scene with these emittances.
    pub(super) scene: Scene,
}

/// The groups of an experiment.
#[derive(Clone, Debug)]
pub struct Groups {
    sources: Vec<String>,
    materials: Vec<SensitivityMaterial>,
    pub(super) classes: Vec<Class>,
    /// By class, the channels in which it emits.
    pub(super) lit: Vec<[bool; 3]>,
    /// For each face that emits, and behind the faces for each lamp without area, the first row of its class among the slots of a board; 0
    /// for others.
    pub(super) first_slots: Vec<u32>,
    faces: usize,
    /// The material of each face, or [`NO_MATERIAL`].
    pub(super) material_of_face: Vec<u32>,
}

impl PatchGroup {
    /// A digest of the patches of some groups. Names do not enter: no number depends on them.
    pub fn hash(groups: &[PatchGroup]) -> [u8; 32] {
        let mut hasher = blake3::Hasher::new();
        for group in groups {
            hasher.update(&(group.patches.len() as u64).to_le_bytes());
            for (first, last) in &group.patches {
                hasher.update(&first.to_le_bytes());
                hasher.update(&last.to_le_bytes());
            }
        }
        *hasher.finalize().as_bytes()
    }

    fn patches(&self) -> impl Iterator<Item = u32> {
        self.patches.iter().flat_map(|&(first, last)| first..=last)
    }
}

impl Groups {
    /// The source of all emitters that no group holds.
    pub const REST: &'static str = "rest";

    /// Groups of a scene; `None` where nothing is distinguished.
    pub(super) fn new(
        scene: &Scene,
        method: &Method,
        (sources, materials): (&[PatchGroup], &[PatchGroup]),
    ) -> Result<Option<Self>, Unfit> {
        if sources.is_empty() && materials.is_empty() {
            return Ok(None);
        }
        check_method(method, !materials.is_empty())?;
        let faces = scene.faces();
        let source_of_patch = sources_of_patches(scene, sources)?;
        let (material_of_patch, materials) = materials_of_patches(scene, materials)?;
        let material_of_face = faces.iter().map(|face| material_of_patch[face.patch as usize]).collect();
        let class = |face: &Face| {
            let patch = face.patch as usize;
            let source = if sources.is_empty() { 0 } else { source_of_patch[patch] };
            Class { source, material: material_of_patch[patch] }
        };
        let class_of_lamp = |lamp: usize| {
            let source = if sources.is_empty() { 0 } else { source_of_patch[faces.patch_count() + lamp] };
            Class { source, material: NO_MATERIAL }
        };
        let emitters = || faces.iter().filter(|face| face.emittance.is_lit());
        let lamps = || (0..scene.lamp_count()).filter(|&lamp| is_lit(scene, lamp));
        let mut classes: Vec<Class> =
            emitters().map(|face| class(&face)).chain(lamps().map(class_of_lamp)).collect();
        classes.sort_unstable();
        classes.dedup();
        let slots = classes.len() * faces.len();
        if u32::try_from(slots).is_err() {
            return Err(Unfit::TooManySums { classes: classes.len(), faces: faces.len() });
        }
        let first_slot = |face: Face| match face.emittance.is_lit() {
            true => classes.binary_search(&class(&face)).expect("its own class") * faces.len(),
            false => 0,
        };
        let slot_of_lamp = |lamp: usize| match is_lit(scene, lamp) {
            true => classes.binary_search(&class_of_lamp(lamp)).expect("its own class") * faces.len(),
            false => 0,
        };
        let of_lamps = (0..scene.lamp_count()).map(|lamp| slot_of_lamp(lamp) as u32);
        let first_slots = faces.iter().map(|face| first_slot(face) as u32).chain(of_lamps).collect();
        let mut names: Vec<String> = sources.iter().map(|group| group.name.clone()).collect();
        if !sources.is_empty() && classes.iter().any(|class| class.source as usize == sources.len()) {
            names.push(Groups::REST.into());
        }
        let mut lit = vec![[false; 3]; classes.len()];
        let mut light = |class: &Class, shines: &dyn Fn(usize) -> bool| {
            let lit = &mut lit[classes.binary_search(class).expect("its own class")];
            (0..scene.channels()).for_each(|channel| lit[channel] |= shines(channel));
        };
        emitters().for_each(|face| light(&class(&face), &|channel| face.emittance[channel] > 0.0));
        lamps().for_each(|lamp| {
            light(&class_of_lamp(lamp), &|channel| scene.lamp_power(lamp, channel) > 0.0);
        });
        let faces = faces.len();
        Ok(Some(Groups { sources: names, materials, classes, lit, first_slots, faces, material_of_face }))
    }

    /// The names of the sources, in the order of the job; the last is [`Groups::REST`] where emitters are left over. Empty
    /// where no sources are distinguished.
    pub fn sources(&self) -> &[String] {
        &self.sources
    }

    /// The materials whose influence is asked for.
    pub fn materials(&self) -> &[SensitivityMaterial] {
        &self.materials
    }

    /// Whether a source emits in a channel.
    pub fn is_lit(&self, source: usize, channel: usize) -> bool {
        let mut classes = self.classes.iter().zip(&self.lit);
        classes.any(|(class, lit)| class.source as usize == source && lit[channel])
    }

    /// The class of a face that emits.
    pub(super) fn class_of(&self, face: usize) -> usize {
        self.first_slots[face] as usize / self.faces
    }

    /// The class of a lamp without area.
    pub(super) fn class_of_lamp(&self, lamp: usize) -> usize {
        self.class_of(self.faces + lamp)
    }

    /// The source that a lamp without area belongs to, by number.
    pub fn source_of_lamp(&self, lamp: usize) -> usize {
        self.classes[self.class_of_lamp(lamp)].source as usize
    }

    /// Rows of a tally beside those of the faces: of every class but the first.
    pub(super) fn class_rows(&self) -> usize {
        (self.classes.len() - 1) * self.faces
    }

    /// Rows of a tally that hold what materials do.
    pub(super) fn material_rows(&self) -> usize {
        self.materials.len() * self.faces
    }

    /// Σx, Σx² and events of face i in one score, class by class.
    pub(super) fn sums<'a>(
        &'a self,
        tally: &'a Tally,
        i: usize,
        score: usize,
    ) -> impl Iterator<Item = [u128; 3]> + 'a {
        let faces = self.faces;
        let row = move |row: usize| {
            let sums = tally.patch(row, score);
            [sums[0], sums[1], tally.events(row)]
        };
        let others = move || (1..self.classes.len()).map(move |class| row(class * faces + i));
        // The first class is what the others leave over.
        let first = others().fold(row(i), |left, of_class| {
            std::array::from_fn(|column| left[column].saturating_sub(of_class[column]))
        });
        std::iter::once(first).chain(others())
    }
}

/// Whether the scores of single walks belong to single emitters.
fn check_method(method: &Method, materials: bool) -> Result<(), Unfit> {
    match method {
        Method::Walks(Walks { direction: Direction::Shooting, score: Score::Of(_), .. }) => match () {
            () if materials && method.is_biased() => Err(Unfit::CutOffInfluence),
            () => Ok(()),
        },
        Method::Walks(Walks { direction: Direction::Gathering(_), .. }) => Err(Unfit::GatheredSources),
        Method::Walks(Walks { score: Score::Linear(_), .. }) => Err(Unfit::LinearSources),
        Method::Walks(_) => Err(Unfit::MixedSources),
        Method::Batches(_) | Method::Chains(_) => Err(Unfit::SourcesOfBatches),
    }
}

/// Whether a lamp without area emits.
fn is_lit(scene: &Scene, lamp: usize) -> bool {
    (0..scene.channels()).any(|channel| scene.lamp_power(lamp, channel) > 0.0)
}

/// The source of every patch that emits, and of every lamp without area; patches that are in no group are of the source after the last.
fn sources_of_patches(scene: &Scene, groups: &[PatchGroup]) -> Result<Vec<u32>, Unfit> {
    let faces = scene.faces();
    let patches = faces.patch_count();
    let shines = |&patch: &u32| match (patch as usize).checked_sub(patches) {
        None => faces.get(patch as usize).emittance.is_lit(),
        Some(lamp) => is_lit(scene, lamp),
    };
    let mut sources = vec![groups.len() as u32; patches + scene.lamp_count()];
    for (number, group) in (0..).zip(groups) {
        check_range(group, patches + scene.lamp_count())?;
        let mut emits = false;
        for patch in group.patches().filter(shines) {
            let source = &mut sources[patch as usize];
            if *source < number {
                let names = [*source, number].map(|source| groups[source as usize].name.clone());
                return Err(match (patch as usize).checked_sub(patches) {
                    None => Unfit::SharedEmitter { patch, names },
                    Some(lamp) => Unfit::SharedLamp { lamp, names },
                });
            }
            *source = number;
            emits = true;
        }
        if !emits {
            return Err(Unfit::DarkSource { name: group.name.clone() });
        }
    }
    Ok(sources)
}

/// The material of every patch, or [`NO_MATERIAL`], and what the materials are.
fn materials_of_patches(
    scene: &Scene,
    groups: &[PatchGroup],
) -> Result<(Vec<u32>, Vec<SensitivityMaterial>), Unfit> {
    let faces = scene.faces();
    let mut numbers = vec![NO_MATERIAL; faces.patch_count()];
    let mut materials = Vec::new();
    for (number, group) in (0..).zip(groups) {
        check_range(group, faces.patch_count())?;
        group.patches().for_each(|patch| numbers[patch as usize] = number);
        materials.push(material(faces, group)?);
    }
    Ok((numbers, materials))
}

fn material(faces: &Faces, group: &PatchGroup) -> Result<SensitivityMaterial, Unfit> {
    let of_group = || group.patches().map(|patch| faces.get(patch as usize));
    let uneven = || Unfit::UnevenMaterial { name: group.name.clone() };
    let reflectance = of_group().next().ok_or_else(uneven)?.reflectance;
    if of_group().any(|face| face.reflectance != reflectance) {
        return Err(uneven());
    }
    let emittances = || of_group().map(|face| face.emittance).filter(|emittance| emittance.is_lit());
    let emittance = emittances().next().filter(|&first| emittances().all(|other| other == first));
    Ok(SensitivityMaterial { name: group.name.clone(), reflectance, emittance })
}

fn check_range(group: &PatchGroup, patches: usize) -> Result<(), Unfit> {
    let unknown = group.patches.iter().find(|&&(_, last)| last as usize >= patches);
    unknown.map_or(Ok(()), |&(_, patch)| Err(Unfit::NoSuchPatch { patch, patches }))
}
