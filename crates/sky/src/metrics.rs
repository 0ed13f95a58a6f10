//! Figures of a year: daylight autonomy, useful daylight, the daylight of EN 17037.

use crate::annual::{BoundedValue, Hour, SkyPatchCounts, Year};
use crate::replicates::{Moved, REPLICATES, half_width};

/// Standard errors beyond which a replicate does not carry an hour over a border: one in 10⁹ would.
const CLEAR: f64 = 6.0;

/// The illuminances of EN 17037:2018, table A.1, lowest first [lx].
pub const TARGETS: [f64; 4] = [100.0, 300.0, 500.0, 750.0];

/// Figures that have replicates: autonomy, useful, excess, and the part of daylight hours that reaches each of [`TARGETS`].
const FIGURES: usize = 3 + TARGETS.len();

/// What is asked of a year. Illuminances in lx.
#[derive(Clone, Debug, PartialEq)]
pub struct Wanted {
    /// The illuminance that is enough, for autonomy.
    pub enough: f64,
    /// Useful daylight lies between these.
    pub useful: [f64; 2],
    /// The hours of the clock that are occupied, each by its end: 9 to 18 are those from 8:00 to 18:00.
    pub occupied: [u32; 2],
    /// The level of intervals.
    pub confidence: f64,
}

impl Default for Wanted {
    fn default() -> Self {
        Wanted { enough: 300.0, useful: [100.0, 3000.0], occupied: [9, 18], confidence: 0.95 }
    }
}

/// Figures of a sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metrics {
    /// The mean over all hours, nights too [lx].
    pub mean: BoundedValue,
    /// DA, the part of the occupied hours in which light is enough (C. F. Reinhart & O. Walkenhorst, Energy and Buildings 33 (2001) 683–697).
    pub enough: BoundedValue,
    /// UDI, the part of them in which it is between the limits (A. Nabil & J. Mardaljevic, Lighting Research & Technology 37 (2005) 41–57).
    pub useful: BoundedValue,
    /// The part of them in which it is above both.
    pub excess: BoundedValue,
    /// The part of the daylight hours that reaches each of [`TARGETS`]: of the half of all hours with the most light from the sky (EN 17037, annex A).
    pub daylight: [BoundedValue; TARGETS.len()],
}

/// The recommendations of EN 17037:2018, table A.1: illuminances that half of the daylight hours reach on half of a plane, and on 95 % of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// Less than the least recommended.
    None,
    /// 300 lx and 100 lx.
    Minimum,
    /// 500 lx and 300 lx.
    Medium,
    /// 750 lx and 500 lx.
    High,
}

impl Level {
    /// The level of a plane of equal parts, of each of which it is known what part of the daylight hours reaches each of [`TARGETS`].
    pub fn of(plane: &[[f64; TARGETS.len()]]) -> Self {
        let reach = |part: f64, target: usize| {
            plane.iter().filter(|parts| parts[target] >= 0.5).count() as f64 >= part * plane.len() as f64
        };
        let met = |target: usize| !plane.is_empty() && reach(0.5, target) && reach(0.95, target - 1);
        match [3, 2, 1].into_iter().find(|&target| met(target)) {
            Some(3) => Level::High,
            Some(2) => Level::Medium,
            Some(_) => Level::Minimum,
            None => Level::None,
        }
    }

    /// The level in a word.
    pub fn word(self) -> &'static str {
        match self {
            Level::None => "none",
            Level::Minimum => "minimum",
            Level::Medium => "medium",
            Level::High => "high",
        }
    }
}

/// The hours of a year that figures are about, and their borders.
struct Calendar<'a> {
    wanted: &'a Wanted,
    /// Numbers of the hours that are occupied.
    occupied: Vec<usize>,
    /// Numbers of daylight hours.
    daylight: Vec<usize>,
}

impl<'a> Calendar<'a> {
    fn new(hours: &[Hour], wanted: &'a Wanted) -> Self {
        let [first, last] = wanted.occupied;
        let occupied = (0..hours.len()).filter(|&hour| (first..=last).contains(&hours[hour].time[2]));
        let mut daylight: Vec<usize> = (0..hours.len()).collect();
        daylight.sort_by(|&a, &b| hours[b].diffuse.total_cmp(&hours[a].diffuse));
        daylight.truncate(hours.len().div_ceil(2));
        Calendar { wanted, occupied: occupied.collect(), daylight }
    }

