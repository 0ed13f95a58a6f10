//! How a job is solved: the choices of `[method]`, and the digest that names an answer.

use std::collections::HashSet;

use radiosity::{
    BatchScore, Batches, Birth, Chains, Direction, EstimatorKind, IndexChoice, InfiniteEnd, Iterations,
    RayBirths, Sampler, Score, Solve, Space, Walks,
};
use serde::{Deserialize, Serialize};

use crate::document::{Table, Value};
use crate::error::{Error, Place};
use crate::job::Budget;

/// A choice that files and outputs write as one word.
pub trait Word: Copy + 'static {
    /// Every choice.
    const ALL: &'static [Self];

    /// The word of a choice, lower case.
    fn word(self) -> &'static str;
}

/// Which way walks run, and from where.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum WalkKind {
    /// From the emitters.
    #[default]
    Shooting,
    /// From the patches.
    Gathering,
    /// Stochastic Jacobi iteration.
    Jacobi,
    /// Whichever of them takes the least counted work.
    Auto,
}

/// The table `[method]`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Method {
    /// Default: shooting.
    pub walk: WalkKind,
    /// Default: collision.
    pub estimator: EstimatorKind,
    /// Default: discrete.
    pub space: Space,
    /// Default: random.
    pub sampler: Sampler,
    /// Of the infinite estimator only. Default: roulette below a weight of 0.001.
    pub infinite: InfiniteEnd,
    /// Of gathering walks only. Default: by area.
    pub birth: Birth,
    /// Whether collision walks are scored by absorption and survival too, to find the best mix of both.
    pub mix: bool,
    /// Rays of a chain, or walks that share a Sobol sequence: [`crate::load`] puts it where the job names none. Random
    /// walks have none.
    pub batch_paths: Option<u64>,
    /// What chains make of their rays; of Jacobi only. Default: links.
    pub jacobi: Solve,
    /// Patches, in ascending order, whose light rays of their own gather from what each batch or chain has found. Default:
    /// none.
    pub final_gather: Vec<u32>,
}

impl Method {
    /// The walks, batches or chains that it takes, for the walk and sampler that are built.
    pub fn walks(&self) -> radiosity::Method {
        let (estimator, paths) = (self.estimator.ending(self.infinite), self.batch_paths.unwrap_or(0));
        let score = if self.mix { Score::Mix } else { Score::Of(estimator) };
        let direction = match &self.walk {
            WalkKind::Jacobi => {
                let final_gather = self.final_gather.clone();
                return Chains { rays: paths, solve: self.jacobi, final_gather }.into();
            }
            WalkKind::Gathering => Direction::Gathering(self.birth.clone()),
            WalkKind::Shooting | WalkKind::Auto => Direction::Shooting,
        };
        if !self.is_in_batches() {
            return Walks { direction, space: self.space, score }.into();
        }
        let score = match self.final_gather.is_empty() {
            true => BatchScore::Of(estimator, self.space),
            false => BatchScore::FinalGather(self.final_gather.clone()),
        };
        Batches { walks: paths, sampler: self.sampler, score }.into()
    }

    /// Whether batches or chains take the place of walks.
    fn is_in_batches(&self) -> bool {
        self.walk == WalkKind::Jacobi || self.sampler == Sampler::Sobol || !self.final_gather.is_empty()
    }
}

impl Word for WalkKind {
    const ALL: &'static [Self] = &[Self::Shooting, Self::Gathering, Self::Jacobi, Self::Auto];

    fn word(self) -> &'static str {
        match self {
            WalkKind::Shooting => "shooting",
            WalkKind::Gathering => "gathering",
            WalkKind::Jacobi => "jacobi",
            WalkKind::Auto => "auto",
        }
    }
}

impl Word for EstimatorKind {
    const ALL: &'static [Self] = EstimatorKind::ALL;

    fn word(self) -> &'static str {
        EstimatorKind::word(self)
    }
}

impl Word for Space {
    const ALL: &'static [Self] = &[Self::Discrete, Self::Continuous];

