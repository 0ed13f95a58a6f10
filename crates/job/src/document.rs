//! Tables and values of a document that know their key and place, read one typed key at a time.
//!
//! Reading by hand rather than by derived deserialisation gives every refusal its line, its dotted key and its
//! own words, also where a key takes values of several types.

use std::ops::{Range, RangeInclusive};

use toml::Spanned;
use toml::de::{DeFloat, DeInteger, DeTable, DeValue};

use crate::error::{Error, SourceLocation, SourceSpot};
use crate::near;
use crate::source::{ParsedText, SourceText};
use crate::word::Keyword;

/// A table whose keys have been found to be known.
pub(crate) struct KeyTable<'a> {
    source: ParsedText<'a>,
    /// What precedes a key in messages, its separator included.
    prefix: String,
    /// `None` for the document as a whole.
    span: Option<Range<usize>>,
    entries: DeTable<'a>,
}

/// A value with the key that it was found under.
pub(crate) struct Value<'a> {
    source: ParsedText<'a>,
    key: String,
    span: Range<usize>,
    inner: DeValue<'a>,
}

impl<'a> KeyTable<'a> {
    /// The document itself; refuses keys other than `known`.
    pub(crate) fn root(source: &'a SourceText, known: &'static [&'static str]) -> Result<Self, Error> {
        KeyTable::part(ParsedText::whole(source), source.parse()?, known)
    }

    /// A part of a document that is one itself; refuses keys other than `known`.
    pub(crate) fn part(
        source: ParsedText<'a>,
        entries: DeTable<'a>,
        known: &'static [&'static str],
    ) -> Result<Self, Error> {
        let table = KeyTable { source, prefix: String::new(), span: None, entries };
        table.refuse_unknown(known)?;
        Ok(table)
    }

