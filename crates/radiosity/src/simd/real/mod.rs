//! Several f64 side by side, on each instruction set. Intrinsics are in this folder and in `sixteen/`, nowhere else.
//!
//! Each operation is rounded as IEEE 754 says and none is fused with another, so that a formula has the same
//! bits whatever it is compiled for.

use std::ops::{Add, BitAnd, Div, Mul, Sub};

use crate::simd::table::Table;

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
#[cfg(target_arch = "aarch64")]
mod neon;

#[cfg(target_arch = "x86_64")]
pub(super) use avx2::Avx2;
#[cfg(target_arch = "x86_64")]
pub(super) use avx512::Avx512;
#[cfg(target_arch = "aarch64")]
pub(super) use neon::Neon;

/// A vector of N real numbers.
pub(crate) trait Real:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// A truth value for each number.
    type Mask: Copy + BitAnd<Output = Self::Mask>;

    /// The number of lanes.
    const N: usize;

    /// Whether words of 64 bits are multiplied faster by their halves, side by side, than whole, one after the other.
    const MULTIPLIES_HALVES: bool = false;

    /// a·b + c, fused or not.
    #[inline(always)]
    fn mul_add_f32(a: f32, b: f32, c: f32) -> f32 {
        a * b + c
    }

    fn splat(x: f64) -> Self;
    /// The first N of a slice that has them.
    fn load(from: &[f64]) -> Self;
    /// The first N of a slice of integers, converted.
    fn load_u32(from: &[u32]) -> Self;
    /// The upper and the lower 32 bits of the first N of a slice, converted.
    fn load_halves(from: &[u64]) -> [Self; 2];
    fn store(self, to: &mut [f64]);
    /// Writes whole numbers below 2³¹; −1 becomes `u32::MAX`.
    fn store_u32(self, to: &mut [u32]);
    /// Rows of a table side by side: column k of row `index[i]` for each i. A number beyond the table is that of
    /// some row.
    #[inline(always)]
    fn rows<const K: usize>(table: &Table<K>, index: &[u32]) -> [Self; K] {
        let rows: [&[f64; K]; 8] = std::array::from_fn(|i| table.row(index[if i < Self::N { i } else { 0 }]));
        std::array::from_fn(|k| Self::load(&rows.map(|row| row[k])))
    }
    fn abs(self) -> Self;
    fn sqrt(self) -> Self;
    /// The larger of two numbers; +0 for zeros of either sign against +0.
    fn max(self, other: Self) -> Self;
    /// The largest whole number that is not larger; of a number in (−1, 2³¹), where those below 0 may become 0.
    fn floor(self) -> Self;
    fn lt(self, other: Self) -> Self::Mask;
    fn le(self, other: Self) -> Self::Mask;
    fn ne(self, other: Self) -> Self::Mask;
    /// Which of the first N of a slice are below the numbers whose bits `thresholds` has.
    fn below(bits: &[u64], thresholds: Self) -> Self::Mask;
    /// Bit i for number i.
    fn bits(mask: Self::Mask) -> u64;
    /// `yes` where the mask holds, else `no`.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
}

impl Real for f64 {
    type Mask = bool;

    const N: usize = 1;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn load(from: &[f64]) -> Self {
        from[0]
    }
    #[inline(always)]
    fn load_u32(from: &[u32]) -> Self {
        f64::from(from[0])
    }
    #[inline(always)]
    fn load_halves(from: &[u64]) -> [Self; 2] {
        [f64::from((from[0] >> 32) as u32), f64::from(from[0] as u32)]
    }
    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        to[0] = self;
    }
    #[inline(always)]
    fn store_u32(self, to: &mut [u32]) {
        to[0] = self as i64 as u32;
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
    #[inline(always)]
    fn floor(self) -> Self {
        f64::from(self as i32)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self < other
    }
    #[inline(always)]
    fn le(self, other: Self) -> bool {
        self <= other
    }
    #[inline(always)]
    fn ne(self, other: Self) -> bool {
        self != other
    }
    #[inline(always)]
    fn below(bits: &[u64], threshold: Self) -> bool {
        bits[0] < threshold.to_bits()
    }
    #[inline(always)]
    fn bits(mask: bool) -> u64 {
        mask.into()
    }
    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        // Rays meet one side as often as the other.
        std::hint::select_unpredictable(mask, yes, no)
    }
}

/// Plain Rust, two by two, which compilers turn into SSE2 or NEON.
#[derive(Clone, Copy)]
pub(in crate::simd) struct Pair([f64; 2]);

/// All bits set or none.
#[derive(Clone, Copy)]
pub(in crate::simd) struct PairMask([u64; 2]);

impl PairMask {
    #[inline(always)]
    fn of(a: Pair, b: Pair, holds: impl Fn(&f64, &f64) -> bool) -> Self {
        PairMask(std::array::from_fn(|i| u64::from(holds(&a.0[i], &b.0[i])).wrapping_neg()))
    }
}

impl BitAnd for PairMask {
    type Output = Self;

    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        PairMask(std::array::from_fn(|i| self.0[i] & other.0[i]))
    }
}

