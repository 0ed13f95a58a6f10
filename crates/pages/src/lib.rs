//! The allocator of the system, with large pieces of memory in huge pages, where the system has them: trees, tables and boards are
//! visited all over, and finding their pages takes 4 to 14 % of the time of large scenes.

#![allow(unsafe_code, reason = "an allocator hands out memory, and tells the system how to keep it")]

use std::alloc::{GlobalAlloc, Layout, System};

/// The least piece of memory to ask huge pages for: two of those of x86-64 [bytes].
const LARGE: usize = 1 << 22;

/// The allocator of the system, which keeps large pieces of memory in huge pages.
pub struct HugePages;

// SAFETY: all memory comes from the allocator of the system, whose promises these are.
unsafe impl GlobalAlloc for HugePages {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller keeps the promises of `GlobalAlloc::alloc`.
        in_huge_pages(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller keeps the promises of `GlobalAlloc::alloc_zeroed`.
        in_huge_pages(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: the caller keeps the promises of `GlobalAlloc::realloc`.
        in_huge_pages(unsafe { System.realloc(memory, layout, size) }, size)
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: the caller keeps the promises of `GlobalAlloc::dealloc`.
        unsafe { System.dealloc(memory, layout) }
    }
}

/// The memory, for which huge pages are asked where it is large. Where the system refuses, nothing changes.
#[inline]
fn in_huge_pages(memory: *mut u8, size: usize) -> *mut u8 {
    if size >= LARGE && !memory.is_null() {
        advise(memory, size);
    }
    memory
}

/// Asks for huge pages in what lies within the memory of whole pages of the least size.
#[cfg(all(target_os = "linux", not(miri)))]
#[cold]
fn advise(memory: *mut u8, size: usize) {
    // Bytes of the least page of a processor that Linux runs on.
    const PAGE: usize = 1 << 12;
    let skipped = memory.addr().wrapping_neg() % PAGE;
    let first = memory.wrapping_add(skipped).cast();
    // SAFETY: the advice changes no byte of the memory, which the caller owns.
    let _ = unsafe {
        rustix::mm::madvise(first, (size - skipped) & !(PAGE - 1), rustix::mm::Advice::LinuxHugepage)
    };
}

// Miri does not know the call.
#[cfg(any(not(target_os = "linux"), miri))]
fn advise(_: *mut u8, _: usize) {}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lays out memory of every size about [`LARGE`], grows and shrinks it, and reads what was written.
    #[test]
    fn what_is_written_is_read() {
        for size in [1, 4096, LARGE - 1, LARGE, LARGE + 1, 3 * LARGE + 77] {
            let layout = |size| Layout::from_size_align(size, 64).expect("a layout");
            // SAFETY: the layouts are those of the memory, which is given back once.
            unsafe {
                let memory = HugePages.alloc_zeroed(layout(size));
                assert!(!memory.is_null() && memory.addr() % 64 == 0);
                assert_eq!((*memory, *memory.add(size - 1)), (0, 0));
                memory.write(7);
                let more = HugePages.realloc(memory, layout(size), 2 * size);
                more.add(2 * size - 1).write(9);
                assert_eq!((*more, *more.add(2 * size - 1)), (7, 9));
                HugePages.dealloc(more, layout(2 * size));
                let other = HugePages.alloc(layout(size));
                other.write_bytes(3, size);
                HugePages.dealloc(other, layout(size));
            }
        }
    }
}
