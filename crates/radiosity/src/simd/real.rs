//! Several f64 side by side, on each instruction set: with `tree/lanes.rs` the only place with intrinsics.
//!
//! Each operation is rounded as IEEE 754 says and none is fused with another, so that a formula has the same
//! bits whatever it is compiled for.

use std::ops::{Add, BitAnd, Div, Mul, Sub};

use crate::simd::table::Table;

/// N numbers. A method may be called only where the processor has the implementation's instruction set; the
/// kernel's entry points see to that.
pub(crate) trait Real:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// A truth value for each number.
    type Mask: Copy + BitAnd<Output = Self::Mask>;

    /// How many.
    const N: usize;

    /// a·b + c, fused or not.
    #[inline(always)]
    fn mul_add_f32(a: f32, b: f32, c: f32) -> f32 {
        a * b + c
    }

    fn splat(x: f64) -> Self;
    /// The first N of a slice that has them.
    fn load(from: &[f64]) -> Self;
    /// Likewise, converted.
    fn load_u32(from: &[u32]) -> Self;
    /// The upper and the lower 32 bits of the first N of a slice, converted.
    fn load_halves(from: &[u64]) -> [Self; 2];
    fn store(self, to: &mut [f64]);
    /// Of whole numbers below 2³¹; −1 becomes `u32::MAX`.
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
        if mask { yes } else { no }
    }
}

/// Plain Rust, two by two, which compilers turn into SSE2 or NEON.
#[derive(Clone, Copy)]
pub(crate) struct Pair([f64; 2]);

/// All bits set or none.
#[derive(Clone, Copy)]
pub(crate) struct PairMask([u64; 2]);

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

