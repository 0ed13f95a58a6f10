//! The legacy format of VTK: `POLYDATA` and `UNSTRUCTURED_GRID`, in text or in big-endian binary.

use std::path::Path;

use super::cells::{CellMesh, add_cells, facet_rank};
use super::encoded::VtkScalar;
use crate::error::{Error, FileSpot, UnplacedError};
use crate::mesh::Mesh;
use crate::text::{name, number, words};

/// Reads a file of the legacy format.
pub(super) fn read(path: &Path, content: &[u8]) -> Result<Mesh, Error> {
    let mut text = LegacyText { rest: content, line: 0, passed: 0, binary: false, section: b"" };
    let reader = LegacyReader::read(&mut text);
    let spot = match text.binary {
        // Where numbers are bytes there are no lines.
        true => FileSpot::Element(name(text.section)),
        false => FileSpot::Line(text.line),
    };
    reader.and_then(|reader| reader.finish(path)).map_err(|fault| fault.at(path, spot))
}

/// What is left of a file.
struct LegacyText<'a> {
    rest: &'a [u8],
    /// The number of the line that the last word was in.
    line: usize,
    /// How many ends of lines were passed.
    passed: usize,
    /// Whether numbers are bytes.
    binary: bool,
    /// The word that the current section begins with.
    section: &'a [u8],
}

impl<'a> LegacyText<'a> {
    /// The next line, trimmed; `None` at the end of the file.
    fn any_line(&mut self) -> Option<&'a [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        let end = self.rest.iter().position(|&byte| byte == b'\n').unwrap_or(self.rest.len());
        let line = &self.rest[..end];
        self.rest = &self.rest[(end + 1).min(self.rest.len())..];
        self.passed += 1;
        self.line = self.passed;
        Some(line.trim_ascii())
    }

    /// The words of the next line that is not blank; none at the end of the file.
    fn next_words(&mut self) -> Vec<&'a [u8]> {
        let line = std::iter::from_fn(|| self.any_line()).find(|line| !line.is_empty());
        words(line.unwrap_or_default()).collect()
    }

    /// The words of the next line if it begins with `keyword`.
    fn words_of(&mut self, keyword: &[u8]) -> Option<Vec<&'a [u8]>> {
        let begins = self.rest.trim_ascii_start().get(..keyword.len())?.eq_ignore_ascii_case(keyword);
        begins.then(|| self.next_words())
    }

    /// Passes over lines up to one that is blank.
    fn pass_metadata(&mut self) {
        while self.any_line().is_some_and(|line| !line.is_empty()) {}
    }

    /// The next numbers.
    fn numbers(&mut self, count: usize, scalar: VtkScalar) -> Result<Vec<f64>, UnplacedError> {
        if self.binary {
            return Ok(scalar.numbers(self.bytes(count, scalar)?, true));
        }
        (0..count).map(|_| number(Some(self.word()?))).collect()
    }

    /// Passes over numbers, which need not be finite.
    fn skip(&mut self, count: usize, scalar: VtkScalar) -> Result<(), UnplacedError> {
        if self.binary {
            return self.bytes(count, scalar).map(|_| ());
        }
        (0..count).try_for_each(|_| self.word().map(|_| ()))
    }

    /// Passes over strings: a line each, or in binary the bytes that the two highest bits of a first number count.
    fn skip_strings(&mut self, count: usize) -> Result<(), UnplacedError> {
        if !self.binary {
            return (0..count).try_for_each(|_| self.any_line().map(|_| ()).ok_or_else(UnplacedError::short));
        }
        for _ in 0..count {
            let first = *self.rest.first().ok_or_else(UnplacedError::short)?;
            let head = [8, 4, 2, 1][usize::from(first >> 6)];
            let number = self.bytes(head, VtkScalar::Unsigned(1))?;
            let length =
                number[1..].iter().fold(usize::from(first & 0x3f), |all, &byte| all << 8 | usize::from(byte));
            self.bytes(length, VtkScalar::Unsigned(1))?;
        }
        Ok(())
    }

    fn bytes(&mut self, count: usize, scalar: VtkScalar) -> Result<&'a [u8], UnplacedError> {
        let split = self.rest.split_at_checked(count.saturating_mul(scalar.size()));
        let (bytes, rest) = split.ok_or_else(UnplacedError::short)?;
        self.rest = rest;
        Ok(bytes)
    }

    fn word(&mut self) -> Result<&'a [u8], UnplacedError> {
        let begin = self.rest.iter().position(|byte| !byte.is_ascii_whitespace()).unwrap_or(self.rest.len());
        self.passed += self.rest[..begin].iter().filter(|&&byte| byte == b'\n').count();
        self.line = self.passed + 1;
        let rest = &self.rest[begin..];
        let (word, rest) = rest.split_at(rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len()));
        self.rest = rest;
        (!word.is_empty()).then_some(word).ok_or_else(UnplacedError::short)
    }
}

