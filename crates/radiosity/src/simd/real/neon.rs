//! Four f64 in two registers of NEON.

use std::arch::aarch64::*;
use std::ops::{Add, BitAnd, Div, Mul, Sub};

use super::Real;
use crate::simd::intrinsics::registers;
use crate::simd::table::Table;

/// Four numbers in two registers of NEON.
#[derive(Clone, Copy)]
pub(in crate::simd) struct Neon([float64x2_t; 2]);

/// All bits of a lane set or none.
#[derive(Clone, Copy)]
pub(in crate::simd) struct NeonMask([uint64x2_t; 2]);

macro_rules! operator {
    ($($trait:ident $method:ident $intrinsic:ident),*) => {
        $(impl $trait for Neon {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Neon([0, 1].map(|half| registers!($intrinsic(self.0[half], other.0[half]))))
            }
        })*
    };
}

operator!(Add add vaddq_f64, Sub sub vsubq_f64, Mul mul vmulq_f64, Div div vdivq_f64);

impl BitAnd for NeonMask {
    type Output = Self;

    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        NeonMask([0, 1].map(|half| registers!(vandq_u64(self.0[half], other.0[half]))))
    }
}

impl Neon {
    #[inline(always)]
    fn compare(self, other: Self, holds: impl Fn(float64x2_t, float64x2_t) -> uint64x2_t) -> NeonMask {
        NeonMask([0, 1].map(|half| holds(self.0[half], other.0[half])))
    }
}

/// Four numbers of 64 bits.
#[inline(always)]
fn words(from: &[u64]) -> [uint64x2_t; 2] {
    assert!(from.len() >= 4);
    // SAFETY: the slice has four numbers.
    unsafe { [vld1q_u64(from.as_ptr()), vld1q_u64(from.as_ptr().add(2))] }
}

/// Two numbers of a row of a table.
#[inline(always)]
fn two<const K: usize>(row: &[f64; K], first: usize) -> float64x2_t {
    assert!(first + 2 <= K);
    // SAFETY: the row has both.
    unsafe { vld1q_f64(row.as_ptr().add(first)) }
}

impl Real for Neon {
    type Mask = NeonMask;

    const N: usize = 4;

    #[inline(always)]
    fn mul_add_f32(a: f32, b: f32, c: f32) -> f32 {
        a.mul_add(b, c)
    }
    #[inline(always)]
    fn splat(x: f64) -> Self {
        Neon([registers!(vdupq_n_f64(x)); 2])
    }
    #[inline(always)]
    fn load(from: &[f64]) -> Self {
        let four: &[f64; 4] = from[..4].try_into().expect("four numbers");
        Neon([two(four, 0), two(four, 2)])
    }
    #[inline(always)]
    fn load_u32(from: &[u32]) -> Self {
        assert!(from.len() >= 4);
        // SAFETY: the slice has four numbers.
        let four = unsafe { vld1q_u32(from.as_ptr()) };
        let [low, high] = registers!([vmovl_u32(vget_low_u32(four)), vmovl_high_u32(four)]);
        Neon([low, high].map(|half| registers!(vcvtq_f64_u64(half))))
    }
    #[inline(always)]
    fn load_halves(from: &[u64]) -> [Self; 2] {
        let words = words(from);
        let lower = u64::from(u32::MAX);
        [
            Neon(words.map(|word| registers!(vcvtq_f64_u64(vshrq_n_u64::<32>(word))))),
            Neon(words.map(|word| registers!(vcvtq_f64_u64(vandq_u64(word, vdupq_n_u64(lower)))))),
        ]
    }
    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        assert!(to.len() >= 4);
        // SAFETY: the slice has room for four numbers.
        unsafe {
            vst1q_f64(to.as_mut_ptr(), self.0[0]);
            vst1q_f64(to.as_mut_ptr().add(2), self.0[1]);
        }
    }
    #[inline(always)]
    fn store_u32(self, to: &mut [u32]) {
        assert!(to.len() >= 4);
        let [a, b] = self.0.map(|half| registers!(vcvtq_s64_f64(half)));
        let four = registers!(vreinterpretq_u32_s32(vmovn_high_s64(vmovn_s64(a), b)));
        // SAFETY: the slice has room for four numbers.
        unsafe { vst1q_u32(to.as_mut_ptr(), four) }
    }
    /// Two rows at a time are turned into columns in registers.
    #[inline(always)]
    fn rows<const K: usize>(table: &Table<K>, index: &[u32]) -> [Self; K] {
        const { assert!(K.is_multiple_of(2)) };
        let rows: [&[f64; K]; 4] = std::array::from_fn(|i| table.row(index[i]));
        let mut columns = [Self::splat(0.0); K];
        for first in (0..K).step_by(2) {
            let [a, b, c, d] = rows.map(|row| two(row, first));
            columns[first] = Neon(registers!([vtrn1q_f64(a, b), vtrn1q_f64(c, d)]));
            columns[first + 1] = Neon(registers!([vtrn2q_f64(a, b), vtrn2q_f64(c, d)]));
        }
        columns
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Neon(self.0.map(|half| registers!(vabsq_f64(half))))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Neon(self.0.map(|half| registers!(vsqrtq_f64(half))))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self::select(self.compare(other, |a, b| registers!(vcgtq_f64(a, b))), self, other)
    }
    #[inline(always)]
    fn floor(self) -> Self {
        Neon(self.0.map(|half| registers!(vrndmq_f64(half))))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> NeonMask {
        self.compare(other, |a, b| registers!(vcltq_f64(a, b)))
    }
    #[inline(always)]
    fn le(self, other: Self) -> NeonMask {
        self.compare(other, |a, b| registers!(vcleq_f64(a, b)))
    }
    #[inline(always)]
    fn ne(self, other: Self) -> NeonMask {
        self.compare(other, |a, b| registers!(veorq_u64(vceqq_f64(a, b), vdupq_n_u64(u64::MAX))))
    }
    #[inline(always)]
    fn below(bits: &[u64], thresholds: Self) -> NeonMask {
        let words = words(bits);
        let thresholds = thresholds.0.map(|half| registers!(vreinterpretq_u64_f64(half)));
        NeonMask([0, 1].map(|half| registers!(vcltq_u64(words[half], thresholds[half]))))
    }
    #[inline(always)]
    fn bits(mask: NeonMask) -> u64 {
        static WEIGHTS: [u32; 4] = [1, 2, 4, 8];
        let lanes = registers!(vmovn_high_u64(vmovn_u64(mask.0[0]), mask.0[1]));
        // SAFETY: there are four weights.
        let weights = unsafe { vld1q_u32(WEIGHTS.as_ptr()) };
        registers!(vaddvq_u32(vandq_u32(lanes, weights))).into()
    }
    #[inline(always)]
    fn select(mask: NeonMask, yes: Self, no: Self) -> Self {
        Neon([0, 1].map(|half| registers!(vbslq_f64(mask.0[half], yes.0[half], no.0[half]))))
    }
}