macro_rules! pair_operator {
    ($($trait:ident $method:ident $operator:tt),*) => {
        $(impl $trait for Pair {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Pair(std::array::from_fn(|i| self.0[i] $operator other.0[i]))
            }
        })*
    };
}

pair_operator!(Add add +, Sub sub -, Mul mul *, Div div /);

impl Real for Pair {
    type Mask = PairMask;

    const N: usize = 2;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        Pair([x; 2])
    }
    #[inline(always)]
    fn load(from: &[f64]) -> Self {
        Pair([from[0], from[1]])
    }
    #[inline(always)]
    fn load_u32(from: &[u32]) -> Self {
        Pair([f64::from(from[0]), f64::from(from[1])])
    }
    #[inline(always)]
    fn load_halves(from: &[u64]) -> [Self; 2] {
        [32, 0].map(|shift| Pair(std::array::from_fn(|i| f64::from((from[i] >> shift) as u32))))
    }
    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        to[..2].copy_from_slice(&self.0);
    }
    #[inline(always)]
    fn store_u32(self, to: &mut [u32]) {
        to[..2].copy_from_slice(&self.0.map(|number| number as i64 as u32));
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Pair(self.0.map(f64::abs))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Pair(self.0.map(f64::sqrt))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self::select(PairMask::of(self, other, PartialOrd::gt), self, other)
    }
    #[inline(always)]
    fn floor(self) -> Self {
        Pair(self.0.map(|number| f64::from(number as i32)))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> PairMask {
        PairMask::of(self, other, PartialOrd::lt)
    }
    #[inline(always)]
    fn le(self, other: Self) -> PairMask {
        PairMask::of(self, other, PartialOrd::le)
    }
    #[inline(always)]
    fn ne(self, other: Self) -> PairMask {
        PairMask::of(self, other, PartialEq::ne)
    }
    #[inline(always)]
    fn below(bits: &[u64], thresholds: Self) -> PairMask {
        PairMask(std::array::from_fn(|i| u64::from(bits[i] < thresholds.0[i].to_bits()).wrapping_neg()))
    }
    #[inline(always)]
    fn bits(mask: PairMask) -> u64 {
        (mask.0[0] & 1) | (mask.0[1] & 2)
    }
    #[inline(always)]
    fn select(mask: PairMask, yes: Self, no: Self) -> Self {
        let bits = |i: usize| (mask.0[i] & yes.0[i].to_bits()) | (!mask.0[i] & no.0[i].to_bits());
        Pair(std::array::from_fn(|i| f64::from_bits(bits(i))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::isa::{Isa, Kernel, Simd};

    /// Every operation on numbers that are easily got wrong, against plain f64.
    fn agrees_with_plain<R: Real>() {
        let numbers = [0.0, -0.0, 1.0, -1.5, 1e300, -1e-300, f64::INFINITY, 3.0];
        let integers = [0, 1, u32::MAX, 1 << 31, (1 << 31) - 1, 7, 1 << 30, 12345];
        let map = |f: &dyn Fn(R, R) -> R, plain: &dyn Fn(f64, f64) -> f64| {
            for (i, b) in numbers.iter().enumerate() {
                for start in (0..8).step_by(R::N) {
                    let mut got = [0.0; 8];
                    f(R::load(&numbers[start..]), R::splat(*b)).store(&mut got[start..]);
                    for (a, got) in numbers[start..][..R::N].iter().zip(&got[start..]) {
                        let want = plain(*a, *b);
                        assert!(
                            got.to_bits() == want.to_bits() || (got.is_nan() && want.is_nan()),
                            "{a} {b} {i}"
                        );
                    }
                }
            }
        };
        map(&|a, b| a + b, &|a, b| a + b);
        map(&|a, b| a - b, &|a, b| a - b);
        map(&|a, b| a * b, &|a, b| a * b);
        map(&|a, b| a / b, &|a, b| a / b);
        map(&|a, _| a.abs().sqrt(), &|a, _| a.abs().sqrt());
        map(&|a, b| a.max(b), &|a, b| if a > b { a } else { b });
        map(&|a, b| R::select(a.lt(b), a, b), &|a, b| if a < b { a } else { b });
        map(&|a, b| R::select(a.le(b) & a.ne(b), a, b), &|a, b| if a < b { a } else { b });
        for start in (0..8).step_by(R::N) {
            let mut got = [0.0; 8];
            R::load_u32(&integers[start..]).store(&mut got[start..]);
            for (integer, got) in integers[start..][..R::N].iter().zip(&got[start..]) {
                assert_eq!(f64::from(*integer), *got);
            }
        }
    }

    /// Compiled for an instruction set, with its vectors.
    struct AgreesWithPlain;

    impl Kernel for AgreesWithPlain {
        #[inline(always)]
        fn run<S: Simd>(self) {
            agrees_with_plain::<S::Doubles>();
        }
    }

    #[test]
    fn every_instruction_set_rounds_alike() {
        agrees_with_plain::<f64>();
        for isa in Isa::available() {
            isa.run(AgreesWithPlain);
        }
    }
}
