//! What each command takes.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use job::{Job, Light, OutputFile};
use results::daylight::DaylightFile;
use results::factors::{MatrixFile, SparseFile};
use voice::{emit, say};

use super::values::{
    NamedLamp, altitude, azimuth, count, factor, illuminance, lamp, output_file, part, periods, rays,
    reflectance, row_walks, sky_patches, threads, tolerance, workers,
};
use crate::fault::Fault;
use crate::team::Team;

/// How a mesh is lit, and read.
#[derive(Args)]
pub(crate) struct MeshArgs {
    /// Make a material or a part of a mesh shine: --light Lamp=1000lm, or =60W; repeatable
    #[arg(long, value_name = "NAME=POWER", value_parser = lamp)]
    pub light: Vec<NamedLamp>,
    /// Put a mesh under a uniform sky, by its light on a horizontal plane [lx] [default: 10000]
    #[arg(long, value_name = "LX", num_args = 0..=1, require_equals = true, default_missing_value = "10000", value_parser = illuminance)]
    pub sky: Option<f64>,
    /// Refuse a mesh where something has to be assumed: reflectances of 1 and more, and light
    #[arg(long)]
    pub strict: bool,
}

impl MeshArgs {
    /// Every change as KEY=VALUE, with the option that was typed in a line of its own.
    ///
    /// # Errors
    /// Where some light is in lm or lx, and some in W.
    pub(crate) fn overrides(&self) -> Result<Vec<String>, Fault> {
        let mut typed = Vec::new();
        let lumens = self.sky.is_some() || self.light.iter().any(|lamp| lamp.lumens);
        if let Some(lamp) = self.light.iter().find(|lamp| lumens && !lamp.lumens) {
            return Err(Fault::MixedUnits { name: lamp.name.clone() });
        }
        typed.extend(lumens.then(|| "light=luminous".to_owned()));
        typed.extend(self.light.iter().map(|NamedLamp { name, power, .. }| {
            let quoted = name.replace('\\', "\\\\").replace('"', "\\\"");
            let unit = if lumens { "lm" } else { "W" };
            format!("import.material.\"{quoted}\".power={power}\n--light {name}={power}{unit}")
        }));
        typed.extend(self.sky.map(|sky| format!("import.sky={sky}\n--sky={sky}")));
        typed.extend(self.strict.then(|| "import.strict=true\n--strict".to_owned()));
        Ok(typed)
    }

    /// Holds the units of lamps against those of the job.
    ///
    /// # Errors
    /// Where a lamp is in W, and the job's numbers are lm and lx, as those of its file are.
    pub(crate) fn fit(&self, job: &Job) -> Result<(), Fault> {
        match self.light.iter().find(|lamp| !lamp.lumens && job.light == Light::Luminous) {
            Some(lamp) => Err(Fault::MixedUnits { name: lamp.name.clone() }),
            None => Ok(()),
        }
    }
}

/// A job and what to change in it.
#[derive(Args)]
pub(crate) struct JobArgs {
    /// The path of the job file
    pub job: PathBuf,
    /// Total walks (budget.paths): 1000000, 1_000_000 or 1e6
    #[arg(long, value_name = "N", value_parser = count, allow_negative_numbers = true)]
    pub paths: Option<u64>,
    /// The seed of all random numbers
    #[arg(long, value_name = "S", value_parser = count, allow_negative_numbers = true)]
    pub seed: Option<u64>,
    /// Where the picture is taken from (view.from): inside or outside
    #[arg(long, value_name = "NAME", value_parser = ["inside", "outside"])]
    pub view: Option<String>,
    /// Set any key of the job, e.g. --set method.space=continuous; parts may be in quotes: --set 'import.material."Red.003".sides=2'
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    #[command(flatten)]
    pub mesh: MeshArgs,
}

