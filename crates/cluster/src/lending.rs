//! Threads of a worker that have no lease of their own help those that have a long one.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;

use radiosity::parallel::ThreadPool;

/// The threads of a worker, and what they do.
pub(crate) struct Lending {
    threads: usize,
    busy: Mutex<Busy>,
    /// Held by the thread that has a tally.
    tally: Mutex<()>,
}

/// Threads that are at work.
#[derive(Default)]
struct Busy {
    /// Threads with a lease.
    leases: usize,
    /// Threads that are lent to others with a lease.
    lent: usize,
}

impl Busy {
    /// The threads that may be lent to one more part of a lease: its share of those without a lease, as far as these are free.
    fn spare(&self, threads: usize) -> usize {
        let leases = self.leases.max(1);
        let share = (threads / leases).saturating_sub(1);
        share.min(threads.saturating_sub(leases + self.lent))
    }
}

impl Lending {
    pub(crate) fn new(threads: usize) -> Self {
        Lending { threads, busy: Mutex::default(), tally: Mutex::default() }
    }

    /// A thread begins a lease, which ends when what is returned is dropped.
    pub(crate) fn begin(&self) -> AtLease<'_> {
        self.busy().leases += 1;
        AtLease(self)
    }

    /// Waits for a thread's turn to have a tally, which ends when what is returned is dropped.
    pub(crate) fn turn(&self) -> MutexGuard<'_, ()> {
        self.tally.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn busy(&self) -> MutexGuard<'_, Busy> {
        self.busy.lock().expect("no thread panics while it counts")
    }
}

/// A thread has a lease.
pub(crate) struct AtLease<'a>(&'a Lending);

impl Drop for AtLease<'_> {
    fn drop(&mut self) {
        self.0.busy().leases -= 1;
    }
}

/// A loan of threads, which ends when it is dropped.
struct Lent<'a>(&'a Lending, usize);

impl Drop for Lent<'_> {
    fn drop(&mut self) {
        self.0.busy().lent -= self.1;
    }
}

/// The threads that are lent to a thread with a lease.
pub(crate) struct LentThreads<'a, G> {
    pub(crate) lending: &'a Lending,
    pub(crate) go_on: G,
}

impl<G: Fn() -> bool + Sync> ThreadPool for LentThreads<'_, G> {
    fn go_on(&self) -> bool {
        (self.go_on)()
    }

    fn count(&self) -> usize {
        1 + self.lending.busy().spare(self.lending.threads)
    }

    fn share(&self, parts: usize, part: &(dyn Fn(usize) + Sync)) {
        let lent = {
            let mut busy = self.lending.busy();
            let lent = busy.spare(self.lending.threads).min(parts.saturating_sub(1));
            busy.lent += lent;
            Lent(self.lending, lent)
        };
        let next = AtomicUsize::new(0);
        let take = || Some(next.fetch_add(1, Ordering::Relaxed)).filter(|&number| number < parts);
        let work = || std::iter::from_fn(take).for_each(part);
        thread::scope(|scope| {
            for _ in 0..lent.1 {
                // Where the system has no more threads, the others do the parts.
                let _ = thread::Builder::new().spawn_scoped(scope, work);
            }
            work();
        });
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn threads_without_a_lease_are_shared_among_those_that_have_one() {
        let spare = |leases, lent| Busy { leases, lent }.spare(8);
        assert_eq!([spare(1, 0), spare(2, 0), spare(3, 0), spare(5, 0), spare(8, 0)], [7, 3, 1, 0, 0]);
        // A lease came while threads were lent: none beyond those that are free.
        assert_eq!([spare(2, 3), spare(2, 5), spare(2, 7)], [3, 1, 0]);
    }

    #[test]
    fn every_part_is_done_once_and_threads_come_back() {
        let lending = Lending::new(4);
        let _lease = lending.begin();
        let lent = LentThreads { lending: &lending, go_on: || true };
        let (done, ids) = (Mutex::new(vec![0; 1000]), Mutex::new(BTreeSet::new()));
        let together = std::sync::Barrier::new(4);
        lent.share(1000, &|part| {
            if part < 4 {
                // Four threads, or this would wait for ever.
                together.wait();
            }
            ids.lock().unwrap().insert(format!("{:?}", thread::current().id()));
            done.lock().unwrap()[part] += 1;
        });
        assert_eq!(*done.lock().unwrap(), vec![1; 1000]);
        assert_eq!(ids.lock().unwrap().len(), 4);
        assert_eq!(lent.count(), 4);
    }
}
