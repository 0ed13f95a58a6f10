//! Which instruction set the kernel runs on: picked once, at run time. The answer does not know.
//!
//! An instruction set that not every processor of its kind has is a token, `Avx2` or `Avx512`, that only detection makes. Vector types
//! of the instruction set are named nowhere but in this folder, and reach the kernel as type parameters, through
//! [`Isa::run`], which asks for the token. So no vector is ever made where the processor has not got it.

use super::real::{self, Real};
use super::sixteen::{self, Sixteen};
use super::wide::{Quad, Wide};

/// The instruction sets that the kernel is compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Isa {
    /// Rust without vector instructions.
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2(x86::Avx2),
    #[cfg(target_arch = "x86_64")]
    Avx512(x86::Avx512),
    /// Every processor of AArch64 has it.
    #[cfg(target_arch = "aarch64")]
    Neon,
}

/// The vectors of an instruction set.
pub(crate) trait Simd {
    /// A vector of several f64.
    type Doubles: Real;
    /// A vector of sixteen f32.
    type Singles: Sixteen;
    /// Adds to sums of 128 bits, modulo 2¹²⁸.
    #[inline(always)]
    fn add_wide(sums: &mut Wide, low: [&Quad; 2], high: [&Quad; 2]) {
        sums.add(low, high);
    }
}

/// What is to be done with whatever vectors there are.
pub(crate) trait Kernel {
    /// Does it; must be inlined, so that it is compiled for the instruction set.
    fn run<S: Simd>(self);
}

struct Portable;

impl Simd for Portable {
    type Doubles = real::Pair;
    type Singles = sixteen::Portable;
}

impl Isa {
    /// The instruction sets that this machine has, the best last.
    pub(crate) fn available() -> Vec<Isa> {
        let mut available = vec![Isa::Portable];
        #[cfg(target_arch = "x86_64")]
        available.extend(x86::available());
        #[cfg(target_arch = "aarch64")]
        available.push(Isa::Neon);
        available
    }

    /// The best that this machine has.
    pub(crate) fn best() -> Isa {
        Isa::available().pop().expect("one is always available")
    }

    /// The best that this machine has, AVX-512 left out.
    pub(crate) fn best_without_avx512() -> Isa {
        let mut others = Isa::available();
        #[cfg(target_arch = "x86_64")]
        others.retain(|isa| !matches!(isa, Isa::Avx512(_)));
        others.pop().expect("one is always available")
    }

    /// Does something with the vectors of the instruction set, compiled for it.
    #[inline(always)]
    pub(crate) fn run(self, kernel: impl Kernel) {
        match self {
            Isa::Portable => kernel.run::<Portable>(),
            #[cfg(target_arch = "x86_64")]
            Isa::Avx2(found) => found.run(kernel),
            #[cfg(target_arch = "x86_64")]
            Isa::Avx512(found) => found.run(kernel),
            #[cfg(target_arch = "aarch64")]
            Isa::Neon => kernel.run::<OnNeon>(),
        }
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::*;

    /// The processor has AVX2, FMA, BMI and what comes with them.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub(crate) struct Avx2(());

    /// The processor has AVX-512 (foundation, VL and DQ), and all that [`Avx2`] says.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub(crate) struct Avx512(());

    /// What this machine has of them, the best last.
    pub(super) fn available() -> impl Iterator<Item = Isa> {
        let avx2 = Avx2::detect();
        let avx512 = avx2.and_then(Avx512::detect);
        avx2.map(Isa::Avx2).into_iter().chain(avx512.map(Isa::Avx512))
    }

    struct OnAvx2;

    impl Simd for OnAvx2 {
        type Doubles = real::Avx2;
        type Singles = sixteen::Avx2;
    }

    struct OnAvx512;

    impl Simd for OnAvx512 {
        type Doubles = real::Avx512;
        type Singles = sixteen::Avx512;

        #[inline(always)]
        fn add_wide(sums: &mut Wide, low: [&Quad; 2], high: [&Quad; 2]) {
            sums.add_on_avx512(low, high);
        }
    }

    impl Avx2 {
        fn detect() -> Option<Self> {
            let found = is_x86_feature_detected!("avx2")
                && is_x86_feature_detected!("fma")
                && is_x86_feature_detected!("bmi1")
                && is_x86_feature_detected!("bmi2")
                && is_x86_feature_detected!("lzcnt")
                && is_x86_feature_detected!("popcnt");
            found.then_some(Avx2(()))
        }

        #[inline(always)]
        pub(super) fn run(self, kernel: impl Kernel) {
            #[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
            fn on_avx2(kernel: impl Kernel) {
                kernel.run::<OnAvx2>();
            }
            // SAFETY: `detect` alone makes `self`, where the processor has all of these.
            unsafe { on_avx2(kernel) }
        }
    }

    impl Avx512 {
        fn detect(_: Avx2) -> Option<Self> {
            let found = is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512vl")
                && is_x86_feature_detected!("avx512dq");
            found.then_some(Avx512(()))
        }

        #[inline(always)]
        pub(super) fn run(self, kernel: impl Kernel) {
            #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
            fn on_avx512(kernel: impl Kernel) {
                kernel.run::<OnAvx512>();
            }
            // SAFETY: `detect` alone makes `self`, where the processor has all of these.
            unsafe { on_avx512(kernel) }
        }
    }
}

#[cfg(target_arch = "aarch64")]
struct OnNeon;

#[cfg(target_arch = "aarch64")]
impl Simd for OnNeon {
    type Doubles = real::Neon;
    type Singles = sixteen::Neon;
}

/// Calls a function that is generic over [`Real`] with the f64 vectors of an instruction set, compiled for it.
macro_rules! on_isa {
    ($isa:expr, $function:ident($($argument:ident: $type:ty),* $(,)?)) => {{
        struct Call<A>(A);
        impl $crate::simd::isa::Kernel for Call<($($type,)*)> {
            #[inline(always)]
            fn run<S: $crate::simd::isa::Simd>(self) {
                let ($($argument,)*) = self.0;
                $function::<S::Doubles>($($argument),*);
            }
        }
        $isa.run(Call(($($argument,)*)))
    }};
}

pub(crate) use on_isa;
