//! The source of a reader's bytes: the disk, or a test.

use std::io;
use std::path::{Path, PathBuf};

/// Reads the files that a mesh file names. Readers open nothing themselves.
pub struct Files<'a> {
    read: &'a mut dyn FnMut(&Path) -> io::Result<Vec<u8>>,
}

impl<'a> Files<'a> {
    /// Reads files by a function from path to content.
    pub fn new(read: &'a mut dyn FnMut(&Path) -> io::Result<Vec<u8>>) -> Self {
        Files { read }
    }

    /// The content of a file that `of` names relative to itself, and its path. Both kinds of slashes separate folders.
    pub(crate) fn beside(&mut self, of: &Path, name: &str) -> io::Result<(PathBuf, Vec<u8>)> {
        let path = of.parent().unwrap_or(Path::new("")).join(name.replace('\\', "/"));
        let content = (self.read)(&path)?;
        Ok((path, content))
    }
}
