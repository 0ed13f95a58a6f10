//! Compares whole walks with a tracer that only traces: dumps the rays of diffuse walks, has
//! `scripts/embree/compare.cpp` trace them, and measures whole walks in between. `scripts/embree.sh` starts it.

use std::fs::File;
use std::io::{BufRead, BufReader, BufWriter, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use super::meshes::grey_scene;
use super::rays::{Emitters, walk};
use super::{Failure, TimedWalks, collision_shooting, median};
use glam::DVec3;
use radiosity::{IndexChoice, Scene, SceneError, SceneSpec, Sequence, Shape};
use scenes::{cornell, cube, interior};

/// The number of rays to trace in each scene.
const RAYS: usize = 2_000_000;

/// The qualities with which Embree builds its trees.
const QUALITIES: [&str; 2] = ["medium", "high"];

/// How scenes are built for an instruction set.
type Build = fn(&SceneSpec, IndexChoice) -> Result<Scene, SceneError>;

/// An instruction set that both tracers are told to use.
struct InstructionSet {
    name: &'static str,
    build: Build,
    /// What Embree is told.
    embree: &'static str,
}

/// AVX2, and where the machine has it AVX-512.
fn instruction_sets() -> Vec<InstructionSet> {
    let avx2 = InstructionSet { name: "AVX2", build: Scene::build_without_avx512, embree: "isa=avx2" };
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx512dq") && std::arch::is_x86_feature_detected!("avx512vl") {
        return vec![InstructionSet { name: "AVX-512", build: Scene::build, embree: "isa=avx512" }, avx2];
    }
    vec![avx2]
}

/// The modes of Embree that are timed, in the order of the table.
const MODES: [&str; 6] = ["robust 1", "robust 8", "robust 16", "fast 1", "fast 8", "fast 16"];

pub(crate) fn run(words: &[String]) -> Result<(), Failure> {
    let [compare, rounds, meshes @ ..] = words else {
        return Err("usage: embree COMPARE ROUNDS [MESH…]".into());
    };
    let rounds = rounds.parse()?;
    println!(
        "M rays per second of processor time, medians of {rounds} interleaved rounds (ratios: of the rounds' own)"
    );
    println!(
        "{:<14} {:>9} {:<7} {:<6} | {:>6} | {:>17} | {:>17} | {:>13} | {:>11} | {:>11}",
        "scene",
        "triangles",
        "set",
        "trees",
        "walks",
        "robust 1 8 16",
        "fast 1 8 16",
        "÷ robust fast",
        "robust",
        "fast"
    );
    println!("{:>106} | {:>11} | {:>11}", "", "off, lost", "off, lost");
    let compare = Path::new(compare);
    compare_scene("cube54", &cube(3), compare, rounds)?;
    compare_scene("cornell", &cornell(), compare, rounds)?;
    compare_scene("interior 57 k", &interior(57_000), compare, rounds)?;
    compare_scene("interior 1 M", &interior(1_000_000), compare, rounds)?;
    for mesh in meshes.iter().map(Path::new) {
        let name = mesh.file_stem().unwrap_or_default().to_string_lossy();
        compare_scene(&name, &grey_scene(mesh)?, compare, rounds)?;
    }
    println!("set: the instruction set that both are told to use.");
    println!("walks: whole walks of radwalk (sampling, tracing, survival, tally); Embree traces only.");
    println!(
        "trees: the quality that Embree builds its trees with (medium: its default; high: with spatial splits)."
    );
    println!("÷: walks over the better of rtcIntersect1 and rtcIntersect8, robust and fast.");
    println!(
        "off: hits farther from ours than 10⁻³ t + 6·10⁻⁵ scene diagonals; lost: rays that hit with us and"
    );
    println!("miss there (of {RAYS}).");
    Ok(())
}

/// The rows of one scene: one for each instruction set and each quality of Embree's trees.
fn compare_scene(name: &str, spec: &SceneSpec, compare: &Path, rounds: usize) -> Result<(), Failure> {
    let folder = tempfile::tempdir()?;
    let dump = folder.path().join("rays");
    let triangles = write_dump(&dump, spec, &Scene::build(spec, IndexChoice::Auto)?)?;
    for set in instruction_sets() {
        let rows = compare_with(&set, spec, compare, &dump, rounds)?;
        for (row, quality) in rows.iter().zip(QUALITIES) {
            println!("{name:<14} {triangles:>9} {:<7} {quality:<6} | {row}", set.name);
        }
    }
    Ok(())
}

/// The measurements with an instruction set, one row for each quality of Embree's trees.
fn compare_with(
    set: &InstructionSet,
    spec: &SceneSpec,
    compare: &Path,
    dump: &Path,
    rounds: usize,
) -> Result<[QualityRow; QUALITIES.len()], Failure> {
    let mut embree = Embree::start(compare, dump, set.embree)?;
    let mut ours = TimedWalks::new(collision_shooting((set.build)(spec, IndexChoice::Auto)?)?);
    let mut rows = QUALITIES.map(|_| QualityRow::default());
    for _ in 0..rounds {
        // Jobs walk on and on; the time of 50 ms of walks depends on what ran before them.
        let walks = ours.rate(10 * RAYS as u64)?;
        for (row, quality) in rows.iter_mut().zip(QUALITIES) {
            row.round(walks, quality, &mut embree)?;
        }
    }
    Ok(rows)
}

