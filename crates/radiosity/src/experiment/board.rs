//! The board that an experiment scores on.

use std::ops::Range;

use crate::jacobi::final_gather::GatheredLight;
use crate::jacobi::{ChainBoard, UNITS};
use crate::tally::{ColouredBoard, HitScoreboard, Layout, LinearBoard, Overflow, Tally, WeightScoreboard};
use crate::walk::marks::MarkBoard;
use crate::walk::score::RELATED;

/// The board that an experiment scores on.
///
/// ```
/// use radiosity::{EstimatorKind, Experiment, IndexChoice, Method, Scene, SceneSpec, Sequence};
///
/// let scene = Scene::build(&SceneSpec::furnace(3, 0.5), IndexChoice::Auto)?;
/// let experiment = Experiment::new(scene, Method::shooting(EstimatorKind::Collision))?;
/// let (sequence, mut board, mut tally) = (Sequence::new(1), experiment.board(), experiment.tally());
/// experiment.walk(&sequence, 0..100, &mut board);
/// board.add_to(&mut tally)?;
/// assert_eq!(tally.counts.walks, 100);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Board {
    /// The scores of faces.
    pub(super) scores: Scores,
    /// The scores of sensors, where there are any.
    pub(super) sensing: Option<Sensing>,
    /// The scores of groups, where there are any; with sensors, groups are sources alone.
    pub(super) group_sums: Option<GroupSums>,
}

/// What a board keeps for groups of patches.
#[derive(Clone, Debug)]
pub(super) struct GroupSums {
    /// The number of faces of the scene.
    pub(super) faces: usize,
    /// What materials do, where that is asked for.
    pub(super) marks: Option<MarkBoard>,
}

/// Where the faces of a scene score.
#[derive(Clone, Debug)]
pub(super) enum Scores {
    /// Grey analog shooting: whole hits.
    Hits(HitScoreboard<1>),
    /// Grey analog shooting with three estimators at once: whole hits.
    RelatedHits(HitScoreboard<RELATED>),
    /// Other grey walks: fixed point.
    Fixed(WeightScoreboard<1>),
    /// Gathering with three estimators at once.
    RelatedFixed(WeightScoreboard<RELATED>),
    /// All walks in coloured scenes: three channels.
    Coloured(ColouredBoard),
    /// Grey analog shooting with slopes.
    LinearHits(LinearBoard<u64, 0, 1>),
    /// Other grey walks with slopes.
    LinearFixed(LinearBoard<u128, 1, 1>),
    /// Three channels with slopes.
    LinearColoured(LinearBoard<u128, 1, 3>),
    /// Whole chains of stochastic Jacobi.
    Chains(ChainBoard),
}

/// Does the same with every kind of scores.
macro_rules! with_board {
    ($self:expr, $board:ident => $body:expr) => {
        match $self {
            $crate::experiment::board::Scores::Hits($board) => $body,
            $crate::experiment::board::Scores::RelatedHits($board) => $body,
            $crate::experiment::board::Scores::Fixed($board) => $body,
            $crate::experiment::board::Scores::RelatedFixed($board) => $body,
            $crate::experiment::board::Scores::Coloured($board) => $body,
            $crate::experiment::board::Scores::LinearHits($board) => $body,
            $crate::experiment::board::Scores::LinearFixed($board) => $body,
            $crate::experiment::board::Scores::LinearColoured($board) => $body,
            $crate::experiment::board::Scores::Chains($board) => $body,
        }
    };
}

pub(super) use with_board;

impl Board {
    /// Hands over all that was scored and empties the board.
    ///
    /// # Errors
    /// Where a sum may have wrapped.
    pub fn take(&mut self) -> Result<Tally, Overflow> {
        match (&mut self.sensing, &mut self.group_sums) {
            (None, None) => self.scores.take(),
            (Some(sensing), _) => sensing.take(&mut self.scores),
            (None, Some(group_sums)) => group_sums.take(&mut self.scores),
        }
    }

    /// Adds all that was scored to a tally of the same experiment and empties the board.
    ///
    /// # Errors
    /// Where a sum may have wrapped or leaves its range; then the tally is unusable.
    pub fn add_to(&mut self, tally: &mut Tally) -> Result<(), Overflow> {
        if self.sensing.is_none() && self.group_sums.is_none() {
            return self.scores.add_to(tally);
        }
        tally.merge(&self.take()?).map_err(|_| Overflow)
    }
}

impl GroupSums {
    /// Hands over what faces have scored: all classes together, then each but the first, then what materials do.
    fn take(&mut self, scores: &mut Scores) -> Result<Tally, Overflow> {
        scores.total_first(self.faces);
        let of_classes = scores.take()?;
        let Some(marks) = &mut self.marks else { return Ok(of_classes) };
        let (counts, layout) = (of_classes.counts, of_classes.layout());
        let mut sums = of_classes.into_sums();
        sums.extend(marks.take().ok_or(Overflow)?);
        let rows = sums.len() / layout.columns();
        Ok(Tally::from_parts(counts, rows, layout, sums).expect("the layout is the board's own"))
    }
}

