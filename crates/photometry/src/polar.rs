//! The polar curve of a luminaire as SVG, in the style of the project's charts: lines differ in their dashes.

use std::f64::consts::PI;
use std::fmt::Write;
use std::ops::Range;

use crate::Luminaire;
use crate::figures::plain;

/// The width of the drawing [pixels].
const WIDTH: f64 = 720.0;

/// The radius of the outermost ring [pixels].
const RADIUS: f64 = 240.0;

/// The planes that are drawn: their azimuth, name, and look.
const PLANES: [(f64, &str, &str); 2] = [
    (0.0, "C0–C180", "stroke=\"#000000\" stroke-width=\"2\""),
    (90.0, "C90–C270", "stroke=\"#0072B2\" stroke-width=\"2\" stroke-dasharray=\"9 5\""),
];

/// The angles from straight down that curves are drawn at, in halves of a degree.
const HALVES: Range<i32> = -360..360;

impl Luminaire {
    /// The intensities in the planes C0–C180 and C90–C270 over the angle from straight down, with rings in cd/klm of the lamps, or in cd in
    /// absolute photometry.
    pub fn polar_svg(&self) -> String {
        let (unit, scale) = self.lamp_flux().map_or(("cd", 1.0), |flux| ("cd/klm", 1000.0 / flux));
        let curves = PLANES.map(|(c, ..)| -> Vec<f64> {
            HALVES.map(|half| scale * self.in_plane(c, 0.5 * f64::from(half))).collect()
        });
        let largest = curves.iter().flatten().fold(0.0_f64, |most, value| most.max(*value));
        // A lamp that lies between the planes may be dark in both.
        let largest = if largest > 0.0 { largest } else { scale * self.brightest()[2] };
        let (step, rings) = rings(largest);
        let upwards = curves
            .iter()
            .any(|curve| curve.iter().enumerate().any(|(k, v)| !(180..=540).contains(&k) && *v > 0.0));
        let y = if upwards { 60.0 + RADIUS } else { 76.0 };
        let mut chart = PolarChart { svg: String::new(), y, upwards, step, rings };
        chart.begin(&escaped(&self.title()));
        chart.draw_grid();
        chart.draw_curves(&curves);
        chart.draw_labels();
        chart.draw_legend(unit);
        chart.put("</svg>");
        chart.svg
    }

    /// The title of the chart.
    fn title(&self) -> String {
        let named =
            [&self.name, &self.catalogue, &self.manufacturer].into_iter().find(|text| !text.is_empty());
        let title = named.map_or("Luminaire", |text| text.as_str());
        let mut short: String = title.chars().take(70).collect();
        if short.len() < title.len() {
            short.push('…');
        }
        short
    }
}

/// A chart that is being drawn.
struct PolarChart {
    svg: String,
    /// Where the lamp is, down from the upper edge [pixels].
    y: f64,
    /// Whether light goes above the horizon, so that the chart is a whole disc.
    upwards: bool,
    /// The intensity from ring to ring, and the number of rings.
    step: f64,
    rings: u32,
}

impl PolarChart {
    /// Where the lamp is, from the left edge [pixels].
    const X: f64 = WIDTH / 2.0;

    fn put(&mut self, line: &str) {
        let _ = writeln!(self.svg, "{line}");
    }

    /// The place at an angle from straight down [°] and a distance from the lamp [pixels].
    fn place(&self, from_nadir: f64, radius: f64) -> (f64, f64) {
        let (sine, cosine) = (from_nadir * PI / 180.0).sin_cos();
        (Self::X + radius * sine, self.y + radius * cosine)
    }

    /// Each ring, with its radius [pixels].
    fn radii(&self) -> impl Iterator<Item = (u32, f64)> + use<> {
        let rings = self.rings;
        (1..=rings).map(move |ring| (ring, RADIUS * f64::from(ring) / f64::from(rings)))
    }

    /// The lower edge of the rings with the numbers of the spokes [pixels].
    fn bottom(&self) -> f64 {
        self.y + RADIUS + 44.0
    }

