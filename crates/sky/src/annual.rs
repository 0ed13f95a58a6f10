//! The hours of a year from what walks of one sensor have counted.
//!
//! A walk is born at a sensor with the cosine about its normal as density, is reflected with probability R where it arrives, and leaves for
//! patch j of the sky, or for the ground, or ends. With p_j the probability of patch j and L_j its radiance, the sensor receives
//! E = π·Σ_j p_j·L_j: each walk scores x = π·L_j, or 0 where it ends. So of N walks with n_j for patch j, E is estimated by
//! Σ n_j·x_j/N, and the variance of that is (Σ p_j·x_j² − E²)/N. The counts of a row are multinomial: hours share them, and the
//! covariance of E and E′ is (Σ p_j·x_j·x′_j − E·E′)/N.

use std::f64::consts::PI;

use stats::{Sample, mean_interval};

use crate::dome::Dome;
use crate::epw::{Weather, WeatherHour};
use crate::perez::SkyUnit;

/// What became of the walks of one sensor, by the numbers of a sky vector: the ground, then patches.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SkyPatchCounts {
    /// All walks.
    pub walks: u64,
    /// Those that left without a reflection.
    pub straight: Vec<u64>,
    /// Those that left after some.
    pub reflected: Vec<u64>,
}

/// A number with its interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundedValue {
    /// The estimate.
    pub value: f64,
    /// The lower end of the interval.
    pub low: f64,
    /// The upper end of the interval.
    pub high: f64,
}

impl SkyPatchCounts {
    /// The coefficients ∂E/∂L_j of numbers of the sky vector [sr]: π·p_j.
    pub fn coefficients(&self) -> impl Iterator<Item = f64> + '_ {
        let each = self.straight.iter().zip(&self.reflected);
        each.map(|(straight, reflected)| PI * (straight + reflected) as f64 / self.walks as f64)
    }

    /// The standard errors of [`SkyPatchCounts::coefficients`] [sr]: π·√(p·(1 − p)/N).
    pub fn coefficient_errors(&self) -> Vec<f64> {
        let parts = self.coefficients().map(|coefficient| coefficient / PI);
        parts.map(|p| PI * (p * (1.0 - p) / self.walks as f64).sqrt()).collect()
    }

    /// What the sensor receives from a sky vector, and from the vector of the sun besides where walks have been reflected.
    ///
    /// Few walks find the sun, and each of them brings much. So what these say has an interval of its own, and the ends of both intervals are
    /// added in squares (G. Y. Zou & A. Donner, Statistics in Medicine 27 (2008) 1693–1702); the covariance, −E·E′/N, is left out.
    pub fn light(&self, sky: &[f64], sun: &[(usize, f64)], confidence: f64) -> BoundedValue {
        let of = |(scores, most): (Sample, f64)| {
            let interval = mean_interval(scores, 1.0, confidence, most.max(1.0));
            BoundedValue { value: scores.mean().unwrap_or(0.0), low: interval.low, high: interval.high }
        };
        let [rest, sunny] = self.samples(sky, sun).map(of);
        if sun.is_empty() {
            return rest;
        }
        let value = rest.value + sunny.value;
        let low = value - (rest.value - rest.low).hypot(sunny.value - sunny.low);
        BoundedValue { value, low, high: value + (rest.high - rest.value).hypot(sunny.high - sunny.value) }
    }

    /// The scores of walks that have not found the sun, and of those that have, with the largest of each.
    fn samples(&self, sky: &[f64], sun: &[(usize, f64)]) -> [(Sample, f64); 2] {
        let mut others = self.reflected.clone();
        sun.iter().for_each(|&(patch, _)| others[patch] = 0);
        let counts = self.straight.iter().chain(&others).zip(sky.iter().chain(sky));
        let rest = sample(self.walks, counts.map(|(&n, radiance)| (PI * radiance, n)));
        let lit = |&(patch, radiance): &(usize, f64)| PI * (radiance + sky[patch]);
        let sunny = sample(self.walks, sun.iter().map(|one| (lit(one), self.reflected[one.0])));
        [
            (rest, PI * sky.iter().copied().fold(0.0, f64::max)),
            (sunny, sun.iter().map(lit).fold(0.0, f64::max)),
        ]
    }

    /// Walks by number, straight ones first, where there are any, and those of these `besides` that were reflected: the number, whether they were
    /// reflected, how many.
    pub(crate) fn classes(&self, besides: &[bool]) -> impl Iterator<Item = (usize, bool, u64)> {
        let straight = self.straight.iter().enumerate().map(|(j, &n)| (j, false, n));
        let reflected = self.reflected.iter().enumerate().map(|(j, &n)| (j, true, n));
        straight.chain(reflected).filter(|&(j, reflected, n)| n > 0 || reflected && besides[j])
    }
}