    /// Removes and returns a key's value.
    pub(crate) fn take(&mut self, key: &str) -> Option<Value<'a>> {
        let (_, value) = self.entries.remove_entry(key)?;
        Some(Value::new(self.source, format!("{}{key}", self.prefix), value))
    }

    /// [`KeyTable::take`] of a choice; the default where the key is absent.
    pub(crate) fn word<W: Keyword + Default>(&mut self, key: &str) -> Result<W, Error> {
        self.take(key).map_or(Ok(W::default()), |value| value.word())
    }

    /// [`KeyTable::take`] of a key without default.
    pub(crate) fn require(
        &mut self,
        key: &str,
        why: &'static str,
        remedy: impl Into<String>,
    ) -> Result<Value<'a>, Error> {
        self.take(key).ok_or_else(|| Error::MissingKey { place: self.place(key), why, remedy: remedy.into() })
    }

    /// A table within this one; an absent one reads as empty.
    pub(crate) fn table(&mut self, key: &str, known: &'static [&'static str]) -> Result<KeyTable<'a>, Error> {
        match self.take(key) {
            Some(value) => value.table(known),
            None => Ok(KeyTable {
                source: self.source,
                prefix: format!("{}{key}.", self.prefix),
                span: self.span.clone(),
                entries: DeTable::new(),
            }),
        }
    }

    /// All entries, by key.
    pub(crate) fn into_values(self) -> impl Iterator<Item = (String, Value<'a>)> {
        let (source, prefix) = (self.source, self.prefix);
        self.entries.into_iter().map(move |(name, value)| {
            let name = name.into_inner().into_owned();
            let value = Value::new(source, format!("{prefix}{name}"), value);
            (name, value)
        })
    }

    /// The place of the table, for a key that it lacks.
    pub(crate) fn place(&self, key: &str) -> Box<SourceLocation> {
        let key = format!("{}{key}", self.prefix);
        match &self.span {
            Some(span) => self.source.place(span.start, key),
            None => Box::new(SourceLocation { file: self.source.file().into(), spot: SourceSpot::File, key }),
        }
    }

    /// The place of the first key that is left; `None` where none is.
    pub(crate) fn first(&self) -> Option<Box<SourceLocation>> {
        let key = self.entries.keys().min_by_key(|key| key.span().start)?;
        Some(self.source.place(key.span().start, format!("{}{}", self.prefix, key.as_ref())))
    }

    /// Whether the table has any of these keys.
    pub(crate) fn has_any(&self, keys: &[&str]) -> bool {
        keys.iter().any(|&key| self.entries.contains_key(key))
    }

    /// Whether a key has this string for its value.
    pub(crate) fn says(&self, key: &str, word: &str) -> bool {
        matches!(self.entries.get(key).map(Spanned::get_ref), Some(DeValue::String(found)) if found == word)
    }

    /// Whether a key's value is a table with another key.
    pub(crate) fn holds(&self, key: &str, inner: &str) -> bool {
        let value = self.entries.get(key).map(Spanned::get_ref);
        matches!(value, Some(DeValue::Table(table)) if table.contains_key(inner))
    }

    /// Whether a table of the list under a key has another key.
    pub(crate) fn list_holds(&self, key: &str, inner: &str) -> bool {
        let Some(DeValue::Array(tables)) = self.entries.get(key).map(Spanned::get_ref) else { return false };
        let has = |table: &DeValue<'_>| matches!(table, DeValue::Table(table) if table.contains_key(inner));
        tables.iter().any(|table| has(table.get_ref()))
    }

    /// Whether a key is `true`.
    pub(crate) fn is_true(&self, key: &str) -> bool {
        matches!(self.entries.get(key).map(Spanned::get_ref), Some(DeValue::Boolean(true)))
    }

    /// The place of a key, or of the table where the key is absent.
    pub(crate) fn place_of(&self, key: &str) -> Box<SourceLocation> {
        match self.entries.get(key) {
            Some(value) => self.source.place(value.span().start, format!("{}{key}", self.prefix)),
            None => self.place(key),
        }
    }

    /// The line of a key, from 1; `None` where it is absent.
    pub(crate) fn line(&self, key: &str) -> Option<usize> {
        self.entries.get(key).map(|value| self.source.line(value.span().start))
    }

    /// Changes what precedes keys in messages.
    pub(crate) fn rename(&mut self, prefix: String) {
        self.prefix = prefix;
    }

    fn refuse_unknown(&self, known: &'static [&'static str]) -> Result<(), Error> {
        let unknown = self.entries.keys().filter(|key| !known.contains(&key.as_ref().as_ref()));
        // Entries are sorted by name; the user reads from the top.
        match unknown.min_by_key(|key| key.span().start) {
            Some(key) => Err(Error::UnknownKey {
                place: self.source.place(key.span().start, format!("{}{}", self.prefix, key.as_ref())),
                hint: near::key_hint(&self.prefix, key.as_ref().as_ref(), known),
                known,
            }),
            None => Ok(()),
        }
    }
}

impl<'a> Value<'a> {
    fn new(source: ParsedText<'a>, key: String, value: Spanned<DeValue<'a>>) -> Self {
        Value { source, key, span: value.span(), inner: value.into_inner() }
    }

    pub(crate) fn place(&self) -> Box<SourceLocation> {
        self.source.place(self.span.start, self.key.as_str())
    }

    /// Where it begins, in bytes: values can be put in the order in which they are written.
    pub(crate) fn start(&self) -> usize {
        self.span.start
    }

    /// The line it is written on, from 1.
    pub(crate) fn line(&self) -> usize {
        self.source.line(self.span.start)
    }

    pub(crate) fn refuse(&self, problem: String, why: &'static str, remedy: impl Into<String>) -> Error {
        Error::Refused { place: self.place(), problem, why, remedy: remedy.into() }
    }