    fn begin(&mut self, title: &str) {
        let (x, height) = (Self::X, self.bottom() + 38.0);
        self.put(&format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{height}\" viewBox=\"0 0 {WIDTH} {height}\" font-family=\"sans-serif\" font-size=\"13\">"
        ));
        self.put(&format!("<rect width=\"{WIDTH}\" height=\"{height}\" fill=\"#FFFFFF\"/>"));
        self.put(&format!("<text x=\"{x}\" y=\"28\" font-size=\"17\" text-anchor=\"middle\">{title}</text>"));
    }

    /// Rings and spokes, and the angles of the spokes.
    fn draw_grid(&mut self) {
        let (x, y) = (Self::X, self.y);
        self.put("<g fill=\"none\" stroke=\"#E1E1E1\">");
        for (_, r) in self.radii() {
            self.put(&if self.upwards {
                format!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{r:.1}\"/>")
            } else {
                format!("<path d=\"M{:.1} {y} A{r:.1} {r:.1} 0 0 0 {:.1} {y}\"/>", x - r, x + r)
            });
        }
        let most = if self.upwards { 180 } else { 90 };
        let spokes: Vec<i32> = (-most..=most).step_by(30).filter(|a| *a > -180).collect();
        for &spoke in &spokes {
            let (to_x, to_y) = self.place(f64::from(spoke), RADIUS);
            self.put(&format!("<line x1=\"{x}\" y1=\"{y}\" x2=\"{to_x:.1}\" y2=\"{to_y:.1}\"/>"));
        }
        self.put("</g>");
        for &spoke in &spokes {
            let (to_x, to_y) = self.place(f64::from(spoke), RADIUS + 14.0);
            let anchor = match spoke {
                0 | 180 => "middle",
                spoke if spoke < 0 => "end",
                _ => "start",
            };
            self.put(&format!(
                "<text x=\"{to_x:.1}\" y=\"{:.1}\" text-anchor=\"{anchor}\">{}°</text>",
                to_y + 4.5,
                spoke.abs()
            ));
        }
    }

    fn draw_curves(&mut self, curves: &[Vec<f64>; 2]) {
        let pixels = RADIUS / (self.step * f64::from(self.rings));
        for (curve, (_, _, look)) in curves.iter().zip(PLANES) {
            let points: Vec<String> = HALVES
                .zip(curve)
                .filter(|(half, _)| self.upwards || (-180..=180).contains(half))
                .map(|(half, value)| {
                    let (x, y) = self.place(0.5 * f64::from(half), pixels * value);
                    format!("{x:.1},{y:.1}")
                })
                .collect();
            let shape = if self.upwards { "polygon" } else { "polyline" };
            self.put(&format!("<{shape} fill=\"none\" {look} points=\"{}\"/>", points.join(" ")));
        }
    }

    /// The intensities of the rings, along 15°, between spokes, above the curves.
    fn draw_labels(&mut self) {
        for (ring, r) in self.radii() {
            let (label_x, label_y) = self.place(15.0, r);
            // A white edge around the digits, drawn first.
            for edge in [" stroke=\"#FFFFFF\" stroke-width=\"4\"", ""] {
                self.put(&format!(
                    "<text x=\"{label_x:.1}\" y=\"{:.1}\" text-anchor=\"middle\"{edge}>{}</text>",
                    label_y + 4.5,
                    plain(self.step * f64::from(ring))
                ));
            }
        }
    }

    fn draw_legend(&mut self, unit: &str) {
        for (number, (c, name, look)) in PLANES.into_iter().enumerate() {
            let middle = self.bottom() + 20.0 * number as f64;
            self.put(&format!("<line x1=\"76\" y1=\"{middle}\" x2=\"116\" y2=\"{middle}\" {look}/>"));
            let side = format!("C{} to the right, C{} to the left", c, c + 180.0);
            self.put(&format!(
                "<text x=\"126\" y=\"{:.1}\" font-size=\"14\">{name} [{unit}]; {side}</text>",
                middle + 5.0
            ));
        }
    }
}

/// The step between rings, 1, 2 or 5 times a power of 10, and their number, at most 6.
fn rings(largest: f64) -> (f64, u32) {
    let rough = largest / 6.0;
    let decade = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|m| m * decade)
        .find(|step| largest / step <= 6.0)
        .unwrap_or(largest);
    (step, (largest / step).ceil().max(1.0) as u32)
}

fn escaped(text: &str) -> String {
    let known = |c: char| match c {
        '&' => "&amp;".into(),
        '<' => "&lt;".into(),
        '>' => "&gt;".into(),
        '"' => "&quot;".into(),
        c if c.is_control() => " ".into(),
        c => c.to_string(),
    };
    text.chars().map(known).collect()
}
