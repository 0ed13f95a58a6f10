//! How many processes of this machine walk.

/// Worker processes of this machine.
#[derive(Clone, Copy)]
pub(crate) struct Team {
    /// The number of worker processes.
    pub workers: usize,
    /// The threads of each worker process.
    pub threads: u32,
}
