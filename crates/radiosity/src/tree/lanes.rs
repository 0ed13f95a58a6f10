//! Eight f32 lanes side by side, on each instruction set: the only place with intrinsics.
//!
//! All of this is culling: a lane may be rounded differently from one instruction set to the next (fused or
//! not) without a trace in the answer, since `wavefront.rs` allows for either.

/// Lanes of a vector: children of a node, facets of a leaf.
pub(super) const LANES: usize = 8;

/// A register of lanes, in plain memory.
pub(super) type Row = [f32; LANES];

/// Eight f32 lanes. Comparisons with a NaN are false. A method may be called only where the processor has the
/// implementation's instruction set; the kernel's entry points see to that.
pub(super) trait Lanes: Copy {
    /// A truth value for each lane.
    type Mask: Copy;

    fn splat(x: f32) -> Self;
    fn load(row: &Row) -> Self;
    fn add(self, other: Self) -> Self;
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    /// self · factor + addend, fused or not.
    fn mul_add(self, factor: Self, addend: Self) -> Self;
    /// self · factor − subtrahend, fused or not.
    fn mul_sub(self, factor: Self, subtrahend: Self) -> Self;
    fn recip(self) -> Self;
    fn min(self, other: Self) -> Self;
    fn max(self, other: Self) -> Self;
    fn abs(self) -> Self;
    /// `self` in the lanes where `sign` is negative, else 0.
    fn where_negative(self, sign: Self) -> Self;
    fn le(self, other: Self) -> Self::Mask;
    /// Whether the bits of a lane differ from `bits`.
    fn differs(self, bits: u32) -> Self::Mask;
    fn and(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    fn or(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// Bit i: lane i.
    fn bits(mask: Self::Mask) -> u32;
    /// The least lane of a mask; infinite where there is none.
    fn least(self, mask: Self::Mask) -> f32;
    /// Lane i ^ `flip` in place of lane i.
    fn flip_lanes(self, flip: usize) -> Self;
    /// Writes the lanes whose bits are set to the front of `to`, in order; what follows them is arbitrary.
    fn compress(self, bits: u32, to: &mut Row);
}

/// FLIPS[f][i] = i ^ f.
static FLIPS: [[u32; LANES]; LANES] = {
    let mut table = [[0; LANES]; LANES];
    let mut flip = 0;
    while flip < LANES {
        let mut lane = 0;
        while lane < LANES {
            table[flip][lane] = (lane ^ flip) as u32;
            lane += 1;
        }
        flip += 1;
    }
    table
};

/// Plain Rust, which compilers turn into whatever vectors the target has.
#[derive(Clone, Copy)]
pub(super) struct Portable(Row);

impl Portable {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Portable(std::array::from_fn(|i| f(self.0[i], other.0[i])))
    }
}

impl Lanes for Portable {
    type Mask = [bool; LANES];

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Portable([x; LANES])
    }
    #[inline(always)]
    fn load(row: &Row) -> Self {
        Portable(*row)
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
    fn le(self, other: Self) -> [bool; LANES] {
        std::array::from_fn(|i| self.0[i] <= other.0[i])
    }
    #[inline(always)]
    fn differs(self, bits: u32) -> [bool; LANES] {
        self.0.map(|x| x.to_bits() != bits)
    }
    #[inline(always)]
    fn and(a: [bool; LANES], b: [bool; LANES]) -> [bool; LANES] {
        std::array::from_fn(|i| a[i] & b[i])
    }
    #[inline(always)]
    fn or(a: [bool; LANES], b: [bool; LANES]) -> [bool; LANES] {
        std::array::from_fn(|i| a[i] | b[i])
    }
    #[inline(always)]
    fn bits(mask: [bool; LANES]) -> u32 {
        (0..LANES).fold(0, |bits, i| bits | u32::from(mask[i]) << i)
    }
    #[inline(always)]
    fn least(self, mask: [bool; LANES]) -> f32 {
        (0..LANES)
            .fold(f32::INFINITY, |least, i| if mask[i] && self.0[i] < least { self.0[i] } else { least })
    }
    #[inline(always)]
    fn flip_lanes(self, flip: usize) -> Self {
        Portable(FLIPS[flip & (LANES - 1)].map(|lane| self.0[lane as usize & (LANES - 1)]))
    }
    #[inline(always)]
    fn compress(self, bits: u32, to: &mut Row) {
        let mut next = 0;
        for i in 0..LANES {
            to[next & (LANES - 1)] = self.0[i];
            next += (bits >> i & 1) as usize;
        }
    }
}

#[cfg(target_arch = "x86_64")]
pub(super) use x86::{Avx2, Avx512};

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::*;

    use super::{FLIPS, LANES, Lanes, Row};

