//! What `radwalk factors` is asked: between which groups, of what kind, how well, and with what temperatures.

use std::path::{Path, PathBuf};

use exchange::{Tolerance, WalkPlan};
use job::{Enclosure, FaceGroups, GroupNames, Grouping, Job, MethodTable, load_enclosure};
use radiosity::{Scene, exchange::FactorKind};
use report::{BACK, ESCAPE};

use super::fault::FactorsFault;
use super::sparse::{RowWalks, SparseAsked, SparseFile};
use super::subject::{GroupOfFaces, Subject};
use crate::error::Error;

/// The most groups: every pair of them is a row of the table.
const MOST_GROUPS: usize = 2048;

/// The most groups of sparse factors: walks of each have places of their own in the sequence.
const MOST_ROWS: usize = 1 << 22;

/// The most faces that are groups each where nothing is said of groups.
const MOST_FACES: usize = 256;

/// What a user asks for, beside the job.
#[derive(Clone, Copy, Debug, Default)]
pub struct Asked<'a> {
    /// The kind of groups, or a file of them; `None`: by patch while that is few.
    pub groups: Option<&'a str>,
    /// Whether walks go on until they are absorbed.
    pub reflections: bool,
    /// Of a scene in colour: the channel whose reflectances hold.
    pub channel: Option<usize>,
    /// The relative half-width at which the count ends.
    pub tolerance: Option<f64>,
    /// The pairs that it is asked of, as FROM:TO.
    pub pairs: &'a [String],
    /// Whether factors are adjusted to each other.
    pub smooth: bool,
    /// A file of temperatures and fluxes.
    pub temperatures: Option<&'a Path>,
    /// What is asked of sparse factors; `None`: of dense ones.
    pub sparse: Option<SparseAsked>,
}

/// What is to be counted.
pub struct FactorsQuestion {
    /// The job, whose scene emits everywhere, in one channel.
    pub job: Job,
    /// The scene of the job.
    pub scene: Scene,
    pub(super) groups: FaceGroups,
    /// Whether each face is a group, which goes by its patch.
    by_patch: bool,
    /// Whether the scene is in colour and no channel was chosen.
    has_no_channel: bool,
    pub(super) kind: FactorKind,
    pub(super) tolerance: Option<Tolerance>,
    /// The names of the pairs that the tolerance is asked of.
    pub(super) pairs: Option<Vec<[String; 2]>>,
    pub(super) enclosure: Option<Enclosure>,
    /// The level of each interval.
    pub(super) level: f64,
    pub(super) smooth: bool,
}

impl FactorsQuestion {
    /// The question about a job's scene; reads the files that it names.
    ///
    /// # Errors
    /// Where the scene or a file is refused, and where the question has no answer.
    pub fn of(mut job: Job, asked: &Asked<'_>) -> Result<Self, Error> {
        let kind = match asked.reflections || asked.temperatures.is_some() {
            true => FactorKind::Absorbed,
            false => FactorKind::FirstHit,
        };
        if !job.scene.spec().panes.is_empty() {
            return Err(FactorsFault::Panes.into());
        }
        if job.scene.spec().surfaces.iter().any(|surface| surface.transmittance.is_lit()) {
            return Err(FactorsFault::Transmission.into());
        }
        if !job.scene.spec().patch_of_cell.is_empty() {
            return Err(FactorsFault::GroupedPatches.into());
        }
        let channels = job.scene.spec().channels();
        let has_no_channel = channels > 1 && asked.channel.is_none();
        if has_no_channel && kind == FactorKind::Absorbed {
            return Err(FactorsFault::NoChannel.into());
        }
        job.scene = job.scene.for_exchange(asked.channel.unwrap_or(0), |_| None);
        // What leaves the scene escapes.
        job.scene = job.scene.without_sky();
        // Factors are counted by single walks; of the method only the space that they go on in is used.
        job.method = MethodTable { space: job.method.space, ..MethodTable::default() };
        (job.budget.first_path, job.budget.wall_seconds) = (0, None);
        (job.sources, job.sensitivity) = (Vec::new(), Vec::new());
        let mut scene = job.build_scene()?;
        let grouping = grouping_of(asked, &scene)?;
        let groups = groups_of(asked, &grouping, (&job, &scene))?;
        let by_patch = grouping == Grouping::ByPatch;
        let paths = match asked.sparse.map(|sparse| sparse.walks) {
            None => Some(job.budget.paths),
            Some(RowWalks::Shared(paths)) => Some(paths),
            Some(RowWalks::Each(_)) => None,
        };
        if let Some(paths) = paths.filter(|&paths| WalkPlan::pilot(groups.count(), paths).is_none()) {
            return Err(FactorsFault::FewWalks { paths, groups: groups.count() }.into());
        }
        let names = match asked.sparse.is_some() && by_patch {
            true => names_of_parts(&groups, &scene),
            false => groups.names.iter().cloned().map(GroupNames::whole).collect(),
        };
        let enclosure = asked.temperatures.map(|path| load_enclosure(path, &names)).transpose()?;
        if let Some(enclosure) = enclosure.as_ref().filter(|it| it.emissivities.iter().any(Option::is_some)) {
            let reflectances = reflectances(enclosure, &groups, &scene)?;
            job.scene = job.scene.for_exchange(0, |surface| reflectances[surface]);
            scene = job.build_scene()?;
        }
        let scene = repeated(scene, asked)?;
        let factors = groups.count() as f64 * (groups.count() + 2) as f64;
        let level = match job.simultaneous {
            true => (1.0 - (1.0 - job.confidence) / factors).min(1.0_f64.next_down()),
            false => job.confidence,
        };
        let chosen: Vec<GroupPair> =
            asked.pairs.iter().map(|typed| pair(typed, &groups)).collect::<Result<_, _>>()?;
        let pairs = (!chosen.is_empty()).then(|| chosen.iter().map(|(_, names)| names.clone()).collect());
        let numbers = (!chosen.is_empty()).then(|| chosen.iter().map(|(numbers, _)| *numbers).collect());
        let tolerance = asked.tolerance.map(|relative| Tolerance { relative, pairs: numbers, level });
        Ok(FactorsQuestion {
            job,
            scene,
            groups,
            by_patch,
            has_no_channel,
            kind,
            tolerance,
            pairs,
            enclosure,
            level,
            smooth: asked.smooth,
        })
    }

