//! Tests of the advice of a page of `radwalk compare`: the commands of the page are run, with seeds that the page has
//! not used. They must err as the page says, and take less time than the next method for the same error.
//!
//! `cargo test --release --test suite follow:: -- --ignored --nocapture` follows docs/results/compare.md, and writes
//! the outcome to the page's section "Followed". RADWALK_PAGE names another page.

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use crate::support::{columns, numbers};
use serde_json::Value;
use stats::Measured;

/// The seeds of runs; the page uses its jobs' own, and those 2⁴⁰ further on for references.
const SEEDS: std::ops::Range<u64> = 900_001..900_009;

/// The factor of a reference's paths over those of the runs, its fewest paths (errors are relative to it, and must not
/// be ruled by its own error), and its seed.
const LONGER: u64 = 4;
const FEWEST_PATHS: u64 = 1 << 26;
const REFERENCE_SEED: u64 = 800_001;

/// The most patches of a scene whose exact solution is quickly found.
const FEW_PATCHES: usize = 400;

/// The time by the page above which a command is not followed [s].
const PATIENCE: f64 = 10.0;

/// The part of the mean radiosity below which patches are left out of relative errors.
const DARK: f64 = 1e-3;

const SECTION: &str = "\n## Followed\n";

/// A command of the page, and the error that it is to reach.
#[derive(Clone)]
struct Command {
    /// The path of the job's file.
    job: String,
    /// A value of the option --set.
    set: String,
    paths: u64,
    /// The name of the method on the page.
    method: String,
    /// The rms relative error that the command is to reach [%].
    error: f64,
    /// The processor time that it is to take [s].
    seconds: f64,
    /// The largest relative standard error of a squared error that the page has for the method.
    doubt: f64,
    /// Whether this is the advised command, not the next best one.
    best: bool,
}

/// The part of a line between two words.
fn between<'a>(line: &'a str, before: &str, after: &str) -> Option<&'a str> {
    let (_, rest) = line.split_once(before)?;
    Some(rest.split_once(after)?.0)
}

/// Reads a number as pages write it: 0.0123 or 1.2·10^-4.
fn number(text: &str) -> f64 {
    text.replace("·10^", "e").parse().unwrap_or_else(|_| panic!("{text} is no number"))
}

/// All commands of a page, in its order.
fn commands(page: &Path) -> Vec<Command> {
    let rows: Vec<std::collections::HashMap<String, String>> =
        csv::Reader::from_path(page.with_file_name("compare").join("compare.csv"))
            .or_else(|_| csv::Reader::from_path(page.with_file_name("compare.csv")))
            .unwrap()
            .deserialize()
            .map(Result::unwrap)
            .collect();
    let doubt = |job: &str, method: &str| {
        let of_method = |row: &&std::collections::HashMap<String, String>| {
            row["method"] == method && job.ends_with(&format!("{}.toml", row["job"]))
        };
        let value = |row: &std::collections::HashMap<String, String>, name: &str| -> f64 {
            row[name].parse().unwrap()
        };
        rows.iter()
            .filter(of_method)
            .map(|row| value(row, "squared_error_error") / value(row, "squared_error"))
            .fold(0.0, f64::max)
    };
    let mut commands = Vec::new();
    let (mut method, mut best) = (String::new(), 0.0);
    for line in fs::read_to_string(page).unwrap().lines() {
        if line.starts_with("- For ") {
            method = between(line, "**", "**").unwrap().into();
        }
        if let Some(seconds) = between(line, " % in ", " s: ") {
            best = number(seconds);
        }
        let Some(job) = between(line, "`radwalk run ", " --set '") else { continue };
        let next = between(line, " % by ", ", next, ");
        let method = next.map_or_else(|| method.clone(), String::from);
        commands.push(Command {
            job: job.into(),
            set: between(line, "--set '", "' --paths ").unwrap().into(),
            paths: between(line, "' --paths ", "`").unwrap().parse().unwrap(),
            error: between(line, "  - ", " %").unwrap().parse().unwrap(),
            seconds: best * between(line, ", next, ", " times longer").map_or(1.0, number),
            doubt: doubt(job, &method),
            best: next.is_none(),
            method,
        });
    }
    assert!(!commands.is_empty(), "{} advises nothing", page.display());
    commands
}

