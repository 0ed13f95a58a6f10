//! Work in parts. This crate has no threads: callers say on which ones the parts run.

use std::sync::Mutex;

/// Runs a number of independent jobs, each once, in any order and on any threads.
pub type ParallelFor<'a> = dyn Fn(usize, &(dyn Fn(usize) + Sync)) + 'a;

/// Items that one job makes.
const CHUNK: usize = 1 << 12;

/// Runs jobs one after the other.
pub fn in_turn(jobs: usize, job: &(dyn Fn(usize) + Sync)) {
    (0..jobs).for_each(job);
}

/// The results of jobs, in the order of the jobs.
pub(crate) fn results<T: Send>(
    executor: &ParallelFor,
    jobs: usize,
    job: impl Fn(usize) -> T + Sync,
) -> Vec<T> {
    let results: Vec<Mutex<Option<T>>> = (0..jobs).map(|_| Mutex::new(None)).collect();
    executor(jobs, &|number| {
        let result = job(number);
        *results[number].lock().unwrap_or_else(|poisoned| poisoned.into_inner()) = Some(result);
    });
    let result = |slot: Mutex<Option<T>>| slot.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner());
    results.into_iter().map(|slot| result(slot).expect("every job ran")).collect()
}

/// What is made of each number below `count`, in their order.
pub(crate) fn collect<T: Send>(
    executor: &ParallelFor,
    count: usize,
    make: impl Fn(usize) -> T + Sync,
) -> Vec<T> {
    if count <= CHUNK {
        return (0..count).map(make).collect();
    }
    let chunk =
        |number: usize| -> Vec<T> { (number * CHUNK..count.min((number + 1) * CHUNK)).map(&make).collect() };
    let mut all = Vec::with_capacity(count);
    results(executor, count.div_ceil(CHUNK), chunk).into_iter().for_each(|chunk| all.extend(chunk));
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_stand_in_their_order_whatever_runs_first() {
        let backwards = |jobs: usize, job: &(dyn Fn(usize) + Sync)| (0..jobs).rev().for_each(job);
        for count in [0, 1, CHUNK, 3 * CHUNK + 1] {
            let expected: Vec<usize> = (0..count).map(|i| i * i).collect();
            assert_eq!(collect(&in_turn, count, |i| i * i), expected);
            assert_eq!(collect(&backwards, count, |i| i * i), expected);
        }
    }
}
