//! Claims of studies, and their verdicts.

use stats::Measured;

use report::words::{measured, number};

/// The bound that a measurement is held to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ClaimBound {
    /// The measurement is this number, but for chance.
    Is(f64),
    /// The measurement is at most this number, but for chance.
    AtMost(f64),
    /// The measurement is at least this number, but for chance.
    AtLeast(f64),
    /// The measurement lies between both numbers, but for chance.
    Between(f64, f64),
    /// The measurement is below this number, beyond chance.
    ClearlyBelow(f64),
    /// Theory gives this number only approximately: the claim is not judged.
    About(f64),
    /// The measurement is held to nothing.
    Nothing,
}

/// The test of a claim.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Test {
    /// A statement without statistical error, and whether it holds.
    Sure(bool),
    /// A measurement with its bound. A standard error of 0 leaves nothing to chance.
    Measured(Measured, ClaimBound),
    /// The measurement that is furthest off among several, all of which should be this number: it may be off by the
    /// given number of standard errors.
    Furthest(Measured, f64, Limit),
}

/// A limit as a number of standard errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limit(f64);

/// A claim: a result that a study holds to theory, or shows beside it.
#[derive(Clone, Debug, PartialEq)]
pub struct Claim {
    /// The subject of the claim.
    pub label: String,
    /// The test that the claim must pass.
    pub test: Test,
    /// The measurement that was published.
    pub published: Option<f64>,
    /// Whether the claim is about the remedy.
    pub remedy: bool,
}

/// The verdict on a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClaimVerdict {
    /// The claim holds within its limit.
    Agrees,
    /// The claim does not hold, and not by chance.
    Differs,
    /// The claim is only shown, not judged.
    Shown,
}

/// The judge of claims, by standard errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClaimJudge {
    /// The standard errors that a measurement may be off by.
    pub limit: f64,
    /// The probability that a true two-sided claim fails, for seeds drawn at random.
    pub false_alarm: f64,
    /// The part of its expectation that a measurement may be off by beside chance: scores in fixed point are rounded.
    rounding: f64,
}

/// The standard errors by which a measurement must be below a bound to be clearly below.
const CLEARLY: f64 = 5.0;

impl ClaimJudge {
    /// One limit for a number of independent claims, so that any of them fails by chance with the probability
    /// `false_alarm` (Šidák 1967): each may fail with 1 − (1 − p)^(1/m). Dependent claims fail less often, as do those
    /// whose standard errors are known better than by `runs` runs (Student's t).
    pub fn of_all(false_alarm: f64, claims: usize, runs: usize) -> Self {
        let each = -((-false_alarm).ln_1p() / claims.max(1) as f64).exp_m1();
        let limit = stats::student_quantile(1.0 - 0.5 * each, runs as u64 - 1);
        ClaimJudge { limit, false_alarm: each, rounding: 0.0 }
    }

    /// One limit for every claim: seven standard errors, which Student's t of 19 degrees of freedom exceeds with the
    /// probability 1.2·10⁻⁶. So no measurement may be of fewer than 20 runs.
    pub const EACH: ClaimJudge = ClaimJudge { limit: 7.0, false_alarm: 1.2e-6, rounding: 1e-9 };

    /// The verdict on a claim.
    pub fn verdict(self, claim: &Claim) -> ClaimVerdict {
        let (ours, bound, limit) = match claim.test {
            Test::Sure(holds) => return if holds { ClaimVerdict::Agrees } else { ClaimVerdict::Differs },
            Test::Measured(ours, bound) => (ours, bound, self.limit),
            Test::Furthest(ours, expected, Limit(limit)) => (ours, ClaimBound::Is(expected), limit),
        };
        let Measured { value, standard_error } = ours;
        let slack = limit * standard_error;
        let agrees = match bound {
            ClaimBound::Is(expected) => (value - expected).abs() <= slack + self.rounding * expected.abs(),
            ClaimBound::AtMost(most) => value <= most + slack,
            ClaimBound::AtLeast(least) => value >= least - slack,
            ClaimBound::Between(low, high) => value >= low - slack && value <= high + slack,
            ClaimBound::ClearlyBelow(bound) => ours.z(bound) < -CLEARLY,
            ClaimBound::About(_) | ClaimBound::Nothing => return ClaimVerdict::Shown,
        };
        if agrees { ClaimVerdict::Agrees } else { ClaimVerdict::Differs }
    }

