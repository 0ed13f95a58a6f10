//! A method at work in a scene: which walks to shoot, onto what board, and what a tally of them says.

use std::ops::Range;

use thiserror::Error;

use crate::birth::{Births, birth_probabilities};
use crate::estimator::{
    Absorption, Collision, Estimator, Gather, ShootAnalog, ShootInfinite, Survival, fixed_units,
};
use crate::fate::{Analog, Infinite};
use crate::method::{Direction, EstimatorKind, InfiniteEnd, Method};
use crate::rng::Sequence;
use crate::scene::{Patch, Scene};
use crate::tally::{Counts, Layout, Overflow, Scoreboard, Tally};
use crate::walk::walk_all;

/// A method that would be wrong in this scene.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum Unfit {
    /// Gathering by survival scores where a walk survives on an emitter.
    #[error(
        "patch {patch} emits and has reflectance 0, and gathering by survival scores only where walks survive (its light would be lost); choose another estimator"
    )]
    BlackEmitter {
        /// The emitter.
        patch: usize,
    },
    /// Nobody can be born where there is no patch.
    #[error("walks are to be born on patch {patch}, but the scene has {patches} patches; choose from 0 to {last}", last = patches - 1)]
    NoSuchPatch {
        /// The patch.
        patch: u32,
        /// Patches of the scene.
        patches: usize,
    },
}

/// The board that an experiment scores on; M power sums per patch.
#[derive(Clone, Debug)]
pub enum Board<const M: usize> {
    /// Analog shooting: whole hits.
    Hits(Scoreboard<u64, (), M>),
    /// All else: fixed point.
    Fixed(Scoreboard<u128, u64, M>),
}

/// What gathering needs beyond the scene.
#[derive(Clone, Debug)]
struct Gathering {
    births: Births,
    /// p_i.
    probability: Vec<f64>,
    /// What an event on patch j is worth, over `largest_value`.
    values: Vec<f64>,
    /// The largest value of an event [W/m²].
    largest_value: f64,
    /// B̄ = max_s E_s/(1 − R_s) [W/m²].
    b_bar: f64,
    /// A bound on E[x²]/E[x], x in events of the largest value.
    ratio_bound: f64,
}

/// A scene and a method that fits it.
#[derive(Clone, Debug)]
pub struct Experiment {
    scene: Scene,
    method: Method,
    gathering: Option<Gathering>,
}