/// The moments of the scores of walks: each score with the number of walks that have it; all other walks score 0.
fn sample(walks: u64, scores: impl Iterator<Item = (f64, u64)>) -> Sample {
    Sample::weighted(walks, scores.map(|(x, n)| (x, u128::from(n), u128::from(n))))
}

/// The light of an hour.
#[derive(Clone, Debug, PartialEq)]
pub struct Hour {
    /// The month, the day, and the hour that ends.
    pub time: [u32; 3],
    /// The radiance of the ground and of each patch; empty where all is dark.
    pub sky: Vec<f64>,
    /// The patches that stand for the sun where its light is reflected, and the radiance of each.
    pub sun: Vec<(usize, f64)>,
    /// What a plane that faces the sun receives from it, and the unit vector to it.
    pub beam: f64,
    /// See [`Hour::beam`].
    pub direction: [f64; 3],
    /// What a horizontal plane receives from the sky without the sun.
    pub diffuse: f64,
}

impl Hour {
    fn new(hour: &WeatherHour, dome: &Dome, quantity: SkyUnit, ground: f64) -> Self {
        let conditions = &hour.conditions;
        let time = [hour.month, hour.day, hour.hour];
        let direction =
            crate::sun::SunPosition { altitude: conditions.altitude, azimuth: conditions.azimuth }
                .direction();
        let [diffuse, normal] = conditions.light(quantity);
        // A sun below the horizon at the middle of the hour is left out.
        let beam = if direction[2] > 0.0 { normal } else { 0.0 };
        let mut sky = conditions.sky(quantity).map(|sky| dome.vector(&sky)).unwrap_or_default();
        if sky.is_empty() && beam > 0.0 {
            sky = vec![0.0; dome.size()];
        }
        if let Some(below) = sky.first_mut() {
            *below = ground / PI * (diffuse + beam * direction[2].max(0.0));
        }
        let sun = if beam > 0.0 { dome.sun(direction, beam) } else { Vec::new() };
        Hour { time, sky, sun, beam, direction, diffuse }
    }

    /// Whether there is no light at all.
    pub fn is_dark(&self) -> bool {
        self.sky.is_empty()
    }
}

/// The light of the hours of a year.
#[derive(Clone, Debug)]
pub struct Year {
    /// Hour by hour.
    pub hours: Vec<Hour>,
}

impl Year {
    /// The hours of a weather file, over ground of this reflectance.
    pub fn new(weather: &Weather, dome: &Dome, quantity: SkyUnit, ground: f64) -> Self {
        Year { hours: weather.hours.iter().map(|hour| Hour::new(hour, dome, quantity, ground)).collect() }
    }

