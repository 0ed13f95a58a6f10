//! What a misspelt word was probably meant to be.

use crate::keys::{JOB_KEYS, TABLES};

/// Words less similar than this (Jaro and Winkler's measure) are not taken for one another.
const SIMILAR: f64 = 0.82;

/// `did you mean "X"; `, or nothing where no known word is near.
pub(crate) fn hint<'a>(found: &str, known: impl Iterator<Item = &'a str>) -> String {
    nearest(found, known).map_or(String::new(), |near| format!("did you mean {near:?}? "))
}

/// The known word that is most similar to what was found.
fn nearest<'a>(found: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let lower = found.to_lowercase();
    let similarity = |word: &str| strsim::jaro_winkler(&lower, &word.to_lowercase());
    let rated = known.map(|word| (similarity(word), word)).filter(|(similarity, _)| *similarity >= SIMILAR);
    rated.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, word)| word)
}

/// What a key that is not known in a table was probably meant to be: a near miss, a key of another table of jobs, or a key
/// of another kind of file.
pub(crate) fn key_hint(prefix: &str, key: &str, known: &'static [&'static str]) -> String {
    if let Some(near) = nearest(key, known.iter().copied()) {
        return format!("did you mean `{prefix}{near}`? ");
    }
    if known == JOB_KEYS || TABLES.iter().any(|(_, keys)| known == *keys) {
        let home = [("", JOB_KEYS)].into_iter().chain(TABLES).find(|(_, keys)| keys.contains(&key));
        return home.map_or(String::new(), |(table, _)| format!("did you mean `{table}{key}`? "));
    }
    if prefix.is_empty() && JOB_KEYS.contains(&key) {
        return "this is a scene, and the key is one of jobs; ".into();
    }
    String::new()
}
