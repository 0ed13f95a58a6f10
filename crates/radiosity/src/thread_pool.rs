//! The thread pool that the caller of a long sample lends, which also says whether the sample is still wanted.

/// Parts of the work for each thread: threads that are faster, or come first, do more of them.
pub(crate) const PARTS_PER_THREAD: usize = 4;

/// The threads of the caller of a long sample. This crate starts no threads: the caller lends its own.
///
/// A function that says whether to go on is a pool of one thread.
pub trait ThreadPool: Sync {
    /// Whether the sample is still wanted. It is asked many times a second, by every thread that does a part.
    fn go_on(&self) -> bool;

    /// The threads that would share work at this moment, the caller's own included: 1 or more. No result depends on it.
    fn count(&self) -> usize {
        1
    }

    /// Calls `part` with each number below `parts` once, in any order and on any thread, and returns when all calls have.
    fn share(&self, parts: usize, part: &(dyn Fn(usize) + Sync)) {
        (0..parts).for_each(part);
    }
}

impl<F: Fn() -> bool + Sync> ThreadPool for F {
    fn go_on(&self) -> bool {
        self()
    }
}