/// B of every patch and channel, with its variance, and the patches' areas and whether they count.
struct Answer {
    radiosity: Vec<f64>,
    variance: Vec<f64>,
    area: Vec<f64>,
    counts: Vec<bool>,
}

/// Reads a table of patches; channels follow each other.
fn answer(folder: &Path) -> Answer {
    let table = columns(&folder.join("patches.csv"));
    let suffixes: &[&str] = if table.contains_key("radiosity") { &[""] } else { &["_r", "_g", "_b"] };
    let all = |name: &str| -> Vec<f64> {
        let of = |suffix: &&str| {
            let column = table.get(&format!("{name}{suffix}")).or_else(|| table.get(name)).unwrap();
            // Fields are empty if no walk could tell.
            column.iter().map(|number| number.parse().unwrap_or(f64::NAN)).collect::<Vec<f64>>()
        };
        suffixes.iter().flat_map(of).collect()
    };
    let [reflectance, emittance] = ["reflectance", "emittance"].map(all);
    let n = table["patch"].len();
    let emits = |i: usize| (0..suffixes.len()).any(|c| emittance[c * n + i] > 0.0);
    let [radiosity, errors] = ["radiosity", "std_error"].map(all);
    let known = |k: usize| radiosity[k].is_finite() && errors[k].is_finite();
    Answer {
        counts: (0..reflectance.len()).map(|k| reflectance[k] > 0.0 && !emits(k % n) && known(k)).collect(),
        variance: errors.iter().map(|error| error * error).collect(),
        area: all("area"),
        radiosity,
    }
}

impl Answer {
    /// The numbers of the values that are judged, as `compare` judges: those of reflecting patches that do not emit and
    /// are not dark.
    fn judged(&self, channels: usize) -> Vec<usize> {
        let n = self.radiosity.len() / channels;
        let mean = |c: usize| {
            let of = c * n..(c + 1) * n;
            let area: f64 = self.area[of.clone()].iter().sum();
            of.map(|k| self.area[k] * self.radiosity[k]).sum::<f64>() / area
        };
        let means: Vec<f64> = (0..channels).map(mean).collect();
        let bright = |k: &usize| self.counts[*k] && self.radiosity[*k] > DARK * means[k / n];
        (0..self.radiosity.len()).filter(bright).collect()
    }

    /// The mean squared relative error of another answer, by area.
    fn squared_error(&self, other: &Answer, judged: &[usize]) -> f64 {
        let total: f64 = judged.iter().map(|&k| self.area[k]).sum();
        let square = |k: usize| {
            let off = other.radiosity[k] - self.radiosity[k];
            (off * off - self.variance[k]) / self.radiosity[k].powi(2)
        };
        judged.iter().map(|&k| self.area[k] * square(k)).sum::<f64>() / total
    }
}

/// Runs a command of the program to its end, however long that takes.
fn radwalk(args: &[&str]) -> bool {
    crate::support::radwalk().args(args).stderr(std::process::Stdio::null()).status().unwrap().success()
}

/// Runs a job. Returns the folder of its results, and its summary.
fn shoot(folder: &Path, job: &str, set: &str, paths: u64, seed: u64) -> (PathBuf, Value) {
    let out = folder.join(format!("{seed}"));
    let (paths, seed) = (paths.to_string(), seed.to_string());
    let to = ["--quiet", "--force", "--out", out.to_str().unwrap(), "--workers", "1"];
    let what = ["run", job, "--set", set, "--paths", &paths, "--seed", &seed];
    assert!(radwalk(&[&what[..], &to[..]].concat()), "{job} with {set}");
    let summary = crate::support::summary(&out);
    (out, summary)
}

/// The reference of a command's job: exact if that is quick and known, else a longer run.
fn reference(folder: &Path, command: &Command) -> Answer {
    let is_biased = ["cutoff", "length"].iter().any(|end| command.set.contains(end));
    let set = if is_biased { "method={ estimator = \"infinite\" }" } else { &command.set };
    let shoot = |paths| answer(&shoot(folder, &command.job, set, paths, REFERENCE_SEED).0);
    let short = shoot(1 << 16);
    if !command.set.contains("continuous") && short.radiosity.len() <= FEW_PATCHES {
        let exact = folder.join("exact");
        assert!(radwalk(&["exact", &command.job, "--quiet", "--out", exact.to_str().unwrap()]));
        // A coloured scene has other tables.
        if exact.join("exact.csv").exists() {
            let radiosity = numbers(&columns(&exact.join("exact.csv"))["radiosity"]);
            return Answer { variance: vec![0.0; radiosity.len()], radiosity, ..short };
        }
    }
    shoot(FEWEST_PATHS.max(LONGER * command.paths))
}