    fn word(self) -> &'static str {
        match self {
            Space::Discrete => "discrete",
            Space::Continuous => "continuous",
        }
    }
}

impl Word for Sampler {
    const ALL: &'static [Self] = &[Self::Random, Self::Sobol];

    fn word(self) -> &'static str {
        match self {
            Sampler::Random => "random",
            Sampler::Sobol => "sobol",
        }
    }
}

impl Word for RayBirths {
    const ALL: &'static [Self] = &[Self::Systematic, Self::Multinomial];

    fn word(self) -> &'static str {
        match self {
            RayBirths::Systematic => "systematic",
            RayBirths::Multinomial => "multinomial",
        }
    }
}

impl Word for IndexChoice {
    const ALL: &'static [Self] = &[Self::Auto, Self::Flat, Self::Tree];

    fn word(self) -> &'static str {
        match self {
            IndexChoice::Auto => "auto",
            IndexChoice::Flat => "flat",
            IndexChoice::Tree => "tree",
        }
    }
}

/// Names an answer but for the number of walks: equal for equal scene, method and seed.
///
/// `scene_hash` is [`radiosity::Scene::hash`]. What the method does not use (where gathering walks are born,
/// while they are shot) does not enter, nor do budget, target, confidence, index and names.
pub fn job_hash(scene_hash: [u8; 32], method: &Method, seed: u64) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    let mut field = |bytes: &[u8]| {
        hasher.update(&(bytes.len() as u64).to_le_bytes());
        hasher.update(bytes);
    };
    field(b"radwalk job");
    field(&scene_hash);
    field(&seed.to_le_bytes());
    field(method.walk.word().as_bytes());
    field(method.estimator.word().as_bytes());
    field(method.space.word().as_bytes());
    field(method.sampler.word().as_bytes());
    if method.estimator == EstimatorKind::Infinite {
        let (end, number) = match method.infinite {
            InfiniteEnd::Roulette { threshold } => ("roulette", threshold),
            InfiniteEnd::Cutoff { threshold } => ("cutoff", threshold),
            InfiniteEnd::Length { length } => ("length", f64::from(length)),
        };
        field(end.as_bytes());
        field(&number.to_bits().to_le_bytes());
    }
    if method.walk == WalkKind::Gathering {
        match &method.birth {
            Birth::Area => field(b"area"),
            Birth::Uniform => field(b"uniform"),
            Birth::Patches(patches) => {
                field(b"patches");
                field(&patches.iter().flat_map(|patch| patch.to_le_bytes()).collect::<Vec<_>>());
            }
        }
    }
    if method.mix {
        field(b"mix");
    }
    if method.is_in_batches() {
        // No number of walks is 0.
        field(&method.batch_paths.unwrap_or(0).to_le_bytes());
    }
    if let (WalkKind::Jacobi, Solve::Iterations(Iterations { births, regular, .. })) =
        (method.walk, method.jacobi)
    {
        field(b"iterations");
        field(births.word().as_bytes());
        field(&regular.to_le_bytes());
    }
    if !method.final_gather.is_empty() {
        field(b"final gather");
        field(&method.final_gather.iter().flat_map(|patch| patch.to_le_bytes()).collect::<Vec<_>>());
    }
    *hasher.finalize().as_bytes()
}

const DEFAULT_LENGTH: u32 = 20;

pub(crate) const METHOD_KEYS: &[&str] = &[
    "walk",
    "estimator",
    "space",
    "sampler",
    "infinite",
    "birth",
    "mix",
    "batch_paths",
    "jacobi",
    "final_gather",
];

