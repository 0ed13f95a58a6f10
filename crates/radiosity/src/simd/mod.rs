//! Many numbers side by side, on the best instruction set that the machine has.

pub(crate) mod batch;
pub(crate) mod isa;
pub(crate) mod prefetch;
pub(crate) mod real;
pub(crate) mod sixteen;
pub(crate) mod table;
pub(crate) mod wide;
#[cfg(target_arch = "x86_64")]
mod x86;
