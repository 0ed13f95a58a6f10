//! The entries, a file each.

mod absorption;
mod area_ratios;
mod cut_off;
mod geometry;
mod survival;

use super::entry::Entry;

/// In the order of the page.
pub const ALL: &[Entry] = &[
    survival::ENTRY,
    absorption::ENTRY,
    area_ratios::ENTRY,
    cut_off::ENTRY,
    geometry::FAR_ORIGIN,
    geometry::SCALES,
    geometry::SLIVERS,
    geometry::WEDGES,
];
