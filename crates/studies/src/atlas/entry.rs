//! What an entry of the atlas says.

use report::Chart;
use serde::Serialize;
use stats::Measured;

use super::lab::Lab;
use crate::numbers::{figure, pm};

/// One way in which a method fails.
pub struct Entry {
    /// Names it on the command line and its chart.
    pub name: &'static str,
    /// A sentence.
    pub title: &'static str,
    /// Drives the method there.
    pub study: fn(&Lab) -> Result<Finding, Failure>,
}

/// What keeps an entry from being studied.
pub type Failure = Box<dyn std::error::Error + Send + Sync>;

/// What became of it.
pub struct Finding {
    /// What theory says will happen, and who says so.
    pub predicted: String,
    /// What happened, with standard errors.
    pub seen: String,
    /// What the program told its user, word by word.
    pub told: Vec<String>,
    /// What to do instead, and what that gave.
    pub instead: String,
    /// What has to hold of all this.
    pub claims: Vec<Claim>,
    /// The sweep.
    pub chart: Chart,
}

/// Something that has to hold.
#[derive(Clone, Debug, Serialize)]
pub struct Claim {
    /// What, with the numbers.
    pub what: String,
    /// Whether it does.
    pub holds: bool,
    /// With which probability it does not although theory is right, for seeds drawn at random; 0 of what chance has no
    /// part in.
    pub false_alarm: f64,
    /// Whether it is of what to do instead.
    pub remedy: bool,
}

/// Standard errors that measurements may be off by, and how often chance alone takes them further: by Student's t of 19
/// degrees of freedom, since no measurement here is of fewer than 20 runs.
const ALLOWED: f64 = 7.0;
const FALSE_ALARM: f64 = 1.2e-6;

/// Standard errors by which something is clearly below a bound.
const CLEARLY: f64 = 5.0;

/// Where chance has no part, weights in fixed point are still rounded.
const ROUNDING: f64 = 1e-9;

impl Claim {
    /// Something that chance has no part in.
    pub fn sure(what: impl Into<String>, holds: bool) -> Self {
        Claim { what: what.into(), holds, false_alarm: 0.0, remedy: false }
    }

    /// A measurement has the value that theory gives it.
    pub fn equal(what: &str, measured: Measured, expected: f64) -> Self {
        let allowed = ALLOWED * measured.standard_error + ROUNDING * expected.abs();
        let holds = (measured.value - expected).abs() <= allowed;
        let what = format!("{what}: {}, expected {}", pm(measured), figure(expected));
        Claim { what, holds, false_alarm: FALSE_ALARM, remedy: false }
    }

    /// The one that is furthest off among so many measurements, each the mean over so many runs, has the value that theory
    /// gives all of them (Bonferroni, Student's t).
    pub fn equal_among(
        what: &str,
        measured: Measured,
        expected: f64,
        measurements: usize,
        runs: u64,
    ) -> Self {
        let level = 1.0 - 0.5 * FALSE_ALARM / measurements as f64;
        let allowed = stats::student_quantile(level, runs - 1) * measured.standard_error;
        let holds = (measured.value - expected).abs() <= allowed + ROUNDING * expected.abs();
        Claim { holds, ..Claim::equal(what, measured, expected) }
    }

    /// A measurement is not below a bound, but for chance.
    pub fn at_least(what: &str, measured: Measured, bound: f64) -> Self {
        let holds = measured.value >= bound || measured.z(bound) > -ALLOWED;
        let what = format!("{what}: {}, at least {}", pm(measured), figure(bound));
        Claim { what, holds, false_alarm: 0.5 * FALSE_ALARM, remedy: false }
    }

    /// A measurement is below a bound, beyond chance.
    pub fn below(what: &str, measured: Measured, bound: f64) -> Self {
        let holds = measured.z(bound) < -CLEARLY;
        Claim::sure(format!("{what}: {}, clearly below {}", pm(measured), figure(bound)), holds)
    }

    /// The same, of what to do instead.
    pub fn instead(self) -> Self {
        Claim { remedy: true, ..self }
    }

    /// The program says a word of it.
    pub fn told(told: &[String], word: &str) -> Self {
        let holds = told.iter().any(|line| line.contains(word));
        Claim::sure(format!("the program says “{word}”"), holds)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn claims_allow_for_chance_only() {
        let measured = Measured { value: 1.0, standard_error: 0.1 };
        assert!(stats::student_quantile(1.0 - 0.5 * FALSE_ALARM, 19) <= ALLOWED);
        assert!(Claim::equal("", measured, 1.6).holds && !Claim::equal("", measured, 1.8).holds);
        let certain = Measured { value: 1.0, standard_error: 0.0 };
        assert!(Claim::equal("", certain, 1.0 + 1e-10).holds && !Claim::equal("", certain, 1.0 + 1e-8).holds);
        // Student's t of 19 degrees of freedom at 1 − 2·10⁻⁸ is 8.80.
        let among = |expected| Claim::equal_among("", measured, expected, 30, 20).holds;
        assert!(among(1.87) && !among(1.89));
        assert!(Claim::below("", measured, 1.6).holds && !Claim::below("", measured, 1.4).holds);
        assert!(Claim::at_least("", measured, 1.6).holds && !Claim::at_least("", measured, 1.8).holds);
    }
}
