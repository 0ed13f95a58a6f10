//! Sums of 128 bits, eight side by side.

/// Four numbers.
pub(crate) type Quad = [u64; 4];

/// The lower halves of eight sums, and the upper ones: a cache line each.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(128))]
pub(crate) struct Wide {
    pub(crate) low: [Quad; 2],
    pub(crate) high: [Quad; 2],
}

impl Wide {
    /// Adds to all sums, modulo 2¹²⁸.
    #[inline(always)]
    pub(crate) fn add(&mut self, low: [&Quad; 2], high: [&Quad; 2]) {
        for half in 0..2 {
            for i in 0..4 {
                let sum = self.low[half][i].wrapping_add(low[half][i]);
                let carry = u64::from(sum < low[half][i]);
                self.low[half][i] = sum;
                self.high[half][i] = self.high[half][i].wrapping_add(high[half][i]).wrapping_add(carry);
            }
        }
    }

    /// [`Wide::add`] by vectors.
    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    pub(super) fn add_on_avx512(&mut self, low: [&Quad; 2], high: [&Quad; 2]) {
        use std::arch::x86_64::*;
        // SAFETY: only what runs on AVX-512 calls this (`isa.rs`); each half of `self` is a cache line, and a quad half of one.
        unsafe {
            let joined = |[first, second]: [&Quad; 2]| {
                let first = _mm512_castsi256_si512(_mm256_loadu_si256(first.as_ptr().cast()));
                _mm512_inserti64x4::<1>(first, _mm256_loadu_si256(second.as_ptr().cast()))
            };
            let (more, more_high) = (joined(low), joined(high));
            let sums = _mm512_add_epi64(_mm512_load_si512(self.low.as_ptr().cast()), more);
            let carries = _mm512_cmplt_epu64_mask(sums, more);
            let high = _mm512_add_epi64(_mm512_load_si512(self.high.as_ptr().cast()), more_high);
            let high = _mm512_mask_sub_epi64(high, carries, high, _mm512_set1_epi64(-1));
            _mm512_store_si512(self.low.as_mut_ptr().cast(), sums);
            _mm512_store_si512(self.high.as_mut_ptr().cast(), high);
        }
    }

    /// Sum i.
    pub(crate) fn get(&self, i: usize) -> u128 {
        u128::from(self.high[i / 4][i % 4]) << 64 | u128::from(self.low[i / 4][i % 4])
    }

    /// Adds to sum i, modulo 2¹²⁸.
    #[inline(always)]
    pub(crate) fn raise(&mut self, i: usize, by: u128) {
        let sum = self.get(i).wrapping_add(by);
        (self.low[i / 4][i % 4], self.high[i / 4][i % 4]) = (sum as u64, (sum >> 64) as u64);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::isa::{Isa, Kernel, Simd};

    struct Adds<'a>(&'a mut Wide, [[Quad; 2]; 2]);

    impl Kernel for Adds<'_> {
        #[inline(always)]
        fn run<S: Simd>(self) {
            let [low, high] = self.1.each_ref().map(|[first, second]| [first, second]);
            S::add_wide(self.0, low, high);
        }
    }

    #[test]
    fn halves_hold_what_whole_sums_do() {
        let numbers = [0, 1, u64::MAX, 1 << 63, 12345, u64::MAX - 7, 3 << 40, 9_876_543_210_123_456_789];
        for isa in Isa::available() {
            let (mut wide, mut sums) = (Wide::default(), [0_u128; 8]);
            for turn in 0..40 {
                let number = |i: usize| numbers[(3 * i + 5 * turn + i * turn) % 8];
                let quads = |from: usize| [0, 4].map(|half| [0, 1, 2, 3].map(|i| number(from + half + i)));
                let (low, high) = (quads(0), quads(11));
                isa.run(Adds(&mut wide, [low, high]));
                for (i, sum) in sums.iter_mut().enumerate() {
                    let more = u128::from(high[i / 4][i % 4]) << 64 | u128::from(low[i / 4][i % 4]);
                    *sum = sum.wrapping_add(more);
                }
                assert_eq!([0, 1, 2, 3, 4, 5, 6, 7].map(|i| wide.get(i)), sums, "{isa:?}, turn {turn}");
                wide.raise(turn % 8, u128::MAX - 5);
                sums[turn % 8] = sums[turn % 8].wrapping_add(u128::MAX - 5);
            }
        }
    }
}
