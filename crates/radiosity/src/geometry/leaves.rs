//! Rectangles of different sizes on one parallelogram: it is cut in two across u or across v, each half is cut again or left whole,
//! and so on. The parts that are left whole are the leaves of the tree of cuts, and the cells of the surface.
//!
//! Every cut is in the middle, so that a leaf is one cell of a grid of 2^a × 2^b cells, and a point finds its place in the leaf as it
//! does in a cell of such a grid, to the last bit.

use std::str::FromStr;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// A rectangle that is cell `at` of a grid of 2^a × 2^b cells.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CutCell {
    /// a and b: how often the surface was halved along u and along v.
    pub levels: [u32; 2],
    /// The number of the cell along u and along v.
    pub at: [u32; 2],
}

impl CutCell {
    /// Cells along u and v of the grid that it is a cell of.
    pub fn grid(self) -> [u32; 2] {
        self.levels.map(|level| 1 << level)
    }

    /// Its halves along an axis, 0 for u and 1 for v.
    pub fn halves(self, axis: usize) -> [CutCell; 2] {
        [0, 1].map(|half| {
            let mut leaf = self;
            leaf.levels[axis] += 1;
            leaf.at[axis] = 2 * leaf.at[axis] + half;
            leaf
        })
    }
}

/// Why a text is no tree of cuts.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum LeavesError {
    /// A letter that means nothing.
    #[error("character {place} is {letter:?}, not u, v or a point")]
    Letter {
        /// Which character it is, from 1.
        place: usize,
        /// The character.
        letter: char,
    },
    /// A part is cut too often.
    #[error("character {place} cuts a part along {axis} more than {} times", Leaves::MOST_CUTS)]
    TooFine {
        /// Which character it is, from 1.
        place: usize,
        /// The axis.
        axis: char,
    },
    /// Some parts are neither cut nor left whole.
    #[error("the cuts end before {missing} of their parts")]
    TooShort {
        /// How many.
        missing: usize,
    },
    /// All parts are left whole, and there is more.
    #[error("the cuts end at character {end}, and there is more")]
    TooLong {
        /// The last character of the tree, from 1.
        end: usize,
    },
}

/// The tree of cuts, as a text: `u` or `v` cuts a part in two along that axis, and the first half follows with all its parts, then
/// the second; `.` leaves a part whole. Leaves are numbered in the order of the text.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Leaves(Arc<CutNode>);

#[derive(Debug, PartialEq, Eq)]
struct CutNode {
    text: String,
    leaves: Vec<CutCell>,
    /// How often some leaf is halved at the most, along u and along v.
    top: [u32; 2],
}

impl Leaves {
    /// How often a part may be halved along each axis.
    pub const MOST_CUTS: u32 = 10;

    /// The tree that grows from the whole surface by the cuts that a function asks for: along axis 0 or 1, or none. Parts that may not
    /// be cut further along the axis are left whole.
    pub fn grow(mut cut: impl FnMut(CutCell) -> Option<usize>) -> Self {
        let (mut text, mut open) = (String::new(), vec![CutCell::default()]);
        while let Some(part) = open.pop() {
            match cut(part).filter(|&axis| part.levels[axis] < Self::MOST_CUTS) {
                Some(axis) => {
                    text.push(['u', 'v'][axis]);
                    open.extend(part.halves(axis).into_iter().rev());
                }
                None => text.push('.'),
            }
        }
        text.parse().expect("every part is cut or left whole")
    }

    /// The tree of no cut.
    pub fn whole() -> Self {
        Leaves::grow(|_| None)
    }

