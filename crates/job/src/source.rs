//! A file's text, and what was typed over it.

use std::fs;
use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::error::{Error, Place, Spot};
use crate::job::JOB_KEYS;
use crate::scene::{LISTS, SCENE_KEYS};

/// The text of a TOML file, followed by the overrides: one numbering of bytes for all of them, so that a span
/// tells where a value was written.
#[derive(Debug)]
pub(crate) struct Source {
    file: PathBuf,
    text: String,
    line_starts: Vec<usize>,
    overrides: Vec<Override>,
}

/// A part of a source that was parsed alone: its spans count from `start`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Part<'a> {
    source: &'a Source,
    start: usize,
}

impl<'a> Part<'a> {
    /// All of a source.
    pub(crate) fn whole(source: &'a Source) -> Self {
        Part { source, start: 0 }
    }

    pub(crate) fn file(&self) -> &'a Path {
        self.source.file()
    }

    pub(crate) fn place(&self, offset: usize, key: impl Into<String>) -> Box<Place> {
        self.source.place(self.start + offset, key)
    }

    pub(crate) fn line(&self, offset: usize) -> usize {
        self.source.line(self.start + offset)
    }
}

/// A scene's text in two: its surfaces, and all else.
pub(crate) struct Split {
    /// The text with every surface blanked out: spans are those of the text.
    rest: String,
    /// Ranges of the text that hold nothing but surfaces, in order.
    surfaces: Vec<Range<usize>>,
}

impl Split {
    /// What is no surface.
    pub(crate) fn rest<'a>(&'a self, source: &'a Source) -> Option<(Part<'a>, DeTable<'a>)> {
        Some((Part::whole(source), DeTable::parse(&self.rest).ok()?.into_inner()))
    }

    /// The surfaces, parsed range by range. `None` stands for a range that is not TOML by itself.
    pub(crate) fn surfaces<'a>(
        &'a self,
        source: &'a Source,
    ) -> impl Iterator<Item = Option<(Part<'a>, DeTable<'a>)>> {
        self.surfaces.iter().map(|range| {
            let table = DeTable::parse(&source.text[range.clone()]).ok()?.into_inner();
            Some((Part { source, start: range.start }, table))
        })
    }
}

/// Surfaces that are parsed at a time: as a document, each takes some 5 kB.
const SURFACES_AT_ONCE: usize = 512;

/// The name of the table that a line opens: `surface` for `[[surface]]` and for `[[surface.emit]]`. `None` for other
/// lines.
fn opened(line: &str) -> Option<&str> {
    let name = line.trim_start().strip_prefix('[')?.trim_start_matches('[').trim_start();
    let end =
        name.find(|c: char| !(c.is_ascii_alphanumeric() || matches!(c, '_' | '-'))).unwrap_or(name.len());
    // A number or a bracket opens a line of an array.
    name.starts_with(|c: char| c.is_ascii_alphabetic() || matches!(c, '"' | '\'')).then_some(&name[..end])
}

/// One `--set key=value`.
#[derive(Debug)]
struct Override {
    typed: String,
    key: String,
    value: String,
    /// A document of the key `v` alone, shifted to its place behind all that comes before.
    shifted: String,
    span: Range<usize>,
}

impl Source {
    /// Reads a file. `expected` tells the user of an empty one what it should hold.
    pub(crate) fn read(file: &Path, expected: &'static str) -> Result<Self, Error> {
        let text = read_text(file)?;
        if text.trim().is_empty() {
            return Err(Error::Empty { file: file.into(), expected });
        }
        let line_starts =
            std::iter::once(0).chain(text.match_indices('\n').map(|(newline, _)| newline + 1)).collect();
        Ok(Source { file: file.into(), text, line_starts, overrides: Vec::new() })
    }

    /// A job that has the default of every key, for the scene in a file.
    pub(crate) fn of_scene(file: &Path, text: &str) -> Self {
        Source { file: file.into(), text: text.into(), line_starts: vec![0], overrides: Vec::new() }
    }

    /// Whether the file is a scene: it opens a table that only scenes have, or has such a key and none of jobs.
    pub(crate) fn holds_scene(&self) -> bool {
        let opens =
            self.text.lines().any(|line| opened(line).is_some_and(|table| SCENE_KEYS.contains(&table)));
        opens
            || DeTable::parse(&self.text).is_ok_and(|document| {
                let has = |known: &[&str]| {
                    document.get_ref().keys().any(|key| known.contains(&key.as_ref().as_ref()))
                };
                has(SCENE_KEYS) && !has(JOB_KEYS)
            })
    }

    /// Splits a scene's text at the lines that open tables. A line of a string that looks like one makes a part that
    /// is not TOML by itself.
    pub(crate) fn split(&self) -> Split {
        let mut split = Split { rest: String::with_capacity(self.text.len()), surfaces: Vec::new() };
        let (mut in_surface, mut count, mut start) = (false, 0, 0);
        for line in self.text.split_inclusive('\n') {
            let end = start + line.len();
            if let Some(name) = opened(line) {
                let begins = name == "surface" && line.trim_start().starts_with("[[surface]]");
                if begins && (!in_surface || count == SURFACES_AT_ONCE) {
                    split.surfaces.push(start..start);
                    count = 0;
                }
                count += usize::from(begins);
                in_surface = begins || (in_surface && name == "surface");
            }
            match split.surfaces.last_mut().filter(|_| in_surface) {
                Some(range) => {
                    range.end = end;
                    split.rest.extend(line.bytes().map(|byte| if byte == b'\n' { '\n' } else { ' ' }));
                }
                None => split.rest.push_str(line),
            }
            start = end;
        }
        split
    }

