//! Eight f64 in a register of AVX-512.

use std::arch::x86_64::*;
use std::ops::BitAnd;

use super::Real;
use crate::simd::intrinsics::{operator, registers};
use crate::simd::table::Table;

/// Eight numbers in a register of AVX-512.
#[derive(Clone, Copy)]
pub(in crate::simd) struct Avx512(__m512d);

/// A bit for each.
#[derive(Clone, Copy)]
pub(in crate::simd) struct Mask512(__mmask8);

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
    const MULTIPLIES_HALVES: bool = true;

    #[inline(always)]
    fn mul_add_f32(a: f32, b: f32, c: f32) -> f32 {
        a.mul_add(b, c)
    }
    #[inline(always)]
    fn splat(x: f64) -> Self {
        Avx512(registers!(_mm512_set1_pd(x)))
    }
    #[inline(always)]
    fn load(from: &[f64]) -> Self {
        assert!(from.len() >= 8);
        // SAFETY: the instruction set is there (see `registers`), and the slices are as long as what is read or written.
        Avx512(unsafe { _mm512_loadu_pd(from.as_ptr()) })
    }
    #[inline(always)]
    fn load_u32(from: &[u32]) -> Self {
        assert!(from.len() >= 8);
        // SAFETY: the instruction set is there (see `registers`), and the slices are as long as what is read or written.
        Avx512(unsafe { _mm512_cvtepu32_pd(_mm256_loadu_si256(from.as_ptr().cast())) })
    }
    #[inline(always)]
    fn load_halves(from: &[u64]) -> [Self; 2] {
        assert!(from.len() >= 8);
        // SAFETY: the instruction set is there (see `registers`), and the slices are as long as what is read or written.
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
        // SAFETY: the instruction set is there (see `registers`), and the slices are as long as what is read or written.
        unsafe { _mm512_storeu_pd(to.as_mut_ptr(), self.0) }
    }
    #[inline(always)]
    fn store_u32(self, to: &mut [u32]) {
        assert!(to.len() >= 8);
        // SAFETY: the instruction set is there (see `registers`), and the slices are as long as what is read or written.
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
                // SAFETY: the instruction set is there (see `registers`), and the slices are as long as what is read or written.
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
            let mut numbers = [Self::splat(0.0); 8];
            for (numbers, row) in numbers.iter_mut().zip(rows) {
                *numbers = Self::load(&row[first..]);
            }
            transpose(numbers, &mut found[first..]);
        }
        found
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Avx512(registers!(_mm512_abs_pd(self.0)))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Avx512(registers!(_mm512_sqrt_pd(self.0)))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Avx512(registers!(_mm512_max_pd(self.0, other.0)))
    }
    #[inline(always)]
    fn floor(self) -> Self {
        Avx512(registers!(_mm512_roundscale_pd::<_MM_FROUND_TO_NEG_INF>(self.0)))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Mask512 {
        Mask512(registers!(_mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0, other.0)))
    }
    #[inline(always)]
    fn le(self, other: Self) -> Mask512 {
        Mask512(registers!(_mm512_cmp_pd_mask::<_CMP_LE_OQ>(self.0, other.0)))
    }
    #[inline(always)]
    fn ne(self, other: Self) -> Mask512 {
        Mask512(registers!(_mm512_cmp_pd_mask::<_CMP_NEQ_UQ>(self.0, other.0)))
    }
    #[inline(always)]
    fn below(bits: &[u64], thresholds: Self) -> Mask512 {
        assert!(bits.len() >= 8);
        // SAFETY: the instruction set is there (see `registers`), and the slices are as long as what is read or written.
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
        Avx512(registers!(_mm512_mask_blend_pd(mask.0, no.0, yes.0)))
    }
}

/// Eight rows of eight numbers as eight columns. No closures here: they do not inherit the
/// instruction set.
#[inline(always)]
fn transpose([a, b, c, d, e, f, g, h]: [Avx512; 8], columns: &mut [Avx512]) {
    registers!({
        let (a, b, c, d) = (a.0, b.0, c.0, d.0);
        let (e, f, g, h) = (e.0, f.0, g.0, h.0);
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
            let (low, high) = (_mm512_shuffle_f64x2::<0x88>(ab, cd), _mm512_shuffle_f64x2::<0x88>(ef, gh));
            columns[first] = Avx512(_mm512_shuffle_f64x2::<0x88>(low, high));
            columns[first + 4] = Avx512(_mm512_shuffle_f64x2::<0xDD>(low, high));
            let (low, high) = (_mm512_shuffle_f64x2::<0xDD>(ab, cd), _mm512_shuffle_f64x2::<0xDD>(ef, gh));
            columns[first + 2] = Avx512(_mm512_shuffle_f64x2::<0x88>(low, high));
            columns[first + 6] = Avx512(_mm512_shuffle_f64x2::<0xDD>(low, high));
        }
    })
}
