//! Sixteen f32 lanes side by side, or four groups of four, on each instruction set: the only place with intrinsics.
//!
//! All of this is culling: a lane may be rounded differently from one instruction set to the next (fused or
//! not) without a trace in the answer, since `wavefront.rs` allows for either.

/// Lanes of a vector: children of a node.
pub(crate) const LANES: usize = 16;

/// A vector in memory.
pub(crate) type Row = [f32; LANES];

/// Lanes of a group: facets of a leaf.
pub(crate) const GROUP: usize = 4;

/// Groups of a vector.
pub(crate) const GROUPS: usize = LANES / GROUP;

/// A group in memory.
pub(crate) type Quad = [f32; GROUP];

/// The bits of a key that number a lane.
const LANE_BITS: u32 = LANES as u32 - 1;

/// Sixteen f32 lanes. Comparisons with a NaN are false. A method may be called only where the processor has the
/// implementation's instruction set; the kernel's entry points see to that.
pub(crate) trait Lanes: Copy {
    /// A truth value for each lane.
    type Mask: Copy;

    fn splat(x: f32) -> Self;
    fn load(row: &Row) -> Self;
    /// A group of each.
    fn groups(quads: [&Quad; GROUPS]) -> Self;
    /// Lane `i` of each group in all of its lanes.
    fn spread(self, i: usize) -> Self;
    fn store(self, to: &mut Row);
    fn add(self, other: Self) -> Self;
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    /// self · factor + addend, fused or not.
    fn mul_add(self, factor: Self, addend: Self) -> Self;
    /// self · factor − subtrahend, fused or not.
    fn mul_sub(self, factor: Self, subtrahend: Self) -> Self;
    /// 1/self within 1.1 · 2⁻²⁴ of itself; infinite or NaN for 0.
    fn recip(self) -> Self;
    fn min(self, other: Self) -> Self;
    /// The greater; `other` where both are zero.
    fn max(self, other: Self) -> Self;
    fn abs(self) -> Self;
    /// `self` in the lanes where `sign` is negative, else 0.
    fn where_negative(self, sign: Self) -> Self;
    /// 0 in the lanes of a mask.
    fn zero_where(self, mask: Self::Mask) -> Self;
    fn le(self, other: Self) -> Self::Mask;
    /// Whether the bits of a lane differ.
    fn differs(self, other: Self) -> Self::Mask;
    /// The first `count` lanes.
    fn first(count: usize) -> Self::Mask;
    fn and(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    fn or(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// Bit i: lane i.
    fn bits(mask: Self::Mask) -> u32;
    /// The least lane of a mask in each group; infinite where there is none.
    fn least_of_groups(self, mask: Self::Mask) -> Self;
    /// The least of the keys of the lanes of a mask, `u32::MAX` where there is none. The key of a lane that is
    /// not negative is its bits, the last four of them replaced by the lane's number.
    fn least_key_in(self, mask: Self::Mask) -> u32;
    /// The same of all lanes.
    fn least_key(self) -> u32;
    /// Writes the lanes whose bits are set to the front of `to`, in order; what follows them is arbitrary.
    fn compress(self, bits: u32, to: &mut Row);
    /// The same of one group.
    fn compress_group(group: &Quad, bits: u32, to: &mut Quad);
}

/// COMPRESS_GROUP[bits]: the set lanes of four in order.
static COMPRESS_GROUP: [[i32; GROUP]; 1 << GROUP] = {
    let mut table = [[0; GROUP]; 1 << GROUP];
    let mut bits = 0;
    while bits < table.len() {
        let (mut lane, mut next) = (0, 0);
        while lane < GROUP {
            if bits >> lane & 1 == 1 {
                table[bits][next] = lane as i32;
                next += 1;
            }
            lane += 1;
        }
        bits += 1;
    }
    table
};

/// The lane that a key names.
#[inline(always)]
pub(crate) fn lane_of(key: u32) -> usize {
    (key & LANE_BITS) as usize
}

/// At most the value whose key this is, as bits.
#[inline(always)]
pub(crate) fn value_of(key: u32) -> u32 {
    key & !LANE_BITS
}

/// Plain Rust, which compilers turn into whatever vectors the target has.
#[derive(Clone, Copy)]
pub(crate) struct Portable(Row);

impl Portable {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Portable(std::array::from_fn(|i| f(self.0[i], other.0[i])))
    }
}

impl Lanes for Portable {
    /// All ones or none.
    type Mask = [u32; LANES];

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Portable([x; LANES])
    }
    #[inline(always)]
    fn load(row: &Row) -> Self {
        Portable(*row)
    }
    #[inline(always)]
    fn groups(quads: [&Quad; GROUPS]) -> Self {
        Portable(std::array::from_fn(|i| quads[i / GROUP][i % GROUP]))
    }
    #[inline(always)]
    fn spread(self, i: usize) -> Self {
        Portable(std::array::from_fn(|lane| self.0[lane / GROUP * GROUP + i]))
    }
    #[inline(always)]
    fn store(self, to: &mut Row) {
        *to = self.0;
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        self.mul(factor).add(addend)
    }
    #[inline(always)]
    fn mul_sub(self, factor: Self, subtrahend: Self) -> Self {
        self.mul(factor).sub(subtrahend)
    }
    #[inline(always)]
    fn recip(self) -> Self {
        Self::splat(1.0).zip(self, |a, b| a / b)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Portable(self.0.map(f32::abs))
    }
    #[inline(always)]
    fn where_negative(self, sign: Self) -> Self {
        self.zip(sign, |a, s| f32::from_bits(a.to_bits() & ((s.to_bits() as i32) >> 31) as u32))
    }
    #[inline(always)]
    fn zero_where(self, mask: [u32; LANES]) -> Self {
        Portable(std::array::from_fn(|i| f32::from_bits(self.0[i].to_bits() & !mask[i])))
    }
    #[inline(always)]
    fn le(self, other: Self) -> [u32; LANES] {
        std::array::from_fn(|i| if self.0[i] <= other.0[i] { u32::MAX } else { 0 })
    }
    #[inline(always)]
    fn differs(self, other: Self) -> [u32; LANES] {
        std::array::from_fn(|i| if self.0[i].to_bits() == other.0[i].to_bits() { 0 } else { u32::MAX })
    }
    #[inline(always)]
    fn first(count: usize) -> [u32; LANES] {
        std::array::from_fn(|i| if i < count { u32::MAX } else { 0 })
    }
    #[inline(always)]
    fn and(a: [u32; LANES], b: [u32; LANES]) -> [u32; LANES] {
        std::array::from_fn(|i| a[i] & b[i])
    }
    #[inline(always)]
    fn or(a: [u32; LANES], b: [u32; LANES]) -> [u32; LANES] {
        std::array::from_fn(|i| a[i] | b[i])
    }
    #[inline(always)]
    fn bits(mask: [u32; LANES]) -> u32 {
        (0..LANES).fold(0, |bits, i| bits | mask[i] & 1 << i)
    }
    #[inline(always)]
    fn least_of_groups(self, mask: [u32; LANES]) -> Self {
        let value = |i: usize| if mask[i] == 0 { f32::INFINITY } else { self.0[i] };
        let least = |first: usize| {
            (first..first + GROUP)
                .fold(f32::INFINITY, |least, i| if value(i) < least { value(i) } else { least })
        };
        Portable(std::array::from_fn(|i| least(i / GROUP * GROUP)))
    }
    #[inline(always)]
    fn least_key_in(self, mask: [u32; LANES]) -> u32 {
        (0..LANES).fold(u32::MAX, |least, i| least.min(value_of(self.0[i].to_bits()) | i as u32 | !mask[i]))
    }
    #[inline(always)]
    fn least_key(self) -> u32 {
        self.least_key_in([u32::MAX; LANES])
    }
    #[inline(always)]
    fn compress(self, bits: u32, to: &mut Row) {
        let mut next = 0;
        for i in 0..LANES {
            to[next & (LANES - 1)] = self.0[i];
            next += (bits >> i & 1) as usize;
        }
    }
    #[inline(always)]
    fn compress_group(group: &Quad, bits: u32, to: &mut Quad) {
        *to = COMPRESS_GROUP[bits as usize].map(|lane| group[lane as usize]);
    }
}