    /// The borders of each figure, and the hours that it is about.
    fn parts(&self) -> [([f64; 2], &[usize]); FIGURES] {
        let [least, most] = self.wanted.useful;
        let over = [self.wanted.enough, most];
        let occupied = [[over[0], f64::INFINITY], [least, most], [most, f64::INFINITY]];
        std::array::from_fn(|figure| match occupied.get(figure) {
            Some(&borders) => (borders, &self.occupied[..]),
            None => ([TARGETS[figure - occupied.len()], f64::INFINITY], &self.daylight[..]),
        })
    }

    /// Each figure: the part of its hours that lies within its borders.
    fn figures(&self, light: &[f64]) -> [f64; FIGURES] {
        self.parts().map(|([low, high], hours)| {
            let within = |&&hour: &&usize| light[hour] >= low && light[hour] < high;
            hours.iter().filter(within).count() as f64 / hours.len().max(1) as f64
        })
    }

    /// What replicates say of each figure.
    fn replicates(&self, (moved, lit): (&Moved, &[usize]), light: &[f64]) -> [Vec<f64>; FIGURES] {
        let borders: Vec<f64> = self.parts().into_iter().flat_map(|(borders, _)| borders).collect();
        let unclear = |&i: &usize| {
            let (light, reach) = (light[lit[i]], CLEAR * moved.spread(i));
            borders.iter().any(|border| (light - border).abs() <= reach)
        };
        let unclear: Vec<usize> = (0..lit.len()).filter(unclear).collect();
        let mut replicates = [const { Vec::new() }; FIGURES];
        let mut other = light.to_vec();
        for number in 0..REPLICATES as u64 {
            for (&i, step) in unclear.iter().zip(moved.replicate(number, &unclear)) {
                other[lit[i]] = light[lit[i]] + step;
            }
            replicates.iter_mut().zip(self.figures(&other)).for_each(|(all, one)| all.push(one));
        }
        replicates
    }
}

/// The hours of a year at a sensor.
pub struct SensorYear<'a> {
    year: &'a Year,
    row: &'a SkyPatchCounts,
    /// Hours with light, by number.
    lit: Vec<usize>,
    moved: Moved,
    /// Hour by hour, the light of the sun that shines on the sensor straight.
    beam: &'a [f64],
}

impl Year {
    /// The year at a sensor by its counts, given hour by hour the light of the sun that shines on it straight.
    pub fn at<'a>(&'a self, row: &'a SkyPatchCounts, beam: &'a [f64]) -> SensorYear<'a> {
        let lit: Vec<usize> = (0..self.hours.len()).filter(|&hour| !self.hours[hour].is_dark()).collect();
        let moved = Moved::new(row, lit.iter().map(|&hour| &self.hours[hour]));
        SensorYear { year: self, row, lit, moved, beam }
    }
}

