//! All findings on one page of Markdown.

use std::fmt::Write;

use stats::Measured;

use super::findings::{Claim, Findings, Judge, Row, Verdict};

/// The probability that chance alone makes any row of a page differ.
pub const FALSE_ALARM: f64 = 1e-3;

/// A chapter's title with its findings.
pub type Entry<'a> = (&'a str, &'a Findings);

/// What judges all rows of a page together.
pub fn judge<'a>(chapters: impl IntoIterator<Item = &'a Findings>) -> Judge {
    let rows = chapters.into_iter().flat_map(|findings| &findings.rows);
    Judge::new(FALSE_ALARM, rows.filter(|row| row.is_judged()).count())
}

/// The page; `how` says which command made it, when and where.
pub fn write(how: &str, chapters: &[Entry<'_>]) -> String {
    let judge = judge(chapters.iter().map(|(_, findings)| *findings));
    let verdicts = || chapters.iter().flat_map(|(_, f)| &f.rows).map(|row| judge.verdict(row));
    let count = |verdict: Verdict| verdicts().filter(|&v| v == verdict).count();
    let mut page = String::new();
    let text = &mut page;
    add(text, "# The papers, reproduced\n");
    add(text, how);
    add(
        text,
        &format!(
            "\nOf {} rows that are held to a claim {} agree and {} differ; {} more are shown without one. *Ours* is \
             followed by its standard error. A row agrees if it lies within {:.2} standard errors of its claim: with \
             that limit chance alone makes *any* of the rows differ once in {:.0} such pages (Šidák's bound; Student's \
             t of 99 degrees of freedom). Seeds are fixed, so that the page is the same whenever it is made.\n",
            count(Verdict::Agrees) + count(Verdict::Differs),
            count(Verdict::Agrees),
            count(Verdict::Differs),
            count(Verdict::Shown),
            judge.limit,
            1.0 / FALSE_ALARM
        ),
    );
    for (title, findings) in chapters {
        chapter(text, title, findings, judge);
    }
    page
}

fn add(page: &mut String, line: &str) {
    writeln!(page, "{line}").expect("strings take all");
}

fn chapter(page: &mut String, title: &str, findings: &Findings, judge: Judge) {
    add(page, &format!("## {title}\n"));
    add(page, &format!("*Published*: {}\n", findings.published));
    add(page, &format!("*Here*: {}\n", findings.experiment));
    if !findings.rows.is_empty() {
        add(page, "| | ours | theirs | theory | z or ratio | |\n|---|---|---|---|---|---|");
        findings.rows.iter().for_each(|row| add(page, &format!("| {} |", cells(row, judge).join(" | "))));
        add(page, "");
    }
    findings.remarks.iter().for_each(|remark| add(page, &format!("{remark}\n")));
    for figure in &findings.figures {
        add(page, &format!("![{}]({})\n", figure.caption, figure.file));
    }
}

/// A row as the cells of a table: label, ours, theirs, theory, z or ratio, verdict.
pub fn cells(row: &Row, judge: Judge) -> [String; 6] {
    let theory = match row.claim {
        Claim::Is(x) => number(x),
        Claim::About(x) => format!("≈ {}", number(x)),
        Claim::AtMost(x) => format!("≤ {}", number(x)),
        Claim::AtLeast(x) => format!("≥ {}", number(x)),
        Claim::Between(low, high) => format!("{} … {}", number(low), number(high)),
        Claim::Nothing => "–".into(),
    };
    let comparison = match (row.z(), row.ratio()) {
        (Some(z), _) => format!("z = {z:+.1}"),
        (None, Some(ratio)) => format!("× {}", number(ratio)),
        _ => "–".into(),
    };
    let verdict = match judge.verdict(row) {
        Verdict::Agrees => "agrees",
        Verdict::Differs => "**differs**",
        Verdict::Shown => "shown",
    };
    let published = row.published.map_or("–".into(), printed);
    [row.label.clone(), measured(row.ours), published, theory, comparison, verdict.into()]
}

/// A number to four digits.
pub fn number(x: f64) -> String {
    if x == 0.0 { "0".into() } else { to_digit(x, x.abs().log10().floor() as i32 - 3) }
}

/// A number as it was printed, or to four digits where it is longer.
fn printed(x: f64) -> String {
    let whole = x.to_string();
    if whole.len() <= 7 { whole } else { number(x) }
}

/// A number as far as its error, of which two digits, leaves it.
pub fn measured(Measured { value, standard_error }: Measured) -> String {
    if standard_error == 0.0 || !standard_error.is_finite() {
        return number(value);
    }
    let last = standard_error.log10().floor() as i32 - 1;
    format!("{} ± {}", to_digit(value, last), to_digit(standard_error, last))
}

/// A number down to the digit worth 10^`last`.
fn to_digit(x: f64, last: i32) -> String {
    if x == 0.0 || !x.is_finite() {
        return format!("{x}");
    }
    if x.abs() >= 1e6 || x.abs() < 1e-4 {
        let digits = (x.abs().log10().floor() as i32 - last).clamp(0, 6) as usize;
        return format!("{x:.digits$e}");
    }
    let digits = (-last).clamp(0, 8) as usize;
    format!("{x:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_end_where_their_errors_begin() {
        let of = |value, standard_error| measured(Measured { value, standard_error });
        assert_eq!(of(1.23456, 0.0123), "1.235 ± 0.012");
        assert_eq!(of(1234.5678, 12.0), "1235 ± 12");
        assert_eq!(of(0.5, 0.0), "0.5000");
        assert_eq!(number(0.049_154), "0.04915");
        assert_eq!(number(12_345_678.0), "1.235e7");
        assert_eq!(number(0.0), "0");
    }
}