    /// Whether a claim agrees or is only shown.
    pub fn passes(self, claim: &Claim) -> bool {
        self.verdict(claim) != ClaimVerdict::Differs
    }

    /// The probability that a claim fails by chance alone; 0 if chance has no part, or if the measurement would have to
    /// be off by more than [`CLEARLY`] to fail.
    pub fn false_alarm(self, claim: &Claim) -> f64 {
        match claim.test {
            Test::Measured(_, ClaimBound::Is(_) | ClaimBound::Between(..)) | Test::Furthest(..) => {
                self.false_alarm
            }
            Test::Measured(_, ClaimBound::AtMost(_) | ClaimBound::AtLeast(_)) => 0.5 * self.false_alarm,
            Test::Measured(..) | Test::Sure(_) => 0.0,
        }
    }
}

impl Claim {
    fn new(label: impl Into<String>, test: Test) -> Self {
        Claim { label: label.into(), test, published: None, remedy: false }
    }

    /// A claim that a measurement keeps a bound.
    pub fn of(label: impl Into<String>, ours: Measured, bound: ClaimBound) -> Self {
        Claim::new(label, Test::Measured(ours, bound))
    }

    /// A claim without statistical error.
    pub fn sure(label: impl Into<String>, holds: bool) -> Self {
        Claim::new(label, Test::Sure(holds))
    }

    /// A claim on the measurement that is furthest off among `measurements`, each the mean over `runs` runs, all of
    /// which should be `expected`: judged as one of them by [`ClaimJudge::EACH`] (Bonferroni, Student's t).
    pub fn furthest(
        label: impl Into<String>,
        ours: Measured,
        expected: f64,
        measurements: usize,
        runs: u64,
    ) -> Self {
        let level = 1.0 - 0.5 * ClaimJudge::EACH.false_alarm / measurements as f64;
        Claim::new(label, Test::Furthest(ours, expected, Limit(stats::student_quantile(level, runs - 1))))
    }

    /// A claim that a measurement is this number.
    pub fn equal(label: impl Into<String>, ours: Measured, expected: f64) -> Self {
        Claim::of(label, ours, ClaimBound::Is(expected))
    }

    /// A claim that a measurement is not below a bound.
    pub fn at_least(label: impl Into<String>, ours: Measured, least: f64) -> Self {
        Claim::of(label, ours, ClaimBound::AtLeast(least))
    }

    /// A claim that a measurement is below a bound, beyond chance.
    pub fn below(label: impl Into<String>, ours: Measured, bound: f64) -> Self {
        Claim::of(label, ours, ClaimBound::ClearlyBelow(bound))
    }

    /// A claim that the program's words hold a word.
    pub fn messages(messages: &[String], word: &str) -> Self {
        let holds = messages.iter().any(|line| line.contains(word));
        Claim::sure(format!("the program says “{word}”"), holds)
    }

    /// The claim with the published measurement.
    pub fn published(self, published: f64) -> Self {
        Claim { published: Some(published), ..self }
    }

    /// The claim as one about the remedy.
    pub fn instead(self) -> Self {
        Claim { remedy: true, ..self }
    }

    /// Whether the claim is judged.
    pub fn is_judged(&self) -> bool {
        !matches!(self.test, Test::Measured(_, ClaimBound::About(_) | ClaimBound::Nothing))
    }

    /// The measurement, if the claim has one.
    pub fn ours(&self) -> Option<Measured> {
        match self.test {
            Test::Measured(ours, _) | Test::Furthest(ours, ..) => Some(ours),
            Test::Sure(_) => None,
        }
    }

    /// The bound of the measurement.
    pub fn bound(&self) -> ClaimBound {
        match self.test {
            Test::Measured(_, bound) => bound,
            Test::Furthest(_, expected, _) => ClaimBound::Is(expected),
            Test::Sure(_) => ClaimBound::Nothing,
        }
    }

    /// The standard errors from the claimed number, if the claim is one number and chance has a part.
    pub fn z(&self) -> Option<f64> {
        let ours = self.ours().filter(|ours| ours.standard_error > 0.0)?;
        match self.bound() {
            ClaimBound::Is(expected) | ClaimBound::About(expected) => Some(ours.z(expected)),
            _ => None,
        }
    }

