//! Walks that find surfaces through the tree against walks that meet every facet in f64, without a tree: do all their
//! hits agree? Minutes to hours of work on every core, so no test: `radwalk-lab brute
//! 57000 10000000` is 10⁷ rays of the interior.
//!
//! Continuous walks go on from the very point they hit, so that one bit of difference in one hit sends a walk
//! elsewhere and shows in the tallies.

use std::sync::atomic::{AtomicU64, Ordering};

use radiosity::{Board, Estimator, Experiment, IndexChoice, Scene, Sequence, Space, Walks};
use scenes::interior;

use super::Failure;

/// The number of walks between two comparisons.
const PART: u64 = 4_096;

pub(crate) fn run(words: &[String]) -> Result<(), Failure> {
    let [triangles, rays] = words else {
        return Err("usage: brute TRIANGLES RAYS".into());
    };
    let (spec, wanted): (_, u64) = (interior(triangles.parse()?), rays.parse()?);
    let tree = Experiment::new(
        Scene::build(&spec, IndexChoice::Tree)?,
        Walks { space: Space::Continuous, ..Walks::shooting(Estimator::Collision) },
    )?;
    let flat = Experiment::new(
        Scene::build(&spec, IndexChoice::Flat)?,
        Walks { space: Space::Continuous, ..Walks::shooting(Estimator::Collision) },
    )?;
    let (next, agreed) = (AtomicU64::new(0), AtomicU64::new(0));
    let compare = || {
        let mut boards: [Board; 2] = [tree.board(), flat.board()];
        let sequence = Sequence::new(1);
        while agreed.load(Ordering::Relaxed) < wanted {
            let first = next.fetch_add(PART, Ordering::Relaxed);
            let [tree, flat] = [(&tree, 0), (&flat, 1)].map(|(experiment, i)| {
                experiment.walk(&sequence, first..first + PART, &mut boards[i]);
                boards[i].take().expect("so few walks fit any sum")
            });
            assert_eq!(tree, flat, "walks {first} to {} differ", first + PART);
            let rays = agreed.fetch_add(tree.counts.rays, Ordering::Relaxed) + tree.counts.rays;
            println!("{rays} rays agree");
        }
    };
    parallel::on_all_cores(parallel::cores(), |_| compare());
    Ok(())
}
