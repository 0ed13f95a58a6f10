//! The page of the atlas, in Markdown and as JSON.

use serde_json::{Value, json};

use super::entry::{Entry, StudyFinding};
use crate::claim::ClaimJudge;
use report::Markdown;

/// The folder of the page's charts, beside the page.
pub const CHARTS: &str = "atlas";

/// Writes the page of the findings of `command` on `date`.
pub fn write(command: &str, date: &str, findings: &[(&Entry, StudyFinding)]) -> String {
    let mut page = Markdown::default();
    page.heading(1, "An atlas of failure");
    page.paragraph(format!(
        "Small scenes that drive each method to where it fails: what theory predicts, what is seen, what the program \
         says of it, and what to do instead. Written by `{command}` on {date}, all seeds fixed; ± is a standard error. \
         Papers: S97 = Sbert 1997, SInf = its infinite-path sequel, BS = Bekaert & Seidel, Sh91 = Shirley 1991. A claim \
         fails by chance alone with the probability given, once and for all with these seeds (“sure”: chance has no \
         part in it)."
    ));
    for (entry, finding) in findings {
        let failed = finding.failed().count();
        let mark = if failed == 0 { String::new() } else { format!(" **({failed} claims fail)**") };
        page.line(format!("- [{}](#{}){mark}", entry.title, entry.name));
    }
    findings.iter().for_each(|(entry, finding)| chapter(&mut page, entry, finding));
    page.text()
}

fn chapter(page: &mut Markdown, entry: &Entry, finding: &StudyFinding) {
    let StudyFinding { predicted, seen, messages, instead, claims, chart } = finding;
    page.line("");
    page.line(format!("<a id=\"{}\"></a>", entry.name));
    page.heading(2, entry.title);
    page.paragraph(format!("**Theory.** {predicted} **Seen.** {seen} **Instead.** {instead}"));
    page.paragraph("The program says:");
    messages.iter().for_each(|line| page.paragraph(format!("> {line}")));
    page.drawing(&chart.title, &format!("{CHARTS}/{}.svg", entry.name));
    for claim in claims {
        let verdict = if ClaimJudge::EACH.passes(claim) { "holds" } else { "**FAILS**" };
        let chance = match ClaimJudge::EACH.false_alarm(claim) {
            0.0 => "sure".into(),
            probability => format!("{probability:.0e}"),
        };
        let instead = if claim.remedy { "**instead**, " } else { "" };
        page.line(format!("- {verdict} ({chance}): {instead}{}", claim.sentence()));
    }
}

/// All entries with their claims, as JSON.
pub fn table(findings: &[(&Entry, StudyFinding)]) -> Value {
    let entry = |(entry, finding): &(&Entry, StudyFinding)| {
        let claims = finding.claims.iter().map(|claim| {
            json!({
                "what": claim.sentence(),
                "holds": ClaimJudge::EACH.passes(claim),
                "false_alarm": ClaimJudge::EACH.false_alarm(claim),
                "remedy": claim.remedy,
            })
        });
        json!({
            "name": entry.name,
            "title": entry.title,
            "holds": finding.holds(),
            "predicted": finding.predicted,
            "seen": finding.seen,
            "told": finding.messages,
            "instead": finding.instead,
            "claims": claims.collect::<Vec<_>>(),
        })
    };
    findings.iter().map(entry).collect()
}