impl JobArgs {
    /// Every change as KEY=VALUE.
    ///
    /// # Errors
    /// As [`MeshArgs::overrides`].
    pub(crate) fn overrides(&self) -> Result<Vec<String>, Fault> {
        let paths = self.paths.map(|paths| format!("budget.paths={paths}"));
        let seed = self.seed.map(|seed| format!("seed={seed}"));
        let view = self.view.as_ref().map(|view| format!("view.from={view}"));
        let mesh = self.mesh.overrides()?.into_iter();
        Ok(mesh.chain(self.set.iter().cloned()).chain(paths).chain(seed).chain(view).collect())
    }
}

/// Where results go, and which messages are shown.
#[derive(Args)]
pub(crate) struct OutArgs {
    /// The output folder [default: out/<job name>]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Replace results that are in the output folder
    #[arg(long)]
    pub force: bool,
    /// Say nothing but errors
    #[arg(long, short)]
    pub quiet: bool,
    /// Report progress as JSON lines on stderr
    #[arg(long)]
    pub json: bool,
}

impl OutArgs {
    /// Tells where a result is, and `lines` to people.
    pub(crate) fn tell(&self, out: &Path, mut lines: Vec<String>) {
        lines.push(format!("written to {}", out.display()));
        tell([self.json, self.quiet], out, &lines);
    }
}

/// What is written beside the files that the job names.
#[derive(Args)]
pub(crate) struct ExportArgs {
    /// Write these files, too; may be a list, e.g. --export vtu,glb
    #[arg(long, value_name = "FILE", value_delimiter = ',', value_parser = output_file())]
    pub export: Vec<OutputFile>,
}

/// How a result is written that is made of others.
#[derive(Args)]
pub(crate) struct MadeArgs {
    #[command(flatten)]
    pub export: ExportArgs,
    /// Replace results that are in the output folder
    #[arg(long)]
    pub force: bool,
    #[command(flatten)]
    pub told: ToldArgs,
}

impl MadeArgs {
    /// The options of a command that shows no progress.
    pub(crate) fn out(&self) -> OutArgs {
        OutArgs { out: None, force: self.force, quiet: self.told.quiet, json: self.told.json }
    }
}

/// How a command tells what it has written.
#[derive(Args)]
pub(crate) struct ToldArgs {
    /// Say nothing but errors
    #[arg(long, short)]
    pub quiet: bool,
    /// Report progress as JSON lines on stderr
    #[arg(long)]
    pub json: bool,
}

impl ToldArgs {
    /// Tells where a result is, and `lines` to people.
    pub(crate) fn tell(&self, out: &Path, lines: &[String]) {
        tell([self.json, self.quiet], out, lines);
    }
}

/// Tells programs by an event where a result is, and people by lines.
fn tell([json, quiet]: [bool; 2], out: &Path, lines: &[String]) {
    if json {
        emit(&serde_json::json!({"event": "done", "out": out}));
    } else if !quiet {
        lines.iter().for_each(|line| say(line));
    }
}

/// The processes of this machine that walk.
#[derive(Args)]
pub(crate) struct TeamArgs {
    /// Worker processes [default: one per core; in scenes of over 64 MB threads of this process]
    #[arg(long, value_name = "N", value_parser = workers)]
    pub workers: Option<u32>,
    /// Threads of each worker
    #[arg(long, value_name = "T", default_value_t = 1, value_parser = threads)]
    pub threads: u32,
}

impl TeamArgs {
    /// The team of the processes that were asked for, else of one per core.
    pub(crate) fn team(&self) -> Team {
        let cores = || std::thread::available_parallelism().map_or(1, usize::from);
        let workers = self.workers.map_or_else(cores, |workers| workers as usize);
        Team { workers, threads: self.threads, is_fixed: self.workers.is_some() }
    }
}

/// Who walks what is counted round by round, and whether counts go on.
#[derive(Args)]
pub(crate) struct RoundArgs {
    #[command(flatten)]
    pub team: TeamArgs,
    /// Listen for workers that are started elsewhere, as coordinate does, in place of starting some here
    #[arg(long, value_name = "HOST:PORT", conflicts_with_all = ["workers", "threads"])]
    pub listen: Option<String>,
    /// The name or address by which others reach this machine, if --listen gives another; with a port behind a gateway
    #[arg(long, value_name = "HOST", requires = "listen")]
    pub advertise: Option<String>,
    /// The access file to write for workers [default: <output folder>/access.json]
    #[arg(long, value_name = "FILE", requires = "listen")]
    pub access: Option<PathBuf>,
    /// Go on from the counts in the output folder
    #[arg(long, conflicts_with = "force")]
    pub resume: bool,
}