impl Scores {
    /// Adds what all classes have scored to the slots of the first, which stand for all of them then.
    fn total_first(&mut self, faces: usize) {
        match self {
            Scores::Hits(board) => board.total_first(faces),
            Scores::Fixed(board) => board.total_first(faces),
            Scores::Coloured(board) => board.total_first(faces),
            Scores::RelatedHits(_)
            | Scores::RelatedFixed(_)
            | Scores::LinearHits(_)
            | Scores::LinearFixed(_)
            | Scores::LinearColoured(_)
            | Scores::Chains(_) => {}
        }
    }

    /// Hands over what faces have scored.
    pub(super) fn take(&mut self) -> Result<Tally, Overflow> {
        with_board!(self, board => board.take())
    }

    /// Adds what faces have scored to a tally of faces.
    pub(super) fn add_to(&mut self, tally: &mut Tally) -> Result<(), Overflow> {
        with_board!(self, board => board.add_to(tally))
    }
}

/// What a board keeps for sensors.
#[derive(Clone, Debug)]
pub(crate) struct Sensing {
    /// The walks that the scores of faces hold, where walks are samples of their own: those of a sample that is not done.
    pub(super) open: Range<u64>,
    /// What faces have scored before.
    done: Tally,
    /// The number of faces, of which every class of sources has rows in `done`.
    faces: usize,
    /// The rows of sensors; `None` once a sum has left its range.
    sums: Option<Vec<u128>>,
    layout: Layout,
}

impl Sensing {
    /// For scores of these faces, with those of all classes of sources, and these cells.
    pub(super) fn new([faces, rows]: [usize; 2], cells: usize, layout: Layout) -> Self {
        Sensing {
            open: 0..0,
            done: Tally::new(rows, layout),
            faces,
            sums: Some(vec![0; (1 + cells) * layout.columns()]),
            layout,
        }
    }

    /// The next walk is number `walk`. Where it does not follow the open ones, their sample will be done elsewhere.
    pub(super) fn open_at(&mut self, walk: u64, scores: &mut Scores) {
        if self.open.end != walk {
            if !self.open.is_empty() && scores.add_to(&mut self.done).is_err() {
                self.sums = None;
            }
            self.open = walk..walk;
        }
    }

    /// The sample of the open walks is done: all of it, those `before` the open ones included.
    pub(super) fn close(&mut self, scores: &mut Scores, mut before: Tally) -> Result<Tally, Overflow> {
        self.open = self.open.end..self.open.end;
        let mut add = || {
            let own = scores.take()?;
            self.done.merge(&own).map_err(|_| Overflow)?;
            before.merge(&own).map_err(|_| Overflow)
        };
        match add() {
            Ok(()) => Ok(before),
            Err(Overflow) => {
                self.sums = None;
                Err(Overflow)
            }
        }
    }

    /// Scores what one sample of every cell has gathered: H over `largest`.
    pub(super) fn add(&mut self, largest: &[f64; 3], gathered: &[GatheredLight]) {
        let Layout { moments, events, .. } = self.layout;
        let last = self.layout.columns() - 1;
        let Some(sums) = &mut self.sums else { return };
        let mut rows = sums.chunks_exact_mut(self.layout.columns());
        let mut fits = true;
        let mut add = |sum: &mut u128, x: Option<u128>| match x.and_then(|x| sum.checked_add(x)) {
            Some(raised) => *sum = raised,
            None => fits = false,
        };
        let count = rows.next().expect("the row of samples");
        add(&mut count[0], Some(1));
        add(&mut count[1], Some(gathered.iter().map(|cell| u128::from(cell.rays)).sum()));
        for (row, GatheredLight { irradiance, landed, .. }) in rows.zip(gathered) {
            for (c, h) in irradiance.iter().enumerate() {
                let x = (h / largest[c] * UNITS + 0.5) as u128;
                let mut power = Some(1_u128);
                for sum in &mut row[c * moments..(c + 1) * moments] {
                    power = power.and_then(|power| power.checked_mul(x));
                    add(sum, power);
                }
            }
            if events {
                add(&mut row[last], Some(u128::from(*landed)));
            }
        }
        if !fits {
            self.sums = None;
        }
    }

    /// Hands over all that faces and sensors have scored.
    pub(super) fn take(&mut self, scores: &mut Scores) -> Result<Tally, Overflow> {
        self.open = 0..0;
        let faces = self.done.patches();
        scores.add_to(&mut self.done)?;
        let done = std::mem::replace(&mut self.done, Tally::new(faces, self.layout));
        let rows = self.sums.as_ref().ok_or(Overflow)?.len();
        let of_sensors = self.sums.replace(vec![0; rows]).ok_or(Overflow)?;
        let counts = done.counts;
        let mut sums = done.into_sums();
        let (of_all, of_others) = sums.split_at_mut(self.faces * self.layout.columns());
        for of_class in of_others.chunks_exact(of_all.len()) {
            let added = of_all.iter_mut().zip(of_class).map(|(sum, own)| {
                *sum = sum.checked_add(*own)?;
                Some(())
            });
            added.collect::<Option<()>>().ok_or(Overflow)?;
        }
        sums.extend(of_sensors);
        let patches = faces + rows / self.layout.columns();
        Ok(Tally::from_parts(counts, patches, self.layout, sums).expect("the layout is the board's own"))
    }
}
