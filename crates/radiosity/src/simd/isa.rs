//! Which instruction set the kernel runs on: picked once, at run time. The answer does not know.

/// The instruction sets that the kernel is compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Isa {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Isa {
    /// Those that this machine has, the best last.
    pub(crate) fn available() -> Vec<Isa> {
        #[allow(unused_mut, reason = "one architecture has more")]
        let mut list = vec![Isa::Portable];
        #[cfg(target_arch = "x86_64")]
        {
            let avx2 = is_x86_feature_detected!("avx2")
                && is_x86_feature_detected!("fma")
                && is_x86_feature_detected!("bmi1")
                && is_x86_feature_detected!("bmi2")
                && is_x86_feature_detected!("lzcnt")
                && is_x86_feature_detected!("popcnt");
            if avx2 {
                list.push(Isa::Avx2);
            }
            if avx2
                && is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512vl")
                && is_x86_feature_detected!("avx512dq")
            {
                list.push(Isa::Avx512);
            }
        }
        list
    }

    /// The best that this machine has.
    pub(crate) fn best() -> Isa {
        *Self::available().last().expect("one is portable")
    }
}

/// Calls a generic function with the numbers of an instruction set, compiled for that instruction set.
macro_rules! on_isa {
    ($isa:expr, $function:ident($($argument:ident: $type:ty),* $(,)?)) => {
        match $isa {
            $crate::simd::isa::Isa::Portable => $function::<$crate::simd::real::Pair>($($argument),*),
            #[cfg(target_arch = "x86_64")]
            $crate::simd::isa::Isa::Avx2 => {
                #[target_feature(enable = "avx2,fma,bmi2")]
                fn on_avx2($($argument: $type),*) {
                    $function::<$crate::simd::real::Avx2>($($argument),*)
                }
                // SAFETY: `Isa::available` has found the instruction set.
                unsafe { on_avx2($($argument),*) }
            }
            #[cfg(target_arch = "x86_64")]
            $crate::simd::isa::Isa::Avx512 => {
                #[target_feature(enable = "avx512f,avx512vl,avx512dq,fma,bmi2")]
                fn on_avx512($($argument: $type),*) {
                    $function::<$crate::simd::real::Avx512>($($argument),*)
                }
                // SAFETY: `Isa::available` has found the instruction set.
                unsafe { on_avx512($($argument),*) }
            }
        }
    };
}

pub(crate) use on_isa;
