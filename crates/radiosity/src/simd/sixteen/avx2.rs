//! Sixteen f32 in two registers of AVX2.

use std::arch::x86_64::*;

use super::{COMPRESS_GROUP, GROUPS, LANE_BITS, LANES, NO_KEY, Quad, Row, Sixteen};
use crate::simd::intrinsics::registers;

/// The number of each lane.
pub(super) static NUMBERS: [i32; LANES] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];

/// AVX2 and fused multiply-add, two registers for a vector.
#[derive(Clone, Copy)]
pub(in crate::simd) struct Avx2([__m256; 2]);

impl Avx2 {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(__m256, __m256) -> __m256) -> Self {
        Avx2([f(self.0[0], other.0[0]), f(self.0[1], other.0[1])])
    }

    #[inline(always)]
    fn map(self, f: impl Fn(__m256) -> __m256) -> Self {
        Avx2([f(self.0[0]), f(self.0[1])])
    }
}

/// The least lane of a mask in each of two groups; infinite where there is none.
#[inline(always)]
fn least_of_two_groups(x: __m256, mask: __m256) -> __m256 {
    registers!({
        let x = _mm256_blendv_ps(_mm256_set1_ps(f32::INFINITY), x, mask);
        let x = _mm256_min_ps(x, _mm256_permute_ps::<0b01_00_11_10>(x));
        _mm256_min_ps(x, _mm256_permute_ps::<0b10_11_00_01>(x))
    })
}

/// The sign bits of eight lanes. By name: of two results of the intrinsic that are joined the compiler makes seven other instructions.
#[inline]
#[target_feature(enable = "avx")]
fn signs(x: __m256) -> u32 {
    let bits;
    // SAFETY: the instruction reads a register and writes another one.
    unsafe {
        std::arch::asm!(
            "vmovmskps {bits:e}, {x}", bits = lateout(reg) bits, x = in(ymm_reg) x,
            options(pure, nomem, nostack, preserves_flags)
        );
    }
    bits
}

/// The keys of the lanes of a mask, given the numbers of the lanes.
#[inline(always)]
fn keys(x: __m256, mask: __m256, numbers: __m256i) -> __m256 {
    registers!({
        let upper = _mm256_andnot_si256(_mm256_set1_epi32(LANE_BITS as i32), _mm256_castps_si256(x));
        let key = _mm256_castsi256_ps(_mm256_or_si256(upper, numbers));
        _mm256_blendv_ps(_mm256_castsi256_ps(_mm256_set1_epi32(NO_KEY as i32)), key, mask)
    })
}