    /// COMPRESS[bits]: the set lanes in order, a byte each.
    static COMPRESS: [u64; 1 << LANES] = {
        let mut table = [0; 1 << LANES];
        let mut bits = 0;
        while bits < table.len() {
            let (mut lane, mut shift) = (0, 0);
            while lane < LANES {
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

    /// AVX2 and fused multiply-add.
    #[derive(Clone, Copy)]
    pub struct Avx2(__m256);

    /// AVX-512 F, VL and DQ on the same 256 bits: masks and compression in one instruction.
    #[derive(Clone, Copy)]
    pub struct Avx512(__m256);

    /// What the two have in common. SAFETY of every block: the entry points of the kernel have made sure of the
    /// instruction set; loads and stores are of a whole `Row`.
    macro_rules! common {
        () => {
            #[inline(always)]
            fn splat(x: f32) -> Self {
                Self(unsafe { _mm256_set1_ps(x) })
            }
            #[inline(always)]
            fn load(row: &Row) -> Self {
                Self(unsafe { _mm256_loadu_ps(row.as_ptr()) })
            }
            #[inline(always)]
            fn add(self, other: Self) -> Self {
                Self(unsafe { _mm256_add_ps(self.0, other.0) })
            }
            #[inline(always)]
            fn sub(self, other: Self) -> Self {
                Self(unsafe { _mm256_sub_ps(self.0, other.0) })
            }
            #[inline(always)]
            fn mul(self, other: Self) -> Self {
                Self(unsafe { _mm256_mul_ps(self.0, other.0) })
            }
            #[inline(always)]
            fn mul_add(self, factor: Self, addend: Self) -> Self {
                Self(unsafe { _mm256_fmadd_ps(self.0, factor.0, addend.0) })
            }
            #[inline(always)]
            fn mul_sub(self, factor: Self, subtrahend: Self) -> Self {
                Self(unsafe { _mm256_fmsub_ps(self.0, factor.0, subtrahend.0) })
            }
            #[inline(always)]
            fn recip(self) -> Self {
                Self(unsafe { _mm256_div_ps(_mm256_set1_ps(1.0), self.0) })
            }
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                Self(unsafe { _mm256_min_ps(self.0, other.0) })
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                Self(unsafe { _mm256_max_ps(self.0, other.0) })
            }
            #[inline(always)]
            fn abs(self) -> Self {
                Self(unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0) })
            }
            #[inline(always)]
            fn where_negative(self, sign: Self) -> Self {
                let mask = unsafe { _mm256_srai_epi32::<31>(_mm256_castps_si256(sign.0)) };
                Self(unsafe { _mm256_and_ps(self.0, _mm256_castsi256_ps(mask)) })
            }
            #[inline(always)]
            fn flip_lanes(self, flip: usize) -> Self {
                let order = &FLIPS[flip & (LANES - 1)];
                Self(unsafe { _mm256_permutevar8x32_ps(self.0, _mm256_loadu_si256(order.as_ptr().cast())) })
            }
        };
    }

    /// The least of eight lanes.
    #[inline(always)]
    fn horizontal_min(x: __m256) -> f32 {
        // SAFETY: as for `common`.
        unsafe {
            let x = _mm_min_ps(_mm256_castps256_ps128(x), _mm256_extractf128_ps::<1>(x));
            let x = _mm_min_ps(x, _mm_movehl_ps(x, x));
            _mm_cvtss_f32(_mm_min_ss(x, _mm_movehdup_ps(x)))
        }
    }

    // SAFETY of the blocks in both implementations: as for `common`.
    impl Lanes for Avx2 {
        type Mask = __m256;

        common!();

        #[inline(always)]
        fn le(self, other: Self) -> __m256 {
            unsafe { _mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0) }
        }
        #[inline(always)]
        fn differs(self, bits: u32) -> __m256 {
            unsafe {
                let same = _mm256_cmpeq_epi32(_mm256_castps_si256(self.0), _mm256_set1_epi32(bits as i32));
                _mm256_castsi256_ps(_mm256_xor_si256(same, _mm256_set1_epi32(-1)))
            }
        }
        #[inline(always)]
        fn and(a: __m256, b: __m256) -> __m256 {
            unsafe { _mm256_and_ps(a, b) }
        }
        #[inline(always)]
        fn or(a: __m256, b: __m256) -> __m256 {
            unsafe { _mm256_or_ps(a, b) }
        }
        #[inline(always)]
        fn bits(mask: __m256) -> u32 {
            unsafe { _mm256_movemask_ps(mask) as u32 }
        }
        #[inline(always)]
        fn least(self, mask: __m256) -> f32 {
            horizontal_min(unsafe { _mm256_blendv_ps(_mm256_set1_ps(f32::INFINITY), self.0, mask) })
        }
        #[inline(always)]
        fn compress(self, bits: u32, to: &mut Row) {
            let order = COMPRESS[bits as usize & (COMPRESS.len() - 1)];
            unsafe {
                let order = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(order as i64));
                _mm256_storeu_ps(to.as_mut_ptr(), _mm256_permutevar8x32_ps(self.0, order));
            }
        }
    }

    impl Lanes for Avx512 {
        type Mask = __mmask8;

        common!();

        #[inline(always)]
        fn le(self, other: Self) -> __mmask8 {
            unsafe { _mm256_cmp_ps_mask::<_CMP_LE_OQ>(self.0, other.0) }
        }
        #[inline(always)]
        fn differs(self, bits: u32) -> __mmask8 {
            unsafe { _mm256_cmpneq_epi32_mask(_mm256_castps_si256(self.0), _mm256_set1_epi32(bits as i32)) }
        }
        #[inline(always)]
        fn and(a: __mmask8, b: __mmask8) -> __mmask8 {
            a & b
        }
        #[inline(always)]
        fn or(a: __mmask8, b: __mmask8) -> __mmask8 {
            a | b
        }
        #[inline(always)]
        fn bits(mask: __mmask8) -> u32 {
            u32::from(mask)
        }
        #[inline(always)]
        fn least(self, mask: __mmask8) -> f32 {
            horizontal_min(unsafe { _mm256_mask_blend_ps(mask, _mm256_set1_ps(f32::INFINITY), self.0) })
        }
        #[inline(always)]
        fn compress(self, bits: u32, to: &mut Row) {
            unsafe {
                _mm256_storeu_ps(to.as_mut_ptr(), _mm256_maskz_compress_ps(bits as __mmask8, self.0));
            }
        }
    }
}