    /// The leaves in the order of their numbers.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = CutCell> {
        self.0.leaves.iter().copied()
    }

    /// How many there are.
    #[expect(clippy::len_without_is_empty, reason = "no tree is without a leaf")]
    pub fn len(&self) -> usize {
        self.0.leaves.len()
    }

    /// Leaf number `i`.
    ///
    /// # Panics
    /// Where there is none.
    pub fn get(&self, i: u32) -> CutCell {
        self.0.leaves[i as usize]
    }

    /// Cells along u and v of the coarsest grid of which every leaf is a block of cells.
    pub fn grid(&self) -> [u32; 2] {
        self.0.top.map(|level| 1 << level)
    }

    /// The tree as a text.
    pub fn text(&self) -> &str {
        &self.0.text
    }

    /// The leaves of the surface with u and v exchanged. They keep their numbers.
    pub fn transposed(&self) -> Self {
        let swapped = self.text().chars().map(|letter| match letter {
            'u' => 'v',
            'v' => 'u',
            other => other,
        });
        swapped.collect::<String>().parse().expect("a tree, turned")
    }
}

impl FromStr for Leaves {
    type Err = LeavesError;

    fn from_str(text: &str) -> Result<Self, LeavesError> {
        let (mut leaves, mut open, mut top) = (Vec::new(), vec![CutCell::default()], [0; 2]);
        for (before, letter) in text.chars().enumerate() {
            let place = before + 1;
            let part = open.pop().ok_or(LeavesError::TooLong { end: before })?;
            let axis = match letter {
                'u' => 0,
                'v' => 1,
                '.' => {
                    leaves.push(part);
                    continue;
                }
                _ => return Err(LeavesError::Letter { place, letter }),
            };
            if part.levels[axis] == Self::MOST_CUTS {
                return Err(LeavesError::TooFine { place, axis: letter });
            }
            top[axis] = top[axis].max(part.levels[axis] + 1);
            open.extend(part.halves(axis).into_iter().rev());
        }
        match open.len() {
            0 => Ok(Leaves(Arc::new(CutNode { text: text.into(), leaves, top }))),
            missing => Err(LeavesError::TooShort { missing }),
        }
    }
}

impl TryFrom<String> for Leaves {
    type Error = LeavesError;

    fn try_from(text: String) -> Result<Self, LeavesError> {
        text.parse()
    }
}

impl From<Leaves> for String {
    fn from(leaves: Leaves) -> Self {
        leaves.0.text.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_says_the_cuts() {
        let leaves: Leaves = "uv..v.u..".parse().unwrap();
        let leaf = |levels, at| CutCell { levels, at };
        let expected = [
            leaf([1, 1], [0, 0]),
            leaf([1, 1], [0, 1]),
            leaf([1, 1], [1, 0]),
            leaf([2, 1], [2, 1]),
            leaf([2, 1], [3, 1]),
        ];
        assert_eq!(leaves.iter().collect::<Vec<CutCell>>(), expected);
        assert_eq!(leaves.grid(), [4, 2]);
        assert_eq!(leaves.transposed().text(), "vu..u.v..");
        let again = Leaves::grow(|part| match (part.levels, part.at) {
            ([0, 0], _) => Some(0),
            ([1, 0], _) => Some(1),
            ([1, 1], [1, 1]) => Some(0),
            _ => None,
        });
        assert_eq!(again, leaves);
    }

    #[test]
    fn texts_that_are_no_trees_are_refused() {
        let error = |text: &str| text.parse::<Leaves>().unwrap_err();
        assert_eq!(error(""), LeavesError::TooShort { missing: 1 });
        assert_eq!(error("u."), LeavesError::TooShort { missing: 1 });
        assert_eq!(error("u..."), LeavesError::TooLong { end: 3 });
        assert_eq!(error("u.x"), LeavesError::Letter { place: 3, letter: 'x' });
        let deep = |cuts: usize| format!("{}{}", "v".repeat(cuts), ".".repeat(cuts + 1));
        assert_eq!(deep(10).parse::<Leaves>().unwrap().len(), 11);
        assert_eq!(error(&deep(11)), LeavesError::TooFine { place: 11, axis: 'v' });
    }
}
