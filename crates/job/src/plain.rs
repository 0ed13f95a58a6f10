//! Surfaces in their plain form, read from the events of a TOML parser without a document: most of a large scene.
//!
//! What is not plain is read as a document, which alone tells what is wrong.

use std::borrow::Cow;

use glam::DVec3;
use radiosity::{Shape, Sides};
use toml_parser::decoder::ScalarKind;
use toml_parser::parser::{Event, EventKind, RecursionGuard, ValidateWhitespace, parse_document};
use toml_parser::{ErrorSink, ParseError, Source};

/// A surface as written.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PlainSurface<'a> {
    pub(crate) name: Option<Cow<'a, str>>,
    pub(crate) material: Cow<'a, str>,
    pub(crate) shape: Shape,
    pub(crate) sides: Sides,
    /// The line of its header.
    pub(crate) header: u32,
    /// The line of its outline.
    pub(crate) outline: u32,
    /// The line of its cells, where it has that key.
    pub(crate) cells: Option<u32>,
}

/// Arrays within arrays that are looked into: those of points are two deep.
const DEPTH: u32 = 4;

/// Reads surfaces; the text begins on `line`. `None` where any of them is not plain: where it has keys other than `name`,
/// `material`, `quad`, `triangle`, `patches` and `sides`, where a key stands twice or is missing, or where a value is not
/// what most scenes have there.
pub(crate) fn plain_surfaces(text: &str, line: u32) -> Option<Vec<PlainSurface<'_>>> {
    let source = Source::new(text);
    let tokens = source.lex().into_vec();
    let (mut events, mut faults) = (Vec::with_capacity(tokens.len()), SyntaxFault::default());
    let mut checked = ValidateWhitespace::new(&mut events, source);
    let mut guarded = RecursionGuard::new(&mut checked, DEPTH);
    parse_document(&tokens, &mut guarded, &mut faults);
    let mut reader = PlainSurfaceReader { source, events: events.iter(), line, faults };
    let surfaces = reader.surfaces()?;
    (!reader.faults.any).then_some(surfaces)
}

/// Whether the parser has met what is not TOML.
#[derive(Default)]
struct SyntaxFault {
    any: bool,
}

impl ErrorSink for SyntaxFault {
    fn report_error(&mut self, _: ParseError) {
        self.any = true;
    }
}

/// The events on their way to surfaces.
struct PlainSurfaceReader<'a, 'e> {
    source: Source<'a>,
    events: std::slice::Iter<'e, Event>,
    /// The line of the next event.
    line: u32,
    faults: SyntaxFault,
}

/// A surface on its way.
#[derive(Default)]
struct SurfaceDraft<'a> {
    name: Option<Cow<'a, str>>,
    material: Option<Cow<'a, str>>,
    outline: Option<SurfaceOutline>,
    cells: Option<(PatchesValue, u32)>,
    sides: Option<Sides>,
}

struct SurfaceOutline {
    is_quad: bool,
    corners: [DVec3; 3],
    line: u32,
}

/// The value of the key `patches`.
#[derive(Clone, Copy)]
enum PatchesValue {
    Grid([u32; 2]),
    Rows(u32),
}

