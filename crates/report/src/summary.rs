//! `summary.json`: what was run, what it cost, how well the answer is known.

use std::io::{self, Write};

use radiosity::{
    Counts, Direction, Method, Scene, Tally,
    methods::AbsorptionMode,
    precision::{Precision, Quantity},
};
use serde::ser::SerializeStruct;
use serde::{Serialize, Serializer};

use crate::accuracy::AccuracySummary;
use crate::method::MethodWords;
use crate::model::Model;
use crate::partition::{ChoiceSummary, PartitionSummary};
use crate::picture::{NamedShot, Shot};
use crate::planes::PlaneSummary;
use crate::precision::{DiscretisedSummary, PrecisionSummary, quantity_word};
use crate::sensitivities::SensitivitySummary;
use crate::sensors::SensorsSummary;
use crate::sources::SourceSummary;
use crate::words::percent;

/// All of `summary.json`, in its order. Numbers that are not finite become null.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Version of the program.
    pub version: String,
    /// The commit it was built from, if that is known.
    pub git: Option<String>,
    /// Digest of scene, method and seed.
    #[serde(serialize_with = "hex")]
    pub job_hash: [u8; 32],
    /// Digest of the scene.
    #[serde(serialize_with = "hex")]
    pub scene_hash: [u8; 32],
    /// Digest of the tally: equal where all results are.
    #[serde(serialize_with = "hex")]
    pub tally_hash: [u8; 32],
    /// Seed of the random sequence.
    pub seed: u64,
    /// How walks and scores are made.
    #[serde(flatten)]
    pub method: MethodWords,
    /// Walks 0 … N − 1 are in the result; this is N. Jacobi: rays of all chains.
    pub paths: u64,
    /// The number of rays traced.
    pub rays: u64,
    /// Walks that left the scene.
    pub escaped: u64,
    /// Walks absorbed by the back of a one-sided surface.
    pub absorbed_back: u64,
    /// Walks that were cut off; analog walks never are.
    pub truncated: u64,
    /// Wall time of tracing, in seconds.
    pub seconds: f64,
    /// Processor time that all workers walked, in seconds.
    pub cpu_seconds: f64,
    /// Walks per second of wall time.
    pub paths_per_second: f64,
    /// Rays per second of wall time.
    pub rays_per_second: f64,
    /// The number of workers that joined.
    pub workers_seen: u64,
    /// Workers that were lost.
    pub workers_lost: u64,
    /// Streams in the result.
    pub streams: u64,
    /// Streams that were leased more than once.
    pub streams_reissued: u64,
    /// Level of every interval, or of all together.
    pub confidence: f64,
    /// Whether it is that of all intervals together.
    pub simultaneous: bool,
    /// How well the non-emitting patches are known.
    #[serde(flatten)]
    pub precision: PrecisionSummary,
    /// How far the discretised system's answer is from the integral equation's, `null` where that was not examined; absent where
    /// the answer is the integral equation's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub discretised: Option<Option<DiscretisedSummary>>,
    /// The errors of the answer that the pilot predicted; absent without a pilot.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub predicted: Option<AccuracySummary>,
    /// The errors of the answer; absent where nothing tells how light is spread over patches.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub accuracy: Option<AccuracySummary>,
    /// What the program chose where the job says no method; absent where it does.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub choice: Option<ChoiceSummary>,
    /// How the patches were chosen; absent where the job says them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub partition: Option<PartitionSummary>,
    /// What the numbers measure, here and in the tables.
    pub units: Units,
    /// Where the power went.
    pub energy: Energy,
    /// The target, if the job has one.
    pub target: Option<TargetReport>,
    /// The sensors; absent where there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sensors: Option<SensorsSummary>,
    /// The planes of points; absent where there are none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub planes: Vec<PlaneSummary>,
    /// The sources that are distinguished; absent where none are.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub sources: Vec<SourceSummary>,
    /// How much materials matter, the one that matters most first; absent where that is not asked for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub sensitivities: Vec<SensitivitySummary>,
    /// The model of the job.
    pub model: Model,
    /// What was left out, changed or assumed of meshes; absent where nothing was.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub import: Vec<String>,
    /// The checks of the result.
    pub checks: Vec<Check>,
    /// How the picture was taken; absent where none was.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub picture: Option<Shot>,
    /// The same of views with names; absent where there are none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub views: Vec<NamedShot>,
    /// Whose walks these are and where they came from.
    pub provenance: Provenance,
}

