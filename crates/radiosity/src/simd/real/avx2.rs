//! Four f64 in a register of AVX2.

use std::arch::x86_64::*;

use super::Real;
use crate::simd::intrinsics::{operator, registers};
use crate::simd::table::Table;

/// Four numbers in a register of AVX2.
#[derive(Clone, Copy)]
pub(in crate::simd) struct Avx2(__m256d);

operator!(Avx2: Add add _mm256_add_pd, Sub sub _mm256_sub_pd, Mul mul _mm256_mul_pd, Div div _mm256_div_pd);
operator!(Avx2: BitAnd bitand _mm256_and_pd);

impl Real for Avx2 {
    type Mask = Self;

    const N: usize = 4;
    const MULTIPLIES_HALVES: bool = true;

    #[inline(always)]
    fn mul_add_f32(a: f32, b: f32, c: f32) -> f32 {
        a.mul_add(b, c)
    }
    #[inline(always)]
    fn splat(x: f64) -> Self {
        Avx2(registers!(_mm256_set1_pd(x)))
    }
    #[inline(always)]
    fn load(from: &[f64]) -> Self {
        assert!(from.len() >= 4);
        // SAFETY: the instruction set is there (see `registers`), and the slices are as long as what is read or written.
        Avx2(unsafe { _mm256_loadu_pd(from.as_ptr()) })
    }
    /// There are no unsigned conversions: 2³¹ less, converted, 2³¹ more, all exact.
    #[inline(always)]
    fn load_u32(from: &[u32]) -> Self {
        assert!(from.len() >= 4);
        // SAFETY: the instruction set is there (see `registers`), and the slices are as long as what is read or written.
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
        // SAFETY: the instruction set is there (see `registers`), and the slices are as long as what is read or written.
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
        // SAFETY: the instruction set is there (see `registers`), and the slices are as long as what is read or written.
        unsafe { _mm256_storeu_pd(to.as_mut_ptr(), self.0) }
    }
    #[inline(always)]
    fn store_u32(self, to: &mut [u32]) {
        assert!(to.len() >= 4);
        // SAFETY: the instruction set is there (see `registers`), and the slices are as long as what is read or written.
        unsafe { _mm_storeu_si128(to.as_mut_ptr().cast(), _mm256_cvttpd_epi32(self.0)) }
    }
    /// Four rows at a time are turned into columns in registers.
    #[inline(always)]
    fn rows<const K: usize>(table: &Table<K>, index: &[u32]) -> [Self; K] {
        const { assert!(K.is_multiple_of(4)) };
        let rows: [&[f64; K]; 4] = std::array::from_fn(|i| table.row(index[i]));
        let mut columns = [Self::splat(0.0); K];
        for first in (0..K).step_by(4) {
            // SAFETY: the instruction set is there (see `registers`), and the slices are as long as what is read or written.
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
        Avx2(registers!(_mm256_andnot_pd(_mm256_set1_pd(-0.0), self.0)))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Avx2(registers!(_mm256_sqrt_pd(self.0)))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Avx2(registers!(_mm256_max_pd(self.0, other.0)))
    }
    #[inline(always)]
    fn floor(self) -> Self {
        Avx2(registers!(_mm256_floor_pd(self.0)))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Self {
        Avx2(registers!(_mm256_cmp_pd::<_CMP_LT_OQ>(self.0, other.0)))
    }
    #[inline(always)]
    fn le(self, other: Self) -> Self {
        Avx2(registers!(_mm256_cmp_pd::<_CMP_LE_OQ>(self.0, other.0)))
    }
    #[inline(always)]
    fn ne(self, other: Self) -> Self {
        Avx2(registers!(_mm256_cmp_pd::<_CMP_NEQ_UQ>(self.0, other.0)))
    }
    /// There are no unsigned comparisons: 2⁶³ less on both sides.
    #[inline(always)]
    fn below(bits: &[u64], thresholds: Self) -> Self {
        assert!(bits.len() >= 4);
        // SAFETY: the instruction set is there (see `registers`), and the slices are as long as what is read or written.
        unsafe {
            let half = _mm256_set1_epi64x(i64::MIN);
            let bits = _mm256_xor_si256(_mm256_loadu_si256(bits.as_ptr().cast()), half);
            let thresholds = _mm256_xor_si256(_mm256_castpd_si256(thresholds.0), half);
            Avx2(_mm256_castsi256_pd(_mm256_cmpgt_epi64(thresholds, bits)))
        }
    }
    #[inline(always)]
    fn bits(mask: Self) -> u64 {
        registers!(_mm256_movemask_pd(mask.0) as u64)
    }
    #[inline(always)]
    fn select(mask: Self, yes: Self, no: Self) -> Self {
        Avx2(registers!(_mm256_blendv_pd(no.0, yes.0, mask.0)))
    }
}