impl<'a> PlainSurfaceReader<'a, '_> {
    /// The next event that says something.
    fn next(&mut self) -> Option<&Event> {
        loop {
            let event = self.events.next()?;
            match event.kind() {
                EventKind::Whitespace | EventKind::Comment => {}
                EventKind::Newline => self.line += 1,
                _ => return Some(event),
            }
        }
    }

    fn expect(&mut self, kind: EventKind) -> Option<()> {
        (self.next()?.kind() == kind).then_some(())
    }

    fn surfaces(&mut self) -> Option<Vec<PlainSurface<'a>>> {
        let mut surfaces = Vec::new();
        let mut open: Option<(SurfaceDraft<'a>, u32)> = None;
        while let Some(event) = self.next().copied() {
            match event.kind() {
                EventKind::ArrayTableOpen => {
                    if let Some((draft, header)) = open.take() {
                        surfaces.push(draft.finish(header)?);
                    }
                    open = Some((SurfaceDraft::default(), self.line));
                    (self.key()? == "surface").then_some(())?;
                    self.expect(EventKind::ArrayTableClose)?;
                }
                EventKind::SimpleKey => {
                    let key = self.plain_key(&event)?;
                    self.expect(EventKind::KeyValSep)?;
                    self.value(key, &mut open.as_mut()?.0)?;
                }
                _ => return None,
            }
        }
        if let Some((draft, header)) = open {
            surfaces.push(draft.finish(header)?);
        }
        Some(surfaces)
    }

    fn key(&mut self) -> Option<&'a str> {
        let event = *self.next().filter(|event| event.kind() == EventKind::SimpleKey)?;
        self.plain_key(&event)
    }

    /// A key without quotes.
    fn plain_key(&self, event: &Event) -> Option<&'a str> {
        event.encoding().is_none().then(|| self.source.get(event))?.map(|raw| raw.as_str())
    }

    fn value(&mut self, key: &str, draft: &mut SurfaceDraft<'a>) -> Option<()> {
        match key {
            "name" => once(&mut draft.name, self.string()?),
            "material" => once(&mut draft.material, self.string()?),
            "quad" | "triangle" => {
                let line = self.line;
                let corners = self.triple(Self::triple_of_numbers)?.map(DVec3::from_array);
                once(&mut draft.outline, SurfaceOutline { is_quad: key == "quad", corners, line })
            }
            "patches" => {
                let line = self.line;
                let cells = self.cells()?;
                once(&mut draft.cells, (cells, line))
            }
            "sides" => {
                let sides = match self.integer()? {
                    1 => Sides::Front,
                    2 => Sides::Both,
                    _ => return None,
                };
                once(&mut draft.sides, sides)
            }
            _ => None,
        }
    }

    /// A scalar with its kind.
    fn scalar(&mut self) -> Option<(ScalarKind, Cow<'a, str>)> {
        let event = *self.next().filter(|event| event.kind() == EventKind::Scalar)?;
        self.decode(&event)
    }

    fn decode(&mut self, event: &Event) -> Option<(ScalarKind, Cow<'a, str>)> {
        let mut decoded = Cow::Borrowed("");
        let kind = self.source.get(event)?.decode_scalar(&mut decoded, &mut self.faults);
        Some((kind, decoded))
    }

    fn string(&mut self) -> Option<Cow<'a, str>> {
        self.scalar().filter(|(kind, _)| *kind == ScalarKind::String).map(|(_, string)| string)
    }

    fn number(&mut self) -> Option<f64> {
        let (kind, decoded) = self.scalar()?;
        let number = match kind {
            ScalarKind::Float => decoded.parse().ok()?,
            // As an integer, −0 is 0.
            kind if is_decimal(kind) => decoded.parse::<i64>().ok()? as f64,
            _ => return None,
        };
        number.is_finite().then_some(number)
    }

    /// A decimal integer from 1 up.
    fn integer(&mut self) -> Option<u32> {
        let event = *self.next()?;
        self.integer_of(&event)
    }

    fn integer_of(&mut self, event: &Event) -> Option<u32> {
        (event.kind() == EventKind::Scalar).then_some(())?;
        let (kind, decoded) = self.decode(event)?;
        is_decimal(kind).then_some(())?;
        decoded.parse().ok().filter(|&integer| integer > 0)
    }

    /// An array of three.
    fn triple<T>(&mut self, item: impl Fn(&mut Self) -> Option<T>) -> Option<[T; 3]> {
        self.expect(EventKind::ArrayOpen)?;
        let first = item(self)?;
        self.expect(EventKind::ValueSep)?;
        let second = item(self)?;
        self.expect(EventKind::ValueSep)?;
        let third = item(self)?;
        self.expect(EventKind::ArrayClose)?;
        Some([first, second, third])
    }

    fn triple_of_numbers(&mut self) -> Option<[f64; 3]> {
        self.triple(Self::number)
    }

    fn cells(&mut self) -> Option<PatchesValue> {
        let event = *self.next()?;
        if event.kind() != EventKind::ArrayOpen {
            return self.integer_of(&event).map(PatchesValue::Rows);
        }
        let nu = self.integer()?;
        self.expect(EventKind::ValueSep)?;
        let nv = self.integer()?;
        self.expect(EventKind::ArrayClose)?;
        Some(PatchesValue::Grid([nu, nv]))
    }
}

