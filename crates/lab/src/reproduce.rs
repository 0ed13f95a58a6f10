//! `radwalk-lab reproduce`: the papers' tables and figures, measured again.

use std::io::Write;
use std::path::PathBuf;
use std::time::Instant;

use report::OutputFolder;
use serde_json::json;
use tracing::info;
use voice::{Phase, emit, say};

use crate::args::ReproduceArgs;
use crate::claim::ClaimVerdict;
use crate::clock::today;
use crate::edition::{PAPERS, VALIDATION};
use crate::fault::LabFault;
use crate::lab::{Lab, StudyScale};
use crate::papers::{Chapter, Findings, page};

/// Runs every chapter; writes the page, its figures and the rows as JSON. Rows that differ are a fault.
pub(crate) fn reproduce(args: &ReproduceArgs) -> Result<(), LabFault> {
    let effort = if args.quick { StudyScale::Quick } else { StudyScale::Full };
    let lab = Lab::new(effort, args.threads.map(|threads| threads as usize));
    let edition = if args.validation { &VALIDATION } else { &PAPERS };
    let [people, programs] = edition.files;
    let path = args.out.out.clone().unwrap_or_else(|| PathBuf::from(edition.folder));
    let folder = OutputFolder::claim(&path, &edition.files, args.out.force)?;
    let began = Instant::now();
    let done: Vec<(&Chapter, Findings)> =
        edition.chapters.iter().map(|chapter| (chapter, run(args, chapter, &lab))).collect();
    let judge = page::judge(done.iter().map(|(_, findings)| findings));
    for (chapter, findings) in &done {
        findings.figures.iter().try_for_each(|f| folder.write(&f.file, |file| file.write_all(&f.content)))?;
        if !args.out.quiet {
            say(&format!("\n{}", chapter.title));
            page::lines(findings, judge).iter().for_each(|line| say(line));
        }
    }
    let entries: Vec<page::ChapterFindings<'_>> =
        done.iter().map(|(c, findings)| (c.name, c.title, findings)).collect();
    let origin = edition.origin(&lab, env!("CARGO_PKG_VERSION"), today(), began.elapsed());
    let table = page::table(&entries, judge);
    folder.write(programs, |file| Ok(serde_json::to_writer_pretty(file, &table)?))?;
    let text = page::write((edition.title, &origin), &entries, judge);
    folder.write(people, |file| file.write_all(text.as_bytes()))?;
    if !args.out.quiet {
        say(&format!("written to {}", folder.file(people).display()));
    }
    let differ =
        done.iter().flat_map(|(_, f)| &f.rows).filter(|row| judge.verdict(row) == ClaimVerdict::Differs);
    match differ.map(|row| row.label.clone()).collect::<Vec<_>>() {
        rows if rows.is_empty() => Ok(()),
        rows => Err(LabFault::NotReproduced { page: folder.file(people), rows }),
    }
}

/// One chapter, with a word before and after.
fn run(args: &ReproduceArgs, chapter: &Chapter, lab: &Lab) -> Findings {
    let began = Instant::now();
    if args.out.json {
        emit(&json!({"event": "chapter", "name": chapter.name}));
    } else if !args.out.quiet {
        info!("{} …", chapter.title);
    }
    let phase = Phase::begin(chapter.title);
    let findings = (chapter.run)(lab);
    drop(phase);
    if args.out.json {
        let seconds = began.elapsed().as_secs_f64();
        emit(&json!({"event": "chapter done", "name": chapter.name, "seconds": seconds}));
    }
    findings
}
