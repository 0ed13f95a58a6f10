//! Asking for memory ahead of time.

/// Asks for `lines` cache lines from `address` on.
#[inline(always)]
pub(crate) fn prefetch<T>(address: *const T, lines: usize) {
    #[cfg(target_arch = "x86_64")]
    for line in 0..lines {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: a prefetch reads nothing; any address will do.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(address.cast::<i8>().wrapping_add(64 * line)) };
    }
    #[cfg(target_arch = "aarch64")]
    for line in 0..lines {
        let address = address.cast::<u8>().wrapping_add(64 * line);
        // SAFETY: a prefetch reads nothing; any address will do.
        unsafe {
            std::arch::asm!("prfm pldl1keep, [{address}]", address = in(reg) address, options(nostack, readonly, preserves_flags));
        }
    }
    #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
    let _ = (address, lines);
}