#[cfg(target_arch = "x86_64")]
pub(crate) use x86::{Avx2, Avx512};

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::*;

    use super::*;

    macro_rules! operator {
        ($type:ty: $($trait:ident $method:ident $intrinsic:ident),*) => {
            $(impl $trait for $type {
                type Output = Self;

                #[inline(always)]
                fn $method(self, other: Self) -> Self {
                    // SAFETY: see `Real`: the processor has it.
                    Self(unsafe { $intrinsic(self.0, other.0) })
                }
            })*
        };
    }

    /// Four numbers in a register of AVX2.
    #[derive(Clone, Copy)]
    pub(crate) struct Avx2(__m256d);

    operator!(Avx2: Add add _mm256_add_pd, Sub sub _mm256_sub_pd, Mul mul _mm256_mul_pd, Div div _mm256_div_pd);
    operator!(Avx2: BitAnd bitand _mm256_and_pd);

    impl Real for Avx2 {
        type Mask = Self;

        const N: usize = 4;

        #[inline(always)]
        fn mul_add_f32(a: f32, b: f32, c: f32) -> f32 {
            a.mul_add(b, c)
        }
        #[inline(always)]
        fn splat(x: f64) -> Self {
            // SAFETY: here and below: the processor has it (see `Real`), and slices are long enough.
            Avx2(unsafe { _mm256_set1_pd(x) })
        }
        #[inline(always)]
        fn load(from: &[f64]) -> Self {
            assert!(from.len() >= 4);
            Avx2(unsafe { _mm256_loadu_pd(from.as_ptr()) })
        }
        /// There are no unsigned conversions: 2³¹ less, converted, 2³¹ more, all exact.
        #[inline(always)]
        fn load_u32(from: &[u32]) -> Self {
            assert!(from.len() >= 4);
            unsafe {
                let half = _mm_set1_epi32(i32::MIN);
                let shifted = _mm_xor_si128(_mm_loadu_si128(from.as_ptr().cast()), half);
                Avx2(_mm256_add_pd(_mm256_cvtepi32_pd(shifted), _mm256_set1_pd(2_147_483_648.0)))
            }
        }
        /// The bits of 2⁵² + k end in those of k.
        #[inline(always)]
        fn load_halves(from: &[u64]) -> [Self; 2] {
            assert!(from.len() >= 4);
            unsafe {
                let bits = _mm256_loadu_si256(from.as_ptr().cast());
                let two_52 = _mm256_set1_pd(4_503_599_627_370_496.0);
                let high = _mm256_castsi256_pd(_mm256_srli_epi64::<32>(bits));
                let low = _mm256_castsi256_pd(_mm256_and_si256(bits, _mm256_set1_epi64x(0xFFFF_FFFF)));
                [
                    Avx2(_mm256_sub_pd(_mm256_or_pd(high, two_52), two_52)),
                    Avx2(_mm256_sub_pd(_mm256_or_pd(low, two_52), two_52)),
                ]
            }
        }
        #[inline(always)]
        fn store(self, to: &mut [f64]) {
            assert!(to.len() >= 4);
            unsafe { _mm256_storeu_pd(to.as_mut_ptr(), self.0) }
        }
        #[inline(always)]
        fn store_u32(self, to: &mut [u32]) {
            assert!(to.len() >= 4);
            unsafe { _mm_storeu_si128(to.as_mut_ptr().cast(), _mm256_cvttpd_epi32(self.0)) }
        }
        /// Four rows at a time are turned into columns in registers.
        #[inline(always)]
        fn rows<const K: usize>(table: &Table<K>, index: &[u32]) -> [Self; K] {
            const { assert!(K.is_multiple_of(4)) };
            let rows: [&[f64; K]; 4] = std::array::from_fn(|i| table.row(index[i]));
            let mut columns = [Self::splat(0.0); K];
            for first in (0..K).step_by(4) {
                unsafe {
                    let [a, b, c, d] = rows.map(|row| row[first..].as_ptr());
                    let (a, b) = (_mm256_loadu_pd(a), _mm256_loadu_pd(b));
                    let (c, d) = (_mm256_loadu_pd(c), _mm256_loadu_pd(d));
                    let (ab, cd) = (_mm256_unpacklo_pd(a, b), _mm256_unpacklo_pd(c, d));
                    columns[first] = Avx2(_mm256_permute2f128_pd::<0x20>(ab, cd));
                    columns[first + 2] = Avx2(_mm256_permute2f128_pd::<0x31>(ab, cd));
                    let (ab, cd) = (_mm256_unpackhi_pd(a, b), _mm256_unpackhi_pd(c, d));
                    columns[first + 1] = Avx2(_mm256_permute2f128_pd::<0x20>(ab, cd));
                    columns[first + 3] = Avx2(_mm256_permute2f128_pd::<0x31>(ab, cd));
                }
            }
            columns
        }
        #[inline(always)]
        fn abs(self) -> Self {
            Avx2(unsafe { _mm256_andnot_pd(_mm256_set1_pd(-0.0), self.0) })
        }
        #[inline(always)]
        fn sqrt(self) -> Self {
            Avx2(unsafe { _mm256_sqrt_pd(self.0) })
        }
        #[inline(always)]
        fn max(self, other: Self) -> Self {
            Avx2(unsafe { _mm256_max_pd(self.0, other.0) })
        }
        #[inline(always)]
        fn floor(self) -> Self {
            Avx2(unsafe { _mm256_floor_pd(self.0) })
        }
        #[inline(always)]
        fn lt(self, other: Self) -> Self {
            Avx2(unsafe { _mm256_cmp_pd::<_CMP_LT_OQ>(self.0, other.0) })
        }
        #[inline(always)]
        fn le(self, other: Self) -> Self {
            Avx2(unsafe { _mm256_cmp_pd::<_CMP_LE_OQ>(self.0, other.0) })
        }
        #[inline(always)]
        fn ne(self, other: Self) -> Self {
            Avx2(unsafe { _mm256_cmp_pd::<_CMP_NEQ_UQ>(self.0, other.0) })
        }
        /// There are no unsigned comparisons: 2⁶³ less on both sides.
        #[inline(always)]
        fn below(bits: &[u64], thresholds: Self) -> Self {
            assert!(bits.len() >= 4);
            unsafe {
                let half = _mm256_set1_epi64x(i64::MIN);
                let bits = _mm256_xor_si256(_mm256_loadu_si256(bits.as_ptr().cast()), half);
                let thresholds = _mm256_xor_si256(_mm256_castpd_si256(thresholds.0), half);
                Avx2(_mm256_castsi256_pd(_mm256_cmpgt_epi64(thresholds, bits)))
            }
        }
        #[inline(always)]
        fn bits(mask: Self) -> u64 {
            unsafe { _mm256_movemask_pd(mask.0) as u64 }
        }
        #[inline(always)]
        fn select(mask: Self, yes: Self, no: Self) -> Self {
            Avx2(unsafe { _mm256_blendv_pd(no.0, yes.0, mask.0) })
        }
    }

    /// Eight numbers in a register of AVX-512.
    #[derive(Clone, Copy)]
    pub(crate) struct Avx512(__m512d);

    /// A bit for each.
    #[derive(Clone, Copy)]
    pub(crate) struct Mask512(__mmask8);

    impl BitAnd for Mask512 {
        type Output = Self;

        #[inline(always)]
        fn bitand(self, other: Self) -> Self {
            Mask512(self.0 & other.0)
        }
    }

    operator!(Avx512: Add add _mm512_add_pd, Sub sub _mm512_sub_pd, Mul mul _mm512_mul_pd, Div div _mm512_div_pd);

    impl Real for Avx512 {
        type Mask = Mask512;

        const N: usize = 8;

        #[inline(always)]
        fn mul_add_f32(a: f32, b: f32, c: f32) -> f32 {
            a.mul_add(b, c)
        }
        #[inline(always)]
        fn splat(x: f64) -> Self {
            // SAFETY: here and below: the processor has it (see `Real`), and slices are long enough.
            Avx512(unsafe { _mm512_set1_pd(x) })
        }
        #[inline(always)]
        fn load(from: &[f64]) -> Self {
            assert!(from.len() >= 8);
            Avx512(unsafe { _mm512_loadu_pd(from.as_ptr()) })
        }
        #[inline(always)]
        fn load_u32(from: &[u32]) -> Self {
            assert!(from.len() >= 8);
            Avx512(unsafe { _mm512_cvtepu32_pd(_mm256_loadu_si256(from.as_ptr().cast())) })
        }
        #[inline(always)]
        fn load_halves(from: &[u64]) -> [Self; 2] {
            assert!(from.len() >= 8);
            unsafe {
                let bits = _mm512_loadu_si512(from.as_ptr().cast());
                let high = _mm512_srli_epi64::<32>(bits);
                let low = _mm512_and_si512(bits, _mm512_set1_epi64(0xFFFF_FFFF));
                [Avx512(_mm512_cvtepu64_pd(high)), Avx512(_mm512_cvtepu64_pd(low))]
            }
        }
        #[inline(always)]
        fn store(self, to: &mut [f64]) {
            assert!(to.len() >= 8);
            unsafe { _mm512_storeu_pd(to.as_mut_ptr(), self.0) }
        }
        #[inline(always)]
        fn store_u32(self, to: &mut [u32]) {
            assert!(to.len() >= 8);
            unsafe { _mm256_storeu_si256(to.as_mut_ptr().cast(), _mm512_cvttpd_epi32(self.0)) }
        }
        /// A column of a small table fits two registers, which one instruction picks from; of larger tables eight
        /// rows at a time are turned into columns in registers.
        #[inline(always)]
        fn rows<const K: usize>(table: &Table<K>, index: &[u32]) -> [Self; K] {
            const { assert!(K.is_multiple_of(8)) };
            assert!(index.len() >= 8);
            let mut found = [Self::splat(0.0); K];
            if let Some(columns) = table.columns() {
                for (found, column) in found.iter_mut().zip(columns) {
                    unsafe {
                        let index = _mm512_cvtepu32_epi64(_mm256_loadu_si256(index.as_ptr().cast()));
                        let low = _mm512_loadu_pd(column.as_ptr());
                        let high = _mm512_loadu_pd(column[8..].as_ptr());
                        *found = Avx512(_mm512_permutex2var_pd(low, index, high));
                    }
                }
                return found;
            }
            let rows: [&[f64; K]; 8] = std::array::from_fn(|i| table.row(index[i]));
            for first in (0..K).step_by(8) {
                unsafe { transpose(rows.map(|row| row[first..].as_ptr()), &mut found[first..]) };
            }
            found
        }
        #[inline(always)]
        fn abs(self) -> Self {
            Avx512(unsafe { _mm512_abs_pd(self.0) })
        }
        #[inline(always)]
        fn sqrt(self) -> Self {
            Avx512(unsafe { _mm512_sqrt_pd(self.0) })
        }
        #[inline(always)]
        fn max(self, other: Self) -> Self {
            Avx512(unsafe { _mm512_max_pd(self.0, other.0) })
        }
        #[inline(always)]
        fn floor(self) -> Self {
            Avx512(unsafe { _mm512_roundscale_pd::<_MM_FROUND_TO_NEG_INF>(self.0) })
        }
        #[inline(always)]
        fn lt(self, other: Self) -> Mask512 {
            Mask512(unsafe { _mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0, other.0) })
        }
        #[inline(always)]
        fn le(self, other: Self) -> Mask512 {
            Mask512(unsafe { _mm512_cmp_pd_mask::<_CMP_LE_OQ>(self.0, other.0) })
        }
        #[inline(always)]
        fn ne(self, other: Self) -> Mask512 {
            Mask512(unsafe { _mm512_cmp_pd_mask::<_CMP_NEQ_UQ>(self.0, other.0) })
        }
        #[inline(always)]
        fn below(bits: &[u64], thresholds: Self) -> Mask512 {
            assert!(bits.len() >= 8);
            Mask512(unsafe {
                let bits = _mm512_loadu_si512(bits.as_ptr().cast());
                _mm512_cmplt_epu64_mask(bits, _mm512_castpd_si512(thresholds.0))
            })
        }
        #[inline(always)]
        fn bits(mask: Mask512) -> u64 {
            mask.0.into()
        }
        #[inline(always)]
        fn select(mask: Mask512, yes: Self, no: Self) -> Self {
            Avx512(unsafe { _mm512_mask_blend_pd(mask.0, no.0, yes.0) })
        }
    }

    /// The first eight numbers of eight rows as eight columns. No closures here: they do not inherit the
    /// instruction set.
    #[inline(always)]
    unsafe fn transpose(rows: [*const f64; 8], columns: &mut [Avx512]) {
        // SAFETY: as for `Avx512`.
        unsafe {
            let mut numbers = [_mm512_setzero_pd(); 8];
            for (numbers, row) in numbers.iter_mut().zip(rows) {
                *numbers = _mm512_loadu_pd(row);
            }
            let [a, b, c, d, e, f, g, h] = numbers;
            // Columns 0, 2, 4, 6 of two rows each, and 1, 3, 5, 7.
            let even = [
                _mm512_unpacklo_pd(a, b),
                _mm512_unpacklo_pd(c, d),
                _mm512_unpacklo_pd(e, f),
                _mm512_unpacklo_pd(g, h),
            ];
            let odd = [
                _mm512_unpackhi_pd(a, b),
                _mm512_unpackhi_pd(c, d),
                _mm512_unpackhi_pd(e, f),
                _mm512_unpackhi_pd(g, h),
            ];
            for (first, [ab, cd, ef, gh]) in [even, odd].into_iter().enumerate() {
                // Columns 0 and 4 of four rows each, 2 and 6.
                let (low, high) =
                    (_mm512_shuffle_f64x2::<0x88>(ab, cd), _mm512_shuffle_f64x2::<0x88>(ef, gh));
                columns[first] = Avx512(_mm512_shuffle_f64x2::<0x88>(low, high));
                columns[first + 4] = Avx512(_mm512_shuffle_f64x2::<0xDD>(low, high));
                let (low, high) =
                    (_mm512_shuffle_f64x2::<0xDD>(ab, cd), _mm512_shuffle_f64x2::<0xDD>(ef, gh));
                columns[first + 2] = Avx512(_mm512_shuffle_f64x2::<0x88>(low, high));
                columns[first + 6] = Avx512(_mm512_shuffle_f64x2::<0xDD>(low, high));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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

    #[test]
    fn every_instruction_set_rounds_alike() {
        agrees_with_plain::<f64>();
        agrees_with_plain::<Pair>();
        #[cfg(target_arch = "x86_64")]
        {
            use crate::simd::isa::Isa;
            for isa in Isa::available() {
                match isa {
                    Isa::Portable => {}
                    Isa::Avx2 => agrees_with_plain::<Avx2>(),
                    Isa::Avx512 => agrees_with_plain::<Avx512>(),
                }
            }
        }
    }
}
