//! Walks that find surfaces through the tree against walks that meet every facet, in f64 and without a tree: do all
//! their hits agree? Hours of work, so no test: `cargo run --release -p scenes --example brute -- 57000 10000000`
//! is 10⁷ rays of the interior.
//!
//! Continuous walks go on from the very point they hit, so that one bit of difference in one hit sends a walk
//! elsewhere and shows in the tallies.

use std::error::Error;

use radiosity::{
    Board, Direction, EstimatorKind, Experiment, IndexChoice, InfiniteEnd, Method, Scene, Sequence, Space,
};
use scenes::interior;

/// Walks between two comparisons.
const PART: u64 = 16_384;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [triangles, rays] = &arguments[..] else {
        return Err("usage: brute TRIANGLES RAYS".into());
    };
    let (spec, wanted): (_, u64) = (interior(triangles.parse()?), rays.parse()?);
    let mut experiments = vec![];
    for index in [IndexChoice::Tree, IndexChoice::Flat] {
        experiments.push(Experiment::new(Scene::build(&spec, index)?, METHOD)?);
    }
    let mut boards: Vec<Board<2>> = experiments.iter().map(Experiment::board).collect();
    let sequence = Sequence::new(1);
    let (mut traced, mut next) = (0, 0);
    while traced < wanted {
        let mut tallies = vec![];
        for (experiment, board) in experiments.iter().zip(&mut boards) {
            experiment.walk(&sequence, next..next + PART, board);
            tallies.push(board.take()?);
        }
        if tallies[0] != tallies[1] {
            return Err(format!("walks {next} to {} differ", next + PART).into());
        }
        traced += tallies[0].counts.rays;
        next += PART;
        println!("{traced} rays agree");
    }
    Ok(())
}

const METHOD: Method = Method {
    direction: Direction::Shooting,
    estimator: EstimatorKind::Collision,
    infinite: InfiniteEnd::Roulette { threshold: InfiniteEnd::DEFAULT_THRESHOLD },
    space: Space::Continuous,
    mix: false,
};