impl Experiment {
    /// Prepares a method for a scene.
    ///
    /// # Errors
    /// Where its answer would be wrong.
    pub fn new(scene: Scene, method: Method) -> Result<Self, Unfit> {
        let gathering = match &method.direction {
            Direction::Shooting => None,
            Direction::Gathering(birth) => {
                if let crate::method::Birth::Patches(chosen) = birth
                    && let Some(&patch) =
                        chosen.iter().find(|&&patch| patch as usize >= scene.patches().len())
                {
                    return Err(Unfit::NoSuchPatch { patch, patches: scene.patches().len() });
                }
                Some(Gathering::new(&scene, method.estimator, birth_probabilities(&scene, birth))?)
            }
        };
        Ok(Experiment { scene, method, gathering })
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The method.
    pub fn method(&self) -> &Method {
        &self.method
    }

    /// Whether walks are cut off while they still carry weight.
    pub fn is_biased(&self) -> bool {
        self.method.estimator == EstimatorKind::Infinite
            && !matches!(self.method.infinite, InfiniteEnd::Roulette { .. })
    }

    fn scores_hits(&self) -> bool {
        self.method.direction == Direction::Shooting && self.method.estimator != EstimatorKind::Infinite
    }

    /// What a tally of M power sums keeps of each patch.
    pub fn layout(&self, moments: usize) -> Layout {
        Layout { moments, events: !self.scores_hits() }
    }

    /// An empty tally of M power sums.
    pub fn tally(&self, moments: usize) -> Tally {
        Tally::new(self.scene.patches().len(), self.layout(moments))
    }

    /// An empty board.
    pub fn board<const M: usize>(&self) -> Board<M> {
        let patches = self.scene.patches().len();
        if self.scores_hits() {
            Board::Hits(Scoreboard::new(patches))
        } else {
            Board::Fixed(Scoreboard::new(patches))
        }
    }

    /// Walks number `walks.start` … `walks.end` − 1 of a sequence, onto a board that [`Experiment::board`] made.
    pub fn walk<const M: usize>(&self, sequence: &Sequence, walks: Range<u64>, board: &mut Board<M>) {
        let counts = match board {
            Board::Hits(board) => self.shoot_analog(sequence, walks, board),
            Board::Fixed(board) => match &self.gathering {
                None => self.shoot_infinite(sequence, walks, board),
                Some(gathering) => self.gather(gathering, sequence, walks, board),
            },
        };
        board.counts().add(&counts).expect("64 bits outlast any process");
    }

    fn shoot_analog<const M: usize>(
        &self,
        sequence: &Sequence,
        walks: Range<u64>,
        board: &mut Scoreboard<u64, (), M>,
    ) -> Counts {
        let births = self.scene.emitters();
        match self.method.estimator {
            EstimatorKind::Absorption => {
                self.analog(births, sequence, walks, &mut ShootAnalog::<Absorption, M>::new(board))
            }
            EstimatorKind::Survival => {
                self.analog(births, sequence, walks, &mut ShootAnalog::<Survival, M>::new(board))
            }
            EstimatorKind::Collision | EstimatorKind::Infinite => {
                self.analog(births, sequence, walks, &mut ShootAnalog::<Collision, M>::new(board))
            }
        }
    }

    fn shoot_infinite<const M: usize>(
        &self,
        sequence: &Sequence,
        walks: Range<u64>,
        board: &mut Scoreboard<u128, u64, M>,
    ) -> Counts {
        self.infinite(self.scene.emitters(), sequence, walks, &mut ShootInfinite::new(board))
    }

    fn gather<const M: usize>(
        &self,
        gathering: &Gathering,
        sequence: &Sequence,
        walks: Range<u64>,
        board: &mut Scoreboard<u128, u64, M>,
    ) -> Counts {
        let (births, values) = (&gathering.births, &gathering.values[..]);
        match self.method.estimator {
            EstimatorKind::Absorption => {
                self.analog(births, sequence, walks, &mut Gather::<Absorption, M>::new(board, values))
            }
            EstimatorKind::Survival => {
                self.analog(births, sequence, walks, &mut Gather::<Survival, M>::new(board, values))
            }
            EstimatorKind::Collision => {
                self.analog(births, sequence, walks, &mut Gather::<Collision, M>::new(board, values))
            }
            EstimatorKind::Infinite => {
                self.infinite(births, sequence, walks, &mut Gather::<Collision, M>::new(board, values))
            }
        }
    }

    fn analog(
        &self,
        births: &Births,
        sequence: &Sequence,
        walks: Range<u64>,
        score: &mut impl Estimator,
    ) -> Counts {
        walk_all(&self.scene, births, self.method.space, sequence, walks, Analog, score)
    }

    fn infinite(
        &self,
        births: &Births,
        sequence: &Sequence,
        walks: Range<u64>,
        score: &mut impl Estimator,
    ) -> Counts {
        let fate = Infinite::new(self.method.infinite);
        walk_all(&self.scene, births, self.method.space, sequence, walks, fate, score)
    }
}

impl<const M: usize> Board<M> {
    fn counts(&mut self) -> &mut Counts {
        match self {
            Board::Hits(board) => &mut board.counts,
            Board::Fixed(board) => &mut board.counts,
        }
    }

    /// Hands over all that was scored and empties the board.
    ///
    /// # Errors
    /// Where a sum may have wrapped.
    pub fn take(&mut self) -> Result<Tally, Overflow> {
        match self {
            Board::Hits(board) => board.take(),
            Board::Fixed(board) => board.take(),
        }
    }
}

impl Gathering {
    fn new(scene: &Scene, estimator: EstimatorKind, probability: Vec<f64>) -> Result<Self, Unfit> {
        let value = |patch: &Patch| match estimator {
            _ if patch.emittance == 0.0 => 0.0,
            EstimatorKind::Absorption => patch.emittance / (1.0 - patch.reflectance),
            EstimatorKind::Survival => patch.emittance / patch.reflectance,
            EstimatorKind::Collision | EstimatorKind::Infinite => patch.emittance,
        };
        let values: Vec<f64> = scene.patches().iter().map(value).collect();
        if let Some(patch) = values.iter().position(|value| !value.is_finite()) {
            return Err(Unfit::BlackEmitter { patch });
        }
        let largest_value = values.iter().fold(0.0, |max: f64, value| max.max(*value));
        let births = Births::new(scene.surfaces(), scene.patches().len(), |i| probability[i])
            .expect("probabilities sum to 1");
        let values = values.iter().map(|value| value / largest_value).collect();
        let b_bar = most(scene, |s| s.emittance / (1.0 - s.reflectance));
        let ratio_bound = largest_ratio(scene, estimator, b_bar) / largest_value;
        Ok(Gathering { births, probability, values, largest_value, b_bar, ratio_bound })
    }
}

/// The largest of a value over the sources.
fn most(scene: &Scene, value: impl Fn(&Patch) -> f64) -> f64 {
    let sources = scene.patches().iter().filter(|patch| patch.emittance > 0.0);
    sources.fold(0.0, |max, source| value(source).max(max))
}

/// A bound on E[x²]/E[x] of gathered scores x [W/m²]. With b_s ≤ R_s·B̄ (S97 §3) the variances of theory give
/// max_s (E_s + 2R_sB̄), over R_s for survival, and max_s E_s/(1 − R_s) = B̄ for absorption. Rounding at random adds
/// less than a unit to a score.
fn largest_ratio(scene: &Scene, estimator: EstimatorKind, b_bar: f64) -> f64 {
    let collisions = |s: &Patch| s.emittance + 2.0 * s.reflectance * b_bar;
    let largest = match estimator {
        EstimatorKind::Absorption => b_bar,
        EstimatorKind::Survival => most(scene, |s| collisions(s) / s.reflectance),
        EstimatorKind::Collision | EstimatorKind::Infinite => most(scene, collisions),
    };
    largest * (1.0 + 1e-9)
}

/// What the sums of one patch mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Meaning {
    /// One unit of score, in events (hits; for gathering, events of the largest value).
    pub unit: f64,
    /// H per event: incoming power over area [W/m²]. `None` where the estimator cannot tell it (survival on a
    /// patch of reflectance 0).
    pub irradiance_per_event: Option<f64>,
    /// A bound on E[x²]/E[x], x in events.
    pub ratio_bound: f64,
    /// A bound on how much too small b may be [W/m²]: walks that were cut off.
    pub bias_bound: f64,
}

