//! `planes.svg`: maps of illuminance on planes of points, with lines of equal illuminance.

mod raster;

use std::fmt::Write as _;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::DVec3;
use radiosity::sensors::{Reading, Readings};

use crate::picture::Picture;
use crate::words::quantity;
pub use raster::isolux_picture;

/// The width of a drawing, and the room for words about it [px].
const WIDTH: f64 = 720.0;
const MARGIN: f64 = 48.0;

/// Lines between the least and the greatest value, about.
const LINES: f64 = 8.0;

/// Colours from the least value to the greatest, with equal steps between them: cividis, whose lightness grows evenly, so that people without
/// colour vision read it alike (J. Nuñez, C. Anderton & R. Renslow, PLoS ONE 13(7), 2018). The page has these colours, too.
const SCALE: [u32; 10] = [
    0x00_224e, 0x12_3570, 0x3b_496c, 0x57_5d6d, 0x70_7173, 0x8a_8678, 0xa5_9c74, 0xc3_b369, 0xe1_cc55,
    0xfe_e838,
];

/// A plane as it is drawn: values at points of a grid, u to the right and v upwards; NaN where there is none.
pub(crate) struct PlaneGrid {
    pub(crate) size: [usize; 2],
    /// The distance of points along u and v [m].
    pub(crate) step: [f64; 2],
    /// Point by point along v, and then along u.
    pub(crate) values: Vec<f64>,
}

impl PlaneGrid {
    fn of(points: &[[DVec3; 2]], [nu, nv]: [u32; 2], values: Vec<f64>) -> Self {
        let (nu, nv) = (nu as usize, nv as usize);
        let apart = |other: usize| points[0][0].distance(points[other][0]);
        PlaneGrid { size: [nu, nv], step: [apart(nv), apart(1)], values }
    }

    fn value(&self, i: usize, j: usize) -> f64 {
        self.values[i * self.size[1] + j]
    }

    fn range(&self) -> [f64; 2] {
        let fold = |of: fn(f64, f64) -> f64, from| self.values.iter().copied().fold(from, of);
        [fold(f64::min, f64::INFINITY), fold(f64::max, f64::NEG_INFINITY)]
    }

    /// Its sides along u and v [m].
    fn sides(&self) -> [f64; 2] {
        [0, 1].map(|axis| self.size[axis] as f64 * self.step[axis])
    }

    /// What is written above its map: its name, its least and its greatest value in a `unit`, its sides.
    fn title(&self, name: &str, unit: &str) -> String {
        let [wide, high] = self.sides();
        let values = match self.range() {
            [low, high] if low <= high => format!("{} … {} {unit}", quantity(low), quantity(high)),
            _ => "unknown".into(),
        };
        format!("{name}: {values}, {wide:.2} × {high:.2} m")
    }

    /// A pixel for each point, in the colour of its value.
    fn picture(&self) -> Picture {
        let [low, high] = self.range();
        let [width, height] = self.size;
        let pixel = |x: usize, y: usize| {
            colour((self.value(x, height - 1 - y) - low) / (high - low).max(f64::MIN_POSITIVE))
        };
        let pixels = (0..height).flat_map(|y| (0..width).flat_map(move |x| pixel(x, y))).collect();
        Picture { width: width as u32, height: height as u32, channels: 3, pixels }
    }

    /// Pieces of the line of one value, between points in steps of the grid: marching squares, whose ends are by linear interpolation.
    fn line(&self, level: f64) -> Vec<[[f64; 2]; 2]> {
        let mut pieces = Vec::new();
        for i in 0..self.size[0] - 1 {
            for j in 0..self.size[1] - 1 {
                let corners = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(a, b)| (i + a, j + b));
                if corners.iter().any(|&(a, b)| self.value(a, b).is_nan()) {
                    continue;
                }
                let ends: Vec<[f64; 2]> = (0..4)
                    .filter_map(|side| {
                        let [(a, b), (c, d)] = [corners[side], corners[(side + 1) % 4]];
                        let [x, y] = [self.value(a, b), self.value(c, d)];
                        let part = (level - x) / (y - x);
                        let along = |from: usize, to: usize| from as f64 + (to as f64 - from as f64) * part;
                        ((x < level) != (y < level)).then(|| [along(a, c), along(b, d)])
                    })
                    .collect();
                pieces.extend(ends.chunks_exact(2).map(|pair| [pair[0], pair[1]]));
            }
        }
        pieces
    }
}

