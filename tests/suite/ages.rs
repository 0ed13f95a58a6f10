//! How old the pages of results are.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::Command;

/// A line of `scripts/results.tsv`.
struct ResultsPage<'a> {
    name: &'a str,
    /// The folders that it speaks of.
    subjects: Vec<&'a str>,
    command: &'a str,
}

fn pages(table: &str) -> Vec<ResultsPage<'_>> {
    let lines = table.lines().filter(|line| !line.starts_with('#') && !line.is_empty());
    let page = |line| {
        let columns: Vec<&str> = str::split(line, '\t').collect();
        let [name, subjects, command] = columns[..] else { panic!("three columns: {line}") };
        ResultsPage { name, subjects: subjects.split(' ').collect(), command }
    };
    lines.map(page).collect()
}

/// The time of the latest commit that changed something below these paths, in seconds; `None` where there is no history.
fn changed(root: &Path, paths: &[&str]) -> Option<u64> {
    let mut log = Command::new("git");
    log.arg("-C").arg(root).args(["log", "-1", "--format=%ct", "--"]).args(paths);
    let done = log.output().ok().filter(|done| done.status.success())?;
    String::from_utf8(done.stdout).ok()?.trim().parse().ok()
}

/// Every page says what it speaks of, in folders that are there, and pages that commands make name their command. Prints which pages are older
/// than that: `cargo test --test suite ages:: -- --nocapture`.
#[test]
fn pages_of_results_know_what_they_speak_of() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let table = fs::read_to_string(root.join("scripts/results.tsv")).unwrap();
    let pages = pages(&table);
    let listed: BTreeSet<String> = pages.iter().map(|page| page.name.to_owned()).collect();
    let there = fs::read_dir(root.join("docs/results")).unwrap();
    let there = there.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let there: BTreeSet<String> = there.filter(|name| name.ends_with(".md")).collect();
    assert_eq!(listed, there, "scripts/results.tsv lists the pages of docs/results");
    for ResultsPage { name, subjects, command } in &pages {
        for subject in subjects {
            assert!(root.join(subject).exists(), "{name} speaks of {subject}, which is not there");
        }
        let text = fs::read_to_string(root.join("docs/results").join(name)).unwrap();
        let study = command.strip_prefix("$LAB ").map(|rest| rest.split(' ').next().unwrap_or_default());
        if let Some(study) = study {
            assert!(text.contains(&format!("`radwalk-lab {study}")), "{name} names its command");
        }
        let made = changed(root, &[&format!("docs/results/{name}")]);
        let since = changed(root, subjects);
        if let (Some(made), Some(since)) = (made, since) {
            let days = since.saturating_sub(made) as f64 / 86_400.0;
            let age =
                if since > made { format!("{days:.1} days older than") } else { "no older than".into() };
            println!("{name} is {age} {}", subjects.join(", "));
        }
    }
}