    /// Adds overrides of the form `key=value`, dotted keys, to be applied in order.
    pub(crate) fn with_overrides(mut self, overrides: &[String]) -> Result<Self, Error> {
        let mut start = self.text.len() + 1;
        for typed in overrides {
            let entry = Override::new(typed, start)?;
            start = entry.span.end + 1;
            self.overrides.push(entry);
        }
        Ok(self)
    }

    /// The document, with the overrides in place.
    pub(crate) fn parse(&self) -> Result<DeTable<'_>, Error> {
        let mut table = DeTable::parse(&self.text).map_err(|error| self.syntax(&error))?.into_inner();
        for entry in &self.overrides {
            entry.apply(&mut table)?;
        }
        Ok(table)
    }

    pub(crate) fn file(&self) -> &Path {
        &self.file
    }

    /// Where the bytes from `offset` were written; `key` is what they belong to.
    pub(crate) fn place(&self, offset: usize, key: impl Into<String>) -> Box<Place> {
        let spot = match self.overrides.iter().find(|entry| entry.span.contains(&offset)) {
            Some(entry) => Spot::Override(entry.typed.clone()),
            None => Spot::Line(self.line(offset)),
        };
        Box::new(Place { file: self.file.clone(), spot, key: key.into() })
    }

    /// The line of a byte of the file, from 1.
    pub(crate) fn line(&self, offset: usize) -> usize {
        self.line_starts.partition_point(|&start| start <= offset)
    }

    fn syntax(&self, error: &toml::de::Error) -> Error {
        let place = match error.span() {
            Some(span) => self.place(span.start, ""),
            None => Box::new(Place { file: self.file.clone(), spot: Spot::File, key: String::new() }),
        };
        let line = error.span().and_then(|span| self.text.lines().nth(self.line(span.start) - 1));
        let opened_once =
            |line: &str| LISTS.into_iter().find(|list| line.trim().starts_with(&format!("[{list}]")));
        match line.and_then(opened_once) {
            Some(list) => Error::OneOfMany { place, list },
            None => Error::Syntax { place, problem: error.message().trim().replace('\n', ", ") },
        }
    }
}

fn read_text(file: &Path) -> Result<String, Error> {
    if file.is_dir() {
        return Err(Error::Folder { file: file.into() });
    }
    let bytes = fs::read(file).map_err(|source| match source.kind() {
        io::ErrorKind::NotFound => Error::Missing { file: file.into() },
        _ => Error::Unreadable { file: file.into(), source },
    })?;
    String::from_utf8(bytes).map_err(|error| {
        let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = 1 + valid.iter().filter(|&&byte| byte == b'\n').count();
        Error::NotText { file: file.into(), line }
    })
}

impl Override {
    fn new(typed: &str, start: usize) -> Result<Self, Error> {
        let fault =
            |problem: &str| Error::Override { text: typed.replace('\n', "\\n"), problem: problem.into() };
        if typed.contains('\n') {
            return Err(fault("there is more than one line"));
        }
        let (key, value) = typed.split_once('=').ok_or_else(|| fault("there is no `=`"))?;
        let (key, value) = (key.trim(), value.trim());
        if key.split('.').any(str::is_empty) {
            return Err(fault("a part of the key is empty"));
        }
        if value.is_empty() {
            return Err(fault("there is no value"));
        }
        let shifted = format!("{:start$}v = {value}", "");
        Ok(Override {
            typed: typed.into(),
            key: key.into(),
            value: value.into(),
            span: start..shifted.len(),
            shifted,
        })
    }

    /// Puts the value where its key says, in tables that need not exist yet.
    fn apply<'a>(&'a self, mut table: &mut DeTable<'a>) -> Result<(), Error> {
        let mut parts = self.key.split('.').peekable();
        while let Some(part) = parts.next() {
            let key = Spanned::new(self.span.clone(), part.into());
            if parts.peek().is_none() {
                // Removed first: inserting alone would keep the old key, and with it the old line.
                table.remove(part);
                table.insert(key, self.parse_value()?);
                break;
            }
            let inner = table
                .entry(key)
                .or_insert_with(|| Spanned::new(self.span.clone(), DeValue::Table(DeTable::new())));
            let DeValue::Table(inner) = inner.get_mut() else {
                let problem = format!("`{part}` has no keys of its own in this job");
                return Err(Error::Override { text: self.typed.clone(), problem });
            };
            table = inner;
        }
        Ok(())
    }

    /// The value as TOML; what looks like none of its types is a string without quotes.
    fn parse_value(&self) -> Result<Spanned<DeValue<'_>>, Error> {
        match DeTable::parse(&self.shifted) {
            Ok(document) => Ok(document.into_inner().remove("v").expect("the key just written")),
            Err(error) if self.value.starts_with(['"', '\'', '[', '{']) => Err(Error::Override {
                text: self.typed.clone(),
                problem: format!(
                    "the value is not valid TOML: {}",
                    error.message().trim().replace('\n', ", ")
                ),
            }),
            Err(_) => Ok(Spanned::new(self.span.clone(), DeValue::String(self.value.as_str().into()))),
        }
    }
}
