//! A file's text, and what was typed over it.

use std::cell::OnceCell;
use std::ops::Range;
use std::path::{Path, PathBuf};

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::bytes::all_bytes;
use crate::error::{Error, SourceLocation, SourceSpot};
use crate::keys::{JOB_KEYS, JOB_LISTS, LISTS, SCENE_KEYS};

/// The text of a TOML file, followed by the overrides: one numbering of bytes for all of them, so that a span
/// tells where a value was written.
#[derive(Debug)]
pub(crate) struct SourceText {
    file: PathBuf,
    text: String,
    /// Found when the first line is asked for.
    line_starts: OnceCell<Vec<usize>>,
    overrides: Vec<Override>,
}

/// A text that was parsed alone: pieces of a source, one behind the other.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ParsedText<'a> {
    source: &'a SourceText,
    pieces: &'a [SourcePiece],
}

/// A piece of a source.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SourcePiece {
    /// Where it begins in its part.
    at: usize,
    /// Where it begins in the source.
    start: usize,
}

/// The piece that is all of a source.
const WHOLE: &[SourcePiece] = &[SourcePiece { at: 0, start: 0 }];

impl<'a> ParsedText<'a> {
    /// All of a source.
    pub(crate) fn whole(source: &'a SourceText) -> Self {
        ParsedText { source, pieces: WHOLE }
    }

    pub(crate) fn file(&self) -> &'a Path {
        self.source.file()
    }

    pub(crate) fn place(&self, offset: usize, key: impl Into<String>) -> Box<SourceLocation> {
        self.source.place(self.in_source(offset), key)
    }

    pub(crate) fn line(&self, offset: usize) -> usize {
        self.source.line(self.in_source(offset))
    }

    fn in_source(&self, offset: usize) -> usize {
        let piece = self.pieces[self.pieces.partition_point(|piece| piece.at <= offset) - 1];
        piece.start + (offset - piece.at)
    }
}

/// A scene's text in two: its surfaces, and all else.
#[derive(Default)]
pub(crate) struct Split {
    /// The text without surfaces, and the pieces that it is of.
    rest: String,
    pieces: Vec<SourcePiece>,
    /// Runs of surfaces, in order.
    surfaces: Vec<Surfaces>,
}

/// A piece of a scene that holds nothing but surfaces.
pub(crate) struct Surfaces {
    range: Range<usize>,
    piece: [SourcePiece; 1],
    /// The line that it begins on.
    line: u32,
}

impl Surfaces {
    /// The text of the surfaces, and the line that it begins on.
    pub(crate) fn text<'a>(&self, source: &'a SourceText) -> (&'a str, u32) {
        (&source.text[self.range.clone()], self.line)
    }

    /// The text as a TOML document; `None` where it is not TOML by itself.
    pub(crate) fn document<'a>(&'a self, source: &'a SourceText) -> Option<(ParsedText<'a>, DeTable<'a>)> {
        let table = DeTable::parse(self.text(source).0).ok()?.into_inner();
        Some((ParsedText { source, pieces: &self.piece }, table))
    }
}

