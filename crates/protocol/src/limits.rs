//! Limits of what the walks of a job can come to, so that an impossible result is refused when it arrives.
//!
//! The limits are generous: a result that exceeds one is wrong beyond doubt. A result within them may still be wrong;
//! `radwalk audit` finds that.

use radiosity::{Counts, Layout};

/// The most that the walks of a job can come to. Walks end one by one; where batches take the place of walks, their
/// rays or walks do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// The ends of one walk: 1; of a batch the number of its paths.
    pub ends: u64,
    /// The most rays of one walk.
    pub rays: u64,
    /// The most units that one ray adds to the scores of a patch.
    pub ray_score: u128,
    /// The most units of one walk's score on a patch.
    pub walk_score: u128,
    /// The limits of the sensors' rows, which follow those of patches; `None` if there are no sensors.
    pub sensors: Option<SensorLimits>,
    /// What the rows of materials can come to, which are the last; `None` where there are none.
    pub materials: Option<MaterialLimits>,
}

/// What materials can score at most: a walk as often as its rays have met one before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MaterialLimits {
    /// The rows before theirs.
    pub first_row: usize,
    /// Units of a walk's score in one row, at most.
    pub walk_score: u128,
}

/// The most that sensors can score.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SensorLimits {
    /// The number of rows before those of sensors.
    pub first_row: usize,
    /// The most units of one sample's score on a cell, and the most rays of it. A walk has at most one sample.
    pub sample: u128,
}

/// The most weight of one walk, in units of 2⁻⁴⁰.
const MOST_WEIGHT: u128 = 1 << 48;

impl Limits {
    /// Limits of work of which nothing is known but that each walk ends once.
    pub const NONE: Limits = Limits {
        ends: 1,
        rays: u64::MAX,
        ray_score: u128::MAX,
        walk_score: u128::MAX,
        sensors: None,
        materials: None,
    };

