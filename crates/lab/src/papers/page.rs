//! All findings of the papers on one page, and as JSON.

use serde_json::{Value, json};

use super::findings::Findings;
use crate::claim::{Claim, ClaimBound, ClaimJudge, ClaimVerdict};
use report::Markdown;
use report::words::{measured, number, printed};

/// The probability that chance alone makes any row of a page differ.
pub const FALSE_ALARM: f64 = 1e-3;

/// The fewest runs behind a row's standard error (unless theory gives it).
const FEWEST_RUNS: usize = 100;

/// A chapter's name and title with its findings.
pub type ChapterFindings<'a> = (&'a str, &'a str, &'a Findings);

/// The judge of all rows of a page together.
pub fn judge<'a>(chapters: impl IntoIterator<Item = &'a Findings>) -> ClaimJudge {
    let rows = chapters.into_iter().flat_map(|findings| &findings.rows);
    ClaimJudge::of_all(FALSE_ALARM, rows.filter(|row| row.is_judged()).count(), FEWEST_RUNS)
}

/// Writes the page with a title; `how` says which command made it, when and where.
pub fn write((title, how): (&str, &str), chapters: &[ChapterFindings<'_>], judge: ClaimJudge) -> String {
    let verdicts = || chapters.iter().flat_map(|(.., f)| &f.rows).map(|row| judge.verdict(row));
    let count = |verdict: ClaimVerdict| verdicts().filter(|&v| v == verdict).count();
    let mut page = Markdown::default();
    page.heading(1, title);
    page.paragraph(how);
    page.paragraph(format!(
        "Of {} rows that are held to a claim {} agree and {} differ; {} more are shown without one. *Ours* is \
         followed by its standard error. A row agrees if it lies within {:.2} standard errors of its claim: with \
         that limit chance alone makes *any* of the rows differ once in {:.0} such pages (Šidák's bound; Student's \
         t of 99 degrees of freedom). Seeds are fixed, so that the page is the same whenever it is made.",
        count(ClaimVerdict::Agrees) + count(ClaimVerdict::Differs),
        count(ClaimVerdict::Agrees),
        count(ClaimVerdict::Differs),
        count(ClaimVerdict::Shown),
        judge.limit,
        1.0 / FALSE_ALARM
    ));
    for (_, title, findings) in chapters {
        chapter(&mut page, title, findings, judge);
    }
    page.text()
}

fn chapter(page: &mut Markdown, title: &str, findings: &Findings, judge: ClaimJudge) {
    page.heading(2, title);
    page.paragraph(format!("*Published*: {}", findings.published));
    page.paragraph(format!("*Here*: {}", findings.experiment));
    if !findings.rows.is_empty() {
        page.table(HEADS, findings.rows.iter().map(|row| cells(row, judge)));
    }
    findings.remarks.iter().for_each(|remark| page.paragraph(remark));
    findings.figures.iter().for_each(|figure| page.drawing(&figure.caption, &figure.file));
}

/// The headings of the columns of [`cells`].
const HEADS: [&str; 6] = ["", "ours", "theirs", "theory", "z or ratio", ""];

/// The rows of a chapter as the lines of a table for a terminal.
pub fn lines(findings: &Findings, judge: ClaimJudge) -> Vec<String> {
    let rows = findings.rows.iter().map(|row| cells(row, judge));
    let rows: Vec<[String; 6]> = std::iter::once(HEADS.map(String::from)).chain(rows).collect();
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: [usize; 6] = std::array::from_fn(width);
    let line = |row: &[String; 6]| {
        let cells = row.iter().zip(widths).map(|(cell, width)| format!("{cell:width$}"));
        format!("  {}", cells.collect::<Vec<_>>().join("  ")).trim_end().to_owned()
    };
    rows.iter().map(line).collect()
}

/// A row as the cells of a table: label, ours, theirs, theory, z or ratio, verdict.
fn cells(row: &Claim, judge: ClaimJudge) -> [String; 6] {
    let theory = match row.bound() {
        ClaimBound::Is(x) => number(x),
        ClaimBound::About(x) => format!("≈ {}", number(x)),
        ClaimBound::AtMost(x) => format!("≤ {}", number(x)),
        ClaimBound::ClearlyBelow(x) => format!("< {}", number(x)),
        ClaimBound::AtLeast(x) => format!("≥ {}", number(x)),
        ClaimBound::Between(low, high) => format!("{} … {}", number(low), number(high)),
        ClaimBound::Nothing => "–".into(),
    };
    let comparison = match (row.z(), row.ratio()) {
        (Some(z), _) => format!("z = {z:+.1}"),
        (None, Some(ratio)) => format!("× {}", number(ratio)),
        _ => "–".into(),
    };
    let verdict = match judge.verdict(row) {
        ClaimVerdict::Differs => "**differs**",
        verdict => word(verdict),
    };
    let published = row.published.map_or("–".into(), printed);
    let ours = row.ours().map_or("–".into(), measured);
    [row.label.clone(), ours, published, theory, comparison, verdict.into()]
}

fn word(verdict: ClaimVerdict) -> &'static str {
    match verdict {
        ClaimVerdict::Agrees => "agrees",
        ClaimVerdict::Differs => "differs",
        ClaimVerdict::Shown => "shown",
    }
}

/// All rows with their verdicts, as JSON.
pub fn table(chapters: &[ChapterFindings<'_>], judge: ClaimJudge) -> Value {
    let row = |row: &Claim| {
        json!({
            "label": row.label,
            "ours": row.ours().map(|ours| ours.value),
            "standard_error": row.ours().map(|ours| ours.standard_error),
            "published": row.published,
            "claim": format!("{:?}", row.bound()),
            "z": row.z(),
            "ratio": row.ratio(),
            "verdict": word(judge.verdict(row)),
        })
    };
    let chapters = chapters.iter().map(|(name, title, findings)| {
        let rows: Vec<Value> = findings.rows.iter().map(row).collect();
        json!({"name": name, "title": title, "rows": rows})
    });
    json!({"limit": judge.limit, "false_alarm": FALSE_ALARM, "chapters": chapters.collect::<Vec<_>>()})
}