/// What arrays belong to, and how many numbers they have for each component.
#[derive(Clone, Copy, PartialEq)]
enum ArrayOwner {
    Cells(usize),
    Points(usize),
}

/// Cells of one list: the points of all, and where each ends.
#[derive(Default)]
struct CellList {
    connectivity: Vec<f64>,
    ends: Vec<f64>,
}

/// The words that begin lists of polygonal data, each with the type of its cells, in the order of cell arrays.
const LISTS: [(&[u8], u64); 4] = [(b"VERTICES", 1), (b"LINES", 4), (b"POLYGONS", 7), (b"TRIANGLE_STRIPS", 6)];

struct LegacyReader {
    points: Vec<f64>,
    /// The lists of polygonal data in the order of [`LISTS`], then that of an unstructured grid.
    lists: [CellList; 5],
    types: Vec<f64>,
    owner: Option<ArrayOwner>,
    /// The facet ids, with the rank of their name, and the name.
    facets: Option<(usize, String, Vec<f64>)>,
}

impl LegacyReader {
    fn read(text: &mut LegacyText<'_>) -> Result<Self, UnplacedError> {
        // Version and title.
        text.any_line();
        text.any_line();
        text.binary = match text.next_words().as_slice() {
            [word] if word.eq_ignore_ascii_case(b"ASCII") => false,
            [word] if word.eq_ignore_ascii_case(b"BINARY") => true,
            other => return Err(no_section(other)),
        };
        let mut reader = LegacyReader {
            points: Vec::new(),
            lists: Default::default(),
            types: Vec::new(),
            owner: None,
            facets: None,
        };
        loop {
            let words = text.next_words();
            let Some(keyword) = words.first() else { return Ok(reader) };
            text.section = keyword;
            reader.section(&keyword.to_ascii_uppercase(), &words, text)?;
        }
    }

    fn section(
        &mut self,
        keyword: &[u8],
        words: &[&[u8]],
        text: &mut LegacyText<'_>,
    ) -> Result<(), UnplacedError> {
        if let Some(list) = LISTS.iter().position(|(word, _)| *word == keyword) {
            self.lists[list] = CellList::read(words, text)?;
            return Ok(());
        }
        match keyword {
            b"DATASET" => match words.get(1).map(|kind| kind.to_ascii_uppercase()).as_deref() {
                Some(b"POLYDATA" | b"UNSTRUCTURED_GRID") => {}
                _ => return Err(no_mesh(words)),
            },
            b"POINTS" => self.points = text.numbers(count(words, 1)?.saturating_mul(3), scalar(words, 2)?)?,
            b"CELLS" => self.lists[4] = CellList::read(words, text)?,
            b"CELL_TYPES" => self.types = text.numbers(count(words, 1)?, VtkScalar::Signed(4))?,
            b"CELL_DATA" => self.owner = Some(ArrayOwner::Cells(count(words, 1)?)),
            b"POINT_DATA" => self.owner = Some(ArrayOwner::Points(count(words, 1)?)),
            b"METADATA" => text.pass_metadata(),
            b"FIELD" => {
                for _ in 0..count(words, 2)? {
                    let mut words = text.next_words();
                    if words.first().is_some_and(|word| word.eq_ignore_ascii_case(b"METADATA")) {
                        text.pass_metadata();
                        words = text.next_words();
                    }
                    let numbers = count(&words, 1)?.saturating_mul(count(&words, 2)?);
                    if words.get(3).is_some_and(|kind| kind.eq_ignore_ascii_case(b"string")) {
                        text.skip_strings(numbers)?;
                        continue;
                    }
                    self.array(&words, numbers, scalar(&words, 3)?, text)?;
                }
            }
            _ => return self.attribute(keyword, words, text),
        }
        Ok(())
    }