    /// A name for each group: where each patch is one, the patch's.
    pub(super) fn names(&self) -> Vec<String> {
        match self.by_patch {
            true => patch_names(&self.groups, &self.scene),
            false => self.groups.names.clone(),
        }
    }

    /// Whether these files can hold the factors.
    ///
    /// # Errors
    /// Where they are for view factors, and reflections are counted; where they hold emissivities, of which the scene has several.
    pub fn check_exports(&self, files: &[SparseFile]) -> Result<(), FactorsFault> {
        if self.has_no_channel && files.contains(&SparseFile::View3d) {
            return Err(FactorsFault::NoEmissivities);
        }
        let of_both = [SparseFile::Mtx, SparseFile::Npz, SparseFile::Parquet];
        match self.kind == FactorKind::FirstHit || files.iter().all(|file| of_both.contains(file)) {
            true => Ok(()),
            false => Err(FactorsFault::NoViewFactors),
        }
    }

    /// What answers need of it.
    pub(super) fn subject(&self) -> Subject {
        let FactorsQuestion { job, scene, groups, kind, enclosure, level, smooth, .. } = self;
        let named = |name: &String| GroupOfFaces { name: name.clone(), ..GroupOfFaces::default() };
        let mut sums: Vec<GroupOfFaces> = groups.names.iter().map(named).collect();
        for (face, &group) in scene.faces().iter().zip(&groups.of_face) {
            let sum = &mut sums[group as usize];
            sum.faces += 1;
            sum.area += FactorKind::FirstHit.weight(&face);
            sum.absorbing += FactorKind::Absorbed.weight(&face);
        }
        Subject {
            scene_hash: scene.hash(),
            kind: *kind,
            groups: sums,
            confidence: job.confidence,
            simultaneous: job.simultaneous,
            level: *level,
            smooth: *smooth,
            enclosure: enclosure.clone(),
        }
    }
}

/// The scene, which repeats where that is asked for.
fn repeated(scene: Scene, asked: &Asked<'_>) -> Result<Scene, FactorsFault> {
    match asked.sparse.and_then(|sparse| sparse.periods) {
        Some(periods) => scene.repeated(periods).map_err(FactorsFault::Copies),
        None => Ok(scene),
    }
}

/// The names by which temperatures are given of groups that are a patch each: a surface's name stands for all of its patches, and each goes by its
/// own as well.
fn names_of_parts(groups: &FaceGroups, scene: &Scene) -> Vec<GroupNames> {
    let called = |(face, own): (radiosity::surfaces::Face, String)| GroupNames {
        own,
        part_of: Some((scene.surface_name(face.surface).to_owned(), face.area)),
    };
    scene.faces().iter().zip(patch_names(groups, scene)).map(called).collect()
}

