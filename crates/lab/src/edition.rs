//! The pages that `radwalk-lab reproduce` makes: what is on them, and what they say of their origin.

use std::fmt::Display;
use std::num::NonZeroUsize;
use std::process::Command;
use std::time::Duration;

use report::words::duration;

use crate::lab::Lab;
use crate::papers::{self, Chapter};
use crate::validation;

/// A page and what is on it.
pub struct Edition {
    /// The title of the page.
    pub title: &'static str,
    /// The names of its files: a page for people, a table for programs.
    pub files: [&'static str; 2],
    /// The output folder unless another is chosen.
    pub folder: &'static str,
    /// The chapters, in their order.
    pub chapters: &'static [Chapter],
    /// The option that asks for it.
    option: &'static str,
}

/// The tables and figures of the papers.
pub const PAPERS: Edition = Edition {
    title: "The papers, reproduced",
    files: ["papers.md", "papers.json"],
    folder: "out/papers",
    chapters: &papers::CHAPTERS,
    option: "",
};

/// Configurations with closed forms.
pub const VALIDATION: Edition = Edition {
    title: "The scorecard: closed forms",
    files: ["validation.md", "validation.json"],
    folder: "out/validation",
    chapters: &validation::CHAPTERS,
    option: " --validation",
};

impl Edition {
    /// Which command of which version made the page, when, where, and how long it took.
    pub fn origin(&self, lab: &Lab, version: &str, today: impl Display, took: Duration) -> String {
        let quick = lab.pick(" --quick", "");
        format!(
            "Made by `radwalk-lab reproduce{}{quick}`, version {version}, on {today}, in {} on {} threads of: {}.",
            self.option,
            duration(took.as_secs_f64()),
            lab.threads,
            machine()
        )
    }
}

/// Where a page comes from: the commit of this build with its date, and the processor.
pub(crate) fn origin() -> String {
    let commit = env!("RADWALK_GIT");
    let known = commit.trim_end_matches("-dirty");
    let log = Command::new("git").args(["log", "-1", "--format=%cs", known]).output();
    let date = log.ok().filter(|log| log.status.success());
    let date =
        date.map_or(String::new(), |log| format!(" of {}", String::from_utf8_lossy(&log.stdout).trim()));
    format!("commit {commit}{date}, {}", machine())
}

/// The class of this machine, as far as it is known.
fn machine() -> String {
    let cores = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let known = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = known.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    let model = model.map_or(std::env::consts::ARCH, |(_, model)| model.trim());
    format!("{model}, {cores} cores, {}", std::env::consts::OS)
}