/// Reads `[method]`, for a scene of `patch_count` patches and a budget; says what was not done as asked.
pub(crate) fn read_method(
    mut table: Table<'_>,
    patch_count: u64,
    budget: &Budget,
) -> Result<(Method, Option<String>), Error> {
    let walk = word(table.take("walk"))?;
    let sampler = table.take("sampler");
    let jacobi = table.take("jacobi").map(|value| read_solve(value, walk)).transpose()?.unwrap_or_default();
    let places = Places { walk: table.place("walk"), batch: table.place("batch_paths") };
    let final_gather = table.take("final_gather");
    let mut method = Method {
        walk,
        estimator: word(table.take("estimator"))?,
        space: word(table.take("space"))?,
        sampler: Sampler::default(),
        infinite: table.take("infinite").map(read_infinite).transpose()?.unwrap_or_default(),
        birth: table
            .take("birth")
            .map(|value| read_birth(value, patch_count))
            .transpose()?
            .unwrap_or_default(),
        mix: table.take("mix").map(|value| value.boolean()).transpose()?.unwrap_or_default(),
        batch_paths: table.take("batch_paths").map(|value| read_batch(&value)).transpose()?,
        jacobi,
        final_gather: Vec::new(),
    };
    if let Some(value) = final_gather {
        method.final_gather = read_final_gather(value, &method, patch_count)?;
    }
    let note = settle_jacobi(&mut method, &places, patch_count, budget)?;
    method.sampler = read_sampler(sampler, walk, &method)?;
    settle_batches(&mut method, &places, budget)?;
    if let Solve::Iterations(iterations) = &mut method.jacobi {
        iterations.sampler = method.sampler;
    }
    Ok((method, note))
}

/// A choice, the default where the key is absent.
fn word<W: Word + Default>(value: Option<Value<'_>>) -> Result<W, Error> {
    value.map_or(Ok(W::default()), |value| value.word())
}

/// Walks draw random numbers unless asked otherwise, links follow Sobol sequences, iterations have the choice. `asked` is
/// what the job says, `method` what it becomes.
fn read_sampler(value: Option<Value<'_>>, asked: WalkKind, method: &Method) -> Result<Sampler, Error> {
    let (walks, links) = (method.walk != WalkKind::Jacobi, method.jacobi == Solve::Links);
    let default = if !walks && links { Sampler::Sobol } else { Sampler::Random };
    let Some(value) = value else { return Ok(default) };
    match value.word()? {
        // Chains that fell back to walks.
        _ if method.walk != asked && walks => Ok(default),
        Sampler::Sobol if walks && (asked != WalkKind::Shooting || method.mix) => Err(value.refuse(
            "\"sobol\" is for shooting walks without `mix`, and for chains".into(),
            "gathered scores are rounded at random, and gathering from every patch leaves each too few points to be even",
            "write \"random\"",
        )),
        Sampler::Random if !walks && links => Err(value.refuse(
            "\"random\" does not go with walk = \"jacobi\"".into(),
            "the rays of its patches follow Sobol sequences, which costs nothing and errs far less",
            "remove the key, or write jacobi = { solve = \"iterations\" }, which has both",
        )),
        sampler => Ok(sampler),
    }
}

/// Batches of a job of walks that does not say how many walks each has: between 16 and 31.
const BATCHES: u64 = 16;

/// Puts the number of walks of a batch: a power of 2 where the job names none, since so many points of a Sobol sequence are
/// spread most evenly.
fn settle_batches(method: &mut Method, places: &Places, budget: &Budget) -> Result<(), Error> {
    if method.walk == WalkKind::Jacobi || !method.is_in_batches() {
        return Ok(());
    }
    let most = (budget.paths / BATCHES).clamp(1, MOST_CHAIN_RAYS);
    let walks = method.batch_paths.unwrap_or(1 << most.ilog2());
    method.batch_paths = Some(walks);
    whole_batches(walks, "walks", places, budget)
}

