//! Several f64 side by side, on each instruction set: with `tree/lanes.rs` the only place with intrinsics.
//!
//! Each operation is rounded as IEEE 754 says and none is fused with another, so that a formula has the same
//! bits whatever it is compiled for.

use std::ops::{Add, BitAnd, Div, Mul, Sub};

/// N numbers. A method may be called only where the processor has the implementation's instruction set; the
/// kernel's entry points see to that.
pub(crate) trait Real:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// A truth value for each number.
    type Mask: Copy + BitAnd<Output = Self::Mask>;

    /// How many.
    const N: usize;

    fn splat(x: f64) -> Self;
    /// The first N of a slice that has them.
    fn load(from: &[f64]) -> Self;
    /// Likewise, converted.
    fn load_u32(from: &[u32]) -> Self;
    fn store(self, to: &mut [f64]);
    fn abs(self) -> Self;
    fn sqrt(self) -> Self;
    /// The larger of two numbers; +0 for zeros of either sign against +0.
    fn max(self, other: Self) -> Self;
    fn lt(self, other: Self) -> Self::Mask;
    fn le(self, other: Self) -> Self::Mask;
    fn ne(self, other: Self) -> Self::Mask;
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
    fn store(self, to: &mut [f64]) {
        to[0] = self;
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
    fn store(self, to: &mut [f64]) {
        to[..2].copy_from_slice(&self.0);
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
        #[inline(always)]
        fn store(self, to: &mut [f64]) {
            assert!(to.len() >= 4);
            unsafe { _mm256_storeu_pd(to.as_mut_ptr(), self.0) }
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
        fn store(self, to: &mut [f64]) {
            assert!(to.len() >= 8);
            unsafe { _mm512_storeu_pd(to.as_mut_ptr(), self.0) }
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
        fn select(mask: Mask512, yes: Self, no: Self) -> Self {
            Avx512(unsafe { _mm512_mask_blend_pd(mask.0, no.0, yes.0) })
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
            use crate::isa::Isa;
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