/// The name of each patch: that of its surface, and the number of the patch where the surface has several.
fn patch_names(groups: &FaceGroups, scene: &Scene) -> Vec<String> {
    let mut faces = std::collections::HashMap::new();
    let surface = |surface| scene.surface_name(surface);
    scene.faces().iter().for_each(|face| *faces.entry(surface(face.surface)).or_insert(0) += 1);
    let name = |(face, number): (radiosity::surfaces::Face, &String)| match faces[surface(face.surface)] {
        1 => surface(face.surface).to_owned(),
        _ => format!("{} {number}", surface(face.surface)),
    };
    scene.faces().iter().zip(&groups.names).map(name).collect()
}

/// How faces are grouped, by what is asked and by how many there are.
fn grouping_of(asked: &Asked<'_>, scene: &Scene) -> Result<Grouping, FactorsFault> {
    let most_faces = if asked.sparse.is_some() { MOST_ROWS } else { MOST_FACES };
    match asked.groups {
        Some("by-patch") => Ok(Grouping::ByPatch),
        Some("by-surface") => Ok(Grouping::BySurface),
        Some("by-material") => Ok(Grouping::ByMaterial),
        Some(file) if Path::new(file).exists() => Ok(Grouping::File(PathBuf::from(file))),
        Some(typed) => Err(FactorsFault::NoGroups { typed: typed.into() }),
        None if scene.faces().len() <= most_faces => Ok(Grouping::ByPatch),
        None => Ok(Grouping::BySurface),
    }
}

fn groups_of(
    asked: &Asked<'_>,
    grouping: &Grouping,
    (job, scene): (&Job, &Scene),
) -> Result<FaceGroups, Error> {
    let most = if asked.sparse.is_some() { MOST_ROWS } else { MOST_GROUPS };
    let faces = scene.faces().len();
    if *grouping == Grouping::ByPatch && faces > most {
        return Err(FactorsFault::TooManyGroups { groups: faces, most }.into());
    }
    let groups = FaceGroups::of(grouping, &job.scene, scene)?;
    if groups.count() > most {
        return Err(FactorsFault::TooManyGroups { groups: groups.count(), most }.into());
    }
    match groups.names.iter().find(|name| [BACK, ESCAPE].contains(&name.as_str())) {
        Some(name) => Err(FactorsFault::Reserved { name: name.clone() }.into()),
        None => Ok(groups),
    }
}

/// The reflectances of surfaces whose groups are given an emissivity.
fn reflectances(
    enclosure: &Enclosure,
    groups: &FaceGroups,
    scene: &Scene,
) -> Result<Vec<Option<f64>>, FactorsFault> {
    let mut group_of_surface: Vec<Option<u32>> = vec![None; scene.surfaces().len()];
    for (face, &group) in scene.faces().iter().zip(&groups.of_face) {
        let other = group_of_surface[face.surface as usize].replace(group);
        if let Some(other) = other.filter(|&other| other != group) {
            let given = [group, other].into_iter().find(|&g| enclosure.emissivities[g as usize].is_some());
            if let Some(given) = given {
                let group = groups.names[given as usize].clone();
                let surface = scene.surface_name(face.surface).to_owned();
                return Err(FactorsFault::EmissivityOfPart { group, surface });
            }
        }
    }
    let emissivity = |group: Option<u32>| group.and_then(|group| enclosure.emissivities[group as usize]);
    Ok(group_of_surface
        .into_iter()
        .map(|group| emissivity(group).map(|emissivity| 1.0 - emissivity))
        .collect())
}

/// A pair of groups: numbers and names. The second may be backs or what escapes.
type GroupPair = ((usize, usize), [String; 2]);

fn pair(typed: &str, groups: &FaceGroups) -> Result<GroupPair, FactorsFault> {
    let from = |name: &str| groups.names.iter().position(|group| group == name);
    let to = |name: &str| {
        let others = [BACK, ESCAPE].iter().position(|other| *other == name);
        from(name).or(others.map(|other| groups.count() + other))
    };
    // Names may hold colons, too.
    let found = typed.match_indices(':').find_map(|(at, _)| {
        let (first, second) = (&typed[..at], &typed[at + 1..]);
        Some(((from(first)?, to(second)?), [first.to_owned(), second.to_owned()]))
    });
    found.ok_or_else(|| {
        let known = groups.names.iter().take(12).map(|name| format!("{name:?}")).collect::<Vec<_>>();
        FactorsFault::NoPair { typed: typed.into(), known: known.join(", ") }
    })
}