/// Whether a budget has batches enough, and begins with one.
fn whole_batches(batch: u64, what: &str, places: &Places, budget: &Budget) -> Result<(), Error> {
    let Budget { paths, first_path, .. } = *budget;
    if paths / batch < CHAINS {
        return Err(Error::Refused {
            place: places.batch.clone(),
            problem: format!("{paths} paths make {} batches of {batch} {what}", paths / batch),
            why: "intervals come from what independent batches differ by, and 8 are the fewest that tell",
            remedy: format!("choose batch_paths ≤ {}, or more paths", paths / CHAINS),
        });
    }
    if !first_path.is_multiple_of(batch) {
        return Err(Error::Refused {
            place: places.batch.clone(),
            problem: format!("budget.first_path = {first_path} begins no batch of {batch} {what}"),
            why: "batches are shot whole",
            remedy: "choose a first_path that is a multiple of batch_paths".into(),
        });
    }
    Ok(())
}

/// The word of a [`Solve`].
#[derive(Clone, Copy)]
pub(crate) enum SolveWord {
    Links,
    Iterations,
}

impl Word for SolveWord {
    const ALL: &'static [Self] = &[Self::Links, Self::Iterations];

    fn word(self) -> &'static str {
        match self {
            SolveWord::Links => "links",
            SolveWord::Iterations => "iterations",
        }
    }
}

pub(crate) const SOLVE_KEYS: &[&str] = &["solve", "births", "regular"];

/// What chains make of their rays; the sampler stands elsewhere.
fn read_solve(value: Value<'_>, walk: WalkKind) -> Result<Solve, Error> {
    if walk != WalkKind::Jacobi {
        let problem = format!("walk = {:?} does not use this key", walk.word());
        return Err(value.refuse(
            problem,
            "it says what chains make of their rays",
            "remove it, or write walk = \"jacobi\"",
        ));
    }
    let mut table = value.table(SOLVE_KEYS)?;
    let solve: SolveWord = table
        .require("solve", "chains have two ways to a solution", "solve = \"iterations\" beside it")?
        .word()?;
    let (births, regular) = (table.take("births"), table.take("regular"));
    match (solve, births.as_ref().or(regular.as_ref())) {
        (SolveWord::Links, Some(stray)) => Err(stray.refuse(
            "solve = \"links\" does not use this key".into(),
            "all rays of its chains go into one system, aimed by what is known",
            "remove one of the two",
        )),
        (SolveWord::Links, None) => Ok(Solve::Links),
        (SolveWord::Iterations, _) => {
            let default = Iterations::default();
            let regular = regular.map(|value| read_regular(&value)).transpose()?;
            Ok(Solve::Iterations(Iterations {
                births: word(births)?,
                regular: regular.unwrap_or(default.regular),
                ..default
            }))
        }
    }
}

/// One in so many patches may be chosen for a final gather, so that each has several times the rays by which a batch tells
/// of a patch.
const FEW: u64 = 16;

fn read_final_gather(value: Value<'_>, method: &Method, patch_count: u64) -> Result<Vec<u32>, Error> {
    let fits = method.space == Space::Discrete && method.estimator == EstimatorKind::Collision && !method.mix;
    if method.walk == WalkKind::Gathering || !fits {
        return Err(value.refuse(
            "a final gather is for discrete collision walks that are shot, and for chains".into(),
            "it gathers what these have found of all other patches, and takes it for the patches' mean",
            "remove it, or `walk`, `estimator`, `space` and `mix`",
        ));
    }
    let place = value.place();
    let instead = "remove the key: no light is gathered";
    let mut patches = read_patches(value, patch_count, "somebody has to gather", instead)?;
    let most = (patch_count / FEW).max(1);
    if patches.len() as u64 > most {
        return Err(Error::Refused {
            place,
            problem: format!("{} of {patch_count} patches are chosen", patches.len()),
            why: "rays from so many are too few each to beat what walks and chains find by themselves",
            remedy: format!("choose at most {most}, or remove the key"),
        });
    }
    patches.sort_unstable();
    Ok(patches)
}

/// More iterations would have fewer rays than there are patches, in scenes of any size.
const MOST_ITERATIONS: u64 = 1 << 16;

fn read_regular(value: &Value<'_>) -> Result<u32, Error> {
    let why = "their results are averaged, and they share the rays of a chain";
    value.integer(1..=MOST_ITERATIONS, why).map(|regular| regular as u32)
}

