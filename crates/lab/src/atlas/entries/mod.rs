//! The entries of the atlas, by subject.

mod absorption;
mod area_ratios;
mod black_emitters;
mod correlated;
mod cut_off;
mod far_lamp;
mod few_walks;
mod geometry;
mod leaks;
mod long_walks;
mod luck;
mod naive_jacobi;
mod plates;
mod slit;
mod survival;
mod tiny_emitter;
mod unequal_emitters;

use super::entry::Entry;

/// All entries in the order of the page.
pub const ALL: &[Entry] = &[
    long_walks::ONE_ROOM,
    long_walks::TWO_ROOMS,
    absorption::ENTRY,
    survival::ENTRY,
    black_emitters::ENTRY,
    area_ratios::ENTRY,
    tiny_emitter::ENTRY,
    far_lamp::ENTRY,
    unequal_emitters::ENTRY,
    slit::ENTRY,
    few_walks::ENTRY,
    plates::ENTRY,
    geometry::WEDGES,
    geometry::SLIVERS,
    geometry::FAR_ORIGIN,
    geometry::SCALES,
    leaks::OPEN,
    leaks::BACKS,
    cut_off::ENTRY,
    naive_jacobi::ENTRY,
    correlated::ENTRY,
    luck::MOMENT,
    luck::SEED,
    luck::TWICE,
];
