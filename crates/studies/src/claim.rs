//! What a study holds to theory, and how that is judged.

use stats::Measured;

use crate::numbers::{measured, number};

/// What a measurement is held to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    /// It is this, but for chance.
    Is(f64),
    /// It is no more than this, but for chance.
    AtMost(f64),
    /// It is no less than this, but for chance.
    AtLeast(f64),
    /// It lies between both, but for chance.
    Between(f64, f64),
    /// It is below this, beyond chance.
    ClearlyBelow(f64),
    /// Theory says this, only nearly: nothing is judged.
    About(f64),
    /// Nothing.
    Nothing,
}

/// What has to hold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Test {
    /// A statement that chance has no part in, and whether it holds.
    Sure(bool),
    /// A measurement that is held to a bound. A standard error of 0 leaves nothing to chance.
    Measured(Measured, Bound),
    /// The one that is furthest off among several measurements, all of which are this number: it may be off by the given
    /// number of standard errors.
    Furthest(Measured, f64, Limit),
}

/// A number of standard errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limit(f64);

/// Something that a study holds to theory, or shows beside it.
#[derive(Clone, Debug, PartialEq)]
pub struct Claim {
    /// What it is of.
    pub label: String,
    /// What has to hold.
    pub test: Test,
    /// What was measured when it was published.
    pub published: Option<f64>,
    /// Whether it is of what to do instead.
    pub remedy: bool,
}

/// What becomes of a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// It holds.
    Agrees,
    /// It does not, and not by chance.
    Differs,
    /// Nothing was claimed.
    Shown,
}

/// Judges claims by standard errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judge {
    /// The standard errors that a measurement may be off by.
    pub limit: f64,
    /// The probability that a two-sided claim fails although it is true, for seeds drawn at random.
    pub false_alarm: f64,
    /// The part of what is expected that a measurement may be off by beside chance: scores in fixed point are rounded.
    rounding: f64,
}

/// The standard errors by which something is clearly below a bound.
const CLEARLY: f64 = 5.0;

impl Judge {
    /// One limit for all of a number of independent claims, so that any of them fails by chance with the probability
    /// `false_alarm` (Šidák 1967): each may fail with 1 − (1 − p)^(1/m). Dependent claims fail less often, as do those
    /// whose standard errors are better known than by `runs` runs (Student's t).
    pub fn of_all(false_alarm: f64, claims: usize, runs: usize) -> Self {
        let each = -((-false_alarm).ln_1p() / claims.max(1) as f64).exp_m1();
        let limit = stats::student_quantile(1.0 - 0.5 * each, runs as u64 - 1);
        Judge { limit, false_alarm: each, rounding: 0.0 }
    }

    /// One limit for every claim: seven standard errors, which Student's t of 19 degrees of freedom exceeds with the
    /// probability 1.2·10⁻⁶. So no measurement may be of fewer than 20 runs.
    pub const EACH: Judge = Judge { limit: 7.0, false_alarm: 1.2e-6, rounding: 1e-9 };

    /// How a claim does.
    pub fn verdict(self, claim: &Claim) -> Verdict {
        let (ours, bound, limit) = match claim.test {
            Test::Sure(holds) => return if holds { Verdict::Agrees } else { Verdict::Differs },
            Test::Measured(ours, bound) => (ours, bound, self.limit),
            Test::Furthest(ours, expected, Limit(limit)) => (ours, Bound::Is(expected), limit),
        };
        let Measured { value, standard_error } = ours;
        let slack = limit * standard_error;
        let agrees = match bound {
            Bound::Is(expected) => (value - expected).abs() <= slack + self.rounding * expected.abs(),
            Bound::AtMost(most) => value <= most + slack,
            Bound::AtLeast(least) => value >= least - slack,
            Bound::Between(low, high) => value >= low - slack && value <= high + slack,
            Bound::ClearlyBelow(bound) => ours.z(bound) < -CLEARLY,
            Bound::About(_) | Bound::Nothing => return Verdict::Shown,
        };
        if agrees { Verdict::Agrees } else { Verdict::Differs }
    }

