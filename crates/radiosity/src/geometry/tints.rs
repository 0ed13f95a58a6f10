//! Tints: what coloured walks look up of the surfaces that they survive.

use super::surface::Surface;
use crate::simd::table::Table;

/// The channels of a tint, and 1 behind them: a power of two of numbers fills a vector.
pub(crate) const TINT: usize = 4;

/// The tints of surfaces.
#[derive(Clone, Debug)]
pub(crate) struct Tints {
    table: Table<TINT>,
}

impl Tints {
    /// The tints of surfaces; in grey scenes, where no walk asks for one, only that of no surface.
    pub(crate) fn new(surfaces: &[Surface], channels: usize) -> Self {
        let coloured = if channels > 1 { surfaces } else { &[] };
        let rows = coloured.iter().map(|surface| {
            let [red, green, blue] = surface.tint();
            [red, green, blue, 1.0]
        });
        // Behind all surfaces, where the table looks up what has no number.
        Tints { table: Table::new(rows.chain([[1.0; TINT]]).collect()) }
    }

    /// What the tints take of memory [bytes].
    pub(crate) fn bytes(&self) -> usize {
        self.table.bytes()
    }

    /// The tint of a surface; 1 in each channel where there is none.
    #[inline(always)]
    pub(crate) fn of(&self, surface: u32) -> &[f64; TINT] {
        self.table.row(surface)
    }

    /// Walks will soon survive on these surfaces.
    #[inline(always)]
    pub(crate) fn expect(&self, surfaces: &[u32]) {
        self.table.expect(surfaces);
    }
}
