//! The text of a file: its lines, the numbers in them, and what may be wrong.

use std::str::FromStr;

use thiserror::Error;

/// The rule that a file breaks: line, problem, reason, remedy.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("{line}: {problem}")]
pub struct Malformed {
    /// The line, from 1.
    pub line: usize,
    /// Problem, reason and remedy.
    pub problem: String,
}

pub(crate) fn at(line: usize, problem: impl Into<String>) -> Malformed {
    Malformed { line, problem: problem.into() }
}

/// The text of UTF-8 or else Latin-1.
pub(crate) fn decode(bytes: &[u8]) -> String {
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    match std::str::from_utf8(bytes) {
        Ok(text) => text.into(),
        Err(_) => bytes.iter().map(|&byte| char::from(byte)).collect(),
    }
}

/// The lines of a text, whatever ends them; at least one. DOS's end of file (26) ends the text.
pub(crate) fn lines(text: &str) -> Vec<&str> {
    let text = text.split('\u{1A}').next().unwrap_or_default();
    // A file of old Macintoshes has no line feeds.
    let end = if text.contains('\n') { '\n' } else { '\r' };
    text.split(end).map(|line| line.trim_end_matches('\r')).collect()
}

/// A piece of text for a message, cut where it is long.
pub(crate) fn quoted(word: &str) -> String {
    let short: String = word.chars().take(24).flat_map(char::escape_debug).collect();
    if word.chars().count() > 24 { format!("\"{short}…\"") } else { format!("\"{short}\"") }
}

/// A finite number.
pub(crate) fn number(word: &str, line: usize, what: &str) -> Result<f64, Malformed> {
    let value = f64::from_str(word).ok().filter(|value| value.is_finite() && value.abs() <= 1e12);
    value.ok_or_else(|| {
        at(
            line,
            format!(
                "{} stands where {what} is expected (a number is needed there); correct it",
                quoted(word)
            ),
        )
    })
}

/// A whole number in a range.
pub(crate) fn whole(value: f64, line: usize, what: &str, range: [usize; 2]) -> Result<usize, Malformed> {
    let [least, most] = range;
    if value.fract() == 0.0 && value >= least as f64 && value <= most as f64 {
        Ok(value as usize)
    } else {
        Err(at(
            line,
            format!("{what} is {value} (a whole number from {least} to {most} is needed); correct it"),
        ))
    }
}

/// Refuses angles that do not ascend, or leave a range.
pub(crate) fn ascending(
    angles: &[f64],
    line: usize,
    what: &str,
    [least, most]: [f64; 2],
) -> Result<(), Malformed> {
    if let Some(pair) = angles.windows(2).find(|pair| pair[0] >= pair[1]) {
        let [a, b] = [pair[0], pair[1]];
        return Err(at(
            line,
            format!("{what} {b}° follows {a}° (angles ascend); put planes and angles in order"),
        ));
    }
    match angles.iter().find(|angle| !(least..=most).contains(*angle)) {
        Some(angle) => Err(at(
            line,
            format!("{what} {angle}° is outside {least}–{most}° (there is no such direction); correct it"),
        )),
        None => Ok(()),
    }
}