impl Experiment {
    /// What the sums of a patch mean; `None` where no walk can tell of it (gathering, p_i = 0).
    pub fn meaning(&self, patch: usize, tally: &Tally) -> Option<Meaning> {
        match &self.gathering {
            None => Some(self.meaning_of_shooting(&self.scene.patches()[patch], tally)),
            Some(gathering) => self.meaning_of_gathering(gathering, patch, tally.layout().moments),
        }
    }

    /// b_i = (R_i/A_i)φ_i, φ_i = Φ_T × the mean score, × 1/(1 − R_i) for absorption, 1/R_i for survival.
    ///
    /// A planar patch cannot hit itself, so between two visits a walk survives on it and on another patch: it
    /// returns with probability at most R_i·R_max. Visits after the first are then at most geometric, m =
    /// 1/(1 − R_i·R_max) of them in the mean, and E[x²]/E[x] ≤ 2m − 1. A weight that is multiplied by R_i·R_max
    /// between visits scores at most m in all.
    fn meaning_of_shooting(&self, patch: &Patch, tally: &Tally) -> Meaning {
        let per_hit = self.scene.total_power() / patch.active_area();
        let reflectance = patch.reflectance;
        let visits = 1.0 / (1.0 - reflectance * self.scene.max_reflectance());
        let (unit, scale, ratio_bound) = match self.method.estimator {
            EstimatorKind::Absorption => (1.0, Some(1.0 / (1.0 - reflectance)), 1.0),
            EstimatorKind::Survival => {
                (1.0, (reflectance > 0.0).then(|| 1.0 / reflectance), 2.0 * visits - 1.0)
            }
            EstimatorKind::Collision => (1.0, Some(1.0), 2.0 * visits - 1.0),
            EstimatorKind::Infinite => (1.0 / fixed_units(tally.layout().moments), Some(1.0), visits),
        };
        // Power that was cut off would have come in here at most `visits` times.
        let counts = &tally.counts;
        let cut_off = counts.truncated_weight as f64 / Counts::WEIGHT_UNITS / counts.walks.max(1) as f64;
        Meaning {
            unit,
            irradiance_per_event: scale.map(|scale| scale * per_hit),
            ratio_bound,
            bias_bound: reflectance * per_hit * cut_off * visits,
        }
    }

    /// b_i = R_i × the mean score / p_i.
    fn meaning_of_gathering(&self, gathering: &Gathering, patch: usize, moments: usize) -> Option<Meaning> {
        let probability = gathering.probability[patch];
        if probability == 0.0 {
            return None;
        }
        // What is left of a walk that is cut off is worth at most its weight times B̄.
        let cut_off = match (self.method.estimator, self.method.infinite) {
            (EstimatorKind::Infinite, InfiniteEnd::Cutoff { threshold }) => threshold,
            (EstimatorKind::Infinite, InfiniteEnd::Length { length }) => {
                self.scene.max_reflectance().powi(length as i32)
            }
            _ => 0.0,
        };
        Some(Meaning {
            unit: 1.0 / fixed_units(moments),
            irradiance_per_event: Some(gathering.largest_value / probability),
            ratio_bound: gathering.ratio_bound,
            bias_bound: self.scene.patches()[patch].reflectance * cut_off * gathering.b_bar,
        })
    }
}
