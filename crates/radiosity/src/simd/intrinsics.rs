//! What the vector types of all instruction sets have in common.

/// Intrinsics on registers alone.
macro_rules! registers {
    ($intrinsics:expr) => {{
        // SAFETY: the vector types of an instruction set are named in this folder alone and reach the kernel through
        // `Isa::run`, where a token shows that the processor has the instruction set, or each of its kind has it. No memory
        // is touched.
        unsafe { $intrinsics }
    }};
}

/// Operators of a vector type that are one intrinsic each.
#[cfg(target_arch = "x86_64")]
macro_rules! operator {
    ($type:ty: $($trait:ident $method:ident $intrinsic:ident),*) => {
        $(impl ::std::ops::$trait for $type {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(registers!($intrinsic(self.0, other.0)))
            }
        })*
    };
}

#[cfg(target_arch = "x86_64")]
pub(super) use operator;
pub(super) use registers;