impl SensorYear<'_> {
    /// The light of each hour, and its standard error.
    pub fn light(&self) -> Vec<[f64; 2]> {
        let mut light: Vec<[f64; 2]> = self.beam.iter().map(|&beam| [beam, 0.0]).collect();
        for (i, &hour) in self.lit.iter().enumerate() {
            light[hour] = [self.moved.means[i] + self.beam[hour], self.moved.errors[i]];
        }
        light
    }

    /// The figures of the sensor, given what [`Year::mean`] says.
    ///
    /// The interval of a part of hours is that of its replicates: each moves all hours by errors with the covariance of the counts, and counts the hours
    /// within the borders again. A part jumps by whole hours, so half an hour is added: where only a few hours are near a border, the interval holds the
    /// truth more often than its level says.
    pub fn metrics(&self, mean: (&[f64], &[(usize, f64)]), wanted: &Wanted) -> Metrics {
        let calendar = Calendar::new(&self.year.hours, wanted);
        let light: Vec<f64> = self.light().into_iter().map(|[light, _]| light).collect();
        let replicates = calendar.replicates((&self.moved, &self.lit), &light);
        let hours = calendar.parts().map(|(_, hours)| hours.len());
        let figures = calendar.figures(&light).into_iter().zip(replicates).zip(hours);
        let mut known = figures.map(|((value, replicates), hours)| {
            let half = half_width(value, &replicates, wanted.confidence);
            let half = if half > 0.0 { half + 0.5 / hours as f64 } else { 0.0 };
            BoundedValue { value, low: (value - half).max(0.0), high: (value + half).min(1.0) }
        });
        let mut next = || known.next().expect("there are that many figures");
        let always = self.beam.iter().sum::<f64>() / self.beam.len().max(1) as f64;
        let BoundedValue { value, low, high } = self.row.light(mean.0, mean.1, wanted.confidence);
        Metrics {
            mean: BoundedValue { value: value + always, low: low + always, high: high + always },
            enough: next(),
            useful: next(),
            excess: next(),
            daylight: std::array::from_fn(|_| next()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::annual::tests::{counted, truth, weather, window};
    use crate::dome::Dome;
    use radiosity::daylight::SkyPatches;
    use stats::{Coverage, Interval};

    /// Intervals of the mean, of autonomy, useful daylight and excess, and of daylight hours hold the truth of 500 hours in 94 % of 250 seeds and more:
    /// the test allows three standard errors of this (4.5 %) below, which raises a false alarm in 100 runs for the twelve of them.
    #[test]
    fn intervals_of_the_figures_cover() {
        cover(1 << 16);
    }

    #[test]
    fn intervals_of_the_figures_of_more_walks_cover() {
        cover(1 << 18);
    }

    fn cover(walks: u64) {
        let dome = Dome::new(SkyPatches::new(145).unwrap());
        let (year, mut p) = (weather(&dome, 500), window(&dome));
        // A dimmer place of the room, so that the illuminances of the standard lie among its hours.
        let last = p.len() - 1;
        p[..last].iter_mut().for_each(|p| *p *= 0.06);
        p[last] = 1.0 - p[..last].iter().sum::<f64>();
        let wanted = Wanted { enough: 400.0, useful: [200.0, 600.0], ..Wanted::default() };
        let exact: Vec<f64> = year.hours.iter().map(|hour| truth(&p, hour)).collect();
        let beam = vec![0.0; exact.len()];
        let expected = Calendar::new(&year.hours, &wanted).figures(&exact);
        assert!((0.2..0.8).contains(&expected[0]) && (0.2..0.9).contains(&expected[4]), "{expected:?}");
        let mean = year.mean(&dome);
        let mut coverages = [Coverage::default(); 6];
        for seed in 0..250 {
            let row = counted(&p, walks, seed);
            let found = year.at(&row, &beam).metrics((&mean.0, &mean.1), &wanted);
            let all = exact.iter().sum::<f64>() / exact.len() as f64;
            let [_, three, five, _] = found.daylight;
            let known = [found.mean, found.enough, found.useful, found.excess, three, five];
            let truths = [all, expected[0], expected[1], expected[2], expected[4], expected[5]];
            for ((coverage, BoundedValue { low, high, .. }), truth) in
                coverages.iter_mut().zip(known).zip(truths)
            {
                coverage.record(&Interval { low, high }, truth);
            }
        }
        let rates = coverages.map(|coverage| coverage.rate(0.95).unwrap().value);
        println!("{walks}: {rates:?}");
        assert!(rates.iter().all(|rate| *rate >= 0.905), "{walks} walks: {rates:?}");
    }

    /// Hours far from a border leave a figure without doubt.
    #[test]
    fn what_is_clear_is_certain() {
        let dome = Dome::new(SkyPatches::new(145).unwrap());
        let (year, p) = (weather(&dome, 50), window(&dome));
        let (row, mean) = (counted(&p, 1 << 14, 1), year.mean(&dome));
        let wanted = Wanted { enough: 1.0, useful: [1e-3, 1e9], ..Wanted::default() };
        let found = year.at(&row, &[5.0; 50]).metrics((&mean.0, &mean.1), &wanted);
        assert_eq!(found.enough, BoundedValue { value: 1.0, low: 1.0, high: 1.0 });
        assert_eq!((found.useful.value, found.excess.high), (1.0, 0.0));
    }

    #[test]
    fn levels_are_those_of_the_table() {
        let reaching = |target: f64| TARGETS.map(|other| if other <= target { 0.5 } else { 0.49 });
        let plane = |high: usize, most: f64, low: usize, least: f64| {
            Level::of(&[vec![reaching(most); high], vec![reaching(least); low]].concat())
        };
        assert_eq!(Level::of(&[]), Level::None);
        assert_eq!(plane(10, 750.0, 10, 500.0), Level::High);
        assert_eq!(plane(10, 750.0, 10, 300.0), Level::Medium);
        assert_eq!(plane(9, 750.0, 11, 300.0), Level::Minimum);
        assert_eq!(plane(19, 300.0, 1, 0.0), Level::Minimum);
        assert_eq!(plane(18, 300.0, 2, 0.0), Level::None);
        assert!(Level::High > Level::Medium && Level::High.word() == "high");
    }
}
