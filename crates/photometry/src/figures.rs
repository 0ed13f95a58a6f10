//! What a luminaire is, in figures and in words.

use glam::DVec3;
use serde_json::{Value, json};

use crate::arithmetic::angle;
use crate::{LampSet, Luminaire, LuminousOpening};

/// Samples of a plane in a degree.
const FINE: i32 = 20;

/// Files in which luminaires give more than this many times the flux of their lamps have a placeholder for it, mostly 1 lm.
const MOST_RATIO: f64 = 10.0;

/// Angles in a vertical plane, around its brightest direction [°].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BeamAngles {
    /// Over which the intensity is at least half of the plane's largest; `None` where it is all around.
    pub beam: Option<f64>,
    /// Over which it is at least a tenth of that.
    pub field: Option<f64>,
}

impl Luminaire {
    /// The intensity [cd] in the vertical plane through azimuth `c` and its opposite, at an angle from straight down towards `c` [°].
    pub(crate) fn in_plane(&self, c: f64, from_nadir: f64) -> f64 {
        let ((sin_c, cos_c), (sine, cosine)) = (c.to_radians().sin_cos(), from_nadir.to_radians().sin_cos());
        self.distribution.intensity(DVec3::new(sine * cos_c, sine * sin_c, -cosine))
    }

    /// Beam and field angle in the vertical plane through azimuth `c` [°].
    pub fn beam(&self, c: f64) -> BeamAngles {
        let circle = 360 * FINE;
        let plane: Vec<f64> = (0..circle).map(|k| self.in_plane(c, f64::from(k) / f64::from(FINE))).collect();
        let value = |k: i32| plane[k.rem_euclid(circle) as usize];
        let mut top = 0;
        for k in 0..circle {
            if value(k) > value(top) {
                top = k;
            }
        }
        let width = |part: f64| {
            let least = part * value(top);
            // The place where the intensity falls below it, between two samples.
            let side = |sign: i32| {
                let out = (1..circle).find(|k| value(top + sign * k) < least)?;
                let (inner, outer) = (value(top + sign * (out - 1)), value(top + sign * out));
                Some(f64::from(out - 1) + (inner - least) / (inner - outer))
            };
            let samples = side(1)? + side(-1)?;
            (least > 0.0).then_some(samples / f64::from(FINE))
        };
        BeamAngles { beam: width(0.5), field: width(0.1) }
    }

    /// The brightest direction of the table, as C and γ [°], and its intensity [cd].
    pub fn brightest(&self) -> [f64; 3] {
        let (d, candela) = self.distribution.brightest();
        let c = if d.x * d.x + d.y * d.y > 1e-20 { angle(d.y, d.x).rem_euclid(360.0) } else { 0.0 };
        [c, angle((d.x * d.x + d.y * d.y).sqrt(), -d.z), candela]
    }

    /// What is in the file, line by line.
    pub fn lines(&self) -> Vec<String> {
        let optional = |text: Option<String>| text.unwrap_or_default();
        let mut facts = vec![
            ("format", self.format.clone()),
            ("luminaire", self.name.clone()),
            ("manufacturer", self.manufacturer.clone()),
            ("catalogue", self.catalogue.clone()),
        ];
        let lamps = self.lamps.iter().enumerate();
        facts.extend(lamps.map(|(index, set)| ("lamps", set.words(index > 0))));
        facts.extend([
            ("input", optional(self.watts.map(|watts| format!("{} W", plain(watts))))),
            ("flux", self.flux_in_words()),
            ("efficacy", optional(self.efficacy().map(|efficacy| format!("{} lm/W", plain(efficacy))))),
        ]);
        let [c, gamma, candela] = self.brightest();
        facts.push(("brightest", format!("{} cd at C {}°, γ {}°", plain(candela), plain(c), plain(gamma))));
        for (c, planes) in [(0.0, "C0–C180"), (90.0, "C90–C270")] {
            let BeamAngles { beam, field } = self.beam(c);
            let [beam, field] =
                [beam, field].map(|angle| angle.map_or("all around".into(), |angle| format!("{angle:.1}°")));
            let text =
                format!("{planes}: {beam} at half of the plane's largest intensity, {field} at a tenth");
            facts.push(("beam angle", text));
        }
        let [planes, angles] = self.measured;
        let dark = match self.distribution.heights() {
            Some([0.0, 180.0]) | None => String::new(),
            Some([least, most]) => format!("; dark outside γ {}–{}°", plain(least), plain(most)),
        };
        let tilt = self.tilt.as_ref().map(|tilt| {
            let [first, last] = [tilt.angles[0], tilt.angles[tilt.angles.len() - 1]].map(plain);
            format!("factors for luminaires tilted by {first}–{last}° are in the file, and are not applied")
        });
        facts.extend([
            ("symmetry", self.symmetry.words().into()),
            ("table", format!("planes × angles: {planes} × {angles}{dark}")),
            ("opening", self.shape.words()),
            ("tilt", optional(tilt)),
        ]);
        let line = |(key, text): (&str, String)| format!("{key:<13} {text}");
        facts.into_iter().filter(|(_, text)| !text.is_empty()).map(line).collect()
    }

