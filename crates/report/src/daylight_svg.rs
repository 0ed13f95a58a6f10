//! `calendar.svg` and `maps.svg`: the hours of a year as a heat map, and daylight factors and autonomy on grids of places.

use std::fmt::Write as _;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::DVec3;

use crate::daylight::{DaylightArrays, DaylightRow};
use crate::isolux::{PlaneGrid, colour, draw, whole};
use crate::picture::Picture;

/// The width of a calendar, the height of its hours, and the room for words about them [px].
const WIDTH: f64 = 624.0;
const HOUR: f64 = 8.0;
const MARGIN: f64 = 48.0;

/// Hours of a day.
const DAY: usize = 24;

/// The part of the lit hours that the scale of colours reaches; brighter hours have its last colour.
const REACH: f64 = 0.98;

/// Steps of the bar that explains the colours.
const STEPS: usize = 64;

/// The first letters of the months.
const MONTHS: [&str; 12] = ["J", "F", "M", "A", "M", "J", "J", "A", "S", "O", "N", "D"];

/// The hours of a year at one sensor: the mean of its places.
struct SensorHours {
    name: String,
    /// The months and days that the weather has, in its order.
    days: Vec<[u32; 2]>,
    /// Day by day, the light of each hour [lx]; NaN where the weather has none.
    light: Vec<[f64; DAY]>,
    /// The median over lit hours and places of the standard error over the light.
    error: f64,
}

impl DaylightArrays<'_> {
    /// A calendar for each sensor, one below the other: days from left to right, hours upwards, light in colours of equal steps.
    pub fn calendar_svg(&self) -> String {
        let (mut body, mut top) = (String::new(), 0.0);
        for places in self.sensors() {
            top += self.calendar(places).draw(&mut body, top);
        }
        whole(&body, top)
    }

    /// Maps of the daylight factor and of autonomy on each sensor that is a grid, with lines of equal value; `None` where no sensor is one.
    pub fn maps_svg(&self) -> Option<String> {
        let (mut body, mut top) = (String::new(), 0.0);
        for places in self.sensors() {
            let Some((size, step)) = grid(places) else { continue };
            let figures =
                |row: &DaylightRow<'_>| [row.daylight_factor.value, 100.0 * row.metrics.enough.value];
            for (which, word) in ["daylight factor", "autonomy"].into_iter().enumerate() {
                let map =
                    PlaneGrid { size, step, values: places.iter().map(|row| figures(row)[which]).collect() };
                top += draw(&mut body, &map, &format!("{}, {word}", places[0].sensor), ("%", top));
            }
        }
        (top > 0.0).then(|| whole(&body, top))
    }

    /// The places of each sensor.
    fn sensors(&self) -> impl Iterator<Item = &[DaylightRow<'_>]> {
        self.rows.chunk_by(|a, b| a.sensor == b.sensor)
    }

    fn calendar(&self, places: &[DaylightRow<'_>]) -> SensorHours {
        let first = self.rows.iter().position(|row| row.sensor == places[0].sensor).unwrap_or(0);
        let own = &self.light[first..first + places.len()];
        let (mut days, mut light) = (Vec::new(), Vec::new());
        for (number, &[month, day, hour]) in self.hours.iter().enumerate() {
            if days.last() != Some(&[month, day]) {
                days.push([month, day]);
                light.push([f64::NAN; DAY]);
            }
            let mean = own.iter().map(|hours| hours[number][0]).sum::<f64>() / own.len() as f64;
            let today = light.last_mut().expect("a day has begun");
            if let Some(known) = today.get_mut((hour as usize).wrapping_sub(1)) {
                *known = mean;
            }
        }
        let lit = own.iter().flat_map(|hours| hours.iter()).filter(|[light, _]| *light > 0.0);
        let error = quantile(lit.map(|[light, error]| error / light).collect(), 0.5);
        SensorHours { name: places[0].sensor.into(), days, light, error }
    }
}

impl SensorHours {
    /// Draws it from `top` on and returns its height [px].
    fn draw(&self, body: &mut String, top: f64) -> f64 {
        let [first, height] = [top + MARGIN, HOUR * DAY as f64];
        let lit = self.light.iter().flatten().copied().filter(|&light| light > 0.0).collect();
        let most = quantile(lit, REACH);
        let mut text = |[x, y]: [f64; 2], anchor: &str, words: &str| {
            writeln!(body, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{words}</text>")
                .expect("strings take all");
        };
        let name = self.name.replace('&', "&amp;").replace('<', "&lt;");
        let error = 100.0 * self.error;
        let title = format!(
            "{name}: mean illuminance of its places, hour by hour; standard error of a place and hour {error:.1} % in the median"
        );
        text([MARGIN, first - 10.0], "start", &title);
        for hour in (0..=DAY).step_by(6) {
            text([MARGIN - 6.0, first + height - HOUR * hour as f64 + 4.0], "end", &format!("{hour}:00"));
        }
        let wide = WIDTH / self.days.len() as f64;
        let months = self.days.chunk_by(|a, b| a[0] == b[0]);
        let mut left = MARGIN;
        for month in months {
            let name = MONTHS.get((month[0][0] as usize).wrapping_sub(1)).unwrap_or(&"");
            text([left + 0.5 * wide * month.len() as f64, first + height + 16.0], "middle", name);
            left += wide * month.len() as f64;
        }
        let bar = first + height + 28.0;
        text([MARGIN - 6.0, bar + 11.0], "end", "0");
        text([MARGIN + 0.4 * WIDTH + 6.0, bar + 11.0], "start", &format!("{most:.0} lx and more"));
        let hours = |x: usize, y: usize| self.light[x][DAY - 1 - y] / most.max(f64::MIN_POSITIVE);
        image(body, [MARGIN, first, WIDTH, height], [self.days.len(), DAY], hours);
        image(body, [MARGIN, bar, 0.4 * WIDTH, 14.0], [STEPS, 1], |x, _| x as f64 / (STEPS - 1) as f64);
        height + 2.0 * MARGIN + 24.0
    }
}

/// Puts a picture of parts of the scale of colours into a box: x, y, width and height [px].
fn image(
    body: &mut String,
    [x, y, width, height]: [f64; 4],
    [columns, rows]: [usize; 2],
    part: impl Fn(usize, usize) -> f64,
) {
    let pixels = (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row)));
    let pixels = pixels.flat_map(|(column, row)| colour(part(column, row))).collect();
    let mut png = Vec::new();
    let picture = Picture { width: columns as u32, height: rows as u32, channels: 3, pixels };
    picture.write_png(&mut png).expect("memory takes all");
    writeln!(
        body,
        "<image x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" preserveAspectRatio=\"none\" image-rendering=\"pixelated\" href=\"data:image/png;base64,{}\"/>",
        STANDARD.encode(png)
    )
    .expect("strings take all");
}

