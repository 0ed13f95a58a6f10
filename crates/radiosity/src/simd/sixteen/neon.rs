//! Sixteen f32 in four registers of NEON.

use std::arch::aarch64::*;

use super::{COMPRESS_GROUP, GROUP, GROUPS, LANE_BITS, LANES, NO_KEY, Quad, Row, Sixteen};
use crate::simd::intrinsics::registers;

/// NEON with fused multiply-add, four registers for a vector.
#[derive(Clone, Copy)]
pub(in crate::simd) struct Neon([float32x4_t; GROUPS]);

/// A truth value for each lane: all bits set or none.
type Mask = [uint32x4_t; GROUPS];

/// The number of each lane.
static NUMBERS: [u32; LANES] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];

/// The bit of each lane.
static WEIGHTS: [u32; LANES] = {
    let mut weights = [1; LANES];
    let mut lane = 0;
    while lane < LANES {
        weights[lane] <<= lane;
        lane += 1;
    }
    weights
};

/// The bytes of [`COMPRESS_GROUP`].
static COMPRESS_BYTES: [[u8; 4 * GROUP]; 1 << GROUP] = {
    let mut table = [[0; 4 * GROUP]; 1 << GROUP];
    let mut bits = 0;
    while bits < table.len() {
        let mut byte = 0;
        while byte < 4 * GROUP {
            table[bits][byte] = 4 * COMPRESS_GROUP[bits][byte / 4] as u8 + byte as u8 % 4;
            byte += 1;
        }
        bits += 1;
    }
    table
};

#[inline(always)]
fn load_quad(quad: &Quad) -> float32x4_t {
    // SAFETY: a group has four lanes.
    unsafe { vld1q_f32(quad.as_ptr()) }
}

/// A group of a row of integers.
#[inline(always)]
fn integers(row: &[u32; LANES], group: usize) -> uint32x4_t {
    assert!(group < GROUPS);
    // SAFETY: a row has `GROUPS` groups of four lanes.
    unsafe { vld1q_u32(row.as_ptr().add(GROUP * group)) }
}

/// Bit i: lane i of a mask.
#[inline(always)]
fn bits(mask: Mask) -> u32 {
    let weights = [0, 1, 2, 3].map(|group| integers(&WEIGHTS, group));
    let [a, b, c, d] = [0, 1, 2, 3].map(|group| registers!(vandq_u32(mask[group], weights[group])));
    registers!(vaddvq_u32(vorrq_u32(vorrq_u32(a, b), vorrq_u32(c, d))))
}

impl Neon {
    #[inline(always)]
    fn map(self, f: impl Fn(float32x4_t) -> float32x4_t) -> Self {
        Neon(self.0.map(f))
    }

    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(float32x4_t, float32x4_t) -> float32x4_t) -> Self {
        Neon([0, 1, 2, 3].map(|group| f(self.0[group], other.0[group])))
    }

    /// Lane by lane of the bits of both.
    #[inline(always)]
    fn zip_bits(self, other: Self, f: impl Fn(uint32x4_t, uint32x4_t) -> uint32x4_t) -> Mask {
        let (a, b) = (self.to_bits(), other.to_bits());
        [0, 1, 2, 3].map(|group| f(a[group], b[group]))
    }

    #[inline(always)]
    fn to_bits(self) -> Mask {
        self.0.map(|x| registers!(vreinterpretq_u32_f32(x)))
    }

    #[inline(always)]
    fn from_bits(bits: Mask) -> Self {
        Neon(bits.map(|x| registers!(vreinterpretq_f32_u32(x))))
    }

    /// A key, or what takes the place of one, in all lanes.
    #[inline(always)]
    fn splat_bits(bits: u32) -> Self {
        Self::from_bits([registers!(vdupq_n_u32(bits)); GROUPS])
    }
}