    pub(crate) fn wrong_type(&self, expected: &'static str) -> Error {
        let found = match &self.inner {
            DeValue::String(string) => format!("the string {string:?}"),
            DeValue::Integer(integer) => format!("the integer {integer}"),
            DeValue::Float(float) => format!("the number {float}"),
            DeValue::Boolean(boolean) => format!("the boolean {boolean}"),
            DeValue::Datetime(datetime) => format!("the date or time {datetime}"),
            DeValue::Array(array) => format!("an array of {}", array.len()),
            DeValue::Table(_) => "a table".into(),
        };
        Error::WrongType { place: self.place(), found, expected }
    }

    pub(crate) fn is_array(&self) -> bool {
        matches!(self.inner, DeValue::Array(_))
    }

    pub(crate) fn is_table(&self) -> bool {
        matches!(self.inner, DeValue::Table(_))
    }

    pub(crate) fn is_string(&self) -> bool {
        matches!(self.inner, DeValue::String(_))
    }

    pub(crate) fn boolean(&self) -> Result<bool, Error> {
        match self.inner {
            DeValue::Boolean(boolean) => Ok(boolean),
            _ => Err(self.wrong_type("true or false")),
        }
    }

    pub(crate) fn string(&self) -> Result<&str, Error> {
        match &self.inner {
            DeValue::String(string) => Ok(string),
            _ => Err(self.wrong_type("a string in quotes")),
        }
    }

    /// A name that people can see, on one line. `what` is named, a name is shown in `shown`, and `remedy` is written where it
    /// cannot be.
    pub(crate) fn name(
        &self,
        what: &str,
        shown: &'static str,
        remedy: &'static str,
    ) -> Result<String, Error> {
        let name = self.string()?;
        match name.trim().is_empty() || name.contains(char::is_control) {
            true => Err(self.refuse(format!("{name:?} cannot name a {what}"), shown, remedy)),
            false => Ok(name.into()),
        }
    }

    /// One of the words for a choice.
    pub(crate) fn word<W: Keyword>(&self) -> Result<W, Error> {
        let found = self.string()?;
        W::ALL.iter().copied().find(|choice| choice.word() == found).ok_or_else(|| Error::UnknownWord {
            place: self.place(),
            found: found.into(),
            hint: near::hint(found, W::ALL.iter().map(|choice| choice.word())),
            choices: W::ALL
                .iter()
                .map(|choice| format!("{:?}", choice.word()))
                .collect::<Vec<_>>()
                .join(" or "),
        })
    }

    /// An integer in a range; `why` explains the range.
    pub(crate) fn integer(&self, range: RangeInclusive<u64>, why: &'static str) -> Result<u64, Error> {
        let (written, parsed) = match &self.inner {
            DeValue::Integer(integer) => {
                (integer.to_string(), u64::from_str_radix(integer.as_str(), integer.radix()).ok())
            }
            DeValue::Float(float) if is_exponential(float) => {
                let written = whole_number(float.as_str());
                (float.to_string(), written.and_then(|number| u64::try_from(number).ok()))
            }
            _ => return Err(self.wrong_type("an integer, such as 1, 1_000_000 or 1e6")),
        };
        parsed.filter(|parsed| range.contains(parsed)).ok_or_else(|| {
            let too_large = !written.starts_with('-') && parsed.is_none_or(|parsed| parsed > *range.end());
            // Where the range ends with the integers of TOML, `why` speaks of its beginning.
            let why = match too_large && *range.end() == i64::MAX as u64 {
                true => "integers in TOML have 64 bits, one of them the sign",
                false => why,
            };
            let remedy = format!("choose an integer from {} to {}", range.start(), range.end());
            self.refuse(format!("{written} is out of range"), why, remedy)
        })
    }

    /// A finite number, written as float or integer.
    pub(crate) fn number(&self) -> Result<f64, Error> {
        let parsed = match &self.inner {
            DeValue::Float(float) => parse_float(float),
            DeValue::Integer(integer) => parse_whole(integer),
            _ => return Err(self.wrong_type("a number, such as 0.5")),
        };
        parsed.filter(|number| number.is_finite()).ok_or_else(|| {
            self.refuse(
                "this is not a finite number".into(),
                "nothing can be computed from it",
                "write a number of ordinary size",
            )
        })
    }