/// Where workers come in.
#[derive(Args)]
pub(crate) struct ListenArgs {
    /// Where to listen for workers: the name by which they reach this machine, e.g. node1:7600 (port 0: any free one)
    #[arg(long, value_name = "HOST:PORT", default_value = "127.0.0.1:0")]
    pub listen: String,
    /// The name or address by which others reach this machine, if --listen gives another; with a port behind a gateway
    #[arg(long, value_name = "HOST")]
    pub advertise: Option<String>,
}

/// A job that is coordinated, and what is written of it.
#[derive(Args)]
pub(crate) struct LeadArgs {
    #[command(flatten)]
    pub job: JobArgs,
    #[command(flatten)]
    pub out: OutArgs,
    #[command(flatten)]
    pub export: ExportArgs,
}

/// Where a coordinated job begins, and where it shows its state.
#[derive(Args)]
pub(crate) struct SessionArgs {
    /// Go on from the checkpoint in the output folder; with more --paths, also from its end
    #[arg(long, conflicts_with = "force")]
    pub resume: bool,
    /// Metrics for Prometheus at http://HOST:PORT/metrics, without a key; a port alone: for this machine only
    #[arg(long, value_name = "HOST:PORT")]
    pub metrics: Option<String>,
    /// The report of the result so far at http://HOST:PORT/; a port alone: for this machine only. Elsewhere the printed
    /// address has a key; the page is not encrypted
    #[arg(long, value_name = "HOST:PORT")]
    pub watch: Option<String>,
}

#[derive(Args)]
pub(crate) struct RunArgs {
    #[command(flatten)]
    pub work: LeadArgs,
    #[command(flatten)]
    pub team: TeamArgs,
    #[command(flatten)]
    pub session: SessionArgs,
}

#[derive(Args)]
pub(crate) struct CoordinateArgs {
    #[command(flatten)]
    pub work: LeadArgs,
    #[command(flatten)]
    pub at: ListenArgs,
    /// The access file to write for workers [default: <output folder>/access.json]
    #[arg(long, value_name = "FILE")]
    pub access: Option<PathBuf>,
    #[command(flatten)]
    pub session: SessionArgs,
}

#[derive(Args)]
pub(crate) struct WorkArgs {
    /// The access file that the coordinator wrote; - reads it from standard input
    #[arg(long, value_name = "FILE")]
    pub access: PathBuf,
    /// The number of threads that walk
    #[arg(long, value_name = "T", default_value_t = 1, value_parser = threads)]
    pub threads: u32,
    /// Say nothing but panics; the coordinator reports what goes wrong
    #[arg(long, short)]
    pub quiet: bool,
    /// How long to look for a coordinator that is not there yet, or that vanished [default: 600; without a launcher, 0 for
    /// one that is not there yet]
    #[arg(long, value_name = "SECONDS")]
    pub wait: Option<u64>,
}

#[derive(Args)]
pub(crate) struct RelayArgs {
    /// The access file that the coordinator (or another relay) wrote
    #[arg(long, value_name = "FILE")]
    pub access: PathBuf,
    /// The access file to write for this relay's workers
    #[arg(long, value_name = "FILE")]
    pub out_access: PathBuf,
    #[command(flatten)]
    pub at: ListenArgs,
    /// Say nothing but errors
    #[arg(long, short)]
    pub quiet: bool,
    /// How long to look for a coordinator, as workers do
    #[arg(long, value_name = "SECONDS")]
    pub wait: Option<u64>,
}

#[derive(Args)]
pub(crate) struct StatusArgs {
    /// The access file or the output folder of the job
    #[arg(value_name = "ACCESS-or-OUT")]
    pub of: PathBuf,
    /// The status as JSON on stdout
    #[arg(long)]
    pub json: bool,
}