/// The units of a result. They are labels: no number depends on them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Units {
    /// The kind of light: `radiant` or `luminous`.
    pub light: &'static str,
    /// The unit of emitted power.
    pub power: &'static str,
    /// The unit of emittance and radiosity.
    pub radiosity: &'static str,
    /// The unit of irradiance.
    pub irradiance: &'static str,
    /// The unit of radiance.
    pub radiance: &'static str,
}

impl Units {
    /// The units of radiant energy, by the watt.
    pub const RADIANT: Units =
        Units {
            light: "radiant", power: "W", radiosity: "W/m²", irradiance: "W/m²", radiance: "W/(m² sr)"
        };

    /// Light as the eye weighs it: lumens in, lux out.
    pub const LUMINOUS: Units =
        Units { light: "luminous", power: "lm", radiosity: "lm/m²", irradiance: "lx", radiance: "cd/m²" };
}

/// Where the walks of a result came from.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Provenance {
    /// The walks, by seed and number.
    pub parts: Vec<PartSummary>,
    /// The workers that walked them.
    pub workers: Vec<WorkerSummary>,
    /// The processes that coordinated them.
    pub sessions: Vec<SessionSummary>,
}

/// Some consecutive walks of one seed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PartSummary {
    /// The seed of the walks.
    pub seed: u64,
    /// The number of the first walk.
    pub first_path: u64,
    /// The number of walks.
    pub paths: u64,
}

/// What one worker delivered.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WorkerSummary {
    /// The worker's name for itself: host and process.
    pub name: String,
    /// The number of its walks.
    pub paths: u64,
    /// In how many leases.
    pub leases: u64,
}

/// One process that coordinated a part of a run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SessionSummary {
    /// The machine that it ran on.
    pub host: String,
    /// Version and commit of the program.
    pub build: String,
    /// When it began, in seconds since 1970-01-01 UTC.
    pub began: u64,
    /// When it wrote its last checkpoint, in seconds since 1970-01-01 UTC.
    pub ended: u64,
}

/// Where the walks or their power went: emitted = absorbed + escaped.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Energy {
    /// Counts, where walks are analog.
    Walks {
        /// The number of walks that began.
        emitted: u64,
        /// Walks that a surface absorbed, on either side.
        absorbed: u64,
        /// Walks that left the scene.
        escaped: u64,
    },
    /// Weighted walks, and chains.
    Power {
        /// Power that set out [W], all channels together; importance 1 for gathering walks.
        emitted: f64,
        /// What surfaces took, and what was cut off.
        absorbed: f64,
        /// What left the scene.
        escaped: f64,
    },
}

/// What the job asked for, and whether it was reached.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TargetReport {
    /// Whether `achieved` is at least `fraction`.
    pub reached: bool,
    /// The relative error that was asked for.
    pub relative_error: f64,
    /// The fraction of patch area that must meet it.
    pub fraction: f64,
    /// The patches that it is about; absent where that is all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub patches: Option<Vec<u32>>,
    /// The quantity whose half-widths must meet it.
    #[serde(serialize_with = "quantity_word")]
    pub quantity: Quantity,
    /// The fraction that does; `null` where there is nothing to judge.
    pub achieved: f64,
    /// About how many walks it takes, by what is known now; `null` where nothing is.
    pub paths_needed: Option<f64>,
    /// The patches furthest from it.
    pub worst: Vec<WorstPatch>,
}

/// The area that a target is about, in words.
pub fn target_scope(patches: Option<&[u32]>, quantity: Quantity) -> String {
    match patches {
        None if quantity == Quantity::Radiosity => "the patch area that reflects".into(),
        None => "the patch area".into(),
        Some([patch]) => format!("patch {patch}"),
        Some(patches) => format!("the area of {} chosen patches", patches.len()),
    }
}