/// The colour of a part, 0 … 1, of the range; white where there is none.
pub(crate) fn colour(part: f64) -> [u8; 3] {
    if part.is_nan() {
        return [255; 3];
    }
    let place = part.clamp(0.0, 1.0) * (SCALE.len() - 1) as f64;
    let low = (place as usize).min(SCALE.len() - 2);
    let channel = |shift: u32| {
        let [a, b] = [low, low + 1].map(|at| f64::from(SCALE[at] >> shift & 0xff));
        (a + (place - low as f64) * (b - a)).round() as u8
    };
    [16, 8, 0].map(channel)
}

/// Round values within a range, about [`LINES`] of them: whole multiples of 1, 2 or 5 times a power of ten.
fn levels([low, high]: [f64; 2]) -> Vec<f64> {
    if !(high > low && high.is_finite()) {
        return Vec::new();
    }
    let rough = (high - low) / LINES;
    let power = 10_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|times| times * power).into_iter().find(|step| *step >= rough);
    let step = step.unwrap_or(rough);
    let first = (low / step).ceil() as i64;
    (first..).map(|n| n as f64 * step).take_while(|level| *level < high).collect()
}

/// The drawing of all planes that are grids, one below the other, in a `unit`; `None` where there are none.
pub fn isolux_svg(readings: &Readings, unit: &str) -> Option<String> {
    let (mut body, mut top) = (String::new(), 0.0);
    for (name, grid) in grids(readings) {
        top += draw(&mut body, &grid, &name, (unit, top));
    }
    (top > 0.0).then(|| whole(&body, top))
}

/// The name of a map: in colour it says what is drawn.
pub(crate) fn map_name(name: &str, channels: usize) -> String {
    if channels > 1 { format!("{name}, mean of the channels") } else { name.into() }
}

/// The planes that are grids, with the names of their maps. In colour the mean of the channels is drawn; a point of which a channel is unknown
/// has no value.
fn grids(readings: &Readings<'_>) -> impl Iterator<Item = (String, PlaneGrid)> {
    let (sensors, channels) = (readings.sensors(), readings.channels());
    sensors.planes().filter_map(move |plane| {
        let spec = &sensors.specs()[plane];
        let (points, grid) = spec.shape.points()?;
        let known = |reading: &Reading| reading.irradiance.unwrap_or(f64::NAN);
        let value = |cell: usize| readings.cell(cell).iter().map(known).sum::<f64>() / channels as f64;
        let drawn = || PlaneGrid::of(points, grid, sensors.cells_of(plane).map(value).collect());
        (!grid.contains(&1)).then(|| (map_name(&spec.name, channels), drawn()))
    })
}

/// The drawing of one grid.
pub(crate) fn map_svg(grid: &PlaneGrid, name: &str, unit: &str) -> String {
    let mut body = String::new();
    let height = draw(&mut body, grid, name, (unit, 0.0));
    whole(&body, height)
}

/// The drawing of a body of this height [px].
pub(crate) fn whole(body: &str, height: f64) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height:.0}\" font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n{body}</svg>\n"
    )
}

/// Draws a plane from `top` on and returns its height [px].
pub(crate) fn draw(body: &mut String, grid: &PlaneGrid, name: &str, (unit, top): (&str, f64)) -> f64 {
    let [wide, high] = grid.sides();
    let scale = (WIDTH - 2.0 * MARGIN) / wide.max(high);
    let [left, bottom] = [MARGIN, top + MARGIN + high * scale];
    let at = |[i, j]: [f64; 2]| {
        [left + (i + 0.5) * grid.step[0] * scale, bottom - (j + 0.5) * grid.step[1] * scale]
    };
    let title = grid.title(name, unit).replace('&', "&amp;").replace('<', "&lt;");
    let mut write = |text: String| body.push_str(&text);
    write(format!("<text x=\"{left}\" y=\"{:.1}\">{title}</text>\n", top + MARGIN - 10.0));
    write(format!(
        "<rect x=\"{left}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"none\" stroke=\"#888\"/>\n",
        top + MARGIN,
        wide * scale,
        high * scale
    ));
    let mut png = Vec::new();
    grid.picture().write_png(&mut png).expect("memory takes all");
    write(format!(
        "<image x=\"{left}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" preserveAspectRatio=\"none\" href=\"data:image/png;base64,{}\"/>\n",
        top + MARGIN,
        wide * scale,
        high * scale,
        STANDARD.encode(png)
    ));
    for level in levels(grid.range()) {
        let pieces = grid.line(level);
        let mut path = String::new();
        for [a, b] in &pieces {
            let ([x, y], [u, v]) = (at(*a), at(*b));
            write!(path, "M{x:.1} {y:.1}L{u:.1} {v:.1}").expect("strings take all");
        }
        write(format!("<path d=\"{path}\" fill=\"none\" stroke=\"#fff\" stroke-width=\"1.2\"/>\n"));
        if let Some([a, b]) = pieces.get(pieces.len() / 2) {
            let [x, y] = at([0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])]);
            write(format!(
                "<text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\" fill=\"#000\" stroke=\"#fff\" stroke-width=\"3\" paint-order=\"stroke\">{}</text>\n",
                y + 4.0,
                quantity(level)
            ));
        }
    }
    high * scale + 2.0 * MARGIN
}