/// The result of a command's runs.
struct Followed {
    squared_error: Measured,
    seconds: f64,
}

fn follow(folder: &Path, command: &Command, truth: &Answer) -> Followed {
    let channels = if columns(&folder.join(format!("{REFERENCE_SEED}/patches.csv"))).contains_key("radiosity")
    {
        1
    } else {
        3
    };
    let judged = truth.judged(channels);
    let (mut squares, mut seconds) = (Vec::new(), 0.0);
    for seed in SEEDS {
        let (out, summary) = shoot(folder, &command.job, &command.set, command.paths, seed);
        squares.push(truth.squared_error(&answer(&out), &judged));
        seconds += summary["cpu_seconds"].as_f64().unwrap();
    }
    let n = squares.len() as f64;
    let value = squares.iter().sum::<f64>() / n;
    let variance = squares.iter().map(|x| (x - value).powi(2)).sum::<f64>() / (n - 1.0);
    Followed {
        squared_error: Measured { value, standard_error: (variance / n).sqrt() },
        seconds: seconds / n,
    }
}

/// The most standard errors of both, page and runs, by which squared errors may differ: Student's t of 7 degrees of
/// freedom exceeds this once in 2,000 times, and a page has some 16 commands.
const LIMIT: f64 = 6.0;

#[test]
#[ignore = "minutes, of a release build"]
fn the_advice_holds_when_it_is_followed() {
    let page = PathBuf::from(std::env::var("RADWALK_PAGE").unwrap_or("docs/results/compare.md".into()));
    let commands = commands(&page);
    let mut section = format!(
        "{SECTION}\nCommands of this page that take up to {PATIENCE} s, run with {} seeds that it had not used (`cargo test \
         --release --test suite follow:: -- --ignored`), against the exact solution or a run {LONGER} times longer or more; ± is a \
         standard error over them.\n\n| job | method | promised | error | promised | s |\n|---|---|---|---|---|---|\n",
        SEEDS.count()
    );
    let mut faults = Vec::new();
    let mut best: Option<(Command, Followed)> = None;
    for command in commands.iter().cloned() {
        if !Path::new(&command.job).exists() || command.seconds > PATIENCE {
            eprintln!("not followed: {} by {}, {} %", command.job, command.method, command.error);
            continue;
        }
        let folder = tempfile::tempdir().unwrap();
        let truth = reference(folder.path(), &command);
        let followed = follow(folder.path(), &command, &truth);
        let Measured { value, standard_error } = followed.squared_error;
        let rms = 100.0 * value.sqrt();
        writeln!(
            section,
            "| {} | {}{} | {} % | {rms:.3} ± {:.3} % | {:.2e} s | {:.2e} |",
            command.job,
            if command.best { "" } else { "next: " },
            command.method,
            command.error,
            50.0 * standard_error / value.sqrt(),
            command.seconds,
            followed.seconds
        )
        .unwrap();
        eprintln!("{}", section.lines().last().unwrap());
        let promised = (command.error / 100.0).powi(2);
        let doubt = (command.doubt * promised).hypot(standard_error);
        // Chains have a shortest run, which may do better than was asked for.
        if value - promised > LIMIT * doubt {
            faults.push(format!(
                "{} of {} errs by {rms} %, not {} %",
                command.method, command.job, command.error
            ));
        }
        if command.best {
            best = Some((command, followed));
        } else if let Some((advised, taken)) = &best
            && (&advised.job, advised.error) == (&command.job, command.error)
            && taken.seconds * taken.squared_error.value > followed.seconds * value
        {
            faults.push(format!("{} is better than {} in {}", command.method, advised.method, command.job));
        }
    }
    let text = fs::read_to_string(&page).unwrap();
    let before = text.split(SECTION).next().unwrap();
    fs::write(&page, format!("{before}{section}")).unwrap();
    assert!(faults.is_empty(), "{}", faults.join("; "));
}