/// The cells of a sensor along u and v, and their distances [m]; `None` where they are not a grid of two rows and columns at least.
fn grid(places: &[DaylightRow<'_>]) -> Option<([usize; 2], [f64; 2])> {
    let size = [0, 1].map(|axis| places.iter().map(|row| row.cell[axis] as usize + 1).max().unwrap_or(0));
    let is_grid = size.iter().all(|&cells| cells > 1) && size[0] * size[1] == places.len();
    let apart = |other: usize| DVec3::from(places[0].middle).distance(DVec3::from(places[other].middle));
    is_grid.then(|| (size, [apart(size[1]), apart(1)]))
}

/// A quantile of some numbers; 0 where there are none.
fn quantile(mut numbers: Vec<f64>, part: f64) -> f64 {
    numbers.sort_by(f64::total_cmp);
    let rank = (part * numbers.len() as f64) as usize;
    numbers.get(rank.min(numbers.len().saturating_sub(1))).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sky::{BoundedValue, Matrix, Metrics};

    fn row(sensor: &str, cell: [u32; 2], value: f64) -> DaylightRow<'_> {
        let known = BoundedValue { value, low: value, high: value };
        let metrics =
            Metrics { mean: known, enough: known, useful: known, excess: known, daylight: [known; 4] };
        let middle = [f64::from(cell[0]), 2.0 * f64::from(cell[1]), 0.8];
        DaylightRow { sensor, cell, middle, walks: 4096, daylight_factor: known, metrics }
    }

    /// Two sensors, of which one is a grid; the second day lacks an hour.
    #[test]
    fn sensors_have_their_own_drawings() {
        let mut rows: Vec<_> = (0..6).map(|n| row("a & b", [n / 3, n % 3], 0.1 * f64::from(n))).collect();
        rows.push(row("point", [0, 0], 0.5));
        let mut hours: Vec<[u32; 3]> = (1..=24).map(|hour| [1, 10, hour]).collect();
        hours.extend((1..=23).map(|hour| [2, 20, hour]));
        let years: Vec<Vec<[f64; 2]>> = (0..7)
            .map(|place| (0..47).map(|hour| [100.0 * f64::from(place * hour), f64::from(hour)]).collect())
            .collect();
        let light: Vec<&[[f64; 2]]> = years.iter().map(|place| &place[..]).collect();
        let matrix = Matrix { rows: 7, columns: 0, numbers: Vec::new() };
        let all =
            DaylightArrays { rows: &rows, coefficients: [&matrix, &matrix], hours: &hours, light: &light };

        let known = all.calendar(&rows[..6]);
        assert_eq!(known.days, [[1, 10], [2, 20]]);
        // The mean of 0 … 5, times 100 lx, in the hour from 2:00 to 3:00, which is the third.
        assert!((known.light[0][2] - 500.0).abs() < 1e-9 && known.light[1][23].is_nan());
        // 1/100 at the first place that has light, down to 1/500.
        assert!((known.error - 1.0 / 300.0).abs() < 1e-12, "{}", known.error);

        let calendar = all.calendar_svg();
        assert_eq!(calendar.matches("<image").count(), 4);
        assert!(calendar.contains("a &amp; b: mean") && calendar.contains("point: mean"));
        assert!(
            calendar.contains("<text x=\"204.0\" y=\"256.0\" text-anchor=\"middle\">J</text>"),
            "{calendar}"
        );

        let maps = all.maps_svg().unwrap();
        assert_eq!(maps.matches("<image").count(), 2);
        assert!(maps.contains("a &amp; b, daylight factor: 0.00 … 0.50 %, 2.00 × 6.00 m"), "{maps}");
        assert!(maps.contains("a &amp; b, autonomy: 0.00 … 50.0 %"));
        let alone =
            DaylightArrays { rows: &rows[6..], light: &light[6..], coefficients: [&matrix, &matrix], ..all };
        assert_eq!(alone.maps_svg(), None);
    }

    #[test]
    fn quantiles_of_few_numbers() {
        assert_eq!(quantile(Vec::new(), 0.5), 0.0);
        assert_eq!((quantile(vec![3.0, 1.0, 2.0], 0.5), quantile(vec![7.0], 0.98)), (2.0, 7.0));
    }
}
