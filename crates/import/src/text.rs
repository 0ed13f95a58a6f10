//! Lines and words of text formats. Files are bytes: names may be of any encoding, numbers are ASCII.

use crate::error::UnplacedError;

/// The lines of a text from 1, joined where a line ends in a backslash. Blank lines and comments, which begin with
/// `#`, are skipped. A joined line has the number of its first part.
pub(crate) struct LogicalLines<'a> {
    rest: &'a [u8],
    number: usize,
    joined: Vec<u8>,
    /// Whether a comment that ends in a backslash goes on in the next line.
    joins_comments: bool,
}

/// The text without a byte order mark, which editors on Windows put before UTF-8.
pub(crate) fn without_mark(text: &[u8]) -> &[u8] {
    text.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(text)
}

impl<'a> LogicalLines<'a> {
    pub(crate) fn new(text: &'a [u8]) -> Self {
        LogicalLines { rest: without_mark(text), number: 0, joined: Vec::new(), joins_comments: false }
    }

    /// The lines of MGF, which are joined before comments are told from the rest. In OBJ a comment ends with its line.
    pub(crate) fn of_mgf(text: &'a [u8]) -> Self {
        LogicalLines { joins_comments: true, ..LogicalLines::new(text) }
    }

    /// The next line that is not blank, with its number.
    pub(crate) fn next(&mut self) -> Option<(usize, &[u8])> {
        loop {
            let line = self.raw()?;
            let number = self.number;
            if line.is_empty() || line[0] == b'#' {
                if self.joins_comments && line.ends_with(b"\\") {
                    self.join(line);
                }
                continue;
            }
            if line.ends_with(b"\\") {
                self.join(line);
                return Some((number, &self.joined));
            }
            return Some((number, line));
        }
    }

    fn raw(&mut self) -> Option<&'a [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        let end = self.rest.iter().position(|&byte| byte == b'\n').unwrap_or(self.rest.len());
        let line = &self.rest[..end];
        self.rest = &self.rest[(end + 1).min(self.rest.len())..];
        self.number += 1;
        Some(line.trim_ascii())
    }

    fn join(&mut self, first: &[u8]) {
        self.joined = first.to_vec();
        while self.joined.ends_with(b"\\") {
            self.joined.pop();
            self.joined.push(b' ');
            let Some(next) = self.raw() else { break };
            self.joined.extend_from_slice(next);
        }
    }
}

/// The words of a line up to a comment: a word that begins with `#`.
pub(crate) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    let words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
    words.take_while(|word| word[0] != b'#')
}

/// The rest of a line after its first word, with its inner spaces.
pub(crate) fn rest(line: &[u8]) -> String {
    let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
    name(line[end..].trim_ascii())
}

/// Bytes as a name: any that are not UTF-8 become �.
pub(crate) fn name(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Reads a finite number.
pub(crate) fn number(word: Option<&[u8]>) -> Result<f64, UnplacedError> {
    let Some(word) = word else {
        return Err(UnplacedError::new(
            "a number is missing",
            "the line ends before it",
            "complete the line",
        ));
    };
    let parsed = std::str::from_utf8(word).ok().and_then(|word| word.parse::<f64>().ok());
    parsed.filter(|number| number.is_finite()).ok_or_else(|| {
        UnplacedError::new(
            format!("{:?} is not a finite number", name(word)),
            "nothing can be computed from it",
            "write a number such as 0.5",
        )
    })
}

/// Reads N finite numbers from words.
pub(crate) fn numbers<'a, const N: usize>(
    words: &mut impl Iterator<Item = &'a [u8]>,
) -> Result<[f64; N], UnplacedError> {
    let mut numbers = [0.0; N];
    for place in &mut numbers {
        *place = number(words.next())?;
    }
    Ok(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_joined_counted_and_freed_of_comments() {
        let mut lines = LogicalLines::new(b"a b # c\n\n  # d\ne \\\n f\ng");
        assert_eq!(lines.next().map(|(n, line)| (n, words(line).count())), Some((1, 2)));
        assert_eq!(lines.next().map(|(n, line)| (n, words(line).count())), Some((4, 2)));
        assert_eq!(lines.next(), Some((6, &b"g"[..])));
        assert_eq!(lines.next(), None);
    }

    #[test]
    fn comments_go_on_in_mgf_alone() {
        let text = b"# old \\\nf a b c\ng";
        assert_eq!(LogicalLines::of_mgf(text).next(), Some((3, &b"g"[..])));
        assert_eq!(LogicalLines::new(text).next(), Some((2, &b"f a b c"[..])));
    }
}
