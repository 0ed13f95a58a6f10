//! Searches for walks that fall out of a closed scene: `radwalk-lab closed 1000000000`
//! traces that many rays in each of three scenes.

use radiosity::{Board, Estimator, Experiment, IndexChoice, Method, Scene, Sequence};
use scenes::{cube, interior};

use super::Failure;

/// The number of walks between two looks.
const PART: u64 = 1 << 20;

pub(crate) fn run(words: &[String]) -> Result<(), Failure> {
    let wanted: u64 = words.first().ok_or("usage: closed RAYS")?.parse()?;
    for (name, spec) in
        [("cube54", cube(3)), ("interior 57 k", interior(57_000)), ("interior 1 M", interior(1_000_000))]
    {
        let experiment =
            Experiment::new(Scene::build(&spec, IndexChoice::Auto)?, Method::shooting(Estimator::Collision))?;
        let mut board: Board = experiment.board();
        let sequence = Sequence::new(1);
        let (mut rays, mut escaped, mut next) = (0, 0, 0);
        while rays < wanted {
            experiment.walk(&sequence, next..next + PART, &mut board);
            let counts = board.take()?.counts;
            rays += counts.rays;
            escaped += counts.escaped;
            next += PART;
        }
        println!("{name}: {escaped} of {rays} rays escaped");
        if escaped > 0 {
            return Err("nothing may fall through".into());
        }
    }
    Ok(())
}
