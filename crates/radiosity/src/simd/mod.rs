//! Many numbers side by side, on the best instruction set that the machine has.

pub(crate) mod batch;
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
mod intrinsics;
pub(crate) mod isa;
pub(crate) mod prefetch;
pub(crate) mod real;
pub(crate) mod sixteen;
pub(crate) mod table;
pub(crate) mod wide;
