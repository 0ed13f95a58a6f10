//! `radwalk help`: the help of a command, and the words that the program uses.

use clap::{CommandFactory, Parser};
use voice::say;

use crate::args::{Cli, HelpArgs};
use crate::fault::{Fault, Outcome};

/// The entries that are printed: a heading each, and paragraphs.
const GLOSSARY: &str = include_str!("../../docs/reference/glossary.md");

/// Prints the help of the whole program, of a command, or the entry of a word.
pub(crate) fn help(args: &HelpArgs) -> Result<Outcome, Fault> {
    let word = args.word.join(" ").to_lowercase();
    if word.is_empty() {
        say(Cli::command().render_help().to_string().trim_end());
        say(&format!("\nWords: {} (radwalk help WORD)", words().collect::<Vec<_>>().join(", ")));
        return Ok(Outcome::Done);
    }
    let is_command = Cli::command().find_subcommand(&word).is_some();
    let entry = entries().find(|(title, _)| *title == word || singular(&word) == *title);
    if !is_command && entry.is_none() {
        return Err(Fault::NoWord { word, known: words().collect::<Vec<_>>().join(", ") });
    }
    // What clap prints of itself, it calls an error.
    let asked = is_command.then(|| Cli::try_parse_from(["radwalk", &word, "--help"]).err()).flatten();
    let command = asked.map(|help| help.to_string());
    let entry = entry.map(|(title, text)| format!("{title}\n\n{text}"));
    let texts: Vec<String> =
        command.into_iter().chain(entry).map(|text| text.trim_end().to_owned()).collect();
    say(&texts.join("\n\n"));
    Ok(Outcome::Done)
}

/// A word without the s of several.
fn singular(word: &str) -> &str {
    word.strip_suffix('s').unwrap_or(word)
}

/// The words that have an entry.
fn words() -> impl Iterator<Item = &'static str> {
    entries().map(|(title, _)| title)
}

/// Each word with its text.
fn entries() -> impl Iterator<Item = (&'static str, &'static str)> {
    let entries = GLOSSARY.split("\n## ").skip(1);
    entries.filter_map(|entry| entry.split_once('\n')).map(|(title, text)| (title, text.trim()))
}