#[cfg(test)]
mod tests {
    use radiosity::{
        IndexChoice, Scene, Spectrum,
        sensors::{SensorShape, SensorSpec},
    };

    use super::*;
    use crate::scenes::{cube_spec, experiment, shot};

    /// Of x + 2y on a grid, each point of a line has its value; the lines of a slope cross all columns.
    #[test]
    fn lines_have_their_value() {
        let size = [6, 5];
        let values = (0..30).map(|n| (n / 5) as f64 + 2.0 * (n % 5) as f64).collect();
        let grid = PlaneGrid { size, step: [1.0, 1.0], values };
        let levels = levels(grid.range());
        assert_eq!(levels, [0.0, 2.0, 4.0, 6.0, 8.0, 10.0, 12.0]);
        for level in levels.into_iter().skip(1) {
            let pieces = grid.line(level);
            assert!(!pieces.is_empty());
            for [x, y] in pieces.into_iter().flatten() {
                assert!((x + 2.0 * y - level).abs() < 1e-12, "{x} {y}");
            }
        }
    }

    /// Where a value is missing no line ends, and the map is white; the least value is dark, the greatest bright.
    #[test]
    fn holes_stay_white_and_colours_follow_values() {
        let values = vec![0.0, 1.0, 2.0, f64::NAN, 4.0, 5.0, 6.0, 7.0, 8.0];
        let grid = PlaneGrid { size: [3, 3], step: [1.0, 1.0], values };
        let picture = grid.picture();
        // The middle of the lower row, whose third value is missing.
        assert_eq!(picture.pixels[3 * 7..3 * 8], [255; 3]);
        assert_eq!(
            (&picture.pixels[3 * 6..3 * 7], &picture.pixels[3 * 2..3 * 3]),
            (&[0, 0x22, 0x4e][..], &[0xfe, 0xe8, 0x38][..])
        );
        assert!(grid.line(0.5).is_empty(), "the cell beside the hole has none");
        assert!(!grid.line(7.5).is_empty());
        assert!(map_svg(&grid, "a < b", "lx").contains("a &lt; b: 0.00 … 8.00 lx, 3.00 × 3.00 m"));
    }

    /// In colour the value is the mean of the channels, and the title says so; where nothing is known there is no value, and none is told.
    #[test]
    fn coloured_planes_show_the_mean_of_their_channels() {
        let mut spec = cube_spec();
        spec.surfaces[1].cell_emittance = vec![(4, Spectrum::rgb([1.0, 0.5, 0.0]))];
        let scene = Scene::build(&spec, IndexChoice::Auto).unwrap();
        let at = |n: u32| DVec3::new(0.25 + 0.5 * f64::from(n / 2), 0.25 + 0.5 * f64::from(n % 2), 0.4);
        let points = (0..4).map(|n| [at(n), DVec3::Z]).collect();
        let shape = SensorShape::Points { points, grid: [2, 2] };
        let plane = SensorSpec { name: "desk".into(), shape };
        let experiment = experiment(&scene).with_sensors(&[plane]).unwrap();
        let tally = shot(&experiment);
        let readings = Readings::new(&experiment, &tally, 0.95).unwrap();
        let (name, grid) = grids(&readings).next().unwrap();
        assert_eq!(name, "desk, mean of the channels");
        let mean = |cell: usize| readings.cell(cell).iter().filter_map(|of| of.irradiance).sum::<f64>() / 3.0;
        assert!((0..4).all(|cell| mean(cell) > 0.0 && (grid.values[cell] - mean(cell)).abs() < 1e-12));
        let nothing = PlaneGrid { values: vec![f64::NAN; 4], ..grid };
        assert_eq!(nothing.title("desk", "lx"), "desk: unknown, 1.00 × 1.00 m");
    }

    #[test]
    fn levels_are_round_and_none_of_an_even_plane() {
        assert_eq!(levels([3.0, 3.0]), [0.0; 0]);
        assert_eq!(levels([101.0, 478.0]), [150.0, 200.0, 250.0, 300.0, 350.0, 400.0, 450.0]);
    }
}
