//! Sixteen f32 in a register of AVX-512.

use std::arch::x86_64::*;

use super::avx2::{NUMBERS, compress_group, least_u32};
use super::{GROUPS, LANE_BITS, NO_KEY, Quad, Row, Sixteen};
use crate::simd::intrinsics::registers;

/// AVX-512: foundation, VL and DQ.
#[derive(Clone, Copy)]
pub(in crate::simd) struct Avx512(__m512);

impl Sixteen for Avx512 {
    type Mask = __mmask16;

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Self(registers!(_mm512_set1_ps(x)))
    }
    #[inline(always)]
    fn load(row: &Row) -> Self {
        // SAFETY: the instruction set is there (see `registers`), and rows and groups are as long as what is read or written.
        Self(unsafe { _mm512_loadu_ps(row.as_ptr()) })
    }
    #[inline(always)]
    fn groups([a, b, c, d]: [&Quad; GROUPS]) -> Self {
        // SAFETY: the instruction set is there (see `registers`), and rows and groups are as long as what is read or written.
        unsafe {
            let x = _mm512_castps128_ps512(_mm_loadu_ps(a.as_ptr()));
            let x = _mm512_insertf32x4::<1>(x, _mm_loadu_ps(b.as_ptr()));
            let x = _mm512_insertf32x4::<2>(x, _mm_loadu_ps(c.as_ptr()));
            Self(_mm512_insertf32x4::<3>(x, _mm_loadu_ps(d.as_ptr())))
        }
    }
    #[inline(always)]
    fn spread(self, i: usize) -> Self {
        Self(registers!({
            match i {
                0 => _mm512_permute_ps::<0b00_00_00_00>(self.0),
                1 => _mm512_permute_ps::<0b01_01_01_01>(self.0),
                2 => _mm512_permute_ps::<0b10_10_10_10>(self.0),
                _ => _mm512_permute_ps::<0b11_11_11_11>(self.0),
            }
        }))
    }
    #[inline(always)]
    fn store(self, to: &mut Row) {
        // SAFETY: the instruction set is there (see `registers`), and rows and groups are as long as what is read or written.
        unsafe { _mm512_storeu_ps(to.as_mut_ptr(), self.0) }
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(registers!(_mm512_add_ps(self.0, other.0)))
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(registers!(_mm512_sub_ps(self.0, other.0)))
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(registers!(_mm512_mul_ps(self.0, other.0)))
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        Self(registers!(_mm512_fmadd_ps(self.0, factor.0, addend.0)))
    }
    #[inline(always)]
    fn mul_sub(self, factor: Self, subtrahend: Self) -> Self {
        Self(registers!(_mm512_fmsub_ps(self.0, factor.0, subtrahend.0)))
    }
    #[inline(always)]
    fn recip(self) -> Self {
        // An estimate within 2⁻¹⁴ and a step of Newton's method: a division would keep a port busy four times as
        // long.
        registers!({
            let estimate = _mm512_rcp14_ps(self.0);
            let rest = _mm512_fnmadd_ps(self.0, estimate, _mm512_set1_ps(1.0));
            Self(_mm512_fmadd_ps(estimate, rest, estimate))
        })
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(registers!(_mm512_min_ps(self.0, other.0)))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(registers!(_mm512_max_ps(self.0, other.0)))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(registers!(_mm512_abs_ps(self.0)))
    }
    #[inline(always)]
    fn where_negative(self, sign: Self) -> Self {
        Self(registers!(_mm512_maskz_mov_ps(_mm512_movepi32_mask(_mm512_castps_si512(sign.0)), self.0)))
    }
    #[inline(always)]
    fn zero_where(self, mask: __mmask16) -> Self {
        Self(registers!(_mm512_maskz_mov_ps(!mask, self.0)))
    }
    #[inline(always)]
    fn le(self, other: Self) -> __mmask16 {
        registers!(_mm512_cmp_ps_mask::<_CMP_LE_OQ>(self.0, other.0))
    }
    #[inline(always)]
    fn differs(self, other: Self) -> __mmask16 {
        registers!(_mm512_cmpneq_epi32_mask(_mm512_castps_si512(self.0), _mm512_castps_si512(other.0)))
    }
    #[inline(always)]
    fn and(a: __mmask16, b: __mmask16) -> __mmask16 {
        a & b
    }
    #[inline(always)]
    fn or(a: __mmask16, b: __mmask16) -> __mmask16 {
        a | b
    }
    #[inline(always)]
    fn bits(mask: __mmask16) -> u32 {
        u32::from(mask)
    }
    #[inline(always)]
    fn least_of_groups(self, mask: __mmask16) -> Self {
        registers!({
            let x = _mm512_mask_blend_ps(mask, _mm512_set1_ps(f32::INFINITY), self.0);
            let x = _mm512_min_ps(x, _mm512_permute_ps::<0b01_00_11_10>(x));
            Self(_mm512_min_ps(x, _mm512_permute_ps::<0b10_11_00_01>(x)))
        })
    }
    #[inline(always)]
    fn keys(self, mask: __mmask16) -> Self {
        // SAFETY: the instruction set is there (see `registers`), and rows and groups are as long as what is read or written.
        unsafe {
            let numbers = _mm512_loadu_si512(NUMBERS.as_ptr().cast());
            let upper = _mm512_andnot_si512(_mm512_set1_epi32(LANE_BITS as i32), _mm512_castps_si512(self.0));
            let key = _mm512_or_si512(upper, numbers);
            let none = _mm512_set1_epi32(NO_KEY as i32);
            Self(_mm512_castsi512_ps(_mm512_mask_blend_epi32(mask, none, key)))
        }
    }
    #[inline(always)]
    fn least(self) -> u32 {
        registers!({
            let x = _mm512_castps_si512(self.0);
            least_u32([_mm512_castsi512_si256(x), _mm512_extracti32x8_epi32::<1>(x)])
        })
    }
    #[inline(always)]
    fn without(self, key: u32) -> Self {
        registers!({
            let x = _mm512_castps_si512(self.0);
            let same = _mm512_cmpeq_epi32_mask(x, _mm512_set1_epi32(key as i32));
            Self(_mm512_castsi512_ps(_mm512_mask_blend_epi32(same, x, _mm512_set1_epi32(NO_KEY as i32))))
        })
    }
    #[inline(always)]
    fn below(self, limit: u32) -> u32 {
        let limit = registers!(_mm512_set1_epi32(limit as i32));
        registers!(u32::from(_mm512_cmplt_epu32_mask(_mm512_castps_si512(self.0), limit)))
    }
    #[inline(always)]
    fn compress_group(group: &Quad, bits: u32, to: &mut Quad) {
        compress_group(group, bits, to);
    }
}
