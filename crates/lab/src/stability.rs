//! `radwalk-lab stability`: the atlas of failure.

use report::OutputFolder;
use serde_json::json;
use voice::{Phase, emit, say};

use crate::args::StabilityArgs;
use crate::atlas::page::{self, CHARTS};
use crate::atlas::{ALL, Entry, StudyFinding};
use crate::clock::today;
use crate::fault::LabFault;
use crate::lab::{Lab, StudyScale};

const PAGE: &str = "atlas.md";
const NUMBERS: &str = "atlas.json";

/// Studies the entries asked for and writes their page, charts and claims.
pub(crate) fn stability(args: &StabilityArgs) -> Result<(), LabFault> {
    let entries = chosen(&args.only)?;
    let path = args.out.out.clone().unwrap_or_else(|| "out/stability".into());
    let folder = OutputFolder::claim(&path, &[PAGE, NUMBERS], args.out.force)?;
    let charts = OutputFolder::claim(&path.join(CHARTS), &[], args.out.force)?;
    let lab = Lab::new(if args.quick { StudyScale::Quick } else { StudyScale::Full }, None);
    let mut findings = Vec::new();
    for entry in entries {
        let phase = Phase::begin(entry.title);
        let finding = (entry.study)(&lab).map_err(|source| LabFault::Entry { entry: entry.name, source })?;
        drop(phase);
        let svg = finding.chart.svg();
        charts
            .write(&format!("{}.svg", entry.name), |file| std::io::Write::write_all(file, svg.as_bytes()))?;
        announce(args, entry, &finding);
        findings.push((entry, finding));
    }
    let text = page::write(&command(args), &today().to_string(), &findings);
    folder.write(PAGE, |file| std::io::Write::write_all(file, text.as_bytes()))?;
    folder.write(NUMBERS, |file| Ok(serde_json::to_writer_pretty(file, &page::table(&findings))?))?;
    if !args.out.quiet {
        say(&format!("written to {}", folder.file(PAGE).display()));
    }
    let failed: Vec<_> = findings.iter().filter(|(_, f)| !f.holds()).map(|(entry, _)| entry.name).collect();
    if failed.is_empty() {
        Ok(())
    } else {
        Err(LabFault::Unfounded { entries: failed, page: folder.file(PAGE) })
    }
}

fn chosen(names: &[String]) -> Result<Vec<&'static Entry>, LabFault> {
    let known = || ALL.iter().map(|entry| entry.name).collect::<Vec<_>>().join(", ");
    let named = |name: &String| {
        let entry = ALL.iter().find(|entry| entry.name == name);
        entry.ok_or_else(|| LabFault::NoEntry { name: name.clone(), known: known() })
    };
    if names.is_empty() { Ok(ALL.iter().collect()) } else { names.iter().map(named).collect() }
}

/// What was typed, as far as it enters the answer.
fn command(args: &StabilityArgs) -> String {
    let only = args.only.iter().map(|name| format!(" --only {name}"));
    let quick = if args.quick { " --quick" } else { "" };
    format!("radwalk-lab stability{quick}{}", only.collect::<String>())
}

fn announce(args: &StabilityArgs, entry: &Entry, finding: &StudyFinding) {
    if args.out.json {
        emit(&json!({"event": "entry", "name": entry.name, "holds": finding.holds()}));
    } else if !args.out.quiet {
        let verdict = if finding.holds() { "holds" } else { "FAILS" };
        say(&format!("{verdict}  {}: {}", entry.name, entry.title));
        for claim in finding.failed() {
            say(&format!("       does not hold: {}", claim.sentence()));
        }
    }
}