impl Sixteen for Neon {
    type Mask = Mask;

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Neon([registers!(vdupq_n_f32(x)); GROUPS])
    }
    #[inline(always)]
    fn load(row: &Row) -> Self {
        let quads = row.as_chunks::<GROUP>().0;
        Neon([0, 1, 2, 3].map(|group| load_quad(&quads[group])))
    }
    #[inline(always)]
    fn groups(quads: [&Quad; GROUPS]) -> Self {
        Neon(quads.map(load_quad))
    }
    #[inline(always)]
    fn spread(self, i: usize) -> Self {
        self.map(|x| {
            registers!({
                match i {
                    0 => vdupq_laneq_f32::<0>(x),
                    1 => vdupq_laneq_f32::<1>(x),
                    2 => vdupq_laneq_f32::<2>(x),
                    _ => vdupq_laneq_f32::<3>(x),
                }
            })
        })
    }
    #[inline(always)]
    fn store(self, to: &mut Row) {
        let quads = to.as_chunks_mut::<GROUP>().0;
        for (quad, group) in quads.iter_mut().zip(self.0) {
            // SAFETY: a group has four lanes.
            unsafe { vst1q_f32(quad.as_mut_ptr(), group) }
        }
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| registers!(vaddq_f32(a, b)))
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| registers!(vsubq_f32(a, b)))
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| registers!(vmulq_f32(a, b)))
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        Neon([0, 1, 2, 3].map(|group| registers!(vfmaq_f32(addend.0[group], self.0[group], factor.0[group]))))
    }
    #[inline(always)]
    fn mul_sub(self, factor: Self, subtrahend: Self) -> Self {
        self.mul_add(factor, subtrahend.map(|x| registers!(vnegq_f32(x))))
    }
    #[inline(always)]
    fn recip(self) -> Self {
        self.map(|x| registers!(vdivq_f32(vdupq_n_f32(1.0), x)))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| registers!(vminq_f32(a, b)))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| registers!(vmaxq_f32(a, b)))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.map(|x| registers!(vabsq_f32(x)))
    }
    #[inline(always)]
    fn where_negative(self, sign: Self) -> Self {
        Self::from_bits(self.zip_bits(sign, |x, sign| {
            let negative = registers!(vreinterpretq_u32_s32(vshrq_n_s32::<31>(vreinterpretq_s32_u32(sign))));
            registers!(vandq_u32(x, negative))
        }))
    }
    #[inline(always)]
    fn zero_where(self, mask: Mask) -> Self {
        Self::from_bits(self.zip_bits(Self::from_bits(mask), |x, mask| registers!(vbicq_u32(x, mask))))
    }
    #[inline(always)]
    fn le(self, other: Self) -> Mask {
        [0, 1, 2, 3].map(|group| registers!(vcleq_f32(self.0[group], other.0[group])))
    }
    #[inline(always)]
    fn differs(self, other: Self) -> Mask {
        self.zip_bits(other, |a, b| registers!(vmvnq_u32(vceqq_u32(a, b))))
    }
    #[inline(always)]
    fn and(a: Mask, b: Mask) -> Mask {
        Self::from_bits(a).zip_bits(Self::from_bits(b), |a, b| registers!(vandq_u32(a, b)))
    }
    #[inline(always)]
    fn or(a: Mask, b: Mask) -> Mask {
        Self::from_bits(a).zip_bits(Self::from_bits(b), |a, b| registers!(vorrq_u32(a, b)))
    }
    #[inline(always)]
    fn bits(mask: Mask) -> u32 {
        bits(mask)
    }
    #[inline(always)]
    fn least_of_groups(self, mask: Mask) -> Self {
        Neon([0, 1, 2, 3].map(|group| {
            registers!({
                let x = vbslq_f32(mask[group], self.0[group], vdupq_n_f32(f32::INFINITY));
                vdupq_n_f32(vminvq_f32(x))
            })
        }))
    }
    #[inline(always)]
    fn keys(self, mask: Mask) -> Self {
        let x = self.to_bits();
        Self::from_bits([0, 1, 2, 3].map(|group| {
            let number = integers(&NUMBERS, group);
            registers!({
                let key = vbslq_u32(vdupq_n_u32(LANE_BITS), number, x[group]);
                vbslq_u32(mask[group], key, vdupq_n_u32(NO_KEY))
            })
        }))
    }
    #[inline(always)]
    fn least(self) -> u32 {
        let [a, b, c, d] = self.to_bits();
        registers!(vminvq_u32(vminq_u32(vminq_u32(a, b), vminq_u32(c, d))))
    }
    #[inline(always)]
    fn without(self, key: u32) -> Self {
        // No key has its sign bit set.
        let put = |x, key| registers!(vorrq_u32(x, vshrq_n_u32::<1>(vceqq_u32(x, key))));
        Self::from_bits(self.zip_bits(Self::splat_bits(key), put))
    }
    #[inline(always)]
    fn below(self, limit: u32) -> u32 {
        bits(self.zip_bits(Self::splat_bits(limit), |x, limit| registers!(vcltq_u32(x, limit))))
    }
    #[inline(always)]
    fn compress_group(group: &Quad, bits: u32, to: &mut Quad) {
        let group = registers!(vreinterpretq_u8_f32(load_quad(group)));
        // SAFETY: a row of the table has sixteen bytes, and a group four lanes.
        unsafe {
            let order = vld1q_u8(COMPRESS_BYTES[bits as usize].as_ptr());
            vst1q_f32(to.as_mut_ptr(), vreinterpretq_f32_u8(vqtbl1q_u8(group, order)));
        }
    }
}