/// The measurements against Embree's trees of one quality.
#[derive(Default)]
struct QualityRow {
    walks: Vec<f64>,
    modes: [Vec<f64>; MODES.len()],
    over_robust: Vec<f64>,
    over_fast: Vec<f64>,
    /// The faults "off lost" of each mode, equal in every round.
    faults: [String; MODES.len()],
}

impl QualityRow {
    /// Traces the rays in every mode.
    fn round(&mut self, walks: f64, quality: &str, embree: &mut Embree) -> Result<(), Failure> {
        let mut rates = [0.0; MODES.len()];
        for (mode, words) in MODES.iter().enumerate() {
            (rates[mode], self.faults[mode]) = embree.trace(&format!("{quality} {words}"))?;
            self.modes[mode].push(rates[mode]);
        }
        self.walks.push(walks);
        self.over_robust.push(walks / rates[0].max(rates[1]));
        self.over_fast.push(walks / rates[3].max(rates[4]));
        Ok(())
    }
}

impl std::fmt::Display for QualityRow {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mega = |rates: &[f64]| format!("{:.2}", median(rates) / 1e6);
        let modes: Vec<String> = self.modes.iter().map(|rates| mega(rates)).collect();
        write!(
            f,
            "{:>6} | {:>17} | {:>17} | {:>6.2} {:>6.2} | {:>11} | {:>11}",
            mega(&self.walks),
            modes[..3].join(" "),
            modes[3..].join(" "),
            median(&self.over_robust),
            median(&self.over_fast),
            self.faults[0],
            self.faults[3],
        )
    }
}

/// The other tracer, at work on one dump.
struct Embree {
    process: Child,
    orders: ChildStdin,
    answers: BufReader<ChildStdout>,
}

impl Embree {
    fn start(compare: &Path, dump: &Path, instructions: &str) -> Result<Self, Failure> {
        let mut command = Command::new(compare);
        command.arg(dump).arg(instructions).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut process = command.spawn()?;
        let orders = process.stdin.take().expect("it is piped");
        let answers = BufReader::new(process.stdout.take().expect("it is piped"));
        let mut embree = Embree { process, orders, answers };
        // The answer is the version and native widths; its trees are built by then.
        embree.answer()?;
        Ok(embree)
    }

    fn answer(&mut self) -> Result<String, Failure> {
        let mut line = String::new();
        if self.answers.read_line(&mut line)? == 0 {
            return Err("the other tracer went away".into());
        }
        Ok(line.trim().to_owned())
    }

    /// The rays per second in a mode, and its wrong hits: "off lost".
    fn trace(&mut self, mode: &str) -> Result<(f64, String), Failure> {
        writeln!(self.orders, "{mode}")?;
        let answer = self.answer()?;
        let (rate, faults) = answer.split_once(' ').ok_or("the other tracer answers nonsense")?;
        Ok((rate.parse()?, faults.to_owned()))
    }
}

impl Drop for Embree {
    fn drop(&mut self) {
        // The process only listens now, so a failure to stop it does no harm.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Writes triangles and rays for `compare.cpp`; returns the number of triangles.
fn write_dump(path: &Path, spec: &SceneSpec, scene: &Scene) -> Result<usize, Failure> {
    let triangles = triangles(spec, scene.origin());
    let corners = triangles.iter().flatten();
    let diagonal = (corners.clone().fold(DVec3::NEG_INFINITY, |m, c| m.max(*c))
        - corners.fold(DVec3::INFINITY, |m, c| m.min(*c)))
    .length();
    let mut file = BufWriter::new(File::create(path)?);
    file.write_all(&(triangles.len() as u32).to_le_bytes())?;
    file.write_all(&(RAYS as u32).to_le_bytes())?;
    // The offset is large enough to keep rays that 32 bits have moved from meeting the surface that they leave.
    write_floats(&mut file, [diagonal / 131_072.0])?;
    for corner in triangles.iter().flatten() {
        write_floats(&mut file, corner.to_array())?;
    }
    let sequence = Sequence::new(1);
    let emitters = Emitters::new(scene);
    let mut left = RAYS;
    for mut rng in sequence.walks_from(0) {
        walk(scene, &emitters, &mut rng, |ray, t| {
            if left > 0 {
                left -= 1;
                write_floats(&mut file, ray.origin.to_array())?;
                write_floats(&mut file, ray.direction.to_array())?;
                write_floats(&mut file, [t.unwrap_or(-1.0)])?;
            }
            Ok(())
        })?;
        if left == 0 {
            break;
        }
    }
    file.flush()?;
    Ok(triangles.len())
}

fn write_floats<const N: usize>(file: &mut impl Write, values: [f64; N]) -> std::io::Result<()> {
    values.iter().try_for_each(|&value| file.write_all(&(value as f32).to_le_bytes()))
}

/// The surfaces of a scene as triangles, relative to its origin as rays are.
fn triangles(spec: &SceneSpec, origin: DVec3) -> Vec<[DVec3; 3]> {
    let cut = |shape: &Shape| match *shape {
        Shape::Triangle { a, b, c, .. } => vec![[a, b, c]],
        Shape::Parallelogram { corner, corner_u, corner_v, .. }
        | Shape::Divided { corner, corner_u, corner_v, .. } => {
            let opposite = corner_u + corner_v - corner;
            vec![[corner, corner_u, opposite], [corner, opposite, corner_v]]
        }
    };
    let all = spec.surfaces.iter().flat_map(|surface| cut(&surface.shape));
    all.map(|corners| corners.map(|corner| corner - origin)).collect()
}