#[derive(Args)]
pub(crate) struct DiffArgs {
    /// The output folder of a run
    pub first: PathBuf,
    /// The output folder of another run of the same scene
    pub second: PathBuf,
    /// The comparison as JSON on stdout
    #[arg(long)]
    pub json: bool,
}

#[derive(Args)]
pub(crate) struct MergeArgs {
    /// Output folders of runs of one scene and method, or of `factors` between the same groups
    #[arg(required = true, num_args = 1.., value_name = "OUT")]
    pub runs: Vec<PathBuf>,
    /// The folder for the merged result
    #[arg(long, value_name = "DIR", required = true)]
    pub out: PathBuf,
    #[command(flatten)]
    pub made: MadeArgs,
}

#[derive(Args)]
pub(crate) struct CombineArgs {
    /// The output folder of a run whose job has [[source]] tables
    #[arg(value_name = "OUT")]
    pub run: PathBuf,
    /// Multiply what a source of the job emits; repeatable. Sources that are not named stay as they are in OUT
    #[arg(long, value_name = "NAME=FACTOR", required = true, value_parser = factor)]
    pub set: Vec<(String, f64)>,
    /// The output folder [default: OUT-mix]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub made: MadeArgs,
}

#[derive(Args)]
pub(crate) struct AuditArgs {
    /// The output folder of a run
    pub run: PathBuf,
    /// The part of the walks to trace again, drawn at random
    #[arg(long, value_name = "FRACTION", default_value_t = 0.001)]
    pub share: f64,
    /// Draw the same leases as another audit [default: a seed drawn anew]
    #[arg(long, value_name = "S", value_parser = count, allow_negative_numbers = true)]
    pub seed: Option<u64>,
    /// Say nothing but errors
    #[arg(long, short)]
    pub quiet: bool,
}

#[derive(Args)]
pub(crate) struct ReportArgs {
    /// The output folder of a run
    pub run: PathBuf,
    #[command(flatten)]
    pub export: ExportArgs,
    #[command(flatten)]
    pub told: ToldArgs,
}

#[derive(Args)]
pub(crate) struct ReplayArgs {
    #[command(flatten)]
    pub job: JobArgs,
    /// The number of the walk
    #[arg(long, value_name = "N", value_parser = count, allow_negative_numbers = true)]
    pub walk: u64,
}

#[derive(Args)]
pub(crate) struct ExactArgs {
    #[command(flatten)]
    pub job: JobArgs,
    #[command(flatten)]
    pub out: OutArgs,
}

