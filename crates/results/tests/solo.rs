//! A job that threads of one process walk: its tally is that of the cluster's walks, whatever the threads are.

use std::path::Path;

use job::Job;
use radiosity::Experiment;
use results::{Ending, Replica, SoloProgress, StoredRun, walk_here};

/// The job of a cube in memory.
fn job(overrides: &[&str]) -> Job {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs/cube54.toml");
    let overrides: Vec<String> = overrides.iter().map(|&set| set.to_owned()).collect();
    job::load(&path, &overrides).unwrap()
}

fn walked(
    overrides: &[&str],
    threads: usize,
    watch: &mut dyn FnMut(SoloProgress) -> bool,
) -> Option<(StoredRun, Ending)> {
    let job = job(overrides);
    let experiment = Experiment::new(job.build_scene().unwrap(), job.method.walks()).unwrap();
    walk_here(&job, experiment, threads, "test", watch).unwrap()
}

fn all(overrides: &[&str], threads: usize) -> (StoredRun, Ending) {
    walked(overrides, threads, &mut |_| true).unwrap()
}

/// The tally of any threads is that of the sequence's walks, one after the other; the books account for all of them.
#[test]
fn threads_come_to_what_one_board_comes_to() {
    let sets: [&[&str]; 3] = [
        &["budget.paths=200_000", "budget.stream_paths=777"],
        &["budget.paths=50_000", "budget.first_path=1_000", "method.walk=gathering"],
        &["budget.paths=1_000_000", "method.walk=jacobi"],
    ];
    for set in sets {
        let (one, ending) = all(set, 1);
        assert_eq!(ending, Ending::BudgetSpent);
        let replica = Replica::new(one.experiment.clone(), &one.settings, one.settings.seed);
        let part = &one.checkpoint.book.parts[0];
        let mut board = replica.experiment().board();
        let expected = replica.trace(part.first..part.first + part.walks(), &mut board).unwrap();
        assert_eq!(*one.checkpoint.tally, expected, "{set:?}");
        one.checkpoint.verify().unwrap();
        let (three, _) = all(set, 3);
        assert_eq!(three.checkpoint.tally, one.checkpoint.tally, "{set:?}");
        three.checkpoint.verify().unwrap();
    }
}

/// A target ends the walks at the same look, whatever the threads are.
#[test]
fn a_target_ends_the_walks_at_a_look() {
    let set = ["budget.paths=100_000_000", "target.relative_error=0.05"];
    let (one, ending) = all(&set, 1);
    assert_eq!(ending, Ending::TargetReached);
    let last = *one.checkpoint.book.looks.last().unwrap();
    assert_eq!(last.walks, one.checkpoint.tally.counts.walks);
    let (four, _) = all(&set, 4);
    assert_eq!(four.checkpoint.tally, one.checkpoint.tally);
    let walks =
        |kept: &StoredRun| kept.checkpoint.book.looks.iter().map(|look| look.walks).collect::<Vec<_>>();
    assert_eq!(walks(&four), walks(&one));
}

/// What the clock leaves is a prefix, as much of it as there is.
#[test]
fn the_wall_clock_leaves_a_prefix() {
    let (kept, ending) = all(&["budget.paths=1_000_000_000_000", "budget.wall_seconds=0.3"], 2);
    assert_eq!(ending, Ending::WallClock);
    kept.checkpoint.verify().unwrap();
    assert!(kept.checkpoint.tally.counts.walks > 0);
}

/// The watcher of a run can give the walks up, and hears how many are in.
#[test]
fn walks_are_given_up_when_the_watcher_says_no() {
    let mut stages = Vec::new();
    let given_up = walked(&["budget.paths=1_000_000_000_000"], 2, &mut |stage| {
        stages.push(stage);
        stages.len() < 3
    });
    assert!(given_up.is_none());
    assert_eq!(stages.len(), 3);
    assert!(stages.is_sorted_by_key(|stage| stage.paths) && stages[2].paths > 0);
    assert_eq!(stages[0].paths_total, 1_000_000_000_000);
}