/// Where the keys stand that chains may be refused by.
struct Places {
    walk: Box<Place>,
    batch: Box<Place>,
}

/// Chains of a job that does not say how many rays each has, if they are not too long then; fewer make no interval.
const CHAINS: u64 = 8;

/// Rays per patch and chain below which intervals are too narrow where light hides: in two rooms that exchange 1 %, R =
/// 0.95. Links: with 16, 92 % cover, with 32, 94.3 %; and with fewer walks err less. Iterations: with 256,
/// 94.0 and 86 %, with 4,096 95.5 and 92 %.
fn rays_per_patch(solve: Solve) -> u64 {
    match solve {
        Solve::Links => 32,
        Solve::Iterations(Iterations { births: RayBirths::Systematic, .. }) => 1024,
        Solve::Iterations(Iterations { births: RayBirths::Multinomial, .. }) => 16_384,
    }
}

/// Rays of a patch are counted in 32 bits.
const MOST_CHAIN_RAYS: u64 = u32::MAX as u64;

/// Up to so many patches are joined by so few links that chains may be as long as they like.
const FEW_PATCHES: u64 = 1 << 12;

/// Among more patches every ray may be a link, which takes memory: more rays make more chains, not longer ones, unless
/// the job says otherwise.
const LONG_CHAIN: u64 = 1 << 24;

/// Decides between chains and walks: `auto` takes chains where they have rays enough, and `jacobi` without enough
/// falls back to walks and says so.
fn settle_jacobi(
    method: &mut Method,
    places: &Places,
    patch_count: u64,
    budget: &Budget,
) -> Result<Option<String>, Error> {
    let paths = budget.paths;
    let asked = method.walk;
    let fits = method.space == Space::Discrete && method.estimator == EstimatorKind::Collision && !method.mix;
    match asked {
        WalkKind::Shooting | WalkKind::Gathering => return Ok(None),
        WalkKind::Jacobi if !fits => {
            return Err(Error::Refused {
                place: places.walk.clone(),
                problem: "\"jacobi\" solves the system of the patches from single rays".into(),
                why: "it has no other space than discrete, no estimators and no mix",
                remedy: "remove `space`, `estimator` and `mix`, or choose walk = \"shooting\"".into(),
            });
        }
        WalkKind::Jacobi | WalkKind::Auto => {}
    }
    let rays_per_patch = rays_per_patch(method.jacobi);
    let needed = rays_per_patch.saturating_mul(patch_count);
    let longest = if patch_count <= FEW_PATCHES { MOST_CHAIN_RAYS } else { LONG_CHAIN.max(needed) };
    let chain_rays = method.batch_paths.unwrap_or((paths / CHAINS).min(longest));
    if !fits || chain_rays < needed {
        method.walk = WalkKind::Shooting;
        return Ok((asked == WalkKind::Jacobi).then(|| {
            format!(
                "walk = \"jacobi\" fell back to shooting: a chain of {chain_rays} rays is too short for {patch_count} \
                 patches (below {rays_per_patch} rays per patch intervals may be too narrow); give budget.paths ≥ {}",
                needed.saturating_mul(CHAINS)
            )
        }));
    }
    whole_batches(chain_rays, "rays (a chain)", places, budget)?;
    method.walk = WalkKind::Jacobi;
    method.batch_paths = Some(chain_rays);
    Ok(None)
}

/// The word of an [`InfiniteEnd`], before its number is known.
#[derive(Clone, Copy)]
pub(crate) enum EndWord {
    Roulette,
    Cutoff,
    Length,
}

impl Word for EndWord {
    const ALL: &'static [Self] = &[Self::Roulette, Self::Cutoff, Self::Length];

    fn word(self) -> &'static str {
        match self {
            EndWord::Roulette => "roulette",
            EndWord::Cutoff => "cutoff",
            EndWord::Length => "length",
        }
    }
}

