//! What a long sample asks of its caller: whether it is still wanted, and threads to share its parts.

/// The caller of a long sample. This crate starts no threads; a caller that has some lends them here.
///
/// A function that tells whether to go on is a caller with one thread.
pub trait Hands: Sync {
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

impl<F: Fn() -> bool + Sync> Hands for F {
    fn go_on(&self) -> bool {
        self()
    }
}
