//! The patches of cells that are grouped, as the file of a partition tells them.
//!
//! Words follow each other in the order of the cells: `+3` for three cells that begin a patch each, `7` for a cell of patch 7, `7*4` for
//! four such cells in a row. Patches are numbered in the order of their first cells.

use std::fmt::Write as _;

use crate::document::Value;
use crate::error::Error;

/// The most characters of a line.
const LINE: usize = 120;

/// The text of the key `groups`: a list of lines.
pub(crate) fn written(patch_of_cell: &[u32]) -> String {
    let mut text = String::from("groups = [\n");
    let mut line = String::new();
    for word in words(patch_of_cell) {
        if !line.is_empty() && line.len() + word.len() >= LINE {
            let _ = writeln!(text, "  \"{line}\",");
            line.clear();
        }
        if !line.is_empty() {
            line.push(' ');
        }
        line.push_str(&word);
    }
    let _ = writeln!(text, "  \"{line}\",\n]");
    text
}

fn words(patch_of_cell: &[u32]) -> Vec<String> {
    let mut words = Vec::new();
    let (mut patches, mut cell) = (0, 0);
    while let Some(&patch) = patch_of_cell.get(cell) {
        let rest = &patch_of_cell[cell..];
        let count = match patch == patches {
            true => rest.iter().zip(patches..).take_while(|(patch, next)| **patch == *next).count(),
            false => rest.iter().take_while(|other| **other == patch).count(),
        };
        words.push(match (patch == patches, count) {
            (true, count) => format!("+{count}"),
            (false, 1) => patch.to_string(),
            (false, count) => format!("{patch}*{count}"),
        });
        patches += if patch == patches { count as u32 } else { 0 };
        cell += count;
    }
    words
}

/// Reads the key `groups` of a partition of some cells.
pub(crate) fn read(value: Value<'_>, cells: u64) -> Result<Vec<u32>, Error> {
    let (mut patch_of_cell, mut patches) = (Vec::new(), 0);
    for line in value.array()? {
        for word in line.string()?.split_whitespace() {
            let (first, count, new) = parsed(word, patches).ok_or_else(|| {
                line.refuse(
                    format!("{word:?} tells no patch of cells"),
                    "+3 begins three patches of one cell, 7*4 puts four more cells in patch 7",
                    "take the text as a run has written it",
                )
            })?;
            if patch_of_cell.len() as u64 + u64::from(count) > cells {
                return Err(line.refuse(
                    "there are more cells in groups than surfaces have".into(),
                    "a partition says for each cell which patch it is in",
                    format!("tell of {cells} cells"),
                ));
            }
            let patch = |k: u32| if new { first + k } else { first };
            patch_of_cell.extend((0..count).map(patch));
            patches += if new { count } else { 0 };
        }
    }
    Ok(patch_of_cell)
}

/// The patch of the first cell that a word tells of, the number of cells, and whether each of them begins a patch.
fn parsed(word: &str, patches: u32) -> Option<(u32, u32, bool)> {
    if let Some(count) = word.strip_prefix('+') {
        return Some((patches, count.parse().ok()?, true));
    }
    let (patch, count) = word.split_once('*').unwrap_or((word, "1"));
    let patch = patch.parse().ok().filter(|&patch| patch < patches)?;
    Some((patch, count.parse().ok()?, false))
}

#[cfg(test)]
mod tests {
    use super::words;

    #[test]
    fn words_tell_which_cells_begin_a_patch() {
        assert_eq!(words(&[0, 1, 1, 1, 0, 2, 3, 4, 4]).join(" "), "+2 1*2 0 +3 4");
    }
}