    pub(crate) fn array(self) -> Result<Vec<Value<'a>>, Error> {
        let Value { source, key, span, inner } = self;
        match inner {
            DeValue::Array(array) => {
                let numbered = array.into_iter().enumerate();
                Ok(numbered.map(|(i, value)| Value::new(source, format!("{key}[{i}]"), value)).collect())
            }
            inner => Err(Value { source, key, span, inner }.wrong_type("an array in brackets")),
        }
    }

    /// The elements of a list of tables that is called so.
    pub(crate) fn tables(self, list: &'static str) -> Result<Vec<Value<'a>>, Error> {
        match self.inner {
            DeValue::Table(_) => Err(Error::OneOfMany { place: self.place(), list }),
            _ => self.array(),
        }
    }

    /// An array of exactly N elements; `expected` describes it.
    pub(crate) fn exactly<const N: usize>(self, expected: &'static str) -> Result<[Value<'a>; N], Error> {
        match &self.inner {
            DeValue::Array(array) if array.len() == N => {
                let mut elements = self.array()?.into_iter();
                Ok(std::array::from_fn(|_| elements.next().expect("N elements, as just found")))
            }
            _ => Err(self.wrong_type(expected)),
        }
    }

    /// A table with no other keys than `known`.
    pub(crate) fn table(self, known: &'static [&'static str]) -> Result<KeyTable<'a>, Error> {
        let prefix = format!("{}.", self.key);
        self.table_called(prefix, known)
    }

    /// [`Value::table`] whose keys get another prefix in messages.
    pub(crate) fn table_called(
        self,
        prefix: String,
        known: &'static [&'static str],
    ) -> Result<KeyTable<'a>, Error> {
        let mut table = self.any_table()?;
        table.rename(prefix);
        table.refuse_unknown(known)?;
        Ok(table)
    }

    /// A table whose keys are names.
    pub(crate) fn any_table(self) -> Result<KeyTable<'a>, Error> {
        let Value { source, key, span, inner } = self;
        match inner {
            DeValue::Table(entries) => {
                Ok(KeyTable { source, prefix: format!("{key}."), span: Some(span), entries })
            }
            inner => Err(Value { source, key, span, inner }
                .wrong_type("a table: its name in brackets on a line of its own, and its keys below")),
        }
    }
}

fn parse_float(float: &DeFloat<'_>) -> Option<f64> {
    float.as_str().parse().ok()
}

/// Whether a float is written as 1e6 is: an integer with an exponent, however large.
fn is_exponential(float: &DeFloat<'_>) -> bool {
    float.as_str().contains(['e', 'E']) && parse_float(float).is_some_and(|number| number.fract() == 0.0)
}

/// The whole number that decimal digits such as `1000000`, `1e6` or `2.5E3` write, without rounding; `None` where they write none.
/// One beyond 128 bits is the largest there.
pub fn whole_number(written: &str) -> Option<u128> {
    let written = written.strip_prefix('+').unwrap_or(written);
    let (mantissa, exponent) = written.split_once(['e', 'E']).unwrap_or((written, "0"));
    let (before, behind) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let digits = [before, behind].concat();
    if before.is_empty() || !digits.bytes().all(|digit| digit.is_ascii_digit()) {
        return None;
    }
    let exponent = exponent.parse::<i64>().ok()?.checked_sub(behind.len() as i64)?;
    let short = digits.trim_end_matches('0');
    if short.is_empty() {
        return Some(0);
    }
    let zeros = u32::try_from(exponent.checked_add((digits.len() - short.len()) as i64)?).ok()?;
    let number = short.parse::<u128>().ok().zip(10_u128.checked_pow(zeros));
    Some(number.and_then(|(number, power)| number.checked_mul(power)).unwrap_or(u128::MAX))
}

fn parse_whole(integer: &DeInteger<'_>) -> Option<f64> {
    i128::from_str_radix(integer.as_str(), integer.radix()).ok().map(|whole| whole as f64)
}
