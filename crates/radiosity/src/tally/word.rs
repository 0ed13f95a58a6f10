//! The whole numbers in which scores are summed up.

/// A whole number of units, 32, 64 or 128 bits wide.
pub trait Word: Copy + Default + Into<u128> {
    /// The word of a small number.
    fn from_units(units: f64) -> Self;
    /// The word of a signed number, in two's complement.
    fn from_signed(number: i64) -> Self;
    /// The sum, modulo the width.
    fn plus(self, other: Self) -> Self;
    /// The difference, modulo the width.
    fn minus(self, other: Self) -> Self;
    /// The product, modulo the width.
    fn times(self, other: Self) -> Self;
    /// Whether its square fits.
    fn is_small(self) -> bool;
}

/// What a visit of a walk scores, or several visits together.
pub(crate) trait Sum: Copy {
    /// The sum of no visits.
    const NONE: Self;
    /// The sum of two, part by part.
    fn plus(self, other: Self) -> Self;
}

impl<const C: usize> Sum for [u64; C] {
    const NONE: Self = [0; C];

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        std::array::from_fn(|c| self[c] + other[c])
    }
}

/// Adds what a walk scores on a patch: Σx grows by y, and Σx² by (x + y)² − x² = y·(2x + y), x being what it has scored before.
#[inline(always)]
pub(super) fn raise_sums(sums: &mut [u128], x: u64, y: u64) {
    sums[0] = sums[0].wrapping_add(y.into());
    sums[1] = sums[1].wrapping_add(u128::from(y) * u128::from(2 * x + y));
}

macro_rules! word {
    ($word:ty) => {
        impl Word for $word {
            #[inline(always)]
            fn from_units(units: f64) -> Self {
                units as $word
            }
            #[inline(always)]
            fn from_signed(number: i64) -> Self {
                number as $word
            }
            #[inline(always)]
            fn plus(self, other: Self) -> Self {
                self.wrapping_add(other)
            }
            #[inline(always)]
            fn minus(self, other: Self) -> Self {
                self.wrapping_sub(other)
            }
            #[inline(always)]
            fn times(self, other: Self) -> Self {
                self.wrapping_mul(other)
            }
            #[inline(always)]
            fn is_small(self) -> bool {
                self >> (<$word>::BITS / 2) == 0
            }
        }
    };
}

word!(u32);
word!(u64);
word!(u128);
