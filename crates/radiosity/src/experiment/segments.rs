//! Walks of several kinds of birth, each with places of its own in the sequence, one segment after the other.

use std::ops::Range;

use serde::{Deserialize, Serialize};

/// Walk n of group i is walk i·2⁴⁰ + n of the sequence, whatever the other groups walk.
pub(super) const WALKS_OF_A_GROUP: u64 = 1 << 40;

/// Walks of one group of faces, or of one cell of a sensor: `first` and those that follow, of the group's own walks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Segment {
    /// The group, or the cell, that they are born in.
    pub group: u32,
    /// The number of the first among the group's walks.
    pub first: u64,
    /// The number of these walks.
    pub walks: u64,
}

impl Segment {
    /// Whether the segment is of one of `groups` and its walks have numbers there.
    fn fits(&self, groups: u32) -> bool {
        let end = self.first.checked_add(self.walks);
        self.group < groups && end.is_some_and(|end| end <= WALKS_OF_A_GROUP)
    }
}

/// The walks of an experiment: number n is number n of these segments, one after the other.
#[derive(Clone, Debug)]
pub(super) struct Segments {
    all: Vec<Segment>,
    /// The number of the walk behind each segment.
    ends: Vec<u64>,
}

/// Walks of one segment.
pub(super) struct SegmentPart {
    /// The number of the segment.
    pub(super) segment: usize,
    /// Its group.
    pub(super) group: u32,
    /// Which of the group's own walks.
    pub(super) walks: Range<u64>,
}

impl Segments {
    /// Segments of `groups` groups; `None` where one does not fit.
    pub(super) fn new(all: Vec<Segment>, groups: u32) -> Option<Self> {
        if !all.iter().all(|segment| segment.fits(groups)) {
            return None;
        }
        let ends = all.iter().scan(0, |end, segment| {
            *end += segment.walks;
            Some(*end)
        });
        Some(Segments { ends: ends.collect(), all })
    }

    /// The number of segments.
    pub(super) fn len(&self) -> usize {
        self.all.len()
    }

    /// Some walks of the experiment, segment by segment.
    pub(super) fn parts(&self, walks: Range<u64>) -> impl Iterator<Item = SegmentPart> {
        let before = self.ends.partition_point(|&end| end <= walks.start);
        let segments = self.all.iter().zip(&self.ends).enumerate().skip(before);
        segments.map_while(move |(number, (&Segment { group, first, walks: of_segment }, &end))| {
            let begin = end - of_segment;
            if begin >= walks.end {
                return None;
            }
            let [from, to] = [walks.start.max(begin), walks.end.min(end)].map(|walk| walk - begin + first);
            Some(SegmentPart { segment: number, group, walks: from..to })
        })
    }
}