    /// Why a result's counts are impossible, if they are.
    pub fn breach_of_counts(&self, counts: &Counts) -> Option<&'static str> {
        let Counts { walks, rays, absorbed, absorbed_back, escaped, truncated, .. } = *counts;
        let ended: u128 = [absorbed, absorbed_back, escaped, truncated].into_iter().map(u128::from).sum();
        let paths = u128::from(walks) * u128::from(self.ends);
        let rays = u128::from(rays);
        let by_ray = self.ends > 1 && ended == rays;
        let weights = [counts.absorbed_back_weight, counts.escaped_weight, counts.truncated_weight];
        let most = u128::from(walks) * MOST_WEIGHT;
        match () {
            () if ended != paths && !by_ray => Some("not every walk of it ended once"),
            () if rays > u128::from(walks) * u128::from(self.rays) => Some("its walks are too long"),
            () if weights.as_flattened().iter().any(|&weight| weight > most) => {
                Some("its walks carry too much weight")
            }
            () => None,
        }
    }

    /// The number of the first sum of sensors and of materials, and the most units of one of their samples.
    fn rows_apart(&self, layout: Layout) -> [(usize, u128); 2] {
        let sensors = self.sensors.map(|SensorLimits { first_row, sample }| (first_row, sample));
        let materials =
            self.materials.map(|MaterialLimits { first_row, walk_score }| (first_row, walk_score));
        [sensors, materials]
            .map(|rows| rows.map_or((usize::MAX, 0), |(first, most)| (first * layout.columns(), most)))
    }

    /// Why a result's sums, patch-major, are impossible, if they are.
    pub fn breach_of_sums(
        &self,
        counts: &Counts,
        layout: Layout,
        sums: impl Iterator<Item = u128>,
    ) -> Option<&'static str> {
        let (walks, rays) = (u128::from(counts.walks), u128::from(counts.rays));
        let most = rays.saturating_mul(self.ray_score).min(walks.saturating_mul(self.walk_score));
        let scores = layout.scores * layout.moments;
        let events = layout.columns() - usize::from(layout.events);
        let [(first_of_sensors, sample), (first_of_materials, marks)] = self.rows_apart(layout);
        let slope_units = u128::from(layout.slope_units());
        // The scores of this patch, which its slopes are held to.
        let mut scored = vec![0_u128; layout.scores];
        let (mut column, mut before) = (0, 0_u128);
        for (number, sum) in sums.enumerate() {
            let of_sensor = number >= first_of_sensors;
            let (is_first, is_event) = (column % layout.moments == 0, column == events);
            let of_material = number >= first_of_materials;
            let largest = match () {
                () if of_material => marks,
                () if of_sensor => sample,
                () => self.walk_score,
            };
            let (least, limit) = match () {
                () if of_sensor && (is_first || is_event) => (0, walks.saturating_mul(sample)),
                () if is_event => (0, rays.max(walks)),
                () if of_material && is_first => (0, walks.saturating_mul(marks)),
                () if is_first && column < scores => (0, most),
                () if column >= scores => {
                    // |d| ≤ x for a slope d of a score x, so that x + d ≤ 2x and d² ≤ x².
                    let channel = (column - scores) / layout.moments * layout.scores / layout.slopes;
                    let score = scored[channel].saturating_mul(slope_units);
                    let each = if is_first { 2 } else { largest.saturating_mul(slope_units) };
                    (0, score.saturating_mul(each))
                }
                // Scores are whole numbers: the sum of their squares is no less than their sum, and no more than their
                // sum times the largest score. The samples of sensors and their rays obey this, too.
                () => (before, before.saturating_mul(largest)),
            };
            if sum > limit {
                return Some("its scores are more than its walks can make");
            }
            if sum < least {
                return Some("its sums of squares are less than its sums of scores");
            }
            if is_first && column < scores {
                scored[column / layout.moments] = sum;
            }
            before = sum;
            column = (column + 1) % layout.columns();
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits =
        Limits { ends: 1, rays: 1000, ray_score: 1, walk_score: 1000, sensors: None, materials: None };
    const PAIR: Layout = Layout { scores: 1, moments: 2, slopes: 0, events: false };

    fn counts() -> Counts {
        Counts {
            walks: 100,
            rays: 300,
            absorbed: 90,
            escaped: 10,
            escaped_weight: [10 << 40, 0, 0],
            ..Counts::default()
        }
    }

    #[test]
    fn walks_end_once_and_take_few_rays() {
        let breach = |change: fn(&mut Counts)| {
            let mut counts = counts();
            change(&mut counts);
            LIMITS.breach_of_counts(&counts)
        };
        assert_eq!(breach(|_| {}), None);
        assert!(breach(|counts| counts.absorbed -= 1).is_some());
        assert!(breach(|counts| counts.truncated = u64::MAX).is_some());
        assert!(breach(|counts| counts.rays = u64::MAX).is_some());
        assert!(breach(|counts| counts.escaped_weight[1] = u128::MAX).is_some());
        let batch = Limits { ends: 7, ..LIMITS };
        let of_batches = Counts { walks: 10, rays: 75, absorbed: 70, ..Counts::default() };
        assert_eq!(batch.breach_of_counts(&of_batches), None);
        assert_eq!(
            batch.breach_of_counts(&Counts { absorbed: 75, ..of_batches }),
            None,
            "each ray of a chain"
        );
        assert!(batch.breach_of_counts(&Counts { absorbed: 69, ..of_batches }).is_some());
    }

    /// 100 walks take at most 100 samples, each of up to 2¹⁰ units and rays.
    #[test]
    fn sensors_score_no_more_than_their_samples_can() {
        let limits = Limits { sensors: Some(SensorLimits { first_row: 1, sample: 1 << 10 }), ..LIMITS };
        let breach = |sums: [u128; 4]| limits.breach_of_sums(&counts(), PAIR, sums.into_iter());
        assert_eq!(breach([300, 90_000, 100 << 10, 100 << 20]), None);
        assert!(breach([301, 90_000, 0, 0]).is_some(), "patches are as they were");
        assert!(breach([0, 0, (100 << 10) + 1, 100 << 20]).is_some());
        assert!(breach([0, 0, 1 << 10, (1 << 20) + 1]).is_some());
        assert!(breach([0, 0, 10, 9]).is_some());
    }

    /// 100 walks mark a row with 500 at most each.
    #[test]
    fn materials_score_no_more_than_their_walks_can() {
        let materials = Some(MaterialLimits { first_row: 1, walk_score: 500 });
        let limits = Limits { materials, ..LIMITS };
        let breach = |sums: [u128; 4]| limits.breach_of_sums(&counts(), PAIR, sums.into_iter());
        assert_eq!(breach([300, 90_000, 50_000, 25_000_000]), None);
        assert!(breach([0, 0, 50_001, 25_000_000]).is_some());
        assert!(breach([0, 0, 50_000, 25_000_001]).is_some());
        assert!(breach([301, 90_000, 0, 0]).is_some(), "patches are as they were");
    }

    #[test]
    fn scores_are_no_more_than_walks_can_make() {
        let breach = |sums: [u128; 4]| LIMITS.breach_of_sums(&counts(), PAIR, sums.into_iter());
        assert_eq!(breach([300, 90_000, 0, 0]), None);
        assert!(breach([0, 0, 301, 301]).is_some(), "more than rays");
        assert!(breach([0, 1, 0, 0]).is_some(), "squares of nothing");
        assert!(breach([10, 9, 0, 0]).is_some());
        assert!(breach([10, 10_001, 0, 0]).is_some());
        assert!(breach([0, 0, 1 << 90, 1 << 100]).is_some());
        assert!(breach([u128::MAX; 4]).is_some());
        let counted = Layout { events: true, ..PAIR };
        let breach = |sums: [u128; 3]| LIMITS.breach_of_sums(&counts(), counted, sums.into_iter());
        assert_eq!(breach([300, 300, 300]), None);
        assert!(breach([300, 300, 301]).is_some());
        assert_eq!(
            Limits::NONE.breach_of_sums(&counts(), counted, [u128::MAX; 3].into_iter()),
            Some("its scores are more than its walks can make"),
            "events"
        );
    }
}