impl TargetReport {
    /// The part of the area that meets the target, in words.
    pub fn achieved_words(&self) -> String {
        let of = target_scope(self.patches.as_deref(), self.quantity);
        let what = self.quantity.words();
        match self.achieved.is_nan() {
            true => format!("nothing to judge: no walk can tell of the {what} of {of}"),
            false => format!(
                "{:.2} % of {of} is within {} of the {what}",
                100.0 * self.achieved,
                percent(self.relative_error)
            ),
        }
    }
}

/// A patch that keeps a target from being reached.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WorstPatch {
    /// The number of the patch.
    pub patch: usize,
    /// The patch, or the side of it, as messages name it.
    #[serde(skip)]
    pub words: String,
    /// The surface of the patch.
    pub surface: String,
    /// Half-width over estimate; `null` where no walk has hit it.
    pub relative_error: f64,
    /// Scored events on the patch.
    pub hits: u64,
    /// About how many walks it takes, by what is known now.
    pub paths_needed: f64,
}

/// The outcome of a check.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Check {
    /// A word that names it.
    pub name: String,
    /// Whether the result passed the check, or was not examined.
    pub verdict: Verdict,
    /// What the check found.
    pub message: String,
}

/// What a check says of a result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    /// The check ran and found a fault.
    Failed,
    /// The check had nothing to go by.
    NotExamined,
    /// The check ran and found no fault.
    Passed,
}

impl Verdict {
    /// The verdict in words.
    pub fn words(self) -> &'static str {
        match self {
            Verdict::Failed => "failed",
            Verdict::NotExamined => "not examined",
            Verdict::Passed => "passed",
        }
    }
}

impl From<bool> for Verdict {
    fn from(passed: bool) -> Self {
        if passed { Verdict::Passed } else { Verdict::Failed }
    }
}

impl Serialize for Check {
    /// `ok` is `null` where nothing was examined.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Check { name, verdict, message } = self;
        let mut fields = serializer.serialize_struct("Check", 4)?;
        fields.serialize_field("name", name)?;
        fields.serialize_field(
            "ok",
            &(*verdict != Verdict::NotExamined).then_some(*verdict == Verdict::Passed),
        )?;
        fields.serialize_field("verdict", verdict.words())?;
        fields.serialize_field("message", message)?;
        fields.end()
    }
}

/// What the program knows of a run beyond its result.
#[derive(Clone, Debug, PartialEq)]
pub struct RunFacts {
    /// Version of the program.
    pub version: String,
    /// The commit it was built from, if that is known.
    pub git: Option<String>,
    /// Digest of scene, method and seed.
    pub job_hash: [u8; 32],
    /// Seed of the random sequence.
    pub seed: u64,
    /// How walks and scores were made.
    pub method: Method,
    /// N: walks, or rays of all chains.
    pub paths: u64,
    /// Wall time of tracing, in seconds.
    pub seconds: f64,
    /// Processor time of all workers, in seconds.
    pub cpu_seconds: f64,
    /// The number of workers that joined.
    pub workers_seen: u64,
    /// Workers that were lost.
    pub workers_lost: u64,
    /// Streams in the result.
    pub streams: u64,
    /// Streams that were leased more than once.
    pub streams_reissued: u64,
    /// The target, if the job has one.
    pub target: Option<TargetReport>,
    /// How far the discretised system's answer is from the integral equation's, if that was examined, and if the answer is of that
    /// system.
    pub discretised: Option<Option<DiscretisedSummary>>,
    /// The errors of the answer that a pilot predicted.
    pub predicted: Option<AccuracySummary>,
    /// The errors of the answer, if anything tells how light is spread over patches.
    pub accuracy: Option<AccuracySummary>,
    /// What the program chose, if it chose the method.
    pub choice: Option<ChoiceSummary>,
    /// How the patches were chosen, if a pilot chose them.
    pub partition: Option<PartitionSummary>,
    /// The sensors, if the scene has any.
    pub sensors: Option<SensorsSummary>,
    /// The planes of points.
    pub planes: Vec<PlaneSummary>,
    /// The sources that are distinguished.
    pub sources: Vec<SourceSummary>,
    /// How much materials matter, the one that matters most first.
    pub sensitivities: Vec<SensitivitySummary>,
    /// The model of the job.
    pub model: Model,
    /// What was left out, changed or assumed of meshes.
    pub import: Vec<String>,
    /// What the numbers measure.
    pub units: Units,
    /// The checks of the result.
    pub checks: Vec<Check>,
    /// Level of every interval, or of all together.
    pub confidence: f64,
    /// Whether it is that of all intervals together.
    pub simultaneous: bool,
    /// Whose walks these are and where they came from.
    pub provenance: Provenance,
}