    /// The measurement over the claimed number, if the claim is one number.
    pub fn ratio(&self) -> Option<f64> {
        match self.bound() {
            ClaimBound::Is(x)
            | ClaimBound::AtMost(x)
            | ClaimBound::AtLeast(x)
            | ClaimBound::ClearlyBelow(x)
            | ClaimBound::About(x) => Some(self.ours()?.value / x),
            ClaimBound::Between(..) | ClaimBound::Nothing => None,
        }
    }

    /// The claim in words, with its numbers.
    pub fn sentence(&self) -> String {
        let Some(ours) = self.ours() else { return self.label.clone() };
        let bound = match self.bound() {
            ClaimBound::Is(x) => format!(", expected {}", number(x)),
            ClaimBound::AtMost(x) => format!(", at most {}", number(x)),
            ClaimBound::AtLeast(x) => format!(", at least {}", number(x)),
            ClaimBound::Between(low, high) => format!(", between {} and {}", number(low), number(high)),
            ClaimBound::ClearlyBelow(x) => format!(", clearly below {}", number(x)),
            ClaimBound::About(x) => format!(", about {}", number(x)),
            ClaimBound::Nothing => String::new(),
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
        assert!((ClaimJudge::of_all(0.05, 1, 100).limit - 1.9842).abs() < 1e-4);
    }

    #[test]
    fn many_claims_are_judged_more_mildly_so_that_all_hold_together() {
        let judge = ClaimJudge::of_all(1e-3, 100, 100);
        // The normal deviate of 10⁻⁵, two-sided, is 4.417; that of t is a little more.
        assert!((4.417..4.8).contains(&judge.limit), "{judge:?}");
    }

    #[test]
    fn verdicts_know_their_side() {
        let judge = ClaimJudge { limit: 4.0, ..ClaimJudge::EACH };
        let verdict = |bound| judge.verdict(&Claim::of("", ABOUT_ONE, bound));
        assert_eq!(verdict(ClaimBound::Is(1.39)), ClaimVerdict::Agrees);
        assert_eq!(verdict(ClaimBound::Is(1.41)), ClaimVerdict::Differs);
        assert_eq!(verdict(ClaimBound::AtMost(0.59)), ClaimVerdict::Differs);
        assert_eq!(verdict(ClaimBound::AtMost(0.61)), ClaimVerdict::Agrees);
        assert_eq!(verdict(ClaimBound::AtLeast(1.41)), ClaimVerdict::Differs);
        assert_eq!(verdict(ClaimBound::Between(1.41, 2.0)), ClaimVerdict::Differs);
        assert_eq!(verdict(ClaimBound::ClearlyBelow(1.49)), ClaimVerdict::Differs);
        assert_eq!(verdict(ClaimBound::ClearlyBelow(1.51)), ClaimVerdict::Agrees);
        assert_eq!(verdict(ClaimBound::About(9.0)), ClaimVerdict::Shown);
        assert_eq!(Claim::of("", ABOUT_ONE, ClaimBound::About(2.0)).ratio(), Some(0.5));
    }

    #[test]
    fn claims_allow_for_chance_only() {
        let ClaimJudge { limit, false_alarm, .. } = ClaimJudge::EACH;
        assert!(stats::student_quantile(1.0 - 0.5 * false_alarm, 19) <= limit);
        let holds = |ours, expected| ClaimJudge::EACH.passes(&Claim::of("", ours, ClaimBound::Is(expected)));
        assert!(holds(ABOUT_ONE, 1.6) && !holds(ABOUT_ONE, 1.8));
        let certain = Measured { value: 1.0, standard_error: 0.0 };
        assert!(holds(certain, 1.0 + 1e-10) && !holds(certain, 1.0 + 1e-8));
        // Student's t of 19 degrees of freedom at 1 − 2·10⁻⁸ is 8.80.
        let among = |expected| ClaimJudge::EACH.passes(&Claim::furthest("", ABOUT_ONE, expected, 30, 20));
        assert!(among(1.87) && !among(1.89));
        assert!(!ClaimJudge::EACH.passes(&Claim::sure("", false)));
    }
}
