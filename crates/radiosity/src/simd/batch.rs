//! Walks side by side.

use std::ops::{BitAnd, BitOr};

/// Walks in a batch.
pub(crate) const WIDTH: usize = 128;

/// Walks of a batch whose set is one word of bits.
pub(crate) const WORD: usize = 64;

/// Some of the walks of a batch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Lanes([u64; WIDTH / 64]);

impl Lanes {
    /// The first `len` walks of the batch.
    #[inline(always)]
    pub(crate) fn first(len: usize) -> Self {
        Lanes(std::array::from_fn(|word| match len.saturating_sub(64 * word) {
            0 => 0,
            len => u64::MAX >> (64 - len.min(64)),
        }))
    }

    /// Whether it is among them.
    #[inline(always)]
    pub(crate) fn has(self, lane: usize) -> bool {
        self.0[lane / 64] >> (lane % 64) & 1 == 1
    }

    /// Adds those of `bits`, the lowest bit for `first`; they do not cross a multiple of 64.
    #[inline(always)]
    pub(crate) fn add(&mut self, first: usize, bits: u64) {
        self.0[first / 64] |= bits << (first % 64);
    }

    /// Bit i: walk `first` + i, of the [`WORD`] walks from a multiple of that on.
    #[inline(always)]
    pub(crate) fn word(self, first: usize) -> u64 {
        self.0[first / WORD]
    }

    /// Adds one walk to the set.
    #[inline(always)]
    pub(crate) fn insert(&mut self, lane: usize) {
        self.add(lane, 1);
    }

    /// The walks of this set that are not among the others.
    #[inline(always)]
    pub(crate) fn without(self, others: Self) -> Self {
        Lanes(std::array::from_fn(|word| self.0[word] & !others.0[word]))
    }

    /// Whether there are none.
    #[inline(always)]
    pub(crate) fn is_empty(self) -> bool {
        self == Lanes::default()
    }

    /// The number of walks in the set.
    #[inline(always)]
    pub(crate) fn count(self) -> u64 {
        self.0.iter().map(|word| u64::from(word.count_ones())).sum()
    }

    /// The numbers of the walks in the set, in ascending order.
    #[inline(always)]
    pub(crate) fn each(self, mut visit: impl FnMut(usize)) {
        for (word, mut bits) in self.0.into_iter().enumerate() {
            while bits != 0 {
                visit(64 * word + bits.trailing_zeros() as usize);
                bits &= bits - 1;
            }
        }
    }
}

impl BitAnd for Lanes {
    type Output = Self;

    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Lanes(std::array::from_fn(|word| self.0[word] & other.0[word]))
    }
}

impl BitOr for Lanes {
    type Output = Self;

    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Lanes(std::array::from_fn(|word| self.0[word] | other.0[word]))
    }
}

/// What became of the walks of a batch where their rays have led them.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Decisions {
    /// The walks that arrived at an active side.
    pub(crate) arrived: Lanes,
    /// The walks that arrived and go on.
    pub(crate) survived: Lanes,
    /// The walks that arrived and are absorbed. All other arrivals are cut off.
    pub(crate) died: Lanes,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_of_lanes_are_sets() {
        for len in [0, 1, 63, 64, 65, 127, 128] {
            let set = Lanes::first(len);
            let mut numbers = Vec::new();
            set.each(|lane| numbers.push(lane));
            assert_eq!(numbers, (0..len).collect::<Vec<_>>());
            assert_eq!((set.count(), set.is_empty()), (len as u64, len == 0));
        }
        let mut set = Lanes::default();
        set.add(72, 0b1010_0001);
        set.insert(3);
        let mut numbers = Vec::new();
        (set & Lanes::first(78)).without(Lanes::first(3)).each(|lane| numbers.push(lane));
        assert_eq!(numbers, [3, 72, 77]);
        assert_eq!((set | Lanes::first(1)).count(), 5);
        assert_eq!([0, 64].map(|first| set.word(first)), [1 << 3, 1 << 8 | 1 << 13 | 1 << 15]);
    }
}
