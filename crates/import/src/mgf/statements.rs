//! The statements of an MGF text, and which of them a transform encloses.

use std::path::Path;
use std::rc::Rc;

use crate::text::{LogicalLines, words};

/// The statements of one file.
pub(super) struct Text {
    /// The path of the file, for messages.
    pub(super) path: Rc<Path>,
    pub(super) statements: Vec<Statement>,
    /// The bytes of all statements, one after the other.
    bytes: Vec<u8>,
}

pub(super) struct Statement {
    pub(super) line: u32,
    start: usize,
    length: usize,
    /// The number of the `xf` that closes the transform which this `xf` opens; the number of the text's end if there is
    /// none.
    pub(super) end: usize,
}

impl Text {
    pub(super) fn new(path: &Path, content: &[u8]) -> Self {
        let mut text = Text { path: path.into(), statements: Vec::new(), bytes: Vec::new() };
        let (mut lines, mut open) = (LogicalLines::of_mgf(content), Vec::new());
        while let Some((line, bytes)) = lines.next() {
            let number = text.statements.len();
            let (start, length) = (text.bytes.len(), bytes.len());
            text.bytes.extend_from_slice(bytes);
            text.statements.push(Statement { line: line as u32, start, length, end: number });
            let mut words = words(bytes);
            if words.next() == Some(b"xf") {
                match words.next() {
                    Some(_) => open.push(number),
                    None => text.close(open.pop(), number),
                }
            }
        }
        let end = text.statements.len();
        open.into_iter().for_each(|begun| text.close(Some(begun), end));
        text
    }

    fn close(&mut self, begun: Option<usize>, end: usize) {
        if let Some(begun) = begun {
            self.statements[begun].end = end;
        }
    }

    /// The bytes of one statement.
    pub(super) fn of(&self, statement: &Statement) -> &[u8] {
        &self.bytes[statement.start..statement.start + statement.length]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transforms_end_at_their_own_xf() {
        let text = Text::new(Path::new("a.mgf"), b"xf -mx\nxf -my\no\nxf\nxf\nxf -mz\n\nsph");
        let ends: Vec<usize> = text.statements.iter().map(|statement| statement.end).collect();
        assert_eq!(ends, [4, 3, 2, 3, 4, 7, 6]);
        assert_eq!(text.of(&text.statements[6]), b"sph");
        assert_eq!(text.statements[6].line, 8);
    }
}