    /// The flux, and how it compares with that of the lamps.
    fn flux_in_words(&self) -> String {
        let flux = plain(self.distribution.flux());
        // In absolute photometry the stated ratio is of the luminaire's own flux.
        if let Some(lamps) = self.lamp_flux().filter(|lamps| self.distribution.flux() > MOST_RATIO * lamps) {
            let lamps = plain(lamps);
            return format!(
                "{flux} lm by the integral of the table; the {lamps} lm of the lamps stand for a number that the file does not have"
            );
        }
        let ratios = self.output_ratio().map_or_else(String::new, |ratio| {
            let stated =
                self.stated_ratio.map(|ratio| format!(" (the file says {} %)", plain(100.0 * ratio)));
            format!(", {:.1} % of the lamps' flux{}", 100.0 * ratio, stated.unwrap_or_default())
        });
        format!("{flux} lm by the integral of the table{ratios}")
    }

    /// What is in the file, as JSON; what it does not say is null.
    pub fn json(&self) -> Value {
        let lamps: Vec<Value> = self
            .lamps
            .iter()
            .map(|set| json!({ "number": set.number, "kind": set.kind, "flux": set.flux }))
            .collect();
        let [c, gamma, candela] = self.brightest();
        let beam = |c: f64| {
            let BeamAngles { beam, field } = self.beam(c);
            json!({ "beam": beam, "field": field })
        };
        let (shape, size) = self.shape.parts();
        json!({
            "format": self.format,
            "luminaire": self.name,
            "manufacturer": self.manufacturer,
            "catalogue": self.catalogue,
            "lamps": lamps,
            "watts": self.watts,
            "flux": self.distribution.flux(),
            "output_ratio": self.output_ratio(),
            "stated_ratio": self.stated_ratio,
            "efficacy": self.efficacy(),
            "brightest": { "c": c, "gamma": gamma, "candela": candela },
            "c0_c180": beam(0.0),
            "c90_c270": beam(90.0),
            "symmetry": self.symmetry.words(),
            "planes": self.measured[0],
            "angles": self.measured[1],
            "opening": { "shape": shape, "size": size },
            "tilt": self.tilt.is_some(),
        })
    }
}

impl LampSet {
    /// The lamps in words.
    fn words(&self, is_another_choice: bool) -> String {
        let flux = self.flux.map_or("flux not stated (absolute photometry)".into(), |flux| {
            format!("{} lm in all", plain(flux))
        });
        let kind = if self.kind.is_empty() { String::new() } else { format!(" × {}", self.kind) };
        let other = if is_another_choice { " (another choice of lamps, not used)" } else { "" };
        format!("{}{kind}, {flux}{other}", self.number)
    }
}

impl LuminousOpening {
    /// The kind of the shape, and its extents along x, y and z [m].
    fn parts(self) -> (&'static str, [f64; 3]) {
        match self {
            LuminousOpening::Point => ("point", [0.0; 3]),
            LuminousOpening::Rectangle { x, y } => ("rectangle", [x, y, 0.0]),
            LuminousOpening::Disc { x, y } => ("disc", [x, y, 0.0]),
            LuminousOpening::Box { size } => ("box", size),
            LuminousOpening::Cylinder { size, .. } => ("cylinder", size),
            LuminousOpening::Ellipsoid { size } => ("ellipsoid", size),
        }
    }

    /// The opening in words.
    fn words(self) -> String {
        let (kind, [x, y, z]) = self.parts();
        let [x, y, z] = [x, y, z].map(|metres| plain((metres * 1e4).round() / 1e4));
        match self {
            LuminousOpening::Point => kind.into(),
            LuminousOpening::Rectangle { .. } | LuminousOpening::Disc { .. } => {
                format!("{kind}, {x} m along C0–C180, {y} m along C90–C270")
            }
            _ => format!("{kind}, {x} m along C0–C180, {y} m along C90–C270, {z} m high"),
        }
    }
}

/// A number with five digits, without zeros at its end.
pub(crate) fn plain(x: f64) -> String {
    let digits = if x == 0.0 { 0 } else { (4 - x.abs().log10().floor() as i32).clamp(0, 9) as usize };
    let text = format!("{x:.digits$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    let (whole, rest) = text.split_at(text.find('.').unwrap_or(text.len()));
    let (sign, whole) = whole.strip_prefix('-').map_or(("", whole), |whole| ("-", whole));
    let mut grouped = String::new();
    for (index, digit) in whole.chars().enumerate() {
        if index > 0 && (whole.len() - index).is_multiple_of(3) {
            grouped.push(',');
        }
        grouped.push(digit);
    }
    format!("{sign}{grouped}{rest}")
}