#[cfg(target_arch = "x86_64")]
pub(crate) use x86::{Avx2, Avx512};

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::*;

    use super::{COMPRESS_GROUP, GROUPS, LANE_BITS, LANES, Lanes, Quad, Row};

    /// The lanes' numbers.
    static NUMBERS: [i32; LANES] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];

    /// AVX2 and fused multiply-add, two registers for a vector.
    #[derive(Clone, Copy)]
    pub struct Avx2([__m256; 2]);

    /// COMPRESS[bits]: the set lanes of eight in order, a byte each.
    static COMPRESS: [u64; 256] = {
        let mut table = [0; 256];
        let mut bits = 0;
        while bits < table.len() {
            let (mut lane, mut shift) = (0, 0);
            while lane < 8 {
                if bits >> lane & 1 == 1 {
                    table[bits] |= (lane as u64) << shift;
                    shift += 8;
                }
                lane += 1;
            }
            bits += 1;
        }
        table
    };

    impl Avx2 {
        #[inline(always)]
        fn zip(self, other: Self, f: impl Fn(__m256, __m256) -> __m256) -> Self {
            Avx2([f(self.0[0], other.0[0]), f(self.0[1], other.0[1])])
        }

        #[inline(always)]
        fn map(self, f: impl Fn(__m256) -> __m256) -> Self {
            Avx2([f(self.0[0]), f(self.0[1])])
        }

        #[inline(always)]
        fn keys(self) -> [__m256i; 2] {
            // SAFETY: as for the implementation of `Lanes`.
            [0, 1].map(|half| unsafe {
                let number = _mm256_loadu_si256(NUMBERS.as_ptr().add(8 * half).cast());
                let value = _mm256_castps_si256(self.0[half]);
                _mm256_or_si256(_mm256_andnot_si256(_mm256_set1_epi32(LANE_BITS as i32), value), number)
            })
        }
    }

    /// The least of eight u32 twice.
    #[inline(always)]
    fn least_u32([a, b]: [__m256i; 2]) -> u32 {
        // SAFETY: as for the implementations of `Lanes`.
        unsafe {
            let x = _mm256_min_epu32(a, b);
            let x = _mm_min_epu32(_mm256_castsi256_si128(x), _mm256_extracti128_si256::<1>(x));
            let x = _mm_min_epu32(x, _mm_shuffle_epi32::<0b01_00_11_10>(x));
            let x = _mm_min_epu32(x, _mm_shuffle_epi32::<0b10_11_00_01>(x));
            _mm_cvtsi128_si32(x) as u32
        }
    }

    #[inline(always)]
    fn compress_group(group: &Quad, bits: u32, to: &mut Quad) {
        // SAFETY: as for the implementations of `Lanes`.
        unsafe {
            let order = _mm_loadu_si128(COMPRESS_GROUP[bits as usize].as_ptr().cast());
            _mm_storeu_ps(to.as_mut_ptr(), _mm_permutevar_ps(_mm_loadu_ps(group.as_ptr()), order));
        }
    }

    // SAFETY of every block here and below: the entry points of the kernel have made sure of the instruction
    // set; loads and stores are of parts of a `Row`.
    impl Lanes for Avx2 {
        type Mask = [__m256; 2];

        #[inline(always)]
        fn splat(x: f32) -> Self {
            Avx2([unsafe { _mm256_set1_ps(x) }; 2])
        }
        #[inline(always)]
        fn load(row: &Row) -> Self {
            Avx2(unsafe { [_mm256_loadu_ps(row.as_ptr()), _mm256_loadu_ps(row.as_ptr().add(8))] })
        }
        #[inline(always)]
        fn groups([a, b, c, d]: [&Quad; GROUPS]) -> Self {
            unsafe {
                Avx2([_mm256_loadu2_m128(b.as_ptr(), a.as_ptr()), _mm256_loadu2_m128(d.as_ptr(), c.as_ptr())])
            }
        }
        #[inline(always)]
        fn spread(self, i: usize) -> Self {
            self.map(|x| unsafe {
                match i {
                    0 => _mm256_permute_ps::<0b00_00_00_00>(x),
                    1 => _mm256_permute_ps::<0b01_01_01_01>(x),
                    2 => _mm256_permute_ps::<0b10_10_10_10>(x),
                    _ => _mm256_permute_ps::<0b11_11_11_11>(x),
                }
            })
        }
        #[inline(always)]
        fn store(self, to: &mut Row) {
            unsafe {
                _mm256_storeu_ps(to.as_mut_ptr(), self.0[0]);
                _mm256_storeu_ps(to.as_mut_ptr().add(8), self.0[1]);
            }
        }
        #[inline(always)]
        fn add(self, other: Self) -> Self {
            self.zip(other, |a, b| unsafe { _mm256_add_ps(a, b) })
        }
        #[inline(always)]
        fn sub(self, other: Self) -> Self {
            self.zip(other, |a, b| unsafe { _mm256_sub_ps(a, b) })
        }
        #[inline(always)]
        fn mul(self, other: Self) -> Self {
            self.zip(other, |a, b| unsafe { _mm256_mul_ps(a, b) })
        }
        #[inline(always)]
        fn mul_add(self, factor: Self, addend: Self) -> Self {
            Avx2([0, 1].map(|i| unsafe { _mm256_fmadd_ps(self.0[i], factor.0[i], addend.0[i]) }))
        }
        #[inline(always)]
        fn mul_sub(self, factor: Self, subtrahend: Self) -> Self {
            Avx2([0, 1].map(|i| unsafe { _mm256_fmsub_ps(self.0[i], factor.0[i], subtrahend.0[i]) }))
        }
        #[inline(always)]
        fn recip(self) -> Self {
            self.map(|x| unsafe { _mm256_div_ps(_mm256_set1_ps(1.0), x) })
        }
        #[inline(always)]
        fn min(self, other: Self) -> Self {
            self.zip(other, |a, b| unsafe { _mm256_min_ps(a, b) })
        }
        #[inline(always)]
        fn max(self, other: Self) -> Self {
            self.zip(other, |a, b| unsafe { _mm256_max_ps(a, b) })
        }
        #[inline(always)]
        fn abs(self) -> Self {
            self.map(|x| unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), x) })
        }
        #[inline(always)]
        fn where_negative(self, sign: Self) -> Self {
            self.zip(sign, |x, sign| unsafe {
                _mm256_and_ps(x, _mm256_castsi256_ps(_mm256_srai_epi32::<31>(_mm256_castps_si256(sign))))
            })
        }
        #[inline(always)]
        fn zero_where(self, mask: [__m256; 2]) -> Self {
            self.zip(Avx2(mask), |x, mask| unsafe { _mm256_andnot_ps(mask, x) })
        }
        #[inline(always)]
        fn le(self, other: Self) -> [__m256; 2] {
            self.zip(other, |a, b| unsafe { _mm256_cmp_ps::<_CMP_LE_OQ>(a, b) }).0
        }
        #[inline(always)]
        fn differs(self, other: Self) -> [__m256; 2] {
            self.zip(other, |a, b| unsafe {
                let same = _mm256_cmpeq_epi32(_mm256_castps_si256(a), _mm256_castps_si256(b));
                _mm256_castsi256_ps(_mm256_xor_si256(same, _mm256_set1_epi32(-1)))
            })
            .0
        }
        #[inline(always)]
        fn first(count: usize) -> [__m256; 2] {
            [0, 1].map(|half| unsafe {
                let numbers = _mm256_loadu_si256(NUMBERS.as_ptr().add(8 * half).cast());
                _mm256_castsi256_ps(_mm256_cmpgt_epi32(_mm256_set1_epi32(count as i32), numbers))
            })
        }
        #[inline(always)]
        fn and(a: [__m256; 2], b: [__m256; 2]) -> [__m256; 2] {
            Avx2(a).zip(Avx2(b), |a, b| unsafe { _mm256_and_ps(a, b) }).0
        }
        #[inline(always)]
        fn or(a: [__m256; 2], b: [__m256; 2]) -> [__m256; 2] {
            Avx2(a).zip(Avx2(b), |a, b| unsafe { _mm256_or_ps(a, b) }).0
        }
        #[inline(always)]
        fn bits(mask: [__m256; 2]) -> u32 {
            unsafe { (_mm256_movemask_ps(mask[0]) | _mm256_movemask_ps(mask[1]) << 8) as u32 }
        }
        #[inline(always)]
        fn least_of_groups(self, mask: [__m256; 2]) -> Self {
            self.zip(Avx2(mask), |x, mask| unsafe {
                let x = _mm256_blendv_ps(_mm256_set1_ps(f32::INFINITY), x, mask);
                let x = _mm256_min_ps(x, _mm256_permute_ps::<0b01_00_11_10>(x));
                _mm256_min_ps(x, _mm256_permute_ps::<0b10_11_00_01>(x))
            })
        }
        #[inline(always)]
        fn least_key_in(self, mask: [__m256; 2]) -> u32 {
            let [a, b] = self.keys();
            least_u32([(a, mask[0]), (b, mask[1])].map(|(key, mask)| unsafe {
                _mm256_or_si256(key, _mm256_xor_si256(_mm256_castps_si256(mask), _mm256_set1_epi32(-1)))
            }))
        }
        #[inline(always)]
        fn least_key(self) -> u32 {
            least_u32(self.keys())
        }
        #[inline(always)]
        fn compress(self, bits: u32, to: &mut Row) {
            let front = |x: __m256, bits: u32| unsafe {
                let order = COMPRESS[(bits & 255) as usize];
                _mm256_permutevar8x32_ps(x, _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(order as i64)))
            };
            unsafe {
                _mm256_storeu_ps(to.as_mut_ptr(), front(self.0[0], bits));
                let next = to.as_mut_ptr().add((bits & 255).count_ones() as usize);
                _mm256_storeu_ps(next, front(self.0[1], bits >> 8));
            }
        }
        #[inline(always)]
        fn compress_group(group: &Quad, bits: u32, to: &mut Quad) {
            compress_group(group, bits, to);
        }
    }

    /// AVX-512: foundation, VL and DQ.
    #[derive(Clone, Copy)]
    pub struct Avx512(__m512);

    impl Avx512 {
        #[inline(always)]
        fn keys(self) -> __m512i {
            unsafe {
                let numbers = _mm512_loadu_si512(NUMBERS.as_ptr().cast());
                let low = _mm512_set1_epi32(LANE_BITS as i32);
                _mm512_or_si512(_mm512_andnot_si512(low, _mm512_castps_si512(self.0)), numbers)
            }
        }
    }

    impl Lanes for Avx512 {
        type Mask = __mmask16;

        #[inline(always)]
        fn splat(x: f32) -> Self {
            Self(unsafe { _mm512_set1_ps(x) })
        }
        #[inline(always)]
        fn load(row: &Row) -> Self {
            Self(unsafe { _mm512_loadu_ps(row.as_ptr()) })
        }
        #[inline(always)]
        fn groups([a, b, c, d]: [&Quad; GROUPS]) -> Self {
            unsafe {
                let x = _mm512_castps128_ps512(_mm_loadu_ps(a.as_ptr()));
                let x = _mm512_insertf32x4::<1>(x, _mm_loadu_ps(b.as_ptr()));
                let x = _mm512_insertf32x4::<2>(x, _mm_loadu_ps(c.as_ptr()));
                Self(_mm512_insertf32x4::<3>(x, _mm_loadu_ps(d.as_ptr())))
            }
        }
        #[inline(always)]
        fn spread(self, i: usize) -> Self {
            Self(unsafe {
                match i {
                    0 => _mm512_permute_ps::<0b00_00_00_00>(self.0),
                    1 => _mm512_permute_ps::<0b01_01_01_01>(self.0),
                    2 => _mm512_permute_ps::<0b10_10_10_10>(self.0),
                    _ => _mm512_permute_ps::<0b11_11_11_11>(self.0),
                }
            })
        }
        #[inline(always)]
        fn store(self, to: &mut Row) {
            unsafe { _mm512_storeu_ps(to.as_mut_ptr(), self.0) }
        }
        #[inline(always)]
        fn add(self, other: Self) -> Self {
            Self(unsafe { _mm512_add_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn sub(self, other: Self) -> Self {
            Self(unsafe { _mm512_sub_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn mul(self, other: Self) -> Self {
            Self(unsafe { _mm512_mul_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn mul_add(self, factor: Self, addend: Self) -> Self {
            Self(unsafe { _mm512_fmadd_ps(self.0, factor.0, addend.0) })
        }
        #[inline(always)]
        fn mul_sub(self, factor: Self, subtrahend: Self) -> Self {
            Self(unsafe { _mm512_fmsub_ps(self.0, factor.0, subtrahend.0) })
        }
        #[inline(always)]
        fn recip(self) -> Self {
            // An estimate within 2⁻¹⁴ and a step of Newton's method: a division would keep a port busy four times as
            // long.
            unsafe {
                let estimate = _mm512_rcp14_ps(self.0);
                let rest = _mm512_fnmadd_ps(self.0, estimate, _mm512_set1_ps(1.0));
                Self(_mm512_fmadd_ps(estimate, rest, estimate))
            }
        }
        #[inline(always)]
        fn min(self, other: Self) -> Self {
            Self(unsafe { _mm512_min_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn max(self, other: Self) -> Self {
            Self(unsafe { _mm512_max_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn abs(self) -> Self {
            Self(unsafe { _mm512_abs_ps(self.0) })
        }
        #[inline(always)]
        fn where_negative(self, sign: Self) -> Self {
            Self(unsafe { _mm512_maskz_mov_ps(_mm512_movepi32_mask(_mm512_castps_si512(sign.0)), self.0) })
        }
        #[inline(always)]
        fn zero_where(self, mask: __mmask16) -> Self {
            Self(unsafe { _mm512_maskz_mov_ps(!mask, self.0) })
        }
        #[inline(always)]
        fn le(self, other: Self) -> __mmask16 {
            unsafe { _mm512_cmp_ps_mask::<_CMP_LE_OQ>(self.0, other.0) }
        }
        #[inline(always)]
        fn differs(self, other: Self) -> __mmask16 {
            unsafe { _mm512_cmpneq_epi32_mask(_mm512_castps_si512(self.0), _mm512_castps_si512(other.0)) }
        }
        #[inline(always)]
        fn first(count: usize) -> __mmask16 {
            ((1_u32 << count) - 1) as __mmask16
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
            unsafe {
                let x = _mm512_mask_blend_ps(mask, _mm512_set1_ps(f32::INFINITY), self.0);
                let x = _mm512_min_ps(x, _mm512_permute_ps::<0b01_00_11_10>(x));
                Self(_mm512_min_ps(x, _mm512_permute_ps::<0b10_11_00_01>(x)))
            }
        }
        #[inline(always)]
        fn least_key_in(self, mask: __mmask16) -> u32 {
            unsafe {
                let x = _mm512_mask_blend_epi32(mask, _mm512_set1_epi32(-1), self.keys());
                least_u32([_mm512_castsi512_si256(x), _mm512_extracti32x8_epi32::<1>(x)])
            }
        }
        #[inline(always)]
        fn least_key(self) -> u32 {
            unsafe {
                let x = self.keys();
                least_u32([_mm512_castsi512_si256(x), _mm512_extracti32x8_epi32::<1>(x)])
            }
        }
        #[inline(always)]
        fn compress(self, bits: u32, to: &mut Row) {
            unsafe {
                _mm512_storeu_ps(to.as_mut_ptr(), _mm512_maskz_compress_ps(bits as __mmask16, self.0));
            }
        }
        #[inline(always)]
        fn compress_group(group: &Quad, bits: u32, to: &mut Quad) {
            compress_group(group, bits, to);
        }
    }
}