fn is_decimal(kind: ScalarKind) -> bool {
    matches!(kind, ScalarKind::Integer(radix) if radix.value() == 10)
}

/// Puts a value in its place; `None` where there is one.
fn once<T>(place: &mut Option<T>, value: T) -> Option<()> {
    place.replace(value).is_none().then_some(())
}

impl<'a> SurfaceDraft<'a> {
    /// The surface, where it has all that it needs.
    fn finish(self, header: u32) -> Option<PlainSurface<'a>> {
        let SurfaceOutline { is_quad, corners: [a, b, c], line } = self.outline?;
        let shape = match (is_quad, self.cells.map(|(cells, _)| cells)) {
            (true, None) => Shape::Parallelogram { corner: a, corner_u: b, corner_v: c, cells: [1, 1] },
            (true, Some(PatchesValue::Grid(cells))) => {
                cells[0].checked_mul(cells[1])?;
                Shape::Parallelogram { corner: a, corner_u: b, corner_v: c, cells }
            }
            (false, None) => Shape::Triangle { a, b, c, rows: 1 },
            (false, Some(PatchesValue::Rows(rows))) if rows <= u16::MAX.into() => {
                Shape::Triangle { a, b, c, rows }
            }
            _ => return None,
        };
        Some(PlainSurface {
            name: self.name,
            material: self.material?,
            shape,
            sides: self.sides.unwrap_or(Sides::Front),
            header,
            outline: line,
            cells: self.cells.map(|(_, line)| line),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plain_surfaces_are_read_with_their_lines() {
        let text = "[[surface]] # a wall\nname = \"w\\u0061ll\"\nmaterial = 'm'\nquad = [[0, 0, 0], [1.5, 0, 0],\n  [0, 1e1, -0]]\n\npatches = [2, 3]\n";
        let surfaces = plain_surfaces(text, 10).unwrap();
        let [corner, corner_u, corner_v] = [DVec3::ZERO, DVec3::X * 1.5, DVec3::Y * 10.0];
        let wall = PlainSurface {
            name: Some("wall".into()),
            material: "m".into(),
            shape: Shape::Parallelogram { corner, corner_u, corner_v, cells: [2, 3] },
            sides: Sides::Front,
            header: 10,
            outline: 13,
            cells: Some(16),
        };
        assert_eq!(surfaces, [wall]);
    }

    #[test]
    fn all_else_is_left_to_documents() {
        let plain =
            "[[surface]]\nmaterial = \"m\"\ntriangle = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\npatches = 2\n";
        assert!(plain_surfaces(plain, 1).is_some());
        for (old, new) in [
            ("patches", "pathces"),
            ("patches = 2", "patches = [2, 2]"),
            ("patches = 2", "patches = 0"),
            ("patches = 2", "patches = 2.0"),
            ("patches = 2", "patches = 70000"),
            ("patches = 2", "sides = 3"),
            ("patches = 2", "material = \"n\""),
            ("patches = 2", "patches = 2 2"),
            ("patches = 2", "emit = []"),
            ("patches = 2", "[[surface.emit]]"),
            ("[0, 1, 0]]", "[0, 1]]"),
            ("[0, 1, 0]]", "[0, 1, nan]]"),
            ("[0, 1, 0]]", "[0, 01, 0]]"),
            ("[0, 1, 0]]", "[0, 1, 0],]"),
            ("[[0, 0", "[[[[[[[0, 0"),
            ("\"m\"", "m"),
            ("\"m\"", "\"m\0\""),
            ("[[surface]]", "[[mesh]]"),
            ("[[surface]]", "[surface]"),
            ("material = \"m\"\n", ""),
        ] {
            assert!(plain.contains(old), "{old}");
            assert_eq!(plain_surfaces(&plain.replacen(old, new, 1), 1), None, "{new}");
        }
    }
}