/// What `radwalk factors` counts.
#[derive(Args)]
pub(crate) struct FactorsArgs {
    #[command(flatten)]
    pub job: JobArgs,
    #[command(flatten)]
    pub out: OutArgs,
    /// Between what: by-patch, by-surface, by-material, or a file of [[group]] tables [default: by-patch up to 256 faces, else
    /// by-surface]
    #[arg(long, value_name = "GROUPS")]
    pub groups: Option<String>,
    /// Count where walks are absorbed after reflections (Gebhart's factors), not what they hit first
    #[arg(long)]
    pub reflections: bool,
    /// The channel whose reflectances hold, in a scene in colour
    #[arg(long, value_enum)]
    pub channel: Option<ChannelWord>,
    /// End where half-widths are this part of their factors: of each row in the mean square, or of each of --pairs
    #[arg(long, value_name = "PART", value_parser = tolerance)]
    pub tolerance: Option<f64>,
    /// Pairs of groups that the tolerance is asked of, each of them; may be a list, e.g. --pairs floor:ceiling,lamp:floor
    #[arg(long, value_name = "FROM:TO", value_delimiter = ',', requires = "tolerance")]
    pub pairs: Vec<String>,
    /// Add factors that are adjusted to each other: reciprocal, and adding up to 1
    #[arg(long)]
    pub smooth: bool,
    /// Solve for the heat between the groups: a file of temperatures [K] or fluxes [W] of each; implies --reflections
    #[arg(long, value_name = "FILE")]
    pub temperatures: Option<PathBuf>,
    /// Write the factors as matrices, too; may be a list [default of --sparse: mtx]
    #[arg(long, value_name = "FILE", value_delimiter = ',', value_enum)]
    pub export: Vec<MatrixWord>,
    /// Count row by row and keep the factors that are not 0: for any number of groups, by default every patch
    #[arg(long, conflicts_with_all = ["pairs", "listen"])]
    pub sparse: bool,
    /// Walks of each row; with --tolerance, the most [default: 10000]. With --paths in its place, all rows share that many by area and variance
    #[arg(long, value_name = "N", value_parser = row_walks, requires = "sparse", conflicts_with = "paths")]
    pub rays: Option<u32>,
    /// Leave out factors below this; a column `rest` holds their sum
    #[arg(long, value_name = "LEAST", value_parser = tolerance, requires = "sparse", conflicts_with = "smooth")]
    pub drop: Option<f64>,
    /// Divide `escape` by patches of the sky: 145 (Tregenza), 577 or 2305 (Reinhart)
    #[arg(long, value_name = "N", value_parser = sky_patches, requires = "sparse")]
    pub sky_patches: Option<u32>,
    /// Repeat the scene without end at these steps along x and y [m], e.g. 30,30; 0 along an axis where it does not repeat
    #[arg(long, value_name = "X,Y", value_parser = periods, requires = "sparse")]
    pub periodic: Option<[f64; 2]>,
    /// Count this part of the rows, e.g. 1/4 on the first of four machines
    #[arg(long, value_name = "K/N", value_parser = part, requires = "sparse")]
    pub part: Option<[u32; 2]>,
    /// Take the rows from these folders, where parts of them were counted
    #[arg(long, value_name = "DIR", value_delimiter = ',', requires = "sparse", conflicts_with_all = ["part", "resume"])]
    pub join: Vec<PathBuf>,
    #[command(flatten)]
    pub rounds: RoundArgs,
}

/// What `radwalk daylight` counts.
#[derive(Args)]
pub(crate) struct DaylightArgs {
    #[command(flatten)]
    pub job: JobArgs,
    #[command(flatten)]
    pub out: OutArgs,
    /// The weather of a year, in the format of EnergyPlus (EPW)
    #[arg(long, value_name = "FILE")]
    pub weather: PathBuf,
    /// Patches of the sky: 145 (Tregenza's), 577 or 2305 (Reinhart's)
    #[arg(long, value_name = "N", default_value_t = 145, value_parser = sky_patches)]
    pub sky_patches: u32,
    /// The reflectance of the ground, where the scene has none
    #[arg(long, value_name = "R", default_value_t = 0.2, value_parser = reflectance)]
    pub ground: f64,
    /// The channel whose reflectances hold, in a scene in colour
    #[arg(long, value_enum)]
    pub channel: Option<ChannelWord>,
    /// End the walks of a place where the half-width of its yearly mean is this part of the mean
    #[arg(long, value_name = "PART", default_value_t = 0.05, value_parser = tolerance)]
    pub tolerance: f64,
    /// The illuminance that is enough, for daylight autonomy [lx]
    #[arg(long, value_name = "LX", default_value_t = 300.0, value_parser = illuminance)]
    pub enough: f64,
    /// Write these files, too; may be a list
    #[arg(long, value_name = "FILE", value_delimiter = ',', value_enum)]
    pub export: Vec<DaylightWord>,
    #[command(flatten)]
    pub rounds: RoundArgs,
}

/// A file of daylight.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum DaylightWord {
    /// daylight.npz: arrays of coefficients and of the light of every hour, with errors, for NumPy
    Npz,
    /// daylight.parquet: a row for each place and hour
    Parquet,
    /// coefficients.float.mtx: coefficients.mtx in Radiance's binary numbers
    FloatMtx,
}

impl From<DaylightWord> for DaylightFile {
    fn from(word: DaylightWord) -> Self {
        match word {
            DaylightWord::Npz => DaylightFile::Npz,
            DaylightWord::Parquet => DaylightFile::Parquet,
            DaylightWord::FloatMtx => DaylightFile::FloatMtx,
        }
    }
}