impl Summary {
    /// The summary of a run of analog walks.
    pub fn new(scene: &Scene, tally: &Tally, precision: Precision, facts: RunFacts) -> Self {
        let counts = tally.counts;
        let paths = facts.paths;
        let energy = Energy::new(scene, &counts, paths, &facts.method);
        Summary {
            version: facts.version,
            git: facts.git,
            job_hash: facts.job_hash,
            scene_hash: scene.hash(),
            tally_hash: tally.hash(),
            seed: facts.seed,
            model: facts.model,
            method: MethodWords::of(&facts.method),
            paths,
            rays: counts.rays,
            escaped: counts.escaped,
            absorbed_back: counts.absorbed_back,
            truncated: counts.truncated,
            seconds: facts.seconds,
            cpu_seconds: facts.cpu_seconds,
            paths_per_second: paths as f64 / facts.seconds,
            rays_per_second: counts.rays as f64 / facts.seconds,
            workers_seen: facts.workers_seen,
            workers_lost: facts.workers_lost,
            streams: facts.streams,
            streams_reissued: facts.streams_reissued,
            confidence: facts.confidence,
            simultaneous: facts.simultaneous,
            precision: PrecisionSummary::new(scene, &precision),
            discretised: facts.discretised,
            predicted: facts.predicted,
            accuracy: facts.accuracy,
            choice: facts.choice,
            partition: facts.partition,
            units: facts.units,
            energy,
            target: facts.target,
            sensors: facts.sensors,
            planes: facts.planes,
            sources: facts.sources,
            sensitivities: facts.sensitivities,
            import: facts.import,
            checks: facts.checks,
            picture: None,
            views: Vec::new(),
            provenance: facts.provenance,
        }
    }

    /// What errors are of, where that is not the light itself: words behind an error.
    pub fn system(&self) -> &'static str {
        if self.discretised.is_some() { ", of the discretised system" } else { "" }
    }

    /// How well the patches are known, in one line.
    pub fn headline(&self) -> String {
        self.precision.headline.line((self.confidence, self.simultaneous), self.discretised)
    }

    /// Writes the summary as indented JSON.
    ///
    /// # Errors
    /// Those of `writer`.
    pub fn write(&self, mut writer: impl Write) -> io::Result<()> {
        serde_json::to_writer_pretty(&mut writer, self)?;
        writeln!(writer)
    }
}

impl Energy {
    /// The balance of some walks. Gathering walks carry importance: each sets out with 1.
    fn new(scene: &Scene, counts: &Counts, paths: u64, method: &Method) -> Self {
        if method.estimator_kind().is_some_and(|kind| kind.absorption() != AbsorptionMode::Implicit) {
            let absorbed = counts.absorbed + counts.absorbed_back;
            return Energy::Walks { emitted: paths, absorbed, escaped: counts.escaped };
        }
        let walks = counts.walks as f64;
        let gathers = matches!(method.direction(), Some(Direction::Gathering(_)));
        let emitted = |c: usize| if gathers { walks } else { scene.total_power(c) };
        let escaped =
            |c: usize| emitted(c) * (counts.escaped_weight[c] as f64 / (walks * Counts::WEIGHT_UNITS));
        let all = |of: &dyn Fn(usize) -> f64| (0..scene.channels()).map(of).sum::<f64>();
        let (emitted, escaped) = (all(&emitted), all(&escaped));
        Energy::Power { emitted, absorbed: emitted - escaped, escaped }
    }
}

pub(crate) fn hex<S: Serializer>(hash: &[u8; 32], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(&blake3::Hash::from_bytes(*hash).to_hex())
}

#[cfg(test)]
mod tests {
    use radiosity::{Counts, EstimatorKind, Layout};
    use serde_json::{Value, json};

