//! Discomfort glare at eyes: UGR = 8 log₁₀(0.25/L_b Σ L²ω/p²) (CIE 117:1995).
//!
//! L and ω are those of luminaires, exact as their light at a point is; p is Guth's index. The luminance of the background L_b = E_i/π is what
//! walks find, E_i the illuminance on a vertical plane at the eye without light that comes straight from luminaires. UGR falls with L_b, so that
//! limits of it are those of E_i.

use std::f64::consts::{LN_10, PI};

use photometry::position_index;
use serde::Serialize;

use super::planes::{Figure, ValueWithError};
use super::readings::{Reading, Readings};
use crate::geometry::face::Face;

/// Solid angles of luminaires that the formula was fitted to [sr] (CIE 117:1995).
const SOLID_ANGLES: std::ops::RangeInclusive<f64> = 0.0003..=0.1;

/// The reason why the unified glare rating does not apply at an eye.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Unexamined {
    /// The channels of light are no luminances.
    Colour,
    /// Faces emit: their light cannot be told from that of the background.
    EmittingFaces,
    /// A lamp without opening is seen, whose luminance has no bound; or a distant disc lights the scene.
    NoOpening,
    /// A luminaire is seen under less than 0.0003 sr, or more than 0.1 sr.
    SolidAngle,
    /// A luminaire is seen below the line of sight, where there is no position index.
    BelowSight,
    /// Nothing lights the background, or no walk has told of it.
    DarkBackground,
}

impl Unexamined {
    /// The reason in words.
    pub fn words(self) -> &'static str {
        match self {
            Unexamined::Colour => "the scene is in colour",
            Unexamined::EmittingFaces => "surfaces emit, whose light is no background",
            Unexamined::NoOpening => "a lamp without luminous opening is seen",
            Unexamined::SolidAngle => "a luminaire is seen under less than 0.0003 or more than 0.1 sr",
            Unexamined::BelowSight => "a luminaire is seen below the line of sight",
            Unexamined::DarkBackground => "the background is dark",
        }
    }
}

/// The unified glare rating at the eyes of a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glare {
    /// The largest of the eyes that are examined and see a luminaire; `None` where there are none.
    pub largest: Option<Figure>,
    /// The eyes that see no luminaire.
    pub undisturbed: usize,
    /// The eyes that are not examined.
    pub unexamined: usize,
    /// Why the first of these is not.
    pub because: Option<Unexamined>,
}

impl Readings<'_> {
    /// UGR at the eyes of plane number `plane` of [`crate::Sensors::planes`]; `None` where its points are no eyes.
    pub fn glare(&self, plane: usize) -> Option<Glare> {
        let sensor = self.sensors().planes().nth(plane).expect("a plane of the job");
        if !self.sensors().specs()[sensor].shape.is_eyes() {
            return None;
        }
        let (mut known, mut glare) =
            (Vec::new(), Glare { largest: None, undisturbed: 0, unexamined: 0, because: None });
        for cell in self.sensors().cells_of(sensor) {
            match self.rating(cell) {
                Ok(Some(rating)) => known.push(rating),
                Ok(None) => glare.undisturbed += 1,
                Err(because) => {
                    glare.unexamined += 1;
                    glare.because = glare.because.or(Some(because));
                }
            }
        }
        let correlation = self.correlation_of_points(plane, 0);
        glare.largest =
            (!known.is_empty()).then(|| self.extreme(known.into_iter(), correlation, -1.0).figure);
        Some(glare)
    }

    /// UGR at one eye; `None` where it sees no luminaire.
    fn rating(&self, cell: usize) -> Result<Option<ValueWithError>, Unexamined> {
        let scene = self.scene();
        if self.channels() > 1 {
            return Err(Unexamined::Colour);
        }
        if scene.faces().iter().any(|face: Face| face.emittance.is_lit()) {
            return Err(Unexamined::EmittingFaces);
        }
        let sum = self.glare_of_lamps(cell)?;
        if sum == 0.0 {
            return Ok(None);
        }
        let Reading { irradiance, std_error, ci_low, ci_high } = self.indirect(cell, 0);
        let background = irradiance.filter(|&e| e > 0.0).ok_or(Unexamined::DarkBackground)?;
        let rating = |e: f64| 8.0 * (0.25 * PI / e * sum).log10();
        let error = std_error.filter(|&error| error > 0.0).map_or(0.0, |_| self.sample_error(cell, 0));
        let error = 8.0 / LN_10 * error / background;
        Ok(Some(ValueWithError {
            value: rating(background),
            error,
            limits: [rating(ci_high), rating(ci_low)],
            unmet: 0.0,
        }))
    }

    /// Σ L²ω/p² of the luminaires that an eye sees, whose luminances are I over the area that is seen [cd²/m⁴ sr].
    fn glare_of_lamps(&self, cell: usize) -> Result<f64, Unexamined> {
        let sensors = self.sensors();
        let eye = sensors.cell(cell);
        let place = sensors.frame(&eye).point([0.0; 2]).into();
        let lamps = &self.scene().parts.lamps;
        // The light of a distant disc is not told from that of the background.
        if !(0..lamps.len()).all(|lamp| lamps.is_sharp(lamp)) {
            return Err(Unexamined::NoOpening);
        }
        let mut sum = 0.0;
        for (lamp, light) in self.lights_at(cell) {
            let seen = lamps.seen(lamp, place).ok_or(Unexamined::NoOpening)?;
            let cosine = eye.normal.dot(seen.towards);
            if light == [0.0; 3] || cosine <= 0.0 {
                continue;
            }
            let solid_angle = seen.area / (seen.distance * seen.distance);
            if seen.area == 0.0 {
                return Err(Unexamined::NoOpening);
            }
            if !SOLID_ANGLES.contains(&solid_angle) {
                return Err(Unexamined::SolidAngle);
            }
            let index = position_index(eye.normal, seen.towards).ok_or(Unexamined::BelowSight)?;
            // E = Lω cos θ.
            let luminance = light[0] / (cosine * solid_angle);
            sum += luminance * luminance * solid_angle / (index * index);
        }
        Ok(sum)
    }
}
