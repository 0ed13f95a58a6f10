//! What an experiment came to, and whether that is what it should be.

use report::{Chart, Point};
use stats::Measured;

/// What a row is held to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Claim {
    /// It is this, but for chance.
    Is(f64),
    /// It is no more than this, but for chance.
    AtMost(f64),
    /// It is no less than this, but for chance.
    AtLeast(f64),
    /// It lies between both, but for chance.
    Between(f64, f64),
    /// Theory says this, only nearly: nothing is judged.
    About(f64),
    /// Nothing.
    Nothing,
}

/// A number of ours beside theirs.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// What it is.
    pub label: String,
    /// Ours, with its standard error; 0 where nothing is left to chance.
    pub ours: Measured,
    /// What was measured when it was published.
    pub published: Option<f64>,
    /// What theory says.
    pub claim: Claim,
}

/// How a row does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// As claimed.
    Agrees,
    /// Not by chance.
    Differs,
    /// Nothing was claimed.
    Shown,
}

/// What belongs to one chapter.
#[derive(Clone, Debug, Default)]
pub struct Findings {
    /// What was published, in a sentence or two.
    pub published: String,
    /// What was done here.
    pub experiment: String,
    /// The numbers.
    pub rows: Vec<Row>,
    /// What is to be learnt from them, a paragraph each.
    pub remarks: Vec<String>,
    /// The drawings.
    pub figures: Vec<Figure>,
}

/// A drawing or picture.
#[derive(Clone, Debug)]
pub struct Figure {
    /// The name of its file.
    pub file: String,
    /// What it shows.
    pub caption: String,
    /// What is in its file.
    pub content: Vec<u8>,
}

/// Standard errors are told by so many runs at least (but where theory gives them).
pub const FEWEST_RUNS: usize = 100;

/// Judges rows such that all verdicts together raise a false alarm with a probability that is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judge {
    /// The |z| that no row may exceed.
    pub limit: f64,
}

impl Judge {
    /// A false alarm among `claims` independent claims has this probability (Šidák 1967): each may raise one with
    /// 1 − (1 − p)^(1/m). Dependent claims raise fewer, as do those whose standard errors are better known than by
    /// [`FEWEST_RUNS`] runs.
    pub fn new(false_alarm: f64, claims: usize) -> Self {
        let each = -((-false_alarm).ln_1p() / claims.max(1) as f64).exp_m1();
        Judge { limit: stats::student_quantile(1.0 - 0.5 * each, FEWEST_RUNS as u64 - 1) }
    }

    /// How a row does.
    pub fn verdict(self, row: &Row) -> Verdict {
        let Measured { value, standard_error } = row.ours;
        let slack = self.limit * standard_error;
        let agrees = match row.claim {
            Claim::Is(expected) => (value - expected).abs() <= slack,
            Claim::AtMost(most) => value <= most + slack,
            Claim::AtLeast(least) => value >= least - slack,
            Claim::Between(low, high) => value >= low - slack && value <= high + slack,
            Claim::About(_) | Claim::Nothing => return Verdict::Shown,
        };
        if agrees { Verdict::Agrees } else { Verdict::Differs }
    }
}

impl Row {
    /// A row that was not published as a number.
    pub fn new(label: impl Into<String>, ours: Measured, claim: Claim) -> Self {
        Row { label: label.into(), ours, published: None, claim }
    }

    /// The same with what was published.
    pub fn published(self, published: f64) -> Self {
        Row { published: Some(published), ..self }
    }

    /// Whether a verdict is asked for.
    pub fn is_judged(&self) -> bool {
        !matches!(self.claim, Claim::About(_) | Claim::Nothing)
    }

    /// Standard errors from what is claimed, where that is one number and chance has a part.
    pub fn z(&self) -> Option<f64> {
        match self.claim {
            Claim::Is(expected) | Claim::About(expected) if self.ours.standard_error > 0.0 => {
                Some(self.ours.z(expected))
            }
            _ => None,
        }
    }

    /// Ours over what is claimed, where that is one number.
    pub fn ratio(&self) -> Option<f64> {
        match self.claim {
            Claim::Is(x) | Claim::AtMost(x) | Claim::AtLeast(x) | Claim::About(x) => {
                Some(self.ours.value / x)
            }
            Claim::Between(..) | Claim::Nothing => None,
        }
    }
}

impl Figure {
    /// A chart as SVG.
    pub fn chart(file: &str, caption: impl Into<String>, chart: &Chart) -> Self {
        Figure { file: file.into(), caption: caption.into(), content: chart.svg().into_bytes() }
    }
}

/// A point of a chart, with its error bar.
pub fn point(x: f64, y: Measured) -> Point {
    Point { x, y: y.value, error: y.standard_error }
}

/// A number that no chance has a part in.
pub fn counted(value: f64) -> Measured {
    Measured { value, standard_error: 0.0 }
}

/// The quotient of two independent numbers, neither of them near 0.
pub fn quotient(a: Measured, b: Measured) -> Measured {
    let value = a.value / b.value;
    let relative = (a.standard_error / a.value).hypot(b.standard_error / b.value);
    Measured { value, standard_error: value.abs() * relative }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Student's t of 99 degrees of freedom (tabulated: 1.9842 at 5 %, two-sided).
    #[test]
    fn a_single_claim_at_five_percent_is_judged_at_1_98() {
        assert!((Judge::new(0.05, 1).limit - 1.9842).abs() < 1e-4);
    }

    #[test]
    fn many_claims_are_judged_more_mildly_so_that_all_hold_together() {
        let judge = Judge::new(1e-3, 100);
        // The normal deviate of 10⁻⁵, two-sided, is 4.417; that of t is a little more.
        assert!((4.417..4.8).contains(&judge.limit), "{judge:?}");
    }

    #[test]
    fn verdicts_know_their_side() {
        let judge = Judge { limit: 4.0 };
        let row = |claim| Row::new("", Measured { value: 1.0, standard_error: 0.1 }, claim);
        assert_eq!(judge.verdict(&row(Claim::Is(1.39))), Verdict::Agrees);
        assert_eq!(judge.verdict(&row(Claim::Is(1.41))), Verdict::Differs);
        assert_eq!(judge.verdict(&row(Claim::AtMost(0.59))), Verdict::Differs);
        assert_eq!(judge.verdict(&row(Claim::AtMost(0.61))), Verdict::Agrees);
        assert_eq!(judge.verdict(&row(Claim::AtLeast(1.41))), Verdict::Differs);
        assert_eq!(judge.verdict(&row(Claim::Between(1.41, 2.0))), Verdict::Differs);
        assert_eq!(judge.verdict(&row(Claim::About(9.0))), Verdict::Shown);
        assert_eq!(row(Claim::About(2.0)).ratio(), Some(0.5));
    }
}