impl Split {
    /// What is no surface.
    pub(crate) fn rest<'a>(&'a self, source: &'a SourceText) -> Option<(ParsedText<'a>, DeTable<'a>)> {
        let pieces = if self.pieces.is_empty() { WHOLE } else { &self.pieces };
        Some((ParsedText { source, pieces }, DeTable::parse(&self.rest).ok()?.into_inner()))
    }

    /// Runs of surfaces, in order.
    pub(crate) fn surfaces(&self) -> &[Surfaces] {
        &self.surfaces
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

/// One override of the form `--set key=value`.
#[derive(Debug)]
struct Override {
    typed: String,
    /// The option that it was typed as.
    option: String,
    /// The parts of the dotted key.
    key: Vec<String>,
    value: String,
    /// A document of the key `v` alone, shifted to its place behind all that comes before.
    shifted: String,
    span: Range<usize>,
}

impl SourceText {
    /// Reads a file. `expected` tells the user of an empty one what it should hold.
    pub(crate) fn read(file: &Path, expected: &'static str) -> Result<Self, Error> {
        let text = read_text(file)?;
        if text.trim().is_empty() {
            return Err(Error::Empty { file: file.into(), expected });
        }
        Ok(SourceText { file: file.into(), text, line_starts: OnceCell::new(), overrides: Vec::new() })
    }

    /// A job that has the default of every key, for the scene in a file.
    pub(crate) fn of_scene(file: &Path, text: &str) -> Self {
        SourceText {
            file: file.into(),
            text: text.into(),
            line_starts: OnceCell::new(),
            overrides: Vec::new(),
        }
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
        let mut split = Split::default();
        let (mut in_surface, mut in_rest, mut count, mut start) = (false, false, 0, 0);
        for (number, line) in (1..).zip(self.text.split_inclusive('\n')) {
            let end = start + line.len();
            if let Some(name) = opened(line) {
                let begins = name == "surface" && line.trim_start().starts_with("[[surface]]");
                if begins && (!in_surface || count == SURFACES_AT_ONCE) {
                    let piece = [SourcePiece { at: 0, start }];
                    split.surfaces.push(Surfaces { range: start..start, piece, line: number });
                    count = 0;
                }
                count += usize::from(begins);
                in_surface = begins || (in_surface && name == "surface");
            }
            match split.surfaces.last_mut().filter(|_| in_surface) {
                Some(surfaces) => surfaces.range.end = end,
                None => {
                    if !in_rest {
                        split.pieces.push(SourcePiece { at: split.rest.len(), start });
                    }
                    split.rest.push_str(line);
                }
            }
            in_rest = !in_surface;
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
    pub(crate) fn place(&self, offset: usize, key: impl Into<String>) -> Box<SourceLocation> {
        let spot = match self.overrides.iter().find(|entry| entry.span.contains(&offset)) {
            Some(entry) => SourceSpot::Override(entry.option.clone()),
            None => SourceSpot::Line(self.line(offset)),
        };
        Box::new(SourceLocation { file: self.file.clone(), spot, key: key.into() })
    }

    /// The line of a byte of the file, from 1.
    pub(crate) fn line(&self, offset: usize) -> usize {
        let starts = self.line_starts.get_or_init(|| {
            let newlines = self.text.match_indices('\n').map(|(newline, _)| newline + 1);
            std::iter::once(0).chain(newlines).collect()
        });
        starts.partition_point(|&start| start <= offset)
    }

    fn syntax(&self, error: &toml::de::Error) -> Error {
        let place = match error.span() {
            Some(span) => self.place(span.start, ""),
            None => Box::new(SourceLocation {
                file: self.file.clone(),
                spot: SourceSpot::File,
                key: String::new(),
            }),
        };
        let line = error.span().and_then(|span| self.text.lines().nth(self.line(span.start) - 1));
        let lists = || LISTS.into_iter().chain(JOB_LISTS);
        let opened_once = |line: &str| lists().find(|list| line.trim().starts_with(&format!("[{list}]")));
        match line.and_then(opened_once) {
            Some(list) => Error::OneOfMany { place, list },
            None => Error::Syntax { place, problem: error.message().trim().replace('\n', ", ") },
        }
    }
}

/// A scene that is named by its file alone becomes a table with that file, so that there is room for other keys.
fn make_room_beside_file(table: &mut DeTable<'_>) {
    let Some(scene) = table.get_mut("scene") else { return };
    if matches!(scene.get_ref(), DeValue::String(_)) {
        let span = scene.span();
        let file = std::mem::replace(scene, Spanned::new(span.clone(), DeValue::Table(DeTable::new())));
        if let DeValue::Table(keys) = scene.get_mut() {
            keys.insert(Spanned::new(span, "file".into()), file);
        }
    }
}

fn read_text(file: &Path) -> Result<String, Error> {
    let bytes = all_bytes(file)?;
    String::from_utf8(bytes).map_err(|error| {
        let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = 1 + valid.iter().filter(|&&byte| byte == b'\n').count();
        Error::NotText { file: file.into(), line }
    })
}

/// The key and the value of an override: they part at the first `=` that is in no quotes.
fn split_override(typed: &str) -> Result<(&str, &str), &'static str> {
    let (mut quote, mut escaped) = (None, false);
    for (at, letter) in typed.char_indices() {
        match quote {
            None if letter == '=' => return Ok((typed[..at].trim(), typed[at + 1..].trim())),
            None if matches!(letter, '"' | '\'') => quote = Some(letter),
            Some('"') if letter == '\\' && !escaped => {
                escaped = true;
                continue;
            }
            Some(open) if letter == open && !escaped => quote = None,
            _ => {}
        }
        escaped = false;
    }
    Err(if quote.is_some() { "a quote in the key is not closed" } else { "there is no `=`" })
}

/// The parts of a dotted key, those in quotes as TOML has them. A part without quotes may hold any other letter.
fn key_parts(key: &str) -> Result<Vec<String>, String> {
    if !key.contains(['"', '\'']) {
        let parts: Vec<String> = key.split('.').map(|part| part.trim().to_owned()).collect();
        let empty = parts.iter().any(String::is_empty);
        return if empty { Err("a part of the key is empty".into()) } else { Ok(parts) };
    }
    let line = format!("{key} = 0");
    let document = DeTable::parse(&line)
        .map_err(|error| format!("the key is not TOML's: {}", error.message().trim().replace('\n', ", ")))?;
    let (mut parts, mut rest) = (Vec::new(), document.into_inner());
    while let Some((part, value)) = rest.into_iter().next() {
        parts.push(part.into_inner().into_owned());
        rest = match value.into_inner() {
            DeValue::Table(inner) => inner,
            _ => break,
        };
    }
    Ok(parts)
}

impl Override {
    /// Reads `key=value`. A second line may hold the option that stands for it, as `--sky=5000`.
    fn new(typed: &str, start: usize) -> Result<Self, Error> {
        let (typed, option) = match typed.split_once("\n--") {
            Some((typed, option)) => (typed, format!("--{option}")),
            None => (typed, format!("--set {typed}")),
        };
        let fault =
            |problem: &str| Error::Override { text: typed.replace('\n', "\\n"), problem: problem.into() };
        if typed.contains('\n') {
            return Err(fault("there is more than one line"));
        }
        let (key, value) = split_override(typed).map_err(fault)?;
        let key = key_parts(key).map_err(|problem| fault(&problem))?;
        if value.is_empty() {
            return Err(fault("there is no value"));
        }
        let shifted = format!("{:start$}v = {value}", "");
        Ok(Override {
            typed: typed.into(),
            option,
            key,
            value: value.into(),
            span: start..shifted.len(),
            shifted,
        })
    }

    /// Puts the value where its key says, in tables that need not exist yet.
    fn apply<'a>(&'a self, mut table: &mut DeTable<'a>) -> Result<(), Error> {
        if self.key.len() > 1 && self.key[0] == "scene" {
            make_room_beside_file(table);
        }
        let mut parts = self.key.iter().map(String::as_str).peekable();
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