    /// Whether nothing is wrong with a claim.
    pub fn passes(self, claim: &Claim) -> bool {
        self.verdict(claim) != Verdict::Differs
    }

    /// The probability that a claim fails by chance alone; 0 where chance has no part, or where it would have to be
    /// against what is claimed by more than [`CLEARLY`].
    pub fn false_alarm(self, claim: &Claim) -> f64 {
        match claim.test {
            Test::Measured(_, Bound::Is(_) | Bound::Between(..)) | Test::Furthest(..) => self.false_alarm,
            Test::Measured(_, Bound::AtMost(_) | Bound::AtLeast(_)) => 0.5 * self.false_alarm,
            Test::Measured(..) | Test::Sure(_) => 0.0,
        }
    }
}

impl Claim {
    fn new(label: impl Into<String>, test: Test) -> Self {
        Claim { label: label.into(), test, published: None, remedy: false }
    }

    /// A measurement that is held to a bound.
    pub fn of(label: impl Into<String>, ours: Measured, bound: Bound) -> Self {
        Claim::new(label, Test::Measured(ours, bound))
    }

    /// A statement that chance has no part in.
    pub fn sure(label: impl Into<String>, holds: bool) -> Self {
        Claim::new(label, Test::Sure(holds))
    }

    /// The measurement that is furthest off among `measurements`, each the mean over `runs` runs, all of which are
    /// `expected`: judged as one of them by [`Judge::EACH`] (Bonferroni, Student's t).
    pub fn furthest(
        label: impl Into<String>,
        ours: Measured,
        expected: f64,
        measurements: usize,
        runs: u64,
    ) -> Self {
        let level = 1.0 - 0.5 * Judge::EACH.false_alarm / measurements as f64;
        Claim::new(label, Test::Furthest(ours, expected, Limit(stats::student_quantile(level, runs - 1))))
    }

    /// A measurement that is this number.
    pub fn equal(label: impl Into<String>, ours: Measured, expected: f64) -> Self {
        Claim::of(label, ours, Bound::Is(expected))
    }

    /// A measurement that is not below a bound.
    pub fn at_least(label: impl Into<String>, ours: Measured, least: f64) -> Self {
        Claim::of(label, ours, Bound::AtLeast(least))
    }

    /// A measurement that is below a bound, beyond chance.
    pub fn below(label: impl Into<String>, ours: Measured, bound: f64) -> Self {
        Claim::of(label, ours, Bound::ClearlyBelow(bound))
    }

    /// That the program says a word.
    pub fn told(told: &[String], word: &str) -> Self {
        let holds = told.iter().any(|line| line.contains(word));
        Claim::sure(format!("the program says “{word}”"), holds)
    }

    /// The claim with what was published.
    pub fn published(self, published: f64) -> Self {
        Claim { published: Some(published), ..self }
    }

    /// The claim as one of what to do instead.
    pub fn instead(self) -> Self {
        Claim { remedy: true, ..self }
    }

    /// Whether a verdict is asked for.
    pub fn is_judged(&self) -> bool {
        !matches!(self.test, Test::Measured(_, Bound::About(_) | Bound::Nothing))
    }

    /// What was measured, where something was.
    pub fn ours(&self) -> Option<Measured> {
        match self.test {
            Test::Measured(ours, _) | Test::Furthest(ours, ..) => Some(ours),
            Test::Sure(_) => None,
        }
    }

    /// What the measurement is held to.
    pub fn bound(&self) -> Bound {
        match self.test {
            Test::Measured(_, bound) => bound,
            Test::Furthest(_, expected, _) => Bound::Is(expected),
            Test::Sure(_) => Bound::Nothing,
        }
    }

    /// Standard errors from what is claimed, where that is one number and chance has a part.
    pub fn z(&self) -> Option<f64> {
        let ours = self.ours().filter(|ours| ours.standard_error > 0.0)?;
        match self.bound() {
            Bound::Is(expected) | Bound::About(expected) => Some(ours.z(expected)),
            _ => None,
        }
    }