    /// The sky vector of the mean hour, and its sun.
    pub fn mean(&self, dome: &Dome) -> (Vec<f64>, Vec<(usize, f64)>) {
        let (mut sky, mut sun) = (vec![0.0; dome.size()], vec![0.0; dome.size()]);
        let part = 1.0 / self.hours.len() as f64;
        for hour in &self.hours {
            sky.iter_mut().zip(&hour.sky).for_each(|(sum, radiance)| *sum += part * radiance);
            hour.sun.iter().for_each(|&(patch, radiance)| sun[patch] += part * radiance);
        }
        (sky, sun.into_iter().enumerate().filter(|&(_, radiance)| radiance > 0.0).collect())
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use radiosity::{Sequence, daylight::SkyPatches};
    use stats::Coverage;

    /// Counts of walks of known probabilities, the last of which is that of ending.
    pub(crate) fn counted(probabilities: &[f64], walks: u64, seed: u64) -> SkyPatchCounts {
        let numbers = (probabilities.len() - 1) / 2;
        let mut counts = vec![0; probabilities.len()];
        let mut rng = Sequence::new(seed).walk(0);
        let ends: Vec<f64> = probabilities
            .iter()
            .scan(0.0, |sum, p| {
                *sum += p;
                Some(*sum)
            })
            .collect();
        for _ in 0..walks {
            let x = rng.pair()[0];
            counts[ends.partition_point(|&end| end <= x).min(probabilities.len() - 1)] += 1;
        }
        SkyPatchCounts {
            walks,
            straight: counts[..numbers].to_vec(),
            reflected: counts[numbers..2 * numbers].to_vec(),
        }
    }

    /// Probabilities of a sensor that sees a part of the sky through a window, and less of it by reflections.
    pub(crate) fn window(dome: &Dome) -> Vec<f64> {
        let seen = |j: usize| if (20..60).contains(&j) { 1.0 + (j % 7) as f64 } else { 0.0 };
        let (straight, reflected) = (
            (0..dome.size()).map(|j| 1e-3 * seen(j)),
            (0..dome.size()).map(|j| 2e-4 * (seen(j) + seen(j / 2))),
        );
        let mut all: Vec<f64> = straight.chain(reflected).collect();
        all.push(1.0 - all.iter().sum::<f64>());
        all
    }

    /// A few hundred hours of changing weather.
    pub(crate) fn weather(dome: &Dome, hours: usize) -> Year {
        let hour = |i: usize| {
            let [x, y] = Sequence::new(9).walk(i as u64).pair();
            let altitude = 5.0 + 55.0 * x;
            let (direct, diffuse) =
                if i.is_multiple_of(3) { (0.0, 40.0 + 300.0 * y) } else { (800.0 * y, 60.0 + 90.0 * x) };
            let conditions = crate::Conditions {
                altitude,
                azimuth: 90.0 + 180.0 * y,
                direct,
                diffuse,
                dew_point: 8.0,
                day: 100,
            };
            Hour::new(
                &WeatherHour { month: 4, day: 10, hour: 12, conditions },
                dome,
                SkyUnit::Illuminance,
                0.2,
            )
        };
        Year { hours: (0..hours).map(hour).collect() }
    }

    /// What a sensor of known probabilities receives.
    pub(crate) fn truth(probabilities: &[f64], hour: &Hour) -> f64 {
        let mut twice = hour.sky.clone();
        hour.sun.iter().for_each(|&(patch, radiance)| twice[patch] += radiance);
        PI * hour.sky.iter().chain(&twice).zip(probabilities).map(|(radiance, p)| radiance * p).sum::<f64>()
    }

    fn dome() -> Dome {
        Dome::new(SkyPatches::new(145).unwrap())
    }

    /// All walks that leave see the sky: under a uniform one a sensor in the open has E, and one half of whose walks end has E/2.
    #[test]
    fn light_follows_from_counts() {
        let dome = dome();
        let vector = dome.vector(&crate::Sky::uniform(1000.0));
        let mut straight = vec![1; dome.size()];
        straight[0] = 0;
        let row = |walks, reflected: u64| SkyPatchCounts {
            walks,
            straight: straight.clone(),
            reflected: straight.iter().map(|n| reflected * n).collect(),
        };
        assert!((row(145, 0).light(&vector, &[], 0.95).value - 1000.0).abs() < 1e-9);
        assert!((row(580, 1).light(&vector, &[], 0.95).value - 500.0).abs() < 1e-9);
        // The sun is in walks that were reflected alone.
        assert!((row(580, 0).light(&vector, &[(7, 100.0)], 0.95).value - 250.0).abs() < 1e-9);
        assert!(
            (row(580, 1).light(&vector, &[(7, 100.0)], 0.95).value - 500.0 - PI * 100.0 / 580.0).abs() < 1e-9
        );
        assert!((row(580, 1).coefficients().sum::<f64>() - 0.5 * PI).abs() < 1e-12);
        let (error, p) = (row(580, 1).coefficient_errors()[7], 2.0 / 580.0);
        assert!((error - PI * (p * (1.0 - p) / 580.0_f64).sqrt()).abs() < 1e-15);
    }

    /// Of intervals of single hours 94–97 % hold the truth: 300 seeds × 40 hours. Hours of one seed share walks, so that the error of the
    /// fraction is up to that of 300 trials, 1.3 %: the test allows that once more, false alarms one in 40.
    #[test]
    fn intervals_of_hours_cover() {
        let dome = dome();
        let (year, p) = (weather(&dome, 40), window(&dome));
        for walks in [1 << 11, 1 << 14] {
            let mut coverage = Coverage::default();
            for seed in 0..300 {
                let row = counted(&p, walks, seed);
                for hour in &year.hours {
                    let BoundedValue { low, high, .. } = row.light(&hour.sky, &hour.sun, 0.95);
                    coverage.record(&stats::Interval { low, high }, truth(&p, hour));
                }
            }
            let rate = coverage.rate(0.95).unwrap().value;
            println!("{walks}: {rate}");
            assert!((0.935..0.98).contains(&rate), "{walks} walks: {rate}");
        }
    }
}