pub(crate) const INFINITE_KEYS: &[&str] = &["end", "threshold", "length"];

fn read_infinite(value: Value<'_>) -> Result<InfiniteEnd, Error> {
    let mut table = value.table(INFINITE_KEYS)?;
    let end: EndWord = table
        .require("end", "a number alone does not say how walks end", "end = \"roulette\" beside it")?
        .word()?;
    let (threshold, length) = (table.take("threshold"), table.take("length"));
    let stray = if matches!(end, EndWord::Length) { &threshold } else { &length };
    if let Some(stray) = stray {
        let problem = format!("end = {:?} does not use this key", end.word());
        return Err(stray.refuse(problem, "it would be ignored silently", "remove one of the two"));
    }
    let threshold =
        threshold.map(|value| read_threshold(&value)).transpose()?.unwrap_or(InfiniteEnd::DEFAULT_THRESHOLD);
    let length = length.map(|value| read_length(&value)).transpose()?.unwrap_or(DEFAULT_LENGTH);
    Ok(match end {
        EndWord::Roulette => InfiniteEnd::Roulette { threshold },
        EndWord::Cutoff => InfiniteEnd::Cutoff { threshold },
        EndWord::Length => InfiniteEnd::Length { length },
    })
}

fn read_threshold(value: &Value<'_>) -> Result<f64, Error> {
    let threshold = value.number()?;
    if threshold > 0.0 && threshold < 1.0 {
        return Ok(threshold);
    }
    Err(value.refuse(
        format!("{threshold} is outside (0, 1)"),
        "weights fall from 1 towards 0: no walk or every walk would end",
        "choose 0 < threshold < 1",
    ))
}

fn read_length(value: &Value<'_>) -> Result<u32, Error> {
    let length =
        value.integer(1..=u64::from(u32::MAX), "a walk reflects at least once, counted in 32 bits")?;
    Ok(length as u32)
}

pub(crate) const BIRTH_KEYS: &[&str] = &["patches"];

fn read_birth(value: Value<'_>, patch_count: u64) -> Result<Birth, Error> {
    if value.is_string() {
        return match value.string()? {
            "area" => Ok(Birth::Area),
            "uniform" => Ok(Birth::Uniform),
            other => Err(Error::UnknownWord {
                place: value.place(),
                found: other.into(),
                hint: crate::near::hint(other, ["area", "uniform"].into_iter()),
                choices: "\"area\" or \"uniform\" or { patches = [7, 12] }".into(),
            }),
        };
    }
    let mut table = value.table(BIRTH_KEYS)?;
    let listed = table.require("patches", "walks must be born somewhere", "patches = [7, 12], by number")?;
    read_patches(listed, patch_count, "walks must be born somewhere", "write birth = \"area\"")
        .map(Birth::Patches)
}

/// A list of patches by number; `why` it cannot be empty, and what to write `instead`.
pub(crate) fn read_patches(
    listed: Value<'_>,
    patch_count: u64,
    why: &'static str,
    instead: &str,
) -> Result<Vec<u32>, Error> {
    let place = listed.place();
    let (mut patches, mut seen) = (Vec::new(), HashSet::new());
    for value in listed.array()? {
        let last = patch_count.saturating_sub(1).min(u64::from(u32::MAX));
        let patch = value.integer(0..=last, "the scene's patches are numbered from 0")? as u32;
        if !seen.insert(patch) {
            return Err(value.refuse(
                format!("patch {patch} is listed twice"),
                "each counts once",
                "list it once",
            ));
        }
        patches.push(patch);
    }
    if patches.is_empty() {
        return Err(Error::Refused {
            place,
            problem: "the list is empty".into(),
            why,
            remedy: format!("list a patch, or {instead}"),
        });
    }
    Ok(patches)
}

fn read_batch(value: &Value<'_>) -> Result<u64, Error> {
    value.integer(1..=MOST_CHAIN_RAYS, "a batch has at least one path, and they are counted in 32 bits")
}