impl Sixteen for Avx2 {
    type Mask = [__m256; 2];

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Avx2([registers!(_mm256_set1_ps(x)); 2])
    }
    #[inline(always)]
    fn load(row: &Row) -> Self {
        // SAFETY: the instruction set is there (see `registers`), and rows and groups are as long as what is read or written.
        Avx2(unsafe { [_mm256_loadu_ps(row.as_ptr()), _mm256_loadu_ps(row.as_ptr().add(8))] })
    }
    #[inline(always)]
    fn groups([a, b, c, d]: [&Quad; GROUPS]) -> Self {
        // SAFETY: the instruction set is there (see `registers`), and rows and groups are as long as what is read or written.
        unsafe {
            Avx2([_mm256_loadu2_m128(b.as_ptr(), a.as_ptr()), _mm256_loadu2_m128(d.as_ptr(), c.as_ptr())])
        }
    }
    #[inline(always)]
    fn spread(self, i: usize) -> Self {
        self.map(|x| {
            registers!({
                match i {
                    0 => _mm256_permute_ps::<0b00_00_00_00>(x),
                    1 => _mm256_permute_ps::<0b01_01_01_01>(x),
                    2 => _mm256_permute_ps::<0b10_10_10_10>(x),
                    _ => _mm256_permute_ps::<0b11_11_11_11>(x),
                }
            })
        })
    }
    #[inline(always)]
    fn store(self, to: &mut Row) {
        // SAFETY: the instruction set is there (see `registers`), and rows and groups are as long as what is read or written.
        unsafe {
            _mm256_storeu_ps(to.as_mut_ptr(), self.0[0]);
            _mm256_storeu_ps(to.as_mut_ptr().add(8), self.0[1]);
        }
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| registers!(_mm256_add_ps(a, b)))
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| registers!(_mm256_sub_ps(a, b)))
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| registers!(_mm256_mul_ps(a, b)))
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        Avx2([0, 1].map(|i| registers!(_mm256_fmadd_ps(self.0[i], factor.0[i], addend.0[i]))))
    }
    #[inline(always)]
    fn mul_sub(self, factor: Self, subtrahend: Self) -> Self {
        Avx2([0, 1].map(|i| registers!(_mm256_fmsub_ps(self.0[i], factor.0[i], subtrahend.0[i]))))
    }
    #[inline(always)]
    fn recip(self) -> Self {
        self.map(|x| registers!(_mm256_div_ps(_mm256_set1_ps(1.0), x)))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| registers!(_mm256_min_ps(a, b)))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| registers!(_mm256_max_ps(a, b)))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.map(|x| registers!(_mm256_andnot_ps(_mm256_set1_ps(-0.0), x)))
    }
    #[inline(always)]
    fn where_negative(self, sign: Self) -> Self {
        self.zip(sign, |x, sign| {
            registers!({
                _mm256_and_ps(x, _mm256_castsi256_ps(_mm256_srai_epi32::<31>(_mm256_castps_si256(sign))))
            })
        })
    }
    #[inline(always)]
    fn zero_where(self, mask: [__m256; 2]) -> Self {
        self.zip(Avx2(mask), |x, mask| registers!(_mm256_andnot_ps(mask, x)))
    }
    #[inline(always)]
    fn le(self, other: Self) -> [__m256; 2] {
        self.zip(other, |a, b| registers!(_mm256_cmp_ps::<_CMP_LE_OQ>(a, b))).0
    }
    #[inline(always)]
    fn differs(self, other: Self) -> [__m256; 2] {
        self.zip(other, |a, b| {
            registers!({
                let same = _mm256_cmpeq_epi32(_mm256_castps_si256(a), _mm256_castps_si256(b));
                _mm256_castsi256_ps(_mm256_xor_si256(same, _mm256_set1_epi32(-1)))
            })
        })
        .0
    }
    #[inline(always)]
    fn and(a: [__m256; 2], b: [__m256; 2]) -> [__m256; 2] {
        Avx2(a).zip(Avx2(b), |a, b| registers!(_mm256_and_ps(a, b))).0
    }
    #[inline(always)]
    fn or(a: [__m256; 2], b: [__m256; 2]) -> [__m256; 2] {
        Avx2(a).zip(Avx2(b), |a, b| registers!(_mm256_or_ps(a, b))).0
    }
    #[inline(always)]
    fn bits(mask: [__m256; 2]) -> u32 {
        registers!(signs(mask[0]) | signs(mask[1]) << 8)
    }
    #[inline(always)]
    fn least_of_groups(self, mask: [__m256; 2]) -> Self {
        self.zip(Avx2(mask), least_of_two_groups)
    }
    #[inline(always)]
    fn keys(self, mask: [__m256; 2]) -> Self {
        // SAFETY: the instruction set is there (see `registers`), and rows and groups are as long as what is read or written.
        let numbers = [0, 8].map(|first| unsafe { _mm256_loadu_si256(NUMBERS.as_ptr().add(first).cast()) });
        Avx2([0, 1].map(|half| keys(self.0[half], mask[half], numbers[half])))
    }
    #[inline(always)]
    fn least(self) -> u32 {
        least_u32(registers!(self.0.map(|half| _mm256_castps_si256(half))))
    }
    #[inline(always)]
    fn without(self, key: u32) -> Self {
        self.map(|x| {
            registers!({
                let same = _mm256_cmpeq_epi32(_mm256_castps_si256(x), _mm256_set1_epi32(key as i32));
                // No key has its sign bit set.
                _mm256_or_ps(x, _mm256_castsi256_ps(_mm256_srli_epi32::<1>(same)))
            })
        })
    }
    #[inline(always)]
    fn below(self, limit: u32) -> u32 {
        // Neither is negative as an integer with a sign.
        let limit = registers!(_mm256_set1_epi32(limit as i32));
        let [a, b] = self.0.map(|x| registers!(_mm256_cmpgt_epi32(limit, _mm256_castps_si256(x))));
        registers!(signs(_mm256_castsi256_ps(a)) | signs(_mm256_castsi256_ps(b)) << 8)
    }
    #[inline(always)]
    fn compress_group(group: &Quad, bits: u32, to: &mut Quad) {
        compress_group(group, bits, to);
    }
}

/// The least of eight u32 twice.
#[inline(always)]
pub(super) fn least_u32([a, b]: [__m256i; 2]) -> u32 {
    registers!({
        let x = _mm256_min_epu32(a, b);
        let x = _mm_min_epu32(_mm256_castsi256_si128(x), _mm256_extracti128_si256::<1>(x));
        let x = _mm_min_epu32(x, _mm_shuffle_epi32::<0b01_00_11_10>(x));
        let x = _mm_min_epu32(x, _mm_shuffle_epi32::<0b10_11_00_01>(x));
        _mm_cvtsi128_si32(x) as u32
    })
}

#[inline(always)]
pub(super) fn compress_group(group: &Quad, bits: u32, to: &mut Quad) {
    // SAFETY: the instruction set is there (see `registers`), and rows and groups are as long as what is read or written.
    unsafe {
        let order = _mm_loadu_si128(COMPRESS_GROUP[bits as usize].as_ptr().cast());
        _mm_storeu_ps(to.as_mut_ptr(), _mm_permutevar_ps(_mm_loadu_ps(group.as_ptr()), order));
    }
}
