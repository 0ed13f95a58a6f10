//! Work in parts on the threads of this machine: the results stand in the order of the parts, whatever the threads.

#![warn(unreachable_pub, unnameable_types)]

use std::num::NonZero;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

/// The number of threads that run at once on this machine.
pub fn cores() -> usize {
    thread::available_parallelism().map_or(1, NonZero::get)
}

/// The results of all parts, in their order, on all cores.
pub fn on_all_cores<T: Send>(parts: usize, part: impl Fn(usize) -> T + Sync) -> Vec<T> {
    on_threads(cores(), parts, || (), |(), i| part(i))
}

/// What is made of each item, in their order, on all cores. A thread takes `at_once` items at a time.
pub fn map<T: Sync, U: Send>(items: &[T], at_once: usize, make: impl Fn(&T) -> U + Sync) -> Vec<U> {
    let chunks: Vec<&[T]> = items.chunks(at_once).collect();
    let made = on_all_cores(chunks.len(), |chunk| chunks[chunk].iter().map(&make).collect::<Vec<U>>());
    made.into_iter().flatten().collect()
}

/// Parts of `at_once` items and a few more, none of which ends between neighbours that are `alike`: the same whatever the threads.
pub fn parts<T>(items: &[T], at_once: usize, alike: impl Fn(&T, &T) -> bool) -> Vec<&[T]> {
    let (mut parts, mut rest) = (Vec::new(), items);
    while !rest.is_empty() {
        let least = at_once.min(rest.len());
        let more = rest[least..].iter().take_while(|item| alike(&rest[least - 1], item)).count();
        let (part, others) = rest.split_at(least + more);
        parts.push(part);
        rest = others;
    }
    parts
}

/// Runs all jobs, in any order, on all cores.
pub fn run_on_all_cores(jobs: usize, job: &(dyn Fn(usize) + Sync)) {
    on_all_cores(jobs, job);
}

/// The results of all parts, in their order, on at most `threads` threads, of which the calling thread is one. Each thread works with what
/// `prepare` makes for it, and takes the next part when it is done with one.
///
/// # Panics
/// If a part does.
pub fn on_threads<S, T: Send>(
    threads: usize,
    parts: usize,
    prepare: impl Fn() -> S + Sync,
    part: impl Fn(&mut S, usize) -> T + Sync,
) -> Vec<T> {
    let next = AtomicUsize::new(0);
    let work = || {
        let mut state = prepare();
        let mut done = Vec::new();
        loop {
            let i = next.fetch_add(1, Ordering::Relaxed);
            if i >= parts {
                return done;
            }
            done.push((i, part(&mut state, i)));
        }
    };
    let mut done: Vec<(usize, T)> = thread::scope(|scope| {
        let others: Vec<_> = (1..threads.min(parts)).map(|_| scope.spawn(work)).collect();
        let own = work();
        let theirs = others.into_iter().map(|thread| thread.join().expect("parts do not panic"));
        theirs.fold(own, |mut all, some| {
            all.extend(some);
            all
        })
    });
    done.sort_unstable_by_key(|&(i, _)| i);
    done.into_iter().map(|(_, result)| result).collect()
}

/// The results of two jobs that run side by side, the second on the calling thread.
///
/// # Panics
/// If a job does.
pub fn both<A: Send, B>(first: impl FnOnce() -> A + Send, second: impl FnOnce() -> B) -> (A, B) {
    thread::scope(|scope| {
        let first = scope.spawn(first);
        let second = second();
        (first.join().expect("jobs do not panic"), second)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_come_in_their_order() {
        let squares: Vec<usize> = (0..1000).map(|i| i * i).collect();
        assert_eq!(on_all_cores(1000, |i| i * i), squares);
        assert!(on_all_cores(0, |i| i).is_empty());
        let numbers: Vec<usize> = (0..1000).collect();
        for at_once in [1, 7, 1000, 2000] {
            assert_eq!(map(&numbers, at_once, |i| i * i), squares);
        }
        for threads in [0, 1, 3, 2000] {
            assert_eq!(on_threads(threads, 1000, || (), |(), i| i * i), squares);
        }
    }

    #[test]
    fn no_part_ends_between_items_that_are_alike() {
        let items = [1, 1, 2, 2, 2, 3, 4, 5];
        let expected: [&[i32]; 3] = [&[1, 1], &[2, 2, 2], &[3, 4]];
        let found = parts(&items, 2, |a, b| a == b);
        assert_eq!(found[..3], expected);
        assert_eq!(found.concat(), items);
        assert!(parts(&[0_u8; 0], 2, |a, b| a == b).is_empty());
    }

    #[test]
    fn two_jobs_wait_for_each_other() {
        let (send, receive) = std::sync::mpsc::channel();
        let (first, second) = both(move || receive.recv().unwrap(), || send.send(7));
        assert_eq!((first, second), (7, Ok(())));
    }

    /// What a thread has made for itself stays its own.
    #[test]
    fn threads_prepare_once_each() {
        let made = AtomicUsize::new(0);
        let prepare = || made.fetch_add(1, Ordering::Relaxed);
        let states = on_threads(3, 100, prepare, |state, _| *state);
        assert!(made.into_inner() <= 3 && states.iter().all(|&state| state < 3));
    }
}