    use super::*;
    use crate::scenes::cube;

    fn facts() -> RunFacts {
        let method = Method::shooting(EstimatorKind::Collision);
        RunFacts {
            model: Model::new(&cube(), &method, None),
            version: "0.1.0".into(),
            git: None,
            job_hash: [0xAB; 32],
            seed: u64::MAX,
            method,
            paths: 100,
            seconds: 4.0,
            cpu_seconds: 7.5,
            workers_seen: 2,
            workers_lost: 1,
            streams: 16,
            streams_reissued: 3,
            target: None,
            discretised: None,
            predicted: None,
            accuracy: None,
            choice: None,
            partition: None,
            sensors: None,
            planes: Vec::new(),
            sources: Vec::new(),
            sensitivities: Vec::new(),
            import: Vec::new(),
            units: Units::RADIANT,
            checks: vec![Check {
                name: "energy".into(),
                verdict: Verdict::Passed,
                message: "balanced".into(),
            }],
            confidence: 0.95,
            simultaneous: false,
            provenance: Provenance::default(),
        }
    }

    fn tally(scene: &Scene) -> Tally {
        let counts = Counts {
            walks: 100,
            rays: 250,
            absorbed: 80,
            absorbed_back: 5,
            escaped: 15,
            ..Counts::default()
        };
        let pair = Layout { scores: 1, moments: 2, slopes: 0, events: false };
        Tally::from_parts(counts, scene.faces().len(), pair, vec![0; 2 * scene.faces().len()]).unwrap()
    }

    fn text(summary: &Summary) -> String {
        let mut bytes = Vec::new();
        summary.write(&mut bytes).unwrap();
        String::from_utf8(bytes).unwrap()
    }

    fn parsed(facts: RunFacts) -> Value {
        let scene = cube();
        let summary = Summary::new(&scene, &tally(&scene), Precision::default(), facts);
        serde_json::from_str(&text(&summary)).unwrap()
    }

    #[test]
    fn the_fields_are_in_the_order_of_the_format() {
        const FIELDS: &str = "version git job_hash scene_hash tally_hash seed walk estimator space sampler \
            paths rays escaped absorbed_back truncated seconds cpu_seconds paths_per_second rays_per_second \
            workers_seen workers_lost streams streams_reissued confidence simultaneous rms_relative_error \
            max_relative_error worst_patch headline error_quantiles unhit units energy target model checks provenance";
        let scene = cube();
        let text = text(&Summary::new(&scene, &tally(&scene), Precision::default(), facts()));
        let top_level = text.lines().filter_map(|line| line.strip_prefix("  \"")?.split_once('"'));
        let names: Vec<&str> = top_level.map(|(name, _)| name).collect();
        assert_eq!(names, FIELDS.split_whitespace().collect::<Vec<_>>());
    }

    #[test]
    fn the_numbers_are_those_of_tally_solution_and_run() {
        let json = parsed(facts());
        assert_eq!(json["job_hash"], "ab".repeat(32));
        assert_eq!(json["seed"], u64::MAX);
        assert_eq!(json["paths"], 100);
        assert_eq!(json["rays_per_second"], 62.5);
        assert_eq!(json["energy"], json!({"emitted": 100, "absorbed": 85, "escaped": 15}));
        assert_eq!(json["git"], Value::Null);
        assert_eq!(json["target"], Value::Null);
        assert_eq!(json["checks"][0]["ok"], true);
        assert_eq!(json["model"]["index"], "flat");
        assert_eq!(json["model"]["emitters"], 1);
        assert_eq!(json["model"]["patches"], 54);
    }

    #[test]
    fn numbers_that_are_not_finite_become_null() {
        let scene = cube();
        let unhit =
            Precision { max_relative_error: f64::INFINITY, worst_face: Some(3), ..Precision::default() };
        let facts = RunFacts { seconds: 0.0, ..facts() };
        let summary = Summary::new(&scene, &tally(&scene), unhit, facts);
        let json: Value = serde_json::from_str(&text(&summary)).unwrap();
        assert_eq!(json["rays_per_second"], Value::Null);
        assert_eq!(json["max_relative_error"], Value::Null);
        assert_eq!(json["worst_patch"], 3);
    }
}
