//! A reader of numbers in binary formats, which never reads beyond the end.

use crate::error::UnplacedError;

/// The bytes that are left to read.
pub(crate) struct Bytes<'a> {
    rest: &'a [u8],
}

impl<'a> Bytes<'a> {
    pub(crate) fn new(content: &'a [u8]) -> Self {
        Bytes { rest: content }
    }

    pub(crate) fn len(&self) -> usize {
        self.rest.len()
    }

    /// The next N bytes.
    pub(crate) fn take<const N: usize>(&mut self) -> Result<[u8; N], UnplacedError> {
        let (taken, rest) = self.rest.split_first_chunk::<N>().ok_or_else(UnplacedError::short)?;
        self.rest = rest;
        Ok(*taken)
    }

    /// The next `n` bytes, of any number.
    pub(crate) fn slice(&mut self, n: usize) -> Result<&'a [u8], UnplacedError> {
        let (taken, rest) = self.rest.split_at_checked(n).ok_or_else(UnplacedError::short)?;
        self.rest = rest;
        Ok(taken)
    }

    pub(crate) fn skip(&mut self, n: usize) -> Result<(), UnplacedError> {
        self.slice(n).map(|_| ())
    }
}