/// What `radwalk sky` writes.
#[derive(Args)]
pub(crate) struct SkyArgs {
    /// The standard sky of the CIE: 1 to 15 of CIE S 011, 16 for the traditional overcast sky
    #[arg(long, value_name = "TYPE", required_unless_present = "weather", value_parser = clap::value_parser!(u8).range(1..=16))]
    pub cie: Option<u8>,
    /// The altitude of the sun over the horizon, for a standard sky [°]
    #[arg(long, value_name = "DEG", default_value_t = 45.0, allow_negative_numbers = true, value_parser = altitude, conflicts_with = "weather")]
    pub altitude: f64,
    /// The azimuth of the sun, from the north over the east [°]
    #[arg(long, value_name = "DEG", default_value_t = 180.0, allow_negative_numbers = true, value_parser = azimuth, conflicts_with = "weather")]
    pub azimuth: f64,
    /// What a standard sky gives a horizontal plane, without the sun [lx]
    #[arg(long, value_name = "LX", default_value_t = 10000.0, value_parser = illuminance, conflicts_with = "weather")]
    pub horizontal: f64,
    /// A year of weather (EPW), in place of a standard sky
    #[arg(long, value_name = "FILE", conflicts_with = "cie")]
    pub weather: Option<PathBuf>,
    /// Leave out the sun of the weather
    #[arg(long, requires = "weather")]
    pub no_sun: bool,
    /// Write power [W/(m² sr)] in place of light as eyes see it (over 179 lm/W)
    #[arg(long, requires = "weather")]
    pub solar: bool,
    /// Patches of the sky: 145 (Tregenza's), 577 or 2305 (Reinhart's)
    #[arg(long, value_name = "N", default_value_t = 145, value_parser = sky_patches)]
    pub sky_patches: u32,
    /// The reflectance of the ground
    #[arg(long, value_name = "R", default_value_t = 0.2, value_parser = reflectance)]
    pub ground: f64,
    /// Write numbers of 32 bits, not text
    #[arg(long)]
    pub binary: bool,
    /// The file to write
    #[arg(long, value_name = "FILE", default_value = "sky.mtx")]
    pub out: PathBuf,
    /// Replace the file
    #[arg(long)]
    pub force: bool,
    #[command(flatten)]
    pub told: ToldArgs,
}

/// A file of factors.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum MatrixWord {
    /// factors.npz: arrays of factors, errors and names for NumPy; of --sparse, compressed rows for SciPy
    Npz,
    /// factors.mtx: the factors that are not 0, in the format of Matrix Market
    Mtx,
    /// factors.parquet: a row for each factor that is not 0 (--sparse)
    Parquet,
    /// factors.vf of View3D (--sparse)
    View3d,
    /// vfsparse.inp and svf.inp of uDALES (--sparse)
    Udales,
    /// vf.nc.inp and svf.inp of uDALES, every pair in NetCDF (--sparse)
    UdalesNetcdf,
    /// factors.idf: ZoneProperty:UserViewFactors:BySurfaceName of EnergyPlus (--sparse)
    Energyplus,
    /// F, globalFaceFaces and the maps of one processor of OpenFOAM (--sparse)
    Openfoam,
}

impl MatrixWord {
    /// The matrix of dense factors; `None` where only sparse ones are written so.
    pub(crate) fn dense(self) -> Option<MatrixFile> {
        match self {
            MatrixWord::Npz => Some(MatrixFile::Npz),
            MatrixWord::Mtx => Some(MatrixFile::Mtx),
            _ => None,
        }
    }
}

impl From<MatrixWord> for SparseFile {
    fn from(word: MatrixWord) -> Self {
        match word {
            MatrixWord::Npz => SparseFile::Npz,
            MatrixWord::Mtx => SparseFile::Mtx,
            MatrixWord::Parquet => SparseFile::Parquet,
            MatrixWord::View3d => SparseFile::View3d,
            MatrixWord::Udales => SparseFile::Udales,
            MatrixWord::UdalesNetcdf => SparseFile::UdalesNetcdf,
            MatrixWord::Energyplus => SparseFile::EnergyPlus,
            MatrixWord::Openfoam => SparseFile::OpenFoam,
        }
    }
}

