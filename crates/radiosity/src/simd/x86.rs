//! What the vector types of x86-64 have in common.

/// Intrinsics on registers alone.
macro_rules! registers {
    ($intrinsics:expr) => {{
        // SAFETY: the vector types of an instruction set are named in this folder alone and reach the kernel through
        // `Isa::run`, where a token shows that the processor has the instruction set. No memory is touched.
        unsafe { $intrinsics }
    }};
}

/// Operators of a vector type that are one intrinsic each.
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

pub(super) use {operator, registers};