    /// Reads an array of the attributes of cells or points.
    fn attribute(
        &mut self,
        keyword: &[u8],
        words: &[&[u8]],
        text: &mut LegacyText<'_>,
    ) -> Result<(), UnplacedError> {
        let (components, kind) = match keyword {
            b"SCALARS" => (words.get(3).map_or(Ok(1), |_| count(words, 3))?, scalar(words, 2)?),
            b"COLOR_SCALARS" => (count(words, 2)?, VtkScalar::Unsigned(1)),
            b"TEXTURE_COORDINATES" => (count(words, 2)?, scalar(words, 3)?),
            b"VECTORS" | b"NORMALS" => (3, scalar(words, 2)?),
            b"TENSORS" => (9, scalar(words, 2)?),
            b"TENSORS6" => (6, scalar(words, 2)?),
            b"GLOBAL_IDS" | b"PEDIGREE_IDS" => (1, scalar(words, 2)?),
            b"LOOKUP_TABLE" => return text.skip(count(words, 2)?.saturating_mul(4), VtkScalar::Unsigned(1)),
            _ => return Err(no_section(words)),
        };
        if keyword == b"SCALARS" {
            text.words_of(b"LOOKUP_TABLE");
        }
        let Some(ArrayOwner::Cells(tuples) | ArrayOwner::Points(tuples)) = self.owner else {
            return Err(no_section(words));
        };
        let named = if keyword == b"GLOBAL_IDS" { &[keyword, b"globalid"] } else { words };
        self.array(named.get(1..).unwrap_or_default(), tuples.saturating_mul(components), kind, text)
    }

    /// Reads the array of a name if it has facet ids; passes over others.
    fn array(
        &mut self,
        words: &[&[u8]],
        numbers: usize,
        kind: VtkScalar,
        text: &mut LegacyText<'_>,
    ) -> Result<(), UnplacedError> {
        let title = name(words.first().copied().unwrap_or_default());
        let rank = facet_rank(&title).filter(|_| self.owner == Some(ArrayOwner::Cells(numbers)));
        let Some(rank) = rank.filter(|&rank| self.facets.as_ref().is_none_or(|known| rank < known.0)) else {
            return text.skip(numbers, kind);
        };
        self.facets = Some((rank, title, text.numbers(numbers, kind)?));
        Ok(())
    }

    fn finish(self, path: &Path) -> Result<Mesh, UnplacedError> {
        let mut mesh = CellMesh::new(path);
        mesh.add_points(&self.points)?;
        for (number, CellList { connectivity, ends }) in self.lists.iter().enumerate() {
            let kind = |cell: usize| match LISTS.get(number) {
                Some((_, kind)) => Some(*kind),
                None => self.types.get(cell).map(|&kind| kind as u64),
            };
            add_cells(&mut mesh, (connectivity, ends), 0, kind)?;
        }
        let (_, name, facets) = self.facets.unwrap_or_default();
        mesh.finish(&facets, &name)
    }
}

impl CellList {
    /// Reads the list of a section: offsets and points, as written since VTK 9, or for each cell its number of points and these.
    fn read(words: &[&[u8]], text: &mut LegacyText<'_>) -> Result<Self, UnplacedError> {
        let (cells, size) = (count(words, 1)?, count(words, 2)?);
        if let Some(words) = text.words_of(b"OFFSETS") {
            let mut ends = text.numbers(cells, scalar(&words, 1)?)?;
            ends.drain(..ends.len().min(1));
            let words = text.words_of(b"CONNECTIVITY").ok_or_else(UnplacedError::short)?;
            return Ok(CellList { connectivity: text.numbers(size, scalar(&words, 1)?)?, ends });
        }
        let numbers = text.numbers(size, VtkScalar::Signed(4))?;
        let (mut list, mut rest) = (CellList::default(), numbers.as_slice());
        while let Some((&points, after)) = rest.split_first() {
            let (points, after) =
                after.split_at_checked(points.max(0.0) as usize).ok_or_else(UnplacedError::short)?;
            list.connectivity.extend_from_slice(points);
            list.ends.push(list.connectivity.len() as f64);
            rest = after;
        }
        Ok(list)
    }
}

/// The whole number at a place of a line.
fn count(words: &[&[u8]], place: usize) -> Result<usize, UnplacedError> {
    let word = words.get(place).and_then(|word| std::str::from_utf8(word).ok());
    word.and_then(|word| word.parse().ok()).ok_or_else(|| no_section(words))
}

/// The type of numbers at a place of a line.
fn scalar(words: &[&[u8]], place: usize) -> Result<VtkScalar, UnplacedError> {
    let word = words.get(place).and_then(|word| std::str::from_utf8(word).ok());
    word.and_then(VtkScalar::of).ok_or_else(|| no_section(words))
}

fn no_section(words: &[&[u8]]) -> UnplacedError {
    UnplacedError::new(
        format!("{:?} begins no section that is read", name(&words.join(&b' '))),
        "counts are whole numbers, and types those of numbers",
        "leave out what is not geometry or numbers of cells, or write the mesh as .vtu",
    )
}

fn no_mesh(words: &[&[u8]]) -> UnplacedError {
    UnplacedError::new(
        format!("the file is a {:?}", name(words.get(1).copied().unwrap_or_default())),
        "POLYDATA and UNSTRUCTURED_GRID have faces",
        "extract the surface before: vtkDataSetSurfaceFilter",
    )
}