/// A channel of a scene in colour.
#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum ChannelWord {
    /// Red
    R,
    /// Green
    G,
    /// Blue
    B,
}

#[derive(Args)]
pub(crate) struct PlanArgs {
    #[command(flatten)]
    pub job: JobArgs,
    /// Plan for this number of workers; of chains, also the batch_paths with the least error there
    #[arg(long, value_name = "W", value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    pub workers: Option<u64>,
    /// The plan as JSON on stdout
    #[arg(long)]
    pub json: bool,
}

/// Whatever a command took that is in the laboratory now.
#[derive(Args)]
pub(crate) struct MovedArgs {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    _words: Vec<String>,
}

#[derive(Args)]
pub(crate) struct CompareArgs {
    /// Job files, whose scenes are used and whose methods are not
    #[arg(required = true, num_args = 1.., value_name = "JOB")]
    pub jobs: Vec<PathBuf>,
    #[command(flatten)]
    pub out: OutArgs,
    /// Rays of the longest runs [default: 2^20, or 256 per patch]
    #[arg(long, value_name = "N", value_parser = rays)]
    pub rays: Option<u64>,
    /// Runs of every method and size
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(2..))]
    pub runs: usize,
    /// Set any key of the jobs
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    #[command(flatten)]
    pub team: TeamArgs,
    /// Keep the rows that are measured already
    #[arg(long, conflicts_with = "force")]
    pub resume: bool,
}

#[derive(Args)]
pub(crate) struct LampArgs {
    /// The file of a luminaire: ANSI/IES LM-63 (.ies) or EULUMDAT (.ldt)
    pub file: PathBuf,
    /// The folder for the polar curve, polar.svg [default: out/<file name>]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// The file for the polar curve, in place of a folder
    #[arg(long, value_name = "FILE", conflicts_with = "out")]
    pub svg: Option<PathBuf>,
    /// Replace the curve that is there
    #[arg(long)]
    pub force: bool,
    /// Say nothing but errors
    #[arg(long, short)]
    pub quiet: bool,
    /// What is in the file as JSON on stdout
    #[arg(long)]
    pub json: bool,
}

#[derive(Args)]
pub(crate) struct CheckArgs {
    /// A job file or a scene file
    pub file: PathBuf,
    /// Set any key of the job
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    #[command(flatten)]
    pub mesh: MeshArgs,
    /// All of it as JSON on stdout
    #[arg(long, conflicts_with_all = ["fix_report", "repair"])]
    pub json: bool,
    /// Say nothing but errors; the exit code tells
    #[arg(long, short)]
    pub quiet: bool,
    /// Look for faults of the geometry: flipped, doubled, buried and leaking surfaces, dark lamps
    #[arg(long)]
    pub fix_report: bool,
    /// The folder for findings and pictures [default: out/<job name>-doctor]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Write a copy of the scene with flipped surfaces turned round and doubled ones taken out: NAME.repaired.toml
    #[arg(long)]
    pub repair: bool,
}

#[derive(Args)]
pub(crate) struct NewArgs {
    /// What to begin with
    pub kind: StarterKind,
    /// Where to write the job and its scene
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub out: PathBuf,
    /// Replace what is there
    #[arg(long)]
    pub force: bool,
    #[command(flatten)]
    pub told: ToldArgs,
}

#[derive(Args)]
pub(crate) struct HelpArgs {
    /// A command (run, plan, …) or a word (walk, interval, access file, …) [default: the commands, and a list of the words]
    #[arg(value_name = "COMMAND or WORD")]
    pub word: Vec<String>,
}

/// The kinds of beginnings.
#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum StarterKind {
    /// An empty cube with a lamp in its ceiling
    Box,
    /// A room with a window, a table and a lamp
    Room,
    /// The Cornell box, in colour
    Cornell,
    /// The JSON schemas of job and scene files alone, for editors
    Schema,
}
