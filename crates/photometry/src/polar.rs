//! The polar curve of a luminaire as SVG, in the style of the project's charts: lines differ in their dashes.

use std::f64::consts::PI;
use std::fmt::Write;

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

impl Luminaire {
    /// The intensities in the planes C0–C180 and C90–C270 over the angle from straight down, with rings in cd/klm of the lamps, or in cd in
    /// absolute photometry.
    pub fn polar_svg(&self) -> String {
        let (unit, scale) = self.lamp_flux().map_or(("cd", 1.0), |flux| ("cd/klm", 1000.0 / flux));
        let curves = PLANES.map(|(c, ..)| -> Vec<f64> {
            (-360..360).map(|half| scale * self.in_plane(c, 0.5 * f64::from(half))).collect()
        });
        let largest = curves.iter().flatten().fold(0.0_f64, |most, value| most.max(*value));
        // A lamp that lies between the planes may be dark in both.
        let largest = if largest > 0.0 { largest } else { scale * self.brightest()[2] };
        let (step, rings) = rings(largest);
        let pixels = RADIUS / (step * f64::from(rings));
        let upwards = curves
            .iter()
            .any(|curve| curve.iter().enumerate().any(|(k, v)| !(180..=540).contains(&k) && *v > 0.0));
        let (x, y) = (WIDTH / 2.0, if upwards { 60.0 + RADIUS } else { 76.0 });
        let bottom = y + RADIUS + 44.0;
        let height = bottom + 38.0;
        let place = |from_nadir: f64, radius: f64| {
            let (sine, cosine) = (from_nadir * PI / 180.0).sin_cos();
            (x + radius * sine, y + radius * cosine)
        };

        let mut svg = String::new();
        let mut draw = |text: String| {
            let _ = writeln!(svg, "{text}");
        };
        draw(format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{height}\" viewBox=\"0 0 {WIDTH} {height}\" font-family=\"sans-serif\" font-size=\"13\">"
        ));
        draw(format!("<rect width=\"{WIDTH}\" height=\"{height}\" fill=\"#FFFFFF\"/>"));
        draw(format!(
            "<text x=\"{x}\" y=\"28\" font-size=\"17\" text-anchor=\"middle\">{}</text>",
            escaped(&self.title())
        ));
        draw("<g fill=\"none\" stroke=\"#E1E1E1\">".into());
        for ring in 1..=rings {
            let r = RADIUS * f64::from(ring) / f64::from(rings);
            draw(if upwards {
                format!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{r:.1}\"/>")
            } else {
                format!("<path d=\"M{:.1} {y} A{r:.1} {r:.1} 0 0 0 {:.1} {y}\"/>", x - r, x + r)
            });
        }
        let most = if upwards { 180 } else { 90 };
        let spokes: Vec<i32> = (-most..=most).step_by(30).filter(|a| *a > -180).collect();
        for &spoke in &spokes {
            let (to_x, to_y) = place(f64::from(spoke), RADIUS);
            draw(format!("<line x1=\"{x}\" y1=\"{y}\" x2=\"{to_x:.1}\" y2=\"{to_y:.1}\"/>"));
        }
        draw("</g>".into());
        for &spoke in &spokes {
            let (to_x, to_y) = place(f64::from(spoke), RADIUS + 14.0);
            let anchor = match spoke {
                0 | 180 => "middle",
                spoke if spoke < 0 => "end",
                _ => "start",
            };
            draw(format!(
                "<text x=\"{to_x:.1}\" y=\"{:.1}\" text-anchor=\"{anchor}\">{}°</text>",
                to_y + 4.5,
                spoke.abs()
            ));
        }
        for (curve, (_, _, look)) in curves.iter().zip(PLANES) {
            let points: Vec<String> = (-360..360)
                .zip(curve)
                .filter(|(half, _)| upwards || (-180..=180).contains(half))
                .map(|(half, value)| {
                    let (x, y) = place(0.5 * f64::from(half), pixels * value);
                    format!("{x:.1},{y:.1}")
                })
                .collect();
            let shape = if upwards { "polygon" } else { "polyline" };
            draw(format!("<{shape} fill=\"none\" {look} points=\"{}\"/>", points.join(" ")));
        }
        // Rings are labelled along 15°, between spokes, above the curves.
        for ring in 1..=rings {
            let r = RADIUS * f64::from(ring) / f64::from(rings);
            let (label_x, label_y) = place(15.0, r);
            // A white edge around the digits, drawn first.
            for edge in [" stroke=\"#FFFFFF\" stroke-width=\"4\"", ""] {
                draw(format!(
                    "<text x=\"{label_x:.1}\" y=\"{:.1}\" text-anchor=\"middle\"{edge}>{}</text>",
                    label_y + 4.5,
                    plain(step * f64::from(ring))
                ));
            }
        }
        for (number, (c, name, look)) in PLANES.into_iter().enumerate() {
            let middle = bottom + 20.0 * number as f64;
            draw(format!("<line x1=\"76\" y1=\"{middle}\" x2=\"116\" y2=\"{middle}\" {look}/>"));
            let side = format!("C{} to the right, C{} to the left", c, c + 180.0);
            draw(format!(
                "<text x=\"126\" y=\"{:.1}\" font-size=\"14\">{name} [{unit}]; {side}</text>",
                middle + 5.0
            ));
        }
        draw("</svg>".into());
        svg
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
