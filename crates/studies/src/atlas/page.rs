//! The atlas as a page.

use std::fmt::Write;

use super::entry::{Claim, Entry, Finding};

/// Where the charts of the page are, beside it.
pub const CHARTS: &str = "atlas";

/// The page: what `command` found on `date`.
pub fn page(command: &str, date: &str, findings: &[(&Entry, Finding)]) -> String {
    let mut page = String::from("# An atlas of failure\n\n");
    let _ = writeln!(
        page,
        "Small scenes that drive each method to where it fails: what theory predicts, what is seen, what the program \
         says of it, and what to do instead. Written by `{command}` on {date}, all seeds fixed; ± is a standard error. \
         Papers: S97 = Sbert 1997, SInf = its infinite-path sequel, BS = Bekaert & Seidel, Sh91 = Shirley 1991. A claim \
         fails by chance alone with the probability given, once and for all with these seeds (“sure”: chance has no \
         part in it).\n"
    );
    for (entry, finding) in findings {
        let failed = finding.claims.iter().filter(|claim| !claim.holds).count();
        let mark = if failed == 0 { String::new() } else { format!(" **({failed} claims fail)**") };
        let _ = writeln!(page, "- [{}](#{}){mark}", entry.title, entry.name);
    }
    for (entry, finding) in findings {
        write_entry(&mut page, entry, finding);
    }
    page
}

fn write_entry(page: &mut String, entry: &Entry, finding: &Finding) {
    let Finding { predicted, seen, told, instead, claims, chart } = finding;
    let _ = writeln!(page, "\n<a id=\"{}\"></a>\n## {}\n", entry.name, entry.title);
    let _ = writeln!(page, "**Theory.** {predicted} **Seen.** {seen} **Instead.** {instead}\n");
    let _ = writeln!(page, "The program says:\n");
    for line in told {
        let _ = writeln!(page, "> {line}\n");
    }
    let _ = writeln!(page, "![{}]({CHARTS}/{}.svg)\n", chart.title, entry.name);
    for Claim { what, holds, false_alarm, remedy } in claims {
        let verdict = if *holds { "holds" } else { "**FAILS**" };
        let chance = if *false_alarm == 0.0 { "sure".into() } else { format!("{false_alarm:.0e}") };
        let instead = if *remedy { "**instead**, " } else { "" };
        let _ = writeln!(page, "- {verdict} ({chance}): {instead}{what}");
    }
}
