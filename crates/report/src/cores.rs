//! Work in parts, on all cores: the results do not depend on the number of cores.

use std::sync::atomic::{AtomicUsize, Ordering};

/// The results of all parts, in their order.
pub fn on_all_cores<T: Send>(parts: usize, part: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let next = AtomicUsize::new(0);
    let work = || {
        let mut done = Vec::new();
        loop {
            let i = next.fetch_add(1, Ordering::Relaxed);
            if i >= parts {
                return done;
            }
            done.push((i, part(i)));
        }
    };
    let cores = std::thread::available_parallelism().map_or(1, usize::from).min(parts);
    let mut done: Vec<(usize, T)> = std::thread::scope(|scope| {
        let others: Vec<_> = (1..cores).map(|_| scope.spawn(work)).collect();
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_come_in_their_order() {
        assert_eq!(on_all_cores(1000, |i| i * i), (0..1000).map(|i| i * i).collect::<Vec<_>>());
        assert!(on_all_cores(0, |i| i).is_empty());
    }
}