    /// The measurement over what is claimed, where that is one number.
    pub fn ratio(&self) -> Option<f64> {
        match self.bound() {
            Bound::Is(x)
            | Bound::AtMost(x)
            | Bound::AtLeast(x)
            | Bound::ClearlyBelow(x)
            | Bound::About(x) => Some(self.ours()?.value / x),
            Bound::Between(..) | Bound::Nothing => None,
        }
    }

    /// The claim in words, with its numbers.
    pub fn sentence(&self) -> String {
        let Some(ours) = self.ours() else { return self.label.clone() };
        let bound = match self.bound() {
            Bound::Is(x) => format!(", expected {}", number(x)),
            Bound::AtMost(x) => format!(", at most {}", number(x)),
            Bound::AtLeast(x) => format!(", at least {}", number(x)),
            Bound::Between(low, high) => format!(", between {} and {}", number(low), number(high)),
            Bound::ClearlyBelow(x) => format!(", clearly below {}", number(x)),
            Bound::About(x) => format!(", about {}", number(x)),
            Bound::Nothing => String::new(),
        };
        format!("{}: {}{bound}", self.label, measured(ours))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ABOUT_ONE: Measured = Measured { value: 1.0, standard_error: 0.1 };

    /// Student's t of 99 degrees of freedom (tabulated: 1.9842 at 5 %, two-sided).
    #[test]
    fn a_single_claim_at_five_percent_is_judged_at_1_98() {
        assert!((Judge::of_all(0.05, 1, 100).limit - 1.9842).abs() < 1e-4);
    }

    #[test]
    fn many_claims_are_judged_more_mildly_so_that_all_hold_together() {
        let judge = Judge::of_all(1e-3, 100, 100);
        // The normal deviate of 10⁻⁵, two-sided, is 4.417; that of t is a little more.
        assert!((4.417..4.8).contains(&judge.limit), "{judge:?}");
    }

    #[test]
    fn verdicts_know_their_side() {
        let judge = Judge { limit: 4.0, ..Judge::EACH };
        let verdict = |bound| judge.verdict(&Claim::of("", ABOUT_ONE, bound));
        assert_eq!(verdict(Bound::Is(1.39)), Verdict::Agrees);
        assert_eq!(verdict(Bound::Is(1.41)), Verdict::Differs);
        assert_eq!(verdict(Bound::AtMost(0.59)), Verdict::Differs);
        assert_eq!(verdict(Bound::AtMost(0.61)), Verdict::Agrees);
        assert_eq!(verdict(Bound::AtLeast(1.41)), Verdict::Differs);
        assert_eq!(verdict(Bound::Between(1.41, 2.0)), Verdict::Differs);
        assert_eq!(verdict(Bound::ClearlyBelow(1.49)), Verdict::Differs);
        assert_eq!(verdict(Bound::ClearlyBelow(1.51)), Verdict::Agrees);
        assert_eq!(verdict(Bound::About(9.0)), Verdict::Shown);
        assert_eq!(Claim::of("", ABOUT_ONE, Bound::About(2.0)).ratio(), Some(0.5));
    }

    #[test]
    fn claims_allow_for_chance_only() {
        let Judge { limit, false_alarm, .. } = Judge::EACH;
        assert!(stats::student_quantile(1.0 - 0.5 * false_alarm, 19) <= limit);
        let holds = |ours, expected| Judge::EACH.passes(&Claim::of("", ours, Bound::Is(expected)));
        assert!(holds(ABOUT_ONE, 1.6) && !holds(ABOUT_ONE, 1.8));
        let certain = Measured { value: 1.0, standard_error: 0.0 };
        assert!(holds(certain, 1.0 + 1e-10) && !holds(certain, 1.0 + 1e-8));
        // Student's t of 19 degrees of freedom at 1 − 2·10⁻⁸ is 8.80.
        let among = |expected| Judge::EACH.passes(&Claim::furthest("", ABOUT_ONE, expected, 30, 20));
        assert!(among(1.87) && !among(1.89));
        assert!(!Judge::EACH.passes(&Claim::sure("", false)));
    }
}
