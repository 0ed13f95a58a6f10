//! The whole numbers in which scores are summed up.

/// A whole number of units, 32, 64 or 128 bits wide.
pub trait Word: Copy + Default + From<u8> + Into<u128> {
    /// Its width.
    const BITS: u32;
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
    /// The number over 2^shift, rounded up.
    fn over(self, shift: u32) -> Self;
    /// Whether its square fits.
    fn is_small(self) -> bool;
}

/// Adds what a walk scores on a patch: Σx grows by y, and Σx² by (x + y)² − x² = y·(2x + y), x being what it has scored before.
#[inline(always)]
pub(super) fn raise_sums(sums: &mut [u128], x: u64, y: u64) {
    sums[0] = sums[0].wrapping_add(y.into());
    sums[1] = sums[1].wrapping_add(u128::from(y) * u128::from(2 * x + y));
}

/// The whole number next to x, of x in [0, 2⁵¹); halves go up. Without the conversion of numbers, which vectors of some
/// instruction sets have not got: next to 2⁵² numbers are whole, and rounding to nearest is undone where it went up.
#[inline(always)]
pub(crate) fn rounded(x: f64) -> u64 {
    // Above it all numbers are whole.
    const WHOLE: f64 = (1_u64 << 52) as f64;
    let raised = x + 0.5;
    let nearest = raised + WHOLE;
    let above = u64::from(nearest - WHOLE > raised);
    nearest.to_bits().wrapping_sub(above) & ((1 << 52) - 1)
}

macro_rules! word {
    ($word:ty) => {
        impl Word for $word {
            const BITS: u32 = <$word>::BITS;
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
            fn over(self, shift: u32) -> Self {
                (self >> shift) + Self::from(self & ((1 << shift) - 1) != 0)
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

#[cfg(test)]
mod tests {
    use super::rounded;

    #[test]
    fn numbers_are_rounded_as_conversions_round_them() {
        let ends = [0.0, 0.4, 0.49999999999999994, 0.5, 0.7, 1.0, 1.5, 2.5, 3.3e12, 3.3e12 + 0.5, 2.2e15];
        let between = (0..1000).map(|i| f64::from(i).powi(4) * 1.37);
        for x in ends.into_iter().chain(between) {
            assert_eq!(rounded(x), (x + 0.5) as u64, "{x}");
        }
    }
}
